//! Rays and where in the tree they start, prepared eight at a time and handed out one after the other.

use super::node::{Child, WIDTH};
use super::ray::{RayLanes, SingleRay};
use crate::accel::RayBatch;
use glam::Vec3;
use simd::{Float, Lanes};
use std::ops::Range;

/// A ray that is to be followed from a node or leaf on.
#[derive(Clone, Copy, Debug)]
pub struct Task {
    /// Which of the batch.
    pub ray: u32,
    /// Where to start.
    pub child: Child,
    /// Where the ray enters that.
    pub enter: f32,
}

/// Tasks, numbered.
pub trait Tasks {
    /// How many there are.
    fn len(&self) -> usize;
    /// Task `k`.
    fn get(&self, k: usize) -> Task;
    /// Rays of eight tasks from `k` on; less at the end.
    fn lanes<L: Lanes>(&self, rays: &RayBatch, k: usize, scene: &[[f32; 3]; 2]) -> RayLanes<L>;
}

/// All rays of a range, from the root on.
pub struct Whole {
    pub range: Range<usize>,
    pub root: Child,
}

impl Tasks for Whole {
    #[inline(always)]
    fn len(&self) -> usize {
        self.range.len()
    }

    #[inline(always)]
    fn get(&self, k: usize) -> Task {
        Task { ray: (self.range.start + k) as u32, child: self.root, enter: 0.0 }
    }

    #[inline(always)]
    fn lanes<L: Lanes>(&self, rays: &RayBatch, k: usize, scene: &[[f32; 3]; 2]) -> RayLanes<L> {
        let at = self.range.start + k;
        if at + WIDTH <= rays.capacity() {
            return RayLanes::new(rays, at, scene);
        }
        gathered(rays, std::array::from_fn(|i| (at + i).min(self.range.end - 1)), scene)
    }
}

impl Tasks for &[Task] {
    #[inline(always)]
    fn len(&self) -> usize {
        <[Task]>::len(self)
    }

    #[inline(always)]
    fn get(&self, k: usize) -> Task {
        self[k]
    }

    #[inline(always)]
    fn lanes<L: Lanes>(&self, rays: &RayBatch, k: usize, scene: &[[f32; 3]; 2]) -> RayLanes<L> {
        gathered(rays, std::array::from_fn(|i| self[(k + i).min(<[Task]>::len(self) - 1)].ray as usize), scene)
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

/// One ray in a space of its own, in every lane; `None` if it is none there.
#[inline(always)]
pub fn single<L: Lanes>(origin: Vec3, direction: Vec3, scene: &[[f32; 3]; 2]) -> Option<Ready<L>> {
    let o = [L::F::splat(origin.x), L::F::splat(origin.y), L::F::splat(origin.z)];
    let d = [L::F::splat(direction.x), L::F::splat(direction.y), L::F::splat(direction.z)];
    let lanes = RayLanes::<L>::of(o, d, L::F::splat(f32::INFINITY), scene);
    if lanes.valid & 1 == 0 {
        return None;
    }
    let shape = lanes.shape(0);
    Some((SingleRay::of_lanes(&lanes, shape), shape.octant()))
}

/// A ray and where its octant begins in the nodes' orders.
pub type Ready<L> = (SingleRay<L>, u32);

/// Hands tasks out.
pub struct Feed<'a, L: Lanes, T: Tasks> {
    tasks: T,
    rays: &'a RayBatch,
    scene: &'a [[f32; 3]; 2],
    next: usize,
    lanes: RayLanes<L>,
    stored: [[f32; WIDTH]; 18],
}

impl<'a, L: Lanes, T: Tasks> Feed<'a, L, T> {
    /// There must be a task.
    #[inline(always)]
    pub fn new(tasks: T, rays: &'a RayBatch, scene: &'a [[f32; 3]; 2]) -> Self {
        let lanes = tasks.lanes::<L>(rays, 0, scene);
        let mut stored = [[0.0; WIDTH]; 18];
        lanes.store(&mut stored);
        Self { tasks, rays, scene, next: 0, lanes, stored }
    }

    /// The next task with its ray and the ray's octant; without them if the ray is none.
    #[inline(always)]
    pub fn next(&mut self) -> Option<(Task, Option<Ready<L>>)> {
        if self.next >= self.tasks.len() {
            return None;
        }
        let lane = self.next % WIDTH;
        if lane == 0 && self.next > 0 {
            self.lanes = self.tasks.lanes(self.rays, self.next, self.scene);
            self.lanes.store(&mut self.stored);
        }
        let task = self.tasks.get(self.next);
        self.next += 1;
        if self.lanes.valid >> lane & 1 == 0 {
            return Some((task, None));
        }
        let shape = self.lanes.shape(lane);
        Some((task, Some((SingleRay::new(&self.stored, lane, shape), shape.octant()))))
    }
}
