//! The coat of `KHR_materials_clearcoat`: a dielectric layer of index 1.5 with its own normal and roughness.
//!
//! GGX with exact Fresnel, and the share of multiple scattering that Turquin 2019 gives a lobe of its reflectance at normal
//! incidence. What the coat does not reflect goes to what lies below: that is scaled by `1 - factor x albedo(wo)`, so white
//! stays white whatever is below. The scale depends on the viewer alone and so is not reciprocal; the extension's own
//! (`1 - factor x F(wo . n)`) is not either.

use super::{fresnel, ggx, tables};
use crate::material::bsdf::{BsdfValue, DELTA_ALPHA};
use crate::math::V3;
use simd::{Float, Lanes};

/// Index of refraction.
pub const IOR: f32 = 1.5;
/// Reflectance at normal incidence.
const F0: f32 = 0.04;

/// Reflectance of a smooth coat at cosine `cos` >= 0.
#[inline(always)]
pub fn reflectance<L: Lanes>(cos: L::F) -> L::F {
    fresnel::dielectric::<L>(cos, L::F::splat(IOR))
}

/// A coat as seen from one direction. In lanes without one, and where its normal is turned from the viewer, there is none.
pub struct Coat<L: Lanes> {
    wo: V3<L>,
    factor: L::F,
    alpha: L::F,
    visible: ggx::Visible<L>,
    /// What multiple scattering multiplies by.
    boost: L::F,
    /// Times factor.
    albedo: L::F,
    is_on: L::M,
    is_delta: L::M,
}

impl<L: Lanes> Coat<L> {
    /// Of strength `factor` in [0, 1] and perceptual `roughness` in [0, 1], seen from `wo` (unit, about the coat's normal).
    #[inline(always)]
    pub fn new(factor: L::F, roughness: L::F, wo: V3<L>) -> Self {
        let (zero, one) = (L::F::zero(), L::F::one());
        let is_on = factor.gt(zero) & wo.z.gt(zero);
        let wo = V3::<L>::new(wo.x, wo.y, wo.z.max(L::F::splat(1e-6)));
        let smooth = roughness * roughness;
        let is_delta = smooth.lt(L::F::splat(DELTA_ALPHA)) & is_on;
        let alpha = smooth.max(L::F::splat(DELTA_ALPHA));
        let smooth_albedo = reflectance::<L>(wo.z);
        let [ratio, white] = tables::coat::<L>(wo.z, roughness);
        let boost = (one - white) * L::F::splat(F0) / white + one;
        let albedo = smooth_albedo.or_else(is_delta, (smooth_albedo * ratio).min(one));
        Self {
            wo,
            factor,
            alpha,
            visible: ggx::Visible::new(wo, alpha, alpha),
            boost,
            albedo: (factor * albedo).masked(is_on),
            is_on,
            is_delta,
        }
    }

    /// What is left for all that lies below, in [0, 1]; 1 without a coat.
    #[inline(always)]
    pub fn scale(&self) -> L::F {
        L::F::one() - self.albedo
    }

    /// Share of light that the coat itself reflects, in [0, 1]: for choosing between lobes.
    #[inline(always)]
    pub fn albedo(&self) -> L::F {
        self.albedo
    }

    /// Lanes whose coat is a mirror.
    #[inline(always)]
    pub fn is_delta(&self) -> L::M {
        self.is_delta
    }

    /// What the mirror reflects, in the direction that [`Coat::sample`] gives; 0 in all other lanes.
    #[inline(always)]
    pub fn mirror(&self) -> L::F {
        self.albedo.masked(self.is_delta)
    }

    /// Value and density for `wi`; 0 for mirrors and below the coat's horizon.
    #[inline(always)]
    pub fn eval(&self, wi: V3<L>) -> BsdfValue<L> {
        let one = L::F::one();
        let glossy = wi.z.gt(L::F::zero()) & self.is_on & !self.is_delta;
        let wi = V3::<L>::new(wi.x, wi.y, wi.z.max(L::F::splat(1e-12)));
        let h = (self.wo + wi).normalized();
        let fresnel = reflectance::<L>(self.wo.dot(h));
        let inverse = one / self.alpha;
        let d = ggx::distribution(h, [inverse, inverse]);
        let lambda = ggx::masking(self.wo, self.alpha, self.alpha) + ggx::masking(wi, self.alpha, self.alpha);
        let f_cos = self.factor * self.boost * fresnel * d / ((one + lambda) * L::F::splat(4.0) * self.wo.z);
        let f_cos = f_cos.masked(glossy);
        BsdfValue { f_cos: V3::new(f_cos, f_cos, f_cos), pdf: self.visible.pdf_reflected(d).masked(glossy) }
    }

    /// A direction by `u` in [0, 1)^2, by the density of [`Coat::eval`]; the mirror's in lanes of [`Coat::is_delta`]. Not
    /// valid where its z is not positive.
    #[inline(always)]
    pub fn sample(&self, u: [L::F; 2]) -> V3<L> {
        let h = V3::<L>::splat([0.0, 0.0, 1.0]).or_else(self.is_delta, self.visible.sample(u));
        let cos = self.wo.dot(h);
        h.scale(cos + cos) - self.wo
    }
}
