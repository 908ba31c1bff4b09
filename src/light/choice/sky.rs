//! How much light a point may expect of the environment by sampling it as a light.
//!
//! Scattered rays find what is level in an environment by themselves; what needs light samples is what stands out, the
//! radiance above its mean. Its irradiance is smooth in the normal: nine coefficients, after Ramamoorthi and Hanrahan 2001,
//! "An Efficient Representation for Irradiance Environment Maps".

use super::importance::Receiver;
use glam::DVec3;
use simd::{Float, Lanes};
use std::f64::consts::PI;

/// Least importance as a part of the mean one: nine coefficients ring, and no light may be impossible that stands out.
const LEAST: f64 = 0.1;

/// Irradiance by the normal.
#[derive(Clone, Debug)]
pub struct Sky {
    /// Of 1, x, y, z, xy, yz, 3 zz - 1, xz, xx - yy.
    coefficients: [f64; 9],
    /// Mean over all normals.
    mean: f64,
}

impl Sky {
    /// Of samples of the sphere: unit direction, radiance (nits, mean over channels) and solid angle. `None` where nothing
    /// stands out of the mean.
    pub fn new(samples: impl Iterator<Item = (DVec3, f64, f64)> + Clone) -> Option<Self> {
        let (sum, angle) = samples.clone().fold((0.0, 0.0), |(s, a), (_, l, w)| (s + l * w, a + w));
        let level = sum / angle;
        let mut moments = [0.0; 9];
        for (d, radiance, angle) in samples {
            let above = (radiance - level).max(0.0) * angle;
            if above > 0.0 {
                for (moment, basis) in moments.iter_mut().zip(basis(d)) {
                    *moment += above * basis;
                }
            }
        }
        // Constant but for rounding.
        if moments[0] <= 1e-3 * sum {
            return None;
        }
        // Cosine lobe times each band: pi, 2 pi / 3, pi / 4; basis functions normalised.
        let [b0, b1, b2] = [PI / (4.0 * PI), 2.0 * PI / 3.0 * 3.0 / (4.0 * PI), PI / 4.0 * 15.0 / (4.0 * PI)];
        let weights = [b0, b1, b1, b1, b2, b2, b2 / 12.0, b2, b2 / 4.0];
        let mut coefficients = [0.0; 9];
        for i in 0..9 {
            coefficients[i] = moments[i] * weights[i];
        }
        Some(Self { coefficients, mean: coefficients[0] })
    }

    /// Mean over all normals, lux.
    pub fn brightest(&self) -> f64 {
        self.mean
    }

    /// In other units.
    pub fn scaled(mut self, scale: f64) -> Self {
        self.coefficients = self.coefficients.map(|c| c * scale);
        self.mean *= scale;
        self
    }

    /// What may be expected of it.
    #[inline(always)]
    pub fn importance<L: Lanes>(&self, at: &Receiver<L>) -> L::F {
        let c = |i: usize| L::F::splat(self.coefficients[i] as f32);
        let n = at.n;
        let odd = n.x.mul_add(c(1), n.y.mul_add(c(2), n.z * c(3)));
        let even = c(0)
            + (n.x * n.y).mul_add(c(4), (n.y * n.z) * c(5))
            + n.z.mul_add(n.z, L::F::splat(-1.0 / 3.0)).mul_add(c(6) * L::F::splat(3.0), (n.x * n.z) * c(7))
            + n.x.mul_add(n.x, -(n.y * n.y)) * c(8);
        let odd = odd.abs().or_else(at.both_sides, odd);
        (even + odd).max(L::F::splat((LEAST * self.mean) as f32))
    }
}

/// What [`Sky::coefficients`] are of.
fn basis(d: DVec3) -> [f64; 9] {
    [1.0, d.x, d.y, d.z, d.x * d.y, d.y * d.z, 3.0 * d.z * d.z - 1.0, d.x * d.z, d.x * d.x - d.y * d.y]
}
