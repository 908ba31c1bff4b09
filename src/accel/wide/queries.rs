//! A batch's way through packets and single rays.

use super::WideBvh;
use super::feed::Which;
use super::leaf::Nearest;
use super::node::WIDTH;
use super::packet::{IntersectPackets, OccludedPackets};
use super::sort::{IsMixed, Sort, Sorted};
use super::traverse::{INTERLEAVED, Query, trace};
use crate::accel::{HitBatch, MISS, RayBatch};
use simd::{Kernel, Lanes, dispatch};
use std::ops::Range;

/// Nearest hits of `rays[range]`.
pub fn intersect(bvh: &WideBvh, rays: &RayBatch, range: Range<usize>, coherent: bool, hits: &mut HitBatch) {
    if coherent && !bvh.has_specials() {
        let mut left = Vec::new();
        dispatch(bvh.packet_level, IntersectPackets { bvh, rays, range, hits: &mut *hits, left: &mut left });
        run(bvh, rays, &left[..], &mut Closest(hits));
    } else {
        run(bvh, rays, range, &mut Closest(hits));
    }
}

/// Whether anything is hit by `rays[..n]`.
pub fn occluded(bvh: &WideBvh, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
    if bvh.has_specials() {
        run(bvh, rays, 0..n, &mut Any(occluded));
    } else {
        let scene = &bvh.world.tree.bounds;
        if !dispatch(bvh.packet_level, IsMixed { rays, n, scene }) {
            return occluded_in_packets(bvh, rays, n, occluded);
        }
        let Sorted { rays, from } = dispatch(bvh.packet_level, Sort { rays, n });
        let mut found = vec![0; n];
        occluded_in_packets(bvh, &rays, n, &mut found);
        from.iter().zip(found).for_each(|(&i, o)| occluded[i as usize] = o);
    }
}

fn occluded_in_packets(bvh: &WideBvh, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
    let mut left = Vec::new();
    dispatch(bvh.packet_level, OccludedPackets { bvh, rays, n, occluded: &mut *occluded, left: &mut left });
    run(bvh, rays, &left[..], &mut Any(occluded));
}

fn run(bvh: &WideBvh, rays: &RayBatch, which: impl Which, query: &mut impl Query) {
    dispatch(bvh.level, Singles { bvh, rays, which, query });
}

struct Singles<'a, W, Q> {
    bvh: &'a WideBvh,
    rays: &'a RayBatch,
    which: W,
    query: &'a mut Q,
}

impl<W: Which, Q: Query> Kernel for Singles<'_, W, Q> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        assert!(L::N == WIDTH, "8 children, 8 lanes");
        let Self { bvh, rays, which, query } = self;
        if bvh.has_specials() {
            trace::<L, Q, true, INTERLEAVED>(bvh, rays, which, query);
        } else if bvh.interleaves {
            trace::<L, Q, false, INTERLEAVED>(bvh, rays, which, query);
        } else {
            trace::<L, Q, false, 1>(bvh, rays, which, query);
        }
    }
}

/// Looks for nearest hits.
struct Closest<'a>(&'a mut HitBatch);

impl Query for Closest<'_> {
    const ANY: bool = false;

    #[inline(always)]
    fn done(&mut self, i: usize, nearest: &Nearest) {
        let Self(hits) = self;
        (hits.t[i], hits.u[i], hits.v[i]) = (nearest.t, nearest.u, nearest.v);
        (hits.instance[i], hits.primitive[i]) = (nearest.instance, nearest.primitive);
    }
}

/// Looks for any hit.
struct Any<'a>(&'a mut [u8]);

impl Query for Any<'_> {
    const ANY: bool = true;

    #[inline(always)]
    fn done(&mut self, i: usize, nearest: &Nearest) {
        self.0[i] = u8::from(nearest.primitive != MISS);
    }
}
