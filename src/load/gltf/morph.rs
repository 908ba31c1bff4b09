//! Morph targets with the weights of the file (animation is another matter): `value + sum of weight x displacement`
//! (glTF 2.0 specification, section 3.7.2.2).

use super::Result;
use super::primitive::Attributes;
use super::semantic::{MORPH_NORMAL, MORPH_POSITION, MORPH_TANGENT, Wanted};
use crate::shape::Mesh;
use gltf::json::{Accessor, Index};

/// Displaces positions, normals and tangents; `weights` has none or one weight per target.
pub(super) fn apply(attributes: &Attributes, weights: &[f32], mesh: &mut Mesh) -> Result<()> {
    let targets = attributes.primitive.targets.as_deref().unwrap_or_default();
    for (k, (target, &weight)) in targets.iter().zip(weights).enumerate() {
        if weight == 0.0 {
            continue;
        }
        let read = |index: Option<Index<Accessor>>, wanted: &Wanted, n: usize| match index {
            None => Ok(None),
            Some(index) => {
                let pointer = format!("{}/targets/{k}/{}", attributes.at, wanted.name);
                attributes.elements(index, &pointer, wanted, Some(n))?.floats::<3>().map(Some)
            }
        };
        let n = mesh.positions.len();
        if let Some(deltas) = read(target.positions, &MORPH_POSITION, n)? {
            mesh.positions.iter_mut().zip(deltas).for_each(|(p, d)| add(p, d, weight));
        }
        if let Some(normals) = &mut mesh.normals
            && let Some(deltas) = read(target.normals, &MORPH_NORMAL, n)?
        {
            normals.iter_mut().zip(deltas).for_each(|(v, d)| add(v, d, weight));
        }
        if let Some(tangents) = &mut mesh.tangents
            && let Some(deltas) = read(target.tangents, &MORPH_TANGENT, n)?
        {
            tangents.iter_mut().zip(deltas).for_each(|(v, d)| add(v, d, weight));
        }
    }
    Ok(())
}

/// `value += weight x delta` in the first three components.
fn add(value: &mut [f32], delta: [f32; 3], weight: f32) {
    value.iter_mut().zip(delta).for_each(|(v, d)| *v += weight * d);
}
