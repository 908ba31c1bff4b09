//! Checks of a finished tree, for tests and debug builds.

use super::Tree;
use super::node::{Child, FILTERED, Node, WIDTH};
use super::source::Source;
use crate::accel::woop::can_be_hit;

/// What is wrong with the tree, if anything: every triangle that can be hit is in exactly one leaf, every box contains
/// what lies below it, and the depth is the stated one.
pub fn validate(tree: &Tree, triangles: &Source<'_>) -> Result<(), String> {
    let mut seen = vec![0u32; triangles.len()];
    let depth = visit(tree, triangles, &mut seen, 0, [[f32::NEG_INFINITY; 3], [f32::INFINITY; 3]])?;
    if depth != tree.depth {
        return Err(format!("depth is {depth}, not {}", tree.depth));
    }
    for (i, seen) in seen.into_iter().enumerate() {
        let wanted = u32::from(can_be_hit(triangles.corners(i)));
        if seen != wanted {
            return Err(format!("triangle {i} is in {seen} leaves, not {wanted}"));
        }
    }
    Ok(())
}

/// Depth of the subtree at `node`, which must lie in `outer`.
fn visit(
    tree: &Tree,
    triangles: &Source<'_>,
    seen: &mut [u32],
    node: usize,
    outer: [[f32; 3]; 2],
) -> Result<usize, String> {
    let Node { planes, children, count } = &tree.nodes[node];
    let mut depth = 0;
    for (lane, &child) in children[..*count as usize].iter().enumerate() {
        let corner = |row: usize| [0, 1, 2].map(|axis| planes[(row + axis) * WIDTH + lane]);
        let bounds = [corner(0), corner(3)];
        if !contains(outer, bounds[0]) || !contains(outer, bounds[1]) {
            return Err(format!("node {node} lane {lane}: {bounds:?} is not inside {outer:?}"));
        }
        if child.is_leaf() {
            visit_leaf(tree, triangles, seen, child, bounds)?;
        } else {
            depth = depth.max(visit(tree, triangles, seen, child.node(), bounds)?);
        }
    }
    Ok(depth + 1)
}

fn visit_leaf(
    tree: &Tree,
    triangles: &Source<'_>,
    seen: &mut [u32],
    leaf: Child,
    bounds: [[f32; 3]; 2],
) -> Result<(), String> {
    for i in 0..leaf.count() {
        let primitive = (tree.leaves.word(leaf, i) & !FILTERED) as usize;
        *seen.get_mut(primitive).ok_or(format!("{leaf:?} names triangle {primitive}"))? += 1;
        let corners = triangles.corners(primitive).map(|corner| corner.to_array());
        if let Some(corner) = corners.into_iter().find(|&corner| !contains(bounds, corner)) {
            return Err(format!("{leaf:?}: {corner:?} of triangle {primitive} is not inside {bounds:?}"));
        }
    }
    Ok(())
}

fn contains([low, high]: [[f32; 3]; 2], p: [f32; 3]) -> bool {
    (0..3).all(|axis| low[axis] <= p[axis] && p[axis] <= high[axis])
}
