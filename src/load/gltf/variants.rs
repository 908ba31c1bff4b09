//! `KHR_materials_variants`: a file's named sets of materials, of which one may be chosen.

use super::locate::shorten;
use super::{Document, Loader, Result};
use gltf::json::Index;
use gltf::json::mesh::Primitive;
use serde_json::Value;

const NAME: &str = "KHR_materials_variants";

/// The place of the variant called `wanted`; of several of one name the first.
pub(super) fn choose(doc: &Document, wanted: Option<&str>) -> Result<Option<usize>> {
    let Some(wanted) = wanted else { return Ok(None) };
    let found = doc.root.extensions.as_ref().and_then(|e| e.others.get(NAME));
    let list = found.and_then(|e| e.get("variants")).and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let name = |variant: &Value| variant.get("name").and_then(Value::as_str).unwrap_or_default().to_owned();
    if let Some(place) = list.iter().position(|variant| name(variant) == wanted) {
        return Ok(Some(place));
    }
    let names: Vec<String> = list.iter().map(|variant| format!("\"{}\"", shorten(&name(variant)))).collect();
    let (at, fix) = match names.is_empty() {
        true => (String::new(), "The file has no variants: leave --variant out to see its own materials.".to_owned()),
        false => (format!("/extensions/{NAME}/variants"), format!("Allowed: {}.", names.join(", "))),
    };
    Err(doc.error(at, format!("there is no variant \"{}\"", shorten(wanted)), fix))
}

/// The material of the primitive at `at` in the chosen variant, and where that is said: its own one where the variant
/// says nothing.
pub(super) fn material(
    loader: &Loader,
    primitive: &Primitive,
    at: &str,
) -> Result<(Option<Index<gltf::json::Material>>, String)> {
    let own = (primitive.material, format!("{at}/material"));
    let found = primitive.extensions.as_ref().and_then(|e| e.others.get(NAME));
    let (Some(variant), Some(found)) = (loader.variant, found) else { return Ok(own) };
    let mappings = found.get("mappings").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let is_meant = |mapping: &&Value| {
        let variants = mapping.get("variants").and_then(Value::as_array);
        variants.is_some_and(|list| list.iter().any(|v| v.as_u64() == Some(variant as u64)))
    };
    let Some(place) = mappings.iter().position(|mapping| is_meant(&mapping)) else { return Ok(own) };
    let at = format!("{at}/extensions/{NAME}/mappings/{place}/material");
    let index = mappings.get(place).and_then(|m| m.get("material")).and_then(Value::as_u64);
    match index.and_then(|i| u32::try_from(i).ok()) {
        Some(index) => Ok((Some(Index::new(index)), at)),
        None => Err(loader.doc.bad(&at, "is not an index into materials", "A mapping has the index of a material.")),
    }
}
