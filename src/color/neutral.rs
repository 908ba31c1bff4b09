//! After Khronos, "PBR Neutral Tone Mapper" (2024), specification section "Tone Mapper": colours below 0.8 keep hue and
//! saturation, highlights are compressed towards white.

/// Start of the highlight compression: `F90 - F_min`, 0.8 - 0.04.
const START_COMPRESSION: f64 = 0.8 - 0.04;
/// Speed of desaturation of highlights.
const DESATURATION: f64 = 0.15;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neutral_matches_its_specification() {
        // Below 0.8 a grey is shifted down by 0.04; the compressed value was worked out by hand:
        // peak = 1.96, d = 0.24, 1 - 0.0576 / (1.96 + 0.24 - 0.76) = 0.96.
        assert!((pbr_neutral([0.18; 3])[0] - 0.14).abs() < 1e-12);
        assert!((pbr_neutral([2.0; 3])[1] - 0.96).abs() < 1e-12);
        // Dark: 6.25 x^2.
        assert!((pbr_neutral([0.04; 3])[2] - 0.01).abs() < 1e-12);
    }
}
