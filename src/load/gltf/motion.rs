//! What moves while the shutter is open: the animation asked again at later times, as often as it takes for straight lines
//! between them to be true.
//!
//! Each thing is watched by probes, points of it: the corners of its box, or the axes and the place of what has none. Its
//! interval is halved until linear interpolation is off by no more than [`TOLERANCE`] of how far its probes get, at the
//! quarters of every piece. Quarters, because the middle alone is where a symmetric curve (ease in, ease out) crosses its
//! chord; and pieces are no longer than from key to key of the animation to begin with, so that nothing that goes to and
//! fro can pass for still. A rotation by more than half a turn is right for the same reason.

use super::animation::Animation;
use super::kept::Kept;
use super::node::{Rigid, rigid};
use super::primitive::Found;
use super::skin::Palette;
use super::trace::{Form, Trace};
use super::{Document, Loader, Result, mesh, node, primitive, skin};
use crate::scene::{Motion, Pose, SceneBuilder};
use crate::shape::Mesh;
use glam::{DMat4, DVec3};
use gltf::json::Index;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Share of a thing's motion that it may be off by: a tenth of a pixel in a blur of 100.
const TOLERANCE: f64 = 1e-3;
/// Nodes are placed by 32-bit numbers: what they round is no motion. Relative to coordinates.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;
/// The most pieces, one less than times.
const MOST: usize = 128;
/// Probes look at the quarters of pieces.
const QUARTERS: usize = 4;
/// Finest division of the interval.
const TICKS: usize = MOST * QUARTERS;

/// Who asks.
pub(super) struct Shutter<'a> {
    pub doc: &'a mut Document,
    pub parents: &'a [Option<usize>],
    pub kept: &'a mut Kept,
    pub animation: &'a Animation,
    /// When it opens and closes, seconds.
    pub interval: [f64; 2],
    /// Where skinned meshes are placed.
    pub skin_origins: BTreeMap<usize, DVec3>,
}

/// The animated things at one time.
#[derive(Default)]
struct Snapshot {
    worlds: BTreeMap<usize, DMat4>,
    palettes: BTreeMap<usize, Arc<Palette>>,
    /// Of nodes' meshes.
    weights: BTreeMap<usize, Vec<f32>>,
}

/// Something that may move.
enum Thing<'a> {
    Instance(u32, usize, Box<(DMat4, [DVec3; 8])>),
    Camera(u32, usize),
    Light(u32, usize),
    Shape(u32, usize, Box<(DMat4, [DVec3; 8])>),
    Form(&'a Form),
}

impl Shutter<'_> {
    /// The motion of what `trace` tells of, which was placed in `builder` as at the opening.
    ///
    /// # Errors
    /// At a later time something is where nothing can be.
    pub fn motion(mut self, trace: &Trace, builder: &SceneBuilder) -> Result<Motion> {
        let [start, end] = self.interval;
        let things = self.things(trace, builder)?;
        if start >= end || things.is_empty() {
            return Ok(Motion::default());
        }
        let mut known: BTreeMap<usize, Snapshot> = BTreeMap::new();
        let mut open: Vec<usize> = (0..things.len()).collect();
        // Into how many pieces the motion of each is cut; nothing moves in none.
        let mut pieces_of = vec![0; things.len()];
        let mut pieces = (self.animation.keys_between(self.interval) + 1).next_power_of_two().min(MOST);
        while !open.is_empty() {
            let step = TICKS / (pieces * QUARTERS);
            self.look(&mut known, step, open.iter().filter_map(|&i| things.get(i)))?;
            open.retain(|&i| {
                let Some((thing, found)) = things.get(i).zip(pieces_of.get_mut(i)) else { return false };
                let probes: Vec<Vec<Vec<DVec3>>> =
                    (0..=TICKS).step_by(step).filter_map(|tick| known.get(&tick)).map(|s| thing.probes(s)).collect();
                match path(&probes, QUARTERS) {
                    Path::Still => false,
                    Path::Straight => {
                        // Keys that are close together may still lie on one line.
                        *found = pieces;
                        while *found > 1 && path(&probes, 2 * QUARTERS * pieces / *found) == Path::Straight {
                            *found /= 2;
                        }
                        false
                    }
                    Path::Curved => {
                        *found = pieces;
                        pieces < MOST
                    }
                }
            });
            pieces = (2 * pieces).min(MOST);
        }
        self.keys(&things, &pieces_of, &known, builder)
    }

    /// Everything below an animated node, and what animated joints or weights move.
    fn things<'t>(&mut self, trace: &'t Trace, builder: &SceneBuilder) -> Result<Vec<Thing<'t>>> {
        let moved = self.animation.moved_nodes(self.interval);
        let morphing = self.animation.morphing_nodes(&self.doc.root.nodes, self.interval);
        let is_moved = |node: usize| {
            let mut at = Some(node);
            while let Some(node) = at {
                if moved.contains(&node) {
                    return true;
                }
                at = self.parents.get(node).copied().flatten();
            }
            false
        };
        let mut things = Vec::new();
        for (i, place) in trace.instances.iter().enumerate() {
            if let Some((node, below, mesh)) = *place
                && is_moved(node)
            {
                things.push(Thing::Instance(i as u32, node, Box::new((below, corners(builder.mesh(mesh))))));
            }
        }
        for (i, &(node, below, corners)) in trace.shapes.iter().enumerate() {
            if is_moved(node) {
                things.push(Thing::Shape(i as u32, node, Box::new((below, corners))));
            }
        }
        let of_nodes = |nodes: &[usize]| -> Vec<(u32, usize)> {
            nodes.iter().enumerate().filter(|(_, node)| is_moved(**node)).map(|(i, node)| (i as u32, *node)).collect()
        };
        things.extend(of_nodes(&trace.cameras).into_iter().map(|(i, node)| Thing::Camera(i, node)));
        things.extend(of_nodes(&trace.lights).into_iter().map(|(i, node)| Thing::Light(i, node)));
        let has_moved_joint = |skin: usize| {
            let joints = self.doc.root.skins.get(skin).map_or(&[][..], |skin| &skin.joints);
            joints.iter().any(|joint| is_moved(joint.value()))
        };
        let mut forms = Vec::new();
        for form in &trace.forms {
            let morphs = morphing.contains(&form.node);
            if morphs || form.skin.is_some_and(has_moved_joint) {
                forms.push((form, morphs));
            }
        }
        for (form, morphs) in forms {
            if morphs {
                // All of its targets may get a weight.
                let all = vec![1.0; form.base.targets.reaches().count()];
                self.prepare(form, &all, None)?;
            }
            things.push(Thing::Form(form));
        }
        Ok(things)
    }

    /// Makes sure that what a pose takes is read.
    fn prepare(&mut self, form: &Form, weights: &[f32], palette: Option<&Palette>) -> Result<()> {
        let loader = Loader::new(self.doc, self.parents, 0, self.kept);
        let (mesh, i) = form.key;
        let Some(primitive) = loader.doc.root.meshes.get(mesh).and_then(|mesh| mesh.primitives.get(i)) else {
            return Ok(());
        };
        let found = Found { primitive, at: &format!("/meshes/{mesh}/primitives/{i}"), name: "", key: form.key };
        primitive::prepare(&loader, found, &form.base, weights, palette)
    }

    /// Poses the file at every tick that is not known yet and asks where the things are.
    fn look<'t, 'f: 't>(
        &mut self,
        known: &mut BTreeMap<usize, Snapshot>,
        step: usize,
        things: impl Iterator<Item = &'t Thing<'f>>,
    ) -> Result<()> {
        let (mut nodes, mut skins, mut shown) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
        for thing in things {
            match thing {
                Thing::Instance(_, node, ..)
                | Thing::Shape(_, node, ..)
                | Thing::Camera(_, node)
                | Thing::Light(_, node) => _ = nodes.insert(*node),
                Thing::Form(form) => {
                    skins.extend(form.skin);
                    shown.insert(form.node);
                }
            }
        }
        let [start, end] = self.interval;
        for tick in (0..=TICKS).step_by(step) {
            if known.contains_key(&tick) {
                continue;
            }
            self.animation.move_nodes(self.doc, start + (end - start) * (tick as f64 / TICKS as f64));
            let mut loader = Loader::new(self.doc, self.parents, 0, self.kept);
            loader.skin_origins.clone_from(&self.skin_origins);
            let mut snapshot = Snapshot::default();
            for &node in &nodes {
                snapshot.worlds.insert(node, node::world(&mut loader, node)?);
            }
            for &skin in &skins {
                let pointer = format!("/skins/{skin}");
                snapshot.palettes.insert(skin, skin::palette(&mut loader, Index::new(skin as u32), &pointer)?);
            }
            for &i in &shown {
                let Some(node) = loader.doc.root.nodes.get(i) else { continue };
                let Some(index) = node.mesh else { continue };
                let Some(found) = loader.doc.root.meshes.get(index.value()) else { continue };
                let weights = mesh::weights(loader.doc, found, index.value(), node, &format!("/nodes/{i}"))?;
                snapshot.weights.insert(i, weights);
            }
            known.insert(tick, snapshot);
        }
        Ok(())
    }

    /// The motion, cut into as many pieces as was found.
    fn keys(
        &mut self,
        things: &[Thing],
        pieces_of: &[usize],
        known: &BTreeMap<usize, Snapshot>,
        builder: &SceneBuilder,
    ) -> Result<Motion> {
        let mut motion = Motion::default();
        let forms = things.iter().zip(pieces_of).filter(|(thing, _)| matches!(thing, Thing::Form(_)));
        // Meshes share their times.
        let of_forms = forms.map(|(_, pieces)| *pieces).max().unwrap_or(0);
        for (thing, &pieces) in things.iter().zip(pieces_of).filter(|(_, pieces)| **pieces > 0) {
            let pieces = if matches!(thing, Thing::Form(_)) { of_forms } else { pieces };
            let later = || (1..=pieces).filter_map(|i| known.get(&(i * TICKS / pieces)));
            let worlds = |node: &usize| later().filter_map(|s| s.worlds.get(node).copied()).collect::<Vec<DMat4>>();
            match thing {
                Thing::Instance(i, node, placed) => {
                    motion.instances.insert(*i, worlds(node).into_iter().map(|world| world * placed.0).collect());
                }
                Thing::Shape(i, node, placed) => {
                    motion.shapes.insert(*i, worlds(node).into_iter().map(|world| world * placed.0).collect());
                }
                Thing::Camera(i, node) => _ = motion.cameras.insert(*i, worlds(node).iter().map(frame).collect()),
                Thing::Light(i, node) => _ = motion.lights.insert(*i, worlds(node).iter().map(frame).collect()),
                Thing::Form(form) => {
                    let at = builder.mesh(form.id);
                    let mut poses: Vec<Pose> = Vec::with_capacity(pieces);
                    // A form that was settled early is not known at the finer times of others.
                    let mut own = BTreeMap::new();
                    self.look(&mut own, TICKS / pieces, std::iter::once(thing))?;
                    for snapshot in own.values().skip(1) {
                        let weights = snapshot.weights.get(&form.node).map_or(&[][..], |w| w);
                        let palette = form.skin.and_then(|skin| snapshot.palettes.get(&skin));
                        let palette = palette.map(|palette| &**palette);
                        poses.push(form.base.pose(at, form.origin.as_deref(), weights, palette));
                    }
                    motion.meshes.insert(form.id.0, poses);
                }
            }
        }
        Ok(motion)
    }
}

/// The corners of the box of a mesh, object space.
fn corners(mesh: &Mesh) -> [DVec3; 8] {
    let points = mesh.positions.iter().map(|p| DVec3::from_array(p.map(f64::from))).filter(|p| p.is_finite());
    box_corners(points.map(|p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default())
}

pub(super) fn box_corners((low, high): (DVec3, DVec3)) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let pick = |k: usize, low: f64, high: f64| if i >> k & 1 == 1 { high } else { low };
        DVec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
    })
}

/// The rigid part; without a direction, the place alone.
fn frame(world: &DMat4) -> DMat4 {
    match rigid(world) {
        Rigid::Frame(frame) | Rigid::NoDirection(frame) => frame,
    }
}

impl Thing<'_> {
    /// Points whose paths tell how it moves, in groups that are judged each by its own size.
    fn probes(&self, snapshot: &Snapshot) -> Vec<Vec<DVec3>> {
        match self {
            Thing::Instance(_, node, placed) | Thing::Shape(_, node, placed) => {
                let (below, corners) = &**placed;
                let world = snapshot.worlds.get(node).copied().unwrap_or_default() * *below;
                vec![corners.iter().map(|&c| world.transform_point3(c)).collect()]
            }
            Thing::Camera(_, node) | Thing::Light(_, node) => {
                let frame = frame(&snapshot.worlds.get(node).copied().unwrap_or_default());
                let [x, y, z, place] = [frame.x_axis, frame.y_axis, frame.z_axis, frame.w_axis].map(|v| v.truncate());
                vec![vec![x, y, z], vec![place]]
            }
            Thing::Form(form) => {
                let mut points = Vec::new();
                let palette = form.skin.and_then(|skin| snapshot.palettes.get(&skin));
                if let (Some(palette), Some(influences)) = (palette, form.base.influences.get()) {
                    let boxes = influences.boxes(form.base.mesh()).iter().zip(&palette.matrices);
                    for (found, matrix) in boxes.filter_map(|(found, matrix)| Some((found.as_ref()?, matrix))) {
                        points.extend(box_corners(*found).map(|c| matrix.transform_point3(c)));
                    }
                }
                let weights = snapshot.weights.get(&form.node).map_or(&[][..], |w| w);
                points.extend(form.base.targets.reaches().zip(weights).map(|(r, &w)| DVec3::X * (r * f64::from(w))));
                vec![points]
            }
        }
    }
}

/// How a thing moves.
#[derive(PartialEq, Eq)]
enum Path {
    Still,
    /// From piece to piece, as nearly as is asked for.
    Straight,
    Curved,
}

/// Judges `[time][group][point]`, at evenly spaced times, in pieces of so many steps.
fn path(probes: &[Vec<Vec<DVec3>>], steps: usize) -> Path {
    let Some((first, later)) = probes.split_first() else { return Path::Still };
    if later.iter().all(|probes| probes == first) {
        return Path::Still;
    }
    for group in 0..first.len() {
        let points = |time: &Vec<Vec<DVec3>>| time.get(group).cloned().unwrap_or_default();
        let paths: Vec<Vec<DVec3>> = probes.iter().map(points).collect();
        let Some(start) = paths.first() else { continue };
        let distances = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        let travel = paths.iter().map(|at| distances(at, start)).fold(0.0, f64::max);
        let size = paths.iter().flatten().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let allowed = TOLERANCE * travel + ROUNDING * size;
        for piece in paths.windows(steps + 1).step_by(steps) {
            let (Some(from), Some(to)) = (piece.first(), piece.last()) else { continue };
            for (k, at) in piece.iter().enumerate() {
                let share = k as f64 / steps as f64;
                let straight: Vec<DVec3> = from.iter().zip(to).map(|(&a, &b)| a + (b - a) * share).collect();
                if distances(at, &straight) > allowed {
                    return Path::Curved;
                }
            }
        }
    }
    Path::Straight
}
