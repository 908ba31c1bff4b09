//! Perspective and orthographic cameras.

use super::node::{Rigid, rigid};
use super::{Document, Loader, Result, extensions, lens};
use crate::camera::{Camera, Projection};
use glam::DMat4;
use gltf::json::camera::{Camera as Json, Type};
use gltf::json::validation::Checked;
use gltf::json::{Extras, Index};
use std::f64::consts::PI;

/// Places the camera at `index` (found at `pointer`) by a node of which the rest is given.
pub(super) fn place(
    loader: &mut Loader,
    index: Index<Json>,
    pointer: &str,
    world: DMat4,
    node_at: &str,
    node_name: &str,
    node_extras: &Extras,
) -> Result<()> {
    let doc = loader.doc;
    let found = doc.item(&doc.root.cameras, index, pointer, "cameras")?;
    let at = format!("/cameras/{}", index.value());
    if let Some(carried) = &found.extensions {
        extensions::note_carried(doc, carried.others.keys(), &at, &[]);
    }
    let projection = match found.type_ {
        Checked::Valid(Type::Perspective) => perspective(doc, found, &at)?,
        Checked::Valid(Type::Orthographic) => orthographic(doc, found, &at)?,
        Checked::Invalid => {
            let fix = "Allowed: perspective, orthographic.";
            return Err(doc.bad(&format!("{at}/type"), "is not a kind of camera", fix));
        }
    };
    let Rigid::Frame(world_from_camera) = rigid(&world) else {
        let fix = "A scale of 0 along the camera's z leaves no direction to look in.";
        return Err(doc.error(node_at, "the camera has no direction", fix));
    };
    let name = found.name.clone().filter(|n| !n.is_empty()).unwrap_or_else(|| node_name.to_owned());
    let (of_node, of_camera) = (lens::read(doc, node_extras, node_at)?, lens::read(doc, &found.extras, &at)?);
    let lens = of_node.or(of_camera);
    lens::check(doc, &lens, &projection, if of_node.f_stop.is_some() { node_at } else { &at })?;
    loader.cameras.insert(index.value());
    loader.builder.add_camera(Camera { name, world_from_camera, projection, lens });
    Ok(())
}

fn perspective(doc: &Document, found: &Json, at: &str) -> Result<Projection> {
    let Some(perspective) = &found.perspective else {
        return Err(doc.error(at, "has no perspective", "A camera of type perspective needs it, with yfov."));
    };
    let yfov = f64::from(perspective.yfov);
    if !(yfov > 0.0 && yfov < PI) {
        let fix = "It must be more than 0 and less than pi. Did the exporter write degrees? It is in radians.";
        return Err(doc.bad(&format!("{at}/perspective/yfov"), "is out of range", fix));
    }
    let aspect_ratio = perspective.aspect_ratio.map(f64::from);
    if aspect_ratio.is_some_and(|a| !(a.is_finite() && a > 0.0)) {
        let fix = "Width over height must be positive; leave it out to take the picture's own.";
        return Err(doc.bad(&format!("{at}/perspective/aspectRatio"), "is out of range", fix));
    }
    Ok(Projection::Perspective { yfov, aspect_ratio })
}

/// `znear` and `zfar` do not clip, so any value is taken.
fn orthographic(doc: &Document, found: &Json, at: &str) -> Result<Projection> {
    let Some(orthographic) = &found.orthographic else {
        let fix = "A camera of type orthographic needs it, with xmag, ymag, znear and zfar.";
        return Err(doc.error(at, "has no orthographic", fix));
    };
    for (key, value) in [("xmag", orthographic.xmag), ("ymag", orthographic.ymag)] {
        if !(value.is_finite() && value > 0.0) {
            let fix = "Half of the width and half of the height of what is seen must be more than 0, in metres.";
            return Err(doc.bad(&format!("{at}/orthographic/{key}"), "is out of range", fix));
        }
    }
    Ok(Projection::Orthographic { xmag: f64::from(orthographic.xmag), ymag: f64::from(orthographic.ymag) })
}
