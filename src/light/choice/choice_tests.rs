//! LGT-06 and LGT-09: probabilities told and rebuilt, in lists and in trees; LGT-07's part that is the choice.
//!
//! Seeds are fixed and the numbers of the choice are spread evenly, so nothing here is left to chance.

use super::*;
use crate::math::V3;
use crate::math::lanes::tests::at_all_levels;
use crate::math::random::Rng;
use glam::{DVec3, Vec3};
use simd::{Kernel, Mask};

/// Surfaces first, then points, half of them balls; every kind, size and direction, within 10 m.
fn lights(surfaces: usize, points: usize, rng: &mut Rng) -> Vec<Bounds> {
    let at = |rng: &mut Rng| 10.0 * rng.cube().as_dvec3();
    let mut lights = Vec::new();
    for i in 0..surfaces {
        let (p, a, b) = (at(rng), rng.direction().as_dvec3(), rng.direction().as_dvec3());
        let size = f64::from(rng.range(0.01, 1.0));
        let corners = |n: usize| [p, p + size * a, p + size * (b + n as f64 * a)];
        // A triangle, a sheet, a folded one.
        let triangles: Vec<_> = (0..=i % 3).map(corners).collect();
        lights.push(Bounds::of_surface(&triangles, f64::from(rng.range(0.1, 100.0)), i % 4 == 0));
    }
    for i in 0..points {
        let (p, intensity) = (at(rng), f64::from(rng.range(0.1, 100.0)));
        let light = match i % 2 {
            0 => Bounds::of_point(p, intensity),
            _ => Bounds::of_spot(p, intensity, rng.direction().as_dvec3(), 0.9, 0.6),
        };
        lights.push(if i < points / 2 { light.with_radius(f64::from(rng.range(0.1, 2.0))) } else { light });
    }
    lights
}

fn choice_of(placed: Vec<Bounds>, surfaces: usize, sky: bool) -> (Choice, Vec<u32>) {
    choice_with_balls(placed, surfaces, 0, sky)
}

fn choice_with_balls(placed: Vec<Bounds>, surfaces: usize, balls: usize, sky: bool) -> (Choice, Vec<u32>) {
    let sun = |towards, illuminance, angular_radius| Sun { towards, illuminance, angular_radius };
    let suns = vec![sun(DVec3::Y, 3.0, 0.0), sun(DVec3::new(0.6, -0.8, 0.0), 1.0, 0.1)];
    let suns = if sky { suns } else { Vec::new() };
    let sky = sky.then(|| Sky::new([(DVec3::Y, 5.0, 1.0), (DVec3::NEG_Y, 1.0, 11.5)].into_iter()).expect("a sky"));
    Choice::new(Candidates { placed, surfaces, balls, suns, sky, radius: 20.0 })
}

fn receiver<L: Lanes>(p: Vec3, n: Vec3) -> Receiver<L> {
    let (p, n) = (V3::splat(p.to_array()), V3::splat(n.to_array()));
    Receiver { p, n, both_sides: L::M::from_bits(0), least: L::F::zero() }
}

/// What lanes hold.
fn floats<L: Lanes>(v: L::F) -> [f32; 16] {
    let mut out = [0.0; 16];
    v.store(&mut out, 0);
    out
}

/// Chooses by `n` numbers spread evenly: light, pmf and total of each.
fn choose_all<L: Lanes>(choice: &Choice, at: &Receiver<L>, n: usize) -> Vec<(u32, f32, f32)> {
    let mut scratch = vec![0.0; choice.scratch()];
    let mut found = Vec::new();
    for first in (0..n).step_by(L::N) {
        let u = (L::U::splat(first as u32) + L::U::lane_ids()).to_float() + L::F::splat(0.5);
        let chosen = choice.choose(at, u * L::F::splat(1.0 / n as f32), &mut scratch);
        let mut light = [0; 16];
        chosen.light.store(&mut light, 0);
        let (pmf, total) = (floats::<L>(chosen.pmf), floats::<L>(chosen.total));
        found.extend((0..L::N).map(|i| (light[i], pmf[i], total[i])));
    }
    found
}

/// Holds lights against each other: few in a list, many in a tree, with and without suns and a sky.
#[derive(Clone)]
struct Check {
    surfaces: usize,
    points: usize,
    sky: bool,
}

impl Kernel for Check {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        const N: usize = 4096;
        let Self { surfaces, points, sky } = self;
        let mut rng = Rng::new(3);
        let placed = lights(surfaces, points, &mut rng);
        let (choice, order) = choice_with_balls(placed, surfaces, points / 2, sky);
        let placed = surfaces + points;
        for _ in 0..12 {
            let at = receiver::<L>(10.0 * rng.cube(), rng.direction());
            let chosen = choose_all(&choice, &at, N);
            let total = L::F::splat(chosen[0].2);
            let mut counts = vec![0_usize; placed + 3];
            for &(light, pmf, _) in chosen.iter().filter(|c| c.1 > 0.0) {
                counts[light as usize] += 1;
                let is_surface = (light as usize) < placed && (order[light as usize] as usize) < surfaces;
                if is_surface {
                    // To the bit.
                    let rebuilt = floats::<L>(choice.pmf(L::U::splat(light), &at, total))[0];
                    assert_eq!(rebuilt.to_bits(), pmf.to_bits(), "light {light}: {rebuilt} for {pmf}");
                }
                if sky && light == choice.sky_number() {
                    let rebuilt = floats::<L>(choice.pmf_of_sky(&at, total))[0];
                    assert_eq!(rebuilt.to_bits(), pmf.to_bits(), "the sky: {rebuilt} for {pmf}");
                }
            }
            // Numbers spread evenly find each light as often as its probability says: one more or less at each end of a
            // share, and a tree's rounding.
            for &(light, pmf, _) in chosen.iter().filter(|c| c.1 > 0.0) {
                let (found, expected) = (counts[light as usize] as f32, pmf * N as f32);
                assert!((found - expected).abs() < 2.0 + 1e-3 * expected, "light {light}: {found} for {expected}");
            }
            if choice.tree.is_some() && !sky {
                // Over all lights 1, or less by what bounds promise and nobody behind them holds.
                let pmf = |light| f64::from(floats::<L>(choice.pmf(L::U::splat(light), &at, total))[0]);
                let sum: f64 = (0..placed as u32).map(pmf).sum();
                let lost = chosen.iter().filter(|c| c.1 <= 0.0).count() as f64 / N as f64;
                assert!((sum + lost - 1.0).abs() < 2e-3, "{sum} and {lost} lost");
            }
        }
    }
}

#[test]
fn lgt_06_few_lights_are_chosen_with_the_probability_told() {
    at_all_levels(Check { surfaces: 33, points: 0, sky: false });
    at_all_levels(Check { surfaces: 20, points: 10, sky: true });
}

#[test]
fn lgt_06_lights_of_a_tree_are_chosen_with_the_probability_told() {
    at_all_levels(Check { surfaces: 200, points: 100, sky: false });
    at_all_levels(Check { surfaces: 300, points: 0, sky: true });
}

/// Every light that can light the point has a probability, whatever bounds it is seen through.
#[derive(Clone)]
struct NeverNone(usize);

impl Kernel for NeverNone {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut rng = Rng::new(8);
        let n = self.0;
        let mut placed = Vec::new();
        let mut triangles = Vec::new();
        for _ in 0..n {
            let (p, a, b) = (10.0 * rng.cube(), rng.direction(), rng.direction());
            let corners = [p, p + rng.range(0.01, 2.0) * a, p + rng.range(0.01, 2.0) * b].map(|c| c.as_dvec3());
            placed.push(Bounds::of_surface(&[corners], 1.0, false));
            triangles.push(corners);
        }
        let (choice, order) = choice_of(placed, n, false);
        let (mut scratch, mut asked) = (vec![0.0; choice.scratch()], 0);
        for _ in 0..1000 {
            let (p, normal) = (10.0 * rng.cube(), rng.direction());
            let at = receiver::<L>(p, normal);
            let total = choice.choose(&at, L::F::zero(), &mut scratch).total;
            for _ in 0..30 {
                let light = rng.below(n) as u32;
                let [a, b, c] = triangles[order[light as usize] as usize];
                let on = a + (b - a) * 0.3 + (c - a) * 0.3 - p.as_dvec3();
                let ng = (b - a).cross(c - a);
                // A thousandth of a radian within the horizons of both.
                if on.dot(normal.as_dvec3()) < 1e-3 * on.length() || -on.dot(ng) < 1e-3 * on.length() * ng.length() {
                    continue;
                }
                asked += 1;
                let pmf = floats::<L>(choice.pmf(L::U::splat(light), &at, total))[0];
                assert!(pmf > 0.0, "light {light} from {p} about {normal}");
            }
        }
        assert!(asked > 5000, "{asked} asked");
    }
}

#[test]
fn lgt_06_no_light_is_impossible_that_can_contribute() {
    at_all_levels(NeverNone(40));
    at_all_levels(NeverNone(700));
}

#[test]
fn lgt_04_a_ball_is_possible_while_any_of_it_is_above_the_horizon() {
    struct Horizon;
    impl Kernel for Horizon {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let mut rng = Rng::new(5);
            for _ in 0..1000 {
                let (place, radius) = (rng.direction().as_dvec3() * f64::from(rng.range(1.0, 9.0)), 0.9);
                let ball = Bounds::of_point(place, 1.0);
                let (choice, _) = choice_with_balls(vec![ball.with_radius(radius)], 0, 1, false);
                let n = rng.direction();
                let (at, mut scratch) = (receiver::<L>(Vec3::ZERO, n), vec![0.0; choice.scratch()]);
                let total = floats::<L>(choice.choose(&at, L::F::zero(), &mut scratch).total)[0];
                let height = place.dot(n.as_dvec3());
                assert!((total > 0.0) == (height > -radius) || (height + radius).abs() < 2e-3, "{height}: {total}");
            }
        }
    }
    simd::dispatch(simd::Level::Scalar, Horizon);
}

#[test]
fn lgt_06_far_away_the_probability_is_the_power() {
    struct Far;
    impl Kernel for Far {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let mut rng = Rng::new(2);
            let powers: Vec<f64> = (0..400).map(|_| f64::from(rng.range(1.0, 50.0))).collect();
            let placed = powers.iter().map(|&power| Bounds::of_point(rng.cube().as_dvec3(), power)).collect();
            let (choice, order) = choice_of(placed, 0, false);
            let at = receiver::<L>(Vec3::new(0.0, -1e4, 0.0), Vec3::Y);
            let mut scratch = vec![0.0; choice.scratch()];
            let total = choice.choose(&at, L::F::zero(), &mut scratch).total;
            let sum: f64 = powers.iter().sum();
            for (light, &number) in order.iter().enumerate() {
                let pmf = f64::from(floats::<L>(choice.pmf(L::U::splat(light as u32), &at, total))[0]);
                let expected = powers[number as usize] / sum;
                assert!((pmf / expected - 1.0).abs() < 0.01, "{pmf} for {expected}");
            }
        }
    }
    simd::dispatch(simd::Level::Scalar, Far);
}

#[test]
fn lgt_09_lights_in_one_place_share_alike() {
    struct Coincident;
    impl Kernel for Coincident {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let place = DVec3::new(1.0, 5.0, -2.0);
            let (choice, _) = choice_of(vec![Bounds::of_point(place, 1.0); 10_000], 0, false);
            let at = receiver::<L>(Vec3::ZERO, Vec3::Y);
            let chosen = choose_all(&choice, &at, 4096);
            for (light, pmf, _) in &chosen {
                assert!(*light < 10_000 && (pmf * 1e4 - 1.0).abs() < 1e-4, "light {light}: {pmf}");
            }
            let mut lights: Vec<u32> = chosen.iter().map(|c| c.0).collect();
            lights.dedup();
            assert!(lights.is_sorted() && lights.len() > 4000, "{} lights", lights.len());
        }
    }
    simd::dispatch(simd::Level::Scalar, Coincident);
}

#[test]
fn nobody_expects_light_of_a_lamp_that_faces_away() {
    struct Behind;
    impl Kernel for Behind {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            // Facing -y at y = 2, and a small one at y = -1 facing up.
            let down = [DVec3::new(0.0, 2.0, 0.0), DVec3::new(4.0, 2.0, 0.0), DVec3::new(0.0, 2.0, 4.0)];
            let up = [DVec3::new(0.0, -1.0, 0.0), DVec3::new(0.0, -1.0, 0.1), DVec3::new(0.1, -1.0, 0.0)];
            let placed = vec![Bounds::of_surface(&[down], 9.0, false), Bounds::of_surface(&[up], 1.0, false)];
            let (choice, _) = choice_of(placed, 2, false);
            let mut scratch = vec![0.0; choice.scratch()];
            // Close above the first, within the ball around it: only the second can be seen.
            let at = receiver::<L>(Vec3::new(1.0, 2.1, 1.0), Vec3::NEG_Y);
            let total = choice.choose(&at, L::F::zero(), &mut scratch).total;
            let pmf = |i| floats::<L>(choice.pmf(L::U::splat(i), &at, total))[0];
            assert_eq!((pmf(0), pmf(1)), (0.0, 1.0));
        }
    }
    simd::dispatch(simd::Level::Scalar, Behind);
}

#[test]
fn the_sky_is_expected_where_it_stands_out() {
    struct Skies;
    impl Kernel for Skies {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            // Level but for a patch of 0.1 sr straight up; the irradiance of the patch is 0.1 x 9 cos.
            let (n, mut samples) = (20_000, Vec::new());
            for i in 0..n {
                let y: f64 = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
                let (sin, cos) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
                let r = (1.0 - y * y).sqrt();
                let radiance = if y > 1.0 - 0.1 / std::f64::consts::TAU { 10.0 } else { 1.0 };
                samples.push((DVec3::new(r * cos, y, r * sin), radiance, 4.0 * std::f64::consts::PI / f64::from(n)));
            }
            let sky = Sky::new(samples.iter().copied()).expect("a patch stands out");
            let seen = |n: Vec3| f64::from(floats::<L>(sky.importance(&receiver::<L>(Vec3::ZERO, n)))[0]);
            // Nine coefficients have the cosine lobe within 7 % of its height.
            let up = 0.1 * (9.0 - 9.0 * 0.1 / (4.0 * std::f64::consts::PI));
            for angle in [0.0_f32, 0.5, 1.0, 1.5, 2.5, 3.1] {
                let (found, exact) =
                    (seen(Vec3::new(angle.sin(), angle.cos(), 0.0)), up * f64::from(angle.cos()).max(0.0));
                assert!((found - exact).abs() < 0.07 * up, "{found} for {exact} at {angle}");
            }
            assert!(Sky::new(samples.iter().map(|s| (s.0, 2.0, s.2))).is_none(), "nothing stands out of a level sky");
        }
    }
    simd::dispatch(simd::Level::Scalar, Skies);
}
