//! A plain binary tree over boxes in f64, so that the oracle need not look at every triangle: nothing of the trees that it
//! judges.

use glam::DVec3;

/// A box: low and high corner.
pub type Box3 = [DVec3; 2];

/// Boxes in a leaf.
const LEAF: usize = 4;

/// The tree.
#[derive(Debug, Default)]
pub struct Tree {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

#[derive(Debug)]
struct Node {
    bounds: Box3,
    /// First item and number of items of a leaf; of others the index of the second child (the first follows) and 0.
    at: u32,
    count: u32,
}

fn around(boxes: &[Box3], items: &[u32]) -> Box3 {
    let all = items.iter().map(|&i| boxes[i as usize]);
    all.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or([DVec3::ZERO; 2])
}

impl Tree {
    /// A tree over `boxes`, which are known by their index.
    pub fn new(boxes: &[Box3]) -> Self {
        let mut tree = Self { nodes: Vec::new(), items: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            tree.split(boxes, 0, boxes.len());
        }
        tree
    }

    /// Halves `items[from..to]` by the middles of their boxes: depth is the logarithm of their number, whatever they are.
    fn split(&mut self, boxes: &[Box3], from: usize, to: usize) {
        let bounds = around(boxes, &self.items[from..to]);
        let node = self.nodes.len();
        self.nodes.push(Node { bounds, at: from as u32, count: (to - from) as u32 });
        if to - from <= LEAF {
            return;
        }
        let middle = |i: u32| boxes[i as usize][0] + boxes[i as usize][1];
        let middles = self.items[from..to].iter().map(|&i| middle(i));
        let (low, high) = middles.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), m| (l.min(m), h.max(m)));
        let axis = (high - low).max_position();
        let half = (to - from) / 2;
        self.items[from..to].select_nth_unstable_by(half, |&a, &b| middle(a)[axis].total_cmp(&middle(b)[axis]));
        self.split(boxes, from, from + half);
        self.nodes[node].at = self.nodes.len() as u32;
        self.nodes[node].count = 0;
        self.split(boxes, from + half, to);
    }

    /// Tells `each` of all items whose box, made larger on all sides by `widening` of it, the ray meets at t in
    /// [0, end]; `end` is what `each` returned last, at first `end`.
    pub fn visit(
        &self,
        (origin, direction): (DVec3, DVec3),
        widening: impl Fn(&Box3) -> f64,
        mut end: f64,
        mut each: impl FnMut(usize) -> f64,
    ) {
        let enter = |node: &Node, end: f64| {
            let wider = widening(&node.bounds);
            let (mut near, mut far) = (0.0, end);
            for axis in 0..3 {
                let (low, high) = (node.bounds[0][axis] - wider, node.bounds[1][axis] + wider);
                let (o, d) = (origin[axis], direction[axis]);
                if d == 0.0 {
                    if o < low || o > high {
                        return None;
                    }
                    continue;
                }
                let (a, b) = ((low - o) / d, (high - o) / d);
                near = f64::max(near, a.min(b));
                far = f64::min(far, a.max(b));
            }
            // f64's own roundings.
            (near <= far + 1e-12 * far.abs()).then_some(near)
        };
        let mut stack = vec![0];
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index) else { continue };
            if enter(node, end).is_none() {
                continue;
            }
            if node.count > 0 {
                for &item in &self.items[node.at as usize..(node.at + node.count) as usize] {
                    end = each(item as usize);
                }
                continue;
            }
            let children = [index + 1, node.at as usize];
            let [a, b] = children.map(|child| enter(&self.nodes[child], end));
            // The nearer one is taken up first.
            let second_first = matches!((a, b), (Some(a), Some(b)) if b < a);
            let order =
                if second_first { [(children[0], a), (children[1], b)] } else { [(children[1], b), (children[0], a)] };
            stack.extend(order.into_iter().filter(|(_, entry)| entry.is_some()).map(|(child, _)| child));
        }
    }
}
