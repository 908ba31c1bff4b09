//! Writes the pictures that were rendered, EXR first, the report last: it says what the others hold.

use super::fingerprint::Fingerprint;
use super::output::{WriteError, write_atomic};
use super::picture::{exr_bytes, png_bytes};
use super::render_stage::fail;
use super::report::{self, ImageReport, Status};
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
    /// The picture and the settings it was rendered with; `None` = there is none, and `image` says why.
    pub frame: Option<Box<(Frame, RenderSettings)>>,
    /// The file could not be read.
    pub is_bad_input: bool,
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
        let Made { task, progress, mut image, output, frame, .. } = made;
        progress.enter(Phase::Writing);
        let clock = Instant::now();
        let mut written = Ok(());
        if let (Some(output), Some(frame)) = (&output, frame) {
            written = self.pictures(task, &frame.0, &frame.1, output, &mut image);
            image.seconds.write = Some(clock.elapsed().as_secs_f64());
            image.seconds.total += clock.elapsed().as_secs_f64();
        }
        image.peak_rss_bytes = report::peak_rss_bytes();
        if let (Some(output), Ok(())) = (&output, &written) {
            let path = self.path(output, "json");
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
        frame: &Frame,
        settings: &RenderSettings,
        output: &Path,
        image: &mut ImageReport,
    ) -> Result<(), WriteError> {
        let files = self.shared.settings.tasks[task].settings.files;
        if files.exr {
            let fingerprint = image.fingerprint.as_ref().map(|f| f.pixels.as_str());
            match self.shared.beside.install(|| exr_bytes(frame, settings, files.compression, fingerprint)) {
                Ok(bytes) => image.outputs.exr = Some(self.file(output, "exr", &bytes, &mut image.fingerprint)?),
                Err(error) => {
                    fail(image, format!("{}: {error}", image.input));
                    return Ok(());
                }
            }
        }
        if files.png {
            let (bytes, nan_channels) = png_bytes(frame, &files.tone);
            if nan_channels > 0 {
                image.warnings.push(format!("{nan_channels} channels of the picture are NaN; the PNG shows them as 0"));
            }
            image.outputs.png = Some(self.file(output, "png", &bytes, &mut image.fingerprint)?);
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
        let path = self.path(output, extension);
        write_atomic(&path, bytes)?;
        if let Some(fingerprint) = fingerprint {
            fingerprint.add_output(extension, bytes);
        }
        Ok(path.display().to_string())
    }

    fn path(&self, output: &Path, extension: &str) -> PathBuf {
        let mut name = self.shared.settings.out.join(output).into_os_string();
        name.push(".");
        name.push(extension);
        name.into()
    }
}
