//! `--texture-lod`: what it leaves alone to the bit, and what it averages.
//!
//! Nothing here is a matter of chance: one seed a picture, no significance. Where textures are averaged by cones a
//! single sample shows the mean.

mod support;

use glam::DVec3;
use prt::light::Light;
use prt::material::{AlphaMode, Material};
use prt::render::memory::{Encoded, estimate};
use prt::render::{AccelChoice, CropWindow, RenderSettings, prepare};
use prt::scene::{Scene, SceneBuilder};
use prt::texture::{Filter, Image, Texels, Texture, TextureRef, Wrap};
use std::f64::consts::PI;
use support::pictures::{settings, shoot};
use support::scenes;
use support::smooth::{add_mesh, flat_quad};

fn bits(scene: &Scene, settings: &RenderSettings) -> Vec<[u32; 3]> {
    shoot(scene, settings).pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}

fn lod(settings: RenderSettings) -> RenderSettings {
    RenderSettings { texture_lod: true, ..settings }
}

fn repeated(builder: &mut SceneBuilder, width: u32, texels: Vec<[u8; 4]>) -> TextureRef {
    let height = texels.len() as u32 / width;
    let image = builder.add_image(Image { width, height, texels: Texels::Rgba8(texels), name: String::from("image") });
    let wrap = Wrap::Repeat;
    TextureRef::plain(builder.add_texture(Texture { image, wrap_u: wrap, wrap_v: wrap, filter: Filter::Bilinear }))
}

/// A board of `n` x `n` texels, black and white by turns.
fn board(builder: &mut SceneBuilder, n: usize) -> TextureRef {
    let texel = |i: usize| if (i % n + i / n).is_multiple_of(2) { [0, 0, 0, 255] } else { [255; 4] };
    repeated(builder, n as u32, (0..n * n).map(texel).collect())
}

/// A square floor of half side 1 m with a board that repeats 32 times on it, 64 texels a time, under a sun of 10 lux,
/// seen from `height` over it at a slant; `yfov` in radians.
fn floor(height: f64, yfov: f64, change: impl FnOnce(&mut SceneBuilder, &mut Material)) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let mut material = scenes::lambert(1.0);
    material.base_color.texture = Some(board(&mut builder, 64));
    change(&mut builder, &mut material);
    let material = builder.add_material(material);
    let mut quad = flat_quad(1.0, material);
    quad.uv_sets[0].iter_mut().flatten().for_each(|c| *c *= 32.0);
    add_mesh(&mut builder, quad);
    let sun = Light::Directional { illuminance: [10.0; 3] };
    scenes::add_light(&mut builder, sun, DVec3::ZERO, -DVec3::Y);
    scenes::add_camera(&mut builder, DVec3::new(0.6, 1.0, 0.5) * height, DVec3::ZERO, yfov);
    builder.finish()
}

/// The camera sees an eighth of a metre of floor: at 16 pixels 8 texels each.
#[test]
fn far_board_shows_its_mean_at_one_sample_and_noise_without() {
    let (scene, settings) = (floor(1.0, 0.1, |_, _| ()), settings(16, 1, 3));
    let mean = 5.0 / PI;
    let off = shoot(&scene, &settings).pixels;
    let far_off = off.iter().filter(|p| (f64::from(p[1]) - mean).abs() > 0.1 * mean).count();
    assert!(far_off > off.len() / 2, "{far_off}");
    // Byte 188 is 0.503 of the light; the rest is the last traces of the board.
    for p in shoot(&scene, &lod(settings)).pixels {
        assert!((f64::from(p[1]) - mean).abs() < 0.02 * mean, "{p:?} for {mean}");
    }
}

#[test]
fn materials_that_are_shaded_one_by_one_see_levels_as_well() {
    // A sheen too faint to be seen puts the material among those with extras.
    let scene = floor(1.0, 0.1, |_, m| m.sheen.color.factor = [1e-4; 3]);
    let mean = 5.0 / PI;
    for p in shoot(&scene, &lod(settings(16, 1, 3))).pixels {
        assert!((f64::from(p[1]) - mean).abs() < 0.02 * mean, "{p:?} for {mean}");
    }
}

#[test]
fn near_board_is_the_same_to_the_bit() {
    // A texel covers 50 pixels across.
    let (scene, settings) = (floor(0.01, 0.1, |_, _| ()), settings(64, 2, 3));
    let off = bits(&scene, &settings);
    assert!(off.iter().any(|p| *p != off[0]), "a board");
    assert!(bits(&scene, &lod(settings)) == off);
}

/// A room of two materials with every kind of path: glossy floor, mirror, lamp, glass.
fn room(texels: impl Fn(usize) -> [u8; 4]) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let texture = repeated(&mut builder, 7, (0..35).map(texels).collect());
    let mut material = scenes::white_dielectric(0.4);
    material.base_color.texture = Some(texture);
    material.roughness.texture = Some(texture);
    material.normal.texture = Some(texture);
    let floor = builder.add_material(material.clone());
    let mut quad = flat_quad(2.0, floor);
    quad.uv_sets[0].iter_mut().flatten().for_each(|c| *c *= 40.0);
    add_mesh(&mut builder, quad);
    material.sheen.color.factor = [0.3; 3];
    material.sheen.color.texture = Some(texture);
    let rich = builder.add_material(material);
    let mut wall = flat_quad(2.0, rich);
    wall.uv_sets[0].iter_mut().flatten().for_each(|c| *c *= 40.0);
    wall.positions.iter_mut().for_each(|p| *p = [p[0], 2.0 - p[2], -2.0]);
    wall.normals = Some(vec![[0.0, 0.0, 1.0]; 4]);
    add_mesh(&mut builder, wall);
    let lamp = builder.add_material(scenes::lamp(0.0, 20.0));
    scenes::add_quad(&mut builder, [[-1.0, 3.0, 1.0], [-1.0, 3.0, -1.0], [1.0, 3.0, -1.0], [1.0, 3.0, 1.0]], lamp);
    let mirror = builder.add_material(scenes::white_metal(0.0));
    scenes::add_quad(&mut builder, [[-2.0, 0.0, 2.0], [-2.0, 0.0, -2.0], [-2.0, 2.0, -2.0], [-2.0, 2.0, 2.0]], mirror);
    scenes::add_camera(&mut builder, DVec3::new(1.5, 1.5, 4.0), DVec3::new(0.0, 0.7, 0.0), 0.8);
    builder.finish()
}

const LANES: [Option<u32>; 3] = [None, Some(8), Some(1)];

#[test]
fn uniform_textures_give_the_same_bits() {
    let scene = room(|_| [201, 133, 250, 255]);
    for lanes in LANES {
        let settings = RenderSettings { lanes, ..settings(24, 4, 7) };
        assert!(bits(&scene, &lod(settings.clone())) == bits(&scene, &settings), "{lanes:?}");
    }
}

#[test]
fn lamps_and_cut_outs_are_read_at_level_0() {
    let scene = |alpha_mode, emits: bool| {
        let mut builder = SceneBuilder::new(0);
        let cut = board(&mut builder, 16);
        let mut material = scenes::lambert(0.5);
        if emits {
            material.emission.factor = [5.0; 3];
            material.emission.texture = Some(cut);
        } else {
            let holes = (0..64).map(|i| [255, 255, 255, if i % 3 == 0 { 90 } else { 200 }]).collect();
            let texture = repeated(&mut builder, 8, holes);
            (material.opacity.texture, material.base_color.texture) = (Some(texture), Some(texture));
            material.alpha_mode = alpha_mode;
        }
        let above = builder.add_material(material);
        let mut roof = flat_quad(2.0, above);
        roof.positions.iter_mut().for_each(|p| p[1] = 1.0);
        roof.uv_sets[0].iter_mut().flatten().for_each(|c| *c *= 40.0);
        add_mesh(&mut builder, roof);
        let floor = builder.add_material(scenes::lambert(0.8));
        scenes::add_floor(&mut builder, 3.0, floor);
        let sun = Light::Directional { illuminance: [10.0; 3] };
        scenes::add_light(&mut builder, sun, DVec3::ZERO, -DVec3::Y);
        scenes::add_camera(&mut builder, DVec3::new(0.5, 4.0, 6.0), DVec3::ZERO, 0.8);
        builder.finish()
    };
    for (mode, emits) in
        [(AlphaMode::Opaque, true), (AlphaMode::Mask { cutoff: 0.5 }, false), (AlphaMode::Blend, false)]
    {
        let (scene, settings) = (scene(mode, emits), settings(24, 4, 7));
        assert!(bits(&scene, &lod(settings.clone())) == bits(&scene, &settings), "{mode:?}");
    }
}

/// See `tests/determinism.rs` for both bounds.
const SAME: f32 = 1e-4;
const ASTRAY: usize = 9;

#[test]
fn pictures_depend_on_neither_threads_nor_window_and_on_lanes_by_rounding() {
    let scene = room(|i| [(i * 77 % 256) as u8, (i * 31 % 256) as u8, 200, 255]);
    for accel in [AccelChoice::Auto, AccelChoice::Bvh] {
        let base = lod(RenderSettings { accel, height: 29, ..settings(37, 4, 7) });
        let whole = bits(&scene, &base);
        assert!(whole != bits(&scene, &RenderSettings { texture_lod: false, ..base.clone() }), "it does something");
        assert!(whole == bits(&scene, &RenderSettings { threads: Some(3), ..base.clone() }));
        for lanes in LANES {
            let settings = RenderSettings { lanes, ..base.clone() };
            let pixels = shoot(&scene, &settings).pixels;
            let crop = Some(CropWindow { x: 5, y: 3, width: 16, height: 9 });
            let part = bits(&scene, &RenderSettings { crop, ..settings });
            for (i, p) in part.iter().enumerate() {
                let at = (3 + i / 16) * 37 + 5 + i % 16;
                assert!(*p == pixels[at].map(f32::to_bits), "{accel:?} {lanes:?} {at}");
            }
            let differs = |(p, q): (&[f32; 3], &[u32; 3])| {
                let q = q.map(f32::from_bits);
                let size = p.iter().chain(&q).fold(0.0_f32, |m, x| m.max(x.abs()));
                (0..3).any(|c| (p[c] - q[c]).abs() > SAME * size)
            };
            let astray = pixels.iter().zip(&whole).filter(|pair| differs(*pair)).count();
            assert!(astray <= ASTRAY, "{accel:?} {lanes:?}: {astray} pixels differ");
        }
    }
}

#[test]
fn levels_are_made_and_counted_only_where_they_are_asked_for() {
    let (scene, settings) = (room(|i| [i as u8; 4]), settings(8, 1, 0));
    let held = |settings: &RenderSettings| {
        let has = prepare(&scene, settings).expect("a sound scene").tables.textures.has_levels();
        (has, estimate(&scene, settings, Encoded { exr: true, png: true }).prepared)
    };
    let (off, on) = (held(&settings), held(&lod(settings)));
    assert_eq!((off.0, on.0), (false, true));
    // Of 35 texels of 4 bytes, a third.
    assert_eq!(on.1 - off.1, 47);
}
