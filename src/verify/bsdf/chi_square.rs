//! BSDF-01 and -02: sampled directions against the density that is claimed for them.
//!
//! As in pbrt and Mitsuba: a histogram over cells, the density integrated adaptively over each, cells with few expected
//! samples pooled, and a chi-square test. What is not sampled at all (`None`, delta lobes, directions outside the domain)
//! is one more cell, expected to hold what the integral leaves of 1; so the test also covers the integral.

use super::domain::Domain;
use super::statistics::chi_square_tail;
use super::{Scatterer, direction};
use crate::math::random::Rng;

/// How much is looked at.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Independent samples.
    pub samples: usize,
    /// Cells along either side of the domain.
    pub cells: usize,
    /// Of the random numbers.
    pub seed: u64,
}

impl Default for Settings {
    /// 1e5 samples on 40 x 40 cells.
    fn default() -> Self {
        Self { samples: 100_000, cells: 40, seed: 1 }
    }
}

/// What was found.
#[derive(Clone, Copy, Debug)]
pub struct ChiSquare {
    /// Sum of (count - expected)^2 / expected.
    pub statistic: f64,
    /// Degrees of freedom: cells after pooling, less one.
    pub dof: usize,
    /// Probability of a statistic as great by chance.
    pub p_value: f64,
    /// Integral of the density over the domain.
    pub integral: f64,
    /// How many directions were asked for.
    pub samples: usize,
    /// Share of the samples that are directions with a density, within the domain.
    pub sampled: f64,
    /// Share of the samples where the density is 0. More than 1e-5 is a fault that pooling would hide.
    pub impossible: f64,
    /// Integral of `f_cos` over the domain, per colour: the albedo without delta lobes.
    pub albedo: [f64; 3],
    /// How well the integral is known.
    pub tolerance: f64,
}

impl ChiSquare {
    /// Not so unlikely, at the probability `level` of a false alarm; and the integral is what is sampled within its tolerance and
    /// five standard deviations: a density that is too great everywhere is spread thin over the cells.
    pub fn passes(&self, level: f64) -> bool {
        let deviation = (self.sampled * (1.0 - self.sampled) / self.samples as f64).sqrt();
        let is_whole = (self.integral - self.sampled).abs() <= self.tolerance + 5.0 * deviation;
        self.p_value >= level && self.impossible <= 1e-5 && is_whole
    }
}

/// Samples `scatterer` as seen from `wo` and holds the result against its density.
pub fn chi_square(scatterer: &dyn Scatterer, wo: [f32; 3], domain: Domain, settings: Settings) -> ChiSquare {
    let Settings { samples, cells, seed } = settings;
    let view = wo.map(f64::from);
    let mut rng = Rng::of_stream(seed, "chi_square", 0);
    let u: Vec<[f32; 3]> = (0..samples).map(|_| [rng.unit(), rng.unit(), rng.unit()]).collect();
    let directions: Vec<[f32; 3]> =
        scatterer.sample(wo, &u).into_iter().flatten().filter(|s| s.pdf.is_finite()).map(|s| s.wi).collect();
    let impossible = scatterer.eval(wo, &directions).iter().filter(|e| e.pdf.is_nan() || e.pdf <= 0.0).count();
    let mut counts = vec![0.0; cells * cells];
    let mut elsewhere = samples as f64;
    for wi in directions {
        if let Some(place) = domain.place(view, wi.map(f64::from)) {
            let [a, b] = place.map(|p| ((p * cells as f64) as usize).min(cells - 1));
            counts[a * cells + b] += 1.0;
            elsewhere -= 1.0;
        }
    }
    let integrals = integrate(scatterer, wo, domain, cells, samples as f64);
    let integral: f64 = integrals.iter().map(|cell| cell[0]).sum();
    let albedo = std::array::from_fn(|k| integrals.iter().map(|cell| cell[k + 1]).sum());
    let mut rows: Vec<(f64, f64)> =
        counts.into_iter().zip(integrals).map(|(count, cell)| (count, cell[0] * samples as f64)).collect();
    rows.push((elsewhere, (1.0 - integral).max(0.0) * samples as f64));
    let (statistic, dof) = pooled(rows);
    ChiSquare {
        statistic,
        dof,
        p_value: chi_square_tail(statistic, dof),
        integral,
        samples,
        sampled: 1.0 - elsewhere / samples as f64,
        impossible: impossible as f64 / samples as f64,
        albedo,
        tolerance: if wo[2].abs() < GRAZING { 4e-3 } else { 1e-3 },
    }
}

/// Sum and degrees of freedom of rows (count, expected); rows that expect less than 5 are put together until they do not.
fn pooled(mut rows: Vec<(f64, f64)>) -> (f64, usize) {
    rows.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (mut statistic, mut cells, mut pool) = (0.0, 0, (0.0, 0.0));
    for (count, expected) in rows {
        pool = (pool.0 + count, pool.1 + expected);
        if pool.1 >= 5.0 {
            statistic += (pool.0 - pool.1).powi(2) / pool.1;
            cells += 1;
            pool = (0.0, 0.0);
        }
    }
    // What is left of a pool: as uncertain as one of 5, so that samples where none belong count all the same.
    statistic += (pool.0 - pool.1).powi(2) / 5.0;
    (statistic, usize::saturating_sub(cells, 1))
}

/// Seen at a cosine below this, densities are so steep that in f32 their integral is off by up to 0.25 %.
const GRAZING: f32 = 0.01;

/// A part of a cell whose integral is estimated.
struct Patch {
    cell: usize,
    low: [f64; 2],
    size: f64,
    estimate: [f64; 4],
    depth: u32,
}

/// Patches are split so often whatever they say: slivers of a lobe in the corner of a cell are not to be missed.
const SHALLOWEST: u32 = 3;

/// Deeper than this a patch is taken as it is: 1/256 of a cell's side.
const DEEPEST: u32 = 8;

/// Per cell the integrals of the density and of `f_cos` per colour.
///
/// 2 x 2 Gauss points in a patch against those in its four quarters, split until they agree to a fifth of the standard
/// deviation of the cell's count of `samples` (the quarters themselves are then about 15 times as good).
fn integrate(scatterer: &dyn Scatterer, wo: [f32; 3], domain: Domain, cells: usize, samples: f64) -> Vec<[f64; 4]> {
    let size = 1.0 / cells as f64;
    let mut sums = vec![[0.0; 4]; cells * cells];
    let patch = |cell: usize| {
        let low = [cell / cells, cell % cells].map(|i| i as f64 * size);
        Patch { cell, low, size, estimate: [0.0; 4], depth: 0 }
    };
    let mut patches: Vec<Patch> = (0..cells * cells).map(patch).collect();
    estimate(scatterer, wo, domain, &mut patches);
    while !patches.is_empty() {
        let quarter = |p: &Patch, k: usize| {
            let half = p.size * 0.5;
            let low = [p.low[0] + half * (k & 1) as f64, p.low[1] + half * (k >> 1) as f64];
            Patch { cell: p.cell, low, size: half, estimate: [0.0; 4], depth: p.depth + 1 }
        };
        let mut quarters: Vec<Patch> = patches.iter().flat_map(|p| (0..4).map(move |k| quarter(p, k))).collect();
        estimate(scatterer, wo, domain, &mut quarters);
        let mut open = Vec::new();
        let mut quarters = quarters.into_iter();
        for whole in &patches {
            let parts: Vec<Patch> = quarters.by_ref().take(4).collect();
            let sum: [f64; 4] = std::array::from_fn(|k| parts.iter().map(|p| p.estimate[k]).sum());
            // Not finite: no splitting helps.
            let error = (sum[0] - whole.estimate[0]).abs() * samples;
            let limit = 0.2 * (sum[0] * samples).max(1.0).sqrt() / f64::from(1 << whole.depth);
            if whole.depth < SHALLOWEST || (error > limit && whole.depth < DEEPEST) {
                open.extend(parts);
            } else {
                sums[whole.cell].iter_mut().zip(sum).for_each(|(s, v)| *s += v);
            }
        }
        patches = open;
    }
    sums
}

/// Fills in the estimates, all directions in one call.
fn estimate(scatterer: &dyn Scatterer, wo: [f32; 3], domain: Domain, patches: &mut [Patch]) {
    // Gauss and Legendre's two points.
    const POINTS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];
    let view = wo.map(f64::from);
    let (mut directions, mut shares) = (Vec::new(), Vec::new());
    for (i, patch) in patches.iter().enumerate() {
        for k in 0..4 {
            let place = [patch.low[0] + patch.size * POINTS[k & 1], patch.low[1] + patch.size * POINTS[k >> 1]];
            if let Some((wi, steradians)) = domain.direction(view, place) {
                directions.push(wi.map(|v| v as f32));
                shares.push((i, steradians * patch.size * patch.size * 0.25));
            }
        }
    }
    for (value, (i, share)) in scatterer.eval(wo, &directions).iter().zip(shares) {
        let [r, g, b] = value.f_cos;
        for (sum, v) in patches[i].estimate.iter_mut().zip([value.pdf, r, g, b]) {
            *sum += f64::from(v) * share;
        }
    }
}

/// The cosines and azimuths that views are taken from: ahead, oblique, and ever closer to grazing.
pub fn views() -> Vec<[f32; 3]> {
    [(1.0, 0.0), (0.9, 0.4), (0.5, 2.0), (0.1, 4.0), (0.02, 1.0), (1e-3, 0.3), (1e-5, 5.0)]
        .map(|(z, phi)| direction(z, phi))
        .to_vec()
}
