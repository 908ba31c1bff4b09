//! Triangles that change their form or place while the shutter is open, as shading reads them: their corners, normals and
//! tangents at every key. In between all are interpolated linearly, corners as the ray kernels do.

use super::table::Triangle;
use crate::math::V3;
use simd::{Float, Lanes, Mask, Uint};

/// The triangles of the prepared scene that move by their vertices: consecutive ones, all with as many keys.
///
/// For each triangle and each of its keys the three corners (metres), then the three normals if any triangle has some,
/// then the three tangents if any has some.
#[derive(Clone, Debug, Default)]
pub struct MovingTriangles {
    /// Number of the first among all triangles.
    first: u32,
    keys: u32,
    /// Records a triangle has at a key: 3, 6 or 9.
    stride: u32,
    has_normals: bool,
    has_tangents: bool,
    records: Vec<[f32; 4]>,
}

/// A triangle at one key.
#[derive(Clone, Copy, Debug)]
pub struct KeyedTriangle {
    /// Metres, prepared space.
    pub corners: [glam::Vec3; 3],
    /// Unit, on the front.
    pub normals: Option<[glam::Vec3; 3]>,
    /// With the handedness, the same at all keys.
    pub tangents: Option<[[f32; 4]; 3]>,
}

/// The moving triangles that lanes hit, at the times of their paths.
#[derive(Clone, Copy)]
pub struct Moved<L: Lanes> {
    /// Lanes that hit one; in the others nothing is changed.
    pub lanes: L::M,
    /// The record of the key before.
    at: L::U,
    /// From there to the next key, in [0, 1].
    s: L::F,
}

/// Of `last` + 1 evenly spaced keys over [0, 1] the one before `time`, or the last but one, and from there to the next, in
/// [0, 1]; the same operations as in the ray kernels.
#[inline(always)]
pub fn segment<L: Lanes>(last: L::U, time: L::F) -> (L::U, L::F) {
    let at = time * last.to_float();
    let k = at.to_uint().min(last - L::U::splat(1));
    (k, at - k.to_float())
}

/// `a + (b - a) s` by plain operations, as the ray kernels do it.
#[inline(always)]
fn between<L: Lanes>(a: V3<L>, b: V3<L>, s: L::F) -> V3<L> {
    a + (b - a).scale(s)
}

impl MovingTriangles {
    /// None yet: the first will be number `first` among all triangles. There are `keys` (at least two) of each.
    pub fn new(first: u32, keys: usize, has_normals: bool, has_tangents: bool) -> Self {
        debug_assert!(keys >= 2, "what has one key does not move");
        let stride = 3 * (1 + u32::from(has_normals) + u32::from(has_tangents));
        Self { first, keys: keys as u32, stride, has_normals, has_tangents, records: Vec::new() }
    }

    /// Adds the next triangle, at all keys.
    ///
    /// # Panics
    /// When there are not as many keys as announced.
    pub fn push(&mut self, keys: &[KeyedTriangle]) {
        assert_eq!(keys.len(), self.keys as usize, "keys of a moving triangle");
        let of = |v: glam::Vec3| [v.x, v.y, v.z, 0.0];
        for key in keys {
            self.records.extend(key.corners.map(of));
            if self.has_normals {
                self.records.extend(key.normals.unwrap_or_default().map(of));
            }
            if self.has_tangents {
                self.records.extend(key.tangents.unwrap_or_default());
            }
        }
    }

    /// Nothing moves.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Keys of each triangle.
    pub fn keys(&self) -> usize {
        self.keys as usize
    }

    /// Triangles.
    pub fn len(&self) -> usize {
        if self.is_empty() { 0 } else { self.records.len() / (self.keys * self.stride) as usize }
    }

    /// The corners of the triangle `primitive` at each key; none if it does not move.
    pub fn corners(&self, primitive: u32) -> impl Iterator<Item = [glam::Vec3; 3]> {
        let i = primitive.checked_sub(self.first).map_or(usize::MAX, |i| i as usize);
        let keys = if i < self.len() { self.keys as usize } else { 0 };
        (0..keys).map(move |k| {
            let at = (i * self.keys as usize + k) * self.stride as usize;
            [0, 1, 2].map(|c| {
                let [x, y, z, _] = self.records[at + c];
                glam::Vec3::new(x, y, z)
            })
        })
    }

    /// Those of the triangles `primitive` that move, at `time`; `None` where no lane of `hit` has one.
    #[inline(always)]
    pub fn at<L: Lanes>(&self, primitive: L::U, time: L::F, hit: L::M) -> Option<Moved<L>> {
        let first = L::U::splat(self.first);
        let index = primitive - first;
        let lanes = hit & !primitive.lt(first) & index.lt(L::U::splat(self.len() as u32));
        if !lanes.any() {
            return None;
        }
        let index = index.or_else(lanes, L::U::splat(0));
        let (k, s) = segment::<L>(L::U::splat(self.keys - 1), time);
        Some(Moved { lanes, at: (index * L::U::splat(self.keys) + k) * L::U::splat(self.stride), s })
    }

    /// What is `offset` records after the first of a key.
    #[inline(always)]
    fn read<L: Lanes>(&self, moved: &Moved<L>, offset: u32) -> V3<L> {
        let at = moved.at + L::U::splat(offset);
        let next = at + L::U::splat(self.stride);
        let (a, b) = (at.records(&self.records), next.records(&self.records));
        between(V3::of_record(&a), V3::of_record(&b), moved.s)
    }

    #[inline(always)]
    fn read3<L: Lanes>(&self, moved: &Moved<L>, offset: u32) -> [V3<L>; 3] {
        [self.read(moved, offset), self.read(moved, offset + 1), self.read(moved, offset + 2)]
    }

    /// `triangle` where and as it is then, and how many times its area that is; those that do not move stay.
    #[inline(always)]
    pub fn moved<L: Lanes>(&self, triangle: &Triangle<L>, moved: &Moved<L>) -> (Triangle<L>, L::F) {
        let [v0, v1, v2] = self.read3(moved, 0);
        let (e1, e2) = (v1 - v0, v2 - v0);
        // By the largest component first: the cross product of edges below 3e-10 m would underflow.
        let scale = L::F::one() / e1.abs().max(e2.abs()).max_component();
        let cross = cross(e1.scale(scale), e2.scale(scale));
        let before = cross_of(triangle, scale);
        let ng = cross.normalized();
        // A triangle that is flat at that time has no normal then, and rays miss it.
        let usable = moved.lanes & ng.is_finite();
        let growth = (cross.dot(cross) / before.dot(before)).sqrt().or_else(usable, L::F::one());
        let moved = Triangle {
            v0: v0.or_else(moved.lanes, triangle.v0),
            e1: e1.or_else(moved.lanes, triangle.e1),
            e2: e2.or_else(moved.lanes, triangle.e2),
            ng: ng.or_else(usable, triangle.ng),
            ..*triangle
        };
        (moved, growth)
    }

    /// The normals of the corners then, in place of `normals`; unit where they have a direction.
    #[inline(always)]
    pub fn normals<L: Lanes>(&self, normals: [V3<L>; 3], moved: &Moved<L>) -> [V3<L>; 3] {
        if !self.has_normals {
            return normals;
        }
        let [n0, n1, n2] = self.read3(moved, 3);
        let [a, b, c] = normals;
        [unit_in(n0, a, moved.lanes), unit_in(n1, b, moved.lanes), unit_in(n2, c, moved.lanes)]
    }

    /// The tangents of the corners then, in place of `tangents`, which they share the handedness with.
    #[inline(always)]
    pub fn tangents<L: Lanes>(&self, tangents: [V3<L>; 3], moved: &Moved<L>) -> [V3<L>; 3] {
        if !self.has_tangents {
            return tangents;
        }
        let [t0, t1, t2] = self.read3(moved, if self.has_normals { 6 } else { 3 });
        let [a, b, c] = tangents;
        [t0.or_else(moved.lanes, a), t1.or_else(moved.lanes, b), t2.or_else(moved.lanes, c)]
    }
}

/// Unit `v` in `lanes`, or as it is where it has no direction; else `other`.
#[inline(always)]
fn unit_in<L: Lanes>(v: V3<L>, other: V3<L>, lanes: L::M) -> V3<L> {
    let unit = v.normalized();
    unit.or_else(unit.is_finite(), v).or_else(lanes, other)
}

/// The cross product of the edges of `triangle`, each `scale` times as long.
#[inline(always)]
fn cross_of<L: Lanes>(triangle: &Triangle<L>, scale: L::F) -> V3<L> {
    cross(triangle.e1.scale(scale), triangle.e2.scale(scale))
}

/// The cross product with an error of two roundings of each component, whatever cancels, where products are fused: by
/// Kahan's difference of products.
#[inline(always)]
fn cross<L: Lanes>(a: V3<L>, b: V3<L>) -> V3<L> {
    V3::new(
        difference::<L>(a.y, b.z, a.z, b.y),
        difference::<L>(a.z, b.x, a.x, b.z),
        difference::<L>(a.x, b.y, a.y, b.x),
    )
}

/// `a b - c d`.
#[inline(always)]
fn difference<L: Lanes>(a: L::F, b: L::F, c: L::F, d: L::F) -> L::F {
    let cd = c * d;
    let error = (-c).mul_add(d, cd);
    a.mul_add(b, -cd) + error
}
