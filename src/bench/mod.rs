//! `prt-batch bench rays`: ray backends against each other on the rays that the renderer sends for a scene, in one
//! process, one after the other on the same rays, by CPU time of the thread.
//!
//! `rays` makes the rays, `contenders` builds the backends, `rounds` times them, `agreement` compares what they hit,
//! `report` is the result.

mod agreement;
mod clock;
mod contenders;
mod rays;
mod report;
mod rounds;
mod stats;
mod surface;

pub use clock::KIND as CLOCK;
pub use contenders::{Backend, BuildRow, Setup};
pub use rays::{Kind, PICTURE};
pub use report::{FailedScene, RayReport, RaySettings, Row, SceneRays};
pub use stats::Overall;

use crate::accel::geometry::Geometry;
use crate::accel::linear::Linear;
use crate::error::RenderError;
use crate::integrator::POOL;
use crate::render::{self, AccelChoice, RenderSettings, build_accel, prepare_with};
use crate::scene::Scene;
use agreement::{Agreement, compare, compare_batch};
use contenders::{Contender, Contenders, time_builds};
use rayon::ThreadPool;
use rays::{RaySet, ray_sets};
use report::rows;
use stats::Spread;
use std::fmt;

/// Ray-triangle tests of brute force in one round of one kind.
const LINEAR_TESTS: usize = 100_000_000;
/// Rounds of brute force, which varies little.
const LINEAR_ROUNDS: usize = 3;

/// Why a scene could not be measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BenchError {
    /// There is nothing that rays could hit.
    Empty,
    /// It could not be prepared, or a backend could not be built.
    Render(RenderError),
}

impl fmt::Display for BenchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "no ray hits any triangle of the scene, so there is nothing to measure"),
            Self::Render(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for BenchError {}

impl From<RenderError> for BenchError {
    fn from(error: RenderError) -> Self {
        Self::Render(error)
    }
}

/// Measures `scene`, called `input` in the result, as its first camera sees it.
///
/// # Errors
/// The scene is empty or too large, or a backend cannot be built.
pub fn measure(scene: &Scene, input: &str, settings: &RaySettings) -> Result<SceneRays, BenchError> {
    let single = render::pool(Some(1))?;
    let all = render::pool(Some(settings.threads))?;
    let [width, height] = PICTURE;
    let picture = RenderSettings { width, height, accel: AccelChoice::Bvh, ..RenderSettings::default() };
    let mut captured = Geometry::default();
    let prepared = all.install(|| {
        prepare_with(scene, &picture, |geometry| {
            captured = geometry.clone();
            build_accel(geometry, &picture)
        })
    })?;
    let geometry = captured;
    let camera = render::camera(scene, 0, &prepared, &picture);
    let batches = settings.rays.div_ceil(POOL).max(1);
    let sets = ray_sets(&prepared, &geometry, &camera, batches, settings.seed).ok_or(BenchError::Empty)?;
    // Large scenes hold their shading data twice over otherwise.
    drop(prepared);

    let build = time_builds(&settings.backends, &geometry, settings.rounds, [&single, &all])?;
    let contenders = all.install(|| Contenders::build(&settings.backends, &geometry))?;
    let mut scene = SceneRays::new(input, &geometry, &contenders, build);
    for set in &sets {
        measure_kind(set, &contenders, settings, [&single, &all], &mut scene);
    }
    Ok(scene)
}

/// Times and compares the backends on one kind of rays.
fn measure_kind(
    set: &RaySet,
    contenders: &Contenders,
    settings: &RaySettings,
    [single, all]: [&ThreadPool; 2],
    scene: &mut SceneRays,
) {
    let mut thread_counts = vec![single];
    if all.current_num_threads() > 1 {
        thread_counts.push(all);
    }
    let fast: Vec<&Contender> = contenders.fast.iter().collect();
    let linear = contenders.linear.as_ref().map(|accel| LinearTimes::of(set, accel));
    for pool in thread_counts {
        let times = rounds::time(set, &fast, pool, settings.rounds);
        let linear = linear.as_ref().filter(|_| pool.current_num_threads() == 1);
        scene.rows.extend(rows(set, &fast, &times, pool.current_num_threads(), linear));
    }
    let prepared = |backend: &str| fast.iter().rev().find(|c| c.backend == backend && c.setup == Setup::Prepared);
    if let Some((bvh, embree)) = prepared("bvh").zip(prepared("embree")) {
        scene.add_agreement(set.kind, compare(set, &*bvh.accel, &*embree.accel));
    }
    if let Some((accel, first)) = contenders.linear.as_ref().zip(prepared("bvh").or(prepared("embree"))) {
        let n = linear_rays(set, accel);
        scene.add_linear_agreement(compare_batch(set.kind, &set.some(n), n, &*first.accel, accel));
    }
}

/// Rays that brute force gets.
fn linear_rays(set: &RaySet, accel: &Linear) -> usize {
    (LINEAR_TESTS / accel.geometry().triangle_count().max(1)).clamp(16, set.len())
}

/// What brute force takes.
struct LinearTimes {
    rays: usize,
    seconds: Spread,
}

impl LinearTimes {
    fn of(set: &RaySet, accel: &Linear) -> Self {
        let rays = linear_rays(set, accel);
        let seconds = rounds::time_linear(set.kind, &set.some(rays), rays, accel, LINEAR_ROUNDS);
        Self { rays, seconds: Spread::of(seconds) }
    }
}
