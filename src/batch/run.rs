//! The engine: one thread reads ahead, one renders (with a pool), one writes, and a failure stays with its image.
//!
//! The thread that calls [`run()`] plans, tells its [`Observer`] what the others report, and ends them when it is asked
//! to. Images are finished in the order of the plan.

use super::budget::Budget;
use super::content::HashCache;
use super::describe::{accel_name, blank};
use super::elsewhere::{Elsewhere, from_elsewhere};
use super::fingerprint::Wanted;
use super::html;
use super::job::{Plan, plan};
use super::load_stage::LoadStage;
use super::memory::MemoryBudget;
use super::output::{WriteError, check_writable, sweep, write_atomic};
use super::render_stage::RenderStage;
use super::report::{self, Accel, BatchReport, Host, ImageReport, Outputs, Status};
use super::settings::{BatchSettings, Task};
use super::shares::Shares;
use super::size::{PictureSize, check_crop};
use super::up_to_date::{Kept, Why, check};
use super::write_stage::WriteStage;
use crate::camera::Camera;
use crate::render::{Progress, pool};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

/// Told what happens, on the thread that called [`run()`].
pub trait Observer {
    /// The inputs are known, and as far as that can be told without loading them `images` will come of them.
    fn planned(&mut self, _images: usize) {}
    /// Work on an image starts; of several there may be one that is read, one that is rendered, one that is written.
    fn started(&mut self, _image: &Started) {}
    /// An image is done, its files are written.
    fn finished(&mut self, _id: ImageId, _image: &ImageReport) {}
}

/// Tells the images of a run apart, in the order in which work on them starts.
pub type ImageId = u64;

/// An image that work starts on.
#[derive(Clone, Debug)]
pub struct Started {
    /// To tell it from the others.
    pub id: ImageId,
    /// Its file.
    pub input: PathBuf,
    /// Its output path without extension, below the output folder.
    pub output: PathBuf,
    /// May be watched from any thread.
    pub progress: Arc<Progress>,
}

/// Why nothing was rendered at all.
#[derive(Debug)]
pub enum Stop {
    /// The settings contradict each other or the inputs.
    Usage(String),
    /// The output folder cannot be written to.
    Unwritable(WriteError),
}

/// How the run went.
#[derive(Debug)]
pub struct Outcome {
    /// As written to `batch.json`.
    pub report: BatchReport,
    /// Images that failed because of their input.
    pub bad_inputs: usize,
    /// An output that could not be written; the run stopped there.
    pub unwritable: Option<WriteError>,
    /// The run was asked to end before everything was done.
    pub interrupted: bool,
    /// Images that `--strict` takes for failures although they were rendered, up to date or empty.
    pub strict_failures: usize,
}

impl Outcome {
    /// 0 all well, 1 some images failed, 3 every input was bad, 4 outputs cannot be written, 75 interrupted.
    pub fn exit_code(&self) -> u8 {
        let (all, failed) = (self.report.images.len(), self.report.counts[&Status::Failed]);
        match () {
            () if self.interrupted => 75,
            () if self.unwritable.is_some() => 4,
            () if all > 0 && self.bad_inputs == all => 3,
            () if failed + self.strict_failures > 0 => 1,
            () => 0,
        }
    }
}

/// What the threads of a run share.
pub(super) struct Shared {
    pub settings: BatchSettings,
    pub plan: Plan,
    /// For each task the cameras that it is to be seen by, if not by its own, and where they come from.
    pub elsewhere: Vec<Elsewhere>,
    /// Contents of files that were hashed.
    pub hashes: HashCache,
    /// Memory that may be used.
    pub memory: MemoryBudget,
    /// Who uses it.
    pub budget: Arc<Budget>,
    /// Ends what is under way.
    pub stop: Arc<AtomicBool>,
    /// For what goes on beside rendering, whose own pool is busy.
    pub beside: rayon::ThreadPool,
    /// Shares out `settings.batch_time_limit`.
    pub shares: Shares,
    next_id: AtomicU64,
    gate: Mutex<Gate>,
}

/// Between rendering and writing, so that a run can end while another thread is still at work on something that nobody
/// waits for any more.
#[derive(Default)]
struct Gate {
    is_closed: bool,
    /// Images handed to the writer and not yet finished.
    writing: usize,
}

impl Shared {
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Starts an image.
    pub fn start(&self, events: &Sender<Event>, task: usize, output: &Path) -> (ImageId, Arc<Progress>) {
        let id = self.next_id.fetch_add(1, Ordering::Relaxed);
        let progress = Arc::new(Progress::cancelled_by(Arc::clone(&self.stop)));
        let input = self.settings.tasks[task].input.path.clone();
        // Nobody listens any more when the run was ended; then nobody misses it.
        let _ = events.send(Event::Started(Started {
            id,
            input,
            output: output.to_owned(),
            progress: Arc::clone(&progress),
        }));
        (id, progress)
    }

    /// What is asked for of a task's camera in a frame.
    pub fn wanted(&self, task: usize, camera: usize, frame: Option<u32>) -> Wanted<'_> {
        self.elsewhere[task].wanted(&self.settings.tasks[task], camera, frame, self.settings.batch_time_limit)
    }

    /// The image as an earlier run left it, if that is what this run would write; else why not.
    pub fn kept(&self, task: usize, camera: usize, frame: Option<u32>, output: &Path) -> Result<ImageReport, Why> {
        let json = self.settings.path(output, "json");
        let Kept { report, outputs } = check(&json, &self.wanted(task, camera, frame), &self.hashes)?;
        let path = |kind: &str| {
            let of_kind = outputs.iter().find(|path| path.extension().is_some_and(|e| e == kind));
            of_kind.map(|path| path.display().to_string())
        };
        // Nothing is missed that nobody asks for any more.
        let is_asked_for = self.settings.tasks[task].settings.render.stopping.target_error.is_some();
        Ok(ImageReport {
            status: Status::UpToDate,
            target_error: report.target_error.clone().filter(|_| is_asked_for),
            input: self.settings.tasks[task].input.path.display().to_string(),
            outputs: Outputs { exr: path("exr"), png: path("png"), json: Some(json.display().to_string()) },
            ..report
        })
    }

    fn gate(&self) -> MutexGuard<'_, Gate> {
        self.gate.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether an image may still be handed to the writer.
    pub fn opens_to_writer(&self) -> bool {
        let mut gate = self.gate();
        gate.writing += usize::from(!gate.is_closed);
        !gate.is_closed
    }

    /// The writer is done with an image.
    pub fn written(&self) {
        self.gate().writing -= 1;
    }
}

/// What the threads tell the one that called [`run()`].
pub(super) enum Event {
    Started(Started),
    Finished { id: ImageId, task: usize, image: Box<ImageReport>, is_bad_input: bool },
    Unwritable(WriteError),
}

/// How often the run asks whether it is to end.
const POLL: Duration = Duration::from_millis(20);

/// How long a thread that was told to end is waited for: tracing ends within a wave, but reading a file or building a
/// tree has no place to stop at.
const GRACE: Duration = Duration::from_millis(200);

/// Stack of the threads that read, render and write: what a main thread has.
const STACK: usize = 8 << 20;

/// Renders everything that `settings` asks for. Ends soon after `settings.cancel` is set: finished images are written,
/// the one under way is dropped. A thread that is reading or building then may go on for a while, to no effect.
///
/// # Errors
/// Nothing was rendered, because names clash, a crop does not fit, the cameras from elsewhere are not to be had, the
/// output folder cannot be written to, or the threads are not to be had.
///
/// # Panics
/// When one of the run's own threads does, which is a bug.
pub fn run(settings: BatchSettings, observer: &mut dyn Observer) -> Result<Outcome, Stop> {
    let (started, clock) = (SystemTime::now(), Instant::now());
    let (hashes, memory) = (HashCache::default(), MemoryBudget::new(settings.memory));
    let (elsewhere, plan) = planned(&settings.tasks, &hashes).map_err(Stop::Usage)?;
    settings.tasks.iter().try_for_each(|task| memory.check_picture(&task.settings)).map_err(Stop::Usage)?;
    let threads = |error: crate::error::RenderError| Stop::Usage(format!("--threads: {error}"));
    let (rendering, beside) = (pool(settings.threads).map_err(threads)?, pool(settings.threads).map_err(threads)?);
    check_writable(&settings.out).map_err(Stop::Unwritable)?;
    let folders: HashSet<&Path> = plan.owners.keys().filter_map(|output| output.parent()).collect();
    folders.into_iter().for_each(|folder| sweep(&settings.out.join(folder)));

    let jobs = jobs(&settings.tasks, &plan);
    let images = jobs.iter().map(Vec::len).sum();
    observer.planned(images);
    let shares = Shares::new(settings.batch_time_limit.map(|limit| clock + limit), images);
    let shared = Arc::new(Shared {
        settings,
        plan,
        elsewhere,
        hashes,
        memory,
        budget: Budget::new(memory.bytes),
        stop: Arc::default(),
        beside,
        shares,
        next_id: AtomicU64::new(0),
        gate: Mutex::default(),
    });
    let (events, threads) = start_threads(&shared, rendering);
    let Conducted { mut images, bad_inputs, mut unwritable, is_abandoned } = conduct(&shared, &events, observer);
    if !is_abandoned {
        for thread in threads {
            if let Err(panic) = thread.join() {
                std::panic::resume_unwind(panic);
            }
        }
    }

    let done = images.len();
    if shared.is_stopped() {
        images.extend(left_out(&shared.settings.tasks, &jobs, &images));
    }
    let interrupted = images.len() > done && shared.settings.cancel.load(Ordering::Relaxed);
    let images: Vec<ImageReport> = images.into_iter().map(|(_, image)| image).collect();
    let report = batch_report(&shared, images, started, clock);
    let settings = &shared.settings;
    let mut files = vec![("batch.json", report::to_json(&report))];
    if settings.report {
        files.push(("index.html", html::report(&report, &settings.out)));
    }
    for (name, text) in files {
        if let Err(error) = write_atomic(&settings.out.join(name), text.as_bytes()) {
            unwritable.get_or_insert(error);
        }
    }
    let strict = report.images.iter().filter(|image| !image.strict_failures().is_empty());
    let strict_failures = if settings.strict { strict.count() } else { 0 };
    Ok(Outcome { report, bad_inputs, unwritable, interrupted, strict_failures })
}

/// The cameras of each task and the names of their outputs.
///
/// # Errors
/// What stops a run before anything is rendered, of what does not depend on this machine.
pub(super) fn planned(tasks: &[Task], hashes: &HashCache) -> Result<(Vec<Elsewhere>, Plan), String> {
    let elsewhere = from_elsewhere(tasks, hashes)?;
    for Task { settings, .. } in tasks {
        if let (Some(crop), PictureSize::Exact(width, height)) = (settings.render.crop, settings.size) {
            check_crop(crop, width, height)?;
        }
    }
    let names: Vec<_> = elsewhere.iter().map(Elsewhere::names).collect();
    let plan = plan(tasks, &names)?;
    Ok((elsewhere, plan))
}

fn batch_report(shared: &Shared, images: Vec<ImageReport>, started: SystemTime, clock: Instant) -> BatchReport {
    let requested = shared.settings.tasks.first().map_or_else(Default::default, |task| task.settings.render.accel);
    let requested = Accel { requested: accel_name(requested).into(), ..Accel::default() };
    let chosen = images.iter().map(|image| &image.accel).find(|accel| accel.used.is_some());
    let count = |status| images.iter().filter(|image| image.status == status).count();
    BatchReport {
        prt: crate::VERSION,
        command: shared.settings.command.clone(),
        started: report::utc(started),
        seconds: clock.elapsed().as_secs_f64(),
        host: Host { cpu: report::cpu_name(), threads: shared.beside.current_num_threads() },
        accel: chosen.cloned().unwrap_or(requested),
        counts: Status::ALL.iter().map(|&status| (status, count(status))).collect(),
        images,
    }
}

/// A frame and a camera by its name in reports.
type Job = (Option<u32>, Option<String>);

/// For each task the images that will come of it, as far as that is known.
fn jobs(tasks: &[Task], plan: &Plan) -> Vec<Vec<Job>> {
    let of = |((task, names), frames): ((&Task, &Vec<String>), &Vec<Option<u32>>)| {
        let chosen = task.settings.cameras.select(names).unwrap_or_else(|_| vec![0]);
        let of_frame = |&frame: &Option<u32>| chosen.iter().map(move |&camera| (frame, reported_name(names, camera)));
        frames.iter().flat_map(of_frame).collect()
    };
    tasks.iter().zip(&plan.cameras).zip(&plan.frames).map(of).collect()
}

/// Reports of the images that were not done because the run ended, each with its task.
fn left_out(tasks: &[Task], jobs: &[Vec<Job>], done: &[(usize, ImageReport)]) -> Vec<(usize, ImageReport)> {
    let mut finished = vec![0; tasks.len()];
    done.iter().for_each(|(task, _)| finished[*task] += 1);
    let of_task = |(index, Task { input, settings }): (usize, &Task)| {
        let interrupted = |(frame, camera): &Job| {
            let (status, frame) = (Status::Interrupted, *frame);
            (index, ImageReport { status, frame, camera: camera.clone(), ..blank(&input.path, settings) })
        };
        jobs[index].iter().skip(finished[index]).map(interrupted).collect::<Vec<_>>()
    };
    tasks.iter().enumerate().flat_map(of_task).collect()
}

/// The camera's name as reports have it: its index where it has none, `None` for the one framed on the bounds.
pub(super) fn reported_name(names: &[String], camera: usize) -> Option<String> {
    names.get(camera).map(|name| if name.is_empty() { camera.to_string() } else { name.clone() })
}

pub(super) fn names_of(cameras: &[Camera]) -> Vec<String> {
    cameras.iter().map(|camera| camera.name.clone()).collect()
}

/// Starts the threads; each ends when the one before it has.
fn start_threads(shared: &Arc<Shared>, rendering: rayon::ThreadPool) -> (Receiver<Event>, Vec<JoinHandle<()>>) {
    let (events, received) = channel();
    // Nothing is kept between reading and rendering: one scene is rendered, one waits. A picture that is being written
    // may be followed by one that waits.
    let (to_render, loaded) = sync_channel(0);
    let (to_write, made) = sync_channel(1);
    let load = LoadStage { shared: Arc::clone(shared), events: events.clone() };
    let render = RenderStage { shared: Arc::clone(shared), events: events.clone(), pool: rendering };
    let write = WriteStage { shared: Arc::clone(shared), events };
    let spawn = |name: &str, work: Box<dyn FnOnce() + Send>| {
        let thread = std::thread::Builder::new().name(name.into()).stack_size(STACK);
        thread.spawn(work).expect("the system gives three threads")
    };
    let threads = vec![
        spawn("load", Box::new(move || load.run(&to_render))),
        spawn("render", Box::new(move || render.run(&loaded, &to_write))),
        spawn("write", Box::new(move || write.run(&made))),
    ];
    (received, threads)
}

/// What came of the images.
#[derive(Default)]
struct Conducted {
    /// Each with its task.
    images: Vec<(usize, ImageReport)>,
    bad_inputs: usize,
    unwritable: Option<WriteError>,
    /// Threads are still at work, on nothing that matters.
    is_abandoned: bool,
}

/// Passes on what the threads report until they are done or the run is to end.
fn conduct(shared: &Shared, events: &Receiver<Event>, observer: &mut dyn Observer) -> Conducted {
    let mut conducted = Conducted::default();
    let mut stopped_at = None;
    loop {
        let event = events.recv_timeout(POLL);
        if shared.settings.cancel.load(Ordering::Relaxed) {
            shared.stop.store(true, Ordering::Relaxed);
        }
        match event {
            Ok(event) => conducted.take(event, observer),
            Err(RecvTimeoutError::Disconnected) => return conducted,
            Err(RecvTimeoutError::Timeout) if shared.is_stopped() => {
                let since = stopped_at.get_or_insert_with(Instant::now);
                if since.elapsed() > GRACE && conducted.closes(shared) {
                    events.try_iter().for_each(|event| conducted.take(event, observer));
                    return conducted;
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

impl Conducted {
    fn take(&mut self, event: Event, observer: &mut dyn Observer) {
        match event {
            Event::Started(image) => observer.started(&image),
            Event::Finished { id, task, image, is_bad_input } => {
                observer.finished(id, &image);
                self.bad_inputs += usize::from(is_bad_input);
                self.images.push((task, *image));
            }
            Event::Unwritable(error) => {
                self.unwritable.get_or_insert(error);
            }
        }
    }

    /// Whether nothing is left to be written; then nothing will be.
    fn closes(&mut self, shared: &Shared) -> bool {
        let mut gate = shared.gate();
        gate.is_closed = gate.writing == 0;
        self.is_abandoned = gate.is_closed;
        gate.is_closed
    }
}

#[cfg(test)]
#[path = "run_tests.rs"]
mod tests;
