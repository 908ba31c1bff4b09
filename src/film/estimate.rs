//! How far a picture is from what it would be with endless samples, estimated from its own samples.
//!
//! A pixel's samples are one sequence in four blocks. If the variance of its mean is `V(n) = a(n) + b(n)`, a part that
//! falls as 1/n (what is sampled at random) and one that falls as n^-1.5 (a scrambled net at edges), then half the mean
//! square difference of two halves is `D(n/2) = 2 a + 2^1.5 (2 - 2^-0.5) b`: halves of a net mend each other's errors, so
//! they differ by more than their own. The same holds for the halves of a half, and two equations give a and b. So
//! nothing is rendered for the estimate alone. (One rate for everything, fitted in the same way: 3 to 5 % too low.)

use super::{BLOCKS, Film};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Weight of the squared mean luminance in the denominator of relMSE, as in `compare`.
const MEAN_WEIGHT: f64 = 0.01;
/// `b` of the variance's fast part in D(n/2), and in D(n/4) - 2 D(n/2).
const FAST_HALVES: f64 = 3.656_854;
const FAST_LEFT: f64 = 3.029_437;
/// Side of the squares of pixels that are left out in turn to learn how sure the estimate is.
const CELL: usize = 16;
/// What the model of the rate is off by besides, as a share of the estimate (one standard deviation): see
/// `examples/error_calibration.rs`.
const MODEL: f64 = 0.04;
/// Of this many neighbours a pixel may be as bright as the least.
const BRIGHT: usize = 3;
/// Standard deviations in a 95 % interval.
const Z95: f64 = 1.96;

/// An estimated error: sqrt(relMSE) of the whole picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Estimate.
    pub value: f64,
    /// Ends of its 95 % interval.
    pub ci95: [f64; 2],
}

/// Sums over pixels and channels of what two differences say about the relative variance.
#[derive(Clone, Copy, Debug, Default)]
struct Differences {
    /// D(n/2).
    halves: f64,
    /// D(n/4), the mean of both halves'.
    quarters: f64,
}

impl Differences {
    fn add(&mut self, weight: f64, other: Self) {
        self.halves += weight * other.halves;
        self.quarters += weight * other.quarters;
    }

    /// V(n), summed over pixels and channels.
    fn variance(self) -> f64 {
        let fast = ((self.quarters - 2.0 * self.halves) / FAST_LEFT).clamp(0.0, self.halves / FAST_HALVES);
        0.5 * (self.halves - FAST_HALVES * fast) + fast
    }
}

impl Film {
    /// The estimated error of `pixels`, which are [`Film::mean`]; `None` with fewer than four samples, or where nothing was seen but black.
    ///
    /// # Panics
    /// When a unit is missing.
    pub fn error(&self, pixels: &[[f32; 3]]) -> Option<ErrorEstimate> {
        if self.blocks.len() < BLOCKS as usize {
            return None;
        }
        let count = pixels.len() as f64;
        let mean = pixels.iter().map(grey).sum::<f64>() / count;
        if mean.is_nan() || mean <= 0.0 {
            return None;
        }
        let width = self.window.width as usize;
        let across = width.div_ceil(CELL);
        // By both kinds of weights; tile by tile, and put together in their order.
        let of_tile = |tile: usize| {
            let (mut found, mut by_own) = (BTreeMap::<usize, Differences>::new(), Differences::default());
            self.each_pixel_of(tile, |x, y, blocks| {
                let of_pixel = differences(blocks);
                // A pixel that is too bright by a lucky sample would be told that it may be off by more.
                let greys = [among_neighbours(pixels, width, x, y), grey(&pixels[y * width + x])];
                let [weight, own] = greys.map(|grey| 1.0 / (grey * grey + MEAN_WEIGHT * mean * mean));
                found.entry(y / CELL * across + x / CELL).or_default().add(weight, of_pixel);
                by_own.add(own, of_pixel);
            });
            (found, by_own)
        };
        let tiles: Vec<_> = (0..self.tiles.len()).into_par_iter().map(of_tile).collect();
        let mut cells = vec![Differences::default(); across * (self.window.height as usize).div_ceil(CELL)];
        let mut by_own = Differences::default();
        for (found, own) in tiles {
            found.into_iter().for_each(|(cell, of_cell)| cells[cell].add(1.0, of_cell));
            by_own.add(1.0, own);
        }
        let mut all = Differences::default();
        cells.iter().for_each(|cell| all.add(1.0, *cell));
        let error = |differences: Differences, count: f64| (differences.variance() / (3.0 * count)).sqrt();
        let value = error(all, count);
        // Each cell left out in turn (the jackknife), on the logarithm; and how much it is a matter of what pixels in which
        // few samples were bright will show in the end.
        let mut deviation = 0.0;
        if value > 0.0 && cells.len() > 1 {
            let share = cells.len() as f64;
            for cell in &cells {
                let rest = Differences { halves: all.halves - cell.halves, quarters: all.quarters - cell.quarters };
                let rest = error(rest, count * (share - 1.0) / share);
                // What is left is nothing where all of the error is in one cell.
                deviation += (rest.max(0.1 * value) / value).ln().powi(2);
            }
            deviation *= (share - 1.0) / share;
            deviation += (0.5 * (value / error(by_own, count)).ln()).powi(2);
        }
        let reach = (Z95 * (deviation + MODEL * MODEL).sqrt()).exp();
        Some(ErrorEstimate { value, ci95: [value / reach, value * reach] })
    }
}

fn grey(pixel: &[f32; 3]) -> f64 {
    pixel.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0
}

/// The luminance of `pixels` at `x`, `y`, at least that of the darkest neighbour and at most that of the third brightest:
/// inside of a corner that is brighter than what is around it there are three.
fn among_neighbours(pixels: &[[f32; 3]], width: usize, x: usize, y: usize) -> f64 {
    let height = pixels.len() / width;
    let (mut near, mut n) = ([0.0; 8], 0);
    for row in y.saturating_sub(1)..(y + 2).min(height) {
        for column in x.saturating_sub(1)..(x + 2).min(width) {
            if (column, row) != (x, y) {
                near[n] = grey(&pixels[row * width + column]);
                n += 1;
            }
        }
    }
    let near = &mut near[..n];
    near.sort_unstable_by(f64::total_cmp);
    let own = grey(&pixels[y * width + x]);
    // A picture of one pixel has no neighbours.
    if n < BRIGHT { own } else { own.clamp(near[0], near[n - BRIGHT]) }
}

/// The sums over the channels of a pixel whose blocks' sums and counts are `blocks`.
fn differences(blocks: [[f32; 4]; BLOCKS as usize]) -> Differences {
    let mut found = Differences::default();
    let mean = |blocks: &[[f32; 4]], channel: usize| {
        let (sum, count) =
            blocks.iter().fold((0.0, 0.0), |(sum, count), b| (sum + f64::from(b[channel]), count + f64::from(b[3])));
        sum / f64::max(count, 1.0)
    };
    for channel in 0..3 {
        let difference = |a: &[[f32; 4]], b: &[[f32; 4]]| 0.5 * (mean(a, channel) - mean(b, channel)).powi(2);
        found.halves += difference(&blocks[..2], &blocks[2..]);
        found.quarters += 0.5 * (difference(&blocks[..1], &blocks[1..2]) + difference(&blocks[2..3], &blocks[3..]));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Tile, TileSums};

    /// A film of 64 x 64 pixels and 64 samples, of `radiance(pixel, sample)`.
    fn film(radiance: impl Fn(u32, u32) -> f32) -> Film {
        let film = Film::new(Tile { x: 0, y: 0, width: 64, height: 64 }, 64);
        for i in 0..film.units() {
            let (tile, samples) = film.unit(i);
            let mut sums = TileSums::new(&tile);
            for pixel in 0..tile.area() as u32 {
                let at = (tile.y + pixel / tile.width) * 64 + tile.x + pixel % tile.width;
                samples.clone().for_each(|sample| sums.add(pixel, [radiance(at, sample); 3]));
            }
            film.store(i, &sums);
        }
        film
    }

    /// Uniform in [0, 1).
    fn hash(mut x: u32) -> f32 {
        for k in [0x7feb_352d_u32, 0x846c_a68b] {
            x = (x ^ x >> 16).wrapping_mul(k);
        }
        (x >> 8) as f32 / 16_777_216.0
    }

    #[test]
    fn adp_02_of_independent_samples_the_error_is_their_deviation_over_the_root_of_their_number() {
        let film = film(|pixel, sample| hash(pixel * 64 + sample + 1));
        let found = film.error(&film.mean()).unwrap();
        // Uniform: deviation 1 / sqrt(12), mean 1/2.
        let expected = (1.0 / 12.0_f64 / 64.0 / (0.25 * 1.01)).sqrt();
        assert!((found.value / expected - 1.0).abs() < 0.03, "{found:?} {expected}");
        assert!(found.ci95[0] < expected && expected < found.ci95[1], "{found:?} {expected}");
        let actual: f64 = film.mean().iter().map(|p| (f64::from(p[0]) - 0.5).powi(2)).sum::<f64>() / 4096.0;
        assert!(((actual / (0.25 * 1.01)).sqrt() / found.value - 1.0).abs() < 0.05);
    }

    #[test]
    fn adp_02_of_a_stratified_sequence_the_error_is_far_below_that_of_independent_samples() {
        // Every 2^k samples from a multiple of 2^k on have one in each 2^k-th of [0, 1), so the error falls much faster than
        // the model says: the statement must be above the truth, and far below that of independent samples.
        let film = film(|pixel, sample| {
            let stratum = (sample.reverse_bits() >> 26) as f32;
            (stratum + hash(pixel * 64 + sample + 1)) / 64.0
        });
        let found = film.error(&film.mean()).unwrap();
        let actual: f64 = film.mean().iter().map(|p| (f64::from(p[0]) - 0.5).powi(2)).sum::<f64>() / 4096.0;
        let actual = (actual / (0.25 * 1.01)).sqrt();
        let independent = (1.0 / 12.0_f64 / 64.0 / (0.25 * 1.01)).sqrt();
        assert!(found.value > actual && found.value < 0.2 * independent, "{found:?} {actual} {independent}");
    }

    #[test]
    fn adp_02_too_few_samples_and_black_pictures_have_none() {
        let window = Tile { x: 0, y: 0, width: 4, height: 4 };
        for (spp, radiance) in [(3, 1.0), (16, 0.0)] {
            let film = Film::new(window, spp);
            for i in 0..film.units() {
                let (tile, samples) = film.unit(i);
                let mut sums = TileSums::new(&tile);
                (0..16).for_each(|pixel| samples.clone().for_each(|_| sums.add(pixel, [radiance; 3])));
                film.store(i, &sums);
            }
            assert_eq!(film.error(&film.mean()), None, "{spp} {radiance}");
        }
    }

    #[test]
    fn adp_02_a_picture_without_noise_has_no_error() {
        let film = film(|pixel, _| 1.0 + pixel as f32);
        let found = film.error(&film.mean()).unwrap();
        assert_eq!((found.value, found.ci95), (0.0, [0.0, 0.0]));
    }
}
