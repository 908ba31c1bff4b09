//! `--progress json`: each line of stderr is one of these objects. Names of fields are the contract of `docs/cli.md`.

use super::board::ImageView;
use prt::batch::ImageId;
use prt::batch::report::{ImageReport, Status};
use serde::Serialize;
use std::collections::BTreeMap;

/// What happened.
#[derive(Debug, Serialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event<'a> {
    /// The inputs are known; so many images will come of them, as far as that can be told without loading.
    Planned { images: usize },
    /// Work on an image starts.
    Started { id: ImageId, input: &'a str, output: &'a str },
    /// How far an image is.
    Progress {
        id: ImageId,
        phase: &'static str,
        /// Since work on it started.
        seconds: f64,
        samples_done: u64,
        /// null until known.
        samples: Option<u64>,
        rays: u64,
        samples_per_s: Option<f64>,
        mrays_per_s: Option<f64>,
        /// Until it is rendered; null until that can be known.
        seconds_left: Option<f64>,
        /// Until the run is done; null until that can be known.
        run_seconds_left: Option<f64>,
    },
    /// An image is done; `image` as in `batch.json`.
    Finished { id: ImageId, image: &'a ImageReport },
    /// For people.
    Message { level: &'static str, text: &'a str },
    /// The run is done.
    Summary {
        exit_code: u8,
        interrupted: bool,
        seconds: f64,
        counts: &'a BTreeMap<Status, usize>,
        /// What could not be written; the run stopped there.
        unwritable: Option<String>,
    },
}

impl Event<'_> {
    /// How far `image` is, of a run that needs so many seconds more.
    pub fn progress(image: &ImageView, run_seconds_left: Option<f64>) -> Self {
        Self::Progress {
            id: image.id,
            phase: image.phase.name(),
            seconds: image.elapsed,
            samples_done: image.done,
            samples: (image.total > 0).then_some(image.total),
            rays: image.rays,
            samples_per_s: image.samples_per_s,
            mrays_per_s: image.mrays_per_s,
            seconds_left: image.left,
            run_seconds_left,
        }
    }
}

/// `event` on one line.
pub fn line(event: &Event<'_>) -> String {
    serde_json::to_string(event).expect("events have string keys and finite numbers")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_one_line_of_json_that_says_first_what_it_is() {
        assert_eq!(line(&Event::Planned { images: 3 }), r#"{"event":"planned","images":3}"#);
        assert_eq!(
            line(&Event::Message { level: "error", text: "a\nb" }),
            r#"{"event":"message","level":"error","text":"a\nb"}"#
        );
        let view = ImageView { id: 7, elapsed: 1.5, done: 5, ..ImageView::default() };
        assert_eq!(
            line(&Event::progress(&view, None)),
            r#"{"event":"progress","id":7,"phase":"waiting","seconds":1.5,"samples_done":5,"samples":null,"rays":0,"samples_per_s":null,"mrays_per_s":null,"seconds_left":null,"run_seconds_left":null}"#
        );
    }
}
