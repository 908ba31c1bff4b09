//! Sheen of `KHR_materials_sheen`: the Charlie distribution of Estevez and Kulla 2017, "Production Friendly Microfacet
//! Sheen BRDF", with the visibility that the extension gives it (their fitted Lambda, without the softened terminator).
//!
//! Two departures. The formula reflects more than it receives at grazing angles where the perceptual roughness is below
//! 0.3 (three times as much at 0.07): the value is divided by its own albedo at `wo` or `wi`, whichever is more, where that
//! exceeds 1; still reciprocal. And roughness is at least 0.07, where the lobe is 0.02 of a hemisphere.

use super::tables;
use crate::material::bsdf::BsdfValue;
use crate::math::V3;
use crate::math::lanes::{cos_sin_2pi, exp, ln, safe_sqrt};
use simd::{Float, Lanes};
use std::f32::consts::TAU;

/// Perceptual roughness is at least this.
pub const LEAST_ROUGHNESS: f32 = 0.07;

/// Cosines are at least this in the formulas: the fit of Lambda goes up and down below, to an infinite value at 0.
pub const LEAST_COSINE: f32 = 1e-4;

/// Share of the samples that are uniform over the hemisphere; they bound the weight of the rest.
const UNIFORM: f32 = 0.1;

/// Sheen as seen from one direction. In lanes without any, and seen from below, there is none.
pub struct Sheen<L: Lanes> {
    wo: V3<L>,
    color: V3<L>,
    roughness: L::F,
    alpha: L::F,
    /// The fit's parameters at `alpha`.
    fit: Lambda<L>,
    lambda_o: L::F,
    /// Albedo of white at `wo`: as the formula has it, and as shaded.
    raw_o: L::F,
    albedo_o: L::F,
    /// Greatest component of `color`; 0 where there is no sheen.
    strength: L::F,
    /// Exponent of the sampler.
    power: L::F,
    is_on: L::M,
}

impl<L: Lanes> Sheen<L> {
    /// Of `color` in [0, 1] and perceptual `roughness` in [0, 1], seen from `wo` (unit).
    #[inline(always)]
    pub fn new(color: V3<L>, roughness: L::F, wo: V3<L>) -> Self {
        let (zero, one) = (L::F::zero(), L::F::one());
        let strength = color.max_component();
        let is_on = strength.gt(zero) & wo.z.gt(zero);
        let wo = V3::<L>::new(wo.x, wo.y, wo.z.max(L::F::splat(LEAST_COSINE)));
        let roughness = roughness.max(L::F::splat(LEAST_ROUGHNESS)).min(one);
        let alpha = roughness * roughness;
        let fit = Lambda::new(alpha);
        let [raw_o, albedo_o] = tables::sheen::<L>(wo.z, roughness);
        Self {
            wo,
            color: color.masked(is_on),
            roughness,
            alpha,
            lambda_o: fit.at(wo.z),
            fit,
            raw_o,
            albedo_o,
            strength: strength.masked(is_on),
            power: (one / roughness - one) * L::F::splat(0.5),
            is_on,
        }
    }

    /// What is left for what lies below, for light from `wi`, in [0, 1]; 1 without sheen. As the extension has it: `min(1 -
    /// max3(color) E(wo), 1 - max3(color) E(wi))`; below the surface, where light does not come through the sheen, the first.
    #[inline(always)]
    pub fn scale(&self, wi: V3<L>) -> L::F {
        let one = L::F::one();
        let mu = wi.z.max(L::F::splat(LEAST_COSINE)).min(one);
        let [_, albedo_i] = tables::sheen::<L>(mu, self.roughness);
        let albedo_i = albedo_i.masked(wi.z.gt(L::F::zero()));
        one - self.strength * self.albedo_o.max(albedo_i)
    }

    /// Share of light that the sheen itself reflects, per colour.
    #[inline(always)]
    pub fn albedo(&self) -> V3<L> {
        self.color.scale(self.albedo_o)
    }

    /// Value and density for `wi`; 0 below the horizon.
    #[inline(always)]
    pub fn eval(&self, wi: V3<L>) -> BsdfValue<L> {
        let (one, half) = (L::F::one(), L::F::splat(0.5));
        let seen = wi.z.gt(L::F::zero()) & self.is_on;
        let mu = wi.z.max(L::F::splat(LEAST_COSINE)).min(one);
        // The sine of the half vector's angle from x and y: 1 - z^2 has no digits left near the normal.
        let (x, y, z) = (self.wo.x + wi.x, self.wo.y + wi.y, self.wo.z + mu);
        let across = x.mul_add(x, y * y);
        let sin2 = across / z.mul_add(z, across);
        let inverse = one / self.alpha;
        let d = (inverse + L::F::splat(2.0)) * exp::<L>(ln::<L>(sin2) * half * inverse) * L::F::splat(1.0 / TAU);
        let lambda = self.lambda_o + self.fit.at(mu);
        let [raw_i, _] = tables::sheen::<L>(mu, self.roughness);
        let above = self.raw_o.max(raw_i).max(one);
        let value = (d / ((one + lambda) * L::F::splat(4.0) * self.wo.z * above)).masked(seen);
        BsdfValue { f_cos: self.color.scale(value), pdf: self.pdf(wi.z.min(one)).masked(seen) }
    }

    /// A direction by `u` in [0, 1)^2, by the density of [`Sheen::eval`]; z > 0.
    ///
    /// Cosines by `(1 - mu)^k` with k = (1/roughness - 1) / 2, in the mean over azimuth and cosine the best of the powers:
    /// standard deviation over mean at roughness 0.07, 0.2, 0.5 and 1, mu 0.02: 0.8, 0.7, 0.5, 0.2; uniform 2.4, 1.2, 0.5,
    /// 0.2; by the cosine 7.9, 3.2, 1.5, 1.1.
    #[inline(always)]
    pub fn sample(&self, u: [L::F; 2]) -> V3<L> {
        let one = L::F::one();
        let share = L::F::splat(UNIFORM);
        let uniform = u[0].lt(share);
        let rest = (u[0] - share) * L::F::splat(1.0 / (1.0 - UNIFORM));
        let sharp = one - exp::<L>(ln::<L>(one - rest) / (one + self.power));
        let mu = (u[0] * L::F::splat(1.0 / UNIFORM)).or_else(uniform, sharp);
        // The horizon itself is below it.
        let mu = mu.max(L::F::splat(1e-7)).min(one);
        let (cos_phi, sin_phi) = cos_sin_2pi::<L>(u[1]);
        let r = safe_sqrt((one - mu) * (one + mu));
        V3::new(r * cos_phi, r * sin_phi, mu)
    }

    /// Density of [`Sheen::sample`] at cosine `mu`, 1/sr.
    #[inline(always)]
    fn pdf(&self, mu: L::F) -> L::F {
        let one = L::F::one();
        let sharp = (one + self.power) * exp::<L>(ln::<L>(one - mu) * self.power);
        sharp.mul_add(L::F::splat((1.0 - UNIFORM) / TAU), L::F::splat(UNIFORM / TAU))
    }
}

/// The fit of Lambda at one roughness: `l(x) = a / (1 + b x^c) + d x + e`.
struct Lambda<L: Lanes> {
    a: L::F,
    b: L::F,
    c: L::F,
    d: L::F,
    e: L::F,
    /// `2 l(1/2)`.
    twice_middle: L::F,
}

impl<L: Lanes> Lambda<L> {
    #[inline(always)]
    fn new(alpha: L::F) -> Self {
        let rest = L::F::one() - alpha;
        let t = rest * rest;
        let mut fit = Self {
            a: mix::<L>(21.5473, 25.3245, t),
            b: mix::<L>(3.82987, 3.32435, t),
            c: mix::<L>(0.19823, 0.16801, t),
            d: mix::<L>(-1.97760, -1.27393, t),
            e: mix::<L>(-4.32054, -4.85967, t),
            twice_middle: L::F::zero(),
        };
        fit.twice_middle = L::F::splat(2.0) * fit.l(L::F::splat(0.5));
        fit
    }

    #[inline(always)]
    fn l(&self, x: L::F) -> L::F {
        let power = exp::<L>(self.c * ln::<L>(x));
        self.d.mul_add(x, self.a / self.b.mul_add(power, L::F::one()) + self.e)
    }

    /// Lambda at cosine `mu` in (0, 1].
    #[inline(always)]
    fn at(&self, mu: L::F) -> L::F {
        let one = L::F::one();
        let low = mu.lt(L::F::splat(0.5));
        let l = self.l(mu.or_else(low, one - mu));
        exp::<L>(l.or_else(low, self.twice_middle - l))
    }
}

#[inline(always)]
fn mix<L: Lanes>(at_1: f32, at_0: f32, t: L::F) -> L::F {
    t.mul_add(L::F::splat(at_0 - at_1), L::F::splat(at_1))
}
