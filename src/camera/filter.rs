//! Pixel filters, sampled by importance, so that every sample has weight 1.

use simd::{Float, Lanes, Uint};
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Shape of a pixel filter; zero at the ends of its support, but for the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterShape {
    /// Constant.
    Box,
    /// Falls linearly from the centre.
    Tent,
    /// A bell whose standard deviation is a sixth of the support, less its value at the ends.
    Gaussian,
    /// Harris 1978, "On the use of windows": four cosines, side lobes at -92 dB.
    BlackmanHarris,
}

impl FilterShape {
    /// As users call it, with the full support in pixels that it has if nothing is said.
    pub const NAMES: [(&'static str, Self, f32); 4] = [
        ("box", Self::Box, 1.0),
        ("tent", Self::Tent, 2.0),
        ("gaussian", Self::Gaussian, 3.0),
        ("blackman-harris", Self::BlackmanHarris, 3.0),
    ];

    /// As users call it.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|n| n.1 == self).map_or("", |n| n.0)
    }

    /// Its value at `x` in [-1, 1], the support, by its value at 0.
    fn at(self, x: f64) -> f64 {
        match self {
            Self::Box => 1.0,
            Self::Tent => 1.0 - x.abs(),
            Self::Gaussian => {
                let bell = |x: f64| (-4.5 * x * x).exp();
                (bell(x) - bell(1.0)) / (1.0 - bell(1.0))
            }
            Self::BlackmanHarris => {
                let waves = [0.35875, 0.48829, 0.14128, 0.01168];
                waves.iter().zip(0..).map(|(a, k)| a * (f64::from(k) * PI * x).cos()).sum()
            }
        }
    }
}

/// A filter ready to be sampled; one dimension, for they are separable.
#[derive(Clone, Copy, Debug)]
pub struct PixelFilter {
    shape: FilterShape,
    /// Half of the full support, pixels.
    radius: f32,
    /// Of the bell-shaped ones; see [`inverse`].
    table: &'static [f32],
}

/// Steps of a table.
const STEPS: u32 = 256;

/// Distances from the centre, in [0, 1], at equal steps of `t`, where the share `1 - t^2` of the filter lies nearer: the
/// distance falls smoothly with `t` to the very end, as it does not with the share. For a tent it is `1 - t`.
fn inverse(shape: FilterShape) -> Vec<f32> {
    const FINE: usize = 1 << 14;
    let mut sums = vec![0.0; FINE + 1];
    for i in 0..FINE {
        sums[i + 1] = sums[i] + shape.at((i as f64 + 0.5) / FINE as f64).max(0.0);
    }
    let distance = |step: u32| {
        let t = f64::from(step) / f64::from(STEPS);
        let share = (1.0 - t * t) * sums[FINE];
        let i = sums.partition_point(|&s| s < share).clamp(1, FINE);
        let within = (share - sums[i - 1]) / (sums[i] - sums[i - 1]).max(f64::MIN_POSITIVE);
        ((i as f64 - 1.0 + within.clamp(0.0, 1.0)) / FINE as f64) as f32
    };
    (0..=STEPS).map(distance).collect()
}

impl PixelFilter {
    /// `width` is the full support in pixels, > 0.
    pub fn new(shape: FilterShape, width: f32) -> Self {
        static GAUSSIAN: LazyLock<Vec<f32>> = LazyLock::new(|| inverse(FilterShape::Gaussian));
        static BLACKMAN_HARRIS: LazyLock<Vec<f32>> = LazyLock::new(|| inverse(FilterShape::BlackmanHarris));
        let table: &'static [f32] = match shape {
            FilterShape::Box | FilterShape::Tent => &[],
            FilterShape::Gaussian => &GAUSSIAN,
            FilterShape::BlackmanHarris => &BLACKMAN_HARRIS,
        };
        Self { shape, radius: 0.5 * width, table }
    }

    /// Offset from the pixel's centre in pixels for `u` in [0, 1).
    #[inline(always)]
    pub fn offset<L: Lanes>(self, u: L::F) -> L::F {
        let one = L::F::one();
        let r = u + u - one;
        let radius = L::F::splat(self.radius);
        if self.shape == FilterShape::Box {
            return r * radius;
        }
        let t = (one - r.abs()).max(L::F::zero()).sqrt();
        let distance = if self.shape == FilterShape::Tent {
            one - t
        } else {
            let at = t * L::F::splat(STEPS as f32);
            let low = at.floor().min(L::F::splat(STEPS as f32 - 1.0));
            let step = low.to_uint();
            let (a, b) = (step.gather(self.table), (step + L::U::splat(1)).gather(self.table));
            (b - a).mul_add(at - low, a)
        };
        distance.copysign(r) * radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simd::{Kernel, Level, dispatch};

    /// Points that are equally likely.
    const N: usize = 1 << 16;

    struct Offsets(PixelFilter);

    impl Kernel for Offsets {
        type Output = Vec<f32>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<f32> {
            let mut out = vec![0.0; N];
            for i in (0..N).step_by(L::N) {
                let u = (L::U::splat(i as u32) + L::U::lane_ids()).to_float() + L::F::splat(0.5);
                self.0.offset::<L>(u * L::F::splat(1.0 / N as f32)).store(&mut out, i);
            }
            out
        }
    }

    /// Mean of `of` over the filter of the shape, by quadrature.
    fn mean(shape: FilterShape, of: impl Fn(f64) -> f64) -> f64 {
        const FINE: u32 = 100_000;
        let points = (0..FINE).map(|i| (2.0 * f64::from(i) + 1.0) / f64::from(FINE) - 1.0);
        let (sum, all) = points.fold((0.0, 0.0), |(sum, all), x| (sum + shape.at(x) * of(x), all + shape.at(x)));
        sum / all
    }

    #[test]
    fn flt_02_moments_are_those_of_the_filter() {
        for (_, shape, width) in FilterShape::NAMES {
            for width in [width, 1.7] {
                let offsets = dispatch(Level::Scalar, Offsets(PixelFilter::new(shape, width)));
                let radius = f64::from(width) / 2.0;
                for power in 1..=4 {
                    let found = offsets.iter().map(|&x| (f64::from(x) / radius).powi(power)).sum::<f64>() / N as f64;
                    let right = mean(shape, |x| x.powi(power));
                    assert!((found - right).abs() < 1e-4, "{shape:?}:{width} moment {power}: {found}, not {right}");
                }
                assert!(offsets.iter().all(|&x| f64::from(x).abs() <= radius), "{shape:?}:{width}");
            }
        }
    }

    #[test]
    fn flt_01_shares_of_offsets_are_the_integrals_of_the_filter() {
        for (_, shape, _) in FilterShape::NAMES {
            let offsets = dispatch(Level::Scalar, Offsets(PixelFilter::new(shape, 2.0)));
            for k in 1..40 {
                let end = f64::from(k) / 20.0 - 1.0;
                let found = offsets.iter().filter(|&&x| f64::from(x) < end).count() as f64 / N as f64;
                let right = mean(shape, |x| f64::from(u8::from(x < end)));
                assert!((found - right).abs() < 2e-4, "{shape:?} below {end}: {found}, not {right}");
            }
        }
    }

    #[test]
    fn offsets_are_the_same_at_every_lane_count() {
        for (_, shape, width) in FilterShape::NAMES {
            let filter = PixelFilter::new(shape, width);
            let one = dispatch(Level::Scalar, Offsets(filter));
            for level in [Level::Portable8, Level::Avx2, Level::Avx512].into_iter().filter(|l| l.is_available()) {
                let wide = dispatch(level, Offsets(filter));
                assert!(one.iter().zip(&wide).all(|(a, b)| (a - b).abs() <= 1e-6), "{shape:?} {level:?}");
            }
        }
    }

    #[test]
    fn known_points_of_the_shapes() {
        assert!((FilterShape::BlackmanHarris.at(1.0) - 6e-5).abs() < 1e-9);
        assert!((FilterShape::BlackmanHarris.at(0.5) - 0.217_47).abs() < 1e-9);
        assert_eq!(FilterShape::Gaussian.at(1.0), 0.0);
        for (_, shape, _) in FilterShape::NAMES {
            assert!((shape.at(0.0) - 1.0).abs() < 1e-12 && shape.at(0.3) == shape.at(-0.3));
        }
    }
}
