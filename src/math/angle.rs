//! Angles of directions, N lanes at a time.

use simd::{Float, Lanes};

/// tan(pi / 8): above it the other side of the octant's middle is nearer.
const TAN_PI_8: f32 = 0.414_213_56;

/// Smallest denominator: (0, 0) has angle 0 and no lane divides by 0.
const TINY: f32 = 1e-37;

/// Angle of the vector (`x`, `y`) in turns, in [0, 1], counter-clockwise from x: `atan2(y, x) / 2 pi`. Absolute error
/// below 1e-7; near the axes x and y the relative error is as small.
///
/// Folded into half an octant, where atan(s) / 2 pi s is a polynomial in s^2 (interpolated at the Chebyshev points,
/// relative error 2e-8).
#[inline(always)]
pub fn turns<L: Lanes>(x: L::F, y: L::F) -> L::F {
    let f = |v: f32| L::F::splat(v);
    let (zero, one) = (L::F::zero(), L::F::one());
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = (ax.min(ay), ax.max(ay).max(f(TINY)));
    let upper = low.gt(high * f(TAN_PI_8));
    let s = ((low - high) / (low + high)).or_else(upper, low / high);
    let z = s * s;
    let mut p = f(0.012_694_663);
    p = p.mul_add(z, f(-0.022_040_557));
    p = p.mul_add(z, f(0.031_789_74));
    p = p.mul_add(z, f(-0.053_050_776));
    p = p.mul_add(z, f(0.159_154_94));
    let octant = (p * s) + f(0.125).or_else(upper, zero);
    let quarter = (f(0.25) - octant).or_else(ay.gt(ax), octant);
    let half = (f(0.5) - quarter).or_else(x.lt(zero), quarter);
    (one - half).or_else(y.lt(zero), half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::tests::at_all_levels;
    use simd::Kernel;

    #[test]
    fn turns_are_those_of_f64_all_around_and_near_the_axes() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                let mut out = [0.0; 16];
                let mut get = |x: f32, y: f32| {
                    turns::<L>(L::F::splat(x), L::F::splat(y)).store(&mut out, 0);
                    f64::from(out[0])
                };
                for i in 0..4096 {
                    let angle = f64::from(i) / 4096.0 * std::f64::consts::TAU;
                    for length in [1.0, 1e-6, 3e4] {
                        let (x, y) = ((angle.cos() * length) as f32, (angle.sin() * length) as f32);
                        let exact = f64::from(y).atan2(f64::from(x)) / std::f64::consts::TAU;
                        let error = (get(x, y) - exact.rem_euclid(1.0)).abs();
                        assert!(error.min(1.0 - error) < 1e-7, "{x} {y}: off by {error}");
                    }
                }
                for y in [1e-3_f32, 1e-8, 1e-20] {
                    let exact = f64::from(y).atan2(1.0) / std::f64::consts::TAU;
                    assert!((get(1.0, y) / exact - 1.0).abs() < 3e-7, "{y}");
                }
                assert_eq!(get(0.0, 0.0), 0.0);
            }
        }
        at_all_levels(Check);
    }
}
