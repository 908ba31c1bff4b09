//! What lanes read of corners: the corners themselves at the corners, what f64 says in between, and constants bit for bit.

use super::*;
use crate::math::lanes::tests::at_all_levels;
use crate::math::random::Rng;
use glam::Vec3;
use simd::Kernel;

/// Sets of texture coordinates.
const SETS: usize = 3;
/// Numbers of a corner: normal, tangent, colour with opacity, coordinates.
const NUMBERS: usize = 3 + 3 + 4 + 2 * SETS;

type Numbers = [f32; NUMBERS];

/// A table of one triangle whose corners have these numbers.
fn table(corners: [Numbers; 3]) -> TriangleTable {
    let mut table = TriangleTable::with_capacity(1);
    let uvs: Vec<[[f32; 2]; 3]> = (0..SETS).map(|set| corners.map(|c| [c[10 + 2 * set], c[11 + 2 * set]])).collect();
    table.push_attributes(&Corners {
        normals: Some(corners.map(|c| Vec3::from_slice(&c[..3]))),
        uvs: &uvs,
        colors: Some(corners.map(|c| [c[6], c[7], c[8], c[9]])),
    });
    table.push_tangents(corners.map(|c| [c[3], c[4], c[5], 1.0]));
    table
}

/// What lane 0 reads at (`u`, `v`).
#[inline(always)]
fn read<L: Lanes>(table: &TriangleTable, u: f32, v: f32) -> Numbers {
    let (index, u, v) = (L::U::splat(0), L::F::splat(u), L::F::splat(v));
    let a = table.attributes::<L>(index, u, v);
    let (t, _) = table.tangent::<L>(index, u, v, &None, &None);
    let (n, c) = (a.normal, a.color);
    let mut out = [0.0; NUMBERS];
    store::<L>(&[n.x, n.y, n.z, t.x, t.y, t.z, c.x, c.y, c.z, a.opacity], &mut out[..10]);
    for set in 0..SETS {
        store::<L>(&a.uvs.get(L::U::splat(set as u32)), &mut out[10 + 2 * set..]);
    }
    out
}

#[inline(always)]
fn store<L: Lanes>(values: &[L::F], out: &mut [f32]) {
    for (value, out) in values.iter().zip(out) {
        *out = value.first();
    }
}

fn corner(rng: &mut Rng) -> Numbers {
    std::array::from_fn(|_| rng.range(-1.0, 1.0))
}

// 500 triangles, seed 8.
#[test]
fn attributes_are_the_corners_at_the_corners_and_their_weighted_mean_between() {
    #[derive(Clone)]
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let mut rng = Rng::of_stream(8, "attributes", 0);
            for _ in 0..500 {
                let corners = [0; 3].map(|_| corner(&mut rng));
                let table = table(corners);
                let (u, v) = (rng.range(0.0, 0.5), rng.range(0.0, 0.5));
                for (at, (u, v)) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (u, v)].into_iter().enumerate() {
                    for (i, found) in read::<L>(&table, u, v).into_iter().enumerate() {
                        let [a, b, c] = corners.map(|corner| f64::from(corner[i]));
                        let (u, v) = (f64::from(u), f64::from(v));
                        let exact = a * (1.0 - u - v) + b * u + c * v;
                        assert!((f64::from(found) - exact).abs() < 6e-7, "number {i} at {at}: {found} for {exact}");
                    }
                }
            }
        }
    }
    at_all_levels(Check);
}

// 1000 places, seed 88. Of sums of three weighted corners a third differ at 0.1.
#[test]
fn geo08_attributes_that_are_alike_at_all_corners_are_that_bit_for_bit() {
    #[derive(Clone)]
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let mut rng = Rng::of_stream(88, "constants", 0);
            let constant: Numbers = std::array::from_fn(|i| [0.1, 0.7333, 1.0, -0.3, 0.9][i % 5]);
            let table = table([constant; 3]);
            for _ in 0..1000 {
                let (u, v) = (rng.unit(), rng.unit());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let found = read::<L>(&table, u, v);
                assert_eq!(found.map(f32::to_bits), constant.map(f32::to_bits), "at {u}, {v}");
            }
        }
    }
    at_all_levels(Check);
}
