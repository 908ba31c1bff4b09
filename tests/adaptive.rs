//! Samples that are spread over the pixels by need. IDs are those of the design's list of tests.

mod support;

use glam::DVec3;
use prt::material::{AlphaMode, Material};
use prt::render::{DefaultLight, Frame, RenderSettings, StoppedBy, Stopping};
use prt::scene::{Scene, SceneBuilder};
use prt::texture::Param;
use support::pictures::{channel_means, settings, shoot};
use support::scenes;
use support::stats::Sample;

fn options(size: u32, spp: u32, seed: u64) -> RenderSettings {
    RenderSettings { default_light: DefaultLight::Off, ..settings(size, spp, seed) }
}

/// What ends a picture at about `share` of the error that it has at 64 samples.
fn until(scene: &Scene, size: u32, share: f64) -> Stopping {
    let first = shoot(scene, &options(size, 64, 1000)).stats.error.expect("it is not black");
    Stopping { target_error: Some(share * first.ci95[1]), ..Stopping::default() }
}

fn shoot_until(scene: &Scene, size: u32, stopping: Stopping, seed: u64) -> Frame {
    shoot(scene, &RenderSettings { stopping, ..options(size, 1 << 13, seed) })
}

fn mean(frame: &Frame) -> f64 {
    channel_means(&frame.pixels).iter().sum::<f64>() / 3.0
}

/// Means over `seeds` of pictures whose samples were spread and of as many even ones of other seeds, 4 standard
/// errors apart at most: false alarms 6e-5. `sharp`: what those errors may be at most, or the test says nothing.
#[track_caller]
fn assert_unbiased(scene: &Scene, seeds: u64, size: u32, share: f64, sharp: f64) {
    let stopping = until(scene, size, share);
    let spread: Vec<Frame> = (0..seeds).map(|seed| shoot_until(scene, size, stopping, seed)).collect();
    let used = spread.iter().filter(|frame| frame.stats.spread.is_some()).count();
    assert!(used > seeds as usize / 3, "{used} pictures were spread");
    let spp = spread.iter().map(|frame| frame.spp).max().expect("there are pictures").next_power_of_two();
    let even = (0..seeds).map(|seed| mean(&shoot(scene, &options(size, spp, seed + 500)))).collect::<Vec<_>>();
    let [a, b] = [spread.iter().map(mean).collect(), even].map(|means: Vec<f64>| Sample::of(&means));
    let se = (a.spread_of_mean().variance + b.spread_of_mean().variance).sqrt();
    println!("{used} spread, to {spp} at most: {} beside {}, standard error {se}", a.mean, b.mean);
    assert!(se < sharp * b.mean, "{se} of {}", b.mean);
    assert!((a.mean - b.mean).abs() < 4.0 * se, "{} beside {}: {:.1} sigma", a.mean, b.mean, (a.mean - b.mean) / se);
}

/// A floor of half side `floor` that sees rare bright spots on the ceiling: lamps of 2 % of its area shine up at it from nearby. Most of the
/// picture is black.
fn bright_spots(floor: f32) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let wall = builder.add_material(scenes::lambert(0.8));
    let lamp = builder.add_material(scenes::lamp(0.0, 100.0));
    scenes::add_floor(&mut builder, floor, wall);
    scenes::add_quad(&mut builder, [[-1.0, 1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]], wall);
    let half = 0.5 * (0.02_f32 * 0.25).sqrt();
    for cell in 0..16 {
        let [x, z] = [cell % 4, cell / 4].map(|i| -0.75 + 0.5 * i as f32);
        let (y, h) = (0.93, half);
        let corners = [[x - h, y, z + h], [x + h, y, z + h], [x + h, y, z - h], [x - h, y, z - h]];
        scenes::add_quad(&mut builder, corners, lamp);
    }
    scenes::add_camera(&mut builder, DVec3::new(0.0, 0.6, 1.4), DVec3::new(0.0, 0.0, 0.2), 0.9);
    builder.finish()
}

/// A ball in the light of a lamp, before nothing.
fn ball() -> SceneBuilder {
    let mut builder = SceneBuilder::new(0);
    let grey = builder.add_material(scenes::lambert(0.6));
    let lamp = builder.add_material(scenes::lamp(0.0, 20.0));
    scenes::add_triangles(&mut builder, &scenes::ball(3, 0.3), false, grey);
    let corners = [[-1.0, 1.5, -1.0], [1.0, 1.5, -1.0], [1.0, 1.5, 1.0], [-1.0, 1.5, 1.0]];
    scenes::add_quad(&mut builder, corners, lamp);
    scenes::add_camera(&mut builder, DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, 0.6);
    builder
}

/// The same with a wire a twentieth of a pixel wide that shines, a hair of a thousandth, and a veil of 3 %.
fn thin_things() -> Scene {
    let mut builder = ball();
    let wire = builder.add_material(scenes::lamp(0.0, 3.0));
    let hair = builder.add_material(scenes::lamp(0.0, 10.0));
    let veil = builder.add_material(Material {
        alpha_mode: AlphaMode::Blend,
        opacity: Param::constant(0.03),
        ..scenes::lamp(0.0, 2.0)
    });
    // The picture is 2.48 m high and 40 pixels.
    for (y, width, material) in [(0.4, 0.05, wire), (-0.5, 0.001, hair)] {
        let half = 0.5 * width * 2.48 / 40.0;
        let [low, high] = [-half, half].map(|side| y + side);
        let corners = [[-1.0, low, 0.0], [1.0, low + 0.1, 0.0], [1.0, high + 0.1, 0.0], [-1.0, high, 0.0]];
        scenes::add_quad(&mut builder, corners, material);
    }
    let corners = [[-0.55, -0.45, 0.0], [-0.3, -0.45, 0.0], [-0.3, -0.35, 0.0], [-0.55, -0.35, 0.0]];
    scenes::add_quad(&mut builder, corners, veil);
    builder.finish()
}

#[test]
fn adp_01_spreading_samples_does_not_bias_rare_bright_pixels() {
    assert_unbiased(&bright_spots(0.2), 64, 24, 0.4, 1e-2);
}

#[test]
fn adp_03_spreading_samples_does_not_bias_partly_covered_pixels() {
    assert_unbiased(&thin_things(), 24, 40, 0.3, 5e-3);
}

#[test]
fn adp_01_no_part_of_a_picture_stops() {
    let stopping = Stopping { target_error: Some(1e-6), ..Stopping::default() };
    let settings = RenderSettings { stopping, ..options(40, 512, 0) };
    let stats = shoot(&ball().finish(), &settings).stats;
    let spread = stats.spread.expect("most of it is black");
    // What is out of reach ends where every pixel has all that it may have.
    assert_eq!((spread.stage, spread.least, spread.most), (64, 512, 512));
    assert_eq!(stats.stopped_by, StoppedBy::Spp);
}

#[test]
fn det_01_a_spread_picture_is_the_same_for_any_number_of_threads() {
    let scene = ball().finish();
    let stopping = until(&scene, 40, 0.3);
    let shot = |threads| {
        let threads = Some(threads);
        shoot(&scene, &RenderSettings { stopping, threads, ..options(40, 1 << 13, 0) })
    };
    // With more threads tiles are smaller.
    let (one, three) = (shot(1), shot(3));
    assert!(one.stats.spread.is_some() && one.stats.spread == three.stats.spread, "{:?}", one.stats.spread);
    assert!(one.pixels == three.pixels && one.stats.error == three.stats.error && one.spp == three.spp);
}

#[test]
fn spreading_takes_less_work_for_the_same_error() {
    let scene = bright_spots(0.3);
    let stopping = until(&scene, 24, 0.3);
    let [even, spread] =
        [false, true].map(|adaptive| shoot(&scene, &RenderSettings { stopping, adaptive, ..options(24, 1 << 13, 7) }));
    assert!(even.stats.spread.is_none() && spread.stats.spread.is_some());
    let rays = |frame: &Frame| frame.stats.camera_rays + frame.stats.bounce_rays + frame.stats.shadow_rays;
    println!("{} and {} rays, {:?}", rays(&even), rays(&spread), spread.stats.spread);
    assert!((rays(&spread) as f64) < 0.8 * rays(&even) as f64, "{} and {} rays", rays(&even), rays(&spread));
}
