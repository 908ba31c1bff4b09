//! One primitive: its attributes, deformed by morph targets and skin, as a [`Mesh`]. Those that do not depend on the pose
//! are read once for all moments of an animation.

use super::accessor::{self, Elements};
use super::base::{Base, Deformed, TangentNote};
use super::kept::KeptBase;
use super::material::Along;
use super::semantic::{INDICES, NORMAL, POSITION, TANGENT, Wanted};
use super::skin::{Influences, Palette};
use super::topology::{Topology, topology};
use super::{Loader, Result, extensions, material, variants};
use crate::scene::{MaterialId, MeshId};
use crate::shape::Mesh;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use rayon::prelude::*;
use std::sync::Arc;

/// A primitive and where it was found.
#[derive(Clone, Copy)]
pub(super) struct Found<'p> {
    pub primitive: &'p Primitive,
    pub at: &'p str,
    /// The mesh's.
    pub name: &'p str,
    /// Mesh and primitive, by index.
    pub key: (usize, usize),
}

/// A primitive in the scene, in a pose.
#[derive(Clone, Debug)]
pub(super) struct Read {
    pub id: MeshId,
    /// What it is a pose of, and for each of its vertices that of the base, where they are not the same: for other times.
    pub base: Option<Arc<Base>>,
    pub origin: Option<Arc<[u32]>>,
}

/// Adds a primitive in a pose; `weights` are those of its morph targets (empty = all 0). `None` if there is nothing to draw.
pub(super) fn read(
    loader: &mut Loader,
    found: Found,
    weights: &[f32],
    palette: Option<&Palette>,
) -> Result<Option<Read>> {
    let Found { at, name, key, .. } = found;
    let Some((base, material)) = base(loader, found)? else { return Ok(None) };
    if base.is_zero && weights.is_empty() {
        loader.builder.warn(format!("{name}: the POSITION of {at} are all zero: nothing to draw"));
        return Ok(None);
    }
    let is_moved = !weights.is_empty() || palette.is_some();
    let base = match loader.kept.is_kept {
        true => {
            loader.kept.bases.insert(key, KeptBase::Base(Arc::clone(&base)));
            base
        }
        // Nobody else will ask for it: its vertices need not be there twice.
        false if !is_moved => match Arc::try_unwrap(base).map(Base::into_plain) {
            Ok((mut mesh, too_many)) => {
                say_too_many(loader, too_many, found);
                mesh.material = material;
                return Ok(Some(Read { id: loader.builder.add_mesh(mesh), base: None, origin: None }));
            }
            Err(base) => base,
        },
        false => base,
    };
    prepare(loader, found, &base, weights, palette)?;
    let (id, origin) = if is_moved {
        let Deformed { mut mesh, origin, too_many } = base.deformed(weights, palette);
        say_too_many(loader, too_many, found);
        mesh.material = material;
        (loader.builder.add_mesh(mesh), origin.map(Into::into))
    } else {
        let (mesh, findings, too_many) = base.plain();
        say_too_many(loader, too_many, found);
        let mesh = match mesh.material == material {
            true => mesh,
            false => Arc::new(Mesh { material, ..(*mesh).clone() }),
        };
        (loader.builder.add_checked_mesh(mesh, findings), base.plain_origin())
    };
    let base = loader.kept.is_kept.then_some(base);
    Ok(Some(Read { id, base, origin }))
}

/// Reads what a pose by these weights and joints needs, if it was not read before.
pub(super) fn prepare(
    loader: &Loader,
    Found { primitive, at, .. }: Found,
    base: &Base,
    weights: &[f32],
    palette: Option<&Palette>,
) -> Result<()> {
    let attributes = Attributes { loader, primitive, at };
    base.targets.read(&attributes, weights, base.mesh())?;
    let Some(palette) = palette else { return Ok(()) };
    let influences = match base.influences.get() {
        Some(known) => known,
        None => {
            let read = Influences::read(&attributes, base.count, base.origin.as_deref())?;
            base.influences.get_or_init(|| read)
        }
    };
    influences.check(palette, &attributes)
}

/// The primitive unmoved, and its material; `None`, noted, if there is nothing to draw.
fn base(loader: &mut Loader, found: Found) -> Result<Option<(Arc<Base>, MaterialId)>> {
    let Found { primitive, at, key, .. } = found;
    let known = loader.kept.bases.get(&key).cloned();
    if let Some(KeptBase::Nothing(notes)) = &known {
        loader.builder.note_again(notes);
        return Ok(None);
    }
    let before = loader.builder.note_counts();
    if let Some(KeptBase::Base(base)) = known {
        let (material, material_at) = variants::material(loader, primitive, at)?;
        let surface = material::read(loader, material, &material_at)?;
        // An animated factor may have made a texture appear, and with it its coordinates.
        if base.serves(&surface) {
            loader.builder.note_again(&base.notes);
            return Ok(Some((base, surface.id)));
        }
    }
    let Some((indices, positions)) = read_triangles(loader, found)? else {
        let notes = loader.builder.notes_since(before);
        loader.kept.bases.insert(key, KeptBase::Nothing(Arc::new(notes)));
        return Ok(None);
    };
    let mut notes = loader.builder.notes_since(before);
    let (material, material_at) = variants::material(loader, primitive, at)?;
    // What is said of materials is said for every moment: they are read for each.
    let surface = material::read(loader, material, &material_at)?;
    let before = loader.builder.note_counts();
    let mut base = read_vertices(loader, found, &surface, indices, positions)?;
    notes.append(loader.builder.notes_since(before));
    base.notes = notes;
    Ok(Some((Arc::new(base), surface.id)))
}

fn say_too_many(loader: &mut Loader, too_many: Option<usize>, Found { at, name, .. }: Found) {
    if let Some(n) = too_many {
        let text =
            format!("{name}: {at}: {n} triangles meet in one vertex, too many for MikkTSpace: any tangents used");
        loader.builder.warn(text);
    }
}

/// The triangles and where their corners are, not yet read; `None`, noted, if there is nothing to draw.
fn read_triangles<'d>(loader: &mut Loader<'d>, found: Found) -> Result<Option<(Vec<[u32; 3]>, Elements<'d>)>> {
    let Found { primitive, at, name, .. } = found;
    let doc = loader.doc;
    if let Some(carried) = &primitive.extensions {
        extensions::note_carried(doc, carried.others.keys(), at, &["KHR_draco_mesh_compression"]);
    }
    let Some(positions) = Attributes { loader, primitive, at }.open(&Semantic::Positions, &POSITION, None)? else {
        loader.builder.lose(format!("{name}: {at} has no POSITION: nothing to draw"));
        return Ok(None);
    };
    Ok(triangles(loader, primitive, at, name, positions.count)?.map(|indices| (indices, positions)))
}

/// The vertices as the file has them, those attributes that the material asks for.
fn read_vertices(
    loader: &mut Loader,
    found: Found,
    surface: &material::Read,
    indices: Vec<[u32; 3]>,
    positions: Elements,
) -> Result<Base> {
    let Found { primitive, at, name, .. } = found;
    let (n, is_zero) = (positions.count, positions.is_zero());
    let attributes = Attributes { loader, primitive, at };
    let normals = attributes.open(&Semantic::Normals, &NORMAL, Some(n))?;
    // Without normals, tangents are to be ignored (section 3.7.2.1).
    let tangents = match surface.tangents.is_some() && normals.is_some() {
        false => None,
        true => attributes.open(&Semantic::Tangents, &TANGENT, Some(n))?,
    };
    let colors = attributes.open(&Semantic::Colors(0), &Wanted::color(), Some(n))?;
    let mut missing = Vec::new();
    let mut uv_sets = Vec::new();
    for &set in &surface.tex_coords {
        let found = attributes.open(&Semantic::TexCoords(set), &Wanted::tex_coord(set), Some(n))?;
        if found.is_none() {
            missing.push(set);
        }
        uv_sets.push(found);
    }
    // What no texture reads need not be there.
    let mut along = surface.tangents;
    if let Some(Along { set, is_optional: true, .. }) = along
        && uv_sets.get(set).is_some_and(Option::is_none)
    {
        missing.retain(|&name| Some(&name) != surface.tex_coords.get(set));
        along = along.filter(|_| tangents.is_some());
    }
    // Independent of each other, and most of the time that a large file takes.
    let ((positions, normals), (uv_sets, (tangents, colors))) = rayon::join(
        || (positions.floats(), normals.map(|e| e.floats()).transpose()),
        || {
            let read = |e: Option<Elements>| e.map_or_else(|| Ok(vec![[0.0; 2]; n]), |e| e.floats());
            let uv_sets = uv_sets.into_iter().map(read).collect::<Result<Vec<_>>>();
            let tangents = tangents.map(|e| e.floats()).transpose();
            (uv_sets, (tangents, colors.map(|e| e.colors()).transpose()))
        },
    );
    let mesh = Mesh {
        positions: positions?,
        normals: normals?,
        uv_sets: uv_sets?,
        colors: colors?,
        tangents: tangents?,
        indices,
        material: surface.id,
        name: name.to_owned(),
    };
    for set in missing {
        let text = format!("{name}: {at} has no TEXCOORD_{set}, which {} reads: taken as 0", surface.pointer);
        loader.builder.lose(text);
    }
    if primitive.attributes.contains_key(&Checked::Valid(Semantic::Colors(1))) {
        loader.lose_once("vertex colours other than COLOR_0 are ignored");
    }
    let targets = primitive.targets.as_ref().map_or(0, Vec::len);
    let (base, note) = Base::new(mesh, is_zero, targets, surface, along);
    match note {
        Some(TangentNote::Repaired(n)) => {
            let text = format!("{name}: {at}: {n} tangents have no direction across the normal: replaced");
            loader.builder.warn(text);
        }
        Some(TangentNote::TooMany(n)) => say_too_many(loader, Some(n), found),
        None => {}
    }
    Ok(base)
}

/// The triangles of a primitive of `n` vertices; `None`, noted, if it has none.
fn triangles(
    loader: &mut Loader,
    primitive: &Primitive,
    at: &str,
    name: &str,
    n: usize,
) -> Result<Option<Vec<[u32; 3]>>> {
    let doc = loader.doc;
    let Checked::Valid(mode) = primitive.mode else {
        let fix = "Allowed: 0 to 6 (points, lines, line loop, line strip, triangles, triangle strip, triangle fan).";
        return Err(doc.bad(&format!("{at}/mode"), "is not a mode", fix));
    };
    let Ok(count) = u32::try_from(n) else {
        return Err(doc.error(at, format!("{n} vertices"), "At most 2^32 - 1 are read in one primitive."));
    };
    let made = match primitive.indices {
        None if mode == Mode::Triangles => {
            Topology::Triangles((0..count / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(), n % 3)
        }
        None => topology(mode, (0..count).collect()),
        Some(index) => {
            let elements = accessor::open(doc, index, &format!("{at}/indices"), &INDICES)?;
            let flat = elements.indices()?;
            check_indices(loader, &flat, n, elements.restart(), index.value(), at)?;
            topology(mode, flat)
        }
    };
    match made {
        Topology::Triangles(triangles, rest) => {
            if triangles.is_empty() {
                loader.builder.lose(format!("{name}: {at} has {n} vertices and no triangle: left out"));
                return Ok(None);
            }
            if rest > 0 {
                let text = format!("{name}: the corners of {at} are not a multiple of 3: the last {rest} ignored");
                loader.builder.lose(text);
            }
            Ok(Some(triangles))
        }
        Topology::Without(count, what) => {
            let why = format!("{count} {what}: they have no surface to draw");
            loader.builder.skip(at.trim_start_matches('/'), why);
            loader.lose_once("the scene has points or lines, which are not drawn (listed under skipped)");
            Ok(None)
        }
    }
}

/// Every index must be one of the `n` vertices, and none the value `restart`.
fn check_indices(loader: &Loader, indices: &[u32], n: usize, restart: u32, accessor: usize, at: &str) -> Result<()> {
    let greatest = indices.par_chunks(1 << 16).map(|c| c.iter().copied().max().unwrap_or(0)).max().unwrap_or(0);
    if (greatest as usize) < n && greatest < restart || indices.is_empty() {
        return Ok(());
    }
    let wrong = |i: &u32| *i as usize >= n || *i == restart;
    let k = indices.iter().position(wrong).unwrap_or(0);
    let value = indices.get(k).copied().unwrap_or(0);
    let found = format!("element {k} of accessor {accessor} is {value}");
    let (why, fix) = if value == restart {
        let why = "the primitive restart value of its type";
        (why, "The specification forbids it: make separate primitives, or use a wider type of indices.".to_owned())
    } else {
        let fix = format!("POSITION has {n} elements: 0 to {} are allowed.", n.saturating_sub(1));
        ("there is no such vertex", fix)
    };
    Err(loader.doc.error(format!("{at}/indices"), format!("{found}: {why}"), fix))
}

/// The attributes of one primitive.
pub(super) struct Attributes<'l, 'd> {
    pub loader: &'l Loader<'d>,
    pub primitive: &'l Primitive,
    pub at: &'l str,
}

impl<'d> Attributes<'_, 'd> {
    /// The elements of an attribute, `count` of them where that is given; `None` if the primitive does not have it.
    pub fn open(&self, semantic: &Semantic, wanted: &Wanted, count: Option<usize>) -> Result<Option<Elements<'d>>> {
        let Some(&index) = self.primitive.attributes.get(&Checked::Valid(semantic.clone())) else {
            return Ok(None);
        };
        let pointer = format!("{}/attributes/{}", self.at, wanted.name);
        self.elements(index, &pointer, wanted, count).map(Some)
    }

    /// The elements of the accessor at `index`, found at `pointer`; as many as there are vertices.
    pub fn elements(
        &self,
        index: gltf::json::Index<gltf::json::Accessor>,
        pointer: &str,
        wanted: &Wanted,
        count: Option<usize>,
    ) -> Result<Elements<'d>> {
        let elements = accessor::open(self.loader.doc, index, pointer, wanted)?;
        match count {
            Some(n) if n != elements.count => {
                let fix = "All attributes of a primitive have one element per vertex.";
                Err(self.loader.doc.error(pointer, format!("{} elements but POSITION has {n}", elements.count), fix))
            }
            _ => Ok(elements),
        }
    }
}
