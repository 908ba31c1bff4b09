//! `--explain`, `--memory` and `doctor` as users and their scripts meet them.

use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Instant;

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");
const SCENE: &str = include_str!("data/triangle.gltf");

fn prt_in(folder: &Path, args: &[&str]) -> Output {
    Command::new(BIN).current_dir(folder).args(args).output().expect("the binary was built for this test")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("messages are UTF-8")
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", text(&output.stderr)))
}

fn with_scene() -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    fs::write(root.path().join("a.gltf"), SCENE).unwrap();
    root
}

/// Everything in a folder.
fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_plan_is_told_in_ascii_and_nothing_is_written() {
    let root = with_scene();
    fs::write(root.path().join("broken.gltf"), "{").unwrap();
    let args = ["a.gltf", "--explain", "--size", "64x32", "-s", "4", "--crop", "1,2,8,4", "--accel", "bvh"];
    let output = prt_in(root.path(), &args);
    let said = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    for part in [
        "would be rendered",
        "renders/a.exr, renders/a.png, renders/a.json",
        "64 x 32 pixels, of it 8 x 4 at 1,2, 4 spp, 128 paths, seed 0",
        "of the file: perspective",
        "rays by    bvh",
        "1 placed (1 in the file)",
        "1 emissive triangles",
        "studio     off (--default-light auto): lamps give ",
        "features   emissive_surfaces",
        "memory     about ",
        "time       about ",
    ] {
        assert!(said.contains(part), "{part:?} in {said}");
    }
    assert!(said.is_ascii());
    let output = prt_in(root.path(), &["a.gltf", "broken.gltf", "--explain"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("would fail") && text(&output.stdout).contains("broken.gltf: 1:1"));
    assert_eq!(prt_in(root.path(), &["broken.gltf", "--explain"]).status.code(), Some(3));
    assert_eq!(entries(root.path()), ["a.gltf", "broken.gltf"]);
}

#[test]
fn a_plan_says_what_is_placed_and_why() {
    let root = tempfile::tempdir().unwrap();
    let forest = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/forest.gltf");
    let args = [forest, "--explain", "--size", "32x18", "-s", "1", "--accel", "bvh"];
    let said = text(&prt_in(root.path(), &args).stdout);
    for part in [
        "50,155,202 placed (1,550 in the file), 1,550 held; 3 meshes, 64,801 instances",
        "(2 meshes), 1,548 triangles x 32,400: placed (merging it would cost more; merging 35 s, placing 24 s)",
        "features   default_light, environment, instances",
    ] {
        assert!(said.contains(part), "{part:?} in {said}");
    }
    let plan = json(&prt_in(root.path(), &[&args[..], &["--json"]].concat()));
    let plan = &plan["images"][0];
    assert_eq!((&plan["triangles"]["stored"], &plan["placed_instances"]), (&1550.into(), &32_400.into()));
    let [thing] = &plan["placing"].as_array().unwrap()[..] else { panic!("{plan}") };
    assert_eq!((&thing["placed"], &thing["instances"], &thing["meshes"]), (&32_400.into(), &32_400.into(), &2.into()));
    // Merged it would take gigabytes.
    assert!(plan["memory"]["peak"].as_u64().unwrap() < 200 << 20, "{plan}");
    // Two boxes of one mesh are not worth it.
    let cornell = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell.gltf");
    let said =
        text(&prt_in(root.path(), &[cornell, "--explain", "--size", "32x18", "-s", "1", "--accel", "bvh"]).stdout);
    assert!(said.contains("12 triangles x 2: merged (placing it would cost rays more;"), "{said}");
}

/// The plan of every scene of ours says what the render of it says afterwards.
#[test]
fn a_plan_agrees_with_the_render_that_follows() {
    let root = tempfile::tempdir().unwrap();
    let scenes = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");
    let common = [scenes, "--size", "32x18", "-s", "1", "--accel", "bvh", "--progress", "none", "--json"];
    let plan = json(&prt_in(root.path(), &[&common[..], &["--explain"]].concat()));
    assert!(entries(root.path()).is_empty());
    let run = json(&prt_in(root.path(), &common));
    let (plan, run) = (plan["images"].as_array().unwrap(), run["images"].as_array().unwrap());
    assert!(plan.len() == run.len() && run.len() >= 7);
    for (plan, run) in plan.iter().zip(run) {
        for field in ["input", "scene", "outputs", "width", "height", "spp", "seed", "accel", "features", "skipped"] {
            assert_eq!(plan[field], run[field], "{field} of {}", run["input"]);
        }
        for field in ["warnings", "losses", "default_light", "instances"] {
            assert_eq!(plan[field], run[field], "{field} of {}", run["input"]);
        }
        assert_eq!(plan["camera"]["name"], run["camera"], "{}", run["input"]);
        assert_eq!(plan["triangles"]["traced"], run["triangles"], "{}", run["input"]);
        let lights = &plan["lights"];
        let counts = ["emissive_meshes", "point", "spot", "directional"].map(|k| lights[k].as_u64().unwrap());
        let environment = u64::from(lights["environment"].as_bool().unwrap());
        assert_eq!(counts.iter().sum::<u64>() + environment, run["lights"].as_u64().unwrap(), "{}", run["input"]);
    }
    let cornell = plan.iter().find(|p| p["input"].as_str().unwrap().ends_with("cornell.gltf")).unwrap();
    assert!(cornell["features"]["emissive_surfaces"] == true && cornell["features"]["textures"] == false);
}

/// Refused before anything is allocated: it takes no longer than a process takes to start.
#[track_caller]
fn refused_at_once(root: &Path, args: &[&str], says: &[&str]) {
    let start = Instant::now();
    let output = prt_in(root, args);
    let (seconds, said) = (start.elapsed().as_secs_f64(), text(&output.stderr) + &text(&output.stdout));
    assert!(matches!(output.status.code(), Some(1..=3)), "{args:?}: {:?} {said}", output.status);
    says.iter().for_each(|part| assert!(said.contains(part), "{args:?} must say {part:?}, but says: {said}"));
    // Machines that test are busy; what would be allocated takes far longer.
    assert!(seconds < 2.0, "{args:?} took {seconds} s");
}

#[test]
fn what_cannot_fit_is_refused_at_once_with_parts_limit_and_remedy() {
    let root = with_scene();
    for size in ["40000x25000", "65536x65536"] {
        let args = ["a.gltf", "--explain", "--size", size, "--memory", "8GiB"];
        refused_at_once(root.path(), &args, &["film ", "more than --memory 8.0 GiB", "--crop X,Y,W,H", "a.gltf"]);
    }
    // A file that has the bytes, but more than may be used.
    let heavy = heavy_scene(root.path());
    let args = [heavy.to_str().unwrap(), "--explain", "--memory", "10MiB"];
    refused_at_once(root.path(), &args, &["heavy.gltf: would take about ", "loading ", "Allow more with --memory"]);
    assert_eq!(entries(root.path()), ["a.gltf", "heavy.bin", "heavy.gltf"]);
}

/// A sparse file of 60 MB with a mesh of as many bytes.
fn heavy_scene(folder: &Path) -> PathBuf {
    let bytes = 60_000_000_u64;
    fs::File::create(folder.join("heavy.bin")).unwrap().set_len(bytes).unwrap();
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "buffers":[{{"uri":"heavy.bin","byteLength":{bytes}}}],"bufferViews":[{{"buffer":0,"byteLength":{bytes}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":{}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}]}}"#,
        bytes / 12
    );
    let path = folder.join("heavy.gltf");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn what_promises_more_than_it_holds_is_refused_by_what_is_wrong_with_it() {
    let root = with_scene();
    let promise = SCENE.replace("\"count\": 3", "\"count\": 1000000000").replace("\"count\":3", "\"count\":1000000000");
    assert_ne!(promise, SCENE);
    fs::write(root.path().join("count.gltf"), promise).unwrap();
    refused_at_once(root.path(), &["count.gltf", "--explain"], &["count.gltf", "/accessors/", "1000000000"]);
}

#[test]
fn doctor_finds_this_machine_well_and_a_wrong_embree_dir_out() {
    let root = tempfile::tempdir().unwrap();
    let output = prt_in(root.path(), &["doctor"]);
    let said = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{said}{}", text(&output.stderr));
    let parts =
        ["cpu ", "simd ", "threads ", "memory ", "embree ", "bvh: works: 961 rays", "colour     no", "all well"];
    parts.iter().for_each(|part| assert!(said.contains(part), "{part:?} in {said}"));
    let found = json(&prt_in(root.path(), &["doctor", "--json"]));
    for field in ["prt", "cpu", "memory", "embree", "self_test", "problems", "terminal"] {
        assert!(found.get(field).is_some(), "{field} in {found}");
    }
    assert_eq!(found["self_test"][0]["different"], 0);

    let empty = root.path().join("empty");
    fs::create_dir(&empty).unwrap();
    let output = Command::new(BIN).current_dir(root.path()).arg("doctor").env("EMBREE_DIR", &empty).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stdout));
    assert!(text(&output.stderr).contains("EMBREE_DIR=") && text(&output.stderr).contains("holds no Embree 4"));
    assert_eq!(entries(root.path()), ["empty"]);
}
