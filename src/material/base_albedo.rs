//! What a base's specular layer reflects on the whole, towards a direction and on average, and so leaves for what is below.
//!
//! Films and stretched highlights are shaded one lane at a time: what is asked of them here is not masked by lane.

use super::Base;
use crate::material::energy::{FILM_NODES, Row};
use crate::material::extent::{Extent, Room};
use crate::material::film::tilted;
use crate::math::V3;
use crate::math::lanes::{lerp, pow5};
use simd::{Float, Lanes, Mask};

impl<L: Lanes, K: Extent> Base<'_, L, K> {
    /// Albedo of GGX reflecting everything, and the rise of Fresnel's curve, towards `w` (w.z > 0).
    #[inline(always)]
    pub(super) fn albedo_toward(&self, w: V3<L>) -> [L::F; 2] {
        if !self.is_full {
            return [L::F::one(), pow5(L::F::one() - w.z.min(L::F::one()))];
        }
        let mut white = self.energy.white::<L>(&self.row, w.z);
        if !self.has_layer {
            return [L::F::one().or_else(self.is_delta, white), L::F::zero()];
        }
        let mut found_rise = self.energy.rise::<L>(&self.row, w.z);
        if let Some(stretched) = self.stretched.get() {
            let [own, schlick] = self.energy.stretched::<L>(stretched, w);
            let own_rise = self.energy.stretched_rise::<L>(&self.row_toward(w), w.z, schlick);
            (white, found_rise) =
                (own.or_else(self.is_stretched, white), own_rise.or_else(self.is_stretched, found_rise));
        }
        if !self.is_delta.any() {
            return [white, found_rise];
        }
        // A mirror's curve is Fresnel's own.
        let rise = self.rise(w.z, pow5(L::F::one() - w.z.min(L::F::one())));
        [L::F::one().or_else(self.is_delta, white), rise.or_else(self.is_delta, found_rise)]
    }

    /// Where the albedos towards `w` are that are tabulated for round lobes only: the tilt of normals towards `w` is what
    /// counts for the cosines between them.
    #[inline(always)]
    pub(super) fn row_toward(&self, w: V3<L>) -> Row<L> {
        match self.stretched.get() {
            Some(stretched) => self.energy.row_at::<L>(&self.row, stretched.toward(w)),
            None => self.row,
        }
    }

    /// Mean of the albedo of GGX reflecting everything.
    #[inline(always)]
    pub(super) fn mean(&self) -> L::F {
        match self.stretched.get() {
            Some(stretched) => stretched.mean.or_else(self.is_stretched, self.row.mean),
            None => self.row.mean,
        }
    }

    /// Mean of the rise of Fresnel's curve.
    #[inline(always)]
    pub(super) fn mean_rise(&self) -> L::F {
        match self.stretched.get() {
            Some(stretched) => stretched.mean_rise.or_else(self.is_stretched, self.row.mean_rise),
            None => self.row.mean_rise,
        }
    }

    /// Shares of the albedo towards `w` that come from normals at the cosines where a film's reflectance is taken.
    #[inline(always)]
    pub(super) fn shares(&self, w: V3<L>) -> [L::F; FILM_NODES] {
        let shares = self.energy.film_shares::<L>(&self.row_toward(w), w.z);
        let Some(stretched) = self.stretched.get() else { return shares };
        tilted::<L>(shares, self.energy.stretched::<L>(stretched, w)[1])
    }

    /// Of the mean albedo.
    #[inline(always)]
    pub(super) fn mean_shares(&self) -> [L::F; FILM_NODES] {
        let shares = self.energy.film_mean_shares::<L>(&self.row);
        let Some(stretched) = self.stretched.get() else { return shares };
        tilted::<L>(shares, stretched.mean_schlick)
    }

    /// What the layer leaves of the viewer's light, so that with what [`Base::under`] leaves of `wi`'s the mean is right.
    #[inline(always)]
    pub(super) fn left(shadowed: V3<L>, shadowed_mean: V3<L>) -> V3<L> {
        V3::new(
            Self::left_of(shadowed.x, shadowed_mean.x),
            Self::left_of(shadowed.y, shadowed_mean.y),
            Self::left_of(shadowed.z, shadowed_mean.z),
        )
    }

    #[inline(always)]
    fn left_of(shadowed: L::F, mean: L::F) -> L::F {
        let one = L::F::one();
        let left = (one - shadowed) / (one - mean).max(L::F::splat(1e-4));
        if K::IS_RICH { left.max(L::F::zero()) } else { left }
    }

    /// What the specular layer leaves of light from `wi` for the diffuse base, in addition to the viewer's.
    #[inline(always)]
    pub(super) fn under(&self, wi: V3<L>, albedo: [L::F; 2]) -> V3<L> {
        let one = L::F::one();
        let all = V3::<L>::splat([1.0; 3]);
        let [white, rise] = albedo;
        let [f0, again] = self.layer;
        let layer = lerp(f0, self.weight, rise);
        if let Some(film) = self.film.get() {
            let taken = film.toward(self.shares(wi), layer, self.weight);
            // A film's shares add up to 1 but for rounding.
            return (all - taken.scale(white) - film.again().scale(one - white)).max(V3::zero());
        }
        let left = one - layer * white - again * (one - white);
        all.scale(if K::IS_RICH { left.max(L::F::zero()) } else { left })
    }
}
