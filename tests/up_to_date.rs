//! Fingerprints of images: what changes them, what does not, and when files of an earlier run are kept.

mod gltf_support;
mod obj_support;
#[path = "up_to_date/stopping.rs"]
mod stopping;

use gltf_support::{Sample, png};
use prt::batch::content::{Content, HashCache, hash_sources};
use prt::batch::fingerprint::{CameraOrigin, Fingerprint, Wanted};
use prt::batch::job::CameraChoice;
use prt::batch::names::NameTemplate;
use prt::batch::report::{self, ImageReport, Status};
use prt::batch::up_to_date::{Why, check};
use prt::batch::{CameraSource, EnvironmentOrigin, FileSettings, PictureSize, View};
use prt::color::{Exposure, ToneCurve};
use prt::image::exr::{ExrCompression, ExrSamples};
use prt::load::{LoadOptions, load, obj::ObjUp};
use prt::render::{AccelChoice, CropWindow, DefaultLight, Filter, FilterShape};
use prt::scene::Scene;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

/// A scene in a folder of its own, how it is to be rendered, and a folder with what was rendered. Pictures are stand-ins:
/// what is in them does not matter here.
struct Shot {
    dir: TempDir,
    input: &'static str,
    origin: CameraOrigin,
    environment: Option<EnvironmentOrigin>,
    camera: usize,
    settings: FileSettings,
    batch_time_limit: Option<Duration>,
    /// Samples that it had when its sampling ended, and what ended it; `None`: all that were asked for.
    ended: Option<(u32, &'static str)>,
}

impl Shot {
    /// Of the file `input` that `write` puts into the folder.
    fn new(input: &'static str, write: impl FnOnce(&Path)) -> Self {
        let dir = TempDir::new().unwrap();
        fs::create_dir_all(dir.path().join("scene")).unwrap();
        write(&dir.path().join("scene"));
        Self {
            dir,
            input,
            origin: CameraOrigin::Input,
            environment: None,
            camera: 0,
            settings: FileSettings { size: PictureSize::Width(64), ..FileSettings::default() },
            batch_time_limit: None,
            ended: None,
        }
    }

    /// Of a glTF file with a buffer and a picture beside it.
    fn gltf() -> Self {
        Self::new("scene.gltf", |dir| {
            let sample = Sample::new().set("/images/0", json!({"uri": "textures/wood%20dark.png"}));
            sample.write(dir);
            fs::create_dir(dir.join("textures")).unwrap();
            fs::write(dir.join("textures/wood dark.png"), png(&[255, 0, 0, 255, 0, 255, 0, 255], 2, 1)).unwrap();
        })
    }

    /// Of an OBJ whose MTL names one picture that is there and one that is not.
    fn obj() -> Self {
        let mtl = "map_Kd wood.png\nmap_Ke lost\\glow.png\n";
        let files = obj_support::with_mtl(mtl, &[("wood.png", &png(&[9; 16], 2, 2))]);
        Self::new("m.obj", |dir| {
            for name in ["m.obj", "m.mtl", "wood.png"] {
                fs::copy(files.path(name), dir.join(name)).unwrap();
            }
        })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join("scene").join(name)
    }

    fn out(&self, extension: &str) -> PathBuf {
        self.dir.path().join("a.b.").with_extension(extension)
    }

    fn scene(&self) -> Scene {
        load(&self.path(self.input), &self.settings.load).unwrap().0
    }

    fn with_wanted<T>(&self, take: impl FnOnce(&Wanted) -> T) -> T {
        take(&Wanted {
            input: &self.path(self.input),
            settings: &self.settings,
            origin: &self.origin,
            environment: self.environment.as_ref(),
            camera: self.camera,
            frame: None,
            batch_time_limit: self.batch_time_limit,
        })
    }

    /// Of what is there now.
    fn fingerprint(&self) -> Fingerprint {
        let inputs = hash_sources(&self.scene().sources, &HashCache::default()).unwrap();
        let spp = self.ended.map_or(self.settings.render.spp, |(spp, _)| spp);
        self.with_wanted(|wanted| Fingerprint::new(wanted, inputs, spp, None))
    }

    /// Writes files as a run would.
    fn render(&self) -> Fingerprint {
        let mut fingerprint = self.fingerprint();
        for (kind, is_wanted) in [("exr", self.settings.files.exr), ("png", self.settings.files.png)] {
            if is_wanted {
                let bytes = format!("the {kind} of {}", fingerprint.pixels).into_bytes();
                fs::write(self.out(kind), &bytes).unwrap();
                fingerprint.add_output(kind, &bytes);
            }
        }
        let report = ImageReport {
            status: Status::Rendered,
            stopped_by: Some(self.ended.map_or("spp", |(_, by)| by).into()),
            fingerprint: Some(fingerprint.clone()),
            ..ImageReport::default()
        };
        fs::write(self.out("json"), report::to_json(&report)).unwrap();
        fingerprint
    }

    fn write_json(&self, json: &Value) {
        fs::write(self.out("json"), json.to_string()).unwrap();
    }

    fn json(&self) -> Value {
        serde_json::from_slice(&fs::read(self.out("json")).unwrap()).unwrap()
    }

    /// Changes the JSON at a pointer.
    fn edit_json(&self, pointer: &str, value: Value) {
        let mut json = self.json();
        *json.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer} exists")) = value;
        self.write_json(&json);
    }

    fn check(&self) -> Result<(), Why> {
        self.with_wanted(|wanted| check(&self.out("json"), wanted, &HashCache::default())).map(|_| ())
    }

    /// Why it is not up to date.
    #[track_caller]
    fn why(&self) -> String {
        self.check().expect_err("must not be up to date").to_string()
    }

    /// Rendered, so that it is up to date.
    #[track_caller]
    fn rendered(self) -> Self {
        self.render();
        self.check().expect("is up to date");
        self
    }
}

/// Changes one byte, and nothing else.
fn flip(path: &Path, at: usize) {
    let mut bytes = fs::read(path).unwrap();
    bytes[at] ^= 1;
    fs::write(path, bytes).unwrap();
}

fn names(scene: &Scene) -> Vec<(&str, bool)> {
    scene.sources.iter().map(|s| (s.name.as_str(), s.stamp.is_some())).collect()
}

#[test]
fn a_scene_says_which_files_it_was_made_from_in_order_and_once_each() {
    let shot = Shot::gltf();
    let scene = shot.scene();
    assert_eq!(names(&scene), [("", true), ("scene.bin", true), ("textures/wood dark.png", true)]);
    assert_eq!(scene.sources[0].path, shot.path("scene.gltf"));
    assert_eq!(scene.sources[2].path, shot.path("textures/wood dark.png").canonicalize().unwrap());

    let scene = Shot::obj().scene();
    let looked_for = [("lost/glow.png", false), ("glow.png", false)];
    let found = [("", true), ("m.mtl", true), ("wood.png", true)];
    assert_eq!(names(&scene), [&found[..], &looked_for].concat());

    // What is inside of a file is a part of that file.
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("a.glb");
    fs::write(&path, Sample::new().glb()).unwrap();
    assert_eq!(names(&load(&path, &LoadOptions::default()).unwrap().0), [("", true)]);
}

#[test]
fn equal_inputs_in_another_folder_have_the_same_fingerprint_but_for_their_paths() {
    for (a, b) in [(Shot::gltf(), Shot::gltf()), (Shot::obj(), Shot::obj())] {
        let (a, b) = (a.fingerprint(), b.fingerprint());
        assert_eq!((&a.pixels, &a.files, &a.settings), (&b.pixels, &b.files, &b.settings));
        assert_ne!(a.inputs, b.inputs, "the paths are for people");
        assert_eq!(a.pixels.len(), 64);
        assert_ne!(a.pixels, a.files);
    }
}

#[test]
fn one_byte_in_any_file_changes_the_fingerprint() {
    // What is hit stays readable, but for the glTF's picture.
    let digit = fs::read_to_string(Shot::gltf().path("scene.gltf")).unwrap().find("0.7").unwrap() + 2;
    let gltf =
        [("scene.gltf", digit), ("scene.bin", 0), ("textures/wood dark.png", 40)].map(|(n, at)| (Shot::gltf(), n, at));
    let obj = [("m.obj", 15), ("m.mtl", 7), ("wood.png", 50)].map(|(name, at)| (Shot::obj(), name, at));
    for (shot, name, at) in gltf.into_iter().chain(obj) {
        let shot = shot.rendered();
        flip(&shot.path(name), at);
        assert!(shot.why().ends_with(&format!("{name} changed")), "{}", shot.why());
        // A picture that is damaged thereby has no scene.
        if !name.ends_with("dark.png") {
            let before: Fingerprint = serde_json::from_value(shot.json()["fingerprint"].clone()).unwrap();
            assert_ne!(shot.fingerprint().pixels, before.pixels, "{name}");
        }
    }
}

#[test]
fn a_missing_file_that_appears_and_one_that_goes_change_the_fingerprint() {
    for (name, reported) in [("lost/glow.png", "lost/glow.png"), ("glow.png", "glow.png")] {
        let shot = Shot::obj().rendered();
        let before = shot.fingerprint();
        fs::create_dir_all(shot.path("lost")).unwrap();
        shot.check().expect("the folder alone is nothing");
        fs::write(shot.path(name), png(&[9; 4], 1, 1)).unwrap();
        assert_ne!(shot.fingerprint().pixels, before.pixels);
        assert_eq!(shot.why(), format!("{reported} was not there before"));
    }
    let shot = Shot::obj().rendered();
    fs::remove_file(shot.path("wood.png")).unwrap();
    assert_eq!(shot.why(), "wood.png is missing");
    fs::create_dir(shot.path("wood.png")).unwrap();
    assert_eq!(shot.why(), "wood.png is missing");
}

#[test]
fn files_that_are_not_of_the_scene_do_not_matter() {
    let shot = Shot::gltf().rendered();
    fs::write(shot.path("scene2.bin"), "").unwrap();
    fs::write(shot.path("textures/other.png"), "").unwrap();
    shot.check().expect("is up to date");
}

type Edit = fn(&mut Shot);

/// What matters of both formats, by the option that is named then.
const MATTERS: [(&str, Edit); 22] = [
    ("size 64 wide -> 65 wide", |s| s.settings.size = PictureSize::Width(65)),
    ("size 64 wide -> 64x36", |s| s.settings.size = PictureSize::Exact(64, 36)),
    ("camera 0 -> 1", |s| s.camera = 1),
    ("crop whole -> 1,2,3,4", |s| s.settings.render.crop = Some(CropWindow { x: 1, y: 2, width: 3, height: 4 })),
    ("spp 64 -> 128", |s| s.settings.render.spp = 128),
    ("seed 0 -> 18446744073709551615", |s| s.settings.render.seed = u64::MAX),
    ("frame 0 -> 1", |s| s.settings.render.frame = 1),
    ("max-bounces unlimited -> 0", |s| s.settings.render.max_bounces = Some(0)),
    ("cull-backfaces off -> on", |s| s.settings.render.cull_backfaces = true),
    ("clamp none -> 2.5", |s| s.settings.render.clamp = Some(2.5)),
    ("texture-lod none -> on", |s| s.settings.render.texture_lod = true),
    ("light-radius none -> 0.25", |s| s.settings.render.light_radius = 0.25),
    ("sun-angle none -> 0.53", |s| s.settings.render.sun_angle = 0.53),
    ("filter tent:2 -> box:2", |s| s.settings.render.filter = Filter { shape: FilterShape::Box, width: 2.0 }),
    ("filter tent:2 -> tent:2.0000002", |s| {
        s.settings.render.filter = Filter { shape: FilterShape::Tent, width: 2.0_f32.next_up() }
    }),
    ("default-light auto -> off", |s| s.settings.render.default_light = DefaultLight::Off),
    ("accel auto -> bvh", |s| s.settings.render.accel = AccelChoice::Bvh),
    ("scene default -> 0", |s| s.settings.load.scene = Some("0".into())),
    ("eye none -> 0,0,5", |s| s.origin = CameraOrigin::View(VIEW)),
    ("camera-from none -> ", |s| s.origin = camera_file(s, b"one")),
    ("env none -> 3 bytes, ", |s| s.environment = Some(environment(0.0, 1.0))),
    ("yfov none -> 40", |s| s.origin = CameraOrigin::View(VIEW)),
];

/// Of OBJ alone.
const MATTERS_TO_OBJ: [(&str, Edit); 3] = [
    ("obj-up y -> z", |s| s.settings.load.obj_up = ObjUp::Z),
    ("obj-scale 1 -> 0.01", |s| s.settings.load.obj_scale = Some(0.01)),
    ("smooth-angle off -> 30", |s| s.settings.load.smooth_angle = Some(30.0)),
];

/// What does not change a pixel.
const DOES_NOT: [Edit; 10] = [
    |s| s.settings.name = Some(NameTemplate::parse("{stem}-x").unwrap()),
    |s| s.settings.cameras = CameraChoice::Index(0),
    |s| s.settings.render.threads = Some(7),
    |s| s.settings.render.lanes = Some(1),
    |s| s.settings.render.embree_dirs = vec!["elsewhere".into()],
    |s| (s.settings.render.width, s.settings.render.height) = (1, 1),
    |s| s.settings.load.asset_root = Some(s.dir.path().to_owned()),
    |s| s.settings.load.obj_scale = s.settings.load.obj_scale.or(s.input.ends_with("obj").then_some(1.0)),
    |s| s.settings.files.png = false,
    |s| (s.settings.files.png, s.settings.files.exr) = (false, false),
];

const VIEW: View =
    View { eye: glam::DVec3::new(0.0, 0.0, 5.0), look_at: glam::DVec3::ZERO, up: glam::DVec3::Y, yfov: 40.0 };

fn environment(rotate: f64, scale: f64) -> EnvironmentOrigin {
    EnvironmentOrigin { content: Content::of(b"sky"), rotate, scale }
}

/// The cameras of a file that differs from others by `mark`.
fn camera_file(shot: &Shot, mark: &[u8]) -> CameraOrigin {
    let path = shot.dir.path().join("cameras.gltf");
    let sample = Sample::new().set("/asset/copyright", json!(String::from_utf8_lossy(mark)));
    fs::write(&path, sample.json.to_string()).unwrap();
    let (cameras, origin) = CameraOrigin::read(&CameraSource::File(path), &HashCache::default()).unwrap();
    assert_eq!(cameras.unwrap().len(), 1);
    origin
}

#[test]
fn every_setting_that_matters_changes_the_fingerprint_and_is_named() {
    for make in [Shot::gltf as fn() -> Shot, Shot::obj] {
        let mut shot = make().rendered();
        let before = shot.fingerprint();
        let of_obj = if shot.input == "m.obj" { &MATTERS_TO_OBJ[..] } else { &[] };
        for (says, edit) in MATTERS.iter().chain(of_obj) {
            let settings = shot.settings.clone();
            edit(&mut shot);
            let after = shot.fingerprint();
            assert!(after.pixels != before.pixels && after.files != before.files, "{says}");
            // Several settings may have changed; the first in the alphabet is named.
            let key = says.split(' ').next().unwrap();
            assert_ne!(after.settings.get(key), before.settings.get(key));
            let expected = if key == "yfov" { "eye none" } else { says };
            assert!(shot.why().starts_with(&format!("settings changed: {expected}")), "{says}: {}", shot.why());
            (shot.settings, shot.camera, shot.origin) = (settings, 0, CameraOrigin::Input);
            shot.environment = None;
        }
        shot.check().expect("as it was");
    }
}

#[test]
fn what_changes_no_pixel_keeps_the_files() {
    for make in [Shot::gltf as fn() -> Shot, Shot::obj] {
        let mut shot = make().rendered();
        let before = shot.fingerprint();
        for edit in DOES_NOT {
            edit(&mut shot);
            assert_eq!(shot.fingerprint().pixels, before.pixels);
            shot.check().expect("is up to date");
        }
    }
    // Options of OBJ are nothing to glTF.
    let mut shot = Shot::gltf().rendered();
    for (_, edit) in MATTERS_TO_OBJ {
        edit(&mut shot);
        shot.check().expect("is up to date");
    }
}

#[test]
fn how_files_are_made_of_pixels_changes_their_hash_alone() {
    let edits: [(&str, Edit); 5] = [
        ("exposure 0 -> 1.5", |s| s.settings.files.tone.exposure = Exposure::Stops(1.5)),
        ("exposure 0 -> auto", |s| s.settings.files.tone.exposure = Exposure::Auto),
        ("tonemap neutral -> srgb", |s| s.settings.files.tone.curve = ToneCurve::Srgb),
        ("exr float -> half", |s| s.settings.files.format.samples = ExrSamples::Half),
        ("exr-compression zip -> piz", |s| s.settings.files.format.compression = ExrCompression::Piz),
    ];
    for (says, edit) in edits {
        let mut shot = Shot::gltf().rendered();
        let before = shot.fingerprint();
        edit(&mut shot);
        let after = shot.fingerprint();
        assert_eq!(after.pixels, before.pixels, "{says}");
        assert_ne!(after.files, before.files, "{says}");
        assert_eq!(shot.why(), format!("settings changed: {says}"));
    }
    // The curve is nothing to a run without a PNG.
    let mut shot = Shot::gltf();
    shot.settings.files.png = false;
    let mut shot = shot.rendered();
    shot.settings.files.tone.exposure = Exposure::Stops(1.0);
    shot.check().expect("is up to date");
    shot.settings.files.png = true;
    assert_eq!(shot.why(), "no png was asked for the last time");
}

#[test]
fn the_bytes_of_the_cameras_file_matter_and_not_its_path() {
    let mut shot = Shot::gltf();
    shot.origin = camera_file(&shot, b"one");
    let mut shot = shot.rendered();
    shot.origin = camera_file(&Shot::gltf(), b"one");
    shot.check().expect("the same bytes elsewhere");
    shot.origin = camera_file(&shot, b"two");
    assert!(shot.why().starts_with("settings changed: camera-from"), "{}", shot.why());
}

#[test]
fn outputs_that_are_not_whole_are_found() {
    type Damage = fn(&Path);
    let damage: [(&str, Damage); 4] = [
        ("is missing", |path| fs::remove_file(path).unwrap()),
        ("is damaged or was edited", |path| fs::write(path, &fs::read(path).unwrap()[1..]).unwrap()),
        ("is damaged or was edited", |path| flip(path, 3)),
        ("is missing", |path| {
            fs::remove_file(path).unwrap();
            fs::create_dir(path).unwrap();
        }),
    ];
    for kind in ["exr", "png"] {
        for (says, damage) in damage {
            let mut shot = Shot::gltf().rendered();
            damage(&shot.out(kind));
            assert_eq!(shot.why(), format!("{} {says}", shot.out(kind).display()));
            // One that is not asked for is not looked at.
            (shot.settings.files.exr, shot.settings.files.png) = (kind != "exr", kind != "png");
            shot.check().expect("is up to date");
        }
    }
}

#[test]
fn a_record_that_is_none_means_rendering_and_nothing_worse() {
    let shot = Shot::gltf();
    assert_eq!(shot.check(), Err(Why::New));
    let shot = shot.rendered();
    let json = fs::read(shot.out("json")).unwrap();
    let no_record = Err(Why::NoRecord(shot.out("json")));
    let deep = format!("{{\"fingerprint\": {}", "[".repeat(1 << 20));
    for text in [&b""[..], b"{}", b"[1, 2]", b"\xff\xfe", &json[..json.len() / 2], deep.as_bytes()] {
        fs::write(shot.out("json"), text).unwrap();
        assert_eq!(shot.check(), no_record, "{}", String::from_utf8_lossy(&text[..text.len().min(40)]));
    }
    // As long as it says, but with holes: never read.
    fs::File::create(shot.out("json")).unwrap().set_len(1 << 40).unwrap();
    assert_eq!(shot.check(), no_record);
    fs::remove_file(shot.out("json")).unwrap();
    fs::create_dir(shot.out("json")).unwrap();
    assert_eq!(shot.check(), no_record);
}

#[test]
fn records_of_other_runs_versions_and_hands_do_not_count() {
    let edits: [(&str, &str, Value); 8] = [
        ("/status", "the last run failed", json!("failed")),
        ("/status", "the last run was interrupted", json!("interrupted")),
        ("/fingerprint", "the last run could not record what it was made from", Value::Null),
        ("/fingerprint/prt", "rendered by version 0.0.1", json!("0.0.1")),
        ("/fingerprint/pixels", "a.b.json contradicts itself", json!("0".repeat(64))),
        ("/fingerprint/files", "a.b.json contradicts itself", json!("")),
        ("/fingerprint/inputs", "scene.gltf is missing", json!([])),
        ("/fingerprint/outputs", "no exr was asked for the last time", json!([])),
    ];
    for (pointer, says, value) in edits {
        let shot = Shot::gltf().rendered();
        shot.edit_json(pointer, value);
        assert!(shot.why().ends_with(says), "{pointer}: {}", shot.why());
    }
    // Files that are listed and are not of the scene: not up to date, whatever they hold.
    for name in ["../../etc/passwd", "/etc/passwd", "..", "x\0y", "textures"] {
        let shot = Shot::gltf().rendered();
        shot.edit_json("/fingerprint/inputs/1/name", json!(name));
        assert_eq!(shot.why(), format!("{name} is missing"));
    }
    // One that was rendered before and then found up to date is as good as rendered.
    let shot = Shot::gltf().rendered();
    shot.edit_json("/status", json!("up-to-date"));
    shot.check().expect("is up to date");
}

#[cfg(unix)]
#[test]
fn a_pipe_in_a_files_place_does_not_block() {
    let make_pipe = |path: &Path| {
        fs::remove_file(path).unwrap();
        let status = std::process::Command::new("mkfifo").arg(path).status();
        status.is_ok_and(|status| status.success())
    };
    let shot = Shot::gltf().rendered();
    if !make_pipe(&shot.path("scene.bin")) {
        println!("skipped: there is no mkfifo here");
        return;
    }
    assert_eq!(shot.why(), "scene.bin is missing");
    for kind in ["exr", "json"] {
        let shot = Shot::gltf().rendered();
        assert!(make_pipe(&shot.out(kind)));
        assert!(shot.check().is_err());
    }
}

#[test]
fn an_asset_root_that_lets_a_file_in_which_was_refused_means_rendering() {
    let mut shot = Shot::obj();
    fs::write(shot.path("m.mtl"), "newmtl a\nmap_Kd ../out.png\n").unwrap();
    fs::write(shot.dir.path().join("out.png"), png(&[9; 4], 1, 1)).unwrap();
    let narrow = shot.render();
    shot.check().expect("it is refused again");
    shot.settings.load.asset_root = Some(shot.dir.path().to_owned());
    assert_eq!(shot.why(), "../out.png was not there before");
    let wide = shot.render();
    assert_ne!(wide.pixels, narrow.pixels);
    shot.check().expect("is up to date");
    shot.settings.load.asset_root = None;
    assert_eq!(shot.why(), "../out.png is missing");
}

#[test]
fn a_file_that_changes_while_the_scene_is_made_gives_no_fingerprint() {
    let shot = Shot::gltf();
    let scene = shot.scene();
    // As long as before: only the stamp tells.
    flip(&shot.path("scene.bin"), 0);
    let changed = hash_sources(&scene.sources, &HashCache::default()).unwrap_err();
    let path = shot.path("scene.bin").canonicalize().unwrap();
    assert_eq!(changed.to_string(), format!("{}: changed while it was read", path.display()));
}

#[test]
fn how_an_environment_is_turned_and_scaled_matters() {
    let mut shot = Shot::gltf();
    shot.environment = Some(environment(0.0, 1.0));
    let mut shot = shot.rendered();
    shot.environment = Some(environment(90.0, 1.0));
    assert_eq!(shot.why(), "settings changed: env-rotate 0 -> 90");
    shot.environment = Some(environment(0.0, 2.0));
    assert_eq!(shot.why(), "settings changed: env-scale 1 -> 2");
}
