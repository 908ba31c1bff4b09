//! The evaluated closure: metal and roughness over all lanes (`Base`), and lanes of other materials one by one
//! ([`Layered`]).
//!
//! Directions are world space here and local in the lobes.

use super::base::Base;
pub use super::base::DELTA_ALPHA;
use super::energy::Energy;
use super::extent::Plain;
use super::layered::Layered;
use super::surface::Surface;
use crate::math::{Frame, V3};
use simd::{Float, Lanes, Mask, Part, Scalar};

#[path = "bsdf_mirrors.rs"]
mod mirrors;

pub use mirrors::Mirror;

/// A surface's reflection and transmission at one hit; no textures left.
pub struct Bsdf<'e, L: Lanes> {
    /// Local frame about the shading normal.
    pub frame: Frame<L>,
    base: Base<'e, L, Plain>,
    /// Lanes that are shaded on their own.
    layered: Vec<(usize, Layered<'e>)>,
}

/// Value and density for a pair of directions.
#[derive(Clone, Copy)]
pub struct BsdfValue<L: Lanes> {
    /// BSDF times `cos(wi, ns)`, 1/sr; delta lobes excluded.
    pub f_cos: V3<L>,
    /// Density of [`Bsdf::sample`], 1/sr; delta lobes excluded.
    pub pdf: L::F,
}

/// A sampled direction.
pub struct BsdfSample<L: Lanes> {
    /// World space, unit.
    pub wi: V3<L>,
    /// BSDF x cosine / density.
    pub weight: V3<L>,
    /// 1/sr; infinite where a delta lobe was sampled.
    pub pdf: L::F,
    /// Lanes that have a direction at all.
    pub valid: L::M,
    /// Lanes whose direction leads to the other side of the surface.
    pub transmitted: L::M,
    /// Lanes that go on as they came, through a thin-walled surface of roughness 0: no scattering, light from there was
    /// sampled before (see [`Bsdf::straight`]).
    pub straight: L::M,
}

/// From where a surface is seen.
pub struct View<L: Lanes> {
    /// About the shading normal on the viewer's side; x along the tangent in lanes with anisotropy.
    pub frame: Frame<L>,
    /// About the coat's normal on the viewer's side; `None`: the same.
    pub coat_frame: Option<Frame<L>>,
    /// Towards the viewer, world space, unit.
    pub wo: V3<L>,
    /// Index of refraction behind the surface over that before it, as seen by the viewer; read at the boundaries of
    /// volumes only. 1: there is no boundary.
    pub eta: L::F,
}

impl<L: Lanes> View<L> {
    /// Of an uncoated surface that is no boundary.
    #[inline(always)]
    pub fn new(frame: Frame<L>, wo: V3<L>) -> Self {
        Self { frame, coat_frame: None, wo, eta: L::F::one() }
    }
}

impl<'e, L: Lanes> Bsdf<'e, L> {
    /// The closure for a surface seen so. Where `wo . frame.z` is not positive, a surface with a specular lobe reflects
    /// nothing.
    #[inline(always)]
    pub fn new(surface: &Surface<L>, view: &View<L>, energy: &'e Energy) -> Self {
        Self { frame: view.frame, base: Base::new(surface, view, energy), layered: Vec::new() }
    }

    /// Makes lanes closures of their own.
    #[inline(always)]
    pub fn set_layered(&mut self, layered: Vec<(usize, Layered<'e>)>) {
        let mut normals = Spread::of(self.frame.z);
        for (lane, closure) in &layered {
            normals.set(*lane, closure.frame().z);
        }
        // Nobody asks for the other axes of these lanes.
        self.frame.z = normals.join();
        self.layered = layered;
    }

    /// Puts the diffuse lobe about the world normal `normal` (unit) in those of `lanes` that have two lobes: the specular
    /// one's normal may have been bent for its mirror's sake, which is no matter of the diffuse one.
    #[inline(always)]
    pub fn set_diffuse_normal(&mut self, normal: V3<L>, lanes: L::M) {
        self.base.set_diffuse_normal(&self.frame, normal, lanes);
    }

    /// Lanes of metal and roughness alone that have a specular lobe.
    #[inline(always)]
    pub fn is_glossy(&self) -> L::M {
        let layered = self.layered.iter().fold(0, |bits, (lane, _)| bits | 1 << lane);
        !(self.base.is_diffuse() | L::M::from_bits(layered))
    }

    /// Value and density for world direction `wi`; each lobe is zero beyond its horizon.
    #[inline(always)]
    pub fn eval(&self, wi: V3<L>) -> BsdfValue<L> {
        let value = L::outline(EvalBase { base: &self.base, wi: self.frame.to_local(wi) });
        if self.layered.is_empty() { value } else { self.eval_layered(wi, value) }
    }

    #[inline(always)]
    fn eval_layered(&self, wi: V3<L>, value: BsdfValue<L>) -> BsdfValue<L> {
        let wi = Spread::of(wi);
        let (mut f_cos, mut pdf) = (Spread::of(value.f_cos), [0.0; 16]);
        value.pdf.store(&mut pdf, 0);
        for (lane, closure) in &self.layered {
            let one = closure.eval(wi.lane(*lane));
            f_cos.set(*lane, one.f_cos);
            pdf[*lane] = one.pdf.first();
        }
        BsdfValue { f_cos: f_cos.join(), pdf: L::F::load(&pdf, 0) }
    }

    /// Share of light, per colour, that goes straight through a thin-walled surface of roughness 0, whatever [`Bsdf::eval`]
    /// says besides: what a shadow ray keeps of its light, and what [`Bsdf::sample`] gives on average to rays that go on
    /// as they came. 0 for all other surfaces.
    #[inline(always)]
    pub fn straight(&self) -> V3<L> {
        let mut through = Spread::of(V3::<L>::zero());
        for (lane, closure) in &self.layered {
            through.set(*lane, closure.straight());
        }
        through.join()
    }

    /// A direction from the mixture of all lobes, by `u` (direction) and `u_lobe`.
    #[inline(always)]
    pub fn sample(&self, u: [L::F; 2], u_lobe: L::F) -> BsdfSample<L> {
        let sample = L::outline(SampleBase { bsdf: self, u, u_lobe });
        if self.layered.is_empty() { sample } else { self.sample_layered(u, u_lobe, sample) }
    }

    #[inline(always)]
    fn sample_layered(&self, u: [L::F; 2], u_lobe: L::F, sample: BsdfSample<L>) -> BsdfSample<L> {
        let u = Spread::of(V3::<L>::new(u[0], u[1], u_lobe));
        let (mut wi, mut weight, mut pdf) = (Spread::of(sample.wi), Spread::of(sample.weight), [0.0; 16]);
        sample.pdf.store(&mut pdf, 0);
        let [mut valid, mut transmitted, mut straight] =
            [sample.valid.bits(), sample.transmitted.bits(), sample.straight.bits()];
        for (lane, closure) in &self.layered {
            let u = u.lane(*lane);
            let one = closure.sample([u.x, u.y], u.z);
            wi.set(*lane, one.wi);
            weight.set(*lane, one.weight);
            pdf[*lane] = one.pdf.first();
            put(&mut valid, *lane, one.valid.any());
            put(&mut transmitted, *lane, one.transmitted.any());
            put(&mut straight, *lane, one.straight.any());
        }
        BsdfSample {
            wi: wi.join(),
            weight: weight.join(),
            pdf: L::F::load(&pdf, 0),
            valid: L::M::from_bits(valid),
            transmitted: L::M::from_bits(transmitted),
            straight: L::M::from_bits(straight),
        }
    }

    #[inline(always)]
    fn sample_base(&self, u: [L::F; 2], u_lobe: L::F) -> BsdfSample<L> {
        let zero = L::F::zero();
        let sample = self.base.sample(u, u_lobe);
        let wi = self.frame.to_world(sample.wi);
        let (diffuse, is_diffuse) = self.base.only_diffuse();
        let value = L::outline(EvalBase { base: &self.base, wi: sample.wi });
        if !self.base.has_specular() {
            return BsdfSample {
                wi,
                weight: diffuse,
                pdf: value.pdf,
                valid: sample.valid,
                transmitted: sample.transmitted,
                straight: sample.straight,
            };
        }
        // The weight of a lobe that is alone is its colour, exactly.
        let weight = diffuse.or_else(is_diffuse, value.f_cos.scale(L::F::one() / value.pdf));
        BsdfSample {
            wi,
            weight: sample.delta_weight.or_else(sample.delta, weight),
            pdf: L::F::splat(f32::INFINITY).or_else(sample.delta, value.pdf),
            valid: sample.valid & (sample.delta | value.pdf.gt(zero)),
            transmitted: sample.transmitted,
            straight: sample.straight,
        }
    }
}

/// [`Base::eval`], which is called for the light's direction and for the sampled one.
struct EvalBase<'a, 'e, L: Lanes> {
    base: &'a Base<'e, L, Plain>,
    wi: V3<L>,
}

impl<L: Lanes> Part<L> for EvalBase<'_, '_, L> {
    type Output = BsdfValue<L>;

    #[inline(always)]
    fn run(self) -> BsdfValue<L> {
        self.base.eval(self.wi)
    }
}

/// [`Bsdf::sample_base`].
struct SampleBase<'a, 'e, L: Lanes> {
    bsdf: &'a Bsdf<'e, L>,
    u: [L::F; 2],
    u_lobe: L::F,
}

impl<L: Lanes> Part<L> for SampleBase<'_, '_, L> {
    type Output = BsdfSample<L>;

    #[inline(always)]
    fn run(self) -> BsdfSample<L> {
        self.bsdf.sample_base(self.u, self.u_lobe)
    }
}

/// Sets bit `lane` to `value`.
#[inline(always)]
fn put(bits: &mut u32, lane: usize, value: bool) {
    *bits = *bits & !(1 << lane) | u32::from(value) << lane;
}

/// Vectors lane by lane.
struct Spread([[f32; 16]; 3]);

impl Spread {
    #[inline(always)]
    fn of<L: Lanes>(v: V3<L>) -> Self {
        let mut out = [[0.0; 16]; 3];
        v.x.store(&mut out[0], 0);
        v.y.store(&mut out[1], 0);
        v.z.store(&mut out[2], 0);
        Self(out)
    }

    #[inline(always)]
    fn lane(&self, i: usize) -> V3<Scalar> {
        V3::splat([self.0[0][i], self.0[1][i], self.0[2][i]])
    }

    #[inline(always)]
    fn set(&mut self, i: usize, v: V3<Scalar>) {
        for (lanes, c) in self.0.iter_mut().zip([v.x, v.y, v.z]) {
            lanes[i] = c.first();
        }
    }

    #[inline(always)]
    fn join<L: Lanes>(&self) -> V3<L> {
        V3::new(L::F::load(&self.0[0], 0), L::F::load(&self.0[1], 0), L::F::load(&self.0[2], 0))
    }
}

#[cfg(test)]
#[path = "bsdf_tests.rs"]
mod tests;
