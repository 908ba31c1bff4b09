//! `--env`, `--light-radius` and `--sun-angle` as users meet them: what they light and show, and what is said where a
//! value is none.

use prt::image::exr_read::{Picture, read};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");

/// A camera that looks along -Z, and a triangle far behind it.
fn scene() -> String {
    let mut scene: Value = serde_json::from_str(include_str!("data/triangle.gltf")).unwrap();
    scene["nodes"][0]["translation"] = json!([0.0, 0.0, 50.0]);
    scene["materials"][0]["emissiveFactor"] = json!([0.0, 0.0, 0.0]);
    scene["cameras"][0]["perspective"]["yfov"] = json!(0.02);
    scene.to_string()
}

/// A Radiance file of 64 x 32 texels, 1 nit but for 8 in the two centre columns, which are +X.
fn hdr() -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n".to_vec();
    let texel = |x: usize| if (31..=32).contains(&x) { [128, 128, 128, 132] } else { [128, 128, 128, 129] };
    bytes.extend((0..64 * 32).flat_map(|i| texel(i % 64)));
    bytes
}

fn folder() -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    fs::write(root.path().join("a.gltf"), scene()).unwrap();
    fs::write(root.path().join("sky.hdr"), hdr()).unwrap();
    root
}

fn prt_in(folder: &Path, args: &[&str]) -> Output {
    let quick = ["a.gltf", "--width", "8", "--spp", "4", "--accel", "bvh", "--progress", "none"];
    Command::new(BIN).current_dir(folder).args(quick).args(args).output().expect("the binary was built for this test")
}

/// The picture and the image's report of a run that succeeds.
#[track_caller]
fn rendered(folder: &Path, args: &[&str]) -> (Picture, Value) {
    let output = prt_in(folder, &[args, &["--json"]].concat());
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("the run's report");
    (read(&folder.join("renders/a.exr")).unwrap(), report["images"][0].clone())
}

#[track_caller]
fn all_are(picture: &Picture, radiance: f32) {
    for pixel in &picture.pixels {
        assert!(pixel.iter().all(|c| (c - radiance).abs() < 1e-4 * radiance), "{pixel:?} is not {radiance}");
    }
}

#[test]
fn it_is_seen_turned_and_scaled_and_the_studio_is_off() {
    let root = folder();
    let (picture, report) = rendered(root.path(), &["--env", "sky.hdr"]);
    all_are(&picture, 1.0);
    assert_eq!(report["default_light"]["used"], false, "{report}");
    // What was +X is -Z, where the camera looks.
    let (picture, report) = rendered(root.path(), &["--env", "sky.hdr", "--env-rotate", "90"]);
    all_are(&picture, 8.0);
    assert_eq!(report["fingerprint"]["settings"]["env-rotate"], "90");
    let turned = ["--env", "sky.hdr", "--env-rotate", "-270", "--env-scale", "0.5"];
    all_are(&rendered(root.path(), &turned).0, 4.0);
    let meta = exr::meta::MetaData::read_from_file(root.path().join("renders/a.exr"), false).unwrap();
    let light = meta.headers[0].own_attributes.other.iter().find(|(name, _)| *name == "prt:light");
    assert!(format!("{light:?}").contains("environment"), "{light:?}");
}

#[test]
fn an_exr_is_the_same_as_the_hdr_and_a_changed_file_is_rendered_again() {
    let root = folder();
    let (from_hdr, _) = rendered(root.path(), &["--env", "sky.hdr"]);
    let map = prt::image::radiance_map::decode(&hdr()).unwrap();
    let texel = |x: usize, y: usize| map.pixels[y * 64 + x].into();
    exr::prelude::write_rgb_file(root.path().join("sky.exr"), 64, 32, texel).unwrap();
    let (from_exr, report) = rendered(root.path(), &["--env", "sky.exr"]);
    assert_eq!(from_hdr, from_exr);
    assert_eq!(report["status"], "rendered", "another file is another picture");
    assert_eq!(rendered(root.path(), &["--env", "sky.exr"]).1["status"], "up-to-date");
    exr::prelude::write_rgb_file(root.path().join("sky.exr"), 64, 32, |_, _| (2.0_f32, 2.0_f32, 2.0_f32)).unwrap();
    let (picture, report) = rendered(root.path(), &["--env", "sky.exr"]);
    all_are(&picture, 2.0);
    assert_eq!(report["status"], "rendered");
}

#[test]
fn what_is_not_as_it_should_be_is_warned_of_and_what_is_none_is_a_usage_error() {
    let root = folder();
    let texel = |x: usize, _: usize| if x == 0 { (f32::INFINITY, -1.0, f32::NAN) } else { (3.0, 3.0, 3.0) };
    exr::prelude::write_rgb_file(root.path().join("sun.exr"), 8, 8, texel).unwrap();
    let (_, report) = rendered(root.path(), &["--env", "sun.exr"]);
    let warnings = report["warnings"].to_string();
    for part in
        ["--env sun.exr: 8 x 8 texels", "8 channels of texels are infinite", "16 channels of texels are negative"]
    {
        assert!(warnings.contains(part), "{part}: {warnings}");
    }
    let (picture, report) = rendered(root.path(), &["--env", "sky.hdr", "--env-scale", "0"]);
    assert!(picture.pixels.iter().flatten().all(|c| *c == 0.0), "{report}");
    fs::remove_dir_all(root.path().join("renders")).unwrap();
    for (args, says) in [
        (&["--env", "none.hdr"][..], &["--env none.hdr: cannot be read"][..]),
        (&["--env", "a.gltf"], &["--env a.gltf: is neither", "Allowed: a .hdr or .exr file"]),
        (&["--env-rotate", "90"], &["--env-rotate needs --env FILE"]),
        (&["--env-scale", "2"], &["--env-scale needs --env FILE"]),
        (&["--env", "sky.hdr", "--env-scale", "-1"], &["--env-scale", "must be a factor from 0 to 1e9"]),
        (&["--env", "sky.hdr", "--env-rotate", "inf"], &["--env-rotate", "must be degrees"]),
    ] {
        let output = prt_in(root.path(), args);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
        assert!(says.iter().all(|part| text.contains(part)), "{args:?}: {text}");
        assert!(!root.path().join("renders").exists());
    }
}

/// The same scene under a point light and a sun, which the camera does not see; it looks at the triangle from the front.
fn lit() -> String {
    let mut scene: Value = serde_json::from_str(&scene()).unwrap();
    scene["nodes"][0]["translation"] = json!([0.0, 0.0, -5.0]);
    scene["cameras"][0]["perspective"]["yfov"] = json!(0.001);
    scene["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    scene["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "point", "intensity": 40.0 }, { "type": "directional", "intensity": 2.0 }
    ] } });
    for light in 0..2 {
        let node = json!({ "extensions": { "KHR_lights_punctual": { "light": light } } });
        scene["nodes"].as_array_mut().unwrap().push(node);
        // After the triangle's and the camera's.
        scene["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(2 + light));
    }
    scene.to_string()
}

#[test]
fn lights_get_a_size_that_is_recorded_and_what_sees_all_of_them_stays_as_bright() {
    let root = tempfile::tempdir().expect("a temporary folder");
    fs::write(root.path().join("a.gltf"), lit()).unwrap();
    let mean = |picture: &Picture| {
        let sum: f64 = picture.pixels.iter().flatten().map(|c| f64::from(*c)).sum();
        sum / (3 * picture.pixels.len()) as f64
    };
    let (small, report) = rendered(root.path(), &[]);
    assert!(report["fingerprint"]["settings"]["light-radius"].is_null() && mean(&small) > 0.0);
    let sized = ["--light-radius", "0.5", "--sun-angle", "20"];
    let (large, report) = rendered(root.path(), &sized);
    assert_eq!(report["fingerprint"]["settings"]["light-radius"], "0.5");
    assert_eq!(report["fingerprint"]["settings"]["sun-angle"], "20");
    // Few samples, and a highlight that is spread; `verify light` has the exact values.
    assert!((mean(&large) / mean(&small) - 1.0).abs() < 0.03, "{} and {}", mean(&large), mean(&small));
    assert!(large != small);
    let meta = exr::meta::MetaData::read_from_file(root.path().join("renders/a.exr"), false).unwrap();
    for name in ["prt:lightRadius", "prt:sunAngle"] {
        assert!(meta.headers[0].own_attributes.other.iter().any(|(other, _)| *other == *name), "{name}");
    }
    fs::write(root.path().join("sizes.toml"), "light-radius = 0.5\nsun-angle = 20\n").unwrap();
    let from_config = rendered(root.path(), &["--config", "sizes.toml"]);
    assert_eq!(from_config.1["status"], "up-to-date", "the same options");
    // None again is what there was before.
    let (none, _) = rendered(root.path(), &["--light-radius", "0", "--sun-angle", "0"]);
    assert_eq!(none, small);
}
