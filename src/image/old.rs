//! TGA and BMP, which OBJ files of old still name, to 8-bit RGBA; bounded like [`super::decode`].

use super::decode::{DecodeError, Decoded, decode};
use image::ImageFormat;

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
    let (name, kind) = match format {
        Format::Tga => ("TGA", ImageFormat::Tga),
        Format::Bmp => ("BMP", ImageFormat::Bmp),
    };
    decode(bytes, kind, &name, MAX_PIXELS_PER_BYTE * bytes.len() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::decode::{Pixels, decode_unguarded};
    use image::{ExtendedColorType, ImageEncoder};

    const PIXELS: [u8; 12] = [255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 9, 9];

    #[test]
    fn both_formats_give_the_pixels_back_and_truncations_do_not_panic() {
        let (mut tga, mut bmp) = (Vec::new(), Vec::new());
        let color = ExtendedColorType::Rgb8;
        image::codecs::tga::TgaEncoder::new(&mut tga).write_image(&PIXELS, 2, 2, color).unwrap();
        image::codecs::bmp::BmpEncoder::new(&mut bmp).write_image(&PIXELS, 2, 2, color).unwrap();
        for (bytes, format, kind) in [(tga, Format::Tga, ImageFormat::Tga), (bmp, Format::Bmp, ImageFormat::Bmp)] {
            let image = rgba(&bytes, format).unwrap();
            let expected = vec![[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [9, 9, 9, 255]];
            assert_eq!(image.pixels, Pixels::Rgba8(expected));
            (0..bytes.len()).for_each(|n| drop(decode_unguarded(&bytes[..n], kind, &"", u64::MAX)));
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
