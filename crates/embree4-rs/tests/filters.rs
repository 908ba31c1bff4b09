//! Filters and masks; skipped with a line where there is no Embree.

mod common;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};

use common::{Batch, MISS, Mesh, Numbers, device, hits_in_every_way, is_same, lump, scene_of};
use embree4_rs::{
    Affine, BuildQuality, Candidate, Coherence, CommittedScene, Device, Filter, Geometry, Hit, HitLayout,
    InstanceArrayGeometry, InstanceGeometry, Mask8, Mask16, Ray, Ray8, Ray16, RayHit8, RayHit16, Scene, SceneFlags,
    TriangleGeometry,
};

const CONFIGS: [&str; 3] = ["threads=1", "threads=1,isa=avx2", "threads=1,isa=sse4.2"];
const HALF: Affine = [[0.5, 0.0, 0.0], [0.0, -0.5, 0.0], [0.0, 0.0, 0.5], [0.0, 0.0, 0.0]];

/// A filter that is a closure.
struct By<F>(F);

impl<F: Fn(&Candidate) -> bool + Send + Sync> Filter for By<F> {
    fn accept(&self, candidate: &Candidate) -> bool {
        (self.0)(candidate)
    }
}

fn mesh(device: &Arc<Device>, (positions, indices): Mesh) -> TriangleGeometry {
    TriangleGeometry::new(device, positions, indices).unwrap()
}

fn filtered(
    device: &Arc<Device>,
    shape: Mesh,
    accept: impl Fn(&Candidate) -> bool + Send + Sync + 'static,
) -> TriangleGeometry {
    let mut mesh = mesh(device, shape);
    mesh.set_filter(Arc::new(By(accept))).unwrap();
    mesh
}

fn scene<const N: usize>(device: &Arc<Device>, geometries: [Geometry; N]) -> CommittedScene {
    let mut scene = Scene::new(device, SceneFlags::ROBUST, BuildQuality::Medium).unwrap();
    for geometry in geometries {
        scene.attach(geometry).unwrap();
    }
    scene.commit().unwrap()
}

/// The lump without its odd triangles.
fn half_lump() -> Mesh {
    let (positions, indices) = lump(12);
    (positions, indices.into_iter().step_by(2).collect())
}

fn assert_same(found: &[Option<Hit>], expected: &[Option<Hit>]) {
    let mut edges = 0;
    for (a, b) in found.iter().zip(expected) {
        edges += usize::from(match (a, b) {
            (Some(a), Some(b)) => !is_same(a, b),
            (a, b) => a.is_some() != b.is_some(),
        });
    }
    assert!(edges * 200 <= found.len(), "{edges} of {} rays differ", found.len());
    assert!(found.iter().flatten().count() * 10 > found.len(), "too few hits");
}

#[test]
fn a_filter_that_refuses_half_of_the_triangles_leaves_the_others() {
    for config in CONFIGS {
        let Some(device) = device(config) else { return };
        let holed = scene(&device, [filtered(&device, lump(12), |c| c.primitive % 2 == 0).into()]);
        let rays = Numbers(1).rays(3000);
        let hits = hits_in_every_way(&holed, &rays);
        assert!(hits.iter().flatten().all(|hit| hit.primitive % 2 == 0));
        let half = scene_of(&device, [half_lump()]);
        let expected: Vec<Option<Hit>> = rays
            .iter()
            .map(|ray| half.intersect1(ray).map(|hit| Hit { primitive: 2 * hit.primitive, ..hit }))
            .collect();
        assert_same(&hits, &expected);
    }
}

#[test]
fn a_filter_acts_in_instances_and_sees_which_one() {
    for config in CONFIGS {
        let Some(device) = device(config) else { return };
        let object = Arc::new(scene(&device, [filtered(&device, lump(12), |c| c.primitive % 2 == 0).into()]));
        let half = Arc::new(scene_of(&device, [half_lump()]));
        let rays = Numbers(2).rays(3000);
        let doubled = |scene: &CommittedScene| -> Vec<Option<Hit>> {
            let double = |hit: Hit| Hit { primitive: 2 * hit.primitive, ..hit };
            rays.iter().map(|ray| scene.intersect1(ray).map(double)).collect()
        };
        let placed =
            |object: &Arc<CommittedScene>| scene(&device, [InstanceGeometry::new(object, &[HALF]).unwrap().into()]);
        let hits = hits_in_every_way(&placed(&object), &rays);
        assert_same(&hits, &doubled(&placed(&half)));

        // Of two instances only the one whose number the filter knows.
        let is_second = filtered(&device, lump(12), |c| c.instance == 1 && c.geometry == 0);
        let object = Arc::new(scene(&device, [is_second.into()]));
        let mut left = HALF;
        left[3] = [-0.5, 0.0, 0.0];
        let pair = [left, HALF].map(|matrix| InstanceGeometry::new(&object, &[matrix]).unwrap().into());
        let hits = hits_in_every_way(&scene(&device, pair), &rays);
        assert!(hits.iter().flatten().all(|hit| hit.instance == 1) && hits.iter().flatten().count() > 200);

        if device.library().hit_layout() == HitLayout::InstancePrimitive {
            let is_second = filtered(&device, lump(12), |c| c.instance == 0 && c.instance_primitive == 1);
            let object = Arc::new(scene(&device, [is_second.into()]));
            let pair = InstanceArrayGeometry::new(&object, vec![vec![left, HALF]]).unwrap();
            let hits = hits_in_every_way(&scene(&device, [pair.into()]), &rays);
            assert!(hits.iter().flatten().all(|hit| hit.instance_primitive == 1));
            assert!(hits.iter().flatten().count() > 200);
        }
    }
}

#[test]
fn a_filter_knows_its_ray() {
    for config in CONFIGS {
        let Some(device) = device(config) else { return };
        let third = scene(&device, [filtered(&device, lump(12), |c| c.ray_id % 3 == 0).into()]);
        let plain = scene_of(&device, [lump(12)]);
        let rays = Numbers(3).rays(2000);
        for (ray, hit) in rays.iter().zip(hits_in_every_way(&third, &rays)) {
            let is_expected = ray.id % 3 == 0 && plain.occluded1(ray);
            assert_eq!(hit.is_some(), is_expected, "{ray:?}");
        }
        // Without ids all rays are number 0, also after a batch with ids.
        let batch = Batch::new(&rays);
        let mut out = vec![7; rays.len()];
        let mut anonymous = batch.rays();
        anonymous.id = None;
        third.occluded_batch(anonymous, false, &mut out);
        for (ray, &occluded) in rays.iter().zip(&out) {
            assert_eq!(occluded != 0, plain.occluded1(ray));
        }
    }
}

#[test]
fn the_candidate_that_is_accepted_is_the_hit() {
    let Some(device) = device("threads=1") else { return };
    let seen = Arc::new(Mutex::new(Vec::new()));
    let into = Arc::clone(&seen);
    let watched = filtered(&device, lump(12), move |c| {
        into.lock().unwrap().push(*c);
        true
    });
    // Geometry 0 is far away and has no filter, so it must not be asked about.
    let (positions, indices) = lump(4);
    let far = (positions.into_iter().map(|[x, y, z]| [x + 50.0, y, z]).collect(), indices);
    let object = Arc::new(scene(&device, [mesh(&device, far).into(), watched.into()]));
    let placed = scene(&device, [InstanceGeometry::new(&object, &[HALF]).unwrap().into()]);
    for (scene, instance) in [(&*object, MISS), (&placed, 0)] {
        for ray in Numbers(4).rays(500) {
            seen.lock().unwrap().clear();
            let hit = scene.intersect1(&ray);
            let seen = seen.lock().unwrap();
            let Some(hit) = hit else {
                assert!(seen.is_empty(), "a candidate that was accepted is no hit");
                continue;
            };
            let expected = Candidate {
                ray_id: ray.id,
                geometry: 1,
                primitive: hit.primitive,
                instance,
                instance_primitive: hit.instance_primitive,
                u: hit.u,
                v: hit.v,
                t: hit.t,
            };
            assert!(seen.contains(&expected), "{expected:?} is not among {seen:?}");
            assert!(seen.iter().all(|c| c.t <= ray.t_max && c.instance == instance && c.geometry == 1));
        }
    }
}

#[test]
fn a_filter_acts_on_a_moving_mesh() {
    let Some(device) = device("threads=1") else { return };
    let (positions, indices) = lump(12);
    let risen: Vec<[f32; 3]> = positions.iter().map(|&[x, y, z]| [x, y, z + 0.5]).collect();
    let keys = vec![positions, risen];
    let mut mesh = TriangleGeometry::moving(&device, keys.clone(), indices.clone()).unwrap();
    mesh.set_filter(Arc::new(By(|c: &Candidate| c.primitive % 2 == 0))).unwrap();
    let even = indices.into_iter().step_by(2).collect();
    let expected = scene(&device, [TriangleGeometry::moving(&device, keys, even).unwrap().into()]);
    let rays = Numbers(5).rays(2000);
    let hits = hits_in_every_way(&scene(&device, [mesh.into()]), &rays);
    let double = |hit: Hit| Hit { primitive: 2 * hit.primitive, ..hit };
    let expected: Vec<_> = rays.iter().map(|ray| expected.intersect1(ray).map(double)).collect();
    assert_same(&hits, &expected);
}

#[test]
fn a_panic_in_a_filter_comes_out_of_every_kind_of_query() {
    for config in CONFIGS {
        let Some(device) = device(config) else { return };
        let touchy = filtered(&device, lump(12), |c| {
            assert!(c.ray_id != 7, "ray {} is not welcome", c.ray_id);
            true
        });
        let object = Arc::new(scene(&device, [touchy.into()]));
        let instanced = scene(&device, [InstanceGeometry::new(&object, &[HALF]).unwrap().into()]);
        let at = |id: u32| Ray { id, ..Ray::new([0.1, 0.1, 3.0], [0.0, 0.0, -1.0]) };
        for scene in [&*object, &instanced] {
            let (rays, good) = ([5, 6, 7, 8].map(at), [5, 6, 8, 9].map(at));
            let packet8 = |rays: &[Ray]| {
                let mut packet = RayHit8::default();
                rays.iter().enumerate().for_each(|(lane, ray)| packet.ray.set(lane, ray));
                packet
            };
            let packet16 = |rays: &[Ray]| {
                let mut packet = RayHit16::default();
                rays.iter().enumerate().for_each(|(lane, ray)| packet.ray.set(lane, ray));
                packet
            };
            type Query<'a> = Box<dyn Fn(&[Ray]) -> usize + 'a>;
            let mut queries: Vec<Query> = vec![
                Box::new(|rays| rays.iter().filter(|ray| scene.intersect1(ray).is_some()).count()),
                Box::new(|rays| rays.iter().filter(|ray| scene.occluded1(ray)).count()),
                Box::new(|rays| Batch::new(rays).occluded(scene).iter().map(|&bit| usize::from(bit)).sum()),
            ];
            for coherence in [Coherence::Incoherent, Coherence::Coherent] {
                queries.push(Box::new(move |rays| {
                    let hits = Batch::new(rays).intersect(scene, coherence == Coherence::Coherent);
                    hits.geometry.iter().filter(|&&geometry| geometry != MISS).count()
                }));
                queries.push(Box::new(move |rays| {
                    let mut packet = packet8(rays);
                    scene.intersect8(&Mask8::first(rays.len()), &mut packet, coherence);
                    packet.hit.geometry.iter().filter(|&&geometry| geometry != MISS).count()
                }));
                queries.push(Box::new(move |rays| {
                    let mut packet: Ray16 = packet16(rays).ray;
                    let hit = scene.occluded16(&Mask16::first(rays.len()), &mut packet, coherence);
                    (0..16).filter(|&lane| hit.contains(lane)).count()
                }));
                queries.push(Box::new(move |rays| {
                    let mut packet: Ray8 = packet8(rays).ray;
                    let hit = scene.occluded8(&Mask8::first(rays.len()), &mut packet, coherence);
                    (0..8).filter(|&lane| hit.contains(lane)).count()
                }));
            }
            for (i, query) in queries.iter().enumerate() {
                let payload = catch_unwind(AssertUnwindSafe(|| query(&rays))).expect_err("no panic came out");
                let text = payload.downcast_ref::<String>().expect("the filter's own payload");
                assert_eq!(text, "ray 7 is not welcome", "query {i}");
                // And nothing of it stays behind.
                assert_eq!(query(&good), 4, "query {i}");
            }
        }
    }
}

#[test]
fn a_filter_may_query_a_scene_and_its_panic_passes_both() {
    let Some(device) = device("threads=1") else { return };
    let inner = scene(
        &device,
        [filtered(&device, lump(6), |c| {
            assert!(c.ray_id != 1, "inner");
            true
        })
        .into()],
    );
    let outer = filtered(&device, lump(6), move |c| {
        inner.occluded1(&Ray { id: c.ray_id, ..Ray::new([0.1, 0.1, 3.0], [0.0, 0.0, -1.0]) })
    });
    let outer = scene(&device, [outer.into()]);
    let at = |id: u32| Ray { id, ..Ray::new([0.1, 0.1, 3.0], [0.0, 0.0, -1.0]) };
    assert!(outer.occluded1(&at(0)));
    let payload = catch_unwind(AssertUnwindSafe(|| outer.occluded1(&at(1)))).unwrap_err();
    assert_eq!(payload.downcast_ref::<&str>(), Some(&"inner"));
    assert!(outer.occluded1(&at(2)));
}

#[test]
fn masks_decide_which_rays_meet_which_geometry() {
    for config in CONFIGS {
        let Some(device) = device(config) else { return };
        let square = |z: f32, mask: u32| {
            let mut square = mesh(&device, common::square(z, 1));
            square.set_mask(mask).unwrap();
            square
        };
        let object = Arc::new(scene(&device, [square(0.0, 1).into(), square(-1.0, 6).into()]));
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
        let mut instance = InstanceGeometry::new(&object, &[identity]).unwrap();
        instance.set_mask(3).unwrap();
        let instanced = scene(&device, [instance.into()]);
        let down = |mask| Ray { mask, ..Ray::new([0.3, 0.4, 1.0], [0.0, 0.0, -1.0]) };
        for (mask, plain, within) in [
            (1, Some(1.0), Some(1.0)),
            (2, Some(2.0), Some(2.0)),
            (4, Some(2.0), None),
            (7, Some(1.0), Some(1.0)),
            (8, None, None),
            (0, None, None),
        ] {
            let rays = [down(mask); 20];
            for (scene, expected) in [(&*object, plain), (&instanced, within)] {
                for hit in hits_in_every_way(scene, &rays) {
                    assert_eq!(hit.map(|hit| hit.t.round()), expected, "mask {mask}, {config}");
                }
            }
        }
    }
}
