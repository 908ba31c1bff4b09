//! How far a picture is from what it would be with endless samples, estimated from its own samples.
//!
//! A pixel's samples are one sequence in blocks (`blocks`). If the variance of the mean of n = 2^k samples is
//! `a/n + b/n^1.5`, a part of what is sampled at random and one of a scrambled net at edges, then half the mean square
//! difference of the halves of 2n samples is `a/n + (2 - 2^-0.5) b/n^1.5`: halves of a net mend each other's errors, so
//! they differ by more than their own. The same holds for the halves of a half, and two equations give a and b. So
//! nothing is rendered for the estimate alone. (One rate for everything, fitted in the same way: 3 to 5 % too low.)
//!
//! From three halves of a net on, the third takes part. Between those numbers of samples the error is that of the last
//! of them, carried on by the model; [`net`] says how the fast part goes on there.

use super::{BLOCKS, Film, Rounded, Tile};
use rayon::prelude::*;

/// Weight of the squared mean luminance in the denominator of relMSE, as in `compare`.
pub(super) const MEAN_WEIGHT: f64 = 0.01;
/// Half the mean square difference of two halves of a net, in the fast part of a half: 2 - 2^-0.5. They are correlated
/// by c = 2^-0.5 - 1, as the whole net's fast part is 2^-1.5 of a half's.
const FAST_PAIR: f64 = 1.292_893;
/// The mean square difference of a net and the half that follows it, over 1.5, in the fast part of a half: that net's
/// fast part is 2^-1.5 of a half's, and they are correlated by c as well, so (1 + 2^-1.5 (1 - 2 c)) / 1.5.
const FAST_THIRD: f64 = 1.040_440;
/// Halves and quarters are taken to disagree about the variance by this factor at most.
const MOST_DOUBT: f64 = 16.0;
/// Twice the correlation of halves of a net, negative: 2 - 2^0.5.
const MENDED: f64 = 0.585_786;
/// Side of the squares of pixels that are left out in turn to learn how sure the estimate is; they lie on the whole
/// picture's grid.
pub(super) const CELL: u32 = 16;
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

/// The error of a small part of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Square {
    /// The pixels: 16 x 16, less at the border of the window.
    pub pixels: Tile,
    /// Their sqrt(relMSE), relative to the same as the whole picture's.
    pub error: f64,
}

/// What a film says about its errors.
#[derive(Clone, Debug)]
pub struct Errors {
    /// Of the whole picture.
    pub estimate: ErrorEstimate,
    /// Of its parts, row by row.
    pub squares: Vec<Square>,
    variance: Variance,
    /// The upper end of the interval over the value.
    reach: f64,
}

impl Errors {
    /// The upper end of the interval at `spp` samples a pixel, by what is known now.
    pub fn upper_at(&self, spp: u32) -> f64 {
        self.variance.at(spp).sqrt() * self.reach
    }

    /// About how many samples a pixel it takes until the upper end of the interval is at most `target`, which is above 0.
    pub fn spp_for(&self, target: f64) -> f64 {
        let (mut low, mut high) = (0.0, 60.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let is_enough = self.variance.smooth(f64::exp2(middle)).sqrt() * self.reach <= target;
            *(if is_enough { &mut high } else { &mut low }) = middle;
        }
        f64::exp2(high)
    }

    /// The part that is worst off.
    pub fn worst(&self) -> Square {
        let worse = |a: Square, b: Square| if b.error > a.error { b } else { a };
        self.squares.iter().copied().reduce(worse).expect("a picture has pixels")
    }

    /// Share of the pixels that are in parts whose error is above `target`.
    pub fn share_above(&self, target: f64) -> f64 {
        let area = |least: f64| {
            let above = self.squares.iter().filter(|square| square.error > least);
            above.map(|square| square.pixels.area()).sum::<usize>() as f64
        };
        area(target) / area(f64::NEG_INFINITY)
    }
}

/// The relative variance of the mean of samples as it depends on their number.
#[derive(Clone, Copy, Debug)]
struct Variance {
    /// Of `half` samples: the part that falls as 1/n, and that which falls as n^-1.5.
    slow: f64,
    fast: f64,
    half: f64,
    is_uneven: bool,
    /// Logarithm of the factor by which halves and quarters disagree beyond what the model allows.
    doubt: f64,
}

impl Variance {
    /// Of `spp` samples.
    fn at(&self, spp: u32) -> f64 {
        let n = f64::from(spp);
        if self.is_uneven {
            return self.smooth(n);
        }
        self.slow * self.half / n + self.fast * self.half.powf(1.5) * net(spp) / (n * n)
    }

    /// The same between numbers of samples that are good for nets.
    fn smooth(&self, spp: f64) -> f64 {
        self.slow * self.half / spp + self.fast * (self.half / spp).powf(1.5)
    }
}

/// The variance of the sum of the first `spp` points of a scrambled net, in units of that of one point: sqrt(2^k) for 2^k
/// points; further points mend the errors of the net before them by what they have of the net that follows it.
fn net(mut spp: u32) -> f64 {
    let mut variance = 0.0;
    while spp > 0 {
        let whole = 1 << spp.ilog2();
        spp -= whole;
        variance += f64::from(whole).sqrt() * (1.0 - MENDED * f64::from(spp) / f64::from(whole));
    }
    variance
}

/// Which blocks of a film are held against each other.
#[derive(Clone, Copy, Debug)]
struct Halves {
    /// Samples in a half of the greatest net; in that of a mean pixel where they are spread unevenly.
    size: f64,
    /// They are.
    is_uneven: bool,
    /// The half that follows the net is there.
    has_third: bool,
    /// Of `Differences::halves` in the fast part of a half.
    fast: f64,
}

impl Halves {
    /// Of pixels that have each two halves of their own: what the variance of their means is does not depend on how many
    /// samples these have.
    fn of_uneven(mean: u32) -> Self {
        Self { size: 0.5 * f64::from(mean), is_uneven: true, has_third: false, fast: FAST_PAIR }
    }

    /// Of a film with `spp` samples; `None` with fewer than four.
    fn of(spp: u32) -> Option<Self> {
        let whole = 1 << spp.checked_ilog2()?;
        let has_third = spp >= whole + whole / 2;
        let fast = if has_third { 0.5 * (FAST_PAIR + FAST_THIRD) } else { FAST_PAIR };
        (spp >= BLOCKS).then_some(Self { size: f64::from(whole / 2), is_uneven: false, has_third, fast })
    }

    /// Those of one channel of a pixel.
    fn differences(&self, blocks: &[[f32; 4]], channel: usize) -> Differences {
        let mean = |blocks: &[[f32; 4]]| {
            let (sum, count) = blocks
                .iter()
                .fold((0.0, 0.0), |(sum, count), b| (sum + f64::from(b[channel]), count + f64::from(b[3])));
            sum / f64::max(count, 1.0)
        };
        let square = |a: &[[f32; 4]], b: &[[f32; 4]]| (mean(a) - mean(b)).powi(2);
        let mut halves = 0.5 * square(&blocks[..2], &blocks[2..4]);
        if self.has_third {
            halves = 0.5 * (halves + square(&blocks[..4], &blocks[4..5]) / 1.5);
        }
        let quarters = 0.25 * (square(&blocks[..1], &blocks[1..2]) + square(&blocks[2..3], &blocks[3..4]));
        Differences { halves, quarters }
    }

    /// Beyond what the model allows, the mean (of logarithms) of what halves and what quarters say: the variance of smooth
    /// light falls in steps, at every other power of two, so that either alone is up to three times off.
    fn variance(&self, found: Differences) -> Variance {
        let (half, is_uneven) = (self.size, self.is_uneven);
        if found.halves <= 0.0 && found.quarters <= 0.0 {
            return Variance { slow: 0.0, fast: 0.0, half, is_uneven, doubt: 0.0 };
        }
        // A difference of sums may be just below nothing.
        let [halves, quarters] = [found.halves, found.quarters].map(|d| d.max(f64::MIN_POSITIVE));
        // Of quarters: twice the slow part, 2^1.5 times the fast one.
        let [all_slow, all_fast] = [2.0 * halves, 8.0_f64.sqrt() * FAST_PAIR / self.fast * halves];
        if quarters > all_fast {
            let doubt = (quarters / all_fast).min(MOST_DOUBT);
            return Variance { slow: 0.0, fast: halves / self.fast * doubt.sqrt(), half, is_uneven, doubt: doubt.ln() };
        }
        if quarters < all_slow {
            let doubt = (all_slow / quarters).min(MOST_DOUBT);
            return Variance { slow: halves / doubt.sqrt(), fast: 0.0, half, is_uneven, doubt: doubt.ln() };
        }
        let fast = (quarters - all_slow) / (8.0_f64.sqrt() * FAST_PAIR - 2.0 * self.fast);
        let fast = fast.min(halves / self.fast);
        Variance { slow: halves - self.fast * fast, fast, half, is_uneven, doubt: 0.0 }
    }

    /// The variance of the mean of `spp` samples of one channel of a pixel, by so few differences that only the slow part
    /// is told from them, as if there were no other: with a net's part, too high by 2.3 at most.
    fn safe_variance(&self, found: Differences, spp: u32) -> f64 {
        // Weighted by how many differences are in them.
        let n = if self.has_third { 2.0 } else { 1.0 };
        let slow = (n * found.halves + found.quarters) / (n + 2.0);
        slow * self.size / f64::from(spp)
    }
}

/// Mean square differences of blocks, each the variance of a block's mean where samples are independent; summed over
/// pixels and channels.
#[derive(Clone, Copy, Debug, Default)]
struct Differences {
    /// Of halves.
    halves: f64,
    /// Of the halves of two halves.
    quarters: f64,
}

impl Differences {
    fn add(&mut self, weight: f64, other: Self) {
        self.halves += weight * other.halves;
        self.quarters += weight * other.quarters;
    }
}

/// What is summed of a square of pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    /// Relative to the pixels among their neighbours.
    differences: Differences,
    /// Relative to the pixels themselves.
    by_own: Differences,
}

impl Film {
    /// The estimated errors of `pixels`, which are [`Film::mean`]; `None` with fewer than four samples, or where nothing
    /// was seen but black.
    pub fn errors(&self, pixels: &[[f32; 3]]) -> Option<Errors> {
        let halves = self.halves()?;
        let count = pixels.len() as f64;
        let mean = pixels.iter().map(grey).sum::<f64>() / count;
        if !mean.is_finite() || mean <= 0.0 {
            return None;
        }
        let (places, cells) = self.cells(pixels, mean, halves);
        let all = cells.iter().fold(Cell::default(), |mut all, cell| {
            all.differences.add(1.0, cell.differences);
            all.by_own.add(1.0, cell.by_own);
            all
        });
        let error =
            |differences: Differences, count: f64| (halves.variance(differences).at(self.spp) / (3.0 * count)).sqrt();
        let value = error(all.differences, count);
        // Each cell left out in turn (the jackknife), on the logarithm; and how much it is a matter of what pixels in which
        // few samples were bright will show in the end.
        let mut deviation = 0.0;
        if value > 0.0 && cells.len() > 1 {
            let share = cells.len() as f64;
            for cell in &cells {
                let mut rest = all.differences;
                rest.add(-1.0, cell.differences);
                let without = error(rest, count * (share - 1.0) / share);
                // What is left is nothing where all of the error is in one cell.
                deviation += (without.max(0.1 * value) / value).ln().powi(2);
            }
            deviation *= (share - 1.0) / share;
            deviation += (0.5 * (value / error(all.by_own, count)).ln()).powi(2);
        }
        let doubt = 0.5 * halves.variance(all.differences).doubt;
        let reach = (Z95 * (deviation + MODEL * MODEL + doubt * doubt).sqrt()).exp();
        let squares = places.iter().zip(&cells).map(|(&pixels, cell)| {
            let error = error(cell.differences, pixels.area() as f64);
            Square { pixels, error }
        });
        let mut relative = Differences::default();
        relative.add(1.0 / (3.0 * count), all.differences);
        Some(Errors {
            estimate: ErrorEstimate { value, ci95: [value / reach, value * reach] },
            squares: squares.collect(),
            variance: halves.variance(relative),
            reach,
        })
    }

    /// What is held against each other.
    fn halves(&self) -> Option<Halves> {
        if self.uneven.is_some() { Some(Halves::of_uneven(self.spp)) } else { Halves::of(self.spp) }
    }

    /// The squares of the window, row by row, and what is summed of each; `mean` is that of `pixels`.
    fn cells(&self, pixels: &[[f32; 3]], mean: f64, halves: Halves) -> (Vec<Tile>, Vec<Cell>) {
        let window = self.window;
        let first = [window.x / CELL, window.y / CELL];
        let across = ((window.x + window.width).div_ceil(CELL) - first[0]) as usize;
        let width = window.width as usize;
        let sum = |place: &Tile, blocks: &dyn Fn(u32, u32) -> [[f32; 4]; BLOCKS as usize + 1]| {
            let mut cell = Cell::default();
            for y in place.y..place.y + place.height {
                for x in place.x..place.x + place.width {
                    let blocks = blocks(x, y);
                    let mut found = Differences::default();
                    (0..3).for_each(|channel| found.add(1.0, halves.differences(&blocks, channel)));
                    let (x, y) = ((x - window.x) as usize, (y - window.y) as usize);
                    // A pixel that is too bright by a lucky sample would be told that it may be off by more.
                    let greys = [among_neighbours(pixels, width, x, y), grey(&pixels[y * width + x])];
                    let [weight, own] = greys.map(|grey| 1.0 / (grey * grey + MEAN_WEIGHT * mean * mean));
                    cell.differences.add(weight, found);
                    cell.by_own.add(own, found);
                }
            }
            cell
        };
        let of_tile = |(t, tile): (usize, &Tile)| {
            let sums: Vec<&Rounded> = self.blocks.iter().map(|(_, tiles)| &tiles[t]).collect();
            let blocks = |x: u32, y: u32| {
                let at = ((y - tile.y) * tile.width + x - tile.x) as usize;
                let mut blocks = [[0.0; 4]; BLOCKS as usize + 1];
                blocks.iter_mut().zip(&sums).for_each(|(block, sums)| *block = sums[at]);
                blocks
            };
            let place = |place: Tile| {
                let at = (place.y / CELL - first[1]) as usize * across + (place.x / CELL - first[0]) as usize;
                (at, place, sum(&place, &blocks))
            };
            squares(tile).map(place).collect::<Vec<_>>()
        };
        let mut found: Vec<_> = self.tiles.par_iter().enumerate().flat_map_iter(of_tile).collect();
        // Sums go from square to square in one order, whatever the tiles.
        found.sort_unstable_by_key(|(at, ..)| *at);
        found.into_iter().map(|(_, place, cell)| (place, cell)).unzip()
    }

    /// The variance of each channel of [`Film::mean`], estimated on the safe side; infinite where there is one sample.
    pub fn variance(&self) -> Vec<[f32; 3]> {
        let mut variance = vec![[0.0; 3]; self.window.area()];
        let halves = self.halves();
        self.each_pixel(|at, blocks| {
            variance[at] = [0, 1, 2].map(|channel| match halves {
                Some(halves) => halves.safe_variance(halves.differences(blocks, channel), self.spp) as f32,
                None => variance_of_mean(blocks, channel) as f32,
            });
        });
        variance
    }
}

/// Of blocks that are single samples, or none if that was dropped.
fn variance_of_mean(samples: &[[f32; 4]], channel: usize) -> f64 {
    let there: Vec<f64> = samples.iter().filter(|s| s[3] > 0.0).map(|s| f64::from(s[channel])).collect();
    let n = there.len() as f64;
    if n < 2.0 {
        return f64::INFINITY;
    }
    let mean = there.iter().sum::<f64>() / n;
    there.iter().map(|sample| (sample - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))
}

/// The squares of the whole picture's grid that `tile` is made of.
fn squares(tile: &Tile) -> impl Iterator<Item = Tile> + use<> {
    let parts = |from: u32, to: u32| {
        let cut = move |i: u32| (from.max(i * CELL), to.min((i + 1) * CELL));
        (from / CELL..to.div_ceil(CELL)).map(cut)
    };
    let (rows, tile) = (parts(tile.y, tile.y + tile.height), *tile);
    rows.flat_map(move |(top, bottom)| {
        let square = move |(x, right)| Tile { x, y: top, width: right - x, height: bottom - top };
        parts(tile.x, tile.x + tile.width).map(square)
    })
}

pub(super) fn grey(pixel: &[f32; 3]) -> f64 {
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

#[cfg(test)]
#[path = "estimate_tests.rs"]
mod tests;
