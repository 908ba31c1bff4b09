//! Which volumes a path is in: what absorbs it on its way, and the indices of refraction of the boundaries it meets.
//!
//! A stack without priorities: entering a volume puts it on top, leaving takes its last entry away wherever that is,
//! and the innermost, the last entered, counts. Volumes that overlap and volumes with a gap between them need no more.
//! Boundaries that do not pair up are tolerated: what was never entered was around the path from its start.

use super::SceneTables;
use super::dispersion::Spectrum;
use super::pool::PathPool;
use super::wave::Counters;
use crate::material::media::{AIR, MediumTable};
use crate::math::V3;
use crate::sampler::{Key, dims};
use simd::{Buffer, Float, Lanes, Mask, Part, Uint};

/// Volumes that a path may be in at a time; entering one more forgets the outermost.
pub(super) const DEPTH: usize = 6;

/// Media that paths are in, innermost first; [`AIR`] where there are no more.
#[derive(Clone, Copy)]
pub(super) struct Stack<L: Lanes> {
    media: [L::U; DEPTH],
}

impl<L: Lanes> Stack<L> {
    /// Of the paths `at ..`.
    #[inline(always)]
    pub fn load(buffers: &[Buffer<u32>; DEPTH], at: usize) -> Self {
        let mut media = [L::U::splat(AIR); DEPTH];
        for (medium, buffer) in media.iter_mut().zip(buffers) {
            *medium = L::U::load(buffer, at);
        }
        Self { media }
    }

    /// Packs the lanes of `keep` to `to ..`.
    #[inline(always)]
    pub fn compress(&self, keep: L::M, buffers: &mut [Buffer<u32>; DEPTH], to: usize) {
        for (medium, buffer) in self.media.iter().zip(buffers) {
            medium.compress(keep, buffer, to);
        }
    }

    /// The medium that counts.
    #[inline(always)]
    pub fn innermost(&self) -> L::U {
        self.media[0]
    }

    /// At the boundary of the volume `inside` (in the lanes of `is_boundary`), met from outside in those of `front`: the
    /// medium that the path came through, and the one that it comes into if it goes on behind.
    #[inline(always)]
    pub fn across(&self, inside: L::U, is_boundary: L::M, front: L::M) -> (L::U, L::U) {
        let top = self.innermost();
        let leaves = is_boundary & !front;
        // Leaving what was never entered: it was around the path all along, outside of what it is in since.
        let before = inside.or_else(leaves & top.eq(L::U::splat(AIR)), top);
        let mut left = *self;
        left.leave(inside, leaves);
        (before, inside.or_else(is_boundary & front, left.innermost()))
    }

    /// Puts `medium` on top in `lanes`; those where the outermost is forgotten.
    #[inline(always)]
    pub fn enter(&mut self, medium: L::U, lanes: L::M) -> L::M {
        let full = lanes & !self.media[DEPTH - 1].eq(L::U::splat(AIR));
        for i in (1..DEPTH).rev() {
            self.media[i] = self.media[i - 1].or_else(lanes, self.media[i]);
        }
        self.media[0] = medium.or_else(lanes, self.media[0]);
        full
    }

    /// Takes the last entry of `medium` away in `lanes`; those where there is none.
    #[inline(always)]
    pub fn leave(&mut self, medium: L::U, lanes: L::M) -> L::M {
        let mut gone = L::M::from_bits(0);
        for i in 0..DEPTH {
            gone = gone | (lanes & self.media[i].eq(medium));
            let outer = if i + 1 < DEPTH { self.media[i + 1] } else { L::U::splat(AIR) };
            self.media[i] = outer.or_else(gone, self.media[i]);
        }
        lanes & !gone
    }
}

/// Where paths hit in a scene with volumes: what they came through, and what is behind the surface.
pub(super) struct Crossing<L: Lanes> {
    /// The medium that the path came through.
    pub before: L::U,
    /// The medium that a ray comes into that goes on behind the surface; `before` where that is no boundary.
    pub behind: L::U,
    /// Lanes whose surface is a boundary.
    pub is_boundary: L::M,
    /// Its front was hit: going on behind it is entering.
    front: L::M,
    /// Of the volume whose boundary it is.
    inside: L::U,
    /// Index of refraction behind over that before; exactly 1 where both media are the same.
    pub eta: L::F,
    /// What a path does that takes a wavelength here; `None` where no lane does.
    pub dispersed: Option<Dispersed<L>>,
}

/// Paths that meet their first boundary of a dispersive medium: they have a wavelength once they go through it.
pub(super) struct Dispersed<L: Lanes> {
    /// Which.
    pub lanes: L::M,
    /// nm.
    pub wavelength: L::F,
    /// What their throughput is multiplied by; on average over all wavelengths white.
    pub weight: V3<L>,
}

impl<L: Lanes> Crossing<L> {
    /// At hits of the paths `at ..` on surfaces of `material`.
    #[inline(always)]
    pub fn new(
        tables: &SceneTables,
        pool: &PathPool,
        at: usize,
        material: L::U,
        front: L::M,
        hit: L::M,
        key: &Key<L>,
    ) -> Self {
        L::outline(Cross { tables, pool, at, material, front, hit, key })
    }

    /// The same for paths that take no wavelengths: with the indices at the d line.
    #[inline(always)]
    pub fn without_dispersion(self, media: &MediumTable) -> Self {
        let eta = media.ior::<L>(self.behind) / media.ior::<L>(self.before);
        let eta = eta.or_else(self.is_boundary & !self.behind.eq(self.before), L::F::one());
        Self { eta, dispersed: None, ..self }
    }

    /// What is left of light that came `distance` to the surface.
    #[inline(always)]
    pub fn transmittance(&self, media: &MediumTable, distance: L::F) -> V3<L> {
        media.transmittance(self.before, distance)
    }

    /// What is left of light from `to_light` away (metres; from infinitely far in the lanes of `is_distant`) that comes
    /// through the medium behind the surface in `through`, else through that before it. The boundaries of volumes end
    /// shadow rays, so it is one medium all the way.
    #[inline(always)]
    pub fn on_the_way(&self, tables: &SceneTables, is_distant: L::M, to_light: V3<L>, through: L::M) -> V3<L> {
        let medium = self.medium(through);
        let near: V3<L> = tables.media.transmittance(medium, to_light.dot(to_light).sqrt());
        tables.media.transmittance_from_far(medium).or_else(is_distant, near)
    }

    /// The medium that a ray goes through that leaves behind the surface in `through`, else before it.
    #[inline(always)]
    pub fn medium(&self, through: L::M) -> L::U {
        self.behind.or_else(through, self.before)
    }

    /// By how much radiance is denser than in air where the path goes on: behind the surface in `through`.
    #[inline(always)]
    pub fn density(&self, media: &MediumTable, through: L::M) -> L::F {
        let ior = media.ior::<L>(self.behind.or_else(through, self.before));
        ior * ior
    }

    /// `beta` after going on behind the surface in `through`: paths that take a wavelength get its colour.
    #[inline(always)]
    pub fn colored(&self, beta: V3<L>, through: L::M) -> V3<L> {
        let Some(d) = &self.dispersed else { return beta };
        (beta * d.weight).or_else(d.lanes & through, beta)
    }

    /// Packs the media of the paths `at ..` that are `alive` to `to ..`, those of `through` having gone on behind the
    /// surface; with their wavelengths.
    #[inline(always)]
    pub fn follow(
        &self,
        pool: &mut PathPool,
        counters: &mut Counters,
        at: usize,
        to: usize,
        through: L::M,
        alive: L::M,
    ) {
        let crosses = alive & through & self.is_boundary;
        let mut stack = Stack::<L>::load(&pool.media, at);
        let forgotten = stack.enter(self.inside, crosses & self.front);
        let unknown = stack.leave(self.inside, crosses & !self.front);
        counters.unpaired += (forgotten | unknown).count() as u64;
        stack.compress(alive, &mut pool.media, to);
        if !pool.wavelength.is_empty() {
            let mut wavelength = L::F::load(&pool.wavelength, at);
            if let Some(d) = &self.dispersed {
                wavelength = d.wavelength.or_else(d.lanes & crosses, wavelength);
            }
            wavelength.compress(alive, &mut pool.wavelength, to);
        }
    }
}

/// [`Crossing::new`].
struct Cross<'a, L: Lanes> {
    tables: &'a SceneTables,
    pool: &'a PathPool,
    at: usize,
    material: L::U,
    front: L::M,
    hit: L::M,
    key: &'a Key<L>,
}

impl<L: Lanes> Part<L> for Cross<'_, L> {
    type Output = Crossing<L>;

    #[inline(always)]
    fn run(self) -> Crossing<L> {
        let Self { tables, pool, at, material, front, hit, key } = self;
        let media = &tables.media;
        let stack = Stack::<L>::load(&pool.media, at);
        let inside = MediumTable::inside::<L>(material);
        let is_boundary = media.is_boundary::<L>(inside, hit);
        let (before, behind) = stack.across(inside, is_boundary, front);
        let mut crossing = Crossing { before, behind, is_boundary, front, inside, eta: L::F::one(), dispersed: None };
        let mut ior = [media.ior::<L>(behind), media.ior::<L>(before)];
        if let Some(spectrum) = &tables.spectrum {
            let own = L::F::load(&pool.wavelength, at);
            let disperses = media.is_dispersive::<L>(behind) | media.is_dispersive::<L>(before);
            let lanes = is_boundary & disperses & own.eq(L::F::zero());
            let mut wavelength = own;
            if lanes.any() {
                let dispersed = Dispersed::new(spectrum, key, lanes);
                wavelength = dispersed.wavelength.or_else(lanes, own);
                crossing.dispersed = Some(dispersed);
            }
            ior = [media.ior_at::<L>(behind, wavelength), media.ior_at::<L>(before, wavelength)];
        }
        crossing.eta = (ior[0] / ior[1]).or_else(is_boundary & !behind.eq(before), L::F::one());
        crossing
    }
}

impl<L: Lanes> Dispersed<L> {
    #[inline(always)]
    fn new(spectrum: &Spectrum, key: &Key<L>, lanes: L::M) -> Self {
        let (wavelength, weight) = spectrum.sample::<L>(key.group(L::U::splat(dims::TIME))[dims::WAVELENGTH]);
        Self { lanes, wavelength, weight }
    }
}

#[cfg(test)]
#[path = "medium_tests.rs"]
mod tests;
