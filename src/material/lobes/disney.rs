//! The BRDF of Burley 2012, "Physically Based Shading at Disney", as published: the formulas of the paper's viewer
//! (`disney.brdf`), all eleven parameters, term by term.
//!
//! The base colour comes linear, where the viewer takes a display value to the power 2.2. Floors are the published ones:
//! alpha of the specular lobe at least 0.001, of the clearcoat 0.1 to 0.001. The masking is that of the viewer, Smith with
//! the lobe's own alpha; the remapped roughness of the course notes' first printing is not in it.
//!
//! The model is not bounded by energy: specular, sheen and clearcoat add to the diffuse lobe without taking from it. White
//! and otherwise by default it reflects 1.04 of what comes ahead and 1.19 at cosine 0.02 (roughness 0.5), 1.56 at roughness
//! 1; white metal at roughness 1 is down to 0.31 ahead. Kept as it is.

use super::ggx;
use crate::material::bsdf::BsdfValue;
use crate::material::surface::DisneyExtras;
use crate::math::V3;
use crate::math::lanes::{cos_sin_2pi, exp, ln, pow5, safe_sqrt};
use simd::{Float, Lanes};
use std::f32::consts::{FRAC_1_PI, TAU};

/// Least alpha of the specular lobe.
const LEAST_ALPHA: f32 = 0.001;
/// Alpha of the clearcoat without gloss, and with all of it.
const SATIN_GLOSS: [f32; 2] = [0.1, 0.001];
/// Alpha of the clearcoat's masking.
const CLEARCOAT_MASKING: f32 = 0.25;

/// The BRDF as seen from one direction. Lanes that are not shaded by it, or seen from below, reflect nothing.
pub struct Disney<L: Lanes> {
    wo: V3<L>,
    is_on: L::M,
    /// `(1 - metallic) baseColor`.
    diffuse: V3<L>,
    /// `(1 - metallic) sheen x` its colour.
    sheen: V3<L>,
    subsurface: L::F,
    roughness: L::F,
    /// Specular reflectance ahead.
    f0: V3<L>,
    ax: L::F,
    ay: L::F,
    visible: ggx::Visible<L>,
    /// Clearcoat over 4.
    clearcoat: L::F,
    /// Alpha squared of the clearcoat, and its logarithm.
    gloss2: L::F,
    ln_gloss2: L::F,
    /// Estimate of the albedo.
    albedo: V3<L>,
    /// Probabilities of sampling the hemisphere by the cosine, evenly, the specular lobe and the clearcoat. Sum 1 or 0.
    pmf: [L::F; 4],
}

impl<L: Lanes> Disney<L> {
    /// Of linear colour `base`, `metallic`, perceptual `roughness` and `extras`, all in [0, 1], in `lanes`; seen from `wo`
    /// (unit; x along the tangent).
    #[inline(always)]
    pub fn new(base: V3<L>, metallic: L::F, roughness: L::F, extras: &DisneyExtras<L>, lanes: L::M, wo: V3<L>) -> Self {
        let f = |v: f32| L::F::splat(v);
        let (zero, one, white) = (L::F::zero(), L::F::one(), V3::<L>::splat([1.0; 3]));
        let is_on = lanes & wo.z.gt(zero);
        let wo = V3::<L>::new(wo.x, wo.y, wo.z.max(f(1e-6)));
        let luminance = f(0.3) * base.x + f(0.6) * base.y + f(0.1) * base.z;
        let tint = base.scale(one / luminance.max(f(1e-30))).or_else(luminance.gt(zero), white);
        let dielectric = white.lerp(tint, extras.specular_tint).scale(extras.specular * f(0.08));
        let f0 = dielectric.lerp(base, metallic);
        let sheen = white.lerp(tint, extras.sheen_tint).scale(extras.sheen * (one - metallic));
        let aspect = (one - f(0.9) * extras.anisotropic).sqrt();
        let alpha = roughness * roughness;
        let (ax, ay) = ((alpha / aspect).max(f(LEAST_ALPHA)), (alpha * aspect).max(f(LEAST_ALPHA)));
        let gloss = extras.clearcoat_gloss.mul_add(f(SATIN_GLOSS[1] - SATIN_GLOSS[0]), f(SATIN_GLOSS[0]));
        let diffuse = base.scale(one - metallic);
        let clearcoat = extras.clearcoat * f(0.25);
        // Shares of the albedo at this angle, roughly: half vectors as if they were normals, but the specular lobe, which
        // whitens everywhere, has some at least.
        let s5 = schlick_weight::<L>(wo.z);
        let hemisphere = diffuse + sheen.scale(s5.mul_add(f(0.25), f(0.05)));
        let by_diffuse = hemisphere.max_component();
        // Normals that a rough lobe is seen by lean towards the viewer.
        let specular = f0 + (white - f0).scale(s5 * (one - roughness));
        let by_specular = specular.max_component().max(f(0.02));
        let by_clearcoat = clearcoat * s5.mul_add(f(0.96), f(0.04));
        let total = by_diffuse + by_specular + by_clearcoat;
        let share = (one / total).masked(is_on);
        let coated = V3::<L>::new(by_clearcoat, by_clearcoat, by_clearcoat);
        // Subsurface has a term 1 / (cos + cos), which only even samples bound.
        let even = by_diffuse * share * extras.subsurface * f(0.5);
        Self {
            wo,
            is_on,
            diffuse,
            sheen,
            subsurface: extras.subsurface,
            roughness,
            f0,
            ax,
            ay,
            visible: ggx::Visible::new(wo, ax, ay),
            clearcoat,
            gloss2: gloss * gloss,
            ln_gloss2: ln::<L>(gloss * gloss),
            albedo: (hemisphere + specular + coated).masked(is_on),
            pmf: [by_diffuse * share - even, even, by_specular * share, by_clearcoat * share],
        }
    }

    /// Share of light that is reflected, per colour, as estimated for the choice between lobes: without masking and
    /// retro-reflection, so within 0.4 for dielectrics up to 60 degrees, too much beyond and for rough metals. 0 in lanes that are not shaded by it.
    #[inline(always)]
    pub fn albedo(&self) -> V3<L> {
        self.albedo
    }

    /// Value and density for `wi`; 0 below the horizon.
    #[inline(always)]
    pub fn eval(&self, wi: V3<L>) -> BsdfValue<L> {
        let f = |v: f32| L::F::splat(v);
        let (zero, one) = (L::F::zero(), L::F::one());
        let seen = wi.z.gt(zero) & self.is_on;
        let wi = V3::<L>::new(wi.x, wi.y, wi.z.max(f(1e-12)));
        let sum = self.wo + wi;
        let length2 = sum.dot(sum).max(f(1e-30));
        let h = sum.scale(one / length2.sqrt());
        let cos_h = wi.dot(h).max(zero);
        let (mu_o, mu_i) = (self.wo.z, wi.z);
        let (fresnel_o, fresnel_i) = (schlick_weight::<L>(mu_o), schlick_weight::<L>(mu_i));
        let fresnel_h = schlick_weight::<L>(cos_h);
        // Diffuse with retro-reflection, and the flatter one for subsurface.
        let ss90 = cos_h * cos_h * self.roughness;
        let d90 = ss90.mul_add(f(2.0), f(0.5));
        let fd = from_one::<L>(d90, fresnel_o) * from_one::<L>(d90, fresnel_i);
        let fss = from_one::<L>(ss90, fresnel_o) * from_one::<L>(ss90, fresnel_i);
        let ss = f(1.25) * (fss * (one / (mu_o + mu_i) - f(0.5)) + f(0.5));
        let base = (ss - fd).mul_add(self.subsurface, fd) * f(FRAC_1_PI);
        // Specular: GTR of power 2 is GGX; each masking has its share of 1 / (4 cos cos).
        let d_specular = ggx::distribution(h, [one / self.ax, one / self.ay]);
        let g = self.masking(self.wo) * self.masking(wi);
        let specular = self.f0 + (V3::<L>::splat([1.0; 3]) - self.f0).scale(fresnel_h);
        // Clearcoat: index 1.5.
        let d_clearcoat = self.clearcoat_distribution(h);
        let g_clearcoat = clearcoat_masking::<L>(mu_o) * clearcoat_masking::<L>(mu_i);
        let clearcoat = self.clearcoat * fresnel_h.mul_add(f(0.96), f(0.04)) * d_clearcoat * g_clearcoat;
        let value = self.diffuse.scale(base) + self.sheen.scale(fresnel_h) + specular.scale(g * d_specular);
        let value = V3::<L>::new(value.x + clearcoat, value.y + clearcoat, value.z + clearcoat).scale(mu_i);
        // D h.z / (4 wo . h), where wo . h is half the sum's length: as a product it has no digits left next to the horizon
        // opposite the viewer.
        let clearcoat_pdf = d_clearcoat * sum.z / (length2 + length2);
        let specular_pdf = self.visible.pdf_reflected(d_specular);
        let pdf = self.pmf[0] * mu_i * f(FRAC_1_PI)
            + self.pmf[1] * f(1.0 / TAU)
            + self.pmf[2] * specular_pdf
            + self.pmf[3] * clearcoat_pdf;
        BsdfValue { f_cos: value.masked(seen), pdf: pdf.masked(seen) }
    }

    /// A direction by `u` in [0, 1)^2 and `u_lobe` in [0, 1), by the density of [`Disney::eval`]. Not valid where its z is
    /// not positive.
    #[inline(always)]
    pub fn sample(&self, u: [L::F; 2], u_lobe: L::F) -> V3<L> {
        let one = L::F::one();
        let (cos_phi, sin_phi) = cos_sin_2pi::<L>(u[1]);
        let from_cosine = u_lobe.lt(self.pmf[0]);
        let from_hemisphere = u_lobe.lt(self.pmf[0] + self.pmf[1]);
        let from_clearcoat = u_lobe.ge(self.pmf[0] + self.pmf[1] + self.pmf[2]) & self.pmf[3].gt(L::F::zero());
        let z = safe_sqrt(one - u[0]).or_else(from_cosine, one - u[0]);
        let r = safe_sqrt((one - z) * (one + z));
        let hemisphere = V3::<L>::new(r * cos_phi, r * sin_phi, z);
        // Normals of the clearcoat by D cos: sin^2 = (a^(2 - 2u) - a^2) / (1 - a^2).
        let sin2 = (exp::<L>(self.ln_gloss2 * (one - u[0])) - self.gloss2) / (one - self.gloss2);
        let sin = safe_sqrt(sin2);
        let glossy = V3::<L>::new(sin * cos_phi, sin * sin_phi, safe_sqrt(one - sin2));
        let h = glossy.or_else(from_clearcoat, self.visible.sample(u));
        let cos_h = self.wo.dot(h);
        hemisphere.or_else(from_hemisphere, h.scale(cos_h + cos_h) - self.wo)
    }

    /// Masking of the specular lobe over twice the cosine.
    #[inline(always)]
    fn masking(&self, w: V3<L>) -> L::F {
        let (x, y) = (w.x * self.ax, w.y * self.ay);
        L::F::one() / (w.z + x.mul_add(x, y.mul_add(y, w.z * w.z)).sqrt())
    }

    /// GTR of power 1, 1/sr; `1 + (a^2 - 1) z^2` without loss of digits.
    #[inline(always)]
    fn clearcoat_distribution(&self, h: V3<L>) -> L::F {
        let t = h.x.mul_add(h.x, h.y.mul_add(h.y, self.gloss2 * h.z * h.z));
        (self.gloss2 - L::F::one()) * L::F::splat(FRAC_1_PI) / (self.ln_gloss2 * t)
    }
}

/// `(1 - cos)^5`.
#[inline(always)]
fn schlick_weight<L: Lanes>(cos: L::F) -> L::F {
    pow5((L::F::one() - cos).max(L::F::zero()).min(L::F::one()))
}

/// `1 + (v - 1) t`.
#[inline(always)]
fn from_one<L: Lanes>(v: L::F, t: L::F) -> L::F {
    (v - L::F::one()).mul_add(t, L::F::one())
}

/// Masking of the clearcoat over twice the cosine.
#[inline(always)]
fn clearcoat_masking<L: Lanes>(mu: L::F) -> L::F {
    let a2 = L::F::splat(CLEARCOAT_MASKING * CLEARCOAT_MASKING);
    let rest = L::F::splat(1.0 - CLEARCOAT_MASKING * CLEARCOAT_MASKING);
    L::F::one() / (mu + (rest * mu).mul_add(mu, a2).sqrt())
}
