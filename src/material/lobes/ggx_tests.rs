//! Edges, normalisation, and the sampler against its density by chi-square.

use super::*;
use crate::math::lanes::tests::at_all_levels;
use simd::{Kernel, Level, Mask, Uint, dispatch};

/// Roughness along x and y.
const ALPHAS: [[f32; 2]; 7] =
    [[1e-4, 1e-4], [1e-4, 1.0], [1.0, 1e-4], [0.04, 0.04], [0.2, 0.8], [0.9, 0.3], [1.0, 1.0]];

fn unit(z: f32, phi: f32) -> [f32; 3] {
    let r = (1.0 - z * z).sqrt();
    [r * phi.cos(), r * phi.sin(), z]
}

#[test]
fn bsdf_09_sampled_normals_are_usable_at_every_edge() {
    #[derive(Clone)]
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            const U: [f32; 6] = [0.0, 5.960_464_5e-8, 1e-3, 0.5, 0.999, 1.0 - 5.960_464_5e-8];
            for [ax, ay] in ALPHAS {
                for z in [1.0, 0.5, 1e-3, 1e-7, 0.0, -1e-7, -0.3] {
                    for phi in [0.0, 0.5, 1.570_796_4, 4.0] {
                        let wo = V3::<L>::splat(unit(z, phi));
                        for visible in [
                            Visible::<L>::new(wo, L::F::splat(ax), L::F::splat(ay)),
                            Visible::<L>::all(wo, L::F::splat(ax), L::F::splat(ay)),
                        ] {
                            for u in U {
                                for v in U {
                                    let h = visible.sample([L::F::splat(u), L::F::splat(v)]);
                                    let place = format!("alpha {ax} {ay}, wo.z {z} at {phi}, u {u} {v}");
                                    assert_eq!(h.is_finite().bits() & 1, 1, "{place}: not finite");
                                    let length = h.dot(h).sqrt().first();
                                    assert!((length - 1.0).abs() < 1e-6, "{place}: length {length}");
                                    assert!(h.z.first() > 0.0, "{place}: h.z {}", h.z.first());
                                    let cos_h = wo.dot(h).first();
                                    assert!(cos_h >= 0.0 || z < 0.0, "{place}: wo.h {cos_h}");
                                    let wi = h.scale(L::F::splat(2.0 * cos_h)) - wo;
                                    assert_eq!(wi.is_finite().bits() & 1, 1, "{place}: wi");
                                    let d = distribution(h, [L::F::splat(1.0 / ax), L::F::splat(1.0 / ay)]);
                                    let pdf = visible.pdf_reflected(d).first();
                                    assert!(pdf >= 0.0 && (pdf.is_finite() || z <= 0.0), "{place}: pdf {pdf}");
                                    if z > 0.0 {
                                        assert!(pdf > 0.0, "{place}: pdf 0 of what was sampled");
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
    at_all_levels(Check);
}

/// Bins of the x and y slope of the half vector over alpha, each from -infinity to infinity.
const BINS: usize = 16;

/// Share of `[0, 1]` below the slope `s`; the density of visible normals over it is bounded.
fn slope_to_unit(s: f64) -> f64 {
    0.5 * (1.0 + s / (1.0 + s.abs()))
}

/// Which bin a normal falls into.
fn bin(h: [f64; 3], alpha: [f64; 2]) -> usize {
    let at = |h: f64, a: f64, z: f64| ((slope_to_unit(h / (a * z)) * BINS as f64) as usize).min(BINS - 1);
    at(h[0], alpha[0], h[2]) * BINS + at(h[1], alpha[1], h[2])
}

/// Sampled normals and densities of normals on a grid of bins.
struct Bins {
    alpha: [f32; 2],
    wo: [f32; 3],
    is_bounded: bool,
    samples: u32,
}

impl Kernel for Bins {
    /// Counts; shares of the density.
    type Output = (Vec<f64>, Vec<f64>);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let [ax, ay] = self.alpha.map(L::F::splat);
        let wo = V3::<L>::splat(self.wo);
        let visible = if self.is_bounded { Visible::<L>::new(wo, ax, ay) } else { Visible::<L>::all(wo, ax, ay) };
        let (mut counts, mut shares) = (vec![0.0; BINS * BINS], vec![0.0; BINS * BINS]);
        let alpha = self.alpha.map(f64::from);
        let mut state = 0x1234_5678u32;
        let mut random = || {
            // Marsaglia's xorshift.
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            (state >> 8) as f32 * 2f32.powi(-24)
        };
        for _ in 0..self.samples {
            let h = visible.sample([L::F::splat(random()), L::F::splat(random())]);
            counts[bin([h.x, h.y, h.z].map(|v| f64::from(v.first())), alpha)] += 1.0;
        }
        // Midpoints of a fine grid over the slopes' unit square, lanes along the second axis.
        let n = BINS * 32;
        for i in 0..n {
            for j in (0..n).step_by(L::N) {
                let half = L::F::splat(0.5);
                let t = [L::U::splat(i as u32), L::U::splat(j as u32) + L::U::lane_ids()]
                    .map(|k| (k.to_float() + half) * L::F::splat(2.0 / n as f32) - L::F::one());
                // The inverse of `slope_to_unit`: s = t / (1 - |t|), ds = (1 - |t|)^-2 dt.
                let one = L::F::one();
                let q = [one / (one - t[0].abs()), one / (one - t[1].abs())];
                let h = V3::<L>::new(ax * t[0] * q[0], ay * t[1] * q[1], one).normalized();
                let d = distribution(h, [L::F::one() / ax, L::F::one() / ay]);
                let pdf = visible.pdf_normal(d, wo.dot(h).max(L::F::zero()));
                // dh = h.z^3 ax ay ds.
                let jacobian = h.z * h.z * h.z * ax * ay * q[0] * q[0] * q[1] * q[1];
                let mut values = [0.0; 16];
                (pdf * jacobian).store(&mut values, 0);
                for (lane, value) in values[..L::N].iter().enumerate() {
                    shares[i / 32 * BINS + (j + lane) / 32] += f64::from(*value) * 4.0 / (n * n) as f64;
                }
            }
        }
        (counts, shares)
    }
}

#[test]
fn bsdf_01_sampled_normals_follow_their_density_with_and_without_anisotropy() {
    // Bounded normals do not follow `pdf_normal` where the cap ends: the part below is cut away. Its density is checked
    // where nothing is cut (`all`), and by reflected directions in tests/lobes.rs. 21 tests at 1e-4 each: one false alarm
    // in 476 choices of the seed.
    for alpha in ALPHAS {
        for wo in [unit(0.9, 0.3), unit(0.5, 2.0), unit(0.1, 1.2)] {
            let samples = 100_000;
            let (counts, shares) = dispatch(Level::best(), Bins { alpha, wo, is_bounded: false, samples });
            let total: f64 = shares.iter().sum();
            assert!((total - 1.0).abs() < 2e-3, "{alpha:?} {wo:?}: integral {total}");
            let (mut chi2, mut cells, mut rest) = (0.0, 0.0, [0.0; 2]);
            for (count, share) in counts.iter().zip(&shares) {
                let expected = share * f64::from(samples);
                if expected < 5.0 {
                    rest = [rest[0] + count, rest[1] + expected];
                } else {
                    chi2 += (count - expected).powi(2) / expected;
                    cells += 1.0;
                }
            }
            if rest[1] >= 5.0 {
                chi2 += (rest[0] - rest[1]).powi(2) / rest[1];
                cells += 1.0;
            } else {
                assert!(rest[0] < rest[1] + 20.0, "{alpha:?} {wo:?}: {} samples, {} expected", rest[0], rest[1]);
            }
            // Wilson and Hilferty: the cube root is nearly normal; 3.72 is the 1e-4 point.
            let dof: f64 = cells - 1.0;
            let z = ((chi2 / dof).cbrt() - (1.0 - 2.0 / (9.0 * dof))) / (2.0 / (9.0 * dof)).sqrt();
            assert!(z < 3.72, "{alpha:?} {wo:?}: chi-square {chi2:.0} of {dof} degrees of freedom");
        }
    }
}

#[test]
fn ggx_at_alpha_1_has_its_closed_form() {
    // D G2 / (4 mu_o mu_i) = 1 / (2 pi (mu_o + mu_i)).
    #[derive(Clone)]
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let one = L::F::one();
            for (a, b) in [(1.0, 1.0), (0.9, 0.1), (0.3, 0.02)] {
                let (wo, wi) = (V3::<L>::splat(unit(a, 0.2)), V3::<L>::splat(unit(b, 2.5)));
                let d = distribution((wo + wi).normalized(), [one, one]);
                let g2 = one / (one + masking(wo, one, one) + masking(wi, one, one));
                let f = (d * g2).first() / (4.0 * a * b);
                let expected = 1.0 / (std::f32::consts::TAU * (a + b));
                assert!((f / expected - 1.0).abs() < 1e-5, "{a} {b}: {f}, not {expected}");
            }
        }
    }
    at_all_levels(Check);
}
