//! Shading normals kept usable: in front of the surface, and such that a mirror's ray leaves it.
//!
//! The idea is that of Keller et al. 2017, "The Iray Light Transport Simulation and Rendering System", section A.3, and
//! of Cycles' `ensure_valid_reflection`: where the mirror direction about a shading normal `n` dives below the geometric
//! surface, turn `n` towards the geometric normal until it no longer does. The closed form here is our own. With `n` at
//! the angle `phi` from `ng`, towards the unit vector `x` orthogonal to it, and the view `wo = c ng + a x + ...`, the
//! mirror direction `r = 2 (wo.n) n - wo` has
//!
//! `r.ng = 2 (c cos phi + a sin phi) cos phi - c = c cos 2phi + a sin 2phi = R cos(2phi - psi)`
//!
//! with `R^2 = a^2 + c^2` and `psi = atan2(a, c)`: no less than `tau` up to `2phi = psi + acos(tau / R)`, which needs
//! neither an arc function nor the quadratic of Cycles.

use super::V3;
use crate::math::lanes::safe_sqrt;
use simd::{Float, Lanes, Mask};

/// Smallest sine of a mirror ray's elevation above the geometric surface; at views lower than twice this, half the
/// view's. Small, since all below it is bent; not 0, since rays along the surface meet its neighbours' rounding.
const MIN_ELEVATION: f32 = 0.01;

/// Smallest cosine between shading and geometric normal.
const MIN_FACING: f32 = 0.01;

/// `n` (unit), turned towards `ng` (unit) where it is more than about 89.4 degrees off: in front of the surface. The
/// same bits elsewhere.
#[inline(always)]
pub fn raise<L: Lanes>(n: V3<L>, ng: V3<L>) -> V3<L> {
    let short = L::F::splat(MIN_FACING) - n.dot(ng);
    let low = short.gt(L::F::zero());
    if !low.any() {
        return n;
    }
    ng.mul_add(short, n).normalized().or_else(low, n)
}

/// `n` turned towards `ng`, and the lanes where, as little as lets the mirror direction of `wo` leave the surface. Unit
/// vectors with `n.ng > 0` and `wo.ng > 0`; then the result faces `wo` too. The same bits where nothing is to do.
#[inline(always)]
pub fn let_mirror_leave<L: Lanes>(n: V3<L>, ng: V3<L>, wo: V3<L>) -> (V3<L>, L::M) {
    let (zero, one, half) = (L::F::zero(), L::F::one(), L::F::splat(0.5));
    let (c, facing) = (wo.dot(ng), n.dot(ng));
    let tau = L::F::splat(MIN_ELEVATION).min(c * half);
    let seen = wo.dot(n) * facing;
    let low = (seen + seen - c).lt(tau);
    if !low.any() {
        return (n, low);
    }
    let x = (n - ng.scale(facing)).normalized();
    let a = wo.dot(x);
    let r2 = a * a + c * c;
    let s = safe_sqrt(r2 - tau * tau);
    let scale = one / r2;
    let (cos2, sin2) = ((c * tau - a * s) * scale, (a * tau + c * s) * scale);
    // Half the angle: the larger one of sine and cosine by the root, the other by division, so that neither cancels.
    let obtuse = cos2.lt(zero);
    let large = safe_sqrt((one + cos2.abs()) * half);
    let small = sin2 * half / large;
    let (cos, sin) = (small.or_else(obtuse, large), large.or_else(obtuse, small));
    let bent = x.mul_add(sin, ng.scale(cos)).normalized();
    let low = low & bent.is_finite();
    (bent.or_else(low, n), low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::tests::at_all_levels;
    use glam::DVec3;
    use simd::{Kernel, Level, dispatch};

    /// Unit vectors spread over the sphere.
    fn directions(n: u32) -> impl Iterator<Item = [f32; 3]> {
        (0..n).map(move |i| {
            let (a, z) = (f64::from(i) * 2.399_963_229_728_653, 1.0 - (f64::from(i) + 0.5) / f64::from(n) * 2.0);
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * a.cos(), r * a.sin(), z).as_vec3().to_array()
        })
    }

    fn first<L: Lanes>(v: V3<L>) -> [f32; 3] {
        [v.x, v.y, v.z].map(|c| {
            let mut out = [0.0; 16];
            c.store(&mut out, 0);
            out[0]
        })
    }

    #[derive(Clone)]
    struct Bend {
        n: [f32; 3],
        wo: [f32; 3],
    }

    impl Kernel for Bend {
        type Output = ([f32; 3], bool);

        #[inline(always)]
        fn run<L: Lanes>(self) -> ([f32; 3], bool) {
            let up = V3::<L>::splat([0.0, 0.0, 1.0]);
            let (n, bent) = let_mirror_leave(raise(V3::<L>::splat(self.n), up), up, V3::splat(self.wo));
            (first(n), bent.bits() & 1 == 1)
        }
    }

    #[test]
    fn shn03_bent_normals_reflect_above_the_surface_by_the_smallest_turn() {
        let bend = |n, wo| dispatch(Level::best(), Bend { n, wo });
        let mut turned = 0;
        for n in directions(300).filter(|n| n[2] > MIN_FACING) {
            for wo in directions(300).filter(|w| w[2] > 0.0) {
                let (got, bent) = bend(n, wo);
                let [n, wo, got] = [n, wo, got].map(|v| glam::Vec3::from(v).as_dvec3());
                let tau = f64::from(MIN_ELEVATION).min(wo.z * 0.5);
                let elevation = |n: DVec3| 2.0 * wo.dot(n) * n.z - wo.z;
                if !bent {
                    assert_eq!(got, n, "nothing to do, and the same bits");
                    assert!(elevation(n) >= tau - 1e-6);
                    continue;
                }
                turned += 1;
                assert!(elevation(n) < tau + 1e-6, "{n} seen from {wo} was valid");
                assert!((elevation(got) - tau).abs() < 2e-6, "{n} from {wo}: {got} at {}", elevation(got));
                assert!((got.length() - 1.0).abs() < 1e-6 && got.dot(wo) > 0.0 && got.z > 0.0);
                // In the plane of n and the geometric normal, between them.
                assert!(n.cross(DVec3::Z).dot(got).abs() < 1e-6);
                assert!(got.z > n.z && n.truncate().dot(got.truncate()) > 0.0);
            }
        }
        assert!(turned > 5000, "{turned}");
    }

    #[test]
    fn shn03_normals_from_behind_come_to_the_front() {
        for n in directions(400).chain([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]) {
            for wo in directions(50).filter(|w| w[2] > 0.0).chain([[1.0, 0.0, 1e-6]]) {
                let (got, _) = dispatch(Level::best(), Bend { n, wo });
                let got = glam::Vec3::from(got);
                assert!((got.length() - 1.0).abs() < 1e-5 && got.z > 0.0 && got.dot(wo.into()) > 0.0, "{n:?} {wo:?}");
            }
        }
    }

    #[test]
    fn shn03_levels_agree() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                for n in directions(100) {
                    let case = Bend { n, wo: [0.6, 0.0, 0.8] };
                    let (want, _) = dispatch(Level::Scalar, case.clone());
                    let (got, _) = case.run::<L>();
                    assert!((glam::Vec3::from(got) - glam::Vec3::from(want)).length() < 1e-5, "{n:?}");
                }
            }
        }
        at_all_levels(Check);
    }
}
