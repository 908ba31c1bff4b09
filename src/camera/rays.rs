//! Camera rays over N lanes.

use super::aperture::Aperture;
use super::{Camera, Projection, ThinLens};
use crate::math::V3;
use glam::{DMat4, DVec3};
use simd::{Float, Lanes};

/// A pinhole, a thin lens or an orthographic camera for one picture size, in the prepared scene's space.
#[derive(Clone, Copy, Debug)]
pub struct CameraRays {
    /// The pinhole, the centre of the lens, or that of the plane where parallel rays start; metres.
    origin: [f32; 3],
    /// Direction through the picture's centre.
    forward: [f32; 3],
    /// From the centre to the right edge of the picture at distance 1.
    right: [f32; 3],
    /// From the centre to the lower edge of the picture at distance 1.
    down: [f32; 3],
    /// Side of a pixel at distance 1 along the axis, or of parallel rays anywhere; metres.
    pixel: f32,
    /// 2 / width and 2 / height.
    per_pixel: [f32; 2],
    /// Rays start on the plane instead of at a point.
    is_parallel: bool,
    /// Rays start on a lens.
    aperture: Option<Aperture>,
}

impl CameraRays {
    /// A camera for a picture of `width` x `height` pixels in a scene recentred on `origin` (f64, world metres). The
    /// vertical field of view (or height) is kept; the horizontal one follows from the picture's shape. Rays start on
    /// `lens`, if there is one; an orthographic camera has none.
    pub fn new(camera: &Camera, width: u32, height: u32, origin: DVec3, lens: Option<&ThinLens>) -> Self {
        let (half_height, is_parallel) = match camera.projection {
            Projection::Perspective { yfov, .. } => ((0.5 * yfov).tan(), false),
            Projection::Orthographic { ymag, .. } => (ymag, true),
        };
        let m: &DMat4 = &camera.world_from_camera;
        let aspect = f64::from(width) / f64::from(height);
        let axis = |v: DVec3| v.as_vec3().to_array();
        Self {
            origin: axis(m.w_axis.truncate() - origin),
            forward: axis(-m.z_axis.truncate()),
            right: axis(m.x_axis.truncate() * half_height * aspect),
            down: axis(-m.y_axis.truncate() * half_height),
            pixel: (2.0 * half_height / f64::from(height)) as f32,
            per_pixel: [(2.0 / f64::from(width)) as f32, (2.0 / f64::from(height)) as f32],
            is_parallel,
            aperture: lens.map(|lens| Aperture::new(lens, [half_height * aspect, half_height])),
        }
    }

    /// Origin and unit direction of the rays through film points (`x`, `y`), pixels from the top left corner; `lens`, in
    /// the unit square, says where on the lens they start, if there is one.
    #[inline(always)]
    pub fn ray<L: Lanes>(&self, x: L::F, y: L::F, lens: [L::F; 2]) -> (V3<L>, V3<L>) {
        let one = L::F::one();
        let sx = x.mul_add(L::F::splat(self.per_pixel[0]), -one);
        let sy = y.mul_add(L::F::splat(self.per_pixel[1]), -one);
        let right = V3::<L>::splat(self.right);
        let down = V3::<L>::splat(self.down);
        let (origin, forward) = (V3::<L>::splat(self.origin), V3::<L>::splat(self.forward));
        if self.is_parallel {
            return (right.mul_add(sx, down.mul_add(sy, origin)), forward);
        }
        let d = right.mul_add(sx, down.mul_add(sy, forward));
        let Some(aperture) = &self.aperture else { return (origin, d.normalized()) };
        let (origin, d) = aperture.ray(origin, d, [right, down], lens);
        (origin, d.normalized())
    }

    /// How wide a pixel's rays are where they start, metres, and by how much they widen, radians: the root of the pixel's
    /// solid angle. `direction` (unit) is that of a ray.
    #[inline(always)]
    pub fn cone<L: Lanes>(&self, direction: V3<L>) -> (L::F, L::F) {
        let (zero, pixel) = (L::F::zero(), L::F::splat(self.pixel));
        if self.is_parallel {
            return (pixel, zero);
        }
        // A pixel's area on the picture's plane by cos^3.
        let cos = direction.dot(V3::splat(self.forward)).max(zero);
        (zero, pixel * cos * cos.sqrt())
    }
}
