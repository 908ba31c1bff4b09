//! `prt_shutter` in the extras of a camera or its node: how long the shutter is open, as a share of a frame.

use super::check::children;
use super::{Document, Result};
use serde_json::Value;

const KEY: &str = "prt_shutter";

/// The share that the cameras below `roots` ask for, 0 without any; and a warning where they differ.
///
/// # Errors
/// It is no share.
pub(super) fn share(doc: &Document, roots: &[usize]) -> Result<(f64, Option<String>)> {
    let mut stack: Vec<usize> = roots.iter().rev().copied().collect();
    let mut found: Option<(f64, String)> = None;
    let mut warning = None;
    while let Some(i) = stack.pop() {
        let Some(node) = doc.root.nodes.get(i) else { continue };
        stack.extend(children(node).iter().rev().map(|child| child.value()));
        let Some(index) = node.camera else { continue };
        let of_camera = doc.root.cameras.get(index.value()).and_then(|camera| camera.extras.as_ref());
        let places =
            [(node.extras.as_ref(), format!("/nodes/{i}")), (of_camera, format!("/cameras/{}", index.value()))];
        for (extras, at) in places {
            // Extras may be anything at all; what is no object has no keys.
            let Some(raw) = extras.filter(|raw| raw.get().contains(KEY)) else { continue };
            let Ok(Value::Object(members)) = serde_json::from_str(raw.get()) else { continue };
            let Some(value) = members.get(KEY) else { continue };
            let at = format!("{at}/extras/{KEY}");
            let Some(share) = value.as_f64().filter(|share| (0.0..=1.0).contains(share)) else {
                let fix = "It is the share of a frame that the shutter is open, from 0 to 1.";
                return Err(doc.bad(&at, "is out of range", fix));
            };
            match &found {
                None => found = Some((share, at)),
                Some((first, first_at)) if *first != share && warning.is_none() => {
                    warning = Some(format!(
                        "{at} = {share} and {first_at} = {first} differ: {first} is taken for all cameras; --shutter \
                         says it for the file"
                    ));
                }
                Some(_) => {}
            }
            // The node's own counts before the camera's.
            break;
        }
    }
    Ok((found.map_or(0.0, |(share, _)| share), warning))
}
