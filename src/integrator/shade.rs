//! One vertex of N paths: emission, a light sample, a BSDF sample, roulette.

use super::interaction::{Interaction, interact};
use super::miss::see_environment;
use super::normals::{shading_normal, view};
use super::pool::PathPool;
use super::wave::Counters;
use super::{PathTracer, SceneTables};
use crate::accel::MISS;
use crate::material::bsdf::Bsdf;
use crate::material::surface::Surface;
use crate::math::V3;
use crate::math::bend::let_mirror_leave;
use crate::sampler::{Key, coverage_key, dims};
use simd::{Float, Kernel, Lanes, Mask, Uint};

/// Roulette starts after this many scatterings: earlier, it disturbs the stratification for more than it saves.
const ROULETTE_DEPTH: u32 = 5;

/// Shades all hits of a pool: survivors are packed to the front, shadow rays queued, ended paths listed.
pub struct Shade<'a, 'b> {
    pub tracer: &'a PathTracer<'b>,
    pub pool: &'a mut PathPool,
    pub counters: &'a mut Counters,
}

/// Where the paths go on.
struct Next<L: Lanes> {
    origin: V3<L>,
    direction: V3<L>,
    beta: V3<L>,
    /// Density of the direction, 1/sr.
    pdf: L::F,
    depth: L::U,
}

impl Kernel for Shade<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tracer, pool, counters } = self;
        let n = pool.n;
        (pool.n, pool.n_shadow) = (0, 0);
        for at in (0..n).step_by(L::N) {
            shade::<L>(tracer, pool, counters, at, L::M::first(n - at));
        }
    }
}

/// Shades paths `at ..` in the lanes of `active`.
#[inline(always)]
fn shade<L: Lanes>(tracer: &PathTracer<'_>, pool: &mut PathPool, counters: &mut Counters, at: usize, active: L::M) {
    let tables = tracer.tables;
    let slot = L::U::load(&pool.slot, at);
    let primitive = L::U::load(&pool.hits.primitive, at);
    let mut hit = active & !primitive.eq(L::U::splat(MISS));
    if tables.lights.has_environment() {
        see_environment::<L>(tables, pool, at, slot, active & !hit);
    }
    if !hit.any() {
        slot.compress(active, &mut pool.dead, pool.n_dead);
        pool.n_dead += active.count();
        return;
    }
    let depth = L::U::load(&pool.depth, at);
    let beta = load3::<L>(&pool.beta[0], &pool.beta[1], &pool.beta[2], at);
    let si = interact::<L>(tables, pool, at, primitive, hit);
    let key = Key::<L> { pixel: L::U::load(&pool.seed, at), sample: L::U::load(&pool.sample, at) };
    let mut culled = L::M::from_bits(0);
    if tracer.cull_backfaces {
        culled = tables.materials.single_sided::<L>(si.triangle.material, hit) & depth.eq(L::U::splat(0)) & !si.front;
        hit = hit & !culled;
    }
    if tables.materials.has_unlit() {
        let unlit = tables.materials.unlit::<L>(si.triangle.material, hit);
        if unlit.any() {
            // Only to rays that show things as they are: from the camera or a mirror.
            let seen = unlit & !L::F::load(&pool.prev_pdf, at).is_finite();
            let color = surface(tables, &si, seen).base;
            add_lanes::<L>(pool, slot, beta * color, seen);
            hit = hit & !unlit;
        }
    }

    if tables.materials.is_emissive() {
        let le: V3<L> = tables.materials.emission(&tables.textures, si.triangle.material, si.front, &si.uvs, hit);
        let lit = hit & le.max_component().gt(L::F::zero());
        if lit.any() {
            // Power heuristic against having sampled the same point as a light: 1 / (1 + (p_light / p_bsdf)^2). The ray
            // that found it came straight from the last scattering; only camera rays may have passed a culled surface.
            let t = L::F::load(&pool.hits.t, at);
            let pdf_light = si.triangle.light_density * t * t / si.wo.dot(si.triangle.ng).abs();
            let ratio = pdf_light / L::F::load(&pool.prev_pdf, at);
            let weight = L::F::one() / ratio.mul_add(ratio, L::F::one());
            add_lanes::<L>(pool, slot, (beta * le).scale(weight), lit);
        }
    }

    let allowed = depth.lt(L::U::splat(tracer.max_bounces.saturating_add(1)));
    if tracer.is_capped {
        counters.truncated += (hit & !allowed).count() as u64;
    }
    let scatters = hit & allowed;
    let bsdf = closure::<L>(tables, &si, scatters);
    let start = si.start();

    if !tables.lights.is_empty() {
        let u = key.group(depth + depth + L::U::splat(dims::FIRST_LIGHT));
        let to = pool.n_shadow;
        let cast = queue_light_sample::<L>(tables, pool, &si, &bsdf, start, beta, slot, [u[0], u[1], u[2]], scatters);
        if tables.materials.has_alpha() {
            coverage_key::<L>(key.pixel, key.sample, depth + L::U::splat(1)).compress(cast, &mut pool.shadow.key, to);
        }
    }

    let u = key.group(depth + depth + L::U::splat(dims::FIRST_BSDF));
    let sample = bsdf.sample([u[0], u[1]], u[2]);
    let mut beta = beta * sample.weight;
    let mut alive = scatters & sample.valid & si.is_outside(sample.wi);
    let broken = alive & !(beta.is_finite() & sample.wi.is_finite());
    if broken.any() {
        add_lanes::<L>(pool, slot, V3::splat([f32::NAN; 3]), broken);
    }
    let brightest = beta.max_component();
    alive = alive & !broken & brightest.gt(L::F::zero());
    // Unbiased roulette on the square root of the throughput, no cap: 1.14 times the efficiency of min(beta, 0.95) in
    // diffuse interiors.
    let rolls = alive & !depth.lt(L::U::splat(ROULETTE_DEPTH - 1));
    if rolls.any() {
        let survival = brightest.sqrt().min(L::F::one());
        alive = alive & (!rolls | u[3].lt(survival));
        beta = beta.scale(L::F::one() / survival).or_else(rolls, beta);
    }

    let mut next = Next { origin: start, direction: sample.wi, beta, pdf: sample.pdf, depth: depth + L::U::splat(1) };
    let to = pool.n;
    if tracer.cull_backfaces {
        // Rays that pass go on as they were, from behind the surface.
        next = Next {
            origin: si.behind().or_else(culled, next.origin),
            direction: (-si.wo).or_else(culled, next.direction),
            beta: load3::<L>(&pool.beta[0], &pool.beta[1], &pool.beta[2], at).or_else(culled, next.beta),
            pdf: L::F::load(&pool.prev_pdf, at).or_else(culled, next.pdf),
            depth: depth.or_else(culled, next.depth),
        };
        alive = alive | culled;
    }
    if tables.materials.has_alpha() {
        coverage_key::<L>(key.pixel, key.sample, next.depth).compress(alive, &mut pool.rays.key, to);
    }

    slot.compress(active & !alive, &mut pool.dead, pool.n_dead);
    pool.n_dead += (active & !alive).count();
    next.origin.x.compress(alive, &mut pool.rays.ox, to);
    next.origin.y.compress(alive, &mut pool.rays.oy, to);
    next.origin.z.compress(alive, &mut pool.rays.oz, to);
    next.direction.x.compress(alive, &mut pool.rays.dx, to);
    next.direction.y.compress(alive, &mut pool.rays.dy, to);
    next.direction.z.compress(alive, &mut pool.rays.dz, to);
    L::F::splat(f32::INFINITY).store(&mut pool.rays.t_max, to);
    next.beta.x.compress(alive, &mut pool.beta[0], to);
    next.beta.y.compress(alive, &mut pool.beta[1], to);
    next.beta.z.compress(alive, &mut pool.beta[2], to);
    next.pdf.compress(alive, &mut pool.prev_pdf, to);
    next.depth.compress(alive, &mut pool.depth, to);
    key.pixel.compress(alive, &mut pool.seed, to);
    key.sample.compress(alive, &mut pool.sample, to);
    slot.compress(alive, &mut pool.slot, to);
    pool.n += alive.count();
}

/// Textures and vertex colours applied.
#[inline(always)]
fn surface<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, active: L::M) -> Surface<L> {
    let mut surface = tables.materials.surface(&tables.textures, si.triangle.material, &si.uvs, active);
    if tables.triangles.has_colors() {
        // Exporters write colours above 1; a base colour is a reflectance.
        surface.base = (surface.base * si.color).min(V3::splat([1.0; 3]));
    }
    surface
}

/// Textures applied, shading frame found: what is left is directions.
#[inline(always)]
fn closure<'t, L: Lanes>(tables: &'t SceneTables, si: &Interaction<L>, active: L::M) -> Bsdf<'t, L> {
    let surface = surface(tables, si, active);
    if !tables.has_shading_normals() {
        let view = view(tables, si, &surface, si.ng, active);
        return Bsdf::new(&surface, &view, tables.materials.energy());
    }
    let ns = shading_normal(tables, si, active);
    // Only what mirrors needs a mirror direction; the diffuse lobe keeps the normal as it is.
    let (bent, low) = let_mirror_leave(ns, si.ng, si.wo);
    let low = low & active & surface.has_specular();
    let view = view(tables, si, &surface, bent.or_else(low, ns), active);
    let bsdf = Bsdf::new(&surface, &view, tables.materials.energy());
    if low.any() { bsdf.with_diffuse_normal(ns, low) } else { bsdf }
}

/// Next event estimation: queues a shadow ray with its finished contribution; the lanes that have one.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the vertex's state, spread over lanes")]
fn queue_light_sample<L: Lanes>(
    tables: &SceneTables,
    pool: &mut PathPool,
    si: &Interaction<L>,
    bsdf: &Bsdf<'_, L>,
    start: V3<L>,
    beta: V3<L>,
    slot: L::U,
    u: [L::F; 3],
    scatters: L::M,
) -> L::M {
    let (zero, one) = (L::F::zero(), L::F::one());
    let light = tables.lights.sample::<L>(si.origin, u, &tables.triangles, &tables.materials, &tables.textures);
    let value = bsdf.eval(light.wi);
    let ratio = value.pdf / light.pdf;
    let weight = one.or_else(light.is_delta, one / ratio.mul_add(ratio, one));
    let arriving = (beta * value.f_cos * light.radiance).scale(weight / light.pdf);
    let sees = scatters & light.valid & si.is_outside(light.wi);
    let broken = sees & !arriving.is_finite();
    if broken.any() {
        add_lanes::<L>(pool, slot, V3::splat([f32::NAN; 3]), broken);
    }
    let cast = sees & !broken & arriving.max_component().gt(zero);
    let direction = light.wi.or_else(light.is_distant, light.end - start);
    let t_max = L::F::splat(f32::INFINITY).or_else(light.is_distant, one);
    pool.push_shadow::<L>(cast, (start, direction, t_max), slot, arriving);
    cast
}

#[inline(always)]
pub(super) fn load3<L: Lanes>(x: &[f32], y: &[f32], z: &[f32], at: usize) -> V3<L> {
    V3::new(L::F::load(x, at), L::F::load(y, at), L::F::load(z, at))
}

/// Adds to the radiance of the slots of `lanes`, one by one: slots differ, but memory is not gathered this rarely.
#[inline(always)]
pub(super) fn add_lanes<L: Lanes>(pool: &mut PathPool, slot: L::U, radiance: V3<L>, lanes: L::M) {
    let (mut slots, mut rgb) = ([0; 16], [[0.0; 16]; 3]);
    slot.store(&mut slots, 0);
    radiance.x.store(&mut rgb[0], 0);
    radiance.y.store(&mut rgb[1], 0);
    radiance.z.store(&mut rgb[2], 0);
    let mut bits = lanes.bits();
    while bits != 0 {
        let i = bits.trailing_zeros() as usize;
        pool.add(slots[i], [rgb[0][i], rgb[1][i], rgb[2][i]]);
        bits &= bits - 1;
    }
}
