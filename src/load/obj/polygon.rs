//! Polygons to triangles: the better diagonal of a quadrilateral, ear clipping for the rest.
//!
//! After Meisters 1975, "Polygons Have Ears", American Mathematical Monthly 82(6), on the polygon's projection along the
//! largest component of its Newell normal (Sutherland, Sproull and Schumacker 1974). In f64: differences of f32
//! coordinates of like size are exact there, so the side tests see the polygon as it is written.

use glam::{DVec2, DVec3};

/// Tests of a point against a triangle that one polygon may cost, per corner: far above what polygons of real files
/// take, low enough that none made on purpose holds up a batch.
const TESTS_PER_CORNER: usize = 1024;

/// Twice the area of a polygon times its normal (Newell); zero or not finite if it has none.
pub(super) fn newell(points: &[DVec3]) -> DVec3 {
    let origin = points.first().copied().unwrap_or_default();
    let edges = points.iter().zip(points.iter().cycle().skip(1));
    edges.map(|(a, b)| (*a - origin).cross(*b - origin)).sum()
}

/// Adds the triangles of the polygon, as places in `points`, wound as it is. `false`: it crosses itself (or was too
/// costly), so that part of it became a fan, which may overlap.
pub(super) fn triangulate(points: &[DVec3], out: &mut Vec<[u32; 3]>) -> bool {
    match points.len() {
        0..3 => true,
        3 => {
            out.push([0, 1, 2]);
            true
        }
        n => {
            let normal = newell(points);
            if normal == DVec3::ZERO {
                // All in one line, or what turns left and what turns right cancel out.
                out.extend((1..n as u32 - 1).map(|i| [0, i, i + 1]));
                let fan = points.windows(2).skip(1);
                return fan.map(|p| (p[0] - points[0]).cross(p[1] - points[0])).all(|area| area == DVec3::ZERO);
            }
            let flat = project(points, normal);
            if n == 4 && quadrilateral(points, &flat, out) { true } else { Ears::new(flat).clip(out) }
        }
    }
}

/// The polygon in a plane, counter-clockwise if it is simple.
fn project(points: &[DVec3], normal: DVec3) -> Vec<DVec2> {
    let size = normal.abs();
    let (axis, along) = match () {
        () if size.x >= size.y && size.x >= size.z => (0, normal.x),
        () if size.y >= size.z => (1, normal.y),
        () => (2, normal.z),
    };
    let flip = if along < 0.0 { -1.0 } else { 1.0 };
    let to_plane = |p: &DVec3| match axis {
        0 => DVec2::new(p.y * flip, p.z),
        1 => DVec2::new(p.z * flip, p.x),
        _ => DVec2::new(p.x * flip, p.y),
    };
    points.iter().map(to_plane).collect()
}

/// Twice the signed area: positive if `a`, `b`, `c` turn left.
fn side(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Splits a quadrilateral along the shorter of its inner diagonals; of equal ones, the one from its first corner.
/// `false` if neither has a triangle on each side.
fn quadrilateral(points: &[DVec3], flat: &[DVec2], out: &mut Vec<[u32; 3]>) -> bool {
    const SPLITS: [[[u32; 3]; 2]; 2] = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]];
    // Diagonals that f32 coordinates cannot tell apart count as equal: an axis-aligned rectangle far from the origin
    // must not be split at random.
    const EQUAL: f64 = 1.0 - 1e-5;
    let inner = |split: [[u32; 3]; 2]| {
        split.iter().all(|t| {
            let [a, b, c] = t.map(|i| flat[i as usize]);
            side(a, b, c) > 0.0
        })
    };
    let length = |a: usize, b: usize| points[a].distance_squared(points[b]);
    let best = match SPLITS.map(inner) {
        [true, true] if length(1, 3) < EQUAL * length(0, 2) => 1,
        [true, _] => 0,
        [false, true] => 1,
        [false, false] => return false,
    };
    out.extend(SPLITS[best]);
    true
}

/// A polygon while its ears are cut off.
struct Ears {
    flat: Vec<DVec2>,
    /// Neighbours in what is left.
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Corners where the polygon does not turn left: only they can lie in an ear. Stays so while ears are cut, since
    /// cutting opens no corner.
    reflex: Vec<u32>,
    tests: usize,
}

/// Which corners may be cut.
#[derive(Clone, Copy, PartialEq)]
enum Strictness {
    /// With area, and no other corner in it or on its border.
    Clear,
    /// With area, and no other corner inside.
    Touching,
    /// Without area: corners in line, and those that stand in one place.
    Flat,
}

impl Ears {
    fn new(flat: Vec<DVec2>) -> Self {
        let n = flat.len() as u32;
        let next: Vec<u32> = (0..n).map(|i| (i + 1) % n).collect();
        let previous: Vec<u32> = (0..n).map(|i| (i + n - 1) % n).collect();
        let tests = TESTS_PER_CORNER * flat.len();
        let mut ears = Self { flat, next, previous, reflex: Vec::new(), tests };
        ears.reflex = (0..n).filter(|&i| !ears.is_convex(i)).collect();
        ears
    }

    fn turn(&self, i: u32) -> f64 {
        let at = |i: u32| self.flat[i as usize];
        side(at(self.previous[i as usize]), at(i), at(self.next[i as usize]))
    }

    /// Corners that are not finite are not.
    fn is_convex(&self, i: u32) -> bool {
        self.turn(i) > 0.0
    }

    fn clip(mut self, out: &mut Vec<[u32; 3]>) -> bool {
        let mut left = self.flat.len();
        let mut at = 0;
        // Corners looked at since the last ear; the strictest kind of ear is tried all around before the next.
        let mut idle = 0;
        let mut strictness = Strictness::Clear;
        while left > 3 {
            if self.tests == 0 {
                return self.fan(at, out);
            }
            if self.is_ear(at, strictness) {
                let (previous, next) = (self.previous[at as usize], self.next[at as usize]);
                out.push([previous, at, next]);
                self.next[previous as usize] = next;
                self.previous[next as usize] = previous;
                left -= 1;
                (idle, strictness) = (0, Strictness::Clear);
                // Going on beyond the neighbour keeps the triangles from becoming one fan of slivers.
                at = self.next[next as usize];
                if left.is_multiple_of(16) {
                    self.forget_convex();
                }
                continue;
            }
            at = self.next[at as usize];
            idle += 1;
            if idle >= left {
                idle = 0;
                strictness = match strictness {
                    Strictness::Clear => Strictness::Touching,
                    Strictness::Touching => Strictness::Flat,
                    Strictness::Flat => return self.fan(at, out),
                };
            }
        }
        out.push([self.previous[at as usize], at, self.next[at as usize]]);
        // Of a polygon that crosses itself, what is left may be turned over.
        self.turn(at) >= 0.0
    }

    /// Drops corners from `reflex` that are cut off or have become convex.
    fn forget_convex(&mut self) {
        let mut reflex = std::mem::take(&mut self.reflex);
        reflex.retain(|&i| self.is_left(i) && !self.is_convex(i));
        self.reflex = reflex;
    }

    fn is_left(&self, i: u32) -> bool {
        self.next[self.previous[i as usize] as usize] == i
    }

    fn is_ear(&mut self, i: u32, strictness: Strictness) -> bool {
        if strictness == Strictness::Flat {
            self.tests = self.tests.saturating_sub(1);
            return self.turn(i) == 0.0;
        }
        if !self.is_convex(i) {
            self.tests = self.tests.saturating_sub(1);
            return false;
        }
        let (before, after) = (self.previous[i as usize], self.next[i as usize]);
        let corners @ [a, b, c] = [before, i, after].map(|i| self.flat[i as usize]);
        self.tests = self.tests.saturating_sub(1 + self.reflex.len());
        !self.reflex.iter().any(|&k| {
            let p = self.flat[k as usize];
            // A corner in the same place as one of the ear's is another visit to it (a hole that is cut open).
            if k == before || k == after || corners.contains(&p) || !self.is_left(k) {
                return false;
            }
            let sides = [side(a, b, p), side(b, c, p), side(c, a, p)];
            match strictness {
                Strictness::Touching => sides.iter().all(|s| *s > 0.0),
                _ => sides.iter().all(|s| *s >= 0.0),
            }
        })
    }

    /// What is left becomes a fan.
    fn fan(&self, from: u32, out: &mut Vec<[u32; 3]>) -> bool {
        let mut at = self.next[from as usize];
        while self.next[at as usize] != from {
            out.push([from, at, self.next[at as usize]]);
            at = self.next[at as usize];
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles, whether it went well, and the sum of the signed areas.
    fn split(points: &[[f64; 2]]) -> (Vec<[u32; 3]>, bool, f64) {
        // In a slanted plane, so that the projection matters.
        let lift = |p: &[f64; 2]| DVec3::new(p[0], p[1], 0.5 * p[0] + 0.25 * p[1]);
        let lifted: Vec<DVec3> = points.iter().map(lift).collect();
        let mut out = Vec::new();
        let well = triangulate(&lifted, &mut out);
        let at = |i: u32| DVec2::from_array(points[i as usize]);
        let areas: Vec<f64> = out.iter().map(|t| 0.5 * side(at(t[0]), at(t[1]), at(t[2]))).collect();
        assert!(!well || areas.iter().all(|a| *a >= -1e-12), "a triangle is turned over: {areas:?}");
        assert_eq!(out.len(), points.len() - 2);
        (out, well, areas.iter().sum())
    }

    #[test]
    fn quadrilaterals_take_the_inner_then_the_shorter_diagonal() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 1e4));
        let mut out = Vec::new();
        assert!(triangulate(&square, &mut out));
        assert_eq!(out, [[0, 1, 2], [0, 2, 3]], "of equal diagonals the first");
        assert_eq!(split(&[[0.0, 0.0], [1.0, 0.0], [3.0, 2.0], [0.0, 1.0]]).0, [[0, 1, 3], [1, 2, 3]]);
        // An arrow head: only the diagonal through its notch lies inside.
        let arrow = [[0.0, 0.0], [2.0, -1.0], [0.5, 0.0], [2.0, 1.0]];
        assert_eq!(split(&arrow).0, [[0, 1, 2], [0, 2, 3]]);
        let turned = [arrow[1], arrow[2], arrow[3], arrow[0]];
        assert_eq!(split(&turned).0, [[0, 1, 3], [1, 2, 3]]);
    }

    #[test]
    fn concave_polygons_keep_their_area() {
        let l = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        assert_eq!(split(&l).2, 3.0);
        let comb: Vec<[f64; 2]> = (0..20)
            .flat_map(|i| [[f64::from(i), 0.0], [f64::from(i) + 0.5, 5.0]])
            .rev()
            .chain([[0.0, -1.0], [20.0, -1.0]])
            .collect();
        let shoelace: f64 = (0..comb.len())
            .map(|i| DVec2::from_array(comb[i]).perp_dot(DVec2::from_array(comb[(i + 1) % comb.len()])) / 2.0)
            .sum();
        let (_, well, area) = split(&comb);
        assert!(well && (area - shoelace).abs() < 1e-9, "{area} {shoelace}");
        let star: Vec<[f64; 2]> = (0..200)
            .map(|i| {
                let (angle, radius) = (f64::from(i) * std::f64::consts::TAU / 200.0, 1.0 + f64::from(i % 2));
                [radius * angle.cos(), radius * angle.sin()]
            })
            .collect();
        let (_, well, area) = split(&star);
        assert!(well && (area - 200.0 * (std::f64::consts::TAU / 200.0).sin()).abs() < 1e-9, "{area}");
    }

    #[test]
    fn corners_in_line_and_in_one_place_do_no_harm() {
        let line = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0], [0.0, 2.0], [0.0, 1.0]];
        assert_eq!(split(&line).2, 4.0);
        let twice = [[0.0, 0.0], [2.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.0, 2.0]];
        assert_eq!(split(&twice).2, 4.0);
        // A square with a square hole, cut open along one line.
        let hole = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.0, 1.0],
        ];
        let (_, well, area) = split(&hole);
        assert!(well && area == 12.0, "{area}");
    }

    #[test]
    fn what_is_no_simple_polygon_falls_back_to_a_fan() {
        let crossed = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0], [-3.0, 1.0]];
        assert!(!split(&crossed).1);
        assert!(!split(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]).1);
        assert!(!split(&[[f64::NAN, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [5.0, 5.0]]).1);
        // All in one line: triangles without area, which the scene's check drops.
        assert!(split(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [1.5, 0.0]]).1);
    }

    #[test]
    fn large_polygons_end() {
        let spiral: Vec<[f64; 2]> = (0..3000)
            .map(|i| {
                let k = f64::from(if i < 1500 { i } else { 2999 - i });
                let radius = 1.0 + k * 0.01 + if i < 1500 { 0.03 } else { 0.0 };
                [radius * (k * 0.05).cos(), radius * (k * 0.05).sin()]
            })
            .collect();
        split(&spiral);
    }
}
