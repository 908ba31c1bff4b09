//! Which `--exposure` would help where the one asked for shows nothing.

use super::Luminances;

/// Pixels of a finished 8-bit picture by what can be seen of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shades {
    /// All pixels.
    pub pixels: u64,
    /// No channel above [`Shades::BLACK`].
    pub black: u64,
    /// No channel above [`Shades::DIM`]; the black ones are among them.
    pub dim: u64,
    /// No channel below [`Shades::WHITE`].
    pub white: u64,
}

impl Shades {
    /// 8-bit sRGB values up to this one look black beside others.
    pub const BLACK: u8 = 2;
    /// 8-bit sRGB values up to this one (1.4 % of white) are hardly seen in a black picture.
    pub const DIM: u8 = 32;
    /// 8-bit sRGB values from this one on look white.
    pub const WHITE: u8 = 253;

    /// Counts a pixel.
    pub fn add(&mut self, color: [u8; 3]) {
        self.pixels += 1;
        self.black += u64::from(color.iter().all(|&c| c <= Self::BLACK));
        self.dim += u64::from(color.iter().all(|&c| c <= Self::DIM));
        self.white += u64::from(color.iter().all(|&c| c >= Self::WHITE));
    }

    /// Whether nearly nothing but black, or nearly nothing but white, is left: only then is there [`advice`].
    pub fn is_hopeless(&self) -> bool {
        self.is_black() || self.is_white()
    }

    /// A small lamp in the dark is something to see: one pixel in a thousand. A tenth of the picture may glimmer: colours
    /// outlast greys in the dark, as the neutral curve takes away what the channels have in common.
    fn is_black(&self) -> bool {
        let within = |count: u64, share: f64| (self.pixels - count) as f64 <= share * self.pixels as f64;
        self.pixels > 0 && within(self.dim, 0.001) && within(self.black, 0.1)
    }

    /// White backgrounds are wanted: what stands before one may be as small as a hundredth of the picture.
    fn is_white(&self) -> bool {
        self.pixels > 0 && (self.pixels - self.white) as f64 <= 0.01 * self.pixels as f64
    }
}

/// What is wrong with an exposure, and a better one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Advice {
    /// Almost black, else almost white.
    pub is_black: bool,
    /// Luminance of the brightest hundredth of the pixels if black, of the darkest if white; nits.
    pub nits: f64,
    /// Stops to type, a multiple of 0.5.
    pub exposure: f64,
}

impl std::fmt::Display for Advice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (shade, end) = if self.is_black { ("black", "brightest") } else { ("white", "darkest") };
        let (nits, exposure) = (three_digits(self.nits), self.exposure);
        write!(f, "the PNG is almost {shade}: its {end} 1 % is {nits} nits; --exposure {exposure} would show it")
    }
}

/// The share of the pixels whose luminance is told.
const TOLD: f64 = 0.01;

/// The exposure that would show a picture of which `used` stops left only `shades`; `None` where something can be seen,
/// where there is nothing to see (less than a hundredth of the pixels is lit), and where no other exposure is better.
pub fn advice(shades: &Shades, luminances: &Luminances, used: f64) -> Option<Advice> {
    if !shades.is_hopeless() || luminances.brightest(TOLD) == 0.0 {
        return None;
    }
    let exposure = (luminances.auto_exposure()? * 2.0).round() / 2.0 + 0.0;
    let is_black = shades.is_black();
    let is_better = if is_black { exposure > used } else { exposure < used };
    let nits = luminances.brightest(if is_black { TOLD } else { 1.0 - TOLD });
    is_better.then_some(Advice { is_black, nits, exposure })
}

/// `value` with three digits that count, and a power of ten where it is far from 1.
fn three_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e6).contains(&value) {
        return format!("{value:.2e}");
    }
    let digits = (2 - value.log10().floor() as i32).max(0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::super::{ToneCurve, ToneMap};
    use super::*;

    fn advised(pixels: &[[f32; 3]], exposure: f64) -> Option<Advice> {
        let map = ToneMap { exposure, curve: ToneCurve::Neutral };
        let mut shades = Shades::default();
        pixels.iter().for_each(|&pixel| shades.add(map.apply(pixel).0));
        advice(&shades, &Luminances::of(pixels), exposure)
    }

    /// 1000 pixels from half to twice `level`.
    fn scene(level: f32) -> Vec<[f32; 3]> {
        (0..1000).map(|i| [level * (-1.0 + i as f32 / 500.0).exp2(); 3]).collect()
    }

    #[test]
    fn a_picture_that_can_be_seen_needs_no_advice() {
        for level in [0.05, 0.3, 1.0, 3.0] {
            assert_eq!(advised(&scene(level), 0.0), None, "{level}");
        }
    }

    #[test]
    fn too_dark_and_too_bright_pictures_are_told_an_exposure_that_shows_them() {
        for level in [1e-12, 1e-3, 1e3, 1e9] {
            let pixels = scene(level);
            let advice = advised(&pixels, 0.0).unwrap();
            assert_eq!(advice.is_black, level < 1.0);
            assert_eq!(advice.exposure * 2.0, (advice.exposure * 2.0).round());
            assert_eq!(advised(&pixels, advice.exposure), None);
            let end = f64::from(level) * if level < 1.0 { 2.0 } else { 0.5 };
            assert!((advice.nits / end - 1.0).abs() < 0.05, "{level}: {}", advice.nits);
        }
        let text = advised(&scene(1e-3), 0.0).unwrap().to_string();
        let expected = "the PNG is almost black: its brightest 1 % is 0.00197 nits; --exposure 8 would show it";
        assert_eq!(text, expected);
        let text = advised(&scene(1e3), 0.0).unwrap().to_string();
        assert!(text.starts_with("the PNG is almost white: its darkest 1 % is 50"), "{text}");
    }

    #[test]
    fn a_wrong_exposure_is_corrected_too() {
        assert!(advised(&scene(1.0), -20.0).unwrap().is_black);
        assert!(!advised(&scene(1.0), 20.0).unwrap().is_black);
    }

    #[test]
    fn what_is_black_for_want_of_light_is_left_alone() {
        assert_eq!(advised(&[[0.0; 3]; 1000], 0.0), None);
        assert_eq!(advised(&[[f32::NAN; 3]; 1000], 0.0), None);
        // A few stray sparks are no picture, and a lamp that can be seen is one.
        for spark in [1e-6, 5.0] {
            let mut pixels = vec![[0.0; 3]; 1000];
            pixels[..5].fill([spark; 3]);
            assert_eq!(advised(&pixels, 0.0), None, "{spark}");
        }
        let mut pixels = vec![[1e-6; 3]; 1000];
        pixels[..5].fill([5.0; 3]);
        assert_eq!(advised(&pixels, 0.0), None);
        assert_eq!(advised(&[], 0.0), None);
    }

    #[test]
    fn a_glimmer_here_and_there_is_black_too_but_a_dark_picture_is_not() {
        let mut pixels = scene(1e-4);
        // Red of 0.002 of white becomes 7 of 255.
        pixels[..90].fill([0.002, 0.0, 0.0]);
        assert!(advised(&pixels, 0.0).unwrap().is_black);
        pixels[..200].fill([0.002, 0.0, 0.0]);
        assert_eq!(advised(&pixels, 0.0), None);
    }

    #[test]
    fn one_firefly_does_not_hide_that_the_rest_is_black() {
        let mut pixels = scene(1e-3);
        pixels[17] = [1e6; 3];
        assert_eq!(advised(&pixels, 0.0).unwrap().exposure, 8.0);
    }

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in [
            (0.0, "0"),
            (0.012_345, "0.0123"),
            (1.0, "1.00"),
            (123.4, "123"),
            (98_765.0, "98765"),
            (1.234e-9, "1.23e-9"),
        ] {
            assert_eq!(three_digits(value), text);
        }
    }
}
