//! Boxes as the builder keeps them: 8 numbers, so that one minimum grows a box on all six sides.

use super::source::Source;
use crate::accel::woop::can_be_hit;
use glam::{DVec3, Vec3, Vec4};
use simd::{Float, Lanes};

/// A box: low corner, anything, negated high corner, anything.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Bounds(pub [f32; 8]);

impl Bounds {
    /// Contains nothing.
    pub const EMPTY: Self = Self([f32::INFINITY; 8]);

    /// Both together.
    #[inline(always)]
    pub fn union<L: Lanes>(&self, other: &Self) -> Self {
        let mut out = Self::EMPTY;
        L::F::load(&self.0, 0).min(L::F::load(&other.0, 0)).store(&mut out.0, 0);
        out
    }

    /// Low corner.
    pub fn low(&self) -> [f32; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }

    /// High corner.
    pub fn high(&self) -> [f32; 3] {
        [-self.0[4], -self.0[5], -self.0[6]]
    }

    /// Low minus high corner.
    #[inline(always)]
    pub fn extent(&self) -> Vec4 {
        Vec4::from_slice(&self.0[..4]) + Vec4::from_slice(&self.0[4..])
    }

    /// Half the surface area.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let d = self.extent();
        d.x * d.y + (d.x + d.y) * d.z
    }
}

/// By how much a triangle's box is padded, as a share of its extent: 8 eps, 16 roundings.
const PAD: f64 = 1.0 / (1 << 20) as f64;
/// Pad of parts at most, as a share of the triangle's extent.
const MOST_PAD: f64 = 1.0 / 64.0;
/// Boxes with up to so many times the least area are nothing that cutting mends: 2 is a right-angled triangle along the
/// axes. At 1 walls were cut into pieces that gained nothing by themselves, and the SAH cost rose up to 1.5 times.
const ORDINARY: f32 = 3.0;

/// The bounds of one triangle or box, in the fourth number which, and in the eighth its emptiness (0 for boxes).
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Reference(pub Bounds);

impl Reference {
    /// What stands for something that is left out.
    pub const NOTHING: Self = Self(Bounds([f32::INFINITY; 8]));

    /// The triangle's bounds, padded by what the watertight test may be off by: the ray's distance to a vertex is
    /// rounded relative to the triangle's extent (about 10 eps of it, 16 are taken; the share that grows with the
    /// distance is the ray's, see `ray.rs`). [`Reference::NOTHING`] for a triangle of no area.
    #[inline(always)]
    pub fn of_triangle(triangles: &Source<'_>, i: usize) -> Self {
        Self::of_corners(triangles.corners(i), i)
    }

    /// The same for triangle `i` of these corners.
    #[inline(always)]
    pub fn of_corners([a, b, c]: [Vec3; 3], i: usize) -> Self {
        if !can_be_hit([a, b, c]) {
            return Self::NOTHING;
        }
        let mut reference = Self::padded(a.min(b).min(c), a.max(b).max(c), i);
        // What infinitely many parts' boxes have together: the area that the triangle shows along the three axes.
        let least = 0.5 * (b - a).cross(c - a).abs().element_sum();
        reference.0.0[7] = reference.0.half_area() - ORDINARY * least;
        reference
    }

    /// By how much the parts of a triangle are to be padded, metres: by what a whole one is padded by, times length over
    /// height. The place that the test finds on a sliver is off by that much more, and the ray should be in the box there;
    /// otherwise a box that is entered too late could be left out for a hit that is farther by so little. `None` for
    /// slivers of which the pad would be a good part of the length.
    pub fn pad_of_parts([a, b, c]: [Vec3; 3]) -> Option<f64> {
        let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        let aspect = longest / (b - a).cross(c - a).length();
        let extent = (a.max(b).max(c) - a.min(b).min(c)).max_element();
        (aspect * PAD <= MOST_PAD).then_some(extent * PAD * aspect)
    }

    /// The same triangle with the bounds of one part of it, padded by `pad`, but nowhere outside of its own.
    pub fn part(&self, [low, high]: [DVec3; 2], pad: f64) -> Self {
        let low = (low - pad).as_vec3().to_array().map(f32::next_down);
        let high = (high + pad).as_vec3().to_array().map(f32::next_up);
        let mut part = *self;
        for axis in 0..3 {
            part.0.0[axis] = part.0.0[axis].max(low[axis]);
            part.0.0[axis + 4] = part.0.0[axis + 4].max(-high[axis]);
        }
        part
    }

    /// How much of the box cutting the triangle could save, square metres: its half area less `ORDINARY` times what the
    /// boxes of infinitely many parts have. Negative for ordinary triangles; infinite for nothing.
    #[inline(always)]
    pub fn emptiness(&self) -> f32 {
        self.0.0[7]
    }

    /// The box of index `i`, padded likewise; `None` if it is empty or NaN.
    pub fn of_box([low, high]: [Vec3; 2], i: usize) -> Option<Self> {
        low.cmple(high).all().then(|| Self::padded(low, high, i))
    }

    #[inline(always)]
    fn padded(low: Vec3, high: Vec3, i: usize) -> Self {
        let pad = (high - low).max_element() * PAD as f32;
        let low = (low - pad).to_array().map(f32::next_down);
        let high = (high + pad).to_array().map(f32::next_up);
        // Exponents 0x80 to 0x9f: a normal number, so that minima and sums of it cost nothing and trap nothing.
        let tag = f32::from_bits(i as u32 | 1 << 30);
        Self(Bounds([low[0], low[1], low[2], tag, -high[0], -high[1], -high[2], 0.0]))
    }

    /// Whether it stands for something.
    pub fn is_something(&self) -> bool {
        self.0.0[0] < f32::INFINITY
    }

    /// Index of the triangle or box in the source.
    pub fn primitive(&self) -> u32 {
        self.0.0[3].to_bits() & !(1 << 30)
    }

    /// Twice the centre.
    #[inline(always)]
    pub fn centre(&self) -> Vec4 {
        Vec4::from_slice(&self.0.0[..4]) - Vec4::from_slice(&self.0.0[4..])
    }
}
