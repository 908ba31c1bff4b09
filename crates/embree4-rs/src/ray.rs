//! The rays and hits that go in and out of queries: one ray, packets of 8 and 16, and lane masks.
//! `#[repr(C)]` structs here are exactly what Embree reads and writes, hits with room to spare.

use std::mem::{align_of, offset_of, size_of};

use crate::raw::INVALID_ID;

/// One ray segment, `RTCRay`.
///
/// A query treats a ray as a miss, without handing it to Embree, unless origin and direction are
/// finite, `0 <= t_min <= t_max` and `0 <= time <= 1`; `t_max` may be infinite. The direction need not be unit length:
/// `t` counts in lengths of the direction.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin, scene units.
    pub origin: [f32; 3],
    /// Start of the segment, at least 0.
    pub t_min: f32,
    /// Direction, any length but not zero.
    pub direction: [f32; 3],
    /// Time in [0, 1]; only read where geometry moves.
    pub time: f32,
    /// End of the segment.
    pub t_max: f32,
    /// Ray mask; all bits set meets every geometry.
    pub mask: u32,
    /// Free for callbacks.
    pub id: u32,
    /// Reserved by Embree, 0.
    pub flags: u32,
}

impl Ray {
    /// The ray from `origin` along `direction` with `t` in [0, infinity), time 0 and every mask bit.
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Self { origin, t_min: 0.0, direction, time: 0.0, t_max: f32::INFINITY, mask: u32::MAX, id: 0, flags: 0 }
    }

    /// Whether a query hands this ray to Embree; see the type's documentation.
    pub fn is_traceable(&self) -> bool {
        let ends = self.origin.iter().chain(&self.direction);
        let is_segment = self.t_min >= 0.0 && self.t_max >= self.t_min;
        ends.into_iter().all(|x| x.is_finite()) && is_segment && (0.0..=1.0).contains(&self.time)
    }
}

/// The closest hit of one ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Weight of the triangle's second vertex.
    pub u: f32,
    /// Weight of the triangle's third vertex.
    pub v: f32,
    /// Geometric normal `cross(v1 - v0, v2 - v0)` up to a positive factor, not unit length, object
    /// space. It does not depend on the side that was hit.
    pub ng: [f32; 3],
    /// Index of the triangle in its geometry.
    pub primitive: u32,
    /// Geometry that was hit.
    pub geometry: u32,
    /// Geometry number of the instance that was hit, `u32::MAX` for none.
    pub instance: u32,
    /// Place in an [`InstanceArrayGeometry`](crate::InstanceArrayGeometry), 0 in an instance of its own,
    /// `u32::MAX` for no instance. Libraries with [`HitLayout::Plain`](crate::HitLayout) leave
    /// `u32::MAX` always.
    pub instance_primitive: u32,
}

/// `RTCHit`. Libraries up to 4.2 have no `instance_primitive`; libraries built for more instance
/// levels have longer arrays. `slack` keeps all of them from writing past the end.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
pub(crate) struct RawHit {
    pub(crate) ng: [f32; 3],
    pub(crate) u: f32,
    pub(crate) v: f32,
    pub(crate) primitive: u32,
    pub(crate) geometry: u32,
    pub(crate) instance: u32,
    pub(crate) instance_primitive: u32,
    slack: [u32; 23],
}

/// `RTCRayHit`.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
pub(crate) struct RayHit {
    pub(crate) ray: Ray,
    pub(crate) hit: RawHit,
}

impl RayHit {
    pub(crate) fn new(ray: Ray) -> Self {
        let hit = RawHit {
            ng: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive: INVALID_ID,
            geometry: INVALID_ID,
            instance: INVALID_ID,
            instance_primitive: INVALID_ID,
            slack: [0; 23],
        };
        Self { ray, hit }
    }
}

/// Which lanes of a packet take part: -1 for yes, 0 for no. 64-byte aligned, as Embree asks.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mask<const N: usize>(pub(crate) [i32; N]);

impl<const N: usize> Mask<N> {
    /// All lanes.
    pub const ALL: Self = Self([-1; N]);

    /// No lane.
    pub const NONE: Self = Self([0; N]);

    /// The first `count` lanes; all of them where `count >= N`.
    pub fn first(count: usize) -> Self {
        Self::from_fn(|lane| lane < count)
    }

    /// The lanes for which `is_valid` holds.
    pub fn from_fn(mut is_valid: impl FnMut(usize) -> bool) -> Self {
        Self(std::array::from_fn(|lane| -i32::from(is_valid(lane))))
    }

    /// Whether lane `lane` takes part. Panics when `lane >= N`.
    pub fn contains(&self, lane: usize) -> bool {
        self.0[lane] != 0
    }
}

/// `N` rays in structure-of-arrays form, `RTCRay8` or `RTCRay16`. The rules of [`Ray`] hold per lane.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct RayPacket<const N: usize> {
    /// Origins, x.
    pub origin_x: [f32; N],
    /// Origins, y.
    pub origin_y: [f32; N],
    /// Origins, z.
    pub origin_z: [f32; N],
    /// Starts of the segments.
    pub t_min: [f32; N],
    /// Directions, x.
    pub direction_x: [f32; N],
    /// Directions, y.
    pub direction_y: [f32; N],
    /// Directions, z.
    pub direction_z: [f32; N],
    /// Times in [0, 1].
    pub time: [f32; N],
    /// Ends of the segments; `intersect` queries leave the hit distances here, `occluded` queries
    /// negative infinity where a ray is occluded.
    pub t_max: [f32; N],
    /// Ray masks.
    pub mask: [u32; N],
    /// Free for callbacks.
    pub id: [u32; N],
    /// Reserved by Embree, 0.
    pub flags: [u32; N],
}

impl<const N: usize> Default for RayPacket<N> {
    /// Rays from 0 along 0 with `t` in [0, infinity), time 0 and every mask bit, to be filled.
    fn default() -> Self {
        Self {
            origin_x: [0.0; N],
            origin_y: [0.0; N],
            origin_z: [0.0; N],
            t_min: [0.0; N],
            direction_x: [0.0; N],
            direction_y: [0.0; N],
            direction_z: [0.0; N],
            time: [0.0; N],
            t_max: [f32::INFINITY; N],
            mask: [u32::MAX; N],
            id: [0; N],
            flags: [0; N],
        }
    }
}

impl<const N: usize> RayPacket<N> {
    /// Puts `ray` in lane `lane`. Panics when `lane >= N`.
    pub fn set(&mut self, lane: usize, ray: &Ray) {
        [self.origin_x[lane], self.origin_y[lane], self.origin_z[lane]] = ray.origin;
        self.t_min[lane] = ray.t_min;
        [self.direction_x[lane], self.direction_y[lane], self.direction_z[lane]] = ray.direction;
        self.time[lane] = ray.time;
        self.t_max[lane] = ray.t_max;
        self.mask[lane] = ray.mask;
        self.id[lane] = ray.id;
        self.flags[lane] = ray.flags;
    }

    /// The lanes of `valid` whose rays Embree may see; the same rule as [`Ray::is_traceable`].
    pub(crate) fn traceable(&self, valid: &Mask<N>) -> Mask<N> {
        // 0 * x is NaN for an infinite or NaN x and a zero otherwise, so the sum is 0 exactly when
        // all six numbers are finite. Written without branches so that it vectorises.
        Mask(std::array::from_fn(|i| {
            let origin = self.origin_x[i] * 0.0 + self.origin_y[i] * 0.0 + self.origin_z[i] * 0.0;
            let direction = self.direction_x[i] * 0.0 + self.direction_y[i] * 0.0 + self.direction_z[i] * 0.0;
            let is_segment = (self.t_min[i] >= 0.0) & (self.t_max[i] >= self.t_min[i]);
            let is_ok = (origin + direction == 0.0) & is_segment & (self.time[i] >= 0.0) & (self.time[i] <= 1.0);
            // Only -1 and 0 are defined for Embree.
            -i32::from(is_ok & (valid.0[i] != 0))
        }))
    }
}

/// The hits of `N` rays, `RTCHit8` or `RTCHit16`; see [`Hit`] for the fields.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct HitPacket<const N: usize> {
    /// Geometric normals, x.
    pub ng_x: [f32; N],
    /// Geometric normals, y.
    pub ng_y: [f32; N],
    /// Geometric normals, z.
    pub ng_z: [f32; N],
    /// Weights of the second vertices.
    pub u: [f32; N],
    /// Weights of the third vertices.
    pub v: [f32; N],
    /// Triangles, `u32::MAX` for a miss.
    pub primitive: [u32; N],
    /// Geometries, `u32::MAX` for a miss.
    pub geometry: [u32; N],
    /// Instances, `u32::MAX` for none.
    pub instance: [u32; N],
    /// Places in instance arrays; see [`Hit::instance_primitive`].
    pub instance_primitive: [u32; N],
    // As in `RawHit`: never read, only there to be written to.
    slack: [[u32; N]; 7],
}

impl<const N: usize> Default for HitPacket<N> {
    /// `N` misses.
    fn default() -> Self {
        Self {
            ng_x: [0.0; N],
            ng_y: [0.0; N],
            ng_z: [0.0; N],
            u: [0.0; N],
            v: [0.0; N],
            primitive: [INVALID_ID; N],
            geometry: [INVALID_ID; N],
            instance: [INVALID_ID; N],
            instance_primitive: [INVALID_ID; N],
            slack: [[0; N]; 7],
        }
    }
}

impl<const N: usize> HitPacket<N> {
    /// Makes every lane a miss, so that only lanes that Embree writes are hits afterwards.
    pub(crate) fn reset(&mut self) {
        self.u = [0.0; N];
        self.v = [0.0; N];
        self.primitive = [INVALID_ID; N];
        self.geometry = [INVALID_ID; N];
        self.instance = [INVALID_ID; N];
        self.instance_primitive = [INVALID_ID; N];
    }
}

/// `N` rays and their hits, `RTCRayHit8` or `RTCRayHit16`.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, Default)]
pub struct RayHitPacket<const N: usize> {
    /// The rays, with the hit distances in `t_max` after a query.
    pub ray: RayPacket<N>,
    /// The hits.
    pub hit: HitPacket<N>,
}

/// Eight rays.
pub type Ray8 = RayPacket<8>;
/// Sixteen rays.
pub type Ray16 = RayPacket<16>;
/// Eight rays and their hits.
pub type RayHit8 = RayHitPacket<8>;
/// Sixteen rays and their hits.
pub type RayHit16 = RayHitPacket<16>;
/// Lanes of eight rays.
pub type Mask8 = Mask<8>;
/// Lanes of sixteen rays.
pub type Mask16 = Mask<16>;

const _: () = {
    assert!(size_of::<Ray>() == 48 && align_of::<Ray>() == 16);
    assert!(offset_of!(Ray, origin) == 0);
    assert!(offset_of!(Ray, t_min) == 12);
    assert!(offset_of!(Ray, direction) == 16);
    assert!(offset_of!(Ray, time) == 28);
    assert!(offset_of!(Ray, t_max) == 32);
    assert!(offset_of!(Ray, mask) == 36);
    assert!(offset_of!(Ray, id) == 40);
    assert!(offset_of!(Ray, flags) == 44);
    assert!(size_of::<RawHit>() == 128 && align_of::<RawHit>() == 16);
    assert!(offset_of!(RawHit, ng) == 0);
    assert!(offset_of!(RawHit, u) == 12);
    assert!(offset_of!(RawHit, v) == 16);
    assert!(offset_of!(RawHit, primitive) == 20);
    assert!(offset_of!(RawHit, geometry) == 24);
    assert!(offset_of!(RawHit, instance) == 28);
    assert!(offset_of!(RawHit, instance_primitive) == 32);
    assert!(offset_of!(RawHit, slack) == 36);
    assert!(size_of::<RayHit>() == 176 && align_of::<RayHit>() == 16);
    assert!(offset_of!(RayHit, ray) == 0);
    assert!(offset_of!(RayHit, hit) == 48);
};

/// The rows of a packet follow each other without gaps, each `4 * N` bytes, whatever `N` is.
const fn assert_packet<const N: usize>() {
    let row = 4 * N;
    assert!(align_of::<RayPacket<N>>() == 64 && align_of::<HitPacket<N>>() == 64);
    assert!(align_of::<RayHitPacket<N>>() == 64 && align_of::<Mask<N>>() == 64);
    assert!(offset_of!(RayPacket<N>, origin_x) == 0);
    assert!(offset_of!(RayPacket<N>, origin_y) == row);
    assert!(offset_of!(RayPacket<N>, origin_z) == 2 * row);
    assert!(offset_of!(RayPacket<N>, t_min) == 3 * row);
    assert!(offset_of!(RayPacket<N>, direction_x) == 4 * row);
    assert!(offset_of!(RayPacket<N>, direction_y) == 5 * row);
    assert!(offset_of!(RayPacket<N>, direction_z) == 6 * row);
    assert!(offset_of!(RayPacket<N>, time) == 7 * row);
    assert!(offset_of!(RayPacket<N>, t_max) == 8 * row);
    assert!(offset_of!(RayPacket<N>, mask) == 9 * row);
    assert!(offset_of!(RayPacket<N>, id) == 10 * row);
    assert!(offset_of!(RayPacket<N>, flags) == 11 * row);
    assert!(size_of::<RayPacket<N>>() == 12 * row);
    assert!(offset_of!(HitPacket<N>, ng_x) == 0);
    assert!(offset_of!(HitPacket<N>, ng_y) == row);
    assert!(offset_of!(HitPacket<N>, ng_z) == 2 * row);
    assert!(offset_of!(HitPacket<N>, u) == 3 * row);
    assert!(offset_of!(HitPacket<N>, v) == 4 * row);
    assert!(offset_of!(HitPacket<N>, primitive) == 5 * row);
    assert!(offset_of!(HitPacket<N>, geometry) == 6 * row);
    assert!(offset_of!(HitPacket<N>, instance) == 7 * row);
    assert!(offset_of!(HitPacket<N>, instance_primitive) == 8 * row);
    assert!(offset_of!(HitPacket<N>, slack) == 9 * row);
    assert!(size_of::<HitPacket<N>>() == 16 * row);
    assert!(offset_of!(RayHitPacket<N>, ray) == 0);
    assert!(offset_of!(RayHitPacket<N>, hit) == 12 * row);
    assert!(size_of::<RayHitPacket<N>>() == 28 * row);
}

const _: () = {
    assert_packet::<8>();
    assert_packet::<16>();
    assert!(size_of::<Mask<8>>() == 64 && size_of::<Mask<16>>() == 64);
};
