//! A test of equality that knows about noise: means of 16 x 16 pixel blocks over independent seeds.
//!
//! After Jung, Hanika, Dachsbacher 2020, "Detecting Bias in Monte Carlo Renderers using Welch's t-test", JCGT 9(2).
//! Samples within one picture are not independent, seeds are: the seed is the unit. Family-wise error by Holm 1979.

use super::metrics::denominators;
use super::stats::{holm, student_t_two_sided_p};
use crate::image::exr_read::Picture;
use serde::Serialize;

/// Pixels along one side of a block.
const BLOCK: usize = 16;
/// Chance that a picture without bias fails anywhere.
pub const FAMILY_WISE: f64 = 1e-3;
/// Relative error of a block mean that is rounding, not bias: f32 pixels summed by other programs in other orders.
const ROUNDING: f64 = 1e-6;

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
    /// Where: x and y of the block's first pixel in the picture, and the channel (0 = R).
    pub worst_at: [usize; 3],
    /// Relative difference of the block means there.
    pub worst_difference: f64,
    /// The family-wise level.
    pub level: f64,
}

/// Tests `pictures` (one scene, different seeds, at least two, one size, finite) against `reference`, whose own noise
/// is `reference_rel_se` (rms over pixels of standard error over the square root of relMSE's denominator).
pub fn block_test(pictures: &[Picture], reference: &Picture, reference_rel_se: f64) -> BlockTest {
    let means: Vec<Vec<[f64; 3]>> = pictures.iter().map(block_means).collect();
    let expected = block_means(reference);
    let noise = reference_variances(reference, reference_rel_se);
    let seeds = pictures.len() as f64;
    let (mut p, mut differences) = (Vec::new(), Vec::new());
    for (block, expected) in expected.iter().enumerate() {
        for channel in 0..3 {
            let values = means.iter().map(|m| m[block][channel]);
            let mean = values.clone().sum::<f64>() / seeds;
            let variance = values.map(|v| (v - mean).powi(2)).sum::<f64>() / (seeds - 1.0) / seeds;
            let total = variance + noise[block] + (ROUNDING * expected[channel]).powi(2);
            let difference = mean - expected[channel];
            // Welch-Satterthwaite, with the reference's variance known exactly.
            let dof = (total * total / (variance * variance / (seeds - 1.0)).max(f64::MIN_POSITIVE)).min(1e9);
            let t = if difference == 0.0 { 0.0 } else { difference / total.sqrt() };
            p.push(student_t_two_sided_p(t, dof));
            differences.push(difference / expected[channel].abs().max(f64::MIN_POSITIVE));
        }
    }
    let adjusted = holm(&p);
    let worst = (0..p.len()).min_by(|&a, &b| p[a].total_cmp(&p[b])).expect("a picture has at least one block");
    let across = reference.width.div_ceil(BLOCK);
    let block = worst / 3;
    BlockTest {
        seeds: pictures.len(),
        tests: p.len(),
        rejected: adjusted.iter().filter(|&&p| p < FAMILY_WISE).count(),
        smallest_p: adjusted[worst],
        worst_at: [block % across * BLOCK, block / across * BLOCK, worst % 3],
        worst_difference: differences[worst],
        level: FAMILY_WISE,
    }
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

fn block_means(picture: &Picture) -> Vec<[f64; 3]> {
    let mean = |pixels: Vec<usize>, c: usize| {
        pixels.iter().map(|&i| f64::from(picture.pixels[i][c])).sum::<f64>() / pixels.len() as f64
    };
    blocks(picture).map(|pixels| std::array::from_fn(|c| mean(pixels.clone(), c))).collect()
}

/// Variance of each block's mean that comes from the reference's noise, its pixels independent of each other.
fn reference_variances(reference: &Picture, rel_se: f64) -> Vec<f64> {
    let denominators = denominators(reference);
    let variance = |i: usize| denominators.as_ref().map_or(0.0, |d| d[i]) * rel_se * rel_se;
    blocks(reference)
        .map(|pixels| pixels.iter().map(|&i| variance(i)).sum::<f64>() / (pixels.len() as f64).powi(2))
        .collect()
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
}
