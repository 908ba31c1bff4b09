//! Damaged files: loading returns, quickly and without a panic.

mod gltf_support;

use gltf_support::{Sample, load_bytes};
use prt::load::{LoadOptions, load};
use serde_json::{Value, json};
use std::time::Instant;
use tempfile::TempDir;

/// Numerical Recipes' LCG with a fixed seed: the same damage in every run.
struct Lcg(u64);

impl Lcg {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n.max(1)
    }
}

/// Flips, cuts, doubles or overwrites.
fn damage(bytes: &[u8], random: &mut Lcg) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..=random.below(4) {
        if out.is_empty() {
            break;
        }
        let at = random.below(out.len());
        match random.below(6) {
            0 => out[at] ^= 1 << random.below(8),
            1 => out[at] = random.below(256) as u8,
            2 => out.truncate(at),
            3 => drop(out.drain(at..(at + 1 + random.below(8)).min(out.len()))),
            4 => {
                // Digits are where indices, counts and offsets live.
                if let Some(k) = out.iter().skip(at).position(u8::is_ascii_digit) {
                    let at = at + k;
                    let digits = b"0123456789-.e";
                    match random.below(3) {
                        0 => out[at] = digits[random.below(digits.len())],
                        1 => drop(out.splice(at..at, [digits[random.below(10)]; 9])),
                        _ => drop(out.splice(at..at, *b"1e30")),
                    }
                }
            }
            _ => {
                let piece = out[at..(at + random.below(40)).min(out.len())].to_vec();
                drop(out.splice(at..at, piece));
            }
        }
    }
    out
}

fn storm(name: &str, damaged: &str, original: &[u8], seed: u64) {
    let dir = TempDir::new().unwrap();
    rich().write(dir.path());
    let mut random = Lcg(seed);
    let (mut loaded, mut slowest) = (0, 0.0_f64);
    for round in 0..3000 {
        let bytes = damage(original, &mut random);
        std::fs::write(dir.path().join(damaged), &bytes).unwrap();
        let start = Instant::now();
        let result = load(&dir.path().join(name), &LoadOptions::default());
        slowest = slowest.max(start.elapsed().as_secs_f64());
        match result {
            Ok(_) => loaded += 1,
            Err(error) => assert!(!error.problem.is_empty(), "round {round}"),
        }
    }
    println!("{damaged}: {loaded} of 3000 still load, slowest {slowest:.3} s");
    assert!(slowest < 2.0, "{slowest} s");
}

/// The sample with one of each form of geometry: a sparse strip of bytes with colours, instanced and morphed, without
/// tangents, below a hidden and a shown node; and a skin.
fn rich() -> Sample {
    let mut s = Sample::new();
    let places = s.add_view(&[1, 0, 2, 0]);
    let values = s.add_view(&[1, 2, 3, 0, 4, 5, 6, 0]);
    let sparse = json!({"count": 2, "indices": {"bufferView": places, "componentType": 5123},
        "values": {"bufferView": values}});
    let positions = s.add(json!({"componentType": 5120, "type": "VEC3", "count": 4, "sparse": sparse}));
    let bytes = s.add_accessor(&[0, 1, 1, 0, 0, 0, 1, 0, 1, 0, 0, 1, 0, 1, 0, 0], 5121, "VEC4", 4);
    let weights = s.add_accessor(&[255, 128, 0, 0].repeat(4), 5121, "VEC4", 4);
    s.json["accessors"][weights]["normalized"] = json!(true);
    let strip = s.add_accessor(&[0, 1, 3, 2, 2, 1], 5121, "SCALAR", 6);
    let places = s.add_accessor(&gltf_support::floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), 5126, "VEC3", 2);
    let attributes = json!({"POSITION": positions, "NORMAL": 1, "TEXCOORD_0": 2, "COLOR_0": weights,
        "JOINTS_0": bytes, "WEIGHTS_0": weights});
    let primitive = json!({"attributes": attributes, "indices": strip, "mode": 5, "material": 0,
        "targets": [{"POSITION": 0}]});
    let instancing = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places, "SCALE": places}}});
    s.set("/extensionsUsed/-", json!("KHR_mesh_quantization"))
        .set("/meshes/-", json!({"primitives": [primitive.clone(), primitive], "weights": [0.5]}))
        .set("/skins", json!([{"joints": [0, 1]}]))
        .set("/nodes/0/extensions", json!({"KHR_node_visibility": {"visible": true}}))
        .set("/nodes/-", json!({"mesh": 1, "extensions": instancing}))
        .set("/nodes/-", json!({"mesh": 1, "skin": 0, "weights": [0.25]}))
        .set("/scenes/0/nodes", json!([0, 1, 2, 3, 4]))
}

#[test]
fn rich_sample_is_sound() {
    let scene = rich().load().unwrap();
    assert_eq!((scene.instances.len(), scene.meshes.len()), (1 + 4 + 2, 1 + 2 + 2));
}

#[test]
fn damaged_json_never_panics() {
    storm("scene.gltf", "scene.gltf", rich().json.to_string().as_bytes(), 1);
}

#[test]
fn damaged_glb_never_panics() {
    storm("scene.glb", "scene.glb", &rich().glb(), 2);
}

#[test]
fn damaged_buffers_and_images_never_panic() {
    storm("scene.gltf", "scene.bin", &rich().bin, 3);
}

/// JSON pointers of every value.
fn places(value: &Value, path: &str, out: &mut Vec<String>) {
    match value {
        Value::Array(list) => list.iter().enumerate().for_each(|(i, v)| places(v, &format!("{path}/{i}"), out)),
        Value::Object(map) => map.iter().for_each(|(k, v)| places(v, &format!("{path}/{k}"), out)),
        _ => {}
    }
    out.push(path.to_owned());
}

#[test]
fn well_formed_json_with_wild_values_never_panics() {
    let sample = rich();
    let bytes = sample.bin.clone();
    let uri = format!("data:;base64,{}", gltf_support::base64(&bytes));
    let sample = sample.set("/buffers/0/uri", json!(uri));
    let wild = [
        json!(-1),
        json!(0),
        json!(1),
        json!(2),
        json!(7),
        json!(255),
        json!(65535),
        json!(4294967295_u32),
        json!(4294967296_u64),
        json!(9007199254740993_u64),
        json!(18446744073709551615_u64),
        json!(1e30),
        json!(1e300),
        json!(-0.5),
        json!(0.5),
        json!(""),
        json!("x"),
        json!([]),
        json!({}),
        json!(null),
        json!(true),
        json!([0, 0, 0]),
    ];
    let mut all = Vec::new();
    places(&sample.json, "", &mut all);
    let mut loaded = 0;
    let start = Instant::now();
    let mut tried = 0;
    for place in &all {
        for value in &wild {
            let mut json = sample.json.clone();
            *json.pointer_mut(place).unwrap() = value.clone();
            tried += 1;
            match load_bytes("a.gltf", json.to_string().as_bytes()) {
                Ok(_) => loaded += 1,
                Err(error) => assert!(!error.problem.is_empty(), "{place} = {value}"),
            }
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    println!("{loaded} of {tried} still load, {seconds:.1} s");
    assert!(seconds < 0.05 * f64::from(tried));
}
