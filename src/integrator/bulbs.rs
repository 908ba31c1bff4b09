//! Shadow rays towards bulbs (`light/bulb.rs`): what they meet first, and what that sends back if it is the bulb.

use super::PathTracer;
use super::clamp::{Limit, add_limited};
use super::emission::shining;
use super::interaction::interact;
use super::pool::{PathPool, ROOM};
use super::shade::load3;
use super::wave::Counters;
use crate::accel::{HitBatch, MISS, RayBatch};
use crate::math::V3;
use simd::{Buffer, Float, Kernel, Lanes, Mask, Uint, dispatch_large};

/// Rays towards bulbs, at most one a path.
pub struct BulbRays {
    /// Keys as those of other shadow rays.
    pub rays: RayBatch,
    /// How many.
    pub n: usize,
    hits: HitBatch,
    /// What arrives of a radiance of 1.
    weight: [Buffer<f32>; 3],
    /// Number of the light that is to be met.
    sought: Buffer<u32>,
    /// The medium that they go through.
    medium: Buffer<u32>,
    /// How many scatterings their light has behind it.
    scatterings: Buffer<u32>,
    /// Whom they light.
    slot: Buffer<u32>,
}

impl Default for BulbRays {
    fn default() -> Self {
        Self {
            rays: RayBatch::new(ROOM),
            n: 0,
            hits: HitBatch::new(ROOM),
            weight: std::array::from_fn(|_| Buffer::new(ROOM)),
            sought: Buffer::new(ROOM),
            medium: Buffer::new(ROOM),
            scatterings: Buffer::new(ROOM),
            slot: Buffer::new(ROOM),
        }
    }
}

/// A shadow ray towards a bulb.
pub struct BulbRay<L: Lanes> {
    pub origin: V3<L>,
    /// Unit.
    pub direction: V3<L>,
    /// To behind the bulb, metres.
    pub t_max: L::F,
    /// Of the shutter; 0 where nothing moves.
    pub time: L::F,
    /// What arrives of a radiance of 1.
    pub weight: V3<L>,
    /// Number of the light.
    pub sought: L::U,
    /// The medium that it goes through.
    pub medium: L::U,
    /// How many scatterings its light has behind it.
    pub scatterings: L::U,
    /// Whom it lights.
    pub slot: L::U,
}

impl BulbRays {
    /// Appends the rays of the lanes `keep`, packed.
    #[inline(always)]
    pub fn push<L: Lanes>(&mut self, keep: L::M, ray: &BulbRay<L>) {
        let to = self.n;
        let BulbRay { origin, direction, t_max, time, weight, sought, medium, scatterings, slot } = *ray;
        origin.x.compress(keep, &mut self.rays.ox, to);
        origin.y.compress(keep, &mut self.rays.oy, to);
        origin.z.compress(keep, &mut self.rays.oz, to);
        direction.x.compress(keep, &mut self.rays.dx, to);
        direction.y.compress(keep, &mut self.rays.dy, to);
        direction.z.compress(keep, &mut self.rays.dz, to);
        t_max.compress(keep, &mut self.rays.t_max, to);
        weight.x.compress(keep, &mut self.weight[0], to);
        weight.y.compress(keep, &mut self.weight[1], to);
        weight.z.compress(keep, &mut self.weight[2], to);
        sought.compress(keep, &mut self.sought, to);
        medium.compress(keep, &mut self.medium, to);
        scatterings.compress(keep, &mut self.scatterings, to);
        slot.compress(keep, &mut self.slot, to);
        time.compress(keep, &mut self.rays.time, to);
        self.n += keep.count();
    }
}

impl PathTracer<'_> {
    /// Adds what bulbs send along the queued rays.
    pub(super) fn light_of_bulbs(&self, pool: &mut PathPool, counters: &mut Counters) {
        // Moved out and back, so that the pool's sums can be added to.
        let Some(mut bulbs) = pool.bulbs.take() else { return };
        counters.shadow += bulbs.n as u64;
        self.accel.intersect(&bulbs.rays, 0..bulbs.n, false, &mut bulbs.hits);
        dispatch_large(self.level, Arrive { tracer: self, pool: &mut *pool, bulbs: &bulbs });
        bulbs.n = 0;
        pool.bulbs = Some(bulbs);
    }
}

/// Adds what has been met.
struct Arrive<'a, 't> {
    tracer: &'a PathTracer<'t>,
    pool: &'a mut PathPool,
    bulbs: &'a BulbRays,
}

impl Kernel for Arrive<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tracer, pool, bulbs } = self;
        for at in (0..bulbs.n).step_by(L::N) {
            arrive::<L>(tracer, pool, bulbs, at, L::M::first(bulbs.n - at));
        }
    }
}

/// The rays `at ..` in the lanes of `active`.
#[inline(always)]
fn arrive<L: Lanes>(tracer: &PathTracer<'_>, pool: &mut PathPool, bulbs: &BulbRays, at: usize, active: L::M) {
    let tables = tracer.tables;
    let primitive = L::U::load(&bulbs.hits.primitive, at);
    let hit = active & !primitive.eq(L::U::splat(MISS));
    if !hit.any() {
        return;
    }
    let direction = load3::<L>(&bulbs.rays.dx, &bulbs.rays.dy, &bulbs.rays.dz, at);
    let time = L::F::load(&bulbs.rays.time, at);
    let si = interact::<L>(tables, &bulbs.hits, at, (-direction, time), primitive, hit);
    let met = hit & si.triangle.light.eq(L::U::load(&bulbs.sought, at));
    let (radiance, lit) = shining(tables, &si, met);
    if !lit.any() {
        return;
    }
    let mut arriving = load3::<L>(&bulbs.weight[0], &bulbs.weight[1], &bulbs.weight[2], at) * radiance;
    if tables.media.has_volume() {
        let distance = L::F::load(&bulbs.hits.t, at);
        arriving = arriving * tables.media.transmittance(L::U::load(&bulbs.medium, at), distance);
    }
    let limit = Limit::<L>::new(tracer.clamp, L::U::load(&bulbs.scatterings, at));
    add_limited::<L>(limit, pool, L::U::load(&bulbs.slot, at), arriving, lit);
}
