//! Where a line meets a profile turned about the y axis: every crossing, with certainty.
//!
//! With the line `o + t d` and A(u) = y(u) - o.y, a point of the profile is met where t = A / d.y lies at the profile's
//! distance from the axis, that is at the roots of
//!
//! `F(u) = A (a A + 2 b d.y) + d.y^2 (c - r^2)`, `a = d.x^2 + d.z^2`, `b = o.x d.x + o.z d.z`, `c = o.x^2 + o.z^2`,
//!
//! of degree 6 (Kajiya 1983, "New Techniques for Ray Tracing Procedurally Defined Objects", section 5; van Wijk 1984). Its
//! Bernstein coefficients tell how many roots there may be (`bernstein.rs`): pieces without a change of sign have none,
//! those with one have one, which is then found between its bounds; others are halved. A Newton iteration from one start
//! loses up to 57 % of the hits of some profiles.
//!
//! F is made anew of the halved A and r instead of being halved itself. Rays that hardly rise meet the front and the back
//! of a surface at nearly the same u, d.y apart, where F is about d.y^2; A there is exact to 1e-16 whatever d.y is, and so
//! F to 1e-16 d.y, relative to itself 1e-16 / d.y. Such pieces are divided where the line is nearest to the axis, which is
//! between the two. Rays of less than `LEVEL` are taken as level: the heights y(u) = o.y, then a quadratic.
//!
//! What touches without crossing, or goes less than about 1e-7 of the size deep along the line, is no hit: crossings come
//! and go in pairs.

use super::bernstein::{between, hull, powers, product, root, sign_changes, split};
use super::line::{Crossing, Line, Visit};
use super::profile::{Piece, Profile};

/// A line that rises less, of its unit length, is level.
const LEVEL: f64 = 1e-10;
/// Lines that rise less have their pieces divided where they are nearest to the axis.
const FLAT: f64 = 0.1;
/// Where t is better found by the distance from the axis than by the height.
const NEARLY_LEVEL: f64 = 1e-6;
/// Halvings of a piece at most: roots that are nearer to one another are one.
const DEEPEST: u32 = 46;
/// Two roots that are nearer than halvings tell are both there if both lie on the line up to this, in units.
const ON_LINE: f64 = 1e-11;
/// Room for rounding in boxes, in units.
const SLACK: f64 = 1e-12;
/// What rounding may make of F, of the size of its terms: what is less is nothing.
const NOISE: f64 = 4e-15;

/// A box in the plane of radius and height.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ring {
    /// Least and greatest square of the radius.
    r2: [f64; 2],
    y: [f64; 2],
}

impl Ring {
    const NOTHING: Self = Self { r2: [f64::INFINITY, 0.0], y: [f64::INFINITY, f64::NEG_INFINITY] };

    fn of(piece: &Piece) -> Self {
        let ([low, high], [bottom, top]) = (hull(&piece.r), hull(&piece.y));
        let least = if low <= 0.0 && high >= 0.0 { 0.0 } else { (low.abs().min(high.abs()) - SLACK).max(0.0) };
        let most = low.abs().max(high.abs()) + SLACK;
        Self { r2: [least * least, most * most], y: [bottom - SLACK, top + SLACK] }
    }

    fn join(&self, other: &Self) -> Self {
        Self {
            r2: [self.r2[0].min(other.r2[0]), self.r2[1].max(other.r2[1])],
            y: [self.y[0].min(other.y[0]), self.y[1].max(other.y[1])],
        }
    }
}

/// A profile and the boxes of its parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Revolution {
    profile: Profile,
    /// A binary tree: 1 is the root, 2k and 2k + 1 are the halves of k, and the last [`Self::leaves`] are the pieces.
    rings: Vec<Ring>,
    leaves: usize,
}

impl Revolution {
    /// Of a profile.
    pub fn new(profile: Profile) -> Self {
        let leaves = profile.pieces.len().next_power_of_two();
        let mut rings = vec![Ring::NOTHING; 2 * leaves];
        for (ring, piece) in rings[leaves..].iter_mut().zip(&profile.pieces) {
            *ring = Ring::of(piece);
        }
        for k in (1..leaves).rev() {
            rings[k] = rings[2 * k].join(&rings[2 * k + 1]);
        }
        Self { profile, rings, leaves }
    }

    /// The profile.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Tells `visit` of the crossings of a line, in units of the profile about its middle.
    #[inline(always)]
    pub fn crossings(&self, line: &Line, start: f64, visit: &mut impl Visit) {
        let (o, d) = (line.o, line.d);
        // The corners of the box of radius and height 1 are this far.
        let reach2 = 2.0 + SLACK - o.length_squared();
        if reach2 <= 0.0 {
            return;
        }
        let reach = reach2.sqrt();
        let start = start.max(-reach);
        let (a, b, c) = (d.x * d.x + d.z * d.z, o.x * d.x + o.z * d.z, o.x * o.x + o.z * o.z);
        let nearest = if a > 1e-30 { -b / a } else { 0.0 };
        let is_level = d.y.abs() < LEVEL;
        let per_rise = if is_level { 0.0 } else { 1.0 / d.y };
        let pieces = &*self.profile.pieces;
        let ray = Ray { a, b, c, dy: d.y, oy: o.y, per_rise, start, reach, nearest, is_level };
        let mut search = Search { pieces, rings: &self.rings, leaves: self.leaves, ray, visit, i: 0 };
        search.rings(1);
    }
}

/// What of a line counts.
#[derive(Clone, Copy)]
struct Ray {
    a: f64,
    b: f64,
    c: f64,
    dy: f64,
    oy: f64,
    /// 1 / dy; 0 of a level line.
    per_rise: f64,
    /// Before this place there is nothing to be told.
    start: f64,
    /// Places outside of -`reach` to `reach` are outside of the shape.
    reach: f64,
    /// Where it is nearest to the axis.
    nearest: f64,
    is_level: bool,
}

struct Search<'s, V> {
    pieces: &'s [Piece],
    rings: &'s [Ring],
    leaves: usize,
    ray: Ray,
    visit: &'s mut V,
    /// The piece that is looked at.
    i: usize,
}

/// Part of a piece, seen from the line: radius and height above its origin.
#[derive(Clone, Copy)]
struct Part {
    r: [f64; 4],
    a: [f64; 4],
    /// Parameter of its begin in the piece, and its share of it.
    from: f64,
    width: f64,
}

impl<V: Visit> Search<'_, V> {
    /// Looks into a box; whether that is enough.
    fn rings(&mut self, k: usize) -> bool {
        self.visit.step();
        if !self.enters(&self.rings[k]) {
            return false;
        }
        if k >= self.leaves {
            self.i = k - self.leaves;
            return self.piece();
        }
        let middle = |k: usize| self.rings[k].y[0] + self.rings[k].y[1];
        // The half that the line meets first, so that what is behind its hits is not looked at.
        let first = usize::from((middle(2 * k) - middle(2 * k + 1)) * self.ray.dy > 0.0);
        self.rings(2 * k + first) || self.rings(2 * k + 1 - first)
    }

    /// Whether the line, as far as it counts, may be in the box.
    #[inline(always)]
    fn enters(&self, ring: &Ring) -> bool {
        let Ray { a, b, c, dy, oy, per_rise, start, reach, nearest, is_level } = self.ray;
        let (mut low, mut high) = (start, reach.min(self.visit.end()));
        if is_level {
            if oy < ring.y[0] - dy.abs() * reach || oy > ring.y[1] + dy.abs() * reach {
                return false;
            }
        } else {
            let (t0, t1) = ((ring.y[0] - oy) * per_rise, (ring.y[1] - oy) * per_rise);
            low = low.max(t0.min(t1));
            high = high.min(t0.max(t1));
        }
        if low > high {
            return false;
        }
        let square = |t: f64| (a * t + 2.0 * b) * t + c;
        let least = square(nearest.clamp(low, high));
        let most = square(low).max(square(high));
        least <= ring.r2[1] + SLACK && most >= ring.r2[0] - SLACK
    }

    fn piece(&mut self) -> bool {
        let piece = &self.pieces[self.i];
        let part = Part { r: piece.r, a: piece.y.map(|y| y - self.ray.oy), from: 0.0, width: 1.0 };
        if self.ray.is_level { self.level(&part, DEEPEST) } else { self.part(&part, DEEPEST) }
    }

    /// F over a part, and the size of its terms.
    #[inline(always)]
    fn coefficients(&self, part: &Part) -> [f64; 7] {
        let Ray { a, b, c, dy, .. } = self.ray;
        let (twice, dy2) = (2.0 * b * dy, dy * dy);
        let ap = product(&part.a, &part.a.map(|v| a * v + twice));
        let rr = product(&part.r, &part.r);
        std::array::from_fn(|i| ap[i] + dy2 * (c - rr[i]))
    }

    /// Looks for roots of F in a part; whether that is enough.
    fn part(&mut self, part: &Part, depth: u32) -> bool {
        self.visit.step();
        let Ray { a, b, c, dy, start, reach, .. } = self.ray;
        let [low, high] = hull(&part.a);
        let (t0, t1) = (dy * start, dy * reach.min(self.visit.end()));
        if high < t0.min(t1) - SLACK || low > t0.max(t1) + SLACK {
            return false;
        }
        let f = self.coefficients(part);
        let changes = sign_changes(&f);
        if changes == 0 {
            return false;
        }
        let crosses = (f[0] >= 0.0) != (f[6] >= 0.0);
        let most = |values: &[f64]| values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        if changes > 1 {
            let (r, height) = (most(&part.r), low.abs().max(high.abs()));
            let terms = height * (a * height + 2.0 * (b * dy).abs()) + dy * dy * (c + r * r);
            let is_noise = most(&f) <= NOISE * terms;
            if is_noise && !crosses {
                return false;
            }
            if depth > 0 && !is_noise {
                return self.halves(part, depth);
            }
            if !crosses {
                return self.pair(part, 0.5);
            }
        }
        let (p, q) = (powers(&part.a), powers(&part.r));
        let (twice, dy2) = (2.0 * b * dy, dy * dy);
        let at = |s: f64| {
            let (h, h1) = (p[0] + s * (p[1] + s * (p[2] + s * p[3])), p[1] + s * (2.0 * p[2] + s * (3.0 * p[3])));
            let (r, r1) = (q[0] + s * (q[1] + s * (q[2] + s * q[3])), q[1] + s * (2.0 * q[2] + s * (3.0 * q[3])));
            (h * (a * h + twice) + dy2 * (c - r * r), (2.0 * a * h + twice) * h1 - 2.0 * dy2 * r * r1)
        };
        let s = between(f[0], f[6], at);
        let h = p[0] + s * (p[1] + s * (p[2] + s * p[3]));
        let r = q[0] + s * (q[1] + s * (q[2] + s * q[3]));
        let mut t = h * self.ray.per_rise;
        if dy.abs() < NEARLY_LEVEL
            && let Some([near, far]) = self.at_radius(r)
        {
            t = if (near - t).abs() < (far - t).abs() { near } else { far };
        }
        self.meet(part, s, t, r)
    }

    /// Looks into the two sides of a part.
    fn halves(&mut self, part: &Part, depth: u32) -> bool {
        let mut s = 0.5;
        if self.ray.dy.abs() < FLAT {
            // Front and back of the surface are on either side of where the line is nearest to the axis.
            let height = self.ray.dy * self.ray.nearest;
            let above = part.a.map(|a| a - height);
            if (above[0] >= 0.0) != (above[3] >= 0.0) {
                let middle = root(&above);
                if middle > 0.0 && middle < 1.0 {
                    s = middle;
                }
            }
        }
        let ([r0, r1], [a0, a1]) = (split(&part.r, s), split(&part.a, s));
        let width = [part.width * s, part.width * (1.0 - s)];
        let left = Part { r: r0, a: a0, from: part.from, width: width[0] };
        let right = Part { r: r1, a: a1, from: part.from + width[0], width: width[1] };
        let rises = (part.a[3] - part.a[0]) * self.ray.dy >= 0.0;
        let [first, second] = if rises { [&left, &right] } else { [&right, &left] };
        self.part(first, depth - 1) || self.part(second, depth - 1)
    }

    /// A level line in the heights of a part; whether that is enough.
    fn level(&mut self, part: &Part, depth: u32) -> bool {
        self.visit.step();
        let changes = sign_changes(&part.a);
        let [low, high] = hull(&part.a);
        // A line in the plane of a flat part does not cross it.
        if changes == 0 || low.abs().max(high.abs()) <= NOISE {
            return false;
        }
        if changes == 1 {
            return self.pair(part, root(&part.a));
        }
        if depth == 0 {
            return false;
        }
        let ([r0, r1], [a0, a1]) = (split(&part.r, 0.5), split(&part.a, 0.5));
        let width = 0.5 * part.width;
        let left = Part { r: r0, a: a0, from: part.from, width };
        let right = Part { r: r1, a: a1, from: part.from + width, width };
        self.level(&left, depth - 1) || self.level(&right, depth - 1)
    }

    /// Both crossings of the line with the circle at `s`, if both are on the line: what is one root to F.
    fn pair(&mut self, part: &Part, s: f64) -> bool {
        let (p, q) = (powers(&part.a), powers(&part.r));
        let h = p[0] + s * (p[1] + s * (p[2] + s * p[3]));
        let r = q[0] + s * (q[1] + s * (q[2] + s * q[3]));
        let Some(both) = self.at_radius(r) else { return false };
        let apart = |t: f64| (self.ray.dy * t - h).abs();
        if apart(both[0]).max(apart(both[1])) > if self.ray.is_level { 2.0 * LEVEL } else { ON_LINE } {
            return false;
        }
        self.meet(part, s, both[0], r) || self.meet(part, s, both[1], r)
    }

    /// Where the line is `r` away from the axis.
    #[inline(always)]
    fn at_radius(&self, r: f64) -> Option<[f64; 2]> {
        let Ray { a, b, c, .. } = self.ray;
        let square = b * b - a * (c - r * r);
        if !(square > 0.0 && a > 0.0) {
            return None;
        }
        let root = square.sqrt();
        Some([(-b - root) / a, (-b + root) / a])
    }

    #[inline(always)]
    fn meet(&mut self, part: &Part, s: f64, at: f64, r: f64) -> bool {
        let s = (self.i as f64 + part.from + s * part.width) / self.pieces.len() as f64;
        self.visit.meet(Crossing { at, s: s.min(1.0), is_beyond: r < 0.0 })
    }
}

#[cfg(test)]
#[path = "revolution_tests.rs"]
mod tests;
