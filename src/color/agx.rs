//! After Troy Sobotka's AgX (github.com/sobotka/AgX, 2022, base look): primaries drawn in, exposure as a logarithm over
//! 16.5 stops, a sigmoid, primaries drawn out again.
//!
//! The sigmoid is the published one by Jed Smith, not the polynomial of sixth order that shaders fit to it (B. Wrensch,
//! "Minimal AgX Implementation"): that one is up to 0.0058 off and makes black negative. The outset is the inverse of the
//! inset, as Wrensch has it; Sobotka's base has none and is paler. The result is meant for a display of exponent 2.2, so
//! it is made linear by that and encoded as sRGB like everything else.

use super::aces::multiply;

/// Rows: Rec.709 to primaries drawn in by a fifth.
const INSET: [[f64; 3]; 3] = [
    [0.842_479_062_253_094, 0.078_433_599_999_999_2, 0.079_223_745_147_764_3],
    [0.042_328_242_261_012_3, 0.878_468_636_469_772, 0.079_166_127_460_543_4],
    [0.042_375_654_905_705_1, 0.078_433_6, 0.879_142_973_793_104],
];
/// Rows: the inverse of [`INSET`].
const OUTSET: [[f64; 3]; 3] = [
    [1.196_879_005_120_17, -0.098_020_881_140_136_8, -0.099_029_744_079_720_5],
    [-0.052_896_851_757_456_2, 1.151_903_129_904_17, -0.098_961_176_844_843_3],
    [-0.052_971_635_514_443_8, -0.098_043_450_117_124_1, 1.151_073_672_641_16],
];
/// Stops below middle grey that become black: log2(0.18) - 10 = -12.473 93.
const STOPS_BELOW: f64 = 10.0;
/// Stops above middle grey that become white: log2(0.18) + 6.5 = 4.026 069.
const STOPS_ABOVE: f64 = 6.5;
/// What the stops count from.
const MIDDLE_GREY: f64 = 0.18;
/// Where middle grey goes, encoded.
const PIVOT: f64 = 0.5;
/// Slope there.
const SLOPE: f64 = 2.0;
/// How sharply the curve bends towards black and towards white.
const POWERS: [f64; 2] = [3.0, 3.25];

/// AgX: linear Rec.709, each channel >= 0 and finite, to display-linear, at least 0; a little above 1 at the end, to be
/// clipped there.
pub fn agx(color: [f64; 3]) -> [f64; 3] {
    let encoded = multiply(&INSET, color).map(|c| sigmoid(stops(c)));
    multiply(&OUTSET, encoded).map(|c| c.max(0.0).powf(2.2))
}

/// 0 at [`STOPS_BELOW`] and lower, 1 at [`STOPS_ABOVE`] and higher.
fn stops(linear: f64) -> f64 {
    ((linear / MIDDLE_GREY).log2().clamp(-STOPS_BELOW, STOPS_ABOVE) + STOPS_BELOW) / (STOPS_BELOW + STOPS_ABOVE)
}

/// A straight line of [`SLOPE`] through the pivot, bent so that it ends at (0, 0) and (1, 1).
fn sigmoid(x: f64) -> f64 {
    let pivot = STOPS_BELOW / (STOPS_BELOW + STOPS_ABOVE);
    let (to_end, height, power, sign) =
        if x < pivot { (pivot, PIVOT, POWERS[0], -1.0) } else { (1.0 - pivot, 1.0 - PIVOT, POWERS[1], 1.0) };
    // The line meets `scale` times the unit hyperbola t / (1 + t^p)^(1/p) at the end.
    let line = SLOPE * to_end;
    let scale = (((line / height).powf(power) - 1.0) / line.powf(power)).powf(-1.0 / power);
    let t = SLOPE * (x - pivot).abs() / scale;
    // At the very end the sum is 0 but for rounding, and black is exactly 0.
    (PIVOT + sign * scale * t / (1.0 + t.powf(power)).powf(1.0 / power)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agx_matches_values_worked_out_elsewhere() {
        // In Python's decimal at 50 digits, from the published numbers (logarithm, powers and roots by Decimal's own
        // ln and exp), sigmoid written as its authors do: scale = ((s x)^-p ((s x / y)^p - 1))^(-1/p).
        for (color, expected) in REFERENCE {
            for (found, expected) in agx(color).into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12, "{color:?}: {found} {expected}");
            }
        }
    }

    const REFERENCE: [([f64; 3], [f64; 3]); 4] = [
        ([0.18, 0.18, 0.18], [0.217_584_209_631_457_5, 0.217_651_683_072_752_6, 0.217_655_881_845_038_3]),
        ([1.0, 0.5, 0.25], [0.610_829_698_622_862, 0.429_941_866_363_178_44, 0.292_430_921_890_859_7]),
        ([0.0, 0.02, 4.0], [0.286_076_838_354_263_2, 0.298_052_067_631_602_64, 0.950_584_259_538_407_2]),
        ([16.0, 3.0, 0.001], [1.053_819_278_291_182_4, 0.861_900_135_850_438, 0.527_773_694_522_311_7]),
    ];

    #[test]
    fn the_outset_undoes_the_inset() {
        for unit in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            for (back, there) in multiply(&OUTSET, multiply(&INSET, unit)).into_iter().zip(unit) {
                assert!((back - there).abs() < 1e-6, "{back} {there}");
            }
        }
    }

    #[test]
    fn the_range_is_the_published_one() {
        assert!((MIDDLE_GREY.log2() - STOPS_BELOW + 12.473_93).abs() < 1e-5);
        assert!((MIDDLE_GREY.log2() + STOPS_ABOVE - 4.026_069).abs() < 1e-5);
        assert_eq!((sigmoid(0.0), sigmoid(1.0)), (0.0, 1.0));
        // Straight through the pivot: no kink where the halves meet.
        let pivot = STOPS_BELOW / (STOPS_BELOW + STOPS_ABOVE);
        for step in [1e-4, -1e-4] {
            assert!((sigmoid(pivot + step) - (PIVOT + SLOPE * step)).abs() < 1e-9);
        }
    }
}
