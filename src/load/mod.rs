//! Files to [`Scene`]s, by extension.

pub mod gltf;
mod tangents;

use crate::error::{LoadError, SourceLoc};
use crate::scene::Scene;
use std::path::{Path, PathBuf};

/// How a file is read.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Files may be read below this folder instead of only below the input's own.
    pub asset_root: Option<PathBuf>,
    /// Which scene of the file: an index or a name; `None` = the file's default.
    pub scene: Option<String>,
}

/// Times of one load, seconds of wall clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct LoadTimes {
    /// Reading and checking everything but pictures.
    pub load: f64,
    /// Decoding pictures.
    pub decode: f64,
}

/// Reads `path` into a scene.
///
/// # Errors
/// Whatever is wrong with the file, with its place; whatever it requires that is not built, by name.
pub fn load(path: &Path, options: &LoadOptions) -> Result<(Scene, LoadTimes), LoadError> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("gltf" | "glb") => gltf::load(path, options),
        _ => Err(LoadError::new(SourceLoc::file(path), "not a scene file", "Allowed: .gltf, .glb.")),
    }
}
