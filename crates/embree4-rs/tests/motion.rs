//! Moving meshes and moving instances against the same triangles at rest where they are at that time; skipped
//! with a line where there is no Embree.

mod common;

use std::sync::Arc;

use common::{Mesh, Numbers, apply, between, device, hits_in_every_way, is_same, lump, scene_of, square};
use embree4_rs::{
    Affine, BuildQuality, CommittedScene, Device, Error, Geometry, HitLayout, InstanceArrayGeometry, InstanceGeometry,
    Ray, Scene, SceneFlags, TriangleGeometry,
};

const TIMES: [f32; 7] = [0.0, 0.1, 0.25, 0.5, 0.70710677, 0.999, 1.0];

/// Where on `count` keys a time lies: the key before it and how far to the next one.
fn segment(time: f32, count: usize) -> (usize, f32) {
    let at = time * (count - 1) as f32;
    let before = (at as usize).min(count - 2);
    (before, at - before as f32)
}

/// The lump at each key, shifted, stretched and twisted by numbers from `seed`.
fn keys(count: usize, seed: u32) -> Vec<Vec<[f32; 3]>> {
    let mut numbers = Numbers(seed);
    (0..count)
        .map(|_| {
            let (shift, stretch) = (numbers.point(), numbers.point());
            let place = |p: [f32; 3]| std::array::from_fn(|i| 0.5 * shift[i] + (0.8 + 0.3 * stretch[i]) * p[i]);
            lump(12).0.into_iter().map(place).collect()
        })
        .collect()
}

fn at_rest(keys: &[Vec<[f32; 3]>], time: f32) -> Mesh {
    let (before, f) = segment(time, keys.len());
    let pairs = keys[before].iter().zip(&keys[before + 1]);
    (pairs.map(|(&a, &b)| between(a, b, f)).collect(), lump(12).1)
}

fn scene(device: &Arc<Device>, geometries: Vec<Geometry>) -> CommittedScene {
    let mut scene = Scene::new(device, SceneFlags::ROBUST, BuildQuality::Medium).unwrap();
    for geometry in geometries {
        scene.attach(geometry).unwrap();
    }
    scene.commit().unwrap()
}

fn rays_at(time: f32, seed: u32) -> Vec<Ray> {
    Numbers(seed).rays(1000).into_iter().map(|ray| Ray { time, ..ray }).collect()
}

/// `moving` at each of the times against what `at_rest` says that it is then.
fn assert_moves(device: &Arc<Device>, moving: &CommittedScene, at_rest: impl Fn(f32) -> Mesh) {
    for (seed, time) in (5..).zip(TIMES) {
        let rays = rays_at(time, seed);
        let resting = scene_of(device, [at_rest(time)]);
        let found = hits_in_every_way(moving, &rays);
        let mut edges = 0;
        for (ray, found) in rays.iter().zip(&found) {
            let is_agreed = match (found, resting.intersect1(ray)) {
                (None, None) => true,
                (Some(a), Some(b)) => is_same(
                    &embree4_rs::Hit { instance: b.instance, instance_primitive: b.instance_primitive, ..*a },
                    &b,
                ),
                _ => false,
            };
            edges += usize::from(!is_agreed);
        }
        // At an edge either neighbour may be reported, and at a silhouette either of hit and miss.
        assert!(edges <= 8, "{edges} of {} rays differ at time {time}", rays.len());
        assert!(found.iter().flatten().count() > 100, "too few hits at time {time}");
    }
}

#[test]
fn a_moving_mesh_is_where_its_keys_say() {
    for config in ["threads=1", "threads=1,isa=avx2"] {
        let Some(device) = device(config) else { return };
        for count in [2, 3, 5] {
            let keys = keys(count, 11);
            let mesh = TriangleGeometry::moving(&device, keys.clone(), lump(12).1).unwrap();
            assert_eq!((mesh.time_steps(), mesh.key(count)), (count, None));
            let moving = scene(&device, vec![mesh.into()]);
            assert_moves(&device, &moving, |time| at_rest(&keys, time));
        }
    }
}

#[test]
fn rays_of_one_packet_have_times_of_their_own() {
    let Some(device) = device("threads=1") else { return };
    // A square that rises from 0 to 1: a ray from above meets it at t = 2 - time.
    let keys = vec![square(0.0, 3).0, square(1.0, 3).0];
    let moving = scene(&device, vec![TriangleGeometry::moving(&device, keys, square(0.0, 3).1).unwrap().into()]);
    let mut numbers = Numbers(2);
    let rays: Vec<Ray> = (0..100)
        .map(|_| {
            let ray = Ray::new([numbers.next(), numbers.next(), 2.0], [0.0, 0.0, -1.0]);
            Ray { time: numbers.next(), ..ray }
        })
        .collect();
    for (ray, hit) in rays.iter().zip(hits_in_every_way(&moving, &rays)) {
        let hit = hit.expect("the square is below");
        assert!((hit.t - (2.0 - ray.time)).abs() < 1e-6, "{ray:?}: {hit:?}");
    }
}

#[test]
fn a_mesh_at_rest_beside_a_moving_one_is_untouched() {
    let Some(device) = device("threads=1") else { return };
    let still = || TriangleGeometry::new(&device, lump(12).0, lump(12).1).unwrap().into();
    let far = |keys: Vec<Vec<[f32; 3]>>| -> Vec<Vec<[f32; 3]>> {
        keys.into_iter().map(|key| key.into_iter().map(|[x, y, z]| [x + 100.0, y, z]).collect()).collect()
    };
    let moving = TriangleGeometry::moving(&device, far(keys(2, 3)), lump(12).1).unwrap();
    let alone = scene(&device, vec![still()]);
    let beside = scene(&device, vec![still(), moving.into()]);
    let rays = Numbers(9).rays(1000);
    for ray in &rays {
        assert_eq!(alone.intersect1(ray), beside.intersect1(ray));
    }
}

fn matrices(count: usize, seed: u32) -> Vec<Affine> {
    let mut numbers = Numbers(seed);
    (0..count)
        .map(|_| {
            let mut matrix: Affine = [[0.7, 0.0, 0.0], [0.0, 0.7, 0.0], [0.0, 0.0, 0.7], [0.0; 3]];
            for column in &mut matrix {
                let by = numbers.point();
                *column = std::array::from_fn(|i| column[i] + 0.25 * by[i]);
            }
            matrix
        })
        .collect()
}

fn matrix_at(keys: &[Affine], time: f32) -> Affine {
    let (before, f) = segment(time, keys.len());
    std::array::from_fn(|column| between(keys[before][column], keys[before + 1][column], f))
}

#[test]
fn a_moving_instance_is_where_its_keys_say() {
    let Some(device) = device("threads=1") else { return };
    let object = Arc::new(scene_of(&device, [lump(12)]));
    for count in [2, 4] {
        let keys = matrices(count, 21);
        let at_rest = |time| {
            let matrix = matrix_at(&keys, time);
            (lump(12).0.into_iter().map(|point| apply(&matrix, point)).collect(), lump(12).1)
        };
        let moving = scene(&device, vec![InstanceGeometry::new(&object, &keys).unwrap().into()]);
        assert_moves(&device, &moving, at_rest);

        if device.library().hit_layout() == HitLayout::InstancePrimitive {
            let array = keys.iter().map(|&matrix| vec![matrix]).collect();
            let moving = scene(&device, vec![InstanceArrayGeometry::new(&object, array).unwrap().into()]);
            assert_moves(&device, &moving, at_rest);
        }
    }
}

#[test]
fn a_moving_mesh_in_an_instance_moves_with_both() {
    let Some(device) = device("threads=1") else { return };
    let (inner, outer) = (keys(3, 31), matrices(2, 32));
    let mesh = TriangleGeometry::moving(&device, inner.clone(), lump(12).1).unwrap();
    let object = Arc::new(scene(&device, vec![mesh.into()]));
    for matrices in [&outer[..], &outer[..1]] {
        let moving = scene(&device, vec![InstanceGeometry::new(&object, matrices).unwrap().into()]);
        assert_moves(&device, &moving, |time| {
            let matrix = if matrices.len() == 1 { matrices[0] } else { matrix_at(matrices, time) };
            let (points, indices) = at_rest(&inner, time);
            (points.into_iter().map(|point| apply(&matrix, point)).collect(), indices)
        });
    }
}

#[test]
fn keys_that_do_not_fit_together_are_errors() {
    let Some(device) = device("threads=1") else { return };
    let moving = |keys| TriangleGeometry::moving(&device, keys, vec![[0, 1, 2]]).unwrap_err();
    assert_eq!(moving(Vec::new()), Error::NoKeys);
    let uneven = moving(vec![vec![[0.0; 3]; 3], vec![[0.0; 3]; 4]]);
    assert_eq!(uneven, Error::KeyLength { key: 1, found: 4, expected: 3 });
    let many = moving(vec![vec![[0.0; 3]; 3]; 130]);
    assert_eq!(many, Error::TooMany { what: "time keys", count: 130, limit: 129 });
}

#[test]
fn a_triangle_with_one_wild_key_is_never_hit() {
    let Some(device) = device("threads=1") else { return };
    let (positions, indices) = square(0.0, 1);
    for wild in [f32::NAN, f32::INFINITY, 1.9e19] {
        let mut moved = positions.clone();
        moved[1][2] = wild;
        let mesh = TriangleGeometry::moving(&device, vec![positions.clone(), moved], indices.clone()).unwrap();
        let moving = scene(&device, vec![mesh.into()]);
        // The wild vertex is a corner of the first triangle only.
        for time in TIMES {
            let down = |x, y| Ray { time, ..Ray::new([x, y, 1.0], [0.0, 0.0, -1.0]) };
            assert_eq!(moving.intersect1(&down(0.75, 0.25)), None);
            assert_eq!(moving.intersect1(&down(0.25, 0.75)).map(|hit| hit.primitive), Some(1));
        }
    }
}
