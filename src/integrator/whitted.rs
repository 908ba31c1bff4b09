//! One vertex of Whitted's tracer over N lanes: emission, the light of every lamp by fixed points of it (hard shadows, no
//! ambient term), then all mirrors of the surface, each a branch of its own.
//!
//! After Whitted 1980, "An Improved Illumination Model for Shaded Display". In the place of Phong's lobes is the material's own
//! BSDF, towards each lamp. Nothing is left to chance but where a sample lies in its pixel, and what partly present
//! surfaces let through: that is decided by name.

use super::branches::SCRATCH;
use super::bulbs::BulbRay;
use super::closure::{Closure, closure, surface};
use super::cone::Cone;
use super::emission::shining;
use super::interaction::{Interaction, interact};
use super::medium::Crossing;
use super::miss::see_environment;
use super::pool::{POOL, PathPool};
use super::shade::{add_lanes, is_culled, load3};
use super::wave::Counters;
use super::{Integrator, PathTracer};
use crate::accel::MISS;
use crate::material::bsdf::Mirror;
use crate::material::media::AIR;
use crate::math::V3;
use crate::sampler::{Key, coverage_key};
use crate::shape::table::NONE;
use simd::{Float, Kernel, Lanes, Mask, Uint};

/// Shades all hits of a pool: a branch of each path is packed to the front, the others wait, ended paths are listed.
pub struct Whitted<'a, 'b> {
    pub tracer: &'a PathTracer<'b>,
    pub pool: &'a mut PathPool,
    pub counters: &'a mut Counters,
}

impl Kernel for Whitted<'_, '_> {
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

/// Where paths are.
struct Here<'a, L: Lanes> {
    si: &'a Interaction<L>,
    closure: &'a Closure<'a, L>,
    /// `None` in scenes without volumes.
    crossing: Option<&'a Crossing<L>>,
    /// Throughput.
    beta: V3<L>,
    depth: L::U,
    slot: L::U,
    key: Key<L>,
}

/// What goes on from there.
struct Branch<L: Lanes> {
    origin: V3<L>,
    direction: V3<L>,
    beta: V3<L>,
    depth: L::U,
    /// Lanes that have gone through the surface.
    through: L::M,
    alive: L::M,
}

/// Shades paths `at ..` in the lanes of `active`.
#[inline(always)]
fn shade<L: Lanes>(tracer: &PathTracer<'_>, pool: &mut PathPool, counters: &mut Counters, at: usize, active: L::M) {
    let tables = tracer.tables;
    let none = L::M::from_bits(0);
    let slot = L::U::load(&pool.slot, at);
    let primitive = L::U::load(&pool.hits.primitive, at);
    let mut hit = active & !primitive.eq(L::U::splat(MISS));
    if tables.lights.has_environment() {
        see_environment::<L>(tracer, pool, at, slot, active & !hit);
    }
    if !hit.any() {
        end::<L>(pool, counters, slot, active);
        return;
    }
    let depth = L::U::load(&pool.depth, at);
    let mut beta = load3::<L>(&pool.beta[0], &pool.beta[1], &pool.beta[2], at);
    let wo = -load3::<L>(&pool.rays.dx, &pool.rays.dy, &pool.rays.dz, at);
    let time = L::F::load(&pool.rays.time, at);
    let mut si = interact::<L>(tables, &pool.hits, at, (wo, time), primitive, hit);
    let distance = L::F::load(&pool.hits.t, at);
    let cone = tables.textures.has_levels().then(|| Cone::<L>::load(pool, at, distance));
    if let Some(cone) = &cone {
        si.uvs = si.uvs.with_footprints(cone.footprints(tables, &si, hit));
    }
    let key = Key::<L> { pixel: L::U::load(&pool.seed, at), sample: L::U::load(&pool.sample, at) };
    let mut culled = none;
    if tracer.cull_backfaces {
        culled = is_culled(tables, &si, hit & depth.eq(L::U::splat(0)));
        hit = hit & !culled;
    }
    let mut crossing = None;
    if tables.media.has_volume() {
        let here = Crossing::<L>::new(tables, pool, at, si.triangle.material, si.front, hit, &key);
        let here = here.without_dispersion(&tables.media);
        // What passes a culled surface has its throughput of before.
        beta = (beta * here.transmittance(&tables.media, distance)).or_else(!culled, beta);
        crossing = Some(here);
    }
    if tables.materials.has_unlit() {
        let unlit = tables.materials.unlit::<L>(si.triangle.material, hit);
        if unlit.any() {
            add_lanes::<L>(pool, slot, beta * surface(tables, &si, unlit).base, unlit);
            hit = hit & !unlit;
        }
    }
    if tables.materials.is_emissive() {
        let (radiance, lit) = shining(tables, &si, hit);
        if lit.any() {
            add_lanes::<L>(pool, slot, beta * radiance, lit);
        }
    }

    let allowed = depth.lt(L::U::splat(tracer.max_bounces.saturating_add(1)));
    if tracer.is_capped {
        each::<L>(slot, hit & !allowed, |slot| pool.cut(slot));
    }
    let scatters = hit & allowed;
    let eta = crossing.as_ref().map_or(L::F::one(), |crossing| crossing.eta);
    let mut closure = closure::<L>(tables, &si, scatters);
    closure.add_layers(tables, &pool.hits, at, &si, eta, scatters);
    let here = Here { si: &si, closure: &closure, crossing: crossing.as_ref(), beta, depth, slot, key };
    gather::<L>(tracer, pool, counters, &here, scatters);

    // Those that wait are written first: the last one takes the paths' own place, where what they all are made of is.
    if tables.materials.has_coat() {
        let coat = branch::<L>(tracer, pool, &here, Mirror::Coat, scatters);
        wait::<L>(tracer, pool, counters, at, &here, &coat, cone.as_ref());
    }
    if tables.media.transmits() {
        let behind = branch::<L>(tracer, pool, &here, Mirror::Behind, scatters);
        wait::<L>(tracer, pool, counters, at, &here, &behind, cone.as_ref());
    }
    let mut mirror = branch::<L>(tracer, pool, &here, Mirror::Surface, scatters);
    if tracer.cull_backfaces {
        mirror = Branch {
            origin: si.behind().or_else(culled, mirror.origin),
            direction: (-si.wo).or_else(culled, mirror.direction),
            beta: beta.or_else(culled, mirror.beta),
            depth: depth.or_else(culled, mirror.depth),
            through: mirror.through,
            alive: mirror.alive | culled,
        };
    }
    end::<L>(pool, counters, slot, active & !mirror.alive);
    let to = pool.n;
    write::<L>(tracer, pool, counters, [at, to], &here, &mirror, cone.as_ref());
    pool.n += mirror.alive.count();
}

/// Queues shadow rays to all lamps; rays that find no room are traced at once.
#[inline(always)]
fn gather<L: Lanes>(
    tracer: &PathTracer<'_>,
    pool: &mut PathPool,
    counters: &mut Counters,
    here: &Here<'_, L>,
    scatters: L::M,
) {
    let (tables, zero, one) = (tracer.tables, L::F::zero(), L::F::one());
    if !scatters.any() {
        return;
    }
    for point in &tracer.lamps {
        if pool.n_shadow.max(pool.bulbs.as_ref().map_or(0, |bulbs| bulbs.n)) + L::N > POOL {
            tracer.shadow(pool, counters);
            tracer.light_of_bulbs(pool, counters);
            pool.n_shadow = 0;
        }
        let light = tables.lights.at_fixed(point, here.si.origin, here.si.time, tables.sources());
        let value = here.closure.bsdf.eval(light.wi);
        let share = L::F::splat(point.share) / light.pdf;
        let mut arriving = (here.beta * value.f_cos * light.radiance).scale(share);
        let (through, proper) = here.closure.sides(tables, here.si, light.wi);
        let sees = scatters & light.valid & proper;
        let broken = sees & !arriving.is_finite();
        if broken.any() {
            add_lanes::<L>(pool, here.slot, V3::splat([f32::NAN; 3]), broken);
        }
        let start = here.si.behind().or_else(through, here.si.start());
        let to_light = light.end - start;
        let is_sought = !light.sought.eq(L::U::splat(NONE));
        if let Some(crossing) = here.crossing {
            // How far a bulb is is not known yet.
            let passed = arriving * crossing.on_the_way(tables, light.is_distant, to_light, through);
            arriving = arriving.or_else(is_sought, passed);
        }
        let lit = sees & !broken & arriving.max_component().gt(zero);
        let (sought, cast) = (lit & is_sought, lit & !is_sought);
        if sought.any()
            && let Some(bulbs) = &mut pool.bulbs
        {
            if tables.materials.has_alpha() {
                shadow_key(here).compress(sought, &mut bulbs.rays.key, bulbs.n);
            }
            let medium = here.crossing.map_or(L::U::splat(AIR), |crossing| crossing.medium(through));
            let ray = BulbRay {
                origin: start,
                direction: light.wi,
                t_max: light.reach,
                time: here.si.time,
                weight: arriving,
                sought: light.sought,
                medium,
                scatterings: L::U::splat(0),
                slot: here.slot,
            };
            bulbs.push(sought, &ray);
        }
        if tables.materials.has_alpha() {
            shadow_key(here).compress(cast, &mut pool.shadow.key, pool.n_shadow);
        }
        if tables.moves() {
            here.si.time.compress(cast, &mut pool.shadow.time, pool.n_shadow);
        }
        let direction = light.wi.or_else(light.is_distant, to_light);
        let t_max = L::F::splat(f32::INFINITY).or_else(light.is_distant, one);
        if tracer.clamp.is_some() {
            zero.compress(cast, &mut pool.shadow_excess, pool.n_shadow);
        }
        pool.push_shadow::<L>(cast, (start, direction, t_max), here.slot, arriving);
    }
}

/// By what partly present surfaces know shadow rays.
#[inline(always)]
fn shadow_key<L: Lanes>(here: &Here<'_, L>) -> L::U {
    coverage_key::<L>(here.key.pixel, here.key.sample, here.depth + L::U::splat(1))
}

/// What goes on by `mirror`: nothing that is worth too little.
#[inline(always)]
fn branch<L: Lanes>(
    tracer: &PathTracer<'_>,
    pool: &mut PathPool,
    here: &Here<'_, L>,
    mirror: Mirror,
    scatters: L::M,
) -> Branch<L> {
    let (tables, si) = (tracer.tables, here.si);
    let sample = here.closure.bsdf.mirror(mirror);
    let beta = here.beta * sample.weight;
    let mut through = L::M::from_bits(0);
    let mut leaves = si.is_outside(sample.wi);
    if tables.media.transmits() {
        through = scatters & sample.transmitted;
        leaves = (scatters & sample.straight) | (leaves & !through) | (through & si.is_behind(sample.wi));
    }
    let goes = scatters & sample.valid & leaves;
    let broken = goes & !(beta.is_finite() & sample.wi.is_finite());
    if broken.any() {
        add_lanes::<L>(pool, here.slot, V3::splat([f32::NAN; 3]), broken);
    }
    Branch {
        origin: si.behind().or_else(through, si.start()),
        direction: (-si.wo).or_else(sample.straight, sample.wi),
        beta,
        // Going straight through is no scattering.
        depth: here.depth.or_else(sample.straight, here.depth + L::U::splat(1)),
        through,
        alive: goes & !broken & beta.max_component().ge(L::F::splat(Integrator::LEAST_BRANCH)),
    }
}

/// Has a branch wait.
#[inline(always)]
fn wait<L: Lanes>(
    tracer: &PathTracer<'_>,
    pool: &mut PathPool,
    counters: &mut Counters,
    at: usize,
    here: &Here<'_, L>,
    branch: &Branch<L>,
    cone: Option<&Cone<L>>,
) {
    if branch.alive.any() {
        write::<L>(tracer, pool, counters, [at, SCRATCH], here, branch, cone);
        pool.wait(branch.alive.count());
    }
}

/// Packs a branch of the paths `at ..` to `to ..`.
#[inline(always)]
fn write<L: Lanes>(
    tracer: &PathTracer<'_>,
    pool: &mut PathPool,
    counters: &mut Counters,
    [at, to]: [usize; 2],
    here: &Here<'_, L>,
    branch: &Branch<L>,
    cone: Option<&Cone<L>>,
) {
    let Branch { origin, direction, beta, depth, through, alive } = *branch;
    if tracer.tables.materials.has_alpha() {
        coverage_key::<L>(here.key.pixel, here.key.sample, depth).compress(alive, &mut pool.rays.key, to);
    }
    if let Some(crossing) = here.crossing {
        crossing.follow(pool, counters, at, to, through, alive);
    }
    if let Some(cone) = cone {
        cone.follow(pool, to, L::F::splat(f32::INFINITY), alive, alive);
    }
    here.si.time.compress(alive, &mut pool.rays.time, to);
    origin.x.compress(alive, &mut pool.rays.ox, to);
    origin.y.compress(alive, &mut pool.rays.oy, to);
    origin.z.compress(alive, &mut pool.rays.oz, to);
    direction.x.compress(alive, &mut pool.rays.dx, to);
    direction.y.compress(alive, &mut pool.rays.dy, to);
    direction.z.compress(alive, &mut pool.rays.dz, to);
    L::F::splat(f32::INFINITY).store(&mut pool.rays.t_max, to);
    beta.x.compress(alive, &mut pool.beta[0], to);
    beta.y.compress(alive, &mut pool.beta[1], to);
    beta.z.compress(alive, &mut pool.beta[2], to);
    depth.compress(alive, &mut pool.depth, to);
    here.key.pixel.compress(alive, &mut pool.seed, to);
    here.key.sample.compress(alive, &mut pool.sample, to);
    here.slot.compress(alive, &mut pool.slot, to);
}

/// Ends rays of the slots of `lanes`; those that have no other are listed.
#[inline(always)]
fn end<L: Lanes>(pool: &mut PathPool, counters: &mut Counters, slot: L::U, lanes: L::M) {
    each::<L>(slot, lanes, |slot| {
        if let Some(is_cut) = pool.end(slot) {
            counters.truncated += u64::from(is_cut);
            pool.dead[pool.n_dead] = slot;
            pool.n_dead += 1;
        }
    });
}

/// Calls `f` with the slots of `lanes`, one by one.
#[inline(always)]
fn each<L: Lanes>(slot: L::U, lanes: L::M, mut f: impl FnMut(u32)) {
    let mut slots = [0; 16];
    slot.store(&mut slots, 0);
    let mut bits = lanes.bits();
    while bits != 0 {
        f(slots[bits.trailing_zeros() as usize]);
        bits &= bits - 1;
    }
}
