//! Shapes: triangle meshes, and exact ones.

pub mod exact;
pub mod moving;
pub mod placement;
pub mod table;

use crate::id::MaterialId;

/// Triangles of one material, object space (one glTF primitive).
#[derive(Clone, Debug)]
pub struct Mesh {
    /// `[n][3]` metres, object space, finite.
    pub positions: Vec<[f32; 3]>,
    /// `[n][3]` shading normals, object space, any length; `None` = flat shading.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Sets of `[n][2]` texture coordinates, v = 0 at the top: those that the material's textures name, in the order of
    /// their `TextureRef::uv_set`; at most [`crate::math::MAX_UV_SETS`]. A set that is missing reads as 0.
    pub uv_sets: Vec<Vec<[f32; 2]>>,
    /// `[n][4]` vertex colours, linear R G B and opacity; they multiply the base colour.
    pub colors: Option<Vec<[f32; 4]>>,
    /// `[n][4]` tangents, w = handedness (+1 or -1); only where the material has a normal map.
    pub tangents: Option<Vec<[f32; 4]>>,
    /// `[m][3]` vertex indices, counter-clockwise seen from the front; all `< n`.
    pub indices: Vec<[u32; 3]>,
    /// What the surface is made of.
    pub material: MaterialId,
    /// For messages: the mesh's name or JSON pointer.
    pub name: String,
}

impl Mesh {
    /// One of positions (`[n][3]` metres, object space) and triangles alone: flat shading, nothing to texture it by.
    pub fn plain(name: &str, positions: Vec<[f32; 3]>, indices: Vec<[u32; 3]>, material: MaterialId) -> Self {
        Self {
            positions,
            normals: None,
            uv_sets: Vec::new(),
            colors: None,
            tangents: None,
            indices,
            material,
            name: name.to_owned(),
        }
    }
}
