//! Shadow rays in scenes with thin glass: what is smooth and has no inside colours light and lets it go straight on.
//!
//! A ray is asked for its nearest hit, takes the tint of the glass there and goes on behind it, until it gets through or
//! meets something else. Paths do the same on average (`BsdfSample::straight`), so both strategies of finding a light see
//! the same one, and their densities are those of the last real scattering.

use super::PathTracer;
use super::closure::closure;
use super::interaction::interact;
use super::pool::{PathPool, ROOM};
use super::shade::{add_lanes, load3};
use super::wave::Counters;
use crate::accel::{HitBatch, MISS};
use crate::material::media::MediumTable;
use crate::math::V3;
use simd::{Buffer, Float, Kernel, Lanes, Mask, Uint, dispatch_large};

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
            dispatch_large(self.level, Pass { tracer: self, pool });
        }
    }
}

/// One round: rays that got through are added, those at glass are packed to the front, the others are blocked.
struct Pass<'a, 'b> {
    tracer: &'a PathTracer<'b>,
    pool: &'a mut PathPool,
}

impl Kernel for Pass<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tracer, pool } = self;
        let n = pool.n_shadow;
        pool.n_shadow = 0;
        for at in (0..n).step_by(L::N) {
            pass::<L>(tracer, pool, at, L::M::first(n - at));
        }
    }
}

/// The rays `at ..` in the lanes of `active`.
#[inline(always)]
fn pass<L: Lanes>(tracer: &PathTracer<'_>, pool: &mut PathPool, at: usize, active: L::M) {
    let tables = tracer.tables;
    let Some(glass) = &pool.glass else { return };
    let slot = L::U::load(&pool.shadow_slot, at);
    let [r, g, b] = &pool.shadow_radiance;
    let radiance = load3::<L>(r, g, b, at);
    let primitive = L::U::load(&glass.hits.primitive, at);
    let missed = active & primitive.eq(L::U::splat(MISS));
    let direction = load3::<L>(&pool.shadow.dx, &pool.shadow.dy, &pool.shadow.dz, at);
    let t_max = L::F::load(&pool.shadow.t_max, at);
    let key = L::U::load(&pool.shadow.key, at);
    let hit = active & !missed;
    let mut next = None;
    if hit.any() {
        let si = interact::<L>(tables, &glass.hits, at, -direction.normalized(), primitive, hit);
        let thin = tables.media.is_thin_glass::<L>(MediumTable::inside::<L>(si.triangle.material), hit);
        if thin.any() {
            let tint: V3<L> = closure(tables, &glass.hits, at, &si, L::F::one(), thin).bsdf.straight();
            let radiance = radiance * tint;
            let passes = thin & radiance.max_component().gt(L::F::zero());
            let origin = si.behind();
            let end = load3::<L>(&glass.end[0], &glass.end[1], &glass.end[2], at);
            let to_far = !t_max.is_finite();
            next = Some((passes, origin, direction.or_else(to_far, end - origin), radiance, end));
        }
    }
    add_lanes::<L>(pool, slot, radiance, missed);
    let Some((passes, origin, direction, radiance, end)) = next else { return };
    let to = pool.n_shadow;
    if tables.materials.has_alpha() {
        key.compress(passes, &mut pool.shadow.key, to);
    }
    pool.push_shadow::<L>(passes, (origin, direction, t_max), slot, radiance);
    if let Some(glass) = &mut pool.glass {
        // As it was, not as the sum of origin and direction rounds it.
        glass.push(passes, end, to);
    }
}
