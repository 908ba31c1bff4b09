//! TGA and BMP, which OBJ files of old still name, to 8-bit RGBA; bounded like [`super::decode`].

use super::decode::{DecodeError, Decoded, MAX_PIXELS, MAX_SIDE, Pixels};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Run-length codes of both formats turn two bytes into at most 255 pixels, so a file that promises more than this per
/// byte is cut short or a bomb.
const MAX_PIXELS_PER_BYTE: u64 = 256;

/// Which of the two; TGA files cannot be told by their first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Truevision.
    Tga,
    /// Windows bitmap.
    Bmp,
}

/// The pixels, grey and palettes expanded; no colour conversion.
///
/// # Errors
/// Too large, cut short or damaged.
pub fn rgba(bytes: &[u8], format: Format) -> Result<Decoded, DecodeError> {
    // As in `decode`: a bug of the decoder costs this picture only.
    catch_unwind(AssertUnwindSafe(|| decode(bytes, format))).unwrap_or_else(|_| {
        Err(DecodeError { problem: "the decoder failed on this image".into(), fix: "Save the image again." })
    })
}

fn decode(bytes: &[u8], format: Format) -> Result<Decoded, DecodeError> {
    let (name, kind) = match format {
        Format::Tga => ("TGA", ImageFormat::Tga),
        Format::Bmp => ("BMP", ImageFormat::Bmp),
    };
    let damaged = |e: image::ImageError| DecodeError {
        problem: format!("the {name} cannot be decoded: {e}"),
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
        let problem = format!("{width} x {height} pixels");
        return Err(DecodeError { problem, fix: "Allowed are 1 to 32768 along each side and 2^28 in all." });
    }
    if pixels > MAX_PIXELS_PER_BYTE * bytes.len() as u64 {
        let problem = format!("{width} x {height} pixels cannot be in {} bytes of {name}", bytes.len());
        return Err(DecodeError { problem, fix: "The image is cut short or made to exhaust memory." });
    }
    let pixels = DynamicImage::from_decoder(decoder).map_err(damaged)?.into_rgba8();
    Ok(Decoded { width, height, pixels: Pixels::Rgba8(pixels.as_raw().as_chunks::<4>().0.to_vec()) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ExtendedColorType, ImageEncoder};

    const PIXELS: [u8; 12] = [255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 9, 9];

    #[test]
    fn both_formats_give_the_pixels_back_and_truncations_do_not_panic() {
        let (mut tga, mut bmp) = (Vec::new(), Vec::new());
        let color = ExtendedColorType::Rgb8;
        image::codecs::tga::TgaEncoder::new(&mut tga).write_image(&PIXELS, 2, 2, color).unwrap();
        image::codecs::bmp::BmpEncoder::new(&mut bmp).write_image(&PIXELS, 2, 2, color).unwrap();
        for (bytes, format) in [(tga, Format::Tga), (bmp, Format::Bmp)] {
            let image = rgba(&bytes, format).unwrap();
            let expected = vec![[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [9, 9, 9, 255]];
            assert_eq!(image.pixels, Pixels::Rgba8(expected));
            (0..bytes.len()).for_each(|n| drop(decode(&bytes[..n], format)));
        }
    }

    #[test]
    fn large_promises_in_small_files_are_refused() {
        // The header of a run-length coded TGA of 16384 x 16384.
        let mut bytes = vec![0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 64, 0, 64, 24, 0];
        bytes.extend([0xFF, 1, 2, 3]);
        let error = rgba(&bytes, Format::Tga).unwrap_err();
        assert!(error.problem.contains("cannot be in 22 bytes"), "{error:?}");
    }
}
