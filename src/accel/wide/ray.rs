//! A ray as the nodes see it: slab tests that never lose a hit that the triangle test would report.
//!
//! After Ize 2013, "Robust BVH Ray Traversal", JCGT 2(2), but padded in space and not only in t. Ize's bound covers the
//! rounding of the slab test itself. The triangle test rounds too: it may accept a ray that passes outside a triangle,
//! by up to 5 eps of the distance along the direction's largest component (rounding of vertex - origin and of the
//! shear) and 10 eps of the triangle's extent. Where a neighbour loses what a triangle wins and that triangle's box
//! is missed, light leaks. So the boxes are padded by the second share when they are built, and the rays' slopes are
//! widened here by the first: a pad that grows with t is the same as another slope for the near and the far planes.
//! With the constants below at 0, rays at vertices and edges of closed meshes leak (GEO-01 fails).

use super::node::WIDTH;
use crate::accel::RayBatch;
use simd::{Float, Lanes, Mask};

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
/// By how much boxes beyond the nearest hit may lie and still be entered: 32 eps for the rounding of t and of the
/// slabs and 16 for the lane's number in the last bits of where a box is entered, so that a triangle with an equal t is always found.
const BEHIND: f32 = 6.0 * WIDEN;

/// Rays of a batch prepared for nodes and leaves, one in every lane. `woop::ShearedRay` says what the last four are.
///
/// No closures on vectors here and below: they would not be inlined into the code that has the instructions (4 times
/// slower).
#[derive(Clone, Copy)]
pub struct RayLanes<L: Lanes> {
    /// `t = plane * inverse + start` per axis, for the planes where the ray enters and ...
    near_inverse: [L::F; 3],
    near_start: [L::F; 3],
    /// ... where it leaves.
    far_inverse: [L::F; 3],
    far_start: [L::F; 3],
    /// Bits of the rays that go down along an axis.
    down: [u32; 3],
    /// Bits of the rays whose largest component is x, y and z.
    largest: [u32; 3],
    /// Bits of the rays that can hit anything.
    pub valid: u32,
    /// Origin, permuted.
    pub origin: [L::F; 3],
    /// The shear.
    pub shear: [L::F; 3],
    /// End of the ray.
    pub t_max: L::F,
}

impl<L: Lanes> RayLanes<L> {
    /// Rays `at..at + L::N`, which the batch must have room for. `scene` are the corners of the scene's bounds.
    #[inline(always)]
    pub fn new(rays: &RayBatch, at: usize, scene: &[[f32; 3]; 2]) -> Self {
        let o = [L::F::load(&rays.ox, at), L::F::load(&rays.oy, at), L::F::load(&rays.oz, at)];
        let d = [L::F::load(&rays.dx, at), L::F::load(&rays.dy, at), L::F::load(&rays.dz, at)];
        Self::of(o, d, L::F::load(&rays.t_max, at), scene)
    }

    /// Rays by origin, direction and end.
    #[inline(always)]
    pub fn of(o: [L::F; 3], d: [L::F; 3], t_max: L::F, scene: &[[f32; 3]; 2]) -> Self {
        let zero = L::F::zero();
        let a = [d[0].abs(), d[1].abs(), d[2].abs()];
        // 0 * x is NaN for infinities and NaN. A NaN end fails its comparison.
        let finite = (o[0] * zero + o[1] * zero + o[2] * zero + d[0] * zero + d[1] * zero + d[2] * zero).eq(zero);
        let largest = a[0].max(a[1]).max(a[2]);
        let valid = (finite & largest.ge(L::F::splat(f32::MIN_POSITIVE)) & t_max.gt(zero)).bits();

        let is_x = a[0].ge(a[1]) & a[0].ge(a[2]);
        let is_y = !is_x & a[1].ge(a[2]);
        let dz = pick::<L>(is_x, is_y, d[0], d[1], d[2]);
        let flip = dz.lt(zero);
        let (dx, dy) =
            swap::<L>(flip, pick::<L>(is_x, is_y, d[1], d[2], d[0]), pick::<L>(is_x, is_y, d[2], d[0], d[1]));
        let (ox, oy) =
            swap::<L>(flip, pick::<L>(is_x, is_y, o[1], o[2], o[0]), pick::<L>(is_x, is_y, o[2], o[0], o[1]));
        let oz = pick::<L>(is_x, is_y, o[0], o[1], o[2]);

        let mut reach = zero;
        for axis in 0..3 {
            reach = reach.max((o[axis] - L::F::splat(scene[0][axis])).abs());
            reach = reach.max((o[axis] - L::F::splat(scene[1][axis])).abs());
        }
        let parallel_slope = largest * L::F::splat(PARALLEL_SLOPE);
        let (mut near_inverse, mut near_start) = ([zero; 3], [zero; 3]);
        let (mut far_inverse, mut far_start) = ([zero; 3], [zero; 3]);
        let mut down = [0; 3];
        for axis in 0..3 {
            let sloped = a[axis].gt(largest * L::F::splat(PARALLEL));
            let widen = largest * L::F::splat(WIDEN);
            let near_slope = (a[axis] + widen).or_else(sloped, parallel_slope);
            let far_slope = (a[axis] - widen).or_else(sloped, parallel_slope);
            let parallel_pad = zero.or_else(sloped, reach * L::F::splat(PARALLEL_PAD));
            let sign = L::F::one().copysign(d[axis]);
            let pad = sign * (o[axis].abs() * L::F::splat(ORIGIN_PAD) + parallel_pad);
            near_inverse[axis] = sign / near_slope;
            far_inverse[axis] = sign / far_slope;
            near_start[axis] = -((o[axis] + pad) * near_inverse[axis]);
            far_start[axis] = -((o[axis] - pad) * far_inverse[axis]);
            down[axis] = sign.lt(zero).bits();
        }
        Self {
            near_inverse,
            near_start,
            far_inverse,
            far_start,
            down,
            largest: [is_x.bits(), is_y.bits(), (!(is_x | is_y)).bits()],
            valid,
            origin: [ox, oy, oz],
            shear: [dx / dz, dy / dz, L::F::one() / dz],
            t_max,
        }
    }

    /// Which planes ray `i` enters by, and how its axes are permuted.
    #[inline(always)]
    pub fn shape(&self, i: usize) -> Shape {
        let is = |bits: u32| bits >> i & 1;
        let [x, y, z] = self.down.map(is);
        let kz = is(self.largest[1]) + 2 * is(self.largest[2]);
        let (mut kx, mut ky) = (if kz == 2 { 0 } else { kz + 1 }, if kz == 0 { 2 } else { kz - 1 });
        if is(self.down[kz as usize]) == 1 {
            (kx, ky) = (ky, kx);
        }
        Shape { down: [x == 1, y == 1, z == 1], axes: [kx as usize, ky as usize, kz as usize] }
    }

    /// Those of `lanes` (not empty) that have the shape of the first.
    #[inline(always)]
    pub fn alike(&self, lanes: u32) -> u32 {
        let first = lanes.trailing_zeros();
        let mut alike = lanes;
        for bits in self.down.iter().chain(&self.largest) {
            alike &= if bits >> first & 1 == 1 { *bits } else { !*bits };
        }
        alike
    }

    /// Where the rays, all of shape `down`, enter the box in lane `child` of `planes`, and those that do so in
    /// [0, `end`], as bits.
    ///
    /// Inf - inf and 0 * inf may give NaN; `min` and `max` return their second operand then, so a NaN never culls.
    #[inline(always)]
    pub fn test_box(&self, planes: &[f32; 6 * WIDTH], child: usize, down: [bool; 3], end: L::F) -> (u32, L::F) {
        let (mut enter, mut exit) = (L::F::zero(), end);
        for (axis, &down) in down.iter().enumerate() {
            let (near, far) = rows(axis, down);
            let near = L::F::splat(planes[near + child]).mul_add(self.near_inverse[axis], self.near_start[axis]);
            let far = L::F::splat(planes[far + child]).mul_add(self.far_inverse[axis], self.far_start[axis]);
            enter = near.max(enter);
            exit = far.min(exit);
        }
        (enter.le(exit).bits(), enter)
    }

    /// Those that enter the box of corners `low` and `high` in [0, `end`], whatever their shapes, as bits. As
    /// [`RayLanes::test_box`].
    #[inline(always)]
    pub fn enter(&self, [low, high]: &[[f32; 3]; 2], end: L::F) -> u32 {
        let (mut enter, mut exit) = (L::F::zero(), end);
        for axis in 0..3 {
            let down = L::M::from_bits(self.down[axis]);
            let (low, high) = (L::F::splat(low[axis]), L::F::splat(high[axis]));
            let (near, far) = swap::<L>(down, low, high);
            enter = near.mul_add(self.near_inverse[axis], self.near_start[axis]).max(enter);
            exit = far.mul_add(self.far_inverse[axis], self.far_start[axis]).min(exit);
        }
        enter.le(exit).bits()
    }

    /// The numbers of all rays, to take single rays from.
    #[inline(always)]
    pub fn store(&self, out: &mut [[f32; WIDTH]; 18]) {
        for axis in 0..3 {
            self.near_inverse[axis].store(&mut out[axis], 0);
            self.near_start[axis].store(&mut out[3 + axis], 0);
            self.far_inverse[axis].store(&mut out[6 + axis], 0);
            self.far_start[axis].store(&mut out[9 + axis], 0);
            self.origin[axis].store(&mut out[12 + axis], 0);
            self.shear[axis].store(&mut out[15 + axis], 0);
        }
    }
}

/// `x` where `is_x`, `y` where `is_y`, else `z`.
#[inline(always)]
fn pick<L: Lanes>(is_x: L::M, is_y: L::M, x: L::F, y: L::F, z: L::F) -> L::F {
    x.or_else(is_x, y.or_else(is_y, z))
}

/// `(b, a)` where `flip`, else `(a, b)`.
#[inline(always)]
fn swap<L: Lanes>(flip: L::M, a: L::F, b: L::F) -> (L::F, L::F) {
    (b.or_else(flip, a), a.or_else(flip, b))
}

/// First numbers of the near and the far row of an axis.
#[inline(always)]
fn rows(axis: usize, down: bool) -> (usize, usize) {
    let (low, high) = (axis * WIDTH, (axis + 3) * WIDTH);
    if down { (high, low) } else { (low, high) }
}

/// What rays of a packet must share.
#[derive(Clone, Copy)]
pub struct Shape {
    /// Negative along an axis.
    pub down: [bool; 3],
    /// Which axes became x, y and z in the triangle test.
    pub axes: [usize; 3],
}

impl Shape {
    /// Where the octant's bits begin in the nodes' orders.
    #[inline(always)]
    pub fn octant(&self) -> u32 {
        3 * (u32::from(self.down[0]) + 2 * u32::from(self.down[1]) + 4 * u32::from(self.down[2]))
    }
}

/// One ray, in every lane.
#[derive(Clone, Copy)]
pub struct SingleRay<L: Lanes> {
    near_rows: [usize; 3],
    far_rows: [usize; 3],
    near_inverse: [L::F; 3],
    near_start: [L::F; 3],
    far_inverse: [L::F; 3],
    far_start: [L::F; 3],
    pub axes: [usize; 3],
    pub origin: [L::F; 3],
    pub shear: [L::F; 3],
}

impl<L: Lanes> SingleRay<L> {
    /// Ray `i` of what [`RayLanes::store`] wrote.
    #[inline(always)]
    pub fn new(stored: &[[f32; WIDTH]; 18], i: usize, shape: Shape) -> Self {
        let (mut near_rows, mut far_rows) = ([0; 3], [0; 3]);
        for axis in 0..3 {
            (near_rows[axis], far_rows[axis]) = rows(axis, shape.down[axis]);
        }
        Self {
            near_rows,
            far_rows,
            near_inverse: splat3::<L>(stored, 0, i),
            near_start: splat3::<L>(stored, 3, i),
            far_inverse: splat3::<L>(stored, 6, i),
            far_start: splat3::<L>(stored, 9, i),
            axes: shape.axes,
            origin: splat3::<L>(stored, 12, i),
            shear: splat3::<L>(stored, 15, i),
        }
    }

    /// No ray.
    #[inline(always)]
    pub fn none() -> Self {
        let zero = [L::F::zero(); 3];
        Self {
            near_rows: [0; 3],
            far_rows: [0; 3],
            near_inverse: zero,
            near_start: zero,
            far_inverse: zero,
            far_start: zero,
            axes: [0; 3],
            origin: zero,
            shear: zero,
        }
    }

    /// Makes it the ray that all lanes of `lanes` are.
    #[inline(always)]
    pub fn set(&mut self, lanes: &RayLanes<L>, shape: Shape) {
        for axis in 0..3 {
            (self.near_rows[axis], self.far_rows[axis]) = rows(axis, shape.down[axis]);
        }
        (self.near_inverse, self.near_start) = (lanes.near_inverse, lanes.near_start);
        (self.far_inverse, self.far_start) = (lanes.far_inverse, lanes.far_start);
        (self.axes, self.origin, self.shear) = (shape.axes, lanes.origin, lanes.shear);
    }

    /// Which of a node's boxes the ray meets in [0, `end`], and where it enters them. As [`RayLanes::test_box`].
    #[inline(always)]
    pub fn test_boxes(&self, planes: &[f32; 6 * WIDTH], end: L::F) -> (L::M, L::F) {
        let (mut enter, mut exit) = (L::F::zero(), end);
        for axis in 0..3 {
            let near = L::F::load(planes, self.near_rows[axis]);
            let far = L::F::load(planes, self.far_rows[axis]);
            enter = near.mul_add(self.near_inverse[axis], self.near_start[axis]).max(enter);
            exit = far.mul_add(self.far_inverse[axis], self.far_start[axis]).min(exit);
        }
        (enter.le(exit), enter)
    }
}

#[inline(always)]
fn splat3<L: Lanes>(stored: &[[f32; WIDTH]; 18], row: usize, i: usize) -> [L::F; 3] {
    [L::F::splat(stored[row][i]), L::F::splat(stored[row + 1][i]), L::F::splat(stored[row + 2][i])]
}

/// How far boxes are entered when the nearest hit so far, or the ray's end, is `t`.
#[inline(always)]
pub fn box_end(t: f32) -> f32 {
    (t + t * BEHIND + f32::MIN_POSITIVE).min(f32::MAX)
}

/// As [`box_end`], in lanes.
#[inline(always)]
pub fn box_ends<L: Lanes>(t: L::F) -> L::F {
    (t + t * L::F::splat(BEHIND) + L::F::splat(f32::MIN_POSITIVE)).min(L::F::splat(f32::MAX))
}
