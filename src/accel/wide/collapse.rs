//! From the binary tree to the 8-wide one: which binary nodes survive, and which become leaves.
//!
//! After Ylitie, Karras and Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs",
//! section 3.1 (itself after Wald, Benthin and Boulos 2008): dynamic programming over the binary tree finds the collapse
//! of least SAH cost.

use super::build::{Binary, BinaryTree, Bounds};
use super::node::{Child, LEAF_ROWS, Leaves, Node, WIDTH};
use super::source::Source;

/// Least cost of a subtree that may take up to 1, 2, ... 7 lanes of the node above it.
pub type Costs = [f32; WIDTH - 1];

/// Cost of a node visit, the unit.
const NODE_COST: f32 = 1.0;
/// Cost of a leaf visit and of each triangle in it: 8 are tested at once, but read one by one.
const LEAF_COST: f32 = 0.7;
const TRIANGLE_COST: f32 = 0.1;

/// Cost of `n` triangles as a leaf.
pub fn leaf_cost(bounds: &Bounds, n: usize) -> f32 {
    if n <= WIDTH { bounds.half_area() * (LEAF_COST + TRIANGLE_COST * n as f32) } else { f32::INFINITY }
}

/// Costs of a binary node from those of its children.
pub fn combine(bounds: &Bounds, n: usize, left: &Costs, right: &Costs) -> Costs {
    // More lanes never cost more, so lanes are always handed out completely.
    let shared = |lanes: usize| (1..lanes).map(|k| left[k - 1] + right[lanes - k - 1]).fold(f32::INFINITY, f32::min);
    let node = bounds.half_area() * NODE_COST + shared_by_all(left, right);
    let one = leaf_cost(bounds, n).min(node);
    let mut costs = [one; WIDTH - 1];
    for (i, cost) in costs.iter_mut().enumerate().skip(1) {
        *cost = one.min(shared(i + 1));
    }
    costs
}

/// Least cost of two subtrees that share the 8 lanes of a node.
fn shared_by_all(left: &Costs, right: &Costs) -> f32 {
    (1..WIDTH).map(|k| left[k - 1] + right[WIDTH - k - 1]).fold(f32::INFINITY, f32::min)
}

/// The wide tree: nodes (the root first), leaves and depth in nodes.
pub struct Collapsed {
    pub nodes: Vec<Node>,
    pub leaves: Leaves,
    pub depth: usize,
}

/// Collapses `tree`. Nodes come in depth-first order.
pub fn collapse(tree: &BinaryTree, triangles: &Source<'_>) -> Collapsed {
    let n = tree.references.len();
    let mut out = Writer {
        tree,
        triangles,
        nodes: Vec::with_capacity(n / 4 + 1),
        data: Vec::with_capacity((n + 1) * LEAF_ROWS + WIDTH),
        depth: 1,
    };
    // Leaf 0 is one triangle of NaN: what the unused lanes lead to.
    out.data.resize(LEAF_ROWS - 1, f32::NAN);
    out.data.push(f32::from_bits(u32::MAX));
    if n == 0 {
        out.nodes.push(Node::EMPTY);
    } else {
        out.node(0, 1);
    }
    out.data.resize(out.data.len() + WIDTH, f32::NAN);
    Collapsed { nodes: out.nodes, leaves: Leaves { data: out.data }, depth: out.depth }
}

struct Writer<'a> {
    tree: &'a BinaryTree,
    triangles: &'a Source<'a>,
    nodes: Vec<Node>,
    data: Vec<f32>,
    depth: usize,
}

impl Writer<'_> {
    /// Writes binary node `i` as a wide node at `level` and returns its index.
    fn node(&mut self, i: usize, level: usize) -> usize {
        self.depth = self.depth.max(level);
        let at = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let mut lanes = ([0; WIDTH], 0);
        // Only at the root: any other leaf is a lane of the node above.
        if self.is_leaf(&self.tree.nodes[i]) {
            (lanes.0[0], lanes.1) = (i, 1);
        } else {
            self.share(i, WIDTH, &mut lanes);
        }
        let mut node = Node::EMPTY;
        for &child in &lanes.0[..lanes.1] {
            let binary = &self.tree.nodes[child];
            let word = if self.is_leaf(binary) { self.leaf(binary) } else { Child::inner(self.node(child, level + 1)) };
            let Bounds { low, high } = binary.bounds;
            node.push([low.x, low.y, low.z], [high.x, high.y, high.z], word);
        }
        self.nodes[at] = node;
        at
    }

    /// Whether a leaf is the cheapest form of a binary node.
    fn is_leaf(&self, node: &Binary) -> bool {
        node.right == 0
            || (node.count as usize <= WIDTH && leaf_cost(&node.bounds, node.count as usize) <= node.costs[0])
    }

    /// Hands `lanes` lanes to the children of binary node `i`.
    fn share(&self, i: usize, lanes: usize, out: &mut ([usize; WIDTH], usize)) {
        let (left, right) = (i + 1, i + self.tree.nodes[i].right as usize);
        let (l, r) = (&self.tree.nodes[left].costs, &self.tree.nodes[right].costs);
        let cost = |k: usize| l[k - 1] + r[lanes - k - 1];
        let k = (1..lanes).min_by(|&a, &b| cost(a).total_cmp(&cost(b))).expect("two lanes at least");
        self.place(left, k, out);
        self.place(right, lanes - k, out);
    }

    /// Puts binary node `i` into one lane, or its children into up to `lanes`.
    fn place(&self, i: usize, lanes: usize, out: &mut ([usize; WIDTH], usize)) {
        let node = &self.tree.nodes[i];
        if lanes == 1 || node.right == 0 || node.costs[0] <= node.costs[lanes - 1] {
            out.0[out.1] = i;
            out.1 += 1;
        } else {
            self.share(i, lanes, out);
        }
    }

    /// Writes a leaf.
    fn leaf(&mut self, node: &Binary) -> Child {
        let (first, count) = (node.first as usize, node.count as usize);
        let references = &self.tree.references[first..first + count];
        let at = self.data.len() / LEAF_ROWS;
        let primitives = || references.iter().map(|r| r.primitive());
        for corner in 0..3 {
            for axis in 0..3 {
                self.data.extend(primitives().map(|p| self.triangles.corners(p as usize)[corner][axis]));
            }
        }
        self.data.extend(primitives().map(|p| f32::from_bits(self.triangles.word(p as usize))));
        Child::leaf(at, count)
    }
}
