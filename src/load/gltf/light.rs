//! Punctual lights (`KHR_lights_punctual`).

use super::node::{Rigid, rigid};
use super::{Document, Loader, Result, extensions};
use crate::light::Light;
use crate::scene::PlacedLight;
use glam::DMat4;
use gltf::json::Index;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as Json, Type};
use gltf::json::validation::Checked;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

const LIST: &str = "/extensions/KHR_lights_punctual/lights";

/// The lights of the file.
pub(super) fn list(doc: &Document) -> &[Json] {
    doc.root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()).map_or(&[], |l| &l.lights)
}

/// Places the light at `index` (found at `pointer`) by a node whose name and world transform are given.
pub(super) fn place(
    loader: &mut Loader,
    index: Index<Json>,
    pointer: &str,
    world: DMat4,
    node_at: &str,
    name: &str,
) -> Result<()> {
    let doc = loader.doc;
    let found = doc.item(list(doc), index, pointer, "KHR_lights_punctual lights")?;
    let light = read(doc, found, &format!("{LIST}/{}", index.value()))?;
    if found.range.is_some() {
        loader.warn_once("the range of lights is a hint for rasterisers: ignored");
    }
    let world_from_light = match rigid(&world) {
        Rigid::Frame(frame) => frame,
        Rigid::NoDirection(place) if matches!(light, Light::Point { .. }) => place,
        Rigid::NoDirection(_) => {
            let fix = "A scale of 0 along the light's z leaves no direction to shine in.";
            return Err(doc.error(node_at, "the light has no direction", fix));
        }
    };
    loader.lights.insert(index.value());
    loader.builder.add_light(PlacedLight { light, world_from_light, name: name.to_owned() });
    Ok(())
}

fn read(doc: &Document, found: &Json, at: &str) -> Result<Light> {
    if let Some(carried) = &found.extensions {
        let names: serde_json::Map<String, serde_json::Value> = serde_json::from_str(carried.get()).unwrap_or_default();
        extensions::note_carried(doc, names.keys(), at, &[]);
    }
    let valid = |v: &f32| (0.0..=f32::MAX).contains(v);
    if !valid(&found.intensity) {
        let fix = "It must be at least 0 and finite: cd for point and spot, lux for directional.";
        return Err(doc.bad(&format!("{at}/intensity"), "is out of range", fix));
    }
    if !found.color.iter().all(valid) {
        return Err(doc.bad(&format!("{at}/color"), "is out of range", "Each value must be in [0, 1]."));
    }
    let intensity = found.color.map(|c| c * found.intensity);
    if !intensity.iter().all(valid) {
        return Err(doc.bad(&format!("{at}/intensity"), "is too large", "color x intensity must be finite."));
    }
    match found.type_ {
        Checked::Valid(Type::Point) => Ok(Light::Point { intensity }),
        Checked::Valid(Type::Directional) => Ok(Light::Directional { illuminance: intensity }),
        Checked::Valid(Type::Spot) => {
            let (inner_cone, outer_cone) =
                found.spot.as_ref().map_or((0.0, FRAC_PI_4), |s| (s.inner_cone_angle, s.outer_cone_angle));
            // Written so that NaN fails.
            if !(inner_cone >= 0.0 && inner_cone < outer_cone && outer_cone <= FRAC_PI_2) {
                let problem = format!("innerConeAngle {inner_cone}, outerConeAngle {outer_cone}");
                let fix = "0 <= innerConeAngle < outerConeAngle <= pi/2 (1.5707963) must hold, in radians.";
                return Err(doc.error(format!("{at}/spot"), problem, fix));
            }
            Ok(Light::Spot { intensity, inner_cone, outer_cone })
        }
        Checked::Invalid => {
            Err(doc.bad(&format!("{at}/type"), "is not a kind of light", "Allowed: point, spot, directional."))
        }
    }
}
