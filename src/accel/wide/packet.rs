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
//! 38 Mray/s against 11 with single rays in a room of 910 triangles, but only 1.2 to 1.3 times as fast with 500 000
//! triangles, where few rays of a packet share a leaf. Shadow rays to a lamp: 1.1 to 1.6 times as fast as single rays.

use super::WideBvh;
use super::build::MAX_DEPTH;
use super::leaf::{Asked, cross, sheared};
use super::node::{Child, FILTERED, LEAF_ROWS, Leaves, WIDTH};
use super::ray::{RayLanes, Shape, box_ends};
use crate::accel::{HitBatch, MISS, RayBatch};
use simd::{Float, Kernel, Lanes, Mask, Uint, prefetch};
use std::ops::Range;

/// Lanes at most.
const MAX_LANES: usize = 16;

/// Entries of the stack, a power of two: packets go through one tree only.
const STACK: usize = 512;
const _: () = assert!(MAX_DEPTH as usize * (WIDTH - 1) < STACK && STACK.is_power_of_two());

/// Groups of alike rays up to this size go on as single rays.
const FEW: u32 = 3;

/// Visits after which a batch's packets are judged, and the rays that must share a visit on average for packets to pay.
const TRIAL: u32 = 256;
const SHARED: u32 = 3;

/// How many rays shared the visits of a batch's packets so far. What is traced how changes no hit.
#[derive(Default)]
struct Worth {
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

/// A child still to be visited.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Entry {
    /// Where each ray enters it; infinite for rays that do not.
    enter: [f32; MAX_LANES],
    child: Child,
}

/// Nearest hits of `rays[range]` as far as packets find them; the others are `left`.
pub struct IntersectPackets<'a> {
    pub bvh: &'a WideBvh,
    pub rays: &'a RayBatch,
    pub range: Range<usize>,
    pub hits: &'a mut HitBatch,
    pub left: &'a mut Vec<u32>,
}

/// Hits so far, in lanes.
#[derive(Clone, Copy)]
struct NearestLanes<L: Lanes> {
    t: L::F,
    u: L::F,
    v: L::F,
    primitive: L::U,
}

impl Kernel for IntersectPackets<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { bvh, rays, range, hits, left } = self;
        let mut stack = [Entry { enter: [0.0; MAX_LANES], child: Child::inner(0) }; STACK];
        let mut worth = Worth::default();
        let mut at = range.start;
        while at < range.end {
            let n = L::N.min(range.end - at);
            if at + L::N > rays.capacity() {
                // A range may start anywhere, so its last vector may stick out of the batch.
                left.extend(at as u32..range.end as u32);
                return;
            }
            let packet = RayLanes::<L>::new(rays, at, &bvh.world.tree.bounds);
            let lanes = packet.valid & L::M::first(n).bits();
            let mut nearest =
                NearestLanes::<L> { t: packet.t_max, u: L::F::zero(), v: L::F::zero(), primitive: L::U::splat(MISS) };
            let mut open = lanes;
            while open != 0 {
                let alike = packet.alike(open);
                open &= !alike;
                if alike.count_ones() > FEW && worth.pays() {
                    let keys = &rays.key[at..at + L::N];
                    intersect_packet::<L>(bvh, &packet, alike, keys, &mut stack, &mut worth, &mut nearest);
                } else {
                    leave(left, at, alike);
                }
            }
            let mut out = ([0.0; MAX_LANES], [0.0; MAX_LANES], [0.0; MAX_LANES], [0; MAX_LANES]);
            nearest.t.store(&mut out.0, 0);
            nearest.u.store(&mut out.1, 0);
            nearest.v.store(&mut out.2, 0);
            nearest.primitive.store(&mut out.3, 0);
            hits.t[at..at + n].copy_from_slice(&out.0[..n]);
            hits.u[at..at + n].copy_from_slice(&out.1[..n]);
            hits.v[at..at + n].copy_from_slice(&out.2[..n]);
            hits.primitive[at..at + n].copy_from_slice(&out.3[..n]);
            hits.instance[at..at + n].fill(0);
            at += n;
        }
    }
}

/// Asks for the memory of what will be visited.
#[inline(always)]
fn ask_for(bvh: &WideBvh, child: Child) {
    let tree = &bvh.world.tree;
    if child.is_leaf() {
        prefetch(&tree.leaves.data, Leaves::offset(child), 3);
    } else if child.is_far() {
        prefetch(&tree.nodes, child.node(), 4);
    }
}

/// Appends the rays from `at` on that are in `lanes`.
#[inline(always)]
fn leave(left: &mut Vec<u32>, at: usize, mut lanes: u32) {
    while lanes != 0 {
        left.push(at as u32 + lanes.trailing_zeros());
        lanes &= lanes - 1;
    }
}

#[inline(always)]
fn intersect_packet<L: Lanes>(
    bvh: &WideBvh,
    packet: &RayLanes<L>,
    valid: u32,
    keys: &[u32],
    stack: &mut [Entry; STACK],
    worth: &mut Worth,
    nearest: &mut NearestLanes<L>,
) {
    let shape = packet.shape(valid.trailing_zeros() as usize);
    let valid = L::M::from_bits(valid);
    let (nowhere, none) = (L::F::splat(-1.0), L::F::splat(f32::INFINITY));
    let mut end = box_ends::<L>(nearest.t).or_else(valid, nowhere);
    let (mut child, mut lanes, mut len) = (bvh.world.root, valid.bits(), 0);
    loop {
        worth.visit(lanes);
        if child.is_leaf() {
            intersect_leaf::<L>(bvh, child, packet, shape, keys, lanes, nearest);
            end = box_ends::<L>(nearest.t).or_else(valid, nowhere);
        } else {
            let node = &bvh.world.tree.nodes[child.node()];
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
                    debug_assert!(len < STACK);
                    let entry = &mut stack[len % STACK];
                    entered[i].or_else(L::M::from_bits(bits_of[i]), none).store(&mut entry.enter, 0);
                    entry.child = node.child(i);
                    ask_for(bvh, entry.child);
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
            let entry = &stack[len % STACK];
            lanes = L::F::load(&entry.enter, 0).le(end).bits();
            if lanes != 0 {
                child = entry.child;
                break;
            }
        }
    }
}

/// Whether anything is hit by `rays[..n]`, as far as packets find out; the others are `left`.
pub struct OccludedPackets<'a> {
    pub bvh: &'a WideBvh,
    pub rays: &'a RayBatch,
    pub n: usize,
    pub occluded: &'a mut [u8],
    pub left: &'a mut Vec<u32>,
}

impl Kernel for OccludedPackets<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { bvh, rays, n, occluded, left } = self;
        let mut stack = [(Child::inner(0), 0); STACK];
        let mut worth = Worth::default();
        for at in (0..n).step_by(L::N) {
            let packet = RayLanes::<L>::new(rays, at, &bvh.world.tree.bounds);
            let lanes = packet.valid & L::M::first(n - at).bits();
            let mut found = 0;
            let mut open = lanes;
            while open != 0 {
                let alike = packet.alike(open);
                open &= !alike;
                if alike.count_ones() > FEW && worth.pays() {
                    found |=
                        occluded_packet::<L>(bvh, &packet, alike, &rays.key[at..at + L::N], &mut stack, &mut worth);
                } else {
                    leave(left, at, alike);
                }
            }
            for (i, out) in occluded[at..n.min(at + L::N)].iter_mut().enumerate() {
                *out = (found >> i & 1) as u8;
            }
        }
    }
}

/// Which rays of `lanes` are stopped by anything, as bits.
#[inline(always)]
fn occluded_packet<L: Lanes>(
    bvh: &WideBvh,
    packet: &RayLanes<L>,
    lanes: u32,
    keys: &[u32],
    stack: &mut [(Child, u32); STACK],
    worth: &mut Worth,
) -> u32 {
    let shape = packet.shape(lanes.trailing_zeros() as usize);
    let end = box_ends::<L>(packet.t_max);
    let mut open = lanes;
    stack[0] = (bvh.world.root, lanes);
    let mut len = 1;
    while len > 0 {
        len -= 1;
        let (child, entered) = stack[len % STACK];
        let active = entered & open;
        if active == 0 {
            continue;
        }
        worth.visit(active);
        if child.is_leaf() {
            open &= !stopped::<L>(bvh, child, packet, shape, keys, active);
            if open == 0 {
                break;
            }
            continue;
        }
        let node = &bvh.world.tree.nodes[child.node()];
        for i in 0..node.count() {
            let bits = packet.test_box(&node.planes, i, shape.down, end).0 & active;
            if bits != 0 {
                debug_assert!(len < STACK);
                let child = node.child(i % WIDTH);
                ask_for(bvh, child);
                stack[len % STACK] = (child, bits);
                len += 1;
            }
        }
    }
    lanes & !open
}

/// Which rays of `lanes` a leaf stops.
#[inline(always)]
fn stopped<L: Lanes>(bvh: &WideBvh, leaf: Child, packet: &RayLanes<L>, shape: Shape, keys: &[u32], lanes: u32) -> u32 {
    let n = leaf.count();
    let rows = &bvh.world.tree.leaves.data[Leaves::offset(leaf)..][..LEAF_ROWS * n];
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
            hit = hit & !passing::<L>(bvh, word, hit.bits(), keys, u, v);
        }
        found |= hit.bits();
        if found == lanes {
            break;
        }
    }
    found
}

#[inline(always)]
fn intersect_leaf<L: Lanes>(
    bvh: &WideBvh,
    leaf: Child,
    packet: &RayLanes<L>,
    shape: Shape,
    keys: &[u32],
    lanes: u32,
    nearest: &mut NearestLanes<L>,
) {
    let n = leaf.count();
    let rows = &bvh.world.tree.leaves.data[Leaves::offset(leaf)..][..LEAF_ROWS * n];
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
        let tie = t.eq(nearest.t) & primitive.lt(nearest.primitive) & !none;
        let mut nearer = L::M::from_bits(bits) & (t.lt(nearest.t) | tie);
        if word & FILTERED != 0 {
            nearer = nearer & !passing::<L>(bvh, word, nearer.bits(), keys, u, v);
        }
        nearest.t = t.or_else(nearer, nearest.t);
        nearest.u = u.or_else(nearer, nearest.u);
        nearest.v = v.or_else(nearer, nearest.v);
        nearest.primitive = primitive.or_else(nearer, nearest.primitive);
    }
}

/// Which rays of `bits` pass the filtered triangle of `word`.
#[cold]
#[inline(never)]
fn ask(bvh: &WideBvh, word: u32, mut bits: u32, keys: &[u32], u: &[f32; MAX_LANES], v: &[f32; MAX_LANES]) -> u32 {
    let mut passing = 0;
    while bits != 0 {
        let i = bits.trailing_zeros() as usize % MAX_LANES;
        bits &= bits - 1;
        let asked = Asked { filter: bvh.filter.as_deref(), key: keys[i], instance: 0 };
        passing |= u32::from(asked.passes(word, u[i], v[i])) << i;
    }
    passing
}

/// [`ask`] with vectors.
#[inline(always)]
fn passing<L: Lanes>(bvh: &WideBvh, word: u32, bits: u32, keys: &[u32], u: L::F, v: L::F) -> L::M {
    let mut lanes = [[0.0; MAX_LANES]; 2];
    u.store(&mut lanes[0], 0);
    v.store(&mut lanes[1], 0);
    L::M::from_bits(ask(bvh, word, bits, keys, &lanes[0], &lanes[1]))
}

/// One corner, for all rays.
#[inline(always)]
fn corner<L: Lanes>(rows: &[f32], first: usize, n: usize, packet: &RayLanes<L>, shape: Shape) -> (L::F, L::F, L::F) {
    let [kx, ky, kz] = shape.axes;
    let p = [rows[first + kx * n], rows[first + ky * n], rows[first + kz * n]];
    let p = [L::F::splat(p[0]), L::F::splat(p[1]), L::F::splat(p[2])];
    sheared::<L>(p, &packet.origin, &packet.shear)
}
