//! Distributions and tests in f64: Student, Welch, chi-square, normal, Holm.
//!
//! After Press, Teukolsky, Vetterling, Flannery 2007, "Numerical Recipes", 3rd edition, sections 6.1 (log gamma, with
//! the coefficients of Lanczos for g = 7), 6.2 (incomplete gamma) and 6.4 (incomplete beta), both fractions by Lentz's
//! method; Satterthwaite 1946; Welch 1947; Holm 1979. Checked against printed tables in `tests/statistics.rs`.
//!
//! What is not a number counts as a failure: its p is 0.

use std::f64::consts::PI;

/// Relative accuracy at which series and continued fractions stop.
const ACCURACY: f64 = 1e-15;
/// Stands for 0 in Lentz's method.
const TINY: f64 = 1e-300;
/// Terms after which they stop in any case; large degrees of freedom need about their square root.
const MOST_TERMS: usize = 100_000;

/// Count, mean and variance of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Values.
    pub n: usize,
    /// Arithmetic mean.
    pub mean: f64,
    /// Unbiased variance of one value (`n - 1` in the denominator); 0 for `n < 2`.
    pub variance: f64,
}

impl Sample {
    /// Statistics of `values`, by two passes.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len();
        let mean = values.iter().sum::<f64>() / n.max(1) as f64;
        let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
        Self { n, mean, variance: if n < 2 { 0.0 } else { squares / (n - 1) as f64 } }
    }

    /// Variance of the mean, with its degrees of freedom; at least two values.
    pub fn spread_of_mean(&self) -> Spread {
        Spread { variance: self.variance / self.n as f64, dof: self.n as f64 - 1.0 }
    }
}

/// The variance of a mean and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Variance of the mean.
    pub variance: f64,
    /// Degrees of freedom of that variance; infinite where it is known.
    pub dof: f64,
}

impl Spread {
    /// A variance that is known.
    pub fn known(variance: f64) -> Self {
        Self { variance, dof: f64::INFINITY }
    }

    /// The variance of a sum of independent means, degrees of freedom after Satterthwaite 1946 (infinite if all are
    /// known or zero).
    pub fn sum(parts: &[Self]) -> Self {
        let variance: f64 = parts.iter().map(|p| p.variance).sum();
        let denominator: f64 = parts.iter().map(|p| p.variance.powi(2) / p.dof).sum();
        Self { variance, dof: if denominator == 0.0 { f64::INFINITY } else { variance.powi(2) / denominator } }
    }
}

/// Result of [`difference_test`] and [`welch`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TTest {
    /// Difference over its standard error; 0 if there is no difference.
    pub t: f64,
    /// Degrees of freedom; infinite if the standard error is known.
    pub dof: f64,
    /// Two-sided chance of such a difference if there is none in truth.
    pub p: f64,
}

/// Student's test that a difference of the given spread is 0 in truth.
pub fn difference_test(difference: f64, spread: Spread) -> TTest {
    let t = if difference == 0.0 { 0.0 } else { difference / spread.variance.sqrt() };
    TTest { t, dof: spread.dof, p: student_t_two_sided_p(t, spread.dof) }
}

/// Welch's test (1947) that two samples of at least two independent values have one mean.
pub fn welch(a: &Sample, b: &Sample) -> TTest {
    difference_test(a.mean - b.mean, Spread::sum(&[a.spread_of_mean(), b.spread_of_mean()]))
}

/// Natural logarithm of the gamma function, `x > 0`; relative error below 1e-13.
#[expect(clippy::excessive_precision, reason = "the coefficients as published")]
pub fn ln_gamma(x: f64) -> f64 {
    const G: f64 = 7.0;
    const COEFFICIENTS: [f64; 9] = [
        0.999_999_999_999_809_93,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_13,
        -176.615_029_162_140_59,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_571_6e-6,
        1.505_632_735_149_311_6e-7,
    ];
    if x < 0.5 {
        // Reflection.
        return (PI / (PI * x).sin()).ln() - ln_gamma(1.0 - x);
    }
    let x = x - 1.0;
    let series: f64 = (1..9).map(|i| COEFFICIENTS[i] / (x + i as f64)).sum::<f64>() + COEFFICIENTS[0];
    let t = x + G + 0.5;
    0.5 * (2.0 * PI).ln() + (x + 0.5) * t.ln() - t + series.ln()
}

/// The continued fraction `a1/(b1 + a2/(b2 + ...))` of `terms` (a, b), by Lentz's method.
fn lentz(terms: impl Fn(f64) -> (f64, f64)) -> f64 {
    let away_from_0 = |x: f64| if x.abs() < TINY { TINY } else { x };
    let (mut result, mut c, mut d) = (TINY, TINY, 0.0);
    for i in 0..MOST_TERMS {
        let (a, b) = terms(i as f64);
        d = 1.0 / away_from_0(b + a * d);
        c = away_from_0(b + a / c);
        result *= c * d;
        if (c * d - 1.0).abs() < ACCURACY {
            break;
        }
    }
    result
}

/// Regularised incomplete beta function `I_x(a, b)`, `a, b > 0`, `x` in [0, 1].
pub fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (-x).ln_1p()).exp();
    // The fraction converges fast on this side of the mean only.
    if x < (a + 1.0) / (a + b + 2.0) {
        front * beta_fraction(a, b, x) / a
    } else {
        1.0 - front * beta_fraction(b, a, 1.0 - x) / b
    }
}

/// The continued fraction of the incomplete beta function (Numerical Recipes 6.4.5).
fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    lentz(|i| {
        let m = (0.5 * i).floor();
        let numerator = if i == 0.0 {
            1.0
        } else if i == 2.0 * m {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        };
        (numerator, 1.0)
    })
}

/// Regularised upper incomplete gamma function `Q(a, x)`, `a > 0`, `x >= 0` (may be infinite).
pub fn incomplete_gamma_upper(a: f64, x: f64) -> f64 {
    if x <= 0.0 || x == f64::INFINITY {
        return if x <= 0.0 { 1.0 } else { 0.0 };
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x >= a + 1.0 {
        return front * lentz(|i| (if i == 0.0 { 1.0 } else { i * (a - i) }, x + 2.0 * i + 1.0 - a));
    }
    let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
    for _ in 0..MOST_TERMS {
        n += 1.0;
        term *= x / n;
        sum += term;
        if term < sum * ACCURACY {
            break;
        }
    }
    1.0 - front * sum
}

/// Chance that a standard normal is farther from 0 than `z`.
pub fn normal_two_sided_p(z: f64) -> f64 {
    if z.is_nan() { 0.0 } else { incomplete_gamma_upper(0.5, 0.5 * z * z) }
}

/// Chance that Student's t with `dof > 0` degrees of freedom (may be infinite) is farther from 0 than `t`.
pub fn student_t_two_sided_p(t: f64, dof: f64) -> f64 {
    if t.is_nan() || dof.is_nan() {
        0.0
    } else if dof > 1e7 {
        // p differs by t^4 / (4 dof) relative, below 2e-5 where it matters (|t| < 5), and costs fewer terms.
        normal_two_sided_p(t)
    } else {
        incomplete_beta(0.5 * dof, 0.5, dof / (dof + t * t))
    }
}

/// Chance that chi-square with `dof > 0` degrees of freedom exceeds `statistic`.
pub fn chi_square_p(statistic: f64, dof: f64) -> f64 {
    if statistic.is_nan() { 0.0 } else { incomplete_gamma_upper(0.5 * dof, 0.5 * statistic) }
}

/// The `z` that a standard normal stays below with chance `p` in (0, 1).
pub fn normal_quantile(p: f64) -> f64 {
    student_t_quantile(p, f64::INFINITY)
}

/// The `t` that Student's t with `dof > 0` degrees of freedom stays below with chance `p` in (0, 1).
pub fn student_t_quantile(p: f64, dof: f64) -> f64 {
    let two_sided = 2.0 * p.min(1.0 - p);
    let (mut low, mut high) = (0.0, 1.0);
    while student_t_two_sided_p(high, dof) > two_sided {
        high *= 2.0;
    }
    // Bisection to the last bit.
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if student_t_two_sided_p(middle, dof) > two_sided { low = middle } else { high = middle }
    }
    if p < 0.5 { -0.5 * (low + high) } else { 0.5 * (low + high) }
}

/// P-values adjusted after Holm 1979, in the order of `p`: rejecting those below a level keeps the chance of any false
/// rejection below that level.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let mut adjusted = vec![0.0; p.len()];
    let mut largest = 0.0_f64;
    for (rank, &index) in order.iter().enumerate() {
        largest = largest.max(p[index] * (p.len() - rank) as f64).min(1.0);
        adjusted[index] = largest;
    }
    adjusted
}
