//! From linear radiance to 8-bit sRGB: exposure, curve, encoding.

use super::aces::aces;
use super::agx::agx;
use super::neutral::pbr_neutral;
use super::srgb_from_linear;

/// Tone curve of the 8-bit picture; the EXR is never touched by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Khronos PBR Neutral.
    #[default]
    Neutral,
    /// Sobotka's AgX, base look: bright colours pale gradually, contrast is gentle.
    Agx,
    /// ACES 1.0 as fitted by Hill: film-like, darker and with more contrast.
    Aces,
    /// The sRGB transfer function alone; values above 1 clip.
    Srgb,
}

/// How linear radiance becomes 8-bit sRGB.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToneMap {
    /// Exposure value: radiance is multiplied by `2^exposure`.
    pub exposure: f64,
    /// Curve after the exposure.
    pub curve: ToneCurve,
}

/// Beyond this every curve is white; below it none of them overflows.
const GREATEST: f64 = 1e100;

impl ToneCurve {
    /// Every curve, with its name on the command line and in files.
    pub const NAMES: [(&str, Self); 4] =
        [("neutral", Self::Neutral), ("agx", Self::Agx), ("aces", Self::Aces), ("srgb", Self::Srgb)];
}

impl ToneMap {
    /// The 8-bit sRGB colour of linear Rec.709 `radiance`, and how many of its channels were NaN (they become 0).
    /// Negative channels become 0, infinite ones the largest finite number.
    pub fn apply(&self, radiance: [f32; 3]) -> ([u8; 3], u32) {
        let nan = radiance.iter().filter(|c| c.is_nan()).count() as u32;
        let scale = self.exposure.exp2();
        let exposed = radiance.map(|c| if c > 0.0 { (f64::from(c.min(f32::MAX)) * scale).min(GREATEST) } else { 0.0 });
        let display = match self.curve {
            ToneCurve::Neutral => pbr_neutral(exposed),
            ToneCurve::Agx => agx(exposed),
            ToneCurve::Aces => aces(exposed),
            ToneCurve::Srgb => exposed,
        };
        (display.map(|c| (srgb_from_linear(c.clamp(0.0, 1.0)) * 255.0).round() as u8), nan)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEUTRAL: ToneMap = ToneMap { exposure: 0.0, curve: ToneCurve::Neutral };
    const ALL: [ToneMap; 4] = [
        NEUTRAL,
        SRGB,
        ToneMap { exposure: 0.0, curve: ToneCurve::Agx },
        ToneMap { exposure: 0.0, curve: ToneCurve::Aces },
    ];
    const SRGB: ToneMap = ToneMap { exposure: 0.0, curve: ToneCurve::Srgb };

    #[test]
    fn nan_becomes_black_and_is_counted() {
        for map in ALL {
            assert_eq!(map.apply([f32::NAN, f32::NAN, 0.0]), ([0, 0, 0], 2));
            assert_eq!(map.apply([0.25, 0.25, 0.25]).1, 0);
        }
    }

    #[test]
    fn negative_becomes_black_and_huge_becomes_white() {
        for map in ALL {
            for dark in [0.0, -0.0, -1e-6, -10.0, f32::NEG_INFINITY, f32::MIN] {
                assert_eq!(map.apply([dark; 3]), ([0; 3], 0), "{map:?} {dark}");
            }
            for bright in [1e30, f32::MAX, f32::INFINITY] {
                assert_eq!(map.apply([bright; 3]), ([255; 3], 0), "{map:?} {bright}");
            }
        }
    }

    #[test]
    fn greys_are_monotone_and_stay_grey() {
        for map in ALL {
            let mut last = [0; 3];
            for step in 0..1200 {
                let now = map.apply([1e-6 * 1.02_f32.powi(step); 3]).0;
                assert!((0..3).all(|c| now[c] >= last[c] && now[c].abs_diff(now[0]) <= 1), "{map:?}: {now:?} {last:?}");
                last = now;
            }
        }
    }

    /// AgX and ACES mix the channels, so that more red may well be less green: greys are monotone there.
    #[test]
    fn curves_without_mixing_are_monotone_in_each_channel() {
        for map in [NEUTRAL, SRGB] {
            for channel in 0..3 {
                for others in [0.0, 0.05, 0.5, 3.0, 1e4] {
                    let mut last = 0;
                    for step in 0..600 {
                        let mut color = [others; 3];
                        color[channel] = 1e-4 * 1.04_f32.powi(step);
                        let now = map.apply(color).0[channel];
                        assert!(now >= last, "{map:?} {color:?}: {now} < {last}");
                        last = now;
                    }
                }
            }
        }
    }

    #[test]
    fn middle_grey_goes_where_its_curve_says() {
        // 0.18, 0.14, 0.21765 and 0.10559 of white, encoded by hand: 255 (1.055 v^(1/2.4) - 0.055).
        for ((_, curve), expected) in ToneCurve::NAMES.into_iter().zip([105, 128, 91, 118]) {
            let grey = ToneMap { exposure: 0.0, curve }.apply([0.18; 3]).0;
            assert_eq!(grey, [expected; 3], "{curve:?}");
        }
    }

    #[test]
    fn exposure_is_in_stops() {
        let brighter = ToneMap { exposure: 2.0, curve: ToneCurve::Srgb };
        assert_eq!(brighter.apply([0.045, 0.0, 0.0]), SRGB.apply([0.18, 0.0, 0.0]));
        for map in ALL {
            let extreme = ToneMap { exposure: 1000.0, ..map };
            assert_eq!(extreme.apply([f32::MAX; 3]), ([255; 3], 0), "{map:?}");
        }
    }
}
