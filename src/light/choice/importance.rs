//! How much light a point may expect of a light or of a group of them: irradiance without anything in between.
//!
//! After Conty Estevez and Kulla 2018 (see `bounds.rs`), in the form without angles of pbrt-v4, section 12.6.3. Never 0
//! for a light that can contribute and that no scattered ray finds.

use crate::math::{V3, lanes::safe_sqrt};
use simd::{Float, Lanes};

/// Squared distances are at least this, m^2, so that no direction is 0 / 0.
const LEAST_SQUARE: f32 = 1e-37;
/// A point is behind a flat light if it is this far behind its plane, in radii.
const BEHIND: f32 = 2e-3;

/// Points that choose a light.
#[derive(Clone, Copy)]
pub struct Receiver<L: Lanes> {
    /// Metres, prepared space.
    pub p: V3<L>,
    /// Unit normal on the side that light is gathered on.
    pub n: V3<L>,
    /// Lanes that gather light on both sides.
    pub both_sides: L::M,
    /// Least share of a light that counts for what is behind the normal, where the normal does not say which light can
    /// contribute; else 0.
    pub least: L::F,
}

/// Records of one light or group, see [`super::super::bounds::Bounds::records`].
///
/// | record | x, y, z | w |
/// |---|---|---|
/// | 0 | centre | radius, metres |
/// | 1 | axis | cosine of the cone, exactly 1: flat |
/// | 2 | strength / radius^2, start and slope of the falloff (slope < 0: both sides) | 1 / the most that it can give |
pub type Group<L> = [[<L as Lanes>::F; 4]; 3];

/// The importance of a group of surfaces and points, and how large it is seen: radius / distance.
#[inline(always)]
pub fn of_group<L: Lanes>(group: &Group<L>, at: &Receiver<L>) -> (L::F, L::F) {
    let [place, direction, light] = group;
    let (zero, one) = (L::F::zero(), L::F::one());
    let v = V3::<L>::of_record(place) - at.p;
    let inverse = one / v.dot(v).max(L::F::splat(LEAST_SQUARE)).sqrt();
    let size = place[3] * inverse;
    let inside = size.ge(one);
    // The angle at which the ball around it is seen.
    let sin_ball = size.min(one);
    let square = sin_ball * sin_ball;
    let cos_ball = safe_sqrt(one - square);

    // The least angle between a direction that it shines in and one to the point.
    let (cos_cone, two_sided) = (direction[3], light[2].lt(zero));
    let along = -(V3::<L>::of_record(direction).dot(v) * inverse);
    let cos = along.abs().or_else(two_sided, along);
    let sin = safe_sqrt(one - cos * cos);
    let sin_cone = safe_sqrt(one - cos_cone * cos_cone);
    let within = cos.ge(cos_cone);
    let (cos, sin) = (
        one.or_else(within, cos.mul_add(cos_cone, sin * sin_cone)),
        zero.or_else(within, sin.mul_add(cos_cone, -(cos * sin_cone))),
    );
    let cos = one.or_else(inside | cos.ge(cos_ball), cos.mul_add(cos_ball, sin * sin_ball));
    let shines = ((cos - light[1]) * light[2].abs()).max(zero).min(one);
    let hidden = cos_cone.eq(one) & !two_sided & along.lt(-(size * L::F::splat(BEHIND)));
    let shines = zero.or_else(hidden, shines);

    let receives = facing(v, inverse, at);
    let sin = safe_sqrt(one - receives * receives);
    let receives = one.or_else(inside | receives.ge(cos_ball), receives.mul_add(cos_ball, sin * sin_ball));
    let irradiance = light[0] * square * shines * receives.max(at.least);
    // What fills much of what the point sees is found by scattered rays.
    let left = (one - irradiance * light[3]).max(zero);
    (irradiance * left, size)
}

/// The importance of a point or spot light: as exact as [`of_group`], for less.
#[inline(always)]
pub fn of_point<L: Lanes>(group: &Group<L>, at: &Receiver<L>) -> L::F {
    let [place, direction, light] = group;
    let (zero, one) = (L::F::zero(), L::F::one());
    let v = V3::<L>::of_record(place) - at.p;
    let inverse = one / v.dot(v).max(L::F::splat(LEAST_SQUARE)).sqrt();
    let size = (place[3] * inverse).min(one);
    let cos = -(V3::<L>::of_record(direction).dot(v) * inverse);
    let shines = ((cos - light[1]) * light[2]).max(zero).min(one);
    light[0] * size * size * shines * facing(v, inverse, at).max(at.least)
}

/// The importance of a point or spot light that is a ball: [`of_point`] where all of it is above the horizon.
#[inline(always)]
pub fn of_ball<L: Lanes>(group: &Group<L>, at: &Receiver<L>) -> L::F {
    let [place, direction, light] = group;
    let (zero, one) = (L::F::zero(), L::F::one());
    let v = V3::<L>::of_record(place) - at.p;
    let inverse = one / v.dot(v).max(L::F::splat(LEAST_SQUARE)).sqrt();
    let size = (place[3] * inverse).min(one);
    let cos = -(V3::<L>::of_record(direction).dot(v) * inverse);
    let shines = ((cos - light[1]) * light[2]).max(zero).min(one);
    light[0] * size * size * shines * facing_disc(facing(v, inverse, at), size, at).max(at.least)
}

/// The importance of parallel light: direction towards it and illuminance, the sine of its angular radius.
#[inline(always)]
pub fn of_sun<L: Lanes>([sun, size]: &[[L::F; 4]; 2], at: &Receiver<L>) -> L::F {
    sun[3] * facing_disc(facing(V3::<L>::of_record(sun), L::F::one(), at), size[0], at).max(at.least)
}

/// The mean cosine over a disc of directions of the sine `size` about one of the cosine `cos`: what is above the horizon,
/// by a parabola that meets both ends in value and slope. Above 0 where any of it is.
#[inline(always)]
fn facing_disc<L: Lanes>(cos: L::F, size: L::F, at: &Receiver<L>) -> L::F {
    let above = cos + size;
    let part = (above * above * L::F::splat(0.25) / size).masked(above.gt(L::F::zero()));
    // Both sides gather all of it.
    cos.or_else(at.both_sides | cos.ge(size), part)
}

/// Cosine between the normal and `v` of length 1 / `inverse`.
#[inline(always)]
fn facing<L: Lanes>(v: V3<L>, inverse: L::F, at: &Receiver<L>) -> L::F {
    let cos = at.n.dot(v) * inverse;
    cos.abs().or_else(at.both_sides, cos)
}
