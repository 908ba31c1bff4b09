//! Writes 8-bit sRGB PNG.

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

/// The `sRGB` chunk with rendering intent 0 (perceptual), with length and CRC: PNG specification, section 11.3.2.5.
const SRGB_CHUNK: [u8; 13] = [0, 0, 0, 1, b's', b'R', b'G', b'B', 0, 0xAE, 0xCE, 0x1C, 0xE9];
/// Bytes of the signature and the IHDR chunk, after which the `sRGB` chunk must come before PLTE and IDAT.
const AFTER_IHDR: usize = 8 + 25;

/// The bytes of a PNG of `rgb`: `[height][width][3]` 8-bit sRGB.
///
/// # Panics
/// If `rgb` does not fill `width x height`.
pub fn encode(rgb: &[u8], width: u32, height: u32) -> Vec<u8> {
    encode_as(ExtendedColorType::Rgb8, rgb, width, height)
}

/// The bytes of a PNG of `rgba`: `[height][width][4]` 8-bit sRGB and straight alpha.
///
/// # Panics
/// If `rgba` does not fill `width x height`.
pub fn encode_rgba(rgba: &[u8], width: u32, height: u32) -> Vec<u8> {
    encode_as(ExtendedColorType::Rgba8, rgba, width, height)
}

fn encode_as(color: ExtendedColorType, samples: &[u8], width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(samples, width, height, color)
        .expect("a buffer of the right size is encoded to memory without error");
    bytes.splice(AFTER_IHDR..AFTER_IHDR, SRGB_CHUNK);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn png_has_an_srgb_chunk_and_reads_back() {
        let rgb: Vec<u8> = (0..5 * 3 * 3).map(|i| i * 5).collect();
        let bytes = encode(&rgb, 5, 3);
        assert_eq!(&bytes[AFTER_IHDR + 4..AFTER_IHDR + 8], b"sRGB");
        let read = image::load_from_memory(&bytes).unwrap().into_rgb8();
        assert_eq!((read.width(), read.height()), (5, 3));
        assert_eq!(read.into_raw(), rgb);
        assert_eq!(bytes, encode(&rgb, 5, 3));
    }

    #[test]
    fn alpha_reads_back() {
        let rgba: Vec<u8> = (0..5 * 3 * 4).map(|i| i * 4).collect();
        let bytes = encode_rgba(&rgba, 5, 3);
        assert_eq!(&bytes[AFTER_IHDR + 4..AFTER_IHDR + 8], b"sRGB");
        assert_eq!(image::load_from_memory(&bytes).unwrap().into_rgba8().into_raw(), rgba);
    }
}
