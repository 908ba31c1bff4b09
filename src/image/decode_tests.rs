use super::*;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

fn png(pixels: &[u8], width: u32, height: u32, color: ExtendedColorType) -> Vec<u8> {
    let mut out = Vec::new();
    PngEncoder::new(&mut out).write_image(pixels, width, height, color).unwrap();
    out
}

/// A PNG of its parts: IHDR, whatever chunks are given, and rows (each with its filter byte) stored uncompressed.
fn raw_png(width: u32, height: u32, ihdr: [u8; 5], chunks: &[(&[u8; 4], &[u8])], rows: &[u8]) -> Vec<u8> {
    let mut out = Vec::from(*b"\x89PNG\r\n\x1a\n");
    let mut chunk = |kind: &[u8; 4], data: &[u8]| {
        out.extend((data.len() as u32).to_be_bytes());
        let body = [&kind[..], data].concat();
        out.extend(&body);
        out.extend(crc(&body).to_be_bytes());
    };
    chunk(b"IHDR", &[&width.to_be_bytes()[..], &height.to_be_bytes(), &ihdr].concat());
    chunks.iter().for_each(|(kind, data)| chunk(kind, data));
    // zlib (RFC 1950) around one stored block (RFC 1951).
    let length = rows.len() as u16;
    let mut zlib = vec![0x78, 0x01, 1];
    zlib.extend([length.to_le_bytes(), (!length).to_le_bytes()].concat());
    zlib.extend(rows);
    let adler = rows.iter().fold((1_u32, 0_u32), |(a, b), &v| {
        let a = (a + u32::from(v)) % 65521;
        (a, (b + a) % 65521)
    });
    zlib.extend((adler.1 << 16 | adler.0).to_be_bytes());
    chunk(b"IDAT", &zlib);
    chunk(b"IEND", &[]);
    out
}

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { c >> 1 ^ 0xEDB8_8320 } else { c >> 1 })
    })
}

fn bytes_of(file: &[u8]) -> Vec<[u8; 4]> {
    match rgba(file).unwrap().0.pixels {
        Pixels::Rgba8(texels) => texels,
        Pixels::Rgba16(_) => panic!("16 bits"),
    }
}

fn words_of(file: &[u8]) -> Vec<[u16; 4]> {
    match rgba(file).unwrap().0.pixels {
        Pixels::Rgba16(texels) => texels,
        Pixels::Rgba8(_) => panic!("8 bits"),
    }
}

#[test]
fn grey_is_expanded_and_alpha_is_opaque() {
    let file = png(&[0, 200], 2, 1, ExtendedColorType::L8);
    assert_eq!(rgba(&file).unwrap().1, Format::Png);
    assert_eq!(bytes_of(&file), [[0, 0, 0, 255], [200, 200, 200, 255]]);
    let with_alpha = png(&[10, 20, 30, 40], 2, 1, ExtendedColorType::La8);
    assert_eq!(bytes_of(&with_alpha), [[10, 10, 10, 20], [30, 30, 30, 40]]);
}

#[test]
fn sixteen_bits_are_kept() {
    let native = |words: &[u16]| words.iter().flat_map(|w| w.to_ne_bytes()).collect::<Vec<u8>>();
    let rgb = png(&native(&[1, 256, 65535, 513, 2, 3]), 2, 1, ExtendedColorType::Rgb16);
    assert_eq!(words_of(&rgb), [[1, 256, 65535, 65535], [513, 2, 3, 65535]]);
    let rgba = png(&native(&[1, 256, 65535, 40000]), 1, 1, ExtendedColorType::Rgba16);
    assert_eq!(words_of(&rgba), [[1, 256, 65535, 40000]]);
    let grey = png(&native(&[300]), 1, 1, ExtendedColorType::L16);
    assert_eq!(words_of(&grey), [[300, 300, 300, 65535]]);
}

#[test]
fn sixteen_bit_grey_with_alpha_is_kept() {
    // Filter 0; L = 0x0102, A = 0x0304.
    let file = raw_png(1, 1, [16, 4, 0, 0, 0], &[], &[0, 1, 2, 3, 4]);
    assert_eq!(words_of(&file), [[0x0102, 0x0102, 0x0102, 0x0304]]);
}

#[test]
fn palettes_and_few_bits_are_expanded() {
    let palette = [10, 20, 30, 40, 50, 60, 70, 80, 90];
    // Two bits a pixel, the palette's entries 0, 1, 2, 1; tRNS gives the first two entries their alpha.
    let file = raw_png(4, 1, [2, 3, 0, 0, 0], &[(b"PLTE", &palette), (b"tRNS", &[0, 128])], &[0, 0b00_01_10_01]);
    assert_eq!(bytes_of(&file), [[10, 20, 30, 0], [40, 50, 60, 128], [70, 80, 90, 255], [40, 50, 60, 128]]);
    let opaque = raw_png(2, 1, [8, 3, 0, 0, 0], &[(b"PLTE", &palette)], &[0, 2, 0]);
    assert_eq!(bytes_of(&opaque), [[70, 80, 90, 255], [10, 20, 30, 255]]);
    // One bit a pixel of grey.
    let bits = raw_png(3, 1, [1, 0, 0, 0, 0], &[], &[0, 0b1010_0000]);
    assert_eq!(bytes_of(&bits), [[255; 4], [0, 0, 0, 255], [255; 4]]);
}

#[test]
fn colour_named_transparent_by_trns_is_transparent() {
    let rows = [0, 1, 2, 3, 9, 9, 9];
    let file = raw_png(2, 1, [8, 2, 0, 0, 0], &[(b"tRNS", &[0, 1, 0, 2, 0, 3])], &rows);
    assert_eq!(bytes_of(&file), [[1, 2, 3, 0], [9, 9, 9, 255]]);
}

#[test]
fn interlaced_rows_end_up_in_their_places() {
    // 2 x 2 in Adam7: pass 1 holds (0, 0), pass 6 (1, 0), pass 7 row 1; a pass's row has its own filter byte.
    let file = raw_png(2, 2, [8, 0, 0, 0, 1], &[], &[0, 1, 0, 2, 0, 3, 4]);
    let reds: Vec<u8> = bytes_of(&file).iter().map(|t| t[0]).collect();
    assert_eq!(reds, [1, 2, 3, 4]);
}

#[test]
fn gamma_and_profiles_change_nothing() {
    let plain = raw_png(1, 1, [8, 2, 0, 0, 0], &[], &[0, 10, 100, 200]);
    // gAMA 1.0 and cICP BT.2020 PQ.
    let chunks: [(&[u8; 4], &[u8]); 2] = [(b"cICP", &[9, 16, 0, 1]), (b"gAMA", &100_000_u32.to_be_bytes())];
    let tagged = raw_png(1, 1, [8, 2, 0, 0, 0], &chunks, &[0, 10, 100, 200]);
    assert_eq!(bytes_of(&tagged), bytes_of(&plain));
}

/// Decodes without the net that catches a decoder's panic.
fn unguarded(bytes: &[u8]) {
    if let Ok((format, kind)) = sniff(bytes) {
        let _ = decode_unguarded(bytes, kind, &format, u64::MAX);
    }
}

#[test]
fn jpeg_is_read_and_its_truncations_do_not_panic() {
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100)
        .write_image(&[200; 64], 8, 8, ExtendedColorType::L8)
        .unwrap();
    assert_eq!(rgba(&bytes).unwrap().1, Format::Jpeg);
    let texels = bytes_of(&bytes);
    assert_eq!(texels.len(), 64);
    assert!(texels.iter().all(|t| t[0].abs_diff(200) <= 2 && t[0] == t[1] && t[3] == 255));
    for n in 0..bytes.len() {
        unguarded(&bytes[..n]);
    }
}

#[test]
fn webp_is_read_with_its_alpha_and_its_truncations_do_not_panic() {
    let pixels: Vec<u8> = (0..64).collect();
    let mut bytes = Vec::new();
    image::codecs::webp::WebPEncoder::new_lossless(&mut bytes)
        .write_image(&pixels, 4, 4, ExtendedColorType::Rgba8)
        .unwrap();
    let (decoded, format) = rgba(&bytes).unwrap();
    assert_eq!((format, decoded.width, decoded.height), (Format::WebP, 4, 4));
    assert_eq!(bytes_of(&bytes).as_flattened(), pixels);
    for n in 0..bytes.len() {
        unguarded(&bytes[..n]);
    }
}

#[test]
fn png_that_promises_more_than_deflate_can_hold_is_refused() {
    let mut bytes = png(&[0; 4], 1, 1, ExtendedColorType::Rgba8);
    bytes[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]); // 16384 x 16384 in IHDR
    let crc = crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    let error = rgba(&bytes).unwrap_err();
    assert!(error.problem.contains("16384 x 16384 pixels cannot be in"), "{error:?}");
}

#[test]
fn every_truncation_is_an_error() {
    let whole = png(&[7; 4 * 16 * 16], 16, 16, ExtendedColorType::Rgba8);
    // The last chunk (IEND, 12 bytes) holds no pixels.
    for n in 0..whole.len() - 12 {
        assert!(rgba(&whole[..n]).is_err(), "{n} bytes");
    }
}
