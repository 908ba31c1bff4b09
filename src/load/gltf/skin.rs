//! Skins in the pose of the file (animation is another matter): each vertex is moved by the weighted sum of
//! `world_from_joint x inverseBindMatrix` of its joints (glTF 2.0 specification, section 3.7.3). The node that shows a
//! skinned mesh does not place it.

use super::primitive::Attributes;
use super::semantic::{INVERSE_BIND, Wanted};
use super::{Loader, Result, accessor, node};
use crate::shape::Mesh;
use glam::{DMat3, DMat4, DVec3};
use gltf::json::Index;
use gltf::json::mesh::Semantic;
use gltf::json::skin::Skin;
use rayon::prelude::*;
use std::rc::Rc;

/// The matrices of a skin.
#[derive(Debug)]
pub(super) struct Palette {
    /// Per joint, mesh to world space less `origin`.
    matrices: Vec<DMat4>,
    /// Where the first joint is, metres: vertices are stored relative to it, so that f32 serves far from the world's
    /// origin as well.
    origin: DVec3,
}

/// The skin at `index`, read once; `pointer` is where the index was found.
pub(super) fn palette(loader: &mut Loader, index: Index<Skin>, pointer: &str) -> Result<Rc<Palette>> {
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
    let inverse = match skin.inverse_bind_matrices {
        None => vec![DMat4::IDENTITY; n],
        Some(index) => {
            let pointer = format!("{at}/inverseBindMatrices");
            let elements = accessor::open(doc, index, &pointer, &INVERSE_BIND)?;
            if elements.count < n {
                let fix = format!("There must be one per joint, and the skin has {n}.");
                return Err(doc.error(pointer, format!("{} matrices", elements.count), fix));
            }
            elements.floats::<16>()?.into_iter().map(|m| DMat4::from_cols_array(&m.map(f64::from))).collect()
        }
    };
    let mut matrices = Vec::with_capacity(n);
    let mut origin = DVec3::ZERO;
    for (k, (joint, inverse)) in skin.joints.iter().zip(inverse).enumerate() {
        let joint_at = format!("{at}/joints/{k}");
        doc.item(&doc.root.nodes, *joint, &joint_at, "nodes")?;
        let world = node::world(loader, joint.value())?;
        if k == 0 {
            origin = world.w_axis.truncate();
        }
        let matrix = DMat4::from_translation(-origin) * world * inverse;
        if !matrix.is_finite() {
            let fix = "Its inverse bind matrix, or the transforms above it, are too large or not numbers.";
            return Err(doc.error(joint_at, "the matrix of this joint is not finite", fix));
        }
        matrices.push(matrix);
    }
    let palette = Rc::new(Palette { matrices, origin });
    loader.skins.insert(index.value(), palette.clone());
    Ok(palette)
}

impl Palette {
    /// Where meshes in this skin are placed.
    pub fn world(&self) -> DMat4 {
        DMat4::from_translation(self.origin)
    }

    /// Moves a mesh by its joints.
    pub fn apply(&self, attributes: &Attributes, mesh: &mut Mesh) -> Result<()> {
        let n = mesh.positions.len();
        let mut moves = vec![Move::default(); n];
        for set in 0.. {
            let joints = attributes.open(&Semantic::Joints(set), &Wanted::joints(set), Some(n))?;
            let weights = attributes.open(&Semantic::Weights(set), &Wanted::weights(set), Some(n))?;
            let (Some(joints), Some(weights)) = (joints, weights) else {
                if set > 0 {
                    break;
                }
                let fix = "A mesh that a skin moves needs both.";
                let at = format!("{}/attributes", attributes.at);
                return Err(attributes.loader.doc.error(at, "no JOINTS_0 or no WEIGHTS_0", fix));
            };
            let (joints, weights) = (joints.floats::<4>()?, weights.floats::<4>()?);
            for (v, (joints, weights)) in joints.iter().zip(&weights).enumerate() {
                self.gather(&mut moves, v, joints, weights).map_err(|problem| {
                    let fix = format!("The skin has {} joints, counted from 0.", self.matrices.len());
                    let at = format!("{}/attributes/JOINTS_{set}", attributes.at);
                    attributes.loader.doc.error(at, format!("vertex {v}: {problem}"), fix)
                })?;
            }
        }
        let moves: Vec<DMat4> = moves.par_iter().map(Move::matrix).collect();
        deform(mesh, &moves);
        Ok(())
    }

    /// Adds the joints of vertex `v`.
    fn gather(
        &self,
        moves: &mut [Move],
        v: usize,
        joints: &[f32; 4],
        weights: &[f32; 4],
    ) -> std::result::Result<(), String> {
        let Some(sum) = moves.get_mut(v) else { return Ok(()) };
        for (&joint, &weight) in joints.iter().zip(weights) {
            // Exact: joints are integers of at most 16 bits.
            let Some(matrix) = self.matrices.get(joint as usize) else {
                // Exporters leave anything in the joints that have no weight.
                if weight == 0.0 {
                    continue;
                }
                return Err(format!("there is no joint {joint}"));
            };
            sum.first.get_or_insert(*matrix);
            if weight.is_finite() && weight > 0.0 {
                sum.sum += *matrix * f64::from(weight);
                sum.weight += f64::from(weight);
            }
        }
        Ok(())
    }
}

/// The weighted sum of matrices of one vertex.
#[derive(Clone, Copy, Debug)]
struct Move {
    sum: DMat4,
    weight: f64,
    first: Option<DMat4>,
}

impl Default for Move {
    fn default() -> Self {
        Self { sum: DMat4::ZERO, weight: 0.0, first: None }
    }
}

impl Move {
    /// Weights are made to add up to 1; a vertex without any goes with its first joint.
    fn matrix(&self) -> DMat4 {
        match self.weight > 0.0 {
            true => self.sum * self.weight.recip(),
            false => self.first.unwrap_or(DMat4::IDENTITY),
        }
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
