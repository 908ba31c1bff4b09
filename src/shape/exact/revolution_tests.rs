use super::super::line::Line;
use super::super::profile::{Curve, Profile};
use super::*;
use crate::math::random::Rng;
use glam::DVec3;

/// All crossings of a line with `profile`, ascending, and the steps of the search.
struct All {
    found: Vec<f64>,
    steps: u64,
}

impl Visit for All {
    fn meet(&mut self, crossing: Crossing) -> bool {
        self.found.push(crossing.at);
        false
    }

    fn end(&self) -> f64 {
        f64::INFINITY
    }

    fn step(&mut self) {
        self.steps += 1;
    }
}

fn revolution(points: &[[f64; 2]]) -> Revolution {
    Revolution::new(Profile::new(Curve::Bezier, points).unwrap())
}

/// Straight from (r, y) to (r, y).
fn straight(a: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
    (0..4).map(|i| [0, 1].map(|c| a[c] + (b[c] - a[c]) * f64::from(i) / 3.0)).collect()
}

/// Crossings along the whole line through `o`, as t of `o + t d`.
fn crossings(shape: &Revolution, o: DVec3, d: DVec3) -> All {
    let (middle, scale) = (shape.profile().middle, shape.profile().scale);
    let line = Line::new((o - DVec3::Y * middle) / scale, d / scale).unwrap();
    let mut all = All { found: Vec::new(), steps: 0 };
    shape.crossings(&line, f64::NEG_INFINITY, &mut all);
    let reach = (line.point(0.0) * scale + DVec3::Y * middle - o).dot(d) / d.length_squared();
    all.found.iter_mut().for_each(|at| *at = reach + *at * scale / d.length());
    all.found.sort_by(f64::total_cmp);
    all
}

/// Roots of `a t^2 + 2 b t + c`.
fn quadratic(a: f64, b: f64, c: f64) -> Vec<f64> {
    let square = b * b - a * c;
    if a == 0.0 {
        return if b == 0.0 { Vec::new() } else { vec![-c / (2.0 * b)] };
    }
    if square <= 0.0 {
        return Vec::new();
    }
    let q = -(b + square.sqrt().copysign(b));
    let mut both = vec![q / a, c / q];
    both.sort_by(f64::total_cmp);
    both
}

fn vector(rng: &mut Rng, size: f32) -> DVec3 {
    DVec3::new(rng.range(-size, size).into(), rng.range(-size, size).into(), rng.range(-size, size).into())
}

/// Directions as they come: any, level, nearly level, steep, along the axis.
fn direction(rng: &mut Rng, i: usize) -> DVec3 {
    let any = vector(rng, 1.0);
    match i % 8 {
        0 => DVec3::new(any.x, 0.0, any.z),
        1 => DVec3::new(any.x, 10f64.powi(-(i as i32 / 8 % 14)) * any.y, any.z),
        2 => DVec3::Y * any.y,
        3 => DVec3::new(1e-9 * any.x, any.y, 1e-5 * any.z),
        _ => any,
    }
}

type Kind = (&'static str, Vec<[f64; 2]>, fn(DVec3, DVec3) -> [f64; 3], fn(f64) -> bool);

/// Quadrics as cubics: name, profile, coefficients of the quadratic in t, and which heights belong to the shape.
fn quadrics() -> Vec<Kind> {
    vec![
        (
            "cylinder",
            straight([0.7, -1.0], [0.7, 2.0]),
            |o, d| [d.x * d.x + d.z * d.z, o.x * d.x + o.z * d.z, o.x * o.x + o.z * o.z - 0.49],
            |y| (-1.0..=2.0).contains(&y),
        ),
        (
            "cone",
            straight([0.0, 0.0], [1.0, 2.0]),
            |o, d| {
                let (x, z, y) = (o.x * d.x + o.z * d.z, o.x * o.x + o.z * o.z, 0.25);
                [d.x * d.x + d.z * d.z - y * d.y * d.y, x - y * o.y * d.y, z - y * o.y * o.y]
            },
            |y| (0.0..=2.0).contains(&y),
        ),
        (
            // r = u, y = u^2.
            "paraboloid",
            vec![[0.0, 0.0], [1.0 / 3.0, 0.0], [2.0 / 3.0, 1.0 / 3.0], [1.0, 1.0]],
            |o, d| [d.x * d.x + d.z * d.z, o.x * d.x + o.z * d.z - 0.5 * d.y, o.x * o.x + o.z * o.z - o.y],
            |y| (0.0..=1.0).contains(&y),
        ),
    ]
}

// Seed 1, 4000 lines a quadric; lines that pass an end or touch within 1e-9 may go either way.
#[test]
fn sor_01_cylinders_cones_and_paraboloids_are_crossed_where_their_quadratics_say() {
    let mut rng = Rng::new(1);
    for (name, points, coefficients, belongs) in quadrics() {
        let shape = revolution(&points);
        let (mut met, mut wrong) = (0, 0);
        for i in 0..4000 {
            let (o, d) = (vector(&mut rng, 2.0) + DVec3::Y * 0.5, direction(&mut rng, i));
            if d == DVec3::ZERO {
                continue;
            }
            let [a, b, c] = coefficients(o, d);
            let ts = quadratic(a, b, c);
            let touches = (b * b - a * c).abs() < 1e-9 * b * b.max(1e-12);
            let at_end = |t: f64| {
                let y = o.y + t * d.y;
                belongs(y + 1e-9) != belongs(y - 1e-9)
            };
            if touches || ts.iter().any(|t| at_end(*t)) {
                continue;
            }
            let want: Vec<f64> = ts.into_iter().filter(|t| t.abs() < 1e6 && belongs(o.y + t * d.y)).collect();
            let found = crossings(&shape, o, d).found;
            met += want.len();
            let same = found.len() == want.len();
            let near = |(x, y): (&f64, &f64)| (x - y).abs() <= 1e-6 * (x.abs() + 1.0 / d.length());
            if !(same && found.iter().zip(&want).all(near)) {
                wrong += 1;
                assert!(wrong < 2, "{name}: {o:?} {d:?}: {found:?}, not {want:?}");
            }
        }
        assert!(met > 500 && wrong == 0, "{name}: {met} {wrong}");
    }
}

#[test]
fn sor_01_discs_are_planes_also_for_rays_that_hardly_rise() {
    let disc = revolution(&straight([0.25, 1.0], [1.0, 1.0]));
    for exponent in 0..9 {
        let slope = 10f64.powi(-exponent);
        let d = DVec3::new(1.0, slope, 0.0);
        // Through x = 0.5, then through the hole, then beside.
        for (x, hit) in [(0.5, true), (0.0, false), (-0.9, true), (1.1, false)] {
            let o = DVec3::new(x - 2.0, 1.0 - 2.0 * slope, 0.0);
            let found = crossings(&disc, o, d).found;
            assert_eq!(found.len(), usize::from(hit), "{slope:e} {x}: {found:?}");
            assert!(found.iter().all(|t| (t - 2.0).abs() < 1e-6), "{slope:e} {x}: {found:?}");
        }
    }
    assert!(crossings(&disc, DVec3::new(-2.0, 1.0, 0.0), DVec3::X).found.is_empty(), "in its plane");
}

/// The search ends, and quickly, for lines that lie in the surface or touch all of it.
#[test]
fn sor_01_lines_in_the_surface_and_tangent_lines_end() {
    let cylinder = revolution(&straight([1.0, -1.0], [1.0, 1.0]));
    let cone = revolution(&straight([0.0, 0.0], [1.0, 2.0]));
    let ball = revolution(&[[0.0, -1.0], [1.5, -1.0], [1.5, 1.0], [0.0, 1.0]]);
    let mut most = 0;
    let mut try_ = |shape: &Revolution, o: DVec3, d: DVec3| most = most.max(crossings(shape, o, d).steps);
    for k in 0..200 {
        let e = if k == 0 { 0.0 } else { 10f64.powf(-0.08 * f64::from(k)) };
        try_(&cylinder, DVec3::new(1.0 - e, 0.0, 0.0), DVec3::Y);
        try_(&cylinder, DVec3::new(1.0 - e, 0.3, -2.0), DVec3::Z);
        try_(&cylinder, DVec3::new(1.0 - e, 0.3, -2.0), DVec3::new(0.0, e, 1.0));
        try_(&cone, DVec3::new(e, 0.0, 0.0), DVec3::new(1.0, 2.0, 0.0));
        try_(&cone, DVec3::new(e, 0.0, 0.0), DVec3::new(1.0, -2.0, e));
        try_(&ball, DVec3::new(1.125 - e, 0.0, -3.0), DVec3::Z);
        try_(&ball, DVec3::new(-3.0, 1.0 - e, 0.0), DVec3::X);
        try_(&ball, DVec3::new(-3.0, 1.0 - e, 0.0), DVec3::new(1.0, e * e, 0.0));
    }
    assert!(most < 2000, "{most}");
}

#[test]
fn sor_01_short_chords_near_the_rim_are_found() {
    let ball = revolution(&[[0.0, -1.0], [1.5, -1.0], [1.5, 1.0], [0.0, 1.0]]);
    for k in 2..12 {
        let e = 10f64.powi(-k);
        for rise in [0.0, 1e-7, 1e-3, 0.3] {
            // Through the inside of the equator, whose radius is 9/8, e deep.
            let d = DVec3::new(0.0, rise, 1.0);
            let found = crossings(&ball, DVec3::new(1.125 - e, 0.0, 0.0) - 3.0 * d, d).found;
            let [a, b] = found[..] else { panic!("{e:e} {rise:e}: {found:?}") };
            assert!(a < 3.0 && b > 3.0 && b - a < 4.0 * e.sqrt(), "{e:e} {rise:e}: {found:?}");
        }
    }
}

// A closed surface is crossed an even number of times, whatever the line: seed 2.
#[test]
fn crossings_of_a_closed_surface_come_in_pairs() {
    let ball = revolution(&[[0.0, -1.0], [1.5, -1.0], [1.5, 1.0], [0.0, 1.0]]);
    let mut rng = Rng::new(2);
    let mut crossed = 0;
    for i in 0..20_000 {
        let (o, d) = (vector(&mut rng, 1.5), direction(&mut rng, i));
        if d != DVec3::ZERO {
            let found = crossings(&ball, o, d).found;
            assert!(found.len().is_multiple_of(2), "{o:?} {d:?}: {found:?}");
            crossed += found.len() / 2;
        }
    }
    assert!(crossed > 5000);
}

#[test]
fn the_two_branches_agree_at_their_limit() {
    let shape = revolution(&[[1.0, -1.0], [0.2, -0.4], [1.6, 0.3], [0.5, 1.0]]);
    let mut rng = Rng::new(3);
    for _ in 0..2000 {
        let o = vector(&mut rng, 1.0);
        let (x, z) = (f64::from(rng.range(-1.0, 1.0)), f64::from(rng.range(-1.0, 1.0)));
        let at = |y: f64| crossings(&shape, o, DVec3::new(x, y, z).normalize()).found;
        let (level, rising) = (at(0.5 * LEVEL), at(2.0 * LEVEL));
        if level.len() == rising.len() {
            assert!(level.iter().zip(&rising).all(|(a, b)| (a - b).abs() < 1e-5), "{o:?}: {level:?} {rising:?}");
        } else {
            // Only where the line touches.
            let gap = |ts: &[f64]| ts.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
            assert!(gap(&level).min(gap(&rising)) < 1e-3, "{o:?}: {level:?} {rising:?}");
        }
    }
}
