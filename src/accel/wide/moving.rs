//! Triangles whose vertices move: a tree for each segment between two keys, its boxes moving linearly as well.
//!
//! A box that holds its contents at both ends of a segment and moves linearly holds them in between, and is far tighter
//! than one that holds them all the time. The tree's shape is that of the boxes at the segment's middle.

use super::Tree;
use super::leaf::{Asked, Nearest};
use super::node::{Child, FILTERED, WIDTH};
use super::ray::box_end;
use crate::accel::geometry::{Part, ShapeRay, segment};
use crate::accel::woop::{ShearedRay, can_be_hit};
use glam::Vec3;

/// A part whose vertices move, with its trees.
#[derive(Clone, Debug)]
pub struct Moving {
    part: Part,
    /// One for each segment.
    segments: Vec<Segment>,
}

/// The tree between two keys.
#[derive(Clone, Debug)]
struct Segment {
    /// The root first, if there is any.
    nodes: Vec<MovingNode>,
}

/// Boxes of up to 8 children at both ends of the segment.
#[derive(Clone, Debug)]
struct MovingNode {
    /// Low and high corner at the start, and at the end.
    boxes: [[[Vec3; 2]; 2]; WIDTH],
    /// Inner nodes and, as specials, triangles.
    children: [Child; WIDTH],
    count: usize,
}

impl Moving {
    /// Builds the trees of `part`, which has at least two keys.
    pub fn new(part: Part) -> Self {
        let segments = (0..part.keys() - 1).map(|k| Segment::new(&part, k)).collect();
        Self { part, segments }
    }

    /// Low and high corner of everything at every time; `None` if nothing can be hit.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let roots = self.segments.iter().filter_map(|segment| segment.nodes.first());
        let boxes = roots.flat_map(|node| node.boxes[..node.count].iter().flatten());
        boxes.copied().reduce(union)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let nodes: usize = self.segments.iter().map(|segment| size_of_val(&*segment.nodes)).sum();
        let keys: usize = self.part.later.iter().map(|positions| size_of_val(&**positions)).sum();
        let triangles = &self.part.triangles;
        nodes + keys + size_of_val(&*triangles.positions) + size_of_val(&*triangles.indices)
    }

    /// Updates `nearest` by the triangles; `ray` ends there. With `any` the first hit will do.
    pub fn meet(&self, ray: &ShapeRay, any: bool, asked: &Asked<'_>, nearest: &mut Nearest) {
        let (k, s) = segment(self.part.keys(), ray.time);
        let nodes = &self.segments[k].nodes;
        let (Some(sheared), Some(boxes)) = (ShearedRay::new(ray.origin, ray.direction), BoxRay::new(ray)) else {
            return;
        };
        if nodes.is_empty() {
            return;
        }
        // Nearest on top, as far as a node tells.
        let mut stack = vec![(0.0, Child::inner(0))];
        while let Some((enter, child)) = stack.pop() {
            if enter > box_end(nearest.t) {
                continue;
            }
            if child.is_special() {
                self.meet_triangle(child.index(), ray, &sheared, asked, nearest);
                if any && nearest.primitive != crate::accel::MISS {
                    return;
                }
                continue;
            }
            let node = &nodes[child.node()];
            let base = stack.len();
            for lane in 0..node.count {
                let [start, end] = node.boxes[lane];
                let at = [start[0] + (end[0] - start[0]) * s, start[1] + (end[1] - start[1]) * s];
                if let Some(enter) = boxes.enter(at, box_end(nearest.t)) {
                    stack.push((enter, node.children[lane]));
                }
            }
            stack[base..].sort_by(|a, b| b.0.total_cmp(&a.0));
        }
    }

    fn meet_triangle(&self, i: usize, ray: &ShapeRay, sheared: &ShearedRay, asked: &Asked<'_>, nearest: &mut Nearest) {
        let Some(c) = sheared.cross(self.part.corners_at(i, ray.time)) else { return };
        let (primitive, instance) = (self.part.primitives.get(i), asked.instance);
        let word = primitive | if self.part.filtered { FILTERED } else { 0 };
        if c.t > 0.0 && nearest.yields_to(c.t, instance, primitive) && !asked.passes(word, c.u, c.v) {
            *nearest = Nearest { t: c.t, u: c.u, v: c.v, instance, primitive };
        }
    }
}

impl Segment {
    fn new(part: &Part, k: usize) -> Self {
        let n = part.triangles.indices.len();
        // The triangles of which the oracle would report a hit: with an area at some key.
        let counts = |i: usize| (0..part.keys()).any(|k| can_be_hit(part.corners_of_key(k, i)));
        let ends: Vec<Option<[[Vec3; 2]; 2]>> =
            (0..n).map(|i| counts(i).then(|| [0, 1].map(|end| padded(part.corners_of_key(k + end, i))))).collect();
        let middle: Vec<_> =
            ends.iter().map(|ends| ends.map(|[a, b]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])])).collect();
        let tree = Tree::of_boxes(&middle);
        let mut nodes: Vec<MovingNode> = tree
            .nodes
            .iter()
            .map(|node| MovingNode {
                boxes: [[[Vec3::ZERO; 2]; 2]; WIDTH],
                children: std::array::from_fn(|lane| node.child(lane)),
                count: node.count(),
            })
            .collect();
        if ends.iter().all(Option::is_none) {
            nodes.clear();
        } else {
            fit(&mut nodes, &ends, 0);
        }
        Self { nodes }
    }
}

/// Fits the boxes of node `at` to what is below, and returns the box around them at both ends.
fn fit(nodes: &mut [MovingNode], ends: &[Option<[[Vec3; 2]; 2]>], at: usize) -> Option<[[Vec3; 2]; 2]> {
    let mut all: Option<[[Vec3; 2]; 2]> = None;
    for lane in 0..nodes[at].count {
        let child = nodes[at].children[lane];
        let found = if child.is_special() { ends[child.index()] } else { fit(nodes, ends, child.node()) };
        let Some(boxes) = found else { continue };
        nodes[at].boxes[lane] = boxes;
        all = Some(all.map_or(boxes, |a| [union(a[0], boxes[0]), union(a[1], boxes[1])]));
    }
    all
}

fn union(a: [Vec3; 2], b: [Vec3; 2]) -> [Vec3; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// The box of a triangle at a key, padded by what the triangle test and the interpolation of boxes and of corners may be
/// off by: a share of the extent (`build.rs`) and 8 roundings of the coordinates.
fn padded(corners: [Vec3; 3]) -> [Vec3; 2] {
    let (low, high) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
    let pad = (high - low).max_element() * 2f32.powi(-20) + low.abs().max(high.abs()).max_element() * 2f32.powi(-20);
    [(low - pad).map(f32::next_down), (high + pad).map(f32::next_up)]
}

/// A ray against boxes, one at a time and in f64, where nothing needs widening but for what the triangle test may be off
/// by: see `ray.rs`.
struct BoxRay {
    origin: glam::DVec3,
    inverse: glam::DVec3,
    /// What a box grows by, as a share of the distance from the origin.
    widen: f64,
}

impl BoxRay {
    fn new(ray: &ShapeRay) -> Option<Self> {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        (direction.max_element().is_finite() && origin.max_element().is_finite()).then_some(Self {
            origin,
            inverse: direction.recip(),
            widen: 8.0 * f64::from(f32::EPSILON),
        })
    }

    /// Where the ray enters the box, if it does so before `end`.
    fn enter(&self, [low, high]: [Vec3; 2], end: f32) -> Option<f32> {
        let (low, high) = (low.as_dvec3() - self.origin, high.as_dvec3() - self.origin);
        let reach = low.abs().max(high.abs()).max_element() * self.widen;
        let (a, b) = ((low - reach) * self.inverse, (high + reach) * self.inverse);
        let (mut near, mut far) = (0.0_f64, f64::from(end));
        for axis in 0..3 {
            // A NaN (0 * infinity: along a plane of the box) culls nothing.
            near = near.max(a[axis].min(b[axis]));
            far = far.min(a[axis].max(b[axis]));
        }
        (near <= far).then_some(near as f32)
    }
}
