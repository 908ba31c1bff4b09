//! Which cameras a run uses, as users and their scripts meet it: `--camera`, `--camera-from`, `--eye`, and none at all.

use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");

/// A scene of one emissive triangle in front of one camera, "Main", of aspect ratio 2.
const SCENE: &str = include_str!("data/triangle.gltf");

fn prt_in(folder: &Path, args: &[&str]) -> Output {
    let quick = ["--spp", "1", "--accel", "bvh", "--progress", "none"];
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

/// Runs, and checks that it is refused as usage before anything is rendered, with all of `says`.
#[track_caller]
fn refused(folder: &Path, args: &[&str], says: &[&str]) {
    let output = prt_in(folder, args);
    let text = String::from_utf8(output.stderr).expect("messages are UTF-8");
    assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
    for part in says {
        assert!(text.contains(part), "{args:?} must say {part:?}, but says: {text}");
    }
    assert!(!folder.join("renders").exists(), "{args:?} rendered something");
}

/// `SCENE` with these cameras, (name, aspect ratio, distance in front of the triangle), each on a node of its own.
fn scene_with(cameras: &[(&str, f64, f64)]) -> String {
    let mut scene: Value = serde_json::from_str(SCENE).unwrap();
    let mesh = scene["nodes"][0].clone();
    scene["nodes"] = json!([mesh]);
    scene["scenes"][0]["nodes"] = (0..=cameras.len()).collect();
    scene["cameras"] = json!([]);
    for (i, &(name, aspect, z)) in cameras.iter().enumerate() {
        let camera = json!({"type": "perspective", "name": name,
            "perspective": {"yfov": 0.8, "aspectRatio": aspect, "znear": 0.1}});
        scene["cameras"].as_array_mut().unwrap().push(camera);
        let node = json!({"camera": i, "translation": [0.0, 0.0, z]});
        scene["nodes"].as_array_mut().unwrap().push(node);
    }
    scene.to_string()
}

/// A folder with `a.gltf`, which is [`SCENE`].
fn folder() -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    fs::write(root.path().join("a.gltf"), SCENE).unwrap();
    root
}

/// Files `renders/*.EXTENSION`, sorted.
fn written(folder: &Path, extension: &str) -> Vec<String> {
    let entries = fs::read_dir(folder.join("renders")).unwrap();
    let mut names: Vec<String> =
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).filter(|n| n.ends_with(extension)).collect();
    names.sort();
    names
}

/// `worldToCamera` and `worldToNDC` of an EXR, each `[4][4]` row by row, for row vectors.
fn matrices(path: &Path) -> [[f32; 16]; 2] {
    let meta = exr::meta::MetaData::read_from_file(path, false).unwrap();
    let attributes = &meta.headers[0].own_attributes;
    [attributes.world_to_camera.unwrap(), attributes.world_to_normalized_device.unwrap()]
}

#[test]
fn camera_from_gives_every_input_the_cameras_of_another_file() {
    let root = folder();
    fs::write(root.path().join("b.gltf"), SCENE).unwrap();
    // Nothing else of that file is needed: neither its buffer nor its image is there.
    let mut cameras: Value = serde_json::from_str(&scene_with(&[("Near", 1.5, 1.0), ("Far", 3.0, 9.0)])).unwrap();
    cameras["buffers"][0]["uri"] = json!("missing.bin");
    cameras["images"] = json!([{"uri": "missing.png"}]);
    fs::write(root.path().join("studio.gltf"), cameras.to_string()).unwrap();

    let images = images(root.path(), &["a.gltf", "b.gltf", "--camera-from", "studio.gltf", "--width", "12"]);
    let seen: Vec<_> = images.iter().map(|i| (i["camera"].as_str().unwrap(), i["height"].as_u64().unwrap())).collect();
    assert_eq!(seen, [("Near", 8), ("Far", 4), ("Near", 8), ("Far", 4)]);
    assert_eq!(written(root.path(), ".exr"), ["a.Far.exr", "a.Near.exr", "b.Far.exr", "b.Near.exr"]);
    let skipped = json!({"what": "cameras", "why": "--camera-from studio.gltf gives the cameras"});
    assert!(images[0]["skipped"].as_array().unwrap().contains(&skipped), "{}", images[0]);
    let [view, _] = matrices(&root.path().join("renders/b.Far.exr"));
    assert_eq!(view[14], 9.0, "the camera is 9 m in front of the origin: {view:?}");
}

#[test]
fn a_file_seen_by_its_own_cameras_from_elsewhere_is_the_same_picture() {
    let root = folder();
    images(root.path(), &["a.gltf", "--width", "16"]);
    // Pixels: the settings, and so the fingerprint in the file, are others.
    let pixels = || prt::image::exr_read::read(&root.path().join("renders/a.exr")).unwrap().pixels;
    let own = pixels();
    images(root.path(), &["a.gltf", "--width", "16", "--camera-from", "a.gltf"]);
    assert!(pixels() == own && own.iter().flatten().any(|value| *value > 0.0));
}

#[test]
fn camera_chooses_among_those_from_elsewhere() {
    let root = folder();
    fs::write(root.path().join("studio.gltf"), scene_with(&[("Near", 1.5, 1.0), ("Far", 3.0, 9.0)])).unwrap();
    for choice in ["Far", "1"] {
        let args = ["a.gltf", "--camera-from", "studio.gltf", "--width", "12", "--camera", choice];
        assert_eq!(images(root.path(), &args)[0]["camera"], "Far");
        assert_eq!(written(root.path(), ".exr"), ["a.exr"]);
    }
}

#[test]
fn cameras_from_elsewhere_that_are_not_to_be_had_are_usage() {
    let root = folder();
    fs::write(root.path().join("bare.gltf"), scene_with(&[])).unwrap();
    fs::write(root.path().join("broken.gltf"), "{").unwrap();
    fs::write(root.path().join("studio.gltf"), scene_with(&[("Near", 1.5, 1.0), ("", 3.0, 9.0)])).unwrap();
    let from = |file| ["a.gltf", "--camera-from", file];
    refused(root.path(), &from("none.gltf"), &["--camera-from none.gltf", "cannot be read"]);
    refused(root.path(), &from("broken.gltf"), &["--camera-from broken.gltf: 1:1"]);
    refused(root.path(), &from("a.obj"), &["--camera-from a.obj", "Allowed: .gltf, .glb"]);
    refused(root.path(), &from("bare.gltf"), &["--camera-from bare.gltf", "no camera", "--eye X,Y,Z --look-at X,Y,Z"]);
    let wanted = ["a.gltf", "--camera-from", "studio.gltf", "--camera", "Main"];
    let says = ["--camera-from studio.gltf", "--camera \"Main\": there is no such camera", "0 \"Near\", 1 \"\""];
    refused(root.path(), &wanted, &says);
}

#[test]
fn eye_places_a_camera_for_every_input() {
    let root = folder();
    fs::write(root.path().join("b.gltf"), scene_with(&[("X", 1.0, 1.0), ("Y", 1.0, 2.0)])).unwrap();
    let view = ["--eye", "0,2,5", "--look-at", "0,2,-1", "--up", "1,0,0", "--yfov", "90"];
    let images = images(root.path(), &[&["a.gltf", "b.gltf", "--width", "16"], &view[..]].concat());
    assert_eq!(images.len(), 2);
    for image in &images {
        assert_eq!((&image["camera"], &image["width"], &image["height"]), (&json!("eye"), &json!(16), &json!(9)));
    }
    assert_eq!(written(root.path(), ".exr"), ["a.exr", "b.exr"]);
    // Left-handed, +z forward, +x of the world upwards in the picture, for row vectors.
    let [view, ndc] = matrices(&root.path().join("renders/a.exr"));
    let expected = [0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 2.0, 0.0, 5.0, 1.0];
    let near = view.iter().zip(expected).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-6);
    assert!(near, "{view:?}");
    // 90 degrees: what is as high above the middle as it is far away is on the upper edge.
    let at = [5.0_f32, 2.0, 0.0, 1.0];
    let [x, y, w] = [0, 1, 3].map(|k| (0..4).map(|i| at[i] * ndc[4 * i + k]).sum::<f32>());
    assert!((x / w - 0.5).abs() < 1e-6 && (y / w).abs() < 1e-6, "{} {}", x / w, y / w);
}

#[test]
fn eye_without_up_and_angle_has_defaults() {
    let root = folder();
    images(root.path(), &["a.gltf", "--size", "8x8", "--eye", "0,0,-3", "--look-at", "0,0,0"]);
    let [_, ndc] = matrices(&root.path().join("renders/a.exr"));
    let at = [0.0_f32, 3.0 * 20f32.to_radians().tan(), 0.0, 1.0];
    let [y, w] = [1, 3].map(|k| (0..4).map(|i| at[i] * ndc[4 * i + k]).sum::<f32>());
    assert!((y / w).abs() < 1e-6, "+y is up and 40 degrees are seen: {}", y / w);
}

#[test]
fn views_that_are_none_are_usage() {
    let root = folder();
    let eye = ["a.gltf", "--eye", "0,2,5"];
    let both = ["a.gltf", "--eye", "0,2,5", "--look-at", "0,0,0"];
    let with = |args: &[&'static str], more: &[&'static str], says: &[&str]| {
        refused(root.path(), &[args, more].concat(), says);
    };
    with(&eye, &[], &["--look-at"]);
    with(&["a.gltf"], &["--look-at", "0,0,0"], &["--eye"]);
    with(&["a.gltf"], &["--up", "0,0,1"], &["--eye"]);
    with(&["a.gltf"], &["--yfov", "30"], &["--eye"]);
    with(&both, &["--camera-from", "a.gltf"], &["--eye", "--camera-from", "cannot be used with"]);
    with(&both, &["--camera", "Main"], &["--eye", "--camera", "cannot be used with"]);
    with(&eye, &["--look-at", "0,2,5"], &["--look-at 0,2,5", "where --eye is", "any other point"]);
    with(&both, &["--up", "0,-4,-10"], &["--up 0,-4,-10", "along the view", "such as --up 0,1,0"]);
    with(&both, &["--up", "0,0,0"], &["--up 0,0,0", "no direction"]);
    with(&eye, &["--look-at", "0,-9,5"], &["--up 0,1,0 (the default)", "such as --up 0,0,-1"]);
    for value in ["0,0", "1,2,3,4", "a,b,c", "nan,0,0", "0,inf,0", "1e19,0,0", ""] {
        let says = ["--look-at", &format!("'{value}'"), "X,Y,Z: three numbers from -1e18 to 1e18"];
        refused(root.path(), &["a.gltf", "--eye", "-1,-2,-3", "--look-at", value], &says);
    }
    for value in ["0", "180", "-30", "nan", "x"] {
        refused(root.path(), &[&both[..], &["--yfov", value]].concat(), &["--yfov", value, "above 0 and below 180"]);
    }
}

#[test]
fn cameras_of_the_same_or_no_name_are_told_apart() {
    let root = folder();
    let cameras = [("Cam", 1.0, 1.0), ("", 1.0, 2.0), ("Cam", 1.0, 3.0), ("", 1.0, 4.0), ("1", 1.0, 5.0)];
    fs::write(root.path().join("many.gltf"), scene_with(&cameras)).unwrap();
    let all = images(root.path(), &["many.gltf", "--size", "4x4"]);
    let names: Vec<_> = all.iter().map(|i| i["camera"].as_str().unwrap()).collect();
    // A camera without a name is known by its place in the file.
    assert_eq!(names, ["Cam", "1", "Cam", "3", "1"]);
    let outputs = ["many.1-4.exr", "many.1.exr", "many.3.exr", "many.Cam-2.exr", "many.Cam.exr"];
    assert_eq!(written(root.path(), ".exr"), outputs);
    let distance = |file: &str| matrices(&root.path().join("renders").join(file))[0][14];
    assert_eq!([distance("many.Cam.exr"), distance("many.Cam-2.exr"), distance("many.1-4.exr")], [1.0, 3.0, 5.0]);
    // A name means the first of that name, a number a place.
    for (choice, z) in [("Cam", 1.0), ("2", 3.0), ("1", 2.0)] {
        images(root.path(), &["many.gltf", "--size", "4x4", "--camera", choice]);
        assert_eq!(distance("many.exr"), z, "--camera {choice}");
    }
}

#[test]
fn a_camera_that_is_not_there_fails_the_file_and_lists_those_that_are() {
    let root = folder();
    let output = prt_in(root.path(), &["a.gltf", "--camera", "Side"]);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{text}");
    for part in ["a.gltf", "--camera \"Side\": there is no such camera", "0 \"Main\""] {
        assert!(text.contains(part), "{text}");
    }
}

#[test]
fn a_file_without_a_camera_is_framed_on_its_bounds() {
    let root = folder();
    fs::write(root.path().join("bare.gltf"), scene_with(&[])).unwrap();
    let image = &images(root.path(), &["bare.gltf", "--width", "32"])[0];
    assert_eq!((&image["camera"], &image["height"]), (&Value::Null, &json!(18)));
    // The emissive triangle, which faces +z, is in the picture and not on its border.
    let png = image::open(root.path().join("renders/bare.png")).unwrap().to_rgb8();
    let lit = |x: u32, y: u32| png.get_pixel(x, y).0[0] > 0;
    let border = (0..32).flat_map(|x| [(x, 0), (x, 17)]).chain((0..18).flat_map(|y| [(0, y), (31, y)]));
    assert!(border.into_iter().all(|(x, y)| !lit(x, y)));
    let share = (0..18).flat_map(|y| (0..32).map(move |x| (x, y))).filter(|&(x, y)| lit(x, y)).count();
    assert!(share > 40, "{share} of 576 pixels are lit");
}
