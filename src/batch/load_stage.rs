//! Reads scenes, one ahead of the one that is rendered.

use super::render_stage::Loaded;
use super::run::{Event, Shared, names_of};
use super::settings::Task;
use crate::load::{LoadTimes, load};
use crate::scene::Scene;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Sender, SyncSender};
use std::time::Instant;

/// The thread that reads.
pub(super) struct LoadStage {
    pub shared: Arc<Shared>,
    pub events: Sender<Event>,
}

/// A file that was read.
pub(super) struct Contents {
    pub scene: Scene,
    pub times: LoadTimes,
    /// Of the scene's cameras, in order.
    pub names: Vec<String>,
    /// Which of them to render.
    pub chosen: Vec<usize>,
}

impl LoadStage {
    /// Reads all tasks' files, in order, and hands them on.
    pub fn run(&self, to_render: &SyncSender<Loaded>) {
        for task in 0..self.shared.settings.tasks.len() {
            // The other end is gone when the run was ended.
            if self.shared.is_stopped() || to_render.send(self.load(task)).is_err() {
                return;
            }
        }
    }

    fn load(&self, task: usize) -> Loaded {
        let shared = &*self.shared;
        let Task { input, settings } = &shared.settings.tasks[task];
        let planned = settings.cameras.select(&shared.plan.cameras[task]).unwrap_or_else(|_| vec![0]);
        let outputs = shared.plan.namings[task].outputs(&shared.plan.cameras[task], &planned[..1]);
        let first: PathBuf = outputs.into_iter().next().unwrap_or_default();
        let (id, progress) = shared.start(&self.events, task, &first);
        progress.enter(crate::render::Phase::Loading);
        let clock = Instant::now();
        let loaded = match &input.problem {
            Some(problem) => Err(problem.to_string()),
            None => {
                let load = || load(&input.path, &settings.load).map_err(|error| error.to_string());
                shared.beside.install(|| guarded(load))
            }
        };
        let contents = loaded.and_then(|(mut scene, times)| {
            if let Some(cameras) = &shared.elsewhere[task] {
                settings.camera_source.replace(&mut scene, cameras);
            }
            let names = names_of(&scene.cameras);
            let chosen = settings.cameras.select(&names);
            let chosen = chosen.map_err(|error| format!("{}: {error}", input.path.display()))?;
            Ok(Contents { scene, times, names, chosen })
        });
        Loaded { task, id, progress, contents, seconds: clock.elapsed().as_secs_f64() }
    }
}

/// Runs `work`; a panic in it becomes an error, so that the batch goes on.
pub(super) fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let text = payload.downcast_ref::<&str>().map(ToString::to_string);
        let text = text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default();
        Err(format!("internal error: {text}\n  This is a bug in prt-batch, please report it with the file."))
    })
}
