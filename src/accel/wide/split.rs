//! Spatial splits: long diagonal triangles cut into parts, each with a box of its own, before the tree is built.
//!
//! After Karras and Aila 2013, "Fast Parallel Construction of High-Quality Bounding Volume Hierarchies", section 4: cuts
//! are shared out by how much of a box is empty, and lie on the planes that halve the scene, halve the halves and so on.
//! Deviations: the planes are those of a cube, the fourth root of the priority is taken instead of the third (two square
//! roots give the same bits everywhere; the SAH cost is the same to 3 %), parts are the exact polygons, and ordinary
//! triangles have no priority.
//!
//! A part is only a smaller box: leaves hold whole triangles, so a ray finds the same crossing whichever part led to it.

use super::build::BinaryTree;
use super::clip::Polygon;
use super::node::Child;
use super::reference::{Bounds, Reference};
use super::source::Source;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use simd::{Kernel, Lanes, Level, dispatch};

/// Whether a triangle may be in several leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SpatialSplits {
    /// In the trees where a trial finds that it pays.
    #[default]
    Auto,
    /// Nowhere.
    Never,
    /// In every tree, for tests and measurements.
    Always,
}

/// Parts beyond one a triangle at most, as a share of the triangles. With 0.1 and 0.3 instead of 0.5 a timber hall
/// gave 1.28 and 1.5 times the camera rays a second instead of 1.8.
pub const MOST_SPLITS: f64 = 0.5;
/// Parts of one triangle at most, less 1.
const MOST: f32 = 4095.0;
/// Cells of the grid along each axis: where its planes may lie.
const CELLS: u32 = 1 << 20;
/// References per task.
const CHUNK: usize = 16 * 1024;

/// Emptiness from which a trial is made: in so many boxes' worth of nothing a line through the scene tests triangles.
/// With 5 to 6 (a room of many meshes; sparse straws) splits cost rays in spite of a lower SAH cost, with 37 they may pay.
const EMPTY_BOXES: f64 = 20.0;
/// The trial is made with one triangle of so many ...
const SAMPLE: usize = 16;
/// ... or with about this many, if that is more.
const LEAST_SAMPLE: usize = 1024;
/// By how much the trial's SAH cost must fall. It falls less than the whole tree's, and rays gain less than that:
/// 1.30 in the trial were 2.1 by the whole cost and 1.3 to 1.7 by rays; 1.05 were 1.15 and nothing.
const PAYS: f32 = 1.2;

/// What the references of a tree are like.
pub struct Survey {
    /// Of all.
    pub bounds: Bounds,
    /// Sum of their [`Reference::emptiness`].
    emptiness: f64,
    /// Whether none stands for nothing.
    pub is_complete: bool,
}

impl Survey {
    const NOTHING: Self = Self { bounds: Bounds::EMPTY, emptiness: 0.0, is_complete: true };

    fn add(&mut self, bounds: &Bounds, emptiness: f64) {
        self.bounds = Bounds(std::array::from_fn(|i| self.bounds.0[i].min(bounds.0[i])));
        self.emptiness += emptiness;
    }

    /// Whether boxes are so empty that a trial is made. NaN and infinite areas: no.
    fn calls_for_a_trial(&self) -> bool {
        let is_empty = self.emptiness >= EMPTY_BOXES * f64::from(self.bounds.half_area());
        is_empty && self.emptiness.is_finite()
    }

    /// Of `references`, whatever the number of threads.
    pub fn of(references: &[Reference], level: Level) -> Self {
        let parts: Vec<Self> =
            references.par_chunks(CHUNK).map(|references| dispatch(level, Look { references })).collect();
        let mut all = Self::NOTHING;
        for part in parts {
            all.add(&part.bounds, part.emptiness);
            all.is_complete &= part.is_complete;
        }
        all
    }
}

struct Look<'a> {
    references: &'a [Reference],
}

impl Kernel for Look<'_> {
    type Output = Survey;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Survey {
        let mut all = Survey::NOTHING;
        for r in self.references {
            all.bounds = all.bounds.union::<L>(&r.0);
            all.is_complete &= r.is_something();
            all.emptiness += if r.is_something() { f64::from(r.emptiness()) } else { 0.0 };
        }
        all
    }
}

/// Whether a tree over triangles of these corners, metres, may have spatial splits: for estimates of its memory. What is
/// asked here is asked first by the build, which then makes a trial.
pub fn may_split(triangles: impl Iterator<Item = [Vec3; 3]>) -> bool {
    let mut all = Survey::NOTHING;
    for corners in triangles {
        let r = Reference::of_corners(corners, 0);
        if r.is_something() {
            all.add(&r.0, f64::from(r.emptiness()));
        }
    }
    all.calls_for_a_trial()
}

/// Whether splitting `references`, none of which stands for nothing, pays: a matter of their boxes and, if these are
/// empty enough, of the SAH costs of trees over a sample of them.
pub fn pays(triangles: &Source<'_>, references: &[Reference], survey: &Survey) -> bool {
    if !survey.calls_for_a_trial() {
        return false;
    }
    // Multiples of the golden ratio: evenly spread, and in step with no pattern of a mesh.
    let share = u32::MAX / (references.len() / LEAST_SAMPLE).clamp(1, SAMPLE) as u32;
    let is_chosen = |i: usize| (i as u32).wrapping_mul(0x9e37_79b9) <= share;
    let sample: Vec<Reference> = (0..references.len()).filter(|&i| is_chosen(i)).map(|i| references[i]).collect();
    let parts = split(triangles, sample.clone(), &survey.bounds);
    let [whole, split] = [sample, parts].map(|references| BinaryTree::of_references(references).cost());
    whole >= PAYS * split
}

/// The references, those of wasteful triangles replaced by several to parts of them, within the budget; in their order.
pub fn split(triangles: &Source<'_>, references: Vec<Reference>, bounds: &Bounds) -> Vec<Reference> {
    let grid = Grid::new(bounds);
    let n = references.len();
    let budget = ((n as f64 * MOST_SPLITS) as usize).min(Child::MAX_TRIANGLES - 1 - n) as u64;
    let priorities: Vec<f32> =
        references.par_iter().with_min_len(CHUNK).map(|reference| grid.priority(reference)).collect();
    let Some(scale) = scale(&priorities, budget) else { return references };
    let share = |(references, priorities): (&[Reference], &[f32])| {
        let mut out = Vec::with_capacity(references.len() + references.len() / 2);
        for (reference, &priority) in references.iter().zip(priorities) {
            match cuts(priority, scale) {
                0 => out.push(*reference),
                cuts => divide(&grid, triangles, reference, cuts, &mut out),
            }
        }
        out
    };
    let parts: Vec<Vec<Reference>> =
        references.par_chunks(CHUNK).zip(priorities.par_chunks(CHUNK)).map(share).collect();
    drop((references, priorities));
    parts.concat()
}

/// Cuts of a triangle.
fn cuts(priority: f32, scale: f32) -> u32 {
    (priority * scale).min(MOST) as u32
}

/// What priorities are multiplied by for as many cuts as the budget allows; `None` if there is nothing to cut.
fn scale(priorities: &[f32], budget: u64) -> Option<f32> {
    let highest = priorities.par_iter().copied().reduce(|| 0.0, f32::max);
    let total = |scale: f32| -> u64 {
        let of = |chunk: &[f32]| chunk.iter().map(|&priority| u64::from(cuts(priority, scale))).sum::<u64>();
        priorities.par_chunks(CHUNK).map(of).sum()
    };
    let (mut low, mut high) = (0.0, MOST / highest);
    if highest == 0.0 || !high.is_finite() {
        return None;
    }
    if total(high) <= budget {
        return Some(high);
    }
    // 20 halvings use up the budget to 2 in a thousand.
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        *(if total(middle) <= budget { &mut low } else { &mut high }) = middle;
    }
    (low > 0.0).then_some(low)
}

/// A cube around the scene and its cells.
struct Grid {
    low: DVec3,
    /// Edge of a cell.
    cell: f64,
}

/// A plane of the grid.
struct Plane {
    axis: usize,
    at: f64,
    /// Edge of what it halves, in cells.
    cells: u32,
}

impl Grid {
    fn new(bounds: &Bounds) -> Self {
        let [low, high] = [bounds.low(), bounds.high()].map(|corner| Vec3::from_array(corner).as_dvec3());
        Self { low, cell: (high - low).max_element() / f64::from(CELLS) }
    }

    /// The most important plane strictly inside of the box: that of the largest cube; of several, across the box's longest
    /// side.
    fn plane(&self, [low, high]: [DVec3; 2]) -> Option<Plane> {
        let mut best: Option<Plane> = None;
        for axis in 0..3 {
            let cell = |x: f64| ((x - self.low[axis]) / self.cell).clamp(0.0, f64::from(CELLS - 1)) as u32;
            let (first, last) = (cell(low[axis]), cell(high[axis]));
            if first == last {
                continue;
            }
            let level = (first ^ last).ilog2();
            let (at, cells) = (self.low[axis] + f64::from(last >> level << level) * self.cell, 1 << level);
            let is_better = |best: &Plane| {
                let extent = high - low;
                cells > best.cells || cells == best.cells && extent[axis] > extent[best.axis]
            };
            if low[axis] < at && at < high[axis] && best.as_ref().is_none_or(is_better) {
                best = Some(Plane { axis, at, cells });
            }
        }
        best
    }

    /// How much is gained by cutting a triangle, in no unit; 0: nothing.
    fn priority(&self, reference: &Reference) -> f32 {
        let emptiness = f64::from(reference.emptiness());
        // No box contains what is not a number.
        if emptiness.is_nan() || emptiness <= 0.0 {
            return 0.0;
        }
        let [low, high] = [reference.0.low(), reference.0.high()];
        let Some(plane) = self.plane([low, high].map(|corner| Vec3::from_array(corner).as_dvec3())) else { return 0.0 };
        let priority = (emptiness * f64::from(plane.cells) / f64::from(CELLS)).sqrt().sqrt() as f32;
        if priority.is_finite() { priority } else { 0.0 }
    }
}

/// Appends references to the parts of a triangle that is cut up to `cuts` times.
fn divide(grid: &Grid, triangles: &Source<'_>, reference: &Reference, cuts: u32, out: &mut Vec<Reference>) {
    let corners = triangles.corners(reference.primitive() as usize);
    match Reference::pad_of_parts(corners) {
        Some(pad) => cut(grid, reference, &Polygon::new(corners), cuts, pad, out),
        None => out.push(*reference),
    }
}

fn cut(grid: &Grid, reference: &Reference, polygon: &Polygon, cuts: u32, pad: f64, out: &mut Vec<Reference>) {
    let bounds = polygon.bounds();
    let plane = (cuts > 0).then(|| grid.plane(bounds)).flatten();
    let Some(sides) = plane.and_then(|plane| polygon.cut(plane.axis, plane.at)) else {
        out.push(reference.part(bounds, pad));
        return;
    };
    let [left, right] = [&sides[0], &sides[1]].map(|side| {
        let [low, high] = side.bounds();
        (high - low).max_element()
    });
    let cuts = cuts - 1;
    let of_left = (f64::from(cuts) * left / (left + right) + 0.5) as u32;
    cut(grid, reference, &sides[0], of_left, pad, out);
    cut(grid, reference, &sides[1], cuts - of_left, pad, out);
}
