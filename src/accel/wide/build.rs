//! The binary tree: binned SAH.
//!
//! After Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies". All three axes are binned in one
//! pass over the primitives.
//!
//! The subtree of n primitives owns 2n - 1 consecutive slots of one array, its left child beginning right behind it:
//! both halves can be built in parallel and the result is the same however many threads there are.

use super::collapse::{Costs, combine, leaf_cost};
use super::node::Child;
use super::source::Source;
use crate::accel::woop::can_be_hit;
use glam::{Vec3, Vec4, Vec4Swizzles};
use rayon::prelude::*;

/// Bins per axis.
const BINS: usize = 16;
/// Levels of the binary tree at most: the stack of the traversal is sized by this.
pub const MAX_DEPTH: u32 = 64;
/// Splitting stops here; the collapse decides how many of these share a leaf.
const SMALL: usize = 2;
/// Subtrees below this many primitives are built by one thread.
const PARALLEL: usize = 4096;
/// Primitives per task where a single node is binned by several threads.
const CHUNK: usize = 32 * 1024;

/// Bounds of one triangle; `low.w` carries its index.
#[derive(Clone, Copy, Debug)]
pub struct Reference {
    low: Vec4,
    high: Vec4,
}

impl Reference {
    /// The triangle's bounds, padded by what the watertight test may be off by: the ray's distance to a vertex is
    /// rounded relative to the triangle's extent (about 10 eps of it, 16 are taken; the share that grows with the
    /// distance is the ray's, see `ray.rs`).
    fn new(triangles: &Source<'_>, i: usize) -> Option<Self> {
        let [a, b, c] = triangles.corners(i);
        if !can_be_hit([a, b, c]) {
            return None;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let pad = (high - low).max_element() * 2f32.powi(-20);
        let low = (low - pad).to_array().map(f32::next_down);
        let high = (high + pad).to_array().map(f32::next_up);
        // Exponents 0x80 to 0x9f: a normal number, so that min, max and sums of w cost nothing and trap nothing.
        let tag = f32::from_bits(i as u32 | 1 << 30);
        Some(Self { low: Vec3::from(low).extend(tag), high: Vec3::from(high).extend(0.0) })
    }

    /// Index of the triangle in the source.
    pub fn primitive(&self) -> u32 {
        self.low.w.to_bits() & !(1 << 30)
    }

    /// Twice the centre.
    #[inline(always)]
    fn centre(&self) -> Vec4 {
        self.low + self.high
    }
}

/// A box; `w` means nothing.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Low corner.
    pub low: Vec4,
    /// High corner.
    pub high: Vec4,
}

impl Bounds {
    const EMPTY: Self = Self { low: Vec4::splat(f32::INFINITY), high: Vec4::splat(f32::NEG_INFINITY) };

    #[inline(always)]
    fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Half the surface area.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let d = (self.high - self.low).xyz();
        d.x * d.y + (d.x + d.y) * d.z
    }
}

/// A node of the binary tree.
#[derive(Clone, Copy, Debug)]
pub struct Binary {
    /// What it contains.
    pub bounds: Bounds,
    /// Its first primitive.
    pub first: u32,
    /// Its primitives.
    pub count: u32,
    /// Slots from this node to its right child; 0 for a leaf. The left child follows directly.
    pub right: u32,
    /// What the subtree costs as so many children.
    pub costs: Costs,
}

impl Binary {
    const UNUSED: Self = Self { bounds: Bounds::EMPTY, first: 0, count: 0, right: 0, costs: [0.0; 7] };
}

/// The binary tree in depth-first slots (some unused), and the primitives in its order.
#[derive(Debug)]
pub struct BinaryTree {
    /// Node 0 is the root; empty if there are no primitives.
    pub nodes: Vec<Binary>,
    /// In the order of the leaves.
    pub references: Vec<Reference>,
}

impl BinaryTree {
    /// The tree over all triangles that can be hit.
    pub fn build(triangles: &Source<'_>) -> Self {
        let n = triangles.len();
        assert!(n < Child::MAX_TRIANGLES, "the bvh holds up to 2^28 triangles, not {n}");
        let mut references: Vec<_> =
            (0..n).into_par_iter().with_min_len(PARALLEL).filter_map(|i| Reference::new(triangles, i)).collect();
        if references.is_empty() {
            return Self { nodes: Vec::new(), references };
        }
        let mut nodes = vec![Binary::UNUSED; 2 * references.len() - 1];
        subdivide(&mut nodes, &mut references, 0, 0);
        Self { nodes, references }
    }
}

/// Builds the subtree over `references` into `nodes`.
fn subdivide(nodes: &mut [Binary], references: &mut [Reference], first: usize, depth: u32) {
    let n = references.len();
    debug_assert_eq!(nodes.len(), 2 * n - 1);
    let (bounds, centres) = extents(references);
    let mut node = Binary { bounds, first: first as u32, count: n as u32, right: 0, costs: [leaf_cost(&bounds, n); 7] };
    if n > SMALL {
        let mid = split(references, &centres, depth);
        debug_assert!(0 < mid && mid < n);
        let (head, rest) = nodes.split_first_mut().expect("a subtree has at least one slot");
        let (left, right) = rest.split_at_mut(2 * mid - 1);
        let (left_refs, right_refs) = references.split_at_mut(mid);
        if n >= PARALLEL {
            rayon::join(
                || subdivide(left, left_refs, first, depth + 1),
                || subdivide(right, right_refs, first + mid, depth + 1),
            );
        } else {
            subdivide(left, left_refs, first, depth + 1);
            subdivide(right, right_refs, first + mid, depth + 1);
        }
        node.right = 2 * mid as u32;
        node.costs = combine(&bounds, n, &left[0].costs, &right[0].costs);
        *head = node;
    } else {
        nodes[0] = node;
    }
}

/// Bounds of the primitives and of their (doubled) centres.
fn extents(references: &[Reference]) -> (Bounds, Bounds) {
    let grow = |(bounds, centres): (Bounds, Bounds), r: &Reference| {
        let c = r.centre();
        (bounds.union(Bounds { low: r.low, high: r.high }), centres.union(Bounds { low: c, high: c }))
    };
    let empty = (Bounds::EMPTY, Bounds::EMPTY);
    if references.len() < 2 * CHUNK {
        return references.iter().fold(empty, grow);
    }
    let parts = references.par_chunks(CHUNK).map(|chunk| chunk.iter().fold(empty, grow));
    parts.reduce(|| empty, |a, b| (a.0.union(b.0), a.1.union(b.1)))
}

/// Orders `references` into two parts and returns the size of the first: by the SAH, or in halves when that finds no
/// split or the tree would become too deep.
fn split(references: &mut [Reference], centres: &Bounds, depth: u32) -> usize {
    let n = references.len();
    let levels_needed = usize::BITS - (n - 1).leading_zeros();
    if depth + levels_needed < MAX_DEPTH
        && let Some(plane) = Binning::new(centres).best(references)
    {
        return partition(references, |r| plane.is_left(r));
    }
    // Equal centres stay in the order they have, which depends on nothing but the input.
    let extent = centres.high - centres.low;
    let axis = extent.xyz().max_position();
    if extent[axis] > 0.0 {
        let key = |r: &Reference| (r.centre()[axis], r.primitive());
        references.select_nth_unstable_by(n / 2, |a, b| key(a).0.total_cmp(&key(b).0).then(key(a).1.cmp(&key(b).1)));
    }
    n / 2
}

/// Moves those that are `left` to the front and returns how many they are.
fn partition(references: &mut [Reference], left: impl Fn(&Reference) -> bool) -> usize {
    let (mut i, mut j) = (0, references.len());
    loop {
        while i < j && left(&references[i]) {
            i += 1;
        }
        while i < j && !left(&references[j - 1]) {
            j -= 1;
        }
        if i >= j {
            return i;
        }
        references.swap(i, j - 1);
    }
}

/// One bin.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: u32,
}

const EMPTY_BIN: Bin = Bin { bounds: Bounds::EMPTY, count: 0 };

/// How centres map to bins.
#[derive(Clone, Copy)]
struct Binning {
    low: Vec4,
    scale: Vec4,
    last: Vec4,
}

/// A split: bins up to `bin` of `axis` go left.
struct Plane {
    binning: Binning,
    axis: usize,
    bin: u32,
}

impl Plane {
    #[inline(always)]
    fn is_left(&self, r: &Reference) -> bool {
        self.binning.bins(r)[self.axis] <= self.bin
    }
}

impl Binning {
    fn new(centres: &Bounds) -> Self {
        // Slightly fewer bins than there are, so that the highest centre falls into the last one; an extent of zero, or
        // one so small that the quotient overflows, puts all into bin 0, where there is nothing to split.
        let scale = (centres.high - centres.low).to_array().map(|extent| {
            let scale = BINS as f32 * (1.0 - f32::EPSILON) / extent;
            if scale.is_finite() { scale } else { 0.0 }
        });
        Self { low: centres.low, scale: Vec4::from_array(scale), last: Vec4::splat(BINS as f32 - 1.0) }
    }

    #[inline(always)]
    fn bins(&self, r: &Reference) -> [u32; 3] {
        let b = ((r.centre() - self.low) * self.scale).min(self.last).to_array();
        [b[0] as i32 as u32, b[1] as i32 as u32, b[2] as i32 as u32]
    }

    fn fill(&self, references: &[Reference]) -> [[Bin; BINS]; 3] {
        let mut bins = [[EMPTY_BIN; BINS]; 3];
        for r in references {
            let bounds = Bounds { low: r.low, high: r.high };
            for (axis, i) in self.bins(r).into_iter().enumerate() {
                let bin = &mut bins[axis][i as usize % BINS];
                bin.bounds = bin.bounds.union(bounds);
                bin.count += 1;
            }
        }
        bins
    }

    fn fill_parallel(&self, references: &[Reference]) -> [[Bin; BINS]; 3] {
        if references.len() < 2 * CHUNK {
            return self.fill(references);
        }
        references.par_chunks(CHUNK).map(|chunk| self.fill(chunk)).reduce(
            || [[EMPTY_BIN; BINS]; 3],
            |mut a, b| {
                for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
                    *a = Bin { bounds: a.bounds.union(b.bounds), count: a.count + b.count };
                }
                a
            },
        )
    }

    /// The split with the least area times primitives, if any has primitives on both sides.
    fn best(self, references: &[Reference]) -> Option<Plane> {
        let bins = self.fill_parallel(references);
        let mut best = (f32::INFINITY, 0, 0);
        for (axis, bins) in bins.iter().enumerate() {
            if self.scale[axis] == 0.0 {
                continue;
            }
            let mut right_costs = [0.0; BINS];
            let (mut right, mut count) = (Bounds::EMPTY, 0);
            for i in (1..BINS).rev() {
                right = right.union(bins[i].bounds);
                count += bins[i].count;
                right_costs[i] = if count > 0 { right.half_area() * count as f32 } else { f32::INFINITY };
            }
            let (mut left, mut count) = (Bounds::EMPTY, 0);
            for i in 0..BINS - 1 {
                left = left.union(bins[i].bounds);
                count += bins[i].count;
                let cost = if count > 0 { left.half_area() * count as f32 } else { f32::INFINITY };
                if cost + right_costs[i + 1] < best.0 {
                    best = (cost + right_costs[i + 1], axis, i as u32);
                }
            }
        }
        (best.0 < f32::INFINITY).then_some(Plane { binning: self, axis: best.1, bin: best.2 })
    }
}
