//! Embree against the brute-force oracle: BVH-01, GEO-01, GEO-02 and SELF-01 for the third backend.
//!
//! Embree rounds differently, so hits agree within bounds instead of by bits: hit or miss may differ for 2 rays in a
//! million (none of the sets here has that many rays, so none may), t by 32 ulp of the larger of t and the scene,
//! and where another triangle is named, both must be at the same distance within that. Skipped with a line where there
//! is no Embree library.

#[path = "support/meshes.rs"]
mod meshes;
#[path = "support/rng.rs"]
mod rng;

use glam::Vec3;
use prt::accel::embree::EmbreeAccel;
use prt::accel::linear::Linear;
use prt::accel::{Accel, HitBatch, MISS, RayBatch, Triangles};
use prt::math::robust::offset_origin;
use rng::Rng;
use std::path::PathBuf;

/// Embree's accel, or a printed line.
fn embree(triangles: &Triangles) -> Option<EmbreeAccel> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".embree");
    match EmbreeAccel::build(triangles, &[folder]) {
        Ok(embree) => Some(embree),
        Err(why) => {
            println!("skipped: no Embree library ({why})");
            None
        }
    }
}

type Ray = (Vec3, Vec3, f32);

fn trace(accel: &dyn Accel, rays: &[Ray], coherent: bool) -> Vec<(u32, f32)> {
    let mut batch = RayBatch::new(rays.len());
    for (i, &(o, d, t_max)) in rays.iter().enumerate() {
        batch.set(i, o, d, t_max);
    }
    let mut hits = HitBatch::new(rays.len());
    let mut occluded = vec![0; rays.len()];
    accel.intersect(&batch, 0..rays.len(), coherent, &mut hits);
    accel.occluded(&batch, rays.len(), &mut occluded);
    for i in 0..rays.len() {
        assert_eq!(occluded[i] == 1, hits.primitive[i] != MISS, "occluded and intersect differ: {:?}", rays[i]);
    }
    (0..rays.len()).map(|i| (hits.primitive[i], hits.t[i])).collect()
}

/// All rays against the oracle; `scale` is the largest coordinate.
fn agree(triangles: &Triangles, rays: &[Ray], scale: f32) {
    let Some(embree) = embree(triangles) else { return };
    let expected = trace(&Linear::new(triangles.clone()), rays, false);
    for coherent in [false, true] {
        for ((got, want), ray) in trace(&embree, rays, coherent).iter().zip(&expected).zip(rays) {
            assert_eq!(got.0 == MISS, want.0 == MISS, "hit and miss differ: {ray:?}: {got:?}, oracle {want:?}");
            if want.0 != MISS {
                let bound = 32.0 * f32::EPSILON * (want.1 + scale / ray.1.length());
                assert!((got.1 - want.1).abs() <= bound, "{ray:?}: {got:?}, oracle {want:?}");
            }
        }
    }
}

fn random_rays(rng: &mut Rng, n: usize, size: f32) -> Vec<Ray> {
    (0..n)
        .map(|_| {
            let mut v = || Vec3::new(rng.unit(), rng.unit(), rng.unit()) * 2.0 - 1.0;
            let (origin, target) = (v() * 2.0 * size, v() * size);
            (origin, target - origin, f32::INFINITY)
        })
        .filter(|r| r.1.length() > 0.0)
        .collect()
}

#[test]
fn bvh01_embree_agrees_on_spheres_and_soups() {
    let mut rng = Rng::new(2026);
    let sphere = meshes::sphere(24, 48, || 1.0);
    agree(&sphere, &random_rays(&mut rng, 20_000, 1.0), 2.0);
    let soup = meshes::random_soup(400, 0.5, 1.0, Vec3::ZERO, &mut rng);
    agree(&soup, &random_rays(&mut rng, 20_000, 1.0), 2.0);
}

#[test]
fn geo01_embree_leaves_closed_meshes_no_oftener_than_it_promises() {
    let sphere = meshes::sphere(24, 48, || 1.0);
    let Some(embree) = embree(&sphere) else { return };
    let mut rng = Rng::new(12111);
    // Embree's own bar is 2e-5. Aimed exactly at vertices, which its bar leaves out, 189 of these rays were lost (our
    // own backends: none); the bound says when that gets worse.
    for (kind, n, allowed) in [("random", 100_000, 2), ("edge", 100_000, 2), ("vertex", 100_000, 300)] {
        let rays: Vec<Ray> = (0..n)
            .map(|i| {
                let origin = rng.direction() * 0.5;
                let corners = sphere.corners(i % sphere.indices.len());
                let direction = match kind {
                    "random" => rng.direction(),
                    "edge" => corners[0] + (corners[1] - corners[0]) * rng.unit() - origin,
                    _ => corners[0] - origin,
                };
                (origin, direction, f32::INFINITY)
            })
            .collect();
        for coherent in [false, true] {
            let misses = trace(&embree, &rays, coherent).iter().filter(|h| h.0 == MISS).count();
            assert!(misses <= allowed, "{misses} of {n} {kind} rays left the sphere (coherent {coherent})");
        }
    }
}

#[test]
fn geo02_embree_hits_exact_edges() {
    let quad = Triangles {
        positions: vec![[-5.0, -5.0, 0.0], [5.0, -5.0, 0.0], [5.0, 5.0, 0.0], [-5.0, 5.0, 0.0]],
        indices: vec![[0, 1, 2], [0, 2, 3]],
    };
    let ray = (Vec3::new(0.0, 0.0, 10.0), Vec3::new(0.30458447, 0.30458447, -0.9024725), f32::INFINITY);
    agree(&quad, &[ray], 10.0);
}

#[test]
fn self01_rays_that_leave_a_convex_mesh_do_not_return() {
    let sphere = meshes::sphere(24, 48, || 1.0);
    let Some(embree) = embree(&sphere) else { return };
    let mut rng = Rng::new(7);
    let mut rays = Vec::new();
    for i in 0..60_000 {
        let corners = sphere.corners(i % sphere.indices.len());
        let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        if cross.length() == 0.0 {
            continue;
        }
        // Outwards, whatever the winding.
        let ng = cross.normalize() * cross.dot(corners[0]).signum();
        let (a, b) = (rng.unit().sqrt(), rng.unit());
        let (b1, b2) = (1.0 - a, b * a);
        let p = corners[0] + (corners[1] - corners[0]) * b1 + (corners[2] - corners[0]) * b2;
        let extent = corners[0].abs().max(corners[1].abs()).max(corners[2].abs());
        // 30 % of the directions graze.
        let mut d = (Vec3::new(rng.unit(), rng.unit(), rng.unit()) * 2.0 - 1.0).normalize_or(ng);
        let cos = d.dot(ng);
        d += ng * (cos.abs() * if i % 10 < 3 { 1e-3 } else { 1.0 } - cos);
        if d.length() > 0.0 {
            rays.push((offset_origin(p, extent, ng, d), d, f32::INFINITY));
        }
    }
    let hits = trace(&embree, &rays, false).iter().filter(|h| h.0 != MISS).count();
    assert_eq!(hits, 0, "self-hits of {}", rays.len());
}
