//! Skins: each vertex is moved by the weighted sum of `world_from_joint x inverseBindMatrix` of its joints (glTF 2.0
//! specification, section 3.7.3). The node that shows a skinned mesh does not place it.

use super::base::pick;
use super::primitive::Attributes;
use super::semantic::{INVERSE_BIND, Wanted};
use super::{Loader, Result, accessor, node};
use crate::shape::Mesh;
use glam::{DMat3, DMat4, DVec3};
use gltf::json::Index;
use gltf::json::mesh::Semantic;
use gltf::json::skin::Skin;
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

/// The matrices of a skin in a pose.
#[derive(Debug)]
pub(super) struct Palette {
    /// Per joint, mesh to world space less `origin`.
    pub matrices: Vec<DMat4>,
    /// Where the first joint is, metres: vertices are stored relative to it, so that f32 serves far from the world's
    /// origin as well. While the shutter is open, where it was at the opening.
    pub origin: DVec3,
}

/// Which joints move each vertex of a primitive, and how much.
#[derive(Debug)]
pub(super) struct Influences {
    sets: Vec<Set>,
    boxes: OnceLock<Vec<Option<(DVec3, DVec3)>>>,
}

#[derive(Debug)]
struct Set {
    joints: Vec<[u16; 4]>,
    weights: Vec<[f32; 4]>,
}

/// The skin at `index`, read once; `pointer` is where the index was found.
pub(super) fn palette(loader: &mut Loader, index: Index<Skin>, pointer: &str) -> Result<Arc<Palette>> {
    if let Some(done) = loader.skins.get(&index.value()) {
        return Ok(done.clone());
    }
    let doc = loader.doc;
    let skin = doc.item(&doc.root.skins, index, pointer, "skins")?;
    let at = format!("/skins/{}", index.value());
    let n = skin.joints.len();
    if n == 0 {
        return Err(doc.error(format!("{at}/joints"), "has no joints", "A skin needs at least one."));
    }
    let inverse = match loader.kept.inverse_binds.get(&index.value()) {
        Some(known) => Arc::clone(known),
        None => inverse_binds(loader, skin, &at)?,
    };
    loader.kept.inverse_binds.insert(index.value(), Arc::clone(&inverse));
    let mut matrices = Vec::with_capacity(n);
    let mut origin = loader.skin_origins.get(&index.value()).copied();
    for (k, (joint, &inverse)) in skin.joints.iter().zip(inverse.iter()).enumerate() {
        let joint_at = format!("{at}/joints/{k}");
        doc.item(&doc.root.nodes, *joint, &joint_at, "nodes")?;
        let world = node::world(loader, joint.value())?;
        let origin = *origin.get_or_insert(world.w_axis.truncate());
        let matrix = DMat4::from_translation(-origin) * world * inverse;
        if !matrix.is_finite() {
            let fix = "Its inverse bind matrix, or the transforms above it, are too large or not numbers.";
            return Err(doc.error(joint_at, "the matrix of this joint is not finite", fix));
        }
        matrices.push(matrix);
    }
    let palette = Arc::new(Palette { matrices, origin: origin.unwrap_or_default() });
    loader.skins.insert(index.value(), palette.clone());
    Ok(palette)
}

/// One matrix a joint, at least.
fn inverse_binds(loader: &Loader, skin: &Skin, at: &str) -> Result<Arc<Vec<DMat4>>> {
    let (doc, n) = (loader.doc, skin.joints.len());
    let Some(index) = skin.inverse_bind_matrices else { return Ok(Arc::new(vec![DMat4::IDENTITY; n])) };
    let pointer = format!("{at}/inverseBindMatrices");
    let elements = accessor::open(doc, index, &pointer, &INVERSE_BIND)?;
    if elements.count < n {
        let fix = format!("There must be one per joint, and the skin has {n}.");
        return Err(doc.error(pointer, format!("{} matrices", elements.count), fix));
    }
    let matrices = elements.floats::<16>()?;
    Ok(Arc::new(matrices.into_iter().map(|m| DMat4::from_cols_array(&m.map(f64::from))).collect()))
}

impl Influences {
    /// Of a primitive that a skin moves; of each vertex those of the file's vertex in `origin`, where tangents split them.
    pub fn read(attributes: &Attributes, count: usize, origin: Option<&[u32]>) -> Result<Self> {
        let mut sets = Vec::new();
        for set in 0.. {
            let joints = attributes.open(&Semantic::Joints(set), &Wanted::joints(set), Some(count))?;
            let weights = attributes.open(&Semantic::Weights(set), &Wanted::weights(set), Some(count))?;
            let (Some(joints), Some(weights)) = (joints, weights) else {
                if set > 0 {
                    break;
                }
                let fix = "A mesh that a skin moves needs both.";
                let at = format!("{}/attributes", attributes.at);
                return Err(attributes.loader.doc.error(at, "no JOINTS_0 or no WEIGHTS_0", fix));
            };
            // Exact: joints are integers of at most 16 bits.
            let joints: Vec<[u16; 4]> = joints.floats::<4>()?.into_iter().map(|j| j.map(|j| j as u16)).collect();
            let weights = weights.floats::<4>()?;
            sets.push(match origin {
                None => Set { joints, weights },
                Some(origin) => Set { joints: pick(&joints, origin), weights: pick(&weights, origin) },
            });
        }
        Ok(Self { sets, boxes: OnceLock::new() })
    }

    /// Whether `palette` has every joint that moves a vertex.
    ///
    /// # Errors
    /// It lacks one.
    pub fn check(&self, palette: &Palette, attributes: &Attributes) -> Result<()> {
        let n = palette.matrices.len();
        // Exporters leave anything in the joints that have no weight.
        let lacks = |(joint, weight): (&u16, &f32)| usize::from(*joint) >= n && *weight != 0.0;
        for (k, set) in self.sets.iter().enumerate() {
            let wrong = |(joints, weights): (&[u16; 4], &[f32; 4])| joints.iter().zip(weights).any(lacks);
            if let Some(v) = set.joints.par_iter().zip(&set.weights).position_first(wrong) {
                let mut all = set.joints.iter().zip(&set.weights).skip(v).flat_map(|(j, w)| j.iter().zip(w));
                let joint = all.find(|each| lacks(*each)).map_or(0, |(joint, _)| *joint);
                let fix = format!("The skin has {n} joints, counted from 0.");
                let at = format!("{}/attributes/JOINTS_{k}", attributes.at);
                let problem = format!("vertex {v}: there is no joint {joint}");
                return Err(attributes.loader.doc.error(at, problem, fix));
            }
        }
        Ok(())
    }

    /// Of each joint the box of the vertices of `mesh`, unmoved, that it moves: object space, metres.
    pub fn boxes(&self, mesh: &Mesh) -> &[Option<(DVec3, DVec3)>] {
        self.boxes.get_or_init(|| {
            let mut boxes: Vec<Option<(DVec3, DVec3)>> = Vec::new();
            for set in &self.sets {
                for ((joints, weights), p) in set.joints.iter().zip(&set.weights).zip(&mesh.positions) {
                    let p = DVec3::from_array(p.map(f64::from));
                    for (&joint, _) in joints.iter().zip(weights).filter(|(_, w)| **w > 0.0 && p.is_finite()) {
                        let joint = usize::from(joint);
                        if boxes.len() <= joint {
                            boxes.resize(joint + 1, None);
                        }
                        if let Some(found) = boxes.get_mut(joint) {
                            *found = Some(found.map_or((p, p), |(low, high)| (low.min(p), high.max(p))));
                        }
                    }
                }
            }
            boxes
        })
    }

    /// The weighted sum of the matrices of vertex `v`. Weights are made to add up to 1; a vertex without any goes with its
    /// first joint.
    fn matrix(&self, v: usize, palette: &Palette) -> DMat4 {
        let (mut sum, mut total, mut first) = (DMat4::ZERO, 0.0, None);
        for set in &self.sets {
            let (Some(joints), Some(weights)) = (set.joints.get(v), set.weights.get(v)) else { continue };
            for (&joint, &weight) in joints.iter().zip(weights) {
                let Some(matrix) = palette.matrices.get(usize::from(joint)) else { continue };
                first.get_or_insert(*matrix);
                if weight.is_finite() && weight > 0.0 {
                    sum += *matrix * f64::from(weight);
                    total += f64::from(weight);
                }
            }
        }
        if total > 0.0 { sum * total.recip() } else { first.unwrap_or(DMat4::IDENTITY) }
    }
}

impl Palette {
    /// Where meshes in this skin are placed.
    pub fn world(&self) -> DMat4 {
        DMat4::from_translation(self.origin)
    }

    /// Moves a mesh by its joints; a joint that mirrors turns the winding, so that the front stays the front.
    pub fn apply(&self, influences: &Influences, mesh: &mut Mesh) {
        let n = mesh.positions.len();
        let moves: Vec<DMat4> = (0..n).into_par_iter().map(|v| influences.matrix(v, self)).collect();
        deform(mesh, &moves);
    }
}

/// Moves each vertex by its own matrix; one that mirrors turns the winding, so that the front stays the front.
fn deform(mesh: &mut Mesh, moves: &[DMat4]) {
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    mesh.positions.par_iter_mut().zip(moves).for_each(|(p, m)| {
        *p = m.transform_point3(vector(*p)).as_vec3().to_array();
    });
    let mirrors = |m: &DMat4| DMat3::from_mat4(*m).determinant() < 0.0;
    if let Some(normals) = &mut mesh.normals {
        normals.par_iter_mut().zip(moves).for_each(|(normal, m)| {
            let (x, y, z) = (m.x_axis.truncate(), m.y_axis.truncate(), m.z_axis.truncate());
            // By cofactors, as instances are: no division, so a squashed joint stays finite.
            let cofactor = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * if mirrors(m) { -1.0 } else { 1.0 };
            let n = vector(*normal);
            // Joints that turn against each other can squash a vertex to a line, which has no cofactors.
            let moved = (cofactor * n).try_normalize().unwrap_or_else(|| m.transform_vector3(n).normalize_or_zero());
            *normal = moved.as_vec3().to_array();
        });
    }
    if let Some(tangents) = &mut mesh.tangents {
        tangents.par_iter_mut().zip(moves).for_each(|(t, m)| {
            let [x, y, z, w] = *t;
            let v = m.transform_vector3(vector([x, y, z])).normalize_or_zero().as_vec3();
            *t = [v.x, v.y, v.z, if mirrors(m) { -w } else { w }];
        });
    }
    for triangle in &mut mesh.indices {
        if moves.get(triangle[0] as usize).is_some_and(mirrors) {
            triangle.swap(1, 2);
        }
    }
}
