//! The closure of one lane whose material has more than metal and roughness: the lobes that few materials use are shaded
//! one lane at a time, so that the others' kernels stay small.

use super::base::Base;
use super::bsdf::{BsdfSample, BsdfValue, View};
use super::energy::Energy;
use super::surface::Surface;
use crate::math::{Frame, V3};
use simd::{Float, Lanes, Mask, Scalar};

type F = <Scalar as Lanes>::F;

/// See [`super::bsdf::Bsdf`], whose methods these are.
pub struct Layered<'e> {
    frame: Frame<Scalar>,
    base: Base<'e, Scalar, true>,
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
        let mut base = Base::new(surface, view, energy);
        if let Some(normal) = diffuse_normal {
            base = base.with_diffuse_normal(&view.frame, normal, <Scalar as Lanes>::M::first(1));
        }
        Self { frame: view.frame, base }
    }

    /// Value and density.
    #[inline(never)]
    pub fn eval(&self, wi: V3<Scalar>) -> BsdfValue<Scalar> {
        self.base.eval(self.frame.to_local(wi))
    }

    /// What goes straight through.
    #[inline(never)]
    pub fn straight(&self) -> V3<Scalar> {
        self.base.straight()
    }

    /// A direction.
    #[inline(never)]
    pub fn sample(&self, u: [F; 2], u_lobe: F) -> BsdfSample<Scalar> {
        let zero = F::zero();
        let sample = self.base.sample(u, u_lobe);
        let value = self.base.eval(sample.wi);
        let weight = value.f_cos.scale(F::one() / value.pdf);
        BsdfSample {
            wi: self.frame.to_world(sample.wi),
            weight: sample.delta_weight.or_else(sample.delta, weight),
            pdf: F::splat(f32::INFINITY).or_else(sample.delta, value.pdf),
            valid: sample.valid & (sample.delta | value.pdf.gt(zero)),
            transmitted: sample.transmitted,
            straight: sample.straight,
        }
    }
}
