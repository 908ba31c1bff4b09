//! Whether two backends find the same hits.

use super::rays::{Kind, RaySet, direction, origin};
use crate::accel::{Accel, HitBatch, MISS, RayBatch};
use crate::integrator::POOL;
use crate::math::robust::gamma;
use std::ops::AddAssign;

/// Rays that two backends were given, and those they do not agree on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// All of them.
    pub rays: u64,
    /// Rays that hit anything, by the first backend.
    pub hits: u64,
    /// One hits where the other misses, or something nearer by more than rounding.
    pub disagreements: u64,
    /// Both hit at the same distance up to rounding, but different triangles: a shared edge or vertex, or surfaces that
    /// lie in one another.
    pub ties: u64,
}

impl AddAssign for Agreement {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.hits += other.hits;
        self.disagreements += other.disagreements;
        self.ties += other.ties;
    }
}

impl Agreement {
    /// `count` by million rays.
    pub fn per_million(&self, count: u64) -> f64 {
        count as f64 * 1e6 / self.rays.max(1) as f64
    }
}

/// Compares two backends on all rays of `set`.
pub fn compare(set: &RaySet, a: &dyn Accel, b: &dyn Accel) -> Agreement {
    let mut sum = Agreement::default();
    set.batches.iter().for_each(|rays| sum += compare_batch(set.kind, rays, POOL, a, b));
    sum
}

/// Compares two backends on `rays[..n]`.
pub fn compare_batch(kind: Kind, rays: &RayBatch, n: usize, a: &dyn Accel, b: &dyn Accel) -> Agreement {
    let mut sum = Agreement { rays: n as u64, ..Agreement::default() };
    if kind == Kind::Shadow {
        let mut occluded = [vec![0; n], vec![0; n]];
        a.occluded(rays, n, &mut occluded[0]);
        b.occluded(rays, n, &mut occluded[1]);
        sum.hits = occluded[0].iter().map(|&o| u64::from(o)).sum();
        sum.disagreements = occluded[0].iter().zip(&occluded[1]).filter(|(a, b)| a != b).count() as u64;
        return sum;
    }
    let mut hits = [HitBatch::new(n), HitBatch::new(n)];
    a.intersect(rays, 0..n, kind == Kind::Primary, &mut hits[0]);
    b.intersect(rays, 0..n, kind == Kind::Primary, &mut hits[1]);
    for i in 0..n {
        let [a, b] = [0, 1].map(|k| (hits[k].primitive[i], hits[k].instance[i]));
        sum.hits += u64::from(a.0 != MISS);
        if a == b || (a.0 == MISS && b.0 == MISS) {
            continue;
        }
        let is_tie = a.0 != MISS && b.0 != MISS && is_equal(rays, i, hits[0].t[i], hits[1].t[i]);
        sum.ties += u64::from(is_tie);
        sum.disagreements += u64::from(!is_tie);
    }
    sum
}

/// Whether two distances along ray `i` are the same up to rounding: within gamma(16), twice, of the largest number in
/// the computation, the coordinates of the origin and of the hit. 16 roundings are those of a ray's offset
/// (`math/robust.rs`). At grazing angles the error is larger; such a pair counts as a disagreement.
fn is_equal(rays: &RayBatch, i: usize, a: f32, b: f32) -> bool {
    let speed = direction(rays, i).length();
    let extent = origin(rays, i).abs().max_element() + a.max(b) * speed;
    (a - b).abs() * speed <= 2.0 * gamma(16) * extent
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::geometry::{Geometry, Object, Part, Primitives};
    use crate::accel::{Triangles, linear::Linear};
    use glam::Vec3;

    /// Two overlapping squares at z = 0 with these numbers for the triangles of the second, and one at `z`.
    fn squares(first: u32, z: f32) -> Linear {
        let square = |z: f32, first: u32| Part {
            triangles: Triangles {
                positions: vec![[-1.0, -1.0, z], [1.0, -1.0, z], [1.0, 1.0, z], [-1.0, 1.0, z]],
                indices: vec![[0, 1, 2], [0, 2, 3]],
            },
            primitives: Primitives::From(first),
            ..Part::default()
        };
        let parts = vec![square(0.0, 10), square(0.0, first), square(z, 30)];
        Linear::new(Geometry { world: Object { parts, shapes: Vec::new() }, ..Geometry::default() })
    }

    #[test]
    fn ties_are_told_from_wrong_hits() {
        let mut rays = RayBatch::new(16);
        for i in 0..4 {
            rays.set(i, Vec3::new(0.3 * i as f32 + 0.1, 0.05, 9.0), Vec3::NEG_Z, f32::INFINITY);
        }
        rays.set(4, Vec3::new(5.0, 0.0, 9.0), Vec3::NEG_Z, f32::INFINITY);
        let compared = |a: &Linear, b: &Linear| compare_batch(Kind::Diffuse, &rays, 5, a, b);
        let base = squares(20, -1.0);
        let all = Agreement { rays: 5, hits: 4, ..Agreement::default() };
        assert_eq!(compared(&base, &base), all);
        // The other square's numbers are lower there: the same distance, another triangle.
        assert_eq!(compared(&base, &squares(0, -1.0)), Agreement { ties: 4, ..all });
        assert_eq!(compared(&base, &squares(20, 1e-6)), Agreement { ties: 4, ..all });
        assert_eq!(compared(&base, &squares(20, 1e-3)), Agreement { disagreements: 4, ..all });
        let nothing = Linear::new(Triangles::default());
        assert_eq!(compared(&base, &nothing), Agreement { disagreements: 4, ..all });
        let shadow = compare_batch(Kind::Shadow, &rays, 5, &base, &nothing);
        assert_eq!(shadow, Agreement { disagreements: 4, ..all });
        assert_eq!(shadow.per_million(shadow.disagreements), 800_000.0);
    }
}
