//! A ray as the nodes see it: slab tests that never lose a hit that the triangle test would report.
//!
//! After Ize 2013, "Robust BVH Ray Traversal", JCGT 2(2), but padded in space and not only in t. Ize's bound covers the
//! rounding of the slab test itself. The triangle test rounds too: it may accept a ray that passes outside a triangle,
//! by up to 5 eps of the distance along the direction's largest component (rounding of vertex - origin and of the
//! shear) and 10 eps of the triangle's extent. Where a neighbour loses what a triangle wins and that triangle's box
//! is missed, light leaks. So the boxes are padded by the second share when they are built, and the rays' slopes are
//! widened here by the first: a pad that grows with t is the same as another slope for the near and the far planes.

use super::node::WIDTH;
use crate::accel::woop::ShearedRay;
use simd::{Float, Lanes};

/// The share of the distance by which a ray is widened: 8 eps.
const WIDEN: f32 = 1.0 / (1 << 21) as f32;
/// An axis along which the direction is less than this share of its largest component has no usable slope: 32 eps.
const PARALLEL: f32 = 4.0 * WIDEN;
/// Slope taken for such an axis, as a share of the largest component: 16 eps.
const PARALLEL_SLOPE: f32 = 2.0 * WIDEN;
/// Pad for such an axis, as a share of the distance to the scene's farthest corner. It must cover 32 + 8 eps, and 16
/// more for the far planes to lie behind every hit: 64 eps.
const PARALLEL_PAD: f32 = 8.0 * WIDEN;
/// Share of the origin's coordinate lost in `plane * inverse - origin * inverse`: 4 eps (2, and 1 without FMA).
const ORIGIN_PAD: f32 = WIDEN / 2.0;
/// By how much boxes beyond the nearest hit may lie and still be entered: 32 eps, for the rounding of t and of the
/// slabs, so that a triangle with an equal t is always found.
const BEHIND: f32 = 4.0 * WIDEN;

/// Per axis: which planes are near, and `t = plane * inverse + start` for near and far planes.
#[derive(Clone, Copy)]
struct Slab<L: Lanes> {
    near_row: usize,
    far_row: usize,
    near_inverse: L::F,
    near_start: L::F,
    far_inverse: L::F,
    far_start: L::F,
}

impl<L: Lanes> Slab<L> {
    #[inline(always)]
    fn new(axis: usize, origin: f32, direction: f32, largest: f32, reach: f32) -> Self {
        let magnitude = direction.abs();
        let (near_slope, far_slope, pad) = if magnitude > PARALLEL * largest {
            (magnitude + WIDEN * largest, magnitude - WIDEN * largest, ORIGIN_PAD * origin.abs())
        } else {
            (PARALLEL_SLOPE * largest, PARALLEL_SLOPE * largest, ORIGIN_PAD * origin.abs() + PARALLEL_PAD * reach)
        };
        let sign = 1f32.copysign(direction);
        let (near_inverse, far_inverse) = (sign / near_slope, sign / far_slope);
        let (low_row, high_row) = (axis * WIDTH, (axis + 3) * WIDTH);
        let (near_row, far_row) = if sign > 0.0 { (low_row, high_row) } else { (high_row, low_row) };
        Self {
            near_row,
            far_row,
            near_inverse: L::F::splat(near_inverse),
            near_start: L::F::splat(-(origin + sign * pad) * near_inverse),
            far_inverse: L::F::splat(far_inverse),
            far_start: L::F::splat(-(origin - sign * pad) * far_inverse),
        }
    }

    #[inline(always)]
    fn near(&self, planes: &[f32; 6 * WIDTH]) -> L::F {
        L::F::load(planes, self.near_row).mul_add(self.near_inverse, self.near_start)
    }

    #[inline(always)]
    fn far(&self, planes: &[f32; 6 * WIDTH]) -> L::F {
        L::F::load(planes, self.far_row).mul_add(self.far_inverse, self.far_start)
    }
}

/// A ray prepared for the nodes.
#[derive(Clone, Copy)]
pub struct BoxRay<L: Lanes> {
    slabs: [Slab<L>; 3],
}

impl<L: Lanes> BoxRay<L> {
    /// From a ray that [`ShearedRay::new`] accepted. `scene` are the corners of the scene's bounds.
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3], scene: &[[f32; 3]; 2]) -> Self {
        let largest = direction[0].abs().max(direction[1].abs()).max(direction[2].abs());
        let mut reach = 0f32;
        for i in 0..3 {
            reach = reach.max((origin[i] - scene[0][i]).abs()).max((origin[i] - scene[1][i]).abs());
        }
        // No closures on vectors: they would not be inlined into the code that has the instructions.
        Self {
            slabs: [
                Slab::new(0, origin[0], direction[0], largest, reach),
                Slab::new(1, origin[1], direction[1], largest, reach),
                Slab::new(2, origin[2], direction[2], largest, reach),
            ],
        }
    }

    /// Which boxes the ray meets in [0, `end`], as bits, and where it enters them.
    ///
    /// Inf - inf and 0 * inf may give NaN; `min` and `max` return their second operand then, so a NaN never culls.
    #[inline(always)]
    pub fn test(&self, planes: &[f32; 6 * WIDTH], end: L::F) -> (u32, L::F) {
        let [x, y, z] = &self.slabs;
        let enter = x.near(planes).max(y.near(planes).max(z.near(planes).max(L::F::zero())));
        let exit = x.far(planes).min(y.far(planes).min(z.far(planes).min(end)));
        (simd::Mask::bits(enter.le(exit)), enter)
    }
}

/// How far boxes are entered when the nearest hit so far, or the ray's end, is `t`.
#[inline(always)]
pub fn box_end(t: f32) -> f32 {
    (t + t * BEHIND + f32::MIN_POSITIVE).min(f32::MAX)
}

/// The parts of a ray's preparation that the leaves need, in every lane.
#[derive(Clone, Copy)]
pub struct LeafRay<L: Lanes> {
    /// Which axes became x, y and z.
    pub axes: [usize; 3],
    /// Origin, permuted.
    pub origin: [L::F; 3],
    /// The shear.
    pub shear: [L::F; 3],
}

impl<L: Lanes> LeafRay<L> {
    #[inline(always)]
    pub fn new(ray: &ShearedRay) -> Self {
        let ([ox, oy, oz], [sx, sy, sz]) = (ray.origin, ray.shear);
        Self {
            axes: ray.axes,
            origin: [L::F::splat(ox), L::F::splat(oy), L::F::splat(oz)],
            shear: [L::F::splat(sx), L::F::splat(sy), L::F::splat(sz)],
        }
    }
}
