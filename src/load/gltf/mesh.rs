//! Meshes: one [`Mesh`] per primitive of triangles.

use super::accessor::{self, Elements, INDICES, NORMAL, POSITION, TANGENT, TEXCOORD, Wanted};
use super::{Loader, Result, extensions, material, name_or};
use crate::scene::MeshId;
use crate::shape::Mesh;
use gltf::json::Index;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

/// The primitives of a mesh, read once; `pointer` is where the index was found.
pub(super) fn read(loader: &mut Loader, index: Index<gltf::json::Mesh>, pointer: &str) -> Result<Vec<MeshId>> {
    if let Some(done) = loader.meshes.get(&index.value()) {
        return Ok(done.clone());
    }
    let doc = loader.doc;
    let mesh = doc.item(&doc.root.meshes, index, pointer, "meshes")?;
    let name = name_or(mesh.name.as_ref(), "meshes", index.value());
    let mut ids = Vec::new();
    for (i, primitive) in mesh.primitives.iter().enumerate() {
        let at = format!("/meshes/{}/primitives/{i}", index.value());
        if let Some(mesh) = read_primitive(loader, primitive, &at, &name)? {
            ids.push(loader.builder.add_mesh(mesh));
        }
    }
    loader.meshes.insert(index.value(), ids.clone());
    Ok(ids)
}

/// One primitive; `None` if it has no triangles.
fn read_primitive(loader: &mut Loader, primitive: &Primitive, at: &str, name: &str) -> Result<Option<Mesh>> {
    let doc = loader.doc;
    check_supported(loader, primitive, at)?;
    let attributes = Attributes { loader, primitive, at };
    let Some(positions) = attributes.open(&Semantic::Positions, &POSITION, None)? else {
        loader.builder.warn(format!("{name}: {at} has no POSITION: nothing to draw"));
        return Ok(None);
    };
    let n = positions.count;
    if u32::try_from(n).is_err() {
        return Err(doc.error(at, format!("{n} vertices"), "At most 2^32 - 1 are read in one primitive."));
    }
    let indices = match primitive.indices {
        None => None,
        Some(index) => Some(accessor::open(doc, index, &format!("{at}/indices"), &INDICES)?),
    };
    let corners = indices.as_ref().map_or(n, |i| i.count);
    if corners < 3 || n == 0 {
        loader.builder.warn(format!("{name}: {at} has {corners} corners of {n} vertices, no triangle: left out"));
        return Ok(None);
    }

    let surface = material::read(loader, primitive.material, &format!("{at}/material"))?;
    let attributes = Attributes { loader, primitive, at };
    let normals = attributes.open(&Semantic::Normals, &NORMAL, Some(n))?;
    let uvs = match surface.tex_coords.is_empty() {
        true => None,
        false => attributes.open(&Semantic::TexCoords(0), &TEXCOORD, Some(n))?,
    };
    let tangents = match surface.normal_mapped {
        false => None,
        true => attributes.open(&Semantic::Tangents, &TANGENT, Some(n))?,
    };
    if !surface.tex_coords.is_empty() && uvs.is_none() {
        let fix = format!("Its material ({}) has textures, which need TEXCOORD_0.", surface.pointer);
        return Err(doc.error(format!("{at}/attributes"), "no TEXCOORD_0", fix));
    }
    if surface.normal_mapped && (tangents.is_none() || normals.is_none()) {
        let missing = if tangents.is_none() { "TANGENT" } else { "NORMAL" };
        let fix = format!(
            "Its material ({}) has a normal map; tangents in the manner of MikkTSpace are not built yet. \
             Export with normals and tangents.",
            surface.pointer
        );
        return Err(doc.error(format!("{at}/attributes"), format!("no {missing}"), fix));
    }

    let flat = match (&indices, primitive.indices) {
        (Some(elements), Some(index)) => {
            let flat = elements.indices();
            check_range(loader, &flat, n, index.value(), at)?;
            flat
        }
        _ => (0..n as u32).collect(),
    };
    let (triangles, rest) = flat.as_chunks::<3>();
    if !rest.is_empty() {
        let text = format!("{name}: {at} has {corners} corners, not a multiple of 3: the last {} ignored", rest.len());
        loader.builder.warn(text);
    }
    Ok(Some(Mesh {
        positions: positions.floats(),
        normals: normals.map(|e| e.floats()),
        uv_sets: uvs.map(|e| e.uvs()).into_iter().collect(),
        colors: None,
        tangents: tangents.map(|e| e.floats()),
        indices: triangles.to_vec(),
        material: surface.id,
        name: name.to_owned(),
    }))
}

/// Refuses what would change the picture and is not read.
fn check_supported(loader: &Loader, primitive: &Primitive, at: &str) -> Result<()> {
    let doc = loader.doc;
    let mode_at = format!("{at}/mode");
    match primitive.mode {
        Checked::Valid(Mode::Triangles) => {}
        Checked::Valid(_) => {
            let fix = "Only 4 (TRIANGLES) is read: points, lines, strips and fans are not built yet.";
            return Err(doc.bad(&mode_at, "is not a mode that is read", fix));
        }
        Checked::Invalid => return Err(doc.bad(&mode_at, "is not a mode", "Only 4 (TRIANGLES) is read.")),
    }
    if primitive.targets.as_ref().is_some_and(|t| !t.is_empty()) {
        let fix = "Apply the shape keys before exporting.";
        return Err(doc.not_built(format!("{at}/targets"), "morph targets are", fix));
    }
    if primitive.attributes.contains_key(&Checked::Valid(Semantic::Colors(0))) {
        let fix = "They multiply the base colour, so leaving them out would be wrong. Export without them.";
        return Err(doc.not_built(format!("{at}/attributes/COLOR_0"), "vertex colours are", fix));
    }
    if let Some(carried) = &primitive.extensions {
        extensions::note_carried(doc, carried.others.keys(), at, &["KHR_draco_mesh_compression"]);
    }
    Ok(())
}

/// Every index must be one of the `n` vertices.
fn check_range(loader: &Loader, indices: &[u32], n: usize, accessor: usize, at: &str) -> Result<()> {
    match indices.iter().position(|&i| i as usize >= n) {
        None => Ok(()),
        Some(k) => {
            let value = indices.get(k).copied().unwrap_or(0);
            let problem = format!("element {k} of accessor {accessor} is {value}: there is no such vertex");
            let fix = format!("POSITION has {n} elements: 0 to {} are allowed.", n.saturating_sub(1));
            Err(loader.doc.error(format!("{at}/indices"), problem, fix))
        }
    }
}

/// The attributes of one primitive.
struct Attributes<'l, 'd> {
    loader: &'l Loader<'d>,
    primitive: &'l Primitive,
    at: &'l str,
}

impl<'d> Attributes<'_, 'd> {
    /// The elements of an attribute, `count` of them where that is given; `None` if the primitive does not have it.
    fn open(&self, semantic: &Semantic, wanted: &Wanted, count: Option<usize>) -> Result<Option<Elements<'d>>> {
        let Some(&index) = self.primitive.attributes.get(&Checked::Valid(semantic.clone())) else {
            return Ok(None);
        };
        let pointer = format!("{}/attributes/{}", self.at, wanted.name);
        let elements = accessor::open(self.loader.doc, index, &pointer, wanted)?;
        match count {
            Some(n) if n != elements.count => {
                let fix = "All attributes of a primitive have one element per vertex.";
                Err(self.loader.doc.error(pointer, format!("{} elements but POSITION has {n}", elements.count), fix))
            }
            _ => Ok(Some(elements)),
        }
    }
}
