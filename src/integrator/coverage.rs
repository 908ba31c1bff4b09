//! Surfaces that are not all there (alpha MASK and BLEND): which crossings of a ray with them are hits.
//!
//! The ray kernels ask, at every crossing that would be the nearest so far. Whether a ray is stopped is a function of
//! (seed, frame, pixel, sample, bounce, instance, primitive) and of the place on the primitive, so every backend, order
//! of crossings and number of threads decides the same.

use super::SceneTables;
use crate::accel::geometry::{Candidate, HitFilter};
use crate::math::UvSets;
use crate::sampler::coverage_number;
use crate::shape::exact::table::texture_coordinates;
use crate::shape::table::NONE;
use simd::{Float, Kernel, Lanes, Mask, Uint, dispatch_one};
use std::sync::Arc;

/// The filter of a scene. Rays are known to it by their [`coverage_key`](crate::sampler::coverage_key).
pub struct Coverage(Arc<SceneTables>);

impl Coverage {
    /// Of the scene of `tables`, whose triangles are all that it is asked about.
    pub fn new(tables: Arc<SceneTables>) -> Self {
        Self(tables)
    }
}

impl HitFilter for Coverage {
    fn stops(&self, candidate: &Candidate) -> bool {
        // One lane whatever shades, so that decisions do not depend on the lanes.
        dispatch_one(Stops { tables: &self.0, candidate })
    }
}

struct Stops<'a> {
    tables: &'a SceneTables,
    candidate: &'a Candidate,
}

impl Kernel for Stops<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let (tables, &Candidate { key, instance, primitive, u, v }) = (self.tables, self.candidate);
        let primitive = L::U::splat(primitive);
        let triangle = tables.triangles.get::<L>(primitive);
        let (mut uvs, mut vertex_opacity) = (UvSets::single(L::F::zero(), L::F::zero()), L::F::one());
        if !triangle.attributes.eq(L::U::splat(NONE)).any() {
            let a = tables.triangles.attributes::<L>(triangle.attributes, L::F::splat(u), L::F::splat(v));
            (uvs, vertex_opacity) = (a.uvs, a.opacity);
        }
        let mut which = primitive;
        if tables.shapes.get(self.candidate.primitive).is_some() {
            // A ray may cross a shape several times, each time by another chance: what tells its crossings apart is where
            // they are, and that has the same bits whoever asks.
            which = L::U::splat(self.candidate.primitive ^ u.to_bits().wrapping_mul(0x9e37_79b9) ^ v.to_bits());
            let [u, v] = texture_coordinates(u, v);
            uvs = UvSets::single(L::F::splat(u), L::F::splat(v));
        }
        let all = L::M::first(L::N);
        let coverage = tables.materials.coverage::<L>(&tables.textures, triangle.material, &uvs, vertex_opacity, all);
        !coverage.le(coverage_number::<L>(L::U::splat(key), L::U::splat(instance), which)).any()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::coverage_key;

    struct Number(u32, u32, u32);

    impl Kernel for Number {
        type Output = f32;

        #[inline(always)]
        fn run<L: Lanes>(self) -> f32 {
            let mut out = [0.0; 16];
            let [key, instance, primitive] = [self.0, self.1, self.2].map(L::U::splat);
            coverage_number::<L>(key, instance, primitive).store(&mut out, 0);
            out[0]
        }
    }

    struct RayKey(u32, u32, u32);

    impl Kernel for RayKey {
        type Output = u32;

        #[inline(always)]
        fn run<L: Lanes>(self) -> u32 {
            let mut out = [0; 16];
            let [pixel, sample, bounce] = [self.0, self.1, self.2].map(L::U::splat);
            coverage_key::<L>(pixel, sample, bounce).store(&mut out, 0);
            out[0]
        }
    }

    #[test]
    fn decisions_in_the_world_are_those_of_pictures_made_before_there_were_instances() {
        // lowbias32, written down again.
        let mix = |mut x: u32| {
            x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
            x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
            x ^ (x >> 16)
        };
        for i in 0..1000_u32 {
            let (pixel, primitive) = (mix(i), mix(i + 5000) >> (i % 32));
            let key = mix(pixel.wrapping_add(mix(i ^ (i % 7) << 20 ^ 0x1b56_c4e9)));
            assert_eq!(dispatch_one(RayKey(pixel, i, i % 7)), key);
            let number = mix(key ^ mix(primitive.wrapping_add(0x632b_e5ab)));
            assert_eq!(dispatch_one(Number(key, 0, primitive)), (number >> 8) as f32 / 16_777_216.0);
        }
    }

    #[test]
    fn instances_decide_by_themselves() {
        // Of 10,000 rays half stop at each of two instances, and a quarter at both: 5 sigma are 2.5 % and 2.2 %.
        for (a, b) in [(0, 1), (1, 2), (7, 1_000_007)] {
            let stops = |key: u32, instance| dispatch_one(Number(key, instance, 3)) < 0.5;
            let both: Vec<[bool; 2]> = (0..10_000).map(|key| [stops(key, a), stops(key, b)]).collect();
            let share = |f: fn(&[bool; 2]) -> bool| both.iter().filter(|x| f(x)).count() as f64 / 10_000.0;
            assert!((share(|x| x[0]) - 0.5).abs() < 0.025 && (share(|x| x[1]) - 0.5).abs() < 0.025, "{a} {b}");
            assert!((share(|x| x[0] && x[1]) - 0.25).abs() < 0.022, "{a} {b}: {}", share(|x| x[0] && x[1]));
        }
    }
}
