//! `prt-batch retone` as scripts meet it, and the options of pictures that `render` shares with it.

use prt::image::exr::{ExrCamera, ExrOptions, ExrPicture, ExrProjection, encode};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::Command;

/// A scene of one emissive triangle in front of one camera; its buffer is inside the file.
const SCENE: &str = include_str!("data/triangle.gltf");

/// Exit code, stdout and stderr.
fn prt(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_prt-batch")).current_dir(folder).args(args).output();
    let output = output.expect("the binary was built for this test");
    let text = |bytes| String::from_utf8(bytes).expect("messages are UTF-8");
    (output.status.code().expect("it ends by itself"), text(output.stdout), text(output.stderr))
}

#[track_caller]
fn succeeds(folder: &Path, args: &[&str]) -> String {
    let (code, _, stderr) = prt(folder, args);
    assert_eq!(code, 0, "{args:?}: {stderr}");
    stderr
}

/// Renders the scene `name` in `folder` at 16x9 with `options`.
#[track_caller]
fn render(folder: &Path, name: &str, options: &[&str]) -> String {
    fs::write(folder.join(name), SCENE).unwrap();
    succeeds(folder, &[&[name, "--size", "16x9", "--spp", "4", "--accel", "bvh"], options].concat())
}

fn json_of(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// An EXR of `pixels` in one row.
fn exr(pixels: &[[f32; 3]]) -> Vec<u8> {
    let camera = ExrCamera {
        world_from_camera: glam::DMat4::IDENTITY,
        projection: ExrProjection::Perspective { yfov: 1.0 },
        aspect_ratio: 1.0,
    };
    let size = [pixels.len() as u32, 1];
    let picture = ExrPicture {
        display_size: size,
        origin: [0, 0],
        size,
        pixels,
        channels: Vec::new(),
        camera,
        lens: None,
        attributes: Vec::new(),
    };
    encode(&picture, ExrOptions::default()).unwrap()
}

#[test]
fn retone_writes_the_bytes_that_render_writes() {
    let root = tempfile::tempdir().unwrap();
    let tones: [&[&str]; 5] = [
        &[],
        &["--tonemap", "agx", "--exposure", "1.5"],
        &["--tonemap", "aces", "--exposure=-3"],
        &["--tonemap", "srgb", "--exposure", "auto"],
        &["--tonemap", "neutral", "--exposure", "auto"],
    ];
    let crop: &[&str] = &["--crop", "5,2,7,6"];
    for (window, name) in [(&[][..], "whole"), (crop, "part")] {
        for (index, tone) in tones.iter().enumerate() {
            let out = format!("{name}{index}");
            render(root.path(), "a.gltf", &[window, tone, &["-o", &out]].concat());
            let (exr, again) = (format!("{out}/a.exr"), format!("{out}-again"));
            succeeds(root.path(), &[&["retone", &exr, "-o", &again], *tone].concat());
            let read = |folder: &str| fs::read(root.path().join(folder).join("a.png")).unwrap();
            assert_eq!(read(&out), read(&again), "{name} {tone:?}");
            let size = image::load_from_memory(&read(&again)).unwrap();
            assert_eq!((size.width(), size.height()), if window.is_empty() { (16, 9) } else { (7, 6) });
            // And no other setting gives them.
            let (code, ..) = prt(root.path(), &["retone", &exr, "-o", &again, "--exposure", "0.25"]);
            assert!(code == 0 && read(&out) != read(&again), "{name} {tone:?}");
        }
    }
}

#[test]
fn folders_keep_their_sub_folders_and_files_go_beside_their_exr() {
    let root = tempfile::tempdir().unwrap();
    for name in ["in/a.exr", "in/deep/b c.EXR", "in/deep/ü<光>.exr"] {
        fs::create_dir_all(root.path().join(name).parent().unwrap()).unwrap();
        fs::write(root.path().join(name), exr(&[[0.25; 3], [0.5; 3]])).unwrap();
    }
    fs::write(root.path().join("in/notes.txt"), "no picture").unwrap();
    succeeds(root.path(), &["retone", "in", "--out", "out"]);
    for name in ["out/a.png", "out/deep/b c.png", "out/deep/ü<光>.png"] {
        assert!(root.path().join(name).is_file(), "{name}");
    }
    // Named twice is done once.
    let said = succeeds(root.path(), &["retone", "in/a.exr", "in/a.exr", "./in/deep/../a.exr"]);
    assert_eq!((said.lines().count(), root.path().join("in/a.png").is_file()), (1, true), "{said}");
    assert_eq!(succeeds(root.path(), &["retone", "-q", "in"]), "");
    assert!(root.path().join("in/deep/b c.png").is_file());
    let left = fs::read_dir(root.path().join("in/deep")).unwrap().count();
    assert_eq!(left, 4, "nothing but two EXRs and two PNGs");
}

#[test]
fn exit_codes_are_those_of_the_contract() {
    let root = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = root.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    file("a.exr", &exr(&[[0.25; 3]]));
    file("b/a.exr", &exr(&[[0.5; 3]]));
    file("text.exr", b"no picture");
    file("picture.png", &exr(&[[0.5; 3]]));
    fs::create_dir_all(root.path().join("empty")).unwrap();
    fs::create_dir_all(root.path().join("blocked/a.png/x")).unwrap();
    for (args, code, says) in [
        (&["retone"][..], 2, "IN"),
        (&["retone", "a.exr", "--tonemap", "filmic"], 2, "neutral, agx, aces, srgb"),
        (&["retone", "a.exr", "--exposure", "101"], 2, "auto or a number of stops from -100 to 100"),
        (&["retone", "a.exr", "b/a.exr", "-o", "out"], 2, "would both become"),
        (&["retone", "picture.png"], 2, "use --out"),
        (&["retone", "nosuch.exr"], 3, "nosuch.exr"),
        (&["retone", "text.exr"], 3, "text.exr: not a readable EXR"),
        (&["retone", "empty"], 3, "no .exr file"),
        (&["retone", "text.exr", "nosuch.exr"], 3, "text.exr"),
        (&["retone", "text.exr", "a.exr", "-o", "out"], 1, "text.exr"),
        (&["retone", "a.exr", "-o", "a.exr/below"], 4, "Nothing was written"),
        (&["retone", "a.exr", "-o", "blocked"], 4, "a.png: cannot be written"),
    ] {
        let (found, _, stderr) = prt(root.path(), args);
        assert!(found == code && stderr.contains(says), "{args:?}: {found} {stderr}");
    }
    assert!(root.path().join("out/a.png").is_file(), "one bad file does not stop the others");
}

#[test]
fn auto_exposure_is_recorded_and_typing_it_gives_the_same_bytes() {
    let root = tempfile::tempdir().unwrap();
    let said = render(root.path(), "a.gltf", &["-o", "auto", "--exposure", "auto"]);
    let exposure = json_of(&root.path().join("auto/a.json"))["exposure"].clone();
    assert_eq!(exposure["requested"], "auto");
    let used = exposure["used"].as_f64().unwrap();
    assert!(said.contains(&format!("--exposure auto is {used}")), "{said}");
    render(root.path(), "a.gltf", &["-o", "typed", &format!("--exposure={used}")]);
    let read = |folder: &str| fs::read(root.path().join(folder).join("a.png")).unwrap();
    assert_eq!(read("auto"), read("typed"));
    let typed = json_of(&root.path().join("typed/a.json"))["exposure"].clone();
    assert_eq!(typed, json!({"requested": used, "used": used}));
    render(root.path(), "a.gltf", &["-o", "none", "--no-png"]);
    assert_eq!(json_of(&root.path().join("none/a.json"))["exposure"], Value::Null);
}

#[test]
fn a_hopeless_exposure_says_which_would_help() {
    let root = tempfile::tempdir().unwrap();
    for (exposure, shade) in [("--exposure=-40", "almost black"), ("--exposure=40", "almost white")] {
        let row: Vec<_> = (1..=200).map(|i| [i as f32 * 0.01; 3]).collect();
        fs::write(root.path().join("a.exr"), exr(&row)).unwrap();
        let said = succeeds(root.path(), &["retone", "a.exr", exposure]);
        assert!(said.contains("warning: a.exr: the PNG is") && said.contains(shade), "{said}");
        let advised = said.split("--exposure ").nth(1).unwrap().split(' ').next().unwrap();
        let followed = succeeds(root.path(), &["retone", "a.exr", &format!("--exposure={advised}")]);
        assert!(!followed.contains("warning"), "{followed}");
    }
    render(root.path(), "b.gltf", &["-o", "dark", "--exposure=-40"]);
    let warnings = json_of(&root.path().join("dark/b.json"))["warnings"].to_string();
    assert!(warnings.contains("almost black"), "{warnings}");
    fs::write(root.path().join("unlit.exr"), exr(&[[0.0; 3]; 100])).unwrap();
    assert!(!succeeds(root.path(), &["retone", "unlit.exr"]).contains("--exposure"));
}

#[test]
fn half_counts_what_it_clips() {
    let root = tempfile::tempdir().unwrap();
    render(root.path(), "a.gltf", &["-o", "half", "--exr", "half"]);
    render(root.path(), "a.gltf", &["-o", "float"]);
    assert_eq!(json_of(&root.path().join("half/a.json"))["clipped_pixels"], 0);
    assert_eq!(json_of(&root.path().join("float/a.json"))["clipped_pixels"], Value::Null);
    let size = |folder: &str| fs::metadata(root.path().join(folder).join("a.exr")).unwrap().len();
    assert!(size("half") < size("float"));
    // A lamp of 100 knit.
    fs::write(root.path().join("hot.gltf"), hot_scene()).unwrap();
    let args = ["hot.gltf", "--size", "16x9", "--spp", "4", "--accel", "bvh", "--exr", "half", "-o", "hot"];
    let said = succeeds(root.path(), &args);
    let report = json_of(&root.path().join("hot/hot.json"));
    let clipped = report["clipped_pixels"].as_u64().unwrap();
    assert!(clipped > 0 && said.contains(&format!("{clipped} pixels are beyond 65504")), "{said}");
    let bytes = fs::read(root.path().join("hot/hot.exr")).unwrap();
    let biased = format!("{clipped} pixels were clipped at 65504");
    assert!(bytes.windows(biased.len()).any(|window| window == biased.as_bytes()));
    assert!(prt::image::exr_read::decode(&bytes).unwrap().pixels.iter().flatten().all(|c| *c <= 65504.0));
}

/// The scene with its light made 10^5 nits.
fn hot_scene() -> String {
    let mut scene: Value = serde_json::from_str(SCENE).unwrap();
    let material = &mut scene["materials"][0];
    material["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    material["extensions"] = json!({"KHR_materials_emissive_strength": {"emissiveStrength": 1e5}});
    scene["extensionsUsed"] = json!(["KHR_materials_emissive_strength"]);
    scene.to_string()
}
