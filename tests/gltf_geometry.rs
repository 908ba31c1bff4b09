//! Every form in which glTF stores geometry: component types, sparse and missing data, modes, sets of attributes,
//! tangents that are not there.

mod gltf_support;

use gltf_support::{INDICES, POSITIONS, Sample, UVS, floats};
use prt::scene::Scene;
use serde_json::json;

const PRIMITIVE: &str = "/meshes/0/primitives/0";
const ATTRIBUTES: &str = "/meshes/0/primitives/0/attributes";

/// The sample with a normal map but without supplied tangents.
fn without_tangents() -> Sample {
    Sample::new().remove(&format!("{ATTRIBUTES}/TANGENT"))
}

fn quantized() -> Sample {
    Sample::new()
        .set("/extensionsUsed/-", json!("KHR_mesh_quantization"))
        .set("/extensionsRequired", json!(["KHR_mesh_quantization"]))
}

#[track_caller]
fn warned(scene: &Scene, parts: &[&str]) {
    assert!(scene.warnings.iter().any(|w| parts.iter().all(|p| w.contains(p))), "{parts:?}: {:?}", scene.warnings);
}

#[test]
fn quantized_positions_are_what_their_type_says() {
    for (component, normalized, bytes, second) in [
        (5120, false, vec![0, 0, 0, 0, 0x80, 2, 3, 0, 1, 1, 1, 0, 0, 1, 0, 0], [-128.0, 2.0, 3.0]),
        (5120, true, vec![0, 0, 0, 0, 0x80, 127, 0, 0, 1, 1, 1, 0, 0, 1, 0, 0], [-1.0, 1.0, 0.0]),
        (5121, true, vec![0, 0, 0, 0, 255, 51, 0, 0, 1, 1, 1, 0, 0, 1, 0, 0], [1.0, 0.2, 0.0]),
    ] {
        let mut sample = quantized();
        let index = sample.add_accessor(&bytes, component, "VEC3", 4);
        let view = sample.json["accessors"][index]["bufferView"].as_u64().unwrap();
        sample.json["bufferViews"][view as usize]["byteStride"] = json!(4);
        sample.json["accessors"][index]["normalized"] = json!(normalized);
        let scene = sample.set(&format!("{ATTRIBUTES}/POSITION"), json!(index)).load().unwrap();
        assert_eq!(scene.meshes[0].positions[1], second, "{component}");
    }
}

#[test]
fn quantized_normals_tangents_and_coordinates_are_read() {
    let mut sample = quantized();
    let normals = sample.add_accessor(&[0, 0, 127, 0].repeat(4), 5120, "VEC3", 4);
    sample.json["bufferViews"][6]["byteStride"] = json!(4);
    let tangents = sample.add_accessor(&[127, 0, 0, 0x81].repeat(4), 5120, "VEC4", 4);
    let shorts: Vec<u8> = [[2_u16, 3]; 4].as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    let uvs = sample.add_accessor(&shorts, 5123, "VEC2", 4);
    for i in [normals, tangents] {
        sample.json["accessors"][i]["normalized"] = json!(true);
    }
    let scene = sample
        .set(ATTRIBUTES, json!({"POSITION": 0, "NORMAL": normals, "TANGENT": tangents, "TEXCOORD_0": uvs}))
        .load()
        .unwrap();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.normals.as_deref(), Some(&[[0.0, 0.0, 1.0]; 4][..]));
    assert_eq!(mesh.tangents.as_deref(), Some(&[[1.0, 0.0, 0.0, -1.0]; 4][..]));
    assert_eq!(mesh.uv_sets, [[[2.0, 3.0]; 4]]);
}

#[test]
fn sparse_elements_replace_those_of_the_view_or_zeros() {
    for (component, places) in [(5121, vec![1, 3]), (5123, vec![1, 0, 3, 0]), (5125, vec![1, 0, 0, 0, 3, 0, 0, 0])] {
        for with_view in [true, false] {
            let mut sample = Sample::new();
            let indices = sample.add_view(&places);
            let values = sample.add_view(&floats(&[5.0, 6.0, 7.0, 8.0, 9.0, 10.0]));
            let sparse = json!({"count": 2, "indices": {"bufferView": indices, "componentType": component},
                "values": {"bufferView": values}});
            sample = sample.set("/accessors/0/sparse", sparse);
            if !with_view {
                // A stray byteOffset means nothing without a view.
                sample = sample.remove("/accessors/0/bufferView").set("/accessors/0/byteOffset", json!(3));
            }
            let mut expected = if with_view { POSITIONS } else { [[0.0; 3]; 4] };
            (expected[1], expected[3]) = ([5.0, 6.0, 7.0], [8.0, 9.0, 10.0]);
            assert_eq!(sample.load().unwrap().meshes[0].positions, expected, "{component} {with_view}");
        }
    }
}

#[test]
fn accessors_without_a_view_are_zeros() {
    let scene = Sample::new().remove("/accessors/2/bufferView").load().unwrap();
    assert_eq!(scene.meshes[0].uv_sets, [[[0.0; 2]; 4]]);
    let nothing = Sample::new().remove("/accessors/0/bufferView").load().unwrap();
    assert_eq!(nothing.triangle_count(), 0);
    warned(&nothing, &["POSITION", "all zero"]);
    let indices = Sample::new().remove("/accessors/4/bufferView").load().unwrap();
    assert_eq!(indices.triangle_count(), 0);
    warned(&indices, &["2 triangles dropped", "without area"]);
}

#[test]
fn strips_and_fans_face_the_way_lists_do() {
    for (mode, corners, expected) in
        [(5, [0_u16, 1, 3, 2], vec![[0, 1, 3], [1, 2, 3]]), (6, [0, 1, 2, 3], vec![[1, 2, 0], [2, 3, 0]])]
    {
        let mut sample = Sample::new();
        let bytes: Vec<u8> = corners.iter().flat_map(|c| c.to_le_bytes()).collect();
        let index = sample.add_accessor(&bytes, 5123, "SCALAR", 4);
        let scene = sample
            .set(&format!("{PRIMITIVE}/mode"), json!(mode))
            .set(&format!("{PRIMITIVE}/indices"), json!(index))
            .load()
            .unwrap();
        assert_eq!(scene.meshes[0].indices, expected);
        for t in &scene.meshes[0].indices {
            let [a, b, c] = t.map(|v| glam::Vec3::from(POSITIONS[v as usize]));
            assert!((b - a).cross(c - a).z > 0.0, "mode {mode}: {t:?} faces away");
        }
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
}

#[test]
fn points_and_lines_are_counted_and_skipped() {
    for (mode, what) in [(0, "6 points"), (1, "3 lines"), (2, "6 lines"), (3, "5 lines")] {
        let scene = Sample::new().set(&format!("{PRIMITIVE}/mode"), json!(mode)).load().unwrap();
        assert_eq!(scene.triangle_count(), 0);
        let skipped = scene.skipped.iter().find(|s| s.what == "meshes/0/primitives/0").expect("is listed");
        assert!(skipped.why.contains(what), "{}", skipped.why);
        warned(&scene, &["points or lines"]);
    }
}

#[test]
fn further_sets_and_missing_ones() {
    let missing = Sample::new().remove(&format!("{ATTRIBUTES}/TEXCOORD_0")).load().unwrap();
    assert_eq!(missing.meshes[0].uv_sets, [[[0.0; 2]; 4]]);
    warned(&missing, &["TEXCOORD_0", "primitives/0", "/materials/0", "taken as 0"]);
    // A set that no texture reads is not opened.
    let unread = Sample::new().set(&format!("{ATTRIBUTES}/TEXCOORD_1"), json!(0)).load().unwrap();
    assert_eq!(unread.meshes[0].uv_sets, [UVS]);
}

#[test]
fn vertex_colors_of_every_type_are_read() {
    let mut float = Sample::new();
    let index = float.add_accessor(&floats(&[2.0, 0.5, 0.25].repeat(4)), 5126, "VEC3", 4);
    let scene = float.set(&format!("{ATTRIBUTES}/COLOR_0"), json!(index)).load().unwrap();
    assert_eq!(scene.meshes[0].colors.as_deref(), Some(&[[2.0, 0.5, 0.25, 1.0]; 4][..]));
    let mut bytes = Sample::new();
    let index = bytes.add_accessor(&[255, 0, 51, 0].repeat(4), 5121, "VEC4", 4);
    bytes.json["accessors"][index]["normalized"] = json!(true);
    let scene = bytes
        .set(&format!("{ATTRIBUTES}/COLOR_0"), json!(index))
        .set(&format!("{ATTRIBUTES}/COLOR_1"), json!(index))
        .load()
        .unwrap();
    assert_eq!(scene.meshes[0].colors.as_deref(), Some(&[[1.0, 0.0, 0.2, 0.0]; 4][..]));
    warned(&scene, &["COLOR_0"]);
}

#[test]
fn missing_tangents_are_those_that_exporters_write() {
    let scene = without_tangents().load().unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let supplied = Sample::new().load().unwrap();
    assert_eq!(scene.meshes[0].tangents, supplied.meshes[0].tangents);
    assert_eq!(scene.meshes[0].indices, supplied.meshes[0].indices);
}

#[test]
fn without_normals_tangents_of_the_file_are_ignored_and_flat_normals_made() {
    let scene = Sample::new()
        .remove(&format!("{ATTRIBUTES}/NORMAL"))
        .poke(128, &floats(&[0.0, 1.0, 0.0, -1.0].repeat(4)))
        .load()
        .unwrap();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.normals.as_deref(), Some(&[[0.0, 0.0, 1.0]; 4][..]));
    assert_eq!(mesh.tangents.as_deref(), Some(&[[1.0, 0.0, 0.0, 1.0]; 4][..]));
}

#[test]
fn tangents_that_cannot_serve_are_replaced_with_a_count() {
    let scene = Sample::new().poke(128, &floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 1.0])).load().unwrap();
    warned(&scene, &["2 tangents"]);
    for t in scene.meshes[0].tangents.as_ref().unwrap() {
        assert!(t[2] == 0.0 && (t[0].hypot(t[1]) - 1.0).abs() < 1e-6 && t[3].abs() == 1.0, "{t:?}");
    }
}

#[test]
fn restart_values_and_bad_sparse_data_are_refused_by_place() {
    let mut sample = Sample::new();
    let index = sample.add_accessor(&[0, 1, 255, 2], 5121, "SCALAR", 4);
    for mode in [0, 2, 4, 5, 6] {
        let error = sample
            .clone()
            .set(&format!("{PRIMITIVE}/mode"), json!(mode))
            .set(&format!("{PRIMITIVE}/indices"), json!(index))
            .error();
        assert_eq!(error.at.place, format!("{PRIMITIVE}/indices"));
        assert!(error.problem.contains("255: the primitive restart value"), "{error}");
    }
    // Also where there are so many vertices that the value could be meant.
    let mut large = sample.clone().remove("/meshes/0/primitives/0/material");
    let positions = large.add_accessor(&floats(&[1.0; 900]), 5126, "VEC3", 300);
    let large =
        large.set(ATTRIBUTES, json!({"POSITION": positions})).set(&format!("{PRIMITIVE}/indices"), json!(index));
    assert!(large.error().problem.contains("255: the primitive restart value"));
    let indices = sample.add_view(&[1, 1, 9, 0]);
    let sparse = |count: u64, offset: u64, component: u32| {
        json!({"count": count, "values": {"bufferView": 0},
            "indices": {"bufferView": indices, "byteOffset": offset, "componentType": component}})
    };
    for (sparse, place, problem) in [
        (sparse(2, 0, 5121), "/accessors/0/sparse/indices", "index 1 is 1: not more"),
        (sparse(1, 2, 5121), "/accessors/0/sparse/indices", "index 0 is 9: there is no such"),
        (sparse(2, 3, 5121), "/accessors/0/sparse/indices", "past the end"),
        (sparse(1, 1, 5123), "/accessors/0/sparse/indices", "misaligned"),
        (sparse(1, 0, 5126), "/accessors/0/sparse/indices/componentType", "5126"),
        (sparse(5, 0, 5121), "/accessors/0/sparse/count", "5 is too many"),
        (sparse(u64::MAX, 0, 5121), "/accessors/0/sparse/count", "too many"),
    ] {
        let error = sample.clone().set("/accessors/0/sparse", sparse).error();
        assert_eq!(error.at.place, place, "{error}");
        assert!(error.problem.contains(problem), "{error}");
    }
}

#[test]
fn absurd_counts_do_not_allocate() {
    for count in [1_u64 << 31, 1 << 53, u64::MAX] {
        let error = Sample::new().remove("/accessors/0/bufferView").set("/accessors/0/count", json!(count)).error();
        assert_eq!(error.at.place, "/accessors/0/count", "{error}");
        let error = Sample::new().set("/accessors/0/count", json!(count)).error();
        assert_eq!(error.at.place, "/accessors/0", "{error}");
    }
}

#[test]
fn interleaved_and_split_reads_agree_beyond_one_chunk() {
    // 30,000 vertices of 20 bytes are more than is converted at a time.
    let n = 30_000;
    let vertex = |i: usize| [i as f32, (i % 7) as f32, (i % 3) as f32, i as f32 * 0.5, 1.0];
    let interleaved: Vec<u8> = (0..n).flat_map(|i| floats(&vertex(i))).collect();
    let mut sample = Sample::new();
    let view = sample.add_view(&interleaved);
    sample.json["bufferViews"][view]["byteStride"] = json!(20);
    let positions = sample.add(json!({"bufferView": view, "componentType": 5126, "type": "VEC3", "count": n}));
    let uvs =
        sample.add(json!({"bufferView": view, "byteOffset": 12, "componentType": 5126, "type": "VEC2", "count": n}));
    let attributes = json!({"POSITION": positions, "TEXCOORD_0": uvs});
    let scene = sample
        .set(ATTRIBUTES, attributes)
        .remove("/materials/0/normalTexture")
        .set("/accessors/4/count", json!(INDICES.len()))
        .load()
        .unwrap();
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.positions.len(), mesh.uv_sets[0].len()), (n, n));
    for i in 0..n {
        let [x, y, z, u, v] = vertex(i);
        assert_eq!((mesh.positions[i], mesh.uv_sets[0][i]), ([x, y, z], [u, v]), "vertex {i}");
    }
}
