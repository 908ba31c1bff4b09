//! A prepared scene and settings become a [`PathTracer`]: what a frame and the pilot of a plan trace with.

use super::framing::{framing_camera, vector_area};
use super::{CropWindow, Prepared, RenderSettings};
use crate::camera::{Camera, CameraRays, PixelFilter, ThinLens};
use crate::integrator::{Integrator, PathTracer};
use crate::scene::{Framing, Scene};
use glam::DMat4;
use simd::Level;
use std::borrow::Cow;

/// Camera `index` of `scene`, or the one framed on the bounds of a scene without cameras.
///
/// # Panics
/// When there are cameras and `index` is not one of them.
pub fn camera<'s>(scene: &'s Scene, index: usize, prepared: &Prepared, settings: &RenderSettings) -> Cow<'s, Camera> {
    if scene.cameras.is_empty() {
        let aspect = f64::from(settings.width) / f64::from(settings.height);
        let own = || Framing { bounds: prepared.bounds, vector_area: vector_area(scene) };
        let Framing { bounds, vector_area } = scene.framing.unwrap_or_else(own);
        Cow::Owned(framing_camera(bounds, vector_area, aspect))
    } else {
        Cow::Borrowed(&scene.cameras[index])
    }
}

/// The part of the picture that is rendered.
pub fn window(settings: &RenderSettings) -> CropWindow {
    settings.crop.unwrap_or(CropWindow { x: 0, y: 0, width: settings.width, height: settings.height })
}

/// Where camera `index` of `scene` is at later times of the shutter; none if it stands still or is framed on the bounds.
pub fn later(scene: &Scene, index: usize) -> &[DMat4] {
    scene.motion.cameras.get(&(index as u32)).map_or(&[], Vec::as_slice)
}

/// The tracer of a picture of `camera`, which is at `later` after the shutter has opened, taken through `lens` (see
/// [`super::lens()`]).
///
/// # Panics
/// When `settings.lanes` is none of 1, 8, 16.
pub fn tracer<'p>(
    prepared: &'p Prepared,
    camera: &Camera,
    later: &[DMat4],
    lens: Option<&ThinLens>,
    settings: &RenderSettings,
) -> PathTracer<'p> {
    let level = match settings.lanes {
        None => Level::best(),
        Some(1) => Level::Scalar,
        Some(8) => Level::best_of_8(),
        Some(16) => Level::Avx512,
        Some(n) => panic!("{n} lanes; allowed: 1, 8, 16"),
    }
    .without_portable();
    let is_whitted = settings.integrator == Integrator::Whitted;
    PathTracer {
        tables: &prepared.tables,
        accel: &*prepared.accel,
        lamps: if is_whitted { prepared.tables.lights.fixed_points() } else { Vec::new() },
        camera: CameraRays::new(camera, later, settings.width, settings.height, prepared.origin, lens),
        filter: PixelFilter::new(settings.filter.shape, settings.filter.width),
        integrator: settings.integrator,
        max_bounces: settings.max_bounces.unwrap_or(settings.bounce_cap()),
        is_capped: settings.max_bounces.is_none(),
        cull_backfaces: settings.cull_backfaces,
        clamp: settings.clamp,
        seed: settings.seed,
        frame: settings.frame,
        level,
    }
}
