//! How bright a picture is, and the exposure that shows it: `--exposure auto`.
//!
//! After Reinhard et al. 2002, "Photographic Tone Reproduction for Digital Images", section 3: the logarithmic mean of
//! the luminance becomes middle grey. Theirs counts every pixel; here, so that neither a firefly nor a black background
//! decides, the brightest hundredth counts as its dimmest pixel and what lies ten stops below that not at all, and the
//! highlights are kept between half and four times white.

/// The exposure of a picture as asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Radiance is multiplied by 2 to this.
    Stops(f64),
    /// From the picture's own pixels: [`Luminances::auto_exposure`].
    Auto,
}

impl Default for Exposure {
    fn default() -> Self {
        Self::Stops(0.0)
    }
}

impl Exposure {
    /// Stops for the picture that `luminances` counts, which is asked for only where it decides; 0 for one without light.
    pub fn resolve(self, luminances: impl FnOnce() -> Luminances) -> f64 {
        match self {
            Self::Stops(stops) => stops,
            Self::Auto => luminances().auto_exposure().unwrap_or(0.0),
        }
    }
}

/// Exposures beyond this many stops either way are not used.
pub const MOST_STOPS: f64 = 100.0;
/// Where the logarithmic mean goes, of white.
const MIDDLE_GREY: f64 = 0.18;
/// The share of the lit pixels that are highlights and count as the dimmest of them.
const HIGHLIGHTS: f64 = 0.01;
/// Pixels this many stops below the highlights are black whatever the exposure.
const BLACK_STOPS: f64 = 10.0;
/// The share of the metered pixels that may be brighter than [`BRIGHT_RANGE`] says.
const BRIGHT: f64 = 0.05;
/// Where the dimmest of the bright pixels may go, of white: a pale picture stays pale, and a window may be lost before
/// its room is.
const BRIGHT_RANGE: [f64; 2] = [0.5, 4.0];

/// Bits of an f32 that are left out of the number of its bin: 6 bits of the mantissa stay, 64 bins a stop.
const DROPPED_BITS: u32 = 17;
/// Bins of positive finite numbers.
const BINS: usize = (f32::INFINITY.to_bits() >> DROPPED_BITS) as usize;

/// How many pixels have which luminance. Counts are whole numbers, so no order of pixels changes anything.
#[derive(Clone, Debug)]
pub struct Luminances {
    /// `[BINS]` pixels by the upper bits of their luminance, which grow with it.
    bins: Vec<u64>,
    /// Pixels in `bins`: finite and brighter than 0.
    lit: u64,
    /// All pixels.
    pixels: u64,
}

impl Luminances {
    /// Counts `pixels`, linear Rec.709, nits; what is negative counts as 0.
    pub fn of(pixels: &[[f32; 3]]) -> Self {
        let (mut bins, mut lit) = (vec![0; BINS], 0);
        for pixel in pixels.iter().filter(|pixel| pixel.iter().all(|c| c.is_finite())) {
            let [r, g, b] = pixel.map(|c| f64::from(c.max(0.0)));
            // Weights of ITU-R BT.709-6, item 3.2, with the digits of the sRGB matrix.
            let luminance = (0.2126 * r + 0.7152 * g + 0.0722 * b) as f32;
            if luminance > 0.0 {
                // Rounding may take the sum of three greatest numbers beyond the greatest.
                bins[((luminance.to_bits() >> DROPPED_BITS) as usize).min(BINS - 1)] += 1;
                lit += 1;
            }
        }
        Self { bins, lit, pixels: pixels.len() as u64 }
    }

    /// The least luminance of the brightest `share` of all pixels, nits, to 1/64 stop; 0 where fewer are lit.
    pub fn brightest(&self, share: f64) -> f64 {
        self.nth_brightest(rank(share, self.pixels)).map_or(0.0, f64::exp2)
    }

    /// Stops that show the picture best, a multiple of 0.1 (so that it can be typed) within `MOST_STOPS`; `None` for a
    /// picture without light.
    pub fn auto_exposure(&self) -> Option<f64> {
        let top = self.nth_brightest(rank(HIGHLIGHTS, self.lit))?;
        let metered = || self.counted().filter(|(log, _)| *log >= top - BLACK_STOPS);
        let count: u64 = metered().map(|(_, count)| count).sum();
        let sum: f64 = metered().map(|(log, count)| log.min(top) * count as f64).sum();
        let bright = self.nth_brightest(rank(BRIGHT, count))?;
        let [least, most] = BRIGHT_RANGE.map(|white| white.log2() - bright);
        let stops = (MIDDLE_GREY.log2() - sum / count as f64).clamp(least, most).clamp(-MOST_STOPS, MOST_STOPS);
        // Adding 0 makes -0 a plain 0.
        Some((stops * 10.0).round() / 10.0 + 0.0)
    }

    /// Logarithm to base 2 of the luminance of the middle of every bin that has pixels, brightest first, with the pixels.
    fn counted(&self) -> impl Iterator<Item = (f64, u64)> {
        let middle = |bin: usize| f32::from_bits(((bin as u32) << DROPPED_BITS) | (1 << (DROPPED_BITS - 1)));
        let bins = self.bins.iter().enumerate().rev();
        bins.filter(|(_, count)| **count > 0).map(move |(bin, &count)| (f64::from(middle(bin)).log2(), count))
    }

    /// Logarithm to base 2 of the luminance of the `rank`-th brightest pixel, from 1; `None` where fewer are lit.
    fn nth_brightest(&self, rank: u64) -> Option<f64> {
        let mut seen = 0;
        self.counted().find_map(|(log, count)| {
            seen += count;
            (seen >= rank).then_some(log)
        })
    }
}

/// How many pixels a share of `count` is: at least one.
fn rank(share: f64, count: u64) -> u64 {
    ((share * count as f64).ceil() as u64).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn auto(pixels: &[[f32; 3]]) -> Option<f64> {
        Luminances::of(pixels).auto_exposure()
    }

    /// Greys from 2^-3 to 2^1 times `level`, whose logarithmic mean is `level / 2` and whose bright ones are `2 level`.
    fn ramp(level: f32) -> Vec<[f32; 3]> {
        (0..1000).map(|i| [level * (-3.0 + 4.0 * i as f32 / 999.0).exp2(); 3]).collect()
    }

    #[test]
    fn logarithmic_mean_becomes_middle_grey() {
        // log2(0.18 / 0.5) = -1.47 for level 1; the highlights, at 1.74, go to 0.63.
        assert_eq!(auto(&ramp(1.0)), Some(-1.5));
        for stops in [-20, -3, 5, 30] {
            assert_eq!(auto(&ramp((-stops as f32).exp2())), Some(f64::from(stops) - 1.5), "{stops}");
        }
    }

    #[test]
    fn neither_fireflies_nor_a_dark_background_decide() {
        let plain = auto(&ramp(1.0)).unwrap();
        let mut pixels = ramp(1.0);
        for pixel in pixels.iter_mut().step_by(112) {
            *pixel = [1e30, 1e20, f32::MAX];
        }
        assert!((auto(&pixels).unwrap() - plain).abs() < 0.11, "{:?}", auto(&pixels));
        for background in [0.0, 1e-20, 1e-5, -1.0, f32::NAN, f32::INFINITY] {
            let mut pixels = vec![[background; 3]; 9000];
            pixels.extend(ramp(1.0));
            assert!((auto(&pixels).unwrap() - plain).abs() < 0.11, "{background}: {:?}", auto(&pixels));
        }
    }

    #[test]
    fn highlights_stay_between_half_and_four_times_white() {
        // A white wall would become grey.
        assert_eq!(auto(&[[0.5; 3]; 100]), Some(0.0));
        assert_eq!(auto(&[[4.0; 3]; 100]), Some(-3.0));
        // A room of 1/1024 nit with a window of 1 nit over a tenth of the picture would lose the window altogether.
        let mut pixels = vec![[0.25_f32.powi(5); 3]; 900];
        pixels.extend([[1.0; 3]; 100]);
        assert_eq!(auto(&pixels), Some(2.0));
    }

    #[test]
    fn order_does_not_matter_and_nothing_lit_has_no_exposure() {
        let mut pixels = ramp(0.3);
        let forward = auto(&pixels);
        pixels.reverse();
        assert_eq!(auto(&pixels), forward);
        for dark in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(auto(&[[dark; 3]; 4]), None);
            assert_eq!(Exposure::Auto.resolve(|| Luminances::of(&[[dark; 3]; 4])), 0.0);
        }
        assert_eq!(auto(&[]), None);
        for extreme in [f32::MIN_POSITIVE / 8e6, f32::MAX] {
            assert!(auto(&[[extreme; 3]]).unwrap().abs() <= MOST_STOPS);
        }
    }

    #[test]
    fn brightest_share_is_of_all_pixels() {
        let mut pixels = vec![[0.0; 3]; 98];
        pixels.extend([[2.0; 3], [8.0; 3]]);
        let luminances = Luminances::of(&pixels);
        for (share, nits) in [(0.01, 8.0), (0.02, 2.0), (0.03, 0.0), (1.0, 0.0)] {
            let found = luminances.brightest(share);
            assert!((found - nits).abs() <= nits * 0.01, "{share}: {found} {nits}");
        }
    }
}
