//! When a picture is good enough, or has had its time: after which numbers of samples it is looked at, and what follows.
//!
//! Pure decisions, without a clock: whoever traces tells how long waves took and what the film says of its error.
//! Decision 14 (docs/decisions/0014-stopping.md) has the reasons and the numbers.

use crate::film::{Errors, blocks};
use std::time::{Duration, Instant};

/// What may end the sampling of a picture before [`super::RenderSettings::spp`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stopping {
    /// The upper end of the 95 % interval of the estimated sqrt(relMSE) is at most this, above 0.
    pub target_error: Option<f64>,
    /// So much time was spent on samples.
    pub time_limit: Option<Duration>,
    /// Then the picture's share of its batch's time is over.
    pub batch_until: Option<Instant>,
}

impl Stopping {
    /// Whether the number of samples is open.
    pub fn is_open(&self) -> bool {
        *self != Self::default()
    }
}

/// What ended the sampling of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StoppedBy {
    /// It had all samples that were asked for.
    #[default]
    Spp,
    /// Its error was small enough.
    TargetError,
    /// Its time was over.
    TimeLimit,
    /// Its share of its batch's time was over.
    BatchTimeLimit,
}

/// Fewer samples than this say too little about rare bright paths to stop.
const LEAST: u32 = 64;
/// At so many samples a picture is looked at for the first time.
const FIRST_LOOK: u32 = 32;
/// Samples are spread over the pixels by what a stage of at least this share of all of them tells.
const STAGE: f64 = 1.0 / 16.0;
/// They are not where less work than this share is in sight: what is told by few samples flatters.
const WORTH: f64 = 0.7;
/// What of the time left the last wave is made to take.
const FILL: f64 = 0.98;

/// How a picture is taken on, wave by wave.
#[derive(Debug)]
pub(super) struct Waves {
    most: u32,
    target: Option<f64>,
    /// Wall seconds from the first sample on, and what they are a limit of.
    limit: Option<(f64, StoppedBy)>,
    done: u32,
    /// Wall seconds a sample of each pixel, of the wave before.
    pace: f64,
    /// What the film said now and at the look before.
    now: Option<Errors>,
    before: Option<Errors>,
    /// Looks at which nothing was seen but black.
    black: u32,
    is_spread: bool,
}

/// What follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Next {
    /// On to so many samples a pixel.
    To(u32),
    /// On by the next wave of samples that are spread unevenly.
    Spread,
    /// The picture is done.
    Stop(StoppedBy),
}

impl Waves {
    /// Of a picture whose sampling starts at `start`, with `most` samples a pixel at most.
    pub fn new(stopping: &Stopping, most: u32, start: Instant) -> Self {
        let own = stopping.time_limit.map(|limit| (limit.as_secs_f64(), StoppedBy::TimeLimit));
        let share = stopping.batch_until.map(|until| until.saturating_duration_since(start).as_secs_f64());
        let share = share.map(|seconds| (seconds, StoppedBy::BatchTimeLimit));
        let limit = [own, share].into_iter().flatten().reduce(|a, b| if b.0 < a.0 { b } else { a });
        Self {
            most,
            target: stopping.target_error,
            limit,
            done: 0,
            pace: 0.0,
            now: None,
            before: None,
            black: 0,
            is_spread: false,
        }
    }

    /// What follows when `elapsed` seconds have passed since the first sample.
    pub fn next(&self, elapsed: f64) -> Next {
        if self.is_good_enough() {
            return Next::Stop(StoppedBy::TargetError);
        }
        if self.done >= self.most {
            return Next::Stop(StoppedBy::Spp);
        }
        if self.is_spread {
            return Next::Spread;
        }
        let to = self.rung().min(self.most);
        // The least picture has one sample a pixel, however little time there is.
        let Some((seconds, by)) = self.limit.filter(|_| self.done > 0) else { return Next::To(to) };
        let fitting = self.fitting(seconds - elapsed);
        // A film that ended between the ends of blocks cannot go on.
        if fitting < 1.0 || !blocks::is_end(self.done) {
            return Next::Stop(by);
        }
        Next::To(if fitting < f64::from(to - self.done) { self.done + fitting as u32 } else { to })
    }

    /// How many samples a pixel fit into `left` seconds.
    fn fitting(&self, left: f64) -> f64 {
        (FILL * left / self.pace.max(1e-9)).floor().max(0.0)
    }

    /// Where the next wave ends if nothing is in its way.
    fn rung(&self) -> u32 {
        match (self.limit, self.target) {
            (None, None) => self.most,
            (None, Some(_)) if self.done == 0 => FIRST_LOOK,
            // Small waves tell how fast it goes.
            (Some(_), _) if self.done == 0 => 1,
            (_, Some(_)) if self.done >= LEAST => blocks::next_end(self.done),
            _ => (self.done + 1).next_power_of_two(),
        }
    }

    /// A wave that ended at `spp` samples (the mean where they are spread) took `seconds`.
    pub fn took(&mut self, spp: u32, seconds: f64) {
        self.pace = seconds / f64::from(spp.saturating_sub(self.done).max(1));
        self.done = spp;
    }

    /// Whether it is time to think about spreading samples unevenly: a target is far enough away to gain by it, and near
    /// enough that what is known now is a good share of what there will be. A limit of time would make of it a picture
    /// that cannot be had again.
    pub fn may_spread(&self) -> bool {
        let (Some(target), None, false) = (self.target, self.limit, self.is_spread) else { return false };
        let Some(now) = self.now.as_ref().filter(|_| self.done >= LEAST && self.done.is_power_of_two()) else {
            return false;
        };
        let (done, needed) = (f64::from(self.done), now.spp_for(target).min(f64::from(self.most)));
        done >= STAGE * needed && 1.5 * done < needed && !self.is_good_enough()
    }

    /// Samples are spread from now on if it takes this share of the work to do so; whether they are.
    pub fn spreads(&mut self, gain: f64) -> bool {
        self.is_spread = gain < WORTH;
        self.is_spread
    }

    /// Whether it is to be known now what the film says of its error.
    pub fn looks(&self) -> bool {
        self.target.is_some() && self.done >= FIRST_LOOK
    }

    /// What the film says.
    pub fn saw(&mut self, errors: Option<Errors>) {
        self.black += u32::from(errors.is_none());
        self.before = std::mem::replace(&mut self.now, errors);
    }

    /// Whether this look and the one before agree that the target is reached: the upper end is at most the target, and so
    /// is that of the look before, carried on to now. A single bright sample that came late raises the one, one that
    /// came early the other. What is black after two looks has no relative error, and stays so.
    fn is_good_enough(&self) -> bool {
        let Some(target) = self.target.filter(|_| self.done >= LEAST) else { return false };
        let is_below = |errors: &Option<Errors>| errors.as_ref().is_some_and(|e| e.upper_at(self.done) <= target);
        (is_below(&self.now) && is_below(&self.before)) || (self.black > 1 && self.now.is_none())
    }

    /// How many samples a pixel there will be in the end; `None` = that cannot be known yet.
    pub fn expected(&self, elapsed: f64) -> Option<u32> {
        let by_error = match (self.target, &self.now) {
            (Some(target), Some(now)) => {
                let needed = now.spp_for(target).min(f64::from(self.most));
                let mut end = self.done.max(LEAST.min(self.most));
                while f64::from(end) < needed {
                    end = blocks::next_end(end);
                }
                Some(end)
            }
            (Some(_), None) => None,
            (None, _) => Some(self.most),
        };
        let timed = self.limit.filter(|_| self.done > 0);
        let by_time = timed.map(|(seconds, _)| self.done.saturating_add(self.fitting(seconds - elapsed) as u32));
        by_error.into_iter().chain(by_time).min().map(|spp| spp.clamp(self.done.max(1), self.most))
    }

    /// What the film said last, if that was at as many samples as there are now.
    pub fn into_errors(self) -> Option<Errors> {
        self.now
    }
}

#[cfg(test)]
#[path = "stopping_tests.rs"]
mod tests;
