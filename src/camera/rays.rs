//! Camera rays over N lanes.

use super::{Camera, Projection};
use crate::math::V3;
use glam::{DMat4, DVec3};
use simd::{Float, Lanes};

/// A pinhole camera for one picture size, in the prepared scene's space.
#[derive(Clone, Copy, Debug)]
pub struct CameraRays {
    /// The pinhole, metres.
    origin: [f32; 3],
    /// Direction through the picture's centre.
    forward: [f32; 3],
    /// From the centre to the right edge of the picture at distance 1.
    right: [f32; 3],
    /// From the centre to the lower edge of the picture at distance 1.
    down: [f32; 3],
    /// 2 / width and 2 / height.
    per_pixel: [f32; 2],
}

impl CameraRays {
    /// A camera for a picture of `width` x `height` pixels in a scene recentred on `origin` (f64, world metres). The
    /// vertical field of view is kept; the horizontal one follows from the picture's shape.
    pub fn new(camera: &Camera, width: u32, height: u32, origin: DVec3) -> Self {
        let Projection::Perspective { yfov, .. } = camera.projection;
        let m: &DMat4 = &camera.world_from_camera;
        let tan = (0.5 * yfov).tan();
        let aspect = f64::from(width) / f64::from(height);
        let axis = |v: DVec3| v.as_vec3().to_array();
        Self {
            origin: axis(m.w_axis.truncate() - origin),
            forward: axis(-m.z_axis.truncate()),
            right: axis(m.x_axis.truncate() * tan * aspect),
            down: axis(-m.y_axis.truncate() * tan),
            per_pixel: [(2.0 / f64::from(width)) as f32, (2.0 / f64::from(height)) as f32],
        }
    }

    /// Origin and unit direction of the rays through film points (`x`, `y`), pixels from the top left corner.
    #[inline(always)]
    pub fn ray<L: Lanes>(&self, x: L::F, y: L::F) -> (V3<L>, V3<L>) {
        let one = L::F::one();
        let sx = x.mul_add(L::F::splat(self.per_pixel[0]), -one);
        let sy = y.mul_add(L::F::splat(self.per_pixel[1]), -one);
        let right = V3::<L>::splat(self.right);
        let down = V3::<L>::splat(self.down);
        let d = right.mul_add(sx, down.mul_add(sy, V3::splat(self.forward)));
        (V3::splat(self.origin), d.normalized())
    }
}
