//! Two glowing triangles that are a parallelogram: one square of numbers for all of it, not one for each half.

use super::element::LampTriangle;
use glam::Vec3;

/// The fourth corner may be off by this share of the shorter edge: then it is taken to be where it would be exactly.
const OFF: f32 = 1e-4;
/// And by this share of the largest coordinate, so that no point of it is behind the triangles by what rays keep off them.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// Cosine between edges that are at right angles.
const SQUARE: f32 = 1e-5;

/// A parallelogram with the corner `v0`, from which its edges go to either end of the diagonal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// Metres, prepared space.
    pub v0: Vec3,
    /// The triangle at `v0` is on its right side as on the front.
    pub e1: Vec3,
    /// To the other end.
    pub e2: Vec3,
    /// Attribute indices of the triangle at `v0` and of the one opposite.
    pub attributes: [u32; 2],
    /// Which of their corners is the one that is not on the diagonal.
    pub apex: [u32; 2],
}

impl Quad {
    /// One over the lengths of the edges where they are at right angles; else 0, as in `element.rs`.
    pub fn inverse_lengths(&self) -> [f32; 2] {
        let (l1, l2) = (self.e1.length(), self.e2.length());
        let inverse = [1.0 / l1, 1.0 / l2];
        let is_rectangle = self.e1.dot(self.e2).abs() <= SQUARE * l1 * l2 && inverse.iter().all(|i| i.is_normal());
        if is_rectangle { inverse } else { [0.0; 2] }
    }

    /// The parallelogram that connected triangles make, if they make one.
    pub fn of(lamps: &[LampTriangle]) -> Option<Self> {
        let [near, far] = lamps else { return None };
        let corner = |lamp: &LampTriangle, i: usize| lamp.corners[i % 3];
        for (i, k) in (0..3).flat_map(|i| (0..3).map(move |k| (i, k))) {
            let [v0, v1, v2] = [0, 1, 2].map(|step| corner(near, i + step));
            let [fourth, w1, w2] = [0, 1, 2].map(|step| corner(far, k + step));
            // The diagonal, walked the other way round.
            if v1 != w2 || v2 != w1 {
                continue;
            }
            let (e1, e2) = (v1 - v0, v2 - v0);
            let off = (fourth - (v1 + e2)).abs().max_element();
            let largest = [v0, v1, v2, fourth].iter().fold(0.0, |most: f32, v| most.max(v.abs().max_element()));
            let is_exact = off <= OFF * e1.length().min(e2.length()) && off <= ROUNDING * largest;
            let (attributes, apex) = ([near.attributes, far.attributes], [i as u32, k as u32]);
            return is_exact.then_some(Self { v0, e1, e2, attributes, apex });
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamps(triangles: [[[f32; 3]; 3]; 2]) -> Vec<LampTriangle> {
        let lamp = |(i, corners): (usize, [[f32; 3]; 3])| {
            let corners = corners.map(Vec3::from);
            let ng = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            LampTriangle { corners, ng, area: 1.0, primitive: i as u32, attributes: 10 + i as u32 }
        };
        triangles.into_iter().enumerate().map(lamp).collect()
    }

    #[test]
    fn halves_of_a_parallelogram_are_found_whatever_corner_comes_first() {
        let (a, b, d, c) = ([1.0, 5.0, 0.0], [3.0, 5.0, 0.5], [3.5, 5.0, 3.5], [1.5, 5.0, 3.0]);
        for (i, k) in (0..3).flat_map(|i| (0..3).map(move |k| (i, k))) {
            let (mut near, mut far) = ([a, b, c], [d, c, b]);
            near.rotate_right(i);
            far.rotate_right(k);
            let quad = Quad::of(&lamps([near, far])).expect("a parallelogram");
            assert_eq!(quad.v0 + quad.e1, Vec3::from(b));
            assert_eq!(quad.v0 + quad.e2, Vec3::from(c));
            assert_eq!((quad.apex, quad.attributes), ([i as u32, k as u32], [10, 11]));
        }
    }

    #[test]
    fn kites_folds_and_halves_that_face_apart_are_none() {
        let (a, b, d, c) = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]);
        assert!(Quad::of(&lamps([[a, b, c], [d, c, b]])).is_some());
        for (name, far) in [
            ("kite", [[1.2, 1.2, 0.0], c, b]),
            ("nearly", [[1.0, 1.0 + 2e-6, 0.0], c, b]),
            ("folded", [[1.0, 1.0, 0.1], c, b]),
            ("turned", [d, b, c]),
            ("apart", [d, [0.0, 1.5, 0.0], b]),
        ] {
            assert_eq!(Quad::of(&lamps([[a, b, c], far])), None, "{name}");
        }
        assert_eq!(Quad::of(&lamps([[a, b, c], [d, c, b]])[..1]), None);
        let square = Quad::of(&lamps([[a, b, c], [d, c, b]])).expect("a square");
        assert_eq!(square.inverse_lengths(), [1.0; 2]);
        let leaning = Quad { e2: Vec3::new(1e-4, 1.0, 0.0), ..square };
        assert_eq!(leaning.inverse_lengths(), [0.0; 2]);
    }
}
