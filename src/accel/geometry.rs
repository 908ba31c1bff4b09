//! What rays can hit, as every backend is built from it.
//!
//! Ids: `primitive` numbers all triangles and shapes of the prepared scene, whatever object they belong to; `instance` is
//! 0 for the world and i + 1 for placement i. What the numbers mean is `render::prepare`'s and shading's business.

use super::Triangles;
use glam::{DMat3, DVec3, Vec3};
use std::sync::Arc;

/// Everything rays can hit.
#[derive(Clone, Default)]
pub struct Geometry {
    /// What lies in the prepared space itself: instance 0.
    pub world: Object,
    /// What is placed, each in a space of its own.
    pub objects: Vec<Object>,
    /// Where objects are: instance i + 1 is placement i.
    pub placements: Vec<Placement>,
    /// Decides about hits on filtered parts; needed if there are any.
    pub filter: Option<Arc<dyn HitFilter>>,
}

/// Things in one coordinate space.
#[derive(Clone, Default)]
pub struct Object {
    /// Triangles.
    pub parts: Vec<Part>,
    /// Exact shapes, each with its primitive number. Those that are filtered must be the world's: Embree does not tell
    /// them which placement they are in.
    pub shapes: Vec<(Arc<dyn Shape>, u32)>,
}

/// Triangles of one kind. A scene has few parts; splitting one up further gains nothing.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// Triangles with their vertices at time 0.
    pub triangles: Triangles,
    /// Vertices at later times, evenly spaced up to time 1, each as many as at time 0; empty for what does not move.
    /// In between vertices move linearly.
    pub later: Vec<Vec<[f32; 3]>>,
    /// The primitive numbers of the triangles.
    pub primitives: Primitives,
    /// Whether the geometry's filter is asked about hits.
    pub filtered: bool,
}

/// Numbers of a part's triangles, ascending.
#[derive(Clone, Debug)]
pub enum Primitives {
    /// Consecutive from here.
    From(u32),
    /// One for each triangle.
    Each(Vec<u32>),
}

impl Default for Primitives {
    fn default() -> Self {
        Self::From(0)
    }
}

impl Primitives {
    /// The number of triangle `i` of the part.
    #[inline(always)]
    pub fn get(&self, i: usize) -> u32 {
        match self {
            Self::From(first) => first + i as u32,
            Self::Each(numbers) => numbers[i],
        }
    }

    /// Gives triangle `i`, the one after the last, the number `number`, higher than all before.
    pub fn push(&mut self, i: usize, number: u32) {
        match self {
            Self::From(first) if i == 0 => *first = number,
            Self::From(first) if *first + i as u32 == number => {}
            Self::From(first) => *self = Self::Each((*first..*first + i as u32).chain([number]).collect()),
            Self::Each(numbers) => numbers.push(number),
        }
    }
}

/// An object placed in the prepared space.
#[derive(Clone, Debug)]
pub struct Placement {
    /// Index among the objects.
    pub object: u32,
    /// Prepared space from object space at evenly spaced times over [0, 1], never empty; between them the elements are
    /// interpolated linearly. Invertible at every time (see [`Affine::is_usable`]).
    pub keys: Vec<Affine>,
}

/// An affine map: three columns and the translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// Images of the axes.
    pub columns: [Vec3; 3],
    /// Image of the origin.
    pub translation: Vec3,
}

impl Affine {
    /// Leaves everything where it is.
    pub const IDENTITY: Self = Self { columns: [Vec3::X, Vec3::Y, Vec3::Z], translation: Vec3::ZERO };

    /// Where `p` goes. Plain IEEE operations in a fixed order.
    #[inline(always)]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.vector(p) + self.translation
    }

    /// Where the vector `v` goes.
    #[inline(always)]
    pub fn vector(&self, v: Vec3) -> Vec3 {
        self.columns[0] * v.x + self.columns[1] * v.y + self.columns[2] * v.z
    }

    /// The map between `self` (`s` = 0) and `other` (`s` = 1), by elements; exactly `self` where both are equal.
    pub fn lerp(&self, other: &Self, s: f32) -> Self {
        let mix = |a: Vec3, b: Vec3| a + (b - a) * s;
        Self {
            columns: [0, 1, 2].map(|i| mix(self.columns[i], other.columns[i])),
            translation: mix(self.translation, other.translation),
        }
    }

    /// The inverse, by cofactors in f64; `None` where it has elements that f32 cannot hold.
    pub fn inverse(&self) -> Option<Self> {
        let [x, y, z] = self.columns.map(Vec3::as_dvec3);
        let determinant = x.dot(y.cross(z));
        let rows = [y.cross(z), z.cross(x), x.cross(y)].map(|row| row / determinant);
        let inverse = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        let translation = -(inverse * self.translation.as_dvec3());
        let inverse = Self {
            columns: [inverse.x_axis, inverse.y_axis, inverse.z_axis].map(DVec3::as_vec3),
            translation: translation.as_vec3(),
        };
        inverse.is_finite().then_some(inverse)
    }

    /// Whether it can be inverted in f32: the inverse is finite, and so are the cofactors and the determinant on the way,
    /// which must not be below the least normal number either. Embree inverts so, and all backends must leave out the same
    /// placements. Of uniform scales those from 2.3e-13 to 6.9e12 are usable.
    pub fn is_usable(&self) -> bool {
        let [x, y, z] = self.columns.map(Vec3::as_dvec3);
        let cofactors = [y.cross(z), z.cross(x), x.cross(y)];
        let (least, most) = (f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX));
        // Written so that NaN is refused.
        let fits = cofactors.iter().all(|row| row.abs().max_element() <= most);
        self.is_finite() && fits && (least..=most).contains(&x.dot(cofactors[0]).abs()) && self.inverse().is_some()
    }

    fn is_finite(&self) -> bool {
        self.columns.iter().all(|c| c.is_finite()) && self.translation.is_finite()
    }
}

impl Placement {
    /// Whether it is usable at every key; where not, all backends leave it out.
    pub fn is_usable(&self) -> bool {
        self.keys.iter().all(Affine::is_usable)
    }

    /// Whether it moves.
    pub fn moves(&self) -> bool {
        self.keys.len() > 1
    }

    /// The map at `time` in [0, 1].
    pub fn at(&self, time: f32) -> Affine {
        Self::map_at(&self.keys, time)
    }

    /// The map of `keys` (at least one) at `time` in [0, 1].
    pub fn map_at(keys: &[Affine], time: f32) -> Affine {
        match keys {
            [only] => *only,
            keys => {
                let (k, s) = segment(keys.len(), time);
                keys[k].lerp(&keys[k + 1], s)
            }
        }
    }
}

/// The segment between two of `keys` (at least two) keys in which `time` lies, and where in it, in [0, 1].
#[inline(always)]
pub fn segment(keys: usize, time: f32) -> (usize, f32) {
    let at = time.clamp(0.0, 1.0) * (keys - 1) as f32;
    let k = (at as usize).min(keys - 2);
    (k, at - k as f32)
}

/// A ray and one crossing of it with a filtered triangle or shape.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// The ray's [`key`](super::RayBatch::key).
    pub key: u32,
    /// 0 for the world, i + 1 for placement i.
    pub instance: u32,
    /// Primitive number.
    pub primitive: u32,
    /// Barycentric weight of the second vertex; of a shape its first surface parameter.
    pub u: f32,
    /// Barycentric weight of the third vertex; of a shape its second surface parameter.
    pub v: f32,
}

/// Decides which crossings with filtered triangles and shapes are hits: surfaces that are not all there. A pure function, since every
/// backend asks in another order and about other crossings.
pub trait HitFilter: Send + Sync {
    /// Whether the ray is stopped there.
    fn stops(&self, candidate: &Candidate) -> bool;
}

/// A ray in an exact shape's space.
#[derive(Clone, Copy, Debug)]
pub struct ShapeRay {
    /// Origin.
    pub origin: Vec3,
    /// Direction of any length but 0; t counts in its lengths.
    pub direction: Vec3,
    /// End of the ray.
    pub t_max: f32,
    /// In [0, 1].
    pub time: f32,
}

/// Where a ray meets an exact shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeHit {
    /// In (0, `t_max`).
    pub t: f32,
    /// First surface parameter.
    pub u: f32,
    /// Second surface parameter.
    pub v: f32,
}

/// Something that is no triangle mesh.
pub trait Shape: Send + Sync {
    /// Low and high corner of what it occupies at any time.
    fn bounds(&self) -> [[f32; 3]; 2];

    /// The nearest crossing with t in (0, `t_max`).
    fn intersect(&self, ray: &ShapeRay) -> Option<ShapeHit>;

    /// Whether there is any; must agree with [`Shape::intersect`].
    fn occludes(&self, ray: &ShapeRay) -> bool {
        self.intersect(ray).is_some()
    }

    /// Whether the geometry's filter is asked about its crossings.
    fn is_filtered(&self) -> bool {
        false
    }

    /// The nearest crossing with t in (0, `t_max`) that `stops` the ray; asked of what is filtered. Whoever has more than
    /// one crossing and is filtered must look at all of them.
    fn intersect_where(&self, ray: &ShapeRay, stops: &mut dyn FnMut(&ShapeHit) -> bool) -> Option<ShapeHit> {
        self.intersect(ray).filter(|hit| stops(hit))
    }
}

/// A ray at a shape, as a filter knows it.
#[derive(Clone, Copy)]
pub struct AtShape<'a> {
    /// The shape.
    pub shape: &'a dyn Shape,
    /// Its primitive number.
    pub primitive: u32,
    /// 0 for the world, i + 1 for placement i.
    pub instance: u32,
    /// The ray's [`key`](super::RayBatch::key).
    pub key: u32,
    /// Decides about hits on what is filtered; without one nothing stops there.
    pub filter: Option<&'a dyn HitFilter>,
}

impl AtShape<'_> {
    /// The nearest crossing that counts.
    pub fn intersect(&self, ray: &ShapeRay) -> Option<ShapeHit> {
        if !self.shape.is_filtered() {
            return self.shape.intersect(ray);
        }
        let &Self { primitive, instance, key, filter, .. } = self;
        let filter = filter?;
        let stops = &mut |hit: &ShapeHit| filter.stops(&Candidate { key, instance, primitive, u: hit.u, v: hit.v });
        self.shape.intersect_where(ray, stops)
    }

    /// Whether there is any crossing that counts.
    pub fn occludes(&self, ray: &ShapeRay) -> bool {
        if self.shape.is_filtered() { self.intersect(ray).is_some() } else { self.shape.occludes(ray) }
    }
}

impl From<Triangles> for Part {
    fn from(triangles: Triangles) -> Self {
        Self { triangles, ..Self::default() }
    }
}

impl From<&Triangles> for Geometry {
    fn from(triangles: &Triangles) -> Self {
        triangles.clone().into()
    }
}

impl From<Triangles> for Geometry {
    fn from(triangles: Triangles) -> Self {
        Self { world: Object { parts: vec![triangles.into()], shapes: Vec::new() }, ..Self::default() }
    }
}

impl Part {
    /// The corners of triangle `i` at `time` in [0, 1]; exactly those of time 0 where it does not move.
    pub fn corners_at(&self, i: usize, time: f32) -> [Vec3; 3] {
        let start = self.triangles.corners(i);
        if self.later.is_empty() {
            return start;
        }
        let (k, s) = segment(self.later.len() + 1, time);
        let before = if k == 0 { start } else { self.corners_of_key(k, i) };
        let after = self.corners_of_key(k + 1, i);
        [0, 1, 2].map(|c| before[c] + (after[c] - before[c]) * s)
    }

    /// The corners of triangle `i` at key `k`.
    pub fn corners_of_key(&self, k: usize, i: usize) -> [Vec3; 3] {
        if k == 0 {
            return self.triangles.corners(i);
        }
        self.triangles.indices[i].map(|v| Vec3::from_array(self.later[k - 1][v as usize]))
    }

    /// Times at which vertices are given: 1 for what does not move.
    pub fn keys(&self) -> usize {
        1 + self.later.len()
    }
}

impl Object {
    /// Low and high corner of everything at every time; `None` if there is nothing.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let mut bounds: Option<[Vec3; 2]> = None;
        let mut add = |p: Vec3| {
            let [low, high] = bounds.get_or_insert([p; 2]);
            (*low, *high) = (low.min(p), high.max(p));
        };
        for part in &self.parts {
            part.triangles.positions_in_use().for_each(&mut add);
            for later in &part.later {
                part.triangles.indices.as_flattened().iter().for_each(|&v| add(Vec3::from_array(later[v as usize])));
            }
        }
        for (shape, _) in &self.shapes {
            shape.bounds().map(Vec3::from_array).into_iter().for_each(&mut add);
        }
        bounds
    }
}

impl Placement {
    /// Low and high corner, in the prepared space, of an object with the bounds `object` over all times; rounded
    /// outwards.
    pub fn bounds(&self, object: [Vec3; 2]) -> [Vec3; 2] {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for key in &self.keys {
            for corner in 0..8 {
                let pick = |axis: usize| object[corner >> axis & 1][axis];
                let p = key.point(Vec3::new(pick(0), pick(1), pick(2)));
                (low, high) = (low.min(p), high.max(p));
            }
        }
        // Four roundings of terms up to the largest of them; elements are interpolated linearly, so corners between keys
        // lie between their places at the keys.
        let size = |key: &Affine| {
            let extent = object[0].abs().max(object[1].abs());
            (0..3).fold(key.translation.abs(), |sum, i| sum + key.columns[i].abs() * extent[i])
        };
        let pad = self.keys.iter().map(size).fold(Vec3::ZERO, Vec3::max) * (8.0 * f32::EPSILON);
        [(low - pad).map(f32::next_down), (high + pad).map(f32::next_up)]
    }
}

impl Geometry {
    /// Low and high corner of everything at every time; `None` if there is nothing.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let objects: Vec<_> = self.objects.iter().map(Object::bounds).collect();
        let placed = self.placements.iter().filter_map(|p| Some(p.bounds(objects[p.object as usize]?)));
        self.world.bounds().into_iter().chain(placed).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// Placements that all backends leave out.
    pub fn unusable_placements(&self) -> usize {
        self.placements.iter().filter(|placement| !placement.is_usable()).count()
    }

    /// Triangles held, each object once.
    pub fn triangle_count(&self) -> usize {
        let of = |object: &Object| object.parts.iter().map(|part| part.triangles.indices.len()).sum::<usize>();
        of(&self.world) + self.objects.iter().map(of).sum::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_listed_only_where_they_are_not_consecutive() {
        let numbered = |all: &[u32]| {
            let mut numbers = Primitives::default();
            all.iter().enumerate().for_each(|(i, &number)| numbers.push(i, number));
            assert!(all.iter().enumerate().all(|(i, &number)| numbers.get(i) == number), "{numbers:?}");
            matches!(numbers, Primitives::From(_))
        };
        assert!(numbered(&[7, 8, 9]));
        assert!(!numbered(&[7, 8, 10, 11, 20]));
    }

    #[test]
    fn times_fall_into_the_segment_between_their_keys() {
        assert_eq!(segment(2, 0.0), (0, 0.0));
        assert_eq!(segment(2, 1.0), (0, 1.0));
        assert_eq!(segment(3, 0.5), (1, 0.0));
        assert_eq!(segment(3, 0.75), (1, 0.5));
        assert_eq!(segment(5, 7.0), (3, 1.0));
        assert_eq!(segment(5, f32::NAN.max(0.0)), (0, 0.0));
    }

    #[test]
    fn an_inverse_undoes_its_map_and_a_singular_map_has_none() {
        let map = Affine {
            columns: [Vec3::new(1.0, 2.0, 0.0), Vec3::new(0.0, -3.0, 1.0), Vec3::new(0.5, 0.0, 2.0)],
            translation: Vec3::new(10.0, -20.0, 5.0),
        };
        let p = Vec3::new(0.3, -0.7, 4.0);
        assert!((map.inverse().unwrap().point(map.point(p)) - p).length() < 1e-5);
        let flat = Affine { columns: [Vec3::X, Vec3::Y, Vec3::X + Vec3::Y], translation: Vec3::ZERO };
        assert!(!flat.is_usable());
        let scaled = |s: f32| Affine { columns: [Vec3::X * s, Vec3::Y * s, Vec3::Z * s], translation: Vec3::ONE };
        assert!([2.3e-13, -1e-12, 1.0, 6.9e12].map(scaled).iter().all(Affine::is_usable));
        assert!(![2.2e-13, -1e-14, 0.0, 7.1e12, -1e14].map(scaled).iter().any(Affine::is_usable));
        // The determinant is 1e-9, but the origin goes to 1e38 / 1e-9.
        assert!(!Affine { translation: Vec3::X * 1e38, ..scaled(1e-3) }.is_usable());
    }

    #[test]
    fn what_has_equal_keys_stands_exactly_still() {
        let map = Affine { columns: [Vec3::X * 0.1, Vec3::Y * 0.7, Vec3::Z * 1.3], translation: Vec3::splat(0.3) };
        let placement = Placement { object: 0, keys: vec![map, map, map] };
        for i in 0..100 {
            assert_eq!(placement.at(i as f32 / 99.0), map);
        }
    }
}
