//! A primitive before anything moves it: what the file has of its vertices, read and checked once for all poses, and those
//! poses. What neither a skin nor a morph target ever moves is a finished [`Mesh`].

use super::material::{self, Along};
use super::morph::{self, Targets};
use super::skin::{Influences, Palette};
use crate::load::tangents;
use crate::scene::{Findings, Notes, Pose, check_mesh};
use crate::shape::Mesh;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

/// A primitive with triangles.
#[derive(Debug)]
pub(super) struct Base {
    /// As read, unchecked; where tangents are given, or can be made before a pose, with them.
    mesh: Arc<Mesh>,
    /// The same finished: with tangents and checked. Made when it is first asked for.
    plain: OnceLock<Plain>,
    /// Vertices that the file has.
    pub count: usize,
    /// Of each vertex of `mesh` the file's, where tangents split vertices.
    pub origin: Option<Vec<u32>>,
    /// Tangents that have to be made anew for every pose.
    late: Option<Along>,
    /// All positions are zeros that no buffer holds: morph targets alone make something of it.
    pub is_zero: bool,
    /// What its material asked for when it was read.
    asked: (Vec<u32>, Option<Along>),
    pub targets: Targets,
    pub influences: OnceLock<Influences>,
    /// What was said while it was read.
    pub notes: Notes,
}

/// A base at rest.
#[derive(Debug)]
struct Plain {
    mesh: Arc<Mesh>,
    findings: Findings,
    origin: Option<Arc<[u32]>>,
}

/// A pose of a primitive.
pub(super) struct Deformed {
    pub mesh: Mesh,
    /// Of each of its vertices the base's, where tangents split vertices.
    pub origin: Option<Vec<u32>>,
    /// Triangles around a vertex, too many to make tangents; they are any across the normals.
    pub too_many: Option<usize>,
}

impl Base {
    /// From the vertices as the file has them, with so many morph targets. Also what is to be said of tangents.
    pub fn new(
        mut mesh: Mesh,
        is_zero: bool,
        targets: usize,
        surface: &material::Read,
        along: Option<Along>,
    ) -> (Self, Option<TangentNote>) {
        let (mut origin, mut late, mut note) = (None, None, None);
        let count = mesh.positions.len();
        if let Some(along) = along {
            if mesh.tangents.is_some() {
                let repaired = tangents::repair(&mut mesh);
                note = (repaired > 0).then_some(TangentNote::Repaired(repaired));
            } else if targets > 0 || mesh.normals.is_none() {
                // Targets change what tangents follow from (glTF 2.0 specification, section 3.7.2.2), and joints what flat
                // normals do.
                late = Some(along);
            } else {
                // As the surface is at rest; joints turn them with it.
                let (old, made) = tangents::generate_splitting(&mut mesh, along.set, along.transform);
                note = made.err().map(|tangents::TooManyTriangles(n)| TangentNote::TooMany(n));
                origin = Some(old);
            }
        }
        let base = Self {
            count,
            mesh: Arc::new(mesh),
            plain: OnceLock::new(),
            origin,
            late,
            is_zero,
            asked: (surface.tex_coords.clone(), surface.tangents),
            targets: Targets::new(targets),
            influences: OnceLock::new(),
            notes: Notes::default(),
        };
        (base, note)
    }

    /// Whether a material that asks for what `surface` does gets the same vertices.
    pub fn serves(&self, surface: &material::Read) -> bool {
        self.asked == (surface.tex_coords.clone(), surface.tangents)
    }

    /// Unmoved, as read.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// At rest, checked; `too_many` as in [`Deformed`], said once.
    pub fn plain(&self) -> (Arc<Mesh>, Findings, Option<usize>) {
        let mut too_many = None;
        let Plain { mesh, findings, .. } = self.plain.get_or_init(|| {
            let (mut mesh, mut origin) = (Arc::clone(&self.mesh), None);
            if self.late.is_some() {
                let deformed = self.finish((*mesh).clone());
                too_many = deformed.too_many;
                (mesh, origin) = (Arc::new(deformed.mesh), deformed.origin.map(Into::into));
            }
            // What the check leaves as it is is not there twice.
            let mut checked = (*mesh).clone();
            let findings = check_mesh(&mut checked);
            if findings.is_clean() {
                return Plain { mesh, findings, origin };
            }
            Plain { mesh: Arc::new(checked), findings, origin }
        });
        (Arc::clone(mesh), *findings, too_many)
    }

    /// At rest, unchecked, without a copy; `too_many` as in [`Deformed`].
    pub fn into_plain(self) -> (Mesh, Option<usize>) {
        let mesh = Arc::unwrap_or_clone(self.mesh);
        match self.late {
            None => (mesh, None),
            Some(along) => {
                let ((mesh, _), too_many) = make_tangents(mesh, along);
                (mesh, too_many)
            }
        }
    }

    /// Of each vertex of [`Base::plain`] the base's, where they are not the same.
    pub fn plain_origin(&self) -> Option<Arc<[u32]>> {
        self.plain.get().and_then(|plain| plain.origin.clone())
    }

    /// Moved by the weights of its morph targets (none, or one each) and then by joints.
    pub fn deformed(&self, weights: &[f32], palette: Option<&Palette>) -> Deformed {
        self.finish(self.moved(weights, palette))
    }

    /// Without tangents that have to be made.
    fn moved(&self, weights: &[f32], palette: Option<&Palette>) -> Mesh {
        let mut mesh = (*self.mesh).clone();
        morph::apply(&self.targets, weights, &mut mesh);
        if let (Some(palette), Some(influences)) = (palette, self.influences.get()) {
            palette.apply(influences, &mut mesh);
        }
        mesh
    }

    fn finish(&self, mut mesh: Mesh) -> Deformed {
        match self.late {
            Some(along) => {
                let ((mesh, origin), too_many) = make_tangents(mesh, along);
                Deformed { mesh, origin: Some(origin), too_many }
            }
            None => {
                if mesh.tangents.is_some() {
                    tangents::repair(&mut mesh);
                }
                Deformed { mesh, origin: None, too_many: None }
            }
        }
    }

    /// The vertices of the pose `at` (of this base) as other weights and joints move them; the same vertices in the same
    /// order.
    pub fn pose(&self, at: &Mesh, origin: Option<&[u32]>, weights: &[f32], palette: Option<&Palette>) -> Pose {
        let moved = self.moved(weights, palette);
        let (positions, normals, tangents) = match origin {
            None => (moved.positions, moved.normals, moved.tangents),
            Some(origin) => {
                let positions: Vec<[f32; 3]> = pick(&moved.positions, origin);
                let normals = match &moved.normals {
                    Some(normals) => pick(normals, origin),
                    None => flat_normals(at, &positions),
                };
                // Those that were made go along as they are: across the normal they are turned where they are used.
                (positions, Some(normals), None)
            }
        };
        let mut positions = positions;
        // A vertex that goes where no number is stays.
        positions.par_iter_mut().zip(&at.positions).for_each(|(p, rest)| {
            if !p.iter().all(|c| c.abs() <= crate::scene::MAX_COORDINATE) {
                *p = *rest;
            }
        });
        let mut pose = Mesh {
            positions,
            normals,
            tangents: tangents.or_else(|| at.tangents.clone()),
            ..Mesh::plain("", vec![], vec![], at.material)
        };
        if pose.tangents.is_some() {
            tangents::repair(&mut pose);
        }
        Pose {
            positions: pose.positions,
            normals: pose.normals.filter(|_| at.normals.is_some()),
            tangents: pose.tangents.filter(|_| at.tangents.is_some()),
        }
    }
}

/// What is to be said of a primitive's tangents.
#[derive(Clone, Copy, Debug)]
pub(super) enum TangentNote {
    /// So many had no direction.
    Repaired(usize),
    /// So many triangles meet in a vertex.
    TooMany(usize),
}

/// The mesh with tangents, of each vertex the one that it was; and why they are any, if they are.
fn make_tangents(mut mesh: Mesh, along: Along) -> ((Mesh, Vec<u32>), Option<usize>) {
    let (origin, made) = tangents::generate_splitting(&mut mesh, along.set, along.transform);
    ((mesh, origin), made.err().map(|tangents::TooManyTriangles(n)| n))
}

pub(super) fn pick<T: Copy + Default>(list: &[T], which: &[u32]) -> Vec<T> {
    which.iter().map(|&i| list.get(i as usize).copied().unwrap_or_default()).collect()
}

/// Of each vertex that of the last triangle that has it: after a split for tangents, vertices of flat meshes belong to
/// triangles of one normal.
fn flat_normals(mesh: &Mesh, positions: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let mut normals = mesh.normals.clone().unwrap_or_else(|| vec![[0.0; 3]; positions.len()]);
    let at = |i: u32| positions.get(i as usize).map_or(DVec3::ZERO, |p| DVec3::from_array(p.map(f64::from)));
    for triangle in &mesh.indices {
        let [a, b, c] = triangle.map(at);
        if let Some(normal) = (b - a).cross(c - a).try_normalize() {
            for &i in triangle {
                normals.get_mut(i as usize).into_iter().for_each(|n| *n = normal.as_vec3().to_array());
            }
        }
    }
    normals
}
