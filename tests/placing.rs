//! What is merged and what is placed, and that a picture does not tell: placed meshes of every kind beside merged ones,
//! their rays that leave, and what is said about the choice.
//!
//! One seed (7) unless a test says otherwise.

mod support;

#[path = "support/meshes.rs"]
mod meshes;
#[path = "support/prepared.rs"]
mod prepared;
#[path = "support/rng.rs"]
mod rng;

use glam::{DMat4, DQuat, DVec3, Vec3};
use prepared::{backends, prepared_as, trace};
use prt::accel::{HitBatch, MISS, RayBatch};
use prt::material::{AlphaMode, Material};
use prt::render::{AccelChoice, Choice, Progress, RenderSettings, pool, prepare_placing, render_prepared};
use prt::scene::{Instance, MaterialId, Scene, SceneBuilder};
use prt::shape::Mesh;
use prt::texture::{Filter, Param};
use rng::Rng;
use support::pictures::settings;
use support::scenes;
use support::smooth::{add_mesh, add_texture, flat_quad, normal_texel, smooth_sphere};

/// Turned, stretched, mirrored, sheared.
fn places() -> Vec<DMat4> {
    let trs = |s: DVec3, angle: f64, at: DVec3| {
        DMat4::from_scale_rotation_translation(s, DQuat::from_rotation_y(angle) * DQuat::from_rotation_x(0.5), at)
    };
    let shear = DMat4::from_scale(DVec3::new(1.0, 1.6, 0.8)) * DMat4::from_rotation_z(0.6);
    vec![
        trs(DVec3::splat(0.5), 0.3, DVec3::new(-1.2, 0.5, 0.0)),
        trs(DVec3::new(0.3, 0.6, 0.4), 1.0, DVec3::new(0.0, 0.6, -0.4)),
        trs(DVec3::new(-0.5, 0.5, 0.5), 2.0, DVec3::new(1.2, 0.5, 0.1)),
        DMat4::from_translation(DVec3::new(0.5, 0.5, 0.9)) * shear * DMat4::from_scale(DVec3::new(0.3, -0.35, 0.3)),
    ]
}

/// A floor, and a ball and a leaf of `material` at each of [`places`], under the studio.
fn scene(material: impl FnOnce(&mut SceneBuilder) -> Material) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let floor = builder.add_material(scenes::lambert(0.5));
    add_mesh(&mut builder, flat_quad(3.0, floor));
    let made = material(&mut builder);
    let material = builder.add_material(made);
    let meshes = [smooth_sphere(10, 16, material), flat_quad(1.3, material)].map(|mesh| builder.add_mesh(mesh));
    for world_from_object in places() {
        for mesh in meshes {
            builder.add_instance(Instance { mesh, world_from_object, name: String::from("thing") });
        }
    }
    scenes::add_camera(&mut builder, DVec3::new(0.3, 2.2, 4.0), DVec3::new(0.0, 0.4, 0.0), 0.8);
    builder.finish()
}

fn picture(scene: &Scene, settings: &RenderSettings, choice: Choice) -> Vec<[f32; 3]> {
    let ready = prepare_placing(scene, settings, choice).expect("a small scene");
    let expected = if choice == Choice::Never { 0 } else { 5 };
    assert_eq!(ready.tables.placements.len(), expected, "the floor and four pairs");
    let frame = render_prepared(scene, ready, 0, settings, &Progress::default()).expect("a picture");
    assert_eq!(frame.stats.non_finite_samples, 0);
    frame.pixels
}

fn small(accel: AccelChoice) -> RenderSettings {
    let size = if accel == AccelChoice::Linear { 20 } else { 40 };
    RenderSettings { accel, ..settings(size, 4, 7) }
}

/// Asserts that pictures of `scene`, merged and placed, are the same to rounding: a path that rounding sends another way
/// is another path from there on, so a few pixels may differ; 3 % here, where a single path in 50 000 spoils a pixel of 4
/// samples of some 5 vertices with two rays.
fn assert_placed_like_merged(what: &str, scene: &Scene) {
    for accel in backends() {
        let [merged, placed] = [Choice::Never, Choice::Always].map(|choice| picture(scene, &small(accel), choice));
        let close = |(p, q): &(&[f32; 3], &[f32; 3])| {
            let size = p.iter().chain(*q).fold(0.0_f32, |m, x| m.max(x.abs()));
            (0..3).all(|c| (p[c] - q[c]).abs() <= 1e-3 * size)
        };
        let astray = merged.iter().zip(&placed).filter(|pair| !close(pair)).count();
        println!("{what}, {accel:?}: {astray} of {} pixels differ", merged.len());
        assert!(merged.iter().flatten().any(|&x| x > 0.1), "{what}: dark");
        assert!(astray * 100 <= 3 * merged.len(), "{what}, {accel:?}: {astray} of {} pixels differ", merged.len());
    }
}

#[test]
fn inst_01_pictures_of_placed_meshes_are_those_of_merged_ones() {
    assert_placed_like_merged("diffuse", &scene(|_| scenes::lambert(0.7)));
    assert_placed_like_merged("metal", &scene(|_| scenes::white_metal(0.3)));
}

#[test]
fn inst_01_placed_normal_maps_look_like_merged_ones_also_where_they_are_mirrored() {
    let mapped = |builder: &mut SceneBuilder| {
        let texels = (0..64).map(|i| normal_texel(25.0, f64::from(i) * 0.7)).collect();
        let texture = add_texture(builder, 8, texels, Filter::Bilinear);
        let mut material = scenes::white_dielectric(0.4);
        material.normal = Param { factor: 1.0, texture: Some(texture) };
        material
    };
    let mut scene = scene(mapped);
    // The balls get tangents along their circles of latitude.
    for mesh in scene.meshes.iter_mut().map(std::sync::Arc::make_mut).filter(|mesh| mesh.tangents.is_none()) {
        let tangent = |n: &[f32; 3]| match Vec3::new(n[2], 0.0, -n[0]).try_normalize() {
            Some(t) => [t.x, t.y, t.z, 1.0],
            None => [1.0, 0.0, 0.0, 1.0],
        };
        mesh.tangents = mesh.normals.as_ref().map(|normals| normals.iter().map(tangent).collect());
    }
    assert!(scene.meshes.iter().all(|mesh| mesh.tangents.is_some()));
    assert_placed_like_merged("normal map", &scene);
}

#[test]
fn placed_surfaces_show_the_side_that_merged_ones_show() {
    // Camera rays pass what they see from behind: a mirrored mesh must not turn inside out.
    let scene = scene(|_| Material { double_sided: false, ..scenes::lambert(0.7) });
    for accel in backends() {
        let culled = RenderSettings { cull_backfaces: true, max_bounces: Some(0), ..small(accel) };
        let [merged, placed] = [Choice::Never, Choice::Always].map(|choice| picture(&scene, &culled, choice));
        let differ = merged.iter().zip(&placed).filter(|(p, q)| (p[1] - q[1]).abs() > 1e-3 * p[1].max(q[1])).count();
        assert!(differ * 100 <= 3 * merged.len(), "{accel:?}: {differ} of {} pixels", merged.len());
    }
    // Both sides emit nothing but reflect: a two-sided material is lit from both.
    assert_placed_like_merged("two-sided", &self::scene(|_| Material { double_sided: true, ..scenes::lambert(0.7) }));
}

// 24 seeds of 16 samples; the difference of the means of 24 pictures in units of its standard error: |z| < 4 fails a sound
// renderer once in 16 000 changes of the random numbers.
#[test]
fn placed_surfaces_that_are_partly_there_are_so_on_average() {
    let scene = scene(|_| {
        let mut material = scenes::lambert(0.8);
        (material.alpha_mode, material.opacity.factor) = (AlphaMode::Blend, 0.4);
        material
    });
    let mean = |choice: Choice, seed: u64| {
        let settings = RenderSettings { seed, spp: 16, ..small(AccelChoice::Auto) };
        let pixels = picture(&scene, &RenderSettings { width: 24, height: 24, ..settings }, choice);
        pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / pixels.len() as f64
    };
    let runs = |choice: Choice, from: u64| -> Vec<f64> { (from..from + 24).map(|seed| mean(choice, seed)).collect() };
    let (merged, placed) = (runs(Choice::Never, 0), runs(Choice::Always, 100));
    let average = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let variance =
        |v: &[f64]| v.iter().map(|x| (x - average(v)).powi(2)).sum::<f64>() / (v.len() * (v.len() - 1)) as f64;
    let z = (average(&merged) - average(&placed)) / (variance(&merged) + variance(&placed)).sqrt();
    println!("merged {}, placed {}: z = {z:.2}", average(&merged), average(&placed));
    assert!(z.abs() < 4.0, "merged {}, placed {}: z = {z:.2}", average(&merged), average(&placed));
    // What one instance lets pass another one stops: holes do not repeat.
    assert!((average(&merged) / average(&placed) - 1.0).abs() < 0.01);
}

#[test]
fn number_of_threads_changes_no_bit_of_placed_meshes() {
    let scene = scene(|_| scenes::white_metal(0.3));
    for accel in [AccelChoice::Auto, AccelChoice::Bvh] {
        let with = |threads: usize| {
            let pixels =
                pool(Some(threads)).expect("threads").install(|| picture(&scene, &small(accel), Choice::Always));
            pixels.into_iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>()
        };
        let alone = with(1);
        assert!(alone == with(2) && alone == with(5), "{accel:?}");
    }
}

/// How many of the rays that leave `points` points of a placed mesh meet the mesh again: to both sides of single
/// triangles, to the outside only of a convex mesh. Also the longest offset over that of the same triangle merged.
fn self_hits(
    mesh: &Mesh,
    place: DMat4,
    accel: AccelChoice,
    points: usize,
    convex: bool,
    rng: &mut Rng,
) -> (usize, usize, f64) {
    const DIRECTIONS: usize = 25;
    let scene = prepared::one_instance(mesh, place);
    let ready = prepared_as(&scene, accel, Choice::Always);
    assert_eq!(ready.tables.placements.len(), 1);
    let targets: Vec<(u32, u32, f32, f32)> = (0..points)
        .map(|_| {
            let (u, v) = (rng.unit(), rng.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            (1, rng.below(mesh.indices.len()) as u32, u, v)
        })
        .collect();
    let reach = scene.meshes[0]
        .positions
        .iter()
        .map(|p| (place.transform_point3(Vec3::from(*p).as_dvec3()) - ready.origin).abs().max_element());
    let reach = reach.fold(0.0, f64::max);
    let (mut rays, mut from, mut longest) = (Vec::new(), Vec::new(), 0.0_f64);
    for seen in prepared::read_placed(&ready, &targets) {
        longest = longest.max(seen.offset / (16.0 * f64::from(f32::EPSILON) * reach));
        for k in 0..DIRECTIONS {
            let side = if convex || k % 2 == 0 { 1.0 } else { -1.0 };
            let n = side as f32 * seen.ng.as_vec3();
            let d = rng.direction();
            let cos = d.dot(n);
            // A third of them grazing.
            let up = cos.abs() * if k % 10 < 3 { 1e-3 } else { 1.0 };
            let d = (d - n * cos + n * up).normalize();
            // As `robust::offset_point`.
            let moved = seen.point.as_vec3() + n * seen.offset as f32;
            let start = moved + (moved.abs() * 1.25e-7) * n.signum();
            rays.push((start, d));
            from.push(seen.primitive);
        }
    }
    let mut batch = RayBatch::new(rays.len());
    for (i, &(origin, direction)) in rays.iter().enumerate() {
        batch.set(i, origin, direction, f32::INFINITY);
    }
    let mut hits = HitBatch::new(rays.len());
    ready.accel.intersect(&batch, 0..rays.len(), false, &mut hits);
    let again = |i: &usize| hits.primitive[*i] != MISS && (convex || hits.primitive[*i] == from[*i]);
    ((0..rays.len()).filter(again).count(), rays.len(), longest)
}

// 14 placements, positions from 1e-3 to 1e4 of them; seed 11.
#[test]
fn self_01_rays_that_leave_a_placed_surface_do_not_meet_it_again() {
    let mut rng = Rng::new(11);
    let soup = meshes::random_soup(400, 0.3, 1.0, Vec3::ZERO, &mut rng);
    let soup = prepared::mesh(soup.positions, soup.indices);
    let ball = smooth_sphere(24, 48, MaterialId(0));
    let ball = prepared::mesh(ball.positions, ball.indices);
    let turn = DQuat::from_rotation_y(0.8) * DQuat::from_rotation_x(-0.4);
    let mut places = Vec::new();
    for scale in [
        DVec3::splat(1e-3),
        DVec3::splat(0.57),
        DVec3::splat(1e4),
        DVec3::new(1.0, 2.0, 3.0),
        DVec3::new(-1.0, 1.0, 0.2),
    ] {
        for distance in [0.0, 30.0] {
            let at = distance * scale.abs().max_element() * DVec3::new(1.0, 0.3, -0.7);
            places.push(DMat4::from_scale_rotation_translation(scale, turn, at));
        }
    }
    places.push(DMat4::from_scale(DVec3::new(1.0, 3.0, 0.5)) * DMat4::from_quat(turn));
    for accel in backends() {
        let (mut hits, mut rays) = (0, 0);
        for &place in &places {
            let points = if accel == AccelChoice::Linear { 20 } else { 800 };
            let (again, of, longest) = self_hits(&ball, place, accel, points, true, &mut rng);
            assert_eq!(again, 0, "{accel:?}: {again} of {of} rays re-enter the ball at {place}");
            // SELF-01: at most 4 times the bound of a surface at rest. Placing may take a little more.
            assert!(longest <= 8.0, "{longest} at {place}");
            let (again, of, _) = self_hits(&soup, place, accel, points, false, &mut rng);
            (hits, rays) = (hits + again, rays + of);
        }
        println!("{accel:?}: {hits} of {rays} rays met the triangle that they left");
        assert!(hits as f64 <= (1e-5 * rays as f64).max(0.5), "{accel:?}: {hits} of {rays}");
    }
}

/// `mesh` of `material` at `n` places in a row.
fn row(material: Material, meshes: usize, n: usize) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(material);
    let ids: Vec<_> = (0..meshes).map(|_| builder.add_mesh(smooth_sphere(40, 100, material))).collect();
    for i in 0..n {
        let world_from_object =
            DMat4::from_translation(DVec3::new(3.0 * (i % 100) as f64, 0.0, 3.0 * (i / 100) as f64));
        for &mesh in &ids {
            builder.add_instance(Instance { mesh, world_from_object, name: String::from("ball") });
        }
    }
    builder.finish()
}

fn considered(scene: &Scene) -> prt::render::PlacedReport {
    prepared_as(scene, AccelChoice::Linear, Choice::Auto).placed
}

#[test]
fn meshes_with_the_same_places_are_one_object_and_are_told_once() {
    // 2 x 7800 triangles x 4000.
    let scene = row(Material::default(), 2, 4000);
    let placed = considered(&scene);
    assert_eq!((placed.instances, placed.stored, placed.triangles), (4000, 15_600, 62_400_000));
    let [told] = &placed.considered[..] else { panic!("{placed:?}") };
    assert_eq!((told.meshes, told.triangles, told.instances, told.placed), (2, 15_600, 4000, 4000));
    assert!(told.merge_seconds > told.place_seconds && told.why.starts_with("merging"), "{told:?}");
    let ready = prepared_as(&scene, AccelChoice::Linear, Choice::Auto);
    assert_eq!(ready.bounds, Some((DVec3::new(-1.0, -1.0, -1.0), DVec3::new(298.0, 1.0, 118.0))));
}

#[test]
fn a_few_instances_are_merged_and_lamps_are_always() {
    let few = considered(&row(Material::default(), 1, 3));
    assert_eq!((few.instances, few.stored, few.triangles), (0, 23_400, 23_400));
    assert!(few.considered[0].placed == 0 && few.considered[0].why.starts_with("placing"), "{few:?}");
    let lamps = row(scenes::lamp(0.0, 5.0), 1, 3);
    let ready = prepared_as(&lamps, AccelChoice::Linear, Choice::Always);
    let lights = &ready.tables.lights;
    assert_eq!((ready.placed.instances, lights.len(), lights.emissive_triangles()), (0, 3, 23_400));
    assert!(ready.placed.considered[0].why.contains("emits light"));
}

#[test]
fn surfaces_count_alike_placed_and_merged_where_it_is_decided_about_the_studio() {
    let mut scene = row(scenes::lambert(0.5), 1, 3);
    for (instance, scale) in scene.instances.iter_mut().zip([0.5, 2.0, -3.0]) {
        instance.world_from_object *= DMat4::from_scale(DVec3::splat(scale));
    }
    let lamp = scenes::lamp(0.0, 5.0);
    scene.materials.push(lamp);
    scene.meshes.push(flat_quad(0.5, MaterialId(1)).into());
    let mesh = prt::scene::MeshId(1);
    scene.instances.push(Instance { mesh, world_from_object: DMat4::IDENTITY, name: String::from("lamp") });
    let [merged, placed] = [Choice::Never, Choice::Always]
        .map(|choice| prepared_as(&scene, AccelChoice::Linear, choice).default_light.emitted);
    assert!(merged.by_lamps > 0.0 && (placed.by_lamps / merged.by_lamps - 1.0).abs() < 1e-5, "{merged:?} {placed:?}");
    assert!((placed.glowing / merged.glowing - 1.0).abs() < 1e-5, "{merged:?} {placed:?}");
}

#[test]
fn what_is_far_from_its_own_origin_keeps_its_digits_when_placed() {
    // Modelled 10 km away and brought back by its node.
    let mut ball = smooth_sphere(16, 24, MaterialId(0));
    let far = Vec3::new(8192.0, 0.0, -8192.0);
    for p in &mut ball.positions {
        *p = (Vec3::from(*p) + far).to_array();
    }
    let scene = prepared::one_instance(&ball, DMat4::from_translation(-far.as_dvec3()));
    let ready = prepared_as(&scene, AccelChoice::Linear, Choice::Always);
    assert_eq!(ready.tables.placements.len(), 1);
    let rays: Vec<_> = (0..200).map(|i| (DVec3::new(0.0, 0.002 * f64::from(i), 5.0), -DVec3::Z)).collect();
    let seen: Vec<_> = trace(&ready, &rays).into_iter().flatten().collect();
    assert!(seen.len() > 150);
    assert!(seen.iter().all(|seen| seen.offset < 1e-5 && (seen.point + ready.origin).length() < 1.001));
}
