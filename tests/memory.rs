//! Estimates of memory: of reading against what comes of it, of rendering against what a process takes.

use glam::DMat4;
use prt::load::{LoadOptions, estimate, load};
use prt::render::memory::{Encoded, MemoryEstimate, scene_bytes};
use prt::render::{AccelChoice, RenderSettings};
use prt::scene::{Instance, MaterialId, SceneBuilder};
use prt::shape::Mesh;
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
    assert!((12_000_000 * 7 - 1000..12_000_000 * 12).contains(&(large - small)), "{large} {small}");
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
fn estimated_and_measured(scene: &Path, more: &[&str]) -> Option<(f64, f64)> {
    let root = tempfile::tempdir().unwrap();
    let run = |extra: &[&str]| -> Value {
        let mut command = Command::new(env!("CARGO_BIN_EXE_prt-batch"));
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
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene);
        let Some((estimated, measured)) = estimated_and_measured(&file, more) else {
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

/// A strip of `quads` quads of 2 m, placed `n` times by `EXT_mesh_gpu_instancing`, 10 m apart.
fn placed_strips(folder: &Path, quads: usize, n: usize) -> PathBuf {
    let side = (n as f64).sqrt().ceil() as usize;
    let strip = (0..2 * (quads + 1)).map(|k| [2.0 * (k / 2) as f32 / quads as f32, (k % 2) as f32, 0.0]);
    let places = (0..n).map(|i| [10.0 * (i % side) as f32, 0.0, -10.0 * (i / side) as f32]);
    let points: Vec<[f32; 3]> = strip.chain(places).collect();
    let quad = |q: u32| [2 * q, 2 * q + 2, 2 * q + 3, 2 * q, 2 * q + 3, 2 * q + 1];
    let indices: Vec<u32> = (0..quads as u32).flat_map(quad).collect();
    let floats = points.iter().flatten().flat_map(|x| x.to_le_bytes());
    let bytes: Vec<u8> = floats.chain(indices.iter().flat_map(|i| i.to_le_bytes())).collect();
    fs::write(folder.join("strips.bin"), &bytes).unwrap();
    let (corners, all) = (2 * (quads + 1), bytes.len());
    let (from, to) = (12 * corners, 12 * points.len());
    let gltf = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"extensionsUsed":["EXT_mesh_gpu_instancing"],
        "nodes":[{{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":1}}}}}}}}],
        "buffers":[{{"uri":"strips.bin","byteLength":{all}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{from}}},{{"buffer":0,"byteOffset":{from},"byteLength":{}}},
        {{"buffer":0,"byteOffset":{to},"byteLength":{}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":{corners},"min":[0,0,0],"max":[2,1,0]}},
        {{"bufferView":1,"componentType":5126,"type":"VEC3","count":{n}}},
        {{"bufferView":2,"componentType":5125,"type":"SCALAR","count":{}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":2}}]}}]}}"#,
        to - from,
        all - to,
        indices.len()
    );
    let file = folder.join("strips.gltf");
    fs::write(&file, gltf).unwrap();
    file
}

#[test]
fn what_placements_take_is_near_the_estimate() {
    // 200,000 placements are most of it; merged, their 200 million triangles would take 40 GB. Estimated is 1.43 of what is
    // taken: twice the trees, as there might be a front.
    let root = tempfile::tempdir().unwrap();
    let file = placed_strips(root.path(), 500, 200_000);
    let Some((estimated, measured)) =
        estimated_and_measured(&file, &["--size", "32x18", "-s", "1", "--max-bounces", "0"])
    else {
        println!("skipped: this system does not tell a process's peak of memory");
        return;
    };
    let ratio = estimated / measured;
    println!("{estimated} estimated, {measured} measured: {ratio}");
    assert!(measured > 8e7 && (0.9..=1.5).contains(&ratio), "{estimated} estimated, {measured} measured: {ratio}");
}

#[test]
fn long_diagonal_triangles_are_estimated_with_the_parts_they_may_be_cut_into() {
    // 1000 strips across a cube, along its axes or askew.
    let bytes = |slant: f32, accel| {
        let strip = |k: u32| {
            let (x, y) = ((k % 32) as f32 / 32.0, (k / 32) as f32 / 32.0);
            [[x, y, 0.0], [x + 0.001, y, 0.0], [x + slant, y + slant, 1.0]]
        };
        let positions: Vec<[f32; 3]> = (0..1000).flat_map(strip).collect();
        let indices = (0..1000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mut builder = SceneBuilder::new(0);
        builder.add_material(prt::material::Material::default());
        let mesh = builder.add_mesh(Mesh::plain("strips", positions, indices, MaterialId(0)));
        // Where it stands matters as little as how large it is.
        let world_from_object =
            DMat4::from_translation(glam::DVec3::X * 10.0) * DMat4::from_scale(glam::DVec3::splat(3.0));
        builder.add_instance(Instance { mesh, world_from_object, name: String::new() });
        let settings = RenderSettings { accel, ..RenderSettings::default() };
        let all = prt::render::memory::estimate(&builder.finish(), &settings, Encoded { exr: true, png: false });
        all.prepared + all.building
    };
    let [straight, askew] = [0.0, 0.7].map(|slant| bytes(slant, AccelChoice::Bvh));
    // Two trees, 500 parts, 52 bytes a part held and 106 while it is built.
    assert_eq!(askew, straight + 2 * 500 * (52 + 106));
    assert_eq!(bytes(0.7, AccelChoice::Embree), bytes(0.0, AccelChoice::Embree), "only the in-house BVH splits");
}
