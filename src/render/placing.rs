//! Which meshes are merged into the world and which are placed: decided once per scene, by estimated cost.
//!
//! Merged, a mesh costs time and memory for each instance, and rays know no difference. Placed, it is there once, and
//! rays pay wherever they enter the box of an instance. The choice depends on the scene and on nothing else, so that
//! every run, backend and number of samples makes the same; docs/decisions/0008-two-level.md has the measurements.

use super::boxes::{Boxes, area, join, placed};
use super::moving;
use crate::accel::geometry::Affine;
use crate::math::robust::gamma;
use crate::scene::{Instance, MeshId, Scene};
use crate::shape::placement::PlacementError;
use glam::{DMat3, DMat4, DVec3};
use serde::Serialize;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Nanoseconds that a merged triangle costs: its records, its leaf and its share of the tree. Measured on one core.
const MERGE_NS: f64 = 700.0;
/// Nanoseconds that a placement costs whatever it places: its records and its leaf in the upper tree.
const PLACE_NS: f64 = 1000.0;
/// Nanoseconds that a ray pays to enter a placement's box: it is carried over and starts at another root.
const ENTRY_NS: f64 = 60.0;
/// Share of the rays entering a box that end in it, so that a ray enters 1 / this many at most on average. Dense objects
/// stop more, and cost less than estimated.
const STOPPED: f64 = 0.25;
/// Rays of a picture, for the sake of the estimate. Not the picture's own number, since what is placed must not depend on
/// how many samples a picture is made of.
const RAYS: f64 = 1e8;
/// Merged triangles beyond which meshes are placed whatever rays pay for it: about 12 GiB with either backend.
const MOST_MERGED: u64 = 60_000_000;
/// Times by which placing may lengthen the offset of ray origins; what would lose more precision is merged.
const MOST_OFFSET: f64 = 8.0;
/// Times by which an object may be stretched in one direction more than in another: its normals are rounded to f32
/// before they are carried, and the stretch magnifies that.
const MOST_STRETCHED: f64 = 1e3;
/// Coordinates that the scene may reach in an object's space: their squares must not leave f32.
const MOST_CARRIED: f64 = 1e15;

/// Volumes by which an object may be scaled, and their inverse: what f32 holds, and room.
const MOST_SCALED: f64 = 1e36;

/// Who decides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Choice {
    /// The estimated cost.
    #[default]
    Auto,
    /// Everything is merged.
    Never,
    /// Whatever can be placed is placed, even what has a single instance. For tests.
    Always,
}

/// Meshes that have the same places: one object for rays.
#[derive(Clone, Debug)]
pub struct Thing {
    /// Its meshes.
    pub meshes: Vec<MeshId>,
    /// Centre of its box, in the space of its meshes: the origin of the object's own space, so that f32 serves what is
    /// modelled far from its origin.
    pub centre: DVec3,
    /// The instances of its first mesh that are placed, by their index in the scene.
    pub instances: Vec<u32>,
}

/// What was decided.
#[derive(Clone, Debug, Default)]
pub struct Placing {
    /// What is placed.
    pub things: Vec<Thing>,
    /// Whether an instance of the scene is merged, by its index.
    pub is_merged: Vec<bool>,
    /// Instances that are neither: their vertices are known at several times of the shutter. Ascending.
    pub deformed: Vec<u32>,
    /// What was considered: all that has several instances.
    pub considered: Vec<Considered>,
}

/// A mesh, or meshes with the same places, that could be placed, and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Considered {
    /// Name of the mesh, or of the first of them.
    pub mesh: String,
    /// Meshes.
    pub meshes: u64,
    /// Triangles of one instance.
    pub triangles: u64,
    /// Instances.
    pub instances: u64,
    /// Those of them that are placed; the others are merged.
    pub placed: u64,
    /// Estimated seconds of one core to merge what could be placed.
    pub merge_seconds: f64,
    /// Estimated seconds of one core that its rays and placements cost instead, in a picture of 10^8 rays.
    pub place_seconds: f64,
    /// The reason.
    pub why: &'static str,
}

impl Placing {
    /// What `render::prepare` decides for `scene`. Looks at vertices only where something could be placed.
    pub fn of_scene(scene: &Scene) -> Self {
        let mut is_used = vec![false; scene.meshes.len()];
        let mut repeats = |mesh: usize| std::mem::replace(&mut is_used[mesh], true);
        if scene.motion.is_empty() && !scene.instances.iter().any(|instance| repeats(instance.mesh.index())) {
            return Self { is_merged: vec![true; scene.instances.len()], ..Self::default() };
        }
        Self::of(scene, &Boxes::of(scene), Choice::Auto)
    }

    /// Decides for `scene`.
    pub fn of(scene: &Scene, boxes: &Boxes, choice: Choice) -> Self {
        let mut placing = Self { is_merged: vec![true; scene.instances.len()], ..Self::default() };
        let moves = move_apart(scene, boxes, &mut placing);
        if choice == Choice::Never {
            return placing;
        }
        let mut candidates = candidates(scene, boxes, if choice == Choice::Always { 1 } else { 2 }, &moves);
        decide(&mut candidates, scene.triangle_count() as u64, choice);
        for candidate in candidates {
            if candidate.instances > 1 {
                placing.considered.push(candidate.report(scene));
            }
            if !candidate.is_placed {
                continue;
            }
            for &mesh in &candidate.meshes {
                let all = boxes.instances_of(mesh);
                candidate.usable.iter().for_each(|&k| placing.is_merged[all[k as usize] as usize] = false);
            }
            let all = boxes.instances_of(candidate.meshes[0]);
            let instances = candidate.usable.iter().map(|&k| all[k as usize]).collect();
            placing.things.push(Thing { meshes: candidate.meshes, centre: candidate.centre, instances });
        }
        placing
    }

    /// Instances that are held on their own: merged or deformed.
    pub fn held<'a>(&'a self, scene: &'a Scene) -> impl Iterator<Item = &'a Instance> + 'a {
        let merged =
            scene.instances.iter().zip(&self.is_merged).filter_map(|(instance, merged)| merged.then_some(instance));
        merged.chain(self.deformed.iter().map(|&i| &scene.instances[i as usize]))
    }

    /// Placed things, each as often as it is placed.
    pub fn placements(&self) -> usize {
        self.things.iter().map(|thing| thing.instances.len()).sum()
    }
}

impl Thing {
    /// The maps to the prepared space, whose origin is at `origin` in world space, from the object's, when the shutter
    /// opens.
    pub fn places<'a>(&'a self, scene: &'a Scene, origin: DVec3) -> impl Iterator<Item = DMat4> + 'a {
        self.instances.iter().map(move |&i| place(&scene.instances[i as usize].world_from_object, self.centre, origin))
    }

    /// [`Self::places`] at every key: one for what stands still.
    pub fn keys<'a>(&'a self, scene: &'a Scene, origin: DVec3) -> impl Iterator<Item = Vec<DMat4>> + 'a {
        self.instances.iter().map(move |&i| keys(scene, i as usize, self.centre, origin))
    }
}

/// The maps of instance `i` at all of its keys, see [`place`].
fn keys(scene: &Scene, i: usize, centre: DVec3, origin: DVec3) -> Vec<DMat4> {
    let keys = moving::keys_of_instance(scene, i);
    if keys == 1 {
        return vec![place(&scene.instances[i].world_from_object, centre, origin)];
    }
    (0..keys).map(|k| place(&moving::map_at(scene, i, k, keys), centre, origin)).collect()
}

/// Whether a mesh shines.
fn emits(scene: &Scene, mesh: MeshId) -> bool {
    let material = &scene.materials[scene.meshes[mesh.index()].material.index()];
    !material.unlit && material.emission.factor.iter().any(|&e| e > 0.0)
}

/// Decides about the instances that move, and says which they are. What keeps its form is placed at every key, so that only
/// its map moves; its vertices do where that would cost precision, and where it shines, since points on lights are chosen in
/// the world.
fn move_apart(scene: &Scene, boxes: &Boxes, placing: &mut Placing) -> Vec<bool> {
    let mut moves = vec![false; scene.instances.len()];
    if scene.motion.is_empty() {
        return moves;
    }
    let mut things: Vec<(Vec<DMat4>, Thing)> = Vec::new();
    for (i, instance) in scene.instances.iter().enumerate().filter(|&(i, _)| moving::moves(scene, i)) {
        (moves[i], placing.is_merged[i]) = (true, false);
        let deforms = moving::keys_of_mesh(scene, instance.mesh.index()) > 1;
        if deforms || emits(scene, instance.mesh) || !can_move(scene, boxes, i) {
            placing.deformed.push(i as u32);
            continue;
        }
        // The meshes of a node have the same maps, and come one after the other.
        let maps = keys(scene, i, DVec3::ZERO, DVec3::ZERO);
        match things.last_mut().filter(|(last, _)| *last == maps) {
            Some((_, thing)) => thing.meshes.push(instance.mesh),
            None => {
                let (meshes, instances) = (vec![instance.mesh], vec![i as u32]);
                things.push((maps, Thing { meshes, centre: DVec3::ZERO, instances }));
            }
        }
    }
    let mut known: HashMap<Vec<u32>, usize> = HashMap::new();
    for (_, thing) in things {
        let meshes = thing.meshes.iter().map(|mesh| mesh.0).collect();
        if let Some(&at) = known.get(&meshes) {
            placing.things[at].instances.extend(thing.instances);
            continue;
        }
        known.insert(meshes, placing.things.len());
        let bounds = thing.meshes.iter().filter_map(|&mesh| boxes.of_mesh(mesh)).reduce(join);
        let centre = bounds.map_or(DVec3::ZERO, |(low, high)| 0.5 * (low + high));
        placing.things.push(Thing { centre, ..thing });
    }
    moves
}

/// Whether instance `i` can be placed at every key, and in between: it is not turned inside out.
fn can_move(scene: &Scene, boxes: &Boxes, i: usize) -> bool {
    let (Some((low, high)), Some(whole)) = (boxes.of_mesh(scene.instances[i].mesh), boxes.scene) else { return false };
    let (half, radius) = (0.5 * (high - low), 0.5 * (whole.1 - whole.0).max_element());
    let maps = keys(scene, i, 0.5 * (low + high), boxes.origin());
    let determinant = |map: &DMat4| DMat3::from_mat4(*map).determinant();
    let side = determinant(&maps[0]).signum();
    let between = maps.windows(2).map(|pair| (pair[0] + pair[1]) * 0.5);
    maps.iter().copied().chain(between).all(|map| can_be_placed(&map, half, radius) && determinant(&map) * side > 0.0)
}

/// To the prepared space, from that of an object about `centre`.
fn place(world_from_mesh: &DMat4, centre: DVec3, origin: DVec3) -> DMat4 {
    let mut map = *world_from_mesh;
    map.w_axis = (world_from_mesh.transform_point3(centre) - origin).extend(1.0);
    map
}

/// The elements in f32, as backends and shading have them.
pub fn rounded(map: &DMat4) -> Affine {
    let column = |i: usize| map.col(i).truncate().as_vec3();
    Affine { columns: [column(0), column(1), column(2)], translation: column(3) }
}

/// What could be placed.
struct Candidate {
    meshes: Vec<MeshId>,
    /// Triangles of one instance.
    triangles: u64,
    instances: usize,
    centre: DVec3,
    /// Which of the instances can be placed, by their place among those of any of the meshes.
    usable: Vec<u32>,
    /// Boxes of such instances that a line through the scene meets on average.
    entries: f64,
    emits: bool,
    is_placed: bool,
    why: &'static str,
}

impl Candidate {
    /// Triangles that need not be there when it is placed.
    fn saved(&self) -> u64 {
        (self.usable.len() as u64).saturating_sub(1).saturating_mul(self.triangles)
    }

    fn merge_seconds(&self) -> f64 {
        self.saved() as f64 * MERGE_NS * 1e-9
    }

    fn place_seconds(&self) -> f64 {
        // Each entry is left alive with the same chance, whatever lies behind.
        let entries = (1.0 - (1.0 - STOPPED).powf(self.entries)) / STOPPED;
        (entries * RAYS * ENTRY_NS + self.usable.len() as f64 * PLACE_NS) * 1e-9
    }

    fn report(&self, scene: &Scene) -> Considered {
        Considered {
            mesh: scene.meshes[self.meshes[0].index()].name.clone(),
            meshes: self.meshes.len() as u64,
            triangles: self.triangles,
            instances: self.instances as u64,
            placed: if self.is_placed { self.usable.len() as u64 } else { 0 },
            merge_seconds: self.merge_seconds(),
            place_seconds: self.place_seconds(),
            why: self.why,
        }
    }
}

/// Meshes of at least `least` instances, those with the same places together; without those that have an instance that
/// `moves`.
fn candidates(scene: &Scene, boxes: &Boxes, least: usize, moves: &[bool]) -> Vec<Candidate> {
    let mut found: Vec<Candidate> = Vec::new();
    let mut known: HashMap<u64, Vec<usize>> = HashMap::new();
    let transform = |i: &u32| &scene.instances[*i as usize].world_from_object;
    for (i, mesh) in scene.meshes.iter().enumerate() {
        let (id, all) = (MeshId(i as u32), boxes.instances_of(MeshId(i as u32)));
        if all.len() < least.max(1) || mesh.indices.is_empty() || all.iter().any(|&i| moves[i as usize]) {
            continue;
        }
        let emits = emits(scene, id);
        let mut hasher = DefaultHasher::new();
        emits.hash(&mut hasher);
        all.iter().for_each(|i| transform(i).to_cols_array().map(f64::to_bits).hash(&mut hasher));
        let alike = known.entry(hasher.finish()).or_default();
        let same = |&c: &usize| {
            let other = boxes.instances_of(found[c].meshes[0]);
            found[c].emits == emits
                && other.len() == all.len()
                && other.iter().zip(all).all(|(a, b)| transform(a) == transform(b))
        };
        if let Some(c) = alike.iter().copied().find(same) {
            found[c].meshes.push(id);
            found[c].triangles += mesh.indices.len() as u64;
            continue;
        }
        alike.push(found.len());
        found.push(Candidate {
            meshes: vec![id],
            triangles: mesh.indices.len() as u64,
            instances: all.len(),
            centre: DVec3::ZERO,
            usable: Vec::new(),
            entries: 0.0,
            emits,
            is_placed: false,
            why: "",
        });
    }
    found.iter_mut().for_each(|candidate| look(candidate, scene, boxes));
    found
}

/// Finds out which instances of `candidate` can be placed, and how often rays would enter them.
fn look(candidate: &mut Candidate, scene: &Scene, boxes: &Boxes) {
    let bounds = candidate.meshes.iter().filter_map(|&mesh| boxes.of_mesh(mesh)).reduce(join);
    let (Some((low, high)), Some(whole)) = (bounds, boxes.scene) else { return };
    candidate.centre = 0.5 * (low + high);
    let (half, radius) = (0.5 * (high - low), 0.5 * (whole.1 - whole.0).max_element());
    for (k, &i) in boxes.instances_of(candidate.meshes[0]).iter().enumerate() {
        let map = &scene.instances[i as usize].world_from_object;
        if can_be_placed(&place(map, candidate.centre, boxes.origin()), half, radius) {
            candidate.usable.push(k as u32);
            // The share of lines through a convex body that meet a convex body inside it is that of their surfaces.
            let share = area(placed(map, (low, high))) / area(whole);
            candidate.entries += if share.is_finite() { share.min(1.0) } else { 1.0 };
        }
    }
}

/// Whether rays can be carried to the object and back without losing much: it reaches `half` from its origin, the scene
/// `radius` from the prepared space's.
fn can_be_placed(prepared_from_object: &DMat4, half: DVec3, radius: f64) -> bool {
    let (linear, translation) = (DMat3::from_mat4(*prepared_from_object), prepared_from_object.w_axis.truncate());
    // Embree inverts by the determinant in f32.
    let determinant = linear.determinant().abs();
    if !rounded(prepared_from_object).is_usable() || !(1.0 / MOST_SCALED..=MOST_SCALED).contains(&determinant) {
        return false;
    }
    let reach = |m: DMat3, v: DVec3| m.x_axis.abs() * v.x + m.y_axis.abs() * v.y + m.z_axis.abs() * v.z;
    let size = |m: DMat3| m.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
    let stretch = size(linear) * size(linear.inverse());
    let carried = reach(linear.inverse(), DVec3::splat(radius) + translation.abs()).max_element();
    let error = PlacementError::of(linear, translation).at(half.max_element()).max_element();
    let merged = f64::from(gamma(16)) * (reach(linear, half) + translation.abs()).max_element();
    // Written so that NaN is refused.
    carried <= MOST_CARRIED && stretch <= MOST_STRETCHED && error <= MOST_OFFSET * merged
}

/// Decides about each of `candidates` of a scene of so many `triangles`, all instances counted.
fn decide(candidates: &mut [Candidate], triangles: u64, choice: Choice) {
    let mut merged = triangles;
    for candidate in candidates.iter_mut() {
        let (place, why) = match () {
            () if candidate.emits => (false, "it emits light, and points on lights are chosen in the world"),
            () if candidate.usable.is_empty() => (false, "placing it would cost precision"),
            () if choice == Choice::Always => (true, "as asked"),
            () if candidate.merge_seconds() > candidate.place_seconds() => (true, "merging it would cost more"),
            () => (false, "placing it would cost rays more"),
        };
        (candidate.is_placed, candidate.why) = (place, why);
        merged -= if place { candidate.saved() } else { 0 };
    }
    let mut others: Vec<&mut Candidate> = candidates.iter_mut().filter(|c| !c.is_placed && !c.emits).collect();
    // The sort is stable: equal ones in the order of the file.
    others.sort_by_key(|candidate| std::cmp::Reverse(candidate.saved()));
    for candidate in others {
        if merged <= MOST_MERGED || candidate.saved() == 0 {
            break;
        }
        (candidate.is_placed, candidate.why) = (true, "merged, there would be more than 60 million triangles");
        merged -= candidate.saved();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(triangles: u64, instances: usize, entries: f64) -> Candidate {
        Candidate {
            meshes: vec![MeshId(0)],
            triangles,
            instances,
            centre: DVec3::ZERO,
            usable: (0..instances as u32).collect(),
            entries,
            emits: false,
            is_placed: false,
            why: "",
        }
    }

    fn decided(mut candidates: Vec<Candidate>) -> Vec<bool> {
        let triangles = candidates.iter().map(|c| c.triangles * c.instances as u64).sum();
        decide(&mut candidates, triangles, Choice::Auto);
        candidates.iter().map(|c| c.is_placed).collect()
    }

    #[test]
    fn what_is_repeated_much_is_placed_and_what_rays_meet_often_is_merged() {
        let (small, large) = (candidate(100, 1000, 1.0), candidate(100_000, 1000, 1.0));
        // The same number of triangles, in boxes that rays hardly meet.
        let rare = candidate(100, 100_000, 0.01);
        assert_eq!(decided(vec![small, large, rare]), [false, true, true]);
    }

    #[test]
    fn beyond_the_most_that_may_be_merged_those_that_save_most_are_placed() {
        let of = |million: u64| candidate(million * 1_000_000, 2, 1e3);
        assert!(of(30).merge_seconds() < of(30).place_seconds(), "rays alone would have it merged");
        assert_eq!(decided(vec![of(8), of(24), of(9)]), [false, true, false]);
        assert_eq!(decided(vec![of(8), of(9), of(10)]), [false, false, false]);
        let lamp = Candidate { emits: true, ..of(40) };
        assert_eq!(decided(vec![lamp, of(8)]), [false, true]);
    }

    #[test]
    fn what_f32_could_not_carry_is_merged() {
        let (half, radius) = (DVec3::ONE, 100.0);
        let at = |m: DMat4, x: f64| DMat4::from_translation(DVec3::new(x, 2.0, 3.0)) * m;
        let turned = DMat4::from_rotation_x(0.7) * DMat4::from_rotation_y(0.3);
        for (place, can) in [
            (at(turned, 10.0), true),
            (at(DMat4::from_scale(DVec3::new(-1.0, 2.0, 0.5)), 10.0), true),
            (at(turned * DMat4::from_scale(DVec3::splat(1e-4)), 10.0), true),
            (at(turned * DMat4::from_scale(DVec3::splat(1e-20)), 10.0), false),
            (at(DMat4::from_scale(DVec3::new(1e-3, 1.0, 1e3)), 10.0), false),
            (at(turned * DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0)), 10.0), false),
            (at(turned * DMat4::from_scale(DVec3::new(1.0, 1.0, 1e-5)) * turned, 10.0), false),
        ] {
            assert_eq!(can_be_placed(&place, half, radius), can, "{place}");
        }
    }
}
