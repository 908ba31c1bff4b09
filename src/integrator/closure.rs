//! What a surface does with light at a hit: textures applied, frames found, the evaluated closure.

use super::SceneTables;
use super::interaction::{Interaction, interact};
use super::normals::{shading_normal, view};
use crate::accel::HitBatch;
use crate::material::bsdf::{Bsdf, View};
use crate::material::layered::Layered;
use crate::material::media::MediumTable;
use crate::material::surface::Surface;
use crate::math::bend::let_mirror_leave;
use crate::math::{Frame, MAX_UV_SETS, V3};
use simd::{Float, Lanes, Mask, Part, Scalar, Uint};

/// A surface at a hit, all but directions known.
pub(super) struct Closure<'t, L: Lanes> {
    pub bsdf: Bsdf<'t, L>,
    /// Lanes from which light may get to the other side.
    pub transmits: L::M,
}

/// Vertex colours applied to a surface that has its textures.
#[inline(always)]
fn colored<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, mut surface: Surface<L>) -> Surface<L> {
    if tables.triangles.has_colors() {
        // Exporters write colours above 1; a base colour is a reflectance.
        surface.base = (surface.base * si.color).min(V3::splat([1.0; 3]));
    }
    surface
}

/// Textures and vertex colours applied, without what only some materials have.
#[inline(always)]
pub(super) fn surface<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, active: L::M) -> Surface<L> {
    colored(tables, si, tables.materials.surface(&tables.textures, si.triangle.material, &si.uvs, active))
}

/// Textures applied, shading frame found: what is left is directions. As if no material had more than metal and roughness;
/// see [`Closure::add_layers`].
#[inline(always)]
pub(super) fn closure<'t, L: Lanes>(tables: &'t SceneTables, si: &Interaction<L>, active: L::M) -> Closure<'t, L> {
    // Returned as it is: copies of these kilobytes took 8 % of the time of a cornell box.
    L::outline(Plain { tables, si, active })
}

/// [`closure`].
struct Plain<'a, 't, L: Lanes> {
    tables: &'t SceneTables,
    si: &'a Interaction<L>,
    active: L::M,
}

impl<'t, L: Lanes> Part<L> for Plain<'_, 't, L> {
    type Output = Closure<'t, L>;

    #[inline(always)]
    fn run(self) -> Closure<'t, L> {
        let Self { tables, si, active } = self;
        let transmits = L::M::from_bits(0);
        let surface = surface(tables, si, active);
        let energy = tables.materials.energy();
        if !tables.has_shading_normals() {
            let bsdf = Bsdf::new(&surface, &View::new(Frame::around(si.ng), si.wo), energy);
            return Closure { bsdf, transmits };
        }
        let ns = shading_normal(tables, si, active);
        // Only what mirrors needs a mirror direction; the diffuse lobe keeps the normal as it is.
        let (bent, low) = let_mirror_leave(ns, si.ng, si.wo);
        let low = low & active & surface.has_specular();
        let view = View::new(Frame::around(bent.or_else(low, ns)), si.wo);
        let mut closure = Closure { bsdf: Bsdf::new(&surface, &view, energy), transmits };
        if low.any() {
            closure.bsdf.set_diffuse_normal(ns, low);
        }
        closure
    }
}

/// What each lane sees of its textures in each set of coordinates, if that is asked for.
#[inline(always)]
fn stored_footprints<L: Lanes>(si: &Interaction<L>) -> Option<[[f32; 16]; MAX_UV_SETS]> {
    let footprints = si.uvs.footprints()?;
    let mut stored = [[0.0; 16]; MAX_UV_SETS];
    for (stored, areas) in stored.iter_mut().zip(footprints) {
        areas.store(stored, 0);
    }
    Some(stored)
}

/// The closure of hit `at` seen from `wo` at `time`, whose material has what only some have, and whether light may get through it.
/// `footprints`: see [`crate::math::UvSets::with_footprints`].
#[inline(never)]
fn closure_of_one<'t>(
    tables: &'t SceneTables,
    hits: &HitBatch,
    at: usize,
    (wo, time): (V3<Scalar>, f32),
    eta: f32,
    footprints: Option<[f32; MAX_UV_SETS]>,
) -> (Layered<'t>, bool) {
    let active = <Scalar as Lanes>::M::first(1);
    let primitive = <Scalar as Lanes>::U::load(&hits.primitive, at);
    let time = <Scalar as Lanes>::F::splat(time);
    let mut si = interact::<Scalar>(tables, hits, at, (wo, time), primitive, active);
    if let Some(footprints) = footprints {
        // Shadow rays go through thin glass without a cone, and what they find must be what paths find.
        let inside = MediumTable::inside::<Scalar>(si.triangle.material);
        if !tables.media.is_thin_glass::<Scalar>(inside, active).any() {
            si.uvs = si.uvs.with_footprints(footprints.map(<Scalar as Lanes>::F::splat));
        }
    }
    let materials = &tables.materials;
    let surface = materials.rich_surface::<Scalar>(&tables.textures, si.triangle.material, &si.uvs, active);
    let surface = colored(tables, &si, surface);
    let zero = <Scalar as Lanes>::F::zero();
    let transmits =
        surface.extras.as_ref().is_some_and(|e| (e.transmission.gt(zero) | e.diffuse_transmission.gt(zero)).any());
    let eta = <Scalar as Lanes>::F::splat(eta);
    let (mut normal, mut diffuse_normal) = (si.ng, None);
    if tables.has_shading_normals() {
        let ns = shading_normal(tables, &si, active);
        let (bent, low) = let_mirror_leave(ns, si.ng, si.wo);
        normal = ns;
        if (low & surface.has_specular()).any() {
            (normal, diffuse_normal) = (bent, Some(ns));
        }
    }
    let view = View { eta, ..view(tables, &si, &surface, normal, active) };
    (Layered::new(&surface, &view, diffuse_normal, materials.energy()), transmits)
}

/// What hit `at` of a ray at `time` lets straight through to the viewer in direction `wo`, and where a ray goes on behind it; `None` where that
/// is no thin glass.
#[inline(never)]
pub(super) fn pane(
    tables: &SceneTables,
    hits: &HitBatch,
    at: usize,
    (wo, time): (V3<Scalar>, f32),
) -> Option<(V3<Scalar>, V3<Scalar>)> {
    let active = <Scalar as Lanes>::M::first(1);
    let primitive = <Scalar as Lanes>::U::load(&hits.primitive, at);
    let si = interact::<Scalar>(tables, hits, at, (wo, <Scalar as Lanes>::F::splat(time)), primitive, active);
    let inside = MediumTable::inside::<Scalar>(si.triangle.material);
    if !tables.media.is_thin_glass::<Scalar>(inside, active).any() {
        return None;
    }
    let (closure, _) = closure_of_one(tables, hits, at, (wo, time), 1.0, None);
    Some((closure.straight(), si.behind()))
}

impl<'t, L: Lanes> Closure<'t, L> {
    /// Makes the lanes whose material has more than metal and roughness closures of their own. `si` are the hits `at ..`;
    /// `eta` as in [`View::eta`].
    #[inline(always)]
    pub fn add_layers(
        &mut self,
        tables: &'t SceneTables,
        hits: &HitBatch,
        at: usize,
        si: &Interaction<L>,
        eta: L::F,
        active: L::M,
    ) {
        if !tables.materials.has_extras() {
            return;
        }
        let rich = tables.materials.rich::<L>(si.triangle.material, active);
        if !rich.any() {
            return;
        }
        let (mut wo, mut etas, mut times) = ([[0.0; 16]; 3], [0.0; 16], [0.0; 16]);
        si.wo.x.store(&mut wo[0], 0);
        si.wo.y.store(&mut wo[1], 0);
        si.wo.z.store(&mut wo[2], 0);
        eta.store(&mut etas, 0);
        si.time.store(&mut times, 0);
        let footprints = stored_footprints(si);
        let (mut layered, mut transmits) = (Vec::with_capacity(rich.count()), 0);
        let mut bits = rich.bits();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let wo = V3::splat([wo[0][lane], wo[1][lane], wo[2][lane]]);
            let seen = footprints.map(|sets| sets.map(|areas| areas[lane]));
            let (one, goes_through) = closure_of_one(tables, hits, at + lane, (wo, times[lane]), etas[lane], seen);
            transmits |= u32::from(goes_through) << lane;
            layered.push((lane, one));
        }
        self.bsdf.set_layered(layered);
        self.transmits = L::M::from_bits(transmits);
    }

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
