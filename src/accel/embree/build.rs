//! Embree scenes out of our geometry: one of the world, one of each object, all on one device.

use super::super::geometry::{
    self, Affine, AtShape, Geometry, HitFilter, Object, Part, Placement, Primitives, Shape, ShapeRay,
};
use super::numbers::{Group, Groups, Numbers};
use embree4_rs::{
    BuildQuality, Candidate, CommittedScene, Device, Error, Filter, InstanceArrayGeometry, InstanceGeometry, Library,
    Ray, Scene, SceneFlags, TriangleGeometry, UserGeometry, UserHit, UserShapes,
};
use glam::Vec3;
use std::sync::Arc;

/// What is built.
pub(super) struct Built {
    pub(super) scene: CommittedScene,
    pub(super) numbers: Numbers,
    /// Whether rays must tell their times.
    pub(super) moves: bool,
    /// Whether rays must tell their keys.
    pub(super) is_filtered: bool,
}

/// Builds with `library`.
pub(super) fn build(geometry: Geometry, library: &Arc<Library>) -> Result<Built, Error> {
    // A constant thread setting: the tree, and so which of two equally near triangles is found, must not depend on
    // `--threads`.
    let device = Device::new(library, "threads=1")?;
    let Geometry { world, objects, placements, filter } = geometry;
    let parts = || objects.iter().chain([&world]).flat_map(|object| &object.parts);
    let moves = parts().any(|part| !part.later.is_empty()) || placements.iter().any(Placement::moves);
    let shapes = || objects.iter().chain([&world]).flat_map(|object| &object.shapes);
    let is_filtered = parts().any(|part| part.filtered) || shapes().any(|(shape, _)| shape.is_filtered());
    let is_filtered = filter.is_some() && is_filtered;
    // Shapes may move in ways of their own.
    let moves = moves || shapes().next().is_some();

    let first = world.parts.len() + usize::from(!world.shapes.is_empty());
    let arrays = !placements.is_empty() && has_arrays(&device);
    let groups = Arc::new(Groups::new(&placements, first as u32, arrays));
    let filter = filter.map(|filter| (filter, Arc::clone(&groups)));
    let (mut scenes, mut numbers) = (Vec::new(), Vec::new());
    for object in objects {
        let mut scene = scene(&device)?;
        numbers.push(attach(&device, &mut scene, object, &filter)?);
        scenes.push(Arc::new(scene.commit()?));
    }
    let mut scene = scene(&device)?;
    let of_world = attach(&device, &mut scene, world, &filter)?;
    for group in &groups.all {
        place(&mut scene, &scenes[group.object], group, &placements)?;
    }
    drop(placements);
    let numbers = Numbers { world: of_world, objects: numbers, groups };
    Ok(Built { scene: scene.commit()?, numbers, moves, is_filtered })
}

fn scene(device: &Arc<Device>) -> Result<Scene, Error> {
    Scene::new(device, SceneFlags::ROBUST, BuildQuality::Medium)
}

/// Whether the library has instance arrays: some are built without, and none before 4.3 has them.
fn has_arrays(device: &Arc<Device>) -> bool {
    let one = || {
        let object = Arc::new(scene(device)?.commit()?);
        InstanceArrayGeometry::new(&object, vec![vec![matrix(&Affine::IDENTITY)]])
    };
    one().is_ok()
}

/// Attaches parts and shapes, a geometry each; the numbers of their primitives.
fn attach(
    device: &Arc<Device>,
    scene: &mut Scene,
    object: Object,
    filter: &Option<(Arc<dyn HitFilter>, Arc<Groups>)>,
) -> Result<Vec<Arc<Primitives>>, Error> {
    let mut numbers = Vec::new();
    for Part { triangles, later, primitives, filtered } in object.parts {
        let primitives = Arc::new(primitives);
        let keys = std::iter::once(triangles.positions).chain(later).collect();
        let mut mesh = TriangleGeometry::moving(device, keys, triangles.indices)?;
        match filter {
            Some((filter, groups)) if filtered => {
                let (filter, groups) = (Arc::clone(filter), Arc::clone(groups));
                mesh.set_filter(Arc::new(PartFilter { filter, groups, primitives: Arc::clone(&primitives) }))?;
            }
            // Without a filter nothing stops there.
            None if filtered => mesh.set_mask(0)?,
            _ => {}
        }
        scene.attach(mesh)?;
        numbers.push(primitives);
    }
    if !object.shapes.is_empty() {
        let primitives = object.shapes.iter().map(|(_, primitive)| *primitive).collect();
        let filter = filter.as_ref().map(|(filter, _)| Arc::clone(filter));
        let list = ShapeList { shapes: object.shapes, filter };
        scene.attach(UserGeometry::new(device, Arc::new(list))?)?;
        numbers.push(Arc::new(Primitives::Each(primitives)));
    }
    Ok(numbers)
}

fn matrix(map: &Affine) -> embree4_rs::Affine {
    let [x, y, z] = map.columns.map(|c| c.to_array());
    [x, y, z, map.translation.to_array()]
}

/// Attaches the instances of a group as one geometry.
fn place(scene: &mut Scene, object: &Arc<CommittedScene>, group: &Group, all: &[Placement]) -> Result<(), Error> {
    if let [only] = group.placements[..] {
        let keys: Vec<_> = all[only as usize].keys.iter().map(matrix).collect();
        return scene.attach(InstanceGeometry::new(object, &keys)?).map(|_| ());
    }
    let key = |k: usize| {
        // Room for one more, which Embree wants behind the last.
        let mut matrices = Vec::with_capacity(group.placements.len() + 1);
        matrices.extend(group.placements.iter().map(|&i| matrix(&all[i as usize].keys[k])));
        matrices
    };
    let keys = (0..group.keys).map(key).collect();
    scene.attach(InstanceArrayGeometry::new(object, keys)?).map(|_| ())
}

/// The geometry's filter on one part.
struct PartFilter {
    filter: Arc<dyn HitFilter>,
    groups: Arc<Groups>,
    primitives: Arc<Primitives>,
}

impl Filter for PartFilter {
    fn accept(&self, candidate: &Candidate) -> bool {
        let &Candidate { ray_id: key, primitive, instance, instance_primitive, u, v, .. } = candidate;
        let instance = self.groups.instance(instance, instance_primitive);
        let primitive = self.primitives.get(primitive as usize);
        self.filter.stops(&geometry::Candidate { key, instance, primitive, u, v })
    }
}

/// The shapes of an object, with their numbers. Those that are filtered are the world's.
struct ShapeList {
    shapes: Vec<(Arc<dyn Shape>, u32)>,
    filter: Option<Arc<dyn HitFilter>>,
}

impl ShapeList {
    #[inline(always)]
    fn at(&self, primitive: u32, ray: &Ray) -> AtShape<'_> {
        let (shape, primitive) = &self.shapes[primitive as usize];
        AtShape { shape: &**shape, primitive: *primitive, instance: 0, key: ray.id, filter: self.filter.as_deref() }
    }
}

impl UserShapes for ShapeList {
    fn len(&self) -> usize {
        self.shapes.len()
    }

    fn bounds(&self, primitive: u32, _time: f32) -> Option<[[f32; 3]; 2]> {
        Some(self.shapes[primitive as usize].0.bounds())
    }

    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<UserHit> {
        let hit = self.at(primitive, ray).intersect(&shape_ray(ray))?;
        Some(UserHit { t: hit.t, u: hit.u, v: hit.v })
    }

    fn occluded(&self, primitive: u32, ray: &Ray) -> bool {
        self.at(primitive, ray).occludes(&shape_ray(ray))
    }
}

fn shape_ray(ray: &Ray) -> ShapeRay {
    let (origin, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
    // Embree counts hits at the end.
    ShapeRay { origin, direction, t_max: ray.t_max.next_up(), time: ray.time }
}
