//! Meshes in a pose (morph weights, skin), each read once: one [`Mesh`](crate::shape::Mesh) per primitive of triangles.

use super::primitive::{self, Found};
use super::skin::{self, Palette};
use super::trace::Form;
use super::{Document, Loader, Result, extensions, name_or};
use crate::scene::MeshId;
use glam::DMat4;
use gltf::json::Index;
use gltf::json::mesh::Mesh as Json;
use gltf::json::scene::Node;
use std::rc::Rc;

/// Which mesh, and how it is deformed where a node places it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    pub mesh: usize,
    skin: Option<usize>,
    /// Bits of the weights of morph targets; empty if all are 0.
    weights: Vec<u32>,
    /// Whose weights change while the shutter is open: nothing else can be known to change alike.
    alone: Option<usize>,
}

/// The primitives of a mesh that can be drawn.
#[derive(Clone, Debug)]
pub(super) struct Posed {
    pub ids: Rc<[MeshId]>,
    /// Where a skinned mesh is: its joints place it, whichever node shows it.
    pub world: Option<DMat4>,
}

/// The mesh at `index` as node `node_index` shows it; `pointer` is where the index was found.
pub(super) fn read(
    loader: &mut Loader,
    index: Index<Json>,
    pointer: &str,
    node: &Node,
    node_index: usize,
) -> Result<Posed> {
    let node_at = &format!("/nodes/{node_index}");
    let doc = loader.doc;
    let mesh = doc.item(&doc.root.meshes, index, pointer, "meshes")?;
    let weights = weights(doc, mesh, index.value(), node, node_at)?;
    let moved = weights.iter().any(|&w| w != 0.0);
    let bits = if moved { weights.iter().map(|w| w.to_bits()).collect() } else { Vec::new() };
    let is_alone = loader.morphing.contains(&node_index);
    let skin = node.skin.map(|s| s.value());
    let key = Key { mesh: index.value(), skin, weights: bits, alone: is_alone.then_some(node_index) };
    if let Some(done) = loader.meshes.get(&key) {
        return Ok(done.clone());
    }
    let palette = match node.skin {
        None => None,
        Some(skin) => Some(skin::palette(loader, skin, &format!("{node_at}/skin"))?),
    };
    let name = name_or(mesh.name.as_ref(), "meshes", index.value());
    let at = format!("/meshes/{}", index.value());
    if let Some(carried) = &mesh.extensions {
        extensions::note_carried(doc, carried.others.keys(), &at, &[]);
    }
    let mut ids = Vec::new();
    for (i, found) in mesh.primitives.iter().enumerate() {
        let at = format!("{at}/primitives/{i}");
        let weights = if moved || is_alone { &weights[..] } else { &[] };
        let found = Found { primitive: found, at: &at, name: &name, key: (index.value(), i) };
        if let Some(read) = primitive::read(loader, found, weights, palette.as_deref())? {
            if let Some(base) = read.base {
                loader.trace.forms.push(Form {
                    id: read.id,
                    base,
                    origin: read.origin,
                    key: found.key,
                    node: node_index,
                    skin,
                });
            }
            ids.push(read.id);
        }
    }
    let posed = Posed { ids: ids.into(), world: palette.as_deref().map(Palette::world) };
    loader.meshes.insert(key, posed.clone());
    Ok(posed)
}

/// The weights of the morph targets: the node's, else the mesh's, else none.
pub(super) fn weights(doc: &Document, mesh: &Json, index: usize, node: &Node, node_at: &str) -> Result<Vec<f32>> {
    let (weights, at) = match (&node.weights, &mesh.weights) {
        (Some(weights), _) => (weights, format!("{node_at}/weights")),
        (None, Some(weights)) => (weights, format!("/meshes/{index}/weights")),
        (None, None) => return Ok(Vec::new()),
    };
    if !weights.iter().all(|w| w.is_finite()) {
        return Err(doc.bad(&at, "is not finite as 32-bit floats", "Use smaller numbers."));
    }
    for primitive in &mesh.primitives {
        let targets = primitive.targets.as_ref().map_or(0, Vec::len);
        // Weights without any target do nothing, and files have them.
        if targets != weights.len() && targets != 0 {
            let problem = format!("{} weights for {targets} morph targets", weights.len());
            return Err(doc.error(at, problem, "There must be one weight per target."));
        }
    }
    Ok(weights.clone())
}
