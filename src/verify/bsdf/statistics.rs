//! How unlikely a chi-square sum is, and the level of one test among many.

/// Probability that a chi-square variable of `dof` degrees of freedom exceeds `x`. 1 without any degree of freedom.
pub fn chi_square_tail(x: f64, dof: usize) -> f64 {
    if dof == 0 || x <= 0.0 {
        return 1.0;
    }
    let (a, x) = (dof as f64 / 2.0, x / 2.0);
    // x^a e^-x / Gamma(a).
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        // The series of the lower incomplete gamma function.
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-15 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return (1.0 - front * sum).clamp(0.0, 1.0);
    }
    // The continued fraction of the upper one, from the front (Lentz).
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut value = d;
    for i in 1..10_000 {
        let i = f64::from(i);
        let numerator = -i * (i - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        value *= c * d;
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    (front * value).clamp(0.0, 1.0)
}

/// Natural logarithm of the gamma function for x > 0, relative error below 1e-12: Stirling's series beyond 10, to which the
/// recurrence leads from below.
fn ln_gamma(x: f64) -> f64 {
    let (mut x, mut product) = (x, 1.0);
    while x < 10.0 {
        product *= x;
        x += 1.0;
    }
    let r = 1.0 / (x * x);
    let series = (1.0 / 12.0 - r * (1.0 / 360.0 - r * (1.0 / 1260.0 - r * (1.0 / 1680.0 - r / 1188.0)))) / x;
    (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series - f64::ln(product)
}

/// The level of each of `tests` independent tests for which one of them fails by chance with probability `level` (Sidak).
pub fn sidak(level: f64, tests: usize) -> f64 {
    -((-level).ln_1p() / tests.max(1) as f64).exp_m1()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_the_tables() {
        // Two degrees: e^(-x/2). One: 1 - erf(sqrt(x/2)). The others are the 5 %, 1 % and 0.1 % points of printed tables.
        for x in [0.1, 1.0, 5.0, 40.0] {
            assert!((chi_square_tail(x, 2) / (-x / 2.0).exp() - 1.0).abs() < 1e-11, "{x}");
        }
        let table = [(3.841_458_8, 1, 0.05), (18.307_038, 10, 0.05), (29.588_298, 10, 0.001), (135.806_72, 100, 0.01)];
        for (x, dof, p) in table {
            assert!((chi_square_tail(x, dof) / p - 1.0).abs() < 1e-6, "{x} of {dof}: {}", chi_square_tail(x, dof));
        }
        // The median is near dof - 2/3.
        assert!((chi_square_tail(1_999.333_4, 2000) - 0.5).abs() < 1e-4);
        assert_eq!(chi_square_tail(3.0, 0), 1.0);
    }

    #[test]
    fn levels_shrink_with_the_number_of_tests() {
        assert!((sidak(0.01, 1) - 0.01).abs() < 1e-15);
        let each = sidak(0.01, 300);
        assert!(((1.0 - each).powi(300) - 0.99).abs() < 1e-12);
    }
}
