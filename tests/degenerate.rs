//! Geometry that no one should write and exporters do: GEO-05 and GEO-06 of the numerics plan, for whole scenes. (For
//! rays and backends alone: tests/accel_agreement.rs.)

#[path = "support/prepared.rs"]
mod prepared;
#[path = "support/rng.rs"]
mod rng;

use glam::{DMat4, DVec3, Vec3};
use prepared::{mesh, one_instance, prepared, read, scene_of, trace};
use prt::camera::{Camera, Lens, Projection};
use prt::material::Material;
use prt::render::{AccelChoice, Frame, Progress, RenderSettings, render};
use prt::scene::Scene;
use prt::shape::Mesh;
use prt::texture::Param;
use rng::Rng;

/// Separate random triangles in the cube [-1, 1]^3.
fn valid(n: usize, rng: &mut Rng) -> Vec<[[f32; 3]; 3]> {
    (0..n)
        .map(|_| {
            let centre = rng.cube();
            [0; 3].map(|_| (centre + 0.1 * rng.cube()).to_array())
        })
        .collect()
}

fn mesh_of(triangles: &[[[f32; 3]; 3]]) -> Mesh {
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    mesh(triangles.as_flattened().to_vec(), indices)
}

/// `extra` among `triangles`, one after every `every`.
fn mixed(triangles: &[[[f32; 3]; 3]], extra: &[[[f32; 3]; 3]], every: usize) -> Vec<[[f32; 3]; 3]> {
    let mut all = Vec::new();
    for (i, triangle) in triangles.iter().enumerate() {
        all.push(*triangle);
        if i % every == 0 {
            all.push(extra[i / every % extra.len()]);
        }
    }
    all
}

fn lamp() -> Material {
    Material { emission: Param::constant([1.0; 3]), ..Material::default() }
}

fn rays(n: usize, rng: &mut Rng) -> Vec<(DVec3, DVec3)> {
    (0..n).map(|_| (2.0 * rng.direction().as_dvec3(), rng.cube().as_dvec3())).map(|(o, p)| (o, p - o)).collect()
}

/// 32 x 32 pixels of 4 samples from in front, over the scene's own cameras.
fn picture(scene: &mut Scene) -> Frame {
    scene.cameras = vec![Camera {
        name: String::new(),
        world_from_camera: DMat4::from_translation(DVec3::Z * 4.0),
        projection: Projection::Perspective { yfov: 0.7, aspect_ratio: None },
        lens: Lens::default(),
    }];
    settings_render(scene)
}

fn settings_render(scene: &Scene) -> Frame {
    let settings =
        RenderSettings { width: 32, height: 32, spp: 4, accel: AccelChoice::Bvh, ..RenderSettings::default() };
    render(scene, 0, &settings, &Progress::default()).expect("a render")
}

fn count_in(warnings: &[String], what: &str) -> usize {
    let found = warnings.iter().find(|w| w.contains(what));
    found.map_or(0, |w| w.split(' ').next().and_then(|n| n.parse().ok()).expect("a count"))
}

// 1e4 triangles and 1e3 degenerate ones, 1e5 rays, seed 6.
#[test]
fn geo_05_triangles_without_area_change_no_hit_and_no_light() {
    let mut rng = Rng::new(6);
    let good = valid(10_000, &mut rng);
    let (p, q) = ([0.1, 0.2, 0.3], [0.4, 0.4, 0.4]);
    let e = |x: f32, y: f32| [x, y, 0.0];
    let without_area = [[p, p, q], [p, q, q], [p, p, p], [q, p, q], [e(0.0, 0.0), e(0.5, 0.25), e(1.0, 0.5)]];
    let mut clean = scene_of(&mesh_of(&good), lamp(), &[DMat4::IDENTITY]);
    let mut dirty = scene_of(&mesh_of(&mixed(&good, &without_area, 10)), lamp(), &[DMat4::IDENTITY]);
    assert_eq!(count_in(&dirty.warnings, "without area"), 1000);
    let (a, b) = (prepared(&clean), prepared(&dirty));
    let rays = rays(100_000, &mut rng);
    let mut hits = 0;
    for (x, y) in trace(&a, &rays).into_iter().zip(trace(&b, &rays)) {
        let key = |s: prepared::Seen| (s.primitive, s.point, s.ng, s.light_density);
        hits += usize::from(x.is_some());
        assert_eq!(x.map(key), y.map(key));
    }
    assert!(hits > 10_000, "{hits} hits");
    // No two touch, so each is a light of its own: every point of it has the density 1 / area.
    let all: Vec<_> = (0..10_000).map(|i| (i, 0.0, 0.0)).collect();
    for (seen, t) in read(&b, &all).into_iter().zip(&good) {
        let [a, b, c] = t.map(|p| Vec3::from(p).as_dvec3());
        let area = 0.5 * (b - a).cross(c - a).length();
        assert!((seen.light_density * area - 1.0).abs() < 1e-5, "{} for {area}", 1.0 / seen.light_density);
    }
    let (clean, dirty) = (picture(&mut clean), picture(&mut dirty));
    assert_eq!(clean.pixels, dirty.pixels, "the pictures are the same");
    assert_eq!(dirty.stats.non_finite_samples, 0);
}

#[test]
fn geo_05_slivers_and_tiny_triangles_have_unit_normals_and_finite_densities() {
    let mut rng = Rng::new(7);
    let mut bad: Vec<[[f32; 3]; 3]> = Vec::new();
    for _ in 0..400 {
        let (at, along, across) = (rng.cube(), rng.direction(), rng.direction());
        // Aspect 1e8, which near the origin is still a triangle in f32.
        bad.push([Vec3::ZERO, along, 1e-8 * across].map(|p| p.to_array()));
        // Edges of 1e-10 (their product underflows in f32), and areas of 1e-30 and 1e-42.
        for edge in [1e-10, 1e-15, 1e-21] {
            bad.push([Vec3::ZERO, edge * along, edge * across].map(|p| p.to_array()));
        }
        // A third corner that is an ulp off the line of the two others.
        let end = at + along;
        bad.push([at, end, Vec3::new(end.x.next_up(), end.y, end.z)].map(|p| p.to_array()));
    }
    // Bounds about the origin, so that recentring leaves the tiny ones their digits.
    bad.extend([-2.0, 2.0].map(|s| [[s, s, s], [0.0, s, s], [s, 0.0, s]]));
    let mut scene = scene_of(&mesh_of(&mixed(&valid(bad.len(), &mut rng), &bad, 1)), lamp(), &[DMat4::IDENTITY]);
    let ready = prepared(&scene);
    let n = ready.tables.triangles.len() as u32;
    // What is left out is on a line: a third corner moved along it.
    assert!(n > 3900 && n as usize == scene.triangle_count(), "{n} of 4004 are left: {:?}", ready.warnings);
    assert_eq!(ready.origin, DVec3::ZERO);
    for seen in read(&ready, &(0..n).map(|i| (i, 0.3, 0.3)).collect::<Vec<_>>()) {
        assert!((seen.ng.length() - 1.0).abs() < 1e-6 && seen.point.is_finite(), "{seen:?}");
        // Nothing was dropped once placed and the origin stayed, so corners are as written and f64 has their normal.
        let mesh = &scene.meshes[0];
        let [a, b, c] =
            mesh.indices[seen.primitive as usize].map(|i| Vec3::from(mesh.positions[i as usize]).as_dvec3());
        let off = seen.ng.cross((b - a).cross(c - a).normalize()).length();
        assert!(off < 1e-6, "{off} rad: {a} {b} {c}");
        assert!(seen.light_density.is_finite() && seen.offset.is_finite() && seen.offset >= 0.0, "{seen:?}");
    }
    let frame = picture(&mut scene);
    assert_eq!(frame.stats.non_finite_samples, 0);
    assert!(frame.pixels.as_flattened().iter().all(|c| c.is_finite()));
}

#[test]
fn geo_05_a_lamp_too_small_for_a_density_in_f32_is_no_light_but_a_surface() {
    for (size, lights) in [(1.0, 1), (1e-15, 1), (1e-21, 0)] {
        let p = |x: f32, y: f32| [x * size, y * size, 0.0];
        let scene = scene_of(&mesh_of(&[[p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0)]]), lamp(), &[DMat4::IDENTITY]);
        let ready = prepared(&scene);
        assert_eq!((ready.tables.triangles.len(), ready.tables.lights.len()), (1, lights), "size {size:e}");
        assert!(read(&ready, &[(0, 0.3, 0.3)])[0].light_density.is_finite());
        let frame = settings_render(&scene);
        assert_eq!(frame.stats.non_finite_samples, 0);
        assert!(frame.pixels.as_flattened().iter().all(|c| c.is_finite()), "size {size:e}");
    }
}

// Every kind of unusable coordinate in every corner; seed 8.
#[test]
fn geo_06_unusable_vertices_drop_their_triangles_and_leave_the_picture() {
    let mut rng = Rng::new(8);
    let good = valid(2000, &mut rng);
    let mut bad = Vec::new();
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.9e19, -1.9e19, f32::MAX] {
        for corner in 0..9 {
            let mut triangle = valid(1, &mut rng)[0];
            triangle[corner / 3][corner % 3] = value;
            bad.push(triangle);
        }
    }
    let mut clean = scene_of(&mesh_of(&good), lamp(), &[DMat4::IDENTITY]);
    let mut dirty = scene_of(&mesh_of(&mixed(&good, &bad, 20)), lamp(), &[DMat4::IDENTITY]);
    assert_eq!(count_in(&dirty.warnings, "not finite or is beyond"), 100);
    assert_eq!(picture(&mut clean).pixels, picture(&mut dirty).pixels);
    // Denormal coordinates are as good as 0.
    let denormal = valid(1, &mut rng)[0].map(|[_, y, z]| [1e-40, y, z]);
    let scene = one_instance(&mesh_of(&[denormal]), DMat4::IDENTITY);
    assert!(scene.warnings.is_empty());
    let frame = settings_render(&scene);
    assert_eq!(frame.stats.non_finite_samples, 0);
}

#[test]
fn geo_06_what_a_node_moves_out_of_range_is_dropped_with_a_count_and_spoils_nothing() {
    let mut rng = Rng::new(9);
    let mesh = mesh_of(&valid(500, &mut rng));
    let near = DMat4::IDENTITY;
    for far in [
        DMat4::from_translation(DVec3::X * 1e30),
        DMat4::from_scale(DVec3::splat(1e25)),
        DMat4::from_scale(DVec3::splat(1e300)),
    ] {
        let mut clean = scene_of(&mesh, lamp(), &[near]);
        let mut dirty = scene_of(&mesh, lamp(), &[near, far]);
        let (clean, dirty) = (picture(&mut clean), picture(&mut dirty));
        assert_eq!(clean.pixels, dirty.pixels);
        assert_eq!(count_in(&dirty.stats.warnings, "once placed"), 500, "{:?}", dirty.stats.warnings);
    }
}

// 200 scenes of 256 triangles of random bits, seeds as Embree's own test takes them: neither panic nor non-finite sample,
// with the camera that frames whatever is left.
#[test]
fn geo_06_random_bits_render() {
    for i in 0..200_u64 {
        let mut rng = Rng::new(i * 23_565);
        let triangles: Vec<[[f32; 3]; 3]> =
            (0..256).map(|_| [0; 3].map(|_| [0; 3].map(|_| f32::from_bits(rng.bits())))).collect();
        let scene = scene_of(&mesh_of(&triangles), lamp(), &[DMat4::IDENTITY]);
        let settings = RenderSettings {
            width: 8,
            height: 8,
            spp: 1,
            threads: Some(1),
            accel: AccelChoice::Bvh,
            ..RenderSettings::default()
        };
        let frame = render(&scene, 0, &settings, &Progress::default()).expect("a render");
        assert!(frame.camera.world_from_camera.is_finite(), "seed {i}");
        assert!(frame.pixels.as_flattened().iter().all(|c| c.is_finite()), "seed {i}");
    }
}
