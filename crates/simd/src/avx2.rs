//! 8 lanes: AVX2 and FMA.
//!
//! SAFETY of every `unsafe` block here: the intrinsics need AVX2 and FMA. A value of these types, and so a call of these
//! methods, exists only inside `level::dispatch`, which has found the instructions on this CPU (the types are
//! private to the crate and reach kernels only as the parameter of `Kernel::run`). Memory is touched only through
//! slices whose bounds the line above the access has checked; loads and stores are unaligned ones.

use crate::lanes::{Float, Lanes, Mask, Part, Uint};
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// Eight lanes.
#[derive(Clone, Copy)]
pub struct Avx2;

/// Floats.
#[derive(Clone, Copy)]
pub struct F(__m256);

/// Integers.
#[derive(Clone, Copy)]
pub struct U(__m256i);

/// Booleans: all bits of a lane or none.
#[derive(Clone, Copy)]
pub struct M(__m256);

impl Lanes for Avx2 {
    const N: usize = 8;
    type F = F;
    type U = U;
    type M = M;

    #[inline(always)]
    fn outline<P: Part<Self>>(part: P) -> P::Output {
        // SAFETY: see the head of this file.
        unsafe { outlined(part) }
    }
}

#[inline(never)]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
fn outlined<P: Part<Avx2>>(part: P) -> P::Output {
    part.run()
}

impl Add for F {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_add_ps(self.0, other.0)) }
    }
}

impl Sub for F {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_sub_ps(self.0, other.0)) }
    }
}

impl Mul for F {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_mul_ps(self.0, other.0)) }
    }
}

impl Div for F {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_div_ps(self.0, other.0)) }
    }
}

impl Add for U {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_add_epi32(self.0, other.0)) }
    }
}

impl Sub for U {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_sub_epi32(self.0, other.0)) }
    }
}

impl Mul for U {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_mullo_epi32(self.0, other.0)) }
    }
}

impl BitAnd for U {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_and_si256(self.0, other.0)) }
    }
}

impl BitOr for U {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_or_si256(self.0, other.0)) }
    }
}

impl BitXor for U {
    type Output = Self;

    #[inline(always)]
    fn bitxor(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_xor_si256(self.0, other.0)) }
    }
}

impl Neg for F {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_xor_ps(self.0, _mm256_set1_ps(-0.0))) }
    }
}

impl BitAnd for M {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_and_ps(self.0, other.0)) }
    }
}

impl BitOr for M {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_or_ps(self.0, other.0)) }
    }
}

impl Not for M {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_xor_ps(self.0, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))) }
    }
}

impl Mask for M {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        // SAFETY: see the head of this file.
        unsafe {
            let lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits as i32), lane);
            Self(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lane)))
        }
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: see the head of this file.
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
}

/// For each of the 256 masks the lanes that are set, packed to the front.
static PACK: [[u32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut m = 0;
    while m < 256 {
        let (mut n, mut i) = (0, 0);
        while i < 8 {
            if m >> i & 1 == 1 {
                table[m][n] = i as u32;
                n += 1;
            }
            i += 1;
        }
        m += 1;
    }
    table
};

/// The lane order that packs `keep` to the front.
#[inline(always)]
fn packing(keep: M) -> __m256i {
    let order = &PACK[keep.bits() as usize & 255];
    // SAFETY: see the head of this file; `order` is 32 bytes.
    unsafe { _mm256_loadu_si256(order.as_ptr().cast()) }
}

impl Float for F {
    type U = U;
    type M = M;

    #[inline(always)]
    fn splat(v: f32) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_set1_ps(v)) }
    }

    #[inline(always)]
    fn load(src: &[f32], at: usize) -> Self {
        let src = &src[at..at + 8];
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_loadu_ps(src.as_ptr())) }
    }

    #[inline(always)]
    fn store(self, dst: &mut [f32], at: usize) {
        let dst = &mut dst[at..at + 8];
        // SAFETY: see the head of this file.
        unsafe { _mm256_storeu_ps(dst.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn compress(self, keep: M, dst: &mut [f32], at: usize) {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_permutevar8x32_ps(self.0, packing(keep))) }.store(dst, at);
    }

    #[inline(always)]
    fn permute(self, by: U) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_permutevar8x32_ps(self.0, by.0)) }
    }

    #[inline(always)]
    fn first(self) -> f32 {
        // SAFETY: see the head of this file.
        unsafe { _mm256_cvtss_f32(self.0) }
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_fmadd_ps(self.0, b.0, c.0)) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_min_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_max_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_sqrt_ps(self.0)) }
    }

    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_floor_ps(self.0)) }
    }

    #[inline(always)]
    fn lt(self, other: Self) -> M {
        // SAFETY: see the head of this file.
        unsafe { M(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn le(self, other: Self) -> M {
        // SAFETY: see the head of this file.
        unsafe { M(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn eq(self, other: Self) -> M {
        // SAFETY: see the head of this file.
        unsafe { M(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn or_else(self, mask: M, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_blendv_ps(other.0, self.0, mask.0)) }
    }

    #[inline(always)]
    fn to_bits(self) -> U {
        // SAFETY: see the head of this file.
        unsafe { U(_mm256_castps_si256(self.0)) }
    }

    #[inline(always)]
    fn to_uint(self) -> U {
        // SAFETY: see the head of this file.
        unsafe { U(_mm256_cvttps_epi32(self.0)) }
    }
}

impl Uint for U {
    type F = F;
    type M = M;

    #[inline(always)]
    fn splat(v: u32) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_set1_epi32(v as i32)) }
    }

    #[inline(always)]
    fn lane_ids() -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)) }
    }

    #[inline(always)]
    fn load(src: &[u32], at: usize) -> Self {
        let src = &src[at..at + 8];
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_loadu_si256(src.as_ptr().cast())) }
    }

    #[inline(always)]
    fn store(self, dst: &mut [u32], at: usize) {
        let dst = &mut dst[at..at + 8];
        // SAFETY: see the head of this file.
        unsafe { _mm256_storeu_si256(dst.as_mut_ptr().cast(), self.0) }
    }

    #[inline(always)]
    fn compress(self, keep: M, dst: &mut [u32], at: usize) {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_permutevar8x32_epi32(self.0, packing(keep))) }.store(dst, at);
    }

    #[inline(always)]
    fn permute(self, by: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_permutevar8x32_epi32(self.0, by.0)) }
    }

    #[inline(always)]
    fn shl(self, by: u32) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_sll_epi32(self.0, _mm_cvtsi32_si128(by as i32))) }
    }

    #[inline(always)]
    fn shr(self, by: u32) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_srl_epi32(self.0, _mm_cvtsi32_si128(by as i32))) }
    }

    #[inline(always)]
    fn shl_each(self, by: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_sllv_epi32(self.0, by.0)) }
    }

    #[inline(always)]
    fn shr_each(self, by: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_srlv_epi32(self.0, by.0)) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_min_epu32(self.0, other.0)) }
    }

    #[inline(always)]
    fn eq(self, other: Self) -> M {
        // SAFETY: see the head of this file.
        unsafe { M(_mm256_castsi256_ps(_mm256_cmpeq_epi32(self.0, other.0))) }
    }

    #[inline(always)]
    fn lt(self, other: Self) -> M {
        // SAFETY: see the head of this file. AVX2 compares signed only: flip the top bits.
        unsafe {
            let top = _mm256_set1_epi32(i32::MIN);
            let (a, b) = (_mm256_xor_si256(self.0, top), _mm256_xor_si256(other.0, top));
            M(_mm256_castsi256_ps(_mm256_cmpgt_epi32(b, a)))
        }
    }

    #[inline(always)]
    fn or_else(self, mask: M, other: Self) -> Self {
        self.to_float_bits().or_else(mask, other.to_float_bits()).to_bits()
    }

    #[inline(always)]
    fn reverse_bits(self) -> Self {
        // SAFETY: see the head of this file. Nibbles by table, then bytes by a shuffle.
        unsafe {
            let rev = _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15));
            let swap = _mm256_broadcastsi128_si256(_mm_setr_epi8(3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12));
            let nibble = _mm256_set1_epi8(15);
            let low = _mm256_shuffle_epi8(rev, _mm256_and_si256(self.0, nibble));
            let high = _mm256_shuffle_epi8(rev, _mm256_and_si256(_mm256_srli_epi32::<4>(self.0), nibble));
            Self(_mm256_shuffle_epi8(_mm256_or_si256(_mm256_slli_epi32::<4>(low), high), swap))
        }
    }

    #[inline(always)]
    fn to_float_bits(self) -> F {
        // SAFETY: see the head of this file.
        unsafe { F(_mm256_castsi256_ps(self.0)) }
    }

    #[inline(always)]
    fn to_float(self) -> F {
        // SAFETY: see the head of this file.
        unsafe { F(_mm256_cvtepi32_ps(self.0)) }
    }

    #[inline(always)]
    fn gather(self, table: &[f32]) -> F {
        let i = self.clamped(table.len());
        // SAFETY: see the head of this file; `clamped` keeps every index inside the table.
        unsafe { F(_mm256_i32gather_ps::<4>(table.as_ptr(), i.0)) }
    }

    #[inline(always)]
    fn gather_uint(self, table: &[u32]) -> Self {
        let i = self.clamped(table.len());
        // SAFETY: see the head of this file; `clamped` keeps every index inside the table.
        unsafe { Self(_mm256_i32gather_epi32::<4>(table.as_ptr().cast(), i.0)) }
    }

    #[inline(always)]
    fn records(self, table: &[[f32; 4]]) -> [F; 4] {
        let mut i = [0; 8];
        self.clamped(table.len()).store(&mut i, 0);
        // SAFETY: see the head of this file; `clamped` keeps every index inside the table.
        unsafe {
            let (a, b, c, d) = (pair(table, &i, 0), pair(table, &i, 1), pair(table, &i, 2), pair(table, &i, 3));
            let (ab_lo, ab_hi) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
            let (cd_lo, cd_hi) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
            [
                F(_mm256_shuffle_ps::<0x44>(ab_lo, cd_lo)),
                F(_mm256_shuffle_ps::<0xee>(ab_lo, cd_lo)),
                F(_mm256_shuffle_ps::<0x44>(ab_hi, cd_hi)),
                F(_mm256_shuffle_ps::<0xee>(ab_hi, cd_hi)),
            ]
        }
    }
}

impl U {
    /// Indices into a table of `len` elements. Gathers take signed 32-bit indices, so longer tables are refused.
    #[inline(always)]
    fn clamped(self, len: usize) -> Self {
        assert!(len > 0 && len <= i32::MAX as usize, "a table of 1 to 2^31 - 1 elements");
        self.min(Self::splat(len as u32 - 1))
    }
}

/// Row `i[k]` and row `i[k + 4]` side by side, so that 4x4 transposes inside 128 bits leave the lanes in order.
///
/// # Safety
/// AVX2, and every `i` below `table.len()`.
#[inline(always)]
unsafe fn pair(table: &[[f32; 4]], i: &[u32; 8], k: usize) -> __m256 {
    // SAFETY: the caller vouches for the indices and the instructions.
    unsafe {
        let low = _mm_loadu_ps(table.as_ptr().add(i[k] as usize).cast());
        let high = _mm_loadu_ps(table.as_ptr().add(i[k + 4] as usize).cast());
        _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(low), high)
    }
}
