//! The traits that kernels are written against.

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// A lane count with its vector types.
pub trait Lanes: Copy + Send + Sync + 'static {
    /// Lanes: 1, 8 or 16.
    const N: usize;
    /// N floats.
    type F: Float<U = Self::U, M = Self::M>;
    /// N unsigned integers.
    type U: Uint<F = Self::F, M = Self::M>;
    /// N booleans.
    type M: Mask;

    /// Runs `part` as a function of its own, compiled for the same level: large kernels take the compiler less when cut
    /// into parts, and a part that is called twice is there once.
    ///
    /// The shading kernel in one piece took LLVM 100 to 145 s at each level; in parts the library builds in a third of the
    /// time and pictures take 1 to 2 % longer.
    fn outline<P: Part<Self>>(part: P) -> P::Output;
}

/// A part of a kernel, see [`Lanes::outline`].
pub trait Part<L: Lanes> {
    /// What it returns.
    type Output;
    /// The part; `#[inline(always)]`, as all it calls.
    fn run(self) -> Self::Output;
}

/// N booleans.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// Lane i from bit i; higher bits are ignored.
    fn from_bits(bits: u32) -> Self;
    /// Bit i from lane i; the others 0.
    fn bits(self) -> u32;

    /// True in the first `n` lanes.
    #[inline(always)]
    fn first(n: usize) -> Self {
        Self::from_bits(if n >= 32 { u32::MAX } else { (1u32 << n) - 1 })
    }

    /// Any lane true.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }

    /// Lanes that are true.
    #[inline(always)]
    fn count(self) -> usize {
        self.bits().count_ones() as usize
    }
}

/// N f32. Comparisons are false for NaN; `min` and `max` return the second operand if either is NaN.
pub trait Float:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// The matching integers.
    type U: Uint<F = Self, M = Self::M>;
    /// The matching mask.
    type M: Mask;

    /// The same value in every lane.
    fn splat(v: f32) -> Self;
    /// `src[at..at + N]`; panics when that is out of bounds.
    fn load(src: &[f32], at: usize) -> Self;
    /// Into `dst[at..at + N]`; panics when that is out of bounds.
    fn store(self, dst: &mut [f32], at: usize);
    /// The lanes that are `keep`, packed to the front, then unspecified values, into `dst[at..at + N]`.
    fn compress(self, keep: Self::M, dst: &mut [f32], at: usize);
    /// Lane i from lane `by[i] % N`.
    fn permute(self, by: Self::U) -> Self;
    /// Lane 0.
    fn first(self) -> f32;
    /// `self * b + c`, fused where the level has it (AVX2 and up), else with two roundings.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// The smaller; the second operand if either is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger; the second operand if either is NaN.
    fn max(self, other: Self) -> Self;
    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// Largest integer not above.
    fn floor(self) -> Self;
    /// `<`
    fn lt(self, other: Self) -> Self::M;
    /// `<=`
    fn le(self, other: Self) -> Self::M;
    /// `==`
    fn eq(self, other: Self) -> Self::M;
    /// `self` where `mask`, else `other`.
    fn or_else(self, mask: Self::M, other: Self) -> Self;
    /// The bits.
    fn to_bits(self) -> Self::U;
    /// Rounded towards zero; the value must be in 0 ..= 2^31 - 1.
    fn to_uint(self) -> Self::U;

    /// `>`
    #[inline(always)]
    fn gt(self, other: Self) -> Self::M {
        other.lt(self)
    }

    /// `>=`
    #[inline(always)]
    fn ge(self, other: Self) -> Self::M {
        other.le(self)
    }

    /// 0 in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }

    /// 1 in every lane.
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }

    /// Magnitude.
    #[inline(always)]
    fn abs(self) -> Self {
        Self::U::to_float_bits(self.to_bits() & Self::U::splat(0x7fff_ffff))
    }

    /// Magnitude of `self` with the sign of `sign`.
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let s = sign.to_bits() & Self::U::splat(0x8000_0000);
        Self::U::to_float_bits((self.to_bits() & Self::U::splat(0x7fff_ffff)) | s)
    }

    /// `self` where `mask`, else 0.
    #[inline(always)]
    fn masked(self, mask: Self::M) -> Self {
        self.or_else(mask, Self::zero())
    }

    /// Neither NaN nor infinite.
    #[inline(always)]
    fn is_finite(self) -> Self::M {
        self.abs().lt(Self::splat(f32::INFINITY))
    }
}

/// N u32, wrapping.
pub trait Uint:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
{
    /// The matching floats.
    type F: Float<U = Self, M = Self::M>;
    /// The matching mask.
    type M: Mask;

    /// The same value in every lane.
    fn splat(v: u32) -> Self;
    /// 0, 1, 2, ...
    fn lane_ids() -> Self;
    /// `src[at..at + N]`; panics when that is out of bounds.
    fn load(src: &[u32], at: usize) -> Self;
    /// Into `dst[at..at + N]`; panics when that is out of bounds.
    fn store(self, dst: &mut [u32], at: usize);
    /// The lanes that are `keep`, packed to the front, then unspecified values, into `dst[at..at + N]`.
    fn compress(self, keep: Self::M, dst: &mut [u32], at: usize);
    /// Lane i from lane `by[i] % N`.
    fn permute(self, by: Self) -> Self;
    /// Shifted left; `by` < 32.
    fn shl(self, by: u32) -> Self;
    /// Shifted right; `by` < 32.
    fn shr(self, by: u32) -> Self;
    /// Shifted left by as many bits as each lane of `by` says, each < 32.
    fn shl_each(self, by: Self) -> Self;
    /// Shifted right by as many bits as each lane of `by` says, each < 32.
    fn shr_each(self, by: Self) -> Self;
    /// The smaller, unsigned.
    fn min(self, other: Self) -> Self;
    /// `==`
    fn eq(self, other: Self) -> Self::M;
    /// `<`, unsigned.
    fn lt(self, other: Self) -> Self::M;
    /// `self` where `mask`, else `other`.
    fn or_else(self, mask: Self::M, other: Self) -> Self;
    /// Bit 31 becomes bit 0 and so on.
    fn reverse_bits(self) -> Self;
    /// The bits as floats.
    fn to_float_bits(self) -> Self::F;
    /// The nearest floats; the value must be below 2^31.
    fn to_float(self) -> Self::F;
    /// `table[self]` per lane; an index past the end reads the last element. Panics when the table is empty.
    fn gather(self, table: &[f32]) -> Self::F;
    /// `table[self]` per lane; an index past the end reads the last element. Panics when the table is empty.
    fn gather_uint(self, table: &[u32]) -> Self;
    /// The four columns of `table[self]` per lane, by 16-byte loads and a transpose (half the cost of four gathers); an
    /// index past the end reads the last record. Panics when the table is empty.
    fn records(self, table: &[[f32; 4]]) -> [Self::F; 4];

    /// Whether any bit of `bits` is set.
    #[inline(always)]
    fn has(self, bits: u32) -> Self::M {
        !(self & Self::splat(bits)).eq(Self::splat(0))
    }
}
