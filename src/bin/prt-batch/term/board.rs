//! What is under way, how fast it goes and how long it will take; read by whoever shows it.

use prt::batch::report::Status;
use prt::batch::{ImageId, Started};
use prt::render::{Phase, Progress};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Instant;

/// Before this many seconds of rendering nothing is said about its speed.
const FIRST_SPEED: f64 = 0.3;
/// Before this many seconds of rendering, and before this share of it, nothing is said about its end.
const FIRST_GUESS: (f64, f64) = (1.0, 0.01);

/// The state of a run.
#[derive(Debug)]
pub struct Board {
    since: Instant,
    /// Images, as far as that can be told without loading.
    planned: usize,
    finished: usize,
    last_finish: Instant,
    /// Images that had to be rendered, and the seconds between the end of each and of the one before.
    rendered: usize,
    rendered_seconds: f64,
    under_way: Vec<UnderWay>,
}

#[derive(Debug)]
struct UnderWay {
    id: ImageId,
    name: String,
    /// What was being done when it was last looked at, and since when.
    phase: (Phase, Instant),
    progress: Arc<Progress>,
    /// When it was first seen to be rendered, and the samples and rays that it had then.
    rendering: Option<(Instant, u64, u64)>,
}

/// A run at a moment. Durations in seconds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View {
    pub finished: usize,
    /// Images in all, as far as that is known.
    pub all: usize,
    pub elapsed: f64,
    /// Until the run's end; `None` = cannot be known yet.
    pub left: Option<f64>,
    /// In the order in which they started.
    pub images: Vec<ImageView>,
}

/// An image at a moment. Durations in seconds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageView {
    pub id: ImageId,
    pub name: String,
    pub phase: Phase,
    /// Since its phase began: one that was read early waits for its turn.
    pub elapsed: f64,
    /// Camera samples finished, and to do in all; 0 until known.
    pub done: u64,
    pub total: u64,
    pub rays: u64,
    /// Camera samples a second of rendering; `None` unless it is being rendered, and in the first moment.
    pub samples_per_s: Option<f64>,
    pub mrays_per_s: Option<f64>,
    /// Until it is rendered; `None` = cannot be known yet.
    pub left: Option<f64>,
}

impl ImageView {
    /// The part of its samples that is finished, in [0, 1]; `None` before they are counted.
    pub fn share(&self) -> Option<f64> {
        (self.total > 0).then(|| (self.done as f64 / self.total as f64).min(1.0))
    }
}

impl View {
    /// The image to talk about if there is room for one: that which is rendered, else the oldest.
    pub fn foremost(&self) -> Option<&ImageView> {
        self.images.iter().find(|image| image.phase == Phase::Rendering).or(self.images.first())
    }
}

impl Board {
    /// Of a run that starts now.
    pub fn new(now: Instant) -> Self {
        Self {
            since: now,
            planned: 0,
            finished: 0,
            last_finish: now,
            rendered: 0,
            rendered_seconds: 0.0,
            under_way: Vec::new(),
        }
    }

    /// So many images will come of the inputs.
    pub fn plan(&mut self, images: usize, now: Instant) {
        (self.planned, self.last_finish) = (images, now);
    }

    /// Images in all, as far as that is known.
    pub fn all(&self) -> usize {
        self.planned.max(self.finished + self.under_way.len())
    }

    /// Images done.
    pub fn finished(&self) -> usize {
        self.finished
    }

    /// Work on an image starts.
    pub fn start(&mut self, image: &Started, now: Instant) {
        let name = super::text::printable(&image.output.display().to_string());
        let progress = Arc::clone(&image.progress);
        self.under_way.push(UnderWay { id: image.id, name, phase: (Phase::Waiting, now), progress, rendering: None });
    }

    /// An image is done.
    pub fn finish(&mut self, id: ImageId, status: Status, now: Instant) {
        self.under_way.retain(|image| image.id != id);
        self.finished += 1;
        // What was up to date or bad says nothing about how long the others will take.
        if status == Status::Rendered {
            self.rendered += 1;
            self.rendered_seconds += now.duration_since(self.last_finish).as_secs_f64();
        }
        self.last_finish = now;
    }

    /// The run as it is now.
    pub fn view(&mut self, now: Instant) -> View {
        let images: Vec<_> = self.under_way.iter_mut().map(|image| image.view(now)).collect();
        let mut view = View {
            finished: self.finished,
            all: self.all(),
            elapsed: now.duration_since(self.since).as_secs_f64(),
            left: None,
            images,
        };
        view.left = self.left(&view, now);
        view
    }

    /// From the mean time between the ends of rendered images, and from how far the current one is.
    fn left(&self, view: &View, now: Instant) -> Option<f64> {
        let waiting = view.all.checked_sub(view.finished + 1)?;
        let current = view.foremost().and_then(|image| image.left);
        let so_far = now.duration_since(self.last_finish).as_secs_f64();
        let mean = match self.rendered {
            0 => so_far + current?,
            n => self.rendered_seconds / n as f64,
        };
        Some(current.unwrap_or((mean - so_far).max(0.0)) + waiting as f64 * mean)
    }
}

impl UnderWay {
    fn view(&mut self, now: Instant) -> ImageView {
        let progress = &*self.progress;
        let phase = progress.phase();
        let counts = [&progress.done, &progress.total, &progress.rays];
        let [done, total, rays] = counts.map(|count| count.load(Relaxed));
        if self.phase.0 != phase {
            self.phase = (phase, now);
        }
        let elapsed = now.duration_since(self.phase.1).as_secs_f64();
        let mut view =
            ImageView { id: self.id, name: self.name.clone(), phase, elapsed, done, total, rays, ..Default::default() };
        if phase == Phase::Rendering && total > 0 {
            let (since, first_done, first_rays) = *self.rendering.get_or_insert((now, done, rays));
            let seconds = now.duration_since(since).as_secs_f64();
            let samples = (done - first_done.min(done)) as f64;
            if seconds >= FIRST_SPEED {
                view.samples_per_s = Some(samples / seconds);
                view.mrays_per_s = Some((rays - first_rays.min(rays)) as f64 / seconds * 1e-6);
            }
            if seconds >= FIRST_GUESS.0 && samples >= FIRST_GUESS.1 * total as f64 {
                view.left = Some(total.saturating_sub(done) as f64 * seconds / samples);
            }
        }
        view
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn image(id: ImageId) -> Started {
        Started { id, input: "a.gltf".into(), output: "a".into(), progress: Arc::default() }
    }

    fn after(start: Instant, seconds: f64) -> Instant {
        start + Duration::from_secs_f64(seconds)
    }

    #[test]
    fn an_image_s_speed_and_end_are_told_from_what_was_seen_of_its_rendering() {
        let start = Instant::now();
        let mut board = Board::new(start);
        board.plan(1, start);
        let started = image(0);
        board.start(&started, start);
        started.progress.enter(Phase::Loading);
        let loading = board.view(after(start, 4.0));
        assert_eq!((loading.images[0].left, loading.images[0].elapsed), (None, 0.0));
        assert_eq!(board.view(after(start, 5.0)).images[0].elapsed, 1.0);
        started.progress.enter(Phase::Rendering);
        started.progress.total.store(1000, Relaxed);
        assert_eq!(board.view(after(start, 5.0)).images[0].samples_per_s, None, "nothing is known in the first moment");
        started.progress.done.store(200, Relaxed);
        started.progress.rays.store(4_000_000, Relaxed);
        let view = board.view(after(start, 7.0));
        assert_eq!((view.images[0].samples_per_s, view.images[0].mrays_per_s), (Some(100.0), Some(2.0)));
        assert_eq!((view.images[0].left, view.left, view.images[0].share()), (Some(8.0), Some(8.0), Some(0.2)));
        started.progress.enter(Phase::Writing);
        assert_eq!(board.view(after(start, 8.0)).images[0].samples_per_s, None);
    }

    #[test]
    fn the_end_of_a_run_is_guessed_from_rendered_images_and_not_from_others() {
        let start = Instant::now();
        let mut board = Board::new(start);
        board.plan(10, start);
        for id in 0..4 {
            board.start(&image(id), start);
        }
        assert_eq!(board.view(after(start, 0.5)).left, None);
        // Three that were there already; then one took four seconds.
        (0..3).for_each(|id| board.finish(id, Status::UpToDate, after(start, 1.0)));
        assert_eq!(board.view(after(start, 1.0)).left, None, "what was up to date says nothing");
        board.finish(3, Status::Rendered, after(start, 5.0));
        board.start(&image(4), after(start, 5.0));
        let view = board.view(after(start, 6.0));
        assert_eq!((view.finished, view.all), (4, 10));
        // Three more seconds for the current one, and five others.
        assert_eq!(view.left, Some(3.0 + 5.0 * 4.0));
    }

    #[test]
    fn images_that_nobody_planned_are_counted() {
        let now = Instant::now();
        let mut board = Board::new(now);
        board.plan(1, now);
        (0..3).for_each(|id| board.start(&image(id), now));
        assert_eq!(board.view(now).all, 3);
    }
}
