//! A small glTF file with one of everything that is read, to be changed by tests.
// Each test file is a crate of its own and uses a part of this.
#![allow(dead_code)]

use prt::error::LoadError;
use prt::load::{LoadOptions, load};
use prt::scene::Scene;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A file before it is written.
#[derive(Clone)]
pub struct Sample {
    /// The JSON, with `scene.bin` as buffer 0.
    pub json: Value,
    /// The bytes of buffer 0.
    pub bin: Vec<u8>,
}

/// A unit square in the plane z = 0, front towards +z, as two triangles.
pub const POSITIONS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// v = 0 at the top.
pub const UVS: [[f32; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
/// Counter-clockwise.
pub const INDICES: [u16; 6] = [0, 1, 2, 0, 2, 3];

impl Sample {
    /// Views: 0 positions, 1 normals, 2 uvs, 3 tangents, 4 indices, 5 a PNG. Accessors likewise but for the PNG.
    pub fn new() -> Self {
        let float = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let parts = [
            float(POSITIONS.as_flattened()),
            float([[0.0_f32, 0.0, 1.0]; 4].as_flattened()),
            float(UVS.as_flattened()),
            float([[1.0_f32, 0.0, 0.0, 1.0]; 4].as_flattened()),
            INDICES.iter().flat_map(|v| v.to_le_bytes()).collect(),
            png(&[255, 0, 0, 255, 0, 255, 0, 255], 2, 1),
        ];
        let mut bin = Vec::new();
        let mut views = Vec::new();
        for part in &parts {
            views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": part.len()}));
            bin.extend(part);
        }
        let accessor = |view: usize, component: u32, kind: &str, count: usize| json!({"bufferView": view, "componentType": component, "type": kind, "count": count});
        let json = json!({
            "asset": {"version": "2.0"},
            "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_specular", "KHR_materials_emissive_strength"],
            "scene": 0,
            "scenes": [{"name": "main", "nodes": [0, 1, 2]}, {"name": "other", "nodes": []}],
            "nodes": [
                {"name": "square", "mesh": 0},
                {"name": "eye", "camera": 0, "translation": [0.0, 0.0, 5.0]},
                {"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}}
            ],
            "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}],
            "extensions": {"KHR_lights_punctual": {"lights": [
                {"type": "spot", "intensity": 10.0, "color": [1.0, 0.5, 0.25], "spot": {}}]}},
            "meshes": [{"primitives": [{
                "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TANGENT": 3},
                "indices": 4, "material": 0}]}],
            "materials": [{
                "name": "all",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.1, 0.2, 0.3, 1.0], "metallicFactor": 0.4, "roughnessFactor": 0.5,
                    "baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0}},
                "normalTexture": {"index": 0, "scale": 0.7},
                "emissiveFactor": [1.0, 0.5, 0.0],
                "doubleSided": true,
                "extensions": {
                    "KHR_materials_specular": {"specularFactor": 0.6, "specularColorFactor": [1.0, 2.0, 3.0]},
                    "KHR_materials_emissive_strength": {"emissiveStrength": 20.0}}}],
            "textures": [{"source": 0, "sampler": 0}],
            "samplers": [{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}],
            "images": [{"bufferView": 5, "mimeType": "image/png"}],
            "bufferViews": views,
            "accessors": [
                accessor(0, 5126, "VEC3", 4), accessor(1, 5126, "VEC3", 4), accessor(2, 5126, "VEC2", 4),
                accessor(3, 5126, "VEC4", 4), accessor(4, 5123, "SCALAR", 6)],
            "buffers": [{"uri": "scene.bin", "byteLength": bin.len()}]
        });
        Self { json, bin }
    }

    /// Sets the value at a JSON pointer; the last part may be new, and `-` appends.
    pub fn set(mut self, pointer: &str, value: Value) -> Self {
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        match self.json.pointer_mut(parent).unwrap_or_else(|| panic!("{parent} exists")) {
            Value::Object(map) => {
                map.insert(key.into(), value);
            }
            Value::Array(list) if key == "-" => list.push(value),
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            _ => panic!("{parent} holds nothing"),
        }
        self
    }

    /// Removes a key of an object.
    pub fn remove(mut self, pointer: &str) -> Self {
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        self.json.pointer_mut(parent).unwrap().as_object_mut().unwrap().remove(key).expect("was there");
        self
    }

    /// Appends a view with `bytes`; its index.
    pub fn add_view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        self.bin.extend(bytes);
        self.json["buffers"][0]["byteLength"] = json!(self.bin.len());
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(view);
        views.len() - 1
    }

    /// Appends an accessor to a view of its own; its index.
    pub fn add_accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.add_view(bytes);
        self.add(json!({"bufferView": view, "componentType": component, "type": kind, "count": count}))
    }

    /// Appends an accessor; its index.
    pub fn add(&mut self, accessor: Value) -> usize {
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(accessor);
        accessors.len() - 1
    }

    /// Overwrites bytes of buffer 0.
    pub fn poke(mut self, at: usize, bytes: &[u8]) -> Self {
        self.bin[at..at + bytes.len()].copy_from_slice(bytes);
        self
    }

    /// As a binary file.
    pub fn glb(&self) -> Vec<u8> {
        let mut root = self.json.clone();
        root["buffers"][0].as_object_mut().unwrap().remove("uri");
        let mut text = root.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let total = 12 + 8 + text.len() + 8 + bin.len();
        let mut out = Vec::from(*b"glTF");
        let words = |out: &mut Vec<u8>, w: [u32; 2]| w.iter().for_each(|w| out.extend(w.to_le_bytes()));
        words(&mut out, [2, total as u32]);
        words(&mut out, [text.len() as u32, 0x4E4F_534A]);
        out.extend(text);
        words(&mut out, [bin.len() as u32, 0x004E_4942]);
        out.extend(bin);
        out
    }

    /// Writes `scene.gltf` and `scene.bin`.
    pub fn write(&self, dir: &Path) -> PathBuf {
        std::fs::write(dir.join("scene.bin"), &self.bin).unwrap();
        let path = dir.join("scene.gltf");
        std::fs::write(&path, self.json.to_string()).unwrap();
        path
    }

    /// Loads it from a folder of its own.
    pub fn load(&self) -> Result<Scene, LoadError> {
        self.load_with(&LoadOptions::default())
    }

    /// Loads it with options.
    pub fn load_with(&self, options: &LoadOptions) -> Result<Scene, LoadError> {
        let dir = TempDir::new().unwrap();
        load(&self.write(dir.path()), options).map(|(scene, _)| scene)
    }

    /// The error of loading it.
    pub fn error(&self) -> LoadError {
        self.load().expect_err("must not load")
    }
}

/// Little-endian bytes of floats.
pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A PNG of 8-bit RGBA pixels.
pub fn png(pixels: &[u8], width: u32, height: u32) -> Vec<u8> {
    use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
    let mut out = Vec::new();
    PngEncoder::new(&mut out).write_image(pixels, width, height, ExtendedColorType::Rgba8).unwrap();
    out
}

/// Loads bytes written under `name`.
pub fn load_bytes(name: &str, bytes: &[u8]) -> Result<Scene, LoadError> {
    let dir = TempDir::new().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    load(&path, &LoadOptions::default()).map(|(scene, _)| scene)
}

/// Padded base64.
pub fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for chunk in bytes.chunks(3) {
        let bits = chunk.iter().enumerate().fold(0_u32, |acc, (i, &b)| acc | u32::from(b) << (16 - 8 * i));
        for i in 0..4 {
            let c = if i <= chunk.len() { ALPHABET[(bits >> (18 - 6 * i) & 63) as usize] } else { b'=' };
            out.push(c as char);
        }
    }
    out
}
