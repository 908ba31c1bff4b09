//! Tests of the EXR writer on frames made by hand.

use super::*;
use crate::image::exr_read;

/// Distinct finite pixels.
fn pixels(width: u32, height: u32) -> Vec<[f32; 3]> {
    (0..width * height).map(|i| [i as f32 * 0.125, 1.0 / (i as f32 + 1.0), 1e4 + i as f32]).collect()
}

/// A whole picture of `pixels`, seen by a camera that is moved and turned.
fn picture(width: u32, height: u32, pixels: &[[f32; 3]]) -> ExrPicture<'_> {
    let rotation = glam::DQuat::from_rotation_y(0.5) * glam::DQuat::from_rotation_x(-0.25);
    let camera = ExrCamera {
        world_from_camera: DMat4::from_rotation_translation(rotation, DVec3::new(3.0, 2.0, -1.0)),
        projection: ExrProjection::Perspective { yfov: 0.7 },
        aspect_ratio: f64::from(width) / f64::from(height),
    };
    let attributes = vec![
        ("prt:seed", ExrValue::Text("18446744073709551615".into())),
        ("prt:version", ExrValue::Text("光 ü".into())),
        ("prt:spp", ExrValue::Int(16)),
        ("prt:truncated", ExrValue::Double(0.25)),
        ("prt:accel", ExrValue::Text("bvh".into())),
    ];
    ExrPicture {
        display_size: [width, height],
        origin: [0, 0],
        size: [width, height],
        pixels,
        channels: Vec::new(),
        camera,
        lens: None,
        attributes,
    }
}

fn zip(picture: &ExrPicture<'_>) -> Vec<u8> {
    encode(picture, ExrOptions::default()).unwrap()
}

fn header_of(bytes: &[u8]) -> exr::meta::header::Header {
    exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), true).unwrap().headers[0].clone()
}

/// Names of the attributes in the order of the file.
fn attribute_names(bytes: &[u8]) -> Vec<String> {
    let (mut names, mut at) = (Vec::new(), 8);
    while bytes[at] != 0 {
        let name_end = at + bytes[at..].iter().position(|&b| b == 0).unwrap();
        let type_end = name_end + 1 + bytes[name_end + 1..].iter().position(|&b| b == 0).unwrap();
        let size = u32::from_le_bytes(bytes[type_end + 1..type_end + 5].try_into().unwrap());
        names.push(String::from_utf8(bytes[at..name_end].to_vec()).unwrap());
        at = type_end + 5 + size as usize;
    }
    names
}

#[test]
fn pixels_read_back_bit_for_bit_in_every_compression() {
    let mut pixels = pixels(37, 21);
    pixels[5] = [f32::MIN_POSITIVE / 2.0, 1e38, -1e6];
    pixels[6] = [f32::NAN, f32::INFINITY, 65504.0];
    for compression in
        [ExrCompression::Zip, ExrCompression::Zips, ExrCompression::Piz, ExrCompression::Rle, ExrCompression::None]
    {
        let options = ExrOptions { compression, ..ExrOptions::default() };
        let bytes = encode(&picture(37, 21, &pixels), options).unwrap();
        let read = exr_read::decode(&bytes).unwrap();
        assert_eq!((read.width, read.height), (37, 21));
        for (a, b) in read.pixels.iter().zip(&pixels) {
            assert_eq!(a.map(f32::to_bits), b.map(f32::to_bits), "{compression:?}");
        }
    }
}

const HALF: ExrOptions = ExrOptions { samples: ExrSamples::Half, compression: ExrCompression::Zip };

#[test]
fn half_clips_at_its_greatest_and_the_clipped_pixels_are_counted() {
    // 65519.99 would round to 65504 and 65520 to infinity; whatever lies beyond 65504 is clipped.
    let values = [65504.0, 65504.004, 65519.99, 65520.0, 1e6, 1e38, -1e6, f32::INFINITY, f32::NAN, 6e-8, 1e-9, 0.1];
    let read = |value: f32| {
        let bytes = encode(&picture(1, 1, &[[value, 0.5, -0.0]]), HALF).unwrap();
        let header = header_of(&bytes);
        assert!(header.channels.list.iter().all(|channel| channel.sample_type == SampleType::F16));
        exr_read::decode(&bytes).unwrap().pixels[0]
    };
    for value in values {
        let clipped = clipped_by_half(&[[0.5, value, 0.25]]);
        assert_eq!(clipped, u64::from(value.abs() > 65504.0), "{value}");
        let [found, half, zero] = read(value);
        assert_eq!((half, zero.to_bits()), (0.5, (-0.0_f32).to_bits()));
        match value {
            _ if clipped > 0 => assert_eq!(found, 65504.0_f32.copysign(value), "{value}"),
            _ if value.is_nan() => assert!(found.is_nan()),
            // Half a step of 11 bits, or of the smallest half, 2^-24.
            _ => assert!((found - value).abs() <= (value * 0.5_f32.powi(11)).max(0.5_f32.powi(25)), "{value} {found}"),
        }
    }
    let many = [[1e5, 1e5, 1e5], [1.0, 2.0, 3.0], [0.0, f32::NEG_INFINITY, 0.0]];
    assert_eq!(clipped_by_half(&many), 2);
}

#[test]
fn every_half_survives() {
    let values: Vec<f32> = (0..=u16::MAX).map(|bits| f16::from_bits(bits).to_f32()).collect();
    let pixels: Vec<_> = values.iter().map(|&value| [value, -value, 1.0]).collect();
    let read = exr_read::decode(&encode(&picture(256, 256, &pixels), HALF).unwrap()).unwrap();
    for (found, value) in read.pixels.iter().zip(values) {
        let expected = if value.is_infinite() { 65504.0_f32.copysign(value) } else { value };
        assert!(found[0].to_bits() == expected.to_bits() || found[0].is_nan() && value.is_nan(), "{value}: {found:?}");
    }
}

#[test]
fn crop_is_the_data_window_inside_the_whole_display_window() {
    let pixels = pixels(4, 3);
    let crop = ExrPicture { display_size: [100, 50], origin: [90, 40], ..picture(4, 3, &pixels) };
    let header = header_of(&zip(&crop));
    assert_eq!(header.own_attributes.layer_position, Vec2(90, 40));
    assert_eq!(header.layer_size, Vec2(4, 3));
    assert_eq!(header.shared_attributes.display_window, IntegerBounds::new(Vec2(0, 0), Vec2(100, 50)));
    let names: Vec<_> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names, ["A", "B", "G", "R"]);
}

#[test]
fn a_one_pixel_picture_is_written() {
    let bytes = zip(&picture(1, 1, &pixels(1, 1)));
    assert_eq!(exr_read::decode(&bytes).unwrap().pixels.len(), 1);
}

#[test]
fn pixels_that_do_not_fill_the_window_are_refused() {
    assert!(encode(&picture(4, 3, &pixels(4, 2)), ExrOptions::default()).unwrap_err().contains("4 x 3"));
}

#[test]
fn attributes_are_in_alphabetical_order_and_bytes_repeat() {
    let pixels = pixels(8, 8);
    let bytes = zip(&picture(8, 8, &pixels));
    let names = attribute_names(&bytes);
    assert!(names.is_sorted(), "{names:?}");
    for name in ["chromaticities", "worldToCamera", "worldToNDC", "dataWindow", "displayWindow", "prt:seed"] {
        assert!(names.iter().any(|n| n == name), "{name} in {names:?}");
    }
    // Every hash map has its own seed, so unsorted attributes would differ within a few tries.
    for _ in 0..16 {
        assert_eq!(bytes, zip(&picture(8, 8, &pixels)));
    }
}

#[test]
fn attribute_text_is_stored_as_utf_8() {
    let header = header_of(&zip(&picture(1, 1, &pixels(1, 1))));
    let stored = &header.own_attributes.other[&text("prt:version")];
    assert_eq!(stored.to_text().unwrap().bytes(), "光 ü".as_bytes());
}

/// `row` times the stored matrix, as a reader that multiplies row vectors does it.
fn transform(point: DVec3, m: &[f32; 16]) -> [f64; 4] {
    let row = [point.x, point.y, point.z, 1.0];
    std::array::from_fn(|column| (0..4).map(|i| row[i] * f64::from(m[4 * i + column])).sum())
}

#[test]
fn stored_matrices_take_a_known_point_to_camera_and_picture() {
    let pixels = pixels(16, 9);
    let picture = picture(16, 9, &pixels);
    let header = header_of(&zip(&picture));
    let (to_camera, to_ndc) =
        (header.own_attributes.world_to_camera.unwrap(), header.own_attributes.world_to_normalized_device.unwrap());
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-5, "{a} {b}");
    // 5 m in front of the camera, 0.5 m right, 0.25 m up, in the file's frame (looking along -Z).
    let world = picture.camera.world_from_camera.transform_point3(DVec3::new(0.5, 0.25, -5.0));
    let [x, y, z, w] = transform(world, &to_camera);
    for (value, expected) in [(x, 0.5), (y, 0.25), (z, 5.0), (w, 1.0)] {
        near(value, expected);
    }

    let half_height = 5.0 * (0.5 * 0.7_f64).tan();
    let half_width = half_height * 16.0 / 9.0;
    let corner = |x: f64, y: f64| picture.camera.world_from_camera.transform_point3(DVec3::new(x, y, -5.0));
    for (point, expected) in [
        (corner(-half_width, half_height), (0.0, 0.0)),
        (corner(half_width, -half_height), (1.0, 1.0)),
        (corner(half_width, half_height), (1.0, 0.0)),
        (corner(0.0, 0.0), (0.5, 0.5)),
    ] {
        let [x, y, z, w] = transform(point, &to_ndc);
        for (value, expected) in [(x / w, expected.0), (y / w, expected.1), (w, 5.0)] {
            near(value, expected);
        }
        assert!((0.0..1.0).contains(&(z / w)));
    }
}

#[test]
fn channels_beside_the_colour_keep_their_type_and_must_fill_the_picture() {
    let pixels = [[0.25, 0.5, 1.0]; 6];
    let channel = |name, samples| ExrChannel { name, samples };
    let with = |n: usize| ExrPicture {
        channels: vec![
            channel("variance.R", ExrChannelSamples::Float(vec![1e-30; n])),
            channel("samples", ExrChannelSamples::Uint(vec![16_777_217; 6])),
        ],
        ..picture(3, 2, &pixels)
    };
    let half = ExrOptions { samples: ExrSamples::Half, ..ExrOptions::default() };
    let bytes = encode(&with(6), half).unwrap();
    let found = crate::image::exr_read::channels(&bytes).unwrap();
    let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["A", "B", "G", "R", "samples", "variance.R"]);
    // Half would have none of it.
    assert_eq!((found[5].1[3], found[1].1[0]), (1e-30, 1.0));
    assert_eq!(encode(&with(6), half).unwrap(), bytes, "equal pictures have equal bytes");
    let wrong = encode(&with(5), half).unwrap_err();
    assert_eq!(wrong, "EXR: 5 samples of variance.R do not fill 3 x 2");
}
