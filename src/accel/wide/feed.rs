//! Rays prepared eight at a time and handed out one after the other.

use super::node::WIDTH;
use super::ray::{RayLanes, SingleRay};
use crate::accel::RayBatch;
use glam::Vec3;
use simd::{Float, Lanes};
use std::ops::Range;

/// Which rays of a batch are to be followed.
pub trait Which {
    /// How many there are.
    fn len(&self) -> usize;
    /// Which of the batch number `k` is.
    fn get(&self, k: usize) -> usize;
    /// Eight from number `k` on; past the end any.
    fn lanes<L: Lanes>(&self, rays: &RayBatch, k: usize, scene: &[[f32; 3]; 2]) -> RayLanes<L>;
}

impl Which for Range<usize> {
    #[inline(always)]
    fn len(&self) -> usize {
        ExactSizeIterator::len(self)
    }

    #[inline(always)]
    fn get(&self, k: usize) -> usize {
        self.start + k
    }

    #[inline(always)]
    fn lanes<L: Lanes>(&self, rays: &RayBatch, k: usize, scene: &[[f32; 3]; 2]) -> RayLanes<L> {
        let at = self.start + k;
        if at + WIDTH <= rays.capacity() {
            return RayLanes::new(rays, at, scene);
        }
        gathered(rays, std::array::from_fn(|i| (at + i).min(self.end - 1)), scene)
    }
}

impl Which for &[u32] {
    #[inline(always)]
    fn len(&self) -> usize {
        <[u32]>::len(self)
    }

    #[inline(always)]
    fn get(&self, k: usize) -> usize {
        self[k] as usize
    }

    #[inline(always)]
    fn lanes<L: Lanes>(&self, rays: &RayBatch, k: usize, scene: &[[f32; 3]; 2]) -> RayLanes<L> {
        gathered(rays, std::array::from_fn(|i| self[(k + i).min(<[u32]>::len(self) - 1)] as usize), scene)
    }
}

#[inline(always)]
fn gathered<L: Lanes>(rays: &RayBatch, which: [usize; WIDTH], scene: &[[f32; 3]; 2]) -> RayLanes<L> {
    let mut numbers = [[0.0; WIDTH]; 7];
    for (lane, i) in which.into_iter().enumerate() {
        numbers[0][lane] = rays.ox[i];
        numbers[1][lane] = rays.oy[i];
        numbers[2][lane] = rays.oz[i];
        numbers[3][lane] = rays.dx[i];
        numbers[4][lane] = rays.dy[i];
        numbers[5][lane] = rays.dz[i];
        numbers[6][lane] = rays.t_max[i];
    }
    let o = [L::F::load(&numbers[0], 0), L::F::load(&numbers[1], 0), L::F::load(&numbers[2], 0)];
    let d = [L::F::load(&numbers[3], 0), L::F::load(&numbers[4], 0), L::F::load(&numbers[5], 0)];
    RayLanes::of(o, d, L::F::load(&numbers[6], 0), scene)
}

/// Makes `ray` the one in a space of its own, in every lane, and tells where its octant begins in the nodes' orders;
/// `None` if it is none there. Written in place: handing such a ray on takes as long as making it.
#[inline(always)]
pub fn single<L: Lanes>(origin: Vec3, direction: Vec3, scene: &[[f32; 3]; 2], ray: &mut SingleRay<L>) -> Option<u32> {
    let o = [L::F::splat(origin.x), L::F::splat(origin.y), L::F::splat(origin.z)];
    let d = [L::F::splat(direction.x), L::F::splat(direction.y), L::F::splat(direction.z)];
    let lanes = RayLanes::<L>::of(o, d, L::F::splat(f32::INFINITY), scene);
    if lanes.valid & 1 == 0 {
        return None;
    }
    let shape = lanes.shape(0);
    ray.set(&lanes, shape);
    Some(shape.octant())
}

/// A ray and where its octant begins in the nodes' orders.
pub type Ready<L> = (SingleRay<L>, u32);

/// Hands rays out.
pub struct Feed<'a, L: Lanes, W: Which> {
    which: W,
    rays: &'a RayBatch,
    scene: &'a [[f32; 3]; 2],
    next: usize,
    lanes: RayLanes<L>,
    stored: [[f32; WIDTH]; 18],
}

impl<'a, L: Lanes, W: Which> Feed<'a, L, W> {
    /// There must be a ray.
    #[inline(always)]
    pub fn new(which: W, rays: &'a RayBatch, scene: &'a [[f32; 3]; 2]) -> Self {
        let lanes = which.lanes::<L>(rays, 0, scene);
        let mut stored = [[0.0; WIDTH]; 18];
        lanes.store(&mut stored);
        Self { which, rays, scene, next: 0, lanes, stored }
    }

    /// The next one's place in the batch, and the ray if it is one.
    #[inline(always)]
    pub fn next(&mut self) -> Option<(usize, Option<Ready<L>>)> {
        if self.next >= self.which.len() {
            return None;
        }
        let lane = self.next % WIDTH;
        if lane == 0 && self.next > 0 {
            self.lanes = self.which.lanes(self.rays, self.next, self.scene);
            self.lanes.store(&mut self.stored);
        }
        let i = self.which.get(self.next);
        self.next += 1;
        if self.lanes.valid >> lane & 1 == 0 {
            return Some((i, None));
        }
        let shape = self.lanes.shape(lane);
        Some((i, Some((SingleRay::new(&self.stored, lane, shape), shape.octant()))))
    }
}
