//! 16 lanes: AVX-512.
//!
//! SAFETY of every `unsafe` block here: the intrinsics need AVX-512 F, BW, DQ and VL. A value of these types, and so a call of these
//! methods, exists only inside `level::dispatch`, which has found the instructions on this CPU (the types are
//! private to the crate and reach kernels only as the parameter of `Kernel::run`). Memory is touched only through
//! slices whose bounds the line above the access has checked; loads and stores are unaligned ones.

use crate::lanes::{Float, Lanes, Mask, Part, Uint};
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// Sixteen lanes.
#[derive(Clone, Copy)]
pub struct Avx512;

/// Floats.
#[derive(Clone, Copy)]
pub struct F(__m512);

/// Integers.
#[derive(Clone, Copy)]
pub struct U(__m512i);

/// Booleans, a bit a lane.
#[derive(Clone, Copy)]
pub struct M(__mmask16);

impl Lanes for Avx512 {
    const N: usize = 16;
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
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
fn outlined<P: Part<Avx512>>(part: P) -> P::Output {
    part.run()
}

impl Add for F {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_add_ps(self.0, other.0)) }
    }
}

impl Sub for F {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_sub_ps(self.0, other.0)) }
    }
}

impl Mul for F {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_mul_ps(self.0, other.0)) }
    }
}

impl Div for F {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_div_ps(self.0, other.0)) }
    }
}

impl Add for U {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_add_epi32(self.0, other.0)) }
    }
}

impl Sub for U {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_sub_epi32(self.0, other.0)) }
    }
}

impl Mul for U {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_mullo_epi32(self.0, other.0)) }
    }
}

impl BitAnd for U {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_and_si512(self.0, other.0)) }
    }
}

impl BitOr for U {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_or_si512(self.0, other.0)) }
    }
}

impl BitXor for U {
    type Output = Self;

    #[inline(always)]
    fn bitxor(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_xor_si512(self.0, other.0)) }
    }
}

impl Neg for F {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_xor_ps(self.0, _mm512_set1_ps(-0.0))) }
    }
}

impl BitAnd for M {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for M {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for M {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Mask for M {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self(bits as u16)
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
}

impl Float for F {
    type U = U;
    type M = M;

    #[inline(always)]
    fn splat(v: f32) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_set1_ps(v)) }
    }

    #[inline(always)]
    fn load(src: &[f32], at: usize) -> Self {
        let src = &src[at..at + 16];
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_loadu_ps(src.as_ptr())) }
    }

    #[inline(always)]
    fn store(self, dst: &mut [f32], at: usize) {
        let dst = &mut dst[at..at + 16];
        // SAFETY: see the head of this file.
        unsafe { _mm512_storeu_ps(dst.as_mut_ptr(), self.0) }
    }

    // Compressing in the register and storing it whole: `compressstore` to memory is microcoded on Zen.
    #[inline(always)]
    fn compress(self, keep: M, dst: &mut [f32], at: usize) {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_maskz_compress_ps(keep.0, self.0)) }.store(dst, at);
    }

    #[inline(always)]
    fn permute(self, by: U) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_permutexvar_ps(by.0, self.0)) }
    }

    #[inline(always)]
    fn first(self) -> f32 {
        // SAFETY: see the head of this file.
        unsafe { _mm512_cvtss_f32(self.0) }
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_fmadd_ps(self.0, b.0, c.0)) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_min_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_max_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_sqrt_ps(self.0)) }
    }

    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0)) }
    }

    #[inline(always)]
    fn lt(self, other: Self) -> M {
        // SAFETY: see the head of this file.
        unsafe { M(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn le(self, other: Self) -> M {
        // SAFETY: see the head of this file.
        unsafe { M(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn eq(self, other: Self) -> M {
        // SAFETY: see the head of this file.
        unsafe { M(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn or_else(self, mask: M, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_mask_blend_ps(mask.0, other.0, self.0)) }
    }

    #[inline(always)]
    fn to_bits(self) -> U {
        // SAFETY: see the head of this file.
        unsafe { U(_mm512_castps_si512(self.0)) }
    }

    #[inline(always)]
    fn to_uint(self) -> U {
        // SAFETY: see the head of this file.
        unsafe { U(_mm512_cvttps_epi32(self.0)) }
    }
}

impl Uint for U {
    type F = F;
    type M = M;

    #[inline(always)]
    fn splat(v: u32) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_set1_epi32(v as i32)) }
    }

    #[inline(always)]
    fn lane_ids() -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)) }
    }

    #[inline(always)]
    fn load(src: &[u32], at: usize) -> Self {
        let src = &src[at..at + 16];
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_loadu_si512(src.as_ptr().cast())) }
    }

    #[inline(always)]
    fn store(self, dst: &mut [u32], at: usize) {
        let dst = &mut dst[at..at + 16];
        // SAFETY: see the head of this file.
        unsafe { _mm512_storeu_si512(dst.as_mut_ptr().cast(), self.0) }
    }

    #[inline(always)]
    fn compress(self, keep: M, dst: &mut [u32], at: usize) {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_maskz_compress_epi32(keep.0, self.0)) }.store(dst, at);
    }

    #[inline(always)]
    fn permute(self, by: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_permutexvar_epi32(by.0, self.0)) }
    }

    #[inline(always)]
    fn shl(self, by: u32) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_sll_epi32(self.0, _mm_cvtsi32_si128(by as i32))) }
    }

    #[inline(always)]
    fn shr(self, by: u32) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_srl_epi32(self.0, _mm_cvtsi32_si128(by as i32))) }
    }

    #[inline(always)]
    fn shl_each(self, by: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_sllv_epi32(self.0, by.0)) }
    }

    #[inline(always)]
    fn shr_each(self, by: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_srlv_epi32(self.0, by.0)) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_min_epu32(self.0, other.0)) }
    }

    #[inline(always)]
    fn eq(self, other: Self) -> M {
        // SAFETY: see the head of this file.
        unsafe { M(_mm512_cmpeq_epu32_mask(self.0, other.0)) }
    }

    #[inline(always)]
    fn lt(self, other: Self) -> M {
        // SAFETY: see the head of this file.
        unsafe { M(_mm512_cmplt_epu32_mask(self.0, other.0)) }
    }

    #[inline(always)]
    fn or_else(self, mask: M, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Self(_mm512_mask_blend_epi32(mask.0, other.0, self.0)) }
    }

    #[inline(always)]
    fn reverse_bits(self) -> Self {
        // SAFETY: see the head of this file. Nibbles by table, then bytes by a shuffle.
        unsafe {
            let rev = _mm512_broadcast_i32x4(_mm_setr_epi8(0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15));
            let swap = _mm512_broadcast_i32x4(_mm_setr_epi8(3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12));
            let nibble = _mm512_set1_epi8(15);
            let low = _mm512_shuffle_epi8(rev, _mm512_and_si512(self.0, nibble));
            let high = _mm512_shuffle_epi8(rev, _mm512_and_si512(_mm512_srli_epi32::<4>(self.0), nibble));
            Self(_mm512_shuffle_epi8(_mm512_or_si512(_mm512_slli_epi32::<4>(low), high), swap))
        }
    }

    #[inline(always)]
    fn to_float_bits(self) -> F {
        // SAFETY: see the head of this file.
        unsafe { F(_mm512_castsi512_ps(self.0)) }
    }

    #[inline(always)]
    fn to_float(self) -> F {
        // SAFETY: see the head of this file.
        unsafe { F(_mm512_cvtepi32_ps(self.0)) }
    }

    #[inline(always)]
    fn gather(self, table: &[f32]) -> F {
        let i = self.clamped(table.len());
        // SAFETY: see the head of this file; `clamped` keeps every index inside the table.
        unsafe { F(_mm512_i32gather_ps::<4>(i.0, table.as_ptr().cast())) }
    }

    #[inline(always)]
    fn gather_uint(self, table: &[u32]) -> Self {
        let i = self.clamped(table.len());
        // SAFETY: see the head of this file; `clamped` keeps every index inside the table.
        unsafe { Self(_mm512_i32gather_epi32::<4>(i.0, table.as_ptr().cast())) }
    }

    #[inline(always)]
    fn records(self, table: &[[f32; 4]]) -> [F; 4] {
        let mut i = [0; 16];
        self.clamped(table.len()).store(&mut i, 0);
        // SAFETY: see the head of this file; `clamped` keeps every index inside the table.
        unsafe {
            let (a, b, c, d) = (four(table, &i, 0), four(table, &i, 1), four(table, &i, 2), four(table, &i, 3));
            let (ab_lo, ab_hi) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
            let (cd_lo, cd_hi) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
            [
                F(_mm512_shuffle_ps::<0x44>(ab_lo, cd_lo)),
                F(_mm512_shuffle_ps::<0xee>(ab_lo, cd_lo)),
                F(_mm512_shuffle_ps::<0x44>(ab_hi, cd_hi)),
                F(_mm512_shuffle_ps::<0xee>(ab_hi, cd_hi)),
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

/// Rows `i[k]`, `i[k + 4]`, `i[k + 8]`, `i[k + 12]` side by side, so that 4x4 transposes inside 128 bits leave the lanes
/// in order.
///
/// # Safety
/// AVX-512 F and DQ, and every `i` below `table.len()`.
#[inline(always)]
unsafe fn four(table: &[[f32; 4]], i: &[u32; 16], k: usize) -> __m512 {
    // SAFETY: the caller vouches for the indices and the instructions.
    unsafe {
        let rows = table.as_ptr().cast::<f32>();
        let v = _mm512_castps128_ps512(_mm_loadu_ps(rows.add(4 * i[k] as usize)));
        let v = _mm512_insertf32x4::<1>(v, _mm_loadu_ps(rows.add(4 * i[k + 4] as usize)));
        let v = _mm512_insertf32x4::<2>(v, _mm_loadu_ps(rows.add(4 * i[k + 8] as usize)));
        _mm512_insertf32x4::<3>(v, _mm_loadu_ps(rows.add(4 * i[k + 12] as usize)))
    }
}
