//! Colour only at the edge of files: inside, everything is linear Rec.709; here it becomes display-ready sRGB.
//!
//! The default curve is after Khronos, "PBR Neutral Tone Mapper" (2024), specification section "Tone Mapper": colours
//! below 0.8 keep hue and saturation, highlights are compressed towards white.

/// Tone curve of the 8-bit picture; the EXR is never touched by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Khronos PBR Neutral.
    #[default]
    Neutral,
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

/// Start of the highlight compression, Khronos PBR Neutral: `F90 - F_min`, 0.8 - 0.04.
const START_COMPRESSION: f64 = 0.8 - 0.04;
/// Speed of desaturation of highlights, Khronos PBR Neutral.
const DESATURATION: f64 = 0.15;

impl ToneMap {
    /// The 8-bit sRGB colour of linear Rec.709 `radiance`, and how many of its channels were NaN (they become 0).
    /// Negative channels become 0, infinite ones the largest finite number.
    pub fn apply(&self, radiance: [f32; 3]) -> ([u8; 3], u32) {
        let nan = radiance.iter().filter(|c| c.is_nan()).count() as u32;
        let scale = self.exposure.exp2();
        let exposed = radiance.map(|c| if c > 0.0 { f64::from(c.min(f32::MAX)) * scale } else { 0.0 });
        let display = match self.curve {
            ToneCurve::Neutral => pbr_neutral(exposed),
            ToneCurve::Srgb => exposed,
        };
        (display.map(|c| (srgb_from_linear(c.clamp(0.0, 1.0)) * 255.0).round() as u8), nan)
    }
}

/// Khronos PBR Neutral: linear Rec.709, each channel >= 0 and finite, to display-linear in [0, 1].
pub fn pbr_neutral(color: [f64; 3]) -> [f64; 3] {
    let [r, g, b] = color;
    let x = r.min(g).min(b);
    let offset = if x < 0.08 { x - 6.25 * x * x } else { 0.04 };
    let color = color.map(|c| c - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START_COMPRESSION {
        return color;
    }
    let d = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - d * d / (peak + d - START_COMPRESSION);
    let whiteness = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|c| {
        let c = c * (new_peak / peak);
        c + (new_peak - c) * whiteness
    })
}

/// The sRGB transfer function of IEC 61966-2-1, [0, 1] to [0, 1].
pub fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The inverse of [`srgb_from_linear`], [0, 1] to [0, 1].
pub fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_there_and_back_is_the_same() {
        for i in 0..=1000 {
            let v = f64::from(i) / 1000.0;
            assert!((linear_from_srgb(srgb_from_linear(v)) - v).abs() < 1e-6, "{v}");
        }
    }

    const NEUTRAL: ToneMap = ToneMap { exposure: 0.0, curve: ToneCurve::Neutral };
    const SRGB: ToneMap = ToneMap { exposure: 0.0, curve: ToneCurve::Srgb };

    #[test]
    fn nan_becomes_black_and_is_counted() {
        for map in [NEUTRAL, SRGB] {
            assert_eq!(map.apply([f32::NAN, f32::NAN, 0.0]), ([0, 0, 0], 2));
            assert_eq!(map.apply([0.25, 0.25, 0.25]).1, 0);
        }
    }

    #[test]
    fn negative_becomes_black_and_huge_becomes_white() {
        for map in [NEUTRAL, SRGB] {
            for dark in [0.0, -0.0, -1e-6, -10.0, f32::NEG_INFINITY, f32::MIN] {
                assert_eq!(map.apply([dark; 3]), ([0; 3], 0), "{map:?} {dark}");
            }
            for bright in [1e30, f32::MAX, f32::INFINITY] {
                assert_eq!(map.apply([bright; 3]), ([255; 3], 0), "{map:?} {bright}");
            }
        }
    }

    #[test]
    fn neutral_matches_its_specification() {
        // Below 0.8 a grey is shifted down by 0.04; the compressed value was worked out by hand:
        // peak = 1.96, d = 0.24, 1 - 0.0576 / (1.96 + 0.24 - 0.76) = 0.96.
        assert!((pbr_neutral([0.18; 3])[0] - 0.14).abs() < 1e-12);
        assert!((pbr_neutral([2.0; 3])[1] - 0.96).abs() < 1e-12);
        // Dark: 6.25 x^2.
        assert!((pbr_neutral([0.04; 3])[2] - 0.01).abs() < 1e-12);
    }

    #[test]
    fn curves_are_monotone_in_each_channel() {
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
    fn srgb_pieces_join() {
        let (below, above) = (srgb_from_linear(0.003_130_8), srgb_from_linear(0.003_130_800_001));
        assert!((above - below).abs() < 1e-6);
        assert_eq!(SRGB.apply([0.18; 3]).0, [118; 3]);
    }

    #[test]
    fn srgb_is_undone() {
        for step in 0..=100 {
            let linear = f64::from(step) / 100.0;
            assert!((linear_from_srgb(srgb_from_linear(linear)) - linear).abs() < 1e-6, "{linear}");
        }
    }

    #[test]
    fn exposure_is_in_stops() {
        let brighter = ToneMap { exposure: 2.0, curve: ToneCurve::Srgb };
        assert_eq!(brighter.apply([0.045, 0.0, 0.0]), SRGB.apply([0.18, 0.0, 0.0]));
        let extreme = ToneMap { exposure: 1000.0, curve: ToneCurve::Neutral };
        assert_eq!(extreme.apply([f32::MAX, 0.0, 0.0]).1, 0);
    }
}
