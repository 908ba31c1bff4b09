//! Spatial splits of the in-house BVH: triangles in several leaves are hit as if they were in one, by the same bits as
//! brute force; no part gets lost; the budget is kept; splits are taken where they pay.
//!
//! Test names carry the IDs of the stress-test catalogue. Seeds are fixed.

#[path = "support/meshes.rs"]
mod meshes;
#[path = "support/rng.rs"]
mod rng;

use glam::{Quat, Vec3};
use meshes::{batch, random_soup, slivers, soup, sphere};
use prt::accel::geometry::{Candidate, Geometry, HitFilter, Object, Part};
use prt::accel::linear::Linear;
use prt::accel::wide::{SpatialSplits, WideBvh};
use prt::accel::{Accel, HitBatch, MISS, RayBatch, Triangles};
use rng::Rng;
use simd::Level;
use std::sync::Arc;

const INF: f32 = f32::INFINITY;
type Ray = (Vec3, Vec3, f32);
type Hit = (u32, [u32; 3], u8);

/// The tree with splits, sound and with at least `least` of them for every triangle.
fn split(level: Level, mesh: &Triangles, least: f64) -> WideBvh {
    let bvh = WideBvh::with_splits(mesh, level, SpatialSplits::Always);
    bvh.validate(mesh).expect("a sound tree");
    let share = bvh.stats().splits as f64 / mesh.indices.len() as f64;
    assert!((least..=0.5).contains(&share), "{share} splits for every triangle");
    bvh
}

/// Nearest hits as (primitive, t, u, v by bits, occluded), the same with and without the coherent hint.
fn trace(accel: &dyn Accel, rays: &RayBatch, n: usize) -> Vec<Hit> {
    let (mut hits, mut coherent, mut occluded) = (HitBatch::new(n), HitBatch::new(n), vec![2; n]);
    accel.intersect(rays, 0..n, false, &mut hits);
    accel.intersect(rays, 0..n, true, &mut coherent);
    accel.occluded(rays, n, &mut occluded);
    let bits = |hits: &HitBatch, i: usize| (hits.primitive[i], [hits.t[i], hits.u[i], hits.v[i]].map(f32::to_bits));
    let hit = |i: usize| {
        let (primitive, numbers) = bits(&hits, i);
        assert_eq!(bits(&coherent, i), (primitive, numbers), "the coherent hint changes ray {i}");
        assert_eq!(occluded[i] == 1, primitive != MISS, "occluded and intersect disagree about ray {i}");
        (primitive, numbers, occluded[i])
    };
    (0..n).map(hit).collect()
}

/// Brute force's hits, after checking that trees with splits find the same bits at every level.
fn agreed(what: &str, mesh: &Triangles, least: f64, rays: &[Ray]) -> Vec<Hit> {
    let rays_in = batch(rays);
    let expected = trace(&Linear::new(mesh.clone()), &rays_in, rays.len());
    let levels = [Level::Portable8, Level::Scalar, Level::Avx2, Level::Avx512];
    for level in levels.into_iter().filter(|level| level.is_available()) {
        let found = trace(&split(level, mesh, least), &rays_in, rays.len());
        for i in 0..rays.len() {
            assert_eq!(found[i], expected[i], "{what}, {}: ray {i}, {:?}", level.name(), rays[i]);
        }
    }
    expected
}

/// A beam of 12 triangles, whatever its length.
fn beam(mesh: &mut Triangles, start: Vec3, stop: Vec3, width: f32) {
    let first = mesh.positions.len() as u32;
    let side = (stop - start).cross(Vec3::new(0.3, 0.2, 1.0)).normalize() * width;
    let over = (stop - start).cross(side).normalize() * width;
    for k in 0..8 {
        let sign = |bit: u32| if k >> bit & 1 == 1 { 0.5 } else { -0.5 };
        let p = if k & 4 == 0 { start } else { stop } + side * sign(0) + over * sign(1);
        mesh.positions.push(p.to_array());
    }
    for [a, b, c, d] in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        mesh.indices.extend([[a, b, c], [a, c, d]].map(|t| t.map(|i: u32| i + first)));
    }
}

/// Rafters, stairs and wires in the cube [-1, 1]^3 that stand askew.
fn timber(rng: &mut Rng) -> Triangles {
    let turn = Quat::from_euler(glam::EulerRot::YXZ, 0.6, 0.2, 0.3);
    let mut mesh = Triangles::default();
    for i in 0..12 {
        let z = i as f32 / 6.0 - 1.0;
        for x in [-1.0, 1.0] {
            beam(&mut mesh, turn * Vec3::new(x, 0.0, z), turn * Vec3::new(0.0, 1.0, z), 0.03);
            beam(&mut mesh, turn * Vec3::new(x, -1.0, z), turn * Vec3::new(-x, 0.0, z + 0.2), 0.02);
        }
    }
    for i in 0..30 {
        let (y, z) = (i as f32 / 15.0 - 1.0, i as f32 / 15.0 - 1.0);
        beam(&mut mesh, turn * Vec3::new(-0.3, y, z), turn * Vec3::new(0.3, y, z), 0.05);
    }
    for _ in 0..60 {
        beam(&mut mesh, rng.cube(), rng.cube(), 0.002);
    }
    mesh
}

/// Random rays, rays at corners and points of edges, and rays in and through the planes of cuts, which halve the box of
/// the mesh again and again.
fn rays(mesh: &Triangles, n: usize, rng: &mut Rng) -> Vec<Ray> {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for p in mesh.positions_in_use() {
        (low, high) = (low.min(p), high.max(p));
    }
    let (edge, middle) = ((high - low).max_element(), 0.5 * (low + high));
    let mut rays = Vec::new();
    while rays.len() < n {
        let origin = middle + rng.direction() * edge;
        let corners = mesh.corners(rng.below(mesh.indices.len()));
        let k = rng.below(3);
        let on_edge = corners[k] + (corners[(k + 1) % 3] - corners[k]) * rng.unit();
        let t_max = if rng.below(4) == 0 { rng.range(0.5, 1.5) } else { INF };
        for target in [middle + rng.cube() * 0.5 * edge, corners[k], on_edge] {
            rays.push((origin, target - origin, t_max));
        }
        let axis = rng.below(3);
        let at = low[axis] + edge * rng.below(16) as f32 / 16.0;
        let (mut from, mut to) = (origin, on_edge);
        from[axis] = at;
        rays.push((from, to - from, t_max));
        to[axis] = at;
        rays.push((from, to - from, t_max));
        let mut along = Vec3::ZERO;
        along[(axis + 1) % 3] = 1.0;
        rays.push((from - along * 2.0 * edge, along, INF));
    }
    rays
}

#[test]
fn bvh01_diagonal_beams_with_splits_are_hit_as_by_brute_force() {
    let mut rng = Rng::new(41);
    let mesh = timber(&mut rng);
    for (s, shift) in [(1.0, Vec3::ZERO), (1e-6, Vec3::ZERO), (1e6, Vec3::ZERO), (1.0, Vec3::new(1234.0, -99.0, 517.0))]
    {
        let mesh = meshes::placed(&mesh, s, shift);
        let hits = agreed(&format!("s {s}, T {shift}"), &mesh, 0.4, &rays(&mesh, 2000, &mut rng));
        assert!(hits.iter().filter(|hit| hit.0 != MISS).count() > 700);
    }
}

#[test]
fn bvh01_soups_and_slivers_with_splits_are_hit_as_by_brute_force() {
    let mut rng = Rng::new(42);
    let soup = random_soup(400, 0.8, 1.0, Vec3::ZERO, &mut rng);
    agreed("soup", &soup, 0.2, &rays(&soup, 3000, &mut rng));
    let slivers = slivers(400, 1e-2, &mut rng);
    agreed("slivers", &slivers, 0.3, &rays(&slivers, 3000, &mut rng));
}

#[test]
fn geo01_no_ray_leaves_a_closed_mesh_of_spikes_with_splits() {
    let mut rng = Rng::new(43);
    let mesh = sphere(16, 16, || if rng.below(3) == 0 { 30.0 } else { 1.0 + rng.unit() });
    let rays: Vec<Ray> = (0..4500)
        .map(|i| {
            let corners = mesh.corners(rng.below(mesh.indices.len()));
            let k = rng.below(3);
            let edge = corners[k] + (corners[(k + 1) % 3] - corners[k]) * rng.unit();
            let origin = rng.direction() * 0.3;
            (origin, [rng.direction(), corners[k] - origin, edge - origin][i % 3], INF)
        })
        .filter(|ray| ray.1 != Vec3::ZERO)
        .collect();
    let missed = agreed("spikes", &mesh, 0.4, &rays).iter().filter(|hit| hit.0 == MISS).count();
    assert_eq!(missed, 0, "{missed} of {} rays leaked", rays.len());
}

#[test]
fn bvh06_coplanar_triangles_at_the_numbers_of_embrees_regression_lose_no_part() {
    let numbers = [25.6f32, 57.600_002, 34.0, -6.400_002_4];
    let point = |k: usize| Vec3::new(numbers[k & 3], numbers[k >> 2 & 3], 2.5);
    let mut rng = Rng::new(44);
    let flat = soup((0..600).map(|_| [0; 3].map(|_| point(rng.below(16)))));
    // The plane itself turned, since triangles along an axis are not worth a cut.
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.7, 0.6, 0.2);
    let positions = flat.positions.iter().map(|&p| (turn * Vec3::from_array(p)).to_array()).collect();
    let turned = Triangles { positions, indices: flat.indices.clone() };
    for (what, mesh, least) in [("flat", flat, 0.0), ("turned", turned, 0.05)] {
        let hits = agreed(what, &mesh, least, &rays(&mesh, 2500, &mut rng));
        assert!(hits.iter().filter(|hit| hit.0 != MISS).count() > 500);
    }
}

#[test]
fn bvh04_overlapping_diagonals_stay_within_the_budget() {
    // All through one point and along one diagonal: no cut parts them.
    let n = 1 << 14;
    let mut rng = Rng::new(45);
    let mesh = soup((0..n).map(|i| {
        let (side, s) = (rng.direction() * 1e-2, 1.0 + i as f32 * 1e-5);
        [Vec3::splat(-s), Vec3::splat(s), side]
    }));
    let plain = WideBvh::with_splits(&mesh, Level::best(), SpatialSplits::Never);
    let bvh = split(Level::best(), &mesh, 0.4);
    let (bytes, plain) = (bvh.stats().bytes as f64, plain.stats().bytes as f64);
    assert!(bytes < 1.7 * plain, "{bytes} bytes against {plain}");
    // Collinear, from end to end of a diagonal.
    let mesh = soup((0..n).map(|i| {
        let (a, b) = (i as f32, (i + 1) as f32);
        [Vec3::splat(a), Vec3::splat(b), Vec3::new(a, b, a + 1e-3)]
    }));
    let bvh = split(Level::best(), &mesh, 0.0);
    let rays = batch(&[(Vec3::new(100.5, 0.0, 100.2), Vec3::Y, INF), (Vec3::splat(-1.0), Vec3::ONE, INF)]);
    assert_eq!(trace(&bvh, &rays, 2), trace(&Linear::new(mesh), &rays, 2));
}

#[test]
fn splits_are_taken_where_they_pay_and_nowhere_else() {
    let mut rng = Rng::new(46);
    let mut timber = Triangles::default();
    for _ in 0..40 {
        let more = self::timber(&mut rng);
        let first = timber.positions.len() as u32;
        timber.positions.extend(more.positions);
        timber.indices.extend(more.indices.iter().map(|t| t.map(|i| i + first)));
    }
    let splits = |mesh: &Triangles| WideBvh::build(mesh).stats().splits;
    let taken = splits(&timber);
    assert!(taken > timber.indices.len() * 2 / 5, "{taken} splits in {}", timber.indices.len());
    assert_eq!(splits(&sphere(60, 60, || 1.0)), 0);
    assert_eq!(splits(&random_soup(20_000, 0.02, 1.0, Vec3::ZERO, &mut rng)), 0);
    // Large enough for several tasks of every kind.
    let fingerprint = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| WideBvh::build(&timber)).fingerprint()
    };
    assert_eq!(fingerprint(3), fingerprint(1), "the tree depends on the number of threads");
}

/// Stops a third of all rays at a triangle, by its number alone.
struct Third;

impl HitFilter for Third {
    fn stops(&self, candidate: &Candidate) -> bool {
        (candidate.key ^ candidate.primitive.wrapping_mul(0x9e37_79b9)).wrapping_mul(0x85eb_ca6b).is_multiple_of(3)
    }
}

#[test]
fn filters_that_are_asked_twice_about_a_split_triangle_change_no_hit() {
    let mut rng = Rng::new(47);
    let mesh = timber(&mut rng);
    let rays = rays(&mesh, 2500, &mut rng);
    let mut rays_in = batch(&rays);
    for i in 0..rays.len() {
        rays_in.key[i] = rng.bits();
    }
    let part = Part { triangles: mesh, filtered: true, ..Part::default() };
    let world = Object { parts: vec![part], shapes: Vec::new() };
    let geometry = Geometry { world, filter: Some(Arc::new(Third)), ..Geometry::default() };
    let bvh = WideBvh::with_splits(geometry.clone(), Level::best(), SpatialSplits::Always);
    assert!(bvh.stats().splits > 0);
    assert!(trace(&bvh, &rays_in, rays.len()) == trace(&Linear::new(geometry), &rays_in, rays.len()));
}
