//! BSDF-01 to -05, -08, -10, -13 over whole materials: a slice of what `prt-batch verify materials` looks at, and proof that
//! it can fail. 256 x 256 samples a furnace, 20 000 a distribution; a false alarm in 100 choices of the seed.

use prt::material::energy::Brdf;
use prt::verify::bsdf::domain::Domain;
use prt::verify::bsdf::{Evaluated, Functions, Sampled, Scatterer, direction};
use prt::verify::materials::built_in;
use prt::verify::materials::grid::{COSINES, Cell, cells, energy};
use prt::verify::materials::judge::{Effort, Expected, Measured, WHITE, judge, judge_any};
use std::f64::consts::{PI, TAU};

#[test]
fn bsdf_01_02_03_04_05_10_a_slice_of_the_grid_keeps_the_limits() {
    let reports = built_in(20_000, 1, 0, 14);
    assert!(reports.len() > 20 && reports.iter().filter(|r| r.p_value.is_some()).count() > 8, "{}", reports.len());
    let broken: Vec<_> = reports.iter().filter(|r| !r.problems.is_empty()).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

/// What is wrong with a white Lambertian surface.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    None,
    /// 1 % more light than arrives.
    Gain,
    /// The density is not that of the samples.
    Density,
    /// Brighter seen from one side than from the other.
    OneWay,
    Negative,
}

fn lambert(fault: Fault) -> impl Scatterer {
    let eval = move |wo: [f32; 3], wi: [f32; 3]| {
        let cosine = wi[2].max(0.0) / PI as f32;
        let value = match fault {
            Fault::Gain => 1.01 * cosine,
            Fault::OneWay => cosine * (0.5 + 0.5 * wo[2]),
            Fault::Negative if wi[2] > 0.999 => -cosine,
            _ => cosine,
        };
        let pdf = if fault == Fault::Density { cosine * (0.4 + 0.9 * wi[2]) } else { cosine };
        Evaluated { f_cos: [value; 3], pdf }
    };
    let sample = move |wo: [f32; 3], u: [f32; 3]| {
        let wi = direction((1.0 - f64::from(u[0])).sqrt().max(1e-6), f64::from(u[1]) * TAU);
        let value = eval(wo, wi);
        Some(Sampled { wi, weight: value.f_cos.map(|f| f / value.pdf), pdf: value.pdf })
    };
    Functions { eval, sample }
}

fn judged(fault: Fault) -> Measured {
    let expected = Expected { white: Some(WHITE), ..Expected::default() };
    let effort = Effort { samples: 20_000, furnace: 64, seed: 1, tests: 1 };
    judge_any(&lambert(fault), direction(0.6, 0.4), Domain::Sphere, &expected, effort)
}

#[test]
fn broken_bsdfs_are_found_each_by_its_own_check() {
    assert_eq!(judged(Fault::None).problems, Vec::<String>::new());
    for (fault, words) in [
        (Fault::Gain, "gives back 1.01"),
        (Fault::Density, "is sampled otherwise than its density says"),
        (Fault::OneWay, "is not reciprocal"),
        (Fault::Negative, "are none or negative"),
    ] {
        let problems = judged(fault).problems;
        assert!(problems.iter().any(|p| p.contains(words)), "no {words}: {problems:?}");
    }
}

/// A white round cell without coat, sheen and film.
fn plain() -> Cell {
    let first = cells(1).into_iter().next().expect("a grid");
    let none = Cell { roughness: 1.0, metallic: 0.0, transmission: 0.0, is_volume: false, clearcoat: 0.0, ..first };
    Cell { has_sheen: false, has_iridescence: false, anisotropy: 0.0, ior: 0, is_inside: false, is_white: true, ..none }
}

fn albedo(cell: Cell, brdf: Brdf) -> f64 {
    let (energy, surface) = (energy(brdf), cell.surface());
    prt::verify::bsdf::checks::furnace(&cell.side(&surface, &energy), cell.view(), 128, 1).albedo[0]
}

#[test]
fn bsdf_05_metal_at_alpha_1_has_its_closed_form_without_compensation_and_is_white_with_it() {
    for cosine in COSINES {
        let cell = Cell { metallic: 1.0, cosine, ..plain() };
        let mu = f64::from(cosine);
        let exact = 1.0 - mu * (1.0 / mu).ln_1p();
        let found = albedo(cell, Brdf::AppendixB);
        assert!((found - exact).abs() < 2e-3, "cosine {mu}: {found}, closed form {exact}");
        let found = albedo(cell, Brdf::Full);
        assert!((found - 1.0).abs() < WHITE, "cosine {mu}: {found}");
    }
}

#[test]
fn bsdf_08_albedo_of_ever_smoother_glass_and_metal_goes_to_that_of_the_mirror() {
    for (metallic, transmission) in [(1.0, 0.0), (0.0, 1.0), (0.0, 0.0)] {
        for cosine in [0.9, 0.5, 0.1] {
            let cell = Cell { metallic, transmission, is_white: false, cosine, ..plain() };
            let mirror = albedo(Cell { roughness: 0.0, ..cell }, Brdf::Full);
            let off = |roughness| (albedo(Cell { roughness, ..cell }, Brdf::Full) - mirror).abs();
            assert!(off(0.011) < 3e-3 && off(0.05) < 1.5e-2, "{cell}: {} {}", off(0.011), off(0.05));
        }
    }
}

#[test]
fn bsdf_05_where_there_is_no_boundary_no_light_is_gained_at_grazing_angles() {
    for cosine in COSINES {
        for transmission in [0.5, 1.0] {
            let cell = Cell { transmission, is_volume: true, ior: 3, roughness: 0.5, cosine, ..plain() };
            let found = albedo(cell, Brdf::Full);
            assert!((found - 1.0).abs() < WHITE, "{cell} at {cosine}: {found}");
        }
    }
}

#[test]
fn bsdf_05_white_below_a_film_is_white_in_every_colour() {
    for (thickness, metallic) in [(100.0, 0.0), (400.0, 0.0), (1200.0, 0.0), (400.0, 1.0), (400.0, 0.5)] {
        for (roughness, cosine) in [(0.0, 0.5), (0.25, 0.5), (0.5, 1.0), (0.5, 0.1), (1.0, 0.02)] {
            let film = Cell { has_iridescence: true, ior: 6, thickness, metallic, roughness, cosine, ..plain() };
            let (energy, surface) = (energy(Brdf::Full), film.surface());
            let found = prt::verify::bsdf::checks::furnace(&film.side(&surface, &energy), film.view(), 96, 1);
            for k in 0..3 {
                let noise = 3.0 * found.deviation[k] / 96.0;
                assert!((found.albedo[k] - 1.0).abs() < WHITE + noise, "{film} at {cosine}: {found:?}");
            }
        }
    }
}

/// Looks at `cell` with 50 000 samples a distribution; what is wrong.
fn problems(cell: Cell) -> Vec<String> {
    let (energy, surface) = (energy(Brdf::Full), cell.surface());
    let effort = Effort { samples: 50_000, furnace: 64, seed: 1, tests: 1 };
    judge(&cell.side(&surface, &energy), cell.view(), effort).problems
}

#[test]
fn bsdf_01_02_what_a_coat_samples_below_its_horizon_is_no_sample_of_what_lies_below() {
    let coated = Cell { clearcoat: 1.0, clearcoat_roughness: 0.5, transmission: 1.0, cosine: 0.1, ..plain() };
    assert_eq!(problems(coated), Vec::<String>::new());
    assert_eq!(problems(Cell { is_volume: true, ..coated }), Vec::<String>::new());
}

#[test]
fn bsdf_05_white_stretched_highlights_are_white_from_every_azimuth() {
    for (metallic, anisotropy, roughness) in [(1.0, 1.0, 0.25), (1.0, 0.5, 0.1), (0.0, 0.5, 0.25)] {
        for azimuth in [0.0, 0.8, 1.2, 1.45, 1.57] {
            for cosine in [0.9, 0.5, 0.1] {
                let cell = Cell { metallic, anisotropy, roughness, azimuth, cosine, ..plain() };
                let (energy, surface) = (energy(Brdf::Full), cell.surface());
                let found = prt::verify::bsdf::checks::furnace(&cell.side(&surface, &energy), cell.view(), 96, 1);
                let noise = 3.0 * found.deviation[0] / 96.0;
                assert!((found.albedo[0] - 1.0).abs() < WHITE + noise, "{cell} at {cosine}, {azimuth}: {found:?}");
            }
        }
    }
}

#[test]
fn bsdf_05_rough_white_boundaries_of_index_0_are_white() {
    for (roughness, cosine, transmission) in [(1.0, 1.0, 1.0), (1.0, 0.5, 0.5), (0.5, 0.9, 1.0)] {
        let cell = Cell { ior: 1, is_volume: true, roughness, cosine, transmission, ..plain() };
        let (energy, surface) = (energy(Brdf::Full), cell.surface());
        let found = prt::verify::bsdf::checks::furnace(&cell.side(&surface, &energy), cell.view(), 96, 1);
        let noise = 3.0 * found.deviation[0] / 96.0;
        assert!((found.albedo[0] - 1.0).abs() < WHITE + noise, "{cell} at {cosine}: {found:?}");
    }
}

#[test]
fn bsdf_13_black_surfaces_without_specular_reflection_give_nothing_and_no_number_that_is_none() {
    let cell = Cell { ior: 2, is_white: true, ..plain() };
    let mut surface = cell.surface();
    surface.base = prt::math::V3::splat([0.0; 3]);
    surface.specular = simd::Float::splat(0.0);
    let energy = energy(Brdf::Full);
    let side = cell.side(&surface, &energy);
    for cosine in COSINES {
        let found = prt::verify::bsdf::checks::furnace(&side, direction(f64::from(cosine), 0.3), 32, 1);
        assert_eq!(found.albedo, [0.0; 3], "{cosine}");
    }
    let faults = prt::verify::bsdf::checks::finiteness(&side, 50, 50, 1);
    assert_eq!(faults.count, 0, "{:?}", faults.first);
}

#[test]
fn bsdf_05_stored_albedos_are_those_that_the_generator_makes() {
    use prt::material::energy::tables::{GLASS, NODES, SIDE, STRETCHED, glass, hats, stored, stretched, white};
    use prt::math::random::Rng;
    let mut rng = Rng::new(5);
    // As stored: steps of 1/65535.
    let check = |name: &str, stored: f32, made: f64| {
        assert!((f64::from(stored) - made).abs() < 1e-5, "{name}: stored {stored}, made {made}");
    };
    for _ in 0..6 {
        let (j, i) = (rng.below(SIDE), rng.below(SIDE));
        check("white", stored().white[j * SIDE + i], white(j, i, 256));
        let made = hats(j, i, 128);
        let row = &stored().hats[(j * SIDE + i) * NODES..][..NODES];
        row.iter().zip(made).for_each(|(&stored, made)| check("hats", stored, made));
        let [k, j, i] = GLASS.map(|n| rng.below(n));
        let made = glass(k, j, i, 256);
        let at = ((k * GLASS[1] + j) * GLASS[2] + i) * 2;
        (0..2).for_each(|w| check("glass", stored().glass[at + w], made[w]));
        let [l, k, j, i] = STRETCHED.map(|n| rng.below(n));
        let at = ((l * STRETCHED[1] + k) * STRETCHED[2] + j) * STRETCHED[3] + i;
        let made = stretched(l, k, j, i, 64);
        (0..2).for_each(|w| check("stretched", stored().stretched[2 * at + w], made[w]));
    }
}
