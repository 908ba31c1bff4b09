//! Checks of a finished tree, for tests and debug builds.

use super::Tree;
use super::clip::Polygon;
use super::node::{Child, FILTERED, WIDTH};
use super::source::Source;
use crate::accel::woop::can_be_hit;

const EVERYWHERE: [[f32; 3]; 2] = [[f32::NEG_INFINITY; 3], [f32::INFINITY; 3]];

/// What is wrong with the tree, if anything: every triangle that can be hit is in exactly one leaf or, with spatial splits,
/// in at least one, and covered by the boxes of those leaves; every box contains what lies below it, the depth and the
/// number of splits are the stated ones.
pub fn validate(tree: &Tree, triangles: &Source<'_>) -> Result<(), String> {
    let mut boxes = vec![Vec::new(); triangles.len()];
    let depth = visit(tree, &mut |leaf, bounds| visit_leaf(tree, &mut boxes, leaf, bounds), 0, EVERYWHERE)?;
    if depth != tree.depth {
        return Err(format!("depth is {depth}, not {}", tree.depth));
    }
    let mut splits = 0;
    for (i, boxes) in boxes.iter().enumerate() {
        let corners = triangles.corners(i);
        let (found, wanted) = (boxes.len(), usize::from(can_be_hit(corners)));
        if found < wanted || found > wanted && (wanted == 0 || tree.splits == 0) {
            return Err(format!("triangle {i} is in {found} leaves, not {wanted}"));
        }
        splits += found - wanted;
        if !is_covered(&Polygon::new(corners), boxes) && wanted == 1 {
            return Err(format!("triangle {i}, {corners:?}, is not inside {boxes:?}"));
        }
    }
    if splits != tree.splits {
        return Err(format!("{splits} splits, not {}", tree.splits));
    }
    Ok(())
}

/// Whether the boxes together contain a polygon: what sticks out of the first is looked for in the others.
fn is_covered(polygon: &Polygon, boxes: &[[[f32; 3]; 2]]) -> bool {
    let Some((&[low, high], others)) = boxes.split_first() else { return false };
    let mut inside = *polygon;
    for axis in 0..3 {
        for (at, outer) in [(f64::from(low[axis]), 0), (f64::from(high[axis]), 1)] {
            let sides = inside.cut(axis, at);
            let bounds = inside.bounds();
            let (out, keeps) = match sides {
                Some(sides) => (Some(sides[outer]), Some(sides[1 - outer])),
                None if outer == 0 && bounds[1][axis] < at || outer == 1 && bounds[0][axis] > at => {
                    (Some(inside), None)
                }
                None if outer == 0 && bounds[0][axis] < at || outer == 1 && bounds[1][axis] > at => {
                    (Some(inside), None)
                }
                None => (None, Some(inside)),
            };
            if out.is_some_and(|out| !is_covered(&out, others)) {
                return false;
            }
            match keeps {
                Some(rest) => inside = rest,
                None => return true,
            }
        }
    }
    true
}

/// Depth of the subtree at `node`, which must lie in `outer`; `leaf` checks what lies in each box that is no node.
fn visit(
    tree: &Tree,
    leaf: &mut impl FnMut(Child, [[f32; 3]; 2]) -> Result<(), String>,
    node: usize,
    outer: [[f32; 3]; 2],
) -> Result<usize, String> {
    let node_ref = &tree.nodes[node];
    let planes = &node_ref.planes;
    let mut depth = 0;
    for lane in 0..node_ref.count() {
        let child = node_ref.child(lane);
        let corner = |row: usize| [0, 1, 2].map(|axis| planes[(row + axis) * WIDTH + lane]);
        let bounds = [corner(0), corner(3)];
        if !contains(outer, bounds[0]) || !contains(outer, bounds[1]) {
            return Err(format!("node {node} lane {lane}: {bounds:?} is not inside {outer:?}"));
        }
        if child.is_inner() {
            depth = depth.max(visit(tree, leaf, child.node(), bounds)?);
        } else {
            leaf(child, bounds)?;
        }
    }
    Ok(depth + 1)
}

fn visit_leaf(tree: &Tree, boxes: &mut [Vec<[[f32; 3]; 2]>], leaf: Child, bounds: [[f32; 3]; 2]) -> Result<(), String> {
    if !leaf.is_leaf() {
        return Err(format!("{leaf:?} is a box in a tree over triangles"));
    }
    for i in 0..leaf.count() {
        let primitive = (tree.leaves.word(leaf, i) & !FILTERED) as usize;
        boxes.get_mut(primitive).ok_or(format!("{leaf:?} names triangle {primitive}"))?.push(bounds);
    }
    Ok(())
}

fn contains([low, high]: [[f32; 3]; 2], p: [f32; 3]) -> bool {
    (0..3).all(|axis| low[axis] <= p[axis] && p[axis] <= high[axis])
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// Checks a tree over `boxes`: each that is one is one child, its box inside that child's.
    fn assert_sound(boxes: &[Option<[Vec3; 2]>]) {
        let tree = Tree::of_boxes(boxes);
        let mut seen = vec![0; boxes.len()];
        let mut check = |child: Child, bounds: [[f32; 3]; 2]| {
            if child.is_leaf() {
                return Err(format!("{child:?} is a leaf in a tree over boxes"));
            }
            seen[child.index()] += 1;
            let [low, high] = boxes[child.index()].ok_or("of no box")?;
            let is_inside = contains(bounds, low.to_array()) && contains(bounds, high.to_array());
            is_inside.then_some(()).ok_or(format!("{low} to {high} is not inside {bounds:?}"))
        };
        assert_eq!(visit(&tree, &mut check, 0, EVERYWHERE), Ok(tree.depth));
        let wanted = |b: &Option<[Vec3; 2]>| i32::from(b.is_some_and(|[low, high]| low.cmple(high).all()));
        assert_eq!(seen, boxes.iter().map(wanted).collect::<Vec<_>>());
    }

    #[test]
    fn every_box_is_one_child() {
        let mut state = 1u32;
        let mut unit = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 * 2f32.powi(-24)
        };
        for n in [0, 1, 2, 3, 7, 8, 9, 10, 17, 100, 5000] {
            let mut boxes = Vec::new();
            for i in 0..n {
                let (low, size) = (Vec3::new(unit(), unit(), unit()), Vec3::new(unit(), unit(), unit()) * 0.1);
                boxes.push((i % 5 != 4).then_some([low, low + size]));
            }
            assert_sound(&boxes);
        }
    }

    #[test]
    fn equal_huge_flat_empty_and_nan_boxes_make_a_sound_tree() {
        let (big, nan) = (Vec3::splat(1.8e18), Vec3::splat(f32::NAN));
        assert_sound(&[Some([-big, big]); 1000]);
        assert_sound(&[Some([Vec3::ONE, Vec3::ONE]); 20]);
        assert_sound(&[None, Some([Vec3::ONE, Vec3::ZERO]), Some([nan, nan]), Some([nan, Vec3::ONE])]);
        assert_sound(&[Some([Vec3::MIN, Vec3::MAX]); 30]);
        let nested: Vec<_> = (0..120).map(|i| Some([Vec3::ZERO, Vec3::ONE * 2f32.powi(i - 60)])).collect();
        assert_sound(&nested);
    }
}
