//! `EXT_mesh_gpu_instancing`: a node's mesh placed many times.

use super::semantic::{ROTATION, SCALE, TRANSLATION, Wanted};
use super::{Document, Loader, Result, accessor};
use glam::{DMat4, DQuat, DVec3};
use gltf::json::Index;
use serde_json::Value;

/// The extension's name.
pub(super) const NAME: &str = "EXT_mesh_gpu_instancing";

/// The transforms of the instances, relative to the node; `at` is the extension's place. Attributes other than the
/// three of the extension are for shaders of the exporter's own: ignored.
pub(super) fn read(loader: &mut Loader, extension: &Value, at: &str) -> Result<Vec<DMat4>> {
    let doc = loader.doc;
    let attributes = extension.get("attributes").and_then(Value::as_object);
    let Some(attributes) = attributes else {
        let fix = "It must be an object with TRANSLATION, ROTATION or SCALE.";
        return Err(doc.bad(&format!("{at}/attributes"), "is not a list of attributes", fix));
    };
    let mut count = None;
    let mut columns: [Option<Vec<[f32; 4]>>; 3] = [None, None, None];
    for (wanted, column) in [TRANSLATION, ROTATION, SCALE].iter().zip(&mut columns) {
        let Some(value) = attributes.get(wanted.name.as_ref()) else { continue };
        let at = format!("{at}/attributes/{}", wanted.name);
        let values = floats(doc, value, &at, wanted)?;
        match count {
            Some(n) if n != values.len() => {
                let fix = "All attributes of the instances must have as many elements.";
                return Err(doc.error(at, format!("{} elements but another has {n}", values.len()), fix));
            }
            _ => count = Some(values.len()),
        }
        *column = Some(values);
    }
    let Some(count) = count else {
        let fix = "At least one of TRANSLATION, ROTATION and SCALE is needed to know how many.";
        return Err(doc.error(format!("{at}/attributes"), "names no instances", fix));
    };
    let [translations, rotations, scales] = columns;
    let element = |column: &Option<Vec<[f32; 4]>>, i: usize, default: [f32; 4]| {
        column.as_ref().and_then(|c| c.get(i)).copied().unwrap_or(default).map(f64::from)
    };
    let mut transforms = Vec::with_capacity(count);
    for i in 0..count {
        let [x, y, z, _] = element(&translations, i, [0.0; 4]);
        let rotation = DQuat::from_array(element(&rotations, i, [0.0, 0.0, 0.0, 1.0]));
        let [sx, sy, sz, _] = element(&scales, i, [1.0; 4]);
        let length = rotation.length();
        // Bytes and shorts are not of length 1 to more than two or four digits.
        let matrix =
            DMat4::from_scale_rotation_translation(DVec3::new(sx, sy, sz), rotation / length, DVec3::new(x, y, z));
        if length == 0.0 || !matrix.is_finite() {
            let fix = "Translations and scales must be finite, rotations quaternions of length 1.";
            return Err(doc.error(format!("{at}/attributes"), format!("instance {i} has no transform"), fix));
        }
        transforms.push(matrix);
    }
    Ok(transforms)
}

/// `[count][4]`; the last is 0 where the attribute has three components.
fn floats(doc: &Document, value: &Value, at: &str, wanted: &Wanted) -> Result<Vec<[f32; 4]>> {
    let Some(index) = value.as_u64().and_then(|i| u32::try_from(i).ok()) else {
        return Err(doc.bad(at, "is not an index", "It must be the index of an accessor."));
    };
    let elements = accessor::open(doc, Index::new(index), at, wanted)?;
    if wanted.name == ROTATION.name {
        return elements.floats();
    }
    Ok(elements.floats::<3>()?.into_iter().map(|[x, y, z]| [x, y, z, 0.0]).collect())
}
