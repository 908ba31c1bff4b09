//! Scattered rays that meet lights with a size (`light/sized.rs`): balls on the way to what they hit, suns behind all of it.
//!
//! Rays from the camera do not see them: a lamp of `--light-radius` in the picture is seldom what is meant. One that comes
//! from a mirror or through glass has been scattered.

use super::PathTracer;
use super::clamp::{Limit, add_limited};
use super::medium::Stack;
use super::pool::PathPool;
use super::receiver;
use super::shade::load3;
use super::weight::weight_of_remembered;
use crate::math::V3;
use simd::{Float, Lanes, Mask, Part, Uint};

/// Adds what balls send along the rays `at ..` of `active`, which end at what they hit in the lanes of `hit`.
#[inline(always)]
pub fn see_balls<L: Lanes>(
    tracer: &PathTracer<'_>,
    pool: &mut PathPool,
    at: usize,
    slot: L::U,
    active: L::M,
    hit: L::M,
) {
    let scattered = active & scattered::<L>(pool, at);
    if scattered.any() {
        L::outline(SeeBalls { tracer, pool, at, slot, scattered, hit });
    }
}

/// Adds what suns send along the rays `at ..` that are `missed`.
#[inline(always)]
pub fn see_suns<L: Lanes>(tracer: &PathTracer<'_>, pool: &mut PathPool, at: usize, slot: L::U, missed: L::M) {
    let scattered = missed & scattered::<L>(pool, at);
    if scattered.any() {
        L::outline(SeeSuns { tracer, pool, at, slot, scattered });
    }
}

/// Paths that have left what the camera sees.
#[inline(always)]
fn scattered<L: Lanes>(pool: &PathPool, at: usize) -> L::M {
    !L::U::load(&pool.depth, at).eq(L::U::splat(0))
}

/// [`see_balls`].
struct SeeBalls<'a, 't, L: Lanes> {
    tracer: &'a PathTracer<'t>,
    pool: &'a mut PathPool,
    at: usize,
    slot: L::U,
    scattered: L::M,
    hit: L::M,
}

impl<L: Lanes> Part<L> for SeeBalls<'_, '_, L> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { tracer, pool, at, slot, scattered, hit } = self;
        let tables = tracer.tables;
        let limit = Limit::<L>::new(tracer.clamp, L::U::load(&pool.depth, at));
        let direction = load3::<L>(&pool.rays.dx, &pool.rays.dy, &pool.rays.dz, at);
        let mut origin = load3::<L>(&pool.rays.ox, &pool.rays.oy, &pool.rays.oz, at);
        let mut end = L::F::load(&pool.hits.t, at).or_else(hit, L::F::splat(f32::INFINITY));
        let mut start = L::F::zero();
        if tables.media.has_thin_glass() {
            // From the last scattering on, as the light was sampled there; what is before the last pane was seen.
            start = L::F::load(&pool.travelled, at);
            origin = direction.mul_add(-start, origin);
            end = end + start;
        }
        let beta = load3::<L>(&pool.beta[0], &pool.beta[1], &pool.beta[2], at);
        let from = receiver::load::<L>(tables, &pool.from, at);
        let prev_pdf = L::F::load(&pool.prev_pdf, at);
        let time = L::F::load(&pool.rays.time, at);
        for number in tables.lights.balls() {
            let met = tables.lights.ball::<L>(number, (origin, direction), time, from.as_ref());
            let sees = scattered & met.meets & start.le(met.distance) & met.distance.lt(end);
            if !sees.any() {
                continue;
            }
            let mut radiance = beta * met.radiance.scale(weight_of_remembered::<L>(prev_pdf, met.pdf));
            if tables.media.has_volume() {
                let medium = Stack::<L>::load(&pool.media, at).innermost();
                radiance = radiance * tables.media.transmittance(medium, met.distance - start);
            }
            add_limited::<L>(limit, pool, slot, radiance, sees);
        }
    }
}

/// [`see_suns`].
struct SeeSuns<'a, 't, L: Lanes> {
    tracer: &'a PathTracer<'t>,
    pool: &'a mut PathPool,
    at: usize,
    slot: L::U,
    scattered: L::M,
}

impl<L: Lanes> Part<L> for SeeSuns<'_, '_, L> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { tracer, pool, at, slot, scattered } = self;
        let tables = tracer.tables;
        let limit = Limit::<L>::new(tracer.clamp, L::U::load(&pool.depth, at));
        let direction = load3::<L>(&pool.rays.dx, &pool.rays.dy, &pool.rays.dz, at);
        let from = receiver::load::<L>(tables, &pool.from, at);
        let prev_pdf = L::F::load(&pool.prev_pdf, at);
        let time = L::F::load(&pool.rays.time, at);
        for number in tables.lights.suns() {
            let met = tables.lights.sun::<L>(number, direction, time, from.as_ref());
            let sees = scattered & met.meets;
            if !sees.any() {
                continue;
            }
            let mut beta = load3::<L>(&pool.beta[0], &pool.beta[1], &pool.beta[2], at);
            if tables.media.has_volume() {
                let medium = Stack::<L>::load(&pool.media, at).innermost();
                beta = beta * tables.media.transmittance_from_far(medium);
            }
            let radiance: V3<L> = met.radiance.scale(weight_of_remembered::<L>(prev_pdf, met.pdf));
            add_limited::<L>(limit, pool, slot, beta * radiance, sees);
        }
    }
}
