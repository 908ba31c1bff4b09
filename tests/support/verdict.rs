//! When is a picture wrong? The tests of means and of blocks, with seeds as the unit.
//!
//! Samples inside one picture are not independent (the sampler stratifies), so every variance comes from the scatter
//! of whole renders with different seeds. After Jung, Hanika and Dachsbacher 2020, "Detecting Bias in Monte Carlo
//! Renderers using Welch's t-test", JCGT 9(2).

use super::stats::{Sample, Spread, holm, satterthwaite, student_t_two_sided_p};

/// Standard error, relative to the value, granted to f32 arithmetic (a few units in the last place of a product of
/// some ten factors that round the same way in every sample). It is what a picture without noise is judged by: an
/// error of 1e-5 is then 4 standard errors.
pub const ROUNDING: f64 = 2.5e-6;

/// What a mean should be.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// The value.
    pub value: f64,
    /// Its own relative standard error: 0 for a closed form.
    pub rel_se: f64,
}

/// Outcome of [`mean_test`].
#[derive(Clone, Copy, Debug)]
pub struct MeanVerdict {
    /// Mean over the seeds.
    pub mean: f64,
    /// `mean / expected - 1`.
    pub bias: f64,
    /// Relative standard error of `bias`: seeds, reference and rounding.
    pub rel_se: f64,
    /// Two-sided p of "no bias", Student's t with Welch-Satterthwaite degrees of freedom.
    pub p: f64,
}

/// Largest bias that passes, relative: 0.15 %.
pub const MAX_BIAS: f64 = 1.5e-3;

/// Significance of one mean test: fixed seeds make the outcome repeatable; after a change of the random numbers a
/// sound renderer fails one test in 10 000 by this bound, and one in 16 000 by [`MAX_BIAS`] if the noise is at its limit.
pub const SIGNIFICANCE: f64 = 1e-4;

/// Compares the mean of `runs` (one value a seed) with what it should be (not 0).
pub fn mean_test(runs: &[f64], expected: Expected) -> MeanVerdict {
    let sample = Sample::of(runs);
    let value = expected.value;
    let parts = [
        Spread { variance: sample.mean_variance(), dof: (sample.n - 1) as f64 },
        Spread { variance: (expected.rel_se * value).powi(2), dof: f64::INFINITY },
        Spread { variance: (ROUNDING * value).powi(2), dof: f64::INFINITY },
    ];
    let se = parts.iter().map(|p| p.variance).sum::<f64>().sqrt();
    let p = student_t_two_sided_p((sample.mean - value) / se, satterthwaite(&parts));
    MeanVerdict { mean: sample.mean, bias: sample.mean / value - 1.0, rel_se: se / value.abs(), p }
}

impl MeanVerdict {
    /// Whether the mean is right, and the test sharp enough (4 standard errors within `max_bias`) to say so.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn within(&self, max_bias: f64) -> Result<(), String> {
        if 4.0 * self.rel_se > max_bias {
            return Err(format!("too noisy to tell: 4 standard errors are {:.4} %", 400.0 * self.rel_se));
        }
        // Negated so that NaN fails.
        if !(self.bias.abs() <= max_bias && self.p >= SIGNIFICANCE) {
            return Err(format!(
                "mean {:.6} is off by {:+.4} % (standard error {:.4} %, p = {:.2e}; allowed: {:.2} % and p >= {SIGNIFICANCE:e})",
                self.mean,
                100.0 * self.bias,
                100.0 * self.rel_se,
                self.p,
                100.0 * max_bias,
            ));
        }
        Ok(())
    }
}

/// Edge of the blocks of [`block_test`], pixels.
pub const BLOCK: usize = 16;

/// Family-wise significance of [`block_test`]: a sound renderer fails one picture in 1000.
pub const FAMILY_SIGNIFICANCE: f64 = 1e-3;

/// Outcome of [`block_test`].
#[derive(Clone, Copy, Debug)]
pub struct BlockVerdict {
    /// Largest |t| over blocks and channels.
    pub max_t: f64,
    /// Smallest p after Holm's adjustment over all blocks and channels; below [`FAMILY_SIGNIFICANCE`] = biased.
    pub min_p: f64,
    /// Block column, block row and channel of it.
    pub worst: (usize, usize, usize),
}

/// Compares the block means of `runs` (one picture a seed, `width` across) with those of a noisy `reference` whose
/// pixels have relative standard error `rel_se` (root mean square over the picture).
///
/// Per block and channel: Student's t of `mean over seeds - reference`, variance = that of the seeds' means + the
/// reference's + [`ROUNDING`], degrees of freedom by Welch-Satterthwaite. The reference's variance is `rel_se^2
/// (block mean)^2 / 256`, its pixels being independent; since `rel_se` is an average over the picture, a block whose
/// scatter about our mean picture is larger is believed up to [`UNEVEN`] times that. (The scatter is about the block's
/// own mean difference, so a bias of the block does not hide itself.) Blocks that are black on both sides agree.
pub fn block_test(runs: &[Vec<[f32; 3]>], reference: &[[f32; 3]], width: usize, rel_se: f64) -> BlockVerdict {
    let blocks = (width / BLOCK, reference.len() / width / BLOCK);
    let mut verdict = BlockVerdict { max_t: 0.0, min_p: 1.0, worst: (0, 0, 0) };
    let mut p_values = Vec::new();
    let mut places = Vec::new();
    for (by, bx) in (0..blocks.1).flat_map(|by| (0..blocks.0).map(move |bx| (by, bx))) {
        for channel in 0..3 {
            let (t, dof) = block_t(runs, reference, width, (bx, by), channel, rel_se);
            if t.is_nan() || t.abs() > verdict.max_t {
                verdict.max_t = t.abs();
            }
            p_values.push(student_t_two_sided_p(t, dof));
            places.push((bx, by, channel));
        }
    }
    for (p, place) in holm(&p_values).into_iter().zip(places) {
        if p < verdict.min_p {
            verdict.min_p = p;
            verdict.worst = place;
        }
    }
    verdict
}

/// How much more variance than the picture's average a block of the reference may have: shadows and light from
/// several bounces away have some times the relative variance of a lit floor. Measured, largest |t|
/// by the stated variance alone and with this: Mitsuba with 32 new seeds of 32 samples against its stored pictures 3.3
/// and 3.0 in cornell, 3.7 and 2.9 in furnace; Cycles against Mitsuba in cornell, whose means agree to 0.025 %, 9.1 and
/// 3.0. In the same runs 0.5 % of planted light gave 5.0 in cornell and punctual, just short of significance: our
/// side wants more than 1024 samples in all.
pub const UNEVEN: f64 = 9.0;

/// `(t, degrees of freedom)` of one block and channel.
fn block_t(
    runs: &[Vec<[f32; 3]>],
    reference: &[[f32; 3]],
    width: usize,
    (bx, by): (usize, usize),
    channel: usize,
    rel_se: f64,
) -> (f64, f64) {
    const N: f64 = (BLOCK * BLOCK) as f64;
    let pixels: Vec<usize> =
        (0..BLOCK * BLOCK).map(|i| (by * BLOCK + i / BLOCK) * width + bx * BLOCK + i % BLOCK).collect();
    let values =
        |picture: &[[f32; 3]]| -> Vec<f64> { pixels.iter().map(|&i| f64::from(picture[i][channel])).collect() };
    let theirs = values(reference);
    let mut ours = vec![0.0; BLOCK * BLOCK];
    let mut means = Vec::with_capacity(runs.len());
    for run in runs {
        let block = values(run);
        means.push(block.iter().sum::<f64>() / N);
        ours.iter_mut().zip(&block).for_each(|(sum, x)| *sum += x / runs.len() as f64);
    }
    let seeds = Sample::of(&means);
    let residual = Sample::of(&theirs.iter().zip(&ours).map(|(r, x)| x - r).collect::<Vec<_>>());
    if residual.mean == 0.0 {
        return (0.0, f64::INFINITY);
    }
    let reference_mean = theirs.iter().sum::<f64>() / N;
    let stated = (rel_se * reference_mean).powi(2) / N;
    let own = seeds.mean_variance();
    let scatter = (residual.mean_variance() - own).clamp(stated, UNEVEN * stated);
    let parts = [
        Spread { variance: own, dof: (seeds.n - 1) as f64 },
        Spread { variance: scatter, dof: N - 1.0 },
        Spread { variance: (ROUNDING * reference_mean).powi(2), dof: f64::INFINITY },
    ];
    let se = parts.iter().map(|p| p.variance).sum::<f64>().sqrt();
    (residual.mean / se, satterthwaite(&parts))
}
