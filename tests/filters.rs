//! Filtered parts: every backend asks about the same crossings in the end, so all find the same hits; what is not
//! filtered is never asked about.
//!
//! BVH-01 with a filter. `bvh` and `linear` agree by bits; Embree rounds differently, so it may differ by t within 32 ulp
//! and in which of two triangles at that distance it names. Seeds are fixed.

#[path = "support/fronts.rs"]
mod fronts;
#[path = "support/meshes.rs"]
mod meshes;
#[path = "support/rng.rs"]
mod rng;

use glam::Vec3;
use meshes::{random_soup, soup};
use prt::accel::embree::EmbreeAccel;
use prt::accel::front::Split;
use prt::accel::geometry::{Candidate, Geometry, HitFilter, Object, Part, Primitives};
use prt::accel::linear::Linear;
use prt::accel::wide::WideBvh;
use prt::accel::{Accel, HitBatch, MISS, RayBatch, Triangles};
use rng::Rng;
use simd::Level;
use std::path::PathBuf;
use std::sync::Arc;

/// A third of all (ray, primitive) pairs stop, if at all then where u < `below`.
struct Third {
    below: f32,
    /// Primitives that may be asked about.
    known: Vec<u32>,
}

impl HitFilter for Third {
    fn stops(&self, candidate: &Candidate) -> bool {
        let &Candidate { key, instance, primitive, u, v } = candidate;
        assert!(instance == 0 && (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v), "{candidate:?}");
        assert!(self.known.binary_search(&primitive).is_ok(), "asked about {primitive}, which is not filtered");
        let mixed = (key ^ primitive.wrapping_mul(0x9e37_79b9)).wrapping_mul(0x85eb_ca6b);
        (mixed >> 16).is_multiple_of(3) && u < self.below
    }
}

/// Two parts of `triangles`, numbered in turn: those of `is_filtered` and the others.
fn split(triangles: &Triangles, is_filtered: impl Fn(usize) -> bool, below: f32) -> Geometry {
    let part = |filtered: bool| {
        let mine: Vec<usize> = (0..triangles.indices.len()).filter(|&i| is_filtered(i) == filtered).collect();
        let indices = mine.iter().map(|&i| triangles.indices[i]).collect();
        Part {
            triangles: Triangles { positions: triangles.positions.clone(), indices },
            primitives: Primitives::Each(mine.iter().map(|&i| i as u32).collect()),
            filtered,
            ..Part::default()
        }
    };
    let known = (0..triangles.indices.len()).filter(|&i| is_filtered(i)).map(|i| i as u32).collect();
    let world = Object { parts: vec![part(true), part(false)], shapes: Vec::new() };
    Geometry { world, filter: Some(Arc::new(Third { below, known })), ..Geometry::default() }
}

/// Everything but Embree, the oracle first.
fn backends(geometry: &Geometry) -> Vec<(String, Box<dyn Accel>)> {
    let mut all: Vec<(String, Box<dyn Accel>)> = vec![("linear".into(), Box::new(Linear::new(geometry.clone())))];
    let levels = [Level::Portable8, Level::Scalar, Level::Avx2, Level::Avx512];
    for level in levels.into_iter().filter(|level| level.is_available()) {
        all.push((level.name().into(), Box::new(WideBvh::with_level(geometry.clone(), level))));
        if let Some(front) = fronts::front(geometry.clone(), level) {
            all.push((format!("front {}", level.name()), Box::new(front)));
        }
    }
    all
}

/// Embree's, or a printed line.
fn embree(geometry: &Geometry) -> Option<EmbreeAccel> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".embree");
    let built = EmbreeAccel::build(geometry.clone(), &[folder]);
    built.map_err(|why| println!("skipped: no Embree library ({why})")).ok()
}

/// Nearest hits as (primitive, t, u, v) by bits; checks that the coherent hint changes nothing and that `occluded` agrees.
fn trace(name: &str, accel: &dyn Accel, rays: &RayBatch, n: usize, exactly: bool) -> Vec<(u32, [u32; 3])> {
    let (mut hits, mut coherent, mut occluded) = (HitBatch::new(n), HitBatch::new(n), vec![2; n]);
    accel.intersect(rays, 0..n, false, &mut hits);
    accel.intersect(rays, 0..n, true, &mut coherent);
    accel.occluded(rays, n, &mut occluded);
    let bits = |hits: &HitBatch, i: usize| (hits.primitive[i], [hits.t[i], hits.u[i], hits.v[i]].map(f32::to_bits));
    for (i, &is_occluded) in occluded.iter().enumerate() {
        assert_eq!(is_occluded == 1, hits.primitive[i] != MISS, "{name}: occluded and intersect differ for ray {i}");
        assert!(!exactly || bits(&coherent, i) == bits(&hits, i), "{name}: the coherent hint changes ray {i}");
    }
    (0..n).map(|i| bits(&hits, i)).collect()
}

/// Rays from around the cube [-1, 1]^3 through it, each with a key of its own; some end inside.
fn rays(n: usize, rng: &mut Rng) -> RayBatch {
    let mut rays = RayBatch::new(n);
    for i in 0..n {
        let (origin, target) = (rng.direction() * 3.0, rng.cube());
        let t_max = if i % 4 == 0 { rng.range(0.3, 1.2) } else { f32::INFINITY };
        rays.set(i, origin, target - origin, t_max);
        rays.key[i] = rng.bits();
    }
    rays
}

/// All backends on `geometry`; the oracle's hits.
fn agree(geometry: &Geometry, rays: &RayBatch, n: usize) -> Vec<(u32, [u32; 3])> {
    let backends = backends(geometry);
    let expected = trace("linear", &*backends[0].1, rays, n, true);
    for (name, accel) in &backends[1..] {
        for (i, (got, want)) in trace(name, &**accel, rays, n, true).iter().zip(&expected).enumerate() {
            assert_eq!(got, want, "{name}: ray {i}");
        }
    }
    if let Some(embree) = embree(geometry) {
        for (i, (got, want)) in trace("embree", &embree, rays, n, false).iter().zip(&expected).enumerate() {
            assert_eq!(got.0 == MISS, want.0 == MISS, "embree: hit and miss differ for ray {i}: {got:?}, {want:?}");
            let (got, want) = (f32::from_bits(got.1[0]), f32::from_bits(want.1[0]));
            assert!(got == want || (got - want).abs() <= 32.0 * f32::EPSILON * (want + 1.0), "{i}: {got}, {want}");
        }
    }
    expected
}

#[test]
fn bvh01_every_backend_finds_the_same_hits_on_filtered_and_other_parts() {
    let mut rng = Rng::new(31);
    let soup = random_soup(400, 0.5, 1.0, Vec3::ZERO, &mut rng);
    let rays = rays(5_000, &mut rng);
    for geometry in [split(&soup, |i| i % 3 != 0, 2.0), split(&soup, |_| true, 2.0), split(&soup, |_| false, 2.0)] {
        let hits = agree(&geometry, &rays, 5_000);
        let hit = hits.iter().filter(|hit| hit.0 != MISS).count();
        assert!((1_000..4_999).contains(&hit), "{hit}");
    }
}

#[test]
fn filters_may_depend_on_where_a_triangle_is_hit() {
    // Embree's u differs by rounding, so a ray may be decided otherwise at the border: not here, of 5,000.
    let mut rng = Rng::new(32);
    let soup = random_soup(300, 0.7, 1.0, Vec3::ZERO, &mut rng);
    let rays = rays(5_000, &mut rng);
    let geometry = split(&soup, |i| i % 2 == 0, 0.4);
    for (primitive, hit) in agree(&geometry, &rays, 5_000) {
        assert!(primitive == MISS || primitive % 2 == 1 || f32::from_bits(hit[1]) < 0.4, "{primitive} {hit:?}");
    }
}

#[test]
fn big_triangles_of_both_kinds_go_in_front() {
    let mut rng = Rng::new(33);
    let small = random_soup(200, 0.1, 0.8, Vec3::ZERO, &mut rng);
    let wall = |x: f32| [[x, -1.0, -1.0], [x, 1.0, -1.0], [x, 0.0, 1.5]].map(Vec3::from);
    let all: Vec<[Vec3; 3]> = (0..200).map(|i| small.corners(i)).chain([wall(0.2), wall(-0.2), wall(0.3)]).collect();
    let soup = soup(all);
    // A big triangle of each kind, and one of the filtered kind that is the first in its part.
    let geometry = split(&soup, |i| i % 2 == 0, 2.0);
    let (_, rest) = Split::new(geometry.clone()).front.expect("walls are big enough");
    assert_eq!(rest.triangle_count(), 200);
    let rays = rays(5_000, &mut rng);
    agree(&geometry, &rays, 5_000);
}

#[test]
fn triangles_in_one_place_are_asked_about_one_by_one() {
    // Four copies of one triangle, each stopping a third of the rays: (2/3)^4 of them pass. 30,000 rays, 5 sigma.
    let mut rng = Rng::new(34);
    let corners = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]].map(Vec3::from);
    let geometry = split(&soup([corners; 4]), |_| true, 2.0);
    let n = 30_000;
    let mut rays = RayBatch::new(n);
    for i in 0..n {
        rays.set(i, Vec3::new(0.1, 0.2, 1.0), Vec3::new(0.1, 0.0, -1.0), f32::INFINITY);
        rays.key[i] = rng.bits();
    }
    let passed = agree(&geometry, &rays, n).iter().filter(|hit| hit.0 == MISS).count() as f64 / n as f64;
    let expected = (2.0_f64 / 3.0).powi(4);
    let sigma = (expected * (1.0 - expected) / n as f64).sqrt();
    assert!((passed - expected).abs() < 5.0 * sigma, "{passed} passed, expected {expected}");
}
