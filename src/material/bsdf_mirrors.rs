//! All mirror directions of a surface, each with what it is worth: for tracers that follow every one of them.

use super::{Bsdf, BsdfSample, Spread, put};
use crate::material::base::BaseSample;
use crate::material::layered::Layered;
use crate::math::{Frame, V3};
use simd::{Float, Lanes, Mask, Part, Scalar};

/// One of the mirrors of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mirror {
    /// The coat's.
    Coat,
    /// That of what lies below it.
    Surface,
    /// Through the surface: refracted, or straight on through thin walls.
    Behind,
}

impl<L: Lanes> Bsdf<'_, L> {
    /// The direction of `mirror` and what it reflects or lets through; valid in lanes that have it.
    #[inline(always)]
    pub fn mirror(&self, mirror: Mirror) -> BsdfSample<L> {
        L::outline(Follow { bsdf: self, mirror })
    }

    /// The mirror of lanes of metal and roughness alone, which have no other.
    #[inline(always)]
    fn mirror_of_base(&self, mirror: Mirror) -> BsdfSample<L> {
        let none = L::M::from_bits(0);
        if mirror != Mirror::Surface || !self.base.has_specular() {
            return BsdfSample {
                wi: self.frame.z,
                weight: V3::zero(),
                pdf: L::F::splat(f32::INFINITY),
                valid: none,
                transmitted: none,
                straight: none,
            };
        }
        of_base(self.base.mirrored(), &self.frame)
    }
}

/// [`Bsdf::mirror`].
struct Follow<'a, 'e, L: Lanes> {
    bsdf: &'a Bsdf<'e, L>,
    mirror: Mirror,
}

impl<L: Lanes> Part<L> for Follow<'_, '_, L> {
    type Output = BsdfSample<L>;

    #[inline(always)]
    fn run(self) -> BsdfSample<L> {
        let Self { bsdf, mirror } = self;
        let plain = bsdf.mirror_of_base(mirror);
        if bsdf.layered.is_empty() {
            return plain;
        }
        let (mut wi, mut weight) = (Spread::of(plain.wi), Spread::of(plain.weight));
        let [mut valid, mut transmitted, mut straight] =
            [plain.valid.bits(), plain.transmitted.bits(), plain.straight.bits()];
        for (lane, closure) in &bsdf.layered {
            let one = closure.mirror(mirror);
            let has = one.is_some();
            if let Some(one) = &one {
                wi.set(*lane, one.wi);
                weight.set(*lane, one.weight);
            }
            let is = |f: fn(&BsdfSample<Scalar>) -> bool| one.as_ref().is_some_and(f);
            put(&mut valid, *lane, has);
            put(&mut transmitted, *lane, is(|one| one.transmitted.any()));
            put(&mut straight, *lane, is(|one| one.straight.any()));
        }
        BsdfSample {
            wi: wi.join(),
            weight: weight.join(),
            pdf: plain.pdf,
            valid: L::M::from_bits(valid),
            transmitted: L::M::from_bits(transmitted),
            straight: L::M::from_bits(straight),
        }
    }
}

/// A sample of the base in world directions.
#[inline(always)]
fn of_base<L: Lanes>(sample: BaseSample<L>, frame: &Frame<L>) -> BsdfSample<L> {
    BsdfSample {
        wi: frame.to_world(sample.wi),
        weight: sample.delta_weight,
        pdf: L::F::splat(f32::INFINITY),
        valid: sample.valid,
        transmitted: sample.transmitted,
        straight: sample.straight,
    }
}

impl Layered<'_> {
    /// [`Bsdf::mirror`]; `None` where there is none.
    #[inline(never)]
    fn mirror(&self, mirror: Mirror) -> Option<BsdfSample<Scalar>> {
        let none = <Scalar as Lanes>::M::from_bits(0);
        let sample = match mirror {
            Mirror::Coat => {
                let (wi, weight) = self.coat_mirror()?;
                let valid = <Scalar as Lanes>::M::first(1);
                let pdf = <Scalar as Lanes>::F::splat(f32::INFINITY);
                BsdfSample { wi, weight, pdf, valid, transmitted: none, straight: none }
            }
            Mirror::Surface | Mirror::Behind => {
                let base = self.base()?;
                let sample = if mirror == Mirror::Surface { base.mirrored() } else { base.passed() };
                let local = if mirror == Mirror::Surface { sample.wi } else { V3::splat([0.0, 0.0, -1.0]) };
                let mut sample = of_base(sample, self.frame());
                sample.weight = sample.weight.scale(self.left(local));
                sample
            }
        };
        sample.valid.any().then_some(sample)
    }
}
