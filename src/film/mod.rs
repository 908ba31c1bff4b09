//! The film: per pixel sums over blocks of the sample sequence, from which mean and error come.
//!
//! A picture's samples are cut into [`BLOCKS`] consecutive blocks. A (tile, block) pair is summed by one worker, rounded
//! once and stored whole, so no addition depends on which thread did what, and the spread of the block means tells the
//! error. Sums are compensated f64: paths of a pixel end in another order when a window is rendered, and its pixels must
//! still be those of the whole picture.

mod estimate;

pub use estimate::ErrorEstimate;

use std::ops::Range;
use std::sync::OnceLock;

/// Blocks a pixel's samples are cut into (fewer if there are fewer samples).
pub const BLOCKS: u32 = 4;

/// Tiles are this many pixels wide and high, less at the border.
pub const TILE: u32 = 32;

/// A rectangle of pixels, in pixels of the whole picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Left edge.
    pub x: u32,
    /// Top edge.
    pub y: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

impl Tile {
    /// Pixels.
    pub fn area(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// Sums of one tile over one block of samples, while it is rendered.
#[derive(Debug)]
pub struct TileSums {
    /// Per pixel, row by row: R, G, B and the number of samples in them.
    sums: Vec<([Sum; 3], u32)>,
}

/// A sum whose rounding errors are kept beside it (Knuth's two-sum): 106 bits, so that the order of additions does not
/// show after rounding to f32.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    high: f64,
    low: f64,
}

impl Sum {
    #[inline]
    fn add(&mut self, value: f64) {
        let sum = self.high + value;
        let part = sum - self.high;
        self.low += (self.high - (sum - part)) + (value - part);
        self.high = sum;
    }

    fn rounded(self) -> f32 {
        (self.high + self.low) as f32
    }
}

impl TileSums {
    /// Nothing yet.
    pub fn new(tile: &Tile) -> Self {
        Self { sums: vec![([Sum::default(); 3], 0); tile.area()] }
    }

    /// Adds a finite sample to pixel `pixel` (row by row in the tile).
    #[inline]
    pub fn add(&mut self, pixel: u32, radiance: [f32; 3]) {
        let (sum, count) = &mut self.sums[pixel as usize];
        for (s, r) in sum.iter_mut().zip(radiance) {
            s.add(f64::from(r));
        }
        *count += 1;
    }
}

/// All block sums of a picture window.
#[derive(Debug)]
pub struct Film {
    tiles: Vec<Tile>,
    blocks: Vec<Range<u32>>,
    /// `[block][tile]`, each R, G, B sums and the number of samples, per pixel.
    sums: Vec<OnceLock<Box<[[f32; 4]]>>>,
    window: Tile,
}

impl Film {
    /// A film for `window` with `spp` samples a pixel.
    pub fn new(window: Tile, spp: u32) -> Self {
        let mut tiles = Vec::new();
        // Tiles lie on the whole picture's grid, so a window's pixels are those of the whole picture.
        let mut y = window.y;
        while y < window.y + window.height {
            let bottom = (y / TILE + 1) * TILE;
            let height = bottom.min(window.y + window.height) - y;
            let mut x = window.x;
            while x < window.x + window.width {
                let right = (x / TILE + 1) * TILE;
                let width = right.min(window.x + window.width) - x;
                tiles.push(Tile { x, y, width, height });
                x += width;
            }
            y += height;
        }
        let n = BLOCKS.min(spp);
        let at = |i: u32| (u64::from(i) * u64::from(spp) / u64::from(n)) as u32;
        let blocks: Vec<_> = (0..n).map(|i| at(i)..at(i + 1)).collect();
        let sums = (0..tiles.len() * blocks.len()).map(|_| OnceLock::new()).collect();
        Self { tiles, blocks, sums, window }
    }

    /// Units of work: (tile, block) pairs.
    pub fn units(&self) -> usize {
        self.sums.len()
    }

    /// The tile and the samples of unit `i`; the first block of all tiles comes first.
    pub fn unit(&self, i: usize) -> (Tile, Range<u32>) {
        (self.tiles[i % self.tiles.len()], self.blocks[i / self.tiles.len()].clone())
    }

    /// Stores the sums of unit `i`.
    ///
    /// # Panics
    /// When it was stored before: two workers took one unit.
    pub fn store(&self, i: usize, sums: &TileSums) {
        let rounded =
            sums.sums.iter().map(|&([r, g, b], n)| [r.rounded(), g.rounded(), b.rounded(), n as f32]).collect();
        assert!(self.sums[i].set(rounded).is_ok(), "each unit is rendered once");
    }

    /// The mean of each pixel of the window, row by row; 0 where no sample survived.
    ///
    /// # Panics
    /// When a unit is missing.
    pub fn mean(&self) -> Vec<[f32; 3]> {
        let mut pixels = vec![[0.0; 3]; self.window.area()];
        let mut of_pixel = |x: usize, y: usize, blocks: [[f32; 4]; BLOCKS as usize]| {
            let (mut sum, mut count) = ([0.0f64; 3], 0.0f64);
            for block in blocks {
                for (s, v) in sum.iter_mut().zip(block) {
                    *s += f64::from(v);
                }
                count += f64::from(block[3]);
            }
            pixels[y * self.window.width as usize + x] = sum.map(|s| (s / count.max(1.0)) as f32);
        };
        (0..self.tiles.len()).for_each(|tile| self.each_pixel_of(tile, &mut of_pixel));
        pixels
    }

    /// Calls `with` for each pixel of tile `t`, by its place in the window, with its blocks' sums; zeroes for blocks that
    /// there are none of.
    fn each_pixel_of(&self, t: usize, mut with: impl FnMut(usize, usize, [[f32; 4]; BLOCKS as usize])) {
        let tile = &self.tiles[t];
        let units: Vec<&[[f32; 4]]> = (0..self.blocks.len())
            .map(|block| &**self.sums[block * self.tiles.len() + t].get().expect("every unit was rendered"))
            .collect();
        for i in 0..tile.area() {
            let mut blocks = [[0.0; 4]; BLOCKS as usize];
            blocks.iter_mut().zip(&units).for_each(|(block, unit)| *block = unit[i]);
            let (x, y) = (i % tile.width as usize, i / tile.width as usize);
            with((tile.x - self.window.x) as usize + x, (tile.y - self.window.y) as usize + y, blocks);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_in_one_tile_and_every_sample_in_one_block() {
        for (window, spp) in [((0, 0, 100, 37), 1), ((31, 5, 2, 70), 3), ((64, 64, 32, 32), 64), ((7, 9, 1, 1), 7)] {
            let window = Tile { x: window.0, y: window.1, width: window.2, height: window.3 };
            let film = Film::new(window, spp);
            let mut samples = vec![0; window.area()];
            for i in 0..film.units() {
                let (tile, range) = film.unit(i);
                assert!(!range.is_empty());
                for y in tile.y..tile.y + tile.height {
                    for x in tile.x..tile.x + tile.width {
                        samples[((y - window.y) * window.width + x - window.x) as usize] += range.len();
                    }
                }
            }
            assert!(samples.iter().all(|&n| n == spp as usize));
        }
    }

    #[test]
    fn acc_01_mean_of_many_samples_is_exact_to_rounding_and_dropped_samples_leave_sum_and_weight() {
        let window = Tile { x: 0, y: 0, width: 2, height: 1 };
        let film = Film::new(window, 4);
        for i in 0..film.units() {
            let (tile, _) = film.unit(i);
            let mut sums = TileSums::new(&tile);
            for k in 0..1_000_000u32 {
                sums.add(0, [1.0 + (k % 2) as f32 * 1e-3, 0.1, 1e6]);
            }
            film.store(i, &sums);
        }
        let mean = film.mean();
        for (got, exact) in mean[0].iter().zip([1.0005, f64::from(0.1f32), 1e6]) {
            assert!((f64::from(*got) / exact - 1.0).abs() < 2e-7, "{got} for {exact}");
        }
        assert_eq!(mean[1], [0.0; 3]);
    }
}
