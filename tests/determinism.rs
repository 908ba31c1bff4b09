//! Same settings, same bytes: whatever the threads, the crop, or the render before. And the same picture, to
//! rounding, whatever the SIMD width and the backend.
//!
//! Nothing here is random: one seed (7), no significance.

mod support;

use prt::load::{LoadOptions, load};
use prt::render::{AccelChoice, CropWindow, RenderSettings};
use prt::scene::Scene;
use std::path::Path;
use support::pictures::{settings, shoot};
use support::scenes;

/// Odd on purpose, so that tiles and lanes do not divide it.
const WIDTH: u32 = 37;
const HEIGHT: u32 = 29;

fn base(accel: AccelChoice) -> RenderSettings {
    RenderSettings { width: WIDTH, height: HEIGHT, accel, ..settings(WIDTH, 5, 7) }
}

fn bits(pixels: &[[f32; 3]]) -> Vec<[u32; 3]> {
    pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}

/// The picture's bits under `settings`.
fn picture(scene: &str, settings: &RenderSettings) -> Vec<[u32; 3]> {
    bits(&shoot(&scenes::reference(scene), settings).pixels)
}

const BACKENDS: [AccelChoice; 3] = [AccelChoice::Auto, AccelChoice::Bvh, AccelChoice::Linear];

#[test]
fn number_of_threads_changes_no_bit() {
    for accel in BACKENDS {
        for scene in ["cornell", "punctual"] {
            let alone = picture(scene, &RenderSettings { threads: Some(1), ..base(accel) });
            for threads in [2, 3, 7] {
                let many = picture(scene, &RenderSettings { threads: Some(threads), ..base(accel) });
                assert!(alone == many, "{scene}, {accel:?}: 1 and {threads} threads differ");
            }
        }
    }
}

#[test]
fn rendering_again_in_one_process_changes_no_bit() {
    for accel in BACKENDS {
        let first = picture("cornell", &base(accel));
        picture("furnace", &base(accel)); // something else in between
        assert!(first == picture("cornell", &base(accel)), "{accel:?}");
    }
}

#[test]
fn seed_and_frame_change_the_picture() {
    let first = picture("cornell", &base(AccelChoice::Bvh));
    assert!(first != picture("cornell", &RenderSettings { seed: 8, ..base(AccelChoice::Bvh) }));
    assert!(first != picture("cornell", &RenderSettings { frame: 1, ..base(AccelChoice::Bvh) }));
}

/// Asserts that windows of a picture show the whole picture's pixels.
fn assert_crops_equal(what: &str, scene: &Scene, base: &RenderSettings) {
    let whole = bits(&shoot(scene, base).pixels);
    for (x, y, width, height) in [(0, 0, 1, 1), (5, 3, 16, 9), (36, 28, 1, 1), (0, 13, 37, 2), (20, 0, 17, 29)] {
        let window = CropWindow { x, y, width, height };
        let frame = shoot(scene, &RenderSettings { crop: Some(window), threads: Some(3), ..base.clone() });
        assert_eq!((frame.width, frame.height, frame.window), (WIDTH, HEIGHT, window));
        let part: Vec<_> = (y..y + height)
            .flat_map(|row| (x..x + width).map(move |column| (row * WIDTH + column) as usize))
            .map(|i| whole[i])
            .collect();
        assert!(bits(&frame.pixels) == part, "{what}, {window:?}");
    }
}

#[test]
fn cropped_pixels_equal_those_of_the_whole_picture() {
    for accel in BACKENDS {
        assert_crops_equal(&format!("cornell, {accel:?}"), &scenes::reference("cornell"), &base(accel));
    }
}

#[test]
fn cropped_pixels_are_equal_where_materials_are_mixed() {
    // Lambertian walls beside glossy things: a lane must not notice what its neighbours are made of.
    for name in ["knot.gltf", "wall.gltf"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
        let (scene, _) = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        for accel in [AccelChoice::Auto, AccelChoice::Bvh] {
            for lanes in [None, Some(8), Some(1)] {
                let settings = RenderSettings { lanes, ..base(accel) };
                assert_crops_equal(&format!("{name}, {accel:?}, {lanes:?} lanes"), &scene, &settings);
            }
        }
    }
}

/// Two evaluations of the same paths differ by rounding: a few units in the last place at each of some ten products.
const SAME: f32 = 1e-4;

/// Share of pixels that may differ by more: a hit that falls on the other side of an edge, or a path that roulette
/// ends on one side only, is another path from there on. Differences of 1e-6 do that to about one path in 1e5, so at
/// 5 samples of some 4 vertices hardly one pixel of the 1073 here; 1 % is 10 pixels.
const ASTRAY: f64 = 0.01;

fn assert_same_to_rounding(what: &str, a: &RenderSettings, b: &RenderSettings) {
    for scene in ["cornell", "punctual", "quad_plane"] {
        let scene_loaded = scenes::reference(scene);
        let (a, b) = (shoot(&scene_loaded, a).pixels, shoot(&scene_loaded, b).pixels);
        let close = |p: &[f32; 3], q: &[f32; 3]| {
            let size = p.iter().chain(q).fold(0.0_f32, |m, x| m.max(x.abs()));
            (0..3).all(|c| (p[c] - q[c]).abs() <= SAME * size)
        };
        let astray = a.iter().zip(&b).filter(|(p, q)| !close(p, q)).count();
        assert!(a.iter().flatten().any(|x| *x > 0.0), "{scene}: black");
        assert!(astray as f64 <= ASTRAY * a.len() as f64, "{what}, {scene}: {astray} of {} pixels differ", a.len());
    }
}

#[test]
fn simd_width_changes_the_picture_by_rounding_only() {
    for accel in [AccelChoice::Auto, AccelChoice::Bvh] {
        let lanes = |n| RenderSettings { lanes: Some(n), ..base(accel) };
        for n in [8, 16] {
            if n == 16 && !simd::Level::Avx512.is_available() {
                println!("skipped: this CPU has no AVX-512");
                continue;
            }
            assert_same_to_rounding(&format!("1 and {n} lanes, {accel:?}"), &lanes(1), &lanes(n));
        }
    }
}

#[test]
fn backends_agree_to_rounding() {
    for accel in [AccelChoice::Auto, AccelChoice::Linear] {
        assert_same_to_rounding(&format!("bvh and {accel:?}"), &base(AccelChoice::Bvh), &base(accel));
    }
}
