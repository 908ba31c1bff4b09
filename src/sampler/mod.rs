//! Random numbers as a pure function of (seed, frame, pixel, sample, dimension): no generator state.
//!
//! Dimensions are addressed by name ([`dims`]), never consumed in order, so a skipped feature changes no other sample.
//! The first vertices of a path take Owen-scrambled Sobol points (`sobol`), the rest a counter hash.

pub mod dims;
mod hash;
mod sobol;

pub use hash::{mix, pixel_seed};
pub use sobol::{INDEX_BITS, sobol_4d};

use simd::{Float, Lanes, Uint};

/// What the numbers of one path depend on, per lane.
#[derive(Clone, Copy)]
pub struct Key<L: Lanes> {
    /// From [`pixel_seed`]: seed, frame and pixel.
    pub pixel: L::U,
    /// Index of the sample in its pixel.
    pub sample: L::U,
}

impl<L: Lanes> Key<L> {
    /// Four numbers in [0, 1) for a group of dimensions; groups at and past [`dims::SOBOL_GROUPS`] are hashed.
    #[inline(always)]
    pub fn group(&self, group: L::U) -> [L::F; 4] {
        use simd::Mask;
        let stratified = group.lt(L::U::splat(dims::SOBOL_GROUPS));
        let points = sobol_4d::<L>(self.pixel, self.sample, group);
        if (!stratified).bits() & (u32::MAX >> (32 - L::N)) == 0 {
            return points;
        }
        let hashed = self.hashed(group);
        [
            points[0].or_else(stratified, hashed[0]),
            points[1].or_else(stratified, hashed[1]),
            points[2].or_else(stratified, hashed[2]),
            points[3].or_else(stratified, hashed[3]),
        ]
    }

    /// Four independent numbers in [0, 1).
    #[inline(always)]
    fn hashed(&self, group: L::U) -> [L::F; 4] {
        let base = mix::<L>(self.pixel + mix::<L>(self.sample ^ group.shl(20) ^ L::U::splat(0x68e3_1da4)) + group);
        [
            to_unit::<L>(mix::<L>(base)),
            to_unit::<L>(mix::<L>(base + L::U::splat(0x9e37_79b9))),
            to_unit::<L>(mix::<L>(base + L::U::splat(0x3c6e_f372))),
            to_unit::<L>(mix::<L>(base + L::U::splat(0xdaa6_6d2b))),
        ]
    }
}

/// What decides, with instance and primitive, whether a ray after `bounce` scatterings passes through a surface that is
/// partly there: a function of names alone, so that every backend and every order of hits decides the same.
#[inline(always)]
pub fn coverage_key<L: Lanes>(pixel: L::U, sample: L::U, bounce: L::U) -> L::U {
    mix::<L>(pixel + mix::<L>(sample ^ bounce.shl(20) ^ L::U::splat(0x1b56_c4e9)))
}

/// A number in [0, 1) for a [`coverage_key`] and a primitive of an instance; a ray passes where the coverage is not above
/// it.
#[inline(always)]
pub fn coverage_number<L: Lanes>(key: L::U, instance: L::U, primitive: L::U) -> L::F {
    // Each instance is as another ray to its primitives; `mix` of 0, the world, is 0.
    let key = key ^ mix::<L>(instance);
    to_unit::<L>(mix::<L>(key ^ mix::<L>(primitive + L::U::splat(0x632b_e5ab))))
}

/// The top 24 bits as a number in [0, 1): rounding can never give 1.
#[inline(always)]
pub(crate) fn to_unit<L: Lanes>(bits: L::U) -> L::F {
    bits.shr(8).to_float() * L::F::splat(1.0 / 16_777_216.0)
}
