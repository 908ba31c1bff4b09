//! A ray as f64 sees it, and how far from there an f32 backend may see it.

use crate::accel::geometry::Affine;
use glam::{DMat3, DVec3};

/// Unit round-off of f32.
pub const EPS: f64 = 1.0 / (1 << 24) as f64;

/// Error of a corner's place across a ray, in shares of its distance from the origin. `accel/woop.rs` subtracts the origin
/// (1 rounding), shears (4, of terms no longer than the distance) and adds (1): at most 6 eps a coordinate, 8.5 in the
/// plane. Embree's Pluecker test has products of the same lengths with about 10. Both are doubled at most.
const ACROSS: f64 = 16.0 * EPS;

/// A ray in one space, its axes permuted and sheared as `accel/woop.rs` has them, but in f64.
#[derive(Clone, Copy, Debug)]
pub struct ExactRay {
    /// Origin.
    pub origin: DVec3,
    /// Direction of any length but 0.
    pub direction: DVec3,
    /// End, in lengths of the direction.
    pub t_max: f64,
    /// Shutter time in [0, 1].
    pub time: f64,
    /// What filters know it by.
    pub key: u32,
    /// Which axes became x, y, z.
    axes: [usize; 3],
    shear: [f64; 2],
    /// How far off the origin may be, metres: 0 in the world.
    origin_error: f64,
    /// How far off the direction may be, in shares of its length: 0 in the world.
    direction_error: f64,
}

/// A point relative to a ray.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Across the ray, sheared; the ray is at the origin. Metres.
    pub x: f64,
    /// As `x`.
    pub y: f64,
    /// Along the ray, in lengths of the direction.
    pub t: f64,
    /// How far a backend's x and y may be from these, metres.
    pub across: f64,
    /// How far a backend's `t` may be from this, because the ray is (not because of roundings along it).
    pub along: f64,
}

impl ExactRay {
    /// The ray, exactly. The direction is finite and not zero.
    pub fn new(origin: DVec3, direction: DVec3, t_max: f64, time: f64, key: u32) -> Self {
        let a = direction.abs();
        let kz = if a.x >= a.y && a.x >= a.z {
            0
        } else if a.y >= a.z {
            1
        } else {
            2
        };
        let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
        Self {
            origin,
            direction,
            t_max,
            time,
            key,
            axes: [kx, ky, kz],
            shear: [direction[kx] / direction[kz], direction[ky] / direction[kz]],
            origin_error: 0.0,
            direction_error: 0.0,
        }
    }

    /// The ray in the space of an object that is placed by `world_from_object` (with relative errors of `moving` of its
    /// elements); `None` if that cannot be inverted. Bounds what becomes of it by an inverse in f32.
    pub fn into_object(self, world_from_object: &Map, moving: f64) -> Option<Self> {
        let Map { linear, translation } = *world_from_object;
        let determinant = linear.determinant();
        let object_from_world = linear.inverse();
        if determinant == 0.0 || !object_from_world.is_finite() {
            return None;
        }
        // Absolute values of all products in cofactors and determinant: what roundings are relative to.
        let size = DMat3::from_cols(linear.x_axis.abs(), linear.y_axis.abs(), linear.z_axis.abs());
        let [x, y, z] = [size.x_axis, size.y_axis, size.z_axis];
        let rows = [plus_cross(y, z), plus_cross(z, x), plus_cross(x, y)].map(|row| row / determinant.abs());
        let cofactors = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        let permanent = x.dot(plus_cross(y, z)) / determinant.abs();
        let inverse_size = abs(&object_from_world);
        // Cofactors, division by the determinant, and what the map's own errors do to the inverse.
        let error = cofactors * (4.0 * EPS)
            + inverse_size * ((8.0 * permanent + 4.0) * EPS)
            + inverse_size * size * inverse_size * moving;
        let reach = self.origin.abs() + translation.abs();
        let origin_error = error * reach + inverse_size * (reach * (4.0 * EPS) + translation.abs() * moving);
        let direction = object_from_world * self.direction;
        let direction_error = error * self.direction.abs() + inverse_size * self.direction.abs() * (4.0 * EPS);
        let origin = object_from_world * (self.origin - translation);
        if !(origin.is_finite() && direction.is_finite() && direction != DVec3::ZERO) {
            return None;
        }
        let ray = Self::new(origin, direction, self.t_max, self.time, self.key);
        Some(Self {
            origin_error: origin_error.length() + EPS * origin.length(),
            direction_error: direction_error.length() / direction.length() + EPS,
            ..ray
        })
    }

    /// Where `p`, itself known within `error` metres, is seen.
    pub fn see(&self, p: DVec3, error: f64) -> Seen {
        let r = p - self.origin;
        let [kx, ky, kz] = self.axes;
        let own = self.origin_error + self.direction_error * r.length() + error;
        Seen {
            x: r[kx] - self.shear[0] * r[kz],
            y: r[ky] - self.shear[1] * r[kz],
            t: r[kz] / self.direction[kz],
            // A distance across the ray is at most sqrt(3) times as long once sheared.
            across: ACROSS * r.length() + 1.8 * own + f64::from(f32::MIN_POSITIVE),
            along: own / self.direction[kz].abs(),
        }
    }

    /// Bound of `across` for points within a box, which is that of its furthest corner.
    pub fn widening(&self, low: DVec3, high: DVec3, error: f64) -> f64 {
        let furthest = (low - self.origin).abs().max((high - self.origin).abs()).length();
        (ACROSS + 1.8 * self.direction_error) * furthest
            + 1.8 * (self.origin_error + error)
            + f64::from(f32::MIN_POSITIVE)
    }
}

/// An affine map in f64.
#[derive(Clone, Copy, Debug)]
pub struct Map {
    /// Images of the axes.
    pub linear: DMat3,
    /// Image of the origin.
    pub translation: DVec3,
}

impl Map {
    /// Between two maps, by elements.
    pub fn between(a: &Affine, b: &Affine, s: f64) -> Self {
        let column = |i: usize| a.columns[i].as_dvec3().lerp(b.columns[i].as_dvec3(), s);
        Self {
            linear: DMat3::from_cols(column(0), column(1), column(2)),
            translation: a.translation.as_dvec3().lerp(b.translation.as_dvec3(), s),
        }
    }
}

fn abs(m: &DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

/// The cross product with plus in place of minus.
fn plus_cross(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x)
}
