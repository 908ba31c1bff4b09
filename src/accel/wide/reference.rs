//! Boxes as the builder keeps them: 8 numbers, so that one minimum grows a box on all six sides.

use super::source::Source;
use crate::accel::woop::can_be_hit;
use glam::{Vec3, Vec4};
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

/// The bounds of one triangle or box, and in the fourth number which.
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
        let [a, b, c] = triangles.corners(i);
        if can_be_hit([a, b, c]) { Self::padded(a.min(b).min(c), a.max(b).max(c), i) } else { Self::NOTHING }
    }

    /// The box of index `i`, padded likewise; `None` if it is empty or NaN.
    pub fn of_box([low, high]: [Vec3; 2], i: usize) -> Option<Self> {
        low.cmple(high).all().then(|| Self::padded(low, high, i))
    }

    #[inline(always)]
    fn padded(low: Vec3, high: Vec3, i: usize) -> Self {
        let pad = (high - low).max_element() * 2f32.powi(-20);
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
