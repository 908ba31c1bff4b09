//! Images: bytes from a buffer view, a data URI or a file; decoded in parallel, each once.

use super::document::Document;
use super::uri::Source;
use super::{Loader, Result, name_or};
use crate::image::decode::{self, Format, Pixels};
use crate::load::folders::read_file;
use crate::texture::{Channels, Image, Texels};
use rayon::prelude::*;
use std::borrow::Cow;
use std::path::PathBuf;

/// An image that is found but not yet decoded.
struct Encoded<'d> {
    index: usize,
    bytes: Bytes<'d>,
    /// `mimeType`, or that of the data URI; empty if there is none.
    media: String,
    /// Where the bytes came from, for messages.
    pointer: String,
}

enum Bytes<'d> {
    Here(Cow<'d, [u8]>),
    File(PathBuf),
}

/// Decodes the images that textures need and adds them to the scene in the order of their ids.
pub(super) fn decode_all(loader: &mut Loader) -> Result<()> {
    let doc = loader.doc;
    let found: Vec<Encoded> = loader.textures.images.iter().map(|&i| find(doc, i)).collect::<Result<_>>()?;
    let used = loader.builder.channels();
    // An error is made from its kind afterwards: a document is not shared between threads.
    let decode = |(i, encoded)| decode_one(encoded, used.get(i).copied().unwrap_or_default());
    let decoded: Vec<_> = found.par_iter().enumerate().map(decode).collect();
    for (encoded, result) in found.iter().zip(decoded) {
        let (mut image, format) = result.map_err(|(problem, fix)| doc.error(&encoded.pointer, problem, fix))?;
        let name = doc.root.images.get(encoded.index).and_then(|i| i.name.as_ref());
        image.name = name_or(name, "images", encoded.index);
        if let Some(said) = Format::from_media_type(&encoded.media)
            && said != format
        {
            let text = format!("/images/{}: said to be {said} but is {format}: read as {format}", encoded.index);
            loader.builder.warn(text);
        }
        loader.builder.add_image(image);
    }
    Ok(())
}

/// Where the bytes of an image are; the media type is checked.
fn find(doc: &Document, index: usize) -> Result<Encoded<'_>> {
    let at = format!("/images/{index}");
    let Some(image) = doc.root.images.get(index) else {
        return Err(doc.error(at, "no such image", ""));
    };
    let mut media = image.mime_type.as_ref().map(|m| m.0.clone()).unwrap_or_default();
    let mut media_at = format!("{at}/mimeType");
    let (bytes, pointer) = match (image.buffer_view, &image.uri) {
        (Some(view), None) => {
            let pointer = format!("{at}/bufferView");
            let (bytes, _) = doc.view(view, &pointer)?;
            (Bytes::Here(bytes), pointer)
        }
        (None, Some(uri)) => {
            let pointer = format!("{at}/uri");
            let bytes = match doc.resolve(&pointer, uri)? {
                Source::File(path) => Bytes::File(path),
                Source::Data(bytes, kind) => {
                    if media.is_empty() {
                        (media, media_at) = (kind, pointer.clone());
                    }
                    Bytes::Here(Cow::Owned(bytes))
                }
            };
            (bytes, pointer)
        }
        (view, _) => {
            let problem = if view.is_some() { "has both uri and bufferView" } else { "has no uri and no bufferView" };
            return Err(doc.error(at, problem, "An image has exactly one of the two."));
        }
    };
    // Other media types of data URIs (application/octet-stream) are common and say nothing.
    if media.starts_with("image/") && Format::from_media_type(&media).is_none() {
        let fix = "Allowed: image/png, image/jpeg, image/webp.";
        return Err(doc.error(media_at, format!("{media} is not built yet"), fix));
    }
    Ok(Encoded { index, bytes, media, pointer })
}

/// The image without those channels that nothing uses, and what the bytes turned out to be; or the problem and its remedy.
fn decode_one(encoded: &Encoded, used: Channels) -> std::result::Result<(Image, Format), (String, String)> {
    let file;
    let (bytes, source): (&[u8], String) = match &encoded.bytes {
        Bytes::Here(bytes) => (bytes, String::new()),
        Bytes::File(path) => {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            file = read_file(path).map_err(|why| (format!("{name}: {why}"), String::new()))?;
            (&file, format!("{name}: "))
        }
    };
    let (decoded, format) = decode::rgba(bytes).map_err(|e| (format!("{source}{}", e.problem), e.fix.to_owned()))?;
    let texels = match decoded.pixels {
        Pixels::Rgba8(texels) => Texels::Rgba8(texels),
        Pixels::Rgba16(texels) => Texels::Rgba16(texels),
    };
    let image =
        Image { width: decoded.width, height: decoded.height, texels: texels.narrowed(used), name: String::new() };
    Ok((image, format))
}
