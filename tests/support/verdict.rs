//! When is a picture's mean wrong? With seeds as the unit, like `prt::compare::blocks`, which judges by blocks.

use super::stats::{Sample, Spread, difference_test};
use prt::compare::blocks::ROUNDING;

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
    let spread = Spread::sum(&[
        sample.spread_of_mean(),
        Spread::known((expected.rel_se * value).powi(2)),
        Spread::known((ROUNDING * value).powi(2)),
    ]);
    let p = difference_test(sample.mean - value, spread).p;
    MeanVerdict { mean: sample.mean, bias: sample.mean / value - 1.0, rel_se: spread.variance.sqrt() / value.abs(), p }
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
