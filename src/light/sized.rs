//! Point and spot lights that are balls (`--light-radius`), directional ones that are discs in the sky (`--sun-angle`);
//! glowing meshes that are bulbs (`bulb.rs`).
//!
//! Both fill a cone of directions, each of which is as likely to be sampled. A ball of intensity I has the radiance
//! `I / (pi r^2)`, a sun of illuminance E `E / (pi sin^2)` of its angular radius: where all of it is above the horizon, a
//! surface gets what it gets of the light without size. What a spot sends to a point goes by the direction from its middle.
//! They are no geometry: rays go through them. 1 - cos of the cone is kept, never cos: exact however narrow it is.

use super::element::{Element, LightSample};
use crate::math::lanes::{cos_sin_2pi, safe_sqrt};
use crate::math::{Frame, V3};
use simd::{Float, Lanes, Mask};
use std::f32::consts::{PI, TAU};

/// Where rays meet a light with a size.
pub struct Met<L: Lanes> {
    /// Nits.
    pub radiance: V3<L>,
    /// With which the light is sampled there, once chosen, 1/sr.
    pub pdf: L::F,
    /// To the surface of a ball, metres.
    pub distance: L::F,
    /// Lanes that meet it.
    pub meets: L::M,
}

/// Squared sine and 1 - cos of the half angle at which a ball is seen: `sin2` < 1.
#[inline(always)]
fn depth_of_ball<L: Lanes>(sin2: L::F) -> L::F {
    let one = L::F::one();
    sin2 / (one + safe_sqrt(one - sin2))
}

/// Directions in the cones of 1 - cos `depth` about `axis` (unit), each as likely; 1 - cos of each from the axis.
#[inline(always)]
fn in_cone<L: Lanes>(axis: V3<L>, depth: L::F, u: [L::F; 2]) -> (V3<L>, L::F) {
    let below = u[0] * depth;
    let sin = safe_sqrt(below * (L::F::splat(2.0) - below));
    let (c, s) = cos_sin_2pi::<L>(u[1]);
    (Frame::around(axis).to_world(V3::new(sin * c, sin * s, L::F::one() - below)), below)
}

/// One over the cone at which a ball is seen, 1/sr; 0 inside of it.
#[inline(always)]
fn pdf_of_ball<F: Float>(radius2: F, distance2: F) -> F {
    let one = F::one();
    let sin2 = radius2 / distance2;
    // (1 - cos) = sin^2 / (1 + cos).
    let pdf = (one + safe_sqrt(one - sin2)) / (sin2 * F::splat(TAU));
    pdf.masked(sin2.lt(one))
}

impl<L: Lanes> Element<L> {
    /// Directions towards the bulbs number `light`, as seen from `p`: none from within their spheres. What the ray meets is
    /// to be found.
    #[inline(always)]
    pub fn sample_bulb(&self, light: L::U, p: V3<L>, u: [L::F; 2]) -> LightSample<L> {
        let (one, none) = (L::F::one(), L::M::from_bits(0));
        let v = V3::<L>::of_record(&self.records[0]) - p;
        let radius2 = self.records[2][2];
        let distance2 = v.dot(v);
        let distance = distance2.sqrt();
        let (wi, below) = in_cone(v.scale(one / distance), depth_of_ball::<L>(radius2 / distance2), u);
        let pdf = self.pmf * pdf_of_ball(radius2, distance2);
        // Where the sphere ends behind it, and where it begins.
        let sin2 = below * (L::F::splat(2.0) - below);
        let far = distance * ((one - below) + safe_sqrt(radius2 / distance2 - sin2));
        let near = (distance2 - radius2) / far;
        LightSample {
            radiance: V3::splat([1.0; 3]),
            wi,
            pdf,
            is_hidden: none,
            end: wi.mul_add(near, p),
            sought: light,
            reach: far,
            is_distant: none,
            valid: pdf.gt(L::F::zero()) & pdf.is_finite() & wi.is_finite(),
            total: L::F::zero(),
        }
    }

    /// Density (1/sr) of a direction towards the bulbs from `p`, given that they are chosen: 0 within their spheres.
    #[inline(always)]
    pub fn pdf_of_bulb(&self, p: V3<L>) -> L::F {
        let v = V3::<L>::of_record(&self.records[0]) - p;
        pdf_of_ball(self.records[2][2], v.dot(v))
    }

    /// The point, spot and directional lights, as seen from `p`, a point outside of them. Scattered rays find
    /// suns and, if `finds_balls`, balls.
    #[inline(always)]
    pub fn sample_sized(&self, p: V3<L>, u: [L::F; 2], finds_balls: bool) -> LightSample<L> {
        let small = self.sample_punctual(p);
        let (zero, one, two) = (L::F::zero(), L::F::one(), L::F::splat(2.0));
        let size = self.records[2][2];
        let is_sized = size.gt(zero);
        let to_middle = small.end - p;
        let distance2 = to_middle.dot(to_middle);
        let sin2 = size / distance2;
        let outside = small.is_distant | sin2.lt(one);
        let depth = size.or_else(small.is_distant, depth_of_ball::<L>(sin2));
        let sin2_of_cone = (depth * (two - depth)).or_else(small.is_distant, sin2);
        let (wi, below) = in_cone(small.wi, depth, u);
        let sin2_of_direction = below * (two - below);
        // The near side of the ball, in units of the distance to its middle.
        let t = (one - sin2) / ((one - below) + safe_sqrt(sin2 - sin2_of_direction));
        let near = wi.mul_add(t * distance2.sqrt(), p);
        // Of what no scattered ray finds only the product with the cone matters.
        let cone = depth * L::F::splat(TAU);
        let is_hidden = if finds_balls { !is_sized } else { !(is_sized & small.is_distant) };
        let radiance = small.radiance.scale(one / (sin2_of_cone * L::F::splat(PI)));
        let gathered = radiance.scale(cone);
        let radiance = gathered.or_else(is_hidden, radiance).or_else(is_sized, small.radiance);
        LightSample {
            radiance,
            wi: wi.or_else(is_sized, small.wi),
            pdf: small.pdf.or_else(is_hidden, small.pdf / cone),
            is_hidden,
            end: wi.or_else(small.is_distant, near).or_else(is_sized, small.end),
            valid: small.valid & outside & radiance.is_finite() & wi.is_finite(),
            ..small
        }
    }

    /// What rays from `p` along the unit vectors `d` meet of a ball.
    #[inline(always)]
    pub fn meet_ball(&self, p: V3<L>, d: V3<L>) -> Met<L> {
        let small = self.sample_punctual(p);
        let size = self.records[2][2];
        let v = small.end - p;
        let (distance2, along) = (v.dot(v), v.dot(d));
        let off = d.mul_add(-along, v);
        let off2 = off.dot(off);
        let sin2 = size / distance2;
        let meets = off2.lt(size) & size.lt(distance2) & along.gt(L::F::zero()) & small.valid;
        Met {
            radiance: small.radiance.scale(L::F::one() / (sin2 * L::F::splat(PI))),
            pdf: L::F::one() / (depth_of_ball::<L>(sin2) * L::F::splat(TAU)),
            distance: (distance2 - size) / (along + safe_sqrt(size - off2)),
            meets,
        }
    }

    /// What rays along the unit vectors `d` meet of a sun.
    #[inline(always)]
    pub fn meet_sun(&self, d: V3<L>) -> Met<L> {
        let depth = self.records[2][2];
        let apart = d - V3::<L>::of_record(&self.records[0]);
        let sin2 = depth * (L::F::splat(2.0) - depth);
        Met {
            radiance: V3::<L>::of_record(&self.records[3]).scale(L::F::one() / (sin2 * L::F::splat(PI))),
            pdf: L::F::one() / (depth * L::F::splat(TAU)),
            distance: L::F::splat(f32::INFINITY),
            // Half the squared distance of unit vectors is 1 - cos.
            meets: (apart.dot(apart) * L::F::splat(0.5)).lt(depth),
        }
    }
}

#[cfg(test)]
#[path = "sized_tests.rs"]
mod tests;
