//! Materials, textures, images and cameras of glTF: what is read, what is left out and said, what is refused.

mod gltf_support;

use gltf_support::{Sample, base64, png};
use prt::camera::Projection;
use prt::error::LoadError;
use prt::material::{AlphaMode, Material};
use prt::render::{Filter, FilterShape, Progress, RenderSettings, render};
use prt::scene::Scene;
use prt::texture::{Few, Texels, UvTransform};
use serde_json::{Value, json};

const PBR: &str = "/materials/0/pbrMetallicRoughness";

fn material(scene: &Scene) -> &Material {
    &scene.materials[scene.meshes[0].material.index()]
}

/// What was skipped.
fn skipped(scene: &Scene) -> Vec<&str> {
    scene.skipped.iter().map(|s| s.what.as_str()).collect()
}

#[track_caller]
fn expect(error: &LoadError, place: &str, parts: &[&str]) {
    let text = error.to_string();
    assert_eq!(error.at.place, place, "{text}");
    for part in parts {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
}

/// One value changed; the error is at that very place.
#[track_caller]
fn refused(sample: Sample, pointer: &str, value: Value, parts: &[&str]) {
    expect(&sample.set(pointer, value).error(), pointer, parts);
}

/// An image as a data URI.
fn image(bytes: &[u8]) -> Value {
    json!({"uri": format!("data:application/octet-stream;base64,{}", base64(bytes))})
}

#[test]
fn opacity_is_the_base_colours_alpha_where_the_alpha_mode_asks_for_it() {
    let base = Sample::new().set(&format!("{PBR}/baseColorFactor"), json!([0.1, 0.2, 0.3, 0.75]));
    let opaque = base.load().unwrap();
    assert_eq!((material(&opaque).alpha_mode, material(&opaque).opacity.texture), (AlphaMode::Opaque, None));
    for (set, expected) in [
        (json!({"alphaMode": "MASK"}), AlphaMode::Mask { cutoff: 0.5 }),
        (json!({"alphaMode": "MASK", "alphaCutoff": 0.25}), AlphaMode::Mask { cutoff: 0.25 }),
        (json!({"alphaMode": "MASK", "alphaCutoff": 2}), AlphaMode::Mask { cutoff: 2.0 }),
        (json!({"alphaMode": "BLEND", "alphaCutoff": 0.25}), AlphaMode::Blend),
    ] {
        let mut sample = base.clone();
        for (key, value) in set.as_object().unwrap() {
            sample = sample.set(&format!("/materials/0/{key}"), value.clone());
        }
        let scene = sample.load().unwrap();
        let m = material(&scene);
        assert_eq!((m.alpha_mode, m.opacity.factor), (expected, 0.75));
        assert!(m.opacity.texture.is_some() && m.opacity.texture == m.base_color.texture);
    }
    let mask = base.set("/materials/0/alphaMode", json!("MASK"));
    refused(mask, "/materials/0/alphaCutoff", json!(-0.5), &["-0.5", "at least 0"]);
}

#[test]
fn unlit_material_reads_its_base_colour_only() {
    let scene = Sample::new()
        .set("/materials/0/emissiveTexture", json!({"index": 99}))
        .set("/materials/0/extensions", json!({"KHR_materials_unlit": {}}))
        .load()
        .unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let m = material(&scene);
    assert!(m.unlit && m.base_color.texture.is_some());
    assert_eq!(m.textures().count(), 1);
    let at = |slot: &str| format!("materials/0/{slot}");
    let expected = [at("pbrMetallicRoughness/metallicRoughnessTexture"), at("normalTexture"), at("emissiveTexture")];
    assert_eq!(skipped(&scene), expected);
    assert!(!material(&Sample::new().load().unwrap()).unlit);
}

#[test]
fn index_of_refraction_is_read_and_bounded() {
    let ior = "/materials/0/extensions/KHR_materials_ior";
    assert_eq!(material(&Sample::new().load().unwrap()).ior, 1.5);
    for (value, expected) in
        [(json!({}), 1.5), (json!({"ior": 1.33}), 1.33), (json!({"ior": 1}), 1.0), (json!({"ior": 0}), 0.0)]
    {
        assert_eq!(material(&Sample::new().set(ior, value).load().unwrap()).ior, expected);
    }
    for bad in [json!(0.9), json!(-1), json!(1e39), json!("glass")] {
        let error = Sample::new().set(ior, json!({"ior": bad})).error();
        expect(&error, &format!("{ior}/ior"), &["at least 1", "glass 1.5"]);
    }
}

#[test]
fn textures_that_cannot_matter_are_neither_opened_nor_checked() {
    let scene = Sample::new()
        .set("/images/-", json!({"uri": "missing.png"}))
        .set("/textures/-", json!({"source": 1}))
        .set("/materials/0/emissiveTexture", json!({"index": 1}))
        .set("/materials/0/emissiveFactor", json!([0, 0, 0]))
        .set(&format!("{PBR}/metallicFactor"), json!(0))
        .set(&format!("{PBR}/roughnessFactor"), json!(0))
        .set(&format!("{PBR}/metallicRoughnessTexture"), json!({"index": 77}))
        .set(
            "/materials/0/extensions/KHR_materials_specular",
            json!({
            "specularFactor": 0, "specularTexture": {"index": 1}, "specularColorTexture": {"index": 1}}),
        )
        .load()
        .unwrap();
    let at = |slot: &str| format!("materials/0/{slot}");
    let specular = "extensions/KHR_materials_specular";
    let expected = [
        at("pbrMetallicRoughness/metallicRoughnessTexture"),
        at("emissiveTexture"),
        at(&format!("{specular}/specularTexture")),
        at(&format!("{specular}/specularColorTexture")),
        "images/1".to_owned(),
    ];
    assert_eq!(skipped(&scene), expected);
    assert_eq!(scene.images.len(), 1);
}

#[test]
fn one_of_metallic_and_roughness_may_be_all_that_is_read() {
    let no_metal = Sample::new().set(&format!("{PBR}/metallicFactor"), json!(0)).load().unwrap();
    assert!(material(&no_metal).metallic.texture.is_none() && material(&no_metal).roughness.texture.is_some());
    let smooth = Sample::new().set(&format!("{PBR}/roughnessFactor"), json!(0)).load().unwrap();
    assert!(material(&smooth).metallic.texture.is_some() && material(&smooth).roughness.texture.is_none());
}

#[test]
fn sets_of_texture_coordinates_are_numbered_as_they_are_used() {
    let base = Sample::new()
        .set("/meshes/0/primitives/0/attributes/TEXCOORD_1", json!(2))
        .set("/meshes/0/primitives/0/attributes/TEXCOORD_3", json!(2));
    let scene = base
        .clone()
        .set(&format!("{PBR}/baseColorTexture/texCoord"), json!(3))
        .set(&format!("{PBR}/metallicRoughnessTexture/texCoord"), json!(1))
        .set("/materials/0/normalTexture/texCoord", json!(0))
        // The transform's own set wins, although it transforms nothing.
        .set("/materials/0/normalTexture/extensions", json!({"KHR_texture_transform": {"texCoord": 3}}))
        .load()
        .unwrap();
    let m = material(&scene);
    let set = |texture: Option<prt::texture::TextureRef>| texture.unwrap().uv_set;
    assert_eq!([m.roughness.texture, m.base_color.texture, m.normal.texture].map(set), [0, 1, 1]);
    assert_eq!(m.normal.texture.unwrap().transform, None);
    // A slot that is not read asks for no set.
    let scene = base
        .set("/materials/0/emissiveFactor", json!([0, 0, 0]))
        .set("/materials/0/emissiveTexture", json!({"index": 0, "texCoord": 9}))
        .load()
        .unwrap();
    assert!(material(&scene).textures().all(|t| t.uv_set == 0));
}

#[test]
fn more_sets_than_four_in_one_material_are_refused() {
    let error = Sample::new()
        .set(&format!("{PBR}/metallicRoughnessTexture/texCoord"), json!(1))
        .set("/materials/0/normalTexture/texCoord", json!(2))
        .set("/materials/0/emissiveTexture", json!({"index": 0, "texCoord": 5}))
        .set("/materials/0/extensions/KHR_materials_specular/specularTexture", json!({"index": 0, "texCoord": 4}))
        .error();
    expect(&error, "/materials/0", &["5 sets", "[0, 1, 2, 4, 5]", "At most 4"]);
}

fn transform(value: Value) -> Option<UvTransform> {
    let slots = [
        "/materials/0/normalTexture",
        "/materials/0/pbrMetallicRoughness/baseColorTexture",
        "/materials/0/extensions/KHR_materials_specular/specularTexture",
    ];
    let mut sample = Sample::new().set(slots[2], json!({"index": 0}));
    for slot in slots {
        sample = sample.set(&format!("{slot}/extensions"), json!({"KHR_texture_transform": value}));
    }
    let scene = sample.load().unwrap();
    let m = material(&scene);
    let found = [m.normal.texture, m.base_color.texture, m.specular.texture].map(|t| t.unwrap().transform);
    assert!(found.iter().all(|t| *t == found[0]), "every slot: {found:?}");
    found[0]
}

#[test]
fn texture_transform_scales_then_turns_then_moves() {
    for identity in [json!({}), json!({"scale": [1, 1], "rotation": 0, "offset": [0, 0]})] {
        assert_eq!(transform(identity), None);
    }
    let moved = transform(json!({"offset": [0.25, -2], "scale": [3, 4]}));
    assert_eq!(moved, Some(UvTransform { m: [[3.0, 0.0, 0.25], [0.0, 4.0, -2.0]] }));
    // A quarter turn counter-clockwise as one sees it: +u (right) becomes -v (up).
    let turned = transform(json!({"rotation": std::f64::consts::FRAC_PI_2, "scale": [2, 5], "offset": [7, 8]}));
    let expected = [[0.0, 5.0, 7.0], [-2.0, 0.0, 8.0]];
    for (row, wanted) in turned.unwrap().m.iter().zip(expected) {
        assert!(row.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6), "{turned:?}");
    }
}

#[test]
fn texture_transform_that_is_none_is_refused() {
    let at = "/materials/0/normalTexture/extensions";
    for (key, bad, part) in [
        ("offset", json!([1]), "two finite numbers"),
        ("offset", json!([1, "x"]), "two finite numbers"),
        ("scale", json!([1, 2, 3]), "two finite numbers"),
        ("rotation", json!("left"), "radians"),
        ("texCoord", json!(-1), "0, 1, 2"),
    ] {
        let error = Sample::new().set(at, json!({"KHR_texture_transform": {key: bad}})).error();
        expect(&error, &format!("{at}/KHR_texture_transform/{key}"), &[part]);
    }
    let error = Sample::new().set(at, json!({"KHR_texture_transform": {"scale": [1e39, 1]}})).error();
    expect(&error, &format!("{at}/KHR_texture_transform"), &["1e+39", "finite"]);
}

/// Red of the pixels, row by row, of the unit square with `texture` on it, seen straight on by `size` x `size` pixels.
fn reds(texture: Value, file: &[u8], size: u32) -> Vec<u32> {
    let ortho = json!({"type": "orthographic", "orthographic": {"xmag": 0.5, "ymag": 0.5, "zfar": 9, "znear": 0}});
    let scene = Sample::new()
        .set("/cameras/0", ortho)
        .set("/nodes/1/translation", json!([0.5, 0.5, 5]))
        .set(
            "/materials/0",
            json!({"extensions": {"KHR_materials_unlit": {}},
            "pbrMetallicRoughness": {"baseColorTexture": texture}}),
        )
        .set("/samplers/0", json!({"magFilter": 9728}))
        .set("/images/0", image(file))
        .load()
        .unwrap();
    let settings = RenderSettings {
        width: size,
        height: size,
        spp: 4,
        filter: Filter { shape: FilterShape::Box, width: 1.0 },
        accel: prt::render::AccelChoice::Bvh,
        ..RenderSettings::default()
    };
    let frame = render(&scene, 0, &settings, &Progress::default()).unwrap();
    let srgb = |v: f32| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    frame.pixels.iter().map(|p| (srgb(p[0]) * 255.0).round() as u32).collect()
}

#[test]
fn pictures_show_the_texels_where_the_transform_puts_them() {
    // a b
    // c d
    let (a, b, c, d) = (40, 90, 140, 240);
    let texels: Vec<u8> = [a, b, c, d].iter().flat_map(|&r| [r as u8, 0, 0, 255]).collect();
    let file = png(&texels, 2, 2);
    let seen = |t: Value| reds(json!({"index": 0, "extensions": {"KHR_texture_transform": t}}), &file, 2);
    assert_eq!(seen(json!({})), [a, b, c, d]);
    // Half a texture further right.
    assert_eq!(seen(json!({"offset": [0.5, 0]})), [b, a, d, c]);
    // The upper left quarter, on all of the square.
    assert_eq!(seen(json!({"scale": [0.5, 0.5]})), [a; 4]);
    // The coordinates turn counter-clockwise (u' = v, v' = -u), the picture clockwise.
    assert_eq!(seen(json!({"rotation": std::f64::consts::FRAC_PI_2})), [c, a, d, b]);
    assert_eq!(seen(json!({"rotation": std::f64::consts::PI})), [d, c, b, a]);
}

#[test]
fn sixteen_bit_images_keep_their_bits_and_unused_channels_are_left_out() {
    use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
    let words: [u16; 4] = [1, 300, 65_535, 40_000];
    let mut file = Vec::new();
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_ne_bytes()).collect();
    PngEncoder::new(&mut file).write_image(&bytes, 1, 1, ExtendedColorType::Rgba16).unwrap();
    let sample = Sample::new().set("/images/0", image(&file));
    assert_eq!(sample.load().unwrap().images[0].texels, Texels::Rgba16(vec![words]));
    let scene = sample.set("/materials/0", json!({"pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 0}}}));
    let few = Few { values: vec![300, 65_535], kept: 2, at: [0, 0, 1, 0] };
    assert_eq!(scene.load().unwrap().images[0].texels, Texels::Few16(few));
}

fn webp(pixel: [u8; 4]) -> Vec<u8> {
    use image::{ExtendedColorType, ImageEncoder, codecs::webp::WebPEncoder};
    let mut out = Vec::new();
    WebPEncoder::new_lossless(&mut out).write_image(&pixel, 1, 1, ExtendedColorType::Rgba8).unwrap();
    out
}

#[test]
fn webp_image_is_preferred_to_its_fallback() {
    let base = Sample::new().set("/images/-", image(&webp([9, 8, 7, 6])));
    let texture = json!({"source": 0, "extensions": {"EXT_texture_webp": {"source": 1}}});
    let scene = base.clone().set("/textures/0", texture).set("/materials/0/alphaMode", json!("BLEND"));
    let scene = scene.set("/extensionsRequired", json!(["EXT_texture_webp"])).load().unwrap();
    assert_eq!(scene.images[0].texels, Texels::Rgba8(vec![[9, 8, 7, 6]]));
    assert_eq!((skipped(&scene), scene.warnings.len()), (vec!["images/0"], 0));
    let at = "/textures/0/extensions/EXT_texture_webp";
    for bad in [json!({"source": 2}), json!({}), json!({"source": -1})] {
        let error = base.clone().set("/textures/0", json!({"extensions": {"EXT_texture_webp": bad}})).error();
        expect(&error, &format!("{at}/source"), &["index into images"]);
    }
}

#[test]
fn texture_without_an_image_that_is_read_leaves_the_factor_with_a_warning() {
    for (texture, part) in
        [(json!({"extensions": {"KHR_texture_basisu": {"source": 0}}}), "KHR_texture_basisu"), (json!({}), "no source")]
    {
        let scene = Sample::new().set("/textures/0", texture).load().unwrap();
        assert_eq!((material(&scene).textures().count(), scene.images.len()), (0, 0));
        assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
        assert!(scene.warnings[0].contains("/textures/0") && scene.warnings[0].contains(part), "{:?}", scene.warnings);
    }
    // Beside a source it is an alternative, and nothing is lost.
    let both = json!({"source": 0, "extensions": {"KHR_texture_basisu": {"source": 7}}});
    let scene = Sample::new().set("/textures/0", both).set("/extensionsUsed/-", json!("KHR_texture_basisu"));
    assert!(scene.load().unwrap().warnings.is_empty());
}

#[test]
fn extensions_that_are_not_read_are_warned_of_once_with_their_first_place() {
    for (object, at, name) in [
        ("/materials/0/extensions", "/materials/0", "ACME_wax"),
        ("/materials/0/normalTexture/extensions", "/materials/0/normalTexture", "ACME_filter"),
        ("/nodes/0/extensions", "/nodes/0", "ACME_shape"),
        ("/scenes/0/extensions", "/scenes/0", "EXT_lights_image_based"),
        (
            "/extensions/KHR_lights_punctual/lights/0/extensions",
            "/extensions/KHR_lights_punctual/lights/0",
            "EXT_lights_ies",
        ),
    ] {
        let mut sample = Sample::new().set("/extensionsUsed/-", json!(name));
        if sample.json.pointer(object).is_none() {
            sample = sample.set(object, json!({}));
        }
        let scene = sample.clone().set(&format!("{object}/{name}"), json!({})).load().unwrap();
        let text = format!("{at}: the extension {name} is not read");
        assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
        assert!(scene.warnings[0].starts_with(&text), "{:?}", scene.warnings);
        let error = sample.set("/extensionsRequired", json!([name])).error();
        expect(&error, "/extensionsRequired/0", &[name, "not built"]);
    }
    let scene = Sample::new()
        .set("/nodes/0/extensions", json!({"ACME_shape": {}}))
        .set("/nodes/1/extensions", json!({"ACME_shape": {}}))
        .load()
        .unwrap();
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    assert!(scene.warnings[0].contains("first of 2 places"), "{:?}", scene.warnings);
}

#[test]
fn metadata_is_accepted_in_silence_even_if_required() {
    for name in ["KHR_xmp_json_ld", "KHR_materials_variants"] {
        let scene = Sample::new()
            .set("/extensionsUsed/-", json!(name))
            .set("/extensionsRequired", json!([name]))
            .set(&format!("/extensions/{name}"), json!({}))
            .set("/nodes/0/extensions", json!({ name: {} }))
            .load()
            .unwrap();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
}

#[test]
fn orthographic_camera_is_read_and_its_planes_do_not_matter() {
    let with = |o: Value| Sample::new().set("/cameras/0", json!({"type": "orthographic", "orthographic": o}));
    let scene = with(json!({"xmag": 2, "ymag": 1.5, "znear": 0, "zfar": -3})).load().unwrap();
    assert_eq!(scene.cameras[0].projection, Projection::Orthographic { xmag: 2.0, ymag: 1.5 });
    for (key, bad) in [("xmag", json!(0)), ("ymag", json!(-1)), ("ymag", json!(1e39))] {
        let mut planes = json!({"xmag": 2, "ymag": 1.5, "znear": 0, "zfar": 3});
        planes[key] = bad;
        expect(&with(planes).error(), &format!("/cameras/0/orthographic/{key}"), &["more than 0"]);
    }
    let missing = with(json!({"xmag": 2, "znear": 0, "zfar": 3})).error();
    assert!(missing.problem.contains("missing field `ymag`"), "{missing}");
    let none = Sample::new().set("/cameras/0", json!({"type": "orthographic"})).error();
    expect(&none, "/cameras/0", &["has no orthographic", "xmag"]);
    refused(Sample::new(), "/cameras/0/type", json!("fisheye"), &["fisheye", "orthographic"]);
}
