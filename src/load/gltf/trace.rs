//! Where the things of a scene come from: what has to be asked to know where they are at another time.

use super::base::Base;
use crate::scene::MeshId;
use glam::{DMat4, DVec3};
use std::sync::Arc;

/// Of each thing in the scene, by its place there.
#[derive(Debug, Default)]
pub(super) struct Trace {
    /// The node, where below it, and what; `None` for what joints place.
    pub instances: Vec<Option<(usize, DMat4, MeshId)>>,
    /// The node.
    pub cameras: Vec<usize>,
    /// The node.
    pub lights: Vec<usize>,
    /// The node, where below it, and the corners of its box.
    pub shapes: Vec<(usize, DMat4, [DVec3; 8])>,
    /// Those meshes that could change their form, if vertices are kept.
    pub forms: Vec<Form>,
}

/// A mesh of the scene in its pose.
#[derive(Debug)]
pub(super) struct Form {
    pub id: MeshId,
    pub base: Arc<Base>,
    /// Of each of its vertices the base's, where they are not the same.
    pub origin: Option<Arc<[u32]>>,
    /// Mesh and primitive of the file.
    pub key: (usize, usize),
    /// The node that shows it, whose weights count.
    pub node: usize,
    pub skin: Option<usize>,
}
