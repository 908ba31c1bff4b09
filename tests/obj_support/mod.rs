//! Small OBJ files on disk for the tests of the loader.
// Every test target compiles this module anew and uses its own part of it.
#![allow(dead_code)]

use prt::error::LoadError;
use prt::load::{LoadOptions, load};
use prt::scene::Scene;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Files in a folder of their own.
pub struct Files(pub TempDir);

impl Files {
    /// `m.obj` with `obj`, and whatever else is named.
    pub fn new(obj: impl AsRef<[u8]>, others: &[(&str, &[u8])]) -> Self {
        let files = Self(TempDir::new().unwrap());
        files.write("m.obj", obj.as_ref());
        others.iter().for_each(|(name, bytes)| files.write(name, bytes));
        files
    }

    pub fn write(&self, name: &str, bytes: &[u8]) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn load(&self) -> Result<Scene, LoadError> {
        self.load_with(&LoadOptions::default())
    }

    pub fn load_with(&self, options: &LoadOptions) -> Result<Scene, LoadError> {
        load(&self.path("m.obj"), options).map(|(scene, _)| scene)
    }
}

/// Loads an OBJ without other files.
pub fn load_obj(obj: impl AsRef<[u8]>) -> Result<Scene, LoadError> {
    Files::new(obj, &[]).load()
}

/// One triangle of the material `a`, with texture coordinates, and an MTL file that says `mtl` about it.
pub fn with_mtl(mtl: impl AsRef<[u8]>, others: &[(&str, &[u8])]) -> Files {
    let files = Files::new(
        "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n",
        others,
    );
    files.write("m.mtl", &[b"newmtl a\n", mtl.as_ref()].concat());
    files
}

/// An RGBA PNG.
pub fn png(texels: &[[u8; 4]], width: u32) -> Vec<u8> {
    use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
    let mut out = Vec::new();
    let height = texels.len() as u32 / width;
    PngEncoder::new(&mut out).write_image(texels.as_flattened(), width, height, ExtendedColorType::Rgba8).unwrap();
    out
}

/// Every `.obj` below a folder, sorted.
pub fn obj_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}
