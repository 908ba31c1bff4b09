//! The shadow terminator of coarse meshes with smooth normals.
//!
//! After Hanika 2021, "Hacking the Shadow Terminator", Ray Tracing Gems II, chapter 4: rays start not on the flat
//! triangle but on the round surface that its vertex normals tell of, at `p' = p - sum b_i min(0, (p - v_i).n_i) n_i`:
//! p moved to the tangent planes of the corners, in proportion. Ours differ in two ways. Only the part along the
//! geometric normal is taken, so that no origin moves sideways, through the wall that it touches. And a start that is
//! raised may shine and be lit below the plane of its triangle, down to the plane of its interpolated normal: else the
//! triangles turned away from the light would stay dark however their rays started. What is in between is found by the
//! rays, the triangle itself included, so a closed mesh lets nothing in.

use crate::math::{V3, robust};
use crate::shape::table::Triangle;
use simd::{Float, Lanes};

/// How far the hit at barycentric `b` is raised along the geometric normal on the viewer's side, metres; `normals` are
/// the unit normals of the corners, front side up. Exactly 0 where the normals agree with the triangle or close over it
/// (a concave corner).
#[inline(always)]
pub(super) fn lift<L: Lanes>(triangle: &Triangle<L>, normals: &[V3<L>; 3], b: [L::F; 2], front: L::M) -> L::F {
    let Triangle { e1, e2, ng, .. } = *triangle;
    let from_0 = e2.mul_add(b[1], e1.scale(b[0]));
    // Normals that agree with the triangle have rounded heights: at most 7 roundings of the offset's components.
    let (a1, a2) = (e1.abs(), e2.abs());
    let noise = (a1.x + a1.y + a1.z + a2.x + a2.y + a2.z) * L::F::splat(robust::gamma(16));
    let side = L::F::one().or_else(front, -L::F::one());
    corner::<L>(from_0, normals[0], ng, side, noise) * (L::F::one() - b[0] - b[1])
        + corner::<L>(from_0 - e1, normals[1], ng, side, noise) * b[0]
        + corner::<L>(from_0 - e2, normals[2], ng, side, noise) * b[1]
}

/// One corner's part: how far along `ng` its tangent plane's foot is above the point at `from` the corner.
#[inline(always)]
fn corner<L: Lanes>(from: V3<L>, normal: V3<L>, ng: V3<L>, side: L::F, noise: L::F) -> L::F {
    let below = -(from.dot(normal) * side);
    let facing = normal.dot(ng);
    // A normal from behind the triangle tells nothing about its front.
    (below * facing).masked(below.gt(noise) & facing.gt(L::F::zero()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::table::{NONE, TriangleTable};
    use glam::Vec3;
    use simd::{Kernel, Level, Uint, dispatch};

    #[derive(Clone)]
    struct Lift {
        corners: [Vec3; 3],
        normals: [Vec3; 3],
        b: [f32; 2],
        front: bool,
    }

    impl Kernel for Lift {
        type Output = f32;

        #[inline(always)]
        fn run<L: Lanes>(self) -> f32 {
            let mut table = TriangleTable::with_capacity(1);
            table.push(self.corners, normal(self.corners), 0, NONE, NONE);
            let triangle = table.get::<L>(L::U::splat(0));
            let normals = [0, 1, 2].map(|k| V3::splat(self.normals[k].to_array()));
            let front = L::F::splat(if self.front { 1.0 } else { -1.0 }).gt(L::F::zero());
            let mut out = [0.0; 16];
            lift::<L>(&triangle, &normals, self.b.map(L::F::splat), front).store(&mut out, 0);
            out[0]
        }
    }

    /// Random triangles of all sizes and places, with points on them.
    fn cases() -> impl Iterator<Item = ([Vec3; 3], [f32; 2])> {
        let mut state = 1u32;
        let mut random = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32 * 2.0 - 1.0
        };
        (0..2000).map(move |i| {
            let size = 10f32.powi(i % 9 - 4);
            let mut vector = |s: f32| Vec3::new(random(), random(), random()) * s;
            let (centre, edges) = (vector(3.0 * size), [(); 3].map(|()| vector(size)));
            let (u, v) = (0.5 * random().abs(), 0.5 * random().abs());
            (edges.map(|e| centre + e), [u, v])
        })
    }

    fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
        (b - a).as_dvec3().cross((c - a).as_dvec3()).normalize().as_vec3()
    }

    #[test]
    fn shn01_normals_that_agree_with_the_triangle_lift_nothing() {
        for (corners, b) in cases() {
            for front in [true, false] {
                let lifted = dispatch(Level::best(), Lift { corners, normals: [normal(corners); 3], b, front });
                assert_eq!(lifted, 0.0, "{corners:?} {b:?}");
            }
        }
    }

    #[test]
    fn shn01_convex_corners_lift_concave_ones_do_not_and_the_amount_is_hanikas() {
        for (corners, b) in cases() {
            let ng = normal(corners);
            let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
            let size = (corners[1] - corners[0]).length().max((corners[2] - corners[0]).length());
            // Normals that spread like those of a sphere around a centre below.
            let normals = corners.map(|c| (c - (centre - ng * size)).normalize());
            let weights = [1.0 - b[0] - b[1], b[0], b[1]];
            let p = corners[0] + (corners[1] - corners[0]) * b[0] + (corners[2] - corners[0]) * b[1];
            let want: f32 =
                (0..3).map(|k| weights[k] * -(p - corners[k]).dot(normals[k]).min(0.0) * normals[k].dot(ng)).sum();
            let lift = |front| dispatch(Level::best(), Lift { corners, normals, b, front });
            let raised = lift(true);
            assert!((raised - want).abs() <= 1e-4 * size, "{corners:?} {b:?}: {raised}, not {want}");
            assert!(raised <= size, "no farther than the triangle is long");
            // Seen from behind the same corners are concave, but for those where the point lies outwards.
            let against: f32 =
                (0..3).map(|k| weights[k] * (p - corners[k]).dot(normals[k]).max(0.0) * normals[k].dot(ng)).sum();
            assert!((lift(false) - against).abs() <= 1e-4 * size);
        }
    }

    #[test]
    fn shn01_normals_from_behind_the_triangle_lift_nothing() {
        for (corners, b) in cases().take(300) {
            let ng = normal(corners);
            let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
            let normals = corners.map(|c| ((c - centre).normalize() - 0.5 * ng).normalize());
            assert_eq!(dispatch(Level::best(), Lift { corners, normals, b, front: true }), 0.0);
        }
    }
}
