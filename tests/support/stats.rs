//! The library's distributions and tests, and Kolmogorov-Smirnov, which only tests need.
//!
//! After Press et al., "Numerical Recipes", 3rd ed., section 14.3.3. Checked against printed tables in
//! `tests/statistics.rs`.

pub use prt::compare::stats::*;

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
