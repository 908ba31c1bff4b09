//! Rectangles by solid angle: every direction towards one as likely.
//!
//! After Urena, Fajardo and King 2013, "An Area-Preserving Parametrization for Spherical Rectangles", EGSR. Deviations: arc
//! cosines by a polynomial, and 1 - cu^2 of their equation for xu written without its cancellation close to the rectangle.
//! Points that see little of it, or nearly the half space, sample its area: in f32 the excess over 2 pi is off by 1e-6,
//! and by 6e-5 where the edges are seen from a thousandth of their length over the plane.

use crate::math::V3;
use crate::math::lanes::{cos_sin_2pi, safe_sqrt};
use simd::{Float, Lanes};
use std::f32::consts::{PI, TAU};

/// Solid angles by which a rectangle is sampled, sr.
const LEAST: f32 = 0.05;
const MOST: f32 = 5.0;
/// Above it the sheet of directions runs along the other edge, to the last bit.
const ALONG: f32 = 1.0 - 1e-6;

/// A rectangle as points see it: the names are those of the paper, z pointing away from it.
pub struct Span<L: Lanes> {
    x: [L::F; 2],
    y: [L::F; 2],
    z: L::F,
    b: [L::F; 2],
    k: L::F,
    /// One over the lengths of the edges.
    inverse: [L::F; 2],
    solid_angle: L::F,
}

/// Arc cosine, absolute error 1e-7 (Abramowitz and Stegun 4.4.46).
#[inline(always)]
fn acos<F: Float>(c: F) -> F {
    let f = |v: f32| F::splat(v);
    let a = c.abs();
    let p = f(-0.001_262_491_1).mul_add(a, f(0.006_670_09)).mul_add(a, f(-0.017_088_126));
    let p = p.mul_add(a, f(0.030_891_88)).mul_add(a, f(-0.050_174_303)).mul_add(a, f(0.088_978_99));
    let p = p.mul_add(a, f(-0.214_598_8)).mul_add(a, f(std::f32::consts::FRAC_PI_2));
    let acute = p * safe_sqrt(F::one() - a);
    acute.or_else(c.ge(F::zero()), f(PI) - acute)
}

impl<L: Lanes> Span<L> {
    /// The rectangle with the corner `v0`, the edges `e1` and `e2`, the unit normal `ng` on either side, and one over the
    /// lengths of its edges, seen from `p`.
    #[inline(always)]
    pub fn new(p: V3<L>, v0: V3<L>, [e1, e2]: [V3<L>; 2], ng: V3<L>, inverse: [L::F; 2]) -> Self {
        let d = v0 - p;
        let (x0, y0) = (d.dot(e1) * inverse[0], d.dot(e2) * inverse[1]);
        let (x1, y1) = (e1.dot(e1).mul_add(inverse[0], x0), e2.dot(e2).mul_add(inverse[1], y0));
        let z = -d.dot(ng).abs();
        let zz = z * z;
        let (n0, n1) = (-(y0 / y0.mul_add(y0, zz).sqrt()), x1 / x1.mul_add(x1, zz).sqrt());
        let (n2, n3) = (y1 / y1.mul_add(y1, zz).sqrt(), -(x0 / x0.mul_add(x0, zz).sqrt()));
        let k = L::F::splat(TAU) - acos(-(n2 * n3)) - acos(-(n3 * n0));
        let solid_angle = acos(-(n0 * n1)) + acos(-(n1 * n2)) - k;
        Self { x: [x0, x1], y: [y0, y1], z, b: [n0, n2], k, inverse, solid_angle }
    }

    /// Lanes that sample the solid angle; false for NaN.
    #[inline(always)]
    pub fn is_large(&self) -> L::M {
        self.solid_angle.gt(L::F::splat(LEAST)) & self.solid_angle.lt(L::F::splat(MOST))
    }

    /// Density of a direction, 1/sr.
    #[inline(always)]
    pub fn pdf(&self) -> L::F {
        L::F::one() / self.solid_angle
    }

    /// Shares of both edges at which the point of the numbers `u` lies.
    #[inline(always)]
    pub fn sample(&self, u: [L::F; 2]) -> [L::F; 2] {
        let Self { x: [x0, x1], y: [y0, y1], z, b: [b0, b1], k, inverse, solid_angle } = *self;
        let (zero, one) = (L::F::zero(), L::F::one());
        let turns = u[0].mul_add(solid_angle, k) * L::F::splat(1.0 / TAU);
        let (cos, sin) = cos_sin_2pi::<L>(turns - turns.floor());
        let fu = cos.mul_add(b0, -b1) / sin;
        let zz = z * z;
        // 1 - b0^2.
        let c2 = zz / y0.mul_add(y0, zz);
        let xu = (-(z / safe_sqrt(fu.mul_add(fu, -c2)))).copysign(fu).max(x0).min(x1);
        let dd = xu.mul_add(xu, zz);
        let (h0, h1) = (y0 / y0.mul_add(y0, dd).sqrt(), y1 / y1.mul_add(y1, dd).sqrt());
        let h = u[1].mul_add(h1 - h0, h0);
        let hh = h * h;
        let inside = h * (dd / (one - hh).max(L::F::splat(f32::MIN_POSITIVE))).sqrt();
        let yv = inside.or_else(hh.lt(L::F::splat(ALONG)), y1);
        [((xu - x0) * inverse[0]).max(zero).min(one), ((yv - y0) * inverse[1]).max(zero).min(one)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::tests::at_all_levels;
    use crate::math::random::Rng;
    use glam::{DVec3, Vec3};
    use simd::{Kernel, Mask};

    /// Of a triangle seen from the origin (van Oosterom and Strackee 1983).
    fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).abs().atan2(below)
    }

    #[derive(Clone)]
    struct Check;

    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let mut rng = Rng::new(6);
            let (mut large, mut cases) = (0, 0);
            for size in [1e-6_f32, 1.0, 1e6] {
                for _ in 0..300 {
                    cases += 1;
                    let axis = rng.direction();
                    let e1 = rng.direction().cross(axis).normalize();
                    let (l1, l2) = (size * rng.range(0.2, 3.0), size * rng.range(0.2, 3.0));
                    let (e1, e2) = (e1 * l1, axis.cross(e1).normalize() * l2);
                    // In its plane and at its edges, too.
                    let height = size * [0.0, 1e-3, 0.03, 0.3, 1.0, 5.0, 1e4][rng.below(7)];
                    let v0 = axis * height - e1 * rng.range(-1.0, 2.0) - e2 * rng.range(-1.0, 2.0);
                    let v3 = |v: Vec3| V3::<L>::splat(v.to_array());
                    let inverse = [L::F::splat(1.0 / l1), L::F::splat(1.0 / l2)];
                    let span = Span::new(V3::zero(), v3(v0), [v3(e1), v3(e2)], v3(axis), inverse);
                    let [a, b, c] = [v0, v0 + e1, v0 + e2].map(|corner| corner.as_dvec3());
                    let exact = solid_angle([a, b, c]) + solid_angle([b + c - a, c, b]);
                    let found = f64::from(span.solid_angle.first());
                    if span.is_large().bits() == 0 {
                        assert!(!(0.06..4.9).contains(&exact) || found.is_nan(), "{found} for {exact}");
                        continue;
                    }
                    large += 1;
                    assert!((found / exact - 1.0).abs() < 2e-3, "{found} for {exact} at {height} of {size}");
                    // The irradiance along each edge and the normal: moments of the directions.
                    let n = 48;
                    let mut mean = DVec3::ZERO;
                    for i in 0..n * n {
                        let u = [i % n, i / n].map(|i| L::F::splat((i as f32 + 0.5) / n as f32));
                        let [s, t] = span.sample(u).map(|share| f64::from(share.first()));
                        assert!((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t), "{s}, {t}");
                        mean += (a + (b - a) * s + (c - a) * t).normalize();
                    }
                    let mean = mean / f64::from(n * n) * exact;
                    // Lambert: the vector irradiance of a polygon is half the sum of its edges' angles.
                    let corners = [a, b, b + c - a, c];
                    let mut lambert = DVec3::ZERO;
                    for i in 0..4 {
                        let (v, w) = (corners[i], corners[(i + 1) % 4]);
                        let cross = v.cross(w);
                        lambert += 0.5 * cross.length().atan2(v.dot(w)) * cross.normalize_or_zero();
                    }
                    let lambert = if lambert.dot(mean) < 0.0 { -lambert } else { lambert };
                    assert!((mean - lambert).length() < 4e-3 * exact, "{mean} for {lambert} at {height} of {size}");
                }
            }
            assert!(large > cases / 4, "{large} of {cases} are sampled by solid angle");
        }
    }

    #[test]
    fn lgt_03_rectangles_are_sampled_evenly_in_solid_angle_at_every_size() {
        at_all_levels(Check);
    }
}
