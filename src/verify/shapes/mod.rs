//! `verify shapes`: does the search find every crossing of a ray with a turned profile, and no other? Held against an
//! oracle that knows neither polynomials nor boxes; and how fast it is. Numerics SOR-02 and SOR-04.

mod oracle;

pub use oracle::Oracle;

use crate::math::random::Rng;
use crate::shape::exact::ExactShape;
use crate::shape::exact::profile::{Curve, Profile};
use crate::shape::exact::table::{PlacedShape, ShapeLine};
use glam::{DMat4, Vec3};
use rayon::prelude::*;
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

/// A profile that is verified.
pub struct Subject {
    /// As tables show it.
    pub name: String,
    /// How its points are meant.
    pub curve: Curve,
    /// Radius and height, metres.
    pub points: Vec<[f64; 2]>,
}

/// What became of the rays at one profile, or at many of a kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// Of the profile.
    pub name: String,
    /// Rays.
    pub rays: u64,
    /// Crossings that the oracle knows.
    pub crossings: u64,
    /// Of these, not found.
    pub missed: u64,
    /// Rays that met something farther than the nearest crossing, or nothing.
    pub wrong_nearest: u64,
    /// Found where the oracle knows none: two crossings so near to one another that its grid does not see them.
    pub extra: u64,
    /// Rays of which `occludes` and `intersect` say different things.
    pub disagreements: u64,
    /// Largest error of a t beside what its rounding to f32 leaves, metres.
    pub worst_t: f64,
    /// Nearest hits a second on one core, millions.
    pub mrays_per_s: f64,
}

impl Row {
    /// Whether it is as it must be: nothing missed, and at most one crossing in 10,000 that the oracle does not know.
    pub fn is_good(&self) -> bool {
        let lost = self.missed + self.wrong_nearest + self.disagreements;
        lost == 0 && self.extra <= (self.crossings / 10_000).max(2) && self.worst_t <= WORST_T
    }
}

/// Allowed error of a t.
pub const WORST_T: f64 = 1e-5;

/// A bottle: base, wall, shoulder, neck, lip.
pub fn bottle() -> Subject {
    let points = vec![
        [0.0, 0.0],
        [0.2, 0.0],
        [0.4, 0.0],
        [0.4, 0.1],
        [0.4, 0.5],
        [0.4, 0.9],
        [0.4, 1.1],
        [0.4, 1.4],
        [0.14, 1.35],
        [0.13, 1.7],
        [0.13, 1.8],
        [0.17, 1.85],
        [0.14, 1.9],
    ];
    Subject { name: String::from("bottle"), curve: Curve::Bezier, points }
}

/// P0 to P3 of the catalogue, and the bottle.
pub fn named() -> Vec<Subject> {
    let of = |name: &str, r: [f64; 4], y: [f64; 4]| Subject {
        name: String::from(name),
        curve: Curve::Bezier,
        points: (0..4).map(|i| [r[i], y[i]]).collect(),
    };
    vec![
        of("waist", [1.0, 0.2, 1.6, 0.5], [-1.0, -0.4, 0.3, 1.0]),
        of("ball", [0.0, 1.5, 1.5, 0.0], [-1.0, -1.0, 1.0, 1.0]),
        of("crossing", [0.3, 3.0, -2.0, 0.6], [-1.0, -0.3, 0.4, 1.0]),
        of("rod", [0.05, 0.06, 0.04, 0.05], [-1.0, -0.3, 0.3, 1.0]),
        bottle(),
    ]
}

/// Random profile `k`: one to four segments, or a spline.
pub fn random(k: u64) -> Subject {
    let mut rng = Rng::of_stream(1234, "profiles", k);
    let mut point = || [f64::from(rng.range(-0.3, 1.2)), f64::from(rng.range(-1.0, 1.0))];
    let curve = if k.is_multiple_of(2) { Curve::Bezier } else { Curve::BSpline };
    let points = match curve {
        Curve::Bezier => (0..3 * (k / 2 % 4 + 1) + 1).map(|_| point()).collect(),
        Curve::BSpline => (0..k / 2 % 6 + 4).map(|_| point()).collect(),
    };
    Subject { name: format!("random {k}"), curve, points }
}

impl Subject {
    /// As the renderer has it, at the origin.
    ///
    /// # Panics
    /// If its points make no profile.
    pub fn placed(&self) -> PlacedShape {
        let profile = Profile::new(self.curve, &self.points).expect("points that make a profile");
        PlacedShape::new(Arc::new(ExactShape::revolution(profile)), [DMat4::IDENTITY])
    }

    /// Holds `rays` rays from `distance` metres or less away (each coordinate) against the oracle.
    pub fn check(&self, rays: u64, seed: u64, distance: f32) -> Row {
        let (shape, oracle) = (self.placed(), Oracle::new(&self.points, self.curve == Curve::BSpline));
        let mut rng = Rng::of_stream(seed, &self.name, 0);
        let mut row = Row { name: self.name.clone(), rays, ..Row::default() };
        let lines: Vec<ShapeLine> = (0..rays).map(|_| line(&mut rng, distance)).collect();
        for line in &lines {
            judge(&shape, &oracle, line, &mut row);
        }
        let start = Instant::now();
        let hits = lines.iter().filter(|line| shape.nearest(line).is_some()).count();
        std::hint::black_box(hits);
        row.mrays_per_s = rays as f64 / start.elapsed().as_secs_f64().max(1e-9) * 1e-6;
        row
    }
}

/// From the cube of twice `distance` to that of 2.4.
fn line(rng: &mut Rng, distance: f32) -> ShapeLine {
    let mut cube = |size: f32| Vec3::new(rng.range(-size, size), rng.range(-size, size), rng.range(-size, size));
    let (origin, target) = (cube(distance), cube(1.2));
    ShapeLine { origin, direction: target - origin, t_max: f32::INFINITY, time: 0.0 }
}

fn judge(shape: &PlacedShape, oracle: &Oracle, line: &ShapeLine, row: &mut Row) {
    let known = oracle.crossings(line.origin.as_dvec3(), line.direction.as_dvec3());
    row.crossings += known.len() as u64;
    let mut found = Vec::new();
    shape.nearest_where(line, &mut |[t, _, _]| {
        found.push(f64::from(t));
        false
    });
    // What f32 makes of t, and a share of a metre.
    let room = |t: f64| 2e-7 * t + WORST_T / f64::from(line.direction.length());
    // Each crossing is matched once.
    let mut left = found.clone();
    for t in &known {
        let near = left.iter().position(|other| (other - t).abs() <= room(*t));
        match near {
            Some(i) => {
                let apart = (left.swap_remove(i) - t).abs();
                row.worst_t = row.worst_t.max(apart / room(*t) * WORST_T);
            }
            None => row.missed += 1,
        }
    }
    row.extra += left.len() as u64;
    let nearest = shape.nearest(line).map(|[t, _, _]| f64::from(t));
    if let Some(first) = known.first()
        && nearest.is_none_or(|t| t > first + room(*first))
    {
        row.wrong_nearest += 1;
    }
    row.disagreements += u64::from(shape.any(line) != nearest.is_some());
}

/// What is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Rays at each named profile, and at its far copy; at each random one a hundredth of that.
    pub rays: usize,
    /// Random profiles.
    pub random: usize,
    /// Other seeds, other rays.
    pub seed: u64,
}

impl Settings {
    /// Rays by default.
    pub const RAYS: usize = 5000;
    /// Random profiles by default.
    pub const RANDOM: usize = 100;
}

/// What `verify shapes` found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of the program.
    pub prt: &'static str,
    /// All is as it must be.
    pub passed: bool,
    /// As asked for.
    pub seed: u64,
    /// Random profiles.
    pub random: usize,
    /// A row each; the random ones in one.
    pub profiles: Vec<Row>,
    /// What is wrong, a line each.
    pub problems: Vec<String>,
}

/// Distance of the far rays, metres: 1e4 times the profiles.
const FAR: f32 = 2e4;

/// Runs it.
pub fn shapes(settings: &Settings) -> Report {
    let &Settings { rays, random: count, seed } = settings;
    let (rays, few) = (rays as u64, (rays as u64).div_ceil(100));
    let mut profiles: Vec<Row> = named().par_iter().map(|subject| subject.check(rays, seed, 4.0)).collect();
    profiles.extend(
        named()
            .par_iter()
            .map(|subject| {
                let row = subject.check(few, seed, FAR);
                Row { name: format!("{}, far away", row.name), ..row }
            })
            .collect::<Vec<_>>(),
    );
    if count > 0 {
        let rows: Vec<Row> = (0..count as u64).into_par_iter().map(|k| random(k).check(few, seed, 4.0)).collect();
        profiles.push(sum("random", rows));
    }
    let problem = |row: &&Row| !row.is_good();
    let problems = profiles.iter().filter(problem).map(|row| {
        format!(
            "{}: {} crossings missed, {} rays at something farther, {} crossings too many, {} disagreements, t off by {:e}",
            row.name, row.missed, row.wrong_nearest, row.extra, row.disagreements, row.worst_t
        )
    });
    let problems: Vec<String> = problems.collect();
    Report { prt: env!("CARGO_PKG_VERSION"), passed: problems.is_empty(), seed, random: count, profiles, problems }
}

/// All rows of one.
pub fn sum(name: &str, rows: impl IntoIterator<Item = Row>) -> Row {
    let mut all = Row { name: String::from(name), ..Row::default() };
    let mut seconds = 0.0;
    for row in rows {
        all.rays += row.rays;
        all.crossings += row.crossings;
        all.missed += row.missed;
        all.wrong_nearest += row.wrong_nearest;
        all.extra += row.extra;
        all.disagreements += row.disagreements;
        all.worst_t = all.worst_t.max(row.worst_t);
        seconds += row.rays as f64 / row.mrays_per_s;
    }
    all.mrays_per_s = all.rays as f64 / seconds;
    all
}
