//! The kernels: a batch of rays through the tree, one ray at a time, 8 boxes or triangles at a time.
//!
//! After Wald, Benthin and Boulos 2008, "Getting Rid of Packets", and Embree's single-ray kernels: hit children are
//! ordered by where the ray enters them; the common counts 1 and 2 have their own paths.

use super::WideBvh;
use super::build::MAX_DEPTH;
use super::leaf::{self, Asked, Nearest};
use super::node::{Child, WIDTH};
use super::ray::{RayLanes, SingleRay, box_end};
use crate::accel::{HitBatch, MISS, RayBatch};
use simd::{Float, Kernel, Lanes};
use std::ops::Range;

/// Entries of the stack, a power of two. A node adds at most 7 more than it takes.
pub const STACK: usize = 512;
const _: () = assert!(MAX_DEPTH as usize * (WIDTH - 1) < STACK && STACK.is_power_of_two());

/// A child still to be visited.
#[derive(Clone, Copy)]
struct Entry {
    child: Child,
    /// Where the ray enters it.
    t: f32,
}

/// What is still to be visited, the next on top. Indices are masked: the bound holds by the assertion above.
struct Stack {
    entries: [Entry; STACK],
    len: usize,
}

impl Stack {
    #[inline(always)]
    fn new() -> Self {
        Self { entries: [Entry { child: Child::inner(0), t: 0.0 }; STACK], len: 0 }
    }

    #[inline(always)]
    fn push(&mut self, entry: Entry) {
        debug_assert!(self.len < STACK);
        self.entries[self.len % STACK] = entry;
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Entry> {
        self.len = self.len.checked_sub(1)?;
        Some(self.entries[self.len % STACK])
    }

    /// Sinks the topmost entry among those from `base` on, so that the nearest ends on top.
    #[inline(always)]
    fn sort_last(&mut self, base: usize) {
        let mut i = self.len - 1;
        let entry = self.entries[i % STACK];
        while i > base && self.entries[(i - 1) % STACK].t < entry.t {
            self.entries[i % STACK] = self.entries[(i - 1) % STACK];
            i -= 1;
        }
        self.entries[i % STACK] = entry;
    }
}

/// Nearest hits of `rays[range]`.
pub struct Intersect<'a> {
    pub bvh: &'a WideBvh,
    pub rays: &'a RayBatch,
    pub range: Range<usize>,
    pub hits: &'a mut HitBatch,
}

impl Kernel for Intersect<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        assert!(L::N == WIDTH, "8 children, 8 lanes");
        let Self { bvh, rays, range, hits } = self;
        if range.is_empty() {
            return;
        }
        let mut stack = Stack::new();
        let mut lanes = RayLanes::<L>::new(rays, range.start / WIDTH * WIDTH, &bvh.world.bounds);
        let mut stored = [[0.0; WIDTH]; 18];
        lanes.store(&mut stored);
        for i in range {
            let lane = i % WIDTH;
            if lane == 0 {
                lanes = RayLanes::new(rays, i, &bvh.world.bounds);
                lanes.store(&mut stored);
            }
            let mut nearest = Nearest { t: rays.t_max[i], u: 0.0, v: 0.0, primitive: MISS };
            if lanes.valid >> lane & 1 == 1 {
                let ray = SingleRay::<L>::new(&stored, lane, lanes.shape(lane));
                let asked = Asked { filter: bvh.filter.as_deref(), key: rays.key[i], instance: 0 };
                intersect_one(bvh, &ray, &asked, &mut stack, &mut nearest);
            }
            (hits.t[i], hits.u[i], hits.v[i]) = (nearest.t, nearest.u, nearest.v);
            hits.primitive[i] = nearest.primitive;
            hits.instance[i] = 0;
        }
    }
}

#[inline(always)]
fn intersect_one<L: Lanes>(
    bvh: &WideBvh,
    ray: &SingleRay<L>,
    asked: &Asked<'_>,
    stack: &mut Stack,
    nearest: &mut Nearest,
) {
    let mut end = box_end(nearest.t);
    stack.len = 0;
    let mut child = Child::inner(0);
    loop {
        while !child.is_leaf() {
            let node = &bvh.world.nodes[child.node()];
            let (mut bits, enter) = ray.test_boxes(&node.planes, L::F::splat(end));
            if bits == 0 {
                break;
            }
            let mut ts = [0.0; WIDTH];
            enter.store(&mut ts, 0);
            let mut first = take(&mut bits, &node.children, &ts);
            if bits != 0 {
                let mut second = take(&mut bits, &node.children, &ts);
                if second.t < first.t {
                    (first, second) = (second, first);
                }
                if bits == 0 {
                    stack.push(second);
                } else {
                    let base = stack.len;
                    stack.push(second);
                    stack.push(first);
                    while bits != 0 {
                        stack.push(take(&mut bits, &node.children, &ts));
                        stack.sort_last(base);
                    }
                    first = stack.pop().expect("three were pushed");
                }
            }
            child = first.child;
        }
        if child.is_leaf() && leaf::intersect(&bvh.world.leaves, child, ray, asked, nearest) {
            end = box_end(nearest.t);
        }
        child = loop {
            match stack.pop() {
                None => return,
                Some(entry) if entry.t <= end => break entry.child,
                Some(_) => {}
            }
        };
    }
}

/// The child of the lowest bit, which is removed.
#[inline(always)]
fn take(bits: &mut u32, children: &[Child; WIDTH], enter: &[f32; WIDTH]) -> Entry {
    let i = bits.trailing_zeros() as usize % WIDTH;
    *bits &= *bits - 1;
    Entry { child: children[i], t: enter[i] }
}

/// Whether anything is hit by `rays[..n]`.
pub struct Occluded<'a> {
    pub bvh: &'a WideBvh,
    pub rays: &'a RayBatch,
    pub n: usize,
    pub occluded: &'a mut [u8],
}

impl Kernel for Occluded<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        assert!(L::N == WIDTH, "8 children, 8 lanes");
        if self.n == 0 {
            return;
        }
        let mut stack = Stack::new();
        let mut lanes = RayLanes::<L>::new(self.rays, 0, &self.bvh.world.bounds);
        let mut stored = [[0.0; WIDTH]; 18];
        lanes.store(&mut stored);
        for (i, out) in self.occluded[..self.n].iter_mut().enumerate() {
            let lane = i % WIDTH;
            if lane == 0 {
                lanes = RayLanes::new(self.rays, i, &self.bvh.world.bounds);
                lanes.store(&mut stored);
            }
            *out = 0;
            if lanes.valid >> lane & 1 == 1 {
                let ray = SingleRay::<L>::new(&stored, lane, lanes.shape(lane));
                let asked = Asked { filter: self.bvh.filter.as_deref(), key: self.rays.key[i], instance: 0 };
                *out = u8::from(occluded_one(self.bvh, &ray, &asked, &mut stack, self.rays.t_max[i]));
            }
        }
    }
}

#[inline(always)]
fn occluded_one<L: Lanes>(bvh: &WideBvh, ray: &SingleRay<L>, asked: &Asked<'_>, stack: &mut Stack, t_max: f32) -> bool {
    let end = L::F::splat(box_end(t_max));
    stack.len = 0;
    let mut child = Child::inner(0);
    loop {
        if child.is_leaf() {
            if leaf::occluded(&bvh.world.leaves, child, ray, asked, t_max) {
                return true;
            }
        } else {
            let node = &bvh.world.nodes[child.node()];
            let (mut bits, _) = ray.test_boxes(&node.planes, end);
            while bits != 0 {
                let i = bits.trailing_zeros() as usize % WIDTH;
                bits &= bits - 1;
                stack.push(Entry { child: node.children[i], t: 0.0 });
            }
        }
        match stack.pop() {
            None => return false,
            Some(entry) => child = entry.child,
        }
    }
}
