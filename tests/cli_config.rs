//! Config files as users meet them: which option wins, for which file, and what paths and patterns mean.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");

/// A scene of one emissive triangle in front of one camera, "Main", of aspect ratio 2.
const SCENE: &str = include_str!("data/triangle.gltf");

fn prt_in(folder: &Path, args: &[&str]) -> Output {
    let quick = ["--accel", "bvh", "--progress", "none", "--json"];
    Command::new(BIN).current_dir(folder).args(args).args(quick).output().expect("the binary was built for this test")
}

/// The entries of `images` of a run that succeeds, by input.
#[track_caller]
fn images(folder: &Path, args: &[&str]) -> BTreeMap<String, Value> {
    let output = prt_in(folder, args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("the run's report");
    let images = report["images"].as_array().expect("images").iter();
    images.map(|image| (image["input"].as_str().expect("a path").replace('\\', "/"), image.clone())).collect()
}

/// A folder with the scene at each of `paths`, and a config.
fn folder(paths: &[&str], config: &str) -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    for path in paths {
        let path = root.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, SCENE).unwrap();
    }
    fs::write(root.path().join("night.toml"), config).unwrap();
    root
}

#[test]
fn later_blocks_win_over_earlier_ones_these_over_the_top_and_the_command_line_over_all() {
    let config = r#"
        spp = 2
        width = 8
        [[file]]
        match = ["lamps/*.gltf", "b.gltf"]
        spp = 3
        seed = 7
        [[file]]
        match = "lamps/b.gltf"
        spp = 5
    "#;
    let root = folder(&["a.gltf", "lamps/a.gltf", "lamps/b.gltf"], config);
    let inputs = ["a.gltf", "lamps", "--name", "{parent}-{stem}", "--config", "night.toml"];
    let spp = |images: &BTreeMap<String, Value>| -> Vec<(u64, u64)> {
        images.values().map(|image| (image["spp"].as_u64().unwrap(), image["seed"].as_u64().unwrap())).collect()
    };
    let all = images(root.path(), &inputs);
    assert_eq!(all.keys().collect::<Vec<_>>(), ["a.gltf", "lamps/a.gltf", "lamps/b.gltf"]);
    assert_eq!(spp(&all), [(2, 0), (3, 7), (5, 7)]);
    assert!(all.values().all(|image| (&image["width"], &image["height"]) == (&8.into(), &4.into())));
    let all = images(root.path(), &[&inputs[..], &["-s", "1"]].concat());
    assert_eq!(spp(&all), [(1, 0), (1, 7), (1, 7)]);
}

#[test]
fn an_option_takes_the_place_of_what_it_excludes_further_down() {
    let config = r#"
        spp = 1
        width = 8
        eye = [0, 0, 3]
        look-at = "0,0,0"
        yfov = 30
        [[file]]
        match = "b.gltf"
        camera = "Main"
        size = "6x5"
    "#;
    let root = folder(&["a.gltf", "b.gltf"], config);
    let of = |image: &Value| format!("{}x{} {}", image["width"], image["height"], image["camera"]);
    let all = images(root.path(), &["a.gltf", "b.gltf", "--config", "night.toml"]);
    // The view's picture is 16:9.
    assert_eq!(all.values().map(of).collect::<Vec<_>>(), ["8x5 \"eye\"", "6x5 \"Main\""]);
    let all = images(root.path(), &["a.gltf", "b.gltf", "--config", "night.toml", "--size", "3x3", "--camera", "0"]);
    assert_eq!(all.values().map(of).collect::<Vec<_>>(), ["3x3 \"Main\"", "3x3 \"Main\""]);
}

#[test]
fn switches_are_true_or_false_and_false_undoes_true() {
    let config = "size = '4x2'\nspp = 1\nno-png = true\n[[file]]\nmatch = 'b.gltf'\nno-png = false\nno-exr = true";
    let root = folder(&["a.gltf", "b.gltf"], config);
    let all = images(root.path(), &["a.gltf", "b.gltf", "--config", "night.toml"]);
    let kinds = |image: &Value| ["exr", "png"].map(|kind| image["outputs"][kind].is_string());
    assert_eq!(all.values().map(kinds).collect::<Vec<_>>(), [[true, false], [false, true]]);
}

#[test]
fn a_config_alone_is_a_batch_and_its_paths_are_relative_to_its_folder() {
    let config = "inputs = ['scenes/*.gltf', 'more']\nout = 'pictures'\nsize = '4x2'\nspp = 1";
    let root = folder(&["proj/scenes/a.gltf", "proj/scenes/b.gltf", "proj/more/deep/c.gltf", "other.gltf"], "");
    fs::rename(root.path().join("night.toml"), root.path().join("proj/night.toml")).unwrap();
    fs::write(root.path().join("proj/night.toml"), config).unwrap();
    let all = images(root.path(), &["--config", "proj/night.toml"]);
    let inputs: Vec<_> = all.keys().collect();
    assert_eq!(inputs, ["proj/more/deep/c.gltf", "proj/scenes/a.gltf", "proj/scenes/b.gltf"]);
    for file in ["a.exr", "b.png", "deep/c.exr", "batch.json"] {
        assert!(root.path().join("proj/pictures").join(file).is_file(), "{file}");
    }
    // INPUT takes the place of `inputs`, and --out is where one types it.
    let all = images(root.path(), &["render", "other.gltf", "--config", "proj/night.toml", "--out", "here"]);
    assert_eq!(all.keys().collect::<Vec<_>>(), ["other.gltf"]);
    assert!(root.path().join("here/other.exr").is_file());
}

#[test]
fn every_option_can_stand_in_a_config() {
    let config = r#"
        inputs = "a.gltf"
        name = "{stem}-x"
        size = "4x2"
        crop = [1, 0, 2, 2]
        exposure = -1.5
        tonemap = "srgb"
        cull-backfaces = true
        scene = 0
        camera = 0
        spp = 0x2
        seed = 18446744073709551615
        integrator = "path"
        f-stop = 2.8
        focus-distance = 3
        aperture-blades = 6
        sensor = 24.0
        max-bounces = 3
        brdf = "appendix-b"
        filter = "box:1"
        default-light = "off"
        exr = "float"
        exr-compression = "piz"
        no-png = false
        no-exr = false
        asset-root = "."
        obj-up = "z"
        obj-scale = 1e-3
        smooth-angle = 30
        out = "o"
        threads = 1
        force = true
        strict = true
        no-report = true
        verbose = false
        quiet = true
    "#;
    let root = folder(&["a.gltf"], config);
    let image = &images(root.path(), &["--config", "night.toml"])["a.gltf"];
    assert_eq!((&image["spp"], &image["seed"]), (&2.into(), &u64::MAX.into()));
    assert!(root.path().join("o/a-x.exr").is_file());
}

#[test]
fn the_example_of_the_documentation_works() {
    let docs = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/cli.md")).unwrap();
    let example = docs.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("an example");
    let root = folder(&["scenes/room.gltf", "scenes/lamps/a.gltf", "scenes/lamps/hero.gltf"], example);
    let all = images(root.path(), &["--config", "night.toml", "--size", "4x2"]);
    let spp: Vec<_> = all.iter().map(|(path, image)| (path.as_str(), image["spp"].as_u64().unwrap())).collect();
    assert_eq!(spp, [("scenes/lamps/a.gltf", 256), ("scenes/lamps/hero.gltf", 1024), ("scenes/room.gltf", 64)]);
    assert!(root.path().join("renders/lamps-hero.exr").is_file());
}

#[test]
fn a_strict_run_fails_for_an_empty_scene() {
    let root = folder(&[], "strict = true");
    fs::write(root.path().join("empty.gltf"), r#"{"asset": {"version": "2.0"}, "scenes": [{}]}"#).unwrap();
    for (args, code) in [(&[][..], 0), (&["--strict"], 1), (&["--config", "night.toml"], 1)] {
        let output = prt_in(root.path(), &[&["empty.gltf"][..], args].concat());
        assert_eq!(output.status.code(), Some(code), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
}
