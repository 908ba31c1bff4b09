//! Paths through surfaces: slabs with closed forms, volumes in each other, furnaces of glass, light through thin panes.
//! IDs are those of the design's list of tests.
//!
//! Rendered values: seeds 0..8, 8 x 8 pixels that look at one point (furnaces: at a whole body), Student's t over seeds at
//! 1e-4, at most 0.5 % off, with 4 standard errors inside that; a value 2 % away must not pass. False alarms on a change
//! of the random numbers: at most 1.6e-4 a value.

mod support;

use glam::{DMat4, DVec3};
use prt::light::{Environment, Light};
use prt::material::Material;
use prt::material::extensions::{Transmission, Volume};
use prt::render::{Brdf, DefaultLight, RenderSettings};
use prt::scene::{Instance, MaterialId, Scene, SceneBuilder};
use prt::shape::Mesh;
use prt::texture::Param;
use support::pictures::{channel_means, settings, shoot, shoot_seeds};
use support::scenes;
use support::verdict::{Expected, mean_test};

/// Field of view so small that all pixels see one point.
const POINT_VIEW: f64 = 1e-6;
/// Largest relative bias, and the factor that must not pass.
const BIAS: f64 = 5e-3;
const FAULT: f64 = 1.02;

fn options(spp: u32) -> RenderSettings {
    // What reflects shows nothing: no studio.
    let default_light = DefaultLight::Off;
    RenderSettings { brdf: Brdf::default(), max_bounces: None, default_light, ..settings(8, spp, 0) }
}

/// What the picture shows over seeds, per channel, against `value`.
fn assert_shows(what: &str, scene: &Scene, spp: u32, value: [f64; 3]) {
    let runs = shoot_seeds(scene, &options(spp), 8);
    for (channel, value) in value.into_iter().enumerate() {
        let runs: Vec<f64> = runs.iter().map(|run| channel_means(&run.pixels)[channel]).collect();
        let test = |value: f64| mean_test(&runs, Expected { value, rel_se: 0.0 }).within(BIAS);
        test(value).unwrap_or_else(|e| panic!("{what}, channel {channel}: expected {value:.6}: {e}"));
        assert!(test(value * FAULT).is_err(), "{what}: the test does not see a factor of {FAULT}");
    }
}

/// Clear smooth glass with an inside.
fn glass(ior: f32) -> Material {
    absorbing(ior, [1.0; 3], f32::INFINITY)
}

/// Smooth glass that leaves `color` of white light after `distance` metres.
fn absorbing(ior: f32, color: [f32; 3], distance: f32) -> Material {
    Material {
        volume: Some(Volume { attenuation_color: color, attenuation_distance: distance }),
        ior,
        ..pane([1.0; 3], 0.0)
    }
}

/// A thin wall of glass.
fn pane(color: [f32; 3], roughness: f32) -> Material {
    Material {
        base_color: Param::constant(color),
        metallic: Param::constant(0.0),
        roughness: Param::constant(roughness),
        transmission: Transmission { factor: Param::constant(1.0), dispersion: 0.0 },
        double_sided: true,
        ..Material::default()
    }
}

fn white_sky() -> Environment {
    Environment::new(4, 2, [[1.0; 3]; 8])
}

/// Adds a closed box, fronts outwards, `map`ped.
fn add_box(builder: &mut SceneBuilder, low: [f32; 3], high: [f32; 3], map: DMat4, material: MaterialId) {
    let at = |i: usize, axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let mesh = builder.add_mesh(Mesh {
        positions: (0..8).map(|i| [0, 1, 2].map(|axis| at(i, axis))).collect(),
        normals: None,
        uv_sets: Vec::new(),
        colors: None,
        tangents: None,
        indices: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        material,
        name: String::from("box"),
    });
    builder.add_instance(Instance { mesh, world_from_object: map, name: String::from("box") });
}

/// Half the width of slabs: light never gets to their ends.
const WIDE: f32 = 30.0;

/// Adds a slab from `low` to `high` along z.
fn add_slab(builder: &mut SceneBuilder, low: f32, high: f32, material: Material) {
    let material = builder.add_material(material);
    add_box(builder, [-WIDE, -WIDE, low], [WIDE, WIDE, high], DMat4::IDENTITY, material);
}

/// Adds a lamp of 1 nit below everything, and a camera that looks at the origin's z axis from `degrees` off it, `height`
/// above the plane z = 0.
fn over_a_lamp(builder: &mut SceneBuilder, degrees: f64, height: f64) {
    let lamp = builder.add_material(scenes::lamp(0.0, 1.0));
    let w = WIDE;
    scenes::add_quad(builder, [[-w, -w, -6.0], [w, -w, -6.0], [w, w, -6.0], [-w, w, -6.0]], lamp);
    let (sin, cos) = degrees.to_radians().sin_cos();
    let direction = DVec3::new(sin, 0.0, cos);
    scenes::add_camera(builder, direction * (height / cos), DVec3::ZERO, POINT_VIEW);
}

/// Fresnel's reflectance of a boundary of index `eta` at the cosine `mu` before it.
fn fresnel(mu: f64, eta: f64) -> f64 {
    let sin2 = (1.0 - mu * mu) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let t = (1.0 - sin2).sqrt();
    let (s, p) = ((mu - eta * t) / (mu + eta * t), (eta * mu - t) / (eta * mu + t));
    0.5 * (s * s + p * p)
}

/// Cosine in a medium of index `n` of a ray of cosine `mu` in air.
fn bent(mu: f64, n: f64) -> f64 {
    (1.0 - (1.0 - mu * mu) / (n * n)).sqrt()
}

/// Share of light that gets through layers of these indices without absorption, air outside: reflectances of lossless
/// layers add up whatever the order of their reflections.
fn through_layers(mu: f64, indices: &[f64]) -> f64 {
    let mut all = vec![1.0];
    all.extend(indices);
    all.push(1.0);
    let reflected = all.windows(2).fold(0.0_f64, |r, pair| {
        let f = fresnel(bent(mu, pair[0]), pair[1] / pair[0]);
        r + (1.0 - r).powi(2) * f / (1.0 - r * f)
    });
    1.0 - reflected
}

#[test]
fn absorbing_slab_transmits_what_its_closed_form_says() {
    let (ior, d, color, distance) = (1.5, 0.4_f64, [0.9_f32, 0.5, 0.1], 0.7_f32);
    for degrees in [0.0_f64, 50.0] {
        let mut builder = SceneBuilder::new(0);
        add_slab(&mut builder, 0.0, d as f32, absorbing(ior as f32, color, distance));
        over_a_lamp(&mut builder, degrees, 3.0);
        let mu = degrees.to_radians().cos();
        let f = fresnel(mu, ior);
        let value = color.map(|c| {
            let a = f64::from(c).powf(d / bent(mu, ior) / f64::from(distance));
            (1.0 - f).powi(2) * a / (1.0 - f * f * a * a)
        });
        assert_shows(&format!("{degrees} degrees"), &builder.finish(), 256, value);
    }
}

#[test]
fn vol02_a_mirrored_slab_is_a_slab() {
    let (ior, d, color, distance) = (1.4_f64, 0.5_f64, [0.8_f32, 0.4, 0.2], 0.5_f32);
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(absorbing(ior as f32, color, distance));
    let map = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    add_box(&mut builder, [-WIDE, -WIDE, 0.0], [WIDE, WIDE, d as f32], map, material);
    over_a_lamp(&mut builder, 0.0, 3.0);
    let f = fresnel(1.0, ior);
    let value = color.map(|c| {
        let a = f64::from(c).powf(d / f64::from(distance));
        (1.0 - f).powi(2) * a / (1.0 - f * f * a * a)
    });
    assert_shows("mirrored", &builder.finish(), 256, value);
}

#[test]
fn vol02_liquid_in_glass_with_overlap_and_with_a_gap() {
    let mu = 40_f64.to_radians().cos();
    // (glass from, to), (liquid from, to), what the layers are then: overlap, gap, liquid all inside.
    let cases: [([f32; 2], [f32; 2], &[f64]); 3] = [
        ([0.0, 1.0], [-1.0, 0.2], &[1.5, 1.33]),
        ([0.0, 1.0], [-1.0, -0.0001], &[1.5, 1.0, 1.33]),
        ([-1.0, 1.0], [-0.5, 0.5], &[1.5, 1.33, 1.5]),
    ];
    for (glass_z, liquid_z, layers) in cases {
        let mut builder = SceneBuilder::new(0);
        add_slab(&mut builder, glass_z[0], glass_z[1], glass(1.5));
        add_slab(&mut builder, liquid_z[0], liquid_z[1], glass(1.33));
        over_a_lamp(&mut builder, 40.0, 3.0);
        assert_shows(&format!("{layers:?}"), &builder.finish(), 256, [through_layers(mu, layers); 3]);
    }
}

#[test]
fn vol02_a_camera_inside_looks_out_through_what_is_around_it() {
    let (ior, color, distance) = (1.5, [0.9_f32, 0.5, 0.2], 0.5_f32);
    let mut builder = SceneBuilder::new(0);
    add_slab(&mut builder, 0.0, 1.0, absorbing(ior as f32, color, distance));
    over_a_lamp(&mut builder, 0.0, 0.3);
    let f = fresnel(1.0, ior);
    let value = color.map(|c| {
        let a = |x: f64| f64::from(c).powf(x / f64::from(distance));
        // Out at once, or after going to the far side and back any number of times. Radiance in glass is denser.
        ior * ior * (1.0 - f) * a(0.3) / (1.0 - f * f * a(2.0))
    });
    assert_shows("inside", &builder.finish(), 256, value);
}

/// A white sky around `add`ed bodies, and a camera that sees them from the outside.
fn furnace(add: impl FnOnce(&mut SceneBuilder)) -> Scene {
    let mut builder = SceneBuilder::new(0);
    builder.set_environment(white_sky());
    add(&mut builder);
    scenes::add_camera(&mut builder, DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO, 0.5);
    builder.finish()
}

fn add_ball(builder: &mut SceneBuilder, material: Material) {
    let material = builder.add_material(material);
    let mut ball = support::smooth::smooth_sphere(24, 48, material);
    ball.normals = None;
    support::smooth::add_mesh(builder, ball);
}

#[test]
fn a_ball_of_clear_glass_in_a_white_furnace_cannot_be_seen() {
    for roughness in [0.0, 0.4] {
        let material = Material { roughness: Param::constant(roughness), ..glass(1.5) };
        let scene = furnace(|b| add_ball(b, material));
        // Rough glass is compensated by tables: 0.5 % is their tolerance too.
        assert_shows(&format!("roughness {roughness}"), &scene, 512, [1.0; 3]);
    }
}

#[test]
fn dispersion_leaves_a_white_furnace_white() {
    let mut material = glass(1.5);
    material.transmission.dispersion = 2.0;
    assert_shows("dispersive", &furnace(|b| add_ball(b, material)), 512, [1.0; 3]);
}

#[test]
fn vol03_light_trapped_by_total_reflection_is_not_lost() {
    // A black body in a cube of glass under a white sky, all in balance: its radiance is n^2 times the sky's, and all is 1.
    let n = 1.5_f32;
    let mut builder = SceneBuilder::new(0);
    builder.set_environment(white_sky());
    let material = builder.add_material(glass(n));
    add_box(&mut builder, [-1.0; 3], [1.0; 3], DMat4::IDENTITY, material);
    let lamp = builder.add_material(scenes::lamp(0.0, n * n));
    add_box(&mut builder, [-0.3, -0.4, -0.2], [0.4, 0.3, 0.3], DMat4::IDENTITY, lamp);
    scenes::add_camera(&mut builder, DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO, 0.5);
    assert_shows("cube with a body", &builder.finish(), 256, [1.0; 3]);
}

#[test]
fn bsdf07_glass_of_index_1_is_not_there() {
    let plain = |b: &mut SceneBuilder| {
        let floor = b.add_material(scenes::lambert(0.6));
        scenes::add_quad(b, [[-4.0, -1.5, 4.0], [4.0, -1.5, 4.0], [4.0, -1.5, -4.0], [-4.0, -1.5, -4.0]], floor);
    };
    let value = channel_means(&shoot(&furnace(plain), &options(4096)).pixels);
    for roughness in [0.0, 0.5] {
        let material = Material { roughness: Param::constant(roughness), ..glass(1.0) };
        let scene = furnace(|b| {
            plain(b);
            add_ball(b, material);
        });
        assert_shows(&format!("roughness {roughness}"), &scene, 256, value);
    }
}

/// A Lambertian floor of albedo 0.6 below `panes` of tint `color`, seen from below them.
fn floor_under(panes: &[([f32; 3], f32)]) -> SceneBuilder {
    let mut builder = SceneBuilder::new(0);
    let floor = builder.add_material(scenes::lambert(0.6));
    scenes::add_floor(&mut builder, 5.0, floor);
    for &(color, height) in panes {
        let material = builder.add_material(pane(color, 0.0));
        let w = 400.0;
        scenes::add_quad(&mut builder, [[-w, height, w], [w, height, w], [w, height, -w], [-w, height, -w]], material);
    }
    scenes::add_camera(&mut builder, DVec3::new(0.4, 0.5, 0.1), DVec3::ZERO, POINT_VIEW);
    builder
}

const TINTS: [([f32; 3], f32); 3] = [([0.9, 0.7, 0.5], 1.0), ([0.5, 0.9, 1.0], 1.5), ([1.0, 0.8, 0.9], 1.7)];

#[test]
fn bsdf11_thin_panes_tint_the_light_of_a_point_exactly() {
    // One interface a pane (KHR_materials_transmission): 1 - F, and the base colour.
    for count in 0..=3 {
        let panes = &TINTS[..count];
        let mut builder = floor_under(panes);
        let place = DVec3::new(0.8, 3.0, -0.6);
        scenes::add_light(&mut builder, Light::Point { intensity: [100.0; 3] }, place, DVec3::NEG_Y);
        let scene = builder.finish();
        let mu = place.normalize().y;
        let once = 0.6 / std::f64::consts::PI * 100.0 * mu / place.length_squared();
        for pixel in shoot(&scene, &RenderSettings { max_bounces: Some(0), ..options(4) }).pixels {
            for (channel, shown) in pixel.into_iter().enumerate() {
                let tint: f64 = panes.iter().map(|p| (1.0 - fresnel(mu, 1.5)) * f64::from(p.0[channel])).product();
                let (shown, value) = (f64::from(shown), once * tint);
                assert!((shown / value - 1.0).abs() < 1e-4, "{count} panes: {shown} instead of {value}");
            }
        }
    }
}

/// Irradiance / pi of a uniform sky of 1 nit through these panes: quadrature over the cosine.
fn through_panes(panes: &[([f32; 3], f32)], channel: usize) -> f64 {
    let n = 20_000;
    let at = |i: usize| {
        let mu = (i as f64 + 0.5) / f64::from(n);
        let tint: f64 = panes.iter().map(|p| (1.0 - fresnel(mu, 1.5)) * f64::from(p.0[channel])).product();
        2.0 * mu * tint / f64::from(n)
    };
    (0..n as usize).map(at).sum()
}

#[test]
fn thin_panes_show_both_strategies_the_same_sky() {
    // No further bounces: the sky is found by light samples and by scattered rays that go straight through all panes. Were
    // a pane's passing a scattering, or the weights of the two strategies not of one density, the sum would be wrong.
    for count in 1..=3 {
        let panes = &TINTS[..count];
        let mut builder = floor_under(panes);
        builder.set_environment(white_sky());
        let scene = builder.finish();
        let runs = shoot_seeds(&scene, &RenderSettings { max_bounces: Some(0), ..options(256) }, 8);
        for channel in 0..3 {
            let runs: Vec<f64> = runs.iter().map(|run| channel_means(&run.pixels)[channel]).collect();
            let value = 0.6 * through_panes(panes, channel);
            let test = |value: f64| mean_test(&runs, Expected { value, rel_se: 0.0 }).within(BIAS);
            test(value).unwrap_or_else(|e| panic!("{count} panes, channel {channel}: expected {value:.6}: {e}"));
            assert!(test(value * FAULT).is_err(), "{count} panes: the test does not see a factor of {FAULT}");
        }
    }
}

#[test]
fn thin_panes_show_both_strategies_the_same_lamp() {
    // A lamp close above panes close above the floor: both strategies count. The lamp's own size is its form factor.
    let panes = [([0.9, 0.7, 0.5], 0.6), ([0.5, 0.9, 1.0], 0.7)];
    let lit = |panes: &[([f32; 3], f32)]| {
        let mut builder = floor_under(panes);
        let lamp = builder.add_material(scenes::lamp(0.0, 20.0));
        scenes::add_quad(&mut builder, [[-0.9, 0.8, -0.7], [0.9, 0.8, -0.7], [0.9, 0.8, 0.7], [-0.9, 0.8, 0.7]], lamp);
        builder.finish()
    };
    let n = 400;
    let value = [0, 1, 2].map(|channel: usize| {
        let mut sum = 0.0;
        for i in 0..n * n {
            let (x, z) = (((i % n) as f64 + 0.5) / n as f64 * 1.8 - 0.9, ((i / n) as f64 + 0.5) / n as f64 * 1.4 - 0.7);
            let d2 = x * x + z * z + 0.64;
            let mu = 0.8 / d2.sqrt();
            let tint: f64 = panes.iter().map(|p| (1.0 - fresnel(mu, 1.5)) * f64::from(p.0[channel])).product();
            sum += mu * mu / d2 * tint;
        }
        0.6 / std::f64::consts::PI * 20.0 * sum * 1.8 * 1.4 / (n * n) as f64
    });
    let runs = shoot_seeds(&lit(&panes), &RenderSettings { max_bounces: Some(0), ..options(512) }, 8);
    for channel in 0..3 {
        let runs: Vec<f64> = runs.iter().map(|run| channel_means(&run.pixels)[channel]).collect();
        let test = |value: f64| mean_test(&runs, Expected { value, rel_se: 0.0 }).within(BIAS);
        test(value[channel]).unwrap_or_else(|e| panic!("channel {channel}: expected {:.6}: {e}", value[channel]));
        assert!(test(value[channel] * FAULT).is_err(), "the test does not see a factor of {FAULT}");
    }
}
