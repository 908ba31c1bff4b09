//! Three-vectors and the few elementary functions that shading needs, N lanes at a time.

use simd::{Float, Lanes, Uint};
use std::ops::{Add, Mul, Neg, Sub};

/// N three-vectors (or colours), structure of arrays.
#[derive(Clone, Copy)]
pub struct V3<L: Lanes> {
    /// First component.
    pub x: L::F,
    /// Second component.
    pub y: L::F,
    /// Third component.
    pub z: L::F,
}

impl<L: Lanes> V3<L> {
    /// From components.
    #[inline(always)]
    pub fn new(x: L::F, y: L::F, z: L::F) -> Self {
        Self { x, y, z }
    }

    /// The same vector in every lane.
    #[inline(always)]
    pub fn splat(v: [f32; 3]) -> Self {
        Self::new(L::F::splat(v[0]), L::F::splat(v[1]), L::F::splat(v[2]))
    }

    /// The first three numbers of records.
    #[inline(always)]
    pub fn of_record(record: &[L::F; 4]) -> Self {
        Self::new(record[0], record[1], record[2])
    }

    /// All components zero.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat([0.0; 3])
    }

    /// Dot product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> L::F {
        self.x.mul_add(o.x, self.y.mul_add(o.y, self.z * o.z))
    }

    /// Cross product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self::new(self.y * o.z - self.z * o.y, self.z * o.x - self.x * o.z, self.x * o.y - self.y * o.x)
    }

    /// Each component times `s`.
    #[inline(always)]
    pub fn scale(self, s: L::F) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }

    /// `self * s + o`.
    #[inline(always)]
    pub fn mul_add(self, s: L::F, o: Self) -> Self {
        Self::new(self.x.mul_add(s, o.x), self.y.mul_add(s, o.y), self.z.mul_add(s, o.z))
    }

    /// Unit length; NaN for the zero vector.
    #[inline(always)]
    pub fn normalized(self) -> Self {
        self.scale(L::F::one() / self.dot(self).sqrt())
    }

    /// Magnitudes.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self::new(self.x.abs(), self.y.abs(), self.z.abs())
    }

    /// Componentwise maximum.
    #[inline(always)]
    pub fn max(self, o: Self) -> Self {
        Self::new(self.x.max(o.x), self.y.max(o.y), self.z.max(o.z))
    }

    /// Componentwise minimum.
    #[inline(always)]
    pub fn min(self, o: Self) -> Self {
        Self::new(self.x.min(o.x), self.y.min(o.y), self.z.min(o.z))
    }

    /// The largest component.
    #[inline(always)]
    pub fn max_component(self) -> L::F {
        self.x.max(self.y).max(self.z)
    }

    /// `self` where `mask`, else `other`.
    #[inline(always)]
    pub fn or_else(self, mask: L::M, other: Self) -> Self {
        Self::new(self.x.or_else(mask, other.x), self.y.or_else(mask, other.y), self.z.or_else(mask, other.z))
    }

    /// `self` where `mask`, else 0.
    #[inline(always)]
    pub fn masked(self, mask: L::M) -> Self {
        self.or_else(mask, Self::zero())
    }

    /// `self + (other - self) t`.
    #[inline(always)]
    pub fn lerp(self, other: Self, t: L::F) -> Self {
        (other - self).mul_add(t, self)
    }

    /// All components neither NaN nor infinite.
    #[inline(always)]
    pub fn is_finite(self) -> L::M {
        self.x.is_finite() & self.y.is_finite() & self.z.is_finite()
    }
}

impl<L: Lanes> Add for V3<L> {
    type Output = Self;

    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<L: Lanes> Sub for V3<L> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<L: Lanes> Mul for V3<L> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self::new(self.x * o.x, self.y * o.y, self.z * o.z)
    }
}

impl<L: Lanes> Neg for V3<L> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

/// `a + (b - a) t`: exactly `a` where `a == b`.
#[inline(always)]
pub fn lerp<F: Float>(a: F, b: F, t: F) -> F {
    (b - a).mul_add(t, a)
}

/// Limited to `[low, high]`; NaN becomes `low`.
#[inline(always)]
pub fn clamp<F: Float>(v: F, low: f32, high: f32) -> F {
    v.max(F::splat(low)).min(F::splat(high))
}

/// Square root of the positive part; 0 for NaN.
#[inline(always)]
pub fn safe_sqrt<F: Float>(v: F) -> F {
    v.max(F::zero()).sqrt()
}

/// `v^5`.
#[inline(always)]
pub fn pow5<F: Float>(v: F) -> F {
    let v2 = v * v;
    v2 * v2 * v
}

/// `e^x`, relative error below 2e-7; 0 below -87, the largest of them above 88, 0 for NaN.
#[inline(always)]
pub fn exp<L: Lanes>(x: L::F) -> L::F {
    let f = |v: f32| L::F::splat(v);
    let x = x.max(f(-88.0)).min(f(88.0));
    // x = n ln 2 + r with |r| <= ln 2 / 2, ln 2 in two parts: products of n with the first are exact, fused or not.
    let n = (x * f(std::f32::consts::LOG2_E) + f(0.5)).floor();
    let r = n.mul_add(f(2.121_944_4e-4), n.mul_add(f(-0.693_359_4), x));
    let tail = r.mul_add(f(1.0 / 5040.0), f(1.0 / 720.0));
    let tail = r.mul_add(r.mul_add(tail, f(1.0 / 120.0)), f(1.0 / 24.0));
    let p = r.mul_add(r.mul_add(r.mul_add(r.mul_add(tail, f(1.0 / 6.0)), f(0.5)), f(1.0)), f(1.0));
    let power = (n + f(127.0)).max(f(0.0)).to_uint().shl(23).to_float_bits();
    p * power
}

/// Natural logarithm, relative error below 3e-7; that of the smallest normal number (-87.3) for 0, NaN and all below it.
#[inline(always)]
pub fn ln<L: Lanes>(x: L::F) -> L::F {
    let f = |v: f32| L::F::splat(v);
    // x = 2^n m with m in [sqrt(1/2), sqrt(2)); the integer constants are 1.0 and sqrt(1/2).
    let bits = x.max(f(f32::MIN_POSITIVE)).to_bits() + L::U::splat(0x3f80_0000 - 0x3f35_04f3);
    let n = bits.shr(23).to_float() - f(127.0);
    let m = ((bits & L::U::splat(0x007f_ffff)) + L::U::splat(0x3f35_04f3)).to_float_bits();
    // ln m = 2 artanh s.
    let s = (m - f(1.0)) / (m + f(1.0));
    let s2 = s * s;
    let tail = s2.mul_add(s2.mul_add(s2.mul_add(f(2.0 / 9.0), f(2.0 / 7.0)), f(2.0 / 5.0)), f(2.0 / 3.0));
    // ln 2 in two parts.
    n.mul_add(f(0.693_148_6), n.mul_add(f(-1.428_606_8e-6), s.mul_add(s2 * tail, s + s)))
}

/// (cos 2 pi u, sin 2 pi u) for u in [0, 1], absolute error below 3e-7.
///
/// The octant is folded away exactly, then Taylor polynomials in `[-pi/4, pi/4]`.
#[inline(always)]
pub fn cos_sin_2pi<L: Lanes>(u: L::F) -> (L::F, L::F) {
    let f = |v: f32| L::F::splat(v);
    // Quarter turns q = round(4 u), rest r in [-1/8, 1/8] turns.
    let q = (u * f(4.0) + f(0.5)).floor();
    let x = (u - q * f(0.25)) * f(std::f32::consts::TAU);
    let x2 = x * x;
    let sin = x * x2.mul_add(x2.mul_add(x2.mul_add(f(-1.0 / 5040.0), f(1.0 / 120.0)), f(-1.0 / 6.0)), f(1.0));
    let cos = x2
        .mul_add(x2.mul_add(x2.mul_add(x2.mul_add(f(1.0 / 40320.0), f(-1.0 / 720.0)), f(1.0 / 24.0)), f(-0.5)), f(1.0));
    let q = q.to_uint();
    let odd = q.has(1);
    let (c, s) = (sin.or_else(odd, cos), cos.or_else(odd, sin));
    // cos is negative in quarters 1 and 2, sin in 2 and 3.
    let c_sign = ((q + L::U::splat(1)) & L::U::splat(2)).shl(30);
    let s_sign = (q & L::U::splat(2)).shl(30);
    ((c.to_bits() ^ c_sign).to_float_bits(), (s.to_bits() ^ s_sign).to_float_bits())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use simd::{Kernel, Level, dispatch};

    /// Runs `kernel` at every level of this CPU.
    pub(crate) fn at_all_levels<K: Kernel + Clone>(kernel: K) {
        for level in [Level::Scalar, Level::Portable8, Level::Avx2, Level::Avx512] {
            if level.is_available() {
                dispatch(level, kernel.clone());
            }
        }
    }

    #[test]
    fn exp_is_that_of_f64() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                for i in -8600..8800 {
                    let x = i as f32 * 0.01;
                    let found = f64::from(exp::<L>(L::F::splat(x)).first());
                    let exact = f64::from(x).exp();
                    assert!((found / exact - 1.0).abs() < 2e-7, "e^{x}: {found}, f64 {exact}");
                }
                assert_eq!(exp::<L>(L::F::splat(0.0)).first(), 1.0);
                for x in [-89.0, -1e30, f32::NEG_INFINITY, f32::NAN] {
                    assert_eq!(exp::<L>(L::F::splat(x)).first(), 0.0, "e^{x}");
                }
                assert!(exp::<L>(L::F::splat(f32::INFINITY)).first().is_finite());
            }
        }
        at_all_levels(Check);
    }

    #[test]
    fn ln_is_that_of_f64() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                for i in -8000..8000 {
                    // All magnitudes, and crowded about 1.
                    for x in [(i as f32 * 0.01).exp(), 1.0 + i as f32 * 1e-4] {
                        let found = f64::from(ln::<L>(L::F::splat(x)).first());
                        let exact = f64::from(x).ln();
                        if x > 0.0 {
                            assert!((found - exact).abs() <= 3e-7 * exact.abs(), "ln {x}: {found}, f64 {exact}");
                        }
                    }
                }
                assert_eq!(ln::<L>(L::F::splat(1.0)).first(), 0.0);
                for x in [0.0, -1.0, 1e-40, f32::NAN] {
                    assert!((ln::<L>(L::F::splat(x)).first() + 87.336_55).abs() < 1e-4, "ln {x}");
                }
            }
        }
        at_all_levels(Check);
    }

    #[test]
    fn cos_and_sin_of_a_turn_are_those_of_f64() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                for i in 0..=4096 {
                    let u = i as f32 / 4096.0;
                    let (c, s) = cos_sin_2pi::<L>(L::F::splat(u));
                    let mut out = [0.0; 32];
                    c.store(&mut out, 0);
                    s.store(&mut out, 16);
                    let angle = f64::from(u) * std::f64::consts::TAU;
                    assert!((f64::from(out[0]) - angle.cos()).abs() < 4e-7, "cos at {u}");
                    assert!((f64::from(out[16]) - angle.sin()).abs() < 4e-7, "sin at {u}");
                }
            }
        }
        at_all_levels(Check);
    }
}
