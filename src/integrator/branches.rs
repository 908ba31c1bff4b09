//! Paths that branch: of the rays that a vertex sends on one stays in its place, the others wait here. What waits is
//! taken up before new camera rays, last come first, so that it stays few: at most a pool for each scattering in a row.

use super::medium::DEPTH;
use super::pool::{POOL, PathPool};
use crate::material::media::AIR;

/// Where a vertex writes a vector of paths that are to wait: behind those of the pool.
pub(super) const SCRATCH: usize = POOL;

/// A path that waits.
struct Waiting {
    origin: [f32; 3],
    direction: [f32; 3],
    beta: [f32; 3],
    depth: u32,
    seed: u32,
    sample: u32,
    key: u32,
    slot: u32,
    media: [u32; DEPTH],
    cone: [f32; 2],
    time: f32,
}

/// What a pool needs for paths that branch.
pub struct Branches {
    waiting: Vec<Waiting>,
    /// Rays of a slot that are under way or wait.
    rays: Vec<u32>,
    /// Some branch of a slot was cut.
    is_cut: Vec<bool>,
    /// Radiance by slot. Which branch comes first depends on how many others are under way, so that sums must not depend
    /// on their order: in f64 those of f32 are exact, unless parts are 2^22 times less than others.
    sums: Vec<[f64; 3]>,
}

impl PathPool {
    /// Makes room for branches, or gives it back.
    pub fn fit_branches(&mut self, branch: bool) {
        if branch != self.branches.is_some() {
            let new = || Branches {
                waiting: Vec::new(),
                rays: vec![0; POOL],
                is_cut: vec![false; POOL],
                sums: vec![[0.0; 3]; POOL],
            };
            self.branches = branch.then(|| Box::new(new()));
        }
    }

    /// A camera ray starts in `slot`.
    #[inline]
    pub fn begin_branches(&mut self, slot: u32) {
        if let Some(branches) = &mut self.branches {
            (branches.rays[slot as usize], branches.is_cut[slot as usize]) = (1, false);
        }
    }

    /// Takes up paths that wait, as many as there is room for.
    pub fn resume(&mut self) {
        let Some(mut branches) = self.branches.take() else { return };
        while self.n < POOL
            && let Some(path) = branches.waiting.pop()
        {
            self.put(self.n, &path);
            self.n += 1;
        }
        self.branches = Some(branches);
    }

    fn put(&mut self, i: usize, path: &Waiting) {
        let Waiting { origin, direction, beta, depth, seed, sample, key, slot, media, cone, time } = path;
        [self.rays.ox[i], self.rays.oy[i], self.rays.oz[i]] = *origin;
        [self.rays.dx[i], self.rays.dy[i], self.rays.dz[i]] = *direction;
        (self.rays.t_max[i], self.rays.time[i], self.rays.key[i]) = (f32::INFINITY, *time, *key);
        for (to, beta) in self.beta.iter_mut().zip(beta) {
            to[i] = *beta;
        }
        self.prev_pdf[i] = f32::INFINITY;
        (self.depth[i], self.seed[i], self.sample[i], self.slot[i]) = (*depth, *seed, *sample, *slot);
        if !self.media[0].is_empty() {
            for (to, medium) in self.media.iter_mut().zip(media) {
                to[i] = *medium;
            }
        }
        if !self.cone_width.is_empty() {
            [self.cone_width[i], self.cone_spread[i]] = *cone;
        }
    }

    /// Has the `count` paths at [`SCRATCH`] wait.
    pub fn wait(&mut self, count: usize) {
        let Some(mut branches) = self.branches.take() else { return };
        for i in SCRATCH..SCRATCH + count {
            let media = std::array::from_fn(|m| self.media[m].get(i).copied().unwrap_or(AIR));
            let cone = [&self.cone_width, &self.cone_spread].map(|cone| cone.get(i).copied().unwrap_or(0.0));
            branches.rays[self.slot[i] as usize] += 1;
            branches.waiting.push(Waiting {
                origin: [self.rays.ox[i], self.rays.oy[i], self.rays.oz[i]],
                direction: [self.rays.dx[i], self.rays.dy[i], self.rays.dz[i]],
                beta: [self.beta[0][i], self.beta[1][i], self.beta[2][i]],
                depth: self.depth[i],
                seed: self.seed[i],
                sample: self.sample[i],
                key: self.rays.key[i],
                slot: self.slot[i],
                media,
                cone,
                time: self.rays.time[i],
            });
        }
        self.branches = Some(branches);
    }

    /// Takes out what a slot has gathered.
    #[inline]
    pub fn gathered(&mut self, slot: u32) -> [f32; 3] {
        match &mut self.branches {
            None => std::mem::take(&mut self.radiance[slot as usize]),
            Some(branches) => std::mem::take(&mut branches.sums[slot as usize]).map(|sum| sum as f32),
        }
    }

    /// Notes that a branch of `slot` was cut.
    pub fn cut(&mut self, slot: u32) {
        if let Some(branches) = &mut self.branches {
            branches.is_cut[slot as usize] = true;
        }
    }

    /// Adds to the radiance of a slot whose paths branch; whether they do.
    #[inline(always)]
    pub fn add_of_branch(&mut self, slot: u32, radiance: [f32; 3]) -> bool {
        let Some(branches) = &mut self.branches else { return false };
        for (sum, r) in branches.sums[slot as usize].iter_mut().zip(radiance) {
            *sum += f64::from(r);
        }
        true
    }

    /// A ray of `slot` has ended; whether it was the last one, and if so whether some branch was cut.
    pub fn end(&mut self, slot: u32) -> Option<bool> {
        let branches = self.branches.as_mut()?;
        let left = &mut branches.rays[slot as usize];
        *left -= 1;
        (*left == 0).then(|| branches.is_cut[slot as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_ends_with_the_last_of_its_rays_and_waiting_paths_come_back_as_they_were() {
        let mut pool = PathPool::new();
        pool.fit_branches(true);
        pool.begin_branches(7);
        (pool.slot[SCRATCH], pool.slot[SCRATCH + 1]) = (7, 7);
        (pool.rays.oy[SCRATCH + 1], pool.beta[2][SCRATCH + 1], pool.depth[SCRATCH + 1]) = (0.25, 0.5, 3);
        pool.wait(2);
        assert_eq!(pool.end(7), None);
        pool.resume();
        assert_eq!((pool.n, pool.rays.oy[0], pool.beta[2][0], pool.depth[0], pool.slot[0]), (2, 0.25, 0.5, 3, 7));
        assert_eq!((pool.rays.t_max[0], pool.prev_pdf[0]), (f32::INFINITY, f32::INFINITY));
        pool.cut(7);
        assert_eq!((pool.end(7), pool.end(7)), (None, Some(true)));
        pool.begin_branches(7);
        assert_eq!(pool.end(7), Some(false));
    }

    #[test]
    fn sums_do_not_depend_on_the_order_of_branches() {
        let parts = [1.0_f32, 3e-8, 3e-8, 3e-8];
        let sum = |parts: &mut dyn Iterator<Item = f32>| {
            let mut pool = PathPool::new();
            pool.fit_branches(true);
            parts.for_each(|part| pool.add(3, [part; 3]));
            pool.gathered(3)
        };
        assert_eq!(sum(&mut parts.into_iter()), sum(&mut parts.into_iter().rev()));
        let in_f32 = |parts: &mut dyn Iterator<Item = f32>| parts.sum::<f32>();
        assert_ne!(
            in_f32(&mut parts.into_iter()),
            in_f32(&mut parts.into_iter().rev()),
            "the case is one that matters"
        );
    }

    #[test]
    fn what_finds_no_room_goes_on_waiting() {
        let mut pool = PathPool::new();
        pool.fit_branches(true);
        pool.begin_branches(0);
        pool.wait(3);
        pool.n = POOL - 1;
        pool.resume();
        assert_eq!(pool.n, POOL);
        pool.n = 0;
        pool.resume();
        assert_eq!(pool.n, 2);
    }
}
