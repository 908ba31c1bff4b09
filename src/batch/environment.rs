//! The environment of every input, in place of its own.

use super::content::{Content, HashCache, content_of};
use crate::light::Environment;
use crate::load::load_environment;
use crate::scene::{Scene, Skipped, SourceFile};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A map and how it is turned.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentSource {
    /// Radiance HDR or OpenEXR.
    pub path: PathBuf,
    /// Degrees counter-clockwise about +Y seen from above.
    pub rotate: f64,
    /// Factor on its radiance, >= 0.
    pub scale: f64,
}

/// What pixels depend on of an environment.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentOrigin {
    /// Of the file.
    pub content: Content,
    /// See [`EnvironmentSource::rotate`].
    pub rotate: f64,
    /// See [`EnvironmentSource::scale`].
    pub scale: f64,
}

/// An environment that was read.
#[derive(Clone)]
pub(super) struct FromFile {
    environment: Environment,
    warnings: Vec<String>,
    /// As typed.
    path: PathBuf,
    pub origin: EnvironmentOrigin,
}

/// Maps by their files: settings that differ in other things share them.
#[derive(Default)]
pub(super) struct Maps {
    known: HashMap<PathBuf, (Environment, Vec<String>, Content)>,
}

impl Maps {
    /// The environment of `source`.
    ///
    /// # Errors
    /// It is not to be had; the text names the option.
    pub fn read(&mut self, source: &EnvironmentSource, cache: &HashCache) -> Result<FromFile, String> {
        let EnvironmentSource { path, rotate, scale } = source;
        if !self.known.contains_key(path) {
            self.known.insert(path.clone(), read(path, cache)?);
        }
        let (environment, warnings, content) = self.known[path].clone();
        let rotation = (rotate / 360.0).rem_euclid(1.0) as f32;
        Ok(FromFile {
            // Just below a whole turn may have been rounded to one.
            environment: Environment { rotation: rotation % 1.0, scale: *scale as f32, ..environment },
            warnings,
            path: path.clone(),
            origin: EnvironmentOrigin { content, rotate: *rotate, scale: *scale },
        })
    }
}

fn read(path: &Path, cache: &HashCache) -> Result<(Environment, Vec<String>, Content), String> {
    let file = SourceFile::input(path);
    let (environment, warnings) = load_environment(path).map_err(|error| format!("--env {error}"))?;
    let content = content_of("--env", &file, cache)?;
    Ok((environment, warnings, content))
}

impl FromFile {
    /// Lights `scene` by it, in place of an environment of its own, which is listed as skipped.
    pub fn light(&self, scene: &mut Scene) {
        if scene.environment.is_some() {
            let why = format!("--env {} lights the scene", self.path.display());
            scene.skipped.push(Skipped { what: "environment".into(), why });
        }
        scene.environment = Some(self.environment.clone());
        scene.warnings.extend(self.warnings.iter().map(|warning| format!("--env {warning}")));
    }
}
