//! From the binary tree to the 8-wide one: which binary nodes survive, and which become leaves.
//!
//! After Ylitie, Karras and Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs",
//! section 3.1 (itself after Wald, Benthin and Boulos 2008): dynamic programming over the binary tree finds the collapse
//! of least SAH cost.

use super::build::{Binary, BinaryTree, Place};
use super::node::{Child, LEAF_ROWS, Leaves, Node, WIDTH};
use super::reference::Reference;
use super::source::Source;
use rayon::prelude::*;

/// Least cost of a subtree that may take up to 1, 2, ... 7 lanes of the node above it.
pub type Costs = [f32; WIDTH - 1];

/// Cost of a node visit, the unit.
const NODE_COST: f32 = 1.0;
/// Cost of a leaf visit and of each triangle in it: 8 are tested at once, but read one by one.
pub const LEAF_COST: f32 = 0.7;
/// See [`LEAF_COST`].
pub const TRIANGLE_COST: f32 = 0.1;
/// Wide nodes over at most this many primitives are written by one thread.
const TASK: usize = 16 * 1024;

/// Cost of a binary node as a leaf, where up to `most` triangles may share one. What a box costs is the same however they
/// are put together, so boxes take these costs too.
#[inline(always)]
pub fn leaf_cost(node: &Binary, most: usize) -> f32 {
    let n = node.count as usize;
    if n <= most { node.half_area() * (LEAF_COST + TRIANGLE_COST * n as f32) } else { f32::INFINITY }
}

/// Costs of a binary node from those of its children.
#[inline(always)]
pub fn combine(node: &Binary, leaf_size: usize, left: &Costs, right: &Costs) -> Costs {
    // More lanes never cost more, so lanes are always handed out completely: the least of left[i] + right[k - i] for k
    // of 2 to 8 lanes.
    let mut padded = [f32::INFINITY; 2 * WIDTH];
    padded[WIDTH - 1..2 * WIDTH - 2].copy_from_slice(right);
    let mut shared = [f32::INFINITY; WIDTH];
    for i in 1..WIDTH {
        for (k, shared) in shared.iter_mut().enumerate() {
            let cost = left[i - 1] + padded[WIDTH - i + k];
            *shared = if cost < *shared { cost } else { *shared };
        }
    }
    let one = leaf_cost(node, leaf_size).min(node.half_area() * NODE_COST + shared[WIDTH - 2]);
    let mut costs = [one; WIDTH - 1];
    for (cost, shared) in costs[1..].iter_mut().zip(shared) {
        *cost = one.min(shared);
    }
    costs
}

/// The wide tree: nodes (the root first), leaves and depth in nodes.
pub struct Collapsed {
    pub nodes: Vec<Node>,
    pub leaves: Leaves,
    pub depth: usize,
}

/// Collapses `tree`, which is over `triangles` or, without them, over boxes. The upper nodes come first, then what is
/// below them, task by task, all depth first; leaves come in the order of the tree.
pub fn collapse(tree: &BinaryTree, triangles: Option<&Source<'_>>) -> Collapsed {
    let n = if triangles.is_some() { tree.references.len() } else { 0 };
    let mut data = vec![0.0; (n + 1) * LEAF_ROWS + WIDTH];
    // With 1 to 2 million triangles: 1.03 times the speed of diffuse rays, 1.05 to 1.1 of rays anywhere.
    simd::prefer_large_pages(&mut data);
    // Leaf 0 is one triangle of NaN: what the unused lanes lead to.
    data[..LEAF_ROWS - 1].fill(f32::NAN);
    data[LEAF_ROWS - 1] = f32::from_bits(u32::MAX);
    data[(n + 1) * LEAF_ROWS..].fill(f32::NAN);
    let Some(root) = &tree.root else {
        return Collapsed { nodes: vec![Node::EMPTY], leaves: Leaves { data }, depth: 1 };
    };
    let mut upper = Writer { tree, triangles, nodes: Vec::new(), depth: 1, out: Out::Tasks(Vec::new()) };
    upper.node(root.root(), 1);
    let Writer { mut nodes, mut depth, out, .. } = upper;
    let Out::Tasks(tasks) = out else { unreachable!("the writer keeps what it was given") };
    // Tasks come in the order of the references, and every reference is in one.
    let mut rest = &mut data[LEAF_ROWS..];
    let mut shares = Vec::with_capacity(tasks.len());
    for task in tasks {
        let count = if triangles.is_some() { task.place.node().count as usize } else { 0 };
        let (share, others) = rest.split_at_mut(count * LEAF_ROWS);
        rest = others;
        shares.push((task, share));
    }
    let parts: Vec<_> = shares.into_par_iter().map(|(task, data)| task.run(tree, triangles, data)).collect();
    nodes.reserve_exact(parts.iter().map(|part| part.nodes.len()).sum());
    simd::prefer_large_pages(nodes.spare_capacity_mut());
    for part in parts {
        let base = nodes.len();
        if let Some((parent, lane)) = part.parent {
            nodes[parent].replace(lane, Child::inner(base));
        }
        nodes.extend(part.nodes.iter().map(|node| node.moved(base)));
        depth = depth.max(part.depth);
    }
    Collapsed { nodes, leaves: Leaves { data }, depth }
}

/// Something below the upper nodes.
struct Task<'a> {
    place: Place<'a>,
    /// Its level if it is a node.
    level: usize,
    /// Node and lane that lead to it; `None` for a leaf, whose word is known.
    parent: Option<(usize, usize)>,
}

/// What a [`Task`] wrote.
struct Part {
    nodes: Vec<Node>,
    depth: usize,
    parent: Option<(usize, usize)>,
}

impl Task<'_> {
    /// Writes its nodes, and its leaves into `data`.
    fn run(self, tree: &BinaryTree, triangles: Option<&Source<'_>>, data: &mut [f32]) -> Part {
        let out = Out::Leaves { data, first: self.place.node().first as usize };
        let mut writer = Writer { tree, triangles, nodes: Vec::new(), depth: 0, out };
        if self.parent.is_some() {
            writer.node(self.place, self.level);
        } else {
            writer.leaf(self.place);
        }
        Part { nodes: writer.nodes, depth: writer.depth, parent: self.parent }
    }
}

/// Writes wide nodes.
struct Writer<'a, 'd> {
    tree: &'a BinaryTree,
    triangles: Option<&'a Source<'a>>,
    nodes: Vec<Node>,
    depth: usize,
    out: Out<'a, 'd>,
}

/// What becomes of leaves and of small subtrees.
enum Out<'a, 'd> {
    /// They are left to tasks.
    Tasks(Vec<Task<'a>>),
    /// They are written, leaves here, where the one of primitive `first` begins.
    Leaves { data: &'d mut [f32], first: usize },
}

/// Binary nodes that become the lanes of a wide one.
type Lanes<'a> = ([Option<Place<'a>>; WIDTH], usize);

impl<'a> Writer<'a, '_> {
    /// Writes `place` as a wide node at `level`.
    fn node(&mut self, place: Place<'a>, level: usize) {
        self.depth = self.depth.max(level);
        let at = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let mut lanes = ([None; WIDTH], 0);
        match place.children() {
            Some(children) if !self.is_leaf(place.node()) => share(children, WIDTH, &mut lanes),
            // Only at the root: any other leaf is a lane of the node above.
            _ => lanes.0[0] = Some(place),
        }
        let mut node = Node::EMPTY;
        for (lane, child) in lanes.0.into_iter().flatten().enumerate() {
            let [low, high] = child.node().corners;
            let word =
                if self.is_leaf(child.node()) { self.leaf(child) } else { self.inner(child, level + 1, (at, lane)) };
            node.push(low, high, word);
        }
        node.sort();
        self.nodes[at] = node;
    }

    /// Writes `place` as a wide node below `parent`, or leaves that to a task, which puts in the word.
    fn inner(&mut self, place: Place<'a>, level: usize, parent: (usize, usize)) -> Child {
        match &mut self.out {
            Out::Tasks(tasks) if place.node().count as usize <= TASK => {
                tasks.push(Task { place, level, parent: Some(parent) });
                Child::inner(0)
            }
            _ => {
                let word = Child::inner(self.nodes.len());
                self.node(place, level);
                word
            }
        }
    }

    /// Writes a leaf, or leaves that to a task.
    fn leaf(&mut self, place: Place<'a>) -> Child {
        let Binary { first, count, .. } = *place.node();
        let references = &self.tree.references[first as usize..][..count as usize];
        let Some(triangles) = self.triangles else { return Child::special(references[0].primitive() as usize) };
        match &mut self.out {
            Out::Tasks(tasks) => tasks.push(Task { place, level: 0, parent: None }),
            Out::Leaves { data, first: base } => {
                write_leaf(references, triangles, &mut data[(first as usize - *base) * LEAF_ROWS..]);
            }
        }
        Child::leaf(first as usize + 1, count as usize)
    }

    /// Whether a leaf is the cheapest form of a binary node.
    fn is_leaf(&self, node: &Binary) -> bool {
        // Costs may overflow: then it is the count that decides.
        let most = self.tree.leaf_size;
        node.count as usize <= most && leaf_cost(node, most) <= node.costs[0]
    }
}

/// Hands `lanes` lanes to two children.
fn share<'a>([left, right]: [Place<'a>; 2], lanes: usize, out: &mut Lanes<'a>) {
    let (l, r) = (&left.node().costs, &right.node().costs);
    let (mut k, mut least) = (1, l[0] + r[lanes - 2]);
    for other in 2..lanes {
        let cost = l[other - 1] + r[lanes - other - 1];
        if cost < least {
            (k, least) = (other, cost);
        }
    }
    place(left, k, out);
    place(right, lanes - k, out);
}

/// Puts a binary node into one lane, or its children into up to `lanes`.
fn place<'a>(place: Place<'a>, lanes: usize, out: &mut Lanes<'a>) {
    let costs = &place.node().costs;
    match place.children() {
        Some(children) if lanes > 1 && costs[lanes - 1] < costs[0] => share(children, lanes, out),
        _ => {
            out.0[out.1] = Some(place);
            out.1 += 1;
        }
    }
}

/// Writes the triangles of a leaf to the begin of `data`.
fn write_leaf(references: &[Reference], triangles: &Source<'_>, data: &mut [f32]) {
    let n = references.len();
    let rows = &mut data[..n * LEAF_ROWS];
    for (i, reference) in references.iter().enumerate() {
        let primitive = reference.primitive() as usize;
        let corners = triangles.corners(primitive).map(|corner| corner.to_array());
        for (row, &number) in corners.as_flattened().iter().enumerate() {
            rows[row * n + i] = number;
        }
        rows[(LEAF_ROWS - 1) * n + i] = f32::from_bits(triangles.word(primitive));
    }
}
