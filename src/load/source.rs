//! A file that scenes are read from: one as it is written, or one for each moment of an animation, which share what does
//! not change.

use super::moment::{AnimationChoice, Moment};
use super::{LoadOptions, LoadTimes, gltf, load};
use crate::error::LoadError;
use crate::scene::Scene;
use std::path::{Path, PathBuf};

/// An animated file.
pub struct SceneSource(Kind);

enum Kind {
    Gltf(Box<gltf::File>),
    /// Nothing moves in it: the scene, once it was read.
    Still(PathBuf, LoadOptions, Option<Box<Scene>>),
}

impl SceneSource {
    /// Opens `path` for the animations that `choice` names.
    ///
    /// # Errors
    /// What is wrong with the file as a whole, with its place; an animation that it does not have.
    pub fn open(path: &Path, options: &LoadOptions, choice: &AnimationChoice) -> Result<Self, LoadError> {
        Ok(Self(match is_gltf(path) {
            true => Kind::Gltf(Box::new(gltf::File::open(path, options, Some(choice))?)),
            false => Kind::Still(path.to_owned(), options.clone(), None),
        }))
    }

    /// The time of the last key of the chosen animations, seconds; 0 where nothing is animated.
    pub fn seconds(&self) -> f64 {
        match &self.0 {
            Kind::Gltf(file) => file.seconds(),
            Kind::Still(..) => 0.0,
        }
    }

    /// The scene at a moment. As at its opening, with what moves until it closes in [`Scene::motion`].
    ///
    /// # Errors
    /// Whatever is wrong with the file, with its place.
    pub fn at(&mut self, moment: &Moment) -> Result<(Scene, LoadTimes), LoadError> {
        match &mut self.0 {
            Kind::Gltf(file) => file.scene(Some(moment)),
            Kind::Still(_, _, Some(scene)) => Ok(((**scene).clone(), LoadTimes::default())),
            Kind::Still(path, options, scene) => {
                let (mut read, times) = load(path, options)?;
                read.warnings.push("an OBJ has no animation: every frame is the same".into());
                Ok((scene.insert(Box::new(read)).as_ref().clone(), times))
            }
        }
    }
}

/// The time of the last key of the animations that `choice` names, seconds; `None` where that cannot be told, because the
/// file is wrong.
pub fn animation_seconds(path: &Path, options: &LoadOptions, choice: &AnimationChoice) -> Option<f64> {
    match is_gltf(path) {
        true => gltf::animation_seconds(path, options, choice).ok(),
        false => Some(0.0),
    }
}

fn is_gltf(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    matches!(extension.as_deref(), Some("gltf" | "glb"))
}
