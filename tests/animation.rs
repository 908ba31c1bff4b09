//! Scenes at moments of animations: what moves, what is shared, what moves while the shutter is open, and bad animations.

mod gltf_support;

use glam::{DMat4, DQuat, DVec3};
use gltf_support::{POSITIONS, Sample, floats};
use prt::camera::Projection;
use prt::error::LoadError;
use prt::light::Light;
use prt::load::{AnimationChoice, LoadOptions, Moment, SceneSource, ShutterPosition, load};
use prt::render::{AccelChoice, Progress, RenderSettings, render};
use prt::scene::Scene;
use serde_json::{Value, json};
use std::sync::Arc;
use tempfile::TempDir;

/// A channel: the target, the interpolation, times, values and the type of those.
struct Channel<'a>(Value, &'a str, &'a [f32], &'a [f32], &'a str);

/// `sample` with one more animation of these channels.
fn animated(mut sample: Sample, channels: &[Channel]) -> Sample {
    let (mut list, mut samplers) = (Vec::new(), Vec::new());
    for (i, Channel(target, interpolation, times, values, kind)) in channels.iter().enumerate() {
        let width = match *kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let input = sample.add_accessor(&floats(times), 5126, "SCALAR", times.len());
        let output = sample.add_accessor(&floats(values), 5126, kind, values.len() / width);
        samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
        list.push(json!({"sampler": i, "target": target}));
    }
    let name = format!("a{}", sample.json["animations"].as_array().map_or(0, Vec::len));
    let animation = json!({"name": name, "channels": list, "samplers": samplers});
    match sample.json["animations"].as_array_mut() {
        Some(animations) => animations.push(animation),
        None => sample.json["animations"] = json!([animation]),
    }
    sample
}

fn node(node: usize, path: &str) -> Value {
    json!({"node": node, "path": path})
}

fn pointer(pointer: &str) -> Value {
    json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}})
}

/// The sample with this one animation.
fn with(channels: &[Channel]) -> Sample {
    animated(Sample::new(), channels)
}

/// A file that was written and opened.
struct Opened {
    source: SceneSource,
    /// The files are there as long as it is.
    _dir: TempDir,
}

impl Opened {
    fn new(sample: &Sample, choice: &AnimationChoice) -> Result<Self, LoadError> {
        let dir = TempDir::new().unwrap();
        let source = SceneSource::open(&sample.write(dir.path()), &LoadOptions::default(), choice)?;
        Ok(Self { source, _dir: dir })
    }

    fn at(&mut self, time: f64) -> Scene {
        self.source.at(&Moment { time, frame_seconds: 1.0, ..Moment::default() }).unwrap().0
    }

    /// The shutter opens at `start` and closes at `end`.
    fn between(&mut self, start: f64, end: f64) -> Scene {
        let position = ShutterPosition::Start;
        self.source.at(&Moment { time: start, frame_seconds: end - start, shutter: Some(1.0), position }).unwrap().0
    }
}

fn open(sample: &Sample) -> Opened {
    Opened::new(sample, &AnimationChoice::default()).unwrap()
}

fn problem(sample: &Sample) -> (String, String) {
    let error = Opened::new(sample, &AnimationChoice::default()).err().expect("must not open");
    (error.at.place.clone(), error.to_string())
}

#[test]
fn nodes_are_where_their_channels_say() {
    let quarter = DQuat::from_rotation_z(1.0).to_array().map(|v| v as f32);
    let turn = [[0.0, 0.0, 0.0, 1.0], quarter].concat();
    let sample = with(&[
        Channel(node(0, "translation"), "LINEAR", &[1.0, 3.0], &[0.0, 0.0, 0.0, 4.0, 0.0, -2.0], "VEC3"),
        Channel(node(0, "rotation"), "LINEAR", &[0.0, 2.0], &turn, "VEC4"),
        Channel(node(0, "scale"), "STEP", &[0.0, 2.0], &[1.0, 1.0, 1.0, 2.0, 3.0, 4.0], "VEC3"),
        Channel(node(1, "translation"), "LINEAR", &[0.0], &[0.0, 1.0, 9.0], "VEC3"),
    ]);
    let mut file = open(&sample);
    for (time, x, angle, scale) in
        [(0.0, 0.0, 0.0, DVec3::ONE), (1.5, 0.25, 0.75, DVec3::ONE), (7.0, 1.0, 1.0, DVec3::new(2.0, 3.0, 4.0))]
    {
        let scene = file.at(time);
        let place = DVec3::new(4.0 * x, 0.0, -2.0 * x);
        let expected = DMat4::from_scale_rotation_translation(scale, DQuat::from_rotation_z(angle), place);
        let found = scene.instances[0].world_from_object;
        assert!(found.abs_diff_eq(expected, 1e-6), "at {time}: {found} is not {expected}");
        assert_eq!(scene.cameras[0].world_from_camera.w_axis.truncate(), DVec3::new(0.0, 1.0, 9.0));
        assert!(scene.motion.is_empty() && scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
}

#[test]
fn what_does_not_change_is_shared_by_the_moments() {
    let place = Channel(node(0, "translation"), "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0], "VEC3");
    let mut file = open(&with(&[place]));
    let (a, b) = (file.at(0.0), file.at(0.5));
    assert!(Arc::ptr_eq(&a.meshes[0], &b.meshes[0]) && Arc::ptr_eq(&a.images[0], &b.images[0]));
    assert_ne!(a.instances[0].world_from_object, b.instances[0].world_from_object);
    // A moment is what it is whatever was asked for before.
    assert_eq!(format!("{:?}", file.at(0.0)), format!("{a:?}"));
}

#[test]
fn the_scene_at_a_moment_is_that_of_a_file_posed_by_hand() {
    let sample = with(&[
        Channel(node(0, "translation"), "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 0.3, -0.1, 0.7], "VEC3"),
        Channel(
            pointer("/materials/0/pbrMetallicRoughness/baseColorFactor"),
            "LINEAR",
            &[0.0, 1.0],
            &[0.0, 0.0, 0.0, 1.0, 1.0, 0.9, 0.3, 1.0],
            "VEC4",
        ),
    ]);
    let (at, color) =
        ([0.3, -0.1, 0.7].map(|v: f32| f64::from(v) * 0.25), [1.0, 0.9, 0.3].map(|v: f32| f64::from(v) * 0.25));
    let by_hand = Sample::new().set("/nodes/0/translation", json!(at.map(|v| v as f32))).set(
        "/materials/0/pbrMetallicRoughness/baseColorFactor",
        json!([color[0] as f32, color[1] as f32, color[2] as f32, 1.0]),
    );
    let settings = RenderSettings {
        width: 32,
        height: 32,
        spp: 4,
        frame: 6,
        accel: AccelChoice::Bvh,
        threads: Some(1),
        ..RenderSettings::default()
    };
    let pixels = |scene: &Scene| render(scene, 0, &settings, &Progress::default()).unwrap().pixels;
    let found = pixels(&open(&sample).at(0.25));
    assert_eq!(found, pixels(&by_hand.load().unwrap()));
    assert_ne!(found, pixels(&open(&sample).at(0.26)));
}

#[test]
fn pointers_reach_cameras_lights_materials_and_visibility() {
    let mut sample = with(&[
        Channel(pointer("/cameras/0/perspective/yfov"), "LINEAR", &[0.0, 1.0], &[0.5, 1.0], "SCALAR"),
        Channel(
            pointer("/extensions/KHR_lights_punctual/lights/0/intensity"),
            "LINEAR",
            &[0.0, 1.0],
            &[0.0, 8.0],
            "SCALAR",
        ),
        Channel(
            pointer("/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle"),
            "LINEAR",
            &[0.0, 1.0],
            &[0.5, 0.7],
            "SCALAR",
        ),
        Channel(
            pointer("/materials/0/extensions/KHR_materials_specular/specularColorFactor"),
            "STEP",
            &[0.0, 0.5],
            &[1.0, 1.0, 1.0, 0.5, 0.25, 0.125],
            "VEC3",
        ),
        Channel(
            pointer("/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/offset"),
            "LINEAR",
            &[0.0, 1.0],
            &[0.0, 0.0, 1.0, 2.0],
            "VEC2",
        ),
        Channel(pointer("/nodes/2/translation"), "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 0.0, 6.0, 0.0], "VEC3"),
    ])
    .set("/nodes/0/extensions", json!({"KHR_node_visibility": {"visible": true}}));
    let times = sample.add_accessor(&floats(&[0.0, 0.75]), 5126, "SCALAR", 2);
    let shown = sample.add_accessor(&[1, 0], 5121, "SCALAR", 2);
    let animation = &mut sample.json["animations"][0];
    animation["samplers"].as_array_mut().unwrap().push(json!({"input": times, "output": shown}));
    let channel = json!({"sampler": 6, "target": pointer("/nodes/0/extensions/KHR_node_visibility/visible")});
    animation["channels"].as_array_mut().unwrap().push(channel);

    let mut file = open(&sample);
    let scene = file.at(0.5);
    assert_eq!(scene.warnings, Vec::<String>::new());
    assert!(matches!(scene.cameras[0].projection, Projection::Perspective { yfov, .. } if yfov == 0.75));
    let Light::Spot { intensity, outer_cone, .. } = scene.lights[0].light else { panic!("a spot") };
    assert_eq!((intensity, outer_cone), ([4.0, 2.0, 1.0], 0.6));
    assert_eq!(scene.lights[0].world_from_light.w_axis.y, 3.0);
    assert_eq!(scene.materials[0].specular_color.factor, [0.5, 0.25, 0.125]);
    let offset = scene.materials[0].base_color.texture.unwrap().transform.unwrap().m;
    assert_eq!([offset[0][2], offset[1][2]], [0.5, 1.0]);
    assert_eq!(scene.instances.len(), 1);
    assert_eq!(file.at(0.75).instances.len(), 0);
}

#[test]
fn pointers_to_what_cannot_be_animated_are_ignored_with_a_warning() {
    for (text, says) in [
        ("/materials/7/emissiveFactor", "which is not there"),
        ("/materials/0/extensions/KHR_materials_sheen/sheenColorFactor", "which is not there"),
        ("/materials/0/name", "no property that can be animated"),
        ("/buffers/0/byteLength", "no property that can be animated"),
        ("nonsense", "no property that can be animated"),
    ] {
        let sample = with(&[Channel(pointer(text), "LINEAR", &[0.0, 1.0], &[0.0; 6], "VEC3")]);
        let scene = open(&sample).at(0.5);
        assert!(scene.warnings[0].contains(says) && scene.warnings[0].contains(text), "{:?}", scene.warnings);
        assert!(scene.warnings[1].contains("nothing in the file is animated"), "{:?}", scene.warnings);
    }
}

#[test]
fn other_animations_are_chosen_by_index_name_or_all() {
    let x = |x: f32| [0.0, 0.0, 0.0, x, 0.0, 0.0];
    let one = animated(Sample::new(), &[Channel(node(0, "translation"), "LINEAR", &[0.0, 1.0], &x(1.0), "VEC3")]);
    let sample = animated(
        one,
        &[
            Channel(node(0, "translation"), "LINEAR", &[0.0, 1.0], &x(5.0), "VEC3"),
            Channel(node(1, "translation"), "LINEAR", &[0.0, 2.0], &x(7.0), "VEC3"),
        ],
    );
    let at = |choice: &AnimationChoice| {
        let scene = Opened::new(&sample, choice).unwrap().at(2.0);
        (scene.instances[0].world_from_object.w_axis.x, scene.cameras[0].world_from_camera.w_axis.x, scene)
    };
    let (a, b, scene) = at(&AnimationChoice::Index(0));
    assert_eq!((a, b), (1.0, 0.0));
    assert!(scene.skipped.iter().any(|s| s.what == "animations/1" && s.why == "another animation is played"));
    let (a, b, _) = at(&AnimationChoice::Name("a1".into()));
    assert_eq!((a, b), (5.0, 7.0));
    let (a, b, scene) = at(&AnimationChoice::All);
    assert_eq!((a, b), (1.0, 7.0));
    assert!(scene.warnings[0].contains("an animation before this one moves already"), "{:?}", scene.warnings);
    for choice in [AnimationChoice::Index(2), AnimationChoice::Name("walk".into())] {
        let error = Opened::new(&sample, &choice).err().unwrap().to_string();
        assert!(
            error.contains(&format!("no animation {choice}")) && error.contains("0 \"a0\", 1 \"a1\", all"),
            "{error}"
        );
    }
}

#[test]
fn mb_01_bad_animations_are_errors_with_their_place() {
    let good = || Channel(node(0, "translation"), "LINEAR", &[0.0, 1.0], &[0.0; 6], "VEC3");
    let input = "/animations/0/samplers/0/input";
    let times = |times: &'static [f32]| with(&[Channel(node(0, "translation"), "LINEAR", times, &[0.0; 6], "VEC3")]);
    let set = |pointer: &str, value: Value| with(&[good()]).set(pointer, value);
    for (sample, place, says) in [
        (times(&[0.0, f32::NAN]), input, "key 1"),
        (times(&[-1.0, 1.0]), input, "is at -1 s"),
        (times(&[1.0, 1.0]), input, "the one before at 1 s"),
        (times(&[2.0, 1.0]), input, "the one before at 2 s"),
        (
            with(&[Channel(node(0, "scale"), "LINEAR", &[0.0, 1.0], &[0.0; 9], "VEC3")]),
            "/animations/0/samplers/0/output",
            "must be 2: 2 keys",
        ),
        (
            with(&[Channel(node(0, "scale"), "CUBICSPLINE", &[0.0, 1.0], &[0.0; 6], "VEC3")]),
            "/animations/0/samplers/0/output",
            "must be 6: 2 keys x 3",
        ),
        (
            with(&[Channel(node(0, "scale"), "LINEAR", &[0.0], &[f32::INFINITY; 3], "VEC3")]),
            "/animations/0/samplers/0/output",
            "must be finite",
        ),
        (with(&[Channel(node(0, "rotation"), "LINEAR", &[0.0, 1.0], &[0.0; 6], "VEC3")]), "/accessors/6/type", "VEC4"),
        (
            with(&[Channel(node(9, "scale"), "LINEAR", &[0.0], &[1.0; 3], "VEC3")]),
            "/animations/0/channels/0/target/node",
            "nodes",
        ),
        (set("/animations/0/channels/0/sampler", json!(4)), "/animations/0/channels/0/sampler", "no sampler 4"),
        (
            set("/animations/0/samplers/0/interpolation", json!("SINE")),
            "/animations/0/samplers/0/interpolation",
            "CUBICSPLINE",
        ),
        (set("/animations/0/samplers/0/input", json!(99)), input, "accessors"),
        (
            set("/nodes/0/matrix", json!(DMat4::IDENTITY.to_cols_array())),
            "/animations/0/channels/0/target/node",
            "has a matrix",
        ),
        (set("/animations/0/channels", json!(3)), "/animations/0", "not as glTF 2.0 has it"),
        (
            with(&[Channel(json!({"path": "pointer"}), "LINEAR", &[0.0], &[1.0], "SCALAR")]),
            "/animations/0/channels/0/target/extensions/KHR_animation_pointer/pointer",
            "is not there",
        ),
    ] {
        let (at, text) = problem(&sample);
        assert!(at == place && text.contains(says), "{text} ({at}) must be at {place} and say {says}");
    }
}

#[test]
fn channels_that_say_nothing_are_ignored_with_a_warning() {
    let good = || Channel(node(0, "translation"), "LINEAR", &[0.0, 1.0], &[1.0; 6], "VEC3");
    for (other, says) in [
        (Channel(json!({"path": "translation"}), "LINEAR", &[0.0], &[0.0; 3], "VEC3"), "names no node"),
        (Channel(node(0, "color"), "LINEAR", &[0.0], &[0.0; 3], "VEC3"), "no property that can be animated"),
        (Channel(node(0, "weights"), "LINEAR", &[0.0], &[0.0], "SCALAR"), "no morph targets"),
        (Channel(node(1, "weights"), "LINEAR", &[0.0], &[0.0], "SCALAR"), "has no mesh"),
        (Channel(node(0, "translation"), "LINEAR", &[0.0], &[9.0; 3], "VEC3"), "another channel moves already"),
        (Channel(node(0, "scale"), "LINEAR", &[], &[], "VEC3"), "has no keys"),
    ] {
        let scene = open(&with(&[good(), other])).at(0.0);
        assert!(scene.warnings[0].contains(says), "{:?}", scene.warnings);
        assert_eq!(scene.instances[0].world_from_object.w_axis.truncate(), DVec3::ONE);
    }
    let scene = open(&Sample::new()).at(3.0);
    assert!(scene.warnings[0].contains("nothing in the file is animated"), "{:?}", scene.warnings);
    // Nobody who wants the file as it is written is bothered by its animations.
    let bad = with(&[Channel(node(0, "translation"), "LINEAR", &[f32::NAN], &[0.0; 3], "VEC3")]);
    let scene = bad.load().unwrap();
    assert!(scene.skipped.iter().any(|s| s.what == "animations/0" && s.why.contains("as written")));
}

/// The sample with a morph target that lifts the square by (0, 0, 2) and tilts its normals, and these weights over time.
fn morphing(times: &[f32], weights: &[f32]) -> Sample {
    let mut sample = Sample::new();
    let lift = sample.add_accessor(&floats([[0.0_f32, 0.0, 2.0]; 4].as_flattened()), 5126, "VEC3", 4);
    let tilt = sample.add_accessor(&floats([[1.0_f32, 0.0, 0.0]; 4].as_flattened()), 5126, "VEC3", 4);
    let sample = sample.set("/meshes/0/primitives/0/targets", json!([{"POSITION": lift, "NORMAL": tilt}]));
    animated(sample, &[Channel(node(0, "weights"), "LINEAR", times, weights, "SCALAR")])
}

#[test]
fn morph_weights_move_vertices_and_normals() {
    let mut file = open(&morphing(&[0.0, 1.0], &[0.0, 1.0]));
    for time in [0.5, 0.0, 0.25] {
        let scene = file.at(time);
        let z = 2.0 * time as f32;
        assert_eq!(scene.meshes[0].positions, POSITIONS.map(|[x, y, _]| [x, y, z]));
        assert_eq!(scene.meshes[0].normals.as_deref(), Some(&[[time as f32, 0.0, 1.0]; 4][..]));
    }
}

/// The sample with its square in a skin of two joints, nodes 3 and 4: the left half follows 3, the right half 4; channels
/// move them.
fn skinned(channels: &[Channel]) -> Sample {
    let mut sample = Sample::new();
    let joints =
        sample.add_accessor(&[[0, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]].concat(), 5121, "VEC4", 4);
    let weights = sample.add_accessor(&floats([[1.0_f32, 0.0, 0.0, 0.0]; 4].as_flattened()), 5126, "VEC4", 4);
    let sample = sample
        .set("/skins", json!([{"joints": [3, 4]}]))
        .set("/nodes/0/skin", json!(0))
        .set("/nodes/-", json!({"translation": [100.0, 0.0, 0.0]}))
        .set("/nodes/-", json!({"translation": [100.0, 0.0, 0.0]}))
        .set("/scenes/0/nodes", json!([0, 1, 2, 3, 4]))
        .set("/meshes/0/primitives/0/attributes/JOINTS_0", json!(joints))
        .set("/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(weights));
    animated(sample, channels)
}

/// Where the vertices of the only instance are.
fn vertices(scene: &Scene) -> Vec<DVec3> {
    let world = scene.instances[0].world_from_object;
    scene.meshes[0].positions.iter().map(|p| world.transform_point3(DVec3::from_array(p.map(f64::from)))).collect()
}

#[test]
fn joints_move_vertices_wherever_the_first_of_them_is() {
    let mut file = open(&skinned(&[
        Channel(node(3, "translation"), "LINEAR", &[0.0, 1.0], &[100.0, 0.0, 0.0, 104.0, 0.0, 0.0], "VEC3"),
        Channel(node(4, "translation"), "LINEAR", &[0.0, 1.0], &[100.0, 0.0, 0.0, 100.0, 8.0, 0.0], "VEC3"),
    ]));
    for time in [0.0, 0.5, 1.0] {
        let expected: Vec<DVec3> = (0..4)
            .map(|v| {
                let rest = DVec3::from_array(POSITIONS[v].map(f64::from));
                rest + if v == 1 || v == 2 {
                    DVec3::new(100.0, 8.0 * time, 0.0)
                } else {
                    DVec3::new(100.0 + 4.0 * time, 0.0, 0.0)
                }
            })
            .collect();
        assert_eq!(vertices(&file.at(time)), expected);
    }
}

#[test]
fn mb_01_without_an_open_shutter_or_a_motion_nothing_moves() {
    let values = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 9.0, 9.0];
    let place = Channel(node(0, "translation"), "LINEAR", &[0.0, 1.0, 2.0], &values, "VEC3");
    let mut file = open(&with(&[place]));
    assert!(file.between(0.0, 1.0).motion.is_empty(), "its keys are equal");
    assert!(file.between(2.0, 5.0).motion.is_empty(), "behind the last key");
    assert!(file.at(1.5).motion.is_empty(), "no shutter");
    let scene = file.between(1.0, 2.0);
    assert_eq!(scene.motion.instances.keys().copied().collect::<Vec<_>>(), [0]);
    assert!(scene.motion.cameras.is_empty() && scene.motion.lights.is_empty() && scene.motion.meshes.is_empty());
    assert!(open(&Sample::new()).between(0.0, 1.0).motion.is_empty());
    assert_eq!(format!("{:?}", file.between(1.0, 1.0)), format!("{:?}", file.at(1.0)), "a shutter of length 0");
}

#[test]
fn a_straight_motion_has_two_times_and_its_ends_are_exact() {
    let values = [0.0, 0.0, 0.0, 3.0, 0.0, 0.0];
    let mut file = open(&with(&[
        Channel(node(0, "translation"), "LINEAR", &[0.0, 1.0], &values, "VEC3"),
        Channel(node(1, "translation"), "LINEAR", &[0.0, 1.0], &values, "VEC3"),
        Channel(node(2, "translation"), "LINEAR", &[0.0, 1.0], &values, "VEC3"),
    ]));
    let (scene, end) = (file.between(0.25, 0.75), file.at(0.75));
    assert_eq!(scene.instances[0].world_from_object, file.at(0.25).instances[0].world_from_object);
    assert_eq!(scene.motion.instances[&0], [end.instances[0].world_from_object]);
    assert_eq!(scene.motion.cameras[&0], [end.cameras[0].world_from_camera]);
    assert_eq!(scene.motion.lights[&0], [end.lights[0].world_from_light]);
}

/// The greatest distance from linear interpolation between the times of a motion to the truth, for points of the square.
fn off(scene: &Scene, truth: impl Fn(f64) -> DMat4) -> f64 {
    let mut keys = vec![scene.instances[0].world_from_object];
    keys.extend(&scene.motion.instances[&0]);
    let pieces = (keys.len() - 1) as f64;
    let mut most: f64 = 0.0;
    for i in 0..=1000 {
        let t = f64::from(i) / 1000.0 * pieces;
        let k = (t as usize).min(keys.len() - 2);
        for p in POSITIONS {
            let p = DVec3::from_array(p.map(f64::from));
            let [a, b] = [keys[k].transform_point3(p), keys[k + 1].transform_point3(p)];
            let linear = a + (b - a) * (t - k as f64);
            most = most.max(linear.distance(truth(f64::from(i) / 1000.0).transform_point3(p)));
        }
    }
    most
}

#[test]
fn mb_02_rotations_by_more_than_half_a_turn_have_the_times_that_they_need() {
    for turns in [0.01, 0.25, 0.75, 1.0, 2.0] {
        let steps = 16;
        let times: Vec<f32> = (0..=steps).map(|i| i as f32 / steps as f32).collect();
        let angle = |t: f64| t * turns * std::f64::consts::TAU;
        let values: Vec<f32> = times
            .iter()
            .flat_map(|&t| DQuat::from_rotation_z(angle(f64::from(t))).to_array().map(|v| v as f32))
            .collect();
        let mut file = open(&with(&[Channel(node(0, "rotation"), "LINEAR", &times, &values, "VEC4")]));
        let scene = file.between(0.0, 1.0);
        let off = off(&scene, |t| DMat4::from_rotation_z(angle(t)));
        // The far corner gets at most two diagonals far: a thousandth of that, and what lies between the probes.
        let travel = 2.0_f64.sqrt() * if turns < 0.5 { 2.0 * (angle(1.0) / 2.0).sin() } else { 2.0 };
        let n = scene.motion.instances[&0].len();
        assert!(off <= 1.1e-3 * travel, "{turns} turns in {n} pieces: off by {off}, gets {travel} far");
        assert!(n.is_power_of_two() && n <= 128);
    }
}

#[test]
fn an_ease_in_and_out_whose_middle_is_on_its_chord_is_curved_all_the_same() {
    let values = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 8.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut file = open(&with(&[Channel(node(0, "translation"), "CUBICSPLINE", &[0.0, 1.0], &values, "VEC3")]));
    let scene = file.between(0.0, 1.0);
    let off = off(&scene, |t| DMat4::from_translation(DVec3::X * 8.0 * t * t * (3.0 - 2.0 * t)));
    assert!(off <= 1.1e-3 * 8.0, "off by {off} in {} pieces", scene.motion.instances[&0].len());
}

#[test]
fn what_goes_and_comes_back_within_the_shutter_moves() {
    let values = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let times = [0.0, 0.25, 0.5, 0.75, 1.0];
    let mut file = open(&with(&[Channel(node(0, "translation"), "LINEAR", &times, &values, "VEC3")]));
    let keys = &file.between(0.0, 1.0).motion.instances[&0];
    assert_eq!(keys.iter().map(|key| key.w_axis.x).collect::<Vec<_>>(), [1.0, 0.0, 1.0, 0.0]);
}

#[test]
fn mb_02_what_is_squashed_at_the_opening_stays_if_it_grows_and_keeps_its_motion() {
    let values = [0.0, 0.0, 0.0, 2.0, 2.0, 2.0];
    let sample = with(&[Channel(node(3, "scale"), "LINEAR", &[0.0, 1.0], &values, "VEC3")])
        .set("/nodes/-", json!({"mesh": 0}))
        .set("/nodes/-", json!({"mesh": 0, "scale": [0.0, 0.0, 0.0]}))
        .set("/scenes/0/nodes", json!([4, 3, 0, 1, 2]));
    let mut file = open(&sample);
    let scene = file.between(0.0, 1.0);
    assert_eq!(scene.instances.len(), 2, "one never is more than a point");
    assert_eq!(scene.motion.instances.keys().copied().collect::<Vec<_>>(), [0]);
    assert_eq!(scene.motion.instances[&0], [DMat4::from_scale(DVec3::splat(2.0))]);
    assert_eq!(file.at(0.0).instances.len(), 1);
}

#[test]
fn meshes_that_change_their_form_have_poses_at_the_same_times() {
    let turn = [[0.0, 0.0, 0.0, 1.0], DQuat::from_rotation_z(2.0).to_array().map(|v| v as f32)].concat();
    let move_3 = [100.0, 0.0, 0.0, 104.0, 0.0, 0.0];
    let sample = skinned(&[
        Channel(node(4, "rotation"), "LINEAR", &[0.0, 1.0], &turn, "VEC4"),
        Channel(node(3, "translation"), "LINEAR", &[0.0, 1.0], &move_3, "VEC3"),
    ]);
    let mut file = open(&sample);
    let scene = file.between(0.0, 1.0);
    assert!(scene.motion.instances.is_empty(), "joints place it");
    let poses = scene.motion.meshes[&0].clone();
    assert!(poses.len() >= 8 && poses.len().is_power_of_two(), "{}", poses.len());
    for (i, pose) in poses.iter().enumerate() {
        let then = file.at((i + 1) as f64 / poses.len() as f64);
        let world = scene.instances[0].world_from_object;
        let found = pose.positions.iter().map(|p| world.transform_point3(DVec3::from_array(p.map(f64::from))));
        assert!(found.zip(vertices(&then)).all(|(a, b)| a.abs_diff_eq(b, 2e-5)), "pose {i}");
        assert_eq!(pose.normals, then.meshes[0].normals);
        assert_eq!(pose.tangents.is_some(), then.meshes[0].tangents.is_some());
    }
}

#[test]
fn morph_weights_within_the_shutter_are_poses_and_nodes_of_other_weights_have_meshes_of_their_own() {
    let sample = morphing(&[0.0, 1.0], &[0.0, 1.0])
        .set("/nodes/-", json!({"mesh": 0}))
        .set("/scenes/0/nodes", json!([0, 1, 2, 3]));
    let mut file = open(&sample);
    let scene = file.between(0.0, 0.5);
    assert_eq!((scene.meshes.len(), scene.instances.len()), (2, 2), "equal at the opening, but only one moves");
    assert_eq!(scene.motion.meshes.keys().copied().collect::<Vec<_>>(), [0]);
    let [pose] = &scene.motion.meshes[&0][..] else { panic!("straight: one time after the opening") };
    assert_eq!(pose.positions, POSITIONS.map(|[x, y, _]| [x, y, 1.0]));
    assert_eq!(pose.normals.as_deref(), Some(&[[0.5, 0.0, 1.0]; 4][..]));
    assert_eq!(file.at(0.0).meshes.len(), 1);
}

#[test]
fn the_shutter_of_the_file_is_that_of_its_cameras() {
    let values = [0.0, 0.0, 0.0, 24.0, 0.0, 0.0];
    let still = with(&[Channel(node(0, "translation"), "LINEAR", &[0.0, 24.0], &values, "VEC3")]);
    let at = |sample: &Sample, shutter: Option<f64>| {
        let moment = Moment { time: 12.0, frame_seconds: 1.0, shutter, position: ShutterPosition::Center };
        let scene = open(sample).source.at(&moment).unwrap().0;
        let end = scene.motion.instances.get(&0).map(|keys| keys[keys.len() - 1].w_axis.x);
        (scene.instances[0].world_from_object.w_axis.x, end, scene.warnings.len())
    };
    assert_eq!(at(&still, None), (12.0, None, 0));
    let of_camera = still.clone().set("/cameras/0/extras", json!({"prt_shutter": 0.5}));
    assert_eq!(at(&of_camera, None), (11.75, Some(12.25), 0));
    let of_node = of_camera.clone().set("/nodes/1/extras", json!({"prt_shutter": 1}));
    assert_eq!(at(&of_node, None), (11.5, Some(12.5), 0), "the node's own counts before the camera's");
    assert_eq!(at(&of_node, Some(0.0)), (12.0, None, 0));
    let two = of_node.set("/nodes/-", json!({"camera": 0})).set("/scenes/0/nodes", json!([0, 1, 2, 3]));
    assert_eq!(at(&two, None), (11.5, Some(12.5), 1), "they differ");
    let (place, text) = problem(&still.set("/cameras/0/extras", json!({"prt_shutter": 180})));
    assert!(place == "/cameras/0/extras/prt_shutter" && text.contains("from 0 to 1"), "{text}");
}

#[test]
fn an_obj_is_the_same_in_every_frame_and_says_so() {
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("a.obj");
    std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let mut source = SceneSource::open(&path, &LoadOptions::default(), &AnimationChoice::default()).unwrap();
    let mut at = |time| source.at(&Moment { time, frame_seconds: 1.0, ..Moment::default() }).unwrap().0;
    let (a, b) = (at(0.0), at(1.0));
    assert!(Arc::ptr_eq(&a.meshes[0], &b.meshes[0]));
    assert!(b.warnings.iter().any(|w| w.contains("every frame is the same")), "{:?}", b.warnings);
    assert_eq!(load(&path, &LoadOptions::default()).unwrap().0.instances.len(), 1);
}
