//! Which extensions are read, and what is said of the others: an error if the file requires one, else a warning.

use super::locate::shorten;
use super::{Document, Loader, Result};
use std::sync::PoisonError;
use std::sync::atomic::Ordering::Relaxed;

/// Read.
const READ: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
    "PRT_shape",
];

/// Without effect on a picture of the file as it is written.
const WITHOUT_EFFECT: &[&str] = &[
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_structural_metadata",
    "GODOT_single_root",
    "KHR_audio_emitter",
    "KHR_implicit_shapes",
    "KHR_interactivity",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_physics_rigid_bodies",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MSFT_lod",
];

/// Images in other formats, an alternative to the `source` of a texture: see `texture`.
pub(super) const IMAGE_FORMATS: &[&str] = &["EXT_texture_avif", "KHR_texture_basisu", "MSFT_texture_dds"];

/// Compressed vertices, an alternative to the data of the accessors unless the file requires them.
const COMPRESSIONS: &[&str] = &["EXT_meshopt_compression", "KHR_draco_mesh_compression", "KHR_meshopt_compression"];

/// What a picture lacks without an extension that is known and not read.
const LOSSES: &[(&str, &str)] = &[
    ("EXT_lights_ies", "lights shine as if they had no profile"),
    ("EXT_lights_image_based", "its environment gives no light"),
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

/// Notes the extensions that a reached object carries and that are not read, for [`warn_ignored`]; `names` are the
/// extensions at `pointer`, `except` those that the caller looks after.
pub(super) fn note_carried<'a>(
    doc: &Document,
    names: impl Iterator<Item = &'a String>,
    pointer: &str,
    except: &[&str],
) {
    if doc.is_noted.load(Relaxed) {
        return;
    }
    for name in names.filter(|n| is_ignored(n) && !except.contains(&n.as_str())) {
        let mut ignored = doc.ignored.lock().unwrap_or_else(PoisonError::into_inner);
        ignored.entry(name.clone()).and_modify(|(_, n)| *n += 1).or_insert_with(|| (pointer.to_owned(), 1));
    }
}

/// Warns once of each extension that is used and not read: of those that a reached object carries with their first
/// place, and of those that only the file's list names.
pub(super) fn warn_ignored(loader: &mut Loader) {
    let doc = loader.doc;
    doc.is_noted.store(true, Relaxed);
    let ignored = doc.ignored.lock().unwrap_or_else(PoisonError::into_inner);
    for (name, (first, count)) in ignored.iter() {
        let more = if *count > 1 { format!(", first of {count} places") } else { String::new() };
        let loss = LOSSES.iter().find(|(n, _)| n == name).map(|(_, loss)| format!(": {loss}")).unwrap_or_default();
        loader.builder.lose(format!("{first}: the extension {} is not read{more}{loss}", shorten(name)));
    }
    for name in &doc.root.extensions_used {
        let is_alternative = IMAGE_FORMATS.contains(&name.as_str()) || COMPRESSIONS.contains(&name.as_str());
        if is_ignored(name) && !ignored.contains_key(name) && !is_alternative {
            loader.builder.lose(format!("the extension {} is used somewhere and not read", shorten(name)));
        }
    }
}

fn is_ignored(name: &str) -> bool {
    !READ.contains(&name) && !WITHOUT_EFFECT.contains(&name)
}
