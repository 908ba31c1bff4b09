//! Whether anything stops the rays of packets.

use super::specials::Specials;
use super::{FEW, STACK, Walk, Worth, ask_for, corner, leave, passing};
use crate::accel::RayBatch;
use crate::accel::wide::WideBvh;
use crate::accel::wide::leaf::cross;
use crate::accel::wide::node::{Child, FILTERED, LEAF_ROWS, Leaves, WIDTH};
use crate::accel::wide::ray::{RayLanes, Shape, box_ends};
use simd::{Float, Kernel, Lanes, Mask};
use std::marker::PhantomData;

/// A child still to be visited, and by which rays.
pub type Open = (Child, u32);

/// Whether anything is hit by `rays[..n]`, as far as packets find out; the others are `left`. With [`AtRest`] by the
/// world's triangles at rest; with [`Others`] by everything else, of those that nothing stopped so far.
///
/// [`AtRest`]: super::AtRest
/// [`Others`]: super::Others
pub struct OccludedPackets<'a, S> {
    pub bvh: &'a WideBvh,
    pub rays: &'a RayBatch,
    pub n: usize,
    pub occluded: &'a mut [u8],
    pub left: &'a mut Vec<u32>,
    pub specials: PhantomData<S>,
}

impl<S: Specials> Kernel for OccludedPackets<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        packets::<L, S>(self);
    }
}

#[inline(always)]
fn packets<L: Lanes, S: Specials>(query: OccludedPackets<'_, S>) {
    let OccludedPackets { bvh, rays, n, occluded, left, .. } = query;
    let specials = &mut S::new();
    let space = if S::SOME { bvh.others.as_ref().unwrap_or(&bvh.world) } else { &bvh.world };
    let bounds = space.tree.nodes[space.root.node()].bounds();
    let mut stack = [(Child::inner(0), 0); STACK];
    let mut worth = Worth::default();
    for at in (0..n).step_by(L::N) {
        let walk = Walk { bvh, space, rays, at, instance: 0 };
        let packet = RayLanes::<L>::new(rays, at, &space.tree.bounds);
        let mut lanes = packet.valid & L::M::first(n - at).bits();
        let (mut found, end) = (0, n.min(at + L::N));
        if S::SOME {
            found = occluded[at..end].iter().enumerate().fold(0, |found, (i, &o)| found | u32::from(o) << i);
            lanes &= !found & packet.enter(&bounds, box_ends::<L>(packet.t_max));
            if lanes == 0 {
                continue;
            }
        }
        let mut open = lanes;
        while open != 0 {
            let alike = packet.alike(open);
            open &= !alike;
            if alike.count_ones() > FEW && worth.pays() {
                found |= stopped::<L, S, STACK>(&walk, &packet, alike, specials, &mut stack, &mut worth);
            } else {
                leave(left, at, alike);
            }
        }
        for (i, out) in occluded[at..end].iter_mut().enumerate() {
            *out = (found >> i & 1) as u8;
        }
    }
}

/// Which of the alike rays `lanes` of a packet are stopped by anything in the tree of `walk`, as bits.
#[inline(always)]
pub fn stopped<L: Lanes, S: Specials, const N: usize>(
    walk: &Walk<'_>,
    packet: &RayLanes<L>,
    lanes: u32,
    specials: &mut S,
    stack: &mut [Open; N],
    worth: &mut Worth,
) -> u32 {
    let shape = packet.shape(lanes.trailing_zeros() as usize);
    let end = box_ends::<L>(packet.t_max);
    let mut open = lanes;
    let space = walk.space;
    stack[0] = (space.root, lanes);
    let mut len = 1;
    while len > 0 {
        len -= 1;
        let (child, entered) = stack[len % N];
        let active = entered & open;
        if active == 0 {
            continue;
        }
        worth.visit(active);
        if child.is_leaf() {
            open &= !stopped_by_leaf::<L>(walk, child, packet, shape, active);
            if open == 0 {
                break;
            }
            continue;
        }
        if S::SOME && child.is_special() {
            open &= !specials.stopped::<L>(walk, child.index(), packet.t_max, active, worth);
            if open == 0 {
                break;
            }
            continue;
        }
        let node = &space.tree.nodes[child.node()];
        for i in 0..node.count() {
            let bits = packet.test_box(&node.planes, i, shape.down, end).0 & active;
            if bits != 0 {
                debug_assert!(len < N);
                let child = node.child(i % WIDTH);
                ask_for(space, child);
                stack[len % N] = (child, bits);
                len += 1;
            }
        }
    }
    lanes & !open
}

/// Which rays of `lanes` a leaf stops.
#[inline(always)]
fn stopped_by_leaf<L: Lanes>(walk: &Walk<'_>, leaf: Child, packet: &RayLanes<L>, shape: Shape, lanes: u32) -> u32 {
    let n = leaf.count();
    let rows = &walk.space.tree.leaves.data[Leaves::offset(leaf)..][..LEAF_ROWS * n];
    let mut found = 0;
    for i in 0..n {
        let a = corner::<L>(rows, i, n, packet, shape);
        let b = corner::<L>(rows, 3 * n + i, n, packet, shape);
        let c = corner::<L>(rows, 6 * n + i, n, packet, shape);
        let (bits, t, u, v) = cross::<L>([a, b, c], lanes & !found, packet.t_max);
        if bits == 0 {
            continue;
        }
        // The end itself is excluded.
        let mut hit = L::M::from_bits(bits) & t.lt(packet.t_max);
        let word = rows[9 * n + i].to_bits();
        if word & FILTERED != 0 {
            hit = hit & !passing::<L>(walk, word, hit.bits(), u, v);
        }
        found |= hit.bits();
        if found == lanes {
            break;
        }
    }
    found
}
