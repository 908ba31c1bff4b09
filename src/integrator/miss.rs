//! Rays that hit nothing see the environment.

use super::PathTracer;
use super::clamp::{Limit, add_limited};
use super::medium::Stack;
use super::pool::PathPool;
use super::receiver;
use super::shade::load3;
use super::weight::weight_of_remembered;
use crate::math::V3;
use simd::{Float, Lanes, Mask, Part, Uint};

/// Adds what the environment sends along the rays `at ..` that are `missed`. It is weighed against
/// having sampled the same direction as a light; rays from the camera or a mirror have infinite density and weight 1.
#[inline(always)]
pub fn see_environment<L: Lanes>(tracer: &PathTracer<'_>, pool: &mut PathPool, at: usize, slot: L::U, missed: L::M) {
    if missed.any() {
        L::outline(See { tracer, pool, at, slot, missed });
    }
}

/// [`see_environment`].
struct See<'a, 't, L: Lanes> {
    tracer: &'a PathTracer<'t>,
    pool: &'a mut PathPool,
    at: usize,
    slot: L::U,
    missed: L::M,
}

impl<L: Lanes> Part<L> for See<'_, '_, L> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { tracer, pool, at, slot, missed } = self;
        let tables = tracer.tables;
        let direction = load3::<L>(&pool.rays.dx, &pool.rays.dy, &pool.rays.dz, at);
        let mut beta = load3::<L>(&pool.beta[0], &pool.beta[1], &pool.beta[2], at);
        if tables.media.has_volume() {
            beta = beta * tables.media.transmittance_from_far(Stack::<L>::load(&pool.media, at).innermost());
        }
        let (radiance, pdf): (V3<L>, L::F) = tables.lights.environment::<L>(direction);
        let pmf = tables.lights.pmf_of_environment(receiver::load::<L>(tables, &pool.from, at));
        let weight = weight_of_remembered::<L>(L::F::load(&pool.prev_pdf, at), pmf * pdf);
        let limit = Limit::<L>::new(tracer.clamp, L::U::load(&pool.depth, at));
        add_limited::<L>(limit, pool, slot, (beta * radiance).scale(weight), missed);
    }
}
