//! The binary tree: binned SAH from the top down, costs of its forms from the bottom up.
//!
//! Subtrees up to `PARALLEL` primitives are one task and one array; above them the tree is made of boxes. Both halves of a
//! node are built in parallel, and what is built depends on nothing but the primitives.

use super::bins::{Binning, Bins, Plane, Split};
use super::collapse::{Costs, combine, leaf_cost};
use super::node::{Child, WIDTH};
use super::reference::{Bounds, Reference};
use super::source::Source;
use super::split::{self, SpatialSplits, Survey};
use glam::{Vec3, Vec4, Vec4Swizzles};
use rayon::prelude::*;
use simd::{Kernel, Lanes, Level, dispatch};

/// Levels of the binary tree at most: the stack of the traversal is sized by this.
pub const MAX_DEPTH: u32 = 64;
/// Subtrees up to this many primitives are built by one thread.
const PARALLEL: usize = 4096;
/// Primitives per task where a single node is binned by several threads.
const CHUNK: usize = 32 * 1024;

/// A node of the binary tree.
#[derive(Clone, Copy, Debug)]
pub struct Binary {
    /// Low and high corner of what it contains. (Two [`Bounds`] would be 32 bytes more.)
    pub corners: [[f32; 3]; 2],
    /// Its first primitive.
    pub first: u32,
    /// Its primitives.
    pub count: u32,
    /// From this node to its right child in the array; 0 for a leaf. The left child follows directly.
    right: u32,
    /// What the subtree costs as so many children.
    pub costs: Costs,
}

const _: () = assert!(size_of::<Binary>() == 64);

impl Binary {
    /// Without children, its costs unknown.
    #[inline(always)]
    fn leaf(bounds: &Bounds, first: usize, count: usize) -> Self {
        let corners = [bounds.low(), bounds.high()];
        Self { corners, first: first as u32, count: count as u32, right: 0, costs: [0.0; WIDTH - 1] }
    }

    /// Half the surface area.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let [low, high] = self.corners;
        let (x, y, z) = (high[0] - low[0], high[1] - low[1], high[2] - low[2]);
        x * y + (x + y) * z
    }
}

/// A subtree.
#[derive(Debug)]
pub enum Subtree {
    /// A node with two subtrees; its `right` means nothing.
    Node(Binary, Box<[Subtree; 2]>),
    /// All of it, depth first.
    Array(Vec<Binary>),
}

/// A place in the tree: the node there and what is below it.
#[derive(Clone, Copy)]
pub enum Place<'a> {
    /// In the upper part.
    Upper(&'a Binary, &'a [Subtree; 2]),
    /// The first of these.
    Lower(&'a [Binary]),
}

impl Subtree {
    /// Its root.
    pub fn root(&self) -> Place<'_> {
        match self {
            Self::Node(node, children) => Place::Upper(node, children),
            Self::Array(nodes) => Place::Lower(nodes),
        }
    }
}

impl<'a> Place<'a> {
    /// The node.
    #[inline(always)]
    pub fn node(self) -> &'a Binary {
        match self {
            Self::Upper(node, _) => node,
            Self::Lower(nodes) => &nodes[0],
        }
    }

    /// Its children; `None` for a leaf.
    #[inline(always)]
    pub fn children(self) -> Option<[Self; 2]> {
        match self {
            Self::Upper(_, [left, right]) => Some([left.root(), right.root()]),
            Self::Lower(nodes) => {
                let right = nodes[0].right as usize;
                (right != 0).then(|| [Self::Lower(&nodes[1..]), Self::Lower(&nodes[right..])])
            }
        }
    }
}

/// The binary tree, and the primitives in its order.
#[derive(Debug)]
pub struct BinaryTree {
    /// `None` if there are no primitives.
    pub root: Option<Subtree>,
    /// In the order of the leaves.
    pub references: Vec<Reference>,
    /// References that may share a leaf: 8 triangles, 1 box.
    pub leaf_size: usize,
    /// References beyond one for each triangle.
    pub splits: usize,
}

impl BinaryTree {
    /// The tree over all triangles that can be hit.
    pub fn build(triangles: &Source<'_>, splits: SpatialSplits) -> Self {
        let n = triangles.len();
        assert!(n < Child::MAX_TRIANGLES, "the bvh holds up to 2^28 triangles, not {n}");
        let mut references: Vec<_> =
            (0..n).into_par_iter().with_min_len(PARALLEL).map(|i| Reference::of_triangle(triangles, i)).collect();
        let level = Level::best_of_8();
        let survey = Survey::of(&references, level);
        if !survey.is_complete {
            references.retain(Reference::is_something);
        }
        let is_split = match splits {
            SpatialSplits::Auto => split::pays(triangles, &references, &survey),
            SpatialSplits::Never => false,
            SpatialSplits::Always => true,
        };
        if is_split {
            let whole = references.len();
            references = split::split(triangles, references, &survey.bounds);
            let splits = references.len() - whole;
            return Self { splits, ..Self::over(references, WIDTH, level, None) };
        }
        Self::over(references, WIDTH, level, Some(survey.bounds))
    }

    /// The tree over these references to triangles.
    pub fn of_references(references: Vec<Reference>) -> Self {
        Self::over(references, WIDTH, Level::best_of_8(), None)
    }

    /// The tree over the boxes that are not empty, each in a leaf of its own.
    pub fn of_boxes(boxes: &[Option<[Vec3; 2]>]) -> Self {
        let n = boxes.len();
        assert!(n <= Child::MAX_BOXES, "the bvh holds up to 2^30 boxes, not {n}");
        let references = boxes.iter().enumerate().filter_map(|(i, b)| Reference::of_box((*b)?, i)).collect();
        Self::over(references, 1, Level::best_of_8(), None)
    }

    /// `bounds` are those of the references, if they are known.
    fn over(mut references: Vec<Reference>, leaf_size: usize, level: Level, bounds: Option<Bounds>) -> Self {
        if references.is_empty() {
            return Self { root: None, references, leaf_size, splits: 0 };
        }
        let builder = Builder { level, leaf_size };
        let root = builder.subtree(&mut references, Range { first: 0, depth: 0, bounds });
        Self { root: Some(root), references, leaf_size, splits: 0 }
    }

    /// The SAH cost: node visits, or as much work, of a line through the bounds.
    pub fn cost(&self) -> f32 {
        self.root.as_ref().map_or(0.0, |root| root.root().node().costs[0] / root.root().node().half_area())
    }
}

/// What a subtree is built over, beside its primitives.
#[derive(Clone, Copy)]
struct Range {
    /// Number of its first primitive.
    first: usize,
    /// Levels above it.
    depth: u32,
    /// Bounds of its primitives, where they are known.
    bounds: Option<Bounds>,
}

#[derive(Clone, Copy)]
struct Builder {
    level: Level,
    leaf_size: usize,
}

impl Builder {
    /// Builds the subtree over `references`, which are put in its order.
    fn subtree(self, references: &mut [Reference], range: Range) -> Subtree {
        let n = references.len();
        if n <= PARALLEL {
            return Subtree::Array(dispatch(self.level, Small { builder: self, references, range }));
        }
        let (bounds, mid, sides) = self.split_large(references, &range);
        let (left, right) = references.split_at_mut(mid);
        let below = |first, bounds| Range { first, depth: range.depth + 1, bounds };
        let (left, right) = rayon::join(
            || self.subtree(left, below(range.first, sides.map(|s| s[0]))),
            || self.subtree(right, below(range.first + mid, sides.map(|s| s[1]))),
        );
        let mut node = Binary::leaf(&bounds, range.first, n);
        node.costs = combine(&node, self.leaf_size, &left.root().node().costs, &right.root().node().costs);
        Subtree::Node(node, Box::new([left, right]))
    }

    /// Splits many primitives: their bounds, how many go left, and the bounds of both sides where they are known.
    fn split_large(self, references: &mut [Reference], range: &Range) -> (Bounds, usize, Option<[Bounds; 2]>) {
        let n = references.len();
        let chunks = || references.par_chunks(CHUNK);
        let bounds = range.bounds.unwrap_or_else(|| {
            chunks()
                .map(|references| dispatch(self.level, Enclose { references }))
                .reduce(|| Bounds::EMPTY, |a, b| dispatch(self.level, Union(&a, &b)))
        });
        let centres = chunks()
            .map(|references| dispatch(self.level, Centres { references }))
            .reduce(|| [Vec4::INFINITY, Vec4::NEG_INFINITY], |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        if is_shallow(n, range.depth) {
            let binning = Binning::new(n, centres[0], centres[1]);
            let bins = chunks()
                .map(|references| dispatch(self.level, Fill { binning: &binning, references }))
                .reduce_with(|mut a, b| {
                    dispatch(self.level, Add(&mut a, &b));
                    a
                });
            if let Some(split) = bins.and_then(|bins| dispatch(self.level, Best { bins: &bins, binning: &binning })) {
                let mid = dispatch(self.level, Partition { references: &mut *references, plane: split.plane });
                if 0 < mid && mid < n {
                    return (bounds, mid, Some(split.bounds));
                }
            }
        }
        (bounds, halve(references, centres), None)
    }
}

/// Whether halves of halves from here on would still end in time.
#[inline(always)]
fn is_shallow(n: usize, depth: u32) -> bool {
    depth + (usize::BITS - (n - 1).leading_zeros()) < MAX_DEPTH
}

/// Orders by the centres along their longest axis and returns half the number. Equal centres stay in the order they
/// have, which depends on nothing but the input.
fn halve(references: &mut [Reference], [low, high]: [Vec4; 2]) -> usize {
    let n = references.len();
    let extent = high - low;
    let axis = extent.xyz().max_position();
    if extent[axis] > 0.0 {
        let key = |r: &Reference| (r.centre()[axis], r.primitive());
        references.select_nth_unstable_by(n / 2, |a, b| key(a).0.total_cmp(&key(b).0).then(key(a).1.cmp(&key(b).1)));
    }
    n / 2
}

/// Bounds of the centres (doubled).
#[inline(always)]
fn centres(references: &[Reference]) -> [Vec4; 2] {
    let mut out = [Vec4::INFINITY, Vec4::NEG_INFINITY];
    for r in references {
        let c = r.centre();
        out = [out[0].min(c), out[1].max(c)];
    }
    out
}

/// Moves those left of `plane` to the front and returns how many they are. Without a branch on where each goes, which
/// no predictor could know.
#[inline(always)]
fn partition(references: &mut [Reference], plane: &Plane) -> usize {
    let mut mid = 0;
    for i in 0..references.len() {
        let is_left = plane.is_left(&references[i]);
        references.swap(i, mid);
        mid += usize::from(is_left);
    }
    mid
}

#[inline(always)]
fn enclose<L: Lanes>(references: &[Reference]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for r in references {
        bounds = bounds.union::<L>(&r.0);
    }
    bounds
}

/// A subtree built by one thread.
struct Small<'a> {
    builder: Builder,
    references: &'a mut [Reference],
    range: Range,
}

/// A part of [`Small`] still to be built.
#[derive(Clone, Copy)]
struct Pending {
    first: usize,
    end: usize,
    depth: u32,
    /// The node whose right child it is; none's for left children.
    parent: usize,
    bounds: Bounds,
}

const NO_PARENT: usize = usize::MAX;

impl Kernel for Small<'_> {
    type Output = Vec<Binary>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<Binary> {
        let Self { builder, references, range } = self;
        let n = references.len();
        let mut nodes: Vec<Binary> = Vec::with_capacity(n / 2 + 1);
        let mut bins = Bins::new();
        let bounds = match range.bounds {
            Some(bounds) => bounds,
            None => enclose::<L>(references),
        };
        let mut pending = vec![Pending { first: 0, end: n, depth: range.depth, parent: NO_PARENT, bounds }];
        while let Some(part) = pending.pop() {
            let at = nodes.len();
            if part.parent != NO_PARENT {
                nodes[part.parent].right = (at - part.parent) as u32;
            }
            let references = &mut references[part.first..part.end];
            nodes.push(Binary::leaf(&part.bounds, range.first + part.first, references.len()));
            let Some((mid, sides)) = split_small::<L>(references, &part, builder.leaf_size, &mut bins) else {
                continue;
            };
            let mid = part.first + mid;
            let depth = part.depth + 1;
            pending.push(Pending { first: mid, depth, parent: at, bounds: sides[1], ..part });
            pending.push(Pending { end: mid, depth, parent: NO_PARENT, bounds: sides[0], ..part });
        }
        for i in (0..nodes.len()).rev() {
            let (node, leaf_size) = (&nodes[i], builder.leaf_size);
            nodes[i].costs = match node.right as usize {
                0 => [leaf_cost(node, leaf_size); WIDTH - 1],
                right => combine(node, leaf_size, &nodes[i + 1].costs, &nodes[i + right].costs),
            };
        }
        nodes.shrink_to_fit();
        nodes
    }
}

/// Splits the primitives of a small node: how many go left, and the bounds of both sides; `None` for a leaf.
#[inline(always)]
fn split_small<L: Lanes>(
    references: &mut [Reference],
    part: &Pending,
    leaf_size: usize,
    bins: &mut Bins,
) -> Option<(usize, [Bounds; 2])> {
    let n = references.len();
    if n <= UNDIVIDED.min(leaf_size) {
        return None;
    }
    let centres = centres(references);
    if is_shallow(n, part.depth) {
        let binning = Binning::new(n, centres[0], centres[1]);
        bins.fill::<L>(&binning, references);
        let bias = if n <= leaf_size { LEAF_BIAS } else { 0.0 };
        if let Some(split) = bins.best::<L>(&binning, bias) {
            if n <= leaf_size && split.cost >= SPLIT_ANYWAY * part.bounds.half_area() * (n as f32 + LEAF_BIAS) {
                return None;
            }
            let mid = partition(references, &split.plane);
            if 0 < mid && mid < n {
                return Some((mid, split.bounds));
            }
        }
    }
    if n <= leaf_size {
        return None;
    }
    let mid = halve(references, centres);
    Some((mid, [enclose::<L>(&references[..mid]), enclose::<L>(&references[mid..])]))
}

/// A node that could be a leaf is split if that costs at most this much more: halves of halves may cost less again. At 1
/// a scene of thin triangles cost 2 % more by the SAH; above 1.2 nothing changes but the time.
const SPLIT_ANYWAY: f32 = 1.2;
/// Triangles that always share a leaf. Dividing them gained 0.1 % by the SAH and took a quarter of the time.
const UNDIVIDED: usize = 3;
/// What visiting a leaf costs, in triangles.
const LEAF_BIAS: f32 = super::collapse::LEAF_COST / super::collapse::TRIANGLE_COST;

/// Bounds of references.
struct Enclose<'a> {
    references: &'a [Reference],
}

impl Kernel for Enclose<'_> {
    type Output = Bounds;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Bounds {
        enclose::<L>(self.references)
    }
}

/// Both bounds together.
struct Union<'a>(&'a Bounds, &'a Bounds);

impl Kernel for Union<'_> {
    type Output = Bounds;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Bounds {
        self.0.union::<L>(self.1)
    }
}

/// Bounds of centres.
struct Centres<'a> {
    references: &'a [Reference],
}

impl Kernel for Centres<'_> {
    type Output = [Vec4; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [Vec4; 2] {
        centres(self.references)
    }
}

/// Bins of references.
struct Fill<'a> {
    binning: &'a Binning,
    references: &'a [Reference],
}

impl Kernel for Fill<'_> {
    type Output = Bins;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Bins {
        let mut bins = Bins::new();
        bins.fill::<L>(self.binning, self.references);
        bins
    }
}

/// Adds the second bins to the first.
struct Add<'a>(&'a mut Bins, &'a Bins);

impl Kernel for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.0.add::<L>(self.1);
    }
}

/// The best split.
struct Best<'a> {
    bins: &'a Bins,
    binning: &'a Binning,
}

impl Kernel for Best<'_> {
    type Output = Option<Split>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<Split> {
        self.bins.best::<L>(self.binning, 0.0)
    }
}

/// Orders references by a plane.
struct Partition<'a> {
    references: &'a mut [Reference],
    plane: Plane,
}

impl Kernel for Partition<'_> {
    type Output = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        partition(self.references, &self.plane)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes(n: usize) -> Vec<Reference> {
        let mut state = 7u32;
        let mut unit = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 * 2f32.powi(-24)
        };
        let mut random = || Vec3::new(unit(), unit(), unit());
        let corners = (0..n).map(|_| (random(), random() * 0.01));
        corners.enumerate().filter_map(|(i, (low, size))| Reference::of_box([low, low + size], i)).collect()
    }

    #[test]
    fn plain_code_builds_the_same_tree() {
        let build = |level| format!("{:?}", BinaryTree::over(boxes(10_000), WIDTH, level, None));
        assert_eq!(build(Level::Portable8), build(Level::best_of_8()));
    }

    #[test]
    fn infinite_boxes_end_in_leaves() {
        let mut references = boxes(10_000);
        for (i, reference) in references.iter_mut().enumerate() {
            match i % 3 {
                0 => reference.0.0[i % 7 / 4 * 4 + i % 3] = f32::NEG_INFINITY,
                1 => reference.0.0[i % 7] = f32::NAN,
                _ => {}
            }
        }
        let tree = BinaryTree::of_references(references);
        let mut primitives: Vec<_> = tree.references.iter().map(Reference::primitive).collect();
        primitives.sort_unstable();
        primitives.dedup();
        assert!(primitives.len() > 8000);
        let mut places = vec![tree.root.as_ref().unwrap().root()];
        let mut sum = 0;
        while let Some(place) = places.pop() {
            match place.children() {
                Some(children) => places.extend(children),
                None => {
                    assert!((1..=8).contains(&place.node().count));
                    sum += place.node().count;
                }
            }
        }
        assert_eq!(sum, 10_000);
    }
}
