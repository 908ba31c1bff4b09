//! A prepared scene and settings become a [`PathTracer`]: what a frame and the pilot of a plan trace with.

use super::framing::{framing_camera, vector_area};
use super::{CropWindow, Prepared, RenderSettings};
use crate::camera::{Camera, CameraRays, PixelFilter};
use crate::integrator::PathTracer;
use crate::scene::{Framing, Scene};
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

/// The tracer of a picture.
///
/// # Panics
/// When `settings.lanes` is none of 1, 8, 16.
pub fn tracer<'p>(prepared: &'p Prepared, camera: &Camera, settings: &RenderSettings) -> PathTracer<'p> {
    let level = match settings.lanes {
        None => Level::best(),
        Some(1) => Level::Scalar,
        Some(8) => Level::best_of_8(),
        Some(16) => Level::Avx512,
        Some(n) => panic!("{n} lanes; allowed: 1, 8, 16"),
    }
    .without_portable();
    PathTracer {
        tables: &prepared.tables,
        accel: &*prepared.accel,
        camera: CameraRays::new(camera, settings.width, settings.height, prepared.origin),
        filter: PixelFilter::new(settings.filter.shape, settings.filter.width),
        max_bounces: settings.max_bounces.unwrap_or(RenderSettings::BOUNCE_CAP),
        is_capped: settings.max_bounces.is_none(),
        cull_backfaces: settings.cull_backfaces,
        clamp: settings.clamp,
        seed: settings.seed,
        frame: settings.frame,
        level,
    }
}
