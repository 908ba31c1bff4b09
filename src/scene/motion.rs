//! What moves while the shutter is open. A scene at rest has none of it and pays nothing for it.

use super::Scene;
use crate::shape::Mesh;
use glam::DMat4;
use std::collections::BTreeMap;

/// Where things are at later times of the shutter, by their index in the scene. The scene itself is as at its opening
/// (time 0); each list holds the times after that, evenly spaced up to its closing (time 1), and is not empty. In between
/// vertices and the elements of maps are interpolated linearly: whoever makes the lists gives as many times as the motion's
/// curvature needs.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// World from object space.
    pub instances: BTreeMap<u32, Vec<DMat4>>,
    /// World from object space of exact shapes.
    pub shapes: BTreeMap<u32, Vec<DMat4>>,
    /// Meshes that change their form.
    pub meshes: BTreeMap<u32, Vec<Pose>>,
    /// World from camera space, rigid.
    pub cameras: BTreeMap<u32, Vec<DMat4>>,
    /// World from light space, rigid.
    pub lights: BTreeMap<u32, Vec<DMat4>>,
}

/// The vertices of a mesh at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// As many as the mesh's.
    pub positions: Vec<[f32; 3]>,
    /// As many as the mesh's, where it has any.
    pub normals: Option<Vec<[f32; 3]>>,
    /// As many as the mesh's, where it has any; with the handedness.
    pub tangents: Option<Vec<[f32; 4]>>,
}

impl Motion {
    /// Whether nothing moves.
    pub fn is_empty(&self) -> bool {
        let Self { instances, shapes, meshes, cameras, lights } = self;
        instances.is_empty() && shapes.is_empty() && meshes.is_empty() && cameras.is_empty() && lights.is_empty()
    }
}

/// Forgets what keeps its place and form at all times.
///
/// # Panics
/// When an index, the length of a list or a transform is wrong: a bug of the loader.
pub(super) fn clean(scene: &mut Scene) {
    let Scene { motion, instances, shapes, meshes, cameras, lights, .. } = scene;
    let keep = |first: &DMat4, later: &[DMat4]| {
        assert!(later.iter().all(DMat4::is_finite), "world transforms are finite");
        later.iter().any(|m| m != first)
    };
    motion.instances.retain(|&i, later| keep(&instances[i as usize].world_from_object, later));
    motion.shapes.retain(|&i, later| keep(&shapes[i as usize].world_from_object, later));
    motion.cameras.retain(|&i, later| keep(&cameras[i as usize].world_from_camera, later));
    motion.lights.retain(|&i, later| keep(&lights[i as usize].world_from_light, later));
    motion.meshes.retain(|&i, later| {
        let mesh = &meshes[i as usize];
        let n = mesh.positions.len();
        later.iter().for_each(|pose| pose.check(n));
        later.iter().any(|pose| pose.differs(mesh))
    });
    let mut keys = motion.meshes.values().map(Vec::len);
    let first = keys.next();
    assert!(keys.all(|n| Some(n) == first), "meshes that change their form have equally many keys");
}

impl Pose {
    fn check(&self, n: usize) {
        assert_eq!(self.positions.len(), n, "as many vertices as the mesh");
        assert!(self.normals.as_ref().is_none_or(|a| a.len() == n), "one normal per vertex");
        assert!(self.tangents.as_ref().is_none_or(|a| a.len() == n), "one tangent per vertex");
    }

    /// Whether it is not `mesh` as it is when the shutter opens. NaN differs from itself, and is dealt with later.
    fn differs(&self, mesh: &Mesh) -> bool {
        self.positions != mesh.positions
            || (self.normals.is_some() && self.normals != mesh.normals)
            || (self.tangents.is_some() && self.tangents != mesh.tangents)
    }
}
