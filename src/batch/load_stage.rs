//! Reads scenes, one ahead of the one that is rendered: of a file whose frames are asked for, frame by frame.

use super::budget::Grant;
use super::content::{InputRecord, hash_sources};
use super::memory::need;
use super::panics::guarded;
use super::render_stage::{Loaded, sized};
use super::report::ImageReport;
use super::run::{Event, ImageId, Shared, names_of};
use super::settings::{FileSettings, Task};
use super::up_to_date::Why;
use crate::error::LoadError;
use crate::load::{LoadEstimate, LoadTimes, Moment, SceneSource, load};
use crate::render::{Phase, Progress, framing};
use crate::scene::{Framing, Scene, SourceFile};
use std::path::{Path, PathBuf};
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

/// A task whose frames are read one after the other.
struct Reading {
    task: usize,
    /// What the frames share, once one of them had to be read.
    opened: Option<Opened>,
    /// Of the file, as its first frame told them: hashed once.
    sources: Option<Arc<Sources>>,
}

/// What becomes of the other frames.
#[derive(PartialEq, Eq)]
enum Next {
    GoOn,
    /// There are none that could be read.
    Skip,
    /// The run is to end.
    End,
}

impl LoadStage {
    /// Reads all tasks' files, in order, and hands them on.
    pub fn run(&self, to_render: &SyncSender<Loaded>) {
        for task in 0..self.shared.settings.tasks.len() {
            let mut reading = Reading { task, opened: None, sources: None };
            let frames = &self.shared.plan.frames[task];
            for (nth, &frame) in frames.iter().enumerate() {
                // The other end is gone when the run was ended.
                if self.shared.is_stopped() {
                    return;
                }
                match self.frame(&mut reading, frame, frames.len() - nth - 1, to_render) {
                    Next::GoOn => {}
                    Next::Skip => break,
                    Next::End => return,
                }
            }
        }
    }

    /// Reads a frame, after which there are `left` others, and hands it on.
    fn frame(&self, reading: &mut Reading, frame: Option<u32>, left: usize, to_render: &SyncSender<Loaded>) -> Next {
        let was_read = reading.opened.is_some();
        let Some(mut loaded) = self.load(reading, frame) else { return Next::End };
        let mut next = Next::GoOn;
        // What is wrong with the first that is read is wrong with all, or else with the file: said once.
        if let Err(message) = &mut loaded.contents
            && !was_read
            && left > 0
        {
            *message += &format!("\n  The other {left} frames of this file were not tried.");
            (0..left).for_each(|_| self.shared.shares.done());
            next = Next::Skip;
        }
        if to_render.send(loaded).is_ok() { next } else { Next::End }
    }

    /// `None`: the run is to end.
    fn load(&self, of: &mut Reading, frame: Option<u32>) -> Option<Loaded> {
        let (shared, task) = (&*self.shared, of.task);
        let Task { input, settings } = &shared.settings.tasks[task];
        let planned = settings.cameras.select(&shared.plan.cameras[task]).unwrap_or_else(|_| vec![0]);
        let outputs = shared.plan.namings[task].outputs(&shared.plan.cameras[task], &planned, frame);
        let (id, progress) = shared.start(&self.events, task, &outputs[0]);
        let why = match self.kept(task, &planned, frame, &outputs) {
            Ok(reports) => {
                let later = |output: &PathBuf| shared.start(&self.events, task, output);
                let ids = std::iter::once((id, Arc::clone(&progress))).chain(outputs[1..].iter().map(later));
                let kept = ids.zip(reports).map(|((id, progress), report)| (id, progress, report)).collect();
                return Some(Loaded { task, frame, id, progress, contents: Ok(Contents::Kept(kept)), seconds: 0.0 });
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
        let Reading { opened, sources, .. } = of;
        let read = |reading| {
            let load = || scene(&input.path, settings, frame, opened).map_err(|error| error.to_string());
            let (mut scene, times) = shared.beside.install(load)?;
            shared.elsewhere[task].replace_in(&mut scene, settings);
            let names = names_of(&scene.cameras);
            let chosen = settings.cameras.select(&names);
            let chosen = chosen.map_err(|error| format!("{}: {error}", input.path.display()))?;
            let files = std::mem::take(&mut scene.sources);
            let sources = Arc::clone(sources.get_or_insert_with(|| Sources::hash(&self.shared, files)));
            // What the most demanding of its images takes; whether that fits is asked for each of them.
            let of_camera =
                |&camera: &usize| need(&scene, reading, &sized(settings, &scene, camera, frame), settings).peak();
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
        Some(Loaded { task, frame, id, progress, contents, seconds })
    }

    /// The reports of all images of a frame if all are up to date; else why not, empty if that needs no saying.
    fn kept(
        &self,
        task: usize,
        cameras: &[usize],
        frame: Option<u32>,
        outputs: &[PathBuf],
    ) -> Result<Vec<ImageReport>, String> {
        if self.shared.settings.force || self.shared.settings.tasks[task].input.problem.is_some() {
            return Err(String::new());
        }
        let images = cameras.iter().zip(outputs);
        let kept = images.map(|(&camera, output)| self.shared.kept(task, camera, frame, output));
        kept.collect::<Result<_, _>>().map_err(|why| if why == Why::New { String::new() } else { why.to_string() })
    }
}

/// A file whose frames are read.
pub(super) struct Opened {
    source: SceneSource,
    /// For a camera that the file lacks, once a frame needed it.
    framing: Option<Framing>,
}

/// The scene of a file in a frame; `opened` is the file as frames before have left it.
pub(super) fn scene(
    path: &Path,
    settings: &FileSettings,
    frame: Option<u32>,
    opened: &mut Option<Opened>,
) -> Result<(Scene, LoadTimes), LoadError> {
    let (Some(frames), Some(frame)) = (&settings.frames, frame) else { return load(path, &settings.load) };
    let Opened { source, framing } = match opened {
        Some(opened) => opened,
        None => {
            let source = SceneSource::open(path, &settings.load, &frames.animation)?;
            opened.insert(Opened { source, framing: None })
        }
    };
    let (mut scene, times) = source.at(&frames.moment(frame))?;
    if scene.cameras.is_empty() {
        scene.framing = Some(*framing.get_or_insert_with(|| framing_of(source)));
    }
    Ok((scene, times))
}

/// Into how many parts an animation is cut to see where things get.
const LOOKS: u32 = 16;

/// Around what is seen in the course of the whole animation: the camera must not move with it, and a frame must not depend
/// on which others are asked for.
fn framing_of(source: &mut SceneSource) -> Framing {
    let seconds = source.seconds();
    let looks = if seconds > 0.0 { LOOKS } else { 0 };
    let mut all: Option<Framing> = None;
    for k in 0..=looks {
        let time = seconds * f64::from(k) / f64::from(LOOKS);
        // What is wrong there is said by the frame that is there.
        let Ok((scene, _)) = source.at(&Moment { time, shutter: Some(0.0), ..Moment::default() }) else { continue };
        let found = framing(&scene);
        let joined = all.get_or_insert(found);
        joined.bounds = match (joined.bounds, found.bounds) {
            (Some((low, high)), Some((lower, higher))) => Some((low.min(lower), high.max(higher))),
            (one, other) => one.or(other),
        };
    }
    all.unwrap_or_default()
}
