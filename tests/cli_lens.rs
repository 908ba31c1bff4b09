//! Lenses and integrators, as users and their scripts meet them: options, extras, files, JSON, messages.

use exr::meta::attribute::Text;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");

/// A scene of one emissive triangle in front of one camera, "Main", of aspect ratio 2.
const SCENE: &str = include_str!("data/triangle.gltf");

fn prt_in(folder: &Path, args: &[&str]) -> Output {
    let quick = ["--spp", "1", "--width", "8", "--accel", "bvh", "--progress", "none"];
    Command::new(BIN).current_dir(folder).args(args).args(quick).output().expect("the binary was built for this test")
}

/// A folder with `a.gltf`, which is [`SCENE`] after `change`.
fn folder(change: impl FnOnce(&mut Value)) -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    let mut scene: Value = serde_json::from_str(SCENE).unwrap();
    change(&mut scene);
    fs::write(root.path().join("a.gltf"), scene.to_string()).unwrap();
    root
}

/// The only image of a run that succeeds, and what was said.
#[track_caller]
fn image(folder: &Path, args: &[&str]) -> (Value, String) {
    let output = prt_in(folder, &[&["a.gltf", "--json", "-v"], args].concat());
    let said = String::from_utf8(output.stderr).expect("messages are UTF-8");
    assert!(output.status.success(), "{args:?}: {said}");
    let report: Value = serde_json::from_slice(&output.stdout).expect("the run's report");
    (report["images"][0].clone(), said)
}

/// Runs, and checks that nothing was rendered, with this code and all of `says`.
#[track_caller]
fn refused(folder: &Path, args: &[&str], code: i32, says: &[&str]) {
    let output = prt_in(folder, &[&["a.gltf"], args].concat());
    let text = String::from_utf8(output.stderr).expect("messages are UTF-8");
    assert_eq!(output.status.code(), Some(code), "{args:?}: {text}");
    for part in says {
        assert!(text.contains(part), "{args:?} must say {part:?}, but says: {text}");
    }
    assert!(!folder.join("renders/a.exr").exists(), "{args:?} rendered something");
}

/// `aperture`, `focus` and `prt:lens` of `renders/a.exr`.
fn attributes(folder: &Path) -> (Option<f32>, Option<f32>, Option<String>) {
    let meta = exr::meta::MetaData::read_from_file(folder.join("renders/a.exr"), false).unwrap();
    let attributes = &meta.headers[0].own_attributes;
    let lens = match attributes.other.get(&Text::from("prt:lens")) {
        Some(exr::meta::attribute::AttributeValue::Text(text)) => Some(text.to_string()),
        _ => None,
    };
    (attributes.aperture, attributes.focus, lens)
}

fn integrator_of(folder: &Path) -> String {
    let meta = exr::meta::MetaData::read_from_file(folder.join("renders/a.exr"), false).unwrap();
    match meta.headers[0].own_attributes.other.get(&Text::from("prt:integrator")) {
        Some(exr::meta::attribute::AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_lens_is_in_the_json_and_in_the_exr_and_a_pinhole_is_not() {
    let root = folder(|_| {});
    let options = ["--f-stop", "2.8", "--focus-distance", "3.5", "--aperture-blades", "6", "--sensor", "24"];
    let (report, _) = image(root.path(), &options);
    let lens = &report["lens"];
    assert_eq!((&lens["f_stop"], &lens["focus_distance_m"], &lens["blades"]), (&json!(2.8), &json!(3.5), &json!(6)));
    assert_eq!((&lens["focus_found"], &report["features"]["depth_of_field"]), (&json!(false), &json!(true)));
    // 24 mm across, half as much high.
    let yfov = serde_json::from_str::<Value>(SCENE).unwrap()["cameras"][0]["perspective"]["yfov"].as_f64().unwrap();
    let focal = 6.0 / (0.5 * yfov).tan();
    assert!((lens["focal_length_mm"].as_f64().unwrap() / focal - 1.0).abs() < 1e-6, "{lens} for {focal}");
    let radius = lens["aperture_radius_m"].as_f64().unwrap();
    assert!((radius / (1e-3 * focal / 5.6) - 1.0).abs() < 1e-6, "{radius}");
    let (aperture, focus, shape) = attributes(root.path());
    assert_eq!((aperture, focus), (Some(2.8), Some(3.5)));
    assert!(shape.is_some_and(|shape| shape.ends_with("m, 6 blades") && shape.starts_with("radius ")));

    let (report, _) = image(root.path(), &["--force"]);
    assert_eq!((&report["lens"], &report["features"]["depth_of_field"]), (&Value::Null, &json!(false)));
    assert_eq!(attributes(root.path()), (None, None, None));
}

#[test]
fn other_lenses_are_other_pictures_and_the_same_is_kept() {
    let root = folder(|_| {});
    let status = |args: &[&str]| image(root.path(), args).0["status"].as_str().unwrap().to_owned();
    let lens = ["--f-stop", "2", "--focus-distance", "2"];
    assert_eq!(status(&lens), "rendered");
    assert_eq!(status(&lens), "up-to-date");
    for more in [["--aperture-blades", "5"], ["--sensor", "24"], ["--integrator", "ao"], ["--seed", "1"]] {
        assert_eq!(status(&[&lens[..], &more].concat()), "rendered", "{more:?}");
        assert_eq!(status(&lens), "rendered", "after {more:?}");
    }
    assert_eq!(status(&["--f-stop", "2.8", "--focus-distance", "2"]), "rendered");
    assert_eq!(status(&["--f-stop", "2.8", "--focus-distance", "3"]), "rendered");
}

#[test]
fn a_lens_of_the_file_is_used_and_options_win() {
    let root = folder(|scene| {
        scene["cameras"][0]["extras"] = json!({"prt_f_stop": 4.0, "prt_focus_distance": 2.0, "prt_aperture_blades": 5});
    });
    let lens = image(root.path(), &[]).0["lens"].clone();
    assert_eq!((&lens["f_stop"], &lens["focus_distance_m"], &lens["blades"]), (&json!(4.0), &json!(2.0), &json!(5)));
    let lens = image(root.path(), &["--focus-distance", "inf", "--aperture-blades", "0"]).0["lens"].clone();
    assert_eq!((&lens["f_stop"], &lens["focus_distance_m"], &lens["blades"]), (&json!(4.0), &Value::Null, &json!(0)));
    assert_eq!(attributes(root.path()).1, Some(f32::INFINITY));
    assert_eq!(image(root.path(), &["--f-stop", "inf"]).0["lens"], Value::Null);
    // Through the camera of another file, too.
    fs::copy(root.path().join("a.gltf"), root.path().join("studio.gltf")).unwrap();
    assert_eq!(image(root.path(), &["--camera-from", "studio.gltf"]).0["lens"]["f_stop"], json!(4.0));
}

#[test]
fn a_node_to_focus_on_gives_the_distance_and_one_that_is_not_there_is_an_error() {
    let node = json!({"name": "Target", "translation": [0.25, 0.5, -1.0]});
    let root = folder(|scene| scene["nodes"].as_array_mut().unwrap().push(node));
    let (report, said) = image(root.path(), &["--f-stop", "2", "--focus-on", "Target"]);
    let distance = report["lens"]["focus_distance_m"].as_f64().unwrap();
    assert_eq!(distance, 1.0, "{said}");
    fs::remove_dir_all(root.path().join("renders")).unwrap();
    refused(root.path(), &["--f-stop", "2", "--focus-on", "Targte"], 3, &["no node \"Targte\"", "\"Target\""]);
    refused(root.path(), &["--focus-on", "Target", "--focus-distance", "2"], 2, &["--focus-on", "--focus-distance"]);
}

#[test]
fn a_lens_without_a_focus_says_how_far_it_found_one_and_idle_options_say_so() {
    let root = folder(|_| {});
    let (report, said) = image(root.path(), &["--f-stop", "2"]);
    assert!(said.contains("the lens is focused at") && said.contains("--focus-on NODE"), "{said}");
    assert_eq!(report["lens"]["focus_found"], json!(true));
    let (report, said) = image(root.path(), &["--focus-distance", "2"]);
    assert!(said.contains("--focus-distance does nothing") && report["lens"].is_null(), "{said}");
    let plan = prt_in(root.path(), &["a.gltf", "--f-stop", "2", "--focus-distance", "5", "--explain"]);
    let text = String::from_utf8(plan.stdout).unwrap();
    assert!(text.contains("f/2") && text.contains("5 m") && text.contains("depth_of_field"), "{text}");
}

#[test]
fn lenses_that_are_none_are_refused_by_option() {
    let root = folder(|_| {});
    for (option, values, allowed) in [
        ("--f-stop", ["0", "-2.8", "nan", "f/2"], "1000000"),
        ("--focus-distance", ["0", "-1", "NaN", "2m"], "1e18"),
        ("--aperture-blades", ["2", "65", "5.5", "-5"], "from 3 to 64"),
        ("--sensor", ["0", "-36", "nan", "inf"], "millimetres"),
    ] {
        for value in values {
            refused(root.path(), &[option, value], 2, &[option, &format!("'{value}'"), allowed]);
        }
    }
}

#[test]
fn an_orthographic_camera_has_no_lens() {
    let orthographic = json!({"type": "orthographic", "name": "Main",
        "orthographic": {"xmag": 1.0, "ymag": 0.5, "znear": 0.1, "zfar": 10.0}});
    let root = folder(|scene| scene["cameras"][0] = orthographic);
    refused(root.path(), &["--f-stop", "2"], 1, &["camera \"Main\"", "orthographic", "no lens"]);
    let plan = prt_in(root.path(), &["a.gltf", "--f-stop", "2", "--explain"]);
    assert!(String::from_utf8(plan.stdout).unwrap().contains("orthographic"));
    let (report, _) = image(root.path(), &[]);
    assert_eq!(report["lens"], Value::Null);
}

#[test]
fn an_obj_has_no_node_to_focus_on() {
    let root = tempfile::tempdir().unwrap();
    fs::write(root.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let output = prt_in(root.path(), &["a.obj", "--f-stop", "2", "--focus-on", "x"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.code() == Some(3) && said.contains("an OBJ has no nodes") && said.contains("--focus-distance")
    );
}

#[test]
fn integrators_are_in_the_json_the_exr_and_the_plan() {
    let root = folder(|_| {});
    for name in ["path", "direct", "whitted", "ao", "normal", "albedo"] {
        let (report, _) = image(root.path(), &["--integrator", name]);
        assert_eq!((report["integrator"].as_str(), report["status"].as_str()), (Some(name), Some("rendered")));
        assert_eq!(integrator_of(root.path()), name);
        let plan = prt_in(root.path(), &["a.gltf", "--integrator", name, "--explain", "--json"]);
        let plan: Value = serde_json::from_slice(&plan.stdout).unwrap();
        assert_eq!(plan["images"][0]["integrator"], json!(name));
        assert_eq!(plan["images"][0]["prospect"], json!("keep"), "{name}");
    }
    let typo = prt_in(root.path(), &["a.gltf", "--integrator", "whited"]);
    assert!(String::from_utf8(typo.stderr).unwrap().contains("did you mean whitted?"));
}

#[test]
fn whitted_says_what_it_takes_for_points() {
    let root = folder(|_| {});
    let (_, said) = image(root.path(), &["--integrator", "whitted"]);
    assert!(said.contains("lamps are points"), "{said}");
}
