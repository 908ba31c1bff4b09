//! Integrators that look no further than the first surface: occlusion, normals, base colours. What a camera ray finds is
//! its sample; where it finds nothing that is 0.

use super::closure::surface;
use super::cone::Cone;
use super::interaction::{Interaction, interact};
use super::normals::shading_normal;
use super::pool::PathPool;
use super::shade::{add_lanes, is_culled, load3};
use super::{Integrator, PathTracer};
use crate::accel::MISS;
use crate::math::lanes::{cos_sin_2pi, safe_sqrt};
use crate::math::{Frame, V3};
use crate::sampler::{Key, coverage_key, dims};
use simd::{Float, Kernel, Lanes, Mask, Uint};

/// Shades all hits of a pool: what passes culled surfaces is packed to the front, the rest has ended.
pub struct FirstHit<'a, 'b> {
    pub tracer: &'a PathTracer<'b>,
    pub pool: &'a mut PathPool,
}

impl Kernel for FirstHit<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tracer, pool } = self;
        let n = pool.n;
        (pool.n, pool.n_shadow) = (0, 0);
        for at in (0..n).step_by(L::N) {
            shade::<L>(tracer, pool, at, L::M::first(n - at));
        }
    }
}

/// Shades paths `at ..` in the lanes of `active`.
#[inline(always)]
fn shade<L: Lanes>(tracer: &PathTracer<'_>, pool: &mut PathPool, at: usize, active: L::M) {
    let tables = tracer.tables;
    let slot = L::U::load(&pool.slot, at);
    let primitive = L::U::load(&pool.hits.primitive, at);
    let mut hit = active & !primitive.eq(L::U::splat(MISS));
    let mut passes = L::M::from_bits(0);
    if hit.any() {
        let wo = -load3::<L>(&pool.rays.dx, &pool.rays.dy, &pool.rays.dz, at);
        let time = L::F::load(&pool.rays.time, at);
        let mut si = interact::<L>(tables, &pool.hits, at, (wo, time), primitive, hit);
        let cone = tables.textures.has_levels().then(|| Cone::<L>::load(pool, at, L::F::load(&pool.hits.t, at)));
        if let Some(cone) = &cone {
            si.uvs = si.uvs.with_footprints(cone.footprints(tables, &si, hit));
        }
        if tracer.cull_backfaces {
            passes = is_culled(tables, &si, hit);
            hit = hit & !passes;
        }
        let key = Key::<L> { pixel: L::U::load(&pool.seed, at), sample: L::U::load(&pool.sample, at) };
        match tracer.integrator {
            Integrator::Normal => {
                let half = V3::splat([0.5; 3]);
                let color = shading_normal(tables, &si, hit).mul_add(L::F::splat(0.5), half);
                add_lanes::<L>(pool, slot, color, hit);
            }
            Integrator::Albedo => add_lanes::<L>(pool, slot, surface(tables, &si, hit).base, hit),
            _ => look_around::<L>(tracer, pool, &si, &key, slot, hit),
        }
        go_on::<L>(tracer, pool, at, &si, cone.as_ref(), &key, passes);
    }
    let ends = active & !passes;
    slot.compress(ends, &mut pool.dead, pool.n_dead);
    pool.n_dead += ends.count();
}

/// Queues a ray in a direction distributed as the cosine to the shading normal: what is open brings 1. Below the surface
/// nothing is.
#[inline(always)]
fn look_around<L: Lanes>(
    tracer: &PathTracer<'_>,
    pool: &mut PathPool,
    si: &Interaction<L>,
    key: &Key<L>,
    slot: L::U,
    hit: L::M,
) {
    let u = key.group(L::U::splat(dims::FIRST_BSDF));
    let (cos, sin) = cos_sin_2pi::<L>(u[1]);
    let r = u[0].sqrt();
    let local = V3::<L>::new(r * cos, r * sin, safe_sqrt(L::F::one() - u[0]));
    let wi = Frame::around(shading_normal(tracer.tables, si, hit)).to_world(local);
    let sees = hit & si.is_outside(wi);
    if tracer.tables.materials.has_alpha() {
        coverage_key::<L>(key.pixel, key.sample, L::U::splat(1)).compress(sees, &mut pool.shadow.key, pool.n_shadow);
    }
    if tracer.tables.moves() {
        si.time.compress(sees, &mut pool.shadow.time, pool.n_shadow);
    }
    let ray = (si.start(), wi, L::F::splat(f32::INFINITY));
    pool.push_shadow::<L>(sees, ray, slot, V3::splat([1.0; 3]));
}

/// Packs the paths `at ..` that pass a culled surface.
#[inline(always)]
fn go_on<L: Lanes>(
    tracer: &PathTracer<'_>,
    pool: &mut PathPool,
    at: usize,
    si: &Interaction<L>,
    cone: Option<&Cone<L>>,
    key: &Key<L>,
    passes: L::M,
) {
    if !passes.any() {
        return;
    }
    let (to, origin, direction) = (pool.n, si.behind(), -si.wo);
    let slot = L::U::load(&pool.slot, at);
    if let Some(cone) = cone {
        cone.follow(pool, to, L::F::one(), passes, passes);
    }
    if tracer.tables.materials.has_alpha() {
        coverage_key::<L>(key.pixel, key.sample, L::U::splat(0)).compress(passes, &mut pool.rays.key, to);
    }
    si.time.compress(passes, &mut pool.rays.time, to);
    origin.x.compress(passes, &mut pool.rays.ox, to);
    origin.y.compress(passes, &mut pool.rays.oy, to);
    origin.z.compress(passes, &mut pool.rays.oz, to);
    direction.x.compress(passes, &mut pool.rays.dx, to);
    direction.y.compress(passes, &mut pool.rays.dy, to);
    direction.z.compress(passes, &mut pool.rays.dz, to);
    L::F::splat(f32::INFINITY).store(&mut pool.rays.t_max, to);
    key.pixel.compress(passes, &mut pool.seed, to);
    key.sample.compress(passes, &mut pool.sample, to);
    slot.compress(passes, &mut pool.slot, to);
    pool.n += passes.count();
}
