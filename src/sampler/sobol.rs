//! Owen-scrambled, shuffled Sobol points in groups of four dimensions.
//!
//! After Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4), with the better mixing Laine-Karras style hash
//! found by Vegdahl 2021. The index is shuffled per group, so groups are padded, not one high-dimensional sequence.
//!
//! Points are made bit-reversed (the matrices hold reversed columns): the hash wants reversed bits, so one reversal a
//! dimension remains.

use super::{hash::mix, to_unit};
use simd::{Lanes, Uint};

/// Bits of the sample index that one sequence uses; later samples go on in an independently scrambled one.
pub const INDEX_BITS: u32 = 20;

/// Columns of the generator matrices of dimensions 1..=3 (dimension 0 is the bit reversal), bits reversed.
/// Primitive polynomials and initial numbers of Joe and Kuo 2008, `new-joe-kuo-6.21201`, lines d = 2, 3, 4.
const COLUMNS: [[u32; INDEX_BITS as usize]; 3] =
    [columns(1, 0, [1, 0, 0]), columns(2, 1, [1, 3, 0]), columns(3, 1, [1, 3, 1])];

/// Direction numbers for a primitive polynomial of degree `s` with inner coefficients `a` and initial odd numbers `m`.
const fn columns(s: usize, a: u32, m: [u32; 3]) -> [u32; INDEX_BITS as usize] {
    let mut v = [0u32; INDEX_BITS as usize];
    let mut i = 0;
    while i < v.len() {
        if i < s {
            v[i] = m[i] << (31 - i);
        } else {
            let mut x = v[i - s] ^ (v[i - s] >> s);
            let mut k = 1;
            while k < s {
                x ^= ((a >> (s - 1 - k)) & 1) * v[i - k];
                k += 1;
            }
            v[i] = x;
        }
        i += 1;
    }
    let mut i = 0;
    while i < v.len() {
        v[i] = v[i].reverse_bits();
        i += 1;
    }
    v
}

/// Owen scrambling of bit-reversed numbers: each bit is flipped by a hash of the bits below it (above it, unreversed).
#[inline(always)]
fn owen_reversed<L: Lanes>(x: L::U, seed: L::U) -> L::U {
    let x = x ^ (x * L::U::splat(0x3d20_adea));
    let x = x + seed;
    let x = x * (seed.shr(16) | L::U::splat(1));
    let x = x ^ (x * L::U::splat(0x0552_6c56));
    x ^ (x * L::U::splat(0x53a2_2864))
}

/// Four coordinates in [0, 1) of point `index` for (`pixel`, `group`).
#[inline(always)]
pub fn sobol_4d<L: Lanes>(pixel: L::U, index: L::U, group: L::U) -> [L::F; 4] {
    // Samples past 2^20 start a sequence of their own.
    let epoch = index.shr(INDEX_BITS);
    let seed = mix::<L>(pixel ^ ((group + epoch.shl(16)) * L::U::splat(0x9e37_79b9)));
    let low = L::U::splat((1 << INDEX_BITS) - 1);
    let shuffled =
        owen_reversed::<L>(index.reverse_bits(), mix::<L>(seed ^ L::U::splat(0x1157_0ab3))).reverse_bits() & low;

    let zero = L::U::splat(0);
    let (mut x1, mut x2, mut x3) = (zero, zero, zero);
    for bit in 0..INDEX_BITS {
        let set = shuffled.has(1 << bit);
        x1 = x1 ^ L::U::splat(COLUMNS[0][bit as usize]).or_else(set, zero);
        x2 = x2 ^ L::U::splat(COLUMNS[1][bit as usize]).or_else(set, zero);
        x3 = x3 ^ L::U::splat(COLUMNS[2][bit as usize]).or_else(set, zero);
    }
    // A seed per dimension: one for all would correlate them.
    [
        finish::<L>(shuffled, seed + L::U::splat(0x0000_0001)),
        finish::<L>(x1, seed + L::U::splat(0x5851_f42d)),
        finish::<L>(x2, seed + L::U::splat(0x4c95_7f2d)),
        finish::<L>(x3, seed + L::U::splat(0x1405_7b7e)),
    ]
}

/// A bit-reversed coordinate, scrambled, as a number in [0, 1).
#[inline(always)]
fn finish<L: Lanes>(reversed: L::U, seed: L::U) -> L::F {
    to_unit::<L>(owen_reversed::<L>(reversed, mix::<L>(seed)).reverse_bits())
}

#[cfg(test)]
mod tests {
    use super::*;
    use simd::{Float, Kernel, Level, dispatch};

    struct Points {
        pixel: u32,
        group: u32,
        count: u32,
    }

    impl Kernel for Points {
        type Output = Vec<[f32; 4]>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<[f32; 4]> {
            let mut points = Vec::new();
            for at in (0..self.count).step_by(L::N) {
                let index = L::U::splat(at) + L::U::lane_ids();
                let p = sobol_4d::<L>(L::U::splat(self.pixel), index, L::U::splat(self.group));
                let mut out = [[0.0; 16]; 4];
                for d in 0..4 {
                    p[d].store(&mut out[d], 0);
                }
                points.extend((0..L::N).map(|i| [0, 1, 2, 3].map(|d| out[d][i])));
            }
            points
        }
    }

    #[test]
    fn smp_01_dimensions_0_and_1_are_a_net_and_each_dimension_is_stratified() {
        for (pixel, group) in [(0, 0), (1234, 3), (u32::MAX, 11)] {
            for log2 in [2u32, 4, 6, 8, 10] {
                let n = 1u32 << log2;
                let points = dispatch(Level::Scalar, Points { pixel, group, count: n });
                for a in 0..=log2 {
                    let (nx, ny) = (1u32 << a, 1u32 << (log2 - a));
                    let mut seen = vec![false; n as usize];
                    for p in &points {
                        let cell = (p[0] * nx as f32) as u32 + nx * (p[1] * ny as f32) as u32;
                        assert!(!std::mem::replace(&mut seen[cell as usize], true), "two points in one cell");
                    }
                }
                for d in 0..4 {
                    let mut cells: Vec<u32> = points.iter().map(|p| (p[d] * n as f32) as u32).collect();
                    cells.sort_unstable();
                    assert!(cells.iter().enumerate().all(|(i, &c)| c == i as u32), "dimension {d}, {n} points");
                }
            }
        }
    }

    #[test]
    fn smp_02_points_are_the_same_bits_at_every_level() {
        let reference = dispatch(Level::Scalar, Points { pixel: 77, group: 5, count: 1024 });
        for level in [Level::Portable8, Level::Avx2, Level::Avx512] {
            if level.is_available() {
                assert!(reference == dispatch(level, Points { pixel: 77, group: 5, count: 1024 }), "{level:?}");
            }
        }
    }

    #[test]
    fn smp_03_groups_and_pixels_are_uncorrelated() {
        // 2^14 points; |r| < 4 / sqrt(n) = 0.031 fails by chance once in 16,000 pairs; 12 x 4 pairs here.
        let n = 1 << 14;
        let base = dispatch(Level::best(), Points { pixel: 5, group: 2, count: n });
        for (pixel, group) in (3..11).map(|g| (5, g)).chain((6..10).map(|p| (p, 2))) {
            let other = dispatch(Level::best(), Points { pixel, group, count: n });
            for d in 0..4 {
                let r = 12.0
                    * base.iter().zip(&other).map(|(a, b)| f64::from((a[d] - 0.5) * (b[d] - 0.5))).sum::<f64>()
                    / f64::from(n);
                assert!(r.abs() < 4.0 / f64::from(n).sqrt(), "pixel {pixel} group {group} dimension {d}: r = {r}");
            }
        }
    }
}
