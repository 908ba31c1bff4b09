//! Exact shapes: spheres, and profiles turned about the y axis. What a node of a scene may carry in place of its mesh.
//!
//! `profile` is what a file gives, `revolution` where a line meets it (`bernstein` has the polynomials), `line` a ray in a
//! shape's space; `table` what is placed in a prepared scene, for rays and for shading. All of it in f64: a ray is carried
//! to the shape's space as it is and loses nothing.
//!
//! Points of a shape have two parameters: s along the profile in [0, 1] (of a sphere the semicircle from its lowest point
//! to its highest), and the turn in [0, 1) counter-clockwise about +y seen from above, from +x on. The front is on the
//! right hand of who walks along the profile with the axis to the left: the outside, if it is listed from bottom to top.

pub mod bernstein;
pub mod line;
pub mod profile;
pub mod revolution;
pub mod table;

use glam::{DMat3, DMat4, DVec3};
use line::{Crossing, Line, Visit};
use profile::Profile;
use revolution::Revolution;
use std::f64::consts::{PI, TAU};

/// A shape in its object's space.
#[derive(Clone, Debug, PartialEq)]
pub enum ExactShape {
    /// About the origin.
    Sphere {
        /// Metres, above 0.
        radius: f64,
    },
    /// About the y axis.
    Revolution(Revolution),
}

/// A point of a shape, in units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnShape {
    /// Where it is.
    pub p: DVec3,
    /// Derivative by the first texture coordinate, the turn.
    pub du: DVec3,
    /// Derivative by the second texture coordinate, 1 - s.
    pub dv: DVec3,
    /// Unit normal of the front.
    pub n: DVec3,
}

/// Nearer to the axis than this, in units, a point is on it.
const ON_AXIS: f64 = 1e-12;
/// A derivative shorter than this has no direction.
const AT_REST: f64 = 1e-9;

impl ExactShape {
    /// Turned profile.
    pub fn revolution(profile: Profile) -> Self {
        Self::Revolution(Revolution::new(profile))
    }

    /// Object space from the space of units in which lines are met: about the middle, of about unit size.
    pub fn object_from_unit(&self) -> DMat4 {
        match self {
            Self::Sphere { radius } => DMat4::from_scale(DVec3::splat(*radius)),
            Self::Revolution(r) => {
                let Profile { middle, scale, .. } = *r.profile();
                DMat4::from_translation(DVec3::Y * middle) * DMat4::from_scale(DVec3::splat(scale))
            }
        }
    }

    /// Tells `visit` of all crossings from the place `start` on.
    #[inline(always)]
    pub fn crossings(&self, line: &Line, start: f64, visit: &mut impl Visit) {
        match self {
            Self::Sphere { .. } => cross_sphere(line, visit),
            Self::Revolution(revolution) => revolution.crossings(line, start, visit),
        }
    }

    /// The turn of a crossing, in [0, 1).
    #[inline(always)]
    pub fn turn(line: &Line, crossing: &Crossing) -> f32 {
        let p = line.point(crossing.at);
        let side = if crossing.is_beyond { -1.0 } else { 1.0 };
        let turn = (-p.z * side).atan2(p.x * side) / TAU;
        let turn = (if turn < 0.0 { turn + 1.0 } else { turn }) as f32;
        if turn < 1.0 { turn } else { 0.0 }
    }

    /// The point of parameter `s` along the profile and this turn.
    pub fn point(&self, s: f64, turn: f64) -> OnShape {
        let [r, y, dr, dy] = match self {
            Self::Sphere { .. } => {
                let (sin, cos) = (PI * s).sin_cos();
                [sin, -cos, PI * cos, PI * sin]
            }
            Self::Revolution(revolution) => along(revolution.profile(), s),
        };
        let (sin, cos) = (TAU * turn).sin_cos();
        let (out, round) = (DVec3::new(cos, 0.0, -sin), DVec3::new(-sin, 0.0, -cos));
        let is_pole = r.abs() < ON_AXIS && dr != 0.0;
        // At a tip there is no normal but the axis.
        let n = if is_pole { DVec3::NEG_Y * dr.signum() } else { out * dy - DVec3::Y * dr };
        // On the axis the turn still has a direction.
        let radius = if r.abs() < AT_REST { AT_REST.copysign(r) } else { r };
        OnShape {
            p: out * r + DVec3::Y * y,
            du: round * (TAU * radius),
            dv: -(out * dr + DVec3::Y * dy),
            n: n.try_normalize().unwrap_or(DVec3::Y),
        }
    }

    /// Low and high corner of what it is where `map` puts its units; not smaller, and hardly larger.
    pub fn bounds(&self, map: &DMat4) -> (DVec3, DVec3) {
        let centre = map.w_axis.truncate();
        let (x, y, z) = (map.x_axis.truncate(), map.y_axis.truncate(), map.z_axis.truncate());
        // How far each axis of the world is reached across the shape's axis, a unit.
        let across = DVec3::new(x.x.hypot(z.x), x.y.hypot(z.y), x.z.hypot(z.z));
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        let mut reach = |radius: f64, height: f64| {
            let (r, h) = (across * radius.abs(), y * height);
            low = low.min(h - r);
            high = high.max(h + r);
        };
        match self {
            Self::Sphere { .. } => {
                let half = DVec3::new(across.x.hypot(y.x), across.y.hypot(y.y), across.z.hypot(y.z));
                return (centre - half, centre + half);
            }
            // A curve is within its control points, and so is what is convex of them.
            Self::Revolution(revolution) => {
                for piece in &revolution.profile().pieces {
                    (0..4).for_each(|k| reach(piece.r[k], piece.y[k]));
                }
            }
        }
        (centre + low, centre + high)
    }

    /// Square metres where `linear` puts its units, to a hundredth.
    pub fn area(&self, linear: DMat3) -> f64 {
        let stretch = linear.x_axis.length();
        let is_uniform = [linear.y_axis, linear.z_axis].iter().all(|c| (c.length() - stretch).abs() <= 1e-9 * stretch)
            && linear.x_axis.dot(linear.y_axis).abs().max(linear.y_axis.dot(linear.z_axis).abs())
                <= 1e-9 * stretch * stretch;
        if let (Self::Sphere { .. }, true) = (self, is_uniform) {
            return 4.0 * PI * stretch * stretch;
        }
        let (rows, columns) = match self {
            Self::Sphere { .. } => (32, 16),
            Self::Revolution(r) => (2 * r.profile().pieces.len(), if is_uniform { 1 } else { 12 }),
        };
        let mut sum = 0.0;
        for row in 0..rows {
            for column in 0..columns {
                let here = self.point((row as f64 + 0.5) / rows as f64, column as f64 / columns as f64);
                sum += (linear * here.du).cross(linear * here.dv).length();
            }
        }
        sum / (rows * columns) as f64
    }

    /// Sum over the surface of area times normal, square units: that of the discs which would close it.
    pub fn vector_area(&self) -> DVec3 {
        match self {
            Self::Sphere { .. } => DVec3::ZERO,
            Self::Revolution(_) => {
                let radius = |s: f64| self.point(s, 0.0).p.x;
                DVec3::Y * (PI * (radius(0.0).powi(2) - radius(1.0).powi(2)))
            }
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Sphere { .. } => size_of::<Self>(),
            // A piece and two boxes.
            Self::Revolution(r) => size_of::<Self>() + r.profile().pieces.len() * (64 + 64),
        }
    }
}

/// The unit sphere. In f64 about the point nearest to its centre, so that neither distance nor size costs digits.
#[inline(always)]
fn cross_sphere(line: &Line, visit: &mut impl Visit) {
    let square = 1.0 - line.o.length_squared();
    if square <= 0.0 {
        return;
    }
    let half = square.sqrt();
    for at in [-half, half] {
        // Asked for by `ExactShape::parameter`: few crossings are hits.
        if visit.meet(Crossing { at, s: f64::NAN, is_beyond: false }) {
            return;
        }
    }
}

impl ExactShape {
    /// The parameter along the profile of a crossing.
    #[inline(always)]
    pub fn parameter(&self, line: &Line, crossing: &Crossing) -> f32 {
        match self {
            Self::Sphere { .. } => {
                let p = line.point(crossing.at);
                (p.x.hypot(p.z).atan2(-p.y) / PI) as f32
            }
            Self::Revolution(_) => crossing.s as f32,
        }
    }
}

/// Radius and height at `s`, and their derivatives or, where the curve stands still, directions.
fn along(profile: &Profile, s: f64) -> [f64; 4] {
    let (piece, u) = profile.locate(s);
    let ([r, dr], [y, dy]) = (bernstein::at(&piece.r, u), bernstein::at(&piece.y, u));
    let pieces = profile.pieces.len() as f64;
    if dr.abs().max(dy.abs()) > AT_REST {
        return [r, y, dr * pieces, dy * pieces];
    }
    // From where it comes to where it goes on; a point of control may be there twice or three times.
    let (a, b) = ((u - 1e-3).max(0.0), (u + 1e-3).min(1.0));
    let apart = |p: &bernstein::Cubic| bernstein::at(p, b)[0] - bernstein::at(p, a)[0];
    let (dr, dy) = (apart(&piece.r), apart(&piece.y));
    let length = dr.hypot(dy);
    if length > 0.0 { [r, y, dr / length, dy / length] } else { [r, y, 0.0, 1.0] }
}

#[cfg(test)]
#[path = "exact_tests.rs"]
mod tests;
