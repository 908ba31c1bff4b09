//! SELF-01: a ray that leaves a surface does not find that surface again, at any scale and position.

#[path = "support/meshes.rs"]
mod meshes;
#[path = "support/rng.rs"]
mod rng;

use glam::Vec3;
use meshes::{batch, placed, random_soup, sphere};
use prt::accel::linear::Linear;
use prt::accel::wide::WideBvh;
use prt::accel::{Accel, HitBatch, MISS, Triangles};
use prt::math::robust::offset_origin;
use rng::Rng;

const DIRECTIONS: usize = 50;

/// Leaves from random points of triangle `i` on both sides and returns how many of the rays hit anything.
///
/// `solid`: only to the outside of a convex mesh around `centre`. Also checks that the offset stays small.
fn self_hits(accel: &dyn Accel, mesh: &Triangles, i: usize, centre: Option<Vec3>, scale: f32, rng: &mut Rng) -> usize {
    let [a, b, c] = mesh.corners(i);
    let exact = (b - a).as_dvec3().cross((c - a).as_dvec3());
    if exact.length() == 0.0 {
        return 0;
    }
    let mut ng = exact.normalize().as_vec3().normalize();
    if let Some(centre) = centre
        && (a - centre).dot(ng) < 0.0
    {
        ng = -ng;
    }
    let (mut u, mut v) = (rng.unit(), rng.unit());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    let p = a + (b - a) * u + (c - a) * v;
    let extent = a.abs().max(b.abs()).max(c.abs());
    let rays: Vec<_> = (0..DIRECTIONS)
        .map(|k| {
            let d = rng.direction();
            let mut cos = d.dot(ng);
            let tangent = d - ng * cos;
            if k % 10 < 3 {
                cos *= 1e-3;
            }
            if centre.is_some() {
                cos = cos.abs();
            }
            let d = (tangent + ng * cos).normalize();
            let o = offset_origin(p, extent, ng, d);
            let eps_t = 16.0 * 2f32.powi(-24) * (extent.max_element() + scale);
            assert!((o - p).length() <= 4.0 * eps_t, "offset {} of {scale} at {p}", (o - p).length());
            (o, d, f32::INFINITY)
        })
        // A direction that lost its side to rounding has none to be tested for.
        .filter(|ray| centre.is_none() || ray.1.dot(ng) > 0.0)
        .collect();
    let mut hits = HitBatch::new(rays.len());
    accel.intersect(&batch(&rays), 0..rays.len(), false, &mut hits);
    hits.primitive[..rays.len()].iter().filter(|&&hit| hit != MISS).count()
}

fn cases() -> impl Iterator<Item = (f32, Vec3)> {
    [1e-6f32, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6, 1e7]
        .into_iter()
        .flat_map(|s| [0.0, 1e2, 1e4, 1e6].into_iter().map(move |t| (s, Vec3::new(1.0, 0.3, -0.7) * t * s)))
}

#[test]
fn self01_convex_meshes_are_never_hit_from_outside() {
    let unit = sphere(24, 48, || 1.0);
    let mut rng = Rng::new(7);
    // Further out the rounding of the vertices alone makes the mesh concave.
    for (s, shift) in cases().filter(|(s, shift)| shift.length() <= 1.3 * s) {
        let mesh = placed(&unit, s, shift);
        let accel = WideBvh::build(&mesh);
        let hits: usize = (0..1500)
            .map(|_| {
                let i = rng.below(mesh.indices.len());
                self_hits(&accel, &mesh, i, Some(shift), s, &mut rng)
            })
            .sum();
        assert_eq!(hits, 0, "s {s}, T {shift}");
    }
}

#[test]
fn self01_random_triangles_are_rarely_hit_again() {
    let (mut hits, mut rays) = (0, 0);
    for (s, shift) in cases() {
        let mut rng = Rng::new(7);
        for _ in 0..1000 {
            let mesh = random_soup(1, 1.0, s, shift, &mut rng);
            hits += self_hits(&Linear::new(mesh.clone()), &mesh, 0, None, s, &mut rng);
            rays += DIRECTIONS;
        }
    }
    assert!(hits as f64 <= 1e-5 * rays as f64, "{hits} of {rays}");
}
