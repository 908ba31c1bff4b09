//! Nearest hits of packets.

use super::specials::Specials;
use super::{FEW, MAX_LANES, STACK, Walk, Worth, ask_for, corner, leave, passing};
use crate::accel::wide::WideBvh;
use crate::accel::wide::leaf::cross;
use crate::accel::wide::node::{Child, FILTERED, LEAF_ROWS, Leaves, WIDTH};
use crate::accel::wide::ray::{RayLanes, Shape, box_ends};
use crate::accel::{HitBatch, MISS, RayBatch};
use simd::{Float, Kernel, Lanes, Mask, Uint};
use std::marker::PhantomData;
use std::ops::Range;

/// A child still to be visited.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Entry {
    /// Where each ray enters it; infinite for rays that do not.
    enter: [f32; MAX_LANES],
    child: Child,
}

impl Entry {
    /// Nothing.
    pub const NONE: Self = Self { enter: [0.0; MAX_LANES], child: Child::inner(0) };
}

/// Nearest hits of `rays[range]` as far as packets find them; the others are `left`. With [`AtRest`] those with the
/// world's triangles at rest; with [`Others`] those with everything else, where that is nearer than the hits so far. A
/// kernel each: with both in one function camera rays were 3 % slower.
///
/// [`AtRest`]: super::AtRest
/// [`Others`]: super::Others
pub struct IntersectPackets<'a, S> {
    pub bvh: &'a WideBvh,
    pub rays: &'a RayBatch,
    pub range: Range<usize>,
    pub hits: &'a mut HitBatch,
    pub left: &'a mut Vec<u32>,
    pub specials: PhantomData<S>,
}

/// Hits so far, in lanes.
#[derive(Clone, Copy)]
pub struct NearestLanes<L: Lanes> {
    pub t: L::F,
    pub u: L::F,
    pub v: L::F,
    pub primitive: L::U,
    pub instance: L::U,
}

impl<L: Lanes> NearestLanes<L> {
    /// None yet.
    #[inline(always)]
    fn none(t_max: L::F) -> Self {
        let zero = L::F::zero();
        Self { t: t_max, u: zero, v: zero, primitive: L::U::splat(MISS), instance: L::U::splat(0) }
    }

    /// Those of rays `at..at + L::N`.
    #[inline(always)]
    fn load(hits: &HitBatch, at: usize) -> Self {
        Self {
            t: L::F::load(&hits.t, at),
            u: L::F::load(&hits.u, at),
            v: L::F::load(&hits.v, at),
            primitive: L::U::load(&hits.primitive, at),
            instance: L::U::load(&hits.instance, at),
        }
    }

    /// Writes those of `n` rays from `at` on.
    #[inline(always)]
    fn store(&self, hits: &mut HitBatch, at: usize, n: usize) {
        let mut out = [[0.0; MAX_LANES]; 3];
        let mut ids = [[0; MAX_LANES]; 2];
        self.t.store(&mut out[0], 0);
        self.u.store(&mut out[1], 0);
        self.v.store(&mut out[2], 0);
        self.primitive.store(&mut ids[0], 0);
        self.instance.store(&mut ids[1], 0);
        hits.t[at..at + n].copy_from_slice(&out[0][..n]);
        hits.u[at..at + n].copy_from_slice(&out[1][..n]);
        hits.v[at..at + n].copy_from_slice(&out[2][..n]);
        hits.primitive[at..at + n].copy_from_slice(&ids[0][..n]);
        hits.instance[at..at + n].copy_from_slice(&ids[1][..n]);
    }
}

impl<S: Specials> Kernel for IntersectPackets<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        packets::<L, S>(self);
    }
}

#[inline(always)]
fn packets<L: Lanes, S: Specials>(query: IntersectPackets<'_, S>) {
    let IntersectPackets { bvh, rays, range, hits, left, .. } = query;
    let specials = &mut S::new();
    let space = if S::SOME { bvh.others.as_ref().unwrap_or(&bvh.world) } else { &bvh.world };
    let bounds = space.tree.nodes[space.root.node()].bounds();
    let mut stack = [Entry::NONE; STACK];
    let mut worth = Worth::default();
    let mut at = range.start;
    while at < range.end {
        let n = L::N.min(range.end - at);
        if at + L::N > rays.capacity() {
            // A range may start anywhere, so its last vector may stick out of the batch.
            left.extend(at as u32..range.end as u32);
            return;
        }
        let walk = Walk { bvh, space, rays, at, instance: 0 };
        let packet = RayLanes::<L>::new(rays, at, &space.tree.bounds);
        let mut lanes = packet.valid & L::M::first(n).bits();
        let mut nearest = if S::SOME { NearestLanes::load(hits, at) } else { NearestLanes::<L>::none(packet.t_max) };
        if S::SOME {
            lanes &= packet.enter(&bounds, box_ends::<L>(nearest.t));
            if lanes == 0 {
                at += n;
                continue;
            }
        }
        let mut open = lanes;
        while open != 0 {
            let alike = packet.alike(open);
            open &= !alike;
            if alike.count_ones() > FEW && worth.pays() {
                intersect::<L, S, STACK>(&walk, &packet, alike, specials, &mut stack, &mut worth, &mut nearest);
            } else {
                leave(left, at, alike);
            }
        }
        nearest.store(hits, at, n);
        at += n;
    }
}

/// Follows the alike rays `valid` of a packet through the tree of `walk`.
#[inline(always)]
pub fn intersect<L: Lanes, S: Specials, const N: usize>(
    walk: &Walk<'_>,
    packet: &RayLanes<L>,
    valid: u32,
    specials: &mut S,
    stack: &mut [Entry; N],
    worth: &mut Worth,
    nearest: &mut NearestLanes<L>,
) {
    let shape = packet.shape(valid.trailing_zeros() as usize);
    let valid = L::M::from_bits(valid);
    let (nowhere, none) = (L::F::splat(-1.0), L::F::splat(f32::INFINITY));
    let mut end = box_ends::<L>(nearest.t).or_else(valid, nowhere);
    let space = walk.space;
    let (mut child, mut lanes, mut len) = (space.root, valid.bits(), 0);
    loop {
        worth.visit(lanes);
        if child.is_leaf() {
            intersect_leaf::<L, S>(walk, child, packet, shape, lanes, nearest);
            end = box_ends::<L>(nearest.t).or_else(valid, nowhere);
        } else if S::SOME && child.is_special() {
            specials.meet(walk, child.index(), packet.t_max, lanes, worth, nearest);
            end = box_ends::<L>(nearest.t).or_else(valid, nowhere);
        } else {
            let node = &space.tree.nodes[child.node()];
            // Sorted by where their first ray enters, farthest first, before the large entries are written.
            let (mut entered, mut firsts, mut order) = ([none; WIDTH], [0.0; WIDTH], [0; WIDTH]);
            let mut bits_of = [0; WIDTH];
            let mut n = 0;
            for i in 0..node.count() {
                let i = i % WIDTH;
                let (bits, enter) = packet.test_box(&node.planes, i, shape.down, end);
                if bits == 0 {
                    continue;
                }
                (entered[i], bits_of[i]) = (enter, bits);
                let mut at = [0.0; MAX_LANES];
                enter.store(&mut at, 0);
                let first = at[bits.trailing_zeros() as usize % MAX_LANES];
                firsts[i] = first;
                let mut j = n % WIDTH;
                n += 1;
                while j > 0 && firsts[order[j - 1]] < first {
                    order[j] = order[j - 1];
                    j -= 1;
                }
                order[j] = i;
            }
            if n > 0 {
                let last = (n - 1) % WIDTH;
                for &i in &order[..last] {
                    debug_assert!(len < N);
                    let entry = &mut stack[len % N];
                    entered[i].or_else(L::M::from_bits(bits_of[i]), none).store(&mut entry.enter, 0);
                    entry.child = node.child(i);
                    ask_for(space, entry.child);
                    len += 1;
                }
                // The nearest comes next, without a way over the stack.
                let nearest = order[last];
                (child, lanes) = (node.child(nearest), bits_of[nearest]);
                continue;
            }
        }
        loop {
            if len == 0 {
                return;
            }
            len -= 1;
            let entry = &stack[len % N];
            lanes = L::F::load(&entry.enter, 0).le(end).bits();
            if lanes != 0 {
                child = entry.child;
                break;
            }
        }
    }
}

#[inline(always)]
fn intersect_leaf<L: Lanes, S: Specials>(
    walk: &Walk<'_>,
    leaf: Child,
    packet: &RayLanes<L>,
    shape: Shape,
    lanes: u32,
    nearest: &mut NearestLanes<L>,
) {
    let n = leaf.count();
    let rows = &walk.space.tree.leaves.data[Leaves::offset(leaf)..][..LEAF_ROWS * n];
    for i in 0..n {
        let a = corner::<L>(rows, i, n, packet, shape);
        let b = corner::<L>(rows, 3 * n + i, n, packet, shape);
        let c = corner::<L>(rows, 6 * n + i, n, packet, shape);
        let (bits, t, u, v) = cross::<L>([a, b, c], lanes, nearest.t);
        if bits == 0 {
            continue;
        }
        let word = rows[9 * n + i].to_bits();
        let primitive = L::U::splat(word & !FILTERED);
        let none = nearest.primitive.eq(L::U::splat(MISS));
        let mut first = primitive.lt(nearest.primitive);
        if S::SOME {
            let instance = L::U::splat(walk.instance);
            first = instance.lt(nearest.instance) | (instance.eq(nearest.instance) & first);
        }
        let tie = t.eq(nearest.t) & first & !none;
        let mut nearer = L::M::from_bits(bits) & (t.lt(nearest.t) | tie);
        if word & FILTERED != 0 {
            nearer = nearer & !passing::<L>(walk, word, nearer.bits(), u, v);
        }
        nearest.t = t.or_else(nearer, nearest.t);
        nearest.u = u.or_else(nearer, nearest.u);
        nearest.v = v.or_else(nearer, nearest.v);
        nearest.primitive = primitive.or_else(nearer, nearest.primitive);
        if S::SOME {
            nearest.instance = L::U::splat(walk.instance).or_else(nearer, nearest.instance);
        }
    }
}
