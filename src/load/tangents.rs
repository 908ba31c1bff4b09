//! Tangents for meshes whose material has a normal map and that come without them, after Mikkelsen 2008, "Simulation of
//! Wrinkled Surfaces Revisited" (MikkTSpace, which the glTF specification, section 3.7.2.1, asks for), by the crate
//! `bevy_mikktspace`; and repair of tangents that cannot serve. For every loader.

use crate::shape::Mesh;
use crate::texture::UvTransform;
use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::Vec3;
use std::collections::HashMap;

/// A tangent closer to its normal than this sine (a hundredth of a degree) says nothing about the direction across it.
const MIN_SINE: f32 = 1.7e-4;
/// Coordinates and texture coordinates beyond this overflow the squares inside MikkTSpace.
const LARGEST: f32 = 1e18;
/// MikkTSpace visits the triangles around a vertex recursively. A frame takes a few hundred bytes even where nothing is
/// optimised.
const STACK_PER_TRIANGLE: usize = 1 << 10;
/// Enough for everything else in that thread.
const STACK: usize = 1 << 20;
/// Triangles around one vertex that are still tried: MikkTSpace compares each with each.
const MAX_AROUND_VERTEX: usize = 1 << 13;

/// So many triangles meet in one vertex that MikkTSpace was not tried; the tangents are any across the normals.
#[derive(Debug)]
pub(super) struct TooManyTriangles(pub usize);

/// Gives `mesh` tangents along u of its set `uv_set`, with `transform` (that of the normal map) applied. Meshes without
/// normals get flat ones first. Vertices are split where corners differ, and only there; unused vertices go.
/// Each tangent is of length 1 and across its normal, also where the coordinates say nothing: any direction then.
pub(super) fn generate(mesh: &mut Mesh, uv_set: usize, transform: Option<UvTransform>) -> Result<(), TooManyTriangles> {
    generate_splitting(mesh, uv_set, transform).1
}

/// As [`generate`]; also of each new vertex the one that it was.
pub(super) fn generate_splitting(
    mesh: &mut Mesh,
    uv_set: usize,
    transform: Option<UvTransform>,
) -> (Vec<u32>, Result<(), TooManyTriangles>) {
    let uvs = mesh.uv_sets.get(uv_set).map(|uvs| transformed(uvs, transform));
    let corner_normals: Vec<Vec3> = corner_normals(mesh);
    let mut result = Ok(());
    let mut tangents = vec![None; corner_normals.len()];
    if let Some(uvs) = &uvs {
        let mut corners = Corners { mesh, uvs, normals: &corner_normals, faces: Vec::new(), tangents: &mut tangents };
        corners.faces = (0..mesh.indices.len()).filter(|&f| corners.is_usable(f)).collect();
        result = corners.run();
    }
    let found = corner_normals.iter().zip(tangents).map(|(&n, t)| across(n, t.unwrap_or_default()).0).collect();
    (split(mesh, &corner_normals, found), result)
}

/// Replaces tangents that are not finite, zero, or along the normal by any across it, and makes handedness +1 or -1.
/// How many had to be replaced.
pub(super) fn repair(mesh: &mut Mesh) -> usize {
    let (Some(tangents), Some(normals)) = (&mut mesh.tangents, &mesh.normals) else { return 0 };
    let mut replaced = 0;
    for (tangent, &normal) in tangents.iter_mut().zip(normals) {
        let (usable, kept) = across(Vec3::from(normal), *tangent);
        // As supplied where it serves: exporters' values are not rounded again.
        let w = if tangent[3] < 0.0 { -1.0 } else { 1.0 };
        *tangent = if kept { [tangent[0], tangent[1], tangent[2], w] } else { usable };
        replaced += usize::from(!kept);
    }
    replaced
}

/// The part of `tangent` across `normal`, of length 1, and `true`; if there is none, any direction across it, and
/// `false`.
fn across(normal: Vec3, tangent: [f32; 4]) -> ([f32; 4], bool) {
    let n = normal.try_normalize().filter(|n| n.is_finite()).unwrap_or(Vec3::Z);
    let w = if tangent[3] < 0.0 { -1.0 } else { 1.0 };
    let t = Vec3::new(tangent[0], tangent[1], tangent[2]).try_normalize();
    let part = t.filter(|t| t.is_finite()).map(|t| t - n * n.dot(t)).filter(|t| t.length() > MIN_SINE);
    match part {
        Some(t) => (t.normalize().extend(w).to_array(), true),
        None => (n.any_orthonormal_vector().extend(1.0).to_array(), false),
    }
}

/// Coordinates as the normal map is read.
fn transformed(uvs: &[[f32; 2]], transform: Option<UvTransform>) -> Vec<[f32; 2]> {
    let Some(UvTransform { m }) = transform else { return uvs.to_vec() };
    uvs.iter().map(|&[u, v]| m.map(|row| row[0] * u + row[1] * v + row[2])).collect()
}

/// The unit normal of each corner, `[3 m]`: the vertex's, or, where it has none or none that serves, the triangle's.
fn corner_normals(mesh: &Mesh) -> Vec<Vec3> {
    let mut out = Vec::with_capacity(3 * mesh.indices.len());
    for triangle in &mesh.indices {
        // In f64: the f32 product of edges below 3e-10 underflows.
        let [a, b, c] = triangle.map(|v| Vec3::from(mesh.positions[v as usize]).as_dvec3());
        let flat = (b - a).cross(c - a).normalize_or(glam::DVec3::Z).as_vec3();
        out.extend(triangle.map(|v| match &mesh.normals {
            None => flat,
            Some(normals) => Vec3::from(normals[v as usize]).try_normalize().filter(|n| n.is_finite()).unwrap_or(flat),
        }));
    }
    out
}

/// The triangles as MikkTSpace sees them: corners that share nothing.
struct Corners<'a> {
    mesh: &'a Mesh,
    /// `[n]`
    uvs: &'a [[f32; 2]],
    /// `[3 m]`
    normals: &'a [Vec3],
    /// The triangles that are shown.
    faces: Vec<usize>,
    /// `[3 m]`
    tangents: &'a mut [Option<[f32; 4]>],
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.indices[self.faces[face]][corner] as usize
    }

    /// Whether all numbers of triangle `f` can be reckoned with.
    fn is_usable(&self, f: usize) -> bool {
        self.mesh.indices[f].iter().all(|&v| {
            let v = v as usize;
            self.mesh.positions[v].iter().chain(&self.uvs[v]).all(|c| c.abs() < LARGEST)
        })
    }

    /// The greatest number of triangles around one vertex, as MikkTSpace welds them.
    fn most_around_vertex(&self) -> usize {
        let mut around: HashMap<[u32; 8], usize> = HashMap::with_capacity(self.mesh.positions.len());
        for &f in &self.faces {
            for (k, &v) in self.mesh.indices[f].iter().enumerate() {
                let ([x, y, z], [u, w]) = (self.mesh.positions[v as usize], self.uvs[v as usize]);
                let n = self.normals[3 * f + k];
                // + 0.0 turns -0 into 0, which equals it.
                *around.entry([x, y, z, u, w, n.x, n.y, n.z].map(|c| (c + 0.0).to_bits())).or_default() += 1;
            }
        }
        around.values().copied().max().unwrap_or(0)
    }

    fn run(&mut self) -> Result<(), TooManyTriangles> {
        if self.faces.is_empty() {
            return Ok(());
        }
        let around = self.most_around_vertex();
        if around > MAX_AROUND_VERTEX {
            return Err(TooManyTriangles(around));
        }
        // A thread of its own for its stack.
        let stack = STACK + around * STACK_PER_TRIANGLE;
        std::thread::scope(|scope| {
            let work = || generate_tangents(self);
            let Ok(thread) = std::thread::Builder::new().stack_size(stack).spawn_scoped(scope, work) else {
                return Err(TooManyTriangles(around));
            };
            match thread.join() {
                Ok(Ok(())) => Ok(()),
                Ok(Err(never)) => unreachable!("the crate has no error: {never:?}"),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        })
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, vert)]
    }

    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        self.normals[3 * self.faces[face] + vert].to_array()
    }

    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        self.uvs[self.vertex(face, vert)]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, vert: usize) {
        // MikkTSpace's bitangent points along +v, ours along -v: v = 0 is at the top, and the normal map's y points up.
        let tangent = space.map(|s| s.tangent_encoded()).map(|[x, y, z, w]| [x, y, z, -w]);
        self.tangents[3 * self.faces[face] + vert] = tangent;
    }
}

/// Gives each corner its normal and tangent; corners of one vertex that agree share a vertex again. Of each new vertex the
/// one that it was.
fn split(mesh: &mut Mesh, normals: &[Vec3], tangents: Vec<[f32; 4]>) -> Vec<u32> {
    // Of each old vertex the newest of its new ones, and of each new one the one before it.
    let mut newest: Vec<Option<u32>> = vec![None; mesh.positions.len()];
    let mut before: Vec<Option<u32>> = Vec::with_capacity(mesh.positions.len());
    let mut old: Vec<u32> = Vec::with_capacity(mesh.positions.len());
    // A corner that shows the new vertex's normal and tangent.
    let mut corner: Vec<u32> = Vec::with_capacity(mesh.positions.len());
    for (c, v) in mesh.indices.as_flattened_mut().iter_mut().enumerate() {
        let newest = &mut newest[*v as usize];
        let mut found = *newest;
        while let Some(new) = found {
            let shown = corner[new as usize] as usize;
            if tangents[shown] == tangents[c] && normals[shown] == normals[c] {
                break;
            }
            found = before[new as usize];
        }
        let new = found.unwrap_or(old.len() as u32);
        if found.is_none() {
            old.push(*v);
            corner.push(c as u32);
            before.push(*newest);
            *newest = Some(new);
        }
        *v = new;
    }
    fn pick<T: Copy>(list: &[T], which: &[u32]) -> Vec<T> {
        which.iter().map(|&i| list[i as usize]).collect()
    }
    mesh.positions = pick(&mesh.positions, &old);
    for set in &mut mesh.uv_sets {
        *set = pick(set, &old);
    }
    if let Some(colors) = &mut mesh.colors {
        *colors = pick(colors, &old);
    }
    // Normals as they were, so that a mesh with a normal map shades as one without where the map is flat.
    mesh.normals = Some(match &mesh.normals {
        Some(normals) => pick(normals, &old),
        None => corner.iter().map(|&c| normals[c as usize].to_array()).collect(),
    });
    mesh.tangents = Some(pick(&tangents, &corner));
    old
}

#[cfg(test)]
#[path = "tangents_tests.rs"]
mod tests;
