//! What nodes do to meshes: visibility, instancing, skins, morph weights, transforms without an inverse.

mod gltf_support;

use glam::{DMat4, DVec3};
use gltf_support::{POSITIONS, Sample, floats};
use serde_json::{Value, json};

const PRIMITIVE: &str = "/meshes/0/primitives/0";

#[test]
fn hidden_nodes_hide_meshes_and_lights_below_them_but_no_camera() {
    let hidden = json!({"KHR_node_visibility": {"visible": false}});
    let shown = json!({"KHR_node_visibility": {"visible": true}});
    let scene = Sample::new()
        .set("/extensionsRequired", json!(["KHR_node_visibility"]))
        .set("/scenes/0/nodes", json!([3]))
        .set("/nodes/-", json!({"children": [0, 1, 2], "extensions": hidden}))
        .set("/nodes/0/extensions", shown.clone())
        .load()
        .unwrap();
    assert_eq!((scene.instances.len(), scene.lights.len(), scene.cameras.len()), (0, 0, 1));
    let scene = Sample::new().set("/nodes/0/extensions", shown).load().unwrap();
    assert_eq!(scene.instances.len(), 1);
    let error = Sample::new().set("/nodes/0/extensions", json!({"KHR_node_visibility": {"visible": 1}})).error();
    assert_eq!(error.at.place, "/nodes/0/extensions/KHR_node_visibility/visible");
}

/// The sample with `attributes` for instances.
fn instanced(attributes: Value) -> Sample {
    Sample::new()
        .set("/extensionsRequired", json!(["EXT_mesh_gpu_instancing"]))
        .set("/nodes/0/extensions", json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}}))
}

/// The sample with three accessors from 5 on: translations, rotations (normalized bytes, 180 degrees about z), scales.
fn with_instances(attributes: Value) -> Sample {
    let mut sample = instanced(attributes);
    sample.add_accessor(&floats(&[1.0, 2.0, 3.0, -4.0, 0.0, 0.0]), 5126, "VEC3", 2);
    let rotations = sample.add_accessor(&[0, 0, 0, 127, 0, 0, 127, 0], 5120, "VEC4", 2);
    sample.json["accessors"][rotations]["normalized"] = json!(true);
    sample.add_accessor(&floats(&[1.0, 1.0, 1.0, 2.0, 3.0, -1.0]), 5126, "VEC3", 2);
    sample
}

#[test]
fn instances_are_placed_below_their_node() {
    let all = json!({"TRANSLATION": 5, "ROTATION": 6, "SCALE": 7, "_ID": 99});
    let scene = with_instances(all).set("/nodes/0/scale", json!([10, 10, 10])).load().unwrap();
    assert_eq!((scene.instances.len(), scene.meshes.len()), (2, 1));
    let point = DVec3::new(1.0, 1.0, 1.0);
    let placed: Vec<DVec3> = scene.instances.iter().map(|i| i.world_from_object.transform_point3(point)).collect();
    assert!(placed[0].abs_diff_eq(DVec3::new(20.0, 30.0, 40.0), 1e-9), "{}", placed[0]);
    assert!(placed[1].abs_diff_eq(DVec3::new(-60.0, -30.0, -10.0), 1e-9), "{}", placed[1]);
}

#[test]
fn instances_that_do_not_fit_are_errors() {
    let at = "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes";
    let mut uneven = with_instances(json!({"TRANSLATION": 5, "SCALE": 8}));
    uneven.add_accessor(&floats(&[1.0; 3]), 5126, "VEC3", 1);
    let mut zero = with_instances(json!({"ROTATION": 8}));
    zero.add_accessor(&floats(&[0.0; 4]), 5126, "VEC4", 1);
    for (sample, place, problem) in [
        (uneven, format!("{at}/SCALE"), "1 elements but another has 2"),
        (zero, at.to_owned(), "instance 0 has no transform"),
        (instanced(json!({})), at.to_owned(), "names no instances"),
        (instanced(json!({"SCALE": "x"})), format!("{at}/SCALE"), "is not an index"),
        (instanced(json!({"TRANSLATION": 77})), format!("{at}/TRANSLATION"), "77"),
        (instanced(json!({"TRANSLATION": 2})), "/accessors/2/type".to_owned(), "TRANSLATION"),
    ] {
        let error = sample.error();
        assert_eq!(error.at.place, place, "{error}");
        assert!(error.problem.contains(problem), "{error}");
    }
}

#[test]
fn morph_targets_move_by_the_weights_of_the_node_or_of_the_mesh() {
    let mut sample = Sample::new();
    let up = sample.add_accessor(&floats(&[0.0, 0.0, 2.0].repeat(4)), 5126, "VEC3", 4);
    let tilt = sample.add_accessor(&floats(&[4.0, 0.0, 0.0].repeat(4)), 5126, "VEC3", 4);
    let sample = sample
        .set(&format!("{PRIMITIVE}/targets"), json!([{"POSITION": up}, {"POSITION": tilt, "NORMAL": tilt}]))
        .set("/meshes/0/weights", json!([0.5, 0.25]))
        .set("/scenes/0/nodes", json!([0, 3]))
        .set("/nodes/-", json!({"mesh": 0, "weights": [0, 0]}));
    let scene = sample.load().unwrap();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (2, 2));
    assert_eq!(scene.meshes[0].positions, POSITIONS.map(|[x, y, z]| [x + 1.0, y, z + 1.0]));
    assert_eq!(scene.meshes[0].normals.as_deref(), Some(&[[1.0, 0.0, 1.0]; 4][..]));
    assert_eq!(scene.meshes[1].positions, POSITIONS);
    let error = sample.set("/nodes/0/weights", json!([1])).error();
    assert_eq!(error.at.place, "/nodes/0/weights", "{error}");
}

/// The square's lower corners on joint 0, its upper ones on joint 1, which is moved up and mirrors nothing.
fn skinned() -> Sample {
    let mut sample = Sample::new();
    let joints =
        sample.add_accessor(&[[0, 9, 0, 0], [0, 9, 0, 0], [1, 9, 0, 0], [1, 0, 0, 0]].concat(), 5121, "VEC4", 4);
    // Not of sum 1; the fourth corner is half and half. Joint 9 does not exist, but has no weight.
    let weights = [[1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]];
    let weights = sample.add_accessor(&floats(&weights.concat()), 5126, "VEC4", 4);
    let mut inverse = DMat4::IDENTITY.to_cols_array().map(|v| v as f32).to_vec();
    inverse.extend(DMat4::from_translation(DVec3::new(0.0, -1.0, 0.0)).to_cols_array().map(|v| v as f32));
    let inverse = sample.add_accessor(&floats(&inverse), 5126, "MAT4", 2);
    sample
        .set(&format!("{PRIMITIVE}/attributes/JOINTS_0"), json!(joints))
        .set(&format!("{PRIMITIVE}/attributes/WEIGHTS_0"), json!(weights))
        .set("/skins", json!([{"joints": [3, 4], "inverseBindMatrices": inverse}]))
        .set("/nodes/0", json!({"mesh": 0, "skin": 0, "translation": [100, 100, 100]}))
        .set("/nodes/-", json!({"translation": [10, 0, 0], "children": [4]}))
        .set("/nodes/-", json!({"translation": [0, 3, 0], "rotation": [0, 0, 1, 0]}))
        .set("/scenes/0/nodes", json!([0, 3]))
}

#[test]
fn skins_place_vertices_by_their_joints_and_not_by_the_node() {
    let scene = skinned().load().unwrap();
    let instance = &scene.instances[0];
    let mesh = &scene.meshes[instance.mesh.index()];
    let placed: Vec<DVec3> = mesh
        .positions
        .iter()
        .map(|&p| instance.world_from_object.transform_point3(glam::Vec3::from(p).as_dvec3()))
        .collect();
    // Joint 1 turns its corners by 180 degrees about (10, 3) after its inverse bind matrix moved them down by 1.
    let expected = [[10.0, 0.0], [11.0, 0.0], [9.0, 3.0], [10.0, 2.0]];
    for (p, [x, y]) in placed.iter().zip(expected) {
        assert!(p.abs_diff_eq(DVec3::new(x, y, 0.0), 1e-6), "{placed:?}");
    }
    assert_eq!(mesh.normals.as_deref(), Some(&[[0.0, 0.0, 1.0]; 4][..]));
    // The joint's rotation turns the tangent round; half of each cancels out and is replaced.
    let tangents = mesh.tangents.as_ref().unwrap();
    assert_eq!(tangents[0], [1.0, 0.0, 0.0, 1.0]);
    assert!(tangents[2][0] < -0.999, "{tangents:?}");
}

#[test]
fn mirroring_joints_keep_the_front_in_front() {
    let scene = skinned().set("/nodes/3/scale", json!([-1, 1, 1])).load().unwrap();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.indices[0], [0, 2, 1]);
    assert_eq!(mesh.normals.as_ref().unwrap()[0], [0.0, 0.0, 1.0]);
    assert_eq!(mesh.tangents.as_ref().unwrap()[0], [-1.0, 0.0, 0.0, -1.0]);
}

#[test]
fn skins_that_do_not_fit_are_errors() {
    for (sample, place) in [
        (skinned().set("/skins/0/joints", json!([])), "/skins/0/joints"),
        (skinned().set("/skins/0/joints", json!([3, 99])), "/skins/0/joints/1"),
        (skinned().set("/skins/0/joints", json!([3, 4, 4])), "/skins/0/inverseBindMatrices"),
        (skinned().set("/skins/0", json!({"joints": [3]})), "/meshes/0/primitives/0/attributes/JOINTS_0"),
        (skinned().remove(&format!("{PRIMITIVE}/attributes/WEIGHTS_0")), "/meshes/0/primitives/0/attributes"),
        (skinned().set("/nodes/0/skin", json!(7)), "/nodes/0/skin"),
    ] {
        let error = sample.error();
        assert_eq!(error.at.place, place, "{error}");
    }
}

#[test]
fn nodes_scaled_to_nothing_are_left_out_and_planes_squashed_flat_are_not() {
    let flat = Sample::new().set("/nodes/0/scale", json!([1, 1, 0])).load().unwrap();
    assert_eq!((flat.instances.len(), flat.warnings.len()), (1, 0));
    for scale in [json!([0, 0, 0]), json!([2, 0, 0])] {
        let scene = Sample::new().set("/nodes/0/scale", scale).load().unwrap();
        assert_eq!(scene.instances.len(), 0);
        assert!(scene.warnings[0].contains("1 instances dropped") && scene.warnings[0].contains("square"));
    }
}
