//! Wavelengths of paths that a dispersive medium has split, and their colours.
//!
//! Light is red, green and blue until it is refracted by a medium whose index depends on the wavelength; from then on a
//! path has one wavelength and the colour that the eye sees in it. The sensitivities of the standard observer are those
//! of Wyman, Sloan and Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT
//! 2(2), section 2.2; in linear Rec.709, with nothing negative, each with the integral 1, so that white light stays white
//! on average. Wavelengths are chosen by the mean of the three: no colour is ever brighter than 3.

use crate::math::V3;
use crate::math::lanes::lerp;
use simd::{Float, Lanes, Uint};

/// Wavelengths in use, nm: outside of them the eye sees less than a thousandth.
const RANGE: [f64; 2] = [390.0, 710.0];
/// Steps of the table.
const STEPS: usize = 128;
/// Steps of the integrals it is made by.
const FINE: usize = 8192;

/// Wavelengths with equal shares of [0, 1], and their colours.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// nm, and the weights of red, green and blue at `i / STEPS`; between them linear.
    records: Vec<[f32; 4]>,
}

impl Default for Spectrum {
    fn default() -> Self {
        let step = (RANGE[1] - RANGE[0]) / FINE as f64;
        let at = |i: f64| RANGE[0] + i * step;
        let mut total = [0.0; 3];
        for i in 0..FINE {
            let c = sensitivity(at(i as f64 + 0.5));
            total = [0, 1, 2].map(|k| total[k] + c[k]);
        }
        // Per nm, integral 1.
        let density = |nm: f64| {
            let c = sensitivity(nm);
            [0, 1, 2].map(|k| c[k] / (total[k] * step))
        };
        let mean = |nm: f64| density(nm).iter().sum::<f64>() / 3.0;
        let mut nodes = Vec::with_capacity(STEPS + 1);
        let (mut below, mut i) = (0.0, 0);
        for node in 0..=STEPS {
            let share = node as f64 / STEPS as f64;
            // The cell in which the distribution function reaches the share, and the place in it.
            let mut rise = mean(at(i as f64 + 0.5)) * step;
            while i + 1 < FINE && below + rise < share {
                below += rise;
                i += 1;
                rise = mean(at(i as f64 + 0.5)) * step;
            }
            let nm = at(i as f64 + ((share - below) / rise).clamp(0.0, 1.0));
            let weight = density(nm).map(|d| d / mean(nm));
            nodes.push((nm, weight));
        }
        // The mean over the table, straight between its nodes, is white to the last bit.
        let mut sum = [0.0; 3];
        for pair in nodes.windows(2) {
            sum = [0, 1, 2].map(|k| sum[k] + 0.5 * (pair[0].1[k] + pair[1].1[k]) / STEPS as f64);
        }
        let record = |&(nm, w): &(f64, [f64; 3])| {
            [nm as f32, (w[0] / sum[0]) as f32, (w[1] / sum[1]) as f32, (w[2] / sum[2]) as f32]
        };
        Self { records: nodes.iter().map(record).collect() }
    }
}

impl Spectrum {
    /// The wavelength, nm, of the share `u` in [0, 1), and its colour: 1, 1, 1 on average over `u`.
    #[inline(always)]
    pub(super) fn sample<L: Lanes>(&self, u: L::F) -> (L::F, V3<L>) {
        let x = u * L::F::splat(STEPS as f32);
        let floor = x.floor();
        let (i, t) = (floor.to_uint(), x - floor);
        let [nm0, r0, g0, b0] = i.records(&self.records);
        let [nm1, r1, g1, b1] = (i + L::U::splat(1)).records(&self.records);
        (lerp(nm0, nm1, t), V3::new(lerp(r0, r1, t), lerp(g0, g1, t), lerp(b0, b1, t)))
    }
}

/// What the eye sees in `nm`: linear Rec.709, any scale, negative parts cut off.
fn sensitivity(nm: f64) -> [f64; 3] {
    let lobe = |peak: f64, left: f64, right: f64| {
        let t = (nm - peak) / if nm < peak { left } else { right };
        (-0.5 * t * t).exp()
    };
    let x = 1.056 * lobe(599.8, 37.9, 31.0) + 0.362 * lobe(442.0, 16.0, 26.7) - 0.065 * lobe(501.1, 20.4, 26.2);
    let y = 0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1);
    let z = 1.217 * lobe(437.0, 11.8, 36.0) + 0.681 * lobe(459.0, 26.0, 13.8);
    // IEC 61966-2-1, from CIE XYZ to linear.
    [
        3.240_97 * x - 1.537_383_2 * y - 0.498_610_8 * z,
        -0.969_243_6 * x + 1.875_967_5 * y + 0.041_555_1 * z,
        0.055_630_1 * x - 0.203_977 * y + 1.056_971_5 * z,
    ]
    .map(|v| v.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use simd::{Kernel, Level, dispatch};

    struct At<'a>(&'a Spectrum, f32);

    impl Kernel for At<'_> {
        type Output = [f32; 4];

        #[inline(always)]
        fn run<L: Lanes>(self) -> [f32; 4] {
            let (nm, w) = self.0.sample::<L>(L::F::splat(self.1));
            let mut out = [[0.0; 16]; 4];
            nm.store(&mut out[0], 0);
            w.x.store(&mut out[1], 0);
            w.y.store(&mut out[2], 0);
            w.z.store(&mut out[3], 0);
            out.map(|o| o[0])
        }
    }

    #[test]
    fn white_light_stays_white_over_all_wavelengths() {
        let spectrum = Spectrum::default();
        for level in [Level::Scalar, Level::best()] {
            let (mut sum, n) = ([0.0; 3], 1 << 14);
            let mut last = 0.0;
            for i in 0..n {
                let [nm, w @ ..] = dispatch(level, At(&spectrum, (i as f32 + 0.5) / n as f32));
                assert!(nm >= last && (390.0..=710.0).contains(&nm), "{nm} after {last}");
                last = nm;
                for (k, w) in w.into_iter().enumerate() {
                    assert!((0.0..=3.02).contains(&w), "{w} at {nm} nm");
                    sum[k] += f64::from(w) / f64::from(n);
                }
            }
            for mean in sum {
                assert!((mean - 1.0).abs() < 2e-6, "{sum:?}");
            }
        }
        // The largest number that the sampler gives.
        assert!(dispatch(Level::best(), At(&spectrum, 1.0 - 2f32.powi(-24))).iter().all(|v| v.is_finite()));
    }

    #[test]
    fn colours_come_in_the_order_of_the_rainbow() {
        let spectrum = Spectrum::default();
        let samples: Vec<_> = (0..256).map(|i| dispatch(Level::best(), At(&spectrum, i as f32 / 256.0))).collect();
        let mean = |k: usize| {
            let sum: f32 = samples.iter().map(|s| s[k]).sum();
            samples.iter().map(|s| s[0] * s[k]).sum::<f32>() / sum
        };
        let [red, green, blue] = [mean(1), mean(2), mean(3)];
        assert!((590.0..630.0).contains(&red) && (520.0..555.0).contains(&green), "{red} {green} {blue}");
        assert!((440.0..475.0).contains(&blue), "{blue}");
        // The density that the table stands for: chosen by the mean of the three colours.
        let at_550 = samples.iter().filter(|s| (545.0..555.0).contains(&s[0])).count() as f64 / 256.0;
        let share = |nm: f64| {
            let all = |k: usize| (3900..7100).map(|i| sensitivity(f64::from(i) / 10.0)[k]).sum::<f64>() / 10.0;
            (0..3).map(|k| sensitivity(nm)[k] / all(k)).sum::<f64>() / 3.0
        };
        assert!((at_550 - 10.0 * share(550.0)).abs() < 0.012, "{at_550} and {}", 10.0 * share(550.0));
    }
}
