//! Where things are: the boxes of meshes and of their instances, and which instances a mesh has.

use super::{moving, shapes};
use crate::scene::{Instance, MAX_COORDINATE, MeshId, Scene};
use crate::shape::Mesh;
use glam::{DMat4, DVec3, Vec3};
use rayon::prelude::*;

/// Boxes of instances are exact up to this many triangles to be placed of a mesh, over all its instances. Beyond, an
/// instance's box is that of its mesh's box, which can only be larger.
const MOST_EXACT: usize = 1 << 24;

/// Low and high corner; `None` of nothing.
pub type Bounds = Option<(DVec3, DVec3)>;

/// The boxes of a scene.
pub struct Boxes {
    /// Of each mesh, in its own space: what its triangles use.
    of_meshes: Vec<Bounds>,
    /// The instances of mesh i are `instances[first[i]..first[i + 1]]`, ascending.
    first: Vec<usize>,
    instances: Vec<u32>,
    /// Of everything placed, world space, metres.
    pub scene: Bounds,
}

impl Boxes {
    /// Looks at every mesh of `scene`, and at every instance.
    pub fn of(scene: &Scene) -> Self {
        let of_meshes = scene.meshes.par_iter().map(|mesh| box_of_mesh(mesh)).collect();
        let mut first = vec![0; scene.meshes.len() + 1];
        for instance in &scene.instances {
            first[instance.mesh.index() + 1] += 1;
        }
        for i in 0..scene.meshes.len() {
            first[i + 1] += first[i];
        }
        let (mut next, mut instances) = (first.clone(), vec![0; scene.instances.len()]);
        for (i, instance) in scene.instances.iter().enumerate() {
            let at = &mut next[instance.mesh.index()];
            instances[*at] = i as u32;
            *at += 1;
        }
        let mut boxes = Self { of_meshes, first, instances, scene: None };
        let of_instances = (0..scene.instances.len()).filter_map(|i| boxes.of_instance(scene, i));
        boxes.scene = of_instances.chain(shapes::bounds(scene)).reduce(join);
        boxes
    }

    /// The instances of a mesh, ascending.
    pub fn instances_of(&self, mesh: MeshId) -> &[u32] {
        &self.instances[self.first[mesh.index()]..self.first[mesh.index() + 1]]
    }

    /// The box of a mesh in its own space.
    pub fn of_mesh(&self, mesh: MeshId) -> Bounds {
        self.of_meshes[mesh.index()]
    }

    /// World position of the prepared space's origin: the centre of the scene.
    pub fn origin(&self) -> DVec3 {
        self.scene.map_or(DVec3::ZERO, |(low, high)| 0.5 * (low + high))
    }

    /// World box of instance `i`, at all times of the shutter.
    fn of_instance(&self, scene: &Scene, i: usize) -> Bounds {
        let instance = &scene.instances[i];
        let first = self.of_map(scene, instance);
        if !moving::moves(scene, i) {
            return first;
        }
        // Vertices move linearly in between.
        let mesh = &scene.meshes[instance.mesh.index()];
        let later = moving::later(scene, i, moving::most_keys(scene, &[i as u32]));
        let later = later.iter().filter_map(|later| {
            let positions = later.pose.map_or(&mesh.positions, |pose| &pose.positions);
            exact(mesh, positions, &later.world_from_object)
        });
        first.into_iter().chain(later).reduce(join)
    }

    /// World box of an instance when the shutter opens.
    fn of_map(&self, scene: &Scene, instance: &Instance) -> Bounds {
        let mesh = &scene.meshes[instance.mesh.index()];
        let world_from_object = &instance.world_from_object;
        if mesh.indices.len().saturating_mul(self.instances_of(instance.mesh).len()) > MOST_EXACT {
            let placed = placed(world_from_object, self.of_mesh(instance.mesh)?);
            if [placed.0, placed.1].iter().all(is_usable) {
                return Some(placed);
            }
        }
        exact(mesh, &mesh.positions, world_from_object)
    }
}

/// The box about both.
pub fn join(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> (DVec3, DVec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Half the surface of a box, m^2.
pub fn area((low, high): (DVec3, DVec3)) -> f64 {
    let d = high - low;
    d.x * d.y + d.y * d.z + d.z * d.x
}

/// The box about the box `of` carried by `map`.
pub fn placed(map: &DMat4, (low, high): (DVec3, DVec3)) -> (DVec3, DVec3) {
    let (centre, half) = (map.transform_point3(0.5 * (low + high)), 0.5 * (high - low));
    let axis = |i: usize| map.col(i).truncate().abs() * half[i];
    let reach = axis(0) + axis(1) + axis(2);
    (centre - reach, centre + reach)
}

fn box_of_mesh(mesh: &Mesh) -> Bounds {
    let corners = mesh.indices.as_flattened().iter().map(|&i| Vec3::from(mesh.positions[i as usize]));
    let bounds = corners.map(|p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    bounds.map(|(low, high)| (low.as_dvec3(), high.as_dvec3()))
}

/// Only vertices that a triangle uses, and only triangles that are kept: one that flies off to 1e30 m would leave the
/// others no digits.
fn exact(mesh: &Mesh, positions: &[[f32; 3]], world_from_object: &DMat4) -> Bounds {
    let place = |i: u32| world_from_object.transform_point3(Vec3::from(positions[i as usize]).as_dvec3());
    let corners = mesh.indices.iter().map(|triangle| triangle.map(place));
    let kept = corners.filter(|corners| corners.iter().all(is_usable));
    kept.flatten().map(|p| (p, p)).reduce(join)
}

/// Whether every backend takes a triangle with the corner `p`; placing it may have moved it out of range.
pub fn is_usable(p: &DVec3) -> bool {
    p.to_array().iter().all(|c| c.abs() <= f64::from(MAX_COORDINATE))
}
