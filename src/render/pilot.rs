//! How long a picture will take: a few thousand of its paths, spread over it, are traced and timed.

use super::tracer::{tracer, window};
use super::{CropWindow, LensReport, Prepared, RenderSettings};
use crate::camera::Camera;
use crate::film::{BLOCKS, TILE};
use crate::integrator::{Counters, SampleSink, Unit, Worker};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// What the trial paths cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pilot {
    /// Paths that were traced and timed.
    pub paths: u64,
    /// Rays of these, of every kind.
    pub rays: u64,
    /// Wall seconds that all paths of the picture will take on as many threads, by what those cost.
    pub render_seconds: f64,
}

/// Wall time spent on trial paths.
const TRIAL: Duration = Duration::from_millis(100);
/// Patches at most: a small picture is covered by few.
const MOST_PATCHES: u32 = 1 << 12;
/// Side of a patch, pixels: small, so that there are many, but with its samples as many paths as a worker's pool holds,
/// because the way in and out of a pool costs the same for a large unit.
const PATCH: u32 = 16;
/// Samples a pixel of a patch at most.
const SAMPLES: u32 = 16;
/// From so many samples a pixel on a patch is small.
const FEW_SAMPLES: u32 = 8;

/// The trial adds nothing up.
struct Nowhere;

impl SampleSink for Nowhere {
    #[inline]
    fn add(&mut self, _pixel: u32, _sample: u32, _radiance: [f32; 3]) {}

    fn drop_non_finite(&mut self, _pixel: u32, _sample: u32) {}

    fn goes_on(&mut self, _counters: &Counters) -> bool {
        true
    }
}

/// Traces paths of the picture of `camera` through `lens` for about a tenth of a second on the threads of the current rayon pool.
/// Nothing is kept of them.
pub fn pilot(prepared: &Prepared, camera: &Camera, lens: Option<&LensReport>, settings: &RenderSettings) -> Pilot {
    let lens = lens.map(|lens| &lens.thin);
    let (tracer, window) = (tracer(prepared, camera, &[], lens, settings), window(settings));
    let samples = settings.spp.div_ceil(BLOCKS).min(SAMPLES);
    let side = if samples < FEW_SAMPLES { TILE } else { PATCH };
    let next = AtomicU32::new(0);
    let sums = Mutex::new((0_u64, 0_u64, 0.0_f64));
    let deadline = Instant::now() + TRIAL;
    rayon::broadcast(|_| {
        let mut worker = Worker::default();
        let (mut paths, mut rays, mut seconds) = (0, 0, 0.0);
        let mut is_warm = false;
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= MOST_PATCHES || (is_warm && paths > 0 && Instant::now() >= deadline) {
                break;
            }
            let unit = patch(i, window, side, samples);
            let before = worker.counters.total();
            let start = Instant::now();
            tracer.trace(&unit, &mut worker, &mut Nowhere);
            // What a thread traces first is slow: nothing is in its caches yet.
            if is_warm {
                seconds += start.elapsed().as_secs_f64();
                rays += worker.counters.total() - before;
                paths += u64::from(unit.width) * u64::from(unit.height) * u64::from(samples);
            }
            is_warm = true;
        }
        let mut sums = sums.lock().expect("no worker panics with the lock held");
        *sums = (sums.0 + paths, sums.1 + rays, sums.2 + seconds);
    });
    let (paths, rays, seconds) = sums.into_inner().expect("no worker panics with the lock held");
    let all = f64::from(window.width) * f64::from(window.height) * f64::from(settings.spp);
    let threads = rayon::current_num_threads() as f64;
    Pilot { paths, rays, render_seconds: all * seconds / (paths.max(1) as f64 * threads) }
}

/// Patch `i` of the picture: any number of them from 0 on are spread evenly.
fn patch(i: u32, window: CropWindow, side: u32, samples: u32) -> Unit {
    // After Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences": the sequence R2, whose steps are the
    // inverse of the plastic number and its square.
    const STEP: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let (width, height) = (side.min(window.width), side.min(window.height));
    let place = |step: f64, room: u32| ((0.5 + step * f64::from(i)).fract() * f64::from(room + 1)) as u32;
    let (x, y) = (place(STEP[0], window.width - width), place(STEP[1], window.height - height));
    Unit { x: window.x + x, y: window.y + y, width, height, samples: 0..samples, only: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_lie_in_the_window_and_reach_all_of_it() {
        for window in [
            CropWindow { x: 5, y: 7, width: 300, height: 200 },
            CropWindow { x: 0, y: 0, width: 3, height: 1 },
            CropWindow { x: 65_500, y: 0, width: 36, height: 65_536 },
        ] {
            let mut quarters = [0; 4];
            for i in 0..64 {
                let unit = patch(i, window, PATCH, 4);
                assert!(unit.x >= window.x && unit.x + unit.width <= window.x + window.width, "{unit:?}");
                assert!(unit.y >= window.y && unit.y + unit.height <= window.y + window.height, "{unit:?}");
                let right = unit.x - window.x > (window.width - unit.width) / 2;
                let low = unit.y - window.y > (window.height - unit.height) / 2;
                quarters[usize::from(right) + 2 * usize::from(low)] += 1;
            }
            if window.width > 2 * PATCH && window.height > 2 * PATCH {
                assert!(quarters.iter().all(|&n| (12..=20).contains(&n)), "{quarters:?}");
            }
        }
    }
}
