//! What of glTF is read, and how.

mod gltf_support;

use gltf_support::{INDICES, POSITIONS, Sample, UVS, base64, load_bytes, png};
use prt::camera::Projection;
use prt::light::Light;
use prt::load::{LoadOptions, load};
use prt::scene::Scene;
use prt::texture::{Filter, Texels, Wrap};
use serde_json::json;
use std::f32::consts::FRAC_PI_4;
use tempfile::TempDir;

#[test]
fn sample_is_read_whole() {
    let scene = Sample::new().load().unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert!(scene.skipped.is_empty(), "{:?}", scene.skipped);
    assert_eq!((scene.instances.len(), scene.triangle_count()), (1, 2));
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions, POSITIONS);
    assert_eq!(mesh.normals.as_deref(), Some(&[[0.0, 0.0, 1.0]; 4][..]));
    assert_eq!(mesh.uv_sets, [UVS]);
    assert_eq!(mesh.tangents.as_deref(), Some(&[[1.0, 0.0, 0.0, 1.0]; 4][..]));
    assert_eq!(mesh.indices.as_flattened(), INDICES.map(u32::from));

    let material = &scene.materials[mesh.material.index()];
    assert_eq!(material.base_color.factor, [0.1, 0.2, 0.3]);
    assert_eq!((material.metallic.factor, material.roughness.factor), (0.4, 0.5));
    assert_eq!(material.metallic.texture, material.roughness.texture);
    assert_eq!((material.normal.factor, material.specular.factor), (0.7, 0.6));
    assert_eq!(material.specular_color.factor, [1.0, 2.0, 3.0]);
    assert_eq!(material.emission.factor, [20.0, 10.0, 0.0]);
    assert!(material.double_sided);

    assert_eq!((scene.textures.len(), scene.images.len()), (1, 1));
    let texture = &scene.textures[0];
    assert_eq!(
        (texture.wrap_u, texture.wrap_v, texture.filter),
        (Wrap::ClampToEdge, Wrap::MirroredRepeat, Filter::Nearest)
    );
    assert_eq!(scene.images[0].texels, Texels::Rgba8(vec![[255, 0, 0, 255], [0, 255, 0, 255]]));

    assert_eq!(scene.cameras[0].name, "eye");
    assert_eq!(scene.cameras[0].world_from_camera.w_axis.truncate().to_array(), [0.0, 0.0, 5.0]);
    let Projection::Perspective { yfov, aspect_ratio } = scene.cameras[0].projection else { panic!("perspective") };
    assert_eq!((yfov, aspect_ratio), (0.5, None));
    let expected = Light::Spot { intensity: [10.0, 5.0, 2.5], inner_cone: 0.0, outer_cone: FRAC_PI_4 };
    assert_eq!(scene.lights[0].light, expected);
}

#[test]
fn glb_and_data_uri_give_the_same_scene_as_separate_files() {
    let sample = Sample::new();
    // Everything but the files that it was made from.
    let shown = |scene: Scene| format!("{:?}", Scene { sources: Vec::new(), ..scene });
    let expected = shown(sample.load().unwrap());
    assert_eq!(shown(load_bytes("scene.glb", &sample.glb()).unwrap()), expected);
    let uri = format!("data:application/octet-stream;base64,{}", base64(&sample.bin));
    let embedded = sample.set("/buffers/0/uri", json!(uri));
    assert_eq!(shown(load_bytes("a.gltf", embedded.json.to_string().as_bytes()).unwrap()), expected);
}

#[test]
fn all_index_widths_and_no_indices_give_the_same_triangles() {
    let base = Sample::new();
    let offset = base.bin.len();
    for (component, bytes) in [
        (5121, INDICES.iter().map(|&i| i as u8).collect::<Vec<u8>>()),
        (5125, INDICES.iter().flat_map(|&i| u32::from(i).to_le_bytes()).collect()),
    ] {
        let mut sample = base.clone();
        sample.bin.resize(offset.next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": sample.bin.len(), "byteLength": bytes.len()});
        sample.bin.extend(&bytes);
        let length = sample.bin.len();
        let scene = sample
            .set("/bufferViews/4", view)
            .set("/buffers/0/byteLength", json!(length))
            .set("/accessors/4/componentType", json!(component))
            .load()
            .unwrap();
        assert_eq!(scene.meshes[0].indices, [[0, 1, 2], [0, 2, 3]], "{component}");
    }
    let scene = base.remove("/meshes/0/primitives/0/indices").load().unwrap();
    assert_eq!(scene.meshes[0].indices, [[0, 1, 2]]);
    assert!(scene.warnings[0].contains("not a multiple of 3"), "{:?}", scene.warnings);
}

#[test]
fn interleaved_vertices_are_read_with_their_stride() {
    let mut sample = Sample::new();
    let mut bin = Vec::new();
    for (p, uv) in POSITIONS.iter().zip(UVS) {
        p.iter().chain(&uv).for_each(|v| bin.extend(v.to_le_bytes()));
    }
    sample.bin.resize(sample.bin.len().next_multiple_of(4), 0);
    let view = json!({"buffer": 0, "byteOffset": sample.bin.len(), "byteLength": 80, "byteStride": 20});
    sample.bin.extend(bin);
    let length = sample.bin.len();
    let scene = sample
        .set("/bufferViews/0", view.clone())
        .set("/bufferViews/2", view)
        .set("/accessors/2/byteOffset", json!(12))
        .set("/buffers/0/byteLength", json!(length))
        .load()
        .unwrap();
    assert_eq!(scene.meshes[0].positions, POSITIONS);
    assert_eq!(scene.meshes[0].uv_sets, [UVS]);
}

#[test]
fn normalized_integer_uvs_become_zero_to_one() {
    let bytes: Vec<u8> = [0, 255, 255, 255, 255, 0, 0, 0].to_vec();
    let scene = Sample::new()
        .set("/accessors/2/componentType", json!(5121))
        .set("/accessors/2/normalized", json!(true))
        .poke(96, &bytes)
        .load()
        .unwrap();
    assert_eq!(scene.meshes[0].uv_sets, [UVS]);
}

#[test]
fn transforms_compose_down_the_tree() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let scene = Sample::new()
        .set("/nodes/0", json!({"mesh": 0, "translation": [1, 2, 3], "rotation": [0, half, 0, half], "children": [3]}))
        .set("/nodes/-", json!({"mesh": 0, "matrix": [2,0,0,0, 0,3,0,0, 0,0,4,0, 10,0,0,1]}))
        .load()
        .unwrap();
    assert_eq!((scene.instances.len(), scene.meshes.len()), (2, 1));
    // 90 degrees about y takes +x to -z.
    let world = scene.instances[1].world_from_object;
    let point = world.transform_point3(glam::DVec3::new(1.0, 1.0, 0.0));
    assert!(point.abs_diff_eq(glam::DVec3::new(1.0, 5.0, 3.0 - 12.0), 1e-6), "{point}");
}

#[test]
fn cameras_and_lights_lose_the_scale_of_their_nodes() {
    let scene = Sample::new()
        .set("/nodes/1/scale", json!([-2, 3, 4]))
        .set("/nodes/2/scale", json!([0.5, 0.5, 0.5]))
        .load()
        .unwrap();
    for rigid in [scene.cameras[0].world_from_camera, scene.lights[0].world_from_light] {
        let rotation = glam::DMat3::from_mat4(rigid);
        assert!(rotation.abs_diff_eq(glam::DMat3::IDENTITY, 1e-12), "{rotation}");
    }
}

#[test]
fn mesh_without_material_gets_the_default_and_no_uvs() {
    let scene = Sample::new().remove("/meshes/0/primitives/0/material").load().unwrap();
    let mesh = &scene.meshes[0];
    assert!(mesh.uv_sets.is_empty() && mesh.tangents.is_none() && mesh.normals.is_some());
    let material = &scene.materials[mesh.material.index()];
    assert_eq!((material.base_color.factor, material.metallic.factor), ([1.0; 3], 1.0));
    let skipped: Vec<_> = scene.skipped.iter().map(|s| s.what.as_str()).collect();
    assert_eq!(skipped, ["materials/0", "images/0"]);
}

#[test]
fn what_the_scene_does_not_reach_is_not_opened_and_is_listed() {
    let scene = Sample::new()
        .set("/images/-", json!({"uri": "missing.png"}))
        .set("/buffers/-", json!({"uri": "missing.bin", "byteLength": 4}))
        .set("/meshes/-", json!({"primitives": [{"attributes": {"POSITION": 99}}]}))
        .set("/animations", json!([{"samplers": [], "channels": []}]))
        .set("/materials/0/occlusionTexture", json!({"index": 99}))
        .load()
        .unwrap();
    let skipped: Vec<_> = scene.skipped.iter().map(|s| s.what.as_str()).collect();
    assert_eq!(skipped, ["materials/0/occlusionTexture", "meshes/1", "images/1", "animations/0"]);
}

#[test]
fn shared_images_are_decoded_once() {
    let scene = Sample::new()
        .set("/textures/-", json!({"source": 0}))
        .set("/materials/0/emissiveTexture", json!({"index": 1}))
        .load()
        .unwrap();
    assert_eq!((scene.textures.len(), scene.images.len()), (2, 1));
    assert_eq!(scene.textures[1].wrap_u, Wrap::Repeat);
    assert_eq!(scene.textures[1].filter, Filter::Bilinear);
}

#[test]
fn images_come_from_files_with_escaped_names_and_wrong_media_types() {
    let dir = TempDir::new().unwrap();
    std::fs::create_dir(dir.path().join("maps")).unwrap();
    std::fs::write(dir.path().join("maps/a b.jpg"), png(&[1, 2, 3, 4], 1, 1)).unwrap();
    let sample = Sample::new().set("/images/0", json!({"uri": "maps/./a%20b.jpg", "mimeType": "image/jpeg"}));
    let (scene, _) = load(&sample.write(dir.path()), &LoadOptions::default()).unwrap();
    assert_eq!(scene.images[0].texels, Texels::Rgba8(vec![[1, 2, 3, 4]]));
    assert!(scene.warnings[0].contains("said to be JPEG but is PNG"), "{:?}", scene.warnings);
}

#[test]
fn asset_root_allows_files_beside_the_folder() {
    let dir = TempDir::new().unwrap();
    let inner = dir.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    let sample = Sample::new().set("/buffers/0/uri", json!("../shared.bin"));
    let path = sample.write(&inner);
    std::fs::write(dir.path().join("shared.bin"), &sample.bin).unwrap();
    let options = LoadOptions { asset_root: Some(dir.path().to_owned()), ..LoadOptions::default() };
    assert!(load(&path, &options).is_ok());
    let refused = load(&path, &LoadOptions::default()).unwrap_err();
    assert!(refused.fix.contains("--asset-root"), "{refused}");
}

#[test]
fn scene_is_chosen_by_index_or_name() {
    let with = |scene: &str| LoadOptions { scene: Some(scene.into()), ..LoadOptions::default() };
    for (wanted, index, instances) in [("main", 0, 1), ("1", 1, 0), ("other", 1, 0)] {
        let scene = Sample::new().load_with(&with(wanted)).unwrap();
        assert_eq!((scene.index, scene.instances.len()), (index, instances), "{wanted}");
    }
    let error = Sample::new().load_with(&with("third")).unwrap_err();
    assert!(error.fix.contains("0 \"main\", 1 \"other\""), "{error}");
}

#[test]
fn file_without_scenes_shows_its_parentless_nodes_with_a_warning() {
    let scene = Sample::new().remove("/scenes").remove("/scene").load().unwrap();
    assert_eq!((scene.instances.len(), scene.cameras.len(), scene.lights.len()), (1, 1, 1));
    assert!(scene.warnings[0].contains("no scenes"), "{:?}", scene.warnings);
    let first = Sample::new().remove("/scene").load().unwrap();
    assert_eq!((first.index, first.warnings.len()), (0, 0));
}

#[test]
fn empty_scene_and_empty_primitives_load() {
    let scene = Sample::new().set("/scene", json!(1)).load().unwrap();
    assert_eq!((scene.index, scene.triangle_count()), (1, 0));
    let scene = Sample::new().set("/accessors/4/count", json!(0)).load().unwrap();
    assert_eq!(scene.triangle_count(), 0);
    assert!(scene.warnings[0].contains("no triangle"), "{:?}", scene.warnings);
}

#[test]
fn non_finite_vertices_drop_their_triangles_with_a_count() {
    let scene = Sample::new().poke(12, &f32::NAN.to_le_bytes()).load().unwrap();
    assert_eq!(scene.meshes[0].indices, [[0, 2, 3]]);
    assert!(scene.warnings[0].starts_with("1 triangles dropped"), "{:?}", scene.warnings);
}

#[test]
fn light_range_and_unknown_extensions_are_ignored_with_a_warning() {
    let scene = Sample::new()
        .set("/extensions/KHR_lights_punctual/lights/0/range", json!(3))
        .set("/extensionsUsed/-", json!("ACME_polish"))
        .set("/nodes/0/extensions", json!({"ACME_polish": {}}))
        .load()
        .unwrap();
    assert_eq!(scene.warnings.len(), 2, "{:?}", scene.warnings);
    assert!(scene.warnings.iter().any(|w| w.contains("/nodes/0: the extension ACME_polish")), "{:?}", scene.warnings);
    assert!(scene.warnings.iter().any(|w| w.contains("range")), "{:?}", scene.warnings);
}

#[test]
fn factor_beyond_one_by_rounding_is_cut_off() {
    let scene = Sample::new().set("/materials/0/pbrMetallicRoughness/metallicFactor", json!(1.000001)).load().unwrap();
    assert_eq!(scene.materials[0].metallic.factor, 1.0);
}

#[test]
fn very_deep_trees_load() {
    let n = 50_000;
    let mut sample = Sample::new();
    let nodes = sample.json["nodes"].as_array_mut().unwrap();
    let first = nodes.len();
    for i in 0..n {
        nodes.push(if i + 1 < n { json!({"children": [first + i + 1]}) } else { json!({"mesh": 0}) });
    }
    let scene = sample.set("/scenes/0/nodes", json!([first])).load().unwrap();
    assert_eq!(scene.instances.len(), 1);
}

#[test]
fn every_asset_in_the_shared_folder_loads_or_says_why_not() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets");
    if !folder.is_dir() {
        println!("skipped: {} is not there", folder.display());
        return;
    }
    let mut folders = vec![folder];
    let mut files = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
                files += 1;
                if let Err(error) = load(&path, &LoadOptions::default()) {
                    assert!(!error.problem.is_empty() && error.at.file == path, "{error}");
                    assert!(!error.at.place.is_empty() || error.problem.contains("is empty"), "{error}");
                }
            }
        }
    }
    println!("{files} files");
}
