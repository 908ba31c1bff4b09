//! Exact shapes of a prepared scene: what rays meet, and what shading reads of where they met it.
//!
//! A shape knows where it is by itself, in f64, so nothing is placed and no ray is rounded on its way to a shape's space.
//! In the triangle table each has one record (material, light, whether it has tangents); the primitive numbers of shapes lie
//! above those of triangles. Hits have s along the profile and the turn for u and v, and the point of these is the point
//! that is shaded: on the surface but for the rounding to f32.

use super::line::{Any, Crossing, Line, Nearest};
use super::{ExactShape, OnShape};
use crate::math::robust::gamma;
use crate::shape::placement::{cofactor, scaled};
use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3};
use simd::{Lanes, Uint};
use std::sync::Arc;

/// A shape where it is.
#[derive(Clone, Debug)]
pub struct PlacedShape {
    shape: Arc<ExactShape>,
    /// Prepared space from the shape's units at evenly spaced times over [0, 1], never empty; between them the elements
    /// are interpolated linearly.
    keys: Vec<DAffine3>,
    /// Inverse of the first.
    unit_from_prepared: DAffine3,
    /// Whether some rays pass it.
    pub is_filtered: bool,
    /// Derivatives by the coordinates that tangents run along, in terms of those by the texture coordinates: columns.
    along: [[f64; 2]; 2],
}

/// A ray that may meet a shape: origin and direction (any length) in the prepared space, t in (0, `t_max`).
#[derive(Clone, Copy, Debug)]
pub struct ShapeLine {
    /// Metres.
    pub origin: Vec3,
    /// Of any length.
    pub direction: Vec3,
    /// End.
    pub t_max: f32,
    /// In [0, 1].
    pub time: f32,
}

/// What of a point of a shape is shaded, prepared space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapePoint {
    /// Metres.
    pub p: Vec3,
    /// Unit normal of the front.
    pub ng: Vec3,
    /// Derivative by the first of the coordinates that tangents run along.
    pub du: Vec3,
    /// By the second of these, of such a length that `du x dv` is the area of a unit of texture coordinates.
    pub dv: Vec3,
    /// Texture coordinates, v = 0 at the end of the profile.
    pub uv: [f32; 2],
    /// How far rays that leave are moved off, metres.
    pub offset: f32,
}

/// A shape's own rounding, in its size: what f64 makes of F, with room.
const RESIDUAL: f64 = 1e-11;

impl PlacedShape {
    /// Placed at every time as `keys` say: prepared space from its object's.
    pub fn new(shape: Arc<ExactShape>, keys: impl IntoIterator<Item = DMat4>) -> Self {
        let unit = shape.object_from_unit();
        let keys: Vec<DAffine3> = keys.into_iter().map(|map| DAffine3::from_mat4(map * unit)).collect();
        let unit_from_prepared = keys[0].inverse();
        Self { shape, keys, unit_from_prepared, is_filtered: false, along: [[1.0, 0.0], [0.0, 1.0]] }
    }

    /// Has its tangents run along `m` (rows) times the texture coordinates, as a normal map's transform has it.
    pub fn set_tangents(&mut self, m: [[f64; 2]; 2]) {
        let det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
        if det != 0.0 && det.is_finite() {
            let side = det.signum();
            self.along = [[m[1][1] / det, -m[1][0] / det], [-m[0][1] * side, m[0][0] * side]];
        }
    }

    /// The shape.
    pub fn shape(&self) -> &ExactShape {
        &self.shape
    }

    /// Whether it moves.
    pub fn moves(&self) -> bool {
        self.keys.len() > 1
    }

    /// Prepared space from units.
    fn map(&self, time: f32) -> DAffine3 {
        let last = self.keys.len() - 1;
        if last == 0 {
            return self.keys[0];
        }
        let along = f64::from(time.clamp(0.0, 1.0)) * last as f64;
        let k = (along as usize).min(last - 1);
        let (a, b, s) = (self.keys[k], self.keys[k + 1], along - k as f64);
        let mix = |a: DVec3, b: DVec3| a + (b - a) * s;
        DAffine3 {
            matrix3: DMat3::from_cols(
                mix(a.matrix3.x_axis, b.matrix3.x_axis),
                mix(a.matrix3.y_axis, b.matrix3.y_axis),
                mix(a.matrix3.z_axis, b.matrix3.z_axis),
            ),
            translation: mix(a.translation, b.translation),
        }
    }

    /// Low and high corner of what it occupies at any time, prepared space, rounded outwards.
    pub fn bounds(&self) -> [Vec3; 2] {
        let of = |key: &DAffine3| self.shape.bounds(&DMat4::from(*key));
        // Between keys each point is between its places at the keys.
        let join = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
        let (low, high) = self.keys.iter().map(of).reduce(join).unwrap_or_default();
        let room = (high - low).max_element() * RESIDUAL;
        [(low - room).as_vec3().map(f32::next_down), (high + room).as_vec3().map(f32::next_up)]
    }

    #[inline(always)]
    fn line(&self, ray: &ShapeLine) -> Option<Line> {
        let map = if self.moves() { self.map(ray.time).inverse() } else { self.unit_from_prepared };
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        Line::new(map.transform_point3(o), map.transform_vector3(d))
    }

    /// The nearest crossing: t, s and turn.
    pub fn nearest(&self, ray: &ShapeLine) -> Option<[f32; 3]> {
        self.nearest_of(ray, |_, _| true)
    }

    /// The nearest crossing that `stops` the ray: t, s and turn.
    pub fn nearest_where(&self, ray: &ShapeLine, stops: &mut dyn FnMut([f32; 3]) -> bool) -> Option<[f32; 3]> {
        self.nearest_of(ray, |line, crossing| stops(self.parameters(line, crossing)))
    }

    #[inline(always)]
    fn nearest_of(&self, ray: &ShapeLine, mut stops: impl FnMut(&Line, &Crossing) -> bool) -> Option<[f32; 3]> {
        let line = self.line(ray)?;
        let mut nearest = Nearest::new(&line, ray.t_max, |crossing: &Crossing| stops(&line, crossing));
        self.shape.crossings(&line, line.range(ray.t_max)[0], &mut nearest);
        let found = nearest.found?;
        Some(self.parameters(&line, &found))
    }

    /// Whether there is any crossing that stops the ray.
    pub fn any(&self, ray: &ShapeLine) -> bool {
        let Some(line) = self.line(ray) else { return false };
        let mut any = Any::new(&line, ray.t_max, |_: &Crossing| true);
        self.shape.crossings(&line, line.range(ray.t_max)[0], &mut any);
        any.found
    }

    #[inline(always)]
    fn parameters(&self, line: &Line, crossing: &Crossing) -> [f32; 3] {
        [line.t(crossing.at), self.shape.parameter(line, crossing), ExactShape::turn(line, crossing)]
    }

    /// What is shaded at the parameters of a hit.
    pub fn point(&self, s: f32, turn: f32, time: f32) -> ShapePoint {
        let OnShape { p, du, dv, n } = self.shape.point(f64::from(s), f64::from(turn));
        let map = self.map(time);
        let linear = scaled(map.matrix3);
        let side = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        let ng = ((cofactor(linear) * n) * side).normalize_or_zero();
        let p = map.transform_point3(p);
        let (du, dv) = (map.matrix3 * du, map.matrix3 * dv);
        let [[a, b], [c, d]] = self.along;
        // The point is rounded to f32, and so is what is added to it: that is half of this. A ray from there meets the
        // surface as f64 has it.
        let columns = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
        let size = columns.iter().fold(0.0, |most: f64, c| most.max(c.abs().max_element()));
        let offset = ng.abs().element_sum() * (p.abs().max_element() * f64::from(gamma(6)) + size * RESIDUAL);
        ShapePoint {
            p: p.as_vec3(),
            // + 0 turns -0 into 0: the frame about a normal depends on the sign.
            ng: ng.as_vec3() + Vec3::ZERO,
            du: (du * a + dv * b).as_vec3(),
            dv: (du * c + dv * d).as_vec3(),
            uv: texture_coordinates(s, turn),
            offset: offset as f32,
        }
    }
}

/// Texture coordinates of the parameters of a hit.
#[inline(always)]
pub fn texture_coordinates(s: f32, turn: f32) -> [f32; 2] {
    [turn, 1.0 - s]
}

/// The shapes of a prepared scene by their primitive numbers.
#[derive(Clone, Debug, Default)]
pub struct ShapeTable {
    first: u32,
    shapes: Vec<Arc<PlacedShape>>,
    moves: bool,
}

impl ShapeTable {
    /// Numbered from `first` on.
    pub fn new(first: u32, shapes: Vec<Arc<PlacedShape>>) -> Self {
        let moves = shapes.iter().any(|shape| shape.moves());
        Self { first, shapes, moves }
    }

    /// Some of them move.
    pub fn moves(&self) -> bool {
        self.moves
    }

    /// No shape at all: nobody need ask further.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// Shapes.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// The shapes with their numbers.
    pub fn numbered(&self) -> impl Iterator<Item = (&Arc<PlacedShape>, u32)> {
        self.shapes.iter().zip(self.first..)
    }

    /// The shape of a primitive number, if it is one's.
    #[inline(always)]
    pub fn get(&self, primitive: u32) -> Option<&PlacedShape> {
        self.shapes.get(primitive.checked_sub(self.first)? as usize).map(|shape| &**shape)
    }

    /// Those of the lanes `hit` that hit shapes.
    #[inline(always)]
    pub fn lanes<L: Lanes>(&self, primitive: L::U, hit: L::M) -> L::M {
        hit & !primitive.lt(L::U::splat(self.first))
    }
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
