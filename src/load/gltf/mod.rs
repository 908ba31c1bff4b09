//! glTF 2.0.

use super::{LoadOptions, LoadTimes};
use crate::error::{LoadError, SourceLoc};
use crate::scene::Scene;
use std::path::Path;

/// Reads a `.gltf` or `.glb` file.
///
/// # Errors
/// See [`super::load`].
pub fn load(path: &Path, _options: &LoadOptions) -> Result<(Scene, LoadTimes), LoadError> {
    Err(LoadError::new(SourceLoc::file(path), "not built", ""))
}
