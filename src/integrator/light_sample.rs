//! Next event estimation: a light, a point on it, and a shadow ray on the side where that is.

use super::SceneTables;
use super::bulbs::BulbRay;
use super::clamp::Limit;
use super::closure::Closure;
use super::interaction::Interaction;
use super::medium::Crossing;
use super::pool::PathPool;
use super::shade::add_lanes;
use super::weight::weight;
use crate::light::choice::Receiver;
use crate::material::media::AIR;
use crate::math::V3;
use crate::shape::table::NONE;
use simd::{Float, Lanes, Mask, Uint};

/// A vertex of N paths.
pub(super) struct Vertex<'a, L: Lanes> {
    pub si: &'a Interaction<L>,
    pub closure: &'a Closure<'a, L>,
    /// `None` in scenes without volumes.
    pub crossing: Option<&'a Crossing<L>>,
    /// What chooses the light.
    pub receiver: &'a Receiver<L>,
    /// Where rays start that are reflected.
    pub start: V3<L>,
    /// Throughput.
    pub beta: V3<L>,
    /// How many scatterings light has behind it that arrives from here.
    pub scatterings: L::U,
    /// Of what such light may bring.
    pub limit: Option<Limit<L>>,
    /// Where the paths' radiance is.
    pub slot: L::U,
}

/// What was queued.
pub(super) struct Queued<L: Lanes> {
    /// Lanes that have a shadow ray whose contribution is known.
    pub cast: L::M,
    /// Lanes that have one towards a bulb.
    pub sought: L::M,
    /// The sums of importances that the choice was made by.
    pub total: L::F,
}

/// Queues a shadow ray for a light chosen by `u` in the lanes of `scatters` that get any light, with its finished
/// contribution where that is known.
#[inline(always)]
pub(super) fn queue_light_sample<L: Lanes>(
    tables: &SceneTables,
    pool: &mut PathPool,
    vertex: &Vertex<'_, L>,
    u: [L::F; 4],
    scatters: L::M,
) -> Queued<L> {
    let Vertex { si, closure, crossing, receiver, start, beta, scatterings, limit, slot } = *vertex;
    let (zero, one) = (L::F::zero(), L::F::one());
    let light = tables.lights.sample(receiver, u, si.time, tables.sources(), &mut pool.light_scratch);
    let value = closure.bsdf.eval(light.wi);
    let weight = one.or_else(light.is_hidden, weight::<L>(light.pdf, value.pdf, !closure.bsdf.is_glossy()));
    let mut arriving = (beta * value.f_cos * light.radiance).scale(weight / light.pdf);
    let (through, proper) = closure.sides(tables, si, light.wi);
    let sees = scatters & light.valid & proper;
    let broken = sees & !arriving.is_finite();
    if broken.any() {
        add_lanes::<L>(pool, slot, V3::splat([f32::NAN; 3]), broken);
    }
    let mut start = start;
    if tables.media.transmits() {
        start = si.behind().or_else(through, start);
    }
    let to_light = light.end - start;
    if let Some(crossing) = crossing {
        arriving = crossing.colored(arriving, through);
        let passed = arriving * crossing.on_the_way(tables, light.is_distant, to_light, through);
        // How far a bulb is is not known yet.
        let known = light.sought.eq(L::U::splat(NONE));
        arriving = passed.or_else(known, arriving);
    }
    let mut cast = sees & !broken & arriving.max_component().gt(zero);
    let mut sought = L::M::from_bits(0);
    if let Some(bulbs) = &mut pool.bulbs {
        sought = cast & !light.sought.eq(L::U::splat(NONE));
        cast = cast & !sought;
        let medium = crossing.map_or(L::U::splat(AIR), |crossing| crossing.medium(through));
        let (direction, t_max) = (light.wi, light.reach);
        bulbs.push(
            sought,
            &BulbRay {
                origin: start,
                direction,
                t_max,
                time: si.time,
                weight: arriving,
                sought: light.sought,
                medium,
                scatterings,
                slot,
            },
        );
    }
    if let Some(limit) = limit {
        let (left, excess) = limit.apply(arriving);
        excess.compress(cast, &mut pool.shadow_excess, pool.n_shadow);
        arriving = left;
    }
    if tables.moves() {
        si.time.compress(cast, &mut pool.shadow.time, pool.n_shadow);
    }
    let direction = light.wi.or_else(light.is_distant, to_light);
    let t_max = L::F::splat(f32::INFINITY).or_else(light.is_distant, one);
    pool.push_shadow::<L>(cast, (start, direction, t_max), slot, arriving);
    Queued { cast, sought, total: light.total }
}
