//! Exact shapes: pictures whose values can be written down, pictures of fine meshes of the same form, every backend, and
//! the search against the oracle of `verify shapes`.
//!
//! Pictures: box filter, seeds 0 to 15, a test fails at 4.5 standard errors (one false alarm in 1e5).

mod support;

use glam::{DMat4, DQuat, DVec3, Vec3};
use prt::accel::{Accel, linear::Linear, wide::WideBvh};
use prt::accel::{HitBatch, MISS, RayBatch, embree, embree::EmbreeAccel};
use prt::light::Environment;
use prt::material::extensions::{Transmission, Volume};
use prt::material::{AlphaMode, Material};
use prt::render::{DefaultLight, RenderSettings, geometry, prepare};
use prt::scene::{MaterialId, PlacedShape, Scene, SceneBuilder};
use prt::shape::Mesh;
use prt::shape::exact::ExactShape;
use prt::shape::exact::profile::{Curve, Profile};
use prt::texture::{Filter, Param};
use prt::verify::light::exact::ball_irradiance;
use prt::verify::shapes::{bottle, named, random, sum};
use std::path::PathBuf;
use std::sync::Arc;
use support::pictures::{settings, shoot, shoot_seeds};
use support::scenes::{add_camera, add_floor, lambert, lamp};
use support::smooth::{add_texture, mesh, normal_texel};

fn sphere(radius: f64) -> Arc<ExactShape> {
    Arc::new(ExactShape::Sphere { radius })
}

fn turned(points: &[[f64; 2]]) -> Arc<ExactShape> {
    Arc::new(ExactShape::revolution(Profile::new(Curve::Bezier, points).unwrap()))
}

fn add(builder: &mut SceneBuilder, shape: &Arc<ExactShape>, material: MaterialId, world_from_object: DMat4) {
    builder.add_shape(PlacedShape {
        shape: Arc::clone(shape),
        material,
        world_from_object,
        name: String::from("shape"),
    });
}

fn surrounded(builder: &mut SceneBuilder) {
    builder.set_environment(Environment::new(1, 1, [[1.0; 3]]));
}

/// Mean over the picture and the seeds, and its standard error.
fn mean(scene: &Scene, size: u32, spp: u32) -> (f64, f64) {
    let settings = RenderSettings { default_light: DefaultLight::Off, max_bounces: None, ..settings(size, spp, 0) };
    let means: Vec<f64> = shoot_seeds(scene, &settings, 16)
        .iter()
        .map(|p| p.pixels.iter().flatten().map(|&v| f64::from(v)).sum::<f64>() / (3 * p.pixels.len()) as f64)
        .collect();
    let mean = means.iter().sum::<f64>() / 16.0;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / 15.0;
    (mean, (variance / 16.0).sqrt())
}

/// Holds the mean against `exact`; `finest` is the largest standard error that gives the test its power, as a share.
fn is_exactly(what: &str, scene: &Scene, (size, spp): (u32, u32), exact: f64, finest: f64) {
    let (mean, error) = mean(scene, size, spp);
    assert!(error <= finest * exact, "{what}: the standard error {error} is too large for {exact}");
    assert!((mean - exact).abs() <= 4.5 * error + 2e-5 * exact, "{what}: {mean} +- {error}, not {exact}");
}

// 10,000 rays at five profiles and 20 at each of 150 random ones; the long tests shoot 40,000 at each and take 1000.
#[test]
fn sor_02_no_crossing_is_missed_and_hardly_one_is_too_many() {
    for subject in named() {
        let row = subject.check(1500, 1234, 4.0);
        assert!(row.is_good() && row.crossings > 100, "{row:?}");
    }
    let all = sum("random", (0..150).map(|k| random(k).check(12, 1234, 3.0)));
    assert!(all.is_good() && all.crossings > 1000, "{all:?}");
    let far = bottle().check(1000, 1235, 4000.0);
    assert!(far.is_good() && far.crossings > 200, "{far:?}");
}

#[test]
fn furnaces_with_white_shapes_show_nothing() {
    for (what, shape, place) in [
        ("ball", sphere(1.0), DMat4::IDENTITY),
        ("egg", sphere(1.0), DMat4::from_scale(DVec3::new(1.0, -1.5, 0.7))),
        ("vase", turned(&[[0.0, -1.0], [1.5, -1.0], [0.2, 0.6], [0.6, 1.0]]), DMat4::from_rotation_x(0.5)),
    ] {
        let mut builder = SceneBuilder::new(0);
        surrounded(&mut builder);
        let glass = builder.add_material(Material {
            transmission: Transmission { factor: Param::constant(1.0), dispersion: 0.0 },
            metallic: Param::constant(0.0),
            roughness: Param::constant(0.0),
            volume: Some(Volume { attenuation_color: [1.0; 3], attenuation_distance: f32::INFINITY }),
            ..Material::default()
        });
        let white = builder.add_material(lambert(1.0));
        // A vase is open, so light goes in; a boundary must be closed.
        let is_closed = what != "vase";
        add(&mut builder, &shape, if is_closed { glass } else { white }, place);
        add_camera(&mut builder, DVec3::new(0.4, 0.8, 4.0), DVec3::ZERO, 0.7);
        is_exactly(what, &builder.finish(), (8, 16), 1.0, 2e-3);
    }
    // Convex and grey: what it reflects is what it is.
    let mut builder = SceneBuilder::new(0);
    surrounded(&mut builder);
    let grey = builder.add_material(lambert(0.6));
    add(&mut builder, &sphere(50.0), grey, DMat4::from_translation(DVec3::Z * -52.0));
    add_camera(&mut builder, DVec3::ZERO, DVec3::NEG_Z, 0.3);
    is_exactly("grey ball", &builder.finish(), (4, 16), 0.6, 2e-3);
}

#[test]
fn lgt_04_glowing_spheres_give_what_their_closed_form_says() {
    // Squared sine of the sphere's half angle and cosine to its centre, as numerics 2.4 has them, and from afar.
    for (s2, c) in [(0.25, 0.9), (0.25, 0.3), (0.25, -0.3), (0.81, 0.2), (1e-6, 0.7), (0.999, 0.5)] {
        let (distance, rho) = (2.0, 0.5);
        let radius = f64::sqrt(s2) * distance;
        let mut builder = SceneBuilder::new(0);
        let grey = builder.add_material(lambert(rho));
        add_floor(&mut builder, 1e-3, grey);
        let glow = builder.add_material(lamp(0.0, 3.0));
        let towards = DVec3::new(f64::sqrt(1.0 - c * c), c, 0.0);
        // Scaled by the node, mirrored and turned: a ball all the same.
        let place = DMat4::from_scale_rotation_translation(
            DVec3::new(-2.0, 2.0, 2.0),
            DQuat::from_rotation_z(0.3),
            towards * distance,
        );
        add(&mut builder, &sphere(0.5 * radius), glow, place);
        add_camera(&mut builder, DVec3::new(-2e-4, 5e-4, 0.0), DVec3::ZERO, 0.01);
        let scene = builder.finish();
        let exact = f64::from(rho) / std::f64::consts::PI * 3.0 * ball_irradiance(s2, c);
        is_exactly(&format!("{s2} {c}"), &scene, (2, 64), exact, 2e-2);
        let prepared = prepare(&scene, &settings(2, 1, 0)).unwrap();
        assert!(prepared.tables.lights.has_bulbs() && prepared.warnings.is_empty(), "{:?}", prepared.warnings);
    }
}

#[test]
fn shapes_that_glow_and_are_not_sampled_are_named_and_give_their_light() {
    let light = |shape: &Arc<ExactShape>, stretch: DVec3, pane: bool| {
        let mut builder = SceneBuilder::new(0);
        let grey = builder.add_material(lambert(0.5));
        add_floor(&mut builder, 1e-3, grey);
        let glow = builder.add_material(lamp(0.0, 3.0));
        let place = DMat4::from_translation(DVec3::Y * 2.0) * DMat4::from_scale(stretch);
        add(&mut builder, shape, glow, place);
        if pane {
            let glass = builder.add_material(Material {
                transmission: Transmission { factor: Param::constant(1.0), dispersion: 0.0 },
                metallic: Param::constant(0.0),
                roughness: Param::constant(0.0),
                ..Material::default()
            });
            let far = DMat4::from_translation(DVec3::Y * -50.0);
            add(&mut builder, &sphere(1.0), glass, far);
        }
        add_camera(&mut builder, DVec3::new(-2e-4, 5e-4, 0.0), DVec3::ZERO, 0.01);
        builder.finish()
    };
    let exact = 0.5 / std::f64::consts::PI * 3.0 * ball_irradiance(0.64, 1.0);
    // Stretched along its axis of sight the outline stays, seen from a point below: not a ball, but close to one.
    let ball = sphere(1.6);
    let warning = |scene: &Scene| prepare(scene, &settings(2, 1, 0)).unwrap().warnings.join("; ");
    let stretched = light(&ball, DVec3::new(1.0, 1.0 + 1e-4, 1.0), false);
    assert!(warning(&stretched).contains("exact shape \"shape\" glows"), "{}", warning(&stretched));
    is_exactly("stretched", &stretched, (2, 256), exact, 1e-2);
    let behind = light(&ball, DVec3::ONE, true);
    assert!(warning(&behind).contains("1 exact sphere glows in a scene of smooth thin glass"), "{}", warning(&behind));
    is_exactly("with a pane", &behind, (2, 256), exact, 1e-2);
    let drawn = light(&turned(&[[0.0, -1.0], [1.5, -1.0], [1.5, 1.0], [0.0, 1.0]]), DVec3::ONE, false);
    assert!(warning(&drawn).contains("found by scattered rays only") && !warning(&drawn).contains("black"));
}

#[test]
fn half_there_spheres_let_half_of_the_rays_pass_at_each_crossing() {
    let mut builder = SceneBuilder::new(0);
    surrounded(&mut builder);
    let mut black = lambert(0.0);
    (black.alpha_mode, black.opacity) = (AlphaMode::Blend, Param::constant(0.5));
    let black = builder.add_material(black);
    add(&mut builder, &sphere(5.0), black, DMat4::from_translation(DVec3::Z * -20.0));
    add_camera(&mut builder, DVec3::ZERO, DVec3::NEG_Z, 0.1);
    is_exactly("two crossings", &builder.finish(), (8, 64), 0.25, 2e-2);
}

/// The same form as a mesh with exact normals.
fn tessellated(shape: &ExactShape, (rows, columns): (usize, usize), material: MaterialId) -> Mesh {
    let unit = shape.object_from_unit();
    let (mut positions, mut normals, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for row in 0..=rows {
        for column in 0..=columns {
            let (s, turn) = (row as f64 / rows as f64, column as f64 / columns as f64);
            let point = shape.point(s, turn % 1.0);
            positions.push(unit.transform_point3(point.p).as_vec3().to_array());
            normals.push(point.n.as_vec3().to_array());
            uvs.push([turn as f32, 1.0 - s as f32]);
        }
    }
    let at = |row: usize, column: usize| (row * (columns + 1) + column) as u32;
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let [a, b, c, d] = [at(row, column), at(row, column + 1), at(row + 1, column + 1), at(row + 1, column)];
        indices.extend([[a, b, c], [a, c, d]]);
    }
    mesh(positions, normals, uvs, indices, material)
}

/// A bottle on a floor, as it is or as a mesh; normal-mapped, textured, stretched and mirrored.
fn bottles(is_exact: bool, kind: usize) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let floor = builder.add_material(lambert(0.5));
    add_floor(&mut builder, 3.0, floor);
    let mut material = Material { roughness: Param::constant(0.4), double_sided: true, ..Material::default() };
    match kind {
        0 => {
            material.metallic = Param::constant(0.0);
            let texels = (0..16).map(|i| if (i + i / 4) % 2 == 0 { [230, 60, 30, 255] } else { [30, 60, 230, 255] });
            material.base_color.texture = Some(add_texture(&mut builder, 4, texels.collect(), Filter::Nearest));
        }
        1 => {
            let texel = normal_texel(25.0, 0.7);
            material.normal.texture = Some(add_texture(&mut builder, 1, vec![texel], Filter::Nearest));
        }
        _ => {
            material.transmission = Transmission { factor: Param::constant(1.0), dispersion: 0.0 };
            material.metallic = Param::constant(0.0);
            material.roughness = Param::constant(0.0);
            material.volume = Some(Volume { attenuation_color: [0.4, 0.8, 0.6], attenuation_distance: 0.3 });
        }
    }
    let material = builder.add_material(material);
    // Closed, for glass: a drop.
    let points = bottle().points;
    let drop = [[0.0, 0.0], [1.1, 0.0], [0.5, 1.2], [0.0, 1.6]];
    let shape = turned(if kind == 2 { &drop } else { &points });
    let places = [
        DMat4::from_translation(DVec3::new(-0.7, 0.01, 0.0)),
        DMat4::from_translation(DVec3::new(0.7, 0.3, 0.1))
            * DMat4::from_rotation_z(0.5)
            * DMat4::from_scale(DVec3::new(-1.0, 0.8, 1.3)),
    ];
    let fine = (!is_exact).then(|| {
        let mut mesh = tessellated(&shape, (260, 160), material);
        if kind == 1 {
            let tangents = (0..mesh.positions.len()).map(|i| {
                let (row, column) = (i / 161, i % 161);
                let point = shape.point(row as f64 / 260.0, column as f64 / 160.0);
                let t = point.du.normalize().as_vec3();
                [t.x, t.y, t.z, 1.0]
            });
            mesh.tangents = Some(tangents.collect());
        }
        builder.add_mesh(mesh)
    });
    for place in places {
        match fine {
            None => add(&mut builder, &shape, material, place),
            Some(mesh) => {
                let name = String::from("bottle");
                builder.add_instance(prt::scene::Instance { mesh, world_from_object: place, name });
            }
        }
    }
    add_camera(&mut builder, DVec3::new(0.2, 1.6, 4.0), DVec3::new(0.0, 0.8, 0.0), 0.7);
    builder.finish()
}

// 32 x 32 pixels in blocks of 8 x 8, 8 seeds each: Welch's t of 16 blocks and three channels at 5 standard errors.
#[test]
fn shapes_look_like_fine_meshes_of_the_same_form() {
    for kind in 0..3 {
        let blocks = |is_exact: bool| {
            let settings = RenderSettings { default_light: DefaultLight::On, ..settings(32, 32, 0) };
            let scene = bottles(is_exact, kind);
            let mut all = vec![Vec::new(); 48];
            for picture in shoot_seeds(&scene, &settings, 8) {
                for (block, means) in all.chunks_mut(3).enumerate() {
                    for (channel, means) in means.iter_mut().enumerate() {
                        let pixel = |i: usize| (block / 4 * 8 + i / 8) * 32 + block % 4 * 8 + i % 8;
                        let sum: f64 = (0..64).map(|i| f64::from(picture.pixels[pixel(i)][channel])).sum();
                        means.push(sum / 64.0);
                    }
                }
            }
            all
        };
        let moments = |values: &[f64]| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64;
            (mean, variance / values.len() as f64)
        };
        for (i, (exact, fine)) in blocks(true).iter().zip(blocks(false)).enumerate() {
            let ((a, va), (b, vb)) = (moments(exact), moments(&fine));
            // Facets leave a thousandth.
            let apart = (a - b).abs() - 2e-3 * b;
            assert!(apart <= 6.0 * (va + vb).sqrt(), "kind {kind}, block {i}: {a} and {b}, errors {va:e} {vb:e}");
        }
    }
}

/// Shapes of every kind, stretched, mirrored, far apart in size, over a floor; the second half-there.
fn corpus() -> Scene {
    let mut builder = SceneBuilder::new(0);
    let opaque = builder.add_material(lambert(0.5));
    let texels = vec![[255, 255, 255, 255], [255, 255, 255, 100], [255, 255, 255, 0], [255, 255, 255, 255]];
    let mut holes = lambert(0.5);
    holes.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
    holes.opacity.texture = Some(add_texture(&mut builder, 2, texels, Filter::Nearest));
    let holes = builder.add_material(holes);
    add_floor(&mut builder, 4.0, opaque);
    let shapes: Vec<_> = named().iter().map(|s| turned(&s.points)).chain([sphere(0.7)]).collect();
    for i in 0..24 {
        let k = f64::from(i);
        let turn = DQuat::from_rotation_x(0.7 * k) * DQuat::from_rotation_z(1.3 * k);
        let scale = DVec3::new(0.4, if i % 2 == 0 { 0.3 } else { -0.5 }, 0.2 + 0.02 * k);
        let at = DVec3::new((1.9 * k).sin() * 3.0, 1.0 + 0.05 * k, (2.3 * k).cos() * 3.0);
        let place = DMat4::from_scale_rotation_translation(scale, turn, at);
        add(&mut builder, &shapes[i as usize % shapes.len()], if i % 3 == 0 { holes } else { opaque }, place);
    }
    builder.finish()
}

#[test]
fn bvh_01_every_backend_meets_shapes_at_the_same_bits() {
    let geometry = geometry(&corpus(), &RenderSettings::default()).unwrap();
    assert_eq!(geometry.world.shapes.len(), 24);
    assert_eq!(geometry.world.shapes.iter().filter(|(shape, _)| shape.is_filtered()).count(), 8);
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".embree");
    let mut backends: Vec<(&str, Box<dyn Accel>)> = vec![("bvh", Box::new(WideBvh::build(geometry.clone())))];
    match embree::find(&[folder]) {
        Ok(library) => {
            backends.push(("embree", Box::new(EmbreeAccel::build_with(geometry.clone(), &library).unwrap())));
        }
        Err(why) => println!("skipped: no Embree library ({why})"),
    }
    const N: usize = 4000;
    let mut rng = prt::math::random::Rng::new(7);
    let mut rays = RayBatch::new(N);
    for i in 0..N {
        let mut cube = |size: f32| Vec3::new(rng.range(-size, size), rng.range(-size, size), rng.range(-size, size));
        let (o, target) = (cube(5.0), cube(3.0));
        let t_max = if i % 3 == 0 { 1.0 } else { f32::INFINITY };
        rays.set(i, o, target - o, t_max);
        rays.key[i] = i as u32;
    }
    let trace = |accel: &dyn Accel, coherent: bool| {
        let (mut hits, mut occluded) = (HitBatch::new(N), vec![0; N]);
        accel.intersect(&rays, 0..N, coherent, &mut hits);
        accel.occluded(&rays, N, &mut occluded);
        (0..N).for_each(|i| assert_eq!(occluded[i] == 1, hits.primitive[i] != MISS, "ray {i}"));
        hits
    };
    let want = trace(&Linear::new(geometry.clone()), false);
    let on_shapes = (0..N).filter(|&i| want.primitive[i] != MISS && want.primitive[i] >= 2).count();
    assert!(on_shapes > N / 16, "{on_shapes}");
    for (name, backend) in &backends {
        for coherent in [false, true] {
            let got = trace(&**backend, coherent);
            for i in 0..N {
                assert_eq!(got.primitive[i], want.primitive[i], "{name}, ray {i}");
                let shape = want.primitive[i] != MISS && want.primitive[i] >= 2;
                if shape {
                    let bits = |h: &HitBatch| [h.t[i], h.u[i], h.v[i]].map(f32::to_bits);
                    assert_eq!(bits(&got), bits(&want), "{name}, ray {i}");
                }
            }
        }
    }
}

#[test]
fn shapes_alone_make_a_scene_that_is_framed_and_lit_like_any_other() {
    let mut builder = SceneBuilder::new(0);
    let grey = builder.add_material(lambert(0.5));
    add(&mut builder, &sphere(1.0), grey, DMat4::from_translation(DVec3::new(1e6, 0.0, -3e5)));
    let scene = builder.finish();
    assert!(!scene.is_empty() && scene.triangle_count() == 0);
    let frame = shoot(&scene, &settings(16, 16, 0));
    assert!(frame.stats.default_light.used && frame.stats.features.contains(&("exact_shapes", true)));
    let lit = frame.pixels.iter().filter(|p| p[1] > 0.01).count();
    assert!(lit > 100, "the ball fills much of the picture: {lit}");
    let centre = frame.pixels[8 * 16 + 8][1];
    assert!(centre > 0.01, "{centre}");
}

#[test]
fn shapes_that_are_squashed_flat_or_out_of_range_are_dropped_and_counted() {
    let mut builder = SceneBuilder::new(0);
    let grey = builder.add_material(lambert(0.5));
    let flat = DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0));
    add(&mut builder, &sphere(1.0), grey, flat);
    add(&mut builder, &sphere(1.0), grey, DMat4::from_translation(DVec3::X * 1e19));
    add(&mut builder, &sphere(1e-6), grey, DMat4::IDENTITY);
    let scene = builder.finish();
    assert_eq!(scene.shapes.len(), 1);
    assert!(
        scene.warnings[0].starts_with("1 exact shapes dropped: their scale squashes them flat"),
        "{:?}",
        scene.warnings
    );
    assert!(scene.losses[0].starts_with("1 exact shapes dropped: beyond 1.844e18 m"), "{:?}", scene.losses);
}
