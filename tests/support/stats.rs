//! Distributions and tests in f64: Student, Welch, chi-square, normal, Kolmogorov-Smirnov, Holm.
//!
//! After Press et al., "Numerical Recipes", 3rd ed., sections 6.1, 6.2, 6.4 and 14.3.3 (gamma, incomplete gamma and
//! beta functions, Kolmogorov-Smirnov); Holm 1979, "A simple sequentially rejective multiple test procedure".
//! Checked against printed tables in `tests/statistics.rs`.

use std::f64::consts::PI;

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

    /// Variance of the mean.
    pub fn mean_variance(&self) -> f64 {
        self.variance / self.n as f64
    }
}

/// The variance of a mean and how well it is known.
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    /// Variance of the mean.
    pub variance: f64,
    /// Degrees of freedom of that variance; infinite where it is known.
    pub dof: f64,
}

/// Degrees of freedom of a sum of variances (Welch-Satterthwaite); infinite if all are known or zero.
pub fn satterthwaite(parts: &[Spread]) -> f64 {
    let total: f64 = parts.iter().map(|p| p.variance).sum();
    let denominator: f64 = parts.iter().map(|p| p.variance.powi(2) / p.dof).sum();
    if denominator == 0.0 { f64::INFINITY } else { total.powi(2) / denominator }
}

/// `(t, degrees of freedom)` of Welch's test that two samples have the same mean.
pub fn welch(a: &Sample, b: &Sample) -> (f64, f64) {
    let spread = |s: &Sample| Spread { variance: s.mean_variance(), dof: (s.n - 1) as f64 };
    let (va, vb) = (spread(a), spread(b));
    let d = a.mean - b.mean;
    let t = if d == 0.0 { 0.0 } else { d / (va.variance + vb.variance).sqrt() };
    (t, satterthwaite(&[va, vb]))
}

/// `ln(gamma(x))`, x > 0; Lanczos' approximation with g = 7 and 9 terms, relative error below 1e-13.
pub fn ln_gamma(x: f64) -> f64 {
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    if x < 0.5 {
        return (PI / (PI * x).sin()).ln() - ln_gamma(1.0 - x);
    }
    let x = x - 1.0;
    let t = x + 7.5;
    let series = C[1..].iter().enumerate().fold(C[0], |sum, (i, c)| sum + c / (x + 1.0 + i as f64));
    0.5 * (2.0 * PI).ln() + (x + 0.5) * t.ln() - t + series.ln()
}

/// Lentz's evaluation of `1 / (1 + a(1)/(1 + a(2)/(1 + ...)))`-like fractions, given as `b0 + a1/(b1 + a2/(b2 + ...))`.
fn lentz(b0: f64, terms: impl Iterator<Item = (f64, f64)>) -> f64 {
    const TINY: f64 = 1e-300;
    let guard = |x: f64| if x.abs() < TINY { TINY } else { x };
    let (mut f, mut c, mut d) = (guard(b0), guard(b0), 0.0);
    for (a, b) in terms {
        d = 1.0 / guard(b + a * d);
        c = guard(b + a / c);
        f *= c * d;
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    f
}

/// Regularised incomplete beta function `I_x(a, b)`, x in [0, 1].
pub fn beta_inc(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - beta_inc(b, a, 1.0 - x);
    }
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (-x).ln_1p()).exp() / a;
    let terms = (0..500).map(|i| {
        let m = f64::from(i / 2);
        let a_i = match i {
            0 => 1.0,
            i if i % 2 == 0 => m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            _ => -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        };
        (a_i, 1.0)
    });
    front * lentz(0.0, terms)
}

/// Upper regularised incomplete gamma function `Q(a, x)`.
pub fn gamma_q(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    if x == f64::INFINITY {
        return 0.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-16 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return 1.0 - front * sum;
    }
    let terms = (0..10_000).map(|i| {
        let i = f64::from(i);
        (if i == 0.0 { 1.0 } else { i * (a - i) }, x + 2.0 * i + 1.0 - a)
    });
    front * lentz(0.0, terms)
}

/// Chance that a standard normal exceeds |z| on either side.
pub fn normal_two_sided_p(z: f64) -> f64 {
    if z.is_nan() { 0.0 } else { gamma_q(0.5, 0.5 * z * z) }
}

/// Chance that |T| exceeds |t| for Student's T with `dof` degrees of freedom (may be infinite).
/// A `t` that is not a number counts as a failure: 0.
pub fn student_t_two_sided_p(t: f64, dof: f64) -> f64 {
    if t.is_nan() || dof.is_nan() {
        0.0
    } else if dof > 1e8 {
        normal_two_sided_p(t)
    } else {
        beta_inc(0.5 * dof, 0.5, dof / (dof + t * t))
    }
}

/// Chance that chi-square with `dof` degrees of freedom exceeds `x`.
pub fn chi_square_p(x: f64, dof: f64) -> f64 {
    if x.is_nan() { 0.0 } else { gamma_q(0.5 * dof, 0.5 * x) }
}

/// The `x >= 0` at which the falling function `upper` equals `p`, by bisection to full precision.
fn upper_quantile(p: f64, upper: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while upper(high) > p {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if upper(middle) > p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The `z` that a standard normal stays below with chance `p` in (0, 1).
pub fn normal_quantile(p: f64) -> f64 {
    student_t_quantile(p, f64::INFINITY)
}

/// The `t` that Student's T stays below with chance `p` in (0, 1).
pub fn student_t_quantile(p: f64, dof: f64) -> f64 {
    let t = upper_quantile(2.0 * p.min(1.0 - p), |t| student_t_two_sided_p(t, dof));
    if p < 0.5 { -t } else { t }
}

/// Holm's adjusted p-values, in the order given: reject those <= the family-wise significance.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&i, &j| p[i].total_cmp(&p[j]));
    let mut adjusted = vec![0.0; p.len()];
    let mut running = 0.0_f64;
    for (rank, &i) in order.iter().enumerate() {
        running = running.max(p[i] * (p.len() - rank) as f64).min(1.0);
        adjusted[i] = running;
    }
    adjusted
}

/// Chance of a Kolmogorov-Smirnov distance at least as large if `values` are uniform in [0, 1].
/// Kolmogorov's limit with Stephens' correction, good for n >= 5.
pub fn ks_uniform_p(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let distance = sorted.iter().enumerate().fold(0.0_f64, |d, (i, x)| {
        let below = i as f64 / n;
        d.max(x - below).max(below + 1.0 / n - x)
    });
    kolmogorov_p((n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distance)
}

/// Upper tail of Kolmogorov's distribution.
pub fn kolmogorov_p(lambda: f64) -> f64 {
    if lambda.is_nan() {
        return 0.0;
    }
    if lambda < 0.2 {
        return 1.0; // the alternating series loses all digits there; the true value is above 1 - 1e-12
    }
    let sum: f64 = (1..=100)
        .map(|k| {
            let sign = if k % 2 == 1 { 1.0 } else { -1.0 };
            sign * (-2.0 * f64::from(k * k) * lambda * lambda).exp()
        })
        .sum();
    (2.0 * sum).clamp(0.0, 1.0)
}
