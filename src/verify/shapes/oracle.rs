//! Where a ray meets a turned profile, found without any of the renderer's own means: by looking for changes of sign on a
//! fine grid of the profile and in its dips, then by bisection. Numerics SOR-02.

use glam::DVec3;

/// Intervals of the grid, over the whole profile.
const GRID: usize = 8192;

/// A profile as its file has it, and points of it.
pub struct Oracle {
    points: Vec<[f64; 2]>,
    is_bspline: bool,
    grid: Vec<[f64; 2]>,
}

impl Oracle {
    /// Of Bezier segments or of a clamped uniform cubic B-spline.
    pub fn new(points: &[[f64; 2]], is_bspline: bool) -> Self {
        let mut oracle = Self { points: points.to_vec(), is_bspline, grid: Vec::new() };
        oracle.grid = (0..=GRID).map(|i| oracle.at(i as f64 / GRID as f64)).collect();
        oracle
    }

    /// Radius and height at `s` in [0, 1], from basis polynomials.
    pub fn at(&self, s: f64) -> [f64; 2] {
        if self.is_bspline {
            return self.bspline(s);
        }
        let segments = (self.points.len() - 1) / 3;
        let k = ((s * segments as f64) as usize).min(segments - 1);
        let (u, p) = (s * segments as f64 - k as f64, &self.points[3 * k..]);
        let v = 1.0 - u;
        let weights = [v * v * v, 3.0 * v * v * u, 3.0 * v * u * u, u * u * u];
        [0, 1].map(|c| (0..4).map(|i| weights[i] * p[i][c]).sum())
    }

    /// By Cox and de Boor's recursion.
    fn bspline(&self, s: f64) -> [f64; 2] {
        let segments = self.points.len() - 3;
        let knot = |i: usize| (i as f64 - 3.0).clamp(0.0, segments as f64);
        let u = s * segments as f64;
        let last = (u as usize).min(segments - 1) + 3;
        let mut basis = [0.0; 4];
        basis[3] = 1.0;
        // basis[j] is that of point last - 3 + j.
        for degree in 1..=3 {
            let before = basis;
            for j in 3 - degree..4 {
                let i = last + j - 3;
                let left =
                    if before[j] == 0.0 { 0.0 } else { (u - knot(i)) / (knot(i + degree) - knot(i)) * before[j] };
                let next = if j < 3 { before[j + 1] } else { 0.0 };
                let right = if next == 0.0 {
                    0.0
                } else {
                    (knot(i + degree + 1) - u) / (knot(i + degree + 1) - knot(i + 1)) * next
                };
                basis[j] = left + right;
            }
        }
        [0, 1].map(|c| (0..4).map(|j| basis[j] * self.points[last - 3 + j][c]).sum())
    }

    /// Where `f` is least between `low` and `high`, by thirds.
    fn least(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
        for _ in 0..100 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if f(a) < f(b) { high = b } else { low = a }
        }
        0.5 * (low + high)
    }

    /// All t in (0, infinity) at which the ray crosses, ascending. Of several dips between neighbours of the grid one is
    /// seen.
    pub fn crossings(&self, origin: DVec3, direction: DVec3) -> Vec<f64> {
        // From near the profile: digits that the distance costs are not to be this judge's.
        let shift = -origin.dot(direction) / direction.length_squared();
        let (o, d) = (origin + direction * shift, direction);
        let f = |[r, y]: [f64; 2]| {
            let h = y - o.y;
            let (x, z) = (d.y * o.x + h * d.x, d.y * o.z + h * d.z);
            x * x + z * z - d.y * d.y * r * r
        };
        let place = |i: usize| i as f64 / GRID as f64;
        let values: Vec<f64> = self.grid.iter().map(|&point| f(point)).collect();
        let mut found = Vec::new();
        let mut bisect = |mut low: f64, mut high: f64, first: f64| {
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if (f(self.at(middle)) >= 0.0) == (first >= 0.0) { low = middle } else { high = middle }
            }
            let [_, y] = self.at(0.5 * (low + high));
            found.push(shift + (y - o.y) / d.y);
        };
        for i in 1..=GRID {
            if (values[i] >= 0.0) != (values[i - 1] >= 0.0) {
                bisect(place(i - 1), place(i), values[i - 1]);
            } else if i < GRID && (values[i] >= 0.0) == (values[i + 1] >= 0.0) {
                // A dip between neighbours of one sign may reach the other: two crossings, of a ray that hardly rises.
                let [a, b, c] = [values[i - 1], values[i], values[i + 1]].map(f64::abs);
                if b <= a && b < c {
                    let dip = Self::least(place(i - 1), place(i + 1), |s| f(self.at(s)) * values[i].signum());
                    let least = f(self.at(dip));
                    if (least >= 0.0) != (values[i] >= 0.0) {
                        bisect(place(i - 1), dip, values[i]);
                        bisect(dip, place(i + 1), least);
                    }
                }
            }
        }
        found.retain(|t| *t > 0.0);
        found.sort_by(f64::total_cmp);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cylinder_and_its_spline_are_crossed_where_they_must_be() {
        let points: Vec<[f64; 2]> = (0..4).map(|i| [1.0, f64::from(i) - 1.5]).collect();
        for is_bspline in [false, true] {
            let oracle = Oracle::new(&points, is_bspline);
            let found = oracle.crossings(DVec3::new(-3.0, 0.1, 0.0), DVec3::new(2.0, 0.1, 0.0));
            assert!(found.len() == 2 && (found[0] - 1.0).abs() < 1e-9 && (found[1] - 2.0).abs() < 1e-9, "{found:?}");
            assert!(oracle.crossings(DVec3::new(-3.0, 2.0, 0.0), DVec3::new(2.0, 0.1, 0.0)).is_empty());
        }
    }
}
