//! `--batch-time-limit`: the time that is left, in equal shares for the images that are left. What an image does not use,
//! because its error was small enough or it was up to date, the others have.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Instant;

/// The time of a run.
#[derive(Debug)]
pub(super) struct Shares {
    /// When all of it is over; `None` = there is no limit.
    end: Option<Instant>,
    /// Images that are not done yet, as far as that can be told without loading.
    left: AtomicUsize,
}

impl Shares {
    /// Of a run of `images`.
    pub fn new(end: Option<Instant>, images: usize) -> Self {
        Self { end, left: images.into() }
    }

    /// An image is done, rendered or not.
    pub fn done(&self) {
        // There may be more than were foreseen.
        let _ = self.left.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1));
    }

    /// When the share of an image is over that starts `now`; `None` = never. In the past when the run's time is over.
    pub fn until(&self, now: Instant) -> Option<Instant> {
        let end = self.end?;
        let left = self.left.load(Relaxed).max(1);
        Some(now + end.saturating_duration_since(now) / u32::try_from(left).unwrap_or(u32::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn what_is_left_is_shared_by_the_images_that_are_left() {
        let now = Instant::now();
        let seconds = Duration::from_secs;
        let shares = Shares::new(Some(now + seconds(90)), 3);
        assert_eq!(shares.until(now), Some(now + seconds(30)));
        shares.done();
        // It took 10 of its 30.
        assert_eq!(shares.until(now + seconds(10)), Some(now + seconds(50)));
        shares.done();
        assert_eq!(shares.until(now + seconds(50)), Some(now + seconds(90)));
        // An image that nobody foresaw, and one when the time is over.
        shares.done();
        shares.done();
        assert_eq!(shares.until(now + seconds(80)), Some(now + seconds(90)));
        assert_eq!(shares.until(now + seconds(100)), Some(now + seconds(100)));
        assert_eq!(Shares::new(None, 3).until(now), None);
    }
}
