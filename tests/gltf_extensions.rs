//! glTF's material extensions from the file to what shading reads of them: every slot with texture, transform and set
//! of coordinates, and that what is null is absent.

mod gltf_support;
#[path = "gltf_support/probe.rs"]
mod probe;

use gltf_support::{Sample, base64, png};
use probe::{Inside, Probe, read, tables};
use prt::material::extensions::Disney;
use prt::material::media::MediumTable;
use prt::material::table::MaterialTable;
use prt::material::{AlphaMode, Material};
use prt::math::UvSets;
use prt::render::{AccelChoice, DefaultLight, Progress, RenderSettings, render};
use prt::scene::Scene;
use prt::texture::lookup::TextureTable;
use serde_json::{Value, json};
use simd::{Float, Kernel, Lanes, Level, Mask, Uint, dispatch};
use std::f64::consts::FRAC_PI_2;

/// Two texels beside each other: the one that is meant, and one that would be an error.
const TEXEL: [u8; 4] = [51, 102, 153, 204];
const OTHER: [u8; 4] = [255, 0, 255, 17];
/// The channels of `TEXEL`, and its colours decoded from sRGB.
const R: f32 = 0.2;
const G: f32 = 0.4;
const B: f32 = 0.6;
const A: f32 = 0.8;
const SRGB: [f32; 3] = [0.033_104_766, 0.132_868_33, 0.318_546_8];

/// A square with two sets of coordinates and a material of nothing but `extensions` and what `set` sets.
fn sample(extensions: &Value) -> Sample {
    let file = png(&[TEXEL, OTHER].concat(), 2, 1);
    Sample::new()
        .set("/meshes/0/primitives/0/attributes/TEXCOORD_1", json!(2))
        .set("/samplers/0", json!({"magFilter": 9728}))
        .set("/images/0", json!({"uri": format!("data:image/png;base64,{}", base64(&file))}))
        .set("/materials/0", json!({"name": "m", "extensions": extensions}))
}

/// A texture that reads the texel meant at the coordinates of [`Probe`] only if its transform and its set count.
fn texture() -> Value {
    json!({"index": 0, "texCoord": 0,
        "extensions": {"KHR_texture_transform": {"offset": [0.5, 0], "texCoord": 1}}})
}

/// The same with a texture at TEXCOORD_0, so that the two sets can be told from each other.
fn two_sets(extensions: &Value) -> Sample {
    sample(extensions)
        .set("/materials/0/emissiveFactor", json!([1, 1, 1]))
        .set("/materials/0/emissiveTexture", json!({"index": 0}))
}

fn load(extensions: &Value) -> Scene {
    let scene = two_sets(extensions).load().unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene
}

fn material(scene: &Scene) -> &Material {
    &scene.materials[scene.meshes[0].material.index()]
}

#[track_caller]
fn near(got: &[f32], wanted: &[f32]) {
    let same =
        got.len() == wanted.len() && got.iter().zip(wanted).all(|(g, w)| (g - w).abs() <= 2e-5 * w.abs().max(1.0));
    assert!(same, "{got:?}, not {wanted:?}");
}

#[test]
fn clearcoat_is_read_with_its_three_textures() {
    let plain = json!({"KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25}});
    let values = read(&load(&plain));
    assert_eq!((values.coat, values.coat_normal), ([0.5, 0.25], None));
    let mut full = plain;
    let ext = &mut full["KHR_materials_clearcoat"];
    (ext["clearcoatTexture"], ext["clearcoatRoughnessTexture"]) = (texture(), texture());
    ext["clearcoatNormalTexture"] = texture();
    ext["clearcoatNormalTexture"]["scale"] = json!(0.5);
    let scene = load(&full);
    let values = read(&scene);
    near(&values.coat, &[0.5 * R, 0.25 * G]);
    near(&values.coat_normal.unwrap(), &[0.5 * (2.0 * R - 1.0), 0.5 * (2.0 * G - 1.0), 2.0 * B - 1.0]);
    // Its map asks for tangents, along its own coordinates.
    assert!(scene.meshes[0].tangents.is_some() && material(&scene).normal.texture.is_none());
    let absent = read(&load(&json!({"KHR_materials_clearcoat": {"clearcoatFactor": 1}})));
    assert_eq!(absent.coat, [1.0, 0.0]);
}

/// Share of the first material's own light that gets through its coat, seen at the cosine.
struct ThroughCoat<'a>(&'a MaterialTable, &'a TextureTable, f32);

impl Kernel for ThroughCoat<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        let half = L::F::splat(0.5);
        let mut uvs = UvSets::<L>::single(L::F::splat(0.25), half);
        uvs.set(1, L::F::splat(0.75), half);
        let (cos, all) = (L::F::splat(self.2), L::M::first(L::N));
        self.0.emission_through_coat::<L>(self.1, L::U::splat(0), cos, &uvs, all).first()
    }
}

#[test]
fn coat_takes_its_reflectance_at_index_1_5_from_the_light_of_what_it_lies_over() {
    let mut textured = json!({"KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.7}});
    let plain = load(&textured);
    textured["KHR_materials_clearcoat"]["clearcoatTexture"] = texture();
    let textured = load(&textured);
    let none = load(&json!({}));
    for cos in [1.0f64, 0.6, 0.2, 0.01] {
        // Fresnel's equations with Snell's law.
        let inner = (1.0 - (1.0 - cos * cos) / 2.25).sqrt();
        let (s, p) = ((cos - 1.5 * inner) / (cos + 1.5 * inner), (1.5 * cos - inner) / (1.5 * cos + inner));
        let reflectance = (0.5 * (s * s + p * p)) as f32;
        for (scene, coat) in [(&plain, 0.5), (&textured, 0.5 * R), (&none, 0.0)] {
            let (table, textures) = tables(scene);
            let found = dispatch(Level::best(), ThroughCoat(&table, &textures, cos as f32));
            near(&[found], &[1.0 - coat * reflectance]);
        }
    }
}

#[test]
fn sheen_is_read_with_its_two_textures() {
    let plain = json!({"KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.25, 1], "sheenRoughnessFactor": 0.5}});
    assert_eq!(read(&load(&plain)).sheen, [0.5, 0.25, 1.0, 0.5]);
    let mut full = plain;
    full["KHR_materials_sheen"]["sheenColorTexture"] = texture();
    full["KHR_materials_sheen"]["sheenRoughnessTexture"] = texture();
    near(&read(&load(&full)).sheen, &[0.5 * SRGB[0], 0.25 * SRGB[1], SRGB[2], 0.5 * A]);
}

#[test]
fn anisotropy_is_read_as_strength_and_turned_direction() {
    let with = |ext: Value| {
        let scene = load(&json!({ "KHR_materials_anisotropy": ext }));
        assert!(scene.meshes[0].tangents.is_some(), "the direction is one of tangents");
        read(&scene).anisotropy
    };
    near(&with(json!({"anisotropyStrength": 0.5})), &[0.5, 1.0, 0.0]);
    near(&with(json!({"anisotropyStrength": 0.5, "anisotropyRotation": FRAC_PI_2})), &[0.5, 0.0, 1.0]);
    let (x, y) = (2.0 * R - 1.0, 2.0 * G - 1.0);
    let length = x.hypot(y);
    let textured = json!({"anisotropyStrength": 0.5, "anisotropyTexture": texture()});
    near(&with(textured), &[0.5 * B, x / length, y / length]);
    // A quarter turn counter-clockwise: (x, y) becomes (-y, x).
    let turned = json!({"anisotropyStrength": 1, "anisotropyRotation": FRAC_PI_2, "anisotropyTexture": texture()});
    near(&with(turned), &[B, -y / length, x / length]);
}

#[test]
fn anisotropy_texel_without_a_direction_has_the_tangents() {
    let file = png(&[127, 128, 255, 255], 1, 1);
    let scene =
        sample(&json!({"KHR_materials_anisotropy": {"anisotropyStrength": 1, "anisotropyTexture": {"index": 0}}}))
            .set("/images/0", json!({"uri": format!("data:image/png;base64,{}", base64(&file))}))
            .load()
            .unwrap();
    assert_eq!(read(&scene).anisotropy, [1.0, 1.0, 0.0]);
}

#[test]
fn stretched_highlights_need_tangents_only_where_there_are_coordinates() {
    let ext = json!({"KHR_materials_anisotropy": {"anisotropyStrength": 1}});
    // Made along TEXCOORD_0, although no texture reads that.
    let made = sample(&ext).remove("/meshes/0/primitives/0/attributes/TANGENT").load().unwrap();
    assert_eq!(made.meshes[0].tangents.as_ref().unwrap()[0], [1.0, 0.0, 0.0, 1.0]);
    let none = sample(&ext)
        .remove("/meshes/0/primitives/0/attributes/TANGENT")
        .remove("/meshes/0/primitives/0/attributes/TEXCOORD_0")
        .load()
        .unwrap();
    assert!(none.meshes[0].tangents.is_none() && none.warnings.is_empty(), "{:?}", none.warnings);
    let off = sample(&json!({"KHR_materials_anisotropy": {"anisotropyStrength": 0}})).load().unwrap();
    assert!(off.meshes[0].tangents.is_none() && off.meshes[0].uv_sets.is_empty());
}

#[test]
fn iridescence_is_read_with_its_two_textures() {
    let plain = json!({"KHR_materials_iridescence": {"iridescenceFactor": 0.5}});
    assert_eq!(read(&load(&plain)).iridescence, [0.5, 1.3, 400.0]);
    let full = json!({"KHR_materials_iridescence": {"iridescenceFactor": 0.5, "iridescenceIor": 2,
        "iridescenceThicknessMinimum": 200, "iridescenceThicknessMaximum": 700,
        "iridescenceTexture": texture(), "iridescenceThicknessTexture": texture()}});
    near(&read(&load(&full)).iridescence, &[0.5 * R, 2.0, 200.0 + 500.0 * G]);
}

#[test]
fn transmission_volume_and_dispersion_are_read() {
    let thin = json!({"KHR_materials_transmission": {"transmissionFactor": 0.5}});
    let scene = load(&thin);
    let values = read(&scene);
    assert_eq!((values.transmission, values.is_volume), ([0.5, 1.5], false));
    let (table, _) = tables(&scene);
    let media = MediumTable::new(&scene.materials);
    // Rough, so light is scattered by it and does not go straight through.
    assert!(table.has_transmission() && media.transmits() && !media.has_volume() && !media.has_dispersion());
    let thick = json!({
        "KHR_materials_transmission": {"transmissionFactor": 0.5, "transmissionTexture": texture()},
        "KHR_materials_ior": {"ior": 1.25},
        "KHR_materials_dispersion": {"dispersion": 0.5},
        "KHR_materials_volume": {"thicknessFactor": 2, "attenuationColor": [1, 0.5, 0], "attenuationDistance": 4}});
    let scene = two_sets(&thick).set("/materials/0/doubleSided", json!(true)).load().unwrap();
    let values = read(&scene);
    near(&values.transmission, &[0.5 * R, 1.25]);
    assert!(values.is_volume && !material(&scene).double_sided, "boundaries ignore doubleSided");
    let media = MediumTable::new(&scene.materials);
    assert!(media.has_volume() && media.has_dispersion() && !media.has_thin_glass());
    // KHR_materials_dispersion: between the lines F and C the index falls by (n - 1) dispersion / 20.
    let found = dispatch(Level::Scalar, Inside(&media));
    near(&found[..4], &[1.0, 2.0_f32.powf(-0.25), 0.0, 1.25]);
    near(&[found[4] - found[5]], &[0.25 * 0.5 / 20.0]);
}

#[test]
fn diffuse_transmission_is_read_with_its_two_textures() {
    let plain = json!({"KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.5}});
    assert_eq!(read(&load(&plain)).diffuse_transmission, [0.5, 1.0, 1.0, 1.0]);
    let full = json!({"KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.5,
        "diffuseTransmissionColorFactor": [1, 0.5, 0.25],
        "diffuseTransmissionTexture": texture(), "diffuseTransmissionColorTexture": texture()}});
    let wanted = [0.5 * A, SRGB[0], 0.5 * SRGB[1], 0.25 * SRGB[2]];
    near(&read(&load(&full)).diffuse_transmission, &wanted);
}

#[test]
fn specular_glossiness_takes_the_place_of_metallic_roughness() {
    let plain = json!({"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.8, 0.4, 0.2, 0.5],
        "specularFactor": [0.5, 0.25, 0.125], "glossinessFactor": 0.75}});
    let values = read(&load(&plain));
    near(&values.base, &[0.4, 0.2, 0.1]);
    near(&values.f0, &[0.5, 0.25, 0.125]);
    assert_eq!((values.metallic, values.roughness, values.has_extras), (0.0, 0.25, false));
    let mut full = plain.clone();
    full["KHR_materials_pbrSpecularGlossiness"]["diffuseTexture"] = texture();
    full["KHR_materials_pbrSpecularGlossiness"]["specularGlossinessTexture"] = texture();
    let values = read(&load(&full));
    let f0 = [0.5 * SRGB[0], 0.25 * SRGB[1], 0.125 * SRGB[2]];
    let left = 1.0 - f0[2].max(f0[1]).max(f0[0]);
    near(&values.f0, &f0);
    near(&values.base, &[0.8 * SRGB[0] * left, 0.4 * SRGB[1] * left, 0.2 * SRGB[2] * left]);
    near(&[values.roughness], &[1.0 - 0.75 * A]);
    // A file with both: the extension wins, and so over its neighbours that it excludes.
    full["KHR_materials_ior"] = json!({"ior": 3});
    full["KHR_materials_transmission"] = json!({"transmissionFactor": 1});
    let both = two_sets(&full)
        .set(
            "/materials/0/pbrMetallicRoughness",
            json!({"baseColorTexture": {"index": 99}, "metallicRoughnessTexture": {"index": 99}}),
        )
        .set("/materials/0/alphaMode", json!("BLEND"))
        .load()
        .unwrap();
    assert!(read(&both).is_near(&values));
    let m = material(&both);
    assert_eq!((m.alpha_mode, m.opacity.factor), (AlphaMode::Blend, 0.5));
    assert!(m.opacity.texture.is_some(), "opacity is the diffuse colour's alpha");
    let skipped: Vec<&str> = both.skipped.iter().map(|s| s.what.trim_start_matches("materials/0/")).collect();
    let expected = [
        "pbrMetallicRoughness/baseColorTexture",
        "pbrMetallicRoughness/metallicRoughnessTexture",
        "extensions/KHR_materials_ior",
        "extensions/KHR_materials_transmission",
    ];
    assert_eq!(skipped, expected);
    // Its defaults: white, a mirror.
    let default = read(&load(&json!({"KHR_materials_pbrSpecularGlossiness": {}})));
    assert_eq!((default.base, default.f0, default.roughness), ([0.0; 3], [1.0; 3], 0.0));
}

#[test]
fn disney_parameters_are_read_from_extras() {
    let with = |extras: Value| sample(&json!({})).set("/materials/0/extras", extras).load().unwrap();
    let scene =
        with(json!({"prt_disney": 1, "prt_subsurface": 0.125, "prt_specular": 0.25, "prt_specular_tint": 0.375,
        "prt_anisotropic": 0.5, "prt_sheen": 0.625, "prt_sheen_tint": 0.75, "prt_clearcoat": 0.875,
        "prt_clearcoat_gloss": 0.0625, "note": "anything"}));
    let all = [0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 0.0625];
    assert_eq!((read(&scene).disney, scene.warnings.len()), (Some(all), 0));
    assert!(scene.meshes[0].tangents.is_some(), "its highlight is stretched");
    // Blender writes booleans too.
    let scene = with(json!({"prt_disney": true}));
    let defaults = [0.0, 0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 1.0];
    assert_eq!((read(&scene).disney, material(&scene).disney), (Some(defaults), Some(Disney::default())));
    for off in [json!({"prt_disney": 0}), json!({"prt_specular": 1}), json!("prt_disney"), json!([1])] {
        let scene = with(off);
        assert!(material(&scene).disney.is_none() && !read(&scene).has_extras);
    }
    // What the model has no place for is not opened.
    let coat = json!({"KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatTexture": {"index": 99}}});
    let scene = sample(&coat).set("/materials/0/extras", json!({"prt_disney": 1})).load().unwrap();
    assert_eq!(scene.skipped[0].what, "materials/0/extensions/KHR_materials_clearcoat/clearcoatTexture");
    assert_eq!(read(&scene).coat, [0.0; 2]);
    let typo = with(json!({"prt_disney": 1, "prt_sheeen": 1}));
    assert!(typo.warnings[0].contains("prt_sheeen") && typo.warnings[0].contains("prt_sheen_tint"));
}

/// Extensions that say nothing.
fn nulls() -> Value {
    json!({
        "KHR_materials_clearcoat": {"clearcoatFactor": 0, "clearcoatRoughnessFactor": 1,
            "clearcoatTexture": {"index": 99}, "clearcoatNormalTexture": {"index": 99}},
        "KHR_materials_sheen": {"sheenColorFactor": [0, 0, 0], "sheenRoughnessFactor": 1,
            "sheenColorTexture": {"index": 99}},
        "KHR_materials_anisotropy": {"anisotropyStrength": 0, "anisotropyRotation": 1,
            "anisotropyTexture": {"index": 99}},
        "KHR_materials_iridescence": {"iridescenceFactor": 0, "iridescenceThicknessTexture": {"index": 99}},
        "KHR_materials_transmission": {"transmissionFactor": 0, "transmissionTexture": {"index": 99}},
        "KHR_materials_diffuse_transmission": {"diffuseTransmissionColorTexture": {"index": 99}},
        "KHR_materials_volume": {"thicknessFactor": 1, "attenuationColor": [0.5, 0.5, 0.5], "attenuationDistance": 1},
        "KHR_materials_dispersion": {"dispersion": 1}})
}

#[test]
fn bsdf_14_null_features_are_absent_to_the_bit() {
    let picture = |extensions: &Value| {
        let scene = sample(extensions).load().unwrap();
        assert!(scene.warnings.is_empty() && scene.textures.is_empty(), "{:?}", scene.warnings);
        let (table, _) = tables(&scene);
        assert!(!table.has_extras() && !table.has_coat() && !table.has_anisotropy() && !table.has_volume());
        assert!(scene.meshes[0].tangents.is_none());
        let settings = RenderSettings {
            width: 12,
            height: 12,
            spp: 4,
            accel: AccelChoice::Bvh,
            default_light: DefaultLight::On,
            ..RenderSettings::default()
        };
        let frame = render(&scene, 0, &settings, &Progress::default()).unwrap();
        frame.pixels.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>()
    };
    let plain = picture(&json!({}));
    assert!(plain == picture(&nulls()), "all of them");
    assert!(plain.iter().any(|p| *p != plain[0]), "the picture shows something");
}

#[test]
fn null_features_are_listed_as_skipped() {
    let scene = sample(&nulls()).load().unwrap();
    let why: Vec<&str> = scene.skipped.iter().map(|s| s.why.as_str()).collect();
    for part in [
        "clearcoatFactor is 0",
        "sheenColorFactor is 0",
        "anisotropyStrength is 0",
        "iridescenceFactor is 0",
        "transmissionFactor is 0",
        "diffuseTransmissionFactor is 0",
        "neither transmission nor diffuse transmission",
        "only volumes with transmission refract",
    ] {
        assert!(why.iter().any(|w| w.contains(part)), "{part}: {why:?}");
    }
}

#[test]
fn unlit_material_has_no_features() {
    let mut full = nulls();
    full["KHR_materials_unlit"] = json!({});
    full["KHR_materials_clearcoat"]["clearcoatFactor"] = json!(1);
    full["KHR_materials_transmission"]["transmissionFactor"] = json!(1);
    full["KHR_materials_pbrSpecularGlossiness"] = json!({"diffuseFactor": [0.5, 0.5, 0.5, 1]});
    let scene = load(&full);
    let values = read(&scene);
    assert!(!values.has_extras && material(&scene).interior().is_none());
    assert_eq!(values.base, [0.5; 3], "as it is");
}

#[test]
fn lane_does_not_depend_on_its_neighbours() {
    let mut coat = json!({"KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25}});
    for slot in ["clearcoatTexture", "clearcoatRoughnessTexture", "clearcoatNormalTexture"] {
        coat["KHR_materials_clearcoat"][slot] = texture();
    }
    let all = [
        json!({}),
        coat,
        json!({"KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1], "sheenColorTexture": texture()}}),
        json!({"KHR_materials_anisotropy": {"anisotropyStrength": 1, "anisotropyTexture": texture()}}),
        json!({"KHR_materials_iridescence": {"iridescenceFactor": 1, "iridescenceThicknessTexture": texture()}}),
        json!({"KHR_materials_transmission": {"transmissionFactor": 1, "transmissionTexture": texture()},
            "KHR_materials_volume": {"thicknessFactor": 1, "attenuationColor": [0.5, 1, 1], "attenuationDistance": 1}}),
        json!({"KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 1,
            "diffuseTransmissionColorTexture": texture()}}),
        json!({"KHR_materials_pbrSpecularGlossiness": {"specularGlossinessTexture": texture()}}),
    ];
    let mut file = sample(&all[0]);
    for extensions in &all[1..] {
        file = file.set("/materials/-", json!({ "extensions": extensions }));
        let i = file.json["materials"].as_array().unwrap().len() - 1;
        let mut primitive = file.json["meshes"][0]["primitives"][0].clone();
        primitive["material"] = json!(i);
        file = file.set("/meshes/0/primitives/-", primitive);
    }
    let scene = file.load().unwrap();
    let (table, textures) = tables(&scene);
    let materials: Vec<u32> = (0..all.len() as u32).collect();
    for level in [Level::Avx2, Level::Avx512].into_iter().filter(|level| level.is_available()) {
        let together = dispatch(level, Probe { table: &table, textures: &textures, materials: &materials });
        for (i, mut values) in together.into_iter().enumerate() {
            let mut alone = dispatch(level, Probe { table: &table, textures: &textures, materials: &[i as u32] });
            // Whether there are extras at all is the vector's matter; what they hold for a lane without any is not read.
            let mut alone = alone.remove(0);
            if !alone.has_extras {
                assert_eq!((values.coat, values.transmission[0], values.is_volume), ([0.0; 2], 0.0, false));
                (values.anisotropy, values.iridescence) = ([0.0; 3], [0.0; 3]);
                (values.transmission, values.diffuse_transmission) = ([0.0; 2], [0.0; 4]);
            }
            (values.has_extras, alone.has_extras) = (true, true);
            assert_eq!(values, alone, "material {i}");
        }
    }
}

#[test]
fn extensions_that_a_file_requires_are_read() {
    let names = [
        "anisotropy",
        "clearcoat",
        "diffuse_transmission",
        "dispersion",
        "iridescence",
        "pbrSpecularGlossiness",
        "sheen",
        "transmission",
        "variants",
        "volume",
    ]
    .map(|name| format!("KHR_materials_{name}"));
    let scene = Sample::new().set("/extensionsUsed", json!(names)).set("/extensionsRequired", json!(names)).load();
    assert!(scene.unwrap().warnings.is_empty());
}

#[test]
fn channels_that_a_slot_does_not_read_are_not_kept() {
    use prt::texture::Channels;
    let scene = load(&json!({"KHR_materials_iridescence": {"iridescenceFactor": 1, "iridescenceTexture": texture(),
        "iridescenceThicknessTexture": texture()}}));
    let used = |scene: &Scene| -> Vec<Channels> {
        material(scene).channels().into_iter().map(|(_, channels)| channels).skip(1).collect()
    };
    assert_eq!(used(&scene), [Channels::R, Channels::G]);
    let glossy = json!({"KHR_materials_pbrSpecularGlossiness": {"specularGlossinessTexture": texture()}});
    let all: Vec<Channels> = material(&load(&glossy)).channels().into_iter().map(|(_, channels)| channels).collect();
    assert_eq!(all, [Channels::A, Channels::RGB, Channels::RGB], "glossiness, emission, specular");
}

/// Khronos' sample assets of the extensions, as far as they are there.
#[test]
fn sample_assets_load_whole_and_have_what_they_are_named_for() {
    type Has = fn(&Material) -> bool;
    let assets: [(&str, Has); 9] = [
        ("AnisotropyStrengthTest", Material::has_anisotropy),
        ("AnisotropyDiscTest", Material::has_anisotropy),
        ("AttenuationTest", |m| m.interior().is_some_and(|v| v.absorption() != [0.0; 3])),
        ("ClearCoatTest", Material::has_coat),
        ("ClearCoatCarPaint", Material::has_coat),
        ("DispersionTest", Material::has_dispersion),
        ("IridescenceSuzanne", Material::has_iridescence),
        ("SheenChair", Material::has_sheen),
        ("TransmissionTest", Material::has_transmission),
    ];
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets");
    for (name, has) in assets {
        let mut folders = vec![folder.join(name)];
        let mut files = 0;
        while let Some(folder) = folders.pop() {
            for path in std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
                    let (scene, _) = prt::load::load(&path, &prt::load::LoadOptions::default()).unwrap();
                    assert!(scene.losses.is_empty(), "{}: {:?}", path.display(), scene.losses);
                    assert!(scene.materials.iter().any(has), "{}", path.display());
                    files += 1;
                }
            }
        }
        if files == 0 {
            println!("skipped: no {name} below {}", folder.display());
        }
    }
}
