//! A part of the file as a triangle mesh.

use super::geometry::{Geometry, Part};
use super::polygon;
use super::statement::NONE;
use super::vertices::Chains;
use crate::color::linear_from_srgb;
use crate::scene::MaterialId;
use crate::shape::Mesh;
use glam::DVec3;

/// A mesh and what was lost on the way.
pub(super) struct Built {
    pub mesh: Mesh,
    /// Polygons that cross themselves.
    pub crossed: usize,
    /// Some of its vertices have a colour, others have none.
    pub half_coloured: bool,
    /// Vertices without texture coordinates, where they are asked for.
    pub without_uvs: usize,
}

/// Builds the mesh of `part`; texture coordinates only if the material reads a texture (`wants_uvs`).
pub(super) fn build(geometry: &Geometry, part: &Part, material: MaterialId, wants_uvs: bool) -> Built {
    let faces = || part.runs.iter().flat_map(|run| run.faces.clone().map(|f| (&geometry.pieces[run.piece], f)));
    let corners = || faces().flat_map(|(piece, f)| &piece.corners[piece.range(f)]);
    let (mut least, mut most, mut count, mut has_normals) = (u32::MAX, 0, 0, false);
    for corner in corners() {
        (least, most, count) = (least.min(corner[0]), most.max(corner[0]), count + 1);
        has_normals |= corner[2] != NONE;
    }
    let mut vertices = Chains::for_corners(least, most, count);
    let mut sources = Vec::with_capacity(((most - least) as usize + 1).min(count));
    let mut indices = Vec::with_capacity(count / 3);
    let (mut ids, mut points, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    let mut crossed = 0;
    for (piece, face) in faces() {
        ids.clear();
        ids.extend(piece.corners[piece.range(face)].iter().map(|corner| {
            let uv = if wants_uvs { corner[1] } else { NONE };
            let (id, is_new) = vertices.id(corner[0], [uv, corner[2]]);
            if is_new {
                sources.push([corner[0], uv, corner[2]]);
            }
            id
        }));
        if let &[a, b, c] = ids.as_slice() {
            indices.push([a, b, c]);
            continue;
        }
        points.clear();
        let position = |id: &u32| geometry.positions[sources[*id as usize][0] as usize];
        points.extend(ids.iter().map(|id| DVec3::from_array(position(id).map(f64::from))));
        triangles.clear();
        crossed += usize::from(!polygon::triangulate(&points, &mut triangles));
        indices.extend(triangles.iter().map(|t| t.map(|i| ids[i as usize])));
    }
    let positions = sources.iter().map(|s| geometry.positions[s[0] as usize]).collect();
    let normals = has_normals.then(|| sources.iter().map(|s| geometry.normals[s[2] as usize]).collect());
    let without_uvs = if wants_uvs { sources.iter().filter(|s| s[1] == NONE).count() } else { 0 };
    // v = 0 is at the top from here on.
    let uv = |s: &[u32; 3]| geometry.uvs.get(s[1] as usize).map_or([0.0; 2], |&[u, v]| [u, 1.0 - v]);
    let has_uvs = wants_uvs && without_uvs < sources.len();
    let uv_sets = if has_uvs { vec![sources.iter().map(uv).collect()] } else { Vec::new() };
    let (colors, half_coloured) = colors(geometry, &sources);
    let name = part.name.clone();
    let mesh = Mesh { positions, normals, uv_sets, colors, tangents: None, indices, material, name };
    Built { mesh, crossed, half_coloured, without_uvs }
}

/// Linear vertex colours if every vertex has one; whether only some have.
fn colors(geometry: &Geometry, sources: &[[u32; 3]]) -> (Option<Vec<[f32; 4]>>, bool) {
    if geometry.colors.is_empty() {
        return (None, false);
    }
    let of = |s: &[u32; 3]| geometry.colors[s[0] as usize];
    let coloured = sources.iter().filter(|s| !of(s)[0].is_nan()).count();
    if coloured < sources.len() {
        return (None, coloured > 0);
    }
    let linear = |c: f32| linear_from_srgb(if c.is_nan() { 0.0 } else { f64::from(c.clamp(0.0, 1.0)) }) as f32;
    let colors = sources.iter().map(of).map(|[r, g, b]| [linear(r), linear(g), linear(b), 1.0]);
    (Some(colors.collect()), false)
}
