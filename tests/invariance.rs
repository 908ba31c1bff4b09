//! SELF-04, SELF-05, SELF-06 and GEO-08: pictures that must not change when the world is scaled, moved, turned or mirrored, or
//! when surfaces coincide. 32 x 32 pixels by `bvh`; the z-tests compare the mean of paired pixel differences (same seeds)
//! with its standard error over pixels and pass below 4 (two-sided 6e-5 a test, about 20 tests).

mod support;

use glam::{DMat4, DQuat, DVec3};
use prt::accel::geometry::Geometry;
use prt::light::Light;
use prt::render::{AccelChoice, Frame, RenderSettings, geometry};
use prt::scene::{Instance, Scene, SceneBuilder};
use prt::shape::Mesh;
use support::pictures::{settings, shoot};
use support::scenes;

const SIZE: u32 = 32;

fn shot(scene: &Scene, spp: u32, accel: AccelChoice) -> Frame {
    shoot(scene, &RenderSettings { accel, ..settings(SIZE, spp, 0) })
}

/// `scene` with everything in it placed by `world`, which keeps angles; `scale` is its factor on lengths. `mirror` is
/// applied to cameras' and lights' own axes, which stay rigid.
fn placed(scene: &Scene, world: DMat4, scale: f64, mirror: DMat4) -> Scene {
    let mut scene = scene.clone();
    for instance in &mut scene.instances {
        instance.world_from_object = world * instance.world_from_object;
    }
    let rigid = |m: DMat4| {
        let moved = world * m * mirror;
        let axis = |c: glam::DVec4| c / scale;
        DMat4::from_cols(axis(moved.x_axis), axis(moved.y_axis), axis(moved.z_axis), moved.w_axis)
    };
    for light in &mut scene.lights {
        light.world_from_light = rigid(light.world_from_light);
        // The same illuminance at the same place of the scene.
        let square = (scale * scale) as f32;
        match &mut light.light {
            Light::Point { intensity } | Light::Spot { intensity, .. } => *intensity = intensity.map(|i| i * square),
            Light::Directional { .. } => {}
        }
    }
    for camera in &mut scene.cameras {
        camera.world_from_camera = rigid(camera.world_from_camera);
    }
    scene
}

/// |z| of the mean difference of luminance-like sums; pixels are paired by `pair`.
fn z(a: &Frame, b: &Frame, pair: impl Fn(usize) -> usize) -> f64 {
    let sum = |p: [f32; 3]| f64::from(p[0]) + f64::from(p[1]) + f64::from(p[2]);
    let differences: Vec<f64> = (0..a.pixels.len()).map(|i| sum(a.pixels[i]) - sum(b.pixels[pair(i)])).collect();
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
    if variance == 0.0 { 0.0 } else { (mean / (variance / n).sqrt()).abs() }
}

/// Pixels that are not the same bits.
fn different(a: &Frame, b: &Frame) -> usize {
    let bits = |p: &[f32; 3]| p.map(f32::to_bits);
    a.pixels.iter().zip(&b.pixels).filter(|(a, b)| bits(a) != bits(b)).count()
}

const SCENES: [&str; 2] = ["cornell", "punctual"];

#[test]
fn self04_scaled_by_powers_of_two_pictures_keep_their_bits() {
    for name in SCENES {
        let scene = scenes::reference(name);
        let straight = shot(&scene, 4, AccelChoice::Bvh);
        for j in [-20, -7, 5, 23] {
            let s = 2f64.powi(j);
            let scaled = placed(&scene, DMat4::from_scale(DVec3::splat(s)), s, DMat4::IDENTITY);
            let found = shot(&scaled, 4, AccelChoice::Bvh);
            assert_eq!(different(&straight, &found), 0, "{name}, scaled by 2^{j}");
        }
    }
}

#[test]
fn self04_turned_mirrored_and_moved_worlds_look_the_same() {
    for name in SCENES {
        let scene = scenes::reference(name);
        let straight = shot(&scene, 16, AccelChoice::Bvh);
        let turns = [
            DMat4::from_rotation_y(std::f64::consts::FRAC_PI_2),
            DMat4::from_rotation_x(std::f64::consts::PI),
            DMat4::from_quat(DQuat::from_axis_angle(DVec3::new(0.36, 0.48, 0.8), 1.0)),
        ];
        for (i, turn) in turns.into_iter().enumerate() {
            let found = shot(&placed(&scene, turn, 1.0, DMat4::IDENTITY), 16, AccelChoice::Bvh);
            let z = z(&straight, &found, |i| i);
            assert!(z < 4.0, "{name}, turn {i}: z = {z}");
        }
        let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        let found = shot(&placed(&scene, mirror, 1.0, mirror), 16, AccelChoice::Bvh);
        let (w, z) = (SIZE as usize, |f: &Frame| z(&straight, f, |i| i / 32 * 32 + 31 - i % 32));
        assert!(z(&found) < 4.0, "{name}, mirrored ({w} pixels across): z = {}", z(&found));
    }
}

/// All vertices of the world of a geometry.
fn vertices(scene: &Scene) -> Vec<[f32; 3]> {
    let geometry: Geometry = geometry(scene, &settings(SIZE, 1, 0)).unwrap_or_else(|e| panic!("{e}"));
    geometry.world.parts.iter().flat_map(|part| part.triangles.positions.clone()).collect()
}

#[test]
fn self05_scenes_far_from_the_origin_are_the_scenes_at_the_origin() {
    for name in SCENES {
        let scene = scenes::reference(name);
        let (straight, at) = (shot(&scene, 16, AccelChoice::Bvh), vertices(&scene));
        let most = at.iter().flatten().fold(0.0, |m: f32, c| m.max(c.abs()));
        for t in [1e3, 1e5, 1e6] {
            let away = placed(&scene, DMat4::from_translation(DVec3::new(t, -0.3 * t, 0.7 * t)), 1.0, DMat4::IDENTITY);
            // Recentred in f64 before they become f32: one ulp of the scene.
            for (a, b) in at.iter().flatten().zip(vertices(&away).iter().flatten()) {
                assert!((a - b).abs() <= most * f32::EPSILON, "{name} at {t}: {a} became {b}");
            }
            let found = shot(&away, 16, AccelChoice::Bvh);
            let z = z(&straight, &found, |i| i);
            assert!(z < 4.0, "{name} at {t} m: z = {z}");
        }
    }
}

/// A square that emits `radiance` of each, all in the same place, before a camera.
fn coincident(radiance: &[f32]) -> Scene {
    let mut builder = SceneBuilder::new(0);
    for &radiance in radiance {
        let material = builder.add_material(scenes::lamp(0.0, radiance));
        let at = |x: f32, y: f32| [x, y, 0.1 * x - 0.3 * y];
        scenes::add_quad(&mut builder, [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)], material);
    }
    scenes::add_camera(&mut builder, DVec3::new(0.1, 0.2, 4.0), DVec3::ZERO, 0.4);
    builder.finish()
}

#[test]
fn self06_of_coincident_surfaces_the_first_is_seen_by_our_own_backends() {
    for accel in [AccelChoice::Bvh, AccelChoice::Linear] {
        for radiance in [[1.0, 2.0, 3.0], [3.0, 1.0, 2.0]] {
            let frame = shot(&coincident(&radiance), 4, accel);
            let first = [radiance[0]; 3];
            assert!(frame.pixels.iter().all(|p| *p == first), "{accel:?}, {radiance:?}: {:?}", frame.pixels[0]);
        }
    }
}

#[test]
fn self06_pictures_of_coincident_surfaces_do_not_depend_on_threads() {
    let scene = coincident(&[1.0, 2.0, 1.5, 0.5]);
    for accel in [AccelChoice::Bvh, AccelChoice::Auto] {
        let with = |threads| {
            let settings = RenderSettings { accel, threads: Some(threads), ..settings(SIZE, 4, 0) };
            shoot(&scene, &settings)
        };
        assert_eq!(different(&with(1), &with(3)), 0, "{accel:?}");
    }
}

#[test]
fn geo08_vertex_colours_that_are_all_alike_are_that_colour_bit_for_bit() {
    let scene = |colour: f32, as_vertices: bool| {
        let mut builder = SceneBuilder::new(0);
        let white = builder.add_material(scenes::lambert(if as_vertices { 1.0 } else { colour }));
        let quad = vec![[-1.0, -1.0, 0.0], [1.0, -0.9, 0.1], [0.9, 1.0, 0.0], [-1.0, 1.0, -0.2]];
        let mesh = builder.add_mesh(Mesh {
            colors: as_vertices.then(|| vec![[colour, colour, colour, 1.0]; 4]),
            positions: quad,
            normals: None,
            uv_sets: Vec::new(),
            tangents: None,
            indices: vec![[0, 1, 2], [0, 2, 3]],
            material: white,
            name: String::from("quad"),
        });
        builder.add_instance(Instance { mesh, world_from_object: DMat4::IDENTITY, name: String::from("quad") });
        let light = Light::Point { intensity: [10.0; 3] };
        scenes::add_light(&mut builder, light, DVec3::new(0.3, 0.4, 2.0), DVec3::NEG_Z);
        scenes::add_camera(&mut builder, DVec3::new(0.1, 0.2, 4.0), DVec3::ZERO, 0.4);
        builder.finish()
    };
    // Sums of three weighted corners differ from these in a third of the hits.
    for colour in [0.1, 0.7333] {
        let (plain, vertices) =
            (shot(&scene(colour, false), 4, AccelChoice::Bvh), shot(&scene(colour, true), 4, AccelChoice::Bvh));
        assert!(plain.pixels.iter().any(|p| p[0] > 0.0));
        assert_eq!(different(&plain, &vertices), 0, "colour {colour}");
    }
}
