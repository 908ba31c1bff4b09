//! What a run is asked to do: settings of files, of the run, and the pairs of the two that it works off.

use super::environment::EnvironmentSource;
use super::frames::Frames;
use super::input::Input;
use super::job::CameraChoice;
use super::memory::MemoryLimit;
use super::names::NameTemplate;
use super::picture::FileOptions;
use super::size::PictureSize;
use super::view::CameraSource;
use crate::load::LoadOptions;
use crate::render::RenderSettings;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// How the images of one file are made; may differ from file to file.
#[derive(Clone, Debug, Default)]
pub struct FileSettings {
    /// Output names; `None` = the stem, with the camera where there are several.
    pub name: Option<NameTemplate>,
    /// Size of every picture.
    pub size: PictureSize,
    /// Where the cameras come from.
    pub camera_source: CameraSource,
    /// Which of them.
    pub cameras: CameraChoice,
    /// What lights it from all around in place of an environment of its own.
    pub environment: Option<EnvironmentSource>,
    /// Which frames of its animation; `None` = the file as written.
    pub frames: Option<Frames>,
    /// How the file is read.
    pub load: LoadOptions,
    /// Everything else about the pictures; width and height are set from `size` for each, threads belong to the run.
    pub render: RenderSettings,
    /// What is written.
    pub files: FileOptions,
}

/// One input and how it is to be rendered.
#[derive(Clone, Debug)]
pub struct Task {
    /// The file, or why there is none.
    pub input: Input,
    /// Shared by the inputs that are rendered alike.
    pub settings: Arc<FileSettings>,
}

/// What holds for the whole run.
#[derive(Clone, Debug, Default)]
pub struct BatchSettings {
    /// What to render, in this order.
    pub tasks: Vec<Task>,
    /// Where files go.
    pub out: PathBuf,
    /// Threads that render; `None` = the cores this process may use.
    pub threads: Option<usize>,
    /// Memory that may be used; `None` = [`super::memory::DEFAULT_SHARE`] of what this process may use.
    pub memory: Option<MemoryLimit>,
    /// Time for all images together, which share what is left of it.
    pub batch_time_limit: Option<Duration>,
    /// Render even what is up to date.
    pub force: bool,
    /// Count lost content, dropped samples and empty scenes as failures.
    pub strict: bool,
    /// Write `index.html`.
    pub report: bool,
    /// The command line, for the report.
    pub command: String,
    /// Set it and the run ends soon: the image under way is dropped, finished ones are written.
    pub cancel: Arc<AtomicBool>,
}

impl BatchSettings {
    /// One task for each of `inputs`, all rendered alike.
    pub fn tasks_for(inputs: Vec<Input>, settings: FileSettings) -> Vec<Task> {
        let settings = Arc::new(settings);
        inputs.into_iter().map(|input| Task { input, settings: Arc::clone(&settings) }).collect()
    }

    /// `<out>/<output>.<extension>`.
    pub(super) fn path(&self, output: &Path, extension: &str) -> PathBuf {
        let mut name = self.out.join(output).into_os_string();
        name.push(".");
        name.push(extension);
        name.into()
    }
}
