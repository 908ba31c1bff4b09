//! Triangles cut by axis-parallel planes: what remains of one in a box, exact to f64.

use glam::{DVec3, Vec3};

/// Corners at most. A triangle in a box has 9; rounding may add a few, and one that needs more is not cut further.
const MOST: usize = 14;

/// A convex part of a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    corners: [DVec3; MOST],
    count: usize,
}

impl Polygon {
    const EMPTY: Self = Self { corners: [DVec3::ZERO; MOST], count: 0 };

    /// All of a triangle.
    pub fn new(triangle: [Vec3; 3]) -> Self {
        let mut polygon = Self::EMPTY;
        for corner in triangle {
            polygon.push(corner.as_dvec3());
        }
        polygon
    }

    fn push(&mut self, corner: DVec3) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    /// Low and high corner of the box around it.
    pub fn bounds(&self) -> [DVec3; 2] {
        let corners = self.corners[..self.count].iter();
        corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)])
    }

    /// Both parts, what lies below `at` on `axis` first; together they are all of it. `None` if the plane leaves nothing
    /// on one side.
    pub fn cut(&self, axis: usize, at: f64) -> Option<[Self; 2]> {
        let corners = &self.corners[..self.count];
        let is_cut = corners.iter().any(|p| p[axis] < at) && corners.iter().any(|p| p[axis] > at);
        if !is_cut || self.count + 2 > MOST {
            return None;
        }
        let [mut below, mut above] = [Self::EMPTY; 2];
        for (i, &from) in corners.iter().enumerate() {
            let to = corners[(i + 1) % self.count];
            if from[axis] <= at {
                below.push(from);
            }
            if from[axis] >= at {
                above.push(from);
            }
            if (from[axis] < at && at < to[axis]) || (to[axis] < at && at < from[axis]) {
                // From the lower end, so that neighbours agree about the edge that they share.
                let (a, b) = if from[axis] < to[axis] { (from, to) } else { (to, from) };
                let mut p = a + (b - a) * ((at - a[axis]) / (b[axis] - a[axis]));
                p[axis] = at;
                below.push(p);
                above.push(p);
            }
        }
        Some([below, above])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygon: &Polygon) -> f64 {
        let corners = &polygon.corners[..polygon.count];
        let fan = corners.windows(2).skip(1).map(|pair| (pair[0] - corners[0]).cross(pair[1] - corners[0]));
        0.5 * fan.sum::<DVec3>().length()
    }

    /// Cuts and cuts again at `planes`, and checks that nothing is lost and that both sides are on their sides.
    fn assert_kept(polygon: &Polygon, planes: &[(usize, f64)]) {
        let Some((&(axis, at), others)) = planes.split_first() else { return };
        let [low, high] = polygon.bounds();
        let Some(sides) = polygon.cut(axis, at) else {
            assert!(at <= low[axis] || at >= high[axis], "{at} is inside {low} to {high}");
            return assert_kept(polygon, others);
        };
        assert!(sides[0].bounds()[1][axis] == at && sides[1].bounds()[0][axis] == at);
        let (whole, parts) = (area(polygon), area(&sides[0]) + area(&sides[1]));
        assert!((whole - parts).abs() <= 1e-13 * whole.max(1.0), "{whole} became {parts}");
        for side in &sides {
            let [l, h] = side.bounds();
            assert!(low.cmple(l).all() && h.cmple(high).all() && l.cmple(h).all(), "{side:?} is outside {polygon:?}");
            assert_kept(side, others);
        }
    }

    #[test]
    fn bvh06_no_part_of_a_triangle_vanishes_at_a_plane() {
        // Embree's own regression: coordinates where its splits once lost a primitive from both children.
        let numbers = [25.6f32, 57.600_002, 34.0, -6.400_002_4];
        let near = |x: f32| [x.next_down(), x, x.next_up()];
        let mut planes: Vec<(usize, f64)> = Vec::new();
        for x in numbers.into_iter().flat_map(near) {
            planes.extend([(0, f64::from(x)), (1, f64::from(x))]);
        }
        for a in 0..64 {
            let corner = |k: usize| Vec3::new(numbers[a >> (2 * k) & 3], numbers[(a >> (2 * k) & 3) ^ (k + 1)], 2.5);
            assert_kept(&Polygon::new([corner(0), corner(1), corner(2)]), &planes);
        }
    }
}
