//! A batch's way through packets and single rays.

use super::feed::Which;
use super::leaf::Nearest;
use super::node::WIDTH;
use super::packet::{AtRest, IntersectPackets, OccludedPackets, Others, Specials, leave};
use super::ray::{RayLanes, box_ends};
use super::sort::{IsMixed, Sort, Sorted};
use super::traverse::{INTERLEAVED, Query, trace};
use super::{Space, WideBvh};
use crate::accel::{HitBatch, MISS, RayBatch};
use simd::{Float, Kernel, Lanes, Mask, dispatch};
use std::marker::PhantomData;
use std::ops::Range;

/// Scattered rays that reach what is not at rest, from which on they are put in order and go in packets.
const MANY: usize = 512;

/// Nearest hits of `rays[range]`.
pub fn intersect(bvh: &WideBvh, rays: &RayBatch, range: Range<usize>, coherent: bool, hits: &mut HitBatch) {
    let mut left = Vec::new();
    if bvh.world.is_empty() {
        hits.t[range.clone()].copy_from_slice(&rays.t_max[range.clone()]);
        hits.primitive[range.clone()].fill(MISS);
    } else if coherent {
        packets::<AtRest>(bvh, rays, range.clone(), &mut *hits, &mut left);
        run(bvh, &bvh.world, rays, &left[..], &mut Closest(&mut *hits));
    } else {
        run(bvh, &bvh.world, rays, range.clone(), &mut Closest(&mut *hits));
    }
    let Some(others) = &bvh.others else { return };
    if coherent {
        packets::<Others>(bvh, rays, range, &mut *hits, &mut left);
        return run(bvh, others, rays, &left[..], &mut Closer(hits));
    }
    left.clear();
    let (ends, reaching) = (&hits.t, &mut left);
    dispatch(bvh.packet_level, Reaching { others, rays, range: range.clone(), ends, reaching });
    if left.len() < MANY {
        return run(bvh, others, rays, &left[..], &mut Closer(hits));
    }
    let Sorted { rays, from } = dispatch(bvh.packet_level, Sort { rays, n: left.len(), which: Some(&left) });
    let n = left.len();
    let mut found = HitBatch::new(n);
    for (k, &i) in from[..n].iter().enumerate() {
        found.copy(k, hits, i as usize);
    }
    packets::<Others>(bvh, &rays, 0..n, &mut found, &mut left);
    run(bvh, others, &rays, &left[..], &mut Closer(&mut found));
    for (k, &i) in from[..n].iter().enumerate() {
        hits.copy(i as usize, &found, k);
    }
}

/// Whether anything is hit by `rays[..n]`.
pub fn occluded(bvh: &WideBvh, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
    let scene = &bvh.world.tree.bounds;
    if !dispatch(bvh.packet_level, IsMixed { rays, n, scene }) {
        return occluded_in_packets(bvh, rays, n, occluded);
    }
    let Sorted { rays, from } = dispatch(bvh.packet_level, Sort { rays, n, which: None });
    let mut found = vec![0; n];
    occluded_in_packets(bvh, &rays, n, &mut found);
    from.iter().zip(found).for_each(|(&i, o)| occluded[i as usize] = o);
}

fn occluded_in_packets(bvh: &WideBvh, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
    occluded_by::<AtRest>(bvh, &bvh.world, rays, n, occluded);
    if let Some(others) = &bvh.others {
        occluded_by::<Others>(bvh, others, rays, n, occluded);
    }
}

fn occluded_by<S: Specials>(bvh: &WideBvh, world: &Space, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
    let mut left = Vec::new();
    let (found, specials) = (&mut *occluded, PhantomData::<S>);
    dispatch(bvh.packet_level, OccludedPackets { bvh, rays, n, occluded: found, left: &mut left, specials });
    run(bvh, world, rays, &left[..], &mut Any(occluded));
}

/// Sends `rays[range]` through one of the two in packets; those that are better off alone are `left`.
fn packets<S: Specials>(bvh: &WideBvh, rays: &RayBatch, range: Range<usize>, hits: &mut HitBatch, left: &mut Vec<u32>) {
    left.clear();
    dispatch(bvh.packet_level, IntersectPackets { bvh, rays, range, hits, left, specials: PhantomData::<S> });
}

/// Which of `rays[range]` enter the box around `others` before `ends`.
struct Reaching<'a> {
    others: &'a Space,
    rays: &'a RayBatch,
    range: Range<usize>,
    ends: &'a [f32],
    reaching: &'a mut Vec<u32>,
}

impl Kernel for Reaching<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { others, rays, range, ends, reaching } = self;
        let bounds = others.tree.nodes[others.root.node()].bounds();
        for at in range.clone().step_by(L::N) {
            let n = L::N.min(range.end - at);
            // A range may start anywhere, so its last vector may stick out of the batch: all of it may reach.
            let mut bits = L::M::first(n).bits();
            if at + L::N <= rays.capacity() {
                let packet = RayLanes::<L>::new(rays, at, &others.tree.bounds);
                bits &= packet.valid & packet.enter(&bounds, box_ends::<L>(L::F::load(ends, at)));
            }
            leave(reaching, at, bits);
        }
    }
}

/// Sends single rays through `world`, one of the two.
fn run(bvh: &WideBvh, world: &Space, rays: &RayBatch, which: impl Which, query: &mut impl Query) {
    dispatch(bvh.level, Singles { bvh, world, rays, which, query });
}

struct Singles<'a, W, Q> {
    bvh: &'a WideBvh,
    world: &'a Space,
    rays: &'a RayBatch,
    which: W,
    query: &'a mut Q,
}

impl<W: Which, Q: Query> Kernel for Singles<'_, W, Q> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        assert!(L::N == WIDTH, "8 children, 8 lanes");
        let Self { bvh, world, rays, which, query } = self;
        if !world.specials.is_empty() {
            trace::<L, Q, true, INTERLEAVED>(bvh, world, rays, which, query);
        } else if bvh.interleaves {
            trace::<L, Q, false, INTERLEAVED>(bvh, world, rays, which, query);
        } else {
            trace::<L, Q, false, 1>(bvh, world, rays, which, query);
        }
    }
}

/// Looks for nearest hits.
struct Closest<'a>(&'a mut HitBatch);

impl Query for Closest<'_> {
    const ANY: bool = false;

    #[inline(always)]
    fn before(&self, _: usize, t_max: f32) -> Nearest {
        Nearest::none(t_max)
    }

    #[inline(always)]
    fn done(&mut self, i: usize, nearest: &Nearest) {
        let Self(hits) = self;
        (hits.t[i], hits.u[i], hits.v[i]) = (nearest.t, nearest.u, nearest.v);
        (hits.instance[i], hits.primitive[i]) = (nearest.instance, nearest.primitive);
    }
}

/// Looks for hits nearer than those found already.
struct Closer<'a>(&'a mut HitBatch);

impl Query for Closer<'_> {
    const ANY: bool = false;

    #[inline(always)]
    fn before(&self, i: usize, _: f32) -> Nearest {
        let Self(hits) = self;
        let (instance, primitive) = (hits.instance[i], hits.primitive[i]);
        Nearest { t: hits.t[i], u: hits.u[i], v: hits.v[i], instance, primitive }
    }

    #[inline(always)]
    fn done(&mut self, i: usize, nearest: &Nearest) {
        Closest(self.0).done(i, nearest);
    }
}

/// Looks for any hit.
struct Any<'a>(&'a mut [u8]);

impl Query for Any<'_> {
    const ANY: bool = true;

    #[inline(always)]
    fn before(&self, _: usize, t_max: f32) -> Nearest {
        Nearest::none(t_max)
    }

    #[inline(always)]
    fn done(&mut self, i: usize, nearest: &Nearest) {
        self.0[i] = u8::from(nearest.primitive != MISS);
    }
}
