//! Extensions and extras that the `gltf` crate leaves as JSON: their numbers and textures, with their places.

use super::super::texture_info::Info;
use super::Reader;
use crate::load::gltf::Result;
use crate::texture::TextureRef;
use serde_json::{Map, Value};

/// A JSON object below a material.
pub(super) struct Object<'a> {
    /// Its members.
    pub members: &'a Map<String, Value>,
    /// Where it is below the material: `extensions/KHR_materials_sheen`.
    place: String,
}

impl<'a> Object<'a> {
    pub fn new(members: &'a Map<String, Value>, place: String) -> Self {
        Self { members, place }
    }

    /// Where its member `key` is below the material.
    pub fn place(&self, key: &str) -> String {
        format!("{}/{key}", self.place)
    }
}

impl Reader<'_, '_> {
    /// The extension `name` of a material, if it has that.
    pub(super) fn extension<'a>(&self, found: &'a gltf::json::Material, name: &str) -> Result<Option<Object<'a>>> {
        let Some(value) = found.extensions.as_ref().and_then(|e| e.others.get(name)) else { return Ok(None) };
        let place = format!("extensions/{name}");
        match value.as_object() {
            Some(members) => Ok(Some(Object::new(members, place))),
            None => Err(self.bad(&place, "is not an object", "An extension is an object: {} has all its defaults.")),
        }
    }

    /// The number `key`, `absent` if it is not there. It may be infinite where it is beyond f32.
    pub(super) fn number(&self, object: &Object, key: &str, absent: f32) -> Result<f32> {
        match object.members.get(key) {
            None => Ok(absent),
            Some(value) => value.as_f64().map(|v| v as f32).ok_or_else(|| {
                let fix = format!("It is a number; without it, {absent} counts.");
                self.bad(&object.place(key), "is not a number", &fix)
            }),
        }
    }

    /// The list of `N` numbers `key`, `absent` if it is not there.
    pub(super) fn numbers<const N: usize>(&self, object: &Object, key: &str, absent: [f32; N]) -> Result<[f32; N]> {
        let Some(value) = object.members.get(key) else { return Ok(absent) };
        let list: Option<Vec<f32>> =
            value.as_array().and_then(|list| list.iter().map(|v| v.as_f64().map(|v| v as f32)).collect());
        list.and_then(|list| <[f32; N]>::try_from(list).ok()).ok_or_else(|| {
            let fix = format!("It is a list of {N} numbers; without it, {absent:?} counts.");
            self.bad(&object.place(key), "is not allowed", &fix)
        })
    }

    /// A factor in [0, 1].
    pub(super) fn share(&self, object: &Object, key: &str, absent: f32) -> Result<f32> {
        self.unit(&object.place(key), [self.number(object, key, absent)?]).map(|[v]| v)
    }

    /// Factors in [0, 1].
    pub(super) fn shares<const N: usize>(&self, object: &Object, key: &str, absent: [f32; N]) -> Result<[f32; N]> {
        self.unit(&object.place(key), self.numbers(object, key, absent)?)
    }

    /// The texture `key`; `why_not` is why it need not be read at all.
    pub(super) fn texture_of(
        &mut self,
        object: &Object,
        key: &str,
        why_not: Option<&str>,
    ) -> Result<Option<TextureRef>> {
        let Some(value) = object.members.get(key) else { return Ok(None) };
        let place = object.place(key);
        let info = match why_not {
            // Not looked at, so that nothing can be wrong with it.
            Some(why) => {
                self.skip(&place, why);
                return Ok(None);
            }
            None => Info::from_json(self.loader.doc, value, &format!("{}/{place}", self.at))?,
        };
        self.texture(&place, info)
    }

    /// An error about the value at `place`.
    pub(super) fn bad(&self, place: &str, why: &str, fix: &str) -> crate::error::LoadError {
        self.loader.doc.bad(&format!("{}/{place}", self.at), why, fix)
    }
}
