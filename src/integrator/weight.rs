//! Weights of two ways to find the same light, which sum to 1 at each vertex (Veach 1997, section 9.2).
//!
//! The balance heuristic where a surface of metal and roughness has a specular lobe, the power heuristic where it is
//! Lambertian or has more lobes. Measured as relMSE at 64 samples, balance over power everywhere: Lambertian Cornell box
//! 1.03, cloth 1.06; plastics, brick and gold 0.96 to 0.98 (docs/decisions/0013-light-choice.md).

use simd::{Float, Lanes};

/// Weight of a sample taken with density `own` that would have been taken the other way with density `other`, by the
/// power heuristic in the lanes of `by_power`.
#[inline(always)]
pub fn weight<L: Lanes>(own: L::F, other: L::F, by_power: L::M) -> L::F {
    let (one, ratio) = (L::F::one(), other / own);
    one / ratio.mul_add(ratio.or_else(by_power, one), one)
}

/// A density as paths remember it: negative where it is weighed by the balance heuristic.
#[inline(always)]
pub fn remembered<L: Lanes>(pdf: L::F, by_power: L::M) -> L::F {
    pdf.or_else(by_power, -pdf)
}

/// [`weight`] of a density that is [`remembered`].
#[inline(always)]
pub fn weight_of_remembered<L: Lanes>(pdf: L::F, other: L::F) -> L::F {
    weight::<L>(pdf.abs(), other, L::F::zero().lt(pdf))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::tests::at_all_levels;
    use simd::{Kernel, Mask};

    #[test]
    fn lgt_07_weights_of_both_ways_sum_to_1() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                for by_power in [L::M::from_bits(0), L::M::first(L::N)] {
                    for light in [0.0_f32, 1e-6, 0.3, 1.0, 50.0, 1e8] {
                        for bsdf in [1e-5_f32, 0.2, 1.0, 7.0, 1e6] {
                            let (light, bsdf) = (L::F::splat(light), L::F::splat(bsdf));
                            let found = weight_of_remembered::<L>(remembered::<L>(bsdf, by_power), light).first();
                            let sampled = weight::<L>(light, bsdf, by_power).first();
                            assert!((found + sampled - 1.0).abs() < 1e-6, "{found} and {sampled}");
                        }
                    }
                }
                // What only one way finds is its alone: camera rays and mirrors.
                assert_eq!(weight_of_remembered::<L>(L::F::splat(f32::INFINITY), L::F::splat(3.0)).first(), 1.0);
                assert_eq!(weight_of_remembered::<L>(L::F::splat(f32::NEG_INFINITY), L::F::splat(3.0)).first(), 1.0);
            }
        }
        at_all_levels(Check);
    }
}
