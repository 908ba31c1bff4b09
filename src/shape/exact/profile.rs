//! Profiles of surfaces of revolution: from the points of a file to cubic pieces of about unit size.

use super::bernstein::{Cubic, at, hull, split};

/// How the points of a profile are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curve {
    /// Cubic segments that share end points: 3k + 1 points.
    Bezier,
    /// A clamped uniform cubic B-spline: at least 4 points.
    BSpline,
}

/// Equal parts of a segment: their boxes turn most rays away before there is a polynomial.
pub const PARTS: usize = 8;

/// Part of a profile, in units of [`Profile::scale`] around the middle of the profile's heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Distance from the axis; negative beyond it.
    pub r: Cubic,
    /// Height.
    pub y: Cubic,
}

/// A profile: radius and height along a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// In its order, [`PARTS`] a segment.
    pub pieces: Vec<Piece>,
    /// Height of the middle, metres.
    pub middle: f64,
    /// Metres in a unit, a power of two: radii and heights are at most 1.
    pub scale: f64,
}

/// Why points make no profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileError {
    /// So many points do not make Bezier segments.
    BezierCount,
    /// Fewer than four points.
    BSplineCount,
    /// A number that is not finite or beyond 1e18 m; of which point.
    OutOfRange(usize),
    /// All points are one, or so close to one another that a metre is 1e30 times as long.
    OnePoint,
    /// All points lie on the axis.
    OnAxis,
}

/// What of a profile the user should know: it is drawn as it is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Notes {
    /// Point that equals the one before it.
    pub repeated: Option<usize>,
    /// The radius is negative somewhere.
    pub crosses_axis: bool,
    /// The curve meets itself.
    pub crosses_itself: bool,
}

/// Coordinates beyond this are refused, metres.
const FARTHEST: f64 = 1e18;
/// Smaller profiles are refused, metres.
const LEAST: f64 = 1e-30;
/// Chords of longer profiles are not held against one another.
const MOST_CHORDS: usize = 2048;

impl Profile {
    /// Of points (radius, height), metres.
    ///
    /// # Errors
    /// They make no profile.
    pub fn new(curve: Curve, points: &[[f64; 2]]) -> Result<Self, ProfileError> {
        match curve {
            Curve::Bezier if points.len() < 4 || points.len() % 3 != 1 => return Err(ProfileError::BezierCount),
            Curve::BSpline if points.len() < 4 => return Err(ProfileError::BSplineCount),
            _ => {}
        }
        if let Some(i) = points.iter().position(|p| !p.iter().all(|v| v.abs() <= FARTHEST)) {
            return Err(ProfileError::OutOfRange(i));
        }
        let radius = points.iter().fold(0.0, |most: f64, p| most.max(p[0].abs()));
        let [low, high] =
            points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], p| [a.min(p[1]), b.max(p[1])]);
        let size = radius.max(0.5 * (high - low));
        if size < LEAST || points.iter().all(|p| *p == points[0]) {
            return Err(ProfileError::OnePoint);
        }
        if radius <= 0.0 {
            return Err(ProfileError::OnAxis);
        }
        let (middle, scale) = (0.5 * (low + high), size.log2().ceil().exp2());
        let local: Vec<[f64; 2]> = points.iter().map(|&[r, y]| [r / scale, (y - middle) / scale]).collect();
        let segments = match curve {
            Curve::Bezier => (0..local.len() / 3).map(|k| [0, 1, 2, 3].map(|i| local[3 * k + i])).collect(),
            Curve::BSpline => bezier_from_bspline(&local),
        };
        let mut pieces = Vec::with_capacity(PARTS * segments.len());
        for segment in segments {
            let mut rest = Piece { r: segment.map(|p| p[0]), y: segment.map(|p| p[1]) };
            for left in (2..=PARTS).rev() {
                let s = 1.0 / left as f64;
                let ([r, more_r], [y, more_y]) = (split(&rest.r, s), split(&rest.y, s));
                pieces.push(Piece { r, y });
                rest = Piece { r: more_r, y: more_y };
            }
            pieces.push(rest);
        }
        Ok(Self { pieces, middle, scale })
    }

    /// What is odd about it, and about the points that it was made of.
    pub fn notes(&self, points: &[[f64; 2]]) -> Notes {
        Notes {
            repeated: points.windows(2).position(|w| w[0] == w[1]).map(|i| i + 1),
            crosses_axis: self.pieces.iter().any(|piece| hull(&piece.r)[0] < -1e-9),
            crosses_itself: self.crosses_itself(),
        }
    }

    /// Piece and parameter in it of the parameter `s` in [0, 1] of the whole.
    #[inline(always)]
    pub fn locate(&self, s: f64) -> (&Piece, f64) {
        let along = s * self.pieces.len() as f64;
        let i = (along as usize).min(self.pieces.len() - 1);
        (&self.pieces[i], along - i as f64)
    }

    /// By chords: four a piece are near enough for a message.
    fn crosses_itself(&self) -> bool {
        let chords = 4 * self.pieces.len();
        if chords > MOST_CHORDS {
            return false;
        }
        let point = |i: usize| {
            let (piece, s) = self.locate(i as f64 / chords as f64);
            [at(&piece.r, s)[0], at(&piece.y, s)[0]]
        };
        let points: Vec<[f64; 2]> = (0..=chords).map(point).collect();
        let side =
            |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        let meet = |i: usize, k: usize| {
            let ([a, b], [c, d]) = ([points[i], points[i + 1]], [points[k], points[k + 1]]);
            side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
        };
        (0..chords).any(|i| (i + 2..chords).any(|k| meet(i, k)))
    }
}

/// The Bezier segments of a clamped uniform cubic B-spline, by blossoms: the control points of the segment over [k, k + 1]
/// are the values at (k, k, k), (k, k, k+1), (k, k+1, k+1), (k+1, k+1, k+1). After Ramshaw 1987, "Blossoming".
fn bezier_from_bspline(points: &[[f64; 2]]) -> Vec<[[f64; 2]; 4]> {
    let segments = points.len() - 3;
    let knot = |i: usize| (i as f64 - 3.0).clamp(0.0, segments as f64);
    let blossom = |k: usize, arguments: [f64; 3]| {
        // Those that reach the knot interval number k + 3.
        let mut d = [0, 1, 2, 3].map(|j| points[k + j]);
        for (level, u) in (1..=3).zip(arguments) {
            for j in (level..=3).rev() {
                let (from, to) = (knot(k + j), knot(k + j + 4 - level));
                let s = (u - from) / (to - from);
                d[j] = [0, 1].map(|c| d[j - 1][c] + (d[j][c] - d[j - 1][c]) * s);
            }
        }
        d[3]
    };
    let mut all: Vec<[[f64; 2]; 4]> = Vec::with_capacity(segments);
    for k in 0..segments {
        let (a, b) = (k as f64, (k + 1) as f64);
        // The very point where the one before ends: no ray goes between.
        let first = all.last().map_or_else(|| blossom(k, [a, a, a]), |before| before[3]);
        all.push([first, blossom(k, [a, a, b]), blossom(k, [a, b, b]), blossom(k, [b, b, b])]);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(profile: &Profile, s: f64) -> [f64; 2] {
        let (piece, s) = profile.locate(s);
        [at(&piece.r, s)[0] * profile.scale, at(&piece.y, s)[0] * profile.scale + profile.middle]
    }

    #[test]
    fn pieces_meet_to_the_bit_and_are_the_curve() {
        let points = [[1.0, 10.0], [0.2, 10.6], [1.6, 11.3], [0.5, 12.0], [0.1, 12.2], [0.3, 12.4], [0.0, 12.5]];
        let profile = Profile::new(Curve::Bezier, &points).unwrap();
        assert_eq!((profile.pieces.len(), profile.scale), (2 * PARTS, 2.0));
        assert!(profile.pieces.windows(2).all(|w| w[0].r[3] == w[1].r[0] && w[0].y[3] == w[1].y[0]));
        // B(1/4) = (27 p0 + 27 p1 + 9 p2 + p3) / 64, of the first of two segments.
        let want = [0, 1].map(|c| (27.0 * (points[0][c] + points[1][c]) + 9.0 * points[2][c] + points[3][c]) / 64.0);
        let found = value(&profile, 0.125);
        assert!((found[0] - want[0]).abs() < 1e-14 && (found[1] - want[1]).abs() < 1e-13, "{found:?} {want:?}");
    }

    #[test]
    fn bsplines_are_their_basis_functions() {
        let points: Vec<[f64; 2]> =
            (0..9).map(|i| [1.0 + (f64::from(i) * 2.1).sin(), 0.3 * f64::from(i * i)]).collect();
        let profile = Profile::new(Curve::BSpline, &points).unwrap();
        assert_eq!(profile.pieces.len(), 6 * PARTS);
        // Cox and de Boor's recursion.
        fn basis(i: usize, degree: usize, knots: &[f64], u: f64) -> f64 {
            if degree == 0 {
                return f64::from(u8::from(knots[i] <= u && u < knots[i + 1]));
            }
            let part = |a: f64, b: f64, n: f64| if b > a { n / (b - a) } else { 0.0 };
            part(knots[i], knots[i + degree], u - knots[i]) * basis(i, degree - 1, knots, u)
                + part(knots[i + 1], knots[i + degree + 1], knots[i + degree + 1] - u)
                    * basis(i + 1, degree - 1, knots, u)
        }
        let knots: Vec<f64> = (0..13).map(|i| (f64::from(i) - 3.0).clamp(0.0, 6.0)).collect();
        for k in 0..100 {
            let s = f64::from(k) / 100.0;
            let want = [0, 1].map(|c| (0..9).map(|i| basis(i, 3, &knots, 6.0 * s) * points[i][c]).sum::<f64>());
            let found = value(&profile, s);
            assert!((0..2).all(|c| (found[c] - want[c]).abs() < 1e-12), "{s}: {found:?} {want:?}");
        }
        assert_eq!(value(&profile, 1.0).map(|v| (v * 1e9).round()), points[8].map(|v| (v * 1e9).round()));
    }

    #[test]
    fn points_that_make_no_profile_are_refused_and_odd_ones_noted() {
        let new = |curve, points: &[[f64; 2]]| Profile::new(curve, points).map(|p| p.notes(points));
        let line = |n: usize| (0..n).map(|i| [1.0, i as f64]).collect::<Vec<_>>();
        for n in [0, 1, 2, 3, 5, 6] {
            assert_eq!(new(Curve::Bezier, &line(n)), Err(ProfileError::BezierCount), "{n}");
        }
        assert_eq!(new(Curve::BSpline, &line(3)), Err(ProfileError::BSplineCount));
        assert_eq!(new(Curve::BSpline, &[[1.0, f64::NAN]; 4]), Err(ProfileError::OutOfRange(0)));
        assert_eq!(
            new(Curve::Bezier, &[[0.0, 0.0], [1.0, 2e18], [0.0; 2], [0.0; 2]]),
            Err(ProfileError::OutOfRange(1))
        );
        assert_eq!(new(Curve::Bezier, &[[0.0, 3.0]; 4]), Err(ProfileError::OnePoint));
        assert_eq!(new(Curve::Bezier, &[[0.0, 0.0], [0.0, 1.0], [0.0, 2.0], [0.0, 3.0]]), Err(ProfileError::OnAxis));
        assert_eq!(new(Curve::Bezier, &line(4)), Ok(Notes::default()));
        let notes = new(Curve::Bezier, &[[0.3, -1.0], [3.0, -0.3], [-2.0, 0.4], [0.6, 1.0]]).unwrap();
        assert_eq!(notes, Notes { crosses_axis: true, ..Notes::default() });
        let notes = new(Curve::Bezier, &[[1.0, 0.0], [5.0, 1.0], [0.0, 1.0], [1.0, 0.0]]).unwrap();
        assert_eq!((notes.crosses_axis, notes.repeated), (false, None));
        let loop_ = [[1.0, 0.0], [4.0, 2.0], [0.5, 2.0], [2.5, 0.0]];
        assert!(new(Curve::Bezier, &loop_).unwrap().crosses_itself);
        assert_eq!(new(Curve::Bezier, &[[1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]).unwrap().repeated, Some(1));
    }
}
