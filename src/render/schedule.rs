//! Units of work among threads: whoever is free takes the next one, and no result depends on who that was.

use super::Progress;
use crate::film::{TileSums, Wave};
use crate::integrator::{Counters, PathTracer, SampleSink, Unit, Worker};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Samples remembered by place when they had to be dropped.
const EXAMPLES: usize = 4;

/// What all workers counted together.
#[derive(Debug, Default)]
pub struct Totals {
    /// Rays and events.
    pub counters: Counters,
    /// Samples dropped because a channel was not finite.
    pub non_finite: u64,
    /// The first few of them in the order of units: (x, y, sample).
    pub examples: Vec<(u32, u32, u32)>,
}

/// What a worker found.
#[derive(Default)]
struct Found {
    /// What the clamp took, by unit, so that no sum depends on who traced what.
    taken: Vec<(usize, f64)>,
    /// Dropped samples, by unit.
    examples: Vec<(usize, (u32, u32, u32))>,
}

impl Totals {
    /// Adds those of a later wave.
    pub fn add(&mut self, later: Self) {
        self.counters.add(&later.counters);
        self.non_finite += later.non_finite;
        self.examples.extend(later.examples);
        self.examples.truncate(EXAMPLES);
    }
}

/// Adds a unit's samples to its tile's sums.
struct Sink<'a> {
    unit: &'a Unit,
    progress: &'a Progress,
    sums: TileSums,
    /// Finished since the last wave.
    finished: u64,
    /// Rays at the last wave.
    rays: u64,
    non_finite: u64,
    examples: Vec<(u32, u32, u32)>,
}

impl SampleSink for Sink<'_> {
    #[inline]
    fn add(&mut self, pixel: u32, sample: u32, radiance: [f32; 3]) {
        self.sums.add(pixel, sample, radiance);
        self.finished += 1;
    }

    #[cold]
    fn drop_non_finite(&mut self, pixel: u32, sample: u32) {
        self.non_finite += 1;
        self.finished += 1;
        if self.examples.len() < EXAMPLES {
            self.examples.push((self.unit.x + pixel % self.unit.width, self.unit.y + pixel / self.unit.width, sample));
        }
    }

    #[inline]
    fn goes_on(&mut self, counters: &Counters) -> bool {
        let rays = counters.total();
        self.progress.rays.fetch_add(rays - self.rays, Ordering::Relaxed);
        self.progress.done.fetch_add(std::mem::take(&mut self.finished), Ordering::Relaxed);
        self.rays = rays;
        !self.progress.is_cancelled()
    }
}

/// Traces every unit of `wave` on the threads of the current rayon pool. Ends early, with units missing, when
/// `progress` is cancelled: a round of a worker's paths takes about a millisecond.
pub fn trace(tracer: &PathTracer<'_>, wave: &Wave, progress: &Progress) -> Totals {
    let next = AtomicUsize::new(0);
    let found = Mutex::new((Totals::default(), Found::default()));
    rayon::broadcast(|_| {
        let mut worker = Worker::default();
        let mut non_finite = 0;
        let mut own = Found::default();
        while !progress.is_cancelled() {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= wave.units() {
                break;
            }
            let (tile, samples) = wave.unit(i);
            let sums = TileSums::new(&tile, &samples);
            let only = wave.only(i);
            let unit = Unit { x: tile.x, y: tile.y, width: tile.width, height: tile.height, samples, only };
            let before = worker.counters.total();
            let mut sink = Sink {
                unit: &unit,
                progress,
                sums,
                finished: 0,
                rays: worker.counters.total(),
                non_finite: 0,
                examples: Vec::new(),
            };
            tracer.trace(&unit, &mut worker, &mut sink);
            if progress.is_cancelled() {
                break;
            }
            sink.sums.add_rays(worker.counters.total() - before);
            wave.store(i, &sink.sums);
            non_finite += sink.non_finite;
            own.examples.extend(sink.examples.into_iter().map(|e| (i, e)));
            own.taken.push((i, std::mem::take(&mut worker.counters.taken)));
        }
        let mut found = found.lock().expect("no worker panics with the lock held");
        let (totals, all) = &mut *found;
        totals.counters.add(&worker.counters);
        totals.non_finite += non_finite;
        all.examples.extend(own.examples);
        all.taken.extend(own.taken);
    });
    let (mut totals, Found { mut taken, mut examples }) =
        found.into_inner().expect("no worker panics with the lock held");
    examples.sort_unstable();
    taken.sort_unstable_by_key(|(i, _)| *i);
    totals.counters.taken = taken.into_iter().map(|(_, taken)| taken).sum();
    totals.examples = examples.into_iter().take(EXAMPLES).map(|(_, e)| e).collect();
    totals
}
