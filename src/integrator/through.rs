//! Shadow rays in scenes with thin glass: what is smooth and has no inside colours light and lets it go straight on.
//!
//! A ray is asked for its nearest hit, takes the tint of the glass there and goes on behind it, until it gets through or
//! meets something else. Paths do the same on average (`BsdfSample::straight`), so both strategies of finding a light see
//! the same one, and their densities are those of the last real scattering.

use super::PathTracer;
use super::closure::pane;
use super::pool::{PathPool, ROOM};
use super::shade::{add_lanes, load3};
use super::wave::Counters;
use crate::accel::{HitBatch, MISS};
use crate::math::V3;
use simd::{Buffer, Float, Lanes, Mask, Scalar, Uint};

/// What shadow rays through thin glass need beyond the others.
pub struct Glass {
    /// What they hit.
    hits: HitBatch,
    /// Where they end, unless that is infinitely far: kept as it is, however many panes are in between.
    end: [Buffer<f32>; 3],
}

impl Default for Glass {
    fn default() -> Self {
        Self { hits: HitBatch::new(ROOM), end: std::array::from_fn(|_| Buffer::new(ROOM)) }
    }
}

impl Glass {
    /// Stores the ends of the rays of `keep`, packed, at `to ..`.
    #[inline(always)]
    pub fn push<L: Lanes>(&mut self, keep: L::M, end: V3<L>, to: usize) {
        end.x.compress(keep, &mut self.end[0], to);
        end.y.compress(keep, &mut self.end[1], to);
        end.z.compress(keep, &mut self.end[2], to);
    }
}

impl PathTracer<'_> {
    /// Adds what arrives along the queued shadow rays, glass in between or not. Every round takes the rays that are left
    /// one surface further.
    pub(super) fn shadow_through_glass(&self, pool: &mut PathPool, counters: &mut Counters) {
        while pool.n_shadow > 0 {
            let Some(glass) = &mut pool.glass else { return };
            counters.shadow += pool.n_shadow as u64;
            self.accel.intersect(&pool.shadow, 0..pool.n_shadow, false, &mut glass.hits);
            pass(self, pool);
        }
    }
}

/// One round: rays that got through are added, those at glass are packed to the front, the others are blocked. One ray at a
/// time: few surfaces are smooth thin glass.
fn pass(tracer: &PathTracer<'_>, pool: &mut PathPool) {
    let n = std::mem::take(&mut pool.n_shadow);
    for at in 0..n {
        pass_one(tracer, pool, at);
    }
}

/// Ray `at`.
fn pass_one(tracer: &PathTracer<'_>, pool: &mut PathPool, at: usize) {
    let tables = tracer.tables;
    let active = <Scalar as Lanes>::M::first(1);
    let Some(glass) = &pool.glass else { return };
    let slot = <Scalar as Lanes>::U::load(&pool.shadow_slot, at);
    let [r, g, b] = &pool.shadow_radiance;
    let radiance = load3::<Scalar>(r, g, b, at);
    if glass.hits.primitive[at] == MISS {
        add_lanes::<Scalar>(pool, slot, radiance, active);
        if tracer.clamp.is_some() {
            let left = [radiance.x.first(), radiance.y.first(), radiance.z.first()];
            pool.take(pool.shadow_slot[at], left, pool.shadow_excess[at]);
        }
        return;
    }
    let direction = load3::<Scalar>(&pool.shadow.dx, &pool.shadow.dy, &pool.shadow.dz, at);
    let t_max = <Scalar as Lanes>::F::load(&pool.shadow.t_max, at);
    let key = <Scalar as Lanes>::U::load(&pool.shadow.key, at);
    let Some((tint, origin)) = pane(tables, &glass.hits, at, (-direction.normalized(), pool.shadow.time[at])) else {
        return;
    };
    let radiance = radiance * tint;
    let end = load3::<Scalar>(&glass.end[0], &glass.end[1], &glass.end[2], at);
    let direction = direction.or_else(!t_max.is_finite(), end - origin);
    let passes = active & radiance.max_component().gt(<Scalar as Lanes>::F::zero());
    let to = pool.n_shadow;
    if tracer.clamp.is_some() && passes.any() {
        pool.shadow_excess[to] = pool.shadow_excess[at];
    }
    if tables.materials.has_alpha() {
        key.compress(passes, &mut pool.shadow.key, to);
    }
    if tables.moves() && passes.any() {
        pool.shadow.time[to] = pool.shadow.time[at];
    }
    pool.push_shadow::<Scalar>(passes, (origin, direction, t_max), slot, radiance);
    if let Some(glass) = &mut pool.glass {
        // As it was, not as the sum of origin and direction rounds it.
        glass.push::<Scalar>(passes, end, to);
    }
}
