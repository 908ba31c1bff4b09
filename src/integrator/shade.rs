//! One vertex of N paths: emission, a light sample, a BSDF sample, roulette.

use super::coverage::{behind, passes};
use super::miss::see_environment;
use super::pool::PathPool;
use super::wave::Counters;
use super::{PathTracer, SceneTables};
use crate::accel::MISS;
use crate::material::bsdf::{Bsdf, Surface};
use crate::math::{Frame, UvSets, V3, robust};
use crate::sampler::{Key, coverage_key, dims};
use crate::shape::table::{NONE, Triangle};
use simd::{Float, Kernel, Lanes, Mask, Uint};

/// Roulette starts after this many scatterings: earlier, it disturbs the stratification for more than it saves.
const ROULETTE_DEPTH: u32 = 5;

/// Smallest cosine between view and shading normal. Where interpolation or a normal map turns the normal away from the
/// viewer, it is bent back to this.
const MIN_VIEW_COSINE: f32 = 0.01;

/// Shades all hits of a pool: survivors are packed to the front, shadow rays queued, ended paths listed.
pub struct Shade<'a, 'b> {
    pub tracer: &'a PathTracer<'b>,
    pub pool: &'a mut PathPool,
    pub counters: &'a mut Counters,
}

/// Where a path hit and how it looks from there.
struct Interaction<L: Lanes> {
    triangle: Triangle<L>,
    /// Hit point, from barycentric coordinates.
    p: V3<L>,
    wo: V3<L>,
    /// Geometric normal on the viewer's side.
    ng: V3<L>,
    /// The front side was hit.
    front: L::M,
    /// Texture coordinates.
    uvs: UvSets<L>,
    /// Vertex colour; white where there is none.
    color: V3<L>,
    /// Opacity of the vertex colour.
    opacity: L::F,
    /// Interpolated normal as given (front side up, not normalised) and where there is one.
    normal: V3<L>,
    has_normal: L::M,
    /// Barycentric coordinates.
    b: [L::F; 2],
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
    let (mut t, mut through) = (L::F::load(&pool.hits.t, at), L::M::from_bits(0));
    if tables.materials.has_alpha() {
        t = t + L::F::load(&pool.travelled, at);
        let key = coverage_key::<L>(key.pixel, key.sample, depth);
        through = passes::<L>(tables, si.triangle.material, &si.uvs, si.opacity, key, primitive, hit);
        hit = hit & !through;
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
            // Power heuristic against having sampled the same point as a light: 1 / (1 + (p_light / p_bsdf)^2).
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
    // Off the surface on the viewer's side; reflection only, so all rays leave there.
    let start = robust::offset_point(si.p, si.ng, si.triangle.offset_length());

    if !tables.lights.is_empty() {
        let u = key.group(depth + depth + L::U::splat(dims::FIRST_LIGHT));
        let to = pool.n_shadow;
        let cast = queue_light_sample::<L>(tables, pool, &si, &bsdf, start, beta, slot, [u[0], u[1], u[2]], scatters);
        if tables.materials.has_alpha() {
            coverage_key::<L>(key.pixel, key.sample, depth + L::U::splat(1)).compress(cast, &mut pool.shadow_key, to);
        }
    }

    let u = key.group(depth + depth + L::U::splat(dims::FIRST_BSDF));
    let sample = bsdf.sample([u[0], u[1]], u[2]);
    let mut beta = beta * sample.weight;
    let above = sample.wi.dot(si.ng).gt(L::F::zero());
    let mut alive = scatters & sample.valid & above;
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
    if tables.materials.has_alpha() {
        // Rays that pass go on as they were, from behind the surface.
        next = Next {
            origin: behind(&si.triangle, si.p, -si.wo).or_else(through, next.origin),
            direction: (-si.wo).or_else(through, next.direction),
            beta: load3::<L>(&pool.beta[0], &pool.beta[1], &pool.beta[2], at).or_else(through, next.beta),
            pdf: L::F::load(&pool.prev_pdf, at).or_else(through, next.pdf),
            depth: depth.or_else(through, next.depth),
        };
        alive = alive | through;
        t.masked(through).compress(alive, &mut pool.travelled, to);
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

/// Geometry of the hits.
#[inline(always)]
fn interact<L: Lanes>(tables: &SceneTables, pool: &PathPool, at: usize, primitive: L::U, hit: L::M) -> Interaction<L> {
    let zero = L::F::zero();
    let triangle = tables.triangles.get::<L>(primitive);
    let b = [L::F::load(&pool.hits.u, at), L::F::load(&pool.hits.v, at)];
    let wo = -load3::<L>(&pool.rays.dx, &pool.rays.dy, &pool.rays.dz, at);
    let front = wo.dot(triangle.ng).gt(zero);
    let ng = triangle.ng.or_else(front, -triangle.ng);
    let (mut uvs, mut normal, mut has_normal) = (UvSets::single(zero, zero), triangle.ng, L::M::from_bits(0));
    let (mut color, mut opacity) = (V3::splat([1.0; 3]), L::F::one());
    if tables.triangles.has_attributes() {
        let has = hit & !triangle.attributes.eq(L::U::splat(NONE));
        if has.any() {
            let a = tables.triangles.attributes::<L>(triangle.attributes, b[0], b[1]);
            uvs = a.uvs.masked(has);
            if tables.triangles.has_colors() {
                (color, opacity) = (a.color.or_else(has, color), a.opacity.or_else(has, opacity));
            }
            has_normal = has & a.has_normal;
            normal = a.normal.or_else(has_normal, normal);
        }
    }
    Interaction { p: triangle.point(b[0], b[1]), triangle, wo, ng, front, uvs, color, opacity, normal, has_normal, b }
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
fn closure<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, active: L::M) -> Bsdf<L> {
    let surface = surface(tables, si, active);
    let mut ns = si.ng;
    if tables.triangles.has_attributes() && si.has_normal.any() {
        let mut normal = si.normal.normalized();
        if tables.triangles.has_tangents() {
            let mapped = si.has_normal & !si.triangle.tangents.eq(L::U::splat(NONE));
            if mapped.any() {
                normal = map_normal(tables, si, normal, mapped);
            }
        }
        // The viewer's side; where it cannot be used, the geometric normal.
        let turned = normal.or_else(si.front, -normal);
        let usable = si.has_normal & turned.is_finite();
        ns = turned.or_else(usable, ns);
        let cos = si.wo.dot(ns);
        let short = (L::F::splat(MIN_VIEW_COSINE) - cos).max(L::F::zero());
        let bent = si.wo.mul_add(short, ns).normalized();
        ns = bent.or_else(usable & short.gt(L::F::zero()), ns);
    }
    Bsdf::new(surface, Frame::around(ns), si.wo)
}

/// The shading normal (front side up) with the material's normal map applied.
#[inline(always)]
fn map_normal<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, normal: V3<L>, mapped: L::M) -> V3<L> {
    let (t, handedness) = tables.triangles.tangent::<L>(si.triangle.tangents, si.b[0], si.b[1]);
    let (m, has) = tables.materials.normal_map::<L>(&tables.textures, si.triangle.material, &si.uvs, mapped);
    // glTF 3.7.2.1: bitangent = cross(normal, tangent) x handedness. The tangent is used as interpolated, made unit.
    let t = (t - normal.scale(normal.dot(t))).normalized();
    let b = normal.cross(t).scale(handedness);
    let n = t.mul_add(m.x, b.mul_add(m.y, normal.scale(m.z))).normalized();
    n.or_else(has & n.is_finite(), normal)
}

/// Next event estimation: queues a shadow ray with its finished contribution; the lanes that have one.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the vertex's state, spread over lanes")]
fn queue_light_sample<L: Lanes>(
    tables: &SceneTables,
    pool: &mut PathPool,
    si: &Interaction<L>,
    bsdf: &Bsdf<L>,
    start: V3<L>,
    beta: V3<L>,
    slot: L::U,
    u: [L::F; 3],
    scatters: L::M,
) -> L::M {
    let (zero, one) = (L::F::zero(), L::F::one());
    let light = tables.lights.sample::<L>(si.p, u, &tables.triangles, &tables.materials, &tables.textures);
    let value = bsdf.eval(light.wi);
    let ratio = value.pdf / light.pdf;
    let weight = one.or_else(light.is_delta, one / ratio.mul_add(ratio, one));
    let arriving = (beta * value.f_cos * light.radiance).scale(weight / light.pdf);
    let sees = scatters & light.valid & light.wi.dot(si.ng).gt(zero);
    let broken = sees & !arriving.is_finite();
    if broken.any() {
        add_lanes::<L>(pool, slot, V3::splat([f32::NAN; 3]), broken);
    }
    let cast = sees & !broken & arriving.max_component().gt(zero);
    let direction = light.wi.or_else(light.is_distant, light.end - start);
    let t_max = L::F::splat(f32::INFINITY).or_else(light.is_distant, one);
    let to = pool.n_shadow;
    start.x.compress(cast, &mut pool.shadow.ox, to);
    start.y.compress(cast, &mut pool.shadow.oy, to);
    start.z.compress(cast, &mut pool.shadow.oz, to);
    direction.x.compress(cast, &mut pool.shadow.dx, to);
    direction.y.compress(cast, &mut pool.shadow.dy, to);
    direction.z.compress(cast, &mut pool.shadow.dz, to);
    t_max.compress(cast, &mut pool.shadow.t_max, to);
    slot.compress(cast, &mut pool.shadow_slot, to);
    arriving.x.compress(cast, &mut pool.shadow_radiance[0], to);
    arriving.y.compress(cast, &mut pool.shadow_radiance[1], to);
    arriving.z.compress(cast, &mut pool.shadow_radiance[2], to);
    pool.n_shadow += cast.count();
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
