//! Which textures a material reads, and whether it needs tangents, by the JSON alone: for estimates, which may tell too
//! much and must not tell too little.

use super::outline::{Material, Read};
use crate::texture::Channels;
use serde_json::Value;

/// A texture of an extension, with the factor that is 0 where it is not read (and by default).
struct Slot(&'static str, &'static str, &'static str, Channels);

const COAT: &str = "KHR_materials_clearcoat";
const SHEEN: &str = "KHR_materials_sheen";
const ANISOTROPY: &str = "KHR_materials_anisotropy";
const IRIDESCENCE: &str = "KHR_materials_iridescence";
const THROUGH: &str = "KHR_materials_diffuse_transmission";
const GLOSSY: &str = "KHR_materials_pbrSpecularGlossiness";

const SLOTS: [Slot; 11] = [
    Slot(COAT, "clearcoatTexture", "clearcoatFactor", Channels::R),
    Slot(COAT, "clearcoatRoughnessTexture", "clearcoatFactor", Channels::G),
    Slot(COAT, "clearcoatNormalTexture", "clearcoatFactor", Channels::RGB),
    Slot(SHEEN, "sheenColorTexture", "sheenColorFactor", Channels::RGB),
    Slot(SHEEN, "sheenRoughnessTexture", "sheenColorFactor", Channels::A),
    Slot(ANISOTROPY, "anisotropyTexture", "anisotropyStrength", Channels::RGB),
    Slot(IRIDESCENCE, "iridescenceTexture", "iridescenceFactor", Channels::R),
    Slot(IRIDESCENCE, "iridescenceThicknessTexture", "iridescenceFactor", Channels::G),
    Slot("KHR_materials_transmission", "transmissionTexture", "transmissionFactor", Channels::R),
    Slot(THROUGH, "diffuseTransmissionTexture", "diffuseTransmissionFactor", Channels::A),
    Slot(THROUGH, "diffuseTransmissionColorTexture", "diffuseTransmissionFactor", Channels::RGB),
];

/// The textures that a material's picture depends on, as `material` reads them, and their channels.
pub(super) fn reads(material: &Material) -> Vec<(Read, Channels)> {
    let pbr = &material.pbr_metallic_roughness;
    let is_opaque = material.alpha_mode.as_deref().is_none_or(|mode| mode == "OPAQUE");
    let base = if is_opaque { Channels::RGB } else { Channels::RGB | Channels::A };
    let lit = material.extensions.unlit.is_none();
    let glows = material.emissive_factor.iter().any(|&f| f > 0.0);
    let specular = &material.extensions.specular;
    let glossy = material.extensions.others.get(GLOSSY);
    let of_glossy = |key: &str| glossy.and_then(|g| read(g, key));
    let slots = [
        (pbr.base_color_texture, base, glossy.is_none()),
        (pbr.metallic_roughness_texture, Channels::G | Channels::B, lit && glossy.is_none()),
        (of_glossy("diffuseTexture"), base, true),
        (of_glossy("specularGlossinessTexture"), Channels::RGB | Channels::A, lit),
        (material.normal_texture, Channels::RGB, lit),
        (material.emissive_texture, Channels::RGB, lit && glows),
        (specular.specular_texture, Channels::A, lit),
        (specular.specular_color_texture, Channels::RGB, lit),
    ];
    let slots = slots.into_iter().filter_map(|(read, channels, is_read)| Some((read.filter(|_| is_read)?, channels)));
    let of_extensions = SLOTS.iter().filter(|_| lit).filter_map(|&Slot(extension, key, factor, channels)| {
        let found = material.extensions.others.get(extension).filter(|found| is_on(found, factor))?;
        Some((read(found, key)?, channels))
    });
    slots.chain(of_extensions).collect()
}

/// Whether meshes with this material need tangents.
pub(super) fn needs_tangents(material: &Material) -> bool {
    let on =
        |extension: &str, factor: &str| material.extensions.others.get(extension).filter(|found| is_on(found, factor));
    let is_coat_mapped = on(COAT, "clearcoatFactor").is_some_and(|coat| coat.get("clearcoatNormalTexture").is_some());
    let is_disney = is_on(&material.extras, "prt_disney") || material.extras["prt_disney"] == true;
    let is_stretched =
        on(ANISOTROPY, "anisotropyStrength").is_some() || is_disney && is_on(&material.extras, "prt_anisotropic");
    material.extensions.unlit.is_none() && (material.normal_texture.is_some() || is_coat_mapped || is_stretched)
}

/// Whether the factor `key` of an extension is not 0.
fn is_on(extension: &Value, key: &str) -> bool {
    let above = |v: &Value| v.as_f64().is_some_and(|v| v > 0.0);
    extension.get(key).is_some_and(|value| match value {
        Value::Array(list) => list.iter().any(above),
        other => above(other),
    })
}

/// The reference to a texture that an extension has as `key`.
fn read(extension: &Value, key: &str) -> Option<Read> {
    let natural = |v: &Value| v.as_u64().and_then(|v| usize::try_from(v).ok());
    let info = extension.get(key)?;
    let tex_coord = info.get("texCoord").and_then(natural).and_then(|set| u32::try_from(set).ok()).unwrap_or(0);
    Some(Read { index: info.get("index").and_then(natural)?, tex_coord })
}
