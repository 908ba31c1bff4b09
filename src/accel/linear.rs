//! Brute force as an [`super::Accel`]: the oracle of the tests, and nothing else.

use super::woop::{Crossing, ShearedRay, can_be_hit};
use super::{Accel, AccelStats, HitBatch, MISS, RayBatch, Triangles};
use glam::Vec3;
use std::ops::Range;

/// Every triangle, tested one after the other.
#[derive(Clone, Debug)]
pub struct Linear {
    triangles: Triangles,
}

impl Linear {
    /// Nothing is built.
    pub fn new(triangles: Triangles) -> Self {
        Self { triangles }
    }

    /// Crossings with t in (0, t_max), in the order of the triangles.
    fn crossings(&self, rays: &RayBatch, i: usize) -> impl Iterator<Item = (u32, Crossing)> {
        let origin = Vec3::new(rays.ox[i], rays.oy[i], rays.oz[i]);
        let ray = ShearedRay::new(origin, Vec3::new(rays.dx[i], rays.dy[i], rays.dz[i]));
        let t_max = rays.t_max[i];
        ray.into_iter().flat_map(move |ray| {
            (0..self.triangles.indices.len()).filter_map(move |p| {
                let corners = self.triangles.corners(p);
                let crossing = ray.cross(corners)?;
                (crossing.t > 0.0 && crossing.t < t_max && can_be_hit(corners)).then_some((p as u32, crossing))
            })
        })
    }
}

impl Accel for Linear {
    fn intersect(&self, rays: &RayBatch, range: Range<usize>, _coherent: bool, hits: &mut HitBatch) {
        for i in range {
            let miss = (MISS, Crossing { t: rays.t_max[i], u: 0.0, v: 0.0 });
            // A later triangle must be strictly nearer: ties go to the lowest index.
            let (primitive, hit) = self.crossings(rays, i).fold(miss, |a, b| if b.1.t < a.1.t { b } else { a });
            (hits.t[i], hits.u[i], hits.v[i]) = (hit.t, hit.u, hit.v);
            hits.primitive[i] = primitive;
            hits.instance[i] = 0;
        }
    }

    fn occluded(&self, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
        for (i, out) in occluded[..n].iter_mut().enumerate() {
            *out = u8::from(self.crossings(rays, i).next().is_some());
        }
    }

    fn stats(&self) -> AccelStats {
        let bytes = size_of_val(&*self.triangles.positions) + size_of_val(&*self.triangles.indices);
        AccelStats { name: "linear", version: String::new(), isa: "scalar".into(), bytes, front: 0 }
    }
}
