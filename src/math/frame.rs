//! Orthonormal frames. After Duff et al. 2017, "Building an Orthonormal Basis, Revisited", JCGT 6(1).

use super::V3;
use simd::{Float, Lanes};

/// A right-handed orthonormal frame per lane; z is the normal.
#[derive(Clone, Copy)]
pub struct Frame<L: Lanes> {
    /// Tangent.
    pub x: V3<L>,
    /// Bitangent.
    pub y: V3<L>,
    /// Normal.
    pub z: V3<L>,
}

impl<L: Lanes> Frame<L> {
    /// A frame about the unit vector `z`.
    #[inline(always)]
    pub fn around(z: V3<L>) -> Self {
        let one = L::F::one();
        let sign = one.copysign(z.z);
        let a = -(one / (sign + z.z));
        let b = z.x * z.y * a;
        Self {
            x: V3::new(one + sign * z.x * z.x * a, sign * b, -(sign * z.x)),
            y: V3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// World to local.
    #[inline(always)]
    pub fn to_local(&self, v: V3<L>) -> V3<L> {
        V3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Local to world.
    #[inline(always)]
    pub fn to_world(&self, v: V3<L>) -> V3<L> {
        self.x.mul_add(v.x, self.y.mul_add(v.y, self.z.scale(v.z)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simd::Kernel;

    #[test]
    fn frame_01_is_orthonormal_at_the_poles_and_duffs_bad_vectors() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                let mut vectors = vec![
                    [1.0, 0.0, 0.0],
                    [0.0, -1.0, 0.0],
                    [0.0, 0.0, 1.0],
                    [0.0, 0.0, -1.0],
                    [0.00038527316, 0.00038460016, -0.999_999_9],
                    [-0.00019813581, -0.00008946839, -0.99999994],
                ];
                // All over the sphere, and the 32 numbers next to -1, where the sum in the denominator cancels.
                let all_over = (0..20_000).map(|i| 1.0 - (i as f32 + 0.5) / 10_000.0);
                let near_pole = (1..=32).map(|i| -1.0 + i as f32 * 2f32.powi(-24));
                for (i, z) in all_over.chain(near_pole).enumerate() {
                    let a = i as f32 * 2.399_963_2;
                    let r = (1.0 - z * z).sqrt();
                    vectors.push([r * a.cos(), r * a.sin(), z]);
                }
                for v in vectors {
                    let frame = Frame::<L>::around(V3::splat(v));
                    let mut out = [0.0; 16];
                    let mut get = |v: L::F| {
                        v.store(&mut out, 0);
                        out[0]
                    };
                    let errors = [
                        get(frame.x.dot(frame.x)) - 1.0,
                        get(frame.y.dot(frame.y)) - 1.0,
                        get(frame.x.dot(frame.y)),
                        get(frame.x.dot(frame.z)),
                        get(frame.y.dot(frame.z)),
                        get(frame.x.cross(frame.y).dot(frame.z)) - 1.0,
                    ];
                    let mean_square = errors.iter().map(|e| e * e).sum::<f32>() / 6.0;
                    assert!(mean_square < 1e-10, "{v:?}: {errors:?}");
                }
            }
        }
        crate::math::lanes::tests::at_all_levels(Check);
    }
}
