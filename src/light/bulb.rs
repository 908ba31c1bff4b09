//! Glowing balls and what is much like one: closed, convex, the fronts outside, and most of its bounding sphere.
//!
//! Half of a bulb's surface faces away from any point, and the rest is seen at all slopes: a direction towards its bounding
//! sphere, each as likely, is a better sample than a point on it. The light is what the ray hits, if that is the bulb: no
//! direction leads to two of its points that shine, so the density of a direction is that of the point.

use super::element::LampTriangle;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::f64::consts::PI;

/// Least share of the bounding sphere's outline that a bulb fills on average: 0.76 an icosahedron, 0.64 a cube.
const LEAST_FILLED: f64 = 0.75;
/// Triangles of a bulb at most: while it is looked at each takes 200 bytes.
const MOST: usize = 1 << 16;
/// Corners may be this far above a neighbour's plane, in radii: what f32 makes of a sphere's small triangles.
const FLAT: f64 = 1e-5;
/// Corners this near are one, in radii.
const SEAM: f64 = 1e-5;
/// By how much the sphere is taken larger, for the rounding of f32.
const SLACK: f64 = 1e-5;

/// The sphere around a bulb, in the prepared space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bulb {
    /// Metres.
    pub centre: Vec3,
    /// Metres, above 0.
    pub radius: f64,
}

impl Bulb {
    /// The bulb that connected triangles make, if they make one.
    pub fn of(lamps: &[LampTriangle]) -> Option<Self> {
        // A tetrahedron at least.
        if !(4..=MOST).contains(&lamps.len()) {
            return None;
        }
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for corner in lamps.iter().flat_map(|lamp| lamp.corners) {
            (low, high) = (low.min(corner), high.max(corner));
        }
        let centre = 0.5 * (low + high);
        let c = centre.as_dvec3();
        let distances = lamps.iter().flat_map(|lamp| lamp.corners).map(|corner| (corner.as_dvec3() - c).length());
        let radius = distances.fold(0.0, f64::max) * (1.0 + SLACK);
        let area: f64 = lamps.iter().map(|lamp| lamp.area).sum();
        // A convex solid's outline is a quarter of its surface on average.
        let is_round = 0.25 * area >= LEAST_FILLED * PI * radius * radius;
        (is_round && is_convex(lamps, c, radius)).then_some(Self { centre, radius })
    }
}

/// Whether the triangles are the surface of a convex solid around `centre`, fronts outwards: each edge has a triangle on
/// either side, neither bends inwards there, and seen from the centre they go round it once.
fn is_convex(lamps: &[LampTriangle], centre: DVec3, radius: f64) -> bool {
    // Cells of a grid: what exporters make of a seam or a pole is one corner.
    let place = |corner: Vec3| ((corner.as_dvec3() - centre) / (SEAM * radius)).round().to_array().map(|v| v as i32);
    // From an edge, walked as its triangle has it, to the corner opposite.
    let mut opposite: HashMap<[[i32; 3]; 2], Vec3> = HashMap::with_capacity(3 * lamps.len());
    let mut solid_angle = 0.0;
    for lamp in lamps {
        let [a, b, c] = lamp.corners.map(|corner| corner.as_dvec3() - centre);
        let volume = a.dot(b.cross(c));
        if volume <= 0.0 {
            return false;
        }
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        solid_angle += 2.0 * volume.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
        for i in 0..3 {
            let [from, to, other] = [0, 1, 2].map(|k| lamp.corners[(i + k) % 3]);
            if opposite.insert([place(from), place(to)], other).is_some() {
                return false;
            }
        }
    }
    let bends_outwards = |lamp: &LampTriangle| {
        let [a, b, c] = lamp.corners.map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        (0..3).all(|i| {
            let edge = [lamp.corners[(i + 1) % 3], lamp.corners[i]].map(place);
            opposite.get(&edge).is_some_and(|other| (other.as_dvec3() - a).dot(normal) <= FLAT * radius)
        })
    };
    (solid_angle - 4.0 * PI).abs() < 0.1 && lamps.iter().all(bends_outwards)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Rng;

    fn lamps(triangles: &[[Vec3; 3]]) -> Vec<LampTriangle> {
        let lamp = |(i, &corners): (usize, &[Vec3; 3])| {
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            let cross = (b - a).cross(c - a);
            let (area, ng) = (0.5 * cross.length(), cross.normalize().as_vec3());
            LampTriangle { corners, ng, area, primitive: i as u32, attributes: u32::MAX }
        };
        triangles.iter().enumerate().map(lamp).collect()
    }

    /// A ball of rings of triangles, `stretch` times as long as wide.
    fn ball(stretch: f32) -> Vec<[Vec3; 3]> {
        let (rows, columns) = (8, 12);
        let at = |row: usize, column: usize| {
            let (sin, cos) = (std::f32::consts::PI * row as f32 / rows as f32).sin_cos();
            let (s, c) = (std::f32::consts::TAU * (column % columns) as f32 / columns as f32).sin_cos();
            Vec3::new(0.3 + sin * c, 5.0 + stretch * cos, -2.0 + sin * s)
        };
        let mut triangles = Vec::new();
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let [a, b, c, d] = [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(r, k)| at(row + r, column + k));
            if row > 0 {
                triangles.push([a, b, c]);
            }
            if row + 1 < rows {
                triangles.push([a, c, d]);
            }
        }
        triangles
    }

    #[test]
    fn a_ball_in_any_order_is_a_bulb_in_its_sphere() {
        let mut triangles = ball(1.0);
        Rng::new(1).shuffle(&mut triangles);
        let bulb = Bulb::of(&lamps(&triangles)).expect("a bulb");
        assert!((bulb.centre - Vec3::new(0.3, 5.0, -2.0)).length() < 1e-6 && (bulb.radius - 1.0).abs() < 1e-4);
        assert!(Bulb::of(&lamps(&ball(1.2))).is_some(), "an egg");
    }

    #[test]
    fn what_is_open_dented_turned_long_or_wound_twice_is_no_bulb() {
        let whole = ball(1.0);
        let turned: Vec<_> = whole.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let mut dented = whole.clone();
        let tip = whole[20][0];
        for corner in dented.iter_mut().flatten().filter(|corner| **corner == tip) {
            *corner = tip.lerp(Vec3::new(0.3, 5.0, -2.0), 0.2);
        }
        let twice = [whole.clone(), ball(1.1)].concat();
        let cube: Vec<[Vec3; 3]> = (0..12)
            .map(|i| {
                let (axis, side, half) = (i / 4, i / 2 % 2, i % 2);
                let corner = |u: f32, v: f32| {
                    let mut p = [0.0; 3];
                    let flip = if side == 0 { [v, u] } else { [u, v] };
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side as f32, flip[0], flip[1]);
                    Vec3::from(p)
                };
                let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
                [corners[0], corners[1 + half], corners[2 + half]]
            })
            .collect();
        for (name, triangles) in [
            ("open", whole[1..].to_vec()),
            ("turned", turned),
            ("dented", dented),
            ("long", ball(2.0)),
            ("two in one", twice),
            ("cube", cube),
            ("a triangle", whole[..1].to_vec()),
        ] {
            assert_eq!(Bulb::of(&lamps(&triangles)), None, "{name}");
        }
    }
}
