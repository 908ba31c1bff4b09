//! Scenes whose pixels can be written down, with what they must show.

use super::build::{
    add_box, add_camera, add_floor, add_light, add_mesh, add_quad, add_room, add_triangles, ball, lambert, lamp,
    white_dielectric, white_metal,
};
use super::exact::{
    ball_irradiance, closed_room, corner_form_factor, polygon_irradiance, slab, spot_attenuation, triangles_irradiance,
};
use crate::light::{Environment, Light};
use crate::material::Material;
use crate::material::energy::Brdf;
use crate::material::extensions::{DiffuseTransmission, Transmission, Volume};
use crate::math::random::Rng;
use crate::scene::{Scene, SceneBuilder};
use crate::texture::Param;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// A scene with the value of its pixels.
pub struct Case {
    /// What it is.
    pub name: &'static str,
    /// Tests of the design's list that it belongs to.
    pub id: &'static str,
    /// The first camera looks.
    pub scene: Scene,
    /// Mean of the picture, nits.
    pub exact: f64,
    /// By which share of it the picture may be off in endless samples: facets in place of a sphere, tables, rounding.
    pub model: f64,
    /// Scatterings after the first.
    pub max_bounces: Option<u32>,
    /// Microfacet model.
    pub brdf: Brdf,
    /// Of point and spot lights, metres.
    pub light_radius: f64,
    /// Of directional lights, degrees.
    pub sun_angle: f64,
    /// Samples by the usual number: noisy scenes need more.
    pub effort: u32,
}

/// Field of view so small that all pixels see one point: 1 micrometre at 1 m, ten times what f32 resolves there.
const POINT_VIEW: f64 = 1e-6;
/// Where rounding to f32 alone is in the way.
const ROUNDING: f64 = 1e-5;
/// Albedo of floors.
const FLOOR: f32 = 0.6;
/// A ball of this level is off by 2e-4 of what a sphere does.
const LEVEL: u32 = 5;

impl Case {
    fn new(name: &'static str, id: &'static str, builder: SceneBuilder, exact: f64) -> Self {
        let scene = builder.finish();
        let brdf = Brdf::Full;
        let (light_radius, sun_angle) = (0.0, 0.0);
        Self { name, id, scene, exact, model: ROUNDING, max_bounces: None, brdf, light_radius, sun_angle, effort: 1 }
    }

    fn model(self, model: f64) -> Self {
        Self { model, ..self }
    }

    fn effort(self, effort: u32) -> Self {
        Self { effort, ..self }
    }
}

/// All of them.
pub fn cases() -> Vec<Case> {
    let mut all = punctual();
    all.extend(sized());
    all.extend(lamps());
    all.extend(skies());
    all.extend(rooms());
    all.extend(surfaces());
    all
}

/// A Lambertian floor seen from (1, 1, 1) at the origin.
fn floor() -> SceneBuilder {
    floor_from(DVec3::ONE)
}

/// The same from `eye`.
fn floor_from(eye: DVec3) -> SceneBuilder {
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(lambert(FLOOR));
    // Rays start off a surface by what its coordinates round to.
    let half = if eye.length() < 1e-3 { 0.01 } else { 50.0 };
    add_floor(&mut builder, half, material);
    add_camera(&mut builder, eye, DVec3::ZERO, POINT_VIEW);
    builder
}

/// Radiance of the floor under `lux`.
fn lit(lux: f64) -> f64 {
    f64::from(FLOOR) / PI * lux
}

fn punctual() -> Vec<Case> {
    let mut all = Vec::new();
    let at = DVec3::new(3.0, 1.5, -2.0);
    let mut b = floor();
    add_light(&mut b, Light::Point { intensity: [100.0; 3] }, at, DVec3::NEG_Y);
    all.push(Case::new("point light", "LGT-01", b, lit(100.0 * at.normalize().y / at.length_squared())));

    let mut b = floor();
    let (sin, cos) = 40f64.to_radians().sin_cos();
    add_light(&mut b, Light::Directional { illuminance: [10.0; 3] }, DVec3::X, DVec3::new(sin, -cos, 0.0));
    all.push(Case::new("directional light", "LGT-05", b, lit(10.0 * cos)));

    let mut b = floor();
    let (inner_cone, outer_cone, theta) = (0.3, 0.6, 0.45_f64);
    let spot = Light::Spot { intensity: [100.0; 3], inner_cone, outer_cone };
    add_light(&mut b, spot, DVec3::Y * 2.0, DVec3::new(theta.sin(), -theta.cos(), 0.0));
    let fade = spot_attenuation(theta, f64::from(inner_cone), f64::from(outer_cone));
    // The difference of cosines near the outer cone costs digits.
    all.push(Case::new("spot light, between its cones", "LGT-02", b, lit(25.0 * fade)).model(1e-4));

    let mut b = floor();
    for _ in 0..10_000 {
        add_light(&mut b, Light::Point { intensity: [0.01; 3] }, at, DVec3::NEG_Y);
    }
    let value = lit(100.0 * at.normalize().y / at.length_squared());
    all.push(Case::new("10,000 point lights in one place", "LGT-09", b, value).model(1e-4));

    let (mut b, mut rng) = (floor(), Rng::new(1));
    let mut lux = 0.0;
    for i in 0..400 {
        let p = Vec3::new(rng.range(-6.0, 6.0), rng.range(0.3, 4.3), rng.range(-6.0, 6.0)).as_dvec3();
        let intensity = (1 + i % 7) as f32;
        add_light(&mut b, Light::Point { intensity: [intensity; 3] }, p, DVec3::NEG_Y);
        lux += f64::from(intensity) * p.normalize().y / p.length_squared();
    }
    all.push(Case::new("400 point lights", "LGT-06", b, lit(lux)));
    all
}

/// Punctual lights with a size. Their floors end short of the lights: what is below the horizon is not hidden otherwise.
fn sized() -> Vec<Case> {
    let mut all = Vec::new();
    let floor = || {
        let mut b = SceneBuilder::new(0);
        let material = b.add_material(lambert(FLOOR));
        add_floor(&mut b, 0.01, material);
        add_camera(&mut b, DVec3::new(-0.3, 0.5, 0.2), DVec3::ZERO, POINT_VIEW);
        b
    };
    for (name, at, radius) in [
        ("light of 1 m", DVec3::new(1.2, 1.6, 0.0), 1.0_f64),
        ("light of 1 m, partly below the horizon", DVec3::new(2.0, -0.3, 0.5), 1.0),
        ("light of 1 m, 1 mm away", DVec3::new(0.0, 0.6, 0.8) * 1.001, 1.0),
        ("light of 1 um", DVec3::new(3.0, 1.5, -2.0), 1e-6),
    ] {
        let mut b = floor();
        add_light(&mut b, Light::Point { intensity: [100.0; 3] }, at, DVec3::NEG_Y);
        let (s2, cos) = (radius * radius / at.length_squared(), at.normalize().y);
        let lux = ball_irradiance(s2, cos) * 100.0 / (PI * radius * radius);
        // The distance to the near surface is 1e-3 of what f32 has subtracted.
        all.push(Case { light_radius: radius, ..Case::new(name, "LGT-04", b, lit(lux)).model(2e-4) });
    }

    let mut b = floor();
    let (inner_cone, outer_cone, theta) = (0.3, 0.6, 0.45_f64);
    let spot = Light::Spot { intensity: [100.0; 3], inner_cone, outer_cone };
    add_light(&mut b, spot, DVec3::Y * 2.0, DVec3::new(theta.sin(), -theta.cos(), 0.0));
    let fade = spot_attenuation(theta, f64::from(inner_cone), f64::from(outer_cone));
    let case = Case::new("spot light of 0.5 m", "LGT-02", b, lit(25.0 * fade));
    all.push(Case { light_radius: 0.5, ..case }.model(1e-4));

    for (name, height, angle) in [
        ("sun of 0.53 degrees", 50.0_f64, 0.53),
        ("sun of 1e-4 degrees", 50.0, 1e-4),
        ("sun of 40 degrees, partly below the horizon", 12.0, 40.0),
        ("sun of 180 degrees, half below the horizon", 0.0, 180.0),
    ] {
        let mut b = floor();
        let (sin, cos) = height.to_radians().sin_cos();
        add_light(&mut b, Light::Directional { illuminance: [10.0; 3] }, DVec3::X, DVec3::new(cos, -sin, 0.0));
        let s2 = (0.5 * f64::to_radians(angle)).sin().powi(2);
        // A sun of half the sky, cut by the horizon: half of what a whole one gives.
        let lux = if s2 < 1.0 { ball_irradiance(s2, sin) / (PI * s2) } else { 0.5 };
        all.push(Case { sun_angle: angle, ..Case::new(name, "LGT-05", b, lit(10.0 * lux)).model(1e-4) });
    }

    // Chosen among others, by points that see a part of them.
    let mut b = floor();
    let mut lux = 0.0;
    for i in 0..20 {
        let turn = 0.3 * f64::from(i);
        let at = DVec3::new(2.0 * turn.cos(), 0.1 * f64::from(i) - 0.4, 2.0 * turn.sin());
        add_light(&mut b, Light::Point { intensity: [3.0; 3] }, at, DVec3::NEG_Y);
        lux += ball_irradiance(0.25 / at.length_squared(), at.normalize().y) * 3.0 / (PI * 0.25);
    }
    add_light(&mut b, Light::Directional { illuminance: [2.0; 3] }, DVec3::X, DVec3::NEG_X);
    lux += 2.0 * ball_irradiance(f64::to_radians(10.0).sin().powi(2), 0.0) / (PI * f64::to_radians(10.0).sin().powi(2));
    let case = Case::new("20 lights of 0.5 m and a sun, across the horizon", "LGT-06", b, lit(lux));
    all.push(Case { light_radius: 0.5, sun_angle: 20.0, ..case }.model(1e-4));
    all
}

/// A rectangle of `radiance` over a floor; its corners in order, the front towards the floor.
fn rectangle(mut builder: SceneBuilder, corners: [[f32; 3]; 4], radiance: f32, is_two_sided: bool) -> SceneBuilder {
    let material = Material { double_sided: is_two_sided, ..lamp(0.0, radiance) };
    let material = builder.add_material(material);
    add_quad(&mut builder, corners, material);
    builder
}

fn f64s(corners: [[f32; 3]; 4]) -> [DVec3; 4] {
    corners.map(|c| Vec3::from(c).as_dvec3())
}

fn lamps() -> Vec<Case> {
    let mut all = Vec::new();
    let over = [[0.0, 1.0, 0.0], [1.5, 1.0, 0.0], [1.5, 1.0, 0.7], [0.0, 1.0, 0.7]];
    let value = f64::from(FLOOR) * 20.0 * corner_form_factor(1.5, 0.7, 1.0);
    all.push(Case::new("lamp, a corner overhead", "LGT-03", rectangle(floor(), over, 20.0, false), value));

    let back = [over[3], over[2], over[1], over[0]];
    let b = rectangle(floor(), back, 20.0, true);
    all.push(Case::new("lamp that shines on both sides, from behind", "LGT-08", b, value));

    let one_micrometre_up = [[-3e-4, 1e-6, -4e-4], [2e-4, 1e-6, -4e-4], [2e-4, 1e-6, 1e-4], [-3e-4, 1e-6, 1e-4]];
    for (name, eye, radiance, corners) in [
        ("tilted lamp", DVec3::ONE, 20.0, [[0.9, 0.2, 0.5], [0.3, 1.4, 0.5], [0.3, 1.4, -0.5], [0.9, 0.2, -0.5]]),
        (
            "lamp through the horizon",
            DVec3::new(-1.0, 1.0, 0.3),
            20.0,
            [[1.0, -0.5, 0.5], [1.0, 0.7, 0.5], [1.0, 0.7, -0.5], [1.0, -0.5, -0.5]],
        ),
        (
            "lamp of 1 mm at 5 m",
            DVec3::ONE,
            1e7,
            [[3.0, 4.0, 0.0], [3.001, 4.0, 0.0], [3.001, 4.0, 0.001], [3.0, 4.0, 0.001]],
        ),
        (
            "lamp of 50 m at 1 cm",
            DVec3::new(0.01, 0.005, 0.003),
            2.0,
            [[-30.0, 0.01, -40.0], [20.0, 0.01, -40.0], [20.0, 0.01, 10.0], [-30.0, 0.01, 10.0]],
        ),
        ("lamp of 0.5 mm at 1 um", DVec3::new(1e-6, 5e-7, 0.0), 2.0, one_micrometre_up),
    ] {
        let lux = polygon_irradiance(&f64s(corners), DVec3::ZERO, DVec3::Y, f64::from(radiance));
        let b = rectangle(floor_from(eye), corners, radiance, false);
        // A corner's last bit is 1e-4 of the lamp of a millimetre.
        all.push(Case::new(name, "LGT-03", b, lit(lux)).model(2e-4));
    }

    let mut b = floor();
    let mut lux = 0.0;
    for i in 0..400_u32 {
        let radiance = (1 + i % 5) as f32;
        let material = b.add_material(lamp(0.0, radiance));
        let (x, z) = (0.5 * f64::from(i % 20) - 4.7, 0.5 * f64::from(i / 20) - 5.1);
        let corner = |dx: f64, dz: f64| [(x + dx) as f32, 1.25, (z + dz) as f32];
        let corners = [corner(0.0, 0.0), corner(0.1, 0.0), corner(0.1, 0.15), corner(0.0, 0.15)];
        add_quad(&mut b, corners, material);
        lux += polygon_irradiance(&f64s(corners), DVec3::ZERO, DVec3::Y, f64::from(radiance));
    }
    all.push(Case::new("400 lamps", "LGT-06", b, lit(lux)));

    for (name, centre, radius) in [
        ("ball lamp", DVec3::new(1.2, 1.6, 0.0), 1.0),
        ("ball lamp, half below the horizon", DVec3::new(2.0, -0.3, 0.5), 1.0),
    ] {
        let mut b = SceneBuilder::new(0);
        let (dark, shining) = (b.add_material(lambert(FLOOR)), b.add_material(lamp(0.0, 20.0)));
        // A small floor, that hides nothing of the ball from its own middle.
        add_floor(&mut b, 0.01, dark);
        add_camera(&mut b, DVec3::new(-0.3, 0.5, 0.2), DVec3::ZERO, POINT_VIEW);
        let triangles: Vec<_> = ball(LEVEL, radius).into_iter().map(|t| t.map(|p| p + centre)).collect();
        let triangles = add_triangles(&mut b, &triangles, false, shining);
        let lux = triangles_irradiance(&triangles, DVec3::ZERO, DVec3::Y, 20.0);
        all.push(Case::new(name, "LGT-04", b, lit(lux)));
    }
    all
}

/// A sky of `radiance(sine of the height)`, `rows` rows of equal columns.
fn sky(rows: u32, radiance: impl Fn(f64) -> f64) -> Environment {
    let columns = 4;
    let of_row = |row: u32| radiance((PI * (0.5 - (f64::from(row) + 0.5) / f64::from(rows))).sin()) as f32;
    let texels: Vec<[f32; 3]> = (0..rows * columns).map(|i| [of_row(i / columns); 3]).collect();
    Environment::new(columns, rows, texels)
}

fn under_sky(sky: Environment) -> SceneBuilder {
    let mut b = floor();
    b.set_environment(sky);
    b
}

fn skies() -> Vec<Case> {
    let mut all = vec![
        Case::new("even sky", "ENV-01", under_sky(sky(1, |_| 1.0)), f64::from(FLOOR)),
        Case::new(
            "sky that brightens upwards",
            "ENV-01",
            under_sky(sky(512, |y| 2.0 + y)),
            lit(2.0 * PI + 2.0 * PI / 3.0),
        )
        .model(1e-4),
    ];
    // One texel of a sky of 1: the sun.
    let (rows, columns, row) = (256_u32, 512_u32, 60_u32);
    let mut texels = vec![[1.0; 3]; (rows * columns) as usize];
    texels[(row * columns + 100) as usize] = [1e6; 3];
    let edge = |row: u32| (PI * f64::from(row) / f64::from(rows)).cos();
    let solid_angle = 2.0 * PI / f64::from(columns) * (edge(row) - edge(row + 1));
    let cos = (PI * (f64::from(row) + 0.5) / f64::from(rows)).cos();
    let sun = Environment::new(columns, rows, texels);
    all.push(
        Case::new("sky with a sun of 1e6", "ENV-02", under_sky(sun), lit(PI + (1e6 - 1.0) * solid_angle * cos))
            .model(2e-4),
    );
    all
}

fn rooms() -> Vec<Case> {
    let mut all = Vec::new();
    let room = |albedo: f32, radiance: f32| {
        let mut b = SceneBuilder::new(0);
        let wall = b.add_material(lamp(albedo, radiance));
        add_room(&mut b, 1.0, wall);
        add_camera(&mut b, DVec3::new(0.1, 0.2, 0.6), DVec3::new(-0.3, -0.2, -1.0), 1.2);
        b
    };
    for (name, bounces) in [("closed room, 1 bounce", 1), ("closed room, 4 bounces", 4)] {
        let case = Case::new(name, "INT-02", room(0.5, 0.5), closed_room(0.5, 0.5, bounces));
        all.push(Case { max_bounces: Some(bounces), ..case });
    }
    all.push(Case::new("closed room of albedo 0.9", "INT-03", room(0.9, 0.1), 1.0).effort(16));

    // A light anywhere in a ball: what is scattered is the same everywhere.
    let (rho, intensity, light) = (0.7_f32, 2.0, DVec3::new(0.3, 0.2, -0.4));
    let mut b = SceneBuilder::new(0);
    let wall = b.add_material(lambert(rho));
    let walls = add_triangles(&mut b, &ball(LEVEL, 1.0), true, wall);
    add_light(&mut b, Light::Point { intensity: [intensity as f32; 3] }, light, DVec3::NEG_Y);
    let towards = DVec3::new(0.2, -0.5, -0.6).normalize();
    add_camera(&mut b, DVec3::ZERO, towards, POINT_VIEW);
    let (point, normal) = hit(&walls, towards);
    let to_light = light - point;
    let direct = intensity * to_light.normalize().dot(normal) / to_light.length_squared();
    let rho = f64::from(rho);
    let value = rho / PI * (direct + rho * intensity / (1.0 - rho));
    all.push(Case::new("point light anywhere in a ball", "INT-01", b, value).model(1e-3));

    // A shining ball within a grey one.
    let mut b = SceneBuilder::new(0);
    let (inner, outer) = (b.add_material(lamp(0.5, 1.0)), b.add_material(lambert(0.6)));
    add_triangles(&mut b, &ball(LEVEL, 0.5), false, inner);
    add_triangles(&mut b, &ball(LEVEL, 1.0), true, outer);
    add_camera(&mut b, DVec3::new(0.0, 0.0, 0.75), DVec3::new(0.3, 0.1, 2.0), 0.1);
    // L1 = 1 + L2 / 2; L2 = 0.6 (L1 / 4 + 3 L2 / 4).
    let value = 0.15 / (1.0 - 0.6 * 0.75 - 0.15 * 0.5);
    all.push(Case::new("shining ball in a ball", "INT-01", b, value).model(1e-3));
    all
}

/// Where a ray from the origin meets triangles about it, and the normal on this side.
fn hit(triangles: &[[DVec3; 3]], direction: DVec3) -> (DVec3, DVec3) {
    let inside = |[a, b, c]: &&[DVec3; 3]| {
        let signs = [(a, b), (b, c), (c, a)].map(|(p, q)| p.cross(*q).dot(direction));
        signs.iter().all(|s| *s >= 0.0) || signs.iter().all(|s| *s <= 0.0)
    };
    let ahead = |t: &&[DVec3; 3]| t[0].dot(direction) > 0.0;
    triangles.iter().filter(ahead).find(inside).map_or((direction, -direction), |[a, b, c]| {
        let normal = (*b - *a).cross(*c - *a).normalize();
        let normal = if normal.dot(*a) > 0.0 { -normal } else { normal };
        (direction * (a.dot(normal) / direction.dot(normal)), normal)
    })
}

/// A square of `material` under an even sky of 1, seen at cosine `mu`.
fn in_furnace(material: Material, mu: f64) -> SceneBuilder {
    let mut b = SceneBuilder::new(0);
    let surface = b.add_material(material);
    add_floor(&mut b, 0.5, surface);
    b.set_environment(sky(1, |_| 1.0));
    let eye = 2.0 * DVec3::new((1.0 - mu * mu).sqrt(), mu, 0.0);
    add_camera(&mut b, eye, DVec3::ZERO, POINT_VIEW);
    b
}

fn glass(volume: Volume) -> Material {
    Material {
        metallic: Param::constant(0.0),
        roughness: Param::constant(0.0),
        transmission: Transmission { factor: Param::constant(1.0), ..Transmission::default() },
        volume: Some(volume),
        ..Material::default()
    }
}

fn surfaces() -> Vec<Case> {
    let mut all = Vec::new();
    let case =
        Case::new("white metal of roughness 0.5 in a furnace", "BSDF-05", in_furnace(white_metal(0.5), 0.5), 1.0);
    all.push(case.model(2e-3));
    let case = Case::new("white dielectric in a furnace", "BSDF-05", in_furnace(white_dielectric(0.5), 0.5), 1.0);
    all.push(case.model(5e-3));
    let mu = 0.5_f64;
    let value = 1.0 - mu * (1.0 + 1.0 / mu).ln();
    let case = Case::new("single scattering at alpha 1", "BSDF-05", in_furnace(white_metal(1.0), mu), value);
    all.push(Case { brdf: Brdf::AppendixB, ..case }.model(1e-4));

    let clear = Volume { attenuation_color: [1.0; 3], attenuation_distance: f32::INFINITY };
    let mut b = SceneBuilder::new(0);
    let material = b.add_material(glass(clear));
    add_triangles(&mut b, &ball(LEVEL, 1.0), false, material);
    b.set_environment(sky(1, |_| 1.0));
    add_camera(&mut b, DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, 0.4);
    all.push(Case::new("glass ball in a furnace", "INT-03", b, 1.0));

    // A slab between a white and a black half of the world.
    let (thickness, left) = (0.5_f32, 0.4_f32);
    let absorption = -f64::from(left).ln() / 1.0;
    let mu = 0.6_f64;
    let [reflected, passed] = slab(mu, 1.5, absorption, f64::from(thickness));
    for (name, side, value) in
        [("absorbing slab, reflected", 1.0, reflected), ("absorbing slab, through", -1.0, passed)]
    {
        let mut b = SceneBuilder::new(0);
        let material = b.add_material(glass(Volume { attenuation_color: [left; 3], attenuation_distance: 1.0 }));
        add_box(&mut b, [100.0, 0.5 * thickness, 100.0], false, material);
        b.set_environment(sky(64, |y| f64::from(u8::from(y > 0.0))));
        let target = DVec3::Y * (0.5 * f64::from(thickness) * side);
        add_camera(&mut b, target + 2.0 * DVec3::new((1.0 - mu * mu).sqrt(), mu * side, 0.0), target, POINT_VIEW);
        all.push(Case::new(name, "VOL-01", b, value).model(1e-4));
    }

    // Mirrors at x = -1/2 and 1/2, a lamp at the end.
    let (end, tan, start, rho) = (10.0_f64, 1.17_f64, 0.2_f64, 0.9_f32);
    let mut b = SceneBuilder::new(0);
    let mirror = Material { base_color: Param::constant([rho; 3]), ..white_metal(0.0) };
    let (mirror, wall) = (b.add_material(mirror), b.add_material(lamp(0.0, 3.0)));
    for x in [-0.5, 0.5] {
        add_quad(&mut b, [[x, -5.0, 1.0], [x, 5.0, 1.0], [x, 5.0, -12.0], [x, -5.0, -12.0]], mirror);
    }
    let z = -end as f32;
    add_quad(&mut b, [[-0.5, -5.0, z], [0.5, -5.0, z], [0.5, 5.0, z], [-0.5, 5.0, z]], wall);
    add_camera(&mut b, DVec3::X * start, DVec3::new(start + tan, 0.0, -1.0), POINT_VIEW);
    let bounces = (start + end * tan).round();
    let cos = tan / tan.hypot(1.0);
    let rho = f64::from(rho);
    let value = 3.0 * (rho + (1.0 - rho) * (1.0 - cos).powi(5)).powf(bounces);
    all.push(Case::new("mirror corridor, 12 mirrors", "INT-03", b, value).model(1e-4));

    // A sheet that lets light through, from behind.
    let mut b = SceneBuilder::new(0);
    let through = DiffuseTransmission { factor: Param::constant(0.4), color: Param::constant([0.5; 3]) };
    let sheet = b.add_material(Material { diffuse_transmission: through, ..lambert(FLOOR) });
    let corners = vec![[-5.0, 0.0, 5.0], [5.0, 0.0, 5.0], [5.0, 0.0, -5.0], [-5.0, 0.0, -5.0]];
    add_mesh(&mut b, corners, vec![[0, 1, 2], [0, 2, 3]], sheet);
    let (sin, cos) = 40f64.to_radians().sin_cos();
    add_light(&mut b, Light::Directional { illuminance: [10.0; 3] }, DVec3::X, DVec3::new(sin, -cos, 0.0));
    add_camera(&mut b, DVec3::new(1.0, -1.0, 1.0), DVec3::ZERO, POINT_VIEW);
    all.push(Case::new("sheet that lets light through", "BSDF-02", b, 0.4 * 0.5 / PI * 10.0 * cos));
    all
}
