//! Every bad input gets a message that says where, what, what is allowed. Each case is one change to a file that loads.

mod gltf_support;

use gltf_support::{Sample, base64, load_bytes, png};
use prt::load::{LoadOptions, load};
use serde_json::{Value, json};
use std::path::Path;
use tempfile::TempDir;

/// The place must be exactly `place`; the text must have each of `parts`.
#[track_caller]
fn expect(error: &prt::error::LoadError, place: &str, parts: &[&str]) {
    let text = error.to_string();
    assert_eq!(error.at.place, place, "{text}");
    for part in parts {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
}

/// One value changed.
#[track_caller]
fn case(pointer: &str, value: Value, place: &str, parts: &[&str]) {
    expect(&Sample::new().set(pointer, value).error(), place, parts);
}

/// One value changed; the error is at that very place.
#[track_caller]
fn at(pointer: &str, value: Value, parts: &[&str]) {
    case(pointer, value, pointer, parts);
}

const PRIMITIVE: &str = "/meshes/0/primitives/0";

#[test]
fn missing_and_empty_files_and_folders() {
    let dir = TempDir::new().unwrap();
    let options = LoadOptions::default();
    let error = load(&dir.path().join("none.gltf"), &options).unwrap_err();
    expect(&error, "", &["none.gltf", "No such file"]);
    let folder = dir.path().join("folder.gltf");
    std::fs::create_dir(&folder).unwrap();
    expect(&load(&folder, &options).unwrap_err(), "", &["not a regular file"]);
    for name in ["a.gltf", "a.glb"] {
        expect(&load_bytes(name, b"").unwrap_err(), "", &["0 bytes"]);
    }
    expect(&load_bytes("a.xyz", b"{}").unwrap_err(), "", &[".gltf, .glb"]);
}

#[test]
fn damaged_glb_containers() {
    let glb = Sample::new().glb();
    let word = |at: usize, value: u32| {
        let mut bytes = glb.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        load_bytes("a.glb", &bytes).unwrap_err()
    };
    expect(&word(0, 0), "byte 0", &["\\x00\\x00\\x00\\x00", "glTF"]);
    expect(&word(4, 1), "byte 4", &["version 1", "version 2"]);
    expect(&word(8, 1 << 30), "byte 8", &["length 1073741824", "cut short"]);
    expect(&word(12, u32::MAX), "byte 12", &["chunk 0 has length 4294967295"]);
    expect(&word(16, 7), "byte 16", &["type 0x00000007", "JSON"]);
    expect(&load_bytes("a.glb", &glb[..7]).unwrap_err(), "byte 7", &["7 of 12 bytes"]);
    for n in (1..glb.len()).step_by(97) {
        assert!(load_bytes("a.glb", &glb[..n]).is_err(), "{n} bytes");
    }
    let no_bin = Sample::new().remove("/buffers/0/uri");
    expect(&no_bin.error(), "/buffers/0", &["no uri", "BIN chunk"]);
    let longer = Sample::new().set("/buffers/0/byteLength", json!(100_000)).glb();
    expect(&load_bytes("a.glb", &longer).unwrap_err(), "/buffers/0/byteLength", &["100000", "has"]);
}

#[test]
fn json_cut_short_or_wrong_says_line_and_column() {
    expect(&load_bytes("a.gltf", b"{\n  \"asset\": {").unwrap_err(), "2:12", &["ends too early"]);
    expect(&load_bytes("a.gltf", b"{\n  \"asset\" 2").unwrap_err(), "2:11", &["not JSON"]);
    let text = br#"{"asset":{"version":"2.0"},"nodes":[{"mesh":-1}]}"#;
    expect(&load_bytes("a.gltf", text).unwrap_err(), "1:46", &["-1"]);
    expect(&load_bytes("a.gltf", b"{}").unwrap_err(), "1:2", &["asset"]);
}

#[test]
fn versions_and_required_extensions() {
    at("/asset/version", json!("1.0"), &["\"1.0\"", "glTF 2"]);
    at("/asset/version", json!("two"), &["\"two\""]);
    at("/asset/minVersion", json!("2.1"), &["\"2.1\""]);
    for name in ["KHR_texture_basisu", "KHR_draco_mesh_compression", "ACME_x"] {
        case("/extensionsRequired", json!(["KHR_materials_specular", name]), "/extensionsRequired/1", &[name]);
    }
}

#[test]
fn indices_out_of_range() {
    at("/scene", json!(2), &["2 is not an index into scenes", "0 to 1"]);
    at("/scenes/0/nodes/0", json!(3), &["0 to 2"]);
    at("/nodes/0/mesh", json!(1), &["meshes", "only 0"]);
    at("/nodes/0/skin", json!(0), &["no skins"]);
    at("/nodes/1/camera", json!(4), &["4", "cameras"]);
    at("/nodes/2/extensions/KHR_lights_punctual/light", json!(1), &["lights"]);
    case("/nodes/0/children", json!([9]), "/nodes/0/children/0", &["9"]);
    at("/meshes/0/primitives/0/material", json!(1), &["materials"]);
    at("/meshes/0/primitives/0/indices", json!(5), &["accessors", "0 to 4"]);
    for name in ["POSITION", "NORMAL", "TEXCOORD_0", "TANGENT"] {
        at(&format!("{PRIMITIVE}/attributes/{name}"), json!(77), &["77", "accessors"]);
    }
    at("/accessors/0/bufferView", json!(6), &["bufferViews", "0 to 5"]);
    at("/bufferViews/0/buffer", json!(1), &["buffers"]);
    at("/materials/0/normalTexture/index", json!(1), &["textures"]);
    at("/materials/0/pbrMetallicRoughness/baseColorTexture/index", json!(1), &["textures"]);
    at("/textures/0/source", json!(1), &["images"]);
    at("/textures/0/sampler", json!(1), &["samplers"]);
    at("/images/0/bufferView", json!(6), &["bufferViews"]);
    // The gltf crate would cut these to 0.
    at("/nodes/0/mesh", json!(1_u64 << 32), &["4294967296"]);
    at("/scenes/0/nodes/0", json!(1_u64 << 32), &["4294967296"]);
    at("/meshes/0/primitives/0/attributes/POSITION", json!(1_u64 << 32), &["4294967296"]);
    expect(&Sample::new().remove("/images/0/bufferView").error(), "/images/0", &["no uri"]);
}

#[test]
fn vertex_indices_beyond_the_vertices() {
    let error = Sample::new().poke(192 + 4, &4_u16.to_le_bytes()).error();
    expect(&error, "/meshes/0/primitives/0/indices", &["element 2", "is 4", "0 to 3"]);
    let error = Sample::new().poke(192, &u16::MAX.to_le_bytes()).error();
    expect(&error, "/meshes/0/primitives/0/indices", &["is 65535"]);
}

#[test]
fn nodes_that_are_not_trees() {
    case("/nodes/0/children", json!([0]), "/nodes/0/children", &["node 0 is its own descendant"]);
    let cycle = Sample::new().set("/nodes/0/children", json!([1])).set("/nodes/1/children", json!([0]));
    expect(&cycle.error(), "/nodes/0/children", &["its own descendant"]);
    let two = Sample::new().set("/nodes/0/children", json!([2])).set("/nodes/1/children", json!([2]));
    expect(&two.error(), "/nodes/1/children/0", &["node 2 already is a child of node 0"]);
    case("/nodes/0/children", json!([1]), "/scenes/0/nodes/1", &["node 1 is a child of node 0"]);
    at("/scenes/0/nodes/1", json!(0), &["listed twice"]);
}

#[test]
fn uris_outside_the_folder_are_refused() {
    for uri in [
        "../secret.bin",
        "%2e%2e/secret.bin",
        "a/../../secret.bin",
        "..",
        "/etc/passwd",
        "%2Fetc/passwd",
        "file:///etc/passwd",
        "http://example.org/a.bin",
        "C:/a.bin",
        "C%3A/a.bin",
        "//host/a.bin",
        "",
    ] {
        at("/buffers/0/uri", json!(uri), &["--asset-root", uri]);
    }
    at("/buffers/0/uri", json!("..\\secret.bin"), &["backslash"]);
    at("/buffers/0/uri", json!("a%zz.bin"), &["%", "%25"]);
    at("/buffers/0/uri", json!("a%00.bin"), &["zero byte"]);
    at("/buffers/0/uri", json!("missing.bin"), &["missing.bin", "No such file"]);
    at("/buffers/0/uri", json!("."), &["not a regular file"]);
    let image = Sample::new().set("/images/0", json!({"uri": "../secret.png"}));
    expect(&image.error(), "/images/0/uri", &["--asset-root"]);
    let missing = Sample::new().set("/images/0", json!({"uri": "missing.png"}));
    expect(&missing.error(), "/images/0/uri", &["missing.png"]);
}

#[cfg(unix)]
#[test]
fn link_out_of_the_folder_is_refused() {
    let dir = TempDir::new().unwrap();
    let inner = dir.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    let sample = Sample::new().set("/buffers/0/uri", json!("link.bin"));
    std::fs::write(dir.path().join("outside.bin"), &sample.bin).unwrap();
    std::os::unix::fs::symlink(dir.path().join("outside.bin"), inner.join("link.bin")).unwrap();
    let path = sample.write(&inner);
    let error = load(&path, &LoadOptions::default()).unwrap_err();
    expect(&error, "/buffers/0/uri", &["link that leaves", "--asset-root"]);
    let options = LoadOptions { asset_root: Some(dir.path().into()), ..LoadOptions::default() };
    assert!(load(&path, &options).is_ok());
}

#[test]
fn asset_root_must_exist() {
    let options = LoadOptions { asset_root: Some(Path::new("no-such-folder").into()), ..LoadOptions::default() };
    expect(&Sample::new().load_with(&options).unwrap_err(), "", &["--asset-root no-such-folder"]);
}

#[test]
fn data_uris_that_cannot_be_decoded() {
    case("/buffers/0/uri", json!("data:text/plain,h%20llo"), "/buffers/0/byteLength", &["5 bytes"]);
    at("/buffers/0/uri", json!("data:text/plain,%zz"), &["%"]);
    at("/buffers/0/uri", json!("data:;base64"), &["no comma"]);
    at("/buffers/0/uri", json!("data:;base64,AAA*"), &["'*' at 3"]);
    at("/buffers/0/uri", json!("data:;base64,AAA"), &["multiple of 4"]);
    case("/buffers/0/uri", json!("data:;base64,AAAA"), "/buffers/0/byteLength", &["3 bytes"]);
}

#[test]
fn ranges_past_their_container() {
    at("/buffers/0/byteLength", json!(1_000_000), &["1000000", "cut short"]);
    case("/bufferViews/0/byteLength", json!(100_000), "/bufferViews/0", &["100000", "past the end of buffer 0"]);
    case("/bufferViews/0/byteOffset", json!(u64::MAX), "/bufferViews/0", &["past the end"]);
    case("/accessors/0/count", json!(5), "/accessors/0", &["count 5", "48 bytes"]);
    case("/accessors/0/count", json!(u64::MAX), "/accessors/0", &["past the end"]);
    case("/accessors/0/count", json!(1_u64 << 40), "/accessors/0", &["past the end"]);
    case("/accessors/0/byteOffset", json!(4), "/accessors/0", &["past the end"]);
    case("/accessors/0/byteOffset", json!(u64::MAX - 3), "/accessors/0", &["past the end"]);
}

#[test]
fn strides_and_alignment() {
    at("/bufferViews/0/byteStride", json!(8), &["8", "POSITION", "12 bytes"]);
    at("/bufferViews/0/byteStride", json!(13), &["multiples of 4"]);
    at("/bufferViews/4/byteStride", json!(4), &["indices have no byteStride"]);
    case("/accessors/2/byteOffset", json!(2), "/accessors/2", &["misaligned", "4"]);
    case("/bufferViews/4/byteOffset", json!(191), "/accessors/4", &["misaligned"]);
}

#[test]
fn accessor_types_per_semantic() {
    at("/accessors/0/componentType", json!(5122), &["5122", "POSITION", "KHR_mesh_quantization"]);
    at("/accessors/0/componentType", json!(5124), &["5124", "not a component type"]);
    at("/accessors/0/type", json!("VEC2"), &["\"VEC2\" as POSITION", "VEC3 of float"]);
    at("/accessors/0/type", json!("VEC5"), &["VEC5"]);
    case("/accessors/0/normalized", json!(true), "/accessors/0/normalized", &["true as POSITION"]);
    at("/accessors/1/componentType", json!(5120), &["NORMAL"]);
    at("/accessors/2/componentType", json!(5122), &["TEXCOORD_0"]);
    let unnormalized = Sample::new().set("/accessors/2/componentType", json!(5123));
    expect(&unnormalized.error(), "/accessors/2/normalized", &["false as TEXCOORD_0"]);
    at("/accessors/3/type", json!("VEC3"), &["TANGENT", "VEC4"]);
    at("/accessors/4/componentType", json!(5126), &["indices", "unsigned"]);
    at("/accessors/4/type", json!("VEC3"), &["SCALAR"]);
    case("/accessors/4/normalized", json!(true), "/accessors/4/normalized", &["indices"]);
    case("/accessors/1/count", json!(3), "/meshes/0/primitives/0/attributes/NORMAL", &["3 elements", "has 4"]);
    for component in [5120, 5121, 5122, 5123] {
        at("/accessors/0/componentType", json!(component), &["POSITION", "KHR_mesh_quantization"]);
    }
    let used = Sample::new().set("/extensionsUsed/-", json!("KHR_mesh_quantization"));
    let wrong = used.clone().set("/accessors/1/componentType", json!(5122));
    expect(&wrong.error(), "/accessors/1/normalized", &["false as NORMAL"]);
    expect(&used.set("/accessors/0/componentType", json!(5125)).error(), "/accessors/0/componentType", &["5125"]);
}

#[test]
fn factors_out_of_range() {
    let pbr = "/materials/0/pbrMetallicRoughness";
    at(&format!("{pbr}/metallicFactor"), json!(1.7), &["1.7", "[0, 1]", "percent"]);
    at(&format!("{pbr}/roughnessFactor"), json!(-0.1), &["-0.1"]);
    at(&format!("{pbr}/baseColorFactor"), json!([0, 255, 0, 1]), &["255", "[0, 1]"]);
    at("/materials/0/emissiveFactor", json!([0, -1, 0]), &["at least 0"]);
    at("/materials/0/emissiveFactor", json!([0, 1e39, 0]), &["1e+39", "finite"]);
    at("/materials/0/extensions/KHR_materials_specular/specularFactor", json!(2), &["[0, 1]"]);
    at("/materials/0/extensions/KHR_materials_specular/specularColorFactor", json!([-1, 0, 0]), &["at least 0"]);
    let strength = "/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength";
    at(strength, json!(-2), &["-2"]);
    let light = "/extensions/KHR_lights_punctual/lights/0";
    at(&format!("{light}/intensity"), json!(-1), &["-1", "cd"]);
    at(&format!("{light}/color"), json!([1, -1, 1]), &["[1,-1,1]"]);
    at(&format!("{light}/type"), json!("area"), &["\"area\"", "spot"]);
    at(&format!("{light}/spot"), json!({"innerConeAngle": 0.9}), &["0.9", "pi/2"]);
    at(&format!("{light}/spot"), json!({"innerConeAngle": 0.1, "outerConeAngle": 2}), &["2"]);
    at("/cameras/0/perspective/yfov", json!(45), &["45", "degrees"]);
    at("/cameras/0/perspective/yfov", json!(0), &["0"]);
    at("/cameras/0/perspective/aspectRatio", json!(0), &["positive"]);
    at("/samplers/0/wrapS", json!(1), &["10497"]);
    at("/samplers/0/magFilter", json!(9987), &["9728"]);
    at("/materials/0/alphaMode", json!("SHINY"), &["OPAQUE"]);
}

#[test]
fn transforms_that_are_not() {
    at("/nodes/0/translation", json!([0, 1e39, 0]), &["not finite"]);
    at("/nodes/0/rotation", json!([0, 0, 0, 0]), &["length 0"]);
    at("/nodes/0/matrix", json!([1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]), &["not affine"]);
    let both = Sample::new().set("/nodes/1/matrix", json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]));
    expect(&both.error(), "/nodes/1", &["matrix", "translation"]);
    case("/nodes/1/scale", json!([1, 1, 0]), "/nodes/1", &["no direction"]);
    case("/nodes/2/scale", json!([0, 0, 0]), "/nodes/2", &["no direction"]);
}

#[test]
fn what_is_not_built_is_named() {
    at(&format!("{PRIMITIVE}/mode"), json!(9), &["9", "0 to 6"]);
}

#[test]
fn images_that_cannot_be_used() {
    let image = |bytes: &[u8]| {
        let uri = format!("data:application/octet-stream;base64,{}", base64(bytes));
        Sample::new().set("/images/0", json!({"uri": uri})).error()
    };
    let whole = png(&[7; 4 * 64], 8, 8);
    expect(&image(b""), "/images/0/uri", &["0 bytes"]);
    expect(&image(&whole[..whole.len() - 20]), "/images/0/uri", &["PNG cannot be decoded"]);
    expect(&image(b"RIFF....WEBPVP8 "), "/images/0/uri", &["WebP cannot be decoded"]);
    expect(&image(b"\xabKTX 20\xbb"), "/images/0/uri", &["KTX2", "PNG, JPEG and WebP"]);
    expect(&image(b"hello"), "/images/0/uri", &["hello"]);
    at("/images/0/mimeType", json!("image/ktx2"), &["image/ktx2", "image/png"]);
    case("/images/0/uri", json!("a.png"), "/images/0", &["both"]);
}
