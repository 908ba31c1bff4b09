//! Writes the pictures that were rendered, EXR first, the report last: it says what the others hold.

use super::budget::Grant;
use super::develop::develop;
use super::fingerprint::Fingerprint;
use super::load_stage::Sources;
use super::output::{WriteError, write_atomic, write_whole};
use super::panics::guarded;
use super::picture::exr_bytes;
use super::render_stage::fail;
use super::report::{self, ExposureReport, ImageReport, Status};
use super::run::{Event, ImageId, Shared};
use crate::render::{Frame, Phase, Progress, RenderSettings};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, Sender};
use std::time::Instant;

/// An image as it leaves rendering.
pub(super) struct Made {
    pub task: usize,
    pub id: ImageId,
    pub progress: Arc<Progress>,
    pub image: Box<ImageReport>,
    /// Output path without extension, below the output folder; `None` = it may write nothing, not even its report.
    pub output: Option<PathBuf>,
    /// `None` = there is none, and `image` says why.
    pub picture: Option<Box<Picture>>,
    /// The file could not be read.
    pub is_bad_input: bool,
}

/// A picture to write.
pub(super) struct Picture {
    pub rendered: Frame,
    /// With which it was rendered.
    pub settings: RenderSettings,
    /// Its place among the scene's.
    pub camera: usize,
    pub frame: Option<u32>,
    pub sources: Arc<Sources>,
    /// Held until it is written.
    pub _grant: Option<Arc<Grant>>,
}

/// The thread that writes.
pub(super) struct WriteStage {
    pub shared: Arc<Shared>,
    pub events: Sender<Event>,
}

impl WriteStage {
    /// Writes what comes, in order, until something cannot be written.
    pub fn run(&self, made: &Receiver<Made>) {
        for made in made {
            let (id, task, is_bad_input) = (made.id, made.task, made.is_bad_input);
            let (image, written) = self.write(made);
            let is_written = written.is_ok();
            // Nobody listens any more when the run was ended.
            let _ = self.events.send(Event::Finished { id, task, image, is_bad_input });
            if let Err(error) = written {
                self.shared.stop.store(true, Ordering::Relaxed);
                let _ = self.events.send(Event::Unwritable(error));
            }
            self.shared.written();
            if !is_written {
                return;
            }
        }
    }

    /// All files of one image.
    fn write(&self, made: Made) -> (Box<ImageReport>, Result<(), WriteError>) {
        let Made { task, progress, mut image, output, picture, .. } = made;
        progress.enter(Phase::Writing);
        let clock = Instant::now();
        let mut written = Ok(());
        if let (Some(output), Some(picture)) = (&output, picture) {
            let pictures = guarded(|| Ok(self.pictures(task, &picture, output, &mut image)));
            written = pictures.unwrap_or_else(|message| {
                let input = &image.input;
                let message = format!("{input}: {message}");
                fail(&mut image, message);
                Ok(())
            });
            image.seconds.write = Some(clock.elapsed().as_secs_f64());
            image.seconds.total += clock.elapsed().as_secs_f64();
        }
        if image.status != Status::UpToDate {
            image.peak_rss_bytes = report::peak_rss_bytes();
        }
        if let (Some(output), Ok(())) = (&output, &written) {
            let path = self.shared.settings.path(output, "json");
            image.outputs.json = Some(path.display().to_string());
            written = write_atomic(&path, report::to_json(&image).as_bytes());
        }
        if let Err(error) = &written {
            image.outputs.json = None;
            fail(&mut image, error.to_string());
        }
        (image, written)
    }

    /// EXR, then PNG.
    fn pictures(
        &self,
        task: usize,
        picture: &Picture,
        output: &Path,
        image: &mut ImageReport,
    ) -> Result<(), WriteError> {
        let Picture { rendered, settings, camera, frame, sources, _grant } = picture;
        let files = self.shared.settings.tasks[task].settings.files;
        match sources.records() {
            Ok(inputs) => {
                let wanted = self.shared.wanted(task, *camera, *frame);
                image.fingerprint =
                    Some(Fingerprint::new(&wanted, inputs.clone(), rendered.spp, rendered.stats.spread));
            }
            Err(changed) => {
                image.warnings.push(format!("{changed}; this picture will not be taken for up to date"));
            }
        }
        if files.exr {
            let fingerprint = image.fingerprint.as_ref().map(|f| f.pixels.as_str());
            match self.shared.beside.install(|| exr_bytes(rendered, settings, files.format, fingerprint)) {
                Ok((bytes, clipped)) => {
                    image.clipped_pixels = clipped;
                    image.warnings.extend(clipped.filter(|clipped| *clipped > 0).map(clipped_warning));
                    image.outputs.exr = Some(self.file(output, "exr", &bytes, &mut image.fingerprint)?);
                }
                Err(error) => {
                    fail(image, format!("{}: {error}", image.input));
                    return Ok(());
                }
            }
        }
        if files.png {
            let size = [rendered.window.width, rendered.window.height];
            let developed = develop(&rendered.pixels, None, size, files.tone);
            image.exposure = Some(ExposureReport::new(files.tone.exposure, developed.exposure));
            image.notes.extend(developed.notes);
            image.warnings.extend(developed.warnings);
            image.outputs.png = Some(self.file(output, "png", &developed.png, &mut image.fingerprint)?);
        }
        image.status = Status::Rendered;
        Ok(())
    }

    /// Writes `<out>/<output>.<extension>`, notes it and tells its path.
    fn file(
        &self,
        output: &Path,
        extension: &str,
        bytes: &[u8],
        fingerprint: &mut Option<Fingerprint>,
    ) -> Result<String, WriteError> {
        let path = self.shared.settings.path(output, extension);
        // The report, which is written last and into the same folder, syncs the folder for all three.
        write_whole(&path, bytes)?;
        if let Some(fingerprint) = fingerprint {
            fingerprint.add_output(extension, bytes);
        }
        Ok(path.display().to_string())
    }
}

fn clipped_warning(clipped: u64) -> String {
    format!(
        "{clipped} pixels are beyond 65504, the most that --exr half holds, and were clipped; --exr float keeps them"
    )
}
