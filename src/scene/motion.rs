//! What moves while the shutter is open. A scene at rest has none of it and pays nothing for it.

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
