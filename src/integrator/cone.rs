//! How much of a surface a path sees around the point that it hits, for `--texture-lod`: a cone about each path.
//!
//! After Akenine-Moller, Nilsson, Andersson, Barre-Brisebois, Toth and Karras 2019, "Texture Level of Detail Strategies for
//! Real-Time Ray Tracing", Ray Tracing Gems, chapter 20, section 20.3.4: a width that grows by the cone's spread over the
//! distance, divided by the cosine of incidence, and the ratio of a triangle's areas in texture space and in the scene.
//!
//! What is ours: a camera ray's spread is the root of its pixel's solid angle; scattering adds to the spread
//! [`PER_SAMPLE`] times the root of the solid angle 1 / pdf for which the direction stands, at most [`WIDEST`]. So
//! a mirror (infinite density) keeps the cone, a rough lobe widens it by about its own width, and what is added stays
//! well within the lobe, over which the light is averaged anyway. The curvature of mirrors and lenses is left out: a
//! sphere's reflection is sharper than it could be, a concave mirror's blurrier than it should be.

use super::SceneTables;
use super::interaction::Interaction;
use super::pool::PathPool;
use crate::math::MAX_UV_SETS;
use crate::shape::table::NONE;
use simd::{Float, Lanes, Mask, Uint};

/// Radians of spread that scattering adds, a root of a steradian of 1 / pdf.
const PER_SAMPLE: f32 = 0.25;

/// Radians that scattering adds at most, about what a diffuse surface adds towards its normal (0.44): the density of
/// grazing directions is no measure of a lobe's width.
const WIDEST: f32 = 0.5;

/// The cones of N paths where these hit.
pub(super) struct Cone<L: Lanes> {
    /// Metres across the path.
    width: L::F,
    /// Radians; small, so that it is its own tangent.
    spread: L::F,
}

impl<L: Lanes> Cone<L> {
    /// Of the paths `at ..`, whose rays went `distance` metres.
    #[inline(always)]
    pub fn load(pool: &PathPool, at: usize, distance: L::F) -> Self {
        let spread = L::F::load(&pool.cone_spread, at);
        Self { width: spread.mul_add(distance, L::F::load(&pool.cone_width, at)), spread }
    }

    /// What [`crate::math::UvSets::with_footprints`] takes: the squared width on the surface, by the triangle's areas, in each set.
    #[inline(always)]
    pub fn footprints(&self, tables: &SceneTables, si: &Interaction<L>, hit: L::M) -> [L::F; MAX_UV_SETS] {
        let zero = L::F::zero();
        let has = hit & !si.triangle.attributes.eq(L::U::splat(NONE));
        let on_shape = hit & si.on_shape;
        if !(tables.triangles.has_attributes() && has.any()) {
            if on_shape.any() {
                return [self.on_shape(si).masked(on_shape); MAX_UV_SETS];
            }
            return [zero; MAX_UV_SETS];
        }
        let across = si.triangle.e1.cross(si.triangle.e2);
        let width = self.width / si.wo.dot(si.triangle.ng).abs();
        // Width by width, which stays in range where its square would not.
        let per_area = width / across.dot(across).sqrt();
        let mut areas = tables.triangles.uv_areas::<L>(si.triangle.attributes);
        for area in &mut areas {
            *area = (*area * per_area * width).masked(has);
        }
        if on_shape.any() {
            let own = self.on_shape(si);
            for area in &mut areas {
                *area = own.or_else(on_shape, *area);
            }
        }
        areas
    }

    /// [`Self::footprints`] on exact shapes, whose derivatives span a unit of coordinates: finite at their poles too.
    #[inline(always)]
    fn on_shape(&self, si: &Interaction<L>) -> L::F {
        let across = si.triangle.e1.cross(si.triangle.e2);
        let width = self.width / si.wo.dot(si.triangle.ng).abs();
        (width / across.dot(across).sqrt() * width).min(L::F::splat(f32::MAX))
    }

    /// Writes the cones that go on in the lanes of `alive` as paths `to ..`: wider where they were scattered with the
    /// density `pdf` (1/sr), as they are in the lanes that go `straight` on.
    #[inline(always)]
    pub fn follow(&self, pool: &mut PathPool, to: usize, pdf: L::F, straight: L::M, alive: L::M) {
        let spread = self.spread.or_else(straight, scattered::<L>(self.spread, pdf));
        self.width.compress(alive, &mut pool.cone_width, to);
        spread.compress(alive, &mut pool.cone_spread, to);
    }
}

/// The spread after scattering in a direction of density `pdf`, 1/sr.
#[inline(always)]
fn scattered<L: Lanes>(spread: L::F, pdf: L::F) -> L::F {
    spread + (L::F::splat(PER_SAMPLE) / pdf.sqrt()).min(L::F::splat(WIDEST))
}

#[cfg(test)]
#[path = "cone_tests.rs"]
mod tests;
