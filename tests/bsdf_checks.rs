//! The checks of `verify::bsdf` themselves: a sound BSDF passes each, and each finds its own fault.

use prt::verify::bsdf::checks::{agreement, finiteness, furnace, reciprocity};
use prt::verify::bsdf::chi_square::{ChiSquare, Settings, chi_square, views};
use prt::verify::bsdf::domain::Domain;
use prt::verify::bsdf::{Evaluated, Functions, Sampled, Scatterer, direction};
use std::f64::consts::{PI, TAU};

/// What is wrong with the BSDF.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    None,
    /// Samples a little closer to the normal than the density says.
    Sampler,
    /// Density 3 % too great.
    Density,
    /// Brighter seen from above than from the side.
    OneWay,
    /// NaN straight ahead.
    NotANumber,
    /// 2 % of the samples go below the surface.
    Below,
}

/// A Lambertian surface of albedo 0.8.
fn lambert(fault: Fault) -> impl Scatterer {
    let eval = move |wo: [f32; 3], wi: [f32; 3]| {
        let mut cosine = wi[2].max(0.0) / PI as f32;
        if fault == Fault::NotANumber && wi[2] == 1.0 {
            cosine = f32::NAN;
        }
        let one_way = if fault == Fault::OneWay { 0.5 + 0.5 * wo[2] } else { 1.0 };
        let pdf = if fault == Fault::Density { 1.03 * cosine } else { cosine };
        Evaluated { f_cos: [0.8 * cosine * one_way; 3], pdf }
    };
    let sample = move |wo: [f32; 3], u: [f32; 3]| {
        let power = if fault == Fault::Sampler { 0.54 } else { 0.5 };
        let z = (1.0 - f64::from(u[0])).powf(power);
        let mut wi = direction(z.max(1e-6), f64::from(u[1]) * TAU);
        if fault == Fault::Below && u[2] < 0.02 {
            wi[2] = -wi[2];
        }
        let value = eval(wo, wi);
        Some(Sampled { wi, weight: value.f_cos.map(|f| f / value.pdf), pdf: value.pdf })
    };
    Functions { eval, sample }
}

/// Normals of GGX with alpha 0.01, mirrored: narrow in angles. The sampler's alpha may be another.
fn narrow(sampler_alpha: f64) -> impl Scatterer {
    let alpha = 0.01;
    let eval = move |wo: [f32; 3], wi: [f32; 3]| {
        let h: [f64; 3] = std::array::from_fn(|k| f64::from(wo[k]) + f64::from(wi[k]));
        let length = (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]).sqrt();
        let h = h.map(|v| v / length);
        let cos: f64 = (0..3).map(|k| h[k] * f64::from(wo[k])).sum();
        let e = (h[0] * h[0] + h[1] * h[1]) / (alpha * alpha) + h[2] * h[2];
        let pdf = if h[2] > 0.0 && cos > 0.0 { h[2] / (PI * alpha * alpha * e * e * 4.0 * cos) } else { 0.0 };
        Evaluated { f_cos: [pdf as f32; 3], pdf: pdf as f32 }
    };
    let sample = move |wo: [f32; 3], u: [f32; 3]| {
        let tan = sampler_alpha * (f64::from(u[0]) / (1.0 - f64::from(u[0]))).sqrt();
        let h = direction(1.0 / (1.0 + tan * tan).sqrt(), f64::from(u[1]) * TAU).map(f64::from);
        let cos: f64 = (0..3).map(|k| h[k] * f64::from(wo[k])).sum();
        let wi = std::array::from_fn(|k| (2.0 * cos * h[k] - f64::from(wo[k])) as f32);
        (cos > 0.0).then_some(Sampled { wi, weight: [1.0; 3], pdf: eval(wo, wi).pdf })
    };
    Functions { eval, sample }
}

fn tested(scatterer: &dyn Scatterer, domain: Domain) -> ChiSquare {
    chi_square(scatterer, direction(0.7, 0.4), domain, Settings::default())
}

#[test]
fn sound_densities_pass_and_faulty_ones_do_not() {
    let sound = tested(&lambert(Fault::None), Domain::Sphere);
    // 1e5 samples, seed 1, a false alarm in 1000 choices of it.
    assert!(sound.passes(1e-3), "{sound:?}");
    assert!((sound.integral - 1.0).abs() < 1e-4 && sound.sampled == 1.0, "{sound:?}");
    assert!((sound.albedo[0] - 0.8).abs() < 1e-4, "{sound:?}");
    for fault in [Fault::Sampler, Fault::Density, Fault::Below] {
        let found = tested(&lambert(fault), Domain::Sphere);
        assert!(!found.passes(1e-6), "{found:?}");
    }
    assert!((tested(&lambert(Fault::Below), Domain::Sphere).impossible - 0.02).abs() < 2e-3);
}

#[test]
fn false_alarms_are_as_frequent_as_the_level_says() {
    // 200 seeds, level 5 %: 10 alarms expected; more than 22 or fewer than 2 happen in one choice of seeds in 2000.
    let lambert = lambert(Fault::None);
    let settings = |seed| Settings { samples: 10_000, cells: 16, seed };
    let wo = direction(0.7, 0.4);
    let alarms =
        (0..200).filter(|&seed| !chi_square(&lambert, wo, Domain::Sphere, settings(seed)).passes(0.05)).count();
    assert!((2..=22).contains(&alarms), "{alarms} of 200");
}

#[test]
fn narrow_lobes_are_seen_in_slopes() {
    let slopes = Domain::Reflected { alpha: [0.01; 2] };
    let sound = tested(&narrow(0.01), slopes);
    assert!(sound.passes(1e-3), "{sound:?}");
    assert!((sound.integral - 1.0).abs() < 1e-3, "{sound:?}");
    let wrong = tested(&narrow(0.0105), slopes);
    assert!(!wrong.passes(1e-6), "{wrong:?}");
}

#[test]
fn each_check_finds_its_own_fault_and_none_where_there_is_none() {
    let sound = lambert(Fault::None);
    for wo in views() {
        assert!(agreement(&sound, wo, 1000, 1).worst < 1e-6);
        let white = furnace(&sound, wo, 64, 1);
        assert!((white.albedo[1] - 0.8).abs() < 1e-6 && white.deviation[1] < 1e-3 && white.greatest < 0.81);
    }
    assert!(reciprocity(&sound, 1000, 1).worst < 1e-5);
    assert!(reciprocity(&lambert(Fault::OneWay), 1000, 1).worst > 0.4);
    let faults = finiteness(&sound, 200, 50, 1);
    assert_eq!(faults.count, 0, "{:?}", faults.first);
    let faults = finiteness(&lambert(Fault::NotANumber), 200, 50, 1);
    assert!(faults.count > 0 && faults.first.is_some_and(|f| f.contains("NaN")));
    // A weight that is not that of the value.
    let eval = |_: [f32; 3], wi: [f32; 3]| Evaluated { f_cos: [wi[2].max(0.0); 3], pdf: 0.5 };
    let sample = |_: [f32; 3], _: [f32; 3]| Some(Sampled { wi: [0.6, 0.0, 0.8], weight: [1.5; 3], pdf: 0.5 });
    let found = agreement(&Functions { eval, sample }, [0.0, 0.0, 1.0], 10, 1);
    assert!((found.worst - 0.1 / 1.6).abs() < 1e-5, "{found:?}");
}
