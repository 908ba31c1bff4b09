//! Scenes of the tests: the reference scenes on disk, and small ones built by `prt::verify::light::build`.

use prt::load::{LoadOptions, load};
use prt::scene::Scene;
pub use prt::verify::light::build::*;
use std::path::PathBuf;

/// The reference scenes, each a folder of `tests/data/reference`.
pub const REFERENCE: [&str; 7] =
    ["sun_plane", "point_plane", "quad_plane", "furnace", "furnace_closed", "cornell", "punctual"];

/// Folder of a reference scene.
pub fn reference_folder(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/reference").join(name)
}

/// Loads a reference scene.
pub fn reference(name: &str) -> Scene {
    let path = reference_folder(name).join(format!("{name}.gltf"));
    load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).0
}
