//! Ray queries behind one seam: a batch of rays in, a batch of hits out.
//!
//! Two implementations trace for pictures: `embree` (libembree4, found at run time) and `wide` (our own 8-wide
//! BVH). `linear` tests every triangle and is the oracle of the tests. All three find the same hits.

mod batch;
pub mod embree;
pub mod front;
pub mod geometry;
pub mod linear;
pub mod wide;
mod woop;

pub use batch::{HitBatch, MISS, RayBatch};

use std::ops::Range;

/// Triangles in the prepared scene's space (metres, recentred), what every backend is built from.
/// Vertices are finite and below 1.844e18 in magnitude and indices are in range: `render::prepare` sees to it.
#[derive(Clone, Debug, Default)]
pub struct Triangles {
    /// `[n][3]` metres.
    pub positions: Vec<[f32; 3]>,
    /// `[m][3]`; a hit's `primitive` is an index into this.
    pub indices: Vec<[u32; 3]>,
}

impl Triangles {
    /// The three corners of triangle `i`.
    #[inline]
    pub fn corners(&self, i: usize) -> [glam::Vec3; 3] {
        self.indices[i].map(|v| glam::Vec3::from_array(self.positions[v as usize]))
    }

    /// The corners of all triangles, one after the other.
    pub fn positions_in_use(&self) -> impl Iterator<Item = glam::Vec3> {
        self.indices.as_flattened().iter().map(|&v| glam::Vec3::from_array(self.positions[v as usize]))
    }
}

/// What a backend says about itself, for logs and JSON.
#[derive(Clone, Debug, Default)]
pub struct AccelStats {
    /// `embree`, `bvh` or `linear`.
    pub name: &'static str,
    /// Version of the library behind it; empty for our own.
    pub version: String,
    /// Instruction set in use, such as `avx512`.
    pub isa: String,
    /// Bytes held, as far as known.
    pub bytes: usize,
    /// Big triangles that are tested by packets of rays before the backend.
    pub front: usize,
    /// Spatial splits of `bvh`: entries in leaves beyond one for each triangle.
    pub splits: usize,
}

/// A built acceleration structure. Called once per batch of about 2000 rays, so `dyn` costs nothing here.
///
/// Hits lie in 0 < t < `t_max`, both ends excluded: origins are already offset, so t = 0 is the surface that was left.
/// `bvh` and `linear` leave out triangles of exactly zero area, which a rounded test would hit now and then.
/// A ray with a non-finite origin or direction, a zero direction or a NaN `t_max` misses. Ties (equal t) go to the
/// lowest instance, then to the lowest primitive, for `bvh` and `linear`.
pub trait Accel: Send + Sync {
    /// Nearest hits of `rays[range]` into `hits[range]`. `coherent` is a hint: camera rays in pixel order.
    fn intersect(&self, rays: &RayBatch, range: Range<usize>, coherent: bool, hits: &mut HitBatch);

    /// Whether anything lies in (0, t_max) of `rays[..n]`: 1 or 0 into `occluded[..n]`.
    fn occluded(&self, rays: &RayBatch, n: usize, occluded: &mut [u8]);

    /// What this is.
    fn stats(&self) -> AccelStats;
}
