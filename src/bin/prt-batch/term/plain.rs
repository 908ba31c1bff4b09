//! Progress where there is no terminal: now and then a line.

use super::board::View;
use super::text::{mrays_per_s, samples_per_s, whole};
use prt::batch::ImageId;
use prt::render::Phase;

/// An image that is done within this many seconds gets no line but its last.
const NO_LINE_BEFORE: f64 = 1.0;
/// Seconds after which a line is printed although nothing has changed, so that nobody takes the run for dead.
const SILENCE: f64 = 60.0;

/// What the last line was about.
#[derive(Debug, Default)]
pub struct Lines {
    last: Option<(ImageId, Phase, u64)>,
    /// Seconds of the run.
    said_at: f64,
}

impl Lines {
    /// The line that is due; asked once a second. There is none while images follow each other quickly, because they
    /// have lines of their own, and none while nothing changes.
    pub fn due(&mut self, view: &View) -> Option<String> {
        let image = view.foremost().filter(|image| image.elapsed >= NO_LINE_BEFORE)?;
        let percent = image.share().map_or(0, |share| (100.0 * share) as u64);
        let now = (image.id, image.phase, percent);
        if self.last == Some(now) && view.elapsed - self.said_at < SILENCE {
            return None;
        }
        (self.last, self.said_at) = (Some(now), view.elapsed);
        let mut line = format!("{}: {}", image.name, image.phase.name());
        if image.phase == Phase::Rendering && image.total > 0 {
            line += &format!(" {percent} %");
        }
        line += &format!(", {}", whole(image.elapsed));
        let rates = [image.samples_per_s.map(samples_per_s), image.mrays_per_s.map(mrays_per_s)];
        rates.into_iter().flatten().for_each(|rate| line += &format!(", {rate}"));
        if let Some(left) = image.left {
            line += &format!(", {} left", whole(left));
        }
        if view.all > 1 {
            let left = view.left.map_or(String::new(), |left| format!(", about {} left", whole(left)));
            line += &format!(" ({} of {} images done{left})", view.finished, view.all);
        }
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::super::board::ImageView;
    use super::*;

    fn view(seconds: f64, done: u64) -> View {
        let image = ImageView {
            name: "cornell".into(),
            phase: Phase::Rendering,
            elapsed: seconds,
            done,
            total: 1000,
            samples_per_s: Some(12_345_678.0),
            mrays_per_s: Some(82.1),
            left: Some(4.4),
            ..ImageView::default()
        };
        View { finished: 12, all: 500, elapsed: 60.0 + seconds, left: Some(2640.0), images: vec![image] }
    }

    #[test]
    fn a_line_says_how_far_the_image_and_the_run_are() {
        assert_eq!(
            Lines::default().due(&view(3.2, 439)).as_deref(),
            Some(
                "cornell: rendering 43 %, 3 s, 12.3 Msamples/s, 82 Mray/s, 4 s left (12 of 500 images done, about \
                 44 min left)"
            )
        );
    }

    #[test]
    fn nothing_is_said_where_nothing_changed_but_for_a_minute() {
        let mut lines = Lines::default();
        assert_eq!(lines.due(&view(0.5, 10)), None, "it may be done at once");
        assert!(lines.due(&view(1.5, 10)).is_some());
        assert_eq!(lines.due(&view(2.5, 12)), None);
        assert!(lines.due(&view(3.5, 20)).is_some());
        assert_eq!(lines.due(&view(60.0, 20)), None);
        assert!(lines.due(&view(63.6, 20)).is_some());
    }
}
