//! The size of a picture file by its first bytes: what decoding it will take is known before any of it is decoded.

/// What a PNG, JPEG or WebP says about itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Channels that the decoder gives: 1 grey, 2 grey and alpha, 3 or 4.
    pub channels: u8,
    /// Bytes a channel: 1 or 2.
    pub depth: u8,
}

/// Segments of a JPEG that are looked through for the one with its size.
const MOST_SEGMENTS: usize = 256;

/// The header of the picture whose bytes `read_at` gives: it fills a slice from an offset on, or is `None` where there are
/// not so many bytes. `None` for what is no such picture; the decoder says what is wrong with it.
pub fn header(read_at: &mut dyn FnMut(u64, &mut [u8]) -> Option<()>) -> Option<Header> {
    let mut start = [0; 12];
    read_at(0, &mut start)?;
    if start.starts_with(b"\x89PNG\r\n\x1a\n") {
        return png(read_at);
    }
    if start.starts_with(b"\xff\xd8\xff") {
        return jpeg(read_at);
    }
    if start.starts_with(b"RIFF") && start.ends_with(b"WEBP") {
        return webp(read_at);
    }
    None
}

/// PNG specification, section 11.2.1: IHDR is the first chunk.
fn png(read_at: &mut dyn FnMut(u64, &mut [u8]) -> Option<()>) -> Option<Header> {
    let mut ihdr = [0; 10];
    read_at(16, &mut ihdr)?;
    let [w0, w1, w2, w3, h0, h1, h2, h3, bits, color] = ihdr;
    let channels = match color {
        0 => 1,
        4 => 2,
        2 => 3,
        // A palette may have alpha; the decoder then gives four channels.
        3 | 6 => 4,
        _ => return None,
    };
    let (width, height) = (u32::from_be_bytes([w0, w1, w2, w3]), u32::from_be_bytes([h0, h1, h2, h3]));
    Some(Header { width, height, channels, depth: if bits == 16 { 2 } else { 1 } })
}

/// ITU-T T.81, annex B: segments up to a start of frame.
fn jpeg(read_at: &mut dyn FnMut(u64, &mut [u8]) -> Option<()>) -> Option<Header> {
    let mut at = 2;
    for _ in 0..MOST_SEGMENTS {
        let mut marker = [0; 4];
        read_at(at, &mut marker)?;
        let [0xff, kind, high, low] = marker else { return None };
        match kind {
            // Fill bytes.
            0xff => at += 1,
            // Start of frame of any process; C4, C8 and CC are tables.
            0xc0..=0xcf if ![0xc4, 0xc8, 0xcc].contains(&kind) => {
                let mut frame = [0; 6];
                read_at(at + 4, &mut frame)?;
                let [_, h0, h1, w0, w1, components] = frame;
                let (width, height) = (u16::from_be_bytes([w0, w1]).into(), u16::from_be_bytes([h0, h1]).into());
                let channels = if components == 1 { 1 } else { 3 };
                return Some(Header { width, height, channels, depth: 1 });
            }
            _ => at += 2 + u64::from(u16::from_be_bytes([high, low])),
        }
    }
    None
}

/// RFC 9649, sections 2.5 to 2.7.
fn webp(read_at: &mut dyn FnMut(u64, &mut [u8]) -> Option<()>) -> Option<Header> {
    let mut chunk = [0; 18];
    read_at(12, &mut chunk)?;
    let (kind, body) = (&chunk[..4], &chunk[8..]);
    let [b0, b1, b2, b3, b4, b5, b6, b7, b8, b9] = body.try_into().ok()?;
    let (width, height, has_alpha) = match kind {
        b"VP8 " => {
            (u32::from(u16::from_le_bytes([b6, b7]) & 0x3fff), u32::from(u16::from_le_bytes([b8, b9]) & 0x3fff), false)
        }
        b"VP8L" => {
            let bits = u32::from_le_bytes([b1, b2, b3, b4]);
            ((bits & 0x3fff) + 1, (bits >> 14 & 0x3fff) + 1, bits >> 28 & 1 == 1)
        }
        b"VP8X" => {
            let (w, h) = (u32::from_le_bytes([b4, b5, b6, 0]), u32::from_le_bytes([b7, b8, b9, 0]));
            (w + 1, h + 1, b0 & 0x10 != 0)
        }
        _ => return None,
    };
    Some(Header { width, height, channels: if has_alpha { 4 } else { 3 }, depth: 1 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{DynamicImage, ImageFormat};
    use std::io::Cursor;

    fn of(bytes: &[u8]) -> Option<Header> {
        header(&mut |at, into| {
            let at = usize::try_from(at).ok()?;
            into.copy_from_slice(bytes.get(at..at.checked_add(into.len())?)?);
            Some(())
        })
    }

    fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn sizes_channels_and_depth_are_those_that_the_decoders_find() {
        let images = [
            DynamicImage::new_luma8(300, 7),
            DynamicImage::new_luma_a8(31, 500),
            DynamicImage::new_rgb8(17, 33),
            DynamicImage::new_rgba8(1, 1),
            DynamicImage::new_rgb16(5, 9),
            DynamicImage::new_rgba16(70_000, 1),
        ];
        for image in &images {
            let (color, size) = (image.color(), (image.width(), image.height()));
            let found = of(&encoded(image, ImageFormat::Png)).unwrap();
            assert_eq!((found.width, found.height), size);
            assert_eq!(found.channels, color.channel_count());
            assert_eq!(u16::from(found.depth) * 8 * u16::from(found.channels), color.bits_per_pixel());
        }
        for (image, channels) in [(&images[0], 1), (&images[2], 3)] {
            let found = of(&encoded(image, ImageFormat::Jpeg)).unwrap();
            let expected = Header { width: image.width(), height: image.height(), channels, depth: 1 };
            assert_eq!(found, expected);
        }
        for (image, channels) in [(&images[2], 3), (&images[3], 4)] {
            let found = of(&encoded(image, ImageFormat::WebP)).unwrap();
            assert_eq!((found.width, found.height, found.channels), (image.width(), image.height(), channels));
        }
    }

    #[test]
    fn what_is_cut_short_or_no_picture_has_no_header() {
        let png = encoded(&DynamicImage::new_rgb8(4, 4), ImageFormat::Png);
        let jpeg = encoded(&DynamicImage::new_rgb8(4, 4), ImageFormat::Jpeg);
        for bytes in [&png[..20], &jpeg[..25], b"", b"GIF89a and more", &[0xff, 0xd8, 0xff, 0xe0, 0, 0, 0, 0]] {
            assert_eq!(of(bytes), None);
        }
    }
}
