//! Options whose effect is seen in what a run says and writes.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const SCENE: &str = include_str!("data/triangle.gltf");

fn folder() -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    fs::write(root.path().join("a.gltf"), SCENE).unwrap();
    root
}

fn prt_in(folder: &Path, args: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_prt-batch")).current_dir(folder).args(args).output().unwrap();
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("messages are UTF-8")
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

const SMALL: [&str; 7] = ["a.gltf", "--size", "16x8", "--spp", "2", "--accel", "bvh"];

#[test]
fn what_is_not_wanted_is_not_written() {
    for (options, expected) in [
        (&["--no-exr", "--no-report"][..], &["a.json", "a.png", "batch.json"][..]),
        (&["--no-png"], &["a.exr", "a.json", "batch.json", "index.html"]),
        (&["--no-png", "--no-exr"], &["a.json", "batch.json", "index.html"]),
    ] {
        let root = folder();
        prt_in(root.path(), &[&SMALL[..], options].concat());
        assert_eq!(names(&root.path().join("renders")), expected, "{options:?}");
    }
}

#[test]
fn every_pixel_filter_makes_a_picture_of_its_own() {
    let root = folder();
    let mut pictures = Vec::new();
    for filter in ["box", "tent", "gaussian", "blackman-harris", "gaussian:2", "blackman-harris:1.5"] {
        prt_in(root.path(), &[&SMALL[..], &["--filter", filter]].concat());
        let picture = fs::read(root.path().join("renders/a.exr")).unwrap();
        assert!(!pictures.contains(&picture), "{filter}");
        pictures.push(picture);
    }
    // The usual width is that of nothing said.
    prt_in(root.path(), &[&SMALL[..], &["--filter", "gaussian"]].concat());
    let output = prt_in(root.path(), &[&SMALL[..], &["--filter", "gaussian:3"]].concat());
    assert!(stderr(&output).contains("up to date"), "{}", stderr(&output));
}

#[test]
fn a_picture_that_was_not_wanted_the_last_time_is_made_now() {
    let root = folder();
    prt_in(root.path(), &[&SMALL[..], &["--no-exr"]].concat());
    let output = prt_in(root.path(), &[&SMALL[..], &["-v"]].concat());
    assert!(stderr(&output).contains("rendered again: no exr was asked for the last time"), "{}", stderr(&output));
    assert!(root.path().join("renders/a.exr").exists());
    // The other way round nothing is missing.
    let output = prt_in(root.path(), &[&SMALL[..], &["--no-exr"]].concat());
    assert!(stderr(&output).contains("up to date"), "{}", stderr(&output));
}

#[test]
fn quiet_says_nothing_and_verbose_says_where_time_went() {
    let root = folder();
    let output = prt_in(root.path(), &[&SMALL[..], &["--quiet"]].concat());
    assert_eq!((stderr(&output).as_str(), output.stdout.len()), ("", 0));
    let output = prt_in(root.path(), &[&SMALL[..], &["--verbose", "--force"]].concat());
    let text = stderr(&output);
    for part in ["load ", "render ", "write ", "1 triangle; rays: 256 camera", "1 rendered, "] {
        assert!(text.contains(part), "{part:?} in {text}");
    }
}

#[test]
fn a_settings_change_says_which_and_force_needs_none() {
    let root = folder();
    prt_in(root.path(), &SMALL);
    let again = |options: &[&str]| stderr(&prt_in(root.path(), &[&SMALL[..], &["-v"], options].concat()));
    assert!(again(&[]).contains("renders/a.exr: up to date"));
    assert!(again(&["--cull-backfaces"]).contains("settings changed: cull-backfaces off -> on"));
    assert!(again(&["--cull-backfaces", "--threads", "1"]).contains("up to date"));
    assert!(again(&["--cull-backfaces", "--force"]).contains("16x8  2 spp"));
    let exr = fs::read(root.path().join("renders/a.exr")).unwrap();
    assert!(exr.windows(13).any(|bytes| bytes == b"prt:backfaces"));
    assert!(!exr.windows(14).any(|bytes| bytes == b"prt:textureLod"));
    let changed = again(&["--cull-backfaces", "--texture-lod"]);
    assert!(changed.contains("settings changed: texture-lod none -> on"), "{changed}");
    let exr = fs::read(root.path().join("renders/a.exr")).unwrap();
    assert!(exr.windows(14).any(|bytes| bytes == b"prt:textureLod"));
}

#[test]
fn strict_names_what_was_lost_and_exits_with_1() {
    let root = folder();
    let text = "mtllib nosuch.mtl\nv -1 -1 -3\nv 1 -1 -3\nv 0 1 -3\nf 1 2 3\n";
    fs::write(root.path().join("b.obj"), text).unwrap();
    let args = ["b.obj", "--size", "8x8", "--spp", "1", "--accel", "bvh", "--strict"];
    // Rendered, then up to date: what was lost then is lost now.
    for _ in 0..2 {
        let output =
            Command::new(env!("CARGO_BIN_EXE_prt-batch")).current_dir(root.path()).args(args).output().unwrap();
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(text.contains("error: b.obj: counts as failed (--strict): ") && text.contains("nosuch.mtl"), "{text}");
    }
}

#[test]
fn the_noise_of_a_reference_is_taken_as_stated() {
    let root = folder();
    for seed in ["1", "2", "3"] {
        prt_in(root.path(), &[&SMALL[..], &["--seed", seed, "--out", seed]].concat());
    }
    let args = ["compare", "1/a.exr", "2/a.exr", "3/a.exr", "--ref-rel-se", "0.1", "--json"];
    let json: serde_json::Value = serde_json::from_slice(&prt_in(root.path(), &args).stdout).unwrap();
    assert_eq!(json["passed"], true);
    assert_eq!(json["pairs"][0]["block_test"]["seeds"], 2);
}

#[test]
fn variant_shows_other_materials_and_is_part_of_what_makes_a_picture() {
    let root = folder();
    let mut json: serde_json::Value = serde_json::from_str(SCENE).unwrap();
    let unlit = |color: [f32; 4]| {
        serde_json::json!({"pbrMetallicRoughness": {"baseColorFactor": color},
            "extensions": {"KHR_materials_unlit": {}}})
    };
    json["materials"] = serde_json::json!([unlit([1.0, 0.0, 0.0, 1.0]), unlit([0.0, 0.0, 1.0, 1.0])]);
    json["extensions"]["KHR_materials_variants"] = serde_json::json!({"variants": [{"name": "night"}]});
    let primitive = &mut json["meshes"][0]["primitives"][0];
    primitive["material"] = 0.into();
    primitive["extensions"]["KHR_materials_variants"] =
        serde_json::json!({"mappings": [{"material": 1, "variants": [0]}]});
    fs::write(root.path().join("a.gltf"), json.to_string()).unwrap();
    let exr = |options: &[&str]| {
        let output = prt_in(root.path(), &[&SMALL[..], &["-v", "--exr-compression", "none"], options].concat());
        (fs::read(root.path().join("renders/a.exr")).unwrap(), stderr(&output))
    };
    let (own, _) = exr(&[]);
    let (night, said) = exr(&["--variant", "night"]);
    assert!(said.contains("settings changed: variant"), "{said}");
    assert!(own != night);
    let args = [&SMALL[..], &["--variant", "dusk"]].concat();
    let output = Command::new(env!("CARGO_BIN_EXE_prt-batch")).current_dir(root.path()).args(args).output().unwrap();
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("there is no variant \"dusk\"") && stderr(&output).contains("Allowed: \"night\""));
}

#[test]
fn what_a_clamp_takes_is_told() {
    let room = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/reference/cornell/cornell.gltf");
    let root = folder();
    let run = |args: &[&str]| {
        let common = [room, "--size", "16x16", "--spp", "16", "--accel", "bvh", "--no-png"];
        let output = prt_in(root.path(), &[&common, args].concat());
        let text = fs::read_to_string(root.path().join("renders/cornell.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        (stderr(&output), json, fs::read(root.path().join("renders/cornell.exr")).unwrap())
    };
    let has = |exr: &[u8], text: &str| exr.windows(text.len()).any(|window| window == text.as_bytes());
    let (said, json, exr) = run(&[]);
    assert_eq!(json["energy_clamped"], 0.0);
    assert!(!said.contains("--clamp") && !has(&exr, "prt:clamp"), "{said}");
    // Another picture, not an up-to-date one.
    let (said, json, exr) = run(&["--clamp", "0.05"]);
    let taken = json["energy_clamped"].as_f64().unwrap();
    assert!(taken > 0.001 && taken < 0.9, "{taken}");
    assert!(said.contains("--clamp took "), "{said}");
    assert!(has(&exr, "prt:clamp") && has(&exr, "indirect light is clamped at 0.05 nits (--clamp)"));
    assert_eq!(json["fingerprint"]["settings"]["clamp"], "0.05");
}
