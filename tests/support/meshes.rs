//! Meshes and rays for the tests of ray queries.
#![allow(dead_code, unused_imports)]

use super::rng::Rng;
use glam::Vec3;
use prt::accel::{RayBatch, Triangles};
pub use prt::verify::meshes::{placed, soup, sphere};

/// Random triangles in the cube [-1, 1]^3 with edges of about `size`, positions first scaled by `s` and then moved by
/// `shift`.
pub fn random_soup(n: usize, size: f32, s: f32, shift: Vec3, rng: &mut Rng) -> Triangles {
    placed(&prt::verify::meshes::random_soup(n, size, rng), s, shift)
}

/// Long thin triangles: length about 1, width about `width`.
pub fn slivers(n: usize, width: f32, rng: &mut Rng) -> Triangles {
    soup((0..n).map(|_| {
        let (a, along) = (rng.cube(), rng.direction());
        [a, a + along, a + along * rng.unit() + rng.direction() * width]
    }))
}

/// A flat n x n grid from (x0, x0) on with unit cells in the plane z = 0.
pub fn grid(n: usize, x0: f32) -> Triangles {
    prt::verify::meshes::grid(n, x0, |_, _| 0.0)
}

/// A batch of rays given as origin, direction and end.
pub fn batch(rays: &[(Vec3, Vec3, f32)]) -> RayBatch {
    let mut batch = RayBatch::new(rays.len());
    for (i, &(origin, direction, t_max)) in rays.iter().enumerate() {
        batch.set(i, origin, direction, t_max);
    }
    batch
}
