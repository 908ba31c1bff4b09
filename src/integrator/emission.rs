//! Light of surfaces that a path happens to hit.

use super::SceneTables;
use super::interaction::Interaction;
use super::receiver::{self, Remembered};
use super::weight::weight_of_remembered;
use crate::math::V3;
use crate::shape::table::NONE;
use simd::{Float, Lanes, Mask, Part, Uint};

/// Radiance that the surfaces of `hit` send back along the ray, weighed against having sampled it as a light, and the
/// lanes that have any. `distance` (metres) from the last scattering, whose direction had the density `prev_pdf` (1/sr) and
/// whose light was chosen from what `from` remembers of the paths `at ..`.
#[inline(always)]
pub(super) fn emitted<L: Lanes>(
    tables: &SceneTables,
    si: &Interaction<L>,
    from: &Remembered,
    at: usize,
    distance: L::F,
    prev_pdf: L::F,
    hit: L::M,
) -> (V3<L>, L::M) {
    L::outline(Emitted { tables, si, from, at, distance, prev_pdf, hit })
}

/// Radiance that the surfaces of `hit` send back along the ray, and the lanes that have any.
#[inline(always)]
pub(super) fn shining<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, hit: L::M) -> (V3<L>, L::M) {
    let (materials, material) = (&tables.materials, si.triangle.material);
    let le: V3<L> = materials.emission(&tables.textures, material, si.front, &si.uvs, hit);
    let lit = hit & le.max_component().gt(L::F::zero());
    if !materials.has_coat() || !lit.any() {
        return (le, lit);
    }
    let cos = si.wo.dot(si.ng);
    (le.scale(materials.emission_through_coat::<L>(&tables.textures, material, cos, &si.uvs, lit)), lit)
}

/// [`emitted`].
struct Emitted<'a, L: Lanes> {
    tables: &'a SceneTables,
    si: &'a Interaction<L>,
    from: &'a Remembered,
    at: usize,
    distance: L::F,
    prev_pdf: L::F,
    hit: L::M,
}

impl<L: Lanes> Part<L> for Emitted<'_, L> {
    type Output = (V3<L>, L::M);

    #[inline(always)]
    fn run(self) -> (V3<L>, L::M) {
        let Self { tables, si, from, at, distance, prev_pdf, hit } = self;
        let (le, lit) = shining(tables, si, hit);
        if !lit.any() {
            return (le, lit);
        }
        // Weighed against having sampled the same point as a light. The ray that found it came straight from the last
        // scattering; only camera rays may have passed a culled surface.
        // Nothing samples what is no light, nor what camera rays and mirrors show.
        let light = si.triangle.light;
        let sampled = lit & prev_pdf.is_finite() & !light.eq(L::U::splat(NONE));
        if !sampled.any() {
            return (le, lit);
        }
        let cos = si.wo.dot(si.triangle.ng).abs();
        let density = tables.lights.density(light, si.p, si.wo, distance, cos) / si.growth;
        let pmf = tables.lights.pmf::<L>(light, receiver::load(tables, from, at));
        let other: L::F = (pmf * density).masked(sampled);
        (le.scale(weight_of_remembered::<L>(prev_pdf, other)), lit)
    }
}
