//! Camera rays over N lanes.

use super::aperture::Aperture;
use super::{Camera, Projection, ThinLens};
use crate::math::V3;
use glam::{DMat4, DVec3};
use simd::{Float, Lanes, Uint};

/// A pinhole, a thin lens or an orthographic camera for one picture size, in the prepared scene's space.
#[derive(Clone, Debug)]
pub struct CameraRays {
    /// When the shutter opens.
    view: View,
    /// At evenly spaced times from the opening to the closing of the shutter, four records each, in the order of [`View`]'s
    /// fields; empty for a camera at rest.
    keys: Vec<[f32; 4]>,
    /// Side of a pixel at distance 1 along the axis, or of parallel rays anywhere; metres.
    pixel: f32,
    /// 2 / width and 2 / height.
    per_pixel: [f32; 2],
    /// Rays start on the plane instead of at a point.
    is_parallel: bool,
    /// Rays start on a lens.
    aperture: Option<Aperture>,
}

/// Where the camera is and looks.
#[derive(Clone, Copy, Debug)]
struct View {
    /// The pinhole, the centre of the lens, or that of the plane where parallel rays start; metres.
    origin: [f32; 3],
    /// Direction through the picture's centre.
    forward: [f32; 3],
    /// From the centre to the right edge of the picture at distance 1.
    right: [f32; 3],
    /// From the centre to the lower edge of the picture at distance 1.
    down: [f32; 3],
}

/// [`View`] at the times of N paths.
struct Views<L: Lanes> {
    origin: V3<L>,
    forward: V3<L>,
    right: V3<L>,
    down: V3<L>,
}

impl View {
    /// `half_height` of the picture at distance 1, which is `aspect` times as wide.
    fn new(world_from_camera: &DMat4, half_height: f64, aspect: f64, origin: DVec3) -> Self {
        let m = world_from_camera;
        let axis = |v: DVec3| v.as_vec3().to_array();
        Self {
            origin: axis(m.w_axis.truncate() - origin),
            forward: axis(-m.z_axis.truncate()),
            right: axis(m.x_axis.truncate() * half_height * aspect),
            down: axis(-m.y_axis.truncate() * half_height),
        }
    }

    fn records(&self) -> [[f32; 4]; 4] {
        let Self { origin, forward, right, down } = *self;
        [origin, forward, right, down].map(|[x, y, z]| [x, y, z, 0.0])
    }
}

impl CameraRays {
    /// A camera for a picture of `width` x `height` pixels in a scene recentred on `origin` (f64, world metres). The
    /// vertical field of view (or height) is kept; the horizontal one follows from the picture's shape. `later` is where the
    /// camera is at later times of the shutter, as `scene::Motion` has it; empty for one at rest. Rays start on `lens`, if
    /// there is one; an orthographic camera has none.
    pub fn new(
        camera: &Camera,
        later: &[DMat4],
        width: u32,
        height: u32,
        origin: DVec3,
        lens: Option<&ThinLens>,
    ) -> Self {
        let (half_height, is_parallel) = match camera.projection {
            Projection::Perspective { yfov, .. } => ((0.5 * yfov).tan(), false),
            Projection::Orthographic { ymag, .. } => (ymag, true),
        };
        let aspect = f64::from(width) / f64::from(height);
        let at = |m: &DMat4| View::new(m, half_height, aspect, origin);
        let view = at(&camera.world_from_camera);
        let mut keys = Vec::new();
        if later.iter().any(|m| *m != camera.world_from_camera) {
            keys.extend(view.records());
            keys.extend(later.iter().flat_map(|m| at(m).records()));
        }
        Self {
            view,
            keys,
            pixel: (2.0 * half_height / f64::from(height)) as f32,
            per_pixel: [(2.0 / f64::from(width)) as f32, (2.0 / f64::from(height)) as f32],
            is_parallel,
            aperture: lens.map(|lens| Aperture::new(lens, [half_height * aspect, half_height])),
        }
    }

    /// Whether it moves while the shutter is open.
    pub fn moves(&self) -> bool {
        !self.keys.is_empty()
    }

    #[inline(always)]
    fn views<L: Lanes>(&self, time: L::F) -> Views<L> {
        let View { origin, forward, right, down } = self.view;
        let splat = V3::<L>::splat;
        if !self.moves() {
            return Views { origin: splat(origin), forward: splat(forward), right: splat(right), down: splat(down) };
        }
        let at = time * L::F::splat((self.keys.len() / 4 - 1) as f32);
        let k = at.to_uint().min(L::U::splat(self.keys.len() as u32 / 4 - 2));
        let s = at - k.to_float();
        let before = k.shl(2);
        Views {
            origin: self.between(before, 0, s),
            forward: self.between(before, 1, s),
            right: self.between(before, 2, s),
            down: self.between(before, 3, s),
        }
    }

    /// Record `of` between the key whose records begin at `before` and the next.
    #[inline(always)]
    fn between<L: Lanes>(&self, before: L::U, of: u32, s: L::F) -> V3<L> {
        let at = before + L::U::splat(of);
        let (a, b) = (at.records(&self.keys), (at + L::U::splat(4)).records(&self.keys));
        V3::<L>::of_record(&a).lerp(V3::of_record(&b), s)
    }

    /// Origin and unit direction of the rays through film points (`x`, `y`), pixels from the top left corner, at `time` in
    /// [0, 1] of the shutter; `lens`, in the unit square, says where on the lens they start, if there is one.
    #[inline(always)]
    pub fn ray<L: Lanes>(&self, x: L::F, y: L::F, lens: [L::F; 2], time: L::F) -> (V3<L>, V3<L>) {
        let one = L::F::one();
        let sx = x.mul_add(L::F::splat(self.per_pixel[0]), -one);
        let sy = y.mul_add(L::F::splat(self.per_pixel[1]), -one);
        let Views { origin, forward, right, down } = self.views(time);
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
        let cos = direction.dot(V3::splat(self.view.forward)).max(zero);
        (zero, pixel * cos * cos.sqrt())
    }
}
