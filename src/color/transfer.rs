//! The sRGB transfer function of IEC 61966-2-1, both ways.

/// The encoded value of a linear one, [0, 1] to [0, 1].
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
            assert!((srgb_from_linear(linear_from_srgb(v)) - v).abs() < 1e-6, "{v}");
        }
    }

    #[test]
    fn srgb_pieces_join() {
        let (below, above) = (srgb_from_linear(0.003_130_8), srgb_from_linear(0.003_130_800_001));
        assert!((above - below).abs() < 1e-6);
    }
}
