//! What a surface does with light at a hit: textures applied, frames found, the evaluated closure.

use super::SceneTables;
use super::interaction::Interaction;
use super::normals::{shading_normal, view};
use crate::material::bsdf::{Bsdf, View};
use crate::material::surface::Surface;
use crate::math::V3;
use crate::math::bend::let_mirror_leave;
use simd::{Float, Lanes, Mask};

/// A surface at a hit, all but directions known.
pub(super) struct Closure<L: Lanes> {
    pub bsdf: Bsdf<L>,
    /// Lanes from which light may get to the other side.
    pub transmits: L::M,
}

/// Textures and vertex colours applied.
#[inline(always)]
pub(super) fn surface<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, active: L::M) -> Surface<L> {
    let mut surface = tables.materials.surface(&tables.textures, si.triangle.material, &si.uvs, active);
    if tables.triangles.has_colors() {
        // Exporters write colours above 1; a base colour is a reflectance.
        surface.base = (surface.base * si.color).min(V3::splat([1.0; 3]));
    }
    surface
}

/// Textures applied, shading frame found: what is left is directions. `eta` as in [`View::eta`].
#[inline(always)]
pub(super) fn closure<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, eta: L::F, active: L::M) -> Closure<L> {
    let surface = surface(tables, si, active);
    let zero = L::F::zero();
    let transmits = match &surface.extras {
        Some(e) => active & (e.transmission.gt(zero) | e.diffuse_transmission.gt(zero)),
        None => L::M::from_bits(0),
    };
    let bsdf = if !tables.has_shading_normals() {
        let view = View { eta, ..view(tables, si, &surface, si.ng, active) };
        Bsdf::new(surface, view)
    } else {
        let ns = shading_normal(tables, si, active);
        // Only what mirrors needs a mirror direction; the diffuse lobe keeps the normal as it is.
        let (bent, low) = let_mirror_leave(ns, si.ng, si.wo);
        let low = low & active & surface.has_specular();
        let view = View { eta, ..view(tables, si, &surface, bent.or_else(low, ns), active) };
        let bsdf = Bsdf::new(surface, view);
        if low.any() { bsdf.with_diffuse_normal(ns, low) } else { bsdf }
    };
    Closure { bsdf, transmits }
}

impl<L: Lanes> Closure<L> {
    /// Lanes in which light from `wi` (or scattered to it) is light that goes through the surface, and those in which
    /// it does so or is reflected validly: on the proper side of both the geometric and the shading normal.
    #[inline(always)]
    pub fn sides(&self, tables: &SceneTables, si: &Interaction<L>, wi: V3<L>) -> (L::M, L::M) {
        let outside = si.is_outside(wi);
        if !tables.media.transmits() {
            return (L::M::from_bits(0), outside);
        }
        // An opaque surface's lobes may have normals of their own; what transmits has one, and its sign says which lobe
        // the value is of.
        let through = self.transmits & wi.dot(self.bsdf.frame.z).lt(L::F::zero());
        (through & si.is_behind(wi), (outside & !through) | (through & si.is_behind(wi)))
    }
}
