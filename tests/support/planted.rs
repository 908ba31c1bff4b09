//! Faults put in on purpose: a statistical test that does not find its fault is broken.

use prt::image::exr_read::Picture;

/// A fault in the estimator of [`sky_irradiance`], or none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// As it should be.
    None,
    /// The cosine of the surface is left out of the integrand.
    DropCosine,
    /// The density is reported as this many times what it is.
    Pdf(f64),
    /// Survivors of Russian roulette are not given the weight of those that ended.
    DropRouletteWeight,
    /// The two strategies' weights add up to this.
    MisSum(f64),
}

/// Multiplies every pixel.
pub fn scale(picture: &mut Picture, factor: f32) {
    picture.pixels.as_flattened_mut().iter_mut().for_each(|x| *x *= factor);
}

/// Multiplies the upper left quarter.
pub fn scale_quarter(picture: &mut Picture, factor: f32) {
    for row in picture.pixels.chunks_mut(picture.width).take(picture.height / 2) {
        row[..picture.width / 2].as_flattened_mut().iter_mut().for_each(|x| *x *= factor);
    }
}

/// A small counter-based generator (SplitMix64; Steele et al. 2014), uniform in [0, 1).
pub struct Stream(u64);

impl Stream {
    /// The stream of `seed`.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d)
    }

    /// The next number.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Irradiance over pi, exactly `1 + 2/3`, of a sky of radiance `1 + cos(theta)`: a path tracer in small. It samples
/// the sky by uniform and by cosine-weighted directions under the balance heuristic, then plays roulette at 0.7.
pub fn sky_irradiance(fault: Fault, samples: usize, seed: u64) -> f64 {
    use std::f64::consts::{FRAC_1_PI, PI};
    let mut stream = Stream::new(seed);
    let mut sum = 0.0;
    for i in 0..samples {
        let u = stream.uniform();
        // One strategy a sample, in turn: density 1/2 of each, so the balance heuristic is f over the mean density.
        let cosine = if i % 2 == 0 { u } else { (1.0 - u).sqrt() };
        let mut pdf = 0.5 * (0.5 / PI + cosine * FRAC_1_PI);
        if let Fault::Pdf(factor) = fault {
            pdf *= factor;
        }
        let reflected = FRAC_1_PI * if fault == Fault::DropCosine { 1.0 } else { cosine };
        let mut value = (1.0 + cosine) * reflected / pdf;
        if let Fault::MisSum(total) = fault {
            value *= total;
        }
        const SURVIVAL: f64 = 0.7;
        if stream.uniform() < SURVIVAL {
            sum += if fault == Fault::DropRouletteWeight { value } else { value / SURVIVAL };
        }
    }
    sum / samples as f64
}
