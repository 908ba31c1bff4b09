//! Camera and shadow rays: as many rays as there are lanes walk the tree together, one box or triangle at a time.
//!
//! After Wald, Slusallek, Benthin and Wagner 2001, "Interactive Rendering with Coherent Ray Tracing". A packet's rays
//! must share the signs of their directions and the largest component: lanes are traced in groups that do. Small groups,
//! and batches whose rays part soon, are left to `traverse`. Handing single rays over in the middle of a packet, as
//! Embree does, lost up to a third of the speed: each is set up again. Asking for the memory of children when they are
//! pushed: 1.03 to 1.1 times the speed. Testing all children at once against the interval of the packet's rays first (as
//! Embree does for coherent rays): 1.01 for camera rays, 0.95 for shadow rays; pushing children of shadow rays without
//! branches: 1.04 in a room, 0.95 at organic shapes and in an interior; not kept.
//!
//! Triangles at rest are met in a pass of their own (`nearest`, `occluded`); what is placed, moves or is an exact shape in
//! another one after it (`specials`), where a packet enters a placed object as a packet.
//!
//! 38 Mray/s against 11 with single rays in a room of 910 triangles, but only 1.2 to 1.3 times as fast with 500 000
//! triangles, where few rays of a packet share a leaf. Shadow rays to a lamp: 1.1 to 1.6 times as fast as single rays.

mod nearest;
mod occluded;
mod specials;

pub use nearest::IntersectPackets;
pub use occluded::OccludedPackets;
pub use specials::{AtRest, Others, Specials};

use super::build::MAX_DEPTH;
use super::leaf::{Asked, sheared};
use super::node::{Child, Leaves, WIDTH};
use super::ray::{RayLanes, Shape};
use super::{Space, WideBvh};
use crate::accel::RayBatch;
use simd::{Float, Lanes, Mask, prefetch};

/// Lanes at most.
const MAX_LANES: usize = 16;

/// Entries of the stack of a walk through one tree, a power of two.
const STACK: usize = 512;
const _: () = assert!(MAX_DEPTH as usize * (WIDTH - 1) < STACK && STACK.is_power_of_two());

/// The same in a placed object, which is a tree over what is not triangles at rest and, below, one of these.
const INNER_STACK: usize = 1024;
const _: () = assert!(2 * MAX_DEPTH as usize * (WIDTH - 1) < INNER_STACK && INNER_STACK.is_power_of_two());

/// Groups of alike rays up to this size go on as single rays.
const FEW: u32 = 3;

/// Visits after which a batch's packets are judged, and the rays that must share a visit on average for packets to pay.
const TRIAL: u32 = 256;
const SHARED: u32 = 3;

/// How many rays shared the visits of a batch's packets so far. What is traced how changes no hit.
#[derive(Default)]
pub struct Worth {
    visits: u32,
    rays: u32,
}

impl Worth {
    #[inline(always)]
    fn visit(&mut self, lanes: u32) {
        self.visits += 1;
        self.rays += lanes.count_ones();
    }

    /// Whether packets are faster than single rays, as far as one knows.
    #[inline(always)]
    fn pays(&self) -> bool {
        self.visits < TRIAL || self.rays >= self.visits * SHARED
    }
}

/// Where a packet is.
#[derive(Clone, Copy)]
pub struct Walk<'a> {
    bvh: &'a WideBvh,
    space: &'a Space,
    rays: &'a RayBatch,
    /// The packet's first ray.
    at: usize,
    /// 0 in the world, i + 1 in placement i.
    instance: u32,
}

impl Walk<'_> {
    /// Who is asked about hits of lane `i`.
    #[inline(always)]
    fn asked(&self, i: usize) -> Asked<'_> {
        Asked { filter: self.bvh.filter.as_deref(), key: self.rays.key[self.at + i], instance: self.instance }
    }
}

/// Asks for the memory of what will be visited.
#[inline(always)]
fn ask_for(space: &Space, child: Child) {
    let tree = &space.tree;
    if child.is_leaf() {
        prefetch(&tree.leaves.data, Leaves::offset(child), 3);
    } else if child.is_far() {
        prefetch(&tree.nodes, child.node(), 4);
    }
}

/// Appends the rays from `at` on that are in `lanes`.
#[inline(always)]
pub fn leave(left: &mut Vec<u32>, at: usize, mut lanes: u32) {
    while lanes != 0 {
        left.push(at as u32 + lanes.trailing_zeros());
        lanes &= lanes - 1;
    }
}

/// Which rays of `bits` pass the filtered triangle of `word`.
#[cold]
#[inline(never)]
fn ask(walk: &Walk<'_>, word: u32, mut bits: u32, u: &[f32; MAX_LANES], v: &[f32; MAX_LANES]) -> u32 {
    let mut passing = 0;
    while bits != 0 {
        let i = bits.trailing_zeros() as usize % MAX_LANES;
        bits &= bits - 1;
        let asked = walk.asked(i);
        passing |= u32::from(asked.passes(word, u[i], v[i])) << i;
    }
    passing
}

/// [`ask`] with vectors.
#[inline(always)]
fn passing<L: Lanes>(walk: &Walk<'_>, word: u32, bits: u32, u: L::F, v: L::F) -> L::M {
    let mut lanes = [[0.0; MAX_LANES]; 2];
    u.store(&mut lanes[0], 0);
    v.store(&mut lanes[1], 0);
    L::M::from_bits(ask(walk, word, bits, &lanes[0], &lanes[1]))
}

/// One corner, for all rays.
#[inline(always)]
fn corner<L: Lanes>(rows: &[f32], first: usize, n: usize, packet: &RayLanes<L>, shape: Shape) -> (L::F, L::F, L::F) {
    let [kx, ky, kz] = shape.axes;
    let p = [rows[first + kx * n], rows[first + ky * n], rows[first + kz * n]];
    let p = [L::F::splat(p[0]), L::F::splat(p[1]), L::F::splat(p[2])];
    sheared::<L>(p, &packet.origin, &packet.shear)
}
