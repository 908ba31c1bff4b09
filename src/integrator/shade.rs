//! One vertex of N paths: emission, a light sample, a BSDF sample, roulette.

use super::clamp::{Limit, add_limited};
use super::closure::{closure, surface};
use super::cone::Cone;
use super::emission::emitted;
use super::interaction::{Interaction, interact};
use super::light_sample::{Vertex, queue_light_sample};
use super::medium::{Crossing, Stack};
use super::miss::see_environment;
use super::pool::PathPool;
use super::receiver::{self, receiver};
use super::sized::{see_balls, see_suns};
use super::wave::Counters;
use super::weight::remembered;
use super::{Integrator, PathTracer, SceneTables};
use crate::accel::MISS;
use crate::material::media::{AIR, MediumTable};
use crate::math::V3;
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
    /// Density of the direction, as the pool remembers it.
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
        see_environment::<L>(tracer, pool, at, slot, active & !hit);
    }
    if !tables.lights.balls().is_empty() {
        see_balls::<L>(tracer, pool, at, slot, active, hit);
    }
    if !tables.lights.suns().is_empty() {
        see_suns::<L>(tracer, pool, at, slot, active & !hit);
    }
    if tables.media.has_volume() {
        let inside = !Stack::<L>::load(&pool.media, at).innermost().eq(L::U::splat(AIR));
        counters.unpaired += (active & !hit & inside).count() as u64;
    }
    if !hit.any() {
        slot.compress(active, &mut pool.dead, pool.n_dead);
        pool.n_dead += active.count();
        return;
    }
    let depth = L::U::load(&pool.depth, at);
    let limit = Limit::<L>::new(tracer.clamp, depth);
    let mut beta = load3::<L>(&pool.beta[0], &pool.beta[1], &pool.beta[2], at);
    let wo = -load3::<L>(&pool.rays.dx, &pool.rays.dy, &pool.rays.dz, at);
    let time = L::F::load(&pool.rays.time, at);
    let mut si = interact::<L>(tables, &pool.hits, at, (wo, time), primitive, hit);
    let cone = if tables.textures.has_levels() {
        let cone = Cone::<L>::load(pool, at, L::F::load(&pool.hits.t, at));
        si.uvs = si.uvs.with_footprints(cone.footprints(tables, &si, hit));
        Some(cone)
    } else {
        None
    };
    let key = Key::<L> { pixel: L::U::load(&pool.seed, at), sample: L::U::load(&pool.sample, at) };
    let mut culled = L::M::from_bits(0);
    if tracer.cull_backfaces {
        culled = is_culled(tables, &si, hit & depth.eq(L::U::splat(0)));
        hit = hit & !culled;
    }
    // What lies between the last scattering and this hit: media that absorb, glass that was gone straight through.
    let mut distance = L::F::load(&pool.hits.t, at);
    let crossing = if tables.media.has_volume() {
        let crossing = Crossing::<L>::new(tables, pool, at, si.triangle.material, si.front, hit, &key);
        beta = beta * crossing.transmittance(&tables.media, distance);
        Some(crossing)
    } else {
        None
    };
    let mut thin = L::M::from_bits(0);
    let mut passes = L::U::splat(0);
    if tables.media.has_thin_glass() {
        thin = tables.media.is_thin_glass::<L>(MediumTable::inside::<L>(si.triangle.material), hit);
        distance = distance + L::F::load(&pool.travelled, at);
        passes = L::U::load(&pool.passes, at);
    }
    let vertex = depth + passes;
    if tables.materials.has_unlit() {
        let unlit = tables.materials.unlit::<L>(si.triangle.material, hit);
        if unlit.any() {
            // Only to rays that show things as they are: from the camera or a mirror.
            let seen = unlit & !L::F::load(&pool.prev_pdf, at).is_finite();
            let color = surface(tables, &si, seen).base;
            add_limited::<L>(limit, pool, slot, beta * color, seen);
            hit = hit & !unlit;
        }
    }

    if tables.materials.is_emissive() {
        let prev_pdf = L::F::load(&pool.prev_pdf, at);
        let (radiance, lit) = emitted(tables, &si, &pool.from, at, distance, prev_pdf, hit);
        if lit.any() {
            add_limited::<L>(limit, pool, slot, beta * radiance, lit);
        }
    }

    let allowed = depth.lt(L::U::splat(tracer.max_bounces.saturating_add(1)));
    let mut scatters = hit & allowed;
    if tracer.integrator == Integrator::Direct {
        // Mirrors and clear glass show what is beyond them; what anything else scattered only finds lamps.
        scatters = scatters & !L::F::load(&pool.prev_pdf, at).is_finite();
    }
    // Going straight through is no scattering.
    let shaded = scatters | (thin & hit);
    let eta = match &crossing {
        Some(crossing) => crossing.eta,
        None => L::F::one(),
    };
    let mut closure = closure::<L>(tables, &si, shaded);
    closure.add_layers(tables, &pool.hits, at, &si, eta, shaded);
    let start = si.start();

    let receiver = receiver(tables, &si, &closure);
    let mut expected = L::F::zero();
    if !tables.lights.is_empty() {
        let u = key.group(vertex + vertex + L::U::splat(dims::FIRST_LIGHT));
        let (to, to_bulbs) = (pool.n_shadow, pool.bulbs.as_ref().map_or(0, |bulbs| bulbs.n));
        let (closure, crossing) = (&closure, crossing.as_ref());
        let scatterings = depth + L::U::splat(1);
        let limit = Limit::<L>::new(tracer.clamp, scatterings);
        let here = Vertex { si: &si, closure, crossing, receiver: &receiver, start, beta, scatterings, limit, slot };
        let queued = queue_light_sample::<L>(tables, pool, &here, u, scatters);
        expected = queued.total;
        if tables.materials.has_alpha() {
            let key = coverage_key::<L>(key.pixel, key.sample, depth + L::U::splat(1));
            key.compress(queued.cast, &mut pool.shadow.key, to);
            if let Some(bulbs) = &mut pool.bulbs {
                key.compress(queued.sought, &mut bulbs.rays.key, to_bulbs);
            }
        }
    }

    let u = key.group(vertex + vertex + L::U::splat(dims::FIRST_BSDF));
    let sample = closure.bsdf.sample([u[0], u[1]], u[2]);
    let mut beta = beta * sample.weight;
    let mut leaves = si.is_outside(sample.wi);
    // Lanes that go on behind the surface; those of them that go on as they came, unless roulette or light ends them.
    let (mut through, mut straight) = (L::M::from_bits(0), L::M::from_bits(0));
    if tables.media.transmits() {
        straight = shaded & sample.straight;
        through = straight | (scatters & sample.transmitted);
        leaves = straight | (leaves & !through) | (through & si.is_behind(sample.wi));
        if let Some(crossing) = &crossing {
            beta = crossing.colored(beta, through & crossing.is_boundary);
        }
    }
    if tracer.is_capped {
        counters.truncated += (hit & !allowed & !straight).count() as u64;
    }
    let mut alive = (scatters | straight) & sample.valid & leaves;
    let broken = alive & !(beta.is_finite() & sample.wi.is_finite());
    if broken.any() {
        add_lanes::<L>(pool, slot, V3::splat([f32::NAN; 3]), broken);
    }
    let brightest = beta.max_component();
    alive = alive & !broken & brightest.gt(L::F::zero());
    // Unbiased roulette on the square root of the throughput, no cap: 1.14 times the efficiency of min(beta, 0.95) in
    // diffuse interiors.
    let rolls = alive & !straight & !depth.lt(L::U::splat(ROULETTE_DEPTH - 1));
    if rolls.any() {
        // Radiance is denser in a denser medium, by the square of its index; the path is worth the same.
        let worth = match &crossing {
            Some(crossing) => brightest * crossing.density(&tables.media, through),
            None => brightest,
        };
        let survival = worth.sqrt().min(L::F::one());
        alive = alive & (!rolls | u[3].lt(survival));
        beta = beta.scale(L::F::one() / survival).or_else(rolls, beta);
    }

    let pdf = remembered::<L>(sample.pdf, !closure.bsdf.is_glossy());
    let mut next = Next { origin: start, direction: sample.wi, beta, pdf, depth: depth + L::U::splat(1) };
    let to = pool.n;
    if tables.media.transmits() {
        next.origin = si.behind().or_else(through, next.origin);
        next.direction = (-si.wo).or_else(straight, next.direction);
        next.pdf = L::F::load(&pool.prev_pdf, at).or_else(straight, next.pdf);
        next.depth = depth.or_else(straight, next.depth);
    }
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

    if tables.moves() {
        time.compress(alive, &mut pool.rays.time, to);
    }
    if let Some(crossing) = &crossing {
        crossing.follow(pool, counters, at, to, through & !straight, alive);
    }
    if tables.media.has_thin_glass() {
        distance.masked(straight | culled).compress(alive, &mut pool.travelled, to);
        (passes + L::U::splat(1)).or_else(straight, passes).compress(alive, &mut pool.passes, to);
    }
    if let Some(cone) = &cone {
        cone.follow(pool, to, sample.pdf, straight | culled, alive);
    }
    if tables.lights.has_choice() {
        receiver::follow(pool, at, to, (&receiver, expected), straight | culled, alive);
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

/// The camera rays of `hit` that pass the surface because it is seen from behind.
#[inline(always)]
pub(super) fn is_culled<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, hit: L::M) -> L::M {
    let culled = tables.materials.single_sided::<L>(si.triangle.material, hit) & !si.front;
    // The boundary of a volume has two sides whatever the file says of its surface.
    culled & !tables.media.is_boundary::<L>(MediumTable::inside::<L>(si.triangle.material), culled)
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
