//! A node of the tree in 32 bytes: what takes time on the way down is reading nodes, not their arithmetic.
//!
//! | record | x | y | z | w |
//! |---|---|---|---|---|
//! | 0 | centre x | y | z | radius |
//! | 1 | strength / radius^2 | axis: 3 x 10 bits; bit 30: both sides | cone: 12 bits, start: 10, slope: 10 | right child |
//!
//! Rounded so that a node never looks darker than it is: cones wider, starts lower, slopes steeper. How much of the view a
//! light fills is not kept: nothing surrounds a point in a scene of hundreds of lights.

use super::importance::Group;
use simd::{Float, Lanes, Uint};

/// Steps of a component of an axis on either side of 0.
const AXIS: f32 = 511.0;
/// Steps of the cosine of a cone between -1 and 1.
const CONE: f32 = 2048.0;
/// Steps of a start from 0 to 1.
const START: f32 = 512.0;
/// An axis of rounded components is off by at most sqrt(3) / 2 of a step, rad.
const AXIS_ERROR: f32 = 0.87 / AXIS;
const BOTH_SIDES: u32 = 1 << 30;
/// Exponent and two bits of the mantissa of a positive f32.
const SLOPE_SHIFT: u32 = 21;

/// A node of these records ([`crate::light::bounds::Bounds::records`]).
pub fn pack(&[place, direction, light]: &[[f32; 4]; 3], right: u32) -> [[f32; 4]; 2] {
    let [x, y, z, cone] = direction;
    let step = |v: f32, by: u32| (((v * AXIS).round() + AXIS) as u32) << by;
    let [strength, start, slope, _] = light;
    let both_sides = if slope < 0.0 { BOTH_SIDES } else { 0 };
    let cone = (cone.clamp(-1.0, 1.0).acos() + AXIS_ERROR).min(std::f32::consts::PI).cos();
    // Rounded down, and once more for the rounding of acos and cos.
    let cone = ((cone + 1.0) * (0.5 * CONE)).floor().max(1.0) as u32 - 1;
    let start = ((start.max(-1.0) + 1.0) * START).floor().min(2.0 * START - 1.0) as u32;
    // Rounded up.
    let slope = (slope.abs().to_bits() + (1 << SLOPE_SHIFT) - 1) >> SLOPE_SHIFT;
    let axis = step(x, 0) | step(y, 10) | step(z, 20) | both_sides;
    let falloff = cone << 20 | start << 10 | slope;
    [place, [strength, f32::from_bits(axis), f32::from_bits(falloff), f32::from_bits(right)]]
}

/// The bounds in a node's two records.
#[inline(always)]
pub fn unpack<L: Lanes>(place: [L::F; 4], record: &[L::F; 4]) -> Group<L> {
    let f = |v: f32| L::F::splat(v);
    let (axis, falloff) = (record[1].to_bits(), record[2].to_bits());
    let ten = L::U::splat(1023);
    let x = (axis & ten).to_float().mul_add(f(1.0 / AXIS), f(-1.0));
    let y = (axis.shr(10) & ten).to_float().mul_add(f(1.0 / AXIS), f(-1.0));
    let z = (axis.shr(20) & ten).to_float().mul_add(f(1.0 / AXIS), f(-1.0));
    let cone = falloff.shr(20).to_float().mul_add(f(2.0 / CONE), f(-1.0));
    let start = (falloff.shr(10) & ten).to_float().mul_add(f(1.0 / START), f(-1.0));
    let slope = (falloff & ten).shl(SLOPE_SHIFT).to_float_bits();
    let slope = (-slope).or_else(axis.has(BOTH_SIDES), slope);
    [place, [x, y, z, cone], [record[0], start, slope, L::F::zero()]]
}
