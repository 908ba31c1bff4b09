//! `--clamp`: what light may bring to a path at most, in one contribution, after two scatterings or more.
//!
//! As the clamp of indirect light in Blender Cycles: a contribution is what is added to a path's radiance, after
//! throughput and weights; where its largest channel is above the limit, all three are scaled down to it. Left alone is
//! what the camera sees by itself, and the light of the first surface it sees: light samples there, and lamps and
//! environment that its scattered rays find. What is taken is summed, so that a picture can say how much it lacks.

use super::pool::PathPool;
use super::shade::add_lanes;
use crate::math::V3;
use simd::{Float, Lanes, Mask, Uint};

/// A limit of contributions, and the paths it is about.
#[derive(Clone, Copy)]
pub(super) struct Limit<L: Lanes> {
    /// cd/m^2 of the largest channel.
    most: L::F,
    indirect: L::M,
}

impl<L: Lanes> Limit<L> {
    /// For light that arrives after `scatterings`; `None` without a clamp.
    #[inline(always)]
    pub fn new(clamp: Option<f32>, scatterings: L::U) -> Option<Self> {
        let most = L::F::splat(clamp?);
        Some(Self { most, indirect: L::U::splat(1).lt(scatterings) })
    }

    /// What is left of a contribution, and how much was taken for each part of that.
    #[inline(always)]
    pub fn apply(&self, radiance: V3<L>) -> (V3<L>, L::F) {
        let brightest = radiance.max_component();
        let over = self.indirect & self.most.lt(brightest);
        let left = radiance.scale(self.most / brightest).or_else(over, radiance);
        (left, (brightest / self.most - L::F::one()).masked(over))
    }
}

/// Adds `radiance` to the paths of `lanes`, at most what `limit` lets them have.
#[inline(always)]
pub(super) fn add_limited<L: Lanes>(
    limit: Option<Limit<L>>,
    pool: &mut PathPool,
    slot: L::U,
    radiance: V3<L>,
    lanes: L::M,
) {
    let Some(limit) = limit else { return add_lanes::<L>(pool, slot, radiance, lanes) };
    let (left, excess) = limit.apply(radiance);
    add_lanes::<L>(pool, slot, left, lanes);
    let (mut slots, mut rgb, mut excesses) = ([0; 16], [[0.0; 16]; 3], [0.0; 16]);
    slot.store(&mut slots, 0);
    left.x.store(&mut rgb[0], 0);
    left.y.store(&mut rgb[1], 0);
    left.z.store(&mut rgb[2], 0);
    excess.store(&mut excesses, 0);
    let mut bits = lanes.bits();
    while bits != 0 {
        let i = bits.trailing_zeros() as usize;
        pool.take(slots[i], [rgb[0][i], rgb[1][i], rgb[2][i]], excesses[i]);
        bits &= bits - 1;
    }
}
