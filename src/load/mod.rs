//! Files to [`Scene`]s, by extension.

mod environment;
mod estimate;
mod folders;
pub mod gltf;
mod moment;
pub mod obj;
mod source;
mod tangents;

pub use environment::load_environment;
pub use estimate::{LoadEstimate, estimate};
pub use folders::Folders;
pub use moment::{AnimationChoice, Moment, ShutterPosition};
pub use source::{SceneSource, animation_seconds};

use crate::camera::Camera;
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
    /// glTF: the name of one of the file's variants of materials (`KHR_materials_variants`); `None` = its own materials.
    pub variant: Option<String>,
    /// glTF: the name of a node on which lenses are to be focused, whose place becomes [`Scene::focus`].
    pub focus_on: Option<String>,
    /// OBJ: which axis points up.
    pub obj_up: obj::ObjUp,
    /// OBJ: metres per unit, above 0; `None` = 1.
    pub obj_scale: Option<f64>,
    /// OBJ: where the file gives no normals, edges whose faces make less than this many degrees are smooth, in place of
    /// the file's smoothing groups.
    pub smooth_angle: Option<f32>,
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
        Some("obj") if options.focus_on.is_some() => Err(LoadError::new(
            SourceLoc::file(path),
            "--focus-on: an OBJ has no nodes",
            "Use --focus-distance, in metres.",
        )),
        Some("obj") => obj::load(path, options),
        _ => Err(LoadError::new(SourceLoc::file(path), "not a scene file", "Allowed: .gltf, .glb, .obj.")),
    }
}

/// The cameras of `path`'s default scene, in the order of the file (perhaps none), without reading anything else of it.
///
/// # Errors
/// The file is not of a kind that holds cameras, or is wrong as far as it had to be read.
pub fn load_cameras(path: &Path) -> Result<Vec<Camera>, LoadError> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("gltf" | "glb") => gltf::load_cameras(path),
        _ => Err(LoadError::new(SourceLoc::file(path), "not a file that holds cameras", "Allowed: .gltf, .glb.")),
    }
}
