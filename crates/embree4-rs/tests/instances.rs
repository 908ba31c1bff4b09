//! Instances against the same triangles moved by hand; skipped with a line where there is no Embree.

mod common;

use std::sync::Arc;

use common::{MISS, Mesh, Numbers, apply, device, hits_in_every_way, is_same, lump, scene_of};
use embree4_rs::{
    Affine, BuildQuality, CommittedScene, Device, Error, Hit, HitLayout, InstanceArrayGeometry, InstanceGeometry, Ray,
    Scene, SceneFlags, TriangleGeometry,
};

const IDENTITY: Affine = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];

/// Turned, mirrored, stretched and shifted.
const PLACES: [Affine; 4] = [
    [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0], [0.3, 0.0, 0.0]],
    [[-0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5], [-0.5, 0.5, 0.0]],
    [[1.2, 0.3, 0.0], [0.0, 0.2, 0.1], [0.2, 0.0, 0.5], [0.0, -0.6, 0.4]],
    [[0.0, 0.0, 0.4], [0.4, 0.0, 0.0], [0.0, -0.9, 0.0], [0.4, 0.4, -0.5]],
];

fn moved(mesh: &Mesh, matrix: &Affine) -> Mesh {
    (mesh.0.iter().map(|&point| apply(matrix, point)).collect(), mesh.1.clone())
}

fn object(device: &Arc<Device>) -> Arc<CommittedScene> {
    Arc::new(scene_of(device, [lump(12)]))
}

fn empty(device: &Arc<Device>) -> Scene {
    Scene::new(device, SceneFlags::ROBUST, BuildQuality::Medium).unwrap()
}

/// Compares hits with those of a scene whose geometry numbers are what the instances' numbers should be.
fn assert_as_baked(found: &[Option<Hit>], baked: &[Option<Hit>], place_of: impl Fn(&Hit) -> u32) {
    let mut edges = 0;
    for (i, (found, baked)) in found.iter().zip(baked).enumerate() {
        let as_baked = found.map(|hit| Hit {
            geometry: place_of(&hit),
            instance: MISS,
            instance_primitive: MISS,
            ng: [0.0; 3],
            ..hit
        });
        match (as_baked, baked) {
            (None, None) => {}
            (Some(a), Some(b)) if is_same(&a, b) => {}
            // At an edge either neighbour may be reported, and at a silhouette either of hit and miss.
            _ => edges += 1,
        }
        if let Some(hit) = found {
            assert_eq!(hit.geometry, 0, "ray {i}: the object scene has one geometry");
        }
    }
    assert!(edges * 200 <= found.len(), "{edges} of {} rays differ", found.len());
    let hits = found.iter().flatten().count();
    assert!(hits * 4 > found.len(), "only {hits} hits");
}

fn baked_hits(device: &Arc<Device>, rays: &[Ray]) -> Vec<Option<Hit>> {
    let baked = scene_of(device, PLACES.map(|matrix| moved(&lump(12), &matrix)));
    rays.iter().map(|ray| baked.intersect1(ray)).collect()
}

#[test]
fn instances_agree_with_moved_vertices() {
    for config in ["threads=1", "threads=1,isa=avx2", "threads=1,isa=sse4.2"] {
        let Some(device) = device(config) else { return };
        let object = object(&device);
        let mut scene = empty(&device);
        for matrix in PLACES {
            scene.attach(InstanceGeometry::new(&object, &[matrix]).unwrap()).unwrap();
        }
        let scene = scene.commit().unwrap();
        let rays = Numbers(3).rays(4000);
        let hits = hits_in_every_way(&scene, &rays);
        assert_as_baked(&hits, &baked_hits(&device, &rays), |hit| hit.instance);
        let is_array_aware = device.library().hit_layout() == HitLayout::InstancePrimitive;
        for hit in hits.iter().flatten() {
            assert_eq!(hit.instance_primitive, if is_array_aware { 0 } else { MISS });
        }
    }
}

#[test]
fn an_instance_array_agrees_with_moved_vertices() {
    for config in ["threads=1", "threads=1,isa=avx2"] {
        let Some(device) = device(config) else { return };
        if device.library().hit_layout() == HitLayout::Plain {
            println!("skipped: this Embree has no instance arrays");
            return;
        }
        let instances = InstanceArrayGeometry::new(&object(&device), vec![PLACES.to_vec()]).unwrap();
        assert_eq!(instances.len(), 4);
        let mut scene = empty(&device);
        scene.attach(instances).unwrap();
        let scene = scene.commit().unwrap();
        let rays = Numbers(4).rays(4000);
        let hits = hits_in_every_way(&scene, &rays);
        assert_as_baked(&hits, &baked_hits(&device, &rays), |hit| hit.instance_primitive);
        assert!(hits.iter().flatten().all(|hit| hit.instance == 0));
    }
}

#[test]
fn instances_lie_beside_triangles_and_report_their_own_number() {
    let Some(device) = device("threads=1") else { return };
    let mut scene = empty(&device);
    let (positions, indices) = common::square(0.0, 1);
    scene.attach(TriangleGeometry::new(&device, positions, indices).unwrap()).unwrap();
    let mut right = IDENTITY;
    right[3] = [5.0, 0.0, 0.0];
    let id = scene.attach(InstanceGeometry::new(&object(&device), &[right]).unwrap()).unwrap();
    let scene = scene.commit().unwrap();
    let down = |x: f32| Ray::new([x, 0.5, 3.0], [0.0, 0.0, -1.0]);
    let flat = scene.intersect1(&down(0.3)).unwrap();
    assert_eq!((flat.geometry, flat.instance, flat.instance_primitive), (0, MISS, MISS));
    let lump = scene.intersect1(&down(5.0)).unwrap();
    assert_eq!((lump.geometry, lump.instance), (0, id.0));
    assert!(scene.has_instances());
}

#[test]
fn an_instance_keeps_its_scene_alive() {
    let Some(device) = device("threads=1") else { return };
    let object = object(&device);
    let instance = InstanceGeometry::new(&object, &[IDENTITY]).unwrap();
    let alive = Arc::downgrade(&object);
    drop(object);
    let mut scene = empty(&device);
    scene.attach(instance).unwrap();
    let scene = scene.commit().unwrap();
    assert!(alive.upgrade().is_some());
    assert!(scene.occluded1(&Ray::new([0.0, 0.0, 3.0], [0.0, 0.1, -1.0])));
    drop(scene);
    assert!(alive.upgrade().is_none());
}

#[test]
fn a_second_level_is_an_error() {
    let Some(device) = device("threads=1") else { return };
    let mut scene = empty(&device);
    scene.attach(InstanceGeometry::new(&object(&device), &[IDENTITY]).unwrap()).unwrap();
    let scene = Arc::new(scene.commit().unwrap());
    assert_eq!(InstanceGeometry::new(&scene, &[IDENTITY]).unwrap_err(), Error::SecondLevel);
    assert_eq!(InstanceArrayGeometry::new(&scene, vec![vec![IDENTITY]]).unwrap_err(), Error::SecondLevel);
}

#[test]
fn matrices_that_cannot_be_inverted_are_errors() {
    let Some(device) = device("threads=1") else { return };
    let object = object(&device);
    let flat = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
    let nan = [[f32::NAN, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
    for bad in [flat, nan] {
        let error = InstanceGeometry::new(&object, &[IDENTITY, bad]).unwrap_err();
        assert!(matches!(error, Error::Matrix { instance: 0, key: 1, .. }), "{error}");
        let error = InstanceArrayGeometry::new(&object, vec![vec![IDENTITY, bad]]).unwrap_err();
        assert!(matches!(error, Error::Matrix { instance: 1, key: 0, .. }), "{error}");
    }
    assert_eq!(InstanceGeometry::new(&object, &[]).unwrap_err(), Error::NoKeys);
    let uneven = InstanceArrayGeometry::new(&object, vec![vec![IDENTITY; 2], vec![IDENTITY]]).unwrap_err();
    assert_eq!(uneven, Error::KeyLength { key: 1, found: 1, expected: 2 });
}

/// The smallest and the largest scales that pass the check really work in Embree.
#[test]
fn the_range_of_scales_that_is_accepted_is_hit() {
    let Some(device) = device("threads=1") else { return };
    let object = object(&device);
    for scale in [2.4e-13f32, 1e-9, 1e6, 6.9e12] {
        let matrix = [[scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, 0.0, scale], [0.0; 3]];
        let mut scene = empty(&device);
        scene.attach(InstanceGeometry::new(&object, &[matrix]).unwrap()).unwrap();
        let scene = scene.commit().unwrap();
        let ray = Ray::new([0.1 * scale, 0.2 * scale, 3.0 * scale], [0.0, 0.0, -scale]);
        let hit = scene.intersect1(&ray).unwrap_or_else(|| panic!("scale {scale:e} is not hit"));
        let plain = object.intersect1(&Ray::new([0.1, 0.2, 3.0], [0.0, 0.0, -1.0])).unwrap();
        assert!((hit.t - plain.t).abs() < 1e-5, "scale {scale:e}: {} {}", hit.t, plain.t);
        assert!(scene.occluded1(&ray));
    }
}
