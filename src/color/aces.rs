//! After Stephen Hill's fit of the ACES 1.0 RRT and sRGB ODT (2016, in M. Pettineo's BakingLab, `ACES.hlsl`, MIT): a
//! rational curve between two matrices, the first from linear Rec.709 to the RRT's own primaries with its desaturation,
//! the second back with the ODT's. Unlike K. Narkowicz's fit of one curve per channel, bright saturated colours go
//! towards white as they do in ACES.
//!
//! Nothing is scaled before or after: 18 % grey becomes 0.106 of white, as ACES has it.

/// Rows: linear Rec.709 to the RRT's primaries, RRT saturation included.
const FROM_REC_709: [[f64; 3]; 3] =
    [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
/// Rows: the ODT's saturation and the way to linear Rec.709.
const TO_REC_709: [[f64; 3]; 3] =
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];

/// ACES: linear Rec.709, each channel >= 0 and at most 1e100, to display-linear; a little outside [0, 1] at the ends, to
/// be clipped there.
pub fn aces(color: [f64; 3]) -> [f64; 3] {
    multiply(&TO_REC_709, multiply(&FROM_REC_709, color).map(curve))
}

/// RRT and ODT of one channel.
fn curve(v: f64) -> f64 {
    (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081)
}

/// `matrix` times the column `v`.
pub(super) fn multiply(matrix: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aces_matches_values_worked_out_elsewhere() {
        // In Python's fractions, exactly, from the published numbers, with [0.18] * 3 and so on for c:
        //   M, N = the two matrices as lists of Fraction("0.59719") and so on
        //   f = lambda v: (v*(v+F("0.0245786"))-F("0.000090537"))/(v*(F("0.983729")*v+F("0.4329510"))+F("0.238081"))
        //   w = [f(sum(m*x for m, x in zip(r, c))) for r in M]; [float(sum(n*x for n, x in zip(r, w))) for r in N]
        for (color, expected) in REFERENCE {
            for (found, expected) in aces(color).into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12, "{color:?}: {found} {expected}");
            }
        }
    }

    const REFERENCE: [([f64; 3], [f64; 3]); 4] = [
        ([0.18, 0.18, 0.18], [0.105_591_247_228_930_54, 0.105_591_247_228_930_54, 0.105_590_191_316_458_25]),
        ([1.0, 0.5, 0.25], [0.634_990_375_260_814_3, 0.384_600_074_716_985_6, 0.203_160_361_394_819_1]),
        ([0.0, 0.02, 4.0], [0.116_173_718_319_202_22, 0.015_459_665_544_206_68, 0.953_229_555_603_687_9]),
        ([16.0, 3.0, 0.001], [1.043_080_311_587_671, 0.902_423_234_359_521_1, 0.541_088_941_894_367_5]),
    ];
}
