//! The loop: refill with camera rays, intersect, shade, test shadow rays, add.

use super::first_hit::FirstHit;
use super::pool::{POOL, PathPool};
use super::shade::Shade;
use super::whitted::Whitted;
use super::{Integrator, PathTracer};
use crate::math::V3;
use crate::sampler::{Key, coverage_key, dims, pixel_seed};
use simd::{Float, Kernel, Lanes, Uint, dispatch_large};
use std::ops::Range;
use std::sync::Arc;

/// Receives finished samples, in a fixed order for a fixed unit.
pub trait SampleSink {
    /// The finite sample `sample` of pixel `pixel` (row by row in the unit's rectangle).
    fn add(&mut self, pixel: u32, sample: u32, radiance: [f32; 3]);
    /// A sample that was dropped because a channel was not finite.
    fn drop_non_finite(&mut self, pixel: u32, sample: u32);
    /// Asked once a wave, after its samples were received: false ends the unit where it is, incomplete.
    fn goes_on(&mut self, counters: &Counters) -> bool;
}

/// A rectangle of pixels and a range of samples: what one worker traces on its own.
#[derive(Clone, Debug)]
pub struct Unit {
    /// Left edge in the whole picture.
    pub x: u32,
    /// Top edge in the whole picture.
    pub y: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Sample indices.
    pub samples: Range<u32>,
    /// The pixels that are traced, row by row; `None`: all.
    pub only: Option<Arc<[bool]>>,
}

/// Rays and events of one worker.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counters {
    /// Camera rays.
    pub camera: u64,
    /// Rays after a scattering.
    pub bounce: u64,
    /// Rays towards lights.
    pub shadow: u64,
    /// Paths ended by the safety cap.
    pub truncated: u64,
    /// Crossings of volumes' boundaries that do not pair up: leaving what was not entered, being inside of something far
    /// from everything, being inside of more than a path remembers.
    pub unpaired: u64,
    /// What `--clamp` took, all channels and paths together: cd/m^2.
    pub taken: f64,
}

impl Counters {
    /// All rays.
    pub fn total(&self) -> u64 {
        self.camera + self.bounce + self.shadow
    }

    /// Adds those of another worker.
    pub fn add(&mut self, other: &Self) {
        let Self { camera, bounce, shadow, truncated, unpaired, taken } = other;
        self.camera += camera;
        self.bounce += bounce;
        self.shadow += shadow;
        self.truncated += truncated;
        self.unpaired += unpaired;
        self.taken += taken;
    }
}

/// One thread's state.
pub struct Worker {
    pool: PathPool,
    /// What it has traced so far.
    pub counters: Counters,
}

impl Default for Worker {
    fn default() -> Self {
        Self { pool: PathPool::new(), counters: Counters::default() }
    }
}

impl PathTracer<'_> {
    /// Traces all samples of `unit` into `sink`, unless that ends it. The result depends on the unit alone: not on the worker, nor on what
    /// it did before.
    pub fn trace(&self, unit: &Unit, worker: &mut Worker, sink: &mut impl SampleSink) {
        let Worker { pool, counters } = worker;
        pool.fit(self.tables, self.clamp.is_some());
        pool.fit_branches(self.integrator == Integrator::Whitted);
        let mut feed = Feed::new(unit);
        loop {
            pool.resume();
            let old = pool.n;
            feed.refill(self, unit, pool);
            let n = pool.n;
            if n == 0 {
                return;
            }
            self.accel.intersect(&pool.rays, 0..old, false, &mut pool.hits);
            self.accel.intersect(&pool.rays, old..n, true, &mut pool.hits);
            counters.camera += (n - old) as u64;
            counters.bounce += old as u64;

            match self.integrator {
                Integrator::Path | Integrator::Direct => {
                    dispatch_large(self.level, Shade { tracer: self, pool, counters });
                }
                Integrator::Whitted => dispatch_large(self.level, Whitted { tracer: self, pool, counters }),
                Integrator::Ao | Integrator::Normal | Integrator::Albedo => {
                    dispatch_large(self.level, FirstHit { tracer: self, pool });
                }
            }

            self.shadow(pool, counters);
            self.light_of_bulbs(pool, counters);
            for i in 0..pool.n_dead {
                let slot = pool.dead[i];
                let radiance = pool.gathered(slot);
                let (pixel, sample) = pool.origin[slot as usize];
                let taken = pool.taken.get_mut(slot as usize).map_or(0.0, std::mem::take);
                if radiance.iter().all(|r| r.is_finite()) {
                    counters.taken += taken;
                    sink.add(pixel, sample, radiance);
                } else {
                    sink.drop_non_finite(pixel, sample);
                }
                pool.free.push(slot);
            }
            pool.n_dead = 0;
            if !sink.goes_on(counters) {
                *pool = PathPool::new();
                return;
            }
        }
    }
}

impl PathTracer<'_> {
    /// Adds what arrives along the queued shadow rays.
    pub(super) fn shadow(&self, pool: &mut PathPool, counters: &mut Counters) {
        // Occlusion knows no colours.
        if pool.glass.is_some() && self.integrator != Integrator::Ao {
            return self.shadow_through_glass(pool, counters);
        }
        let n_shadow = pool.n_shadow;
        counters.shadow += n_shadow as u64;
        self.accel.occluded(&pool.shadow, n_shadow, &mut pool.occluded);
        for i in 0..n_shadow {
            if pool.occluded[i] == 0 {
                let [r, g, b] = &pool.shadow_radiance;
                let (slot, radiance) = (pool.shadow_slot[i], [r[i], g[i], b[i]]);
                pool.add(slot, radiance);
                if self.clamp.is_some() {
                    pool.take(slot, radiance, pool.shadow_excess[i]);
                }
            }
        }
    }
}

/// Which camera rays are still to come: pixel by pixel, sample by sample, so that neighbours in the batch are coherent.
struct Feed {
    pixel: u32,
    pixels: u32,
    sample: u32,
}

impl Feed {
    fn new(unit: &Unit) -> Self {
        Self { pixel: 0, pixels: unit.width * unit.height, sample: unit.samples.start }
    }

    /// Fills the pool up with camera rays.
    fn refill(&mut self, tracer: &PathTracer<'_>, unit: &Unit, pool: &mut PathPool) {
        let start = pool.n;
        let mut n = start;
        // The film position's pixel goes into the ray's origin until the kernel below replaces it.
        while n < POOL && self.pixel < self.pixels {
            if unit.only.as_ref().is_some_and(|only| !only[self.pixel as usize]) {
                self.pixel += 1;
                continue;
            }
            let (x, y) = (unit.x + self.pixel % unit.width, unit.y + self.pixel / unit.width);
            let seed = pixel_seed(tracer.seed, tracer.frame, x, y);
            while n < POOL && self.sample < unit.samples.end {
                let slot = pool.free.pop().expect("as many slots as paths");
                pool.origin[slot as usize] = (self.pixel, self.sample);
                pool.slot[n] = slot;
                pool.seed[n] = seed;
                pool.sample[n] = self.sample;
                pool.depth[n] = 0;
                pool.prev_pdf[n] = f32::INFINITY;
                pool.rays.ox[n] = x as f32 + 0.5;
                pool.rays.oy[n] = y as f32 + 0.5;
                pool.rays.t_max[n] = f32::INFINITY;
                pool.rays.time[n] = 0.0;
                for beta in &mut pool.beta {
                    beta[n] = 1.0;
                }
                pool.begin(n);
                pool.begin_branches(slot);
                n += 1;
                self.sample += 1;
            }
            if self.sample == unit.samples.end {
                self.sample = unit.samples.start;
                self.pixel += 1;
            }
        }
        pool.n = n;
        dispatch_large(tracer.level, Generate { tracer, pool, range: start..n });
    }
}

/// Turns pixel centres into camera rays.
struct Generate<'a, 'b> {
    tracer: &'a PathTracer<'b>,
    pool: &'a mut PathPool,
    range: Range<usize>,
}

impl Kernel for Generate<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tracer, pool, range } = self;
        // The vector past the end spills over into the padding.
        for at in range.step_by(L::N) {
            let key = Key::<L> { pixel: L::U::load(&pool.seed, at), sample: L::U::load(&pool.sample, at) };
            if tracer.tables.materials.has_alpha() {
                coverage_key::<L>(key.pixel, key.sample, L::U::splat(0)).store(&mut pool.rays.key, at);
            }
            let u = key.group(L::U::splat(dims::CAMERA));
            let x = L::F::load(&pool.rays.ox, at) + tracer.filter.offset::<L>(u[0]);
            let y = L::F::load(&pool.rays.oy, at) + tracer.filter.offset::<L>(u[1]);
            let mut time = L::F::zero();
            if tracer.moves() {
                time = key.group(L::U::splat(dims::TIME))[0];
                time.store(&mut pool.rays.time, at);
            }
            let (origin, direction): (V3<L>, V3<L>) = tracer.camera.ray::<L>(x, y, [u[2], u[3]], time);
            if tracer.tables.textures.has_levels() {
                let (width, spread) = tracer.camera.cone::<L>(direction);
                width.store(&mut pool.cone_width, at);
                spread.store(&mut pool.cone_spread, at);
            }
            origin.x.store(&mut pool.rays.ox, at);
            origin.y.store(&mut pool.rays.oy, at);
            origin.z.store(&mut pool.rays.oz, at);
            direction.x.store(&mut pool.rays.dx, at);
            direction.y.store(&mut pool.rays.dy, at);
            direction.z.store(&mut pool.rays.dz, at);
        }
    }
}
