//! Which extensions are read, which may be ignored, and which are refused by name.

use super::locate::shorten;
use super::{Document, Loader, Result};

/// Read.
const READ: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_specular",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
];

/// Without effect on a picture of the file as it is written.
const WITHOUT_EFFECT: &[&str] = &[
    "KHR_animation_pointer",
    "KHR_interactivity",
    "KHR_materials_variants",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_xmp",
    "KHR_xmp_json_ld",
];

/// Refuses what the file requires and we do not read.
pub(super) fn check_required(doc: &Document) -> Result<()> {
    for (i, name) in doc.root.extensions_required.iter().enumerate() {
        if !READ.contains(&name.as_str()) && !WITHOUT_EFFECT.contains(&name.as_str()) {
            let fix = format!("Export without it. Extensions that are read: {}.", READ.join(", "));
            let problem = format!("the required extension {} is not built yet", shorten(name));
            return Err(doc.error(format!("/extensionsRequired/{i}"), problem, fix));
        }
    }
    Ok(())
}

/// Warns of extensions of which we do not know whether they change the picture.
pub(super) fn warn_unknown(loader: &mut Loader) {
    for name in &loader.doc.root.extensions_used {
        if !refused(name) && !READ.contains(&name.as_str()) && !WITHOUT_EFFECT.contains(&name.as_str()) {
            loader.builder.warn(format!("the extension {} is not known: ignored", shorten(name)));
        }
    }
}

/// Refuses an object that carries an extension of the kind that changes the picture; `names` are the extensions
/// at `pointer` that were not read, `except` those that the caller looks after.
pub(super) fn check_carried<'a>(
    doc: &Document,
    names: impl Iterator<Item = &'a String>,
    pointer: &str,
    except: &[&str],
) -> Result<()> {
    for name in names {
        if refused(name) && !WITHOUT_EFFECT.contains(&name.as_str()) && !except.contains(&name.as_str()) {
            let fix = "It changes the picture, so it is not left out silently. Export without it.";
            let problem = format!("the extension {} is not built yet", shorten(name));
            return Err(doc.error(format!("{pointer}/extensions/{name}"), problem, fix));
        }
    }
    Ok(())
}

/// Khronos' own extensions change the picture unless listed otherwise, as do ours and a few of several vendors.
fn refused(name: &str) -> bool {
    let prefix = ["KHR_", "PRT_", "EXT_lights_", "EXT_mesh_gpu_instancing"];
    !READ.contains(&name) && prefix.iter().any(|p| name.starts_with(p))
}
