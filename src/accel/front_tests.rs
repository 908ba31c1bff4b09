//! The front by itself.

use super::*;
use crate::accel::Triangles;

#[test]
fn scenes_too_large_for_a_second_tree_have_no_front() {
    let scene = |n: usize| Triangles {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.001, 0.0, 0.0]],
        indices: [[0, 1, 2]].into_iter().chain(std::iter::repeat_n([0, 3, 0], n - 1)).collect(),
    };
    assert!(Split::new(scene(MOST_TWICE)).front.is_some_and(|(big, _)| big.triangles.len() == 1));
    assert!(Split::new(scene(MOST_TWICE + 1)).front.is_none());
}

#[test]
fn geo06_scenes_that_reach_farther_than_1e12_m_or_nowhere_have_no_front() {
    // A wall and a hundred small triangles, the farthest corner at `reach`.
    let has_front = |reach: f32| {
        let wall = [[-1.0, -1.0, 0.5], [1.0, -1.0, 0.5], [0.0, 1.0, 0.5]];
        let small = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]];
        let positions = wall.into_iter().chain(small).map(|p: [f32; 3]| p.map(|x| x * reach)).collect();
        let indices = [[0, 1, 2]].into_iter().chain([[3, 4, 5]; 100]).collect();
        Split::new(Triangles { positions, indices }).front.is_some()
    };
    for near in [1e-12, 1.0, 1e12] {
        assert!(has_front(near), "{near:e} m");
    }
    for far in [1e12_f32.next_up(), 1e13, 1e18, f32::MAX, f32::INFINITY, f32::NAN] {
        assert!(!has_front(far), "{far:e} m");
    }
}

#[test]
fn surfaces_that_are_welded_to_what_is_left_are_not_taken_apart() {
    // Two walls of two triangles and many small ones: alone, at the edge of the first wall, at its corner, at a T-junction.
    let walls = [[0.0, 0.0, -0.0], [9.0, 0.0, 0.0], [9.0, 9.0, 0.0], [0.0, 9.0, 0.0]];
    let positions = |offset: f32| walls.map(|[x, y, z]| [x, y, z + offset]);
    let front = |small: [[f32; 3]; 3]| {
        let positions = positions(0.0).into_iter().chain(positions(5.0)).chain(small).collect();
        let walls = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let indices = walls.into_iter().chain([[8, 9, 10]; 100]).collect();
        let Split { all, front } = Split::new(Triangles { positions, indices }).apart();
        let (big, rest) = front.expect("a wall");
        assert_eq!(all.triangle_count(), big.triangles.len() + rest.triangle_count());
        big.triangles.iter().map(|t| t.primitive).collect::<Vec<_>>()
    };
    assert_eq!(front([[4.0, 0.0, 0.1], [4.1, 0.0, 0.1], [4.0, 0.01, 0.1]]), [0, 1, 2, 3], "apart");
    assert_eq!(front([[0.0, 0.0, 0.0], [0.1, 0.0, 0.1], [0.0, 0.01, 0.1]]), [0, 1, 2, 3], "a corner");
    assert_eq!(front([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.01, 0.0]]), [0, 1, 2, 3], "a part of an edge");
    assert_eq!(
        front([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [4.0, 0.01, 0.0]]),
        [2, 3],
        "an edge, and by it the whole wall"
    );
}

#[test]
fn bvh02_rays_along_a_face_of_the_box_of_the_rest_go_on() {
    let quad = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 2.0], [-1.0, 1.0, 2.0]];
    let wall = [[-50.0, -50.0, 9.0], [50.0, -50.0, 9.0], [0.0, 50.0, 9.0]];
    let positions = quad.into_iter().chain(wall).collect();
    let (big, _) = Split::new(Triangles {
        positions,
        indices: (0..40).map(|_| [0, 1, 2]).chain((0..40).map(|_| [0, 2, 3])).chain([[4, 5, 6]]).collect(),
    })
    .front
    .expect("a wall");
    let rest = big.rest.expect("the quad");
    // In the planes of all six faces; zeroes of both signs.
    let mut rays = RayBatch::new(64);
    let mut n = 0;
    for (axis, side) in [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)] {
        for along in (0..3).filter(|&along| along != axis) {
            for zero in [0.0, -0.0] {
                let (mut o, mut d) = ([0.0, 0.0, 1.0], [zero; 3]);
                (o[axis], o[along], d[along]) = (rest[side][axis], -30.0, 1.0);
                rays.set(n, o.into(), d.into(), f32::INFINITY);
                n += 1;
            }
        }
    }
    #[derive(Clone, Copy)]
    struct Count<'a>(&'a RayBatch, [[f32; 3]; 2], usize);
    impl Kernel for Count<'_> {
        type Output = usize;

        #[inline(always)]
        fn run<L: Lanes>(self) -> usize {
            let Self(rays, rest, n) = self;
            let mut count = 0;
            for at in (0..n).step_by(L::N) {
                let packet = Packet::<L>::load(rays, at, L::M::first(n - at));
                count += packet.meets(&rest, packet.t_max).count();
            }
            count
        }
    }
    for level in [Level::Scalar, Level::Portable8, Level::Avx2, Level::Avx512] {
        if level.is_available() {
            assert_eq!(dispatch(level, Count(&rays, rest, n)), n, "{}", level.name());
        }
    }
}

#[test]
fn shadow_rays_go_to_the_front_only_where_many_meet_nothing_else() {
    // A wall, and 100 small triangles about the origin.
    let small = |k: u32| [0, 1, 2].map(|i| 3 + (k + i) % 3);
    let positions = vec![
        [-9.0, -9.0, 5.0],
        [9.0, -9.0, 5.0],
        [0.0, 9.0, 5.0],
        [-0.1, -0.1, 0.0],
        [0.1, -0.1, 0.05],
        [0.0, 0.1, -0.05],
    ];
    let indices = [[0, 1, 2]].into_iter().chain((0..100).map(small)).collect();
    let (big, _) = Split::new(Triangles { positions, indices }).front.expect("a wall");
    let mut rays = RayBatch::new(1024);
    for share in [0, 100] {
        for i in 0..1024 {
            let x = if i * 100 < share * 1024 { 3.0 } else { 0.0 };
            rays.set(i, glam::Vec3::new(x, 0.0, -5.0), glam::Vec3::Z, 1e9);
        }
        assert_eq!(dispatch(Level::best(), Pays { big: &big, rays: &rays, n: 1024 }), share == 100);
    }
}
