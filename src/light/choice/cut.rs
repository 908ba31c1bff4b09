//! A tree of lights asked by a point: first the nodes of a cut that is fine where the point is near, then down to a light.
//!
//! Binary descent from the root loses most at the nodes near the point, where bounds say little; choosing exactly among
//! [`CUT`] nodes, those that look large and important split first, removes most of the tree's error.

use super::BELOW_1;
use super::importance::{Receiver, of_group};
use super::packed::unpack;
use super::tree::LEAF;
use simd::{Float, Lanes, Mask, Uint};

/// Nodes of a cut. 8 measured twice the error of 16, 64 a twentieth less.
pub const CUT: usize = 16;

/// Nodes that together hold all lights, in the order of the tree; those unused have importance 0.
pub struct Cut<L: Lanes> {
    pub nodes: [L::U; CUT],
    /// Their right children, or [`LEAF`].
    pub rights: [L::U; CUT],
    /// Numbers of their first lights.
    pub firsts: [L::U; CUT],
    pub importance: [L::F; CUT],
}

/// A light found by going down.
pub struct Leaf<L: Lanes> {
    pub light: L::U,
    /// Of the light, given the node.
    pub pmf: L::F,
}

/// A node as a receiver sees it.
struct Seen<L: Lanes> {
    importance: L::F,
    /// By how much it gains to be split: importance x radius / distance; 0 for a leaf.
    gain: L::F,
    /// Its right child, or [`LEAF`].
    right: L::U,
}

#[inline(always)]
fn see<L: Lanes>(nodes: &[[f32; 4]], node: L::U, at: &Receiver<L>) -> Seen<L> {
    let first = node.shl(1);
    let record = (first + L::U::splat(1)).records(nodes);
    let (importance, size) = of_group(&unpack::<L>(first.records(nodes), &record), at);
    let right = record[3].to_bits();
    let gain = (importance * size.min(L::F::one())).masked(!right.eq(L::U::splat(LEAF)));
    Seen { importance, gain, right }
}

/// How many lights are below the left child of `node`, whose right child is `right`.
#[inline(always)]
fn left_lights<L: Lanes>(node: L::U, right: L::U) -> L::U {
    (right - node).shr(1)
}

/// The cut for each receiver. A function of the receiver and the tree alone.
#[inline(always)]
pub fn cut<L: Lanes>(tree: &[[f32; 4]], at: &Receiver<L>) -> Cut<L> {
    let (zero, none) = (L::F::zero(), L::U::splat(0));
    let (mut nodes, mut rights, mut firsts) = ([none; CUT], [L::U::splat(LEAF); CUT], [none; CUT]);
    let (mut importance, mut gain) = ([zero; CUT], [zero; CUT]);
    let root = see(tree, none, at);
    (importance[0], gain[0], rights[0]) = (root.importance, root.gain, root.right);
    for n in 1..CUT {
        let (mut most, mut place) = (gain[0], none);
        let (mut node, mut right, mut first) = (nodes[0], rights[0], firsts[0]);
        for i in 1..n {
            let more = gain[i].gt(most);
            most = gain[i].or_else(more, most);
            place = L::U::splat(i as u32).or_else(more, place);
            (node, right) = (nodes[i].or_else(more, node), rights[i].or_else(more, right));
            first = firsts[i].or_else(more, first);
        }
        let splits = most.gt(zero);
        if !splits.any() {
            break;
        }
        let after = first + left_lights::<L>(node, right);
        // Lanes that have nothing to split look at some node, for nothing.
        let left = see(tree, node + L::U::splat(1), at);
        let other = see(tree, right.or_else(splits, none), at);
        // The children take the node's place: what comes after it moves up by one.
        for i in (0..=n).rev() {
            let number = L::U::splat(i as u32);
            let is_left = splits & place.eq(number);
            let (mut n_i, mut r_i, mut f_i) = (nodes[i], rights[i], firsts[i]);
            let (mut w_i, mut g_i) = (importance[i], gain[i]);
            if i > 0 {
                let is_right = splits & place.eq(L::U::splat(i as u32 - 1));
                let moves = splits & place.lt(L::U::splat(i as u32 - 1));
                n_i = nodes[i - 1].or_else(moves, right.or_else(is_right, n_i));
                r_i = rights[i - 1].or_else(moves, other.right.or_else(is_right, r_i));
                f_i = firsts[i - 1].or_else(moves, after.or_else(is_right, f_i));
                w_i = importance[i - 1].or_else(moves, other.importance.or_else(is_right, w_i));
                g_i = gain[i - 1].or_else(moves, other.gain.or_else(is_right, g_i));
            }
            nodes[i] = (node + L::U::splat(1)).or_else(is_left, n_i);
            rights[i] = left.right.or_else(is_left, r_i);
            // The left child's first light is its parent's.
            firsts[i] = first.or_else(is_left, f_i);
            importance[i] = left.importance.or_else(is_left, w_i);
            gain[i] = left.gain.or_else(is_left, g_i);
        }
    }
    Cut { nodes, rights, firsts, importance }
}

/// From a node down to a light, by `u` in [0, 1), in `lanes`. The `node` with its right child and its first light.
#[inline(always)]
pub fn descend<L: Lanes>(
    tree: &[[f32; 4]],
    at: &Receiver<L>,
    (mut node, mut right, mut light): (L::U, L::U, L::U),
    mut u: L::F,
    lanes: L::M,
) -> Leaf<L> {
    let (zero, one) = (L::F::zero(), L::F::one());
    let mut pmf = one;
    loop {
        let goes_on = lanes & !right.eq(L::U::splat(LEAF));
        if !goes_on.any() {
            return Leaf { light, pmf };
        }
        let left_node = node + L::U::splat(1);
        let left = see(tree, left_node, at);
        let other = see(tree, right.or_else(goes_on, L::U::splat(0)), at);
        let sum = left.importance + other.importance;
        let target = u * sum;
        let goes_right = left.importance.le(target);
        let share = other.importance.or_else(goes_right, left.importance);
        let rest = (target - left.importance).or_else(goes_right, target) / share;
        u = rest.max(zero).min(L::F::splat(BELOW_1)).or_else(goes_on, u);
        // Neither of the children can be expected to give anything: none is chosen.
        let step = (share / sum).masked(sum.gt(zero));
        pmf = (pmf * step).or_else(goes_on, pmf);
        light = (light + left_lights::<L>(node, right)).or_else(goes_on & goes_right, light);
        node = right.or_else(goes_right, left_node).or_else(goes_on, node);
        right = other.right.or_else(goes_right, left.right).or_else(goes_on, right);
    }
}

/// The probability of `light` where all importances together were `total`: the same cut, and the same way down.
#[inline(always)]
pub fn pmf<L: Lanes>(tree: &[[f32; 4]], at: &Receiver<L>, light: L::U, total: L::F) -> L::F {
    let zero = L::F::zero();
    let cut = cut(tree, at);
    let (mut node, mut right, mut first) = (cut.nodes[0], cut.rights[0], cut.firsts[0]);
    let mut importance = cut.importance[0];
    // Nodes are in the order of their first lights; those unused have 0 again and come last.
    for i in 1..CUT {
        let holds = L::U::splat(0).lt(cut.firsts[i]) & !light.lt(cut.firsts[i]);
        (node, right) = (cut.nodes[i].or_else(holds, node), cut.rights[i].or_else(holds, right));
        first = cut.firsts[i].or_else(holds, first);
        importance = cut.importance[i].or_else(holds, importance);
    }
    // Multiplied in the order of `descend`: the same bits.
    let mut pmf = L::F::one();
    loop {
        let goes_on = importance.gt(zero) & !right.eq(L::U::splat(LEAF));
        if !goes_on.any() {
            return (importance / total) * pmf;
        }
        let left_node = node + L::U::splat(1);
        let left = see(tree, left_node, at);
        let other = see(tree, right.or_else(goes_on, L::U::splat(0)), at);
        let sum = left.importance + other.importance;
        let after = first + left_lights::<L>(node, right);
        let goes_right = !light.lt(after);
        let share = other.importance.or_else(goes_right, left.importance);
        let step = (share / sum).masked(sum.gt(zero));
        pmf = (pmf * step).or_else(goes_on, pmf);
        first = after.or_else(goes_on & goes_right, first);
        node = right.or_else(goes_right, left_node).or_else(goes_on, node);
        right = other.right.or_else(goes_right, left.right).or_else(goes_on, right);
    }
}
