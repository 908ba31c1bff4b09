//! Where samples go that are not the same number for every pixel: to pixels whose neighbours are noisy.
//!
//! After Kirk and Arvo 1991, "Unbiased Sampling Techniques for Image Synthesis": a pixel's number of samples must not
//! depend on those samples, or a pixel that missed a bright path by chance is left as dark as it is. So it is decided
//! once, after a stage with the same number everywhere, by what the samples of the pixels around say, never by its own.
//! Every pixel has a share of what the others get, so that none stops, however calm it looks.
//!
//! Numbers are powers of two, four quarters a pixel: blocks as in a film of the same number everywhere.

use super::{BLOCKS, Film, Part, Wave, blocks, estimate};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Samples of a pixel are at least and at most so many times those of a mean one, but for rounding.
const SHARES: Range<f64> = 0.25..8.0;
/// Pixels around a pixel that tell its noise: as far to each side.
const REACH: usize = 2;
/// Side of the squares of the picture's grid whose rays are counted together.
const COST: u32 = super::TILE;

/// How samples are spread over the pixels of a film.
#[derive(Debug)]
pub struct Spread {
    /// Samples a pixel when it was decided.
    stage: u32,
    /// Of the window, row by row: samples relative to a mean pixel's.
    shares: Vec<f32>,
    gain: f64,
    round: u32,
}

impl Spread {
    /// The same samples a pixel in the stage.
    pub fn stage(&self) -> u32 {
        self.stage
    }

    /// The share of the work that a picture of the same error takes, by what is known at the stage.
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// Rounds so far.
    pub fn round(&self) -> u32 {
        self.round
    }

    /// Goes on by about half of the samples, to `most` a pixel at most; `None` where that is reached.
    pub fn next_wave(&mut self, film: &Film, most: u32) -> Option<Wave> {
        loop {
            self.round += 1;
            // In the first round the noisiest pixels begin.
            let mean = f64::from(self.stage) / SHARES.end * (0.5 * f64::from(self.round)).exp2();
            if mean * SHARES.start > 2.0 * f64::from(most) {
                return None;
            }
            let wave = film.uneven_wave(|pixel| self.samples(pixel, mean, most));
            if wave.units() > 0 {
                return Some(wave);
            }
        }
    }

    /// Samples of a pixel where a mean one has `mean`.
    fn samples(&self, pixel: usize, mean: f64, most: u32) -> u32 {
        let wanted = mean * f64::from(self.shares[pixel]) * std::f64::consts::FRAC_1_SQRT_2;
        // The power of two that is nearest by its logarithm.
        let wanted = (wanted.max(1.0).min(f64::from(most)) as u32 + 1).next_power_of_two();
        wanted.min(1 << most.ilog2()).max(self.stage)
    }
}

impl Film {
    /// How to spread further samples, by those that are there; `pixels` are [`Film::mean`]. `None` where nothing is noisy.
    ///
    /// # Panics
    /// When the film has not the same power of two of samples everywhere, four or more.
    pub fn spread(&self, pixels: &[[f32; 3]]) -> Option<Spread> {
        assert!(self.spp.is_power_of_two() && self.spp >= BLOCKS && self.uneven.is_none(), "the stage is over");
        let (width, height) = (self.window.width as usize, self.window.height as usize);
        let variance = self.grey_variance();
        let grey: Vec<f64> = pixels.iter().map(estimate::grey).collect();
        let mean = grey.iter().sum::<f64>() / grey.len() as f64;
        let least = estimate::MEAN_WEIGHT * mean * mean;
        let costs = self.costs();
        // Noise of the surroundings and of the pixel itself, relative to the surroundings.
        let around = |at: usize| {
            let (x, y) = (at % width, at / width);
            let (mut noise, mut light, mut count) = (0.0, 0.0, 0.0);
            for row in y.saturating_sub(REACH)..(y + REACH + 1).min(height) {
                for near in row * width + x.saturating_sub(REACH)..row * width + (x + REACH + 1).min(width) {
                    if near != at {
                        noise += variance[near];
                        light += grey[near];
                        count += 1.0;
                    }
                }
            }
            let count = f64::max(count, 1.0);
            let relative = 1.0 / ((light / count).powi(2) + least);
            (noise / count * relative, variance[at] * relative)
        };
        let found: Vec<(f64, f64)> = (0..grey.len()).into_par_iter().map(around).collect();
        let wanted = |at: usize| (found[at].0 / costs[at]).sqrt();
        let middle = (0..grey.len()).map(wanted).sum::<f64>() / grey.len() as f64;
        if !(middle.is_finite() && middle > 0.0) {
            return None;
        }
        let share = |at: usize| (wanted(at) / middle).clamp(SHARES.start, SHARES.end);
        let shares: Vec<f32> = (0..grey.len()).map(|at| share(at) as f32).collect();
        // By pixels' own noise, which has no part in their shares: so the gain is not flattered.
        let (mut even, mut uneven) = ([0.0; 2], [0.0; 2]);
        for (at, share) in shares.iter().map(|&share| f64::from(share)).enumerate() {
            even = [even[0] + found[at].1, even[1] + costs[at]];
            uneven = [uneven[0] + found[at].1 / share, uneven[1] + costs[at] * share];
        }
        let gain = uneven[0] * uneven[1] / (even[0] * even[1]);
        gain.is_finite().then_some(Spread { stage: self.spp, shares, gain, round: 0 })
    }

    /// The variance of each pixel's mean, all channels together.
    fn grey_variance(&self) -> Vec<f64> {
        self.variance().iter().map(|channels| channels.iter().map(|&v| f64::from(v)).sum()).collect()
    }

    /// Rays of each pixel's samples, as far as its part of the picture tells; above 0.
    fn costs(&self) -> Vec<f64> {
        let window = self.window;
        let across = ((window.x + window.width).div_ceil(COST) - window.x / COST) as usize;
        let place =
            |x: u32, y: u32| (y / COST - window.y / COST) as usize * across + (x / COST - window.x / COST) as usize;
        let down = ((window.y + window.height).div_ceil(COST) - window.y / COST) as usize;
        let mut cells = vec![(0, 0); across * down];
        for (tile, rays) in self.tiles.iter().zip(&self.rays) {
            let cell = &mut cells[place(tile.x, tile.y)];
            *cell = (cell.0 + rays, cell.1 + tile.area());
        }
        let cost = |at: usize| {
            let (x, y) = (at as u32 % window.width, at as u32 / window.width);
            let (rays, pixels) = cells[place(window.x + x, window.y + y)];
            rays.max(1) as f64 / pixels as f64
        };
        (0..window.area()).map(cost).collect()
    }

    /// The work to double the samples of those pixels (by their place in the window) that are to have more.
    fn uneven_wave(&self, samples: impl Fn(usize) -> u32) -> Wave {
        let mut parts = Vec::new();
        for (t, tile) in self.tiles.iter().enumerate() {
            let place = |i: usize| self.place(tile, i);
            let now = |i: usize| self.uneven.as_ref().map_or(self.spp, |now| now[place(i)]);
            let mut grow: Vec<u32> = (0..tile.area()).filter(|&i| samples(place(i)) > now(i)).map(now).collect();
            grow.sort_unstable();
            grow.dedup();
            for from in grow {
                let only: Arc<[bool]> = (0..tile.area()).map(|i| now(i) == from && samples(place(i)) > from).collect();
                for block in blocks::beyond(from, 2 * from) {
                    parts.push(Part { tile: t, block, only: Some(Arc::clone(&only)) });
                }
            }
        }
        Wave::new(Arc::clone(&self.tiles), None, parts)
    }

    /// Takes in what [`Film::uneven_wave`] brought: the halves of what its pixels had become quarters.
    pub(super) fn take_uneven(&mut self, wave: Wave) {
        let mut now = self.uneven.take().unwrap_or_else(|| vec![self.spp; self.window.area()]);
        let mut sums = wave.into_sums();
        while let (Some((part, third, _)), Some((_, fourth, _))) = (sums.next(), sums.next()) {
            let tile = self.tiles[part.tile];
            let only = part.only.iter().flat_map(|only| only.iter());
            for (k, i) in only.enumerate().filter_map(|(i, is_in)| is_in.then_some(i)).enumerate() {
                now[self.place(&tile, i)] *= 2;
                let quarter = |block: usize| self.blocks[block].1[part.tile][i];
                let pair = |a: [f32; 4], b: [f32; 4]| [0, 1, 2, 3].map(|c| a[c] + b[c]);
                let new = [pair(quarter(0), quarter(1)), pair(quarter(2), quarter(3)), third[k], fourth[k]];
                for (block, new) in new.into_iter().enumerate() {
                    self.blocks[block].1[part.tile][i] = new;
                }
            }
        }
        let all: u64 = now.iter().map(|&n| u64::from(n)).sum();
        self.spp = (all as f64 / now.len() as f64).round() as u32;
        self.uneven = Some(now);
    }

    /// Samples of the pixels with fewest and with most.
    pub fn extremes(&self) -> [u32; 2] {
        let now = || self.uneven.iter().flatten().copied();
        [now().min().unwrap_or(self.spp), now().max().unwrap_or(self.spp)]
    }
}

#[cfg(test)]
#[path = "spread_tests.rs"]
mod tests;
