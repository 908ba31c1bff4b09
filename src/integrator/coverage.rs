//! Surfaces that are not all there (alpha MASK and BLEND): rays pass them, from one to the next.
//!
//! Whether a ray passes is a function of (seed, frame, pixel, sample, bounce, instance, primitive), so every backend, order of
//! hits and number of threads decides the same. A ray that passes goes on from just behind the surface: with the same
//! throughput, the same bounce and the same sampler block.

use super::SceneTables;
use super::interaction::placed;
use super::pool::PathPool;
use super::shade::{add_lanes, load3};
use crate::accel::MISS;
use crate::math::{UvSets, V3, robust};
use crate::sampler::coverage_number;
use crate::shape::table::{NONE, Triangle};
use simd::{Float, Kernel, Lanes, Mask, Uint};

/// The lanes of `hit` whose ray passes `primitive`; `key` is of [`crate::sampler::coverage_key`], `instance` of the hits.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the surface is, then what decides")]
pub fn passes<L: Lanes>(
    tables: &SceneTables,
    material: L::U,
    uvs: &UvSets<L>,
    vertex_opacity: L::F,
    key: L::U,
    primitive: L::U,
    instance: L::U,
    hit: L::M,
) -> L::M {
    let coverage = tables.materials.coverage::<L>(&tables.textures, material, uvs, vertex_opacity, hit);
    hit & coverage.le(coverage_number::<L>(key, instance, primitive))
}

/// Just behind the triangle at `p`, for a ray that travels along `d` and is moved by `offset` metres.
#[inline(always)]
pub fn behind<L: Lanes>(triangle: &Triangle<L>, p: V3<L>, offset: L::F, d: V3<L>) -> V3<L> {
    let along = d.dot(triangle.ng).gt(L::F::zero());
    robust::offset_point(p, triangle.ng.or_else(along, -triangle.ng), offset)
}

/// One step of all shadow rays: what reaches its light is added, what is blocked is dropped, what passes a surface is
/// packed to the front with its new origin.
pub struct ShadowThrough<'a> {
    pub tables: &'a SceneTables,
    pub pool: &'a mut PathPool,
}

impl Kernel for ShadowThrough<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tables, pool } = self;
        let n = pool.n_shadow;
        pool.n_shadow = 0;
        for at in (0..n).step_by(L::N) {
            step::<L>(tables, pool, at, L::M::first(n - at));
        }
    }
}

/// Shadow rays `at ..` in the lanes of `active`.
#[inline(always)]
fn step<L: Lanes>(tables: &SceneTables, pool: &mut PathPool, at: usize, active: L::M) {
    let primitive = L::U::load(&pool.shadow_hits.primitive, at);
    let slot = L::U::load(&pool.shadow_slot, at);
    let radiance = load3::<L>(&pool.shadow_radiance[0], &pool.shadow_radiance[1], &pool.shadow_radiance[2], at);
    let free = active & primitive.eq(L::U::splat(MISS));
    if free.any() {
        add_lanes::<L>(pool, slot, radiance, free);
    }
    let hit = active & !free;
    if !hit.any() {
        return;
    }
    let triangle = tables.triangles.get::<L>(primitive);
    let (u, v) = (L::F::load(&pool.shadow_hits.u, at), L::F::load(&pool.shadow_hits.v, at));
    let mut uvs = UvSets::single(L::F::zero(), L::F::zero());
    let mut vertex_opacity = L::F::one();
    if tables.triangles.has_attributes() {
        let has = hit & !triangle.attributes.eq(L::U::splat(NONE));
        if has.any() {
            let a = tables.triangles.attributes::<L>(triangle.attributes, u, v);
            uvs = a.uvs.masked(has);
            vertex_opacity = a.opacity.or_else(has, vertex_opacity);
        }
    }
    let key = L::U::load(&pool.shadow_key, at);
    let instance = L::U::load(&pool.shadow_hits.instance, at);
    let passes = passes::<L>(tables, triangle.material, &uvs, vertex_opacity, key, primitive, instance, hit);
    if !passes.any() {
        return;
    }
    let origin = load3::<L>(&pool.shadow.ox, &pool.shadow.oy, &pool.shadow.oz, at);
    let d = load3::<L>(&pool.shadow.dx, &pool.shadow.dy, &pool.shadow.dz, at);
    let t_max = L::F::load(&pool.shadow.t_max, at);
    let placed = placed::<L>(tables, &pool.shadow_hits, at, hit);
    let (triangle, p, offset) = triangle.placed(&placed, triangle.point(u, v));
    let start = behind(&triangle, p, offset, d);
    // Towards the same end point, which lies at t = 1; a distant light has none.
    let d = (origin + d - start).or_else(t_max.is_finite(), d);
    key.compress(passes, &mut pool.shadow_key, pool.n_shadow);
    pool.push_shadow::<L>(passes, (start, d, t_max), slot, radiance);
}
