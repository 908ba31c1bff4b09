//! Frames of animations, as users and their scripts meet them: `--frames`, `--fps`, `--animation`, `--shutter`, and `{frame}`
//! in names.

use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");

/// A scene of one emissive triangle in front of one camera, "Main".
const SCENE: &str = include_str!("data/triangle.gltf");

fn prt_in(folder: &Path, args: &[&str]) -> Output {
    let quick = ["--size", "16x8", "--spp", "1", "--accel", "bvh", "--progress", "none", "--threads", "1"];
    Command::new(BIN).current_dir(folder).args(args).args(quick).output().expect("the binary was built for this test")
}

/// The entries of `images` of a run that succeeds.
#[track_caller]
fn images(folder: &Path, args: &[&str]) -> Vec<Value> {
    let output = prt_in(folder, &[args, &["--json"]].concat());
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("the run's report");
    report["images"].as_array().expect("images").clone()
}

/// Runs, and checks that it ends with `code` and says all of `says`.
#[track_caller]
fn says(folder: &Path, args: &[&str], code: i32, says: &[&str]) {
    let output = prt_in(folder, args);
    let text = String::from_utf8(output.stderr).expect("messages are UTF-8");
    assert_eq!(output.status.code(), Some(code), "{args:?}: {text}");
    for part in says {
        assert!(text.contains(part), "{args:?} must say {part:?}, but says: {text}");
    }
}

/// `SCENE` with two animations: "slide" moves the triangle within a second, "jump" has one key at a quarter; `keys.bin` has the numbers.
fn scene() -> String {
    let mut scene: Value = serde_json::from_str(SCENE).unwrap();
    let buffer = scene["buffers"].as_array().unwrap().len();
    let list = |scene: &mut Value, key: &str, value: Value| {
        scene[key].as_array_mut().unwrap().push(value);
        scene[key].as_array().unwrap().len() - 1
    };
    list(&mut scene, "buffers", json!({"uri": "keys.bin", "byteLength": 36}));
    let mut accessor = |offset: usize, kind: &str, count: usize, length: usize| {
        let view =
            list(&mut scene, "bufferViews", json!({"buffer": buffer, "byteOffset": offset, "byteLength": length}));
        list(&mut scene, "accessors", json!({"bufferView": view, "componentType": 5126, "type": kind, "count": count}))
    };
    let (second, quarter) = (accessor(0, "SCALAR", 2, 8), accessor(8, "SCALAR", 1, 4));
    let (slide, place) = (accessor(12, "VEC3", 2, 24), accessor(24, "VEC3", 1, 12));
    let animation = |name: &str, input: usize, output: usize| {
        json!({"name": name, "samplers": [{"input": input, "output": output}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]})
    };
    scene["animations"] = json!([animation("slide", second, slide), animation("jump", quarter, place)]);
    scene.to_string()
}

/// A folder with `a.gltf`, animated, and `still.gltf`.
fn folder() -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    write(root.path(), 0.5);
    fs::write(root.path().join("still.gltf"), SCENE).unwrap();
    root
}

fn write(root: &Path, x: f32) {
    let bytes: Vec<u8> =
        [0.0, 1.0, 0.25, 0.0, 0.0, 0.0, x, 0.0, 0.0_f32].iter().flat_map(|v| v.to_le_bytes()).collect();
    fs::write(root.join("keys.bin"), bytes).unwrap();
    fs::write(root.join("a.gltf"), scene()).unwrap();
}

fn stems(images: &[Value]) -> Vec<String> {
    let stem = |image: &Value| {
        let path = image["outputs"]["png"].as_str().expect("a picture").to_owned();
        path.trim_start_matches("renders/").trim_end_matches(".png").to_owned()
    };
    images.iter().map(stem).collect()
}

#[test]
fn every_frame_is_a_picture_with_its_number() {
    let root = folder();
    let all = images(root.path(), &["a.gltf", "--frames", "0-4x2,7"]);
    assert_eq!(stems(&all), ["a.0000", "a.0002", "a.0004", "a.0007"]);
    let frames: Vec<_> = all.iter().map(|image| image["frame"].as_u64().unwrap()).collect();
    assert_eq!(frames, [0, 2, 4, 7]);
    let settings = |image: &Value, key: &str| image["fingerprint"]["settings"][key].as_str().map(str::to_owned);
    assert_eq!(settings(&all[3], "frame").as_deref(), Some("7"));
    assert_eq!(settings(&all[3], "fps").as_deref(), Some("24"));
    assert_eq!(settings(&all[3], "animation").as_deref(), Some("0"));
    assert!(root.path().join("renders/a.0007.exr").is_file() && root.path().join("renders/index.html").is_file());
    // As written: no frame, no animation.
    let one = images(root.path(), &["a.gltf"]);
    assert_eq!((stems(&one), &one[0]["frame"]), (vec!["a".to_owned()], &Value::Null));
    assert_eq!((settings(&one[0], "frame").as_deref(), settings(&one[0], "fps")), (Some("0"), None));
    assert!(one[0]["skipped"].to_string().contains("animations/0"), "{}", one[0]["skipped"]);
}

#[test]
fn all_frames_end_with_the_last_key_at_the_frames_a_second_asked_for() {
    let root = folder();
    assert_eq!(images(root.path(), &["a.gltf", "--frames", "all", "--fps", "4"]).len(), 5);
    assert_eq!(images(root.path(), &["a.gltf", "--frames", "all", "--fps", "5.5", "-o", "b"]).len(), 7);
    let jump = images(root.path(), &["a.gltf", "--frames", "all", "--fps", "4", "--animation", "jump", "-o", "c"]);
    assert_eq!(jump.len(), 2);
    let all = images(root.path(), &["a.gltf", "--frames", "all", "--fps", "4", "--animation", "all", "-o", "d"]);
    assert_eq!(all.len(), 5);
    assert!(all[0]["warnings"].to_string().contains("moves already"), "{}", all[0]["warnings"]);
}

#[test]
fn names_take_the_frame_and_clashes_are_found_before_anything_is_rendered() {
    let root = folder();
    let named = images(root.path(), &["a.gltf", "--frames", "1,12", "--name", "{stem}/{frame:03}_{frame}"]);
    assert_eq!(stems(&named), ["a/001_1", "a/012_12"]);
    assert_eq!(stems(&images(root.path(), &["a.gltf", "--frames", "3"])), ["a"], "one frame");
    let clash = &["a.gltf", "--frames", "1-3", "--name", "{stem}", "-o", "none"];
    says(root.path(), clash, 2, &["several frames would be written to one name", "--name '{stem}.{frame:04}'"]);
    assert!(!root.path().join("none").exists());
}

#[test]
fn a_frame_alone_has_the_bytes_that_it_has_among_others() {
    let root = folder();
    images(root.path(), &["a.gltf", "--frames", "0-7", "--shutter", "0.5"]);
    images(root.path(), &["a.gltf", "--frames", "7,9", "--shutter", "0.5", "-o", "alone"]);
    let read = |path: &str| fs::read(root.path().join(path)).unwrap();
    assert_eq!(read("renders/a.0007.exr"), read("alone/a.0007.exr"));
    assert_ne!(read("renders/a.0006.exr"), read("renders/a.0007.exr"));
}

#[test]
fn frames_that_are_up_to_date_are_kept_and_others_are_rendered_for_a_reason() {
    let root = folder();
    let run = |args: &[&str]| {
        let all = images(root.path(), &[&["a.gltf", "--frames", "0-3"], args].concat());
        all.iter().map(|image| image["status"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(run(&[]), ["rendered"; 4]);
    assert_eq!(run(&[]), ["up-to-date"; 4]);
    fs::remove_file(root.path().join("renders/a.0002.png")).unwrap();
    assert_eq!(run(&[]), ["up-to-date", "up-to-date", "rendered", "up-to-date"]);
    for changed in [
        &["--fps", "25"][..],
        &["--animation", "1"],
        &["--shutter", "0.5"],
        &["--shutter", "0.5", "--shutter-position", "start"],
    ] {
        assert_eq!(run(changed), ["rendered"; 4], "{changed:?}");
        assert_eq!(run(changed), ["up-to-date"; 4], "{changed:?}");
    }
    write(root.path(), 0.25);
    assert_eq!(run(&["--shutter", "0.5", "--shutter-position", "start"]), ["rendered"; 4], "the keys changed");
}

#[test]
fn a_file_that_does_not_move_gives_the_same_scene_for_each_frame_with_a_warning() {
    let root = folder();
    let all = images(root.path(), &["still.gltf", "--frames", "1-2"]);
    assert_eq!(all.len(), 2);
    assert!(all[1]["warnings"].to_string().contains("nothing in the file is animated"), "{}", all[1]["warnings"]);
    assert_eq!(images(root.path(), &["still.gltf", "--frames", "all"]).len(), 1);
}

#[test]
fn a_broken_animation_fails_once_with_its_place_and_the_other_files_are_rendered() {
    let root = folder();
    let broken = scene().replace("\"path\":\"translation\"", "\"path\":\"rotation\"");
    fs::write(root.path().join("broken.gltf"), broken).unwrap();
    let output = prt_in(root.path(), &["broken.gltf", "a.gltf", "--frames", "1-3", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let images = report["images"].as_array().unwrap();
    let statuses: Vec<_> = images.iter().map(|image| image["status"].as_str().unwrap()).collect();
    assert_eq!(statuses, ["failed", "rendered", "rendered", "rendered"]);
    let message = images[0]["error_message"].as_str().unwrap();
    assert!(message.contains("/type") && message.contains("VEC4"), "{message}");
    assert!(message.contains("The other 2 frames of this file were not tried."), "{message}");
    says(
        root.path(),
        &["a.gltf", "--frames", "1", "--animation", "walk"],
        3,
        &["no animation \"walk\"", "0 \"slide\", 1 \"jump\", all"],
    );
}

#[test]
fn options_about_frames_need_them_and_wrong_values_say_what_is_allowed() {
    let root = folder();
    for option in [["--fps", "25"], ["--animation", "walk"], ["--shutter", "0.5"], ["--shutter-position", "end"]] {
        says(root.path(), &["a.gltf", option[0], option[1]], 2, &[&format!("{} needs --frames", option[0])]);
    }
    for (option, value, allowed) in [
        ("--frames", "9-1", "9-1 ends before it begins"),
        ("--frames", "-3", "1-100x2"),
        ("--frames", "every", "must be all, or frames"),
        ("--fps", "0", "from 0.001 to 1e6"),
        ("--fps", "nan", "from 0.001 to 1e6"),
        ("--shutter", "180", "180 degrees are 0.5000"),
        ("--shutter", "-0.1", "from 0 to 1"),
        ("--shutter-position", "middle", "center"),
    ] {
        says(root.path(), &["a.gltf", option, value], 2, &[option, allowed]);
    }
    assert!(!root.path().join("renders").exists());
}

#[test]
fn the_plan_lists_frames_and_a_config_file_has_them_for_some_files() {
    let root = folder();
    let output = prt_in(root.path(), &["a.gltf", "--frames", "2-4", "--explain", "--json"]);
    let plan: Value = serde_json::from_slice(&output.stdout).unwrap();
    let plans = plan["images"].as_array().unwrap();
    let frames: Vec<_> = plans.iter().map(|plan| plan["frame"].as_u64().unwrap()).collect();
    assert_eq!(frames, [2, 3, 4]);
    assert_eq!(plans[2]["outputs"]["exr"], "renders/a.0004.exr");
    fs::write(
        root.path().join("night.toml"),
        "inputs = [\"*.gltf\"]\n[[file]]\nmatch = \"a.gltf\"\nframes = \"1-2\"\nfps = 12\nshutter = 0.25\n",
    )
    .unwrap();
    let all = images(root.path(), &["--config", "night.toml"]);
    assert_eq!(stems(&all), ["a.0001", "a.0002", "still"]);
    assert_eq!(all[0]["fingerprint"]["settings"]["shutter"], "0.25");
}

#[test]
fn a_camera_that_the_file_lacks_stands_still_and_sees_the_whole_animation() {
    let root = folder();
    let mut seen: Value = serde_json::from_str(&scene()).unwrap();
    seen["scenes"][0]["nodes"] = json!([0]);
    fs::write(root.path().join("a.gltf"), seen.to_string()).unwrap();
    let eye = |args: &[&str]| {
        let output = prt_in(root.path(), &[&["a.gltf", "--explain", "--json"], args].concat());
        let plan: Value = serde_json::from_slice(&output.stdout).unwrap();
        plan["images"][0]["camera"]["eye"].clone()
    };
    let (first, last) = (eye(&["--frames", "0"]), eye(&["--frames", "24"]));
    assert_eq!(first, last);
    assert_ne!(first, eye(&[]), "as written it is framed alone");
}
