//! Shading normals where the file gives none: smoothing groups, or every edge below an angle, else flat.
//!
//! Normals of faces that meet in a vertex are averaged by the angle that each has there (Thürmer and Wüthrich 1998,
//! "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3(1)): how a polygon is cut into
//! triangles does not matter then.

use super::geometry::Geometry;
use super::polygon::newell;
use super::statement::NONE;
use super::vertices::Chains;
use glam::DVec3;
use std::collections::HashSet;

/// Gives normals to the corners that have none: within smoothing groups, or, with `smooth_angle` (degrees), across every
/// edge of two such faces that makes less than it. What stays without is flat.
pub(super) fn complete(geometry: &mut Geometry, smooth_angle: Option<f32>) {
    if geometry.pieces.iter().all(|p| !p.lacks_normals) {
        return;
    }
    let bare = bare_faces(geometry, smooth_angle.is_some());
    match smooth_angle {
        Some(angle) => smooth_edges(geometry, &bare, f64::from(angle).to_radians().cos()),
        None => smooth_groups(geometry, &bare),
    }
    fill_flat(geometry);
}

/// A face with a corner that has no normal.
struct Bare {
    piece: usize,
    face: usize,
    smooth: u32,
}

/// Those that may become smooth: of a smoothing group, or `all`.
fn bare_faces(geometry: &Geometry, all: bool) -> Vec<Bare> {
    let mut bare = Vec::new();
    let runs = geometry.parts.iter().flat_map(|part| &part.runs);
    for run in runs.filter(|run| (all || run.smooth > 0) && geometry.pieces[run.piece].lacks_normals) {
        let piece = &geometry.pieces[run.piece];
        let lacking = run.faces.clone().filter(|&f| piece.corners[piece.range(f)].iter().any(|c| c[2] == NONE));
        bare.extend(lacking.map(|face| Bare { piece: run.piece, face, smooth: run.smooth }));
    }
    bare
}

fn point(geometry: &Geometry, position: u32) -> DVec3 {
    DVec3::from_array(geometry.positions[position as usize].map(f64::from))
}

/// The face's unit normal; zero if it has none.
fn face_normal(geometry: &Geometry, piece: usize, face: usize) -> DVec3 {
    let piece = &geometry.pieces[piece];
    let points: Vec<DVec3> = piece.corners[piece.range(face)].iter().map(|c| point(geometry, c[0])).collect();
    newell(&points).try_normalize().unwrap_or_default()
}

/// The angle between the edges of corner `i` of a face, radians; 0 where an edge has no length.
fn angle(points: &[DVec3], i: usize) -> f64 {
    let n = points.len();
    let edge = |k: usize| (points[k] - points[i]).try_normalize();
    match (edge((i + n - 1) % n), edge((i + 1) % n)) {
        (Some(a), Some(b)) => a.dot(b).clamp(-1.0, 1.0).acos(),
        _ => 0.0,
    }
}

fn to_f32(sum: DVec3) -> [f32; 3] {
    // Zero (faces that cancel out) gives way to the geometric normal when it is shaded.
    sum.try_normalize().unwrap_or_default().to_array().map(|c| c as f32)
}

/// Averages over the faces of one group that share a position.
fn smooth_groups(geometry: &mut Geometry, bare: &[Bare]) {
    let base = geometry.normals.len() as u32;
    let mut vertices = Chains::new(0, geometry.positions.len());
    let mut sums: Vec<DVec3> = Vec::new();
    let mut points = Vec::new();
    for Bare { piece, face, smooth } in bare {
        let range = geometry.pieces[*piece].range(*face);
        points.clear();
        points.extend(geometry.pieces[*piece].corners[range.clone()].iter().map(|c| point(geometry, c[0])));
        let normal = newell(&points).try_normalize().unwrap_or_default();
        for (i, k) in range.enumerate() {
            let corner = geometry.pieces[*piece].corners[k];
            let (id, is_new) = vertices.id(corner[0], [*smooth, 0]);
            if is_new {
                sums.push(DVec3::ZERO);
            }
            sums[id as usize] += normal * angle(&points, i);
            if corner[2] == NONE {
                geometry.pieces[*piece].corners[k][2] = base + id;
            }
        }
    }
    geometry.normals.extend(sums.into_iter().map(to_f32));
}

/// A corner of a bare face among those around one position.
struct Wing {
    position: u32,
    /// The positions before and after it in the face.
    neighbours: [u32; 2],
    /// Index into the bare faces.
    face: usize,
    /// Index into the corners of the face's piece.
    corner: usize,
}

/// Joins faces at a vertex across the edges whose faces make an angle of a cosine above `least`.
fn smooth_edges(geometry: &mut Geometry, bare: &[Bare], least: f64) {
    let normals: Vec<DVec3> = bare.iter().map(|b| face_normal(geometry, b.piece, b.face)).collect();
    let mut wings = Vec::new();
    for (face, b) in bare.iter().enumerate() {
        let range = geometry.pieces[b.piece].range(b.face);
        let corners = &geometry.pieces[b.piece].corners[range.clone()];
        let n = corners.len();
        wings.extend((0..n).map(|i| Wing {
            position: corners[i][0],
            neighbours: [corners[(i + n - 1) % n][0], corners[(i + 1) % n][0]],
            face,
            corner: range.start + i,
        }));
    }
    // Stable, so that sums are added in the order of the file.
    wings.sort_by_key(|w| w.position);
    for around in wings.chunk_by(|a, b| a.position == b.position) {
        let joined = join(around, &normals, least);
        let base = geometry.normals.len() as u32;
        let mut sums = vec![DVec3::ZERO; around.len()];
        for (wing, &group) in around.iter().zip(&joined) {
            let b = &bare[wing.face];
            let [before, after] = wing.neighbours;
            let points = [before, wing.position, after].map(|p| point(geometry, p));
            sums[group] += normals[wing.face] * angle(&points, 1);
            let corner = &mut geometry.pieces[b.piece].corners[wing.corner];
            if corner[2] == NONE {
                corner[2] = base + group as u32;
            }
        }
        geometry.normals.extend(sums.into_iter().map(to_f32));
    }
}

/// For each face around a position, the first of those that it is smooth with.
fn join(around: &[Wing], normals: &[DVec3], least: f64) -> Vec<usize> {
    let mut group: Vec<usize> = (0..around.len()).collect();
    let mut edges: Vec<(u32, usize)> =
        around.iter().enumerate().flat_map(|(i, w)| w.neighbours.map(|end| (end, i))).collect();
    edges.sort_unstable();
    for sharing in edges.chunk_by(|a, b| a.0 == b.0) {
        // An edge of three faces or more has no two sides: it stays sharp.
        let &[(_, a), (_, b)] = sharing else { continue };
        if normals[around[a].face].dot(normals[around[b].face]) >= least {
            let (a, b) = (root(&mut group, a), root(&mut group, b));
            group[a.max(b)] = a.min(b);
        }
    }
    (0..around.len()).map(|i| root(&mut group, i)).collect()
}

/// The first member of `i`'s group; shortens the way to it.
fn root(group: &mut [usize], mut i: usize) -> usize {
    while group[i] != i {
        group[i] = group[group[i]];
        i = group[i];
    }
    i
}

/// In parts where some corners have normals, the others get those of their faces: a mesh has normals or has none.
fn fill_flat(geometry: &mut Geometry) {
    let mut flat = Vec::new();
    for part in &geometry.parts {
        let corners = |run: &super::geometry::Run| {
            let piece = &geometry.pieces[run.piece];
            let (first, last) = (run.faces.start, run.faces.end - 1);
            &piece.corners[piece.range(first).start..piece.range(last).end]
        };
        let has = |given: bool| part.runs.iter().any(|run| corners(run).iter().any(|c| (c[2] != NONE) == given));
        if has(true) && has(false) {
            flat.extend(part.runs.iter().flat_map(|run| run.faces.clone().map(|face| (run.piece, face))));
        }
    }
    let mut seen = HashSet::new();
    for (piece, face) in flat {
        let range = geometry.pieces[piece].range(face);
        if !seen.insert((piece, face)) || geometry.pieces[piece].corners[range.clone()].iter().all(|c| c[2] != NONE) {
            continue;
        }
        let normal = to_f32(face_normal(geometry, piece, face));
        geometry.normals.push(normal);
        let id = (geometry.normals.len() - 1) as u32;
        geometry.pieces[piece].corners[range].iter_mut().filter(|c| c[2] == NONE).for_each(|c| c[2] = id);
    }
}
