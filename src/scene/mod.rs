//! The description of a scene: what a loader produces and a user could read. It holds no backend and no settings;
//! `render::prepare` turns it into machinery.

mod builder;
mod check;
mod motion;
mod source;

pub use crate::id::{ImageId, MaterialId, MeshId, TextureId};
pub(crate) use builder::Notes;
pub use builder::SceneBuilder;
pub(crate) use check::{Findings, MAX_COORDINATE, check_mesh};
pub use motion::{Motion, Pose};
pub use source::{SourceFile, Stamp};

use crate::camera::Camera;
use crate::light::{Environment, Light};
use crate::material::Material;
use crate::shape::Mesh;
use crate::shape::exact::ExactShape;
use crate::texture::{Image, Texture};
use glam::{DMat4, DVec3};
use std::sync::Arc;

/// A mesh placed in the world.
#[derive(Clone, Debug)]
pub struct Instance {
    /// What is placed.
    pub mesh: MeshId,
    /// Object to world space, metres; any affine map, kept in f64 until the vertices are flattened.
    pub world_from_object: DMat4,
    /// The node's name, for messages.
    pub name: String,
}

/// An exact shape placed in the world.
#[derive(Clone, Debug)]
pub struct PlacedShape {
    /// What is placed; places share it.
    pub shape: Arc<ExactShape>,
    /// What its surface is made of.
    pub material: MaterialId,
    /// Object to world space, metres; any affine map that has an inverse.
    pub world_from_object: DMat4,
    /// The node's name, for messages.
    pub name: String,
}

/// A light placed in the world (emissive surfaces are materials, not lights).
#[derive(Clone, Debug)]
pub struct PlacedLight {
    /// The light's own parameters.
    pub light: Light,
    /// Rigid part of the node's transform: a light's intensity is not scaled by nodes.
    pub world_from_light: DMat4,
    /// The node's name, for messages.
    pub name: String,
}

/// What a camera is framed on that a file does not give: of an animation the same for every frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Framing {
    /// World space, metres, lowest and highest corner; `None` = nothing to see.
    pub bounds: Option<(DVec3, DVec3)>,
    /// Sum over all triangles of area times normal, m^2, world space: which side flat things show.
    pub vector_area: DVec3,
}

/// Something in the file that the picture does not need and that was not read.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Skipped {
    /// JSON pointer without the leading slash, such as `images/3`.
    pub what: String,
    /// Why it is not needed.
    pub why: String,
}

/// A checked scene; made by [`SceneBuilder::finish`], immutable after it.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Triangle meshes, object space.
    ///
    /// Shared with the scenes of other moments where they do not change; so are images.
    pub meshes: Vec<Arc<Mesh>>,
    /// Where they are.
    pub instances: Vec<Instance>,
    /// Spheres and surfaces of revolution, where they are.
    pub shapes: Vec<PlacedShape>,
    /// Surface descriptions.
    pub materials: Vec<Material>,
    /// Image + sampler pairs.
    pub textures: Vec<Texture>,
    /// Decoded pixels.
    pub images: Vec<Arc<Image>>,
    /// Punctual lights.
    pub lights: Vec<PlacedLight>,
    /// Light from all around, in world axes.
    pub environment: Option<Environment>,
    /// Cameras with their place.
    pub cameras: Vec<Camera>,
    /// Where the node is on which lenses are to be focused, world space, metres; `None`: none was asked for.
    pub focus: Option<DVec3>,
    /// What a camera is framed on where there is none; `None` = on the scene as it is.
    pub framing: Option<Framing>,
    /// What of it moves while the shutter is open; empty for a scene at rest.
    pub motion: Motion,
    /// Which scene of the file this is.
    pub index: usize,
    /// The files it was made from, each name once, in the order in which they were looked for: the input first.
    pub sources: Vec<SourceFile>,
    /// Said to the user and written into the JSON.
    pub warnings: Vec<String>,
    /// Those of `warnings` that mean that something of the file is not in the picture.
    pub losses: Vec<String>,
    /// Parts of the file that were not needed.
    pub skipped: Vec<Skipped>,
}

impl Scene {
    /// Whether there is nothing that a ray could meet.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty() && self.triangle_count() == 0
    }

    /// Triangles after placing every instance.
    pub fn triangle_count(&self) -> usize {
        self.instances.iter().map(|i| self.meshes[i.mesh.index()].indices.len()).sum()
    }
}
