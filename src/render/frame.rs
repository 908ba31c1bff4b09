//! One frame: prepare, trace, develop.

use super::features::features;
use super::prepare::prepare;
use super::schedule::Totals;
use super::stopping::{Next, StoppedBy, Waves};
use super::{
    Frame, FrameCamera, Phase, Prepared, Progress, RenderSettings, RenderStats, SpreadReport, TargetReport, lens,
    schedule, tracer,
};
use crate::error::RenderError;
use crate::film::{Errors, Film, Spread, TILE, Tile};
use crate::integrator::PathTracer;
use crate::scene::Scene;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Crossings of volumes' boundaries that do not pair up, a path, about which nothing is said: rays that slip through the
/// edges of closed meshes are far fewer.
const MOST_UNPAIRED: f64 = 1e-3;

/// A rayon pool of `threads` threads (`None` = the cores this process may use) in which to [`render`].
///
/// # Errors
/// The system does not give that many threads.
pub fn pool(threads: Option<usize>) -> Result<rayon::ThreadPool, RenderError> {
    let threads = threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("render {i}")).build();
    pool.map_err(|e| RenderError::TooLarge(format!("cannot start {threads} threads: {e}")))
}

/// Renders camera `camera` of `scene` (an index into `scene.cameras`; a scene without cameras has one framed on its
/// bounds, index 0), on the current rayon pool or, if the settings give a number of threads, on one of its own.
///
/// # Errors
/// The backend is not to be had, the scene is too large, the camera has no such lens, or `progress` was cancelled.
///
/// # Panics
/// When `camera` is out of range, or the settings are (sizes, samples and lanes are checked by whoever made them).
pub fn render(
    scene: &Scene,
    camera: usize,
    settings: &RenderSettings,
    progress: &Progress,
) -> Result<Frame, RenderError> {
    match settings.threads {
        None => render_here(scene, camera, settings, progress),
        threads => pool(threads)?.install(|| render_here(scene, camera, settings, progress)),
    }
}

/// [`render`] on the current rayon pool.
fn render_here(
    scene: &Scene,
    camera: usize,
    settings: &RenderSettings,
    progress: &Progress,
) -> Result<Frame, RenderError> {
    progress.enter(Phase::Building);
    let start = Instant::now();
    let prepared = prepare(scene, settings)?;
    let build_seconds = start.elapsed().as_secs_f64();
    if progress.is_cancelled() {
        return Err(RenderError::Interrupted);
    }
    let mut frame = render_prepared(scene, prepared, camera, settings, progress)?;
    frame.stats.build_seconds = build_seconds;
    Ok(frame)
}

/// Renders a scene that was made ready with the same settings, on the current rayon pool; `build_seconds` of its
/// statistics are 0.
///
/// # Errors
/// The camera has no such lens, or `progress` was cancelled.
///
/// # Panics
/// As [`render`].
pub fn render_prepared(
    scene: &Scene,
    prepared: Prepared,
    camera: usize,
    settings: &RenderSettings,
    progress: &Progress,
) -> Result<Frame, RenderError> {
    let (width, height) = (settings.width, settings.height);
    assert!(width > 0 && height > 0 && settings.spp > 0, "sizes and samples are positive");
    let later = tracer::later(scene, camera);
    let camera = tracer::camera(scene, camera, &prepared, settings);
    let window = tracer::window(settings);
    let lens = lens(&prepared, &camera, settings)?;
    let tracer = tracer::tracer(&prepared, &camera, later, lens.as_ref().map(|lens| &lens.thin), settings);
    let window_tile = Tile { x: window.x, y: window.y, width: window.width, height: window.height };
    progress.enter(Phase::Rendering);
    let start = Instant::now();
    let Sampled { film, totals, pixels, errors, stopped_by, spread } =
        sample(&tracer, window_tile, settings, progress)?;
    let render_seconds = start.elapsed().as_secs_f64();
    let spp = film.spp();
    let paths = window_tile.area() as u64 * u64::from(spp);

    let shown = pixels.iter().flatten().map(|&channel| f64::from(channel)).sum::<f64>() * f64::from(spp);
    let taken = totals.counters.taken;
    let features = features(scene, &prepared, lens.is_some());
    let lanes = tracer.level.lanes();
    let mut warnings = prepared.warnings;
    if totals.non_finite > 0 {
        let places: Vec<_> = totals
            .examples
            .iter()
            .map(|(x, y, s)| format!("pixel {x},{y} sample {s} seed {}", settings.seed))
            .collect();
        warnings.push(format!("{} samples were not finite and were dropped: {}", totals.non_finite, places.join("; ")));
    }
    let unpaired = totals.counters.unpaired as f64 / paths as f64;
    if unpaired > MOST_UNPAIRED {
        warnings.push(format!(
            "{:.1} % of the paths left a volume that they had not entered, or never left one: the camera is inside it, or \
             its surface is open, where what it absorbs and refracts is a guess",
            100.0 * unpaired
        ));
    }
    let target = settings.stopping.target_error;
    let target = target.map(|target| TargetReport {
        target,
        is_met: errors.as_ref().is_none_or(|errors| errors.upper_at(spp) <= target),
        above: errors.as_ref().map(|errors| errors.share_above(target)),
        spp_needed: errors.as_ref().map(|errors| errors.spp_for(target)),
    });
    let tables = &prepared.tables;
    let stats = RenderStats {
        build_seconds: 0.0,
        render_seconds,
        camera_rays: totals.counters.camera,
        bounce_rays: totals.counters.bounce,
        shadow_rays: totals.counters.shadow,
        non_finite_samples: totals.non_finite,
        non_finite_examples: totals.examples,
        truncated: totals.counters.truncated as f64 / paths as f64,
        energy_clamped: if taken > 0.0 { taken / (taken + shown) } else { 0.0 },
        error: errors.as_ref().map(|errors| errors.estimate),
        worst: errors.as_ref().map(Errors::worst),
        stopped_by,
        spread: spread.map(|spread| {
            let [least, most] = film.extremes();
            SpreadReport { stage: spread.stage(), round: spread.round(), least, most, gain: spread.gain() }
        }),
        target,
        triangles: prepared.placed.triangles,
        instances: scene.instances.len() as u64,
        placed_instances: prepared.placed.instances,
        lights: tables.lights.len() as u64,
        features,
        default_light: prepared.default_light,
        environment: tables.lights.has_environment() && !prepared.default_light.used,
        lens,
        accel: prepared.accel_report,
        lanes,
        warnings,
        losses: prepared.losses,
    };
    let frame_camera = FrameCamera {
        world_from_camera: camera.world_from_camera,
        projection: camera.projection,
        aspect_ratio: f64::from(width) / f64::from(height),
    };
    let variance = settings.layers.variance.then(|| film.variance());
    let samples = settings.layers.samples.then(|| film.counts());
    Ok(Frame { width, height, window, pixels, spp, variance, samples, camera: frame_camera, stats })
}

/// What sampling brings.
struct Sampled {
    film: Film,
    totals: Totals,
    pixels: Vec<[f32; 3]>,
    errors: Option<Errors>,
    stopped_by: StoppedBy,
    /// How samples were spread, if unevenly.
    spread: Option<Spread>,
}

/// Units of work a thread below which tiles are made smaller.
const FEW_UNITS: u32 = 8;

/// Takes samples, wave by wave, until the picture is done.
fn sample(
    tracer: &PathTracer<'_>,
    window: Tile,
    settings: &RenderSettings,
    progress: &Progress,
) -> Result<Sampled, RenderError> {
    let start = Instant::now();
    let elapsed = || start.elapsed().as_secs_f64();
    let stopping = &settings.stopping;
    // All threads wait at the end of a wave, so that there must be enough to share out in each.
    let is_small = window.area() / ((TILE * TILE) as usize) < FEW_UNITS as usize * rayon::current_num_threads();
    let mut film = Film::new(window, if stopping.is_open() && is_small { TILE / 2 } else { TILE });
    let mut waves = Waves::new(stopping, settings.spp, start);
    let mut totals = Totals::default();
    let mut pixels = Vec::new();
    let mut spread: Option<Spread> = None;
    let stopped_by = loop {
        let (to, wave) = match (waves.next(elapsed()), &mut spread) {
            (Next::Stop(by), _) => break by,
            (Next::To(to), _) => (to, Some(film.wave(to))),
            (Next::Spread, spread) => (0, spread.as_mut().and_then(|spread| spread.next_wave(&film, settings.spp))),
        };
        let Some(wave) = wave else { break StoppedBy::Spp };
        let paths = |spp: u32| window.area() as u64 * u64::from(spp);
        let expected = waves.expected(elapsed()).map_or(0, |spp| paths(spp.max(to)));
        progress.total.store(expected, Ordering::Relaxed);
        let before = elapsed();
        totals.add(schedule::trace(tracer, &wave, progress));
        if progress.is_cancelled() {
            return Err(RenderError::Interrupted);
        }
        film.take(wave);
        waves.took(film.spp(), elapsed() - before);
        if waves.looks() {
            pixels = film.mean();
            waves.saw(film.errors(&pixels));
        }
        if settings.adaptive && waves.may_spread() {
            spread = film.spread(&pixels).filter(|spread| waves.spreads(spread.gain()));
        }
    };
    let is_seen = waves.looks();
    if !is_seen {
        pixels = film.mean();
    }
    let errors = if is_seen { waves.into_errors() } else { film.errors(&pixels) };
    progress.total.store(window.area() as u64 * u64::from(film.spp()), Ordering::Relaxed);
    Ok(Sampled { film, totals, pixels, errors, stopped_by, spread })
}
