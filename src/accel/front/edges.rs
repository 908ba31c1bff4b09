//! Which big triangles share no edge with what is not in the front.

use crate::accel::geometry::Geometry;
use std::collections::{HashMap, HashSet};

/// A triangle by part and place in it.
type Place = (usize, usize);
/// A corner's bits; 0 and -0 are the same.
type Corner = [u32; 3];
/// Both ends, in order.
type Edge = [Corner; 2];

/// Those of `chosen` (ascending) that neither share an edge with a triangle of the world that is not among them, nor with
/// one of them that does: a surface is in the front as a whole or not at all.
pub(super) fn apart(all: &Geometry, chosen: &[Place]) -> Vec<Place> {
    let mut by_edge: HashMap<Edge, Vec<usize>> = HashMap::new();
    let mut known: HashSet<Corner> = HashSet::new();
    for (c, &place) in chosen.iter().enumerate() {
        let corners = corners(all, place);
        known.extend(corners);
        edges(corners).into_iter().for_each(|edge| by_edge.entry(edge).or_default().push(c));
    }
    let mut left: Vec<Edge> = Vec::new();
    let mut next = chosen.iter().peekable();
    for (p, part) in all.world.parts.iter().enumerate() {
        for i in 0..part.triangles.indices.len() {
            if next.next_if(|&&place| place == (p, i)).is_some() {
                continue;
            }
            let corners = corners(all, (p, i));
            // Most of a scene is nowhere near.
            if corners.iter().filter(|corner| known.contains(*corner)).count() >= 2 {
                left.extend(edges(corners));
            }
        }
    }
    let mut is_kept = vec![true; chosen.len()];
    while let Some(edge) = left.pop() {
        for c in by_edge.remove(&edge).unwrap_or_default() {
            if std::mem::take(&mut is_kept[c]) {
                left.extend(edges(corners(all, chosen[c])));
            }
        }
    }
    chosen.iter().zip(is_kept).filter(|(_, is_kept)| *is_kept).map(|(place, _)| *place).collect()
}

fn corners(all: &Geometry, (p, i): Place) -> [Corner; 3] {
    all.world.parts[p].triangles.corners(i).map(|corner| corner.to_array().map(|x| (x + 0.0).to_bits()))
}

fn edges([a, b, c]: [Corner; 3]) -> [Edge; 3] {
    [[a.min(b), a.max(b)], [b.min(c), b.max(c)], [c.min(a), c.max(a)]]
}
