//! Distributions and multiple testing.
//!
//! After Press, Teukolsky, Vetterling, Flannery 2007, "Numerical Recipes", 3rd edition, sections 6.1 (log gamma, with
//! the coefficients of Lanczos for g = 7), 6.2 (incomplete gamma) and 6.4 (incomplete beta by Lentz's method).

/// Relative accuracy at which series and continued fractions stop.
const ACCURACY: f64 = 1e-15;
/// Stands for 0 in Lentz's method.
const TINY: f64 = 1e-300;
/// Terms after which they stop in any case; large degrees of freedom need about their square root.
const MOST_TERMS: usize = 100_000;

/// Natural logarithm of the gamma function, `x > 0`.
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
        let pi = std::f64::consts::PI;
        return (pi / (pi * x).sin()).ln() - ln_gamma(1.0 - x);
    }
    let x = x - 1.0;
    let series: f64 = (1..9).map(|i| COEFFICIENTS[i] / (x + i as f64)).sum::<f64>() + COEFFICIENTS[0];
    let t = x + G + 0.5;
    0.5 * (2.0 * std::f64::consts::PI).ln() + (x + 0.5) * t.ln() - t + series.ln()
}

/// Regularised incomplete beta function `I_x(a, b)`, `a, b > 0`, `x` in [0, 1].
pub fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (-x).ln_1p()).exp();
    if x < (a + 1.0) / (a + b + 2.0) {
        front * beta_fraction(a, b, x) / a
    } else {
        1.0 - front * beta_fraction(b, a, 1.0 - x) / b
    }
}

/// The continued fraction of the incomplete beta function by Lentz's method.
fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    let away_from_0 = |v: f64| if v.abs() < TINY { TINY } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / away_from_0(1.0 - (a + b) * x / (a + 1.0));
    let mut result = d;
    for m in 1..MOST_TERMS {
        let m = m as f64;
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / away_from_0(1.0 + even * d);
        c = away_from_0(1.0 + even / c);
        result *= d * c;
        d = 1.0 / away_from_0(1.0 + odd * d);
        c = away_from_0(1.0 + odd / c);
        result *= d * c;
        if (d * c - 1.0).abs() < ACCURACY {
            break;
        }
    }
    result
}

/// Regularised upper incomplete gamma function `Q(a, x)`, `a > 0`, `x >= 0`.
pub fn incomplete_gamma_upper(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        for _ in 0..MOST_TERMS {
            n += 1.0;
            term *= x / n;
            sum += term;
            if term < sum * ACCURACY {
                break;
            }
        }
        return 1.0 - front * sum;
    }
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / b;
    let mut result = d;
    for i in 1..MOST_TERMS {
        let an = -(i as f64) * (i as f64 - a);
        b += 2.0;
        d = an * d + b;
        d = 1.0 / if d.abs() < TINY { TINY } else { d };
        c = b + an / c;
        c = if c.abs() < TINY { TINY } else { c };
        result *= d * c;
        if (d * c - 1.0).abs() < ACCURACY {
            break;
        }
    }
    front * result
}

/// Chance that Student's t with `dof > 0` degrees of freedom is farther from 0 than `t`.
pub fn student_t_two_sided_p(t: f64, dof: f64) -> f64 {
    if t.is_infinite() {
        return 0.0;
    }
    if dof > 1e7 {
        // The normal distribution, to which t differs by less than 1e-7 relative here; its fraction needs few terms.
        return incomplete_gamma_upper(0.5, 0.5 * t * t);
    }
    incomplete_beta(0.5 * dof, 0.5, dof / (dof + t * t))
}

/// The `t > 0` that is exceeded in size with chance `p` in (0, 1).
pub fn student_t_quantile(p: f64, dof: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while student_t_two_sided_p(high, dof) > p && high < 1e300 {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if student_t_two_sided_p(middle, dof) > p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Chance that chi-square with `dof > 0` degrees of freedom exceeds `statistic`.
pub fn chi_square_p(statistic: f64, dof: f64) -> f64 {
    incomplete_gamma_upper(0.5 * dof, 0.5 * statistic)
}

/// Mean and unbiased variance of at least two values.
pub fn mean_and_variance(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0))
}

/// Result of [`welch`].
#[derive(Clone, Copy, Debug)]
pub struct Welch {
    /// Difference of the means over its standard error.
    pub t: f64,
    /// Effective degrees of freedom (Satterthwaite 1946).
    pub dof: f64,
    /// Two-sided chance of such a difference when the means are equal.
    pub p: f64,
}

/// Welch's test (1947) that two sets of at least two independent values have one mean.
pub fn welch(a: &[f64], b: &[f64]) -> Welch {
    let ((mean_a, var_a), (mean_b, var_b)) = (mean_and_variance(a), mean_and_variance(b));
    let (na, nb) = (a.len() as f64, b.len() as f64);
    let (sa, sb) = (var_a / na, var_b / nb);
    if sa + sb == 0.0 {
        let equal = mean_a == mean_b;
        let t = if equal { 0.0 } else { (mean_a - mean_b).signum() * f64::INFINITY };
        return Welch { t, dof: na + nb - 2.0, p: if equal { 1.0 } else { 0.0 } };
    }
    let t = (mean_a - mean_b) / (sa + sb).sqrt();
    let dof = (sa + sb).powi(2) / (sa * sa / (na - 1.0) + sb * sb / (nb - 1.0));
    Welch { t, dof, p: student_t_two_sided_p(t, dof) }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn near(value: f64, expected: f64, relative: f64) {
        assert!((value / expected - 1.0).abs() < relative, "{value} is not {expected}");
    }

    #[test]
    fn log_gamma_of_known_values() {
        near(ln_gamma(0.5), 0.5 * std::f64::consts::PI.ln(), 1e-13);
        near(ln_gamma(11.0), 3_628_800.0_f64.ln(), 1e-13);
        near(ln_gamma(0.1), 2.252_712_651_734_206, 1e-12);
    }

    #[test]
    fn student_t_of_closed_forms() {
        for t in [0.01, 0.5, 1.0, 3.0, 30.0] {
            // 1 degree of freedom is Cauchy; 2 have an algebraic form.
            near(student_t_two_sided_p(t, 1.0), 1.0 - 2.0 / std::f64::consts::PI * t.atan(), 1e-10);
            near(student_t_two_sided_p(-t, 2.0), 1.0 - t / (2.0 + t * t).sqrt(), 1e-9);
        }
        assert_eq!(student_t_two_sided_p(0.0, 5.0), 1.0);
    }

    #[test]
    fn student_t_of_table_values() {
        // Two-sided 5 % and 0.1 % points as every table has them.
        for (t, dof, p) in [(2.228, 10.0, 0.05), (4.587, 10.0, 0.001), (2.042, 30.0, 0.05), (2.776, 4.0, 0.05)] {
            near(student_t_two_sided_p(t, dof), p, 2e-3);
            near(student_t_quantile(p, dof), t, 1e-3);
        }
        near(student_t_two_sided_p(1.959_963_984_540_054, 1e9), 0.05, 1e-6);
        near(student_t_two_sided_p(5.0, 9.9e6), student_t_two_sided_p(5.0, 1.1e7), 1e-4);
    }

    #[test]
    fn chi_square_of_closed_forms_and_table_values() {
        for x in [0.1, 1.0, 10.0, 100.0] {
            near(chi_square_p(x, 2.0), (-0.5 * x).exp(), 1e-11);
            near(chi_square_p(x, 4.0), (-0.5 * x).exp() * (1.0 + 0.5 * x), 1e-11);
        }
        near(chi_square_p(3.841_458_820_694_124, 1.0), 0.05, 1e-9);
        near(chi_square_p(124.342, 100.0), 0.05, 1e-4);
    }

    #[test]
    fn welch_of_a_worked_example() {
        // Means 5/2 and 4, variances 5/3 and 4, so t = -1.5 / sqrt(5/12 + 4/3).
        let result = welch(&[1.0, 2.0, 3.0, 4.0], &[2.0, 4.0, 6.0]);
        near(result.t, -1.5 / 1.75_f64.sqrt(), 1e-12);
        near(result.dof, 1.75 * 1.75 / (25.0 / 144.0 / 3.0 + 16.0 / 9.0 / 2.0), 1e-12);
        assert_eq!(welch(&[1.0, 1.0], &[1.0, 1.0]).p, 1.0);
        assert_eq!(welch(&[1.0, 1.0], &[2.0, 2.0]).p, 0.0);
    }

    #[test]
    fn holm_of_a_worked_example() {
        let adjusted = holm(&[0.01, 0.04, 0.03, 0.005]);
        for (a, b) in adjusted.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            near(*a, b, 1e-12);
        }
        assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
    }
}
