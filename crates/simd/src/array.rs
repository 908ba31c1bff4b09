//! Plain arrays as lanes: 1 lane is the readable reference, 8 lanes the portable path.

use crate::lanes::{Float, Lanes, Mask, Part, Uint};
use std::array::from_fn;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// One lane.
#[derive(Clone, Copy)]
pub struct Scalar;

impl Lanes for Scalar {
    const N: usize = 1;
    type F = F<1>;
    type U = U<1>;
    type M = M<1>;

    #[inline(never)]
    fn outline<P: Part<Self>>(part: P) -> P::Output {
        part.run()
    }
}

/// Eight lanes of plain code.
#[derive(Clone, Copy)]
pub struct Portable8;

impl Lanes for Portable8 {
    const N: usize = 8;
    type F = F<8>;
    type U = U<8>;
    type M = M<8>;

    #[inline(never)]
    fn outline<P: Part<Self>>(part: P) -> P::Output {
        part.run()
    }
}

/// Floats.
#[derive(Clone, Copy)]
pub struct F<const K: usize>([f32; K]);

/// Integers.
#[derive(Clone, Copy)]
pub struct U<const K: usize>([u32; K]);

/// Booleans: all bits or none.
#[derive(Clone, Copy)]
pub struct M<const K: usize>([u32; K]);

macro_rules! binary {
    ($ty:ident, $trait:ident, $method:ident, $f:expr) => {
        impl<const K: usize> $trait for $ty<K> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let f = $f;
                Self(from_fn(
                    #[inline(always)]
                    |i| f(self.0[i], other.0[i]),
                ))
            }
        }
    };
}
binary!(F, Add, add, |a: f32, b: f32| a + b);
binary!(F, Sub, sub, |a: f32, b: f32| a - b);
binary!(F, Mul, mul, |a: f32, b: f32| a * b);
binary!(F, Div, div, |a: f32, b: f32| a / b);
binary!(U, Add, add, u32::wrapping_add);
binary!(U, Sub, sub, u32::wrapping_sub);
binary!(U, Mul, mul, u32::wrapping_mul);
binary!(U, BitAnd, bitand, |a: u32, b: u32| a & b);
binary!(U, BitOr, bitor, |a: u32, b: u32| a | b);
binary!(U, BitXor, bitxor, |a: u32, b: u32| a ^ b);
binary!(M, BitAnd, bitand, |a: u32, b: u32| a & b);
binary!(M, BitOr, bitor, |a: u32, b: u32| a | b);

impl<const K: usize> Neg for F<K> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|v| -v))
    }
}

impl<const K: usize> Not for M<K> {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0.map(|v| !v))
    }
}

impl<const K: usize> Mask for M<K> {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self(from_fn(|i| 0u32.wrapping_sub((bits >> i) & 1)))
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        (0..K).fold(0, |bits, i| bits | ((self.0[i] & 1) << i))
    }
}

/// All bits if true.
#[inline(always)]
fn bits(b: bool) -> u32 {
    0u32.wrapping_sub(u32::from(b))
}

/// The index of element `i` in a table of `len`.
#[inline(always)]
fn clamped(i: u32, len: usize) -> usize {
    (i as usize).min(len - 1)
}

/// `keep`'s elements of `src`, packed to the front of `dst[at..at + K]`.
#[inline(always)]
fn compress<T: Copy, const K: usize>(src: [T; K], keep: M<K>, dst: &mut [T], at: usize) {
    let dst = &mut dst[at..at + K];
    let mut n = 0;
    for (value, keep) in src.into_iter().zip(keep.0) {
        dst[n] = value;
        n += (keep & 1) as usize;
        if n == K {
            break;
        }
    }
}

impl<const K: usize> Float for F<K> {
    type U = U<K>;
    type M = M<K>;

    #[inline(always)]
    fn splat(v: f32) -> Self {
        Self([v; K])
    }

    #[inline(always)]
    fn load(src: &[f32], at: usize) -> Self {
        let src = &src[at..at + K];
        Self(from_fn(|i| src[i]))
    }

    #[inline(always)]
    fn store(self, dst: &mut [f32], at: usize) {
        dst[at..at + K].copy_from_slice(&self.0);
    }

    #[inline(always)]
    fn compress(self, keep: M<K>, dst: &mut [f32], at: usize) {
        compress(self.0, keep, dst, at);
    }

    #[inline(always)]
    fn permute(self, by: U<K>) -> Self {
        Self(from_fn(|i| self.0[by.0[i] as usize % K]))
    }

    #[inline(always)]
    fn first(self) -> f32 {
        self.0[0]
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(from_fn(|i| if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(from_fn(|i| if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    #[inline(always)]
    fn floor(self) -> Self {
        Self(self.0.map(f32::floor))
    }

    #[inline(always)]
    fn lt(self, other: Self) -> M<K> {
        M(from_fn(|i| bits(self.0[i] < other.0[i])))
    }

    #[inline(always)]
    fn le(self, other: Self) -> M<K> {
        M(from_fn(|i| bits(self.0[i] <= other.0[i])))
    }

    #[inline(always)]
    fn eq(self, other: Self) -> M<K> {
        M(from_fn(|i| bits(self.0[i] == other.0[i])))
    }

    #[inline(always)]
    fn or_else(self, mask: M<K>, other: Self) -> Self {
        self.to_bits().or_else(mask, other.to_bits()).to_float_bits()
    }

    #[inline(always)]
    fn to_bits(self) -> U<K> {
        U(self.0.map(f32::to_bits))
    }

    #[inline(always)]
    fn to_uint(self) -> U<K> {
        U(self.0.map(|v| v as i32 as u32))
    }
}

impl<const K: usize> Uint for U<K> {
    type F = F<K>;
    type M = M<K>;

    #[inline(always)]
    fn splat(v: u32) -> Self {
        Self([v; K])
    }

    #[inline(always)]
    fn lane_ids() -> Self {
        Self(from_fn(|i| i as u32))
    }

    #[inline(always)]
    fn load(src: &[u32], at: usize) -> Self {
        let src = &src[at..at + K];
        Self(from_fn(|i| src[i]))
    }

    #[inline(always)]
    fn store(self, dst: &mut [u32], at: usize) {
        dst[at..at + K].copy_from_slice(&self.0);
    }

    #[inline(always)]
    fn compress(self, keep: M<K>, dst: &mut [u32], at: usize) {
        compress(self.0, keep, dst, at);
    }

    #[inline(always)]
    fn permute(self, by: Self) -> Self {
        Self(from_fn(|i| self.0[by.0[i] as usize % K]))
    }

    #[inline(always)]
    fn shl(self, by: u32) -> Self {
        Self(self.0.map(|v| v << by))
    }

    #[inline(always)]
    fn shr(self, by: u32) -> Self {
        Self(self.0.map(|v| v >> by))
    }

    #[inline(always)]
    fn shl_each(self, by: Self) -> Self {
        Self(from_fn(|i| self.0[i] << by.0[i]))
    }

    #[inline(always)]
    fn shr_each(self, by: Self) -> Self {
        Self(from_fn(|i| self.0[i] >> by.0[i]))
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(from_fn(|i| self.0[i].min(other.0[i])))
    }

    #[inline(always)]
    fn eq(self, other: Self) -> M<K> {
        M(from_fn(|i| bits(self.0[i] == other.0[i])))
    }

    #[inline(always)]
    fn lt(self, other: Self) -> M<K> {
        M(from_fn(|i| bits(self.0[i] < other.0[i])))
    }

    #[inline(always)]
    fn or_else(self, mask: M<K>, other: Self) -> Self {
        Self(from_fn(|i| (self.0[i] & mask.0[i]) | (other.0[i] & !mask.0[i])))
    }

    #[inline(always)]
    fn reverse_bits(self) -> Self {
        Self(self.0.map(u32::reverse_bits))
    }

    #[inline(always)]
    fn to_float_bits(self) -> F<K> {
        F(self.0.map(f32::from_bits))
    }

    #[inline(always)]
    fn to_float(self) -> F<K> {
        F(self.0.map(|v| v as i32 as f32))
    }

    #[inline(always)]
    fn gather(self, table: &[f32]) -> F<K> {
        F(self.0.map(|i| table[clamped(i, table.len())]))
    }

    #[inline(always)]
    fn gather_uint(self, table: &[u32]) -> Self {
        Self(self.0.map(|i| table[clamped(i, table.len())]))
    }

    #[inline(always)]
    fn records(self, table: &[[f32; 4]]) -> [F<K>; 4] {
        let rows = self.0.map(|i| table[clamped(i, table.len())]);
        from_fn(|c| F(from_fn(|i| rows[i][c])))
    }
}
