//! Textures: an image with its sampler.

use super::locate::shorten;
use super::{Loader, Result, extensions};
use crate::scene::{ImageId, TextureId};
use crate::texture::{Filter, Texture, Wrap};
use gltf::json::Index;
use gltf::json::texture::{MagFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked;
use serde_json::Value;
use std::collections::BTreeMap;

/// How the `gltf` crate says that a texture has no `source`.
const NO_SOURCE: usize = u32::MAX as usize;

/// Textures read so far, and the images that they need.
#[derive(Debug, Default)]
pub(super) struct Textures {
    read: BTreeMap<usize, Option<TextureId>>,
    /// glTF images in the order of our ids.
    pub images: Vec<usize>,
}

impl Textures {
    /// Whether a texture that was read needs the image.
    pub fn uses_image(&self, image: usize) -> bool {
        self.images.contains(&image)
    }

    /// Our id of a glTF image, which will be decoded later.
    fn image(&mut self, image: usize) -> ImageId {
        let place = self.images.iter().position(|&i| i == image).unwrap_or_else(|| {
            self.images.push(image);
            self.images.len() - 1
        });
        ImageId(place as u32)
    }
}

/// The texture at `index`, read once; `pointer` is where the index was found. `None`, with a warning, if it has no image
/// of a kind that is read.
pub(super) fn read(loader: &mut Loader, index: Index<gltf::json::Texture>, pointer: &str) -> Result<Option<TextureId>> {
    if let Some(&done) = loader.textures.read.get(&index.value()) {
        return Ok(done);
    }
    let doc = loader.doc;
    let texture = doc.item(&doc.root.textures, index, pointer, "textures")?;
    let at = format!("/textures/{}", index.value());
    let id = match source(loader, texture, &at)? {
        None => None,
        Some(image) => {
            let (wrap_u, wrap_v, filter) = match texture.sampler {
                None => (Wrap::Repeat, Wrap::Repeat, Filter::Bilinear),
                Some(index) => sampler(loader, index, &format!("{at}/sampler"))?,
            };
            let image = loader.textures.image(image);
            Some(loader.builder.add_texture(Texture { image, wrap_u, wrap_v, filter }))
        }
    };
    loader.textures.read.insert(index.value(), id);
    Ok(id)
}

/// The image of a texture: its WebP one if it has that, else its `source`.
fn source(loader: &mut Loader, texture: &gltf::json::Texture, at: &str) -> Result<Option<usize>> {
    const WEBP: &str = "EXT_texture_webp";
    let doc = loader.doc;
    let others = texture.extensions.as_ref().map(|e| &e.others);
    if let Some(webp) = others.and_then(|o| o.get(WEBP)) {
        let at = format!("{at}/extensions/{WEBP}/source");
        let index = webp.get("source").and_then(Value::as_u64).and_then(|i| u32::try_from(i).ok());
        let Some(index) = index else {
            return Err(doc.bad(&at, "is not an index into images", "The extension has the index of a WebP image."));
        };
        doc.item(&doc.root.images, Index::<gltf::json::Image>::new(index), &at, "images")?;
        return Ok(Some(index as usize));
    }
    let names = others.into_iter().flat_map(|o| o.keys());
    if texture.source.value() != NO_SOURCE {
        // Images in other formats are an alternative to the `source` that is there: nothing is lost.
        extensions::note_carried(doc, names, at, extensions::IMAGE_FORMATS);
        doc.item(&doc.root.images, texture.source, &format!("{at}/source"), "images")?;
        return Ok(Some(texture.source.value()));
    }
    let names: Vec<String> = names.map(|n| shorten(n)).collect();
    let but = if names.is_empty() { String::new() } else { format!(" but {}, which is not read", names.join(", ")) };
    loader.builder.lose(format!("{at} has no source{but}: materials are drawn without this texture"));
    Ok(None)
}

/// Wrapping and magnification; level 0 is read alone or, by `--texture-lod`, the levels to
/// either side, so the minification filter does not matter.
fn sampler(loader: &Loader, index: Index<Sampler>, pointer: &str) -> Result<(Wrap, Wrap, Filter)> {
    let doc = loader.doc;
    let sampler = doc.item(&doc.root.samplers, index, pointer, "samplers")?;
    let at = format!("/samplers/{}", index.value());
    let wrap = |mode: Checked<WrappingMode>, key: &str| match mode {
        Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
        Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::MirroredRepeat),
        Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::ClampToEdge),
        Checked::Invalid => {
            let fix = "Allowed: 10497 (repeat), 33648 (mirrored repeat), 33071 (clamp to edge).";
            Err(doc.bad(&format!("{at}/{key}"), "is not a wrapping mode", fix))
        }
    };
    let filter = match sampler.mag_filter {
        Some(Checked::Valid(MagFilter::Nearest)) => Filter::Nearest,
        None | Some(Checked::Valid(MagFilter::Linear)) => Filter::Bilinear,
        Some(Checked::Invalid) => {
            let fix = "Allowed: 9728 (nearest), 9729 (linear).";
            return Err(doc.bad(&format!("{at}/magFilter"), "is not a magnification filter", fix));
        }
    };
    Ok((wrap(sampler.wrap_s, "wrapS")?, wrap(sampler.wrap_t, "wrapT")?, filter))
}
