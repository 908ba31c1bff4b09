//! Queries against a real Embree; every test is skipped with a line where there is none.

mod common;

use common::{Batch, MISS, Numbers, device, rounded, scene_of, square};
use embree4_rs::{
    BuildQuality, Coherence, GeometryId, Mask8, Mask16, Ray, Ray8, Ray16, RayHit8, RayHit16, RaysSoA, Scene,
    SceneFlags, TriangleGeometry,
};

/// Down on the unit right triangle at z = 0: a hit with u = x, v = y, t = 2.
fn down(x: f32, y: f32) -> Ray {
    Ray::new([x, y, 2.0], [0.0, 0.0, -1.0])
}

fn triangle() -> common::Mesh {
    (vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]])
}

#[test]
fn one_ray_hits_and_misses_a_triangle() {
    let Some(device) = device("threads=1") else { return };
    let scene = scene_of(&device, [triangle()]);
    let hit = scene.intersect1(&down(0.25, 0.5)).expect("the ray meets the triangle");
    assert_eq!([hit.t, hit.u, hit.v].map(rounded), [2.0, 0.25, 0.5]);
    assert_eq!((hit.primitive, hit.geometry, hit.instance), (0, 0, MISS));
    assert!(hit.ng[0] == 0.0 && hit.ng[1] == 0.0 && hit.ng[2] > 0.0, "{:?}", hit.ng);
    assert_eq!(scene.intersect1(&down(0.75, 0.75)), None);
    assert!(scene.occluded1(&down(0.25, 0.5)));
    assert!(!scene.occluded1(&down(0.75, 0.75)));
    assert_eq!(scene.bounds(), Some([[0.0; 3], [1.0, 1.0, 0.0]]));
}

#[test]
fn the_segment_ends_at_t_max_and_begins_at_t_min() {
    let Some(device) = device("threads=1") else { return };
    let scene = scene_of(&device, [triangle()]);
    let near = Ray { t_max: 1.5, ..down(0.25, 0.25) };
    assert!(scene.intersect1(&near).is_none() && !scene.occluded1(&near));
    let beyond = Ray { t_min: 2.5, ..down(0.25, 0.25) };
    assert!(scene.intersect1(&beyond).is_none() && !scene.occluded1(&beyond));
}

macro_rules! packet_test {
    ($name:ident, $width:literal, $Ray:ident, $RayHit:ident, $Mask:ident, $intersect:ident, $occluded:ident) => {
        #[test]
        fn $name() {
            let Some(device) = device("threads=1") else { return };
            let scene = scene_of(&device, [triangle()]);
            for coherence in [Coherence::Incoherent, Coherence::Coherent] {
                // Even lanes hit, odd lanes miss, every third lane is masked.
                let mut packet = $RayHit::default();
                let mut rays = $Ray::default();
                for lane in 0..$width {
                    let x = if lane % 2 == 0 { 0.25 } else { 0.75 };
                    packet.ray.set(lane, &down(x, 0.5));
                    rays.set(lane, &down(x, 0.5));
                    packet.hit.geometry[lane] = 77;
                }
                let valid = $Mask::from_fn(|lane| lane % 3 != 0);
                scene.$intersect(&valid, &mut packet, coherence);
                let occluded = scene.$occluded(&valid, &mut rays, coherence);
                for lane in 0..$width {
                    let is_hit = lane % 2 == 0 && lane % 3 != 0;
                    let hit = (packet.hit.primitive[lane], packet.hit.geometry[lane]);
                    assert_eq!(hit, if is_hit { (0, 0) } else { (MISS, MISS) }, "lane {lane}");
                    let t = packet.ray.t_max[lane];
                    assert_eq!(rounded(t), if is_hit { 2.0 } else { f32::INFINITY }, "lane {lane}");
                    if is_hit {
                        assert_eq!([packet.hit.u[lane], packet.hit.v[lane]].map(rounded), [0.25, 0.5]);
                        assert_eq!(packet.hit.instance[lane], MISS);
                    }
                    assert_eq!(occluded.contains(lane), is_hit, "lane {lane}");
                }
            }
        }
    };
}

packet_test!(eight_rays_hit_miss_and_are_masked, 8, Ray8, RayHit8, Mask8, intersect8, occluded8);
packet_test!(sixteen_rays_hit_miss_and_are_masked, 16, Ray16, RayHit16, Mask16, intersect16, occluded16);

#[test]
fn rays_that_are_no_rays_miss_in_every_query() {
    let Some(device) = device("threads=1") else { return };
    let scene = scene_of(&device, [triangle()]);
    let good = down(0.25, 0.25);
    let mut bad = Vec::new();
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let mut ray = good;
            ray.origin[axis] = value;
            bad.push(ray);
            let mut ray = good;
            ray.direction[axis] = value;
            bad.push(ray);
        }
    }
    for t_max in [f32::NAN, -1.0, f32::NEG_INFINITY] {
        bad.push(Ray { t_max, ..good });
    }
    for time in [f32::NAN, -0.1, 1.1, f32::INFINITY] {
        bad.push(Ray { time, ..good });
    }
    for ray in &bad {
        assert!(scene.intersect1(ray).is_none() && !scene.occluded1(ray), "{ray:?}");
    }
    // Each among good neighbours.
    let rays: Vec<Ray> = bad.iter().flat_map(|&ray| [good, ray]).collect();
    let batch = Batch::new(&rays);
    let hits = batch.intersect(&scene, false);
    let occluded = batch.occluded(&scene);
    for (i, ray) in rays.iter().enumerate() {
        let is_good = i % 2 == 0;
        assert_eq!(hits.primitive[i], if is_good { 0 } else { MISS }, "{ray:?}");
        assert_eq!(occluded[i], u8::from(is_good), "{ray:?}");
    }
}

#[test]
fn a_direction_of_zero_misses() {
    let Some(device) = device("threads=1") else { return };
    let scene = scene_of(&device, [triangle()]);
    let ray = Ray::new([0.25, 0.25, 1.0], [0.0; 3]);
    assert!(scene.intersect1(&ray).is_none() && !scene.occluded1(&ray));
}

#[test]
fn a_batch_of_any_length_equals_its_single_rays() {
    for config in ["threads=1", "threads=1,isa=avx2", "threads=1,isa=sse4.2"] {
        let Some(device) = device(config) else { return };
        // Two meshes, so that geometry ids differ.
        let scene = scene_of(&device, [square(0.0, 7), square(-1.0, 3)]);
        let mut numbers = Numbers(1);
        for len in 0..=33 {
            let rays: Vec<Ray> = (0..len)
                .map(|_| Ray {
                    t_max: 0.5 + 3.0 * numbers.next(),
                    ..Ray::new(
                        [1.4 * numbers.next() - 0.2, 1.4 * numbers.next() - 0.2, 1.0],
                        [numbers.next() - 0.5, numbers.next() - 0.5, -1.0],
                    )
                })
                .collect();
            let batch = Batch::new(&rays);
            let occluded = batch.occluded(&scene);
            for coherent in [false, true] {
                let hits = batch.intersect(&scene, coherent);
                for (i, ray) in rays.iter().enumerate() {
                    let context = format!("ray {i} of {len}, coherent {coherent}, {config}: {ray:?}");
                    let single = scene.intersect1(ray);
                    assert_eq!(occluded[i], u8::from(single.is_some()), "{context}");
                    assert_eq!(hits.instance[i], MISS, "{context}");
                    let ids = (hits.geometry[i], hits.primitive[i]);
                    let Some(single) = single else {
                        assert_eq!(ids, (MISS, MISS), "{context}");
                        assert_eq!((hits.t[i], hits.u[i], hits.v[i]), (ray.t_max, 0.0, 0.0), "{context}");
                        continue;
                    };
                    assert_eq!(ids, (single.geometry, single.primitive), "{context}");
                    // Single rays and packets round differently.
                    let near = |a: f32, b: f32| (a - b).abs() < 1e-5;
                    assert!(near(hits.t[i], single.t), "{context}: {} {}", hits.t[i], single.t);
                    assert!(near(hits.u[i], single.u) && near(hits.v[i], single.v), "{context}");
                }
            }
        }
    }
}

// A caller's bug, as with indexing: a panic that names the slice, not an error to handle.
#[test]
#[should_panic(expected = "length of RaysSoA::dy must be that of ox")]
fn slices_of_different_lengths_panic() {
    let Some(device) = device("threads=1") else {
        panic!("length of RaysSoA::dy must be that of ox (not run: no Embree)");
    };
    let scene = scene_of(&device, [triangle()]);
    let two = [0.0; 2];
    let dy = &two[..1];
    let rays = RaysSoA {
        ox: &two,
        oy: &two,
        oz: &two,
        dx: &two,
        dy,
        dz: &two,
        t_max: &two,
        time: None,
        id: None,
        mask: None,
        is_open: false,
    };
    scene.occluded_batch(rays, false, &mut [0; 2]);
}

#[test]
fn robust_scene_has_no_leak_along_shared_edges() {
    let Some(device) = device("threads=1") else { return };
    let scene = scene_of(&device, [square(0.0, 16)]);
    // Straight down at vertices and edge midpoints of the grid's inside.
    let rays: Vec<Ray> = (1..32).flat_map(|y| (1..32).map(move |x| down(x as f32 / 32.0, y as f32 / 32.0))).collect();
    let hits = Batch::new(&rays).intersect(&scene, true);
    assert!(hits.primitive.iter().all(|&primitive| primitive != MISS));
}

#[test]
fn many_threads_query_one_scene() {
    let Some(device) = device("threads=1") else { return };
    let scene = scene_of(&device, [square(0.0, 16)]);
    std::thread::scope(|scope| {
        for seed in 0..4 {
            let scene = &scene;
            scope.spawn(move || {
                let mut numbers = Numbers(seed);
                for _ in 0..1000 {
                    assert!(scene.occluded1(&down(numbers.next(), numbers.next())));
                }
            });
        }
    });
}

#[test]
fn an_empty_scene_and_an_empty_mesh_are_misses() {
    let Some(device) = device("threads=1") else { return };
    let ray = down(0.25, 0.25);
    let scene = Scene::new(&device, SceneFlags::NONE, BuildQuality::Low).unwrap().commit().unwrap();
    assert!(scene.intersect1(&ray).is_none() && !scene.occluded1(&ray));
    assert_eq!(scene.bounds(), None);

    let mut scene = Scene::new(&device, SceneFlags::ROBUST, BuildQuality::High).unwrap();
    let empty = TriangleGeometry::new(&device, Vec::new(), Vec::new()).unwrap();
    assert_eq!(scene.attach(empty), Ok(GeometryId(0)));
    let (positions, indices) = triangle();
    let mesh = TriangleGeometry::new(&device, positions, indices).unwrap();
    assert_eq!(scene.attach(mesh), Ok(GeometryId(1)));
    let scene = scene.commit().unwrap();
    assert_eq!(scene.intersect1(&ray).map(|hit| hit.geometry), Some(1));
}

#[test]
fn triangles_with_wild_coordinates_are_never_hit_and_do_no_harm() {
    let Some(device) = device("threads=1") else { return };
    let (mut positions, mut indices) = triangle();
    for value in [f32::NAN, f32::INFINITY, f32::MAX, 1.9e19] {
        let at = positions.len() as u32;
        positions.extend([[value, 0.0, 1.0], [1.0, value, 1.0], [0.0, 1.0, 1.0]]);
        indices.push([at, at + 1, at + 2]);
    }
    let scene = scene_of(&device, [(positions, indices)]);
    let hit = scene.intersect1(&down(0.25, 0.5)).expect("the good triangle is still there");
    assert_eq!((hit.primitive, rounded(hit.t)), (0, 2.0));
}
