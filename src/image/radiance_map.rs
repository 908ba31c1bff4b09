//! Radiance HDR and OpenEXR pictures, which are linear, as environments are kept in them.

use super::decode::{MAX_PIXELS, MAX_SIDE};
use super::exr_read;
use image::codecs::hdr::HdrDecoder;
use image::{ImageDecoder, Limits};
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Linear RGB, Rec.709 primaries unless the file means others.
#[derive(Clone, Debug, PartialEq)]
pub struct RadianceMap {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `[height * width]`, row by row from the top; as in the file, so perhaps not finite or negative.
    pub pixels: Vec<[f32; 3]>,
}

/// The pixels of a Radiance HDR or OpenEXR file, told by its first bytes. A Radiance file's exposure is taken out again:
/// pixels are what was measured.
///
/// # Errors
/// Another format, too large, cut short or damaged: what is wrong, without the path.
pub fn decode(bytes: &[u8]) -> Result<RadianceMap, String> {
    if bytes.starts_with(b"\x76\x2f\x31\x01") {
        let picture = exr_read::decode(bytes)?;
        let [width, height] = [picture.width, picture.height].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
        bounded(width, height)?;
        return Ok(RadianceMap { width, height, pixels: picture.pixels });
    }
    if !bytes.starts_with(b"#?") {
        return Err("is neither Radiance HDR (#?RADIANCE) nor OpenEXR".into());
    }
    // The decoder has been seen to panic on damaged files of other kinds.
    let read = catch_unwind(AssertUnwindSafe(|| radiance_hdr(bytes)));
    read.unwrap_or_else(|_| Err("is damaged".into()))
}

fn radiance_hdr(bytes: &[u8]) -> Result<RadianceMap, String> {
    let wrong = |error: image::ImageError| format!("is no readable Radiance HDR: {error}");
    let mut decoder = HdrDecoder::new(Cursor::new(bytes)).map_err(wrong)?;
    let metadata = decoder.metadata();
    let (width, height) = decoder.dimensions();
    bounded(width, height)?;
    // Four bytes a pixel in runs of at most 127 of two bytes each.
    if u64::from(width) * u64::from(height) > 64 * bytes.len() as u64 {
        return Err(format!("is cut short: {width} x {height} pixels in {} bytes", bytes.len()));
    }
    let mut limits = Limits::default();
    limits.max_alloc = None;
    decoder.set_limits(limits).map_err(wrong)?;
    let mut raw = vec![0; decoder.total_bytes() as usize];
    decoder.read_image(&mut raw).map_err(wrong)?;
    let exposure = metadata.exposure.filter(|e| e.is_finite() && *e > 0.0).unwrap_or(1.0);
    let channel = |at: &[u8]| f32::from_ne_bytes([at[0], at[1], at[2], at[3]]) / exposure;
    let pixels = raw.chunks_exact(12).map(|p| [channel(&p[..4]), channel(&p[4..8]), channel(&p[8..])]).collect();
    Ok(RadianceMap { width, height, pixels })
}

fn bounded(width: u32, height: u32) -> Result<(), String> {
    let pixels = u64::from(width) * u64::from(height);
    if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE || pixels > MAX_PIXELS {
        return Err(format!("has {width} x {height} pixels; at most {MAX_SIDE} a side and {MAX_PIXELS} in all"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of plain (not run-length coded) pixels: red, green, blue mantissas and the exponent.
    fn hdr(header: &str, size: [u32; 2], pixels: &[[u8; 4]]) -> Vec<u8> {
        let mut bytes =
            format!("#?RADIANCE\n{header}FORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", size[1], size[0]).into_bytes();
        bytes.extend(pixels.iter().flatten());
        bytes
    }

    #[test]
    fn mantissas_share_an_exponent_and_the_exposure_is_taken_out() {
        // 128/256 * 2^(129 - 128) = 1.
        let pixels = [[128, 64, 0, 129], [128, 128, 128, 139], [0, 0, 0, 0]];
        let map = decode(&hdr("", [3, 1], &pixels)).unwrap();
        assert_eq!((map.width, map.height), (3, 1));
        assert_eq!(map.pixels, [[1.0, 0.5, 0.0], [1024.0; 3], [0.0; 3]]);
        let map = decode(&hdr("EXPOSURE=4\n", [3, 1], &pixels)).unwrap();
        assert_eq!(map.pixels[0], [0.25, 0.125, 0.0]);
    }

    #[test]
    fn what_is_none_is_said() {
        assert!(decode(b"\x89PNG").unwrap_err().contains("neither Radiance HDR"));
        let whole = hdr("", [4, 4], &[[1, 2, 3, 128]; 16]);
        assert!(decode(&whole).is_ok());
        for length in 2..whole.len() {
            assert!(decode(&whole[..length]).is_err(), "{length}");
        }
        let huge = hdr("", [30_000, 30_000], &[]);
        assert!(decode(&huge).unwrap_err().contains("at most"), "{:?}", decode(&huge));
        let promised = hdr("", [16_000, 16_000], &[[1, 2, 3, 128]]);
        assert!(decode(&promised).unwrap_err().contains("cut short"));
    }
}
