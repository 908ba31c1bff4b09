//! `PRT_shape`: an exact surface in place of a node's mesh.

use super::{Document, Loader, Result, instancing, material, motion, name_or};
use crate::scene::PlacedShape;
use crate::shape::exact::ExactShape;
use crate::shape::exact::profile::{Curve, Profile, ProfileError};
use glam::DMat4;
use gltf::json::Index;
use gltf::json::scene::Node;
use serde_json::Value;
use std::sync::Arc;

/// The extension's name.
pub(super) const NAME: &str = "PRT_shape";

/// Radii beyond these are refused, metres.
const RADII: std::ops::RangeInclusive<f64> = 1e-30..=1e18;

/// What the node carries of it.
pub(super) fn of(node: &Node) -> Option<&Value> {
    node.extensions.as_ref().and_then(|e| e.others.get(NAME))
}

/// Places the shape `found` of node `i`, which is at `world`: by the node, or once per instance.
pub(super) fn place(loader: &mut Loader, node: &Node, i: usize, found: &Value, world: DMat4) -> Result<()> {
    let node_at = format!("/nodes/{i}");
    let at = format!("{node_at}/extensions/{NAME}");
    let name = name_or(node.name.as_ref(), "nodes", i);
    let shape = Arc::new(read(loader, found, &at, &name)?);
    let index = index(loader.doc, found, &format!("{at}/material"))?;
    let material = material::read(loader, index, &format!("{at}/material"))?.id;
    if node.skin.is_some() {
        loader.warn_once("exact shapes are placed by their nodes: skins do not move them");
    }
    let instances = node.extensions.as_ref().and_then(|e| e.others.get(instancing::NAME));
    let below = match instances {
        None => vec![DMat4::IDENTITY],
        Some(found) => instancing::read(loader, found, &format!("{node_at}/extensions/{}", instancing::NAME))?,
    };
    let corners = motion::box_corners(shape.bounds(&shape.object_from_unit()));
    for below in below {
        let world_from_object = world * below;
        loader.trace.shapes.push((i, below, corners));
        if !world_from_object.is_finite() {
            let fix = "The product of the transforms above it is too large.";
            return Err(loader.doc.error(node_at, "the world transform of an instance is not finite", fix));
        }
        let shape = Arc::clone(&shape);
        loader.builder.add_shape(PlacedShape { shape, material, world_from_object, name: name.clone() });
    }
    Ok(())
}

/// The index of its material; `None` is glTF's default one.
fn index(doc: &Document, found: &Value, at: &str) -> Result<Option<Index<gltf::json::Material>>> {
    let Some(value) = found.get("material") else { return Ok(None) };
    match value.as_u64().and_then(|i| u32::try_from(i).ok()) {
        Some(index) => Ok(Some(Index::new(index))),
        None => Err(doc.bad(at, "is not an index", "It must be the index of a material; without it the default one.")),
    }
}

fn read(loader: &mut Loader, found: &Value, at: &str, name: &str) -> Result<ExactShape> {
    let doc = loader.doc;
    match found.get("type").and_then(Value::as_str) {
        Some("sphere") => sphere(doc, found, at),
        Some("revolution") => revolution(loader, found, at, name),
        _ if !found.is_object() => {
            let fix = "It must be an object with type, radius or curve and points, and material.";
            Err(doc.error(at, "the extension is not an object", fix))
        }
        Some(_) => Err(doc.bad(&format!("{at}/type"), "is not a kind of shape", "Allowed: sphere, revolution.")),
        None => Err(doc.error(format!("{at}/type"), "is missing or no text", "Allowed: sphere, revolution.")),
    }
}

fn sphere(doc: &Document, found: &Value, at: &str) -> Result<ExactShape> {
    let at = format!("{at}/radius");
    let fix = "It must be a number from 1e-30 to 1e18: metres, above 0.";
    match found.get("radius").map(Value::as_f64) {
        None => Err(doc.error(at, "a sphere without radius", fix)),
        Some(Some(radius)) if RADII.contains(&radius) => Ok(ExactShape::Sphere { radius }),
        Some(_) => Err(doc.bad(&at, "is no radius", fix)),
    }
}

fn revolution(loader: &mut Loader, found: &Value, at: &str, name: &str) -> Result<ExactShape> {
    let doc = loader.doc;
    let curve = match found.get("curve").and_then(Value::as_str) {
        Some("bezier") => Curve::Bezier,
        Some("bspline") => Curve::BSpline,
        Some(_) => {
            return Err(doc.bad(&format!("{at}/curve"), "is not a kind of curve", "Allowed: bezier, bspline."));
        }
        None => return Err(doc.error(format!("{at}/curve"), "is missing or no text", "Allowed: bezier, bspline.")),
    };
    let points_at = format!("{at}/points");
    let points = points(doc, found, &points_at)?;
    let profile = Profile::new(curve, &points).map_err(|error| refuse(doc, error, &points_at, points.len()))?;
    let notes = profile.notes(&points);
    if let Some(i) = notes.repeated {
        let text =
            format!("{name}: {points_at}/{i} equals the point before it: the curve is drawn, and slows down there");
        loader.builder.warn(text);
    }
    if notes.crosses_axis {
        let text = format!(
            "{name}: {points_at}: the profile crosses the axis: where its radius is negative it is drawn on the other side, \
             with its front turned inwards"
        );
        loader.builder.warn(text);
    }
    if notes.crosses_itself {
        let text = format!(
            "{name}: {points_at}: the profile crosses itself: it is drawn as it is, and of glass each part is a boundary"
        );
        loader.builder.warn(text);
    }
    Ok(ExactShape::revolution(profile))
}

/// Radius and height of each point.
fn points(doc: &Document, found: &Value, at: &str) -> Result<Vec<[f64; 2]>> {
    let fix = "It must be a list of points, each a list of two numbers: radius and height in metres.";
    let Some(list) = found.get("points") else {
        return Err(doc.error(at, "a surface of revolution without points", fix));
    };
    let Some(list) = list.as_array() else { return Err(doc.bad(at, "is not a list", fix)) };
    let mut points = Vec::with_capacity(list.len());
    for (i, point) in list.iter().enumerate() {
        let number = |k: usize| point.get(k).and_then(Value::as_f64);
        match (number(0), number(1), point.as_array().map(Vec::len)) {
            (Some(r), Some(y), Some(2)) => points.push([r, y]),
            _ => return Err(doc.bad(&format!("{at}/{i}"), "is not a point", fix)),
        }
    }
    Ok(points)
}

/// Says why `count` points, found at `at`, make no profile.
fn refuse(doc: &Document, error: ProfileError, at: &str, count: usize) -> super::LoadError {
    let points = if count == 1 { String::from("1 point") } else { format!("{count} points") };
    match error {
        ProfileError::BezierCount => {
            let fix = "Segments of four points share their ends: there must be 4, 7, 10 ... (3k + 1) of them.";
            doc.error(at, format!("{points} make no Bezier segments"), fix)
        }
        ProfileError::BSplineCount => {
            doc.error(at, format!("{points} make no cubic B-spline"), "There must be at least 4.")
        }
        ProfileError::OutOfRange(i) => {
            doc.bad(&format!("{at}/{i}"), "is out of range", "Radius and height must be finite and at most 1e18 m.")
        }
        ProfileError::OnePoint => doc.error(at, "all points are the same", "A profile needs a length."),
        ProfileError::OnAxis => doc.error(
            at,
            "all points lie on the axis",
            "The first number of a point is the radius, the second the height.",
        ),
    }
}
