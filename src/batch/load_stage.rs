//! Reads scenes, one ahead of the one that is rendered.

use super::budget::Grant;
use super::content::{InputRecord, hash_sources};
use super::memory::need;
use super::panics::guarded;
use super::render_stage::{Loaded, sized};
use super::report::ImageReport;
use super::run::{Event, ImageId, Shared, names_of};
use super::settings::Task;
use super::up_to_date::Why;
use crate::load::{LoadEstimate, LoadTimes, load};
use crate::render::{Phase, Progress};
use crate::scene::{Scene, SourceFile};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Instant;

/// The thread that reads.
pub(super) struct LoadStage {
    pub shared: Arc<Shared>,
    pub events: Sender<Event>,
}

/// What is to be done for a file.
pub(super) enum Contents {
    /// Nothing: all of its images are up to date. Each with its id and its progress.
    Kept(Vec<(ImageId, Arc<Progress>, ImageReport)>),
    /// To render it.
    Scene(Box<SceneFile>),
}

/// A file that was read.
pub(super) struct SceneFile {
    pub scene: Scene,
    pub sources: Arc<Sources>,
    pub times: LoadTimes,
    /// Of the scene's cameras, in order.
    pub names: Vec<String>,
    /// Which of them to render.
    pub chosen: Vec<usize>,
    /// Why not all of its images are up to date; empty if nobody asked.
    pub why: String,
    /// What reading it took.
    pub reading: LoadEstimate,
    /// Memory for all of its images, one after the other.
    pub grant: Option<Arc<Grant>>,
}

/// What the files hold that a scene was made from: hashed while it is rendered.
pub(super) struct Sources {
    hashing: Mutex<Option<Receiver<Hashed>>>,
    hashed: OnceLock<Hashed>,
}

type Hashed = Result<Vec<InputRecord>, String>;

impl Sources {
    fn hash(shared: &Arc<Shared>, sources: Vec<SourceFile>) -> Arc<Self> {
        let (done, hashing) = channel();
        let with_cache = Arc::clone(shared);
        shared.beside.spawn(move || {
            // A panic of a task that nobody waits for would end the process.
            let hash = || hash_sources(&sources, &with_cache.hashes).map_err(|changed| changed.to_string());
            let hashed = guarded(hash);
            // Nobody waits for it when the run was ended.
            let _ = done.send(hashed);
        });
        Arc::new(Self { hashing: Mutex::new(Some(hashing)), hashed: OnceLock::new() })
    }

    /// Waits for the hashes. The error says what changed while it was read.
    pub fn records(&self) -> &Hashed {
        self.hashed.get_or_init(|| {
            let hashing = self.hashing.lock().unwrap_or_else(PoisonError::into_inner).take();
            let hashed = hashing.and_then(|hashing| hashing.recv().ok());
            hashed.unwrap_or_else(|| Err("the files that were read could not be hashed".into()))
        })
    }
}

impl LoadStage {
    /// Reads all tasks' files, in order, and hands them on.
    pub fn run(&self, to_render: &SyncSender<Loaded>) {
        for task in 0..self.shared.settings.tasks.len() {
            // The other end is gone when the run was ended.
            if self.shared.is_stopped() {
                return;
            }
            let Some(loaded) = self.load(task) else { return };
            if to_render.send(loaded).is_err() {
                return;
            }
        }
    }

    /// `None`: the run is to end.
    fn load(&self, task: usize) -> Option<Loaded> {
        let shared = &*self.shared;
        let Task { input, settings } = &shared.settings.tasks[task];
        let planned = settings.cameras.select(&shared.plan.cameras[task]).unwrap_or_else(|_| vec![0]);
        let outputs = shared.plan.namings[task].outputs(&shared.plan.cameras[task], &planned);
        let (id, progress) = shared.start(&self.events, task, &outputs[0]);
        let why = match self.kept(task, &planned, &outputs) {
            Ok(reports) => {
                let later = |output: &PathBuf| shared.start(&self.events, task, output);
                let ids = std::iter::once((id, Arc::clone(&progress))).chain(outputs[1..].iter().map(later));
                let kept = ids.zip(reports).map(|((id, progress), report)| (id, progress, report)).collect();
                return Some(Loaded { task, id, progress, contents: Ok(Contents::Kept(kept)), seconds: 0.0 });
            }
            Err(why) => why,
        };
        let reading = match &input.problem {
            Some(problem) => Err(problem.to_string()),
            None => guarded(|| shared.memory.check_loading(&input.path, settings)),
        };
        // Waits until there is room beside the scene that is rendered.
        let bytes = reading.as_ref().map_or(0, |reading| reading.bytes);
        let mut grant = shared.budget.grant(bytes, &shared.stop)?;
        progress.enter(Phase::Loading);
        let clock = Instant::now();
        let read = |reading| {
            let load = || load(&input.path, &settings.load).map_err(|error| error.to_string());
            let (mut scene, times) = shared.beside.install(load)?;
            shared.elsewhere[task].replace_in(&mut scene, settings);
            let names = names_of(&scene.cameras);
            let chosen = settings.cameras.select(&names);
            let chosen = chosen.map_err(|error| format!("{}: {error}", input.path.display()))?;
            let sources = Sources::hash(&self.shared, std::mem::take(&mut scene.sources));
            // What the most demanding of its images takes; whether that fits is asked for each of them.
            let of_camera = |&camera: &usize| need(&scene, reading, &sized(settings, &scene, camera), settings).peak();
            let most = chosen.iter().map(of_camera).max().unwrap_or(0);
            Ok((SceneFile { scene, sources, times, names, chosen, why, reading, grant: None }, most))
        };
        let contents = reading.and_then(|reading| guarded(|| read(reading)));
        let seconds = clock.elapsed().as_secs_f64();
        progress.enter(Phase::Waiting);
        let contents = match contents {
            Ok((mut file, most)) => {
                if !grant.resize(most.min(shared.memory.bytes), &shared.stop) {
                    return None;
                }
                file.grant = Some(Arc::new(grant));
                Ok(Contents::Scene(Box::new(file)))
            }
            Err(message) => Err(message),
        };
        Some(Loaded { task, id, progress, contents, seconds })
    }

    /// The reports of all images of the task if all are up to date; else why not, empty if that needs no saying.
    fn kept(&self, task: usize, cameras: &[usize], outputs: &[PathBuf]) -> Result<Vec<ImageReport>, String> {
        if self.shared.settings.force || self.shared.settings.tasks[task].input.problem.is_some() {
            return Err(String::new());
        }
        let images = cameras.iter().zip(outputs);
        images.map(|(&camera, output)| self.shared.kept(task, camera, output)).collect::<Result<_, _>>().map_err(
            |why| {
                if why == Why::New { String::new() } else { why.to_string() }
            },
        )
    }
}
