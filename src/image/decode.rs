//! PNG and JPEG to 8-bit RGBA, from bytes of unknown origin: sizes are bounded before anything is allocated, and
//! whatever is wrong comes back as an error.

use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::fmt;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Larger pictures are refused: pixels along one side.
pub const MAX_SIDE: u32 = 32_768;
/// Larger pictures are refused: pixels, 1 GiB decoded.
pub const MAX_PIXELS: u64 = 1 << 28;
/// Deflate cannot pack more than 1032 bytes into one (258 bytes from 2 bits, RFC 1951), so a PNG that promises more
/// is cut short or a bomb.
const MAX_DEFLATE_RATIO: u64 = 1032;

/// Decoded pixels, row 0 at the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rgba8 {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `[height * width]` R G B A, as encoded in the file.
    pub texels: Vec<[u8; 4]>,
}

/// What can be decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics.
    Png,
    /// JFIF, Exif and their kin.
    Jpeg,
}

impl Format {
    /// From a media type such as `image/png`.
    pub fn from_media_type(media: &str) -> Option<Self> {
        match media.to_ascii_lowercase().as_str() {
            "image/png" => Some(Self::Png),
            "image/jpeg" | "image/jpg" => Some(Self::Jpeg),
            _ => None,
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
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

/// The pixels of a PNG or JPEG (told by its first bytes), grey and palettes expanded; no colour conversion.
///
/// # Errors
/// Another format, 16 bits a channel, too large, cut short or damaged.
pub fn rgba8(bytes: &[u8]) -> Result<(Rgba8, Format), DecodeError> {
    // The decoders are not ours. A panic in one, a bug there, costs this picture and not the whole batch.
    catch_unwind(AssertUnwindSafe(|| decode(bytes))).unwrap_or_else(|_| {
        Err(DecodeError { problem: "the decoder failed on this image".into(), fix: "Save the image again." })
    })
}

fn decode(bytes: &[u8]) -> Result<(Rgba8, Format), DecodeError> {
    let (format, kind) = sniff(bytes)?;
    let damaged = |e: image::ImageError| DecodeError {
        problem: format!("the {format} cannot be decoded: {e}"),
        fix: "Save the image again.",
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), kind);
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(4 * MAX_PIXELS);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > MAX_PIXELS || width.max(height) > MAX_SIDE {
        return Err(DecodeError {
            problem: format!("{width} x {height} pixels"),
            fix: "Allowed are 1 to 32768 along each side and 2^28 in all.",
        });
    }
    let color = decoder.color_type();
    if color.bytes_per_pixel() > color.channel_count() {
        let bits = 8 * color.bytes_per_pixel() / color.channel_count().max(1);
        return Err(DecodeError {
            problem: format!("{bits} bits a channel are not built yet"),
            fix: "Save the image with 8 bits a channel.",
        });
    }
    debug_assert!(matches!(color, ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8));
    // One bit a pixel is the least that a PNG can mean.
    if format == Format::Png && pixels / 8 > MAX_DEFLATE_RATIO * bytes.len() as u64 {
        return Err(DecodeError {
            problem: format!("{width} x {height} pixels cannot be in {} bytes of PNG", bytes.len()),
            fix: "The image is cut short or made to exhaust memory.",
        });
    }
    let pixels = DynamicImage::from_decoder(decoder).map_err(damaged)?.into_rgba8();
    let texels = pixels.as_raw().as_chunks::<4>().0.to_vec();
    Ok((Rgba8 { width, height, texels }, format))
}

/// The format by its first bytes.
fn sniff(bytes: &[u8]) -> Result<(Format, ImageFormat), DecodeError> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        return Ok((Format::Png, ImageFormat::Png));
    }
    if bytes.starts_with(b"\xff\xd8\xff") {
        return Ok((Format::Jpeg, ImageFormat::Jpeg));
    }
    let known: [(&[u8], usize, &str); 7] = [
        (b"\xabKTX 20", 0, "KTX2"),
        (b"WEBP", 8, "WebP"),
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
            format!("neither PNG nor JPEG: it starts with \"{}\"", first.escape_ascii())
        }
    };
    Err(DecodeError { problem, fix: "Allowed: PNG and JPEG." })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

    fn png(pixels: &[u8], width: u32, height: u32, color: ExtendedColorType) -> Vec<u8> {
        let mut out = Vec::new();
        PngEncoder::new(&mut out).write_image(pixels, width, height, color).unwrap();
        out
    }

    #[test]
    fn grey_is_expanded_and_alpha_is_opaque() {
        let (pixels, format) = rgba8(&png(&[0, 200], 2, 1, ExtendedColorType::L8)).unwrap();
        assert_eq!(format, Format::Png);
        assert_eq!(pixels.texels, [[0, 0, 0, 255], [200, 200, 200, 255]]);
    }

    #[test]
    fn jpeg_is_read_and_its_truncations_do_not_panic() {
        let mut bytes = Vec::new();
        image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100)
            .write_image(&[200; 64], 8, 8, ExtendedColorType::L8)
            .unwrap();
        let (pixels, format) = rgba8(&bytes).unwrap();
        assert_eq!((format, pixels.texels.len()), (Format::Jpeg, 64));
        assert!(pixels.texels.iter().all(|t| t[0].abs_diff(200) <= 2 && t[0] == t[1] && t[3] == 255));
        for n in 0..bytes.len() {
            let _ = decode(&bytes[..n]);
        }
    }

    #[test]
    fn sixteen_bits_are_refused_by_name() {
        let error = rgba8(&png(&[0; 6], 1, 1, ExtendedColorType::Rgb16)).unwrap_err();
        assert!(error.problem.contains("16 bits"), "{error:?}");
    }

    #[test]
    fn png_that_promises_more_than_deflate_can_hold_is_refused() {
        let mut bytes = png(&[0; 4], 1, 1, ExtendedColorType::Rgba8);
        bytes[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]); // 16384 x 16384 in IHDR
        let crc = crc(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.to_be_bytes());
        let error = rgba8(&bytes).unwrap_err();
        assert!(error.problem.contains("16384 x 16384 pixels cannot be in"), "{error:?}");
    }

    #[test]
    fn every_truncation_is_an_error() {
        let whole = png(&[7; 4 * 16 * 16], 16, 16, ExtendedColorType::Rgba8);
        // The last chunk (IEND, 12 bytes) holds no pixels.
        for n in 0..whole.len() - 12 {
            assert!(rgba8(&whole[..n]).is_err(), "{n} bytes");
        }
    }

    fn crc(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0, |crc, &b| {
            (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { c >> 1 ^ 0xEDB8_8320 } else { c >> 1 })
        })
    }
}
