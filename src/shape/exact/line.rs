//! A ray in the space of an exact shape, in f64, and what becomes of the places where it meets it.

use glam::DVec3;

/// A ray seen from a shape of about unit size around the origin: moved along itself to where it passes the origin, so that
/// nothing is lost however far away it starts.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Nearest to the origin.
    pub o: DVec3,
    /// Unit.
    pub d: DVec3,
    /// From the ray's origin to `o`.
    shift: f64,
    /// Lengths of the ray's direction in a unit.
    per_unit: f64,
}

/// A place where a line meets a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// From the line's `o`, along its direction.
    pub at: f64,
    /// Parameter of the profile, in [0, 1].
    pub s: f64,
    /// The profile is beyond the axis there: its radius is negative.
    pub is_beyond: bool,
}

/// Who is told of crossings, in any order.
pub trait Visit {
    /// Told of one; whether that is enough.
    fn meet(&mut self, crossing: Crossing) -> bool;

    /// Beyond this place on the line crossings need not be told of.
    fn end(&self) -> f64;

    /// Counts steps of the search.
    fn step(&mut self) {}
}

/// Room for rounding, in units, where places on a line are compared with its ends.
const SLACK: f64 = 1e-12;

impl Line {
    /// Of a ray with a direction of any length; `None` if it has none or is not finite.
    #[inline(always)]
    pub fn new(origin: DVec3, direction: DVec3) -> Option<Self> {
        let largest = direction.abs().max_element();
        // Written so that NaN is refused.
        if !(largest > 0.0 && largest < f64::INFINITY && origin.is_finite()) {
            return None;
        }
        let scaled = direction / largest;
        let length = scaled.length();
        let d = scaled / length;
        let shift = -origin.dot(d);
        Some(Self { o: origin + d * shift, d, shift, per_unit: 1.0 / (largest * length) })
    }

    /// The ray's t at a place, as hits have it.
    #[inline(always)]
    pub fn t(&self, at: f64) -> f32 {
        ((self.shift + at) * self.per_unit) as f32
    }

    /// Places that may have a t in (0, `t_max`): no others do.
    #[inline(always)]
    pub fn range(&self, t_max: f32) -> [f64; 2] {
        let slack = SLACK * (1.0 + self.shift.abs());
        // Half an f32's rounding, with room.
        let end = f64::from(t_max) * (1.0 + 1e-6) / self.per_unit;
        [-self.shift - slack, end - self.shift + slack]
    }

    /// The point at a place.
    #[inline(always)]
    pub fn point(&self, at: f64) -> DVec3 {
        self.o + self.d * at
    }
}

/// Looks for the nearest crossing of t in (0, `t_max`) that `takes` likes.
pub struct Nearest<'l, F> {
    line: &'l Line,
    t_max: f32,
    end: f64,
    /// The best so far.
    pub found: Option<Crossing>,
    takes: F,
}

impl<'l, F: FnMut(&Crossing) -> bool> Nearest<'l, F> {
    /// Of none so far.
    pub fn new(line: &'l Line, t_max: f32, takes: F) -> Self {
        Self { line, t_max, end: line.range(t_max)[1], found: None, takes }
    }
}

impl<F: FnMut(&Crossing) -> bool> Visit for Nearest<'_, F> {
    #[inline(always)]
    fn meet(&mut self, crossing: Crossing) -> bool {
        let t = self.line.t(crossing.at);
        if t > 0.0 && t < self.t_max && crossing.at < self.end && (self.takes)(&crossing) {
            self.end = crossing.at;
            self.found = Some(crossing);
        }
        false
    }

    #[inline(always)]
    fn end(&self) -> f64 {
        self.end
    }
}

/// Whether there is a crossing of t in (0, `t_max`) that `takes` likes.
pub struct Any<'l, F> {
    line: &'l Line,
    t_max: f32,
    end: f64,
    /// There is.
    pub found: bool,
    takes: F,
}

impl<'l, F: FnMut(&Crossing) -> bool> Any<'l, F> {
    /// Of none so far.
    pub fn new(line: &'l Line, t_max: f32, takes: F) -> Self {
        Self { line, t_max, end: line.range(t_max)[1], found: false, takes }
    }
}

impl<F: FnMut(&Crossing) -> bool> Visit for Any<'_, F> {
    #[inline(always)]
    fn meet(&mut self, crossing: Crossing) -> bool {
        let t = self.line.t(crossing.at);
        self.found = t > 0.0 && t < self.t_max && (self.takes)(&crossing);
        self.found
    }

    #[inline(always)]
    fn end(&self) -> f64 {
        self.end
    }
}
