//! How a material refers to a texture: `texCoord` and `KHR_texture_transform`.

use super::{Document, Loader, Result, extensions};
use crate::texture::{TextureRef, UvTransform};
use gltf::json::Index;
use gltf::json::material::NormalTexture;
use serde_json::{Map, Value};

const TRANSFORM: &str = "KHR_texture_transform";

/// What all kinds of references have.
#[derive(Clone, Copy)]
pub(super) struct Info<'a> {
    index: Index<gltf::json::Texture>,
    tex_coord: u32,
    others: Option<&'a Map<String, Value>>,
}

impl<'a> From<&'a gltf::json::texture::Info> for Info<'a> {
    fn from(info: &'a gltf::json::texture::Info) -> Self {
        let others = info.extensions.as_ref().map(|e| &e.others);
        Self { index: info.index, tex_coord: info.tex_coord, others }
    }
}

impl<'a> From<&'a NormalTexture> for Info<'a> {
    fn from(info: &'a NormalTexture) -> Self {
        let others = info.extensions.as_ref().map(|e| &e.others);
        Self { index: info.index, tex_coord: info.tex_coord, others }
    }
}

impl<'a> Info<'a> {
    /// The reference that `value` is, which lies at `at`: of an extension that the `gltf` crate leaves as JSON.
    pub fn from_json(doc: &Document, value: &'a Value, at: &str) -> Result<Self> {
        let natural = |key: &str| value.get(key).map(|v| v.as_u64().and_then(|v| u32::try_from(v).ok()));
        let bad = |key: &str, fix: &str| Err(doc.bad(&format!("{at}/{key}"), "is not allowed", fix));
        let index = match natural("index") {
            Some(Some(index)) => Index::new(index),
            _ => return bad("index", "A reference to a texture has its index: 0, 1, 2, ..."),
        };
        let tex_coord = match natural("texCoord") {
            None => 0,
            Some(Some(set)) => set,
            Some(None) => return bad("texCoord", "It is the number of a set of texture coordinates: 0, 1, 2, ..."),
        };
        Ok(Self { index, tex_coord, others: value.get("extensions").and_then(Value::as_object) })
    }
}

/// The reference at `at`, with the file's `texCoord` as its set; `None` if the texture has no image that is read.
pub(super) fn read(loader: &mut Loader, info: Info, at: &str) -> Result<Option<TextureRef>> {
    if let Some(others) = info.others {
        extensions::note_carried(loader.doc, others.keys(), at, &[]);
    }
    let (mut uv_set, mut transform) = (info.tex_coord, None);
    if let Some(found) = info.others.and_then(|o| o.get(TRANSFORM)) {
        let reader = Reader { doc: loader.doc, found, at: format!("{at}/extensions/{TRANSFORM}") };
        uv_set = reader.tex_coord()?.unwrap_or(uv_set);
        transform = reader.transform()?;
    }
    let texture = super::texture::read(loader, info.index, &format!("{at}/index"))?;
    Ok(texture.map(|texture| TextureRef { texture, uv_set, transform }))
}

/// Reads a `KHR_texture_transform`.
struct Reader<'a> {
    doc: &'a Document,
    found: &'a Value,
    at: String,
}

impl Reader<'_> {
    /// The set that replaces the texture info's.
    fn tex_coord(&self) -> Result<Option<u32>> {
        let Some(value) = self.found.get("texCoord") else { return Ok(None) };
        match value.as_u64().and_then(|v| u32::try_from(v).ok()) {
            Some(set) => Ok(Some(set)),
            None => Err(self.bad("texCoord", "It is the number of a set of texture coordinates: 0, 1, 2, ...")),
        }
    }

    /// Translation x rotation x scale; `None` if that changes nothing.
    ///
    /// Angles turn coordinates counter-clockwise as they are seen: u to the right, v *down*. Hence the signs, which are
    /// the opposite of those in the extension's sample code and the same as in the viewers (and as
    /// TextureTransformTest asks).
    fn transform(&self) -> Result<Option<UvTransform>> {
        let [ou, ov] = self.pair("offset", 0.0)?;
        let [su, sv] = self.pair("scale", 1.0)?;
        let rotation = match self.found.get("rotation") {
            None => 0.0,
            Some(value) => finite(value).ok_or_else(|| self.bad("rotation", "It is a finite number, in radians."))?,
        };
        let (sin, cos) = rotation.sin_cos();
        let rows = [[cos * su, sin * sv, ou], [-sin * su, cos * sv, ov]];
        let m = rows.map(|row| row.map(|v| v as f32));
        if !m.as_flattened().iter().all(|v| v.is_finite()) {
            let fix = "Its numbers must be finite as 32-bit floats.";
            return Err(self.doc.bad(&self.at, "is out of range", fix));
        }
        let changes = m != [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        Ok(changes.then_some(UvTransform { m }))
    }

    fn pair(&self, key: &str, absent: f64) -> Result<[f64; 2]> {
        let Some(value) = self.found.get(key) else { return Ok([absent; 2]) };
        let numbers: Option<Vec<f64>> = value.as_array().and_then(|list| list.iter().map(finite).collect());
        let pair = numbers.and_then(|n| <[f64; 2]>::try_from(n).ok());
        pair.ok_or_else(|| self.bad(key, "It is a list of two finite numbers."))
    }

    fn bad(&self, key: &str, fix: &str) -> crate::error::LoadError {
        self.doc.bad(&format!("{}/{key}", self.at), "is not allowed", fix)
    }
}

fn finite(value: &Value) -> Option<f64> {
    value.as_f64().filter(|v| v.is_finite())
}
