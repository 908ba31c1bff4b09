//! Morph targets: `value + sum of weight x displacement` (glTF 2.0 specification, section 3.7.2.2).

use super::Result;
use super::primitive::Attributes;
use super::semantic::{MORPH_NORMAL, MORPH_POSITION, MORPH_TANGENT, Wanted};
use crate::shape::Mesh;
use gltf::json::{Accessor, Index};
use rayon::prelude::*;
use std::sync::OnceLock;

/// The morph targets of a primitive, read when they first have a weight.
#[derive(Debug, Default)]
pub(super) struct Targets(Vec<OnceLock<Target>>);

/// Displacements of one target, one a vertex of what is displaced.
#[derive(Debug, Default)]
struct Target {
    positions: Option<Vec<[f32; 3]>>,
    normals: Option<Vec<[f32; 3]>>,
    tangents: Option<Vec<[f32; 3]>>,
    /// The greatest length of those of positions, metres.
    reach: f64,
}

impl Targets {
    /// So many, none of them read.
    pub fn new(count: usize) -> Self {
        Self((0..count).map(|_| OnceLock::new()).collect())
    }

    /// Reads the targets of the primitive that have a weight; vertices as in `mesh`, which is unmoved.
    pub fn read(&self, attributes: &Attributes, weights: &[f32], mesh: &Mesh) -> Result<()> {
        let targets = attributes.primitive.targets.as_deref().unwrap_or_default();
        for (k, ((target, cell), &weight)) in targets.iter().zip(&self.0).zip(weights).enumerate() {
            if weight == 0.0 || cell.get().is_some() {
                continue;
            }
            let n = mesh.positions.len();
            let read = |index: Option<Index<Accessor>>, wanted: &Wanted| match index {
                None => Ok(None),
                Some(index) => {
                    let pointer = format!("{}/targets/{k}/{}", attributes.at, wanted.name);
                    attributes.elements(index, &pointer, wanted, Some(n))?.floats::<3>().map(Some)
                }
            };
            let positions = read(target.positions, &MORPH_POSITION)?;
            let normals = if mesh.normals.is_some() { read(target.normals, &MORPH_NORMAL)? } else { None };
            let tangents = if mesh.tangents.is_some() { read(target.tangents, &MORPH_TANGENT)? } else { None };
            let length = |d: &[f32; 3]| d.iter().map(|c| f64::from(*c).powi(2)).sum::<f64>().sqrt();
            let reach = positions.iter().flatten().map(length).filter(|l| l.is_finite()).fold(0.0, f64::max);
            let _ = cell.set(Target { positions, normals, tangents, reach });
        }
        Ok(())
    }

    /// How far each target moves a vertex at most at weight 1, metres.
    pub fn reaches(&self) -> impl Iterator<Item = f64> + '_ {
        self.0.iter().map(|target| target.get().map_or(0.0, |t| t.reach))
    }
}

/// Displaces positions, normals and tangents; `weights` has none or one weight per target.
pub(super) fn apply(targets: &Targets, weights: &[f32], mesh: &mut Mesh) {
    for (target, &weight) in targets.0.iter().zip(weights) {
        let Some(target) = target.get().filter(|_| weight != 0.0) else { continue };
        if let Some(deltas) = &target.positions {
            mesh.positions.par_iter_mut().zip(deltas).for_each(|(p, d)| add(p, d, weight));
        }
        if let (Some(normals), Some(deltas)) = (&mut mesh.normals, &target.normals) {
            normals.par_iter_mut().zip(deltas).for_each(|(v, d)| add(v, d, weight));
        }
        if let (Some(tangents), Some(deltas)) = (&mut mesh.tangents, &target.tangents) {
            tangents.par_iter_mut().zip(deltas).for_each(|(v, d)| add(v, d, weight));
        }
    }
}

/// `value += weight x delta` in the first three components.
fn add(value: &mut [f32], delta: &[f32; 3], weight: f32) {
    value.iter_mut().zip(delta).for_each(|(v, d)| *v += weight * d);
}
