//! Rays and hits in SoA arrays, 64-byte aligned and padded to a multiple of 16, so that 16 lanes may always be loaded.

use simd::Buffer;

/// `primitive` of a ray that hit nothing.
pub const MISS: u32 = u32::MAX;

/// Rays, structure of arrays. `t` in units of the direction's length (directions need not be unit).
#[derive(Clone, Debug)]
pub struct RayBatch {
    /// Origins, metres, prepared space: x.
    pub ox: Buffer<f32>,
    /// y.
    pub oy: Buffer<f32>,
    /// z.
    pub oz: Buffer<f32>,
    /// Directions: x.
    pub dx: Buffer<f32>,
    /// y.
    pub dy: Buffer<f32>,
    /// z.
    pub dz: Buffer<f32>,
    /// End of the ray; may be infinite.
    pub t_max: Buffer<f32>,
    /// Shutter time in [0, 1].
    pub time: Buffer<f32>,
    /// What the geometry's filter knows a ray by; read only where parts are filtered.
    pub key: Buffer<u32>,
}

impl RayBatch {
    /// Room for `n` rays, rounded up to a multiple of 16.
    pub fn new(n: usize) -> Self {
        let zeros = || Buffer::new(n);
        Self {
            ox: zeros(),
            oy: zeros(),
            oz: zeros(),
            dx: zeros(),
            dy: zeros(),
            dz: zeros(),
            t_max: zeros(),
            time: zeros(),
            key: Buffer::new(n),
        }
    }

    /// Rays it has room for.
    pub fn capacity(&self) -> usize {
        self.ox.len()
    }

    /// Sets ray `i` (time 0, key 0).
    pub fn set(&mut self, i: usize, origin: glam::Vec3, direction: glam::Vec3, t_max: f32) {
        (self.ox[i], self.oy[i], self.oz[i]) = origin.into();
        (self.dx[i], self.dy[i], self.dz[i]) = direction.into();
        self.t_max[i] = t_max;
        self.time[i] = 0.0;
        self.key[i] = 0;
    }
}

/// Hits, structure of arrays: ids and where on them, no normals.
#[derive(Clone, Debug)]
pub struct HitBatch {
    /// Distance in units of the ray's direction; the ray's `t_max` for a miss.
    pub t: Buffer<f32>,
    /// Barycentric weight of the second vertex.
    pub u: Buffer<f32>,
    /// Barycentric weight of the third vertex.
    pub v: Buffer<f32>,
    /// Primitive number, or [`MISS`].
    pub primitive: Buffer<u32>,
    /// 0 for the world, i + 1 for placement i; unspecified for a miss.
    pub instance: Buffer<u32>,
}

impl HitBatch {
    /// Room for `n` hits, rounded up to a multiple of 16.
    pub fn new(n: usize) -> Self {
        Self {
            t: Buffer::new(n),
            u: Buffer::new(n),
            v: Buffer::new(n),
            primitive: Buffer::new(n),
            instance: Buffer::new(n),
        }
    }

    /// Makes hit `i` what hit `k` of `other` is.
    pub fn copy(&mut self, i: usize, other: &Self, k: usize) {
        (self.t[i], self.u[i], self.v[i]) = (other.t[k], other.u[k], other.v[k]);
        (self.primitive[i], self.instance[i]) = (other.primitive[k], other.instance[k]);
    }
}
