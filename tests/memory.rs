//! Estimates of memory: of reading against what comes of it, of rendering against what a process takes.

use prt::load::{LoadOptions, estimate, load};
use prt::render::memory::{MemoryEstimate, scene_bytes};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut scenes: Vec<_> = files.filter(|f| f.extension().is_some_and(|e| e == "gltf" || e == "glb")).collect();
    scenes.sort();
    scenes
}

#[test]
fn reading_takes_more_than_its_scene_and_not_many_times_as_much() {
    let obj = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/reference/cornell/cornell.obj");
    for file in scenes().into_iter().chain([obj]) {
        let reading = estimate(&file, &LoadOptions::default()).expect("a sound file").bytes;
        let scene = scene_bytes(&load(&file, &LoadOptions::default()).unwrap().0);
        assert!(reading >= scene, "{}: {reading} for a scene of {scene}", file.display());
        assert!(reading < 5 * scene + (1 << 20), "{}: {reading} for a scene of {scene}", file.display());
    }
}

#[test]
fn a_file_that_the_loader_refuses_has_no_estimate_and_pictures_count_by_their_header() {
    let root = tempfile::tempdir().unwrap();
    let of = |png: &[u8], count: u64| {
        fs::write(root.path().join("a.png"), png).unwrap();
        let gltf = format!(
            r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "buffers":[{{"uri":"a.png","byteLength":24}}],"bufferViews":[{{"buffer":0,"byteLength":24}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":{count}}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
            "textures":[{{"source":0}}],"images":[{{"uri":"a.png"}}]}}"#
        );
        fs::write(root.path().join("a.gltf"), gltf).unwrap();
        estimate(&root.path().join("a.gltf"), &LoadOptions::default()).map(|e| e.bytes)
    };
    let png = |width: u32, height: u32| {
        let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
        bytes.extend(width.to_be_bytes());
        bytes.extend(height.to_be_bytes());
        bytes.extend([8, 2, 0, 0, 0]);
        bytes
    };
    let small = of(&png(4, 4), 2).unwrap();
    let large = of(&png(4000, 3000), 2).unwrap();
    // R, G and B as decoded, four channels, and what is kept of them: those four.
    assert!((12_000_000 * 7 - 100..12_000_000 * 12).contains(&(large - small)), "{large} {small}");
    // The decoder refuses these by their size, before it allocates anything.
    assert!(of(&png(60_000, 60_000), 2).unwrap() < small + 1000);
    // The loader refuses these: the bytes are not there.
    assert_eq!(of(&png(4, 4), 1_000_000_000), None);
    assert_eq!(of(&png(4, 4), u64::MAX), None);
}

#[test]
fn the_parts_at_the_peak_add_up_to_it() {
    let all = MemoryEstimate {
        program: 1,
        loading: 100,
        left_over: 2,
        scene: 4,
        prepared: 8,
        building: 16,
        film: 32,
        files: 20,
    };
    let sum = |e: &MemoryEstimate| e.at_peak().iter().map(|(_, bytes)| bytes).sum::<u64>();
    assert_eq!((all.peak(), sum(&all)), (101, 101));
    let rendering = MemoryEstimate { loading: 0, ..all };
    assert_eq!((rendering.peak(), sum(&rendering)), (47, 47));
    let building = MemoryEstimate { building: 64, ..rendering };
    assert_eq!((building.peak(), sum(&building)), (79, 79));
    assert_eq!(MemoryEstimate { film: u64::MAX, ..all }.peak(), u64::MAX);
}

/// What the program says a picture will take, and what the process that rendered it took.
fn estimated_and_measured(scene: &str, more: &[&str]) -> Option<(f64, f64)> {
    let root = tempfile::tempdir().unwrap();
    let run = |extra: &[&str]| -> Value {
        let mut command = Command::new(env!("CARGO_BIN_EXE_prt-batch"));
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene);
        command.current_dir(root.path()).arg(scene).args(["--accel", "bvh", "--json", "--progress", "none"]);
        let output = command.args(more).args(extra).output().unwrap();
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let (plan, report) = (run(&["--explain"]), run(&[]));
    let measured = report["images"][0]["peak_rss_bytes"].as_f64()?;
    Some((plan["images"][0]["memory"]["peak"].as_f64().unwrap(), measured))
}

#[test]
fn what_a_process_takes_is_near_the_estimate_and_never_more_for_large_pictures() {
    // Mostly film of four blocks and of one, mostly scene.
    for (scene, more, least) in [
        ("cornell.gltf", &["--size", "1200x800", "-s", "4", "--max-bounces", "0"][..], 1.0),
        ("cornell.gltf", &["--size", "1600x1000", "-s", "1", "--max-bounces", "0"], 1.0),
        ("metals.gltf", &["--size", "64x36", "-s", "1"], 0.9),
    ] {
        let Some((estimated, measured)) = estimated_and_measured(scene, more) else {
            println!("skipped: this system does not tell a process's peak of memory");
            return;
        };
        let ratio = estimated / measured;
        assert!(
            (least..=1.5).contains(&ratio),
            "{scene} {more:?}: {estimated} estimated, {measured} measured: {ratio}"
        );
    }
}
