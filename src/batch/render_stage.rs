//! Renders the scenes that were read.

use super::describe::{blank, describe, lens_notes};
use super::load_stage::{Contents, SceneFile};
use super::memory::need;
use super::panics::guarded;
use super::report::{ImageReport, Status};
use super::run::{Event, ImageId, Shared, reported_name};
use super::settings::{FileSettings, Task};
use super::size::{aspect_note, check_crop, size_for};
use super::write_stage::{Made, Picture};
use crate::error::RenderError;
use crate::load::LoadEstimate;
use crate::render::{Frame, Progress, RenderSettings, render, window};
use crate::scene::Scene;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, SyncSender};
use std::time::Instant;

/// A file that was read, as it is in one frame, or why not.
pub(super) struct Loaded {
    pub task: usize,
    /// Of its animation; `None`: it is as written.
    pub frame: Option<u32>,
    /// Of its first image.
    pub id: ImageId,
    /// Of its first image.
    pub progress: Arc<Progress>,
    pub contents: Result<Contents, String>,
    /// Wall seconds of reading.
    pub seconds: f64,
}

/// The thread that renders.
pub(super) struct RenderStage {
    pub shared: Arc<Shared>,
    pub events: Sender<Event>,
    pub pool: rayon::ThreadPool,
}

/// The receiving end is gone, or nothing is to be handed on any more.
struct Ended;

impl RenderStage {
    /// Renders what comes, in order, and hands it on.
    pub fn run(&self, loaded: &Receiver<Loaded>, to_write: &SyncSender<Made>) {
        for loaded in loaded {
            if self.shared.is_stopped() || self.file(loaded, to_write).is_err() {
                return;
            }
        }
    }

    fn hand_on(&self, made: Made, to_write: &SyncSender<Made>) -> Result<(), Ended> {
        self.shared.shares.done();
        let is_open = self.shared.opens_to_writer();
        if is_open && to_write.send(made).is_ok() { Ok(()) } else { Err(Ended) }
    }

    /// All images of one file.
    fn file(&self, loaded: Loaded, to_write: &SyncSender<Made>) -> Result<(), Ended> {
        let Loaded { task, frame, id, progress, contents, seconds } = loaded;
        let Task { input, settings } = &self.shared.settings.tasks[task];
        let naming = &self.shared.plan.namings[task];
        let image = || Box::new(ImageReport { frame, ..blank(&input.path, settings) });
        let SceneFile { scene, sources, times, names, chosen, why, reading, grant } = match contents {
            Ok(Contents::Scene(file)) => *file,
            Ok(Contents::Kept(images)) => {
                for (id, progress, image) in images {
                    let image = Box::new(image);
                    self.hand_on(
                        Made { task, id, progress, image, output: None, picture: None, is_bad_input: false },
                        to_write,
                    )?;
                }
                return Ok(());
            }
            Err(message) => {
                let mut image = image();
                fail(&mut image, message);
                image.seconds.total = seconds;
                // A pattern or a folder has no name of its own to write under.
                let output = input.problem.is_none().then(|| naming.output("0", false, frame));
                return self
                    .hand_on(Made { task, id, progress, image, output, picture: None, is_bad_input: true }, to_write);
            }
        };
        let outputs = naming.outputs(&names, &chosen, frame);
        let mut first = Some((id, progress, seconds, times.load, times.decode));
        for (&camera, output) in chosen.iter().zip(outputs) {
            let (id, progress, before, load, decode) = first.take().unwrap_or_else(|| {
                let (id, progress) = self.shared.start(&self.events, task, &output);
                // The file was read for the first image already.
                (id, progress, 0.0, 0.0, 0.0)
            });
            let clock = Instant::now();
            let mut image = image();
            (image.seconds.load, image.seconds.decode) = (Some(load), Some(decode));
            image.scene = Some(scene.index);
            image.camera = reported_name(&names, camera);
            image.warnings.clone_from(&scene.warnings);
            image.losses.clone_from(&scene.losses);
            image.skipped.clone_from(&scene.skipped);
            image.why.clone_from(&why);
            let mut made = Made { task, id, progress, image, output: None, picture: None, is_bad_input: false };
            // Names that were guessed before loading are known now.
            if self.shared.plan.owners.get(&output).is_some_and(|owner| *owner != task) {
                let (path, output) = (input.path.display(), output.display());
                fail(&mut made.image, format!("{path}: {output} belongs to another input; use --name"));
            } else {
                // Of several images some may be up to date.
                if chosen.len() > 1
                    && !self.shared.settings.force
                    && let Ok(image) = self.shared.kept(task, camera, frame, &output)
                {
                    made.image = Box::new(image);
                    self.hand_on(made, to_write)?;
                    continue;
                }
                made.output = Some(output);
                match self.image(task, &scene, reading, camera, &made.progress, &mut made.image) {
                    Ok(rendered) => {
                        made.picture = rendered.map(|(rendered, settings)| {
                            Box::new(Picture {
                                rendered,
                                settings,
                                camera,
                                frame,
                                sources: Arc::clone(&sources),
                                _grant: grant.clone(),
                            })
                        });
                    }
                    Err(Interrupted) => return Err(Ended),
                }
            }
            made.image.seconds.total = before + clock.elapsed().as_secs_f64();
            self.hand_on(made, to_write)?;
            if self.shared.is_stopped() {
                return Err(Ended);
            }
        }
        Ok(())
    }

    /// One image; `None` if there is nothing to write, for which `image` has the reason.
    fn image(
        &self,
        task: usize,
        scene: &Scene,
        reading: LoadEstimate,
        camera: usize,
        progress: &Progress,
        image: &mut ImageReport,
    ) -> Result<Option<(Frame, RenderSettings)>, Interrupted> {
        if scene.is_empty() {
            image.status = Status::Empty;
            image.warnings.push("nothing drawable: the scene has no triangles; no picture was written".into());
            return Ok(None);
        }
        let file = &*self.shared.settings.tasks[task].settings;
        let mut settings = sized(file, scene, camera, image.frame);
        settings.stopping.batch_until = self.shared.shares.until(Instant::now());
        (image.width, image.height) = (Some(settings.width), Some(settings.height));
        image.notes.extend(aspect_note(file.size, scene, camera));
        let mut is_interrupted = false;
        let fits = || {
            settings.crop.map_or(Ok(()), |c| check_crop(c, settings.width, settings.height))?;
            let window = window(&settings);
            let need = need(scene, reading, &settings, file);
            self.shared.memory.check(&need, Some((window.width, window.height)))
        };
        let rendered = match fits() {
            Err(message) => Err(message),
            Ok(()) => self.pool.install(|| {
                guarded(|| {
                    render(scene, camera, &settings, progress).map_err(|error| {
                        is_interrupted = error == RenderError::Interrupted;
                        error.to_string()
                    })
                })
            }),
        };
        match rendered {
            Ok(frame) => {
                describe(&frame, image);
                image.notes.extend(lens_notes(file, frame.stats.lens.as_ref()));
                Ok(Some((frame, settings)))
            }
            Err(_) if is_interrupted => Err(Interrupted),
            Err(message) => {
                fail(image, format!("{}: {message}", image.input));
                Ok(None)
            }
        }
    }
}

/// The settings of a camera's picture in a frame.
pub(super) fn sized(file: &FileSettings, scene: &Scene, camera: usize, frame: Option<u32>) -> RenderSettings {
    let (width, height) = size_for(file.size, scene, camera);
    let frame = frame.unwrap_or(file.render.frame);
    RenderSettings { width, height, frame, focus_point: scene.focus, threads: None, ..file.render.clone() }
}

/// The run is to end.
struct Interrupted;

/// Makes `image` a failure.
pub(super) fn fail(image: &mut ImageReport, message: String) {
    image.status = Status::Failed;
    image.error_message = Some(message);
}
