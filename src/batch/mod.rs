//! Many files to many pictures, without a terminal: inputs become jobs with output names ([`job`]), [`run()`] loads,
//! renders and writes them, and says what happened in a [`report`].
//!
//! One bad file does not stop the others; clashing names are refused before anything is rendered.

pub mod host;
pub mod input;
pub mod job;
pub mod memory;
pub mod names;
pub mod output;
mod peek;
mod picture;
pub mod report;
mod run;
mod size;
mod view;

pub use picture::FileOptions;
pub use run::{BatchSettings, Observer, Outcome, Stop, run};
pub use size::{MAX_SIDE, PictureSize};
pub use view::{CameraSource, View};
