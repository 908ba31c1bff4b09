//! Shapes: for now triangle meshes.

pub mod table;

use crate::id::MaterialId;

/// Triangles of one material, object space (one glTF primitive).
#[derive(Clone, Debug)]
pub struct Mesh {
    /// `[n][3]` metres, object space, finite.
    pub positions: Vec<[f32; 3]>,
    /// `[n][3]` shading normals, object space, any length; `None` = flat shading.
    pub normals: Option<Vec<[f32; 3]>>,
    /// `[n][2]` texture coordinates of set 0, v = 0 at the top.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// `[n][4]` tangents, w = handedness (+1 or -1); only where the material has a normal map.
    pub tangents: Option<Vec<[f32; 4]>>,
    /// `[m][3]` vertex indices, counter-clockwise seen from the front; all `< n`.
    pub indices: Vec<[u32; 3]>,
    /// What the surface is made of.
    pub material: MaterialId,
    /// For messages: the mesh's name or JSON pointer.
    pub name: String,
}
