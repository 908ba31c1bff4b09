//! Pixel filters, sampled by importance, so that every sample has weight 1.

use simd::{Float, Lanes};

/// Which filter; half supports in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PixelFilter {
    /// Constant.
    Box {
        /// Half of the full support.
        radius: f32,
    },
    /// Falls linearly from the centre.
    Tent {
        /// Half of the full support.
        radius: f32,
    },
}

impl PixelFilter {
    /// Offset from the pixel's centre in pixels for `u` in [0, 1); one dimension (the filters are separable).
    #[inline(always)]
    pub fn offset<L: Lanes>(self, u: L::F) -> L::F {
        let one = L::F::one();
        let r = u + u - one;
        match self {
            Self::Box { radius } => r * L::F::splat(radius),
            // Inverse of the tent's distribution: 1 - sqrt(1 - |r|), with r's sign.
            Self::Tent { radius } => (one - (one - r.abs()).max(L::F::zero()).sqrt()).copysign(r) * L::F::splat(radius),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simd::{Kernel, Level, dispatch};

    struct Moments(PixelFilter);

    impl Kernel for Moments {
        type Output = [f64; 3];

        #[inline(always)]
        fn run<L: Lanes>(self) -> [f64; 3] {
            let n = 1 << 16;
            let mut moments = [0.0; 3];
            for i in 0..n {
                let mut out = [0.0; 16];
                self.0.offset::<L>(L::F::splat((i as f32 + 0.5) / n as f32)).store(&mut out, 0);
                let x = f64::from(out[0]);
                moments[0] += x / f64::from(n);
                moments[1] += x * x / f64::from(n);
                moments[2] = f64::max(moments[2], x.abs());
            }
            moments
        }
    }

    #[test]
    fn flt_02_first_and_second_moments_are_those_of_the_filter() {
        for (filter, variance, radius) in [
            (PixelFilter::Box { radius: 0.5 }, 1.0 / 12.0, 0.5),
            (PixelFilter::Tent { radius: 1.0 }, 1.0 / 6.0, 1.0),
            (PixelFilter::Tent { radius: 2.0 }, 4.0 / 6.0, 2.0),
        ] {
            let [mean, second, largest] = dispatch(Level::Scalar, Moments(filter));
            assert!(mean.abs() < 1e-6 && (second - variance).abs() < 1e-4 && largest <= radius, "{filter:?}");
        }
    }
}
