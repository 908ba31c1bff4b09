//! Timing: in every round each backend traces the same rays, one backend after the other.

use super::clock::Clock;
use super::contenders::Contender;
use super::rays::{Kind, RaySet};
use crate::accel::{Accel, HitBatch, RayBatch};
use crate::integrator::POOL;
use rayon::ThreadPool;

/// Seconds of one backend in each round.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// CPU time, mean over the threads.
    pub cpu: Vec<f64>,
    /// Wall time from the first thread's start to the last one's end.
    pub wall: Vec<f64>,
}

/// One thread's room for results.
struct Results {
    hits: HitBatch,
    occluded: Vec<u8>,
}

impl Results {
    fn new(n: usize) -> Self {
        Self { hits: HitBatch::new(n), occluded: vec![0; n] }
    }
}

/// Traces `n` rays as the renderer does.
fn trace(accel: &dyn Accel, kind: Kind, rays: &RayBatch, n: usize, results: &mut Results) {
    match kind {
        Kind::Shadow => accel.occluded(rays, n, &mut results.occluded),
        _ => accel.intersect(rays, 0..n, kind == Kind::Primary, &mut results.hits),
    }
}

/// Times of each of the `contenders` over `rounds`. Who begins changes from round to round, and a round that is not
/// counted comes first.
pub fn time(set: &RaySet, contenders: &[&Contender], pool: &ThreadPool, rounds: usize) -> Vec<Times> {
    let mut times = vec![Times::default(); contenders.len()];
    for round in 0..=rounds {
        for turn in 0..contenders.len() {
            let i = (turn + round) % contenders.len();
            let (cpu, wall) = once(set, &*contenders[i].accel, pool);
            if round > 0 {
                times[i].cpu.push(cpu);
                times[i].wall.push(wall);
            }
        }
    }
    times
}

/// Traces all rays once with all threads of `pool`, which take batches in turn: mean CPU seconds, wall seconds.
fn once(set: &RaySet, accel: &dyn Accel, pool: &ThreadPool) -> (f64, f64) {
    let threads = pool.current_num_threads();
    let wall = std::time::Instant::now();
    let seconds = pool.broadcast(|thread| {
        let mut results = Results::new(POOL);
        let clock = Clock::start();
        for rays in set.batches.iter().skip(thread.index()).step_by(threads) {
            trace(accel, set.kind, rays, POOL, &mut results);
        }
        clock.elapsed().0
    });
    (seconds.iter().sum::<f64>() / threads as f64, wall.elapsed().as_secs_f64())
}

/// Seconds of brute force for `rays`, one thread.
pub fn time_linear(kind: Kind, rays: &RayBatch, n: usize, accel: &dyn Accel, rounds: usize) -> Vec<f64> {
    let mut results = Results::new(n);
    let once = |_| {
        let clock = Clock::start();
        trace(accel, kind, rays, n, &mut results);
        clock.elapsed().0
    };
    (0..rounds).map(once).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::AccelStats;
    use crate::bench::contenders::Setup;
    use std::ops::Range;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Counts the rays it is given.
    struct Counts(Arc<AtomicUsize>);

    impl Accel for Counts {
        fn intersect(&self, _: &RayBatch, range: Range<usize>, _: bool, _: &mut HitBatch) {
            self.0.fetch_add(range.len(), Ordering::Relaxed);
        }

        fn occluded(&self, _: &RayBatch, n: usize, _: &mut [u8]) {
            self.0.fetch_add(1_000_000 + n, Ordering::Relaxed);
        }

        fn stats(&self) -> AccelStats {
            AccelStats::default()
        }
    }

    #[test]
    fn every_backend_traces_every_ray_once_a_round_with_any_number_of_threads() {
        for (kind, threads, each) in [(Kind::Diffuse, 3, POOL), (Kind::Shadow, 1, POOL + 1_000_000)] {
            let counts: Vec<_> = (0..2).map(|_| Arc::new(AtomicUsize::new(0))).collect();
            let contender = |count: &Arc<AtomicUsize>| Contender {
                backend: "bvh",
                entry: None,
                setup: Setup::Bare,
                accel: Box::new(Counts(Arc::clone(count))),
            };
            let contenders: Vec<_> = counts.iter().map(contender).collect();
            let set = RaySet { kind, batches: vec![RayBatch::new(POOL); 7] };
            let pool = crate::render::pool(Some(threads)).unwrap();
            let times = time(&set, &contenders.iter().collect::<Vec<_>>(), &pool, 2);
            assert!(times.iter().all(|times| times.cpu.len() == 2 && times.wall.len() == 2));
            for count in counts {
                // One round more, which is not counted.
                assert_eq!(count.load(Ordering::Relaxed), 3 * 7 * each);
            }
        }
    }
}
