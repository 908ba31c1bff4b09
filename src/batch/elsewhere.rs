//! Cameras and environments that tasks are rendered with in place of their own.

use super::content::HashCache;
use super::environment::{FromFile, Maps};
use super::fingerprint::{CameraOrigin, Wanted};
use super::run::names_of;
use super::settings::{FileSettings, Task};
use crate::camera::Camera;
use crate::scene::Scene;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

/// What a task is rendered with.
#[derive(Clone)]
pub(super) struct Elsewhere {
    /// `None`: its own.
    pub cameras: Option<Arc<[Camera]>>,
    /// Where they come from.
    pub origin: CameraOrigin,
    /// `None`: its own environment.
    pub environment: Option<FromFile>,
}

impl Elsewhere {
    /// Puts it into the task's `scene`.
    pub fn replace_in(&self, scene: &mut Scene, settings: &FileSettings) {
        if let Some(cameras) = &self.cameras {
            settings.camera_source.replace(scene, cameras);
        }
        if let Some(environment) = &self.environment {
            environment.light(scene);
        }
    }

    /// An image of the task, with its camera's place and its frame.
    pub fn wanted<'a>(
        &'a self,
        Task { input, settings }: &'a Task,
        camera: usize,
        frame: Option<u32>,
        batch_time_limit: Option<Duration>,
    ) -> Wanted<'a> {
        let environment = self.environment.as_ref().map(|environment| &environment.origin);
        Wanted { input: &input.path, settings, origin: &self.origin, environment, camera, frame, batch_time_limit }
    }

    /// Names of the cameras, if they are not the task's own.
    pub fn names(&self) -> Option<Vec<String>> {
        self.cameras.as_deref().map(names_of)
    }
}

/// For each task, read once for all that share settings.
///
/// # Errors
/// They are not to be had, or the chosen camera is not among them; the text names the option.
pub(super) fn from_elsewhere(tasks: &[Task], hashes: &HashCache) -> Result<Vec<Elsewhere>, String> {
    let mut known: HashMap<*const FileSettings, Elsewhere> = HashMap::new();
    let mut maps = Maps::default();
    let mut read = |settings: &FileSettings| -> Result<Elsewhere, String> {
        let (cameras, origin) = CameraOrigin::read(&settings.camera_source, hashes)?;
        let environment = settings.environment.as_ref().map(|source| maps.read(source, hashes)).transpose()?;
        let elsewhere = Elsewhere { cameras: cameras.map(Into::into), origin, environment };
        if let Some(names) = elsewhere.names() {
            // What is not there is there for no input.
            let source = settings.camera_source.options();
            settings.cameras.select(&names).map_err(|error| format!("{source}: {error}"))?;
        }
        Ok(elsewhere)
    };
    let of = |Task { settings, .. }: &Task| {
        if let Some(elsewhere) = known.get(&Arc::as_ptr(settings)) {
            return Ok(elsewhere.clone());
        }
        let elsewhere = read(settings)?;
        known.insert(Arc::as_ptr(settings), elsewhere.clone());
        Ok(elsewhere)
    };
    tasks.iter().map(of).collect()
}
