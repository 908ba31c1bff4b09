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
