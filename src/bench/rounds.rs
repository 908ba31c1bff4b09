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
