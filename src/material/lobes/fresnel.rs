//! How much of the light a smooth interface reflects.

use crate::math::V3;
use crate::math::lanes::pow5;
use simd::{Float, Lanes};

/// Reflectance of an interface between dielectrics for unpolarised light, in [0, 1].
///
/// `cos_i` >= 0 is the cosine on the side that the light comes from, `eta` the index of refraction of the other side over
/// that of this one, >= 0. Beyond the critical angle exactly 1; `eta` 1: exactly 0; `eta` 0 or infinite: 1.
///
/// The form of Cook and Torrance 1982 with every difference that cancels near `eta` = 1 replaced by `eta^2 - 1 = (eta - 1)
/// (eta + 1)`: `1 - sin^2 / eta^2` is wrong by 13 % at 1.000 001, and 1 instead of 0 at `eta` 1 and grazing angles.
#[inline(always)]
pub fn dielectric<L: Lanes>(cos_i: L::F, eta: L::F) -> L::F {
    let one = L::F::one();
    let excess = (eta - one) * (eta + one);
    let g2 = cos_i.mul_add(cos_i, excess);
    // eta times the cosine on the other side.
    let g = g2.max(L::F::zero()).sqrt();
    // The least divisor matters at eta 1 and cosine 0 alone, where `excess` is 0.
    let sum = (g + cos_i).max(L::F::splat(1e-18));
    let difference = excess / sum;
    let s = difference / sum;
    let p_over_s = (cos_i * sum - one) / cos_i.mul_add(difference, one);
    let reflectance = L::F::splat(0.5) * s * s * p_over_s.mul_add(p_over_s, one);
    // `min` also turns NaN (eta 0 or infinite) into 1.
    one.or_else(g2.lt(L::F::zero()), reflectance.min(one))
}

/// Reflectance at normal incidence of index `eta`.
#[inline(always)]
pub fn normal_incidence<L: Lanes>(eta: L::F) -> L::F {
    let one = L::F::one();
    let r = (eta - one) / (eta + one);
    r * r
}

/// Schlick's approximation with full reflection at grazing angles: `f0 + (1 - f0)(1 - cos)^5`, per colour.
#[inline(always)]
pub fn schlick<L: Lanes>(f0: V3<L>, cos: L::F) -> V3<L> {
    let s5 = pow5((L::F::one() - cos).max(L::F::zero()));
    f0 + (V3::<L>::splat([1.0; 3]) - f0).scale(s5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::tests::at_all_levels;
    use simd::{Kernel, Level, dispatch};

    /// [`dielectric`] at one lane.
    fn at(cos_i: f32, eta: f32) -> f64 {
        struct At(f32, f32);
        impl Kernel for At {
            type Output = f32;

            #[inline(always)]
            fn run<L: Lanes>(self) -> f32 {
                dielectric::<L>(L::F::splat(self.0), L::F::splat(self.1)).first()
            }
        }
        f64::from(dispatch(Level::Scalar, At(cos_i, eta)))
    }

    /// By Snell's law and Fresnel's equations, in f64; the sines' difference of squares by factors.
    fn exact(cos_i: f32, eta: f32) -> f64 {
        let (c, eta) = (f64::from(cos_i), f64::from(eta));
        let g2 = c * c + (eta - 1.0) * (eta + 1.0);
        if g2 < 0.0 || eta == 1.0 {
            return if eta == 1.0 { 0.0 } else { 1.0 };
        }
        let cos_t = g2.sqrt() / eta;
        let s = (c - eta * cos_t) / (c + eta * cos_t);
        let p = (eta * c - cos_t) / (eta * c + cos_t);
        0.5 * (s * s + p * p)
    }

    #[test]
    fn bsdf_06_dielectric_reflectance_has_its_known_values() {
        assert!((at(1.0, 1.5) - 0.04).abs() < 1e-7);
        assert!((at(1.0, 1.0 / 1.5) - 0.04).abs() < 1e-7);
        for eta in [1.01, 1.33, 1.5, 2.42, 0.5, 0.9] {
            assert_eq!(at(0.0, eta), 1.0, "grazing, eta {eta}");
        }
        // At Brewster's angle, 56.3099 degrees, p is not reflected: half of s is left.
        let brewster = (1.0 / (1.0 + 1.5f64 * 1.5)).sqrt();
        let s = (1.5f64 * 1.5 - 1.0) / (1.5 * 1.5 + 1.0);
        assert!((at(brewster as f32, 1.5) - 0.5 * s * s).abs() < 1e-7);
        // 45 degrees: R_p = R_s^2, R_s = 0.092 013 35 for 1.5.
        let (r_s, forty_five) = (0.092_013_35, std::f32::consts::FRAC_1_SQRT_2);
        assert!((at(forty_five, 1.5) - 0.5 * (r_s + r_s * r_s)).abs() < 1e-7);
    }

    #[test]
    fn bsdf_06_reflection_is_total_beyond_the_critical_angle_and_continuous_there() {
        for eta in [0.999f32, 0.9, 1.0 / 1.5, 0.4] {
            let critical = (1.0 - eta * eta).sqrt();
            for share in [0.0, 0.5, 0.99, 0.999_99] {
                assert_eq!(at(critical * share, eta), 1.0, "eta {eta}, {share} of the critical cosine");
            }
            // The reflectance falls as a square root from there: the next f32 is down by 0.005 at eta 0.4.
            let next = critical * (1.0 + 1.2e-7);
            assert!((at(next, eta) - exact(next, eta)).abs() < 5e-3 && at(next, eta) > 1.0 - 1e-2, "eta {eta}");
        }
    }

    #[test]
    fn bsdf_06_indices_near_one_lose_no_digits() {
        for eta in [1.0f32, 1.000_000_1, 1.000_001, 1.0001, 1.01, 1.5, 10.0, 0.999_999_9, 0.9999, 0.5] {
            for i in 0..=4000 {
                let t = i as f32 / 4000.0;
                let cos = t * t * t * t;
                let (found, expected) = (at(cos, eta), exact(cos, eta));
                let near_critical = (f64::from(cos).powi(2) + (f64::from(eta) - 1.0) * (f64::from(eta) + 1.0)).abs();
                if near_critical < 1e-4 * f64::from(cos).powi(2) {
                    continue; // a last bit of the cosine decides
                }
                let error = (found - expected).abs();
                assert!(error <= 1e-4 * expected, "cos {cos}, eta {eta}: {found}, not {expected}");
            }
        }
        for cos in [0.0, 1e-9, 1e-4, 1.7e-4, 0.5, 1.0] {
            assert_eq!(at(cos, 1.0), 0.0, "no interface at cos {cos}");
        }
    }

    #[test]
    fn fully_reflecting_indices_reflect_fully() {
        for cos in [0.0, 1e-9, 0.3, 1.0] {
            assert_eq!(at(cos, 0.0), 1.0);
            assert_eq!(at(cos, f32::INFINITY), 1.0);
        }
    }

    #[test]
    fn schlick_is_f0_ahead_and_white_at_grazing_angles() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                let f0 = V3::<L>::splat([0.1, 0.5, 1.0]);
                let at = |cos: f32| schlick(f0, L::F::splat(cos));
                assert_eq!([at(1.0).x.first(), at(1.0).y.first(), at(1.0).z.first()], [0.1, 0.5, 1.0]);
                assert_eq!([at(0.0).x.first(), at(0.0).y.first(), at(0.0).z.first()], [1.0; 3]);
                assert!((at(0.5).x.first() - (0.1 + 0.9 / 32.0)).abs() < 1e-7);
            }
        }
        at_all_levels(Check);
    }
}
