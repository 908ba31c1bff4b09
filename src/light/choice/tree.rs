//! A binary tree over lights, split by a surface area orientation heuristic.
//!
//! After Conty Estevez and Kulla 2018 (see `bounds.rs`), section 4.4. Deviation: how far directions spread while a split is
//! looked for is read off the length of their mean, not off a cone; only the tree that is built has cones. A cone for each
//! bin and light would cost ten times as much, for the same decisions where it matters.

use super::packed::pack;
use crate::light::bounds::Bounds;
use glam::DVec3;

/// Records of a node (`packed.rs`).
pub const RECORDS: u32 = 2;
/// In place of a right child.
pub const LEAF: u32 = u32::MAX;
const BINS: usize = 16;
/// Subtrees of fewer lights are built by one thread.
const PARALLEL: usize = 4096;

type Node = [[f32; 4]; RECORDS as usize];

/// Lights by place and direction.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Depth first: the left child is the next node. A subtree of n lights has 2 n - 1 nodes, which tells the numbers of
    /// the lights on the way down.
    pub nodes: Vec<[f32; 4]>,
}

impl Tree {
    /// Over `lights`, at least one; `order` is put into the tree's order. `scale`, `least`: see [`Bounds::records`]. It
    /// does not depend on how many threads there are.
    pub fn new(lights: &[Bounds], order: &mut [u32], scale: f64, least: f64) -> Self {
        let mut nodes = vec![[[0.0; 4]; RECORDS as usize]; 2 * order.len() - 1];
        Builder { lights, scale, least }.subtree(order, 0, &mut nodes);
        Self { nodes: nodes.into_flattened() }
    }
}

#[derive(Clone, Copy)]
struct Builder<'a> {
    lights: &'a [Bounds],
    scale: f64,
    least: f64,
}

impl Builder<'_> {
    /// Builds the subtree over the lights of `order`; its root is the first of `nodes`, number `at` of all.
    fn subtree(self, order: &mut [u32], at: usize, nodes: &mut [Node]) -> Bounds {
        let (node, below) = nodes.split_first_mut().expect("a subtree of n lights has 2 n - 1 nodes");
        let (bounds, right) = if let [light] = *order {
            (self.lights[light as usize], LEAF)
        } else {
            let mid = self.split(order);
            let (low, high) = order.split_at_mut(mid);
            let (left, right) = below.split_at_mut(2 * mid - 1);
            let right_at = at + 2 * mid;
            let mut build_left = |low| self.subtree(low, at + 1, left);
            let mut build_right = |high| self.subtree(high, right_at, right);
            let (left, right) = if low.len() + high.len() > PARALLEL {
                rayon::join(|| build_left(low), || build_right(high))
            } else {
                (build_left(low), build_right(high))
            };
            (left.union(&right), right_at as u32)
        };
        *node = pack(&bounds.records(self.scale, self.least), right);
        bounds
    }

    /// Puts the lights that go left to the front; how many.
    fn split(self, order: &mut [u32]) -> usize {
        let centre = |light: u32| self.lights[light as usize].centre();
        let mut box_of_centres = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for &light in order.iter() {
            box_of_centres[0] = box_of_centres[0].min(centre(light));
            box_of_centres[1] = box_of_centres[1].max(centre(light));
        }
        let extent = box_of_centres[1] - box_of_centres[0];
        let mut best: Option<(f64, usize, usize)> = None;
        for axis in 0..3 {
            if extent[axis] <= 0.0 {
                continue;
            }
            let mut bins = [Bin::EMPTY; BINS];
            for &light in order.iter() {
                bins[bin_of(centre(light)[axis], box_of_centres[0][axis], extent[axis])]
                    .add(&self.lights[light as usize]);
            }
            // Long boxes are cut across.
            let shape = extent.max_element() / extent[axis];
            let mut from_right = [Bin::EMPTY; BINS];
            let mut sum = Bin::EMPTY;
            for i in (0..BINS).rev() {
                sum.join(&bins[i]);
                from_right[i] = sum;
            }
            let mut left = Bin::EMPTY;
            for i in 1..BINS {
                left.join(&bins[i - 1]);
                let right = &from_right[i];
                if left.count == 0 || right.count == 0 {
                    continue;
                }
                let cost = shape * (left.cost() + right.cost());
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, i));
                }
            }
        }
        let Some((_, axis, end)) = best else { return order.len() / 2 };
        let (low, extent) = (box_of_centres[0][axis], extent[axis]);
        // Stable, so that equal scenes have equal trees.
        let (left, right): (Vec<u32>, Vec<u32>) =
            order.iter().partition(|&&light| bin_of(centre(light)[axis], low, extent) < end);
        order[..left.len()].copy_from_slice(&left);
        order[left.len()..].copy_from_slice(&right);
        left.len()
    }
}

fn bin_of(place: f64, low: f64, extent: f64) -> usize {
    (((place - low) / extent * BINS as f64) as usize).min(BINS - 1)
}

/// Lights between two planes.
#[derive(Clone, Copy)]
struct Bin {
    count: usize,
    strength: f64,
    /// Directions, weighted by strength.
    direction: DVec3,
    low: DVec3,
    high: DVec3,
}

impl Bin {
    const EMPTY: Self =
        Self { count: 0, strength: 0.0, direction: DVec3::ZERO, low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    fn add(&mut self, light: &Bounds) {
        let [low, high] = light.corners();
        self.join(&Self {
            count: 1,
            strength: light.strength(),
            direction: light.direction() * light.strength(),
            low,
            high,
        });
    }

    fn join(&mut self, other: &Self) {
        self.count += other.count;
        self.strength += other.strength;
        self.direction += other.direction;
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
    }

    /// Strength x surface x spread of directions (1: all one, 2: all around).
    fn cost(&self) -> f64 {
        let d = self.high - self.low;
        let surface = d.x * d.y + d.y * d.z + d.z * d.x;
        // Lights in one line or place have no surface, yet splitting them is worth something.
        let size = surface + 1e-3 * d.length_squared();
        self.strength * size * (2.0 - self.direction.length() / self.strength.max(f64::MIN_POSITIVE))
    }
}
