//! Which triangles of a scene go into the front: few and big ones.

use crate::accel::geometry::{Geometry, HitFilter, Part, Primitives};
use crate::accel::woop::can_be_hit;
use std::collections::HashMap;
use std::sync::Arc;

#[path = "edges.rs"]
mod edges;

/// More triangles than this are no short list.
pub const MOST: usize = 64;

/// A triangle is big when its box has at least this share of the scene's box, by surface area.
const BIG: f64 = 0.01;

/// Corners of the longest list.
pub(super) const MOST_CORNERS: usize = 3 * MOST;

/// Scenes of more triangles and placements have no front: it needs a second tree, without the big triangles, and 35 MB are not
/// worth it where the tree is deep anyway. Million triangles in a room, scattered rays: 1.06 (Embree) to 1.13 times as fast.
pub const MOST_TWICE: usize = 1 << 19;

/// Scenes that reach farther, metres, have no front: where numbers overflow, it and a tree may find other hits (GEO-06),
/// and which of them a ray is given depends on what it is for.
const FARTHEST: f32 = 1e12;

/// Which triangles of a scene go into the front, and what is left.
#[derive(Clone)]
pub struct Split {
    /// Everything.
    pub all: Geometry,
    /// The front and what is not in it; `None` if no triangle is worth it or too many are.
    pub front: Option<(Big, Geometry)>,
}

/// The short list.
#[derive(Clone)]
pub struct Big {
    /// Distinct corners.
    pub(super) corners: Vec<[f32; 3]>,
    /// Ascending by number.
    pub(super) triangles: Vec<Triangle>,
    /// Low and high corner of all that is not in the list; `None` if that is nothing.
    pub(super) rest: Option<[[f32; 3]; 2]>,
    /// Decides about hits on filtered triangles.
    pub(super) filter: Option<Arc<dyn HitFilter>>,
}

/// A triangle of the list.
#[derive(Clone, Copy)]
pub(super) struct Triangle {
    /// Of [`Big::corners`].
    pub(super) corners: [u16; 3],
    pub(super) primitive: u32,
    /// Whether the filter is asked.
    pub(super) is_filtered: bool,
}

impl Split {
    /// Of the world's triangles that do not move: all if there is little else, or else the big ones if those are few.
    pub fn new(all: impl Into<Geometry>) -> Self {
        let all = all.into();
        let chosen = choose(&all);
        let front = (!chosen.is_empty()).then(|| part(&all, &chosen));
        Self { all, front }
    }

    /// For a backend whose arithmetic is not the front's: without those that share an edge with what is left. By each
    /// arithmetic a mesh has no gap, but a ray at an edge may pass its two triangles if one is tested by the one and one
    /// by the other: of 20,000 rays aimed at edges of a glass table of 592 triangles 15 did.
    pub fn apart(self) -> Self {
        let Self { all, front } = self;
        if front.as_ref().is_none_or(|(big, _)| big.is_all()) {
            return Self { all, front };
        }
        let chosen = choose(&all);
        let kept = edges::apart(&all, &chosen);
        if kept.len() == chosen.len() {
            return Self { all, front };
        }
        let front = (!kept.is_empty()).then(|| part(&all, &kept));
        Self { all, front }
    }
}

/// The triangles of the front by part and place in it, ascending; empty if there is none.
fn choose(all: &Geometry) -> Vec<(usize, usize)> {
    let n = all.triangle_count();
    if n + all.placements.len() > MOST_TWICE {
        return Vec::new();
    }
    let few = all.placements.is_empty() && n <= MOST;
    let bounds = all.bounds();
    // Written so that NaN is refused.
    let is_sane = |p: glam::Vec3| p.abs().max_element() <= FARTHEST;
    if !bounds.is_some_and(|corners| corners.into_iter().all(is_sane)) {
        return Vec::new();
    }
    let scene_area = bounds.map_or(0.0, box_area);
    let mut chosen = Vec::new();
    for (p, part) in all.world.parts.iter().enumerate().filter(|(_, part)| part.later.is_empty()) {
        let is_big = |&i: &usize| few || box_area(part.triangles.corners(i)) >= BIG * scene_area;
        let wanted = MOST + 1 - chosen.len();
        chosen.extend((0..part.triangles.indices.len()).filter(is_big).take(wanted).map(|i| (p, i)));
    }
    if chosen.len() > MOST {
        chosen.clear();
    }
    chosen
}

/// The front of the triangles `chosen` (ascending), and the rest.
fn part(all: &Geometry, chosen: &[(usize, usize)]) -> (Big, Geometry) {
    let mut rest = all.clone();
    let (mut corners, mut triangles, mut known) = (Vec::new(), Vec::new(), HashMap::new());
    for &(p, i) in chosen {
        let part = &all.world.parts[p];
        let at = part.triangles.corners(i);
        if !can_be_hit(at) {
            continue;
        }
        let ids = at.map(|c| {
            *known.entry(c.to_array().map(f32::to_bits)).or_insert_with(|| {
                corners.push(c.to_array());
                (corners.len() - 1) as u16
            })
        });
        triangles.push(Triangle { corners: ids, primitive: part.primitives.get(i), is_filtered: part.filtered });
    }
    triangles.sort_unstable_by_key(|triangle| triangle.primitive);
    for (p, part) in rest.world.parts.iter_mut().enumerate() {
        let taken: Vec<usize> = chosen.iter().filter(|c| c.0 == p).map(|c| c.1).collect();
        if !taken.is_empty() {
            take(part, &taken);
        }
    }
    rest.world.parts.retain(|part| !part.triangles.indices.is_empty());
    let bounds = rest.bounds().map(|bounds| bounds.map(|corner| corner.to_array()));
    (Big { corners, triangles, rest: bounds, filter: all.filter.clone() }, rest)
}

/// Removes the triangles `taken` (ascending) from a part; the others keep their numbers.
fn take(part: &mut Part, taken: &[usize]) {
    let mut next = taken.iter().peekable();
    let (mut indices, mut numbers) = (Vec::new(), Vec::new());
    for (i, &triangle) in part.triangles.indices.iter().enumerate() {
        if next.next_if(|&&t| t == i).is_none() {
            indices.push(triangle);
            numbers.push(part.primitives.get(i));
        }
    }
    part.triangles.indices = indices;
    part.primitives = Primitives::Each(numbers);
}

/// Half the surface of the box about `points`.
fn box_area(points: impl IntoIterator<Item = glam::Vec3>) -> f64 {
    let (mut low, mut high) = (glam::Vec3::INFINITY, glam::Vec3::NEG_INFINITY);
    for p in points {
        (low, high) = (low.min(p), high.max(p));
    }
    let d = (high - low).as_dvec3();
    if d.min_element() < 0.0 { 0.0 } else { d.x * d.y + d.y * d.z + d.z * d.x }
}
