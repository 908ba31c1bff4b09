//! `PRT_shape` from files: what is placed, and what is said of input that makes no shape.

mod gltf_support;

use gltf_support::Sample;
use prt::scene::Scene;
use prt::shape::exact::ExactShape;
use serde_json::{Value, json};

fn sample(shape: Value) -> Sample {
    Sample::new()
        .set("/extensionsUsed/-", json!("PRT_shape"))
        .set("/nodes/0/extensions", json!({"PRT_shape": shape}))
        .set("/nodes/0/translation", json!([1.0, 2.0, 3.0]))
}

fn read(shape: Value) -> Scene {
    sample(shape).load().unwrap_or_else(|e| panic!("{e}"))
}

fn refused(shape: Value) -> String {
    sample(shape).load().expect_err("no shape").to_string()
}

fn revolution(points: Value) -> Value {
    json!({"type": "revolution", "curve": "bezier", "points": points, "material": 0})
}

#[test]
fn a_shape_takes_the_place_of_its_nodes_mesh() {
    let scene = read(json!({"type": "sphere", "radius": 0.25, "material": 0}));
    assert!(scene.instances.is_empty() && scene.meshes.is_empty(), "the mesh is for other viewers");
    let [placed] = &scene.shapes[..] else { panic!("one shape, not {}", scene.shapes.len()) };
    assert_eq!(*placed.shape, ExactShape::Sphere { radius: 0.25 });
    assert_eq!((placed.name.as_str(), placed.material.0), ("square", 0));
    assert_eq!(placed.world_from_object.w_axis.truncate().to_array(), [1.0, 2.0, 3.0]);
    assert!(scene.skipped.iter().any(|s| s.what == "meshes/0"), "{:?}", scene.skipped);
    assert!(!scene.warnings.iter().any(|w| w.contains("PRT_shape")), "{:?}", scene.warnings);
    let default = read(json!({"type": "sphere", "radius": 1.0}));
    assert_eq!(default.materials[default.shapes[0].material.index()].name, "default");
    let required = sample(json!({"type": "sphere", "radius": 1.0})).set("/extensionsRequired", json!(["PRT_shape"]));
    assert_eq!(required.load().unwrap().shapes.len(), 1);
    let points = json!([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 1.0], [0.4, 2.0], [0.3, 3.0], [0.1, 4.0]]);
    let ExactShape::Revolution(vase) = &*read(revolution(points.clone())).shapes[0].shape else { panic!("turned") };
    assert_eq!(vase.profile().pieces.len(), 16);
    let spline = json!({"type": "revolution", "curve": "bspline", "points": points});
    let ExactShape::Revolution(spline) = &*read(spline).shapes[0].shape else { panic!("turned") };
    assert_eq!(spline.profile().pieces.len(), 32);
}

#[test]
fn shapes_are_hidden_and_repeated_as_meshes_are() {
    let shape = json!({"type": "sphere", "radius": 1.0, "material": 0});
    let hidden = json!({"PRT_shape": shape, "KHR_node_visibility": {"visible": false}});
    let scene = sample(shape.clone()).set("/nodes/0/extensions", hidden).load().unwrap();
    assert!(scene.shapes.is_empty() && scene.instances.is_empty());
    let mut many = sample(shape.clone());
    let bytes: Vec<u8> = [[0.0_f32; 3], [5.0, 0.0, 0.0]].as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    let accessor = many.add_accessor(&bytes, 5126, "VEC3", 2);
    let instancing = json!({"PRT_shape": shape, "EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": accessor}}});
    let scene = many.set("/nodes/0/extensions", instancing).load().unwrap();
    let x: Vec<f64> = scene.shapes.iter().map(|s| s.world_from_object.w_axis.x).collect();
    assert_eq!(x, [1.0, 6.0]);
    assert!(std::sync::Arc::ptr_eq(&scene.shapes[0].shape, &scene.shapes[1].shape), "held once");
}

#[test]
fn what_makes_no_shape_is_refused_with_its_place_and_a_remedy() {
    let at = "/nodes/0/extensions/PRT_shape";
    for (shape, place, words) in [
        (json!(7), "", "not an object"),
        (json!({}), "/type", "Allowed: sphere, revolution"),
        (json!({"type": "cube"}), "/type", "Allowed: sphere, revolution"),
        (json!({"type": "sphere"}), "/radius", "without radius"),
        (json!({"type": "sphere", "radius": 0.0}), "/radius", "above 0"),
        (json!({"type": "sphere", "radius": -1.0}), "/radius", "above 0"),
        (json!({"type": "sphere", "radius": 1e300}), "/radius", "1e18"),
        (json!({"type": "sphere", "radius": 1e-40}), "/radius", "1e-30"),
        (json!({"type": "sphere", "radius": "1"}), "/radius", "must be a number"),
        (json!({"type": "sphere", "radius": 1.0, "material": 9}), "/material", "materials"),
        (json!({"type": "sphere", "radius": 1.0, "material": -1}), "/material", "index of a material"),
        (json!({"type": "revolution", "points": []}), "/curve", "Allowed: bezier, bspline"),
        (json!({"type": "revolution", "curve": "nurbs"}), "/curve", "Allowed: bezier, bspline"),
        (json!({"type": "revolution", "curve": "bezier"}), "/points", "without points"),
        (revolution(json!(3)), "/points", "is not a list"),
        (revolution(json!([])), "/points", "0 points make no Bezier segments"),
        (revolution(json!([[1.0, 0.0]])), "/points", "1 point make"),
        (revolution(json!([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0], [1.0, 3.0], [1.0, 4.0]])), "/points", "3k + 1"),
        (revolution(json!([[1.0, 0.0], [1.0], [1.0, 2.0], [1.0, 3.0]])), "/points/1", "is not a point"),
        (revolution(json!([[1.0, 0.0], [1.0, 1.0], [1.0, 2e18], [1.0, 3.0]])), "/points/2", "at most 1e18"),
        (revolution(json!([[0.0, 0.0], [0.0, 1.0], [0.0, 2.0], [0.0, 3.0]])), "/points", "all points lie on the axis"),
        (revolution(json!([[1.0, 2.0], [1.0, 2.0], [1.0, 2.0], [1.0, 2.0]])), "/points", "all points"),
        (
            json!({"type": "revolution", "curve": "bspline", "points": [[1, 0], [1, 1], [1, 2]]}),
            "/points",
            "at least 4",
        ),
    ] {
        let message = refused(shape.clone());
        assert!(message.contains(&format!("{at}{place}")) && message.contains(words), "{shape}: {message}");
    }
}

#[test]
fn odd_profiles_are_drawn_and_reported() {
    for (points, words) in [
        (json!([[0.3, -1.0], [3.0, -0.3], [-2.0, 0.4], [0.6, 1.0]]), "crosses the axis"),
        (json!([[1.0, 0.0], [4.0, 2.0], [0.5, 2.0], [2.5, 0.0]]), "crosses itself"),
        (json!([[1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]), "/points/1 equals the point before it"),
    ] {
        let scene = read(revolution(points));
        assert_eq!(scene.shapes.len(), 1);
        let told = scene.warnings.iter().filter(|w| w.contains(words)).count();
        assert_eq!(told, 1, "{words}: {:?}", scene.warnings);
    }
}
