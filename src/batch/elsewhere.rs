//! Cameras that tasks are to be seen by in place of their own.

use super::content::HashCache;
use super::fingerprint::CameraOrigin;
use super::run::names_of;
use super::settings::{FileSettings, Task};
use crate::camera::Camera;
use std::collections::HashMap;
use std::sync::Arc;

/// The cameras of a task.
#[derive(Clone)]
pub(super) struct Elsewhere {
    /// `None`: its own.
    pub cameras: Option<Arc<[Camera]>>,
    /// Where they come from.
    pub origin: CameraOrigin,
}

impl Elsewhere {
    /// Names of the cameras, if they are not the task's own.
    pub fn names(&self) -> Option<Vec<String>> {
        self.cameras.as_deref().map(names_of)
    }
}

/// The cameras of each task, read once for all that share settings.
///
/// # Errors
/// They are not to be had, or the chosen one is not among them; the text names the option.
pub(super) fn cameras_from_elsewhere(tasks: &[Task], hashes: &HashCache) -> Result<Vec<Elsewhere>, String> {
    let mut known: HashMap<*const FileSettings, Elsewhere> = HashMap::new();
    let read = |settings: &FileSettings| -> Result<Elsewhere, String> {
        let (cameras, origin) = CameraOrigin::read(&settings.camera_source, hashes)?;
        let elsewhere = Elsewhere { cameras: cameras.map(Into::into), origin };
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
