//! Many files to many pictures, without a terminal: inputs with their settings ([`Task`]) become jobs with output names
//! ([`job`]), [`run()`] loads, renders and writes them, and says what happened in a [`report`].
//!
//! One bad file does not stop the others; clashing names are refused before anything is rendered.

mod budget;
pub mod content;
mod describe;
mod develop;
pub mod doctor;
mod elsewhere;
mod environment;
pub mod explain;
pub mod fingerprint;
mod frames;
pub mod host;
pub mod html;
pub mod input;
pub mod job;
mod load_stage;
pub mod memory;
pub mod names;
pub mod output;
pub mod panics;
mod pattern;
mod peek;
mod picture;
mod render_stage;
pub mod report;
mod run;
mod settings;
mod shares;
mod size;
pub mod up_to_date;
mod view;
mod write_stage;

pub use develop::{Developed, Tone, develop};
pub use environment::{EnvironmentOrigin, EnvironmentSource};
pub use frames::{FrameChoice, Frames};
pub use picture::FileOptions;
pub use run::{ImageId, Observer, Outcome, Started, Stop, run};
pub use settings::{BatchSettings, FileSettings, Task};
pub use size::{MAX_SIDE, PictureSize};
pub use view::{CameraSource, View};
