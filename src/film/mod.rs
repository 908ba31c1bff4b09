//! The film: per pixel sums over blocks of the sample sequence, from which mean and error come.
//!
//! A picture's samples are taken in waves; after each of them the film may be read, and may go on. Where the sequence is
//! cut into blocks (`blocks`) depends on the number of samples alone, and so do all bits of the picture: one that was
//! stopped at 96 samples is that of `--spp 96`. A (tile, block) pair is summed by one worker, rounded once and stored
//! whole, so no addition depends on which thread did what, and the spread of the block means tells the error. Sums are
//! compensated f64: paths of a pixel end in another order when a window is rendered, and its pixels must still be those
//! of the whole picture.

pub mod blocks;
mod estimate;
mod spread;

pub use estimate::{ErrorEstimate, Errors, Square};
pub use spread::Spread;

use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// Blocks a pixel's samples are cut into where they are a power of two (fewer if there are fewer samples).
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
    block: Range<u32>,
    /// The number of the first leaf, and how many the block has.
    first: u32,
    leaves: u32,
    /// Per pixel, row by row, and leaf: R, G, B and the number of samples in them.
    sums: Vec<([Sum; 3], u32)>,
    /// Rays that it took.
    rays: u64,
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

/// R, G, B sums of each pixel of a tile and the number of samples in them.
type Rounded = Box<[[f32; 4]]>;

/// Adds `other`, pixel by pixel.
fn add_all(sums: &mut Rounded, other: &Rounded) {
    for (sum, other) in sums.iter_mut().zip(other) {
        sum.iter_mut().zip(other).for_each(|(sum, other)| *sum += other);
    }
}

impl TileSums {
    /// Nothing yet, of samples in `block` (see [`Wave::unit`]).
    pub fn new(tile: &Tile, block: &Range<u32>) -> Self {
        let first = blocks::leaf(block.start);
        let leaves = blocks::leaf(block.end - 1) - first + 1;
        let sums = vec![([Sum::default(); 3], 0); tile.area() * leaves as usize];
        Self { block: block.clone(), first, leaves, sums, rays: 0 }
    }

    /// Adds the finite sample `sample` of the block to pixel `pixel` (row by row in the tile).
    #[inline]
    pub fn add(&mut self, pixel: u32, sample: u32, radiance: [f32; 3]) {
        let leaf = blocks::leaf(sample) - self.first;
        let (sum, count) = &mut self.sums[pixel as usize * self.leaves as usize + leaf as usize];
        for (s, r) in sum.iter_mut().zip(radiance) {
            s.add(f64::from(r));
        }
        *count += 1;
    }

    /// Notes how many rays it took.
    pub fn add_rays(&mut self, rays: u64) {
        self.rays += rays;
    }

    /// The sums of the whole block.
    fn rounded(&self) -> Rounded {
        let of_leaf = |leaf: usize| -> Rounded {
            let sums = self.sums.iter().skip(leaf).step_by(self.leaves as usize);
            sums.map(|&([r, g, b], n)| [r.rounded(), g.rounded(), b.rounded(), n as f32]).collect()
        };
        let mut parts =
            blocks::leaves(&self.block).into_iter().enumerate().map(|(i, leaf)| (leaf, of_leaf(i))).collect();
        blocks::joined(&self.block, &mut parts, &|sums, other| add_all(sums, &other))
    }
}

/// All block sums of a picture window.
#[derive(Debug)]
pub struct Film {
    tiles: Arc<[Tile]>,
    /// Samples a pixel; the mean, rounded, once they are spread unevenly.
    spp: u32,
    /// Then those of each pixel of the window: powers of two, four blocks each.
    uneven: Option<Vec<u32>>,
    /// Rays so far, by tile.
    rays: Vec<u64>,
    /// Those of [`blocks::layout`], each with the sums of every tile.
    blocks: Vec<(Range<u32>, Vec<Rounded>)>,
    window: Tile,
}

/// Samples that a [`Film`] goes on by: units of work, which any thread may do.
#[derive(Debug)]
pub struct Wave {
    tiles: Arc<[Tile]>,
    /// Samples a pixel when it is done; `None` where only some pixels go on.
    to: Option<u32>,
    /// The units: block by block all tiles, or two blocks each of some pixels of a tile.
    parts: Vec<Part>,
    /// Of each unit and the pixels that it is about, with the rays that it took.
    sums: Vec<OnceLock<(Rounded, u64)>>,
}

/// A unit of work.
#[derive(Debug)]
struct Part {
    tile: usize,
    block: Range<u32>,
    /// The pixels of the tile that it is about, row by row; `None`: all.
    only: Option<Arc<[bool]>>,
}

impl Wave {
    fn new(tiles: Arc<[Tile]>, to: Option<u32>, parts: Vec<Part>) -> Self {
        let sums = parts.iter().map(|_| OnceLock::new()).collect();
        Self { tiles, to, parts, sums }
    }

    /// Units of work: (tile, block) pairs.
    pub fn units(&self) -> usize {
        self.sums.len()
    }

    /// The tile and the samples of unit `i`; the first block of all tiles comes first.
    pub fn unit(&self, i: usize) -> (Tile, Range<u32>) {
        let Part { tile, block, .. } = &self.parts[i];
        (self.tiles[*tile], block.clone())
    }

    /// The pixels of its tile that unit `i` is about, row by row; `None`: all.
    pub fn only(&self, i: usize) -> Option<Arc<[bool]>> {
        self.parts[i].only.clone()
    }

    /// The units in order with their sums and rays.
    fn into_sums(self) -> impl Iterator<Item = (Part, Rounded, u64)> {
        self.parts.into_iter().zip(self.sums).map(|(part, sums)| {
            let (sums, rays) = sums.into_inner().expect("every unit was rendered");
            (part, sums, rays)
        })
    }

    /// Stores the sums of unit `i`.
    ///
    /// # Panics
    /// When it was stored before: two workers took one unit.
    pub fn store(&self, i: usize, sums: &TileSums) {
        let mut rounded = sums.rounded();
        if let Some(only) = &self.parts[i].only {
            rounded = rounded.iter().zip(only.iter()).filter_map(|(sums, is_in)| is_in.then_some(*sums)).collect();
        }
        assert!(self.sums[i].set((rounded, sums.rays)).is_ok(), "each unit is rendered once");
    }
}

impl Film {
    /// A film for `window` without samples, in tiles of `side` x `side` pixels (less at the border), a multiple of 16;
    /// nothing but the way in which threads share the work depends on it.
    pub fn new(window: Tile, side: u32) -> Self {
        assert!(side > 0 && side.is_multiple_of(estimate::CELL), "tiles are made of whole squares");
        let mut tiles = Vec::new();
        // Tiles lie on the whole picture's grid, so a window's pixels are those of the whole picture.
        let mut y = window.y;
        while y < window.y + window.height {
            let bottom = (y / side + 1) * side;
            let height = bottom.min(window.y + window.height) - y;
            let mut x = window.x;
            while x < window.x + window.width {
                let right = (x / side + 1) * side;
                let width = right.min(window.x + window.width) - x;
                tiles.push(Tile { x, y, width, height });
                x += width;
            }
            y += height;
        }
        let rays = vec![0; tiles.len()];
        Self { tiles: tiles.into(), spp: 0, uneven: None, rays, blocks: Vec::new(), window }
    }

    /// Samples a pixel that it holds; the mean, rounded, where they are spread unevenly.
    pub fn spp(&self) -> u32 {
        self.spp
    }

    /// The work to go on to `to` samples a pixel.
    ///
    /// # Panics
    /// When there are as many already, or the film ends where it cannot go on ([`blocks::is_end`]).
    pub fn wave(&self, to: u32) -> Wave {
        assert!(to > self.spp && blocks::is_end(self.spp), "films go on from the end of a block");
        assert!(self.uneven.is_none(), "what is spread goes on so");
        let all =
            |block: Range<u32>| (0..self.tiles.len()).map(move |tile| Part { tile, block: block.clone(), only: None });
        Wave::new(Arc::clone(&self.tiles), Some(to), blocks::beyond(self.spp, to).into_iter().flat_map(all).collect())
    }

    /// Takes in what a wave of this film brought.
    ///
    /// # Panics
    /// When a unit is missing.
    pub fn take(&mut self, wave: Wave) {
        let Some(to) = wave.to else { return self.take_uneven(wave) };
        for (Part { tile, block, .. }, sums, rays) in wave.into_sums() {
            self.rays[tile] += rays;
            match self.blocks.last_mut() {
                Some((last, tiles)) if *last == block => tiles.push(sums),
                _ => self.blocks.push((block, vec![sums])),
            }
        }
        let join = |sums: &mut Vec<Rounded>, other: Vec<Rounded>| {
            sums.par_iter_mut().zip(other).for_each(|(sums, other)| add_all(sums, &other));
        };
        let layout = blocks::layout(to).into_iter();
        self.blocks = layout.map(|block| (block.clone(), blocks::joined(&block, &mut self.blocks, &join))).collect();
        self.spp = to;
    }

    /// The mean of each pixel of the window, row by row; 0 where no sample survived.
    pub fn mean(&self) -> Vec<[f32; 3]> {
        let mut pixels = vec![[0.0; 3]; self.window.area()];
        self.each_pixel(|at, blocks| {
            let [r, g, b, count] = blocks.iter().fold([0.0f64; 4], |mut sum, block| {
                sum.iter_mut().zip(block).for_each(|(s, v)| *s += f64::from(*v));
                sum
            });
            pixels[at] = [r, g, b].map(|s| (s / count.max(1.0)) as f32);
        });
        pixels
    }

    /// How many samples are in the mean of each pixel: those that were finite.
    pub fn counts(&self) -> Vec<u32> {
        let mut counts = vec![0; self.window.area()];
        self.each_pixel(|at, blocks| counts[at] = blocks.iter().map(|block| block[3] as u32).sum());
        counts
    }

    /// The place in the window of pixel `i` of `tile`.
    fn place(&self, tile: &Tile, i: usize) -> usize {
        let (x, y) = (tile.x - self.window.x, tile.y - self.window.y);
        let (across, down) = (i % tile.width as usize, i / tile.width as usize);
        (y as usize + down) * self.window.width as usize + x as usize + across
    }

    /// Calls `with` for each pixel of the window, by its place in it, with its sums over the film's blocks.
    fn each_pixel(&self, mut with: impl FnMut(usize, &[[f32; 4]])) {
        let mut blocks = Vec::with_capacity(self.blocks.len());
        for (t, tile) in self.tiles.iter().enumerate() {
            for i in 0..tile.area() {
                blocks.clear();
                blocks.extend(self.blocks.iter().map(|(_, tiles)| tiles[t][i]));
                with(self.place(tile, i), &blocks);
            }
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
            for side in [TILE, 16] {
                let wave = Film::new(window, side).wave(spp);
                let mut samples = vec![0; window.area()];
                for i in 0..wave.units() {
                    let (tile, range) = wave.unit(i);
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
    }

    /// A film of `window` after waves that end at `ends`, of `radiance(x, y, sample)`.
    fn film(window: Tile, side: u32, ends: &[u32], radiance: impl Fn(u32, u32, u32) -> [f32; 3]) -> Film {
        let mut film = Film::new(window, side);
        for &end in ends {
            let wave = film.wave(end);
            for i in 0..wave.units() {
                let (tile, samples) = wave.unit(i);
                let mut sums = TileSums::new(&tile, &samples);
                for pixel in 0..tile.area() as u32 {
                    let (x, y) = (tile.x + pixel % tile.width, tile.y + pixel / tile.width);
                    samples.clone().for_each(|sample| sums.add(pixel, sample, radiance(x, y, sample)));
                }
                wave.store(i, &sums);
            }
            film.take(wave);
        }
        film
    }

    #[test]
    fn det_01_the_bits_of_a_picture_do_not_depend_on_its_waves_or_tiles() {
        let window = Tile { x: 10, y: 20, width: 50, height: 30 };
        // Of every size, so that each rounding shows.
        let radiance = |x: u32, y: u32, sample: u32| {
            let mixed = (x * 7919 + y * 104_729 + sample * 1_299_709).wrapping_mul(0x7feb_352d);
            [1.0, 1e-3, 1e4].map(|scale| scale * (mixed >> 8) as f32 / 16_777_216.0)
        };
        for (ends, spp) in
            [(&[32, 64, 96, 128][..], 128), (&[1, 2, 4, 8, 16, 32, 37], 37), (&[64, 96], 96), (&[3, 6], 6)]
        {
            let (in_waves, at_once) = (film(window, 16, ends, radiance), film(window, TILE, &[spp], radiance));
            let pixels = at_once.mean();
            assert_eq!(in_waves.mean(), pixels, "{spp}");
            let estimate = |film: &Film| film.errors(&pixels).map(|errors| errors.estimate);
            assert_eq!(estimate(&in_waves), estimate(&at_once), "{spp}");
            assert_eq!(in_waves.variance(), at_once.variance(), "{spp}");
            assert!(in_waves.counts().iter().all(|&n| n == spp));
        }
    }

    #[test]
    fn acc_01_mean_of_many_samples_is_exact_to_rounding_and_dropped_samples_leave_sum_and_weight() {
        let window = Tile { x: 0, y: 0, width: 2, height: 1 };
        let mut film = Film::new(window, TILE);
        let wave = film.wave(1 << 20);
        for i in 0..wave.units() {
            let (tile, samples) = wave.unit(i);
            let mut sums = TileSums::new(&tile, &samples);
            for k in samples {
                sums.add(0, k, [1.0 + (k % 2) as f32 * 1e-3, 0.1, 1e6]);
            }
            wave.store(i, &sums);
        }
        film.take(wave);
        let mean = film.mean();
        for (got, exact) in mean[0].iter().zip([1.0005, f64::from(0.1f32), 1e6]) {
            assert!((f64::from(*got) / exact - 1.0).abs() < 2e-7, "{got} for {exact}");
        }
        assert_eq!(mean[1], [0.0; 3]);
        assert_eq!(film.counts(), [1 << 20, 0]);
    }
}
