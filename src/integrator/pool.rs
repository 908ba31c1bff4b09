//! The state of a worker's paths, structure of arrays, small enough for the L2 cache.

use super::SceneTables;
use super::branches::Branches;
use super::bulbs::BulbRays;
use super::medium::DEPTH;
use super::receiver::{self, Remembered};
use super::through::Glass;
use crate::accel::{HitBatch, RayBatch};
use crate::material::media::AIR;
use crate::math::V3;
use simd::{Buffer, Float, Lanes, Mask, Uint};

/// Paths in flight per worker. 1024 to 4096 measured equal; more no longer fits in L2.
pub const POOL: usize = 2048;

/// One vector more than paths, so that a whole vector may be stored behind the last compacted path.
pub(super) const ROOM: usize = POOL + 16;

/// Paths in flight. Index i of every array below is path i; live paths are kept at the front. A path's radiance lives
/// in a slot that stays put while the path moves.
pub struct PathPool {
    /// Paths alive.
    pub n: usize,
    /// Their next rays. Keys ([`crate::sampler::coverage_key`]) are set only in scenes with partly present surfaces.
    pub rays: RayBatch,
    /// What those hit.
    pub hits: HitBatch,
    /// Throughput.
    pub beta: [Buffer<f32>; 3],
    /// Density with which the ray's direction was sampled, 1/sr; infinite for camera rays and after a mirror, negative where
    /// it is weighed by the balance heuristic (`weight.rs`).
    pub prev_pdf: Buffer<f32>,
    /// Scatterings so far.
    pub depth: Buffer<u32>,
    /// Key of the pixel's random numbers.
    pub seed: Buffer<u32>,
    /// Sample index.
    pub sample: Buffer<u32>,
    /// Media they are in, innermost first. Here and below: empty where the scene has no use for it.
    pub media: [Buffer<u32>; DEPTH],
    /// nm; 0 where dispersion has not split the path.
    pub wavelength: Buffer<f32>,
    /// Metres gone straight through thin glass since the last scattering, up to where the ray starts.
    pub travelled: Buffer<f32>,
    /// Surfaces of thin glass gone straight through, ever.
    pub passes: Buffer<u32>,
    /// Width of the cone around the path where the ray starts, metres (`cone.rs`).
    pub cone_width: Buffer<f32>,
    /// By how much the cone widens, radians.
    pub cone_spread: Buffer<f32>,
    /// What shadow rays through thin glass need; `None` where there is none.
    pub glass: Option<Box<Glass>>,
    /// Shadow rays towards bulbs; `None` where there are none.
    pub bulbs: Option<Box<BulbRays>>,
    /// From where its last light was chosen (`receiver.rs`).
    pub from: Remembered,
    /// Paths that wait, in pictures whose paths branch.
    pub branches: Option<Box<Branches>>,
    /// What choosing a light needs.
    pub light_scratch: Buffer<f32>,
    /// Where the path's radiance is.
    pub slot: Buffer<u32>,

    /// Radiance gathered so far, by slot.
    pub radiance: Vec<[f32; 3]>,
    /// What `--clamp` took of it, all channels together, by slot.
    pub taken: Vec<f64>,
    /// Pixel in the tile and sample index, by slot.
    pub origin: Vec<(u32, u32)>,
    /// Slots of no path.
    pub free: Vec<u32>,
    /// Slots of paths that have ended, in order.
    pub dead: Buffer<u32>,
    /// How many.
    pub n_dead: usize,

    /// Rays towards lights, at most one a path; keys as those of `rays`.
    pub shadow: RayBatch,
    /// How many.
    pub n_shadow: usize,
    /// Whom they light.
    pub shadow_slot: Buffer<u32>,
    /// What arrives if nothing is in between.
    pub shadow_radiance: [Buffer<f32>; 3],
    /// What `--clamp` took for each part of that; empty without it.
    pub shadow_excess: Buffer<f32>,
    /// 1 where something is in between.
    pub occluded: Vec<u8>,
}

impl PathPool {
    /// An empty pool.
    pub fn new() -> Self {
        let room = ROOM;
        let floats = || Buffer::new(room);
        let ints = || Buffer::new(room);
        Self {
            n: 0,
            rays: RayBatch::new(room),
            hits: HitBatch::new(room),
            beta: [floats(), floats(), floats()],
            prev_pdf: floats(),
            depth: ints(),
            seed: ints(),
            sample: ints(),
            media: std::array::from_fn(|_| Buffer::new(0)),
            wavelength: Buffer::new(0),
            travelled: Buffer::new(0),
            passes: Buffer::new(0),
            cone_width: Buffer::new(0),
            cone_spread: Buffer::new(0),
            glass: None,
            bulbs: None,
            from: std::array::from_fn(|_| Buffer::new(0)),
            branches: None,
            light_scratch: Buffer::new(0),
            slot: ints(),
            radiance: vec![[0.0; 3]; POOL],
            taken: Vec::new(),
            origin: vec![(0, 0); POOL],
            free: (0..POOL as u32).rev().collect(),
            dead: ints(),
            n_dead: 0,
            shadow: RayBatch::new(room),
            n_shadow: 0,
            shadow_slot: ints(),
            shadow_radiance: [floats(), floats(), floats()],
            shadow_excess: Buffer::new(0),
            occluded: vec![0; room],
        }
    }

    /// Makes room for what paths in the scene of `tables` remember beyond other paths, and for what a clamp does.
    pub fn fit(&mut self, tables: &SceneTables, is_clamped: bool) {
        if is_clamped && self.taken.is_empty() {
            (self.taken, self.shadow_excess) = (vec![0.0; POOL], Buffer::new(ROOM));
        }
        let media = &tables.media;
        if media.has_volume() && self.media[0].is_empty() {
            self.media = std::array::from_fn(|_| Buffer::new(ROOM));
        }
        if media.has_dispersion() && self.wavelength.is_empty() {
            self.wavelength = Buffer::new(ROOM);
        }
        if media.has_thin_glass() && self.glass.is_none() {
            (self.travelled, self.passes) = (Buffer::new(ROOM), Buffer::new(ROOM));
            self.glass = Some(Box::default());
        }
        if tables.lights.has_bulbs() && self.bulbs.is_none() {
            self.bulbs = Some(Box::default());
        }
        if tables.textures.has_levels() && self.cone_width.is_empty() {
            (self.cone_width, self.cone_spread) = (Buffer::new(ROOM), Buffer::new(ROOM));
        }
        if tables.lights.has_choice() && self.from[0].is_empty() {
            self.from = std::array::from_fn(|_| Buffer::new(ROOM));
        }
        if self.light_scratch.len() < tables.lights.scratch() {
            self.light_scratch = Buffer::new(tables.lights.scratch());
        }
    }

    /// Path `i` starts: outside of everything.
    #[inline]
    pub fn begin(&mut self, i: usize) {
        if !self.media[0].is_empty() {
            for medium in &mut self.media {
                medium[i] = AIR;
            }
        }
        if !self.wavelength.is_empty() {
            self.wavelength[i] = 0.0;
        }
        if !self.passes.is_empty() {
            (self.travelled[i], self.passes[i]) = (0.0, 0);
        }
        receiver::begin(&mut self.from, i);
    }

    /// Appends shadow rays of the lanes `keep`, packed: where they start, their direction and end (in units of it), whom
    /// they light and with what.
    #[inline(always)]
    pub fn push_shadow<L: Lanes>(
        &mut self,
        keep: L::M,
        (origin, direction, t_max): (V3<L>, V3<L>, L::F),
        slot: L::U,
        radiance: V3<L>,
    ) {
        let to = self.n_shadow;
        if let Some(glass) = &mut self.glass {
            glass.push(keep, origin + direction, to);
        }
        origin.x.compress(keep, &mut self.shadow.ox, to);
        origin.y.compress(keep, &mut self.shadow.oy, to);
        origin.z.compress(keep, &mut self.shadow.oz, to);
        direction.x.compress(keep, &mut self.shadow.dx, to);
        direction.y.compress(keep, &mut self.shadow.dy, to);
        direction.z.compress(keep, &mut self.shadow.dz, to);
        t_max.compress(keep, &mut self.shadow.t_max, to);
        slot.compress(keep, &mut self.shadow_slot, to);
        radiance.x.compress(keep, &mut self.shadow_radiance[0], to);
        radiance.y.compress(keep, &mut self.shadow_radiance[1], to);
        radiance.z.compress(keep, &mut self.shadow_radiance[2], to);
        self.n_shadow += keep.count();
    }

    /// Notes that `--clamp` took `excess` for each part of `left`, which was added to a slot.
    #[inline(always)]
    pub fn take(&mut self, slot: u32, left: [f32; 3], excess: f32) {
        self.taken[slot as usize] += left.iter().map(|&channel| f64::from(channel)).sum::<f64>() * f64::from(excess);
    }

    /// Adds to the radiance of a slot.
    #[inline(always)]
    pub fn add(&mut self, slot: u32, radiance: [f32; 3]) {
        if self.add_of_branch(slot, radiance) {
            return;
        }
        let sum = &mut self.radiance[slot as usize];
        for (s, r) in sum.iter_mut().zip(radiance) {
            *s += r;
        }
    }
}
