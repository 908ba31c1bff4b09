//! A batch's way through packets and single rays.

use super::WideBvh;
use super::feed::{Task, Tasks, Whole};
use super::leaf::Nearest;
use super::node::WIDTH;
use super::packet::{IntersectPackets, OccludedPackets};
use super::traverse::{Query, trace};
use crate::accel::{HitBatch, MISS, RayBatch};
use simd::{Kernel, Lanes, dispatch};
use std::ops::Range;

/// Nearest hits of `rays[range]`.
pub fn intersect(bvh: &WideBvh, rays: &RayBatch, range: Range<usize>, coherent: bool, hits: &mut HitBatch) {
    if coherent && !bvh.has_specials() {
        let mut tasks = Vec::new();
        dispatch(bvh.packet_level, IntersectPackets { bvh, rays, range, hits: &mut *hits, tasks: &mut tasks });
        run(bvh, rays, &tasks[..], &mut Closest(hits));
    } else {
        for i in range.clone() {
            hits.t[i] = rays.t_max[i];
            hits.u[i] = 0.0;
            hits.v[i] = 0.0;
            hits.primitive[i] = MISS;
            hits.instance[i] = 0;
        }
        run(bvh, rays, Whole { range, root: bvh.world.root }, &mut Closest(hits));
    }
}

/// Whether anything is hit by `rays[..n]`.
pub fn occluded(bvh: &WideBvh, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
    if bvh.has_specials() {
        occluded[..n].fill(0);
        run(bvh, rays, Whole { range: 0..n, root: bvh.world.root }, &mut Any { rays, occluded });
    } else {
        let mut tasks = Vec::new();
        dispatch(bvh.packet_level, OccludedPackets { bvh, rays, n, occluded: &mut *occluded, tasks: &mut tasks });
        run(bvh, rays, &tasks[..], &mut Any { rays, occluded });
    }
}

fn run(bvh: &WideBvh, rays: &RayBatch, tasks: impl Tasks, query: &mut impl Query) {
    dispatch(bvh.level, Singles { bvh, rays, tasks, query });
}

struct Singles<'a, T, Q> {
    bvh: &'a WideBvh,
    rays: &'a RayBatch,
    tasks: T,
    query: &'a mut Q,
}

impl<T: Tasks, Q: Query> Kernel for Singles<'_, T, Q> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        assert!(L::N == WIDTH, "8 children, 8 lanes");
        let Self { bvh, rays, tasks, query } = self;
        if bvh.has_specials() {
            trace::<L, Q, true>(bvh, rays, tasks, query);
        } else {
            trace::<L, Q, false>(bvh, rays, tasks, query);
        }
    }
}

/// Looks for nearest hits; a ray's tasks go on from what earlier ones left.
struct Closest<'a>(&'a mut HitBatch);

impl Query for Closest<'_> {
    const ANY: bool = false;

    #[inline(always)]
    fn start(&self, i: usize) -> Nearest {
        let hits = &self.0;
        Nearest { t: hits.t[i], u: hits.u[i], v: hits.v[i], instance: hits.instance[i], primitive: hits.primitive[i] }
    }

    #[inline(always)]
    fn done(&mut self, i: usize, nearest: &Nearest) {
        // Another task of the ray may have ended meanwhile.
        let Self(hits) = self;
        if nearest.primitive != MISS && self_or(hits, i).yields_to(nearest.t, nearest.instance, nearest.primitive) {
            (hits.t[i], hits.u[i], hits.v[i]) = (nearest.t, nearest.u, nearest.v);
            (hits.instance[i], hits.primitive[i]) = (nearest.instance, nearest.primitive);
        }
    }
}

#[inline(always)]
fn self_or(hits: &HitBatch, i: usize) -> Nearest {
    Nearest { t: hits.t[i], u: 0.0, v: 0.0, instance: hits.instance[i], primitive: hits.primitive[i] }
}

/// Looks for any hit.
struct Any<'a> {
    rays: &'a RayBatch,
    occluded: &'a mut [u8],
}

impl Query for Any<'_> {
    const ANY: bool = true;

    #[inline(always)]
    fn start(&self, i: usize) -> Nearest {
        let none = Nearest::none(self.rays.t_max[i]);
        if self.occluded[i] == 0 { none } else { Nearest { primitive: 0, ..none } }
    }

    #[inline(always)]
    fn done(&mut self, i: usize, nearest: &Nearest) {
        self.occluded[i] |= u8::from(nearest.primitive != MISS);
    }
}

/// Adds the tasks of rays `at ..` in `lanes`, from `child` on.
pub fn add(tasks: &mut Vec<Task>, at: usize, mut lanes: u32, child: super::node::Child, enter: &[f32]) {
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize;
        lanes &= lanes - 1;
        tasks.push(Task { ray: (at + lane) as u32, child, enter: enter.get(lane).copied().unwrap_or(0.0) });
    }
}
