//! `verify light`: scenes whose pixels can be written down (`cases`, built by `build`) against that (`exact`).
//!
//! The seed is the unit: the pixels of one picture share a sequence. A case passes if the mean over the seeds is the exact
//! value by Student's t at the chance of 4 standard deviations, within what its `model` may be off by, and if it is known
//! well enough for a bias of 1 % to show.

pub mod build;
pub mod cases;
pub mod exact;

use crate::compare::blocks::ROUNDING;
use crate::compare::stats::{Sample, Spread, difference_test, normal_quantile};
use crate::error::RenderError;
use crate::render::{AccelChoice, DefaultLight, Filter, FilterShape, Progress, RenderSettings, render};
use cases::Case;
use serde::Serialize;
use std::path::PathBuf;

/// Pictures of a case unless told otherwise.
pub const SEEDS: u64 = 16;
/// Samples of a pixel unless told otherwise.
pub const SAMPLES: u32 = 1024;
/// Pixels of a picture along each side.
const SIZE: u32 = 8;
/// Chance of a difference of 4 standard deviations.
const SIGNIFICANCE: f64 = 6.3e-5;
/// Deviations that are told at most.
const MOST: f64 = 99.0;
/// Largest standard error, as a share of the exact value: a bias of 1 % is beyond what 16 seeds leave to chance (5.5 of
/// them).
pub const BLURRED: f64 = 1.5e-3;

/// How a run is made.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The first of the seeds.
    pub seed: u64,
    /// Pictures of each case, >= 2.
    pub seeds: u64,
    /// Samples of a pixel; cases that need more have a multiple of it.
    pub samples: u32,
    /// Ray backend.
    pub accel: AccelChoice,
    /// Folders in which libembree4 is looked for.
    pub embree_dirs: Vec<PathBuf>,
}

/// What was found of one case.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct LightReport {
    pub name: &'static str,
    pub id: &'static str,
    pub exact: f64,
    pub mean: f64,
    pub bias: f64,
    pub standard_error: f64,
    pub z: f64,
    pub allowed: f64,
    pub truncated: f64,
    pub samples: u32,
    pub problem: Option<String>,
}

/// The whole run.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Report {
    pub prt: &'static str,
    pub passed: bool,
    pub seed: u64,
    pub seeds: u64,
    pub samples: u32,
    pub cases: Vec<LightReport>,
}

/// All cases, on the current rayon pool.
///
/// # Errors
/// The backend is not to be had.
pub fn light(settings: &Settings) -> Result<Report, RenderError> {
    let cases: Vec<LightReport> =
        cases::cases().iter().map(|case| of_case(case, settings)).collect::<Result<_, _>>()?;
    let passed = cases.iter().all(|case| case.problem.is_none());
    let Settings { seed, seeds, samples, .. } = *settings;
    Ok(Report { prt: crate::VERSION, passed, seed, seeds, samples, cases })
}

/// One case.
///
/// # Errors
/// The backend is not to be had.
fn of_case(case: &Case, run: &Settings) -> Result<LightReport, RenderError> {
    Ok(judge(case, &shoot(case, run)?))
}

/// The pictures of a case.
#[derive(Clone, Debug)]
pub struct Shots {
    /// Mean of each, one a seed.
    pub means: Vec<f64>,
    /// Samples of a pixel.
    pub samples: u32,
    /// Share of paths that the safety cap cut.
    pub truncated: f64,
    /// Samples that were no numbers.
    pub non_finite: u64,
}

/// Renders a case.
///
/// # Errors
/// The backend is not to be had.
pub fn shoot(case: &Case, run: &Settings) -> Result<Shots, RenderError> {
    let samples = run.samples.saturating_mul(case.effort);
    let mut shots = Shots { means: Vec::new(), samples, truncated: 0.0, non_finite: 0 };
    for seed in run.seed..run.seed.saturating_add(run.seeds) {
        let settings = RenderSettings {
            width: SIZE,
            height: SIZE,
            spp: samples,
            seed,
            max_bounces: case.max_bounces,
            filter: Filter { shape: FilterShape::Box, width: 1.0 },
            brdf: case.brdf,
            light_radius: case.light_radius,
            sun_angle: case.sun_angle,
            default_light: DefaultLight::Off,
            accel: run.accel,
            embree_dirs: run.embree_dirs.clone(),
            ..RenderSettings::default()
        };
        let frame = render(&case.scene, 0, &settings, &Progress::default())?;
        shots.non_finite += frame.stats.non_finite_samples;
        shots.truncated += frame.stats.truncated / run.seeds as f64;
        let sum: f64 = frame.pixels.iter().flatten().map(|&x| f64::from(x)).sum();
        shots.means.push(sum / (3 * frame.pixels.len()) as f64);
    }
    Ok(shots)
}

/// What the pictures say of a case. What paths that were cut would have brought may be missing.
pub fn judge(case: &Case, shots: &Shots) -> LightReport {
    let Case { name, id, exact, model, .. } = *case;
    let Shots { ref means, samples, truncated, non_finite } = *shots;
    let sample = Sample::of(means);
    let spread = Spread::sum(&[sample.spread_of_mean(), Spread::known((ROUNDING * exact).powi(2))]);
    let (off, error) = (sample.mean - exact, spread.variance.sqrt());
    let beyond = (off.abs() - (model + truncated) * exact.abs()).max(0.0);
    let p = difference_test(beyond, spread).p;
    let standard_error = error / exact.abs();
    // By a normal distribution's deviations, whatever the number of seeds.
    let z = (if p > 0.0 { normal_quantile(1.0 - 0.5 * p).min(MOST) } else { MOST }).copysign(off);
    let problem = if non_finite > 0 {
        Some(format!("{non_finite} samples were not finite"))
    } else if standard_error.is_nan() || standard_error > BLURRED {
        Some(format!("too noisy to tell: the standard error is {:.2} %; give more --samples", 100.0 * standard_error))
    } else if p.is_nan() || p < SIGNIFICANCE {
        Some(format!("shows {:.6e}, not {exact:.6e}: off by {:+.3} %", sample.mean, 100.0 * off / exact))
    } else {
        None
    };
    let bias = off / exact;
    LightReport {
        name,
        id,
        exact,
        mean: sample.mean,
        bias,
        standard_error,
        z,
        allowed: model,
        truncated,
        samples,
        problem,
    }
}
