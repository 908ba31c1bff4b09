//! User geometry: spheres against the closed form; skipped with a line where there is no Embree.

mod common;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use common::{MISS, Numbers, device, hits_in_every_way};
use embree4_rs::{
    Affine, BuildQuality, CommittedScene, Device, Error, Geometry, InstanceGeometry, Ray, Scene, SceneFlags,
    TriangleGeometry, UserGeometry, UserHit, UserShapes,
};

const CONFIGS: [&str; 3] = ["threads=1", "threads=1,isa=avx2", "threads=1,isa=sse4.2"];

/// Spheres, each from one centre at time 0 to another at time 1.
struct Spheres {
    centres: Vec<[[f32; 3]; 2]>,
    radius: f32,
}

impl Spheres {
    fn at_rest(centres: &[[f32; 3]], radius: f32) -> Arc<Self> {
        Arc::new(Self { centres: centres.iter().map(|&centre| [centre; 2]).collect(), radius })
    }

    fn centre(&self, primitive: u32, time: f32) -> [f32; 3] {
        let [from, to] = self.centres[primitive as usize];
        common::between(from, to, time)
    }

    /// In f64: the nearest `t` of all spheres, and which.
    fn nearest(&self, ray: &Ray) -> Option<(f64, u32)> {
        let mut best: Option<(f64, u32)> = None;
        for primitive in 0..self.centres.len() as u32 {
            let Some(t) = roots(self.centre(primitive, ray.time), self.radius, ray) else { continue };
            if best.is_none_or(|(found, _)| t < found) {
                best = Some((t, primitive));
            }
        }
        best
    }
}

/// The nearest `t` on the ray where it meets a sphere, in f64.
fn roots(centre: [f32; 3], radius: f32, ray: &Ray) -> Option<f64> {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let direction = ray.direction.map(f64::from);
    let from: [f64; 3] = std::array::from_fn(|i| f64::from(ray.origin[i]) - f64::from(centre[i]));
    let (a, half_b) = (dot(direction, direction), dot(from, direction));
    let discriminant = half_b * half_b - a * (dot(from, from) - f64::from(radius).powi(2));
    if discriminant < 0.0 {
        return None;
    }
    let is_on = |t: &f64| (f64::from(ray.t_min)..=f64::from(ray.t_max)).contains(t);
    [-1.0, 1.0].map(|sign| (-half_b + sign * discriminant.sqrt()) / a).into_iter().find(is_on)
}

impl UserShapes for Spheres {
    fn len(&self) -> usize {
        self.centres.len()
    }

    fn time_steps(&self) -> usize {
        if self.centres.iter().all(|[from, to]| from == to) { 1 } else { 2 }
    }

    fn bounds(&self, primitive: u32, time: f32) -> Option<[[f32; 3]; 2]> {
        let centre = self.centre(primitive, time);
        Some([centre.map(|x| x - self.radius), centre.map(|x| x + self.radius)])
    }

    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<UserHit> {
        let t = roots(self.centre(primitive, ray.time), self.radius, ray)? as f32;
        Some(UserHit { t, u: 0.25, v: 0.75 })
    }
}

fn scene<const N: usize>(device: &Arc<Device>, geometries: [Geometry; N]) -> CommittedScene {
    let mut scene = Scene::new(device, SceneFlags::ROBUST, BuildQuality::Medium).unwrap();
    for geometry in geometries {
        scene.attach(geometry).unwrap();
    }
    scene.commit().unwrap()
}

fn shapes(device: &Arc<Device>, shapes: Arc<dyn UserShapes>) -> Geometry {
    UserGeometry::new(device, shapes).unwrap().into()
}

fn assert_closed_form(scene: &CommittedScene, rays: &[Ray], expected: impl Fn(&Ray) -> Option<(f64, u32)>) {
    let mut hits = 0;
    for (ray, found) in rays.iter().zip(hits_in_every_way(scene, rays)) {
        let expected = expected(ray);
        // A ray that grazes, or ends on the surface, may go either way.
        if let (Some(hit), Some((t, primitive))) = (found, expected) {
            hits += 1;
            assert_eq!((hit.primitive, hit.geometry, hit.u, hit.v, hit.ng), (primitive, 0, 0.25, 0.75, [0.0; 3]));
            assert!((f64::from(hit.t) - t).abs() < 1e-5, "{ray:?}: {} {t}", hit.t);
        } else {
            assert_eq!(found.is_some(), expected.is_some(), "{ray:?}: {expected:?}");
        }
    }
    assert!(hits * 10 > rays.len(), "only {hits} hits");
}

fn ten_spheres() -> Arc<Spheres> {
    let mut numbers = Numbers(7);
    let centres: Vec<[f32; 3]> = (0..10).map(|_| numbers.point()).collect();
    Spheres::at_rest(&centres, 0.3)
}

#[test]
fn spheres_agree_with_the_closed_form() {
    for config in CONFIGS {
        let Some(device) = device(config) else { return };
        let spheres = ten_spheres();
        let scene = scene(&device, [shapes(&device, spheres.clone())]);
        assert_closed_form(&scene, &Numbers(8).rays(3000), |ray| spheres.nearest(ray));
    }
}

#[test]
fn spheres_in_instances_agree_with_the_closed_form() {
    for config in CONFIGS {
        let Some(device) = device(config) else { return };
        let spheres = ten_spheres();
        let object = Arc::new(scene(&device, [shapes(&device, spheres.clone())]));
        // Twice the size, mirrored in x, shifted in y.
        let matrix: Affine = [[-2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [0.0, 0.5, 0.0]];
        let (flat, indices) = common::square(-50.0, 1);
        let floor = TriangleGeometry::new(&device, flat, indices).unwrap();
        let placed = scene(&device, [floor.into(), InstanceGeometry::new(&object, &[matrix]).unwrap().into()]);
        let rays = Numbers(9).rays(2000);
        assert_closed_form(&placed, &rays, |ray| {
            let [x, y, z] = ray.origin;
            let [dx, dy, dz] = ray.direction;
            let local = Ray {
                origin: [-0.5 * x, 0.5 * (y - 0.5), 0.5 * z],
                direction: [-0.5 * dx, 0.5 * dy, 0.5 * dz],
                ..*ray
            };
            spheres.nearest(&local)
        });
        let hit = rays.iter().find_map(|ray| placed.intersect1(ray)).unwrap();
        assert_eq!(hit.instance, 1);
        // And beside it, without an instance.
        assert_eq!(rays.iter().find_map(|ray| object.intersect1(ray)).unwrap().instance, MISS);
    }
}

#[test]
fn moving_spheres_agree_with_the_closed_form() {
    for config in CONFIGS {
        let Some(device) = device(config) else { return };
        let mut numbers = Numbers(10);
        let centres = (0..10).map(|_| [numbers.point(), numbers.point()]).collect();
        let spheres = Arc::new(Spheres { centres, radius: 0.3 });
        let scene = scene(&device, [shapes(&device, spheres.clone())]);
        assert_closed_form(&scene, &Numbers(11).rays(3000), |ray| spheres.nearest(ray));
    }
}

/// Spheres whose `occluded` is another function, to see that any-hit queries call it.
struct Ghosts(Arc<Spheres>);

impl UserShapes for Ghosts {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn bounds(&self, primitive: u32, time: f32) -> Option<[[f32; 3]; 2]> {
        self.0.bounds(primitive, time)
    }

    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<UserHit> {
        self.0.intersect(primitive, ray)
    }

    fn occluded(&self, _: u32, _: &Ray) -> bool {
        false
    }
}

#[test]
fn any_hit_queries_ask_occluded() {
    let Some(device) = device("threads=1") else { return };
    let scene = scene(&device, [shapes(&device, Arc::new(Ghosts(ten_spheres())))]);
    let rays = Numbers(8).rays(500);
    assert!(rays.iter().filter(|ray| scene.intersect1(ray).is_some()).count() > 50);
    assert!(rays.iter().all(|ray| !scene.occluded1(ray)));
    assert!(common::Batch::new(&rays).occluded(&scene).iter().all(|&bit| bit == 0));
}

/// Spheres with a fault: bounds of shape 1 are what `bounds` says, shape 2 panics when it is met.
struct Faulty {
    spheres: Arc<Spheres>,
    bounds: fn() -> Option<[[f32; 3]; 2]>,
}

impl UserShapes for Faulty {
    fn len(&self) -> usize {
        self.spheres.len()
    }

    fn bounds(&self, primitive: u32, time: f32) -> Option<[[f32; 3]; 2]> {
        if primitive == 1 { (self.bounds)() } else { self.spheres.bounds(primitive, time) }
    }

    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<UserHit> {
        assert!(primitive != 2, "shape 2 is broken");
        self.spheres.intersect(primitive, ray)
    }
}

fn row_of_spheres() -> Arc<Spheres> {
    Spheres::at_rest(&[[0.0; 3], [3.0, 0.0, 0.0], [6.0, 0.0, 0.0]], 1.0)
}

fn down(x: f32) -> Ray {
    Ray::new([x, 0.0, 5.0], [0.0, 0.0, -1.0])
}

#[test]
fn shapes_with_boxes_that_are_none_are_never_hit() {
    let Some(device) = device("threads=1") else { return };
    let wild: [fn() -> Option<[[f32; 3]; 2]>; 6] = [
        || None,
        || Some([[f32::NAN; 3], [1.0; 3]]),
        || Some([[0.0; 3], [f32::INFINITY; 3]]),
        || Some([[f32::NEG_INFINITY; 3], [0.0; 3]]),
        || Some([[-1.9e19; 3], [1.9e19; 3]]),
        || Some([[1.0; 3], [-1.0; 3]]),
    ];
    for (i, bounds) in wild.into_iter().enumerate() {
        let scene = scene(&device, [shapes(&device, Arc::new(Faulty { spheres: row_of_spheres(), bounds }))]);
        assert_eq!(scene.intersect1(&down(0.0)).map(|hit| hit.t), Some(4.0), "case {i}");
        assert_eq!(scene.intersect1(&down(3.0)), None, "case {i}");
        let bounds = scene.bounds().unwrap();
        assert!(bounds.iter().flatten().all(|x| x.abs() < 10.0), "case {i}: {bounds:?}");
    }
}

#[test]
fn a_panic_in_a_shape_comes_out_of_the_query_and_one_in_bounds_out_of_commit() {
    for config in ["threads=1", "threads=2"] {
        let Some(device) = device(config) else { return };
        let bounds = || Some([[2.0, -1.0, -1.0], [4.0, 1.0, 1.0]]);
        let scene = scene(&device, [shapes(&device, Arc::new(Faulty { spheres: row_of_spheres(), bounds }))]);
        assert!(scene.occluded1(&down(3.0)));
        let queries: [fn(&CommittedScene, Ray) -> bool; 2] =
            [|scene, ray| scene.occluded1(&ray), |scene, ray| scene.intersect1(&ray).is_some()];
        for query in queries {
            let payload = catch_unwind(AssertUnwindSafe(|| query(&scene, down(6.0)))).unwrap_err();
            assert_eq!(payload.downcast_ref::<&str>(), Some(&"shape 2 is broken"));
            assert!(query(&scene, down(0.0)));
        }

        let mut scene = Scene::new(&device, SceneFlags::ROBUST, BuildQuality::Medium).unwrap();
        let bounds = || panic!("no box");
        scene.attach(shapes(&device, Arc::new(Faulty { spheres: row_of_spheres(), bounds }))).unwrap();
        let payload = catch_unwind(AssertUnwindSafe(|| scene.commit())).unwrap_err();
        assert_eq!(payload.downcast_ref::<&str>(), Some(&"no box"));
    }
}

struct Empty(usize);

impl UserShapes for Empty {
    fn len(&self) -> usize {
        self.0
    }

    fn time_steps(&self) -> usize {
        self.0
    }

    fn bounds(&self, _: u32, _: f32) -> Option<[[f32; 3]; 2]> {
        None
    }

    fn intersect(&self, _: u32, _: &Ray) -> Option<UserHit> {
        None
    }
}

#[test]
fn impossible_counts_are_errors_and_no_shape_is_none() {
    let Some(device) = device("threads=1") else { return };
    let error = UserGeometry::new(&device, Arc::new(Empty(0))).unwrap_err();
    assert_eq!(error, Error::NoKeys);
    let error = UserGeometry::new(&device, Arc::new(Empty(130))).unwrap_err();
    assert_eq!(error, Error::TooMany { what: "time keys", count: 130, limit: 129 });
    let error = UserGeometry::new(&device, Arc::new(Empty(u32::MAX as usize))).unwrap_err();
    assert_eq!(error, Error::TooMany { what: "shapes", count: u32::MAX as usize, limit: u32::MAX as usize - 1 });
    let scene = scene(&device, [shapes(&device, Arc::new(Empty(1)))]);
    assert_eq!(scene.bounds(), None);
    assert!(!scene.occluded1(&down(0.0)));
}

#[test]
fn masks_hide_shapes() {
    let Some(device) = device("threads=1") else { return };
    let mut spheres = UserGeometry::new(&device, row_of_spheres()).unwrap();
    spheres.set_mask(2).unwrap();
    assert_eq!(spheres.shapes().len(), 3);
    let scene = scene(&device, [spheres.into()]);
    for (mask, is_hit) in [(1, false), (2, true), (6, true)] {
        let rays = [Ray { mask, ..down(0.0) }; 9];
        assert!(hits_in_every_way(&scene, &rays).iter().all(|hit| hit.is_some() == is_hit), "mask {mask}");
    }
}
