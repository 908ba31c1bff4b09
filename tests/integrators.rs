//! The integrators other than the path tracer: against closed forms, against the path tracer where both must show the
//! same, and what holds for all of them (threads, lanes, crops, culling).
//!
//! Rendered means: one seed, samples and tolerance as stated at each test; where chance has a part the tolerance is at
//! least five standard errors of the mean, and the value the test would have with the fault that it is about is outside.

mod support;

use glam::DVec3;
use prt::light::{Environment, Light};
use prt::material::Material;
use prt::material::extensions::{Clearcoat, Transmission, Volume};
use prt::render::{AccelChoice, CropWindow, DefaultLight, Filter, FilterShape, Frame, Integrator, RenderSettings};
use prt::scene::{Scene, SceneBuilder};
use prt::texture::Param;
use std::f64::consts::PI;
use support::pictures::{channel_means, shoot};
use support::scenes::{
    add_camera, add_floor, add_light, add_quad, add_room, lambert, lamp, reference, white_dielectric, white_metal,
};

/// A field of view in which all pixels see one point.
const POINT_VIEW: f64 = 1e-6;

fn options(integrator: Integrator, side: u32, spp: u32) -> RenderSettings {
    RenderSettings {
        width: side,
        height: side,
        spp,
        integrator,
        default_light: DefaultLight::Off,
        filter: Filter { shape: FilterShape::Box, width: 1.0 },
        accel: AccelChoice::Bvh,
        ..RenderSettings::default()
    }
}

fn picture(scene: &Scene, integrator: Integrator, side: u32, spp: u32) -> Frame {
    shoot(scene, &options(integrator, side, spp))
}

/// Mean of the picture's first channel.
fn mean(scene: &Scene, integrator: Integrator, side: u32, spp: u32) -> f64 {
    channel_means(&picture(scene, integrator, side, spp).pixels)[0]
}

#[track_caller]
fn assert_near(what: &str, value: f64, wanted: f64, tolerance: f64) {
    assert!((value - wanted).abs() <= tolerance * wanted.abs().max(1e-12), "{what}: {value} for {wanted}");
}

fn pane(base: [f32; 3], ior: f32) -> Material {
    Material {
        base_color: Param::constant(base),
        metallic: Param::constant(0.0),
        roughness: Param::constant(0.0),
        transmission: Transmission { factor: Param::constant(1.0), dispersion: 0.0 },
        double_sided: true,
        ior,
        ..Material::default()
    }
}

fn glass(ior: f32) -> Material {
    Material {
        volume: Some(Volume { attenuation_color: [1.0; 3], attenuation_distance: f32::INFINITY }),
        ..pane([1.0; 3], ior)
    }
}

const ALBEDO: f32 = 0.6;
const INTENSITY: f32 = 7.0;

/// A Lambertian floor at y = 0 under a point light at (0, 2, 0); nothing else.
fn lit_floor() -> SceneBuilder {
    let mut builder = SceneBuilder::new(0);
    let floor = builder.add_material(lambert(ALBEDO));
    add_floor(&mut builder, 20.0, floor);
    add_light(&mut builder, Light::Point { intensity: [INTENSITY; 3] }, DVec3::new(0.0, 2.0, 0.0), -DVec3::Y);
    builder
}

/// Radiance of that floor at (x, z).
fn floor_radiance(x: f64, z: f64) -> f64 {
    let d2 = x * x + z * z + 4.0;
    f64::from(ALBEDO) / PI * f64::from(INTENSITY) / d2 * (2.0 / d2.sqrt())
}

#[test]
fn whitted_direct_and_path_agree_on_a_floor_that_a_point_light_lights() {
    let mut builder = lit_floor();
    add_camera(&mut builder, DVec3::new(3.0, 1.0, 1.0), DVec3::new(1.0, 0.0, 0.5), POINT_VIEW);
    let scene = builder.finish();
    for integrator in [Integrator::Path, Integrator::Direct, Integrator::Whitted] {
        let value = mean(&scene, integrator, 4, 16);
        assert_near(&format!("{integrator:?}"), value, floor_radiance(1.0, 0.5), 2e-5);
    }
}

#[test]
fn whitted_direct_and_path_agree_on_a_floor_in_a_perfect_mirror() {
    // The mirror faces away from the light, so that it adds none to the floor's own.
    let mut builder = lit_floor();
    let mirror = builder.add_material(white_metal(0.0));
    add_quad(&mut builder, [[6.0, 0.5, -1.0], [6.0, 0.5, 1.0], [6.0, 3.0, 1.0], [6.0, 3.0, -1.0]], mirror);
    // Seen from (4, 2, 0) by way of (6, 1, 0): the floor at (4, 0, 0).
    add_camera(&mut builder, DVec3::new(4.0, 2.0, 0.0), DVec3::new(6.0, 1.0, 0.0), POINT_VIEW);
    let scene = builder.finish();
    let wanted = floor_radiance(4.0, 0.0);
    for integrator in [Integrator::Direct, Integrator::Whitted] {
        assert_near(&format!("{integrator:?}"), mean(&scene, integrator, 4, 16), wanted, 1e-4);
    }
    // One scattering after the mirror is the floor's towards the light; further ones would add what the mirror reflects
    // back to it.
    let settings = RenderSettings { max_bounces: Some(1), ..options(Integrator::Path, 4, 256) };
    assert_near("path", channel_means(&shoot(&scene, &settings).pixels)[0], wanted, 5e-3);
    // Without scattering after the first the mirror shows what shines only, for each of them.
    for integrator in [Integrator::Path, Integrator::Direct, Integrator::Whitted] {
        let settings = RenderSettings { max_bounces: Some(0), ..options(integrator, 4, 16) };
        assert_eq!(channel_means(&shoot(&scene, &settings).pixels), [0.0; 3], "{integrator:?}");
    }
}

/// Fresnel's reflectance at normal incidence.
fn normal_incidence(ior: f64) -> f64 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

#[test]
fn whitted_and_direct_agree_through_clear_glass() {
    // A camera above a slab, or a pane, above the floor; the light is below the glass, so that shadow rays cross none.
    for (what, is_slab) in [("slab", true), ("pane", false)] {
        let mut builder = lit_floor();
        let (r, material) = (normal_incidence(1.5), if is_slab { glass(1.5) } else { pane([1.0; 3], 1.5) });
        let material = builder.add_material(material);
        let w = 8.0;
        add_quad(&mut builder, [[-w, 3.0, w], [w, 3.0, w], [w, 3.0, -w], [-w, 3.0, -w]], material);
        if is_slab {
            add_quad(&mut builder, [[-w, 2.5, w], [-w, 2.5, -w], [w, 2.5, -w], [w, 2.5, w]], material);
        }
        add_camera(&mut builder, DVec3::new(1.0, 5.0, 0.0), DVec3::new(1.0, 0.0, 0.0), POINT_VIEW);
        let scene = builder.finish();
        // A clear slab lets (1 - r) / (1 + r) through at normal incidence; a thin wall one interface's 1 - r. Branches
        // that are worth less than 1 / 2048 are left out: after 4 reflections inside, r^4 of it.
        let share = if is_slab { (1.0 - r) / (1.0 + r) } else { 1.0 - r };
        let wanted = floor_radiance(1.0, 0.0) * share;
        assert_near(&format!("whitted, {what}"), mean(&scene, Integrator::Whitted, 4, 4), wanted, 6e-4);
        assert_near(&format!("direct, {what}"), mean(&scene, Integrator::Direct, 16, 256), wanted, 4e-3);
    }
}

#[test]
fn whitted_follows_both_branches_of_glass_and_those_of_a_coat() {
    // Above the plane y = 0 a sky of 1, below a lamp of 5: the picture is reflectance + 5 x the rest.
    let sky = Environment::new(4, 2, [[1.0; 3]; 8]);
    let below = |material: Material, eye: DVec3| {
        let mut builder = SceneBuilder::new(0);
        let shines = builder.add_material(lamp(0.0, 5.0));
        let w = 50.0;
        add_quad(&mut builder, [[-w, -2.0, w], [w, -2.0, w], [w, -2.0, -w], [-w, -2.0, -w]], shines);
        let material = builder.add_material(material);
        add_floor(&mut builder, 20.0, material);
        builder.set_environment(sky.clone());
        add_camera(&mut builder, eye, DVec3::ZERO, POINT_VIEW);
        builder.finish()
    };
    for eye in [DVec3::new(0.0, 3.0, 0.001), DVec3::new(3.0, 1.5, 0.0)] {
        let scene = below(pane([1.0; 3], 1.5), eye);
        let direct = mean(&scene, Integrator::Direct, 16, 1024);
        assert_near("pane", mean(&scene, Integrator::Whitted, 4, 1), direct, 4e-3);
        // A mirror under a coat: all of it is reflected, by one of the two.
        let coated = Material {
            clearcoat: Clearcoat { factor: Param::constant(1.0), ..Clearcoat::default() },
            ..white_metal(0.0)
        };
        assert_near("coat", mean(&below(coated, eye), Integrator::Whitted, 4, 1), 1.0, 1e-4);
    }
}

#[test]
fn whitted_leaves_nothing_to_chance() {
    // With a filter of no width all samples of a pixel are one ray.
    let mut builder = lit_floor();
    let slab = builder.add_material(glass(1.5));
    add_quad(&mut builder, [[-1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [-1.0, 1.0, -1.0]], slab);
    let lamp = builder.add_material(lamp(0.3, 3.0));
    add_quad(&mut builder, [[-1.0, 3.0, -3.0], [1.0, 3.0, -3.0], [1.0, 4.0, -3.0], [-1.0, 4.0, -3.0]], lamp);
    builder.set_environment(Environment::new(4, 2, [[0.1, 0.2, 0.3]; 8]));
    add_camera(&mut builder, DVec3::new(1.0, 4.0, 5.0), DVec3::new(0.0, 0.5, 0.0), 0.7);
    let scene = builder.finish();
    let of = |integrator, seed, spp| {
        let filter = Filter { shape: FilterShape::Box, width: 1e-9 };
        shoot(&scene, &RenderSettings { seed, filter, ..options(integrator, 24, spp) }).pixels
    };
    let first = of(Integrator::Whitted, 0, 1);
    assert!(first.iter().filter(|p| p[0] > 0.0).count() > 500, "something to see");
    for (seed, spp) in [(1, 1), (77, 1), (5, 4)] {
        assert_eq!(of(Integrator::Whitted, seed, spp), first, "seed {seed}, {spp} samples");
    }
    assert_ne!(of(Integrator::Direct, 1, 1), of(Integrator::Direct, 2, 1), "what has chance in it differs");
}

#[test]
fn whitted_takes_lamps_and_skies_for_points() {
    // A small lamp straight above: radiance x its solid angle x cosine, hard-edged.
    let mut builder = SceneBuilder::new(0);
    let floor = builder.add_material(lambert(ALBEDO));
    add_floor(&mut builder, 20.0, floor);
    let shines = builder.add_material(lamp(0.0, 50.0));
    let (h, y) = (0.1_f32, 2.0_f32);
    add_quad(&mut builder, [[-h, y, -h], [h, y, -h], [h, y, h], [-h, y, h]], shines);
    add_camera(&mut builder, DVec3::new(3.0, 1.0, 1.0), DVec3::new(1.0, 0.0, 0.5), POINT_VIEW);
    let mut scene = builder.finish();
    let d2 = 1.25 + 4.0_f64;
    let wanted = f64::from(ALBEDO) / PI * 50.0 * 0.04 * (2.0 / d2.sqrt()).powi(2) / d2;
    assert_near("lamp", mean(&scene, Integrator::Whitted, 2, 1), wanted, 5e-3);
    // An even sky: the cosines of its 16 directions add up to about what they must.
    std::sync::Arc::make_mut(&mut scene.meshes[1]).indices.clear();
    scene.environment = Some(Environment::new(8, 4, [[1.0; 3]; 32]));
    assert_near("sky", mean(&scene, Integrator::Whitted, 2, 1), f64::from(ALBEDO), 0.15);
}

#[test]
fn whitted_ends_between_mirrors_and_says_what_it_cut() {
    let mut builder = SceneBuilder::new(0);
    let mirror = builder.add_material(white_metal(0.0));
    add_room(&mut builder, 1.0, mirror);
    add_camera(&mut builder, DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.0, 0.4, 0.5), 1.0);
    let frame = picture(&builder.finish(), Integrator::Whitted, 16, 2);
    assert_eq!(frame.stats.truncated, 1.0);
    assert_eq!(channel_means(&frame.pixels), [0.0; 3]);
    // Stacks of panes, whose branches double: all are followed, none is lost, and it ends.
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(pane([1.0; 3], 1.5));
    for i in 0..6 {
        let y = 0.2 * i as f32;
        add_quad(&mut builder, [[-9.0, y, 9.0], [9.0, y, 9.0], [9.0, y, -9.0], [-9.0, y, -9.0]], material);
    }
    builder.set_environment(Environment::new(4, 2, [[1.0; 3]; 8]));
    add_camera(&mut builder, DVec3::new(0.3, 4.0, 0.1), DVec3::ZERO, 0.5);
    let frame = picture(&builder.finish(), Integrator::Whitted, 48, 2);
    // White panes under a white sky are white but for the branches that are left out.
    for pixel in &frame.pixels {
        assert!(pixel.iter().all(|v| (0.97..=1.0001).contains(v)), "{pixel:?}");
    }
}

#[test]
fn direct_light_alone_is_a_path_without_scattering_after_the_first() {
    let cornell = reference("cornell");
    let none = RenderSettings { max_bounces: Some(0), ..options(Integrator::Path, 24, 4) };
    let path = shoot(&cornell, &none).pixels;
    // Nothing mirrors there: the same samples, bit for bit.
    assert_eq!(picture(&cornell, Integrator::Direct, 24, 4).pixels, path);
    let mut builder = lit_floor();
    let mirror = builder.add_material(white_metal(0.0));
    add_quad(&mut builder, [[1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [1.0, 2.0, 1.0], [1.0, 2.0, -1.0]], mirror);
    add_camera(&mut builder, DVec3::new(-3.0, 2.0, 0.5), DVec3::new(0.5, 0.5, 0.0), 0.8);
    let scene = builder.finish();
    let direct = RenderSettings { integrator: Integrator::Direct, ..none.clone() };
    assert_eq!(shoot(&scene, &direct).pixels, shoot(&scene, &none).pixels, "with the same limit the same anywhere");
    assert_ne!(
        picture(&scene, Integrator::Direct, 24, 4).pixels,
        shoot(&scene, &none).pixels,
        "mirrors show the floor"
    );
}

#[test]
fn occlusion_is_the_share_of_the_hemisphere_that_is_open() {
    let of = |wall: Option<f32>, at: DVec3| {
        let mut builder = SceneBuilder::new(0);
        let material = builder.add_material(pane([0.2; 3], 1.5));
        add_floor(&mut builder, 2000.0, material);
        if let Some(height) = wall {
            let (w, h) = (2000.0, height);
            add_quad(&mut builder, [[0.0, 0.0, -w], [0.0, 0.0, w], [0.0, h, w], [0.0, h, -w]], material);
        }
        add_camera(&mut builder, at + DVec3::new(1.0, 2.0, 0.5), at, POINT_VIEW);
        builder.finish()
    };
    assert_eq!(mean(&of(None, DVec3::ZERO), Integrator::Ao, 4, 16), 1.0);
    // Beside an endless wall of height h at distance d: (1 + d / sqrt(h^2 + d^2)) / 2 is open. 2^16 samples: one standard
    // error is at most 0.002 without stratification. Of clear glass both are, and yet they are there, and grey.
    for (height, distance) in [(1.0_f64, 1.0_f64), (3.0, 1.0), (1.0, 5.0)] {
        let wanted = 0.5 * (1.0 + distance / height.hypot(distance));
        let scene = of(Some(height as f32), DVec3::new(distance, 0.0, 0.0));
        let frame = picture(&scene, Integrator::Ao, 8, 1024);
        let [r, g, b] = channel_means(&frame.pixels);
        assert!(r == g && g == b, "grey");
        assert_near(&format!("{height} {distance}"), r, wanted, 5e-3);
    }
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(lambert(0.9));
    add_room(&mut builder, 1.0, material);
    add_camera(&mut builder, DVec3::ZERO, DVec3::X, 1.0);
    assert_eq!(mean(&builder.finish(), Integrator::Ao, 16, 4), 0.0);
}

#[test]
fn normals_are_colours_of_the_side_that_is_seen_and_nothing_is_black() {
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(lambert(0.5));
    // Its front looks along (1, 2, 2) / 3.
    let (n, at) = (DVec3::new(1.0, 2.0, 2.0) / 3.0, DVec3::new(5.0, 0.0, 0.0));
    let u = n.cross(DVec3::X).normalize();
    let v = n.cross(u);
    let corners = [at - u - v, at + u - v, at + u + v, at - u + v].map(|p| p.as_vec3().to_array());
    add_quad(&mut builder, corners, material);
    add_camera(&mut builder, at + n * 3.0, at, POINT_VIEW);
    add_camera(&mut builder, at - n * 3.0, at, POINT_VIEW);
    add_camera(&mut builder, at + n * 3.0, at + n * 9.0, POINT_VIEW);
    let mut scene = builder.finish();
    for wanted in [n, -n] {
        let color = picture(&scene, Integrator::Normal, 2, 4).pixels[0].map(f64::from);
        let n = DVec3::from_array(color) * 2.0 - DVec3::ONE;
        assert!((n - wanted).length() < 1e-5, "{n} for {wanted}");
        scene.cameras.remove(0);
    }
    assert_eq!(picture(&scene, Integrator::Normal, 2, 4).pixels[0], [0.0; 3]);
}

#[test]
fn albedo_is_the_base_colour_whatever_the_material_does_with_it() {
    let color = [0.2, 0.5, 0.8];
    let base = || Param::constant(color);
    let metal = Material { base_color: base(), ..white_metal(0.3) };
    let plastic = Material { base_color: base(), ..white_dielectric(0.1) };
    let unlit = Material { base_color: base(), unlit: true, ..lambert(0.1) };
    let shining = Material { base_color: base(), ..lamp(0.1, 100.0) };
    for material in [metal, plastic, pane(color, 1.5), unlit, shining] {
        let mut builder = SceneBuilder::new(0);
        let material = builder.add_material(material);
        add_floor(&mut builder, 1.0, material);
        add_camera(&mut builder, DVec3::Y, DVec3::ZERO, POINT_VIEW);
        let pixel = picture(&builder.finish(), Integrator::Albedo, 2, 4).pixels[0];
        assert!(pixel.iter().zip(color).all(|(a, b)| (a - b).abs() < 1e-6), "{pixel:?}");
    }
}

/// A scene with what the integrators tell apart: diffuse, mirror, glass, a lamp, cut-outs, a culled front.
fn everything() -> Scene {
    let mut builder = lit_floor();
    let materials = [white_metal(0.0), pane([0.9, 0.5, 0.5], 1.5), glass(1.4), lamp(0.2, 3.0), white_dielectric(0.0)];
    for (i, material) in materials.into_iter().enumerate() {
        let x = i as f32 - 2.0;
        let material = builder.add_material(material);
        add_quad(&mut builder, [[x, 0.0, 0.0], [x + 0.8, 0.0, 0.0], [x + 0.8, 1.5, -0.5], [x, 1.5, -0.5]], material);
    }
    let front = builder.add_material(Material { double_sided: false, ..lambert(0.9) });
    add_quad(&mut builder, [[-3.0, 0.0, 2.0], [-3.0, 3.0, 2.0], [3.0, 3.0, 2.0], [3.0, 0.0, 2.0]], front);
    let cut = Material { alpha_mode: prt::material::AlphaMode::Blend, opacity: Param::constant(0.5), ..lambert(0.7) };
    let cut = builder.add_material(cut);
    add_quad(&mut builder, [[-3.0, 0.0, 1.0], [3.0, 0.0, 1.0], [3.0, 0.7, 1.0], [-3.0, 0.7, 1.0]], cut);
    builder.set_environment(Environment::new(4, 2, [[0.1, 0.2, 0.3]; 8]));
    add_camera(&mut builder, DVec3::new(0.5, 2.0, 6.0), DVec3::new(0.0, 0.6, 0.0), 0.7);
    builder.finish()
}

#[test]
fn every_integrator_gives_the_same_bytes_with_any_threads_and_in_any_crop() {
    let scene = everything();
    for (name, integrator) in Integrator::NAMES {
        let settings = RenderSettings { cull_backfaces: true, ..options(integrator, 40, 4) };
        let whole = shoot(&scene, &RenderSettings { threads: Some(1), ..settings.clone() });
        let lit = whole.pixels.iter().filter(|p| p[1] > 0.0).count();
        assert!(lit > 600, "{name}: {lit} pixels show something");
        assert_eq!(
            shoot(&scene, &RenderSettings { threads: Some(3), ..settings.clone() }).pixels,
            whole.pixels,
            "{name}"
        );
        let crop = CropWindow { x: 7, y: 11, width: 20, height: 9 };
        let part = shoot(&scene, &RenderSettings { crop: Some(crop), ..settings.clone() });
        for (i, pixel) in part.pixels.iter().enumerate() {
            let (x, y) = (crop.x + i as u32 % crop.width, crop.y + i as u32 / crop.width);
            assert_eq!(*pixel, whole.pixels[(y * 40 + x) as usize], "{name} {x} {y}");
        }
        // One lane at a time is the readable statement; fused rounding alone tells the others from it.
        let scalar = shoot(&scene, &RenderSettings { lanes: Some(1), ..settings }).pixels;
        let means = [channel_means(&scalar), channel_means(&whole.pixels)];
        for (a, b) in means[0].iter().zip(means[1]) {
            assert!((a / b - 1.0).abs() < 2e-2, "{name}: {means:?}");
        }
        let alike = scalar.iter().zip(&whole.pixels).filter(|(a, b)| (a[1] - b[1]).abs() <= 1e-3 * (1.0 + b[1]));
        let alike = alike.count() as f64 / scalar.len() as f64;
        assert!(alike > 0.97, "{name}: {alike} of the pixels are alike");
    }
}

#[test]
fn every_integrator_sees_through_what_is_culled() {
    let scene = everything();
    for (name, integrator) in Integrator::NAMES {
        let culled = shoot(&scene, &RenderSettings { cull_backfaces: true, ..options(integrator, 24, 4) });
        let shown = shoot(&scene, &options(integrator, 24, 4));
        assert_ne!(culled.pixels, shown.pixels, "{name}");
    }
    // What camera rays alone look for is as if the front were not there.
    let before = |has_front: bool| {
        let mut builder = lit_floor();
        if has_front {
            let front = builder.add_material(Material { double_sided: false, ..lambert(0.9) });
            add_quad(&mut builder, [[-3.0, 0.0, 2.0], [-3.0, 3.0, 2.0], [3.0, 3.0, 2.0], [3.0, 0.0, 2.0]], front);
        }
        add_camera(&mut builder, DVec3::new(0.5, 2.0, 6.0), DVec3::NEG_Y, 0.7);
        builder.finish()
    };
    for integrator in [Integrator::Normal, Integrator::Albedo] {
        let culled = RenderSettings { cull_backfaces: true, ..options(integrator, 24, 4) };
        let pixels = shoot(&before(true), &culled).pixels;
        assert!(pixels.iter().all(|p| p[1] > 0.0), "the floor is everywhere");
        assert_eq!(pixels, shoot(&before(false), &culled).pixels, "{integrator:?}");
    }
}
