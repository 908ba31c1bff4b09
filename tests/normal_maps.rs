//! Normal maps and height maps: what they do to light, against f64, and that flat ones do nothing.
//!
//! Parallel light on Lambertian surfaces seen at one point: no noise. One seed.

mod support;

use glam::{DMat2, DVec2, DVec3};
use prt::light::Light;
use prt::material::Material;
use prt::scene::{Scene, SceneBuilder};
use prt::shape::Mesh;
use prt::texture::{Filter, Param, TextureRef, UvTransform};
use std::f64::consts::PI;
use support::pictures::{settings, shoot};
use support::scenes;
use support::smooth::{add_mesh, add_texture, flat_quad, mesh, normal_texel};

/// Field of view of all pixels together: one point.
const POINT_VIEW: f64 = 1e-6;

/// A sun of 10 lux from `towards` on a surface of albedo 1 with unit normal `n`.
fn shown(n: DVec3, towards: DVec3) -> f64 {
    10.0 / PI * n.dot(towards.normalize()).max(0.0)
}

/// The green value that the point shows; the whole picture must agree.
fn value(scene: &Scene) -> f64 {
    let pixels = shoot(scene, &settings(2, 2, 0)).pixels;
    let first = f64::from(pixels[0][1]);
    assert!(pixels.iter().all(|p| (f64::from(p[1]) - first).abs() <= 1e-5 * first), "{pixels:?}");
    first
}

/// Bits of a picture of a glossy quad with `change` made to it and its material, under a lamp.
fn glossy_quad(change: impl FnOnce(&mut SceneBuilder, &mut Material, &mut Mesh)) -> Vec<[u32; 3]> {
    let mut builder = SceneBuilder::new(0);
    let lamp = builder.add_material(scenes::lamp(0.0, 20.0));
    let (mut material, mut quad) = (scenes::white_dielectric(0.5), flat_quad(1.0, lamp));
    // Leaning corner normals, so that there is a terminator to correct and a frame to build.
    quad.normals = Some(vec![[-0.2, 0.9, 0.3], [0.3, 0.8, 0.1], [0.2, 0.9, -0.3], [-0.1, 0.9, -0.2]]);
    change(&mut builder, &mut material, &mut quad);
    quad.material = builder.add_material(material);
    add_mesh(&mut builder, quad);
    scenes::add_quad(&mut builder, [[-1.0, 2.0, 1.0], [-1.0, 2.0, -1.0], [1.0, 2.0, -1.0], [1.0, 2.0, 1.0]], lamp);
    scenes::add_camera(&mut builder, DVec3::new(1.0, 1.5, 2.5), DVec3::ZERO, 0.8);
    shoot(&builder.finish(), &settings(24, 8, 5)).pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}

/// Puts a normal map of one texel on a material.
fn map(builder: &mut SceneBuilder, material: &mut Material, texel: [u8; 4], scale: f32) {
    let texture = add_texture(builder, 1, vec![texel], Filter::Bilinear);
    material.normal = Param { factor: scale, texture: Some(texture) };
}

// No unsigned integer of 8 or 16 bits stands for 0.5, so an exactly flat map is one of scale 0.
#[test]
fn frame02_exactly_flat_normal_map_changes_no_bit() {
    let plain = glossy_quad(|_, _, _| ());
    assert!(glossy_quad(|b, m, _| map(b, m, normal_texel(30.0, 1.0), 0.0)) == plain);
    assert!(glossy_quad(|b, m, _| map(b, m, normal_texel(30.0, 1.0), 1.0)) != plain, "a map that is not flat does");
}

#[test]
fn frame02_flat_blue_of_8_bits_tilts_by_a_fifth_of_a_degree_and_breaks_nothing() {
    let plain = glossy_quad(|_, _, _| ());
    let blue = glossy_quad(|b, m, _| map(b, m, [128, 128, 255, 255], 1.0));
    let values = |bits: &[[u32; 3]]| bits.iter().map(|p| f64::from(f32::from_bits(p[1]))).collect::<Vec<_>>();
    let (plain, blue) = (values(&plain), values(&blue));
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    assert!((mean(&blue) / mean(&plain) - 1.0).abs() < 0.01, "{} became {}", mean(&plain), mean(&blue));
    for (p, q) in plain.iter().zip(&blue) {
        assert!((p - q).abs() <= 0.3 * p.max(0.1), "{p} became {q}");
    }
}

#[test]
fn frame02_tangents_without_a_direction_leave_the_normal_as_it_is() {
    let plain = glossy_quad(|_, _, _| ());
    let along = |quad: &Mesh| quad.normals.clone().expect("normals").iter().map(|n| [n[0], n[1], n[2], 1.0]).collect();
    for bad in [[0.0, 0.0, 0.0, 1.0], [f32::NAN, 0.0, 0.0, 1.0], [f32::INFINITY, 0.0, 1.0, -1.0]] {
        let got = glossy_quad(|b, m, q| {
            map(b, m, normal_texel(40.0, 0.5), 1.0);
            q.tangents = Some(vec![bad; 4]);
        });
        assert!(got == plain, "{bad:?}");
    }
    // Parallel to the normal at the corners; what is left in between is small but has a direction.
    let parallel = glossy_quad(|b, m, q| {
        map(b, m, normal_texel(40.0, 0.5), 1.0);
        q.normals = Some(vec![[0.0, 1.0, 0.0]; 4]);
        q.tangents = Some(along(q));
    });
    let upright = glossy_quad(|_, _, q| q.normals = Some(vec![[0.0, 1.0, 0.0]; 4]));
    assert!(parallel == upright);
}

/// A quad in y = 0 with a normal map tilted by 30 degrees towards azimuth 0.7, with and without vertex normals, whose
/// texture runs along +x or, mirrored, along -x: what it shows under a sun from `towards`.
fn tilted(mirrored: bool, has_normals: bool, from_below: bool, towards: DVec3) -> f64 {
    let mut builder = SceneBuilder::new(0);
    let texture = add_texture(&mut builder, 1, vec![normal_texel(30.0, 0.7)], Filter::Bilinear);
    let normal = Param { factor: 1.0, texture: Some(texture) };
    let white = builder.add_material(Material { normal, ..scenes::lambert(1.0) });
    let mut quad = flat_quad(1.0, white);
    if mirrored {
        quad.uv_sets[0].iter_mut().for_each(|uv| uv[0] = 1.0 - uv[0]);
        quad.tangents = Some(vec![[-1.0, 0.0, 0.0, -1.0]; 4]);
    }
    if !has_normals {
        quad.normals = None;
    }
    add_mesh(&mut builder, quad);
    scenes::add_light(&mut builder, Light::Directional { illuminance: [10.0; 3] }, DVec3::ZERO, -towards);
    let eye = DVec3::new(0.1, if from_below { -2.0 } else { 2.0 }, 0.2);
    scenes::add_camera(&mut builder, eye, DVec3::new(0.3, 0.0, 0.2), POINT_VIEW);
    value(&builder.finish())
}

#[test]
fn frame02_normal_maps_tilt_as_the_tangent_frame_says_also_mirrored_and_from_behind() {
    let texel = normal_texel(30.0, 0.7).map(|b| f64::from(b) / 127.5 - 1.0);
    // Bitangent = normal x tangent = y x x = -z: +green tilts towards -z, the top of the image.
    let normal = DVec3::new(texel[0], texel[2], -texel[1]).normalize();
    let mirror = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
    for towards in [DVec3::new(0.5, 1.0, 0.2), DVec3::new(-0.3, 1.0, -0.6)] {
        for has_normals in [true, false] {
            let plain = tilted(false, has_normals, false, towards);
            assert!((plain / shown(normal, towards) - 1.0).abs() < 1e-4, "{plain}, {}", shown(normal, towards));
            let mirrored = tilted(true, has_normals, false, mirror(towards));
            assert!((mirrored / plain - 1.0).abs() < 1e-5, "mirrored half: {mirrored}, {plain}");
            let behind = tilted(false, has_normals, true, -towards);
            assert!((behind / plain - 1.0).abs() < 1e-5, "the back has the opposite normal: {behind}, {plain}");
        }
    }
}

/// Texels across and down of the height field.
const TEXELS: u32 = 16;
/// Height of texel 1.0, metres.
const HEIGHT: f64 = 0.6;

/// Red of texel (i, j): a parabola across and a ramp down, whose slope central differences give exactly.
fn height_texel(i: u32, j: u32) -> [u8; 4] {
    [(i * i + j) as u8, 0, 0, 255]
}

/// dh/du, dh/dv of the field that the texels stand for, at texture coordinates `uv`, metres.
fn height_slope(uv: DVec2) -> DVec2 {
    let n = f64::from(TEXELS);
    DVec2::new(2.0 * (uv.x * n - 0.5) * n, n) * HEIGHT / 255.0
}

/// A parallelogram on which the height map lies by coordinates that `place` gives, in the order of [`SKEWED`].
struct Relief {
    uvs: [[f32; 2]; 4],
    transform: Option<UvTransform>,
    smooth: bool,
}

/// A parallelogram in space: corner, two edges.
const SKEWED: [DVec3; 3] = [DVec3::new(-1.0, 0.2, 1.0), DVec3::new(2.0, 0.3, 0.1), DVec3::new(0.4, -0.1, -1.6)];

/// What the parallelogram shows at `at` (shares of its edges), and what f64 says.
fn relief(relief: &Relief, at: DVec2, towards: DVec3, from_below: bool) -> [f64; 2] {
    let [p, e1, e2] = SKEWED;
    let mut builder = SceneBuilder::new(0);
    let texels = (0..TEXELS * TEXELS).map(|k| height_texel(k % TEXELS, k / TEXELS)).collect();
    let texture = add_texture(&mut builder, TEXELS, texels, Filter::Bilinear);
    let texture = TextureRef { transform: relief.transform, ..texture };
    let bump = Param { factor: HEIGHT as f32, texture: Some(texture) };
    let white = builder.add_material(Material { bump, ..scenes::lambert(1.0) });
    let corners = [p, p + e1, p + e1 + e2, p + e2].map(|c| c.as_vec3().to_array());
    let ng = e1.cross(e2).normalize();
    let normals = vec![ng.as_vec3().to_array(); 4];
    let mut quad = mesh(corners.to_vec(), normals, relief.uvs.to_vec(), vec![[0, 1, 2], [0, 2, 3]], white);
    if !relief.smooth {
        quad.normals = None;
    }
    add_mesh(&mut builder, quad);
    scenes::add_light(&mut builder, Light::Directional { illuminance: [10.0; 3] }, DVec3::ZERO, -towards);
    let target = p + e1 * at.x + e2 * at.y;
    let side = if from_below { -1.0 } else { 1.0 };
    scenes::add_camera(&mut builder, target + 2.0 * side * ng + DVec3::new(0.1, 0.0, 0.1), target, POINT_VIEW);
    let got = value(&builder.finish());

    let m = relief.transform.map_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], |t| t.m).map(|row| row.map(f64::from));
    let uv = relief.uvs.map(|[u, v]| {
        let (u, v) = (f64::from(u), f64::from(v));
        DVec2::new(m[0][0] * u + m[0][1] * v + m[0][2], m[1][0] * u + m[1][1] * v + m[1][2])
    });
    let (d1, d2) = (uv[1] - uv[0], uv[3] - uv[0]);
    let slope = height_slope(uv[0] + d1 * at.x + d2 * at.y);
    // The surface P + h ng: its tangents along the edges, and their cross product.
    let along = |d: DVec2, e: DVec3| e + ng * slope.dot(d);
    let n = along(d1, e1).cross(along(d2, e2)).normalize();
    [got, shown(n * side, towards)]
}

#[test]
fn bump_tilts_normals_as_the_displaced_surface_has_them() {
    let rotate = DMat2::from_angle(0.4);
    let turned = UvTransform {
        m: [
            [rotate.x_axis.x as f32 * 0.6, rotate.y_axis.x as f32 * 0.7, 0.35],
            [rotate.x_axis.y as f32 * 0.6, rotate.y_axis.y as f32 * 0.7, 0.1],
        ],
    };
    let square = [[0.1, 0.9], [0.9, 0.9], [0.9, 0.1], [0.1, 0.1]];
    let mirrored = square.map(|[u, v]: [f32; 2]| [1.0 - u, v]);
    for (uvs, transform) in [(square, None), (mirrored, None), (square, Some(turned))] {
        for smooth in [true, false] {
            for from_below in [false, true] {
                let placed = Relief { uvs, transform, smooth };
                for (x, y) in [(0.2, 0.3), (0.5, 0.45), (0.71, 0.13), (0.33, 0.82)] {
                    let side = if from_below { -1.0 } else { 1.0 };
                    let towards = DVec3::new(0.4, 1.0, -0.3) * side;
                    let [got, want] = relief(&placed, DVec2::new(x, y), towards, from_below);
                    assert!(want > 0.1, "the light reaches the point");
                    assert!((got / want - 1.0).abs() < 2e-3, "{uvs:?} {transform:?} {x} {y}: {got}, not {want}");
                }
            }
        }
    }
}

/// Puts a height map on a material.
fn bump(builder: &mut SceneBuilder, material: &mut Material, texels: Vec<[u8; 4]>, height: f32) {
    let texture = add_texture(builder, 4, texels, Filter::Bilinear);
    material.bump = Param { factor: height, texture: Some(texture) };
}

#[test]
fn bump_that_is_flat_or_has_no_coordinates_changes_no_bit() {
    let plain = glossy_quad(|_, _, _| ());
    let rough: Vec<_> = (0..16u8).map(|i| [i * 7 % 11 * 20, 0, 0, 255]).collect();
    assert!(glossy_quad(|b, m, _| bump(b, m, vec![[77, 1, 2, 3]; 16], 0.3)) == plain);
    assert!(glossy_quad(|b, m, _| bump(b, m, rough.clone(), 0.0)) == plain);
    let pinned = |b: &mut SceneBuilder, m: &mut Material, q: &mut Mesh| {
        bump(b, m, rough.clone(), 0.3);
        q.uv_sets = vec![vec![[0.4, 0.3]; 4]];
    };
    assert!(glossy_quad(pinned) == plain);
    let bare = glossy_quad(|_, _, q| (q.normals, q.tangents) = (None, None));
    let bare_bump = glossy_quad(|b, m, q| {
        bump(b, m, rough.clone(), 0.3);
        (q.normals, q.tangents, q.uv_sets) = (None, None, Vec::new());
    });
    assert!(bare_bump == bare);
    assert!(glossy_quad(|b, m, _| bump(b, m, rough.clone(), 0.3)) != plain, "a height map that is not flat does");
}
