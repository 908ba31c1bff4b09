//! The closure of one lane whose material has more than metal and roughness: the lobes that few materials use are shaded
//! one lane at a time, so that the others' kernels stay small.
//!
//! A coat lies over the sheen, that over the base (`Base`, or the Disney BRDF of 2012). Each takes from what is below it
//! what it reflects itself.

use super::base::Base;
use super::bsdf::{BsdfSample, BsdfValue, View};
use super::energy::Energy;
use super::extent::Rich;
use super::lobes::coat::Coat;
use super::lobes::disney::Disney;
use super::lobes::sheen::Sheen;
use super::surface::Surface;
use crate::math::{Frame, V3};
use simd::{Float, Lanes, Mask, Scalar};

type F = <Scalar as Lanes>::F;
type M = <Scalar as Lanes>::M;

/// See [`super::bsdf::Bsdf`], whose methods these are.
pub struct Layered<'e> {
    frame: Frame<Scalar>,
    ground: Ground<'e>,
    sheen: Option<Sheen<Scalar>>,
    coat: Option<(Coat<Scalar>, Frame<Scalar>)>,
    /// Probabilities of sampling the coat and the sheen.
    coat_pmf: F,
    sheen_pmf: F,
}

/// What lies lowest.
enum Ground<'e> {
    Base(Box<Base<'e, Scalar, Rich>>),
    Disney(Box<Disney<Scalar>>),
}

impl<'e> Layered<'e> {
    /// For a surface seen so; `diffuse_normal` is the diffuse lobe's where it is another than the frame's.
    #[inline(never)]
    pub fn new(
        surface: &Surface<Scalar>,
        view: &View<Scalar>,
        diffuse_normal: Option<V3<Scalar>>,
        energy: &'e Energy,
    ) -> Self {
        let (zero, one) = (F::zero(), F::one());
        let frame = view.frame;
        let wo = frame.to_local(view.wo);
        let (mut sheen, mut coat) = (None, None);
        let mut disney = None;
        if let Some(extras) = &surface.extras {
            if extras.sheen.max_component().gt(zero).any() {
                sheen = Some(Sheen::new(extras.sheen, extras.sheen_roughness, wo));
            }
            if extras.clearcoat.gt(zero).any() {
                let own = view.coat_frame.unwrap_or(frame);
                coat = Some((Coat::new(extras.clearcoat, extras.clearcoat_roughness, own.to_local(view.wo)), own));
            }
            if extras.is_disney.any() {
                disney = extras
                    .disney
                    .as_ref()
                    .map(|d| Disney::new(surface.base, surface.metallic, surface.roughness, d, extras.is_disney, wo));
            }
        }
        let (ground, ground_albedo) = match disney {
            Some(disney) => {
                let albedo = disney.albedo().max_component();
                (Ground::Disney(Box::new(disney)), albedo)
            }
            None => {
                let mut base = Base::new(surface, view, energy);
                if let Some(normal) = diffuse_normal {
                    base.set_diffuse_normal(&frame, normal, M::first(1));
                }
                let albedo = base.albedo();
                (Ground::Base(Box::new(base)), albedo)
            }
        };
        let (mut coat_pmf, mut sheen_pmf) = (zero, zero);
        let (mut left, mut upper) = (one, zero);
        if let Some((coat, _)) = &coat {
            coat_pmf = coat.albedo();
            left = coat.scale();
            upper = coat_pmf;
        }
        if let Some(sheen) = &sheen {
            sheen_pmf = sheen.albedo().max_component() * left;
            left = left * sheen.scale(wo);
            upper = upper + sheen_pmf;
        }
        let all = upper + ground_albedo * left;
        let all = one / all.max(F::splat(1e-30));
        Self { frame, ground, sheen, coat, coat_pmf: coat_pmf * all, sheen_pmf: sheen_pmf * all }
    }

    /// About the shading normal.
    pub fn frame(&self) -> &Frame<Scalar> {
        &self.frame
    }

    /// What sheen and coat leave of what goes to or comes from local `wi`.
    pub(super) fn left(&self, wi: V3<Scalar>) -> F {
        let coat = self.coat.as_ref().map_or(F::one(), |(coat, _)| coat.scale());
        self.sheen.as_ref().map_or(coat, |sheen| coat * sheen.scale(wi))
    }

    /// What lies below coat and sheen; `None` for the Disney BRDF.
    pub(super) fn base(&self) -> Option<&Base<'e, Scalar, Rich>> {
        match &self.ground {
            Ground::Base(base) => Some(base),
            Ground::Disney(_) => None,
        }
    }

    /// The direction of the coat's mirror, world space, and what it reflects; `None` where there is none.
    pub(super) fn coat_mirror(&self) -> Option<(V3<Scalar>, V3<Scalar>)> {
        let (coat, frame) = self.coat.as_ref().filter(|(coat, _)| coat.is_delta().any())?;
        // A mirror has one direction, whatever the numbers.
        let wi = frame.to_world(coat.sample([F::zero(), F::zero()]));
        Some((wi, V3::splat([1.0; 3]).scale(coat.mirror())))
    }

    /// Value and density.
    #[inline(never)]
    pub fn eval(&self, wi: V3<Scalar>) -> BsdfValue<Scalar> {
        let local = self.frame.to_local(wi);
        let mut value = match &self.ground {
            Ground::Base(base) => base.eval(local),
            Ground::Disney(disney) => disney.eval(local),
        };
        value.pdf = value.pdf * (F::one() - self.coat_pmf - self.sheen_pmf).max(F::zero());
        value.f_cos = value.f_cos.scale(self.left(local));
        if let Some(sheen) = &self.sheen {
            let above = sheen.eval(local);
            let coat = self.coat.as_ref().map_or(F::one(), |(coat, _)| coat.scale());
            value.f_cos = above.f_cos.mul_add(coat, value.f_cos);
            value.pdf = above.pdf.mul_add(self.sheen_pmf, value.pdf);
        }
        if let Some((coat, frame)) = &self.coat {
            let above = coat.eval(frame.to_local(wi));
            value.f_cos = value.f_cos + above.f_cos;
            value.pdf = above.pdf.mul_add(self.coat_pmf, value.pdf);
        }
        value
    }

    /// What goes straight through.
    #[inline(never)]
    pub fn straight(&self) -> V3<Scalar> {
        match &self.ground {
            Ground::Base(base) => base.straight().scale(self.left(V3::splat([0.0, 0.0, -1.0]))),
            Ground::Disney(_) => V3::zero(),
        }
    }

    /// A direction.
    #[inline(never)]
    pub fn sample(&self, u: [F; 2], u_lobe: F) -> BsdfSample<Scalar> {
        let (zero, one) = (F::zero(), F::one());
        let none = M::from_bits(0);
        if let Some((coat, frame)) = &self.coat
            && u_lobe.lt(self.coat_pmf).any()
        {
            let sampled = coat.sample(u);
            let wi = frame.to_world(sampled);
            if coat.is_delta().any() {
                let weight = V3::<Scalar>::splat([1.0; 3]).scale(coat.mirror() / self.coat_pmf);
                let pdf = F::splat(f32::INFINITY);
                return BsdfSample { wi, weight, pdf, valid: M::first(1), transmitted: none, straight: none };
            }
            // Below its own horizon the coat has no density, but other lobes may: what is lost there is none of theirs.
            return self.weigh(wi, none, sampled.z.gt(zero));
        }
        let u_lobe = u_lobe - self.coat_pmf;
        if let Some(sheen) = &self.sheen
            && u_lobe.lt(self.sheen_pmf).any()
        {
            return self.weigh(self.frame.to_world(sheen.sample(u)), none, M::first(1));
        }
        let share = (one - self.coat_pmf - self.sheen_pmf).max(F::splat(1e-30));
        let u_lobe = ((u_lobe - self.sheen_pmf) / share).max(zero).min(F::splat(1.0 - f32::EPSILON / 2.0));
        match &self.ground {
            Ground::Disney(disney) => {
                let sampled = disney.sample(u, u_lobe);
                self.weigh(self.frame.to_world(sampled), none, sampled.z.gt(zero))
            }
            Ground::Base(base) => {
                let sample = base.sample(u, u_lobe);
                let wi = self.frame.to_world(sample.wi);
                if !sample.delta.any() {
                    return self.weigh(wi, sample.transmitted, sample.valid);
                }
                let to = V3::<Scalar>::splat([0.0, 0.0, -1.0]).or_else(sample.transmitted, sample.wi);
                BsdfSample {
                    wi,
                    weight: sample.delta_weight.scale(self.left(to) / share),
                    pdf: F::splat(f32::INFINITY),
                    valid: sample.valid,
                    transmitted: sample.transmitted,
                    straight: sample.straight,
                }
            }
        }
    }

    /// The sample of direction `wi`, weighed by all lobes.
    fn weigh(&self, wi: V3<Scalar>, transmitted: M, valid: M) -> BsdfSample<Scalar> {
        let value = self.eval(wi);
        BsdfSample {
            wi,
            weight: value.f_cos.scale(F::one() / value.pdf),
            pdf: value.pdf,
            valid: valid & value.pdf.gt(F::zero()),
            transmitted,
            straight: M::from_bits(0),
        }
    }
}
