//! A test of equality that knows about noise: means of 16 x 16 pixel blocks over independent seeds.
//!
//! After Jung, Hanika, Dachsbacher 2020, "Detecting Bias in Monte Carlo Renderers using Welch's t-test", JCGT 9(2).
//! Samples within one picture are not independent (the sampler stratifies), seeds are: the seed is the unit. Family-wise
//! error by Holm 1979.

use super::metrics::denominators;
use super::stats::{Sample, Spread, TTest, difference_test, holm};
use crate::image::exr_read::Picture;
use serde::Serialize;

/// Pixels along one side of a block; those at the right and lower edge may be smaller.
pub const BLOCK: usize = 16;

/// Chance that a picture without bias fails anywhere.
pub const FAMILY_WISE: f64 = 1e-3;

/// Standard error, relative to the value, granted to f32 arithmetic (a few units in the last place of a product of
/// some ten factors that round the same way in every sample). It is what a picture without noise is judged by: an
/// error of 1e-5 is then 4 standard errors.
pub const ROUNDING: f64 = 2.5e-6;

/// How much more variance than the reference's average a block of it may have: shadows and light from several bounces
/// away have some times the relative variance of a lit floor. Measured on Cycles against Mitsuba in cornell, whose means
/// agree to 0.025 %: largest |t| 5.3 by the average alone, which rejects, and 2.7 with this. The price is sharpness: in
/// punctual, 0.5 % of planted light is found with 32 seeds of 128 samples and not with 8 of 32.
pub const UNEVEN: f64 = 9.0;

/// Result of [`block_test`].
#[derive(Clone, Debug, Serialize)]
pub struct BlockTest {
    /// Pictures (seeds) compared.
    pub seeds: usize,
    /// Blocks times channels.
    pub tests: usize,
    /// Tests that reject equality at the family-wise level.
    pub rejected: usize,
    /// The smallest p-value after Holm's correction.
    pub smallest_p: f64,
    /// The largest difference of block means in standard errors.
    pub largest_t: f64,
    /// Where p is smallest: x and y of the block's first pixel in the picture, and the channel (0 = R).
    pub worst_at: [usize; 3],
    /// Relative difference of the block means there.
    pub worst_difference: f64,
    /// The family-wise level.
    pub level: f64,
}

/// Tests `pictures` (one scene, different seeds, at least two, one size) against `reference`, whose own noise is
/// `reference_rel_se`: rms over pixels of standard error over the square root of relMSE's denominator, so that its
/// square is what the noise adds to a relMSE.
///
/// Per block and channel: Student's t of mean over seeds - reference. Its variance is that of the seeds' means, the
/// reference's (`reference_spread`) and [`ROUNDING`], degrees of freedom after Satterthwaite. A block with a pixel that
/// is not finite is rejected; one without any difference has p = 1.
pub fn block_test(pictures: &[Picture], reference: &Picture, reference_rel_se: f64) -> BlockTest {
    let denominators = denominators(reference);
    let mut tests = Vec::new();
    let mut differences = Vec::new();
    for pixels in blocks(reference) {
        // Of the reference's mean over the block, if its noise were spread as relMSE's denominator is.
        let n = pixels.len() as f64;
        let average = |d: &Vec<f64>| pixels.iter().map(|&i| d[i]).sum::<f64>() * (reference_rel_se / n).powi(2);
        let average = denominators.as_ref().map_or(0.0, average);
        for channel in 0..3 {
            let (test, difference) = test_block(pictures, reference, &pixels, channel, reference_rel_se, average);
            tests.push(test);
            differences.push(difference);
        }
    }
    let adjusted = holm(&tests.iter().map(|test| test.p).collect::<Vec<_>>());
    let worst =
        (0..tests.len()).min_by(|&a, &b| tests[a].p.total_cmp(&tests[b].p)).expect("a picture has at least one block");
    let across = reference.width.div_ceil(BLOCK);
    let block = worst / 3;
    BlockTest {
        seeds: pictures.len(),
        tests: tests.len(),
        rejected: adjusted.iter().filter(|&&p| p < FAMILY_WISE).count(),
        smallest_p: adjusted[worst],
        // Not f64::max, which would pass over NaN.
        largest_t: tests.iter().map(|test| test.t.abs()).max_by(f64::total_cmp).expect("at least one block"),
        worst_at: [block % across * BLOCK, block / across * BLOCK, worst % 3],
        worst_difference: differences[worst],
        level: FAMILY_WISE,
    }
}

/// The test of one block and channel, and the relative difference.
fn test_block(
    pictures: &[Picture],
    reference: &Picture,
    pixels: &[usize],
    channel: usize,
    rel_se: f64,
    average: f64,
) -> (TTest, f64) {
    let n = pixels.len() as f64;
    let mut residuals: Vec<f64> = pixels.iter().map(|&i| -f64::from(reference.pixels[i][channel])).collect();
    let expected = -residuals.iter().sum::<f64>() / n;
    let mut means = Vec::with_capacity(pictures.len());
    for picture in pictures {
        let mut sum = 0.0;
        for (residual, &i) in residuals.iter_mut().zip(pixels) {
            let value = f64::from(picture.pixels[i][channel]);
            sum += value;
            *residual += value / pictures.len() as f64;
        }
        means.push(sum / n);
    }
    let ours = Sample::of(&means);
    let own = ours.spread_of_mean();
    let theirs = reference_spread(&Sample::of(&residuals), own.variance, rel_se * expected, average);
    let difference = ours.mean - expected;
    let spread = Spread::sum(&[own, theirs, Spread::known((ROUNDING * expected).powi(2))]);
    (difference_test(difference, spread), difference / expected.abs().max(f64::MIN_POSITIVE))
}

/// The spread of the reference's mean over a block, whose pixels' noise is independent: as their differences from our
/// mean picture (`residuals`) show it, less our own variance `own`.
///
/// That is not believed without bounds. Below: a block whose rare bright samples all stayed away scatters little and is
/// too dark, so at least the stated standard error, `rel_se` times the block's mean, is granted (nothing where the
/// reference is black: light there is found). Above: differences of structure scatter too, so no more than [`UNEVEN`]
/// times the `average` by the definition of the stated error. The scatter is about the block's own mean difference,
/// so a bias of the whole block does not hide itself.
fn reference_spread(residuals: &Sample, own: f64, se: f64, average: f64) -> Spread {
    let n = residuals.n as f64;
    let least = se * se / n;
    if residuals.n < 2 {
        return Spread::known(average.max(least));
    }
    let seen = residuals.spread_of_mean();
    Spread { variance: (seen.variance - own).min(UNEVEN * average).max(least), dof: seen.dof }
}

/// For each block, row by row: the indices of its pixels.
fn blocks(picture: &Picture) -> impl Iterator<Item = Vec<usize>> {
    let (width, height) = (picture.width, picture.height);
    (0..height).step_by(BLOCK).flat_map(move |y| {
        (0..width).step_by(BLOCK).map(move |x| {
            let rows = y..(y + BLOCK).min(height);
            rows.flat_map(|row| (x..(x + BLOCK).min(width)).map(move |column| row * width + column)).collect()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of mean `level` with the noise of a hash: uniform in +-0.5 relative.
    fn noisy(seed: u64, level: f32) -> Picture {
        let pixel = |i: u64| {
            let mut x = (i + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ seed.wrapping_mul(0xD1B5_4A32_D192_ED03);
            x = (x ^ (x >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            let u = ((x ^ (x >> 31)) >> 40) as f32 / (1 << 24) as f32;
            [level * (0.5 + u); 3]
        };
        Picture { origin: [0, 0], width: 72, height: 40, pixels: (0..72 * 40).map(pixel).collect() }
    }

    fn constant(level: f32) -> Picture {
        Picture { pixels: vec![[level; 3]; 72 * 40], ..noisy(0, 1.0) }
    }

    #[test]
    fn noise_without_bias_passes() {
        // Fixed seeds 1..=8, level 1e-3: an unbiased set fails once in a thousand choices of seeds.
        let pictures: Vec<_> = (1..=8).map(|seed| noisy(seed, 2.0)).collect();
        let result = block_test(&pictures, &constant(2.0), 0.0);
        assert_eq!((result.tests, result.rejected), (5 * 3 * 3, 0), "{result:?}");
    }

    #[test]
    fn a_small_bias_is_found() {
        // Standard error of a block mean: 0.29 / sqrt(256 x 8) = 0.6 %; 10 % is 16 of them.
        let pictures: Vec<_> = (1..=8).map(|seed| noisy(seed, 2.2)).collect();
        let result = block_test(&pictures, &constant(2.0), 0.0);
        assert!(result.rejected > 30, "{result:?}");
        assert!(result.worst_difference > 0.05);
    }

    #[test]
    fn a_bias_in_one_block_is_found_there() {
        let mut pictures: Vec<_> = (1..=8).map(|seed| noisy(seed, 2.0)).collect();
        for picture in &mut pictures {
            for y in 16..32 {
                for x in 48..64 {
                    picture.pixels[y * 72 + x][1] *= 1.2;
                }
            }
        }
        let result = block_test(&pictures, &constant(2.0), 0.0);
        assert_eq!((result.rejected, result.worst_at), (1, [48, 16, 1]), "{result:?}");
    }

    #[test]
    fn the_references_own_noise_is_allowed_for() {
        // Pictures without noise against a noisy reference: uniform in +-0.5 has a standard deviation of 0.29.
        let pictures = vec![constant(2.0); 2];
        let reference = noisy(9, 2.0);
        assert!(block_test(&pictures, &reference, 0.0).rejected > 0);
        assert_eq!(block_test(&pictures, &reference, 0.29).rejected, 0);
    }

    #[test]
    fn equal_pictures_without_noise_pass() {
        let result = block_test(&[constant(1.0), constant(1.0)], &constant(1.0), 0.0);
        assert_eq!((result.rejected, result.smallest_p), (0, 1.0));
    }

    #[test]
    fn light_where_a_noisy_reference_is_black_is_found() {
        let mut reference = noisy(9, 2.0);
        for y in 0..16 {
            reference.pixels[y * 72 + 16..][..16].fill([0.0; 3]);
        }
        let mut pictures: Vec<_> = (1..=8).map(|seed| noisy(seed, 2.0)).collect();
        for picture in &mut pictures {
            for y in 0..16 {
                picture.pixels[y * 72 + 16..][..16].fill([0.0, 1e-4, 0.0]);
            }
        }
        let result = block_test(&pictures, &reference, 0.29);
        assert_eq!((result.rejected, result.worst_at), (1, [16, 0, 1]), "{result:?}");
    }

    #[test]
    fn blocks_of_one_pixel_are_judged_by_the_stated_noise() {
        let cut = |picture: Picture, level: f32| Picture {
            width: 17,
            height: 1,
            pixels: (0..17).map(|i| if i == 16 { [level; 3] } else { picture.pixels[i] }).collect(),
            ..picture
        };
        let against = |level: f32| {
            let reference = cut(constant(1.0), level);
            block_test(&[cut(constant(1.0), 1.0), cut(constant(1.0), 1.0)], &reference, 0.01)
        };
        assert_eq!(against(1.02).rejected, 0);
        assert_eq!((against(1.1).rejected, against(1.1).worst_at), (3, [16, 0, 0]));
    }

    #[test]
    fn a_pixel_that_is_not_a_number_is_a_failure() {
        let mut pictures = vec![constant(1.0); 2];
        pictures[1].pixels[0][2] = f32::NAN;
        let result = block_test(&pictures, &constant(1.0), 0.1);
        assert_eq!((result.rejected, result.smallest_p, result.worst_at), (1, 0.0, [0, 0, 2]));
        assert!(result.largest_t.is_nan());
    }
}
