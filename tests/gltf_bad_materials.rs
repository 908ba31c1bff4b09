//! Materials that are wrong or at the edge of what is allowed: defined behaviour, with the JSON pointer in the message.

mod gltf_support;

use gltf_support::{Sample, base64, png};
use prt::error::LoadError;
use prt::load::{LoadOptions, estimate};
use prt::material::Material;
use prt::render::{AccelChoice, DefaultLight, Progress, RenderSettings, render};
use prt::scene::Scene;
use serde_json::{Value, json};

const EXT: &str = "/materials/0/extensions";

fn with(name: &str, ext: Value) -> Sample {
    let mut extensions = json!({"KHR_materials_transmission": {"transmissionFactor": 1}});
    extensions[name] = ext;
    Sample::new().set(EXT, extensions)
}

fn material(scene: &Scene) -> &Material {
    &scene.materials[0]
}

#[track_caller]
fn expect(error: &LoadError, place: &str, parts: &[&str]) {
    let text = error.to_string();
    assert_eq!(error.at.place, place, "{text}");
    for part in parts {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
}

#[test]
fn factors_out_of_range_are_refused_where_they_are() {
    for (name, key, bad, part) in [
        ("clearcoat", "clearcoatFactor", json!(1.7), "1.7"),
        ("clearcoat", "clearcoatRoughnessFactor", json!(-0.5), "[0, 1]"),
        ("clearcoat", "clearcoatFactor", json!("much"), "\"much\" is not a number"),
        ("clearcoat", "clearcoatNormalTexture/scale", json!(1e39), "finite"),
        ("sheen", "sheenColorFactor", json!([0, 0, 255]), "0 to 255"),
        ("sheen", "sheenColorFactor", json!([0, 0]), "list of 3 numbers"),
        ("sheen", "sheenRoughnessFactor", json!(100), "percent"),
        ("anisotropy", "anisotropyStrength", json!(2), "[0, 1]"),
        ("anisotropy", "anisotropyRotation", json!(1e39), "radians"),
        ("iridescence", "iridescenceFactor", json!(-1), "[0, 1]"),
        ("iridescence", "iridescenceIor", json!(0.5), "at least 1"),
        ("iridescence", "iridescenceIor", json!(0), "at least 1"),
        ("iridescence", "iridescenceThicknessMaximum", json!(-1), "at least 0"),
        ("iridescence", "iridescenceThicknessMinimum", json!(1e39), "finite"),
        ("transmission", "transmissionFactor", json!(100), "percent"),
        ("diffuse_transmission", "diffuseTransmissionFactor", json!(1.1), "[0, 1]"),
        ("diffuse_transmission", "diffuseTransmissionColorFactor", json!([2, 0, 0]), "[0, 1]"),
        ("volume", "thicknessFactor", json!(-1), "at least 0"),
        ("volume", "attenuationDistance", json!(-1), "more than 0"),
        ("volume", "attenuationColor", json!([-0.5, 0, 0]), "at least 0"),
        ("dispersion", "dispersion", json!(-1), "at least 0"),
        ("pbrSpecularGlossiness", "glossinessFactor", json!(7), "[0, 1]"),
        ("pbrSpecularGlossiness", "diffuseFactor", json!([1, 1, 1]), "list of 4 numbers"),
        ("ior", "ior", json!(0.5), "at least 1"),
    ] {
        let name = format!("KHR_materials_{name}");
        let mut ext = json!({});
        match key.split_once('/') {
            None => ext[key] = bad,
            Some((texture, key)) => ext[texture] = json!({"index": 0, key: bad}),
        }
        expect(&with(&name, ext).error(), &format!("{EXT}/{name}/{key}"), &[part]);
    }
    let error = with("KHR_materials_sheen", json!([])).error();
    expect(&error, &format!("{EXT}/KHR_materials_sheen"), &["not an object"]);
}

#[test]
fn disney_parameters_out_of_range_are_refused_where_they_are() {
    for (key, bad, part) in [
        ("prt_disney", json!(2), "1, or 0"),
        ("prt_disney", json!("yes"), "\"yes\""),
        ("prt_subsurface", json!(1.5), "[0, 1]"),
        ("prt_clearcoat_gloss", json!(-1), "[0, 1]"),
        ("prt_sheen", json!("some"), "not a number"),
    ] {
        let mut extras = json!({"prt_disney": 1});
        extras[key] = bad;
        let error = Sample::new().set("/materials/0/extras", extras).error();
        expect(&error, &format!("/materials/0/extras/{key}"), &[part]);
    }
}

#[test]
fn reference_to_a_texture_that_is_none_is_refused_where_it_is() {
    for (info, key, part) in [
        (json!({}), "index", "has its index"),
        (json!({"index": -1}), "index", "-1"),
        (json!({"index": 9}), "index", "only 0 is allowed"),
        (json!({"index": 0, "texCoord": "a"}), "texCoord", "0, 1, 2"),
    ] {
        let ext = json!({"clearcoatFactor": 1, "clearcoatRoughnessFactor": 1, "clearcoatRoughnessTexture": info});
        let at = format!("{EXT}/KHR_materials_clearcoat/clearcoatRoughnessTexture/{key}");
        expect(&with("KHR_materials_clearcoat", ext).error(), &at, &[part]);
    }
}

#[test]
fn roughness_texture_without_an_image_leaves_the_factor_with_a_warning() {
    let ext =
        json!({"sheenColorFactor": [1, 1, 1], "sheenRoughnessFactor": 0.5, "sheenRoughnessTexture": {"index": 1}});
    let scene = with("KHR_materials_sheen", ext).set("/textures/-", json!({})).load().unwrap();
    let sheen = material(&scene).sheen;
    assert_eq!((sheen.roughness.factor, sheen.roughness.texture), (0.5, None));
    assert!(scene.warnings[0].contains("/textures/1"), "{:?}", scene.warnings);
}

#[test]
fn attenuation_at_its_edges_is_finite_and_said() {
    let volume = |ext: Value| {
        let mut ext = ext;
        ext["thicknessFactor"] = json!(1);
        with("KHR_materials_volume", ext).load().unwrap()
    };
    let scene = volume(json!({"attenuationColor": [0.5, 0.5, 0.5], "attenuationDistance": 0}));
    let found = material(&scene).interior().unwrap();
    assert!(found.attenuation_distance > 0.0 && found.absorption().iter().all(|a| a.is_finite() && *a > 1e5));
    assert_eq!(scene.warnings.len(), 1);
    let at = format!("{EXT}/KHR_materials_volume/attenuationDistance = 0");
    assert!(scene.warnings[0].contains(at.trim_start_matches('/')), "{:?}", scene.warnings);

    // No number in JSON is infinite, but this one is beyond f32.
    for infinite in [json!({}), json!({"attenuationColor": [0.5, 0, 1], "attenuationDistance": 1e39})] {
        let scene = volume(infinite);
        assert_eq!(material(&scene).interior().unwrap().absorption(), [0.0; 3]);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
    let black = volume(json!({"attenuationColor": [0, 1, 1], "attenuationDistance": 1}));
    assert_eq!(material(&black).interior().unwrap().absorption(), [1e20, 0.0, 0.0]);
    let bright = volume(json!({"attenuationColor": [2, 0.5, 1.000001], "attenuationDistance": 1}));
    assert_eq!(material(&bright).interior().unwrap().attenuation_color, [1.0, 0.5, 1.0]);
    assert!(bright.warnings[0].contains("attenuationColor = [2.0"), "{:?}", bright.warnings);
}

#[test]
fn thickness_without_transmission_and_volume_without_thickness_are_skipped_and_said() {
    let opaque = with("KHR_materials_volume", json!({"thicknessFactor": 1, "thicknessTexture": {"index": 99}}))
        .set(&format!("{EXT}/KHR_materials_transmission/transmissionFactor"), json!(0))
        .load()
        .unwrap();
    assert!(material(&opaque).volume.is_none() && opaque.warnings.is_empty());
    let whats: Vec<(&str, &str)> = opaque.skipped.iter().map(|s| (s.what.as_str(), s.why.as_str())).collect();
    let at = "materials/0/extensions/KHR_materials_volume";
    assert!(whats.iter().any(|(what, why)| *what == at && why.contains("neither transmission")), "{whats:?}");
    assert!(whats.iter().any(|(what, _)| *what == format!("{at}/thicknessTexture")), "{whats:?}");
    for thin in [json!({}), json!({"thicknessFactor": 0, "attenuationColor": [0, 0, 0], "attenuationDistance": 0.1})] {
        let scene = with("KHR_materials_volume", thin).load().unwrap();
        assert!(material(&scene).volume.is_none() && material(&scene).has_transmission());
        assert!(scene.skipped.iter().any(|s| s.what == at && s.why.contains("thin-walled")));
    }
}

#[test]
fn every_index_of_refraction_that_is_allowed_gives_finite_pictures() {
    for ior in [json!(0), json!(1), json!(1.000001), json!(3.4e38)] {
        let scene = with("KHR_materials_ior", json!({ "ior": ior }))
            .set("/materials/0/emissiveFactor", json!([0, 0, 0]))
            .set(
                &format!("{EXT}/KHR_materials_volume"),
                json!({"thicknessFactor": 1, "attenuationDistance": 0,
                "attenuationColor": [0, 0.5, 1]}),
            )
            .load()
            .unwrap();
        let settings = RenderSettings {
            width: 8,
            height: 8,
            spp: 4,
            accel: AccelChoice::Bvh,
            default_light: DefaultLight::On,
            ..RenderSettings::default()
        };
        let frame = render(&scene, 0, &settings, &Progress::default()).unwrap();
        assert_eq!(frame.stats.non_finite_samples, 0, "ior {ior}");
        assert!(frame.pixels.iter().flatten().all(|v| v.is_finite()), "ior {ior}");
    }
}

/// Every slot of the extensions on one texture.
fn all_slots() -> Value {
    let t = || json!({"index": 0});
    json!({
        "KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 1, "clearcoatTexture": t(),
            "clearcoatRoughnessTexture": t(), "clearcoatNormalTexture": t()},
        "KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1], "sheenRoughnessFactor": 1,
            "sheenColorTexture": t(), "sheenRoughnessTexture": t()},
        "KHR_materials_anisotropy": {"anisotropyStrength": 1, "anisotropyTexture": t()},
        "KHR_materials_iridescence": {"iridescenceFactor": 1, "iridescenceTexture": t(),
            "iridescenceThicknessTexture": t()},
        "KHR_materials_transmission": {"transmissionFactor": 1, "transmissionTexture": t()},
        "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 1, "diffuseTransmissionTexture": t(),
            "diffuseTransmissionColorTexture": t()}})
}

fn picture(file: &[u8]) -> Sample {
    let uri = format!("data:image/png;base64,{}", base64(file));
    Sample::new().set("/materials/0", json!({"extensions": all_slots()})).set("/images/0", json!({ "uri": uri }))
}

#[test]
fn textures_of_one_texel_and_of_16384_load() {
    for (width, height) in [(1, 1), (16_384, 1), (1, 16_384)] {
        let texels = vec![128; 4 * (width * height) as usize];
        let scene = picture(&png(&texels, width, height)).load().unwrap();
        assert_eq!((scene.images[0].width, scene.images[0].height), (width, height));
        assert_eq!(material(&scene).textures().count(), 11);
    }
}

#[test]
fn texture_of_16384_squared_is_estimated_by_its_header_once_for_all_slots() {
    let mut header = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
    header.extend(16_384_u32.to_be_bytes().repeat(2));
    header.extend([8, 6, 0, 0, 0]);
    let dir = tempfile::tempdir().unwrap();
    let path = picture(&header).write(dir.path());
    let bytes = estimate(&path, &LoadOptions::default()).unwrap().bytes;
    // Decoded and kept, four bytes a texel each, and not once a slot.
    let texels = 1_u64 << 28;
    assert!((4 * texels..10 * texels).contains(&bytes), "{bytes}");
    // A file that says so and ends there is refused, not allocated for.
    expect(&picture(&header).error(), "/images/0/uri", &[]);
}

#[test]
fn texture_that_is_not_what_it_says_is_read_as_what_it_is_with_a_warning() {
    let uri = format!("data:image/jpeg;base64,{}", base64(&png(&[1, 2, 3, 4], 1, 1)));
    let scene = picture(&[]).set("/images/0/uri", json!(uri)).load().unwrap();
    assert!(scene.warnings[0].starts_with("/images/0: said to be"), "{:?}", scene.warnings);
}

fn variants() -> Sample {
    let red = json!({"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}});
    let list = json!({"variants": [{"name": "day"}, {"name": "night"}, {"name": "day"}]});
    let mapping = json!({"mappings": [{"material": 1, "variants": [1, 2]}, {"material": 99, "variants": [5]}]});
    Sample::new()
        .set("/materials/-", red)
        .set("/extensions/KHR_materials_variants", list)
        .set("/meshes/0/primitives/0/extensions", json!({"KHR_materials_variants": mapping}))
}

fn variant(sample: &Sample, name: &str) -> Result<Scene, LoadError> {
    sample.load_with(&LoadOptions { variant: Some(name.into()), ..LoadOptions::default() })
}

#[test]
fn variant_of_materials_is_chosen_by_name() {
    let own = variants().load().unwrap();
    assert_eq!((own.materials[0].name.as_str(), own.materials.len()), ("all", 1));
    let night = variant(&variants(), "night").unwrap();
    assert_eq!(night.materials[0].name, "red");
    assert!(night.skipped.iter().any(|s| s.what == "materials/0"), "the one that nothing shows");
    // Where a variant says nothing, the primitive's own material stays; of two of one name the first counts.
    assert_eq!(variant(&variants(), "day").unwrap().materials[0].name, "all");
}

#[test]
fn variant_that_is_not_there_is_refused_with_those_that_are() {
    let error = variant(&variants(), "dusk").unwrap_err();
    expect(&error, "/extensions/KHR_materials_variants/variants", &["\"dusk\"", "Allowed: \"day\", \"night\""]);
    let error = variant(&Sample::new(), "dusk").unwrap_err();
    expect(&error, "", &["no variants", "leave --variant out"]);
    let at = "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/0/material";
    expect(&variant(&variants().set(at, json!(7)), "night").unwrap_err(), at, &["index into materials"]);
    expect(&variant(&variants().set(at, json!("red")), "night").unwrap_err(), at, &["index of a material"]);
}
