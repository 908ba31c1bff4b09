//! What moves while the shutter is open, against closed forms and against pictures of the single moments. MB-01 to MB-03.
//!
//! Each way in which something moves is tried: by the map of a placed mesh (what is dark), by its vertices (what shines, and
//! what changes its form), in both backends and by brute force. Seeds are fixed and times are stratified, but not together
//! with places on the film: with 1024 samples a pixel at an edge is off by 6e-3 (one standard deviation).

mod support;

use glam::{DMat4, DVec3, Vec3};
use prt::accel::wide::WideBvh;
use prt::camera::{Camera, Lens, Projection};
use prt::light::{Environment, Light};
use prt::material::Material;
use prt::render::{AccelChoice, DefaultLight, Frame, RenderSettings, prepare};
use prt::scene::{Instance, Pose, Scene, SceneBuilder};
use prt::shape::Mesh;
use prt::texture::Param;
use support::pictures::{settings, shoot};
use support::{scenes, smooth};

/// What a thing of radiance 1 is made of: that which only shows its colour is placed, that which shines is not.
fn colour() -> Material {
    Material { base_color: Param::constant([1.0; 3]), unlit: true, ..Material::default() }
}

fn without_studio(spp: u32) -> RenderSettings {
    RenderSettings { default_light: DefaultLight::Off, ..settings(8, spp, 0) }
}

/// Parallel rays along -z over x, y in [-4, 4]: a pixel of the pictures of 8 x 8 is a metre.
fn look_down_z(builder: &mut SceneBuilder) {
    builder.add_camera(Camera {
        name: String::new(),
        world_from_camera: DMat4::from_translation(DVec3::Z * 10.0),
        projection: Projection::Orthographic { xmag: 4.0, ymag: 4.0 },
        lens: Lens::default(),
    });
}

/// Adds a mesh that goes through `maps`.
fn add_moving(builder: &mut SceneBuilder, mesh: Mesh, maps: &[DMat4]) {
    let mesh = builder.add_mesh(mesh);
    let i = add_instance(builder, mesh, maps[0]);
    builder.motion().instances.insert(i, maps[1..].to_vec());
}

/// The instances of a test are counted here, because the builder does not tell.
fn add_instance(builder: &mut SceneBuilder, mesh: prt::scene::MeshId, world_from_object: DMat4) -> u32 {
    builder.add_instance(Instance { mesh, world_from_object, name: String::from("thing") });
    mesh.0
}

/// A half plane of which x < 0 is covered.
fn half_plane(builder: &mut SceneBuilder, material: Material) -> Mesh {
    let material = builder.add_material(material);
    let positions = vec![[-50.0, -50.0, 0.0], [0.0, -50.0, 0.0], [0.0, 50.0, 0.0], [-50.0, 50.0, 0.0]];
    Mesh::plain("half", positions, vec![[0, 1, 2], [0, 2, 3]], material)
}

fn backends() -> [AccelChoice; 3] {
    // `Auto` is Embree where that is at hand.
    [AccelChoice::Bvh, AccelChoice::Linear, AccelChoice::Auto]
}

/// Formula 2.9: the object covers x < x0 + v t, seen through a box of width 1 about `x`.
fn ramp(x0: f64, v: f64, x: f64) -> f64 {
    let s = |t: f64| match t {
        t if t < -0.5 => 0.0,
        t if t <= 0.5 => 0.5 * (t + 0.5).powi(2),
        t => t,
    };
    (s(x0 + v - x) - s(x0 - x)) / v
}

#[test]
fn mb_02_a_moving_edge_leaves_the_ramp_of_the_closed_form() {
    let shift = |x: f64| DMat4::from_translation(DVec3::X * x);
    let (x0, v) = (-2.3, 3.1);
    for (kind, material) in [("placed", colour()), ("deformed", scenes::lamp(0.0, 1.0))] {
        // Keys in between tell nothing new.
        for keys in [1, 4] {
            for accel in backends() {
                let mut builder = SceneBuilder::new(0);
                look_down_z(&mut builder);
                let mesh = half_plane(&mut builder, material.clone());
                let maps: Vec<DMat4> = (0..=keys).map(|k| shift(x0 + v * f64::from(k) / f64::from(keys))).collect();
                add_moving(&mut builder, mesh, &maps);
                let frame = shoot(&builder.finish(), &RenderSettings { accel, ..without_studio(1024) });
                for column in 0..8 {
                    let exact = ramp(x0, v, f64::from(column) - 3.5);
                    let rows = frame.pixels.iter().skip(column as usize).step_by(8);
                    let off = rows.map(|pixel| f64::from(pixel[0])).sum::<f64>() / 8.0 - exact;
                    assert!(off.abs() < 8e-3, "{kind}, {keys} segments, {accel:?}: column {column}: {off} off {exact}");
                }
            }
        }
    }
}

/// A sector of `angle` about the origin in the plane, from the x axis counter-clockwise.
fn sector(builder: &mut SceneBuilder, angle: f64, material: Material) -> Mesh {
    let material = builder.add_material(material);
    let n = 64;
    let rim = (0..=n).map(|i| {
        let (sin, cos) = (angle * f64::from(i) / f64::from(n)).sin_cos();
        DVec3::new(cos, sin, 0.0).as_vec3() * 20.0
    });
    let positions = std::iter::once(Vec3::ZERO).chain(rim).map(|p| p.to_array()).collect();
    let indices = (1..=n as u32).map(|i| [0, i, i + 1]).collect();
    Mesh::plain("sector", positions, indices, material)
}

// The sector goes more than once around: only what is known at many times can tell.
#[test]
fn mb_02_a_sector_that_turns_covers_its_share_of_the_time() {
    let (angle, turn) = (1.1, 2.0 * std::f64::consts::PI + 1.7);
    for (kind, material) in [("placed", colour()), ("deformed", scenes::lamp(0.0, 1.0))] {
        for accel in backends() {
            let mut builder = SceneBuilder::new(0);
            look_down_z(&mut builder);
            let mesh = sector(&mut builder, angle, material.clone());
            let maps: Vec<DMat4> = (0..=64).map(|k| DMat4::from_rotation_z(turn * f64::from(k) / 64.0)).collect();
            add_moving(&mut builder, mesh, &maps);
            let frame = shoot(&builder.finish(), &RenderSettings { accel, ..without_studio(4096) });
            for (i, pixel) in frame.pixels.iter().enumerate() {
                let (x, y) = ((i % 8) as f64 - 3.5, 3.5 - (i / 8) as f64);
                // Near the middle a pixel sees many directions.
                if x.hypot(y) < 2.0 {
                    continue;
                }
                // At how many times of the turn the direction of the pixel is between its start and its end.
                let towards = y.atan2(x).rem_euclid(std::f64::consts::TAU);
                let covered: f64 = (-1..=2)
                    .map(|k| {
                        let at = towards + std::f64::consts::TAU * f64::from(k);
                        (at.min(turn) - (at - angle).max(0.0)).max(0.0)
                    })
                    .sum();
                let exact = covered / turn;
                // What a pixel 1 / 2 rad wide blurs.
                let slack = if exact < 0.99 * angle / turn || exact > 1.01 * angle / turn { 0.03 } else { 0.012 };
                let off = f64::from(pixel[0]) - exact;
                assert!(off.abs() < slack, "{kind}, {accel:?}: pixel {i}: {off} off {exact}");
            }
        }
    }
}

/// Something textured and lit that lies on a floor, with `offset` given to all of it at later times.
fn lit_scene(offsets: &[DVec3]) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let (grey, red) = (builder.add_material(scenes::lambert(0.5)), builder.add_material(scenes::white_metal(0.4)));
    let lamp = builder.add_material(scenes::lamp(0.2, 3.0));
    let floor = Mesh::plain(
        "floor",
        vec![[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]],
        vec![[0, 1, 2], [0, 2, 3]],
        grey,
    );
    let sheet = Mesh::plain(
        "lamp",
        vec![[-0.5, 3.0, -0.5], [0.5, 3.0, -0.5], [0.5, 3.0, 0.5], [-0.5, 3.0, 0.5]],
        vec![[0, 1, 2], [0, 2, 3]],
        lamp,
    );
    let ball = smooth::smooth_sphere(16, 24, red);
    for (mesh, place) in
        [(floor, DMat4::IDENTITY), (sheet, DMat4::IDENTITY), (ball, DMat4::from_translation(DVec3::Y * 1.1))]
    {
        let mut maps = vec![place];
        maps.extend(offsets.iter().map(|&offset| DMat4::from_translation(offset) * place));
        add_moving(&mut builder, mesh, &maps);
    }
    scenes::add_light(&mut builder, Light::Point { intensity: [4.0; 3] }, DVec3::new(2.0, 2.0, 1.0), DVec3::NEG_Y);
    let spot = Light::Spot { intensity: [9.0; 3], inner_cone: 0.3, outer_cone: 0.5 };
    scenes::add_light(&mut builder, spot, DVec3::new(-2.0, 3.0, 1.0), DVec3::new(1.0, -2.0, 0.0).normalize());
    scenes::add_camera(&mut builder, DVec3::new(0.0, 3.0, 6.0), DVec3::Y, 0.8);
    let mut scene = builder.finish();
    let later = |first: DMat4| offsets.iter().map(|&offset| DMat4::from_translation(offset) * first).collect();
    if !offsets.is_empty() {
        for (i, light) in scene.lights.iter().enumerate() {
            scene.motion.lights.insert(i as u32, later(light.world_from_light));
        }
        scene.motion.cameras.insert(0, later(scene.cameras[0].world_from_camera));
    }
    scene
}

/// Means of the picture's quarters.
fn quarters(frame: &Frame) -> [f64; 4] {
    let n = frame.width as usize;
    let mut sums = [0.0; 4];
    for (i, pixel) in frame.pixels.iter().enumerate() {
        let quarter = 2 * usize::from(2 * (i / n) >= n) + usize::from(2 * (i % n) >= n);
        sums[quarter] += f64::from(pixel[0]) * 4.0 / frame.pixels.len() as f64;
    }
    sums
}

// Lights are chosen by where they go, so the random numbers do other things.
#[test]
fn mb_03_a_camera_that_goes_with_everything_sees_it_stand_still() {
    let still = lit_scene(&[]);
    let path = [DVec3::new(0.4, 0.1, -0.3), DVec3::new(1.5, -0.2, 0.4)];
    let moving = lit_scene(&path);
    for accel in [AccelChoice::Bvh, AccelChoice::Auto] {
        let settings = RenderSettings { accel, ..settings(24, 1024, 0) };
        let (a, b) = (quarters(&shoot(&still, &settings)), quarters(&shoot(&moving, &settings)));
        for (a, b) in a.iter().zip(b) {
            assert!((a / b - 1.0).abs() < 0.02, "{accel:?}: {a} and {b}");
        }
    }
}

#[test]
fn mb_01_equal_keys_are_the_still_scene_to_the_bit() {
    let (still, moving) = (lit_scene(&[]), lit_scene(&[DVec3::ZERO, DVec3::ZERO]));
    assert!(!still.meshes.is_empty() && moving.motion.instances.is_empty(), "what keeps its place does not move");
    // The test put lights and camera in after the scene was checked.
    for accel in [AccelChoice::Bvh, AccelChoice::Auto] {
        let settings = RenderSettings { accel, ..settings(16, 16, 0) };
        assert_eq!(shoot(&still, &settings).pixels, shoot(&moving, &settings).pixels, "{accel:?}");
    }
}

// 8 moments in the middle of as many equal parts of the time, against the light of all of it.
#[test]
fn mb_03_moving_lights_give_the_mean_of_their_moments() {
    let path = |t: f64| DMat4::from_translation(DVec3::new(-1.0 + 2.0 * t, 1.5, 0.3 - 0.4 * t));
    // Turns about z, so that it sweeps over the floor.
    let swing = |t: f64| {
        DMat4::from_translation(DVec3::Y * 1.5)
            * DMat4::from_rotation_z(-0.4 + 0.8 * t)
            * DMat4::from_rotation_x(-std::f64::consts::FRAC_PI_2)
    };
    let point = Light::Point { intensity: [2.0; 3] };
    let spot = Light::Spot { intensity: [2.0; 3], inner_cone: 0.2, outer_cone: 0.6 };
    let sun = Light::Directional { illuminance: [2.0; 3] };
    // What moves, whether lights have a size, and how many there are: the choice among them must know of the motion.
    type Case<'a> = (&'a str, Option<Light>, &'a dyn Fn(f64) -> DMat4, f64, usize);
    let cases: [Case; 7] = [
        ("point", Some(point), &path, 0.0, 1),
        ("spot", Some(spot), &swing, 0.0, 1),
        ("points", Some(point), &path, 0.0, 3),
        ("spots", Some(spot), &swing, 0.0, 3),
        ("balls", Some(point), &path, 0.2, 2),
        ("suns", Some(sun), &swing, 0.0, 2),
        ("lamps", None, &path, 0.0, 2),
    ];
    for (what, light, at, radius, count) in cases {
        let scene = |from: f64, to: f64| {
            let mut builder = SceneBuilder::new(0);
            let (floor, lamp) = (builder.add_material(scenes::lambert(0.5)), scenes::lamp(0.0, 3.0));
            scenes::add_quad(
                &mut builder,
                [[-2.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 0.0, -2.0], [-2.0, 0.0, -2.0]],
                floor,
            );
            let lamp = builder.add_material(Material { double_sided: true, ..lamp });
            let sheet = vec![[-0.3, 0.0, -0.3], [0.3, 0.0, -0.3], [0.3, 0.0, 0.3], [-0.3, 0.0, 0.3]];
            let aside = |k: usize| DMat4::from_translation(DVec3::Z * 0.7 * k as f64);
            let keys = 32;
            let maps = |k: usize| -> Vec<DMat4> {
                (0..=keys).map(|i| aside(k) * at(from + (to - from) * f64::from(i) / f64::from(keys))).collect()
            };
            for k in 0..count {
                let maps = maps(k);
                match light {
                    Some(light) => {
                        builder.add_light(prt::scene::PlacedLight {
                            light,
                            world_from_light: maps[0],
                            name: String::new(),
                        });
                        builder.motion().lights.insert(k as u32, maps[1..].to_vec());
                    }
                    None => {
                        let mesh = Mesh::plain("lamp", sheet.clone(), vec![[0, 1, 2], [0, 2, 3]], lamp);
                        add_moving(&mut builder, mesh, &maps);
                    }
                }
            }
            // Below the lamps, so that only their light is seen.
            scenes::add_camera(&mut builder, DVec3::new(0.0, 1.3, 0.01), DVec3::ZERO, 1.8);
            builder.finish()
        };
        let settings = RenderSettings {
            light_radius: radius,
            max_bounces: Some(0),
            default_light: DefaultLight::Off,
            ..settings(4, 1024, 0)
        };
        let whole = shoot(&scene(0.0, 1.0), &settings);
        let mut mean = vec![0.0; whole.pixels.len()];
        for k in 0..8 {
            let t = (f64::from(k) + 0.5) / 8.0;
            // A short part of the time, lest it be a still scene.
            for (sum, pixel) in mean.iter_mut().zip(shoot(&scene(t - 1e-3, t + 1e-3), &settings).pixels) {
                *sum += f64::from(pixel[0]) / 8.0;
            }
        }
        let most = mean.iter().copied().fold(0.0, f64::max);
        for (i, (mean, pixel)) in mean.iter().zip(&whole.pixels).enumerate() {
            let off = f64::from(pixel[0]) - mean;
            assert!(off.abs() < 0.03 * mean.max(0.5 * most), "{what}: pixel {i}: {off} off {mean}");
        }
    }
}

/// Surroundings of radiance 1.
fn furnace(builder: &mut SceneBuilder) {
    let radiance = vec![[1.0; 3]; 8].into();
    builder.set_environment(Environment { width: 4, height: 2, radiance, rotation: 0.0, scale: 1.0 });
}

// A convex thing of albedo 0.5 shows 0.5 wherever it is: a ray that met the surface which it leaves would show less, and
// normals of another moment would lose light at the rim.
#[test]
fn mb_01_what_moves_does_not_shadow_itself() {
    let maps: Vec<DMat4> = (0..=8)
        .map(|k| {
            let t = f64::from(k) / 8.0;
            DMat4::from_translation(DVec3::new(1.5 * t, 0.0, 0.0))
                * DMat4::from_rotation_y(2.0 * t)
                * DMat4::from_scale(DVec3::new(1.0 + t, 1.0, 1.0 - 0.3 * t))
        })
        .collect();
    for far in [0.0, 1000.0] {
        for deforms in [false, true] {
            for accel in [AccelChoice::Bvh, AccelChoice::Auto] {
                let mut builder = SceneBuilder::new(0);
                furnace(&mut builder);
                let grey = builder.add_material(scenes::lambert(0.5));
                let ball = smooth::smooth_sphere(24, 32, grey);
                let at = DMat4::from_translation(DVec3::X * far);
                if deforms {
                    let pose = |map: &DMat4| Pose {
                        positions: ball.positions.iter().map(|&p| transformed(map, p)).collect(),
                        normals: ball.normals.as_ref().map(|n| n.iter().map(|&n| turned(map, n)).collect()),
                        tangents: None,
                    };
                    let poses = maps[1..].iter().map(pose).collect();
                    let mesh = builder.add_mesh(ball);
                    add_instance(&mut builder, mesh, at);
                    builder.motion().meshes.insert(mesh.0, poses);
                } else {
                    let maps: Vec<DMat4> = maps.iter().map(|map| at * *map).collect();
                    add_moving(&mut builder, ball, &maps);
                }
                scenes::add_camera(&mut builder, DVec3::new(0.7 + far, 1.0, 5.0), DVec3::new(0.7 + far, 0.0, 0.0), 0.5);
                let settings = RenderSettings { accel, ..settings(16, 64, 0) };
                let frame = shoot(&builder.finish(), &settings);
                let kind = if deforms { "deformed" } else { "placed" };
                let (mut inside, mut darker) = (0, 0);
                for pixel in &frame.pixels {
                    assert!(pixel[0] > 0.4999 - 0.02 && pixel[0] < 1.0001, "{kind}, {accel:?}: {pixel:?}");
                    inside += usize::from(pixel[0] < 0.6);
                    darker += usize::from(pixel[0] < 0.4999);
                }
                assert!(
                    inside > 20 && darker <= inside / 50,
                    "{kind}, {accel:?}, {far}: {darker} of {inside} lose light"
                );
            }
        }
    }
}

fn transformed(map: &DMat4, p: [f32; 3]) -> [f32; 3] {
    map.transform_point3(Vec3::from(p).as_dvec3()).as_vec3().to_array()
}

/// The inverse transpose.
fn turned(map: &DMat4, n: [f32; 3]) -> [f32; 3] {
    map.inverse().transpose().transform_vector3(Vec3::from(n).as_dvec3()).normalize().as_vec3().to_array()
}

#[test]
fn mb_01_only_what_moves_is_kept_at_several_times() {
    let mut builder = SceneBuilder::new(0);
    let (grey, lamp) = (builder.add_material(scenes::lambert(0.5)), builder.add_material(scenes::lamp(0.0, 1.0)));
    let still = builder.add_mesh(smooth::smooth_sphere(4, 6, grey));
    add_instance(&mut builder, still, DMat4::IDENTITY);
    add_moving(&mut builder, smooth::smooth_sphere(4, 6, grey), &[DMat4::IDENTITY, DMat4::from_translation(DVec3::X)]);
    add_moving(&mut builder, smooth::smooth_sphere(4, 6, lamp), &[DMat4::IDENTITY, DMat4::from_translation(DVec3::X)]);
    scenes::add_camera(&mut builder, DVec3::Z * 4.0, DVec3::ZERO, 0.5);
    let geometry = prt::render::geometry(&builder.finish(), &settings(8, 1, 0)).unwrap();
    let keys: Vec<usize> = geometry.world.parts.iter().map(|part| part.keys()).collect();
    assert_eq!(keys, [1, 2], "the world holds what is still and the lamp");
    assert_eq!(geometry.placements.iter().map(|placement| placement.keys.len()).collect::<Vec<_>>(), [2]);
    let _ = WideBvh::build(geometry);
    assert!(prepare(&lit_scene(&[]), &settings(8, 1, 0)).is_ok_and(|prepared| !prepared.tables.moves()));
}
