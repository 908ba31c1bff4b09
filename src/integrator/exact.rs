//! Hits of exact shapes: worked out one by one in f64, and put into their lanes.

use super::SceneTables;
use super::interaction::Interaction;
use crate::accel::HitBatch;
use crate::math::V3;
use simd::{Float, Lanes, Mask, Uint};

/// Lanes at most.
const MOST: usize = 16;

/// What lanes that hit shapes are shaded with, structure of arrays.
struct Points {
    p: [[f32; MOST]; 3],
    ng: [[f32; MOST]; 3],
    du: [[f32; MOST]; 3],
    dv: [[f32; MOST]; 3],
    uv: [[f32; MOST]; 2],
    offset: [f32; MOST],
}

/// Points of the hits `at ..` whose bits are set, by their primitive numbers and the times of their rays.
#[inline(never)]
fn points(
    tables: &SceneTables,
    hits: &HitBatch,
    at: usize,
    bits: u32,
    primitives: &[u32; MOST],
    times: &[f32; MOST],
) -> Points {
    const ZERO: [f32; MOST] = [0.0; MOST];
    let mut points = Points { p: [ZERO; 3], ng: [ZERO; 3], du: [ZERO; 3], dv: [ZERO; 3], uv: [ZERO; 2], offset: ZERO };
    for (lane, &primitive) in primitives.iter().enumerate().filter(|(lane, _)| bits >> lane & 1 == 1) {
        let Some(shape) = tables.shapes.get(primitive) else { continue };
        let point = shape.point(hits.u[at + lane], hits.v[at + lane], times[lane]);
        for axis in 0..3 {
            points.p[axis][lane] = point.p[axis];
            points.ng[axis][lane] = point.ng[axis];
            points.du[axis][lane] = point.du[axis];
            points.dv[axis][lane] = point.dv[axis];
        }
        (points.uv[0][lane], points.uv[1][lane]) = (point.uv[0], point.uv[1]);
        points.offset[lane] = point.offset;
    }
    points
}

#[inline(always)]
fn load<L: Lanes>(v: &[[f32; MOST]; 3]) -> V3<L> {
    V3::new(L::F::load(&v[0], 0), L::F::load(&v[1], 0), L::F::load(&v[2], 0))
}

/// Makes the lanes of `si` that hit shapes (`primitive` of the hits `at ..` in the lanes `hit`) what is there.
#[inline(always)]
pub(super) fn put<L: Lanes>(
    tables: &SceneTables,
    hits: &HitBatch,
    at: usize,
    primitive: L::U,
    hit: L::M,
    si: &mut Interaction<L>,
) {
    let here = tables.shapes.lanes::<L>(primitive, hit);
    if !here.any() {
        return;
    }
    let (mut primitives, mut times) = ([0; MOST], [0.0; MOST]);
    primitive.store(&mut primitives, 0);
    si.time.store(&mut times, 0);
    let points = points(tables, hits, at, here.bits(), &primitives, &times);
    let (p, ng) = (load::<L>(&points.p), load::<L>(&points.ng));
    let front = si.wo.dot(ng).gt(L::F::zero());
    si.on_shape = here;
    si.triangle.ng = ng.or_else(here, si.triangle.ng);
    si.triangle.e1 = load::<L>(&points.du).or_else(here, si.triangle.e1);
    si.triangle.e2 = load::<L>(&points.dv).or_else(here, si.triangle.e2);
    si.triangle.v0 = p.or_else(here, si.triangle.v0);
    si.p = p.or_else(here, si.p);
    si.origin = p.or_else(here, si.origin);
    si.offset = L::F::load(&points.offset, 0).or_else(here, si.offset);
    si.front = (front & here) | (si.front & !here);
    si.ng = ng.or_else(front, -ng).or_else(here, si.ng);
    si.normal = ng.or_else(here, si.normal);
    si.uvs.replace(here, L::F::load(&points.uv[0], 0), L::F::load(&points.uv[1], 0));
}
