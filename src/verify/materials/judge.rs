//! All checks of one surface seen from one side, and what is too much.

use super::side::{AsEnergy, Half, Side};
use crate::math::random::Rng;
use crate::verify::bsdf::Scatterer;
use crate::verify::bsdf::checks::{agreement, finiteness, furnace, reciprocity};
use crate::verify::bsdf::chi_square::{self, ChiSquare, chi_square};
use crate::verify::bsdf::domain::Domain;
use crate::verify::bsdf::statistics::sidak;

/// BSDF-05: more than this is energy from nowhere.
pub const MOST_ENERGY: f64 = 1.0 + 2e-3;
/// BSDF-05: how far from 1 a white surface may be.
pub const WHITE: f64 = 5e-3;
/// BSDF-03, relative.
pub const AGREEMENT: f64 = 1e-4;
/// BSDF-04, relative.
pub const RECIPROCITY: f64 = 1e-4;
/// BSDF-01: probability that a sound grid, or a sound file, fails.
pub const FALSE_ALARM: f64 = 0.01;
/// Chi-square tests of a run that are not more are taken as so many.
pub const LEAST_TESTS: usize = 100;

/// How much is looked at.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Samples of each chi-square test.
    pub samples: usize,
    /// Along either side of the square of stratified samples of a furnace.
    pub furnace: usize,
    /// Of the random numbers.
    pub seed: u64,
    /// Chi-square tests in the whole run, of which one may fail by chance with probability [`FALSE_ALARM`].
    pub tests: usize,
}

/// What was measured of one surface.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Least and greatest albedo of a channel.
    pub albedo: [f64; 2],
    /// Least probability of a chi-square test; `None` where there was none.
    pub p_value: Option<f64>,
    /// Greatest difference between the integral of the density and the share of samples.
    pub integral: f64,
    /// Greatest relative difference between samples and values.
    pub agreement: f64,
    /// Between both ways.
    pub reciprocity: f64,
    /// Numbers that are none.
    pub faults: usize,
    /// What is too much, in words.
    pub problems: Vec<String>,
}

impl Default for Measured {
    fn default() -> Self {
        let (albedo, problems) = ([f64::INFINITY, 0.0], Vec::new());
        Self { albedo, p_value: None, integral: 0.0, agreement: 0.0, reciprocity: 0.0, faults: 0, problems }
    }
}

impl Measured {
    /// Takes the worst of both.
    pub fn add(&mut self, other: Self) {
        self.albedo = [self.albedo[0].min(other.albedo[0]), self.albedo[1].max(other.albedo[1])];
        self.p_value = least(self.p_value, other.p_value);
        self.integral = self.integral.max(other.integral);
        self.agreement = self.agreement.max(other.agreement);
        self.reciprocity = self.reciprocity.max(other.reciprocity);
        self.faults += other.faults;
        self.problems.extend(other.problems);
    }
}

/// What may be expected of a surface, and what not.
#[derive(Clone, Debug)]
pub struct Expected {
    /// The greatest albedo; `None`: any.
    pub energy: Option<f64>,
    /// How far from 1 the albedo may be, if all light has to come back.
    pub white: Option<f64>,
    /// Need not be the same both ways.
    pub is_one_way: bool,
    /// Why less is asked for.
    pub exceptions: Vec<&'static str>,
}

impl Default for Expected {
    fn default() -> Self {
        Self { energy: Some(MOST_ENERGY), white: None, is_one_way: false, exceptions: Vec::new() }
    }
}

impl Expected {
    /// Of a surface. What the shading is known to do worse than the bars is written down here, so that it shows when that
    /// grows.
    pub fn of(side: &Side<'_>) -> Self {
        let mut expected = Self { white: side.is_white().then_some(WHITE), ..Self::default() };
        let mut except = |reason| expected.exceptions.push(reason);
        if side.is_disney() {
            except("energy: the Disney BRDF of 2012 is as published");
            expected.energy = None;
        }
        if side.is_coated() {
            except("reciprocity: the coat takes from below by its albedo towards the viewer");
            expected.is_one_way = true;
        }
        if side.transmits() {
            except("reciprocity: rough glass is scaled by its albedo towards the viewer");
            expected.is_one_way = true;
        }
        if side.is_stretched() {
            except(
                "energy and white within 3 % (films 10 %, glass 4 %): tables of stretched lobes are coarse at grazing angles",
            );
            let most = match (side.has_film(), side.refracts()) {
                (true, _) => 0.1,
                (_, true) => 0.04,
                _ => 0.03,
            };
            (expected.energy, expected.white) = (Some(1.0 + most), expected.white.map(|_| most));
            if side.refracts() {
                except("not white: glass has tables of round lobes only");
                expected.white = None;
            }
        }
        expected
    }
}

/// Checks `side` from `wo`.
pub fn judge(side: &Side<'_>, wo: [f32; 3], effort: Effort) -> Measured {
    let mut found = Measured::default();
    energy(&AsEnergy(side), wo, &Expected::of(side), effort, &mut found);
    for (domain, half) in side.domains(wo) {
        let settings = chi_square::Settings { samples: effort.samples, seed: effort.seed, ..Default::default() };
        let result = match half {
            Some(is_below) => chi_square(&Half { side, is_below }, wo, domain, settings),
            None => chi_square(side, wo, domain, settings),
        };
        distribution(&result, wo, effort, &mut found);
    }
    rest(side, wo, &Expected::of(side), effort, &mut found);
    found
}

/// What is the same for any scatterer: for those of the tests, too.
pub fn judge_any(
    scatterer: &dyn Scatterer,
    wo: [f32; 3],
    domain: Domain,
    expected: &Expected,
    effort: Effort,
) -> Measured {
    let mut found = Measured::default();
    energy(scatterer, wo, expected, effort, &mut found);
    let settings = chi_square::Settings { samples: effort.samples, seed: effort.seed, ..Default::default() };
    distribution(&chi_square(scatterer, wo, domain, settings), wo, effort, &mut found);
    rest(scatterer, wo, expected, effort, &mut found);
    found
}

/// BSDF-05. Noise is allowed for: three standard deviations of as many independent samples, which stratified ones are below.
fn energy(scatterer: &dyn Scatterer, wo: [f32; 3], expected: &Expected, effort: Effort, found: &mut Measured) {
    let furnace = furnace(scatterer, wo, effort.furnace, effort.seed);
    let noise = furnace.deviation.map(|d| 3.0 * d / effort.furnace as f64);
    let least = furnace.albedo.into_iter().fold(f64::INFINITY, f64::min);
    let greatest = furnace.albedo.into_iter().fold(0.0, f64::max);
    found.albedo = [least, greatest];
    for (albedo, noise) in furnace.albedo.into_iter().zip(noise) {
        if let Some(most) = expected.energy
            && (albedo.is_nan() || albedo > most + noise)
        {
            found.problems.push(format!("gives back {albedo:.5} of the light at {}; allowed: {most}", at(wo)));
            return;
        }
        if let Some(white) = expected.white
            && (albedo.is_nan() || (albedo - 1.0).abs() > white + noise)
        {
            let most = format!("1 +- {white}");
            found
                .problems
                .push(format!("is white and gives back {albedo:.5} of the light at {}; allowed: {most}", at(wo)));
            return;
        }
    }
}

/// BSDF-01, -02.
fn distribution(result: &ChiSquare, wo: [f32; 3], effort: Effort, found: &mut Measured) {
    let level = sidak(FALSE_ALARM, effort.tests.max(LEAST_TESTS));
    found.p_value = least(found.p_value, Some(result.p_value));
    found.integral = found.integral.max((result.integral - result.sampled).abs());
    if !result.passes(level) {
        let ChiSquare { p_value, integral, sampled, impossible, .. } = result;
        found.problems.push(format!(
            "is sampled otherwise than its density says at {}: p {p_value:.2e} (at least {level:.1e}), density {integral:.5} \
             for {sampled:.5} of the samples, {impossible:.1e} of them where it is 0",
            at(wo)
        ));
    }
}

/// BSDF-03, -04, -10.
fn rest(scatterer: &dyn Scatterer, wo: [f32; 3], expected: &Expected, effort: Effort, found: &mut Measured) {
    let agreement = agreement(scatterer, wo, 1000, effort.seed);
    found.agreement = agreement.worst;
    if agreement.worst > AGREEMENT {
        found.problems.push(format!("samples and values differ by {:.1e}: {}", agreement.worst, agreement.place));
    }
    let both_ways = reciprocity(scatterer, 300, effort.seed);
    if !expected.is_one_way {
        found.reciprocity = both_ways.worst;
        if both_ways.worst > RECIPROCITY {
            found.problems.push(format!("is not reciprocal: {:.1e}, {}", both_ways.worst, both_ways.place));
        }
    }
    let faults = finiteness(scatterer, 10, 40, effort.seed);
    found.faults = faults.count;
    if let Some(first) = faults.first {
        found.problems.push(format!("{} numbers are none or negative, first at {first}", faults.count));
    }
}

fn at(wo: [f32; 3]) -> String {
    format!("cosine {} azimuth {:.2}", wo[2], wo[1].atan2(wo[0]))
}

fn least(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

/// The seed of one view among many.
pub fn seed_of(seed: u64, name: &str, number: u64) -> u64 {
    u64::from(Rng::of_stream(seed, name, number).bits())
}
