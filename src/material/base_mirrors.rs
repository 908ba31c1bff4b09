//! The mirror directions of a smooth surface with what each of them is worth: what `Base::sample` chooses among.

use super::{Base, BaseSample, Extent, Room};
use crate::math::V3;
use crate::math::lanes::safe_sqrt;
use simd::{Float, Lanes, Mask};

impl<L: Lanes, K: Extent> Base<'_, L, K> {
    /// The mirror's direction with its reflectance, in lanes whose specular lobes are mirrors.
    #[inline(always)]
    pub fn mirrored(&self) -> BaseSample<L> {
        let none = L::M::from_bits(0);
        let (reflected, _, _) = self.at_half(self.wo.z);
        let valid = self.is_delta & self.is_seen;
        BaseSample {
            wi: V3::new(-self.wo.x, -self.wo.y, self.wo.z),
            delta: valid,
            delta_weight: reflected,
            transmitted: none,
            straight: none,
            valid,
        }
    }

    /// The direction behind the surface with what gets through, in the same lanes.
    #[inline(always)]
    pub fn passed(&self) -> BaseSample<L> {
        let (zero, one) = (L::F::zero(), L::F::one());
        let mut valid = self.is_delta & self.is_seen;
        let Some(through) = self.through.get() else {
            let none = L::M::from_bits(0);
            let (wi, delta_weight) = (-self.wo, V3::zero());
            return BaseSample { wi, delta: none, delta_weight, transmitted: none, straight: none, valid: none };
        };
        let c = self.wo.z;
        let (_, passed, _) = self.at_half(c);
        // Refracted: c / eta - cos_t about the normal (0, 0, 1).
        let eta = through.eta.max(L::F::splat(1e-6));
        let cos_t = safe_sqrt(one - (one - c * c).max(zero) / (eta * eta));
        let bent = V3::<L>::new(-self.wo.x / eta, -self.wo.y / eta, -cos_t).normalized();
        let goes_on = !through.is_volume | through.is_none;
        let wi = (-self.wo).or_else(goes_on, bent);
        valid = valid & wi.z.lt(zero) & passed.max_component().gt(zero);
        let radiance = (one / (eta * eta)).or_else(through.is_volume, one);
        BaseSample {
            wi,
            delta: valid,
            delta_weight: passed.scale(radiance),
            transmitted: valid,
            straight: valid & !through.is_volume,
            valid,
        }
    }
}
