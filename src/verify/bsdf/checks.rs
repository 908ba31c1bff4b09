//! BSDF-03, -04, -05 and -10: sample against value, reciprocity, energy, finiteness.

use super::{Scatterer, direction};
use crate::math::random::Rng;

/// Directional albedo as sampling finds it.
#[derive(Clone, Copy, Debug)]
pub struct Furnace {
    /// Mean weight per colour, delta lobes included: the radiance in an environment of radiance 1.
    pub albedo: [f64; 3],
    /// Standard deviation of a single sample's weight, per colour: what sampling leaves of noise.
    pub deviation: [f64; 3],
    /// The greatest weight of a single sample.
    pub greatest: f64,
}

/// The albedo from `wo` by `side` x `side` stratified directions (their lobe numbers stratified and shuffled).
pub fn furnace(scatterer: &dyn Scatterer, wo: [f32; 3], side: usize, seed: u64) -> Furnace {
    let mut rng = Rng::of_stream(seed, "furnace", 0);
    let n = side * side;
    let mut lobes: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        lobes.swap(i, rng.below(i + 1));
    }
    let below_1 = |v: f64| (v as f32).min(1.0 - f32::EPSILON / 2.0);
    let u: Vec<[f32; 3]> = (0..n)
        .map(|i| {
            let mut within = |k: usize, of: usize| below_1((k as f64 + f64::from(rng.unit())) / of as f64);
            [within(i / side, side), within(i % side, side), within(lobes[i], n)]
        })
        .collect();
    let (mut sum, mut squares, mut greatest) = ([0.0; 3], [0.0; 3], 0.0f64);
    for sample in scatterer.sample(wo, &u).into_iter().flatten() {
        for k in 0..3 {
            let weight = f64::from(sample.weight[k]);
            sum[k] += weight;
            squares[k] += weight * weight;
            greatest = greatest.max(weight);
        }
    }
    let albedo = sum.map(|s| s / n as f64);
    let deviation = std::array::from_fn(|k| (squares[k] / n as f64 - albedo[k] * albedo[k]).max(0.0).sqrt());
    Furnace { albedo, deviation, greatest }
}

/// The greatest relative difference that was seen, and where.
#[derive(Clone, Debug, Default)]
pub struct Difference {
    /// Relative.
    pub worst: f64,
    /// Directions and values.
    pub place: String,
}

impl Difference {
    /// Takes note of two numbers that should be the same; `scale` below which differences do not count.
    fn note(&mut self, a: f32, b: f32, scale: f32, place: impl FnOnce() -> String) {
        let (a, b) = (f64::from(a), f64::from(b));
        let difference = (a - b).abs() / a.abs().max(b.abs()).max(f64::from(scale));
        // NaN differs from everything.
        if difference.is_nan() || difference > self.worst {
            self.worst = if difference.is_nan() { f64::INFINITY } else { difference };
            self.place = format!("{}: {a:e}, {b:e}", place());
        }
    }
}

/// BSDF-03: how far the density of samples is from that of `eval`, and their weight from value over density. Samples of
/// delta lobes have neither.
pub fn agreement(scatterer: &dyn Scatterer, wo: [f32; 3], samples: usize, seed: u64) -> Difference {
    let mut rng = Rng::of_stream(seed, "agreement", 0);
    let u: Vec<[f32; 3]> = (0..samples).map(|_| [rng.unit(), rng.unit(), rng.unit()]).collect();
    let sampled: Vec<_> = scatterer.sample(wo, &u).into_iter().flatten().filter(|s| s.pdf.is_finite()).collect();
    let directions: Vec<[f32; 3]> = sampled.iter().map(|s| s.wi).collect();
    let mut difference = Difference::default();
    for (sample, value) in sampled.iter().zip(scatterer.eval(wo, &directions)) {
        difference.note(sample.pdf, value.pdf, 0.0, || format!("pdf at wo {wo:?}, wi {:?}", sample.wi));
        for k in 0..3 {
            let weight = value.f_cos[k] / value.pdf;
            difference.note(sample.weight[k], weight, 1e-6, || format!("weight {k} at wo {wo:?}, wi {:?}", sample.wi));
        }
    }
    difference
}

/// BSDF-04: how far f(a, b) is from f(b, a) in the upper hemisphere, over `pairs` random pairs (uniform, cosines from
/// 0.01).
pub fn reciprocity(scatterer: &dyn Scatterer, pairs: usize, seed: u64) -> Difference {
    let mut rng = Rng::of_stream(seed, "reciprocity", 0);
    let mut difference = Difference::default();
    for _ in 0..pairs {
        let [a, b] = [(); 2]
            .map(|()| direction(f64::from(rng.range(0.01, 1.0)), f64::from(rng.range(0.0, std::f32::consts::TAU))));
        let (there, back) = (scatterer.eval(a, &[b])[0], scatterer.eval(b, &[a])[0]);
        for k in 0..3 {
            let place = || format!("f between {a:?} and {b:?}");
            difference.note(there.f_cos[k] / b[2], back.f_cos[k] / a[2], 1e-6, place);
        }
    }
    difference
}

/// Numbers that no BSDF may say.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    /// How many.
    pub count: usize,
    /// The first.
    pub first: Option<String>,
}

impl Faults {
    fn note(&mut self, is_fault: bool, place: impl FnOnce() -> String) {
        if is_fault {
            self.count += 1;
            self.first.get_or_insert_with(place);
        }
    }
}

/// BSDF-10: values, densities and weights that are NaN, infinite or negative (a delta lobe's density is infinite by right)
/// and directions that are not unit. Half of all cosines and numbers come from the edges.
pub fn finiteness(scatterer: &dyn Scatterer, views: usize, samples_each: usize, seed: u64) -> Faults {
    const COSINES: [f32; 8] = [1.0, 0.999_999_9, 0.5, 1e-3, 1e-5, 1e-7, 0.0, -1e-3];
    const NUMBERS: [f32; 6] = [0.0, 5.960_464_5e-8, 0.5, 0.25, 0.75, 1.0 - 5.960_464_5e-8];
    let mut rng = Rng::of_stream(seed, "finiteness", 0);
    let mut faults = Faults::default();
    for _ in 0..views {
        let mut any_direction = |low: f32| {
            let z = if rng.unit() < 0.5 { rng.pick(&COSINES) } else { rng.range(low, 1.0) };
            direction(f64::from(z), f64::from(rng.range(0.0, std::f32::consts::TAU)))
        };
        let wo = any_direction(0.0);
        let mut wi: Vec<[f32; 3]> = (0..samples_each).map(|_| any_direction(-1.0)).collect();
        // The mirror's direction and the viewer's own.
        wi.extend([[-wo[0], -wo[1], wo[2]], wo, [0.0, 0.0, 1.0], [-wo[0], -wo[1], -wo[2]]]);
        let u: Vec<[f32; 3]> = (0..samples_each)
            .map(|_| [(); 3].map(|()| if rng.unit() < 0.5 { rng.pick(&NUMBERS) } else { rng.unit() }))
            .collect();
        let sampled = scatterer.sample(wo, &u);
        for (sample, u) in sampled.iter().zip(&u) {
            let Some(s) = sample else { continue };
            let length = s.wi.iter().map(|v| v * v).sum::<f32>();
            let is_weight_bad = s.weight.iter().any(|w| !w.is_finite() || *w < 0.0);
            let is_unit = (length - 1.0).abs() < 1e-4;
            let is_fault = is_weight_bad || !is_unit || s.pdf.is_nan() || s.pdf <= 0.0;
            faults.note(is_fault, || format!("wo {wo:?}, u {u:?}: {s:?}"));
        }
        wi.extend(sampled.into_iter().flatten().map(|s| s.wi));
        for (value, wi) in scatterer.eval(wo, &wi).into_iter().zip(wi) {
            let is_fault = [value.pdf, value.f_cos[0], value.f_cos[1], value.f_cos[2]]
                .into_iter()
                .any(|v| !v.is_finite() || v < 0.0);
            faults.note(is_fault, || format!("wo {wo:?}, wi {wi:?}: {value:?}"));
        }
    }
    faults
}
