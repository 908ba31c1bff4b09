//! PNG, JPEG and WebP to RGBA of 8 or 16 bits, from bytes of unknown origin: sizes are bounded before anything is
//! allocated, and whatever is wrong comes back as an error.
//!
//! Values stay as they are encoded: colour profiles (ICC, gAMA, cICP) and the orientation in Exif are ignored, as glTF
//! asks. CMYK is converted by inversion, without a profile.

use image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::fmt;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Larger pictures are refused: pixels along one side.
pub const MAX_SIDE: u32 = 32_768;
/// Larger pictures are refused: pixels, 1 GiB decoded at 8 bits a channel.
pub const MAX_PIXELS: u64 = 1 << 28;
/// Deflate cannot pack more than 1032 bytes into one (258 bytes from 2 bits, RFC 1951), so a PNG that promises more
/// is cut short or a bomb.
const MAX_DEFLATE_RATIO: u64 = 1032;

/// Decoded pixels, row 0 at the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Decoded {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `[height * width]`, as encoded in the file.
    pub pixels: Pixels,
}

/// R G B A of each pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pixels {
    /// 8 bits a channel.
    Rgba8(Vec<[u8; 4]>),
    /// 16 bits a channel.
    Rgba16(Vec<[u16; 4]>),
}

/// What can be decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics.
    Png,
    /// JFIF, Exif and their kin.
    Jpeg,
    /// Lossy or lossless, the first frame.
    WebP,
}

impl Format {
    /// From a media type such as `image/png`.
    pub fn from_media_type(media: &str) -> Option<Self> {
        match media.to_ascii_lowercase().as_str() {
            "image/png" => Some(Self::Png),
            "image/jpeg" | "image/jpg" => Some(Self::Jpeg),
            "image/webp" => Some(Self::WebP),
            _ => None,
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::WebP => "WebP",
        })
    }
}

/// Bytes that are not a picture that can be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DecodeError {
    /// What is wrong, with the value.
    pub problem: String,
    /// What is allowed.
    pub fix: &'static str,
}

/// The pixels of a PNG, JPEG or WebP (told by its first bytes), grey and palettes expanded; no colour conversion.
///
/// # Errors
/// Another format, too large, cut short or damaged.
pub fn rgba(bytes: &[u8]) -> Result<(Decoded, Format), DecodeError> {
    let (format, kind) = sniff(bytes)?;
    let most = match format {
        // One bit a pixel is the least that a PNG can mean.
        Format::Png => 8 * MAX_DEFLATE_RATIO * bytes.len() as u64 + 7,
        Format::Jpeg | Format::WebP => u64::MAX,
    };
    Ok((decode(bytes, kind, &format, most)?, format))
}

/// The pixels of a picture of a known kind, called `format` in messages; `bytes` can hold at most `most` of them.
///
/// # Errors
/// See [`rgba`].
pub(super) fn decode(
    bytes: &[u8],
    kind: ImageFormat,
    format: &dyn fmt::Display,
    most: u64,
) -> Result<Decoded, DecodeError> {
    // The decoders are not ours. A panic in one, a bug there, costs this picture and not the whole batch.
    catch_unwind(AssertUnwindSafe(|| decode_unguarded(bytes, kind, format, most))).unwrap_or_else(|_| {
        Err(DecodeError { problem: "the decoder failed on this image".into(), fix: "Save the image again." })
    })
}

/// [`decode`], where a decoder may panic.
pub(super) fn decode_unguarded(
    bytes: &[u8],
    kind: ImageFormat,
    format: &dyn fmt::Display,
    most: u64,
) -> Result<Decoded, DecodeError> {
    let damaged = |e: image::ImageError| DecodeError {
        problem: format!("the {format} cannot be decoded: {e}"),
        fix: "Save the image again.",
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), kind);
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(8 * MAX_PIXELS);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let count = u64::from(width) * u64::from(height);
    if count == 0 || count > MAX_PIXELS || width.max(height) > MAX_SIDE {
        return Err(DecodeError {
            problem: format!("{width} x {height} pixels"),
            fix: "Allowed are 1 to 32768 along each side and 2^28 in all.",
        });
    }
    if count > most {
        return Err(DecodeError {
            problem: format!("{width} x {height} pixels cannot be in {} bytes of {format}", bytes.len()),
            fix: "The image is cut short or made to exhaust memory.",
        });
    }
    let color = decoder.color_type();
    let size = usize::try_from(decoder.total_bytes()).map_err(|_| DecodeError {
        problem: format!("{width} x {height} pixels"),
        fix: "They do not fit into the memory of this machine.",
    })?;
    let mut raw = vec![0; size];
    decoder.read_image(&mut raw).map_err(damaged)?;
    let pixels = expand(&raw, color).ok_or_else(|| DecodeError {
        problem: format!("pixels of the kind {color:?}"),
        fix: "Save the image with 8 or 16 bits a channel.",
    })?;
    Ok(Decoded { width, height, pixels })
}

/// R G B A from what the decoders give; `None` for floats, which none of ours gives.
fn expand(raw: &[u8], color: ColorType) -> Option<Pixels> {
    let word = |bytes: &[u8; 2]| u16::from_ne_bytes(*bytes);
    let words = raw.as_chunks::<2>().0;
    Some(match color {
        ColorType::L8 => Pixels::Rgba8(raw.iter().map(|&l| [l, l, l, u8::MAX]).collect()),
        ColorType::La8 => Pixels::Rgba8(raw.as_chunks::<2>().0.iter().map(|&[l, a]| [l, l, l, a]).collect()),
        ColorType::Rgb8 => Pixels::Rgba8(raw.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, u8::MAX]).collect()),
        ColorType::Rgba8 => Pixels::Rgba8(raw.as_chunks::<4>().0.to_vec()),
        ColorType::L16 => Pixels::Rgba16(words.iter().map(word).map(|l| [l, l, l, u16::MAX]).collect()),
        ColorType::La16 => {
            let pairs = words.as_chunks::<2>().0.iter().map(|p| p.each_ref().map(word));
            Pixels::Rgba16(pairs.map(|[l, a]| [l, l, l, a]).collect())
        }
        ColorType::Rgb16 => {
            let triples = words.as_chunks::<3>().0.iter().map(|p| p.each_ref().map(word));
            Pixels::Rgba16(triples.map(|[r, g, b]| [r, g, b, u16::MAX]).collect())
        }
        ColorType::Rgba16 => Pixels::Rgba16(words.as_chunks::<4>().0.iter().map(|p| p.each_ref().map(word)).collect()),
        _ => return None,
    })
}

/// The format by its first bytes.
fn sniff(bytes: &[u8]) -> Result<(Format, ImageFormat), DecodeError> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        return Ok((Format::Png, ImageFormat::Png));
    }
    if bytes.starts_with(b"\xff\xd8\xff") {
        return Ok((Format::Jpeg, ImageFormat::Jpeg));
    }
    if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        return Ok((Format::WebP, ImageFormat::WebP));
    }
    let known: [(&[u8], usize, &str); 6] = [
        (b"\xabKTX 20", 0, "KTX2"),
        (b"ftyp", 4, "AVIF or HEIF"),
        (b"GIF8", 0, "GIF"),
        (b"BM", 0, "BMP"),
        (b"DDS ", 0, "DDS"),
        (b"\x76\x2f\x31\x01", 0, "OpenEXR"),
    ];
    let found = known.iter().find(|(magic, at, _)| bytes.get(*at..).is_some_and(|b| b.starts_with(magic)));
    let problem = match found {
        _ if bytes.is_empty() => "the image is empty (0 bytes)".to_owned(),
        Some((_, _, name)) => format!("the image is {name}, which is not built yet"),
        None => {
            let first: Vec<u8> = bytes.iter().take(8).copied().collect();
            format!("neither PNG nor JPEG nor WebP: it starts with \"{}\"", first.escape_ascii())
        }
    };
    Err(DecodeError { problem, fix: "Allowed: PNG, JPEG and WebP." })
}

#[cfg(test)]
#[path = "decode_tests.rs"]
mod tests;
