//! What lies under coat and sheen: a metal and a dielectric, mixed; the dielectric is a specular layer over a diffuse or
//! transparent base.
//!
//! glTF 2.0 appendix B with `KHR_materials_specular`, `_ior`, `_transmission`, `_volume`, `_diffuse_transmission`,
//! `_anisotropy`, `_iridescence`. GGX with height-correlated masking; refraction after Walter et al. 2007. With
//! [`Brdf::Full`], what one reflection loses is given back (Kulla and Conty 2017): by a diffuse lobe above metals and
//! opaque dielectrics, by scaling transparent ones (that lobe would not vanish with the boundary itself, at eta 1). The
//! diffuse base gets what the layer leaves, in both directions: reciprocal, and white over white is white.

use super::bsdf::{BsdfValue, View};
use super::energy::{Brdf, Energy, Row, Stretched, again};
use super::extent::{Extent, Room};
use super::film::Film;
use super::lobes::fresnel::{dielectric, normal_incidence};
use super::lobes::ggx::{Visible, distribution, masking};
use super::surface::Surface;
use super::through::Through;
use crate::math::lanes::{cos_sin_2pi, pow5, safe_sqrt};
use crate::math::{Frame, V3};
use simd::{Float, Lanes, Mask};
use std::f32::consts::FRAC_1_PI;

#[path = "base_albedo.rs"]
mod albedo;
#[path = "base_mirrors.rs"]
mod mirrors;

/// Below this alpha the specular lobe is a mirror.
pub const DELTA_ALPHA: f32 = 1e-4;

/// Indices of refraction nearer to each other than this share are no boundary: half vectors could not be told.
const NO_BOUNDARY: f32 = 2e-4;

/// The closure below coat and sheen; directions are local. `K` says whether there
/// is room for the extras.
pub struct Base<'e, L: Lanes, K: Extent> {
    energy: &'e Energy,
    is_full: bool,
    /// Normal of the diffuse lobe, unit; (0, 0, 1) but where [`Base::set_diffuse_normal`] says otherwise.
    diffuse_normal: V3<L>,
    /// Lanes where it does.
    is_split: L::M,
    /// Some lane of them. Only a shortcut.
    has_split: bool,
    /// Towards the viewer, unit, z > 0.
    wo: V3<L>,
    /// Base colour.
    base: V3<L>,
    /// Share of the metal.
    metallic: L::F,
    /// Reflectance of the dielectric at normal incidence, before `weight`.
    f0: V3<L>,
    /// `specularFactor`.
    weight: L::F,
    /// Index of refraction; 0: infinite.
    ior: L::F,
    /// Roughness squared, along x and y.
    alpha: [L::F; 2],
    visible: Visible<L>,
    /// Smith's Lambda of the viewer, `1 / (4 wo.z)`, and `1 / alpha`.
    lambda_o: L::F,
    quarter: L::F,
    inverse: [L::F; 2],
    /// Reflectance of `ior` at normal incidence, and 1 over what that leaves.
    own: L::F,
    left_by_own: L::F,
    /// Where the albedos of this roughness are.
    row: Row<L>,
    stretched: K::Room<Stretched<L>>,
    is_stretched: L::M,
    /// Coefficient of the diffuse lobe of light that was reflected more than once, but for its share towards `wi`.
    multiple: V3<L>,
    /// Coefficient of the diffuse base, but for the layer's share towards `wi`.
    diffuse: V3<L>,
    /// The dielectric's largest reflectance at normal incidence, and of light reflected more than once.
    layer: [L::F; 2],
    through: K::Room<Through<L>>,
    film: K::Room<Film<L>>,
    /// About the albedo towards the viewer.
    albedo: L::F,
    /// Probability of sampling the specular lobes.
    specular_pmf: L::F,
    /// Of sampling the diffuse one on the other side.
    behind_pmf: L::F,
    /// The specular lobes are mirrors.
    is_delta: L::M,
    /// Lanes with nothing but the diffuse lobe.
    is_diffuse: L::M,
    /// Lanes that reflect at all: a specular surface seen from below its shading horizon does not.
    is_seen: L::M,
    /// Some lane has a specular lobe. Only a shortcut: a lane's bits must not depend on its neighbours.
    has_specular: bool,
    /// Some lane of those has a dielectric layer. Only a shortcut as well: the layer counts for nothing in metals (a box of
    /// nothing but metal: 0.93 of the time).
    has_layer: bool,
}

/// A sampled local direction.
pub struct BaseSample<L: Lanes> {
    pub wi: V3<L>,
    /// A mirror or a smooth boundary: the weight is here, not in `eval`.
    pub delta: L::M,
    /// Only where `delta`.
    pub delta_weight: V3<L>,
    pub transmitted: L::M,
    pub straight: L::M,
    pub valid: L::M,
}

impl<'e, L: Lanes, K: Extent> Base<'e, L, K> {
    /// For a surface seen so. Where `view.wo` is below the shading horizon, a surface with a specular lobe reflects
    /// nothing.
    #[inline(always)]
    pub fn new(surface: &Surface<L>, view: &View<L>, energy: &'e Energy) -> Self {
        let (zero, one) = (L::F::zero(), L::F::one());
        let none = L::M::from_bits(0);
        let is_full = energy.brdf == Brdf::Full;
        let has_specular = surface.has_specular();
        let &Surface { base, metallic, roughness, specular, f0, ior, class, .. } = surface;
        let wo = view.frame.to_local(view.wo);
        let is_diffuse = !has_specular;
        let is_seen = is_diffuse | wo.z.gt(zero);
        let wo = V3::<L>::new(wo.x, wo.y, wo.z.max(L::F::splat(1e-6)));
        let opaque = one - metallic;
        // Only what is plain has lanes without a layer side by side.
        let has_layer = K::IS_RICH || (has_specular & opaque.gt(zero)).any();
        let has_specular = has_specular.any();
        let smooth = roughness * roughness;
        let is_delta = smooth.lt(L::F::splat(DELTA_ALPHA)) & !is_diffuse;
        let smooth = smooth.max(L::F::splat(DELTA_ALPHA));
        let mut base_closure = Self {
            energy,
            is_full,
            diffuse_normal: V3::splat([0.0, 0.0, 1.0]),
            is_split: none,
            has_split: false,
            wo,
            base,
            metallic,
            f0,
            weight: specular,
            ior,
            alpha: [smooth, smooth],
            visible: Visible::nothing(wo),
            lambda_o: zero,
            quarter: zero,
            inverse: [zero, zero],
            own: zero,
            left_by_own: zero,
            row: Row::nowhere(),
            stretched: K::Room::hold(None),
            is_stretched: none,
            multiple: V3::zero(),
            diffuse: base.scale(opaque),
            layer: [zero, zero],
            through: K::Room::hold(None),
            film: K::Room::hold(None),
            albedo: base.scale(opaque).max_component(),
            specular_pmf: zero,
            behind_pmf: zero,
            is_delta,
            is_diffuse,
            is_seen,
            has_specular,
            has_layer,
        };
        let extras = if K::IS_RICH { surface.extras.as_ref() } else { None };
        if !has_specular && extras.is_none() {
            return base_closure;
        }
        let this = &mut base_closure;
        let mut share = zero;
        let mut sees_all = none;
        let mut is_none = none;
        if let Some(extras) = extras {
            share = extras.transmission;
            sees_all = share.gt(zero);
            // Where there is no boundary light goes on as it came, whatever the roughness: before any albedo is asked for.
            is_none = extras.is_volume & sees_all & (view.eta - one).abs().lt(L::F::splat(NO_BOUNDARY));
            let smooth = L::F::splat(DELTA_ALPHA).or_else(is_none, smooth);
            let is_delta = is_delta | is_none;
            (this.alpha, this.is_delta) = ([smooth, smooth], is_delta);
            let along = smooth + (one - smooth) * extras.anisotropy * extras.anisotropy;
            this.is_stretched = extras.anisotropy.gt(zero) & !is_diffuse & !is_none;
            if this.is_stretched.any() {
                this.alpha = [along.or_else(this.is_stretched, smooth), smooth];
                this.is_delta = is_delta & !this.is_stretched;
                if is_full {
                    this.stretched = K::Room::hold(Some(energy.stretched_row::<L>(smooth, extras.anisotropy, class)));
                }
            }
            this.film = K::Room::hold(Film::new(extras, f0, base, metallic));
        }
        let [ax, ay] = this.alpha;
        this.visible = if K::IS_RICH { Visible::all_in(sees_all, wo, ax, ay) } else { Visible::new(wo, ax, ay) };
        this.lambda_o = masking::<L>(wo, ax, ay);
        this.quarter = one / (L::F::splat(4.0) * wo.z);
        let inverse = one / ay;
        this.inverse = [if K::IS_RICH { one / ax } else { inverse }, inverse];
        this.own = normal_incidence::<L>(ior);
        this.left_by_own = one / (one - this.own);
        // Albedos towards the viewer.
        this.row = energy.row::<L>((ax * ay).sqrt(), class);
        let toward = this.albedo_toward(wo);
        let white = toward[0];
        let mean = this.mean();
        let mean_rise = this.mean_rise();
        let all = V3::<L>::splat([1.0; 3]);
        let mut metal_mean = base.scale(L::F::splat(20.0 / 21.0)) + V3::splat([1.0 / 21.0; 3]);
        let mut layer_mean = (f0 + (all - f0).scale(mean_rise)).scale(specular);
        let mut metal_toward = this.metal(wo.z);
        let mut layer_toward = (f0 + (all - f0).scale(toward[1])).scale(specular);
        let (plain_mean, plain_toward) = (layer_mean, layer_toward);
        if let Some(film) = this.film.get() {
            (metal_mean, layer_mean) = film.average(this.mean_shares(), metal_mean, layer_mean, specular);
            (metal_toward, layer_toward) = film.average(this.shares(wo), metal_toward, layer_toward, specular);
        }
        let (mut shadowed, mut shadowed_mean) = (V3::<L>::zero(), V3::<L>::zero());
        if is_full {
            let lost = one - white;
            let lost_mean = (one - mean).max(L::F::splat(1e-6));
            let metal_again = again::<L>(metal_mean, mean);
            let layer_again = again::<L>(layer_mean, mean);
            let coefficient = metal_again.scale(metallic) + layer_again.scale(opaque * (one - share));
            this.multiple = coefficient.scale(lost / lost_mean);
            this.layer = [f0.max_component() * specular, layer_again.max_component()];
            shadowed = all.scale(layer_toward.max_component() * white + this.layer[1] * lost);
            shadowed_mean = all.scale(layer_mean.max_component() * mean + this.layer[1] * (one - mean));
            if let Some(film) = this.film.get_mut() {
                let again = film.set_again(layer_again);
                shadowed = film.taken(layer_toward, plain_toward).scale(white) + again.scale(lost);
                shadowed_mean = film.taken(layer_mean, plain_mean).scale(mean) + again.scale(one - mean);
            }
            this.diffuse = (this.diffuse * Self::left(shadowed, shadowed_mean)).scale(one - share);
        } else {
            this.diffuse = this.diffuse.scale(one - share);
        }
        if let Some(extras) = extras {
            let behind = extras.diffuse_transmission;
            if (share.gt(zero) | behind.gt(zero)).any() {
                let is_volume = extras.is_volume & share.gt(zero);
                let eta = view.eta;
                let mut gain = one;
                if is_full {
                    let thin = one / white;
                    gain = thin;
                    if is_volume.any() {
                        let rough = one / energy.glass::<L>(eta, smooth, wo.z, specular);
                        // What reflects everything (index 0) lets nothing through and so is as what is thin.
                        gain = rough.or_else(is_volume & ior.gt(zero), thin);
                    }
                    gain = one.or_else(this.is_delta | is_none | share.eq(zero), gain);
                }
                let white = Self::left(shadowed, shadowed_mean).scale(opaque * (one - share));
                let tinted = extras.diffuse_transmission_color * white;
                // The boundary's reflectance against what is before it, with the colour it has against air.
                let own = this.own.max(L::F::splat(1e-12));
                let f0 = f0.scale(normal_incidence::<L>(eta) / own).min(V3::splat([1.0; 3]));
                this.through = K::Room::hold(Some(Through {
                    f0,
                    tint: base,
                    share,
                    gain,
                    is_volume,
                    eta,
                    is_none,
                    diffuse: tinted.scale(behind),
                    has_behind: behind.gt(zero),
                }));
                this.diffuse = this.diffuse.scale(one - behind);
            }
        }
        // Shares of the albedo at this angle.
        let reflected = metal_toward.scale(metallic * white) + layer_toward.scale(opaque * white);
        let (mut passed, mut behind) = (V3::zero(), V3::zero());
        if let Some(through) = this.through.get() {
            passed = through.tint.scale(opaque * share * (one - layer_toward.max_component()));
            behind = through.diffuse * (all - shadowed_mean);
        }
        let diffused = this.multiple.scale(one - mean) + this.diffuse * (all - shadowed_mean);
        let (s, d, b) = ((reflected + passed).max_component(), diffused.max_component(), behind.max_component());
        this.albedo = s + d + b;
        let sum = this.albedo.max(L::F::splat(1e-30));
        this.specular_pmf = (s / sum).min(one);
        this.behind_pmf = b / sum;
        base_closure
    }

    /// Puts the diffuse lobe about the world normal `normal` (unit) in those of `lanes` that have two lobes: the specular
    /// one's normal may have been bent for its mirror's sake, which is no matter of the diffuse one.
    #[inline(always)]
    pub fn set_diffuse_normal(&mut self, frame: &Frame<L>, normal: V3<L>, lanes: L::M) {
        let lanes = lanes & !self.is_diffuse;
        self.diffuse_normal = frame.to_local(normal).normalized().or_else(lanes, self.diffuse_normal);
        (self.is_split, self.has_split) = (lanes, lanes.any());
    }

    /// Cosine between `wi` and the diffuse lobe's normal.
    #[inline(always)]
    fn diffuse_cosine(&self, wi: V3<L>) -> L::F {
        if self.has_split { wi.dot(self.diffuse_normal).or_else(self.is_split, wi.z) } else { wi.z }
    }

    /// Fresnel's reflectance of the metal at cosine `c` between view and half vector.
    #[inline(always)]
    fn metal(&self, c: L::F) -> V3<L> {
        let s5 = pow5((L::F::one() - c).max(L::F::zero()));
        self.base + (V3::<L>::splat([1.0; 3]) - self.base).scale(s5)
    }

    /// Of the metal, of the dielectric layer, and of the boundary of what is transparent, at cosine `c`.
    #[inline(always)]
    fn fresnel(&self, c: L::F) -> (V3<L>, V3<L>, V3<L>) {
        let (zero, one) = (L::F::zero(), L::F::one());
        let all = V3::<L>::splat([1.0; 3]);
        let c = c.max(zero);
        let s5 = pow5((one - c).max(zero));
        let mut metal = self.base + (all - self.base).scale(s5);
        if !self.has_layer {
            return (metal, V3::zero(), V3::zero());
        }
        let rise = self.rise(c, s5);
        let mut layer = (self.f0 + (all - self.f0).scale(rise)).scale(self.weight).max(V3::zero());
        let mut boundary = layer;
        if let Some(through) = self.through.get() {
            let eta = through.eta;
            let own = normal_incidence::<L>(eta);
            let rise = self.rise_of(eta, [own, one / (one - own)], c, s5);
            let bent = (through.f0 + (all - through.f0).scale(rise)).scale(self.weight).max(V3::zero());
            // Beyond the critical angle everything is reflected, whatever the material says.
            let is_total = eta.lt(one) & (c * c + (eta - one) * (eta + one)).le(zero);
            boundary = all.or_else(is_total, bent).or_else(through.is_volume & self.ior.gt(zero), layer);
        }
        if let Some(film) = self.film.get() {
            (metal, layer) = film.fresnel(c, metal, layer, self.weight);
            if let Some(through) = self.through.get() {
                boundary = boundary.or_else(through.is_volume, layer);
            }
        }
        (metal, layer, boundary)
    }

    /// How far Fresnel's curve has risen at cosine `c`, where Schlick says `s5`.
    #[inline(always)]
    fn rise(&self, c: L::F, s5: L::F) -> L::F {
        self.rise_of(self.ior, [self.own, self.left_by_own], c, s5)
    }

    /// The same for another index than the material's; `own` as [`Self::own`] and [`Self::left_by_own`].
    #[inline(always)]
    fn rise_of(&self, ior: L::F, own: [L::F; 2], c: L::F, s5: L::F) -> L::F {
        let (zero, one) = (L::F::zero(), L::F::one());
        if self.is_full {
            let exact = (dielectric::<L>(c, ior) - own[0]) * own[1];
            return zero.or_else(ior.eq(one), exact).or_else(ior.gt(zero), s5);
        }
        if !K::IS_RICH {
            return s5;
        }
        // From the dense side it is the cosine on the other one that counts.
        let other = safe_sqrt(one - (one - c * c) / (ior * ior).max(L::F::splat(1e-12)));
        pow5(one - other).or_else(ior.gt(zero) & ior.lt(one), s5)
    }

    /// Coefficients of the specular lobes at the half vector `h` with `c = wo . h`: reflected and transmitted.
    #[inline(always)]
    fn at_half(&self, c: L::F) -> (V3<L>, V3<L>, V3<L>) {
        let one = L::F::one();
        let (metal, layer, boundary) = self.fresnel(c);
        let opaque = one - self.metallic;
        let Some(through) = self.through.get() else {
            return (metal.scale(self.metallic) + layer.scale(opaque), V3::zero(), layer);
        };
        let kept = layer.scale(one - through.share);
        let gained = kept + boundary.scale(through.share * through.gain).masked(!through.is_none);
        let all = V3::<L>::splat([1.0; 3]);
        let mut taken = all.scale(boundary.max_component());
        if self.is_full
            && let Some(film) = self.film.get()
        {
            taken = taken.or_else(through.is_volume, film.taken(boundary, boundary));
        }
        let passes = all.or_else(through.is_none, all - taken);
        let passed = (through.tint * passes).scale(opaque * through.share * through.gain);
        (metal.scale(self.metallic) + gained.scale(opaque), passed, layer)
    }

    /// Probability of reflecting, given a half vector.
    #[inline(always)]
    fn reflects(&self, reflected: V3<L>, passed: V3<L>) -> L::F {
        let (r, p) = (reflected.max_component(), passed.max_component());
        if self.through.get().is_some() { r / (r + p).max(L::F::splat(1e-30)) } else { L::F::one() }
    }

    /// Lanes with nothing but the diffuse lobe.
    #[inline(always)]
    pub fn is_diffuse(&self) -> L::M {
        self.is_diffuse
    }

    /// Value and density for `wi`; each lobe is zero beyond its horizon.
    #[inline(always)]
    pub fn eval(&self, wi: V3<L>) -> BsdfValue<L> {
        let (zero, one) = (L::F::zero(), L::F::one());
        let cosine_pdf = self.diffuse_cosine(wi).max(zero) * L::F::splat(FRAC_1_PI);
        if !(self.has_specular || self.through.get().is_some()) {
            return BsdfValue { f_cos: self.diffuse.scale(cosine_pdf), pdf: cosine_pdf };
        }
        let cosine_pdf = cosine_pdf.masked(self.is_seen);
        let above = wi.z.gt(zero);
        let glossy = above & self.is_seen & !self.is_delta;
        let up = V3::<L>::new(wi.x, wi.y, wi.z.max(L::F::splat(1e-12)));
        let h = (self.wo + up).normalized();
        let c = self.wo.dot(h);
        let (reflected, passed, layer) = self.at_half(c);
        let [ax, ay] = self.alpha;
        let d = distribution::<L>(h, self.inverse);
        let g2 = one / (one + self.lambda_o + masking::<L>(up, ax, ay));
        let specular = reflected.scale(d * g2 * self.quarter).masked(glossy);
        let specular_pdf = (self.visible.pdf_reflected(d) * self.reflects(reflected, passed)).masked(glossy);
        // What the layer leaves of the light that comes in, and gives back after the first reflection.
        let mut diffuse = self.diffuse;
        if self.is_full {
            let albedo = self.albedo_toward(up);
            let again = self.multiple.scale(one - albedo[0]);
            diffuse = if self.has_layer { self.diffuse * self.under(up, albedo) + again } else { again };
        } else {
            diffuse = diffuse.scale(one - layer.max_component());
        }
        let diffuse = self.diffuse_only(diffuse);
        let mut diffuse_pmf = one - self.specular_pmf;
        if self.through.get().is_some() {
            diffuse_pmf = diffuse_pmf - self.behind_pmf;
        }
        let f_cos = diffuse.scale(cosine_pdf) + specular;
        let pdf = (diffuse_pmf * cosine_pdf + self.specular_pmf * specular_pdf).max(zero);
        let value = BsdfValue { f_cos, pdf };
        match self.through.get() {
            Some(through) if (!above).any() => self.behind(wi, through, value),
            _ => value,
        }
    }

    /// Lanes without a specular layer keep their colour's very bits.
    #[inline(always)]
    fn diffuse_only(&self, diffuse: V3<L>) -> V3<L> {
        self.diffuse.or_else(self.is_diffuse, diffuse)
    }

    /// `value` with what goes through in the lanes where `wi` is below the horizon.
    #[inline(always)]
    fn behind(&self, wi: V3<L>, through: &Through<L>, value: BsdfValue<L>) -> BsdfValue<L> {
        let (zero, one) = (L::F::zero(), L::F::one());
        let below = wi.z.lt(zero) & self.is_seen;
        let down = V3::<L>::new(wi.x, wi.y, wi.z.min(L::F::splat(-1e-12)));
        let flipped = V3::<L>::new(down.x, down.y, -down.z);
        let [ax, ay] = self.alpha;
        // The half vector: of the flipped direction at thin surfaces, of refraction at others; z > 0.
        let thin = self.wo + flipped;
        let bent = down.scale(through.eta) + self.wo;
        let bent = bent.scale(one.copysign(bent.z));
        let h = bent.or_else(through.is_volume, thin).normalized();
        let (co, ci) = (self.wo.dot(h), down.dot(h));
        let (reflected, passed, _) = self.at_half(co);
        let d = distribution::<L>(h, self.inverse);
        let g2 = one / (one + self.lambda_o + masking::<L>(down, ax, ay));
        // Both cosines lie on their own sides of the half vector, or nothing is refracted so.
        let refracts = co.gt(zero) & ci.lt(zero);
        let sum = co + through.eta * ci;
        let eta2 = through.eta * through.eta;
        let jacobian = eta2 * ci.abs() / (sum * sum).max(L::F::splat(1e-30));
        let glossy = below & !self.is_delta & (refracts | !through.is_volume);
        // Radiance is denser in the denser medium: / eta^2.
        let thin_value = d * g2 * self.quarter;
        let bent_value = d * g2 * co * jacobian / (self.wo.z * eta2);
        let specular = passed.scale(bent_value.or_else(through.is_volume, thin_value)).masked(glossy);
        let bent_pdf = self.visible.pdf_normal(d, co) * jacobian;
        let pdf = bent_pdf.or_else(through.is_volume, self.visible.pdf_reflected(d));
        let specular_pdf = (pdf * (one - self.reflects(reflected, passed))).masked(glossy);
        let cosine_pdf = ((-self.diffuse_cosine(wi)).max(zero) * L::F::splat(FRAC_1_PI)).masked(below);
        let all = V3::<L>::splat([1.0; 3]);
        let left = if self.is_full { self.under(flipped, self.albedo_toward(flipped)) } else { all };
        let left = all.or_else(self.is_diffuse, left);
        let f_cos = through.diffuse * left.scale(cosine_pdf) + specular;
        let pdf = self.behind_pmf * cosine_pdf + self.specular_pmf * specular_pdf;
        BsdfValue { f_cos: f_cos.or_else(below, value.f_cos), pdf: pdf.or_else(below, value.pdf) }
    }

    /// What goes straight through; see [`super::bsdf::Bsdf::straight`].
    #[inline(always)]
    pub fn straight(&self) -> V3<L> {
        let Some(through) = self.through.get() else { return V3::zero() };
        let (_, passed, _) = self.at_half(self.wo.z);
        passed.masked(self.is_delta & self.is_seen & !through.is_volume)
    }

    /// A direction from the mixture of the lobes, by `u` (direction) and `u_lobe`.
    #[inline(always)]
    pub fn sample(&self, u: [L::F; 2], u_lobe: L::F) -> BaseSample<L> {
        let (zero, one) = (L::F::zero(), L::F::one());
        let none = L::M::from_bits(0);
        let (cos_phi, sin_phi) = cos_sin_2pi::<L>(u[1]);
        // Cosine-weighted hemisphere.
        let r = u[0].sqrt();
        let mut diffuse = V3::<L>::new(r * cos_phi, r * sin_phi, safe_sqrt(one - u[0]));
        if self.has_split {
            diffuse = Frame::around(self.diffuse_normal).to_world(diffuse).or_else(self.is_split, diffuse);
        }
        if !(self.has_specular || self.through.get().is_some()) {
            let valid = diffuse.z.gt(zero);
            return BaseSample {
                wi: diffuse,
                delta: none,
                delta_weight: V3::zero(),
                transmitted: none,
                straight: none,
                valid,
            };
        }
        let from_specular = u_lobe.lt(self.specular_pmf);
        let h = self.visible.sample(u);
        let h = V3::<L>::new(zero, zero, one).or_else(self.is_delta, h);
        let c = self.wo.dot(h);
        let mirrored = h.scale(c + c) - self.wo;
        // Of lobes with a width the weight is `eval`'s.
        let asks = self.is_delta.any() || self.through.get().is_some();
        let (reflected, passed, _) = if asks { self.at_half(c) } else { (V3::zero(), V3::zero(), V3::zero()) };
        let mut wi = mirrored.or_else(from_specular, diffuse);
        let mut delta_weight = reflected.scale(one / self.specular_pmf);
        // A specular sample below its horizon is lost, even where the diffuse lobe reaches.
        let mut valid = wi.z.gt(zero) | !from_specular;
        let (mut transmitted, mut straight) = (none, none);
        if let Some(through) = self.through.get() {
            let reflects = self.reflects(reflected, passed);
            let passes = from_specular & !(u_lobe.lt(self.specular_pmf * reflects));
            let behind = !from_specular & u_lobe.lt(self.specular_pmf + self.behind_pmf);
            // Refracted: c / eta - cos_t.
            let eta = through.eta.max(L::F::splat(1e-6));
            let sin2 = (one - c * c).max(zero) / (eta * eta);
            let cos_t = safe_sqrt(one - sin2);
            let bent = h.scale(c / eta - cos_t) - self.wo.scale(one / eta);
            let thin = V3::<L>::new(mirrored.x, mirrored.y, -mirrored.z);
            let through_wi = bent.normalized().or_else(through.is_volume & !through.is_none, thin);
            let on = passes & (self.is_delta & (!through.is_volume | through.is_none));
            let through_wi = (-self.wo).or_else(on, through_wi);
            wi = through_wi.or_else(passes, wi);
            wi = (-diffuse).or_else(behind, wi);
            transmitted = passes | behind;
            valid = (valid & !transmitted) | (passes & wi.z.lt(zero)) | behind;
            straight = on & !through.is_volume;
            let radiance = (one / (eta * eta)).or_else(through.is_volume, one);
            let reflected_weight = delta_weight.scale(one / reflects.max(L::F::splat(1e-30)));
            let passed_weight = passed.scale(radiance / (self.specular_pmf * (one - reflects)).max(L::F::splat(1e-30)));
            delta_weight = passed_weight.or_else(passes, reflected_weight);
        }
        BaseSample {
            wi,
            delta: from_specular & self.is_delta,
            delta_weight,
            transmitted,
            straight,
            valid: valid & self.is_seen,
        }
    }

    /// Colour of the diffuse lobe of lanes that have no other: their weight, exactly.
    #[inline(always)]
    pub fn only_diffuse(&self) -> (V3<L>, L::M) {
        match self.through.get() {
            Some(through) => (self.diffuse, self.is_diffuse & !through.has_behind),
            None => (self.diffuse, self.is_diffuse),
        }
    }

    /// About the albedo towards the viewer (largest channel), by which sampling it is weighed against other lobes.
    #[inline(always)]
    pub fn albedo(&self) -> L::F {
        self.albedo
    }

    /// Whether some lane has more than a diffuse lobe.
    #[inline(always)]
    pub fn has_specular(&self) -> bool {
        self.has_specular || self.through.get().is_some()
    }
}
