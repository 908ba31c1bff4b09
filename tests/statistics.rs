//! The instruments themselves: distributions against printed tables, and statistical tests that must stay quiet on a
//! sound estimator and must find every planted fault.
//!
//! All seeds are fixed. False-alarm rates are those on a change of the random numbers, and stated per test.

mod support;

use prt::compare::block_test;
use prt::image::exr_read::Picture;
use support::planted::{Fault, Stream, sky_irradiance};
use support::stats::*;
use support::verdict::{Expected, MAX_BIAS, mean_test};
use support::{closed, planted};

fn assert_close(got: f64, want: f64, relative: f64) {
    assert!((got - want).abs() <= relative * want.abs(), "got {got}, want {want}");
}

#[test]
fn ln_gamma_matches_factorials_and_the_half_integer() {
    assert_close(ln_gamma(11.0), 3_628_800.0_f64.ln(), 1e-13);
    assert_close(ln_gamma(0.5), std::f64::consts::PI.ln() / 2.0, 1e-13);
    assert_close(ln_gamma(0.1), 2.252_712_651_734_206, 1e-12);
    assert!(ln_gamma(1.0).abs() < 1e-13);
}

#[test]
fn student_t_matches_tables_and_the_exact_cases_of_one_and_two_degrees() {
    // Printed two-sided 5 %, 1 % and 0.1 % points.
    for (dof, t, p) in [
        (5.0, 2.570_582, 0.05),
        (10.0, 3.169_273, 0.01),
        (31.0, 2.039_513, 0.05),
        (30.0, 3.645_959, 0.001),
        (10.0, 4.586_894, 0.001),
        (4.0, 2.776_445, 0.05),
    ] {
        assert_close(student_t_two_sided_p(t, dof), p, 1e-5);
        assert_close(student_t_quantile(1.0 - p / 2.0, dof), t, 1e-6);
    }
    for t in [0.01_f64, 0.1, 0.5, 1.0, 3.0, 7.0, 30.0, 300.0] {
        assert_close(student_t_two_sided_p(t, 1.0), 2.0 / std::f64::consts::PI * (1.0 / t).atan(), 1e-12);
        assert_close(student_t_two_sided_p(-t, 2.0), 1.0 - t / (2.0 + t * t).sqrt(), 1e-9);
    }
    assert_eq!(student_t_two_sided_p(0.0, 7.0), 1.0);
    assert_eq!(student_t_two_sided_p(f64::NAN, 7.0), 0.0, "not a number is a failure");
    assert_eq!(student_t_two_sided_p(f64::INFINITY, f64::INFINITY), 0.0);
    assert_close(student_t_quantile(0.025, 5.0), -2.570_582, 1e-6);
}

#[test]
fn student_t_with_many_degrees_is_normal() {
    assert_close(student_t_two_sided_p(4.0, 1e7), normal_two_sided_p(4.0), 1e-5);
    assert_close(student_t_two_sided_p(1.959_963_984_540_054, 1e9), 0.05, 1e-6);
    // No step where the normal distribution takes over, and enough terms just below.
    assert_close(student_t_two_sided_p(5.0, 9.9e6), student_t_two_sided_p(5.0, 1.1e7), 1e-4);
}

#[test]
fn normal_matches_tables_into_the_tail() {
    assert_close(normal_two_sided_p(1.959_963_984_540_054), 0.05, 1e-12);
    assert_close(normal_two_sided_p(6.0), 1.973_175_290_075_396e-9, 1e-10);
    assert_close(normal_quantile(0.975), 1.959_963_984_540_054, 1e-12);
    assert_close(normal_quantile(0.001), -3.090_232_306_167_813, 1e-12);
}

#[test]
fn chi_square_matches_tables() {
    for (x, dof, p) in
        [(3.841_459, 1.0, 0.05), (18.307_038, 10.0, 0.05), (135.806_723, 100.0, 0.01), (2.558_212, 10.0, 0.99)]
    {
        assert_close(chi_square_p(x, dof), p, 1e-6);
    }
    assert_close(chi_square_p(7.0, 2.0), (-3.5_f64).exp(), 1e-13);
    for x in [0.1_f64, 1.0, 10.0, 100.0] {
        assert_close(chi_square_p(x, 2.0), (-0.5 * x).exp(), 1e-11);
        assert_close(chi_square_p(x, 4.0), (-0.5 * x).exp() * (1.0 + 0.5 * x), 1e-11);
    }
    assert_eq!((chi_square_p(f64::NAN, 3.0), chi_square_p(f64::INFINITY, 3.0)), (0.0, 0.0));
}

#[test]
fn kolmogorov_smirnov_matches_the_table_and_the_limit() {
    assert_close(kolmogorov_p(1.358_1), 0.05, 1e-3);
    assert_close(kolmogorov_p(1.627_6), 0.01, 1e-3);
    // n = 20: the printed exact 5 % point of the distance is 0.29408.
    let n = 20;
    let shifted: Vec<f64> = (1..=n).map(|i| f64::from(i) / f64::from(n) - 0.294_08).map(|x| x.max(0.0)).collect();
    assert_close(ks_uniform_p(&shifted), 0.05, 0.02);
    assert!(ks_uniform_p(&[0.5; 20]) < 1e-3);
}

#[test]
fn holm_adjusts_as_in_the_worked_example() {
    let close = |got: Vec<f64>, want: &[f64]| got.iter().zip(want).for_each(|(g, w)| assert_close(*g, *w, 1e-12));
    close(holm(&[0.01, 0.04, 0.03, 0.005]), &[0.03, 0.06, 0.06, 0.02]);
    close(holm(&[0.9, 0.8]), &[1.0, 1.0]);
    assert!(holm(&[]).is_empty());
}

#[test]
fn welch_matches_a_worked_example() {
    let a = Sample::of(&[1.0, 2.0, 3.0, 4.0, 5.0]);
    let b = Sample::of(&[2.0, 4.0, 6.0, 8.0, 10.0]);
    assert_eq!((a.mean, a.variance, b.mean, b.variance), (3.0, 2.5, 6.0, 10.0));
    let result = welch(&a, &b);
    assert_close(result.t, -3.0 / 2.5_f64.sqrt(), 1e-12);
    assert_close(result.dof, 6.25 / 1.0625, 1e-12);
    assert_close(result.p, student_t_two_sided_p(result.t, result.dof), 1e-12);
    // Sizes 4 and 3, variances 5/3 and 4.
    let result = welch(&Sample::of(&[1.0, 2.0, 3.0, 4.0]), &Sample::of(&[2.0, 4.0, 6.0]));
    assert_close(result.t, -1.5 / 1.75_f64.sqrt(), 1e-12);
    assert_close(result.dof, 1.75 * 1.75 / (25.0 / 144.0 / 3.0 + 16.0 / 9.0 / 2.0), 1e-12);
    // Equal sizes and variances give n1 + n2 - 2.
    let same = Sample { n: 9, mean: 1.0, variance: 2.0 };
    assert_close(welch(&same, &Sample { mean: 3.0, ..same }).dof, 16.0, 1e-12);
    assert_eq!(welch(&same, &same).t, 0.0);
    let of = |x: f64| Sample::of(&[x, x]);
    assert_eq!((welch(&of(1.0), &of(1.0)).p, welch(&of(1.0), &of(2.0)).p), (1.0, 0.0), "no noise at all");
}

/// Means over `seeds` runs of the small path tracer; exact: 5/3.
fn sky_runs(fault: Fault, samples: usize, seeds: u64) -> Vec<f64> {
    (0..seeds).map(|seed| sky_irradiance(fault, samples, seed)).collect()
}

const SKY: Expected = Expected { value: 5.0 / 3.0, rel_se: 0.0 };

// Seeds 0..32, 200 000 samples each, significance 1e-4 and 0.15 %: false alarms 1 in 10 000.
#[test]
fn mean_test_is_quiet_on_a_sound_estimator() {
    mean_test(&sky_runs(Fault::None, 200_000, 32), SKY).within(MAX_BIAS).unwrap();
}

// The twins of the test above: the same seeds and samples, one fault each.
#[test]
fn mean_test_finds_every_planted_fault() {
    use Fault::{DropCosine, DropRouletteWeight, MisSum, Pdf};
    for fault in [DropCosine, Pdf(1.02), Pdf(0.98), DropRouletteWeight, MisSum(1.02), MisSum(1.005)] {
        let verdict = mean_test(&sky_runs(fault, 200_000, 32), SKY);
        assert!(verdict.within(MAX_BIAS).is_err(), "{fault:?} was not found: {verdict:?}");
        assert!(verdict.p < 1e-3, "{fault:?}: the t-test itself should see it: {verdict:?}");
    }
}

#[test]
fn mean_test_refuses_to_pass_what_it_cannot_see() {
    let verdict = mean_test(&sky_runs(Fault::None, 100, 4), SKY);
    assert!(verdict.within(MAX_BIAS).unwrap_err().contains("too noisy"));
    assert!(mean_test(&[1.0, f64::NAN], SKY).within(MAX_BIAS).is_err());
}

// 400 tests of 8 seeds with 1000 samples; Kolmogorov-Smirnov at 1e-3. A test that never rejects is broken too.
#[test]
fn p_values_of_a_sound_estimator_are_uniform() {
    let p: Vec<f64> = (0..400)
        .map(|k| {
            let runs: Vec<f64> = (0..8).map(|i| sky_irradiance(Fault::None, 1000, 1000 + 8 * k + i)).collect();
            mean_test(&runs, SKY).p
        })
        .collect();
    assert!(ks_uniform_p(&p) > 1e-3, "KS p = {}", ks_uniform_p(&p));
    // And the uniformity test sees a bias of half a standard error.
    let shifted: Vec<f64> = (0..400)
        .map(|k| {
            let runs: Vec<f64> = (0..8).map(|i| 1.01 * sky_irradiance(Fault::None, 1000, 1000 + 8 * k + i)).collect();
            mean_test(&runs, SKY).p
        })
        .collect();
    assert!(ks_uniform_p(&shifted) < 1e-3);
}

/// A made-up picture, 64 x 64: a gradient with normal noise of relative standard deviation `noise`, twice that in the
/// lower half (as shadows have).
fn noisy_picture(seed: u64, noise: f64) -> Picture {
    let mut stream = Stream::new(seed);
    let pixels = (0..64 * 64)
        .map(|i| {
            let noise = if i < 32 * 64 { noise } else { 2.0 * noise };
            [0.2, 1.0, 3.0].map(|base| {
                let sum: f64 = (0..12).map(|_| stream.uniform()).sum();
                (base * (1.0 + (i % 64) as f64 / 32.0) * (1.0 + noise * (sum - 6.0))) as f32
            })
        })
        .collect();
    Picture { origin: [0, 0], width: 64, height: 64, pixels }
}

// 60 pictures' worth of trials, 8 seeds each at 2 % noise, reference at 1 %; family-wise 1e-3, so the chance that a
// sound block test fails even one of 60 is 6 %; with these seeds it fails none.
#[test]
fn block_test_is_quiet_on_equal_pictures_with_uneven_noise() {
    let rms = 0.01 * 2.5_f64.sqrt(); // of 1 % in one half and 2 % in the other
    for trial in 0..60 {
        let runs: Vec<_> = (0..8).map(|k| noisy_picture(100 * trial + k, 0.02)).collect();
        let verdict = block_test(&runs, &noisy_picture(100 * trial + 99, 0.01), rms);
        assert!(verdict.rejected == 0, "trial {trial}: {verdict:?}");
    }
}

// The twins: 0.5 % over the picture, and over one quarter of it (which a mean test hardly sees: 0.125 %).
#[test]
fn block_test_finds_half_a_percent() {
    let reference = noisy_picture(99, 0.01);
    let rms = 0.01 * 2.5_f64.sqrt();
    for quarter in [false, true] {
        let mut runs: Vec<_> = (0..32).map(|k| noisy_picture(k, 0.02)).collect();
        for run in &mut runs {
            if quarter { planted::scale_quarter(run, 1.005) } else { planted::scale(run, 1.005) }
        }
        let verdict = block_test(&runs, &reference, rms);
        assert!(verdict.rejected > 0, "quarter {quarter}: {verdict:?}");
    }
}

#[test]
fn block_test_judges_noiseless_pictures_by_rounding() {
    let flat = |x: f32| Picture { origin: [0, 0], width: 32, height: 32, pixels: vec![[x; 3]; 32 * 32] };
    let rejected = |x: f32, reference: f32, se: f64| block_test(&vec![flat(x); 8], &flat(reference), se).rejected;
    assert_eq!(rejected(1.219_197_5, 1.219_197_5, 0.0), 0);
    assert_eq!(rejected(1.219_199_5, 1.219_197_5, 0.0), 0, "1.6e-6 is rounding");
    assert!(rejected(1.219_222, 1.219_197_5, 0.0) > 0, "2e-5 is not");
    assert_eq!(rejected(0.0, 0.0, 0.01), 0);
    assert!(rejected(0.1, 0.0, 0.01) > 0, "light where none is");
    assert!(rejected(f32::NAN, 1.0, 0.01) > 0);
}

#[test]
fn polygon_formula_equals_the_corner_formula() {
    let corners = [(0.0, 0.0), (1.5, 0.0), (1.5, 0.7), (0.0, 0.7)].map(|(x, z)| glam::DVec3::new(x, 1.0, z));
    let e = closed::polygon_irradiance(&corners, glam::DVec3::ZERO, glam::DVec3::Y, 1.0);
    assert_close(closed::corner_form_factor(1.5, 0.7, 1.0), 0.130_067_5, 1e-6);
    assert_close(e, std::f64::consts::PI * closed::corner_form_factor(1.5, 0.7, 1.0), 1e-12);
}

#[test]
fn ggx_albedo_equals_its_closed_form_and_the_table() {
    for mu in [1.0, 0.7, 0.25] {
        assert_close(closed::white_metal_albedo(mu, 1.0), 1.0 - mu * (1.0 + 1.0 / mu).ln(), 3e-5);
    }
    // Tabulated with another quadrature (midpoint over visible normals, 1500^2).
    for (alpha, mu, e) in [(0.25, 1.0, 0.91581), (0.25, 0.5, 0.85726), (0.5, 1.0, 0.68785), (0.5, 0.5, 0.69825)] {
        assert_close(closed::white_metal_albedo(mu, alpha), e, 3e-5);
    }
    // Roughness 0.5 and 1 of the white dielectric.
    for (alpha, mu, e) in [(0.25, 1.0, 0.9966), (0.25, 0.5, 1.0110), (1.0, 1.0, 0.9722), (1.0, 0.5, 0.9761)] {
        assert_close(closed::white_dielectric_albedo(mu, alpha, 0.04), e, 1e-4);
    }
}

#[test]
fn built_scenes_face_the_way_they_say() {
    use glam::{DVec3, Vec3};
    let mut builder = prt::scene::SceneBuilder::new(0);
    let material = builder.add_material(support::scenes::lambert(0.5));
    support::scenes::add_room(&mut builder, 1.0, material);
    support::scenes::add_floor(&mut builder, 0.5, material);
    let (eye, target) = (DVec3::new(3.0, 1.5, -2.0), DVec3::new(0.0, 1.0, 0.5));
    support::scenes::add_camera(&mut builder, eye, target, 1.0);
    let scene = builder.finish();
    assert_eq!(scene.triangle_count(), 14);
    for (i, mesh) in scene.meshes.iter().enumerate() {
        for [a, b, c] in mesh.indices.iter().map(|t| t.map(|v| Vec3::from(mesh.positions[v as usize]))) {
            let normal = (b - a).cross(c - a);
            let towards = if i < 6 { -(a + b + c) } else { Vec3::Y };
            assert!(normal.length() > 0.0 && normal.angle_between(towards) < 1.0, "mesh {i}");
        }
    }
    let camera = scene.cameras[0].world_from_camera;
    assert!((camera.determinant() - 1.0).abs() < 1e-12);
    assert!(camera.transform_vector3(DVec3::NEG_Z).abs_diff_eq((target - eye).normalize(), 1e-12));
    assert!(camera.transform_vector3(DVec3::Y).y > 0.9);
    assert_eq!(camera.transform_point3(DVec3::ZERO), eye);
}
