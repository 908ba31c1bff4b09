//! How a ray sees one triangle: whether a backend may report a hit, whether it must, and between which distances.
//!
//! A backend that tests rounded corners with exact signs, as `accel/woop.rs` does, finds t = sum b_i t_i of a point
//! q = sum b_i p_i of the triangle (weights b_i >= 0 of sum 1) that lies within the corners' error `across` of the ray.
//! So a hit is possible where the triangle comes that near to the ray, and t is that of a point of the triangle there;
//! this holds for slivers and grazing rays too.

use super::ray::{EPS, ExactRay, Seen};
use glam::DVec3;

/// A triangle that may be hit.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// Corners relative to the ray.
    pub corners: [Seen; 3],
    /// Sum of the edges' lengths across the ray.
    perimeter: f64,
    /// Least and greatest distance that a hit may have.
    pub t: [f64; 2],
    /// Weights of the second and third corner at the ray itself, clamped to [0, 1].
    pub uv: [f64; 2],
    /// How far the weights may be off.
    pub uv_error: f64,
    /// Distances of the ray from the edges opposite to the first, second and third corner, metres.
    pub edges: [f64; 3],
    /// Whether the ray is inside, however little.
    pub inside: bool,
}

/// `a x b` of two points.
fn cross(a: &Seen, b: &Seen) -> f64 {
    a.x * b.y - a.y * b.x
}

/// The distance of the ray from the edge between two corners.
fn distance(a: &Seen, b: &Seen) -> f64 {
    let (ex, ey) = (b.x - a.x, b.y - a.y);
    let squared = ex * ex + ey * ey;
    let s = if squared > 0.0 { (-(a.x * ex + a.y * ey) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (a.x + s * ex).hypot(a.y + s * ey)
}

/// Whether all edge functions have one sign, and not by f64's own roundings: of a triangle seen edge on all are nearly 0,
/// wherever the ray is, but no point of a triangle is further from all its edges than its inradius.
fn is_inside(e: [f64; 3], edges: [f64; 3], perimeter: f64) -> bool {
    let det = e[0] + e[1] + e[2];
    let nearest = edges[0].min(edges[1]).min(edges[2]);
    det != 0.0 && e.iter().all(|e| e * det >= 0.0) && nearest * perimeter <= 1.001 * det.abs()
}

impl Sight {
    /// How `ray` sees the triangle, whose corners are known within `error` metres; `None` if no backend may report a hit,
    /// at any distance.
    pub fn new(ray: &ExactRay, corners: [DVec3; 3], error: f64) -> Option<Self> {
        let corners = corners.map(|p| ray.see(p, error));
        let [a, b, c] = &corners;
        let e = [cross(c, b), cross(a, c), cross(b, a)];
        let edges = [distance(b, c), distance(c, a), distance(a, b)];
        let det = e[0] + e[1] + e[2];
        let length = |p: &Seen, q: &Seen| (p.x - q.x).hypot(p.y - q.y);
        let perimeter = length(a, b) + length(b, c) + length(c, a);
        let inside = is_inside(e, edges, perimeter);
        let across = a.across.max(b.across).max(c.across);
        if !inside && edges.iter().all(|d| *d > across) {
            return None;
        }
        let ts = [a.t, b.t, c.t];
        let (least, most) = (ts[0].min(ts[1]).min(ts[2]), ts[0].max(ts[1]).max(ts[2]));
        // What is left of the area when the corners move by their errors.
        let area = det.abs() - 2.0 * across * (perimeter + 4.0 * across);
        let (mut low, mut high) = (least, most);
        let (mut uv, mut uv_error) = ([0.5; 2], 1.0);
        if area > 0.0 {
            // t is linear across the ray: its value there and its slope.
            let at = (e[0] * a.t + e[1] * b.t + e[2] * c.t) / det;
            let slope = |k: fn(&Seen) -> f64| {
                let [ka, kb, kc] = [k(a), k(b), k(c)];
                (a.t * (kc - kb) + b.t * (ka - kc) + c.t * (kb - ka)) / det
            };
            let steepness = slope(|p| p.y).hypot(slope(|p| p.x));
            // The products in the edge functions are rounded once their signs are settled.
            let products = |p: &Seen, q: &Seen| p.x.abs() * q.y.abs() + p.y.abs() * q.x.abs();
            let moved = |p: &Seen, q: &Seen| products(p, q) + across * (p.x.abs() + p.y.abs() + q.x.abs() + q.y.abs());
            let weights = 4.0 * EPS * (moved(a, b) + moved(b, c) + moved(c, a)) / area + 4.0 * EPS;
            let half = steepness * across + weights * (most - least);
            (low, high) = ((at - half).clamp(least, most), (at + half).clamp(least, most));
            uv = [e[1] / det, e[2] / det].map(|w: f64| w.clamp(0.0, 1.0));
            uv_error = (2.0 * across * perimeter / area + weights).min(1.0);
        }
        let along = a.along.max(b.along).max(c.along);
        let rounding = 10.0 * EPS * most.abs().max(least.abs()) + along + f64::from(f32::MIN_POSITIVE);
        Some(Self { corners, perimeter, t: [low - rounding, high + rounding], uv, uv_error, edges, inside })
    }

    /// Error of the corners of the edge opposite to corner `i`.
    pub fn edge_error(&self, i: usize) -> f64 {
        self.corners[(i + 1) % 3].across.max(self.corners[(i + 2) % 3].across)
    }

    /// Whether the edge opposite to corner `i` is so near that it is not certain on which side of it the ray passes.
    pub fn is_near(&self, i: usize) -> bool {
        self.edges[i] <= self.edge_error(i)
    }

    /// Whether the ray passes inside for certain.
    pub fn is_certain(&self) -> bool {
        self.inside && (0..3).all(|i| !self.is_near(i))
    }

    /// Whether weights `u` and `v` name a point of the triangle, within their error.
    pub fn has(&self, u: f64, v: f64) -> bool {
        let near = |got: f64, want: f64| (got - want).abs() <= self.uv_error;
        let within = |w: f64| (-8.0 * EPS..=1.0 + 8.0 * EPS).contains(&w);
        within(u) && within(v) && within(1.0 - u - v) && near(u, self.uv[0]) && near(v, self.uv[1])
    }

    /// Whether the point (`x`, `y`) across the ray is inside, and its distance from the nearest edge.
    pub fn contains(&self, x: f64, y: f64) -> (bool, f64) {
        let [a, b, c] = self.corners.map(|p| Seen { x: p.x - x, y: p.y - y, ..p });
        let e = [cross(&c, &b), cross(&a, &c), cross(&b, &a)];
        let edges = [distance(&b, &c), distance(&c, &a), distance(&a, &b)];
        (is_inside(e, edges, self.perimeter), edges[0].min(edges[1]).min(edges[2]))
    }
}
