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
use std::sync::Arc;

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

/// Decodes the images that textures need, but for those that an earlier moment needed, and adds them to the scene in the
/// order of their ids.
pub(super) fn decode_all(loader: &mut Loader) -> Result<()> {
    let doc = loader.doc;
    let used = loader.builder.channels();
    let wanted: Vec<(usize, Channels)> = loader
        .textures
        .images
        .iter()
        .enumerate()
        .map(|(i, &k)| (k, used.get(i).copied().unwrap_or_default()))
        .collect();
    let is_known = |&(i, used): &(usize, Channels)| loader.kept.images.get(&i).is_some_and(|(kept, ..)| *kept == used);
    let missing: Vec<(Encoded, Channels)> = (wanted.iter().filter(|each| !is_known(each)))
        .map(|&(i, used)| Ok((find(doc, i)?, used)))
        .collect::<Result<_>>()?;
    // An error is made from its kind afterwards: a document is not shared between threads.
    let decoded: Vec<_> = missing.par_iter().map(|(encoded, used)| decode_one(encoded, *used)).collect();
    for ((encoded, used), result) in missing.iter().zip(decoded) {
        let (mut image, format) = result.map_err(|(problem, fix)| doc.error(&encoded.pointer, problem, fix))?;
        let name = doc.root.images.get(encoded.index).and_then(|i| i.name.as_ref());
        image.name = name_or(name, "images", encoded.index);
        let said = Format::from_media_type(&encoded.media).filter(|said| *said != format);
        let note =
            said.map(|said| format!("/images/{}: said to be {said} but is {format}: read as {format}", encoded.index));
        loader.kept.images.insert(encoded.index, (*used, Arc::new(image), note));
    }
    for (i, _) in wanted {
        let known = loader.kept.images.get(&i).map(|(_, image, note)| (Arc::clone(image), note.clone()));
        let Some((image, note)) = known else { return Err(doc.error(format!("/images/{i}"), "no such image", "")) };
        note.into_iter().for_each(|note| loader.builder.warn(note));
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
