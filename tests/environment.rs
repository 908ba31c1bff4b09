//! Environments: the map, its sampler, and what it lights. IDs are those of the design's list of tests.
//!
//! Chi-square tests: 20 000 samples, seed 1, significance 1e-4 a map. Rendered values: seeds 0..8, 8 x 8 pixels that
//! look at one point, Student's t over seeds at 1e-4 and at most 0.15 % off, with 4 standard errors inside it; a value
//! 0.5 % away must not pass. False alarms on a change of the random numbers: at most 1.6e-4 a value.

mod support;

use glam::DVec3;
use prt::light::environment::EnvironmentTable;
use prt::light::{Environment, Light};
use prt::math::V3;
use prt::render::{CropWindow, RenderSettings};
use prt::scene::{Scene, SceneBuilder};
use simd::{Float, Kernel, Lanes, Level, dispatch};
use std::f64::consts::{FRAC_1_PI, PI, TAU};
use support::pictures::{channel_means, settings, shoot, shoot_seeds};
use support::planted::Stream;
use support::stats::{Sample, chi_square_p, welch};
use support::verdict::{Expected, MAX_BIAS, mean_test};
use support::{closed, scenes};

/// Field of view so small that all pixels see one point.
const POINT_VIEW: f64 = 1e-6;

/// Direction, radiance, density.
type Seen = (DVec3, [f64; 3], f64);

/// The first lane of four vectors.
#[inline(always)]
fn first<L: Lanes>(direction: V3<L>, radiance: V3<L>, pdf: L::F) -> Seen {
    let mut out = [[0.0_f32; 16]; 7];
    let all = [direction.x, direction.y, direction.z, radiance.x, radiance.y, radiance.z, pdf];
    for (out, value) in out.iter_mut().zip(all) {
        value.store(out, 0);
    }
    let v = out.map(|o| f64::from(o[0]));
    (DVec3::new(v[0], v[1], v[2]), [v[3], v[4], v[5]], v[6])
}

struct SampleAt<'a>(&'a EnvironmentTable, &'a [[f32; 2]]);

impl Kernel for SampleAt<'_> {
    type Output = Vec<Seen>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<Seen> {
        let mut seen = Vec::with_capacity(self.1.len());
        for u in self.1 {
            let s = self.0.sample::<L>([L::F::splat(u[0]), L::F::splat(u[1])]);
            seen.push(first::<L>(s.direction, s.radiance, s.pdf));
        }
        seen
    }
}

struct LookAt<'a>(&'a EnvironmentTable, &'a [DVec3]);

impl Kernel for LookAt<'_> {
    type Output = Vec<Seen>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<Seen> {
        let mut seen = Vec::with_capacity(self.1.len());
        for d in self.1 {
            let direction = V3::<L>::splat(d.as_vec3().to_array());
            let (radiance, pdf) = self.0.lookup::<L>(direction);
            seen.push(first::<L>(direction, radiance, pdf));
        }
        seen
    }
}

fn levels() -> impl Iterator<Item = Level> {
    [Level::Scalar, Level::Portable8, Level::Avx2, Level::Avx512].into_iter().filter(|l| l.is_available())
}

/// Uniform numbers of `seed`.
fn numbers(n: usize, seed: u64) -> Vec<[f32; 2]> {
    let mut stream = Stream::new(seed);
    let mut unit = || (stream.uniform() as f32).min(1.0 - f32::EPSILON / 2.0);
    (0..n).map(|_| [unit(), unit()]).collect()
}

/// A grey map of `texel(column, row)`.
fn grey(width: u32, height: u32, texel: impl Fn(u32, u32) -> f32) -> Environment {
    let texels = (0..width * height).map(|i| [texel(i % width, i / width); 3]);
    Environment::new(width, height, texels.collect::<Vec<_>>())
}

/// Direction of (u, v) in [0, 1] of a map.
fn direction(u: f64, v: f64) -> DVec3 {
    let (phi, theta) = (TAU * u - PI, PI * v);
    DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
}

/// The maps of ENV-01.
fn maps() -> Vec<(&'static str, Environment)> {
    let mut stream = Stream::new(3);
    let random: Vec<f32> = (0..24 * 12).map(|_| (stream.uniform() as f32).powi(8) * 100.0).collect();
    vec![
        ("one texel", grey(100, 10, |x, y| f32::from(u8::from(x == 40 && y == 5)))),
        ("one texel at the seam and the pole", grey(20, 10, |x, y| f32::from(u8::from(x == 0 && y == 0)))),
        ("constant 100x100", grey(100, 100, |_, _| 2.0)),
        ("constant 3x2", grey(3, 2, |_, _| 0.5)),
        ("column", grey(1, 7, |_, y| y as f32)),
        ("row", grey(9, 1, |x, _| (x % 3) as f32)),
        ("1x1", grey(1, 1, |_, _| 7.0)),
        ("random", grey(24, 12, |x, y| random[(y * 24 + x) as usize])),
        ("turned", Environment { rotation: 0.3, ..grey(24, 12, |x, y| random[(y * 24 + x) as usize]) }),
        ("turned all but wholly", Environment { rotation: 1.0_f32.next_down(), ..grey(5, 4, |x, _| (x * x) as f32) }),
        ("studio", prt::light::studio::environment()),
    ]
}

#[test]
fn env_01_samples_are_spread_by_their_density_and_it_integrates_to_one() {
    const N: usize = 20_000;
    // Bins of the sphere, and points in each for the integral; 400 x 200 points see a tent of 1/100 of a turn well.
    const BINS: [usize; 2] = [20, 20];
    const POINTS: [usize; 2] = [20, 10];
    let [across, down] = [BINS[0] * POINTS[0], BINS[1] * POINTS[1]];
    let points: Vec<DVec3> = (0..across * down)
        .map(|i| direction(((i % across) as f64 + 0.5) / across as f64, ((i / across) as f64 + 0.5) / down as f64))
        .collect();
    for (name, map) in maps() {
        let table = EnvironmentTable::new(&map).unwrap();
        let mut expected = vec![0.0; BINS[0] * BINS[1]];
        for (i, (d, _, pdf)) in dispatch(Level::best(), LookAt(&table, &points)).into_iter().enumerate() {
            assert!(pdf >= 0.0 && pdf.is_finite(), "{name}: density {pdf} at {d}");
            let row = i / across;
            let edge = |row: usize| (PI * row as f64 / down as f64).cos();
            let d_omega = TAU / across as f64 * (edge(row) - edge(row + 1));
            expected[row / POINTS[1] * BINS[0] + i % across / POINTS[0]] += pdf * d_omega;
        }
        let total: f64 = expected.iter().sum();
        assert!((total - 1.0).abs() < 2e-3, "{name}: the density integrates to {total}");
        for level in levels() {
            let mut counts = vec![0.0; expected.len()];
            for (d, radiance, pdf) in dispatch(level, SampleAt(&table, &numbers(N, 1))) {
                assert!((d.length() - 1.0).abs() < 2e-6, "{name}: {d}");
                assert!(pdf > 0.0 && pdf.is_finite() && radiance[0] > 0.0, "{name}: {d} {radiance:?} {pdf}");
                let u = (d.z.atan2(d.x) / TAU + 0.5).clamp(0.0, 1.0 - 1e-12);
                let v = (d.y.clamp(-1.0, 1.0).acos() / PI).clamp(0.0, 1.0 - 1e-12);
                counts[(v * BINS[1] as f64) as usize * BINS[0] + (u * BINS[0] as f64) as usize] += 1.0;
            }
            // Bins that expect fewer than 5 are taken together.
            let (mut statistic, mut bins, mut rest) = (0.0, 0, [0.0, 0.0]);
            for (&count, &share) in counts.iter().zip(&expected) {
                let expected = share / total * N as f64;
                if expected < 5.0 {
                    rest = [rest[0] + count, rest[1] + expected];
                } else {
                    statistic += (count - expected).powi(2) / expected;
                    bins += 1;
                }
            }
            if rest[1] >= 5.0 {
                statistic += (rest[0] - rest[1]).powi(2) / rest[1];
                bins += 1;
            } else {
                assert!(rest[0] <= rest[1] + 20.0, "{name}, {level:?}: {} samples where {} belong", rest[0], rest[1]);
            }
            let p = if bins > 1 { chi_square_p(statistic, f64::from(bins - 1)) } else { 1.0 };
            assert!(p > 1e-4, "{name}, {level:?}: chi-square {statistic} of {bins} bins, p = {p:e}");
        }
    }
}

#[test]
fn env_03_radiance_over_density_is_level_beside_a_bright_texel() {
    let table = EnvironmentTable::new(&grey(100, 50, |x, y| f32::from(u8::from(x == 30 && y == 20)))).unwrap();
    let weights: Vec<f64> =
        dispatch(Level::best(), SampleAt(&table, &numbers(4096, 2))).iter().map(|(_, l, pdf)| l[0] / pdf).collect();
    let (low, high) = weights.iter().fold((f64::MAX, 0.0_f64), |(l, h), &w| (l.min(w), h.max(w)));
    // The sine of the polar angle changes by 2 % over a texel there.
    assert!(high < 1.05 * low, "weights from {low} to {high}");
}

#[test]
fn env_05_a_turned_map_shows_the_same_across_the_seam() {
    let mut stream = Stream::new(5);
    let values: Vec<f32> = (0..16 * 8).map(|_| stream.uniform() as f32).collect();
    let turned =
        |k: u32| EnvironmentTable::new(&grey(16, 8, |x, y| values[(y * 16 + (x + 16 - k) % 16) as usize])).unwrap();
    let mut stream = Stream::new(6);
    let places: Vec<[f64; 2]> = (0..500).map(|_| [stream.uniform(), stream.uniform()]).collect();
    let look = |k: u32| {
        let directions: Vec<DVec3> = places.iter().map(|p| direction(p[0] + f64::from(k) / 16.0, p[1])).collect();
        dispatch(Level::best(), LookAt(&turned(k), &directions))
    };
    let still = look(0);
    for k in [1, 7, 15] {
        for (a, b) in still.iter().zip(look(k)) {
            // Texels are up to 1 apart and 1/16 of a turn wide: an angle off by 1e-7 turns shows as 2e-6.
            assert!((a.1[0] - b.1[0]).abs() < 1e-5, "turned by {k}: {a:?} {b:?}");
            assert!((a.2 - b.2).abs() < 1e-4 * (a.2 + 1.0), "turned by {k}: {a:?} {b:?}");
        }
    }
}

#[test]
fn env_05_rotation_is_counter_clockwise_seen_from_above_and_turns_what_is_sampled_too() {
    // Bright towards +X, which is the centre column.
    let map = grey(64, 32, |x, _| if (31..=32).contains(&x) { 8.0 } else { 1.0 });
    for (degrees, towards) in [(0.0, DVec3::X), (90.0, -DVec3::Z), (180.0, -DVec3::X), (270.0, DVec3::Z)] {
        let table = EnvironmentTable::new(&Environment { rotation: degrees / 360.0, ..map.clone() }).unwrap();
        for level in levels() {
            let axes = [DVec3::X, -DVec3::X, DVec3::Z, -DVec3::Z];
            for (d, radiance, _) in dispatch(level, LookAt(&table, &axes)) {
                let expected = if d.distance(towards) < 1e-6 { 8.0 } else { 1.0 };
                assert!((radiance[0] - expected).abs() < 1e-4, "{degrees}: {d} {radiance:?}, {level:?}");
            }
            for (d, radiance, pdf) in dispatch(level, SampleAt(&table, &numbers(500, 1))) {
                let (_, seen, density) = dispatch(level, LookAt(&table, &[d]))[0];
                // Texels are up to 7 apart and 1/64 of a turn wide.
                assert!((seen[0] - radiance[0]).abs() < 1e-3, "{degrees}: {d} {radiance:?} {seen:?}");
                assert!((density - pdf).abs() < 2e-3 * pdf, "{degrees}: {d} {pdf} {density}");
            }
        }
    }
}

#[test]
fn a_scaled_map_is_as_much_brighter_and_sampled_alike() {
    let (one, four) = (grey(8, 4, |x, y| (x + y) as f32), grey(8, 4, |x, y| (x + y) as f32));
    let (one, four) = (EnvironmentTable::new(&one), EnvironmentTable::new(&Environment { scale: 4.0, ..four }));
    let look =
        |table: &Option<EnvironmentTable>| dispatch(Level::best(), SampleAt(table.as_ref().unwrap(), &numbers(99, 1)));
    for (a, b) in look(&one).into_iter().zip(look(&four)) {
        assert_eq!((a.0, a.1.map(|c| 4.0 * c), a.2), b);
    }
    assert!(EnvironmentTable::new(&Environment { scale: 0.0, ..grey(8, 4, |_, _| 1.0) }).is_none());
}

#[test]
fn axes_are_those_of_the_conventions_up_to_the_poles() {
    // Red grows towards +X, green towards +Y, blue towards +Z.
    let (width, height) = (256, 128);
    let texel = |i: u32| {
        let (x, y) = (f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
        (DVec3::ONE + direction(x / f64::from(width), y / f64::from(height))).as_vec3().to_array()
    };
    let table =
        EnvironmentTable::new(&Environment::new(width, height, (0..width * height).map(texel).collect::<Vec<_>>()));
    let mut directions = vec![DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z];
    for e in [1e-3, 1e-6, 1e-9, 1e-20] {
        directions.extend([
            DVec3::new(e, 1.0, -e),
            DVec3::new(-e, -1.0, e),
            DVec3::new(-1.0, e, e),
            DVec3::new(-1.0, e, -e),
        ]);
    }
    let mut stream = Stream::new(4);
    directions.extend((0..1000).map(|_| direction(stream.uniform(), stream.uniform())));
    for level in levels() {
        for (d, radiance, pdf) in dispatch(level, LookAt(table.as_ref().unwrap(), &directions)) {
            // Clamped within half a texel of the poles, which is 0.0123 rad.
            let tolerance = if d.y.abs() > 0.99985 { 0.013 } else { 1e-3 };
            let error = (DVec3::from(radiance) - DVec3::ONE - d).abs().max_element();
            assert!(error < tolerance, "{d}: {radiance:?}, {level:?}");
            let expected = (3.0 + d.element_sum()) / (12.0 * PI);
            assert!((pdf - expected).abs() < 0.02 / PI, "{d}: density {pdf} instead of {expected}, {level:?}");
        }
    }
}

#[test]
fn env_04_a_black_map_is_no_light() {
    assert!(EnvironmentTable::new(&grey(4, 2, |_, _| 0.0)).is_none());
    let mut builder = SceneBuilder::new(0);
    let floor = builder.add_material(scenes::lambert(0.5));
    scenes::add_floor(&mut builder, 1.0, floor);
    scenes::add_camera(&mut builder, DVec3::ONE, DVec3::ZERO, 1.0);
    builder.set_environment(grey(4, 2, |_, _| 0.0));
    let frame = shoot(&builder.finish(), &settings(8, 4, 0));
    assert!(frame.pixels.iter().flatten().all(|&x| x == 0.0) && frame.stats.lights == 0);
    assert!(
        frame.stats.warnings.iter().any(|w| w.contains("nothing in the scene emits")),
        "{:?}",
        frame.stats.warnings
    );
}

/// What the picture shows over seeds, against `value`; a value half a percent away must not pass.
fn assert_shows(what: &str, scene: &Scene, spp: u32, value: f64) {
    let runs = shoot_seeds(scene, &settings(8, spp, 0), 8);
    let runs: Vec<f64> = runs.iter().map(|run| channel_means(&run.pixels)[1]).collect();
    let test = |value: f64| mean_test(&runs, Expected { value, rel_se: 0.0 }).within(MAX_BIAS);
    test(value).unwrap_or_else(|e| panic!("{what}: expected {value:.6}: {e}"));
    assert!(test(value * 1.005).is_err(), "{what}: the test does not see half a percent");
}

/// A floor of `material` at y = 0 under `environment`, seen at the origin from `eye`.
fn floor(material: prt::material::Material, environment: Environment, eye: DVec3) -> SceneBuilder {
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(material);
    scenes::add_floor(&mut builder, 5.0, material);
    builder.set_environment(environment);
    scenes::add_camera(&mut builder, eye, DVec3::ZERO, POINT_VIEW);
    builder
}

#[test]
fn white_surfaces_under_a_uniform_sky_show_it() {
    let sky = || grey(5, 3, |_, _| 1.0);
    let white = || scenes::lambert(1.0);
    assert_shows("floor", &floor(white(), sky(), DVec3::new(0.3, 1.0, 0.1)).finish(), 256, 1.0);
    // A convex body: a white cube, every side of it, all around.
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(white());
    scenes::add_room(&mut builder, 0.5, material);
    builder.set_environment(sky());
    scenes::add_camera(&mut builder, DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO, 0.6);
    assert_shows("cube and background", &builder.finish(), 256, 1.0);
}

#[test]
fn rough_metal_under_a_uniform_sky_shows_its_albedo() {
    for (roughness, mu) in [(0.5_f32, 0.5), (1.0, 1.0)] {
        let eye = DVec3::new((1.0_f64 - mu * mu).sqrt(), mu, 0.0);
        let scene = floor(scenes::white_metal(roughness), grey(8, 4, |_, _| 1.0), eye).finish();
        let value = closed::white_metal_albedo(mu, f64::from(roughness).powi(2));
        assert_shows(&format!("roughness {roughness}"), &scene, 1024, value);
    }
}

#[test]
fn linear_sky_lights_a_floor_as_its_integral_says() {
    // L = a + b cos: E = pi a + 2 pi b / 3, and chords of step h have 1 - h^2 / 12 of a cosine.
    let sky = grey(128, 64, |_, y| 1.0 + 0.8 * direction(0.0, (f64::from(y) + 0.5) / 64.0).y as f32);
    let value = 1.0 + 0.8 * 2.0 / 3.0 * (1.0 - (PI / 64.0).powi(2) / 12.0);
    assert_shows("gradient", &floor(scenes::lambert(0.6), sky, DVec3::ONE).finish(), 512, 0.6 * value);
}

/// Sky of 0.05 with one texel of 2000 at 45 degrees, and the irradiance of a floor under it over pi, by midpoints.
fn sun() -> (Environment, f64) {
    let (w, h) = (64, 32);
    let map = grey(w, h, |x, y| if (x, y) == (50, 8) { 2000.0 } else { 0.05 });
    const FINE: u32 = 8;
    let tent = |x: f64| (1.0 - x.abs()).max(0.0);
    let mut sum = 0.0;
    for row in 0..h * FINE / 2 {
        for column in 0..w * FINE {
            let (u, v) = ((f64::from(column) + 0.5) / f64::from(FINE), (f64::from(row) + 0.5) / f64::from(FINE));
            let radiance = 0.05 + (2000.0 - 0.05) * tent(u - 50.5) * tent(v - 8.5);
            let theta = PI * v / f64::from(h);
            sum += radiance * theta.cos() * theta.sin();
        }
    }
    let cell = PI / f64::from(h * FINE) * TAU / f64::from(w * FINE);
    (map, sum * cell * FRAC_1_PI)
}

#[test]
fn one_bright_texel_lights_a_floor_as_the_quadrature_says() {
    let (map, value) = sun();
    assert_shows("sun", &floor(scenes::lambert(0.6), map, DVec3::new(-1.0, 0.5, 0.3)).finish(), 1024, 0.6 * value);
}

#[test]
fn sky_lamp_and_point_light_add_up() {
    let mut builder = floor(scenes::lambert(0.6), grey(5, 3, |_, _| 1.0), DVec3::new(-1.0, 0.5, -1.0));
    let lamp = builder.add_material(scenes::lamp(0.0, 20.0));
    scenes::add_quad(&mut builder, [[0.0, 1.0, 0.0], [1.5, 1.0, 0.0], [1.5, 1.0, 0.7], [0.0, 1.0, 0.7]], lamp);
    scenes::add_light(&mut builder, Light::Point { intensity: [3.0; 3] }, DVec3::new(-0.5, 1.0, -0.5), DVec3::NEG_Y);
    // The lamp stands before the sky, and the point light shines at cosine 1 / d from d = sqrt(1.5).
    let lamp = closed::corner_form_factor(1.5, 0.7, 1.0);
    let value = 0.6 * (20.0 * lamp + (1.0 - lamp)) + 0.6 / PI * 3.0 / 1.5_f64.powf(1.5);
    assert_shows("three kinds of light", &builder.finish(), 2048, value);
}

// LGT-07: the light's samples alone, a cosine lobe's alone, and both under the power heuristic, of one integral.
// 16 runs of 4096 samples (of 65536 for the lobe, which hardly finds the sun); Welch's t at 1e-4.
#[test]
fn lgt_07_strategies_agree_alone_and_together() {
    let mut stream = Stream::new(8);
    let (map, _) = sun();
    // Weaker, so that the lobe alone can be tested.
    let map = grey(map.width, map.height, |x, y| map.radiance[(y * map.width + x) as usize][0].min(20.0));
    let table = EnvironmentTable::new(&map).unwrap();
    let mut runs: [Vec<f64>; 3] = Default::default();
    for run in 0..16 {
        let lights = dispatch(Level::best(), SampleAt(&table, &numbers(4096, 100 + run)));
        let lobe: Vec<DVec3> = (0..65_536)
            .map(|_| {
                let (r, phi) = (stream.uniform().sqrt(), TAU * stream.uniform());
                DVec3::new(r * phi.cos(), (1.0 - r * r).sqrt(), r * phi.sin())
            })
            .collect();
        let lobe = dispatch(Level::best(), LookAt(&table, &lobe));
        let value = |l: &Seen| l.1[0] * l.0.y.max(0.0) * FRAC_1_PI;
        let density = |l: &Seen| l.0.y.max(0.0) * FRAC_1_PI;
        let power = |a: f64, b: f64| a * a / (a * a + b * b);
        let by_light: f64 = lights.iter().map(|l| value(l) / l.2).sum::<f64>() / 4096.0;
        let by_lobe: f64 = lobe.iter().map(|l| l.1[0]).sum::<f64>() / 65_536.0;
        let both = lights.iter().map(|l| value(l) / l.2 * power(l.2, density(l))).sum::<f64>() / 4096.0
            + lobe.iter().map(|l| l.1[0] * power(density(l), l.2)).sum::<f64>() / 65_536.0;
        for (runs, value) in runs.iter_mut().zip([by_light, by_lobe, both]) {
            runs.push(value);
        }
    }
    let samples = runs.map(|r| Sample::of(&r));
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let test = welch(&samples[a], &samples[b]);
        assert!(test.p > 1e-4, "{a} and {b}: {} and {}, p = {:e}", samples[a].mean, samples[b].mean, test.p);
    }
}

/// Boxes and a glossy floor under the studio.
fn still_life() -> Scene {
    let mut builder = SceneBuilder::new(0);
    let ids = [scenes::lambert(0.7), scenes::white_metal(0.3), scenes::white_dielectric(0.5)]
        .map(|m| builder.add_material(m));
    scenes::add_floor(&mut builder, 2.0, ids[2]);
    scenes::add_room(&mut builder, 0.4, ids[0]);
    scenes::add_quad(&mut builder, [[0.5, 0.0, 0.5], [1.5, 0.0, 0.0], [1.5, 1.0, 0.0], [0.5, 1.0, 0.5]], ids[1]);
    builder.set_environment(prt::light::studio::environment());
    scenes::add_camera(&mut builder, DVec3::new(0.5, 1.5, 4.0), DVec3::new(0.3, 0.3, 0.0), 0.7);
    builder.finish()
}

#[test]
fn windows_show_the_same_bits_and_lanes_differ_by_rounding_only() {
    let scene = still_life();
    for lanes in [1, 8, 16] {
        if lanes == 16 && !Level::Avx512.is_available() {
            println!("skipped: 16 lanes, this processor has no AVX-512");
            continue;
        }
        let base = RenderSettings { width: 37, height: 29, lanes: Some(lanes), ..settings(37, 5, 7) };
        let whole = shoot(&scene, &base).pixels;
        for (x, y, width, height) in [(0, 0, 1, 1), (5, 3, 16, 9), (0, 13, 37, 2)] {
            let window = CropWindow { x, y, width, height };
            let part = shoot(&scene, &RenderSettings { crop: Some(window), threads: Some(3), ..base.clone() }).pixels;
            for (i, pixel) in part.iter().enumerate() {
                let (column, row) = (x as usize + i % width as usize, y as usize + i / width as usize);
                let same = pixel.map(f32::to_bits) == whole[row * 37 + column].map(f32::to_bits);
                assert!(same, "{lanes} lanes, {window:?}: pixel {column},{row}");
            }
        }
        // A path that turns off elsewhere by rounding is another path: at most 1 % of the pixels (tests/determinism.rs).
        let one = shoot(&scene, &RenderSettings { lanes: Some(1), ..base }).pixels;
        let close = |(p, q): (&[f32; 3], &[f32; 3])| (0..3).all(|c| (p[c] - q[c]).abs() <= 1e-4 * (p[c] + q[c]));
        let astray = one.iter().zip(&whole).filter(|&pair| !close(pair)).count();
        assert!(astray <= one.len() / 100, "{lanes} lanes: {astray} of {} pixels differ", one.len());
    }
}
