//! The lens that a picture is taken through, and what it is focused on if nobody says.

use super::{Prepared, RenderSettings};
use crate::accel::{HitBatch, MISS, RayBatch};
use crate::camera::{Camera, ThinLens};
use crate::error::RenderError;
use glam::DVec3;

/// A lens, and how its focus was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensReport {
    /// The lens.
    pub thin: ThinLens,
    /// Nothing said where it is focused: on the surface in the picture's centre, at infinity where there is none.
    pub is_found: bool,
}

/// The lens of `camera`, as the settings have it, else as it says itself; `None` for a pinhole.
///
/// # Errors
/// There is no such lens, or what it is to be focused on is not before it.
pub fn lens(
    prepared: &Prepared,
    camera: &Camera,
    settings: &RenderSettings,
) -> Result<Option<LensReport>, RenderError> {
    let mut lens = settings.lens.or(camera.lens);
    if let Some(point) = settings.focus_point
        && lens.is_open()
    {
        lens.focus_distance = Some(before(camera, point)?);
    }
    let aspect = f64::from(settings.width) / f64::from(settings.height);
    let is_found = lens.focus_distance.is_none();
    let thin = lens.thin(&camera.projection, aspect, || in_the_centre(prepared, camera));
    let thin = thin.map_err(|why| RenderError::Lens(format!("camera {:?}: {why}", camera.name)))?;
    Ok(thin.map(|thin| LensReport { thin, is_found }))
}

/// How far `point` (world, metres) is before the camera, along its axis.
fn before(camera: &Camera, point: DVec3) -> Result<f64, RenderError> {
    let m = &camera.world_from_camera;
    let distance = (m.w_axis.truncate() - point).dot(m.z_axis.truncate());
    if distance > 0.0 {
        return Ok(distance);
    }
    let side = if distance < 0.0 { format!("{} m behind", -distance) } else { "beside".to_owned() };
    Err(RenderError::Lens(format!(
        "--focus-on: the node is {side} the camera {:?}\n  Allowed: a node before it, or --focus-distance in metres.",
        camera.name
    )))
}

/// How far the first surface on the axis is, metres; infinite where there is none.
fn in_the_centre(prepared: &Prepared, camera: &Camera) -> f64 {
    let m = &camera.world_from_camera;
    let origin = (m.w_axis.truncate() - prepared.origin).as_vec3();
    // One ray, but kernels may read a whole vector.
    let (mut rays, mut hits) = (RayBatch::new(16), HitBatch::new(16));
    rays.set(0, origin, -m.z_axis.truncate().as_vec3(), f32::INFINITY);
    prepared.accel.intersect(&rays, 0..1, false, &mut hits);
    if hits.primitive[0] == MISS || hits.t[0] <= 0.0 { f64::INFINITY } else { f64::from(hits.t[0]) }
}
