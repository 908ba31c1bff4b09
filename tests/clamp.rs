//! `--clamp`: off it costs nothing of the picture, on it says what it took. IDs are those of the design's list of tests.

mod support;

use glam::DVec3;
use prt::material::Material;
use prt::material::extensions::Transmission;
use prt::render::{DefaultLight, RenderSettings};
use prt::scene::{Scene, SceneBuilder};
use prt::texture::Param;
use support::pictures::{channel_means, settings, shoot};
use support::scenes;
use support::stats::Sample;
use support::verdict::{Expected, mean_test};

fn options(size: u32, spp: u32, seed: u64, clamp: Option<f32>) -> RenderSettings {
    RenderSettings { clamp, default_light: DefaultLight::Off, ..settings(size, spp, seed) }
}

/// A floor below a lamp of 10 nits, seen at one point. Beside it a mirror, which throws a second light; or in its place
/// what is seen in it, a second lamp.
fn caustic(has_mirror: bool) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let floor = builder.add_material(scenes::lambert(0.5));
    let lamp = builder.add_material(scenes::lamp(0.0, 10.0));
    scenes::add_floor(&mut builder, 0.5, floor);
    let mut add_lamp = |low: f32, high: f32| {
        let y = 1.5;
        let corners = [[low, y, -1.0], [high, y, -1.0], [high, y, 1.0], [low, y, 1.0]];
        scenes::add_quad(&mut builder, corners, lamp);
    };
    // The mirror is the plane x = -1.
    add_lamp(-0.5, 1.5);
    if has_mirror {
        let mirror = builder.add_material(scenes::white_metal(0.0));
        let corners = [[-1.0, -1.0, 40.0], [-1.0, -1.0, -40.0], [-1.0, 40.0, -40.0], [-1.0, 40.0, 40.0]];
        scenes::add_quad(&mut builder, corners, mirror);
    } else {
        add_lamp(-3.5, -1.5);
    }
    scenes::add_camera(&mut builder, DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, 1e-6);
    builder.finish()
}

/// A room with a lamp behind a pane of coloured glass.
fn room() -> Scene {
    let mut builder = SceneBuilder::new(0);
    let wall = builder.add_material(scenes::lambert(0.7));
    let lamp = builder.add_material(scenes::lamp(0.0, 100.0));
    let pane = builder.add_material(Material {
        base_color: Param::constant([0.9, 0.5, 0.2]),
        metallic: Param::constant(0.0),
        roughness: Param::constant(0.0),
        transmission: Transmission { factor: Param::constant(1.0), dispersion: 0.0 },
        double_sided: true,
        ..Material::default()
    });
    scenes::add_room(&mut builder, 1.0, wall);
    for (y, half, material) in [(0.95, 0.1, lamp), (0.8, 0.4, pane)] {
        let corners = [[-half, y, -half], [half, y, -half], [half, y, half], [-half, y, half]];
        scenes::add_quad(&mut builder, corners, material);
    }
    scenes::add_camera(&mut builder, DVec3::new(0.0, 0.0, 0.9), DVec3::ZERO, 1.5);
    builder.finish()
}

fn grey(pixels: &[[f32; 3]]) -> f64 {
    channel_means(pixels).iter().sum::<f64>() / 3.0
}

/// Means over 8 seeds of 131,072 samples; Student's t over seeds at 1e-4, at most 0.5 % off with 4 standard errors inside
/// that. Without the second light it would be a third less.
#[test]
fn int_05_without_a_clamp_a_caustic_has_all_of_its_light_and_with_one_what_lacks_is_reported() {
    const BIAS: f64 = 5e-3;
    let shots = |scene: &Scene, clamp: Option<f32>| -> Vec<_> {
        (0..8).map(|seed| shoot(scene, &options(8, 2048, seed, clamp))).collect()
    };
    let means = |frames: &[prt::render::Frame]| frames.iter().map(|f| grey(&f.pixels)).collect::<Vec<_>>();
    // The second lamp is found by light samples, the first one's mirror image by scattered rays alone.
    let reference = means(&shots(&caustic(false), None));
    let sample = Sample::of(&reference);
    let rel_se = sample.spread_of_mean().variance.sqrt() / sample.mean;
    let expected = Expected { value: sample.mean, rel_se };
    let scene = caustic(true);
    let (off, on) = (shots(&scene, None), shots(&scene, Some(2.0)));
    mean_test(&means(&off), expected).within(BIAS).unwrap_or_else(|e| panic!("off: {e}"));
    assert!(off.iter().all(|frame| frame.stats.energy_clamped == 0.0));
    for (off, on) in off.iter().zip(&on) {
        // The same paths: what differs is what was taken, but for rounding.
        let (whole, left) = (grey(&off.pixels), grey(&on.pixels));
        let taken = on.stats.energy_clamped;
        assert!(taken > 0.05 && (1.0 - left / whole - taken).abs() < 1e-5, "{whole} - {left}, taken {taken}");
    }
}

#[test]
fn what_light_samples_bring_is_clamped_from_the_second_surface_on_glass_in_between_or_not() {
    let reported = |scene: &Scene, clamp: f32| {
        let shot = |clamp| shoot(scene, &options(24, 16, 3, clamp));
        let (off, on) = (shot(None), shot(Some(clamp)));
        let (whole, left) = (grey(&off.pixels), grey(&on.pixels));
        let taken = on.stats.energy_clamped;
        assert!((1.0 - left / whole - taken).abs() < 1e-5, "{whole} - {left}, taken {taken}");
        for (off, on) in off.pixels.as_flattened().iter().zip(on.pixels.as_flattened()) {
            assert!(*on <= *off * (1.0 + 1e-6), "{on} of {off}");
        }
        taken
    };
    for scene in [scenes::reference("cornell"), room()] {
        let taken = [0.1, 0.01, 1e-6].map(|clamp| reported(&scene, clamp));
        assert!(taken[0] > 1e-3 && taken[1] > taken[0] && taken[2] > taken[1], "{taken:?}");
    }
}

#[test]
fn direct_light_and_what_the_camera_sees_are_left_alone() {
    for scene in [scenes::reference("cornell"), room(), caustic(true)] {
        let shot = |clamp| shoot(&scene, &RenderSettings { max_bounces: Some(0), ..options(24, 16, 0, clamp) });
        let (off, on) = (shot(None), shot(Some(1e-6)));
        assert!(off.pixels == on.pixels);
        assert_eq!(on.stats.energy_clamped, 0.0);
    }
}

#[test]
fn what_was_taken_does_not_depend_on_threads() {
    let scene = room();
    let shot = |threads| shoot(&scene, &RenderSettings { threads: Some(threads), ..options(70, 8, 0, Some(0.5)) });
    let (one, three) = (shot(1), shot(3));
    assert!(one.pixels == three.pixels && one.stats.energy_clamped > 0.0);
    assert_eq!(one.stats.energy_clamped.to_bits(), three.stats.energy_clamped.to_bits());
}
