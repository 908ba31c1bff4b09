//! Medians, quartiles and means of what was measured.

use serde::Serialize;

/// The middle of several measurements and how far they spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The lower and the upper quartile.
    pub quartiles: [f64; 2],
}

impl Spread {
    /// Of `values`, which must not be empty; quartiles are interpolated linearly between neighbours.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let place = share * (sorted.len() - 1) as f64;
            let low = place as usize;
            let high = (low + 1).min(sorted.len() - 1);
            sorted[low] + (sorted[high] - sorted[low]) * (place - low as f64)
        };
        Self { median: at(0.5), quartiles: [at(0.25), at(0.75)] }
    }
}

/// The ratios of several measurements put together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Overall {
    /// Geometric mean of the median ratios.
    pub geomean: f64,
    /// The least median ratio.
    pub worst: f64,
    /// Lower and upper quartile, over the rounds, of the geometric mean of each round's ratios.
    pub spread: [f64; 2],
}

impl Overall {
    /// Of several measurements, each the ratios of its rounds (equally many); `None` of none.
    pub fn of(measurements: &[&[f64]]) -> Option<Self> {
        let rounds = measurements.iter().map(|ratios| ratios.len()).min()?;
        let medians: Vec<f64> = measurements.iter().map(|ratios| Spread::of(ratios.iter().copied()).median).collect();
        let of_round = |round: usize| geomean(measurements.iter().map(|ratios| ratios[round]));
        Some(Self {
            geomean: geomean(medians.iter().copied()),
            worst: medians.iter().copied().fold(f64::INFINITY, f64::min),
            spread: Spread::of((0..rounds).map(of_round)).quartiles,
        })
    }
}

/// Geometric mean.
fn geomean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, n) = values.into_iter().fold((0.0, 0.0), |(sum, n), v| (sum + v.ln(), n + 1.0));
    (sum / n).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_the_median_and_quartiles_between_neighbours() {
        assert_eq!(Spread::of([5.0, 1.0, 4.0, 2.0, 3.0]), Spread { median: 3.0, quartiles: [2.0, 4.0] });
        assert_eq!(Spread::of([1.0, 2.0]), Spread { median: 1.5, quartiles: [1.25, 1.75] });
        assert_eq!(Spread::of([7.0]), Spread { median: 7.0, quartiles: [7.0, 7.0] });
    }

    #[test]
    fn ratios_are_put_together_by_their_geometric_mean() {
        let overall = Overall::of(&[&[2.0, 2.0, 8.0], &[0.5, 0.5, 0.5]]).unwrap();
        assert!((overall.geomean - 1.0).abs() < 1e-12 && overall.worst == 0.5);
        // The rounds' means are 1, 1 and 2.
        assert!((overall.spread[0] - 1.0).abs() < 1e-12 && (overall.spread[1] - 1.5).abs() < 1e-12);
        assert_eq!(Overall::of(&[]), None);
    }
}
