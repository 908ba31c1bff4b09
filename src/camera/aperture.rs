//! Where rays start on a thin lens, over N lanes.

use super::ThinLens;
use crate::math::V3;
use crate::math::lanes::cos_sin_2pi;
use simd::{Float, Lanes};

/// The aperture of a [`ThinLens`], for a camera whose axes are known.
#[derive(Clone, Copy, Debug)]
pub struct Aperture {
    /// Radius over the lengths of the camera's `right` and `down`, so that it turns with them.
    scale: [f32; 2],
    /// 1 / metres; 0: focus at infinity.
    per_focus: f32,
    /// Corners; 0: round.
    blades: f32,
}

impl Aperture {
    /// Of a camera whose axes to the edges of the picture have these lengths.
    pub fn new(lens: &ThinLens, [right, down]: [f64; 2]) -> Self {
        Self {
            scale: [(lens.radius / right) as f32, (lens.radius / down) as f32],
            per_focus: (1.0 / lens.focus_distance) as f32,
            blades: lens.blades as f32,
        }
    }

    /// The ray through a point of the lens, chosen by `u`, that meets the pinhole's ray through `origin` in the plane of
    /// focus; `d` is that one's direction, of length 1 along the axis. The direction is not of unit length.
    #[inline(always)]
    pub fn ray<L: Lanes>(&self, origin: V3<L>, d: V3<L>, [right, down]: [V3<L>; 2], u: [L::F; 2]) -> (V3<L>, V3<L>) {
        let [x, y] = self.point::<L>(u);
        let (x, y) = (x * L::F::splat(self.scale[0]), y * L::F::splat(-self.scale[1]));
        let offset = right.mul_add(x, down.scale(y));
        (origin + offset, offset.mul_add(L::F::splat(-self.per_focus), d))
    }

    /// A point of the aperture of radius 1, x to the right and y up as the camera sees them: uniform over the area.
    #[inline(always)]
    fn point<L: Lanes>(&self, u: [L::F; 2]) -> [L::F; 2] {
        if self.blades > 0.0 { self.in_polygon::<L>(u) } else { in_disc::<L>(u) }
    }

    /// In the regular polygon with corners on the unit circle, one of them at the top: one of the triangles about the
    /// middle, then a point in it.
    #[inline(always)]
    fn in_polygon<L: Lanes>(&self, u: [L::F; 2]) -> [L::F; 2] {
        let blades = L::F::splat(self.blades);
        let place = u[0] * blades;
        let first = place.floor();
        let (c0, s0) = cos_sin_2pi::<L>((first / blades).min(L::F::one()));
        let (c1, s1) = cos_sin_2pi::<L>(((first + L::F::one()) / blades).min(L::F::one()));
        // Triangles from the middle grow as the square of the distance.
        let r = (place - first).sqrt();
        let (x, y) = ((s1 - s0).mul_add(u[1], s0), (c1 - c0).mul_add(u[1], c0));
        [r * x, r * y]
    }
}

/// In the unit disc.
///
/// After Shirley and Chiu 1997, "A Low Distortion Map Between Disk and Square".
#[inline(always)]
fn in_disc<L: Lanes>(u: [L::F; 2]) -> [L::F; 2] {
    let (zero, one, two) = (L::F::zero(), L::F::one(), L::F::splat(2.0));
    let (a, b) = (u[0].mul_add(two, -one), u[1].mul_add(two, -one));
    let by_a = a.abs().gt(b.abs());
    let (r, other) = (a.or_else(by_a, b), b.or_else(by_a, a));
    // An eighth of a turn to either side; 0 / 0 in the middle.
    let eighth = zero.or_else(r.eq(zero), other / r) * L::F::splat(0.125);
    let (cos, sin) = cos_sin_2pi::<L>(eighth.or_else(by_a, L::F::splat(0.25) - eighth));
    [r * cos, r * sin]
}

#[cfg(test)]
#[path = "aperture_tests.rs"]
mod tests;
