//! Integer hashing. `mix` is Chris Wellons' lowbias32 (public domain constants, 2018): bias 0.17 of an ideal 32-bit hash.

use simd::{Lanes, Uint};

/// A well mixed permutation of 32 bits.
#[inline(always)]
pub fn mix<L: Lanes>(x: L::U) -> L::U {
    let x = (x ^ x.shr(16)) * L::U::splat(0x7feb_352d);
    let x = (x ^ x.shr(15)) * L::U::splat(0x846c_a68b);
    x ^ x.shr(16)
}

/// [`mix`] of one number.
fn mix1(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The key of a pixel (of the whole picture, whatever window is rendered) in a frame under a seed.
pub fn pixel_seed(seed: u64, frame: u32, x: u32, y: u32) -> u32 {
    let s = mix1(seed as u32 ^ mix1((seed >> 32) as u32 ^ mix1(frame ^ 0x5bd1_e995)));
    mix1(mix1(x ^ s).wrapping_add(mix1(y ^ 0x2545_f491 ^ s.rotate_left(16))))
}
