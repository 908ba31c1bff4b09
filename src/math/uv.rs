//! Texture coordinates of hits over N lanes.

use simd::{Float, Lanes, Uint};

/// Sets of texture coordinates that one material may use. (A mesh may have more: the loader keeps those in use.)
pub const MAX_UV_SETS: usize = 4;

/// One or several pairs of texture coordinates per lane.
#[derive(Clone, Copy)]
pub struct UvSets<L: Lanes> {
    sets: [[L::F; 2]; MAX_UV_SETS],
    /// Sets that some lane has; the others are not read.
    n: usize,
    /// See [`UvSets::with_footprints`].
    footprints: Option<[L::F; MAX_UV_SETS]>,
}

impl<L: Lanes> UvSets<L> {
    /// One set.
    #[inline(always)]
    pub fn single(u: L::F, v: L::F) -> Self {
        let zero = L::F::zero();
        Self { sets: [[u, v], [zero, zero], [zero, zero], [zero, zero]], n: 1, footprints: None }
    }

    /// Adds set `k`, 1 and up in this order.
    #[inline(always)]
    pub fn set(&mut self, k: usize, u: L::F, v: L::F) {
        self.sets[k] = [u, v];
        self.n = k + 1;
    }

    /// These coordinates in all sets of the lanes `here`.
    #[inline(always)]
    pub fn replace(&mut self, here: L::M, u: L::F, v: L::F) {
        for k in 0..MAX_UV_SETS {
            if k < self.n {
                self.sets[k] = [u.or_else(here, self.sets[k][0]), v.or_else(here, self.sets[k][1])];
            }
        }
    }

    /// 0 in the lanes that are not `keep`.
    #[inline(always)]
    pub fn masked(mut self, keep: L::M) -> Self {
        for k in 0..MAX_UV_SETS {
            if k < self.n {
                let [u, v] = self.sets[k];
                self.sets[k] = [u.masked(keep), v.masked(keep)];
            }
        }
        self
    }

    /// The coordinates in set `which` per lane.
    #[inline(always)]
    pub fn get(&self, which: L::U) -> [L::F; 2] {
        let [mut u, mut v] = self.sets[0];
        if self.n > 1 {
            for k in 1..MAX_UV_SETS {
                if k < self.n {
                    let here = which.eq(L::U::splat(k as u32));
                    u = self.sets[k][0].or_else(here, u);
                    v = self.sets[k][1].or_else(here, v);
                }
            }
        }
        [u, v]
    }

    /// The same coordinates with how much a lane's path sees around them in each set: an area, the square of a width, in
    /// units of the coordinates. Textures are then read at the level of detail that this asks for, else at level 0.
    #[inline(always)]
    #[must_use]
    pub fn with_footprints(self, footprints: [L::F; MAX_UV_SETS]) -> Self {
        Self { footprints: Some(footprints), ..self }
    }

    /// The same coordinates, at which textures are read at level 0.
    #[inline(always)]
    #[must_use]
    pub fn sharp(self) -> Self {
        Self { footprints: None, ..self }
    }

    /// What was given to [`UvSets::with_footprints`].
    #[inline(always)]
    pub fn footprints(&self) -> Option<&[L::F; MAX_UV_SETS]> {
        self.footprints.as_ref()
    }

    /// The footprint in set `which` per lane; 0 where none were given.
    #[inline(always)]
    pub fn footprint(&self, which: L::U) -> L::F {
        let Some(footprints) = &self.footprints else { return L::F::zero() };
        let mut area = footprints[0];
        if self.n > 1 {
            for (k, footprint) in footprints.iter().enumerate() {
                if k > 0 && k < self.n {
                    area = footprint.or_else(which.eq(L::U::splat(k as u32)), area);
                }
            }
        }
        area
    }
}
