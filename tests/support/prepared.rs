//! Small scenes made ready, and what rays and shading see of them, in f64.
#![allow(dead_code)]

use glam::{DMat4, DVec3};
use prt::accel::{HitBatch, MISS, RayBatch};
use prt::material::Material;
use prt::render::{AccelChoice, Choice, Prepared, RenderSettings, prepare_placing};
use prt::scene::{Instance, MaterialId, Scene, SceneBuilder};
use prt::shape::Mesh;
use prt::shape::table::{NONE, interpolate3};
use simd::{Float, Kernel, Lanes, Level, Mask, Uint};

/// A mesh of positions and triangles alone.
pub fn mesh(positions: Vec<[f32; 3]>, indices: Vec<[u32; 3]>) -> Mesh {
    Mesh::plain("mesh", positions, indices, MaterialId(0))
}

/// `mesh` placed by each of `places`.
pub fn scene(mesh: &Mesh, places: &[DMat4]) -> Scene {
    scene_of(mesh, Material::default(), places)
}

/// `mesh` of `material` placed by each of `places`.
pub fn scene_of(mesh: &Mesh, material: Material, places: &[DMat4]) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(material);
    let mesh = builder.add_mesh(Mesh { material, ..mesh.clone() });
    for &world_from_object in places {
        builder.add_instance(Instance { mesh, world_from_object, name: String::from("instance") });
    }
    builder.finish()
}

/// `mesh` placed once.
pub fn one_instance(mesh: &Mesh, place: DMat4) -> Scene {
    scene(mesh, &[place])
}

/// Made ready with our own BVH, everything merged into the world.
pub fn prepared(scene: &Scene) -> Prepared {
    prepared_as(scene, AccelChoice::Bvh, Choice::Never)
}

/// Made ready with a backend, meshes placed or merged as `choice` says.
pub fn prepared_as(scene: &Scene, accel: AccelChoice, choice: Choice) -> Prepared {
    let folder = std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".embree");
    let settings = RenderSettings { accel, embree_dirs: vec![folder], ..RenderSettings::default() };
    prepare_placing(scene, &settings, choice).expect("a small scene")
}

/// The backends that run here.
pub fn backends() -> Vec<AccelChoice> {
    let folder = std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".embree");
    let mut all = vec![AccelChoice::Linear, AccelChoice::Bvh];
    match prt::accel::embree::find(&[folder]) {
        Ok(_) => all.push(AccelChoice::Embree),
        Err(why) => println!("skipped: no Embree library ({why})"),
    }
    all
}

/// A point of a triangle; vectors in the prepared space.
#[derive(Clone, Debug)]
pub struct Seen {
    /// 0 for the world, i + 1 for placement i.
    pub instance: u32,
    pub primitive: u32,
    /// Barycentric weight of the second corner.
    pub u: f32,
    /// Barycentric weight of the third corner.
    pub v: f32,
    pub point: DVec3,
    /// Unit geometric normal.
    pub ng: DVec3,
    /// Shading normal, normalised; `ng` where the mesh has none.
    pub ns: DVec3,
    /// Length of the offset of rays that leave, metres.
    pub offset: f64,
    /// Bound of the point's error along each axis, metres.
    pub bound: DVec3,
    /// Of a point on its light, given that that is chosen, 1/m^2; 0 where it is of none.
    pub light_density: f64,
}

/// The points (triangle of the world, u, v), read as shading reads them.
pub fn read(prepared: &Prepared, points: &[(u32, f32, f32)]) -> Vec<Seen> {
    let points: Vec<_> = points.iter().map(|&(primitive, u, v)| (0, primitive, u, v)).collect();
    read_placed(prepared, &points)
}

/// The points (instance, triangle, u, v), read as shading reads them.
pub fn read_placed(prepared: &Prepared, points: &[(u32, u32, f32, f32)]) -> Vec<Seen> {
    struct Read<'a>(&'a Prepared, &'a [(u32, u32, f32, f32)]);
    impl Kernel for Read<'_> {
        type Output = Vec<Seen>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<Seen> {
            let tables = &self.0.tables;
            let get = |x: L::F| {
                let mut out = [0.0; 16];
                x.store(&mut out, 0);
                f64::from(out[0])
            };
            let vector = |v: prt::math::V3<L>| DVec3::new(get(v.x), get(v.y), get(v.z));
            let one = |&(instance, primitive, u, v): &(u32, u32, f32, f32)| {
                let stored = tables.triangles.get::<L>(L::U::splat(primitive));
                let at = (u, v);
                let (u, v) = (L::F::splat(u), L::F::splat(v));
                let all = L::M::first(L::N);
                let placed = match tables.placements.is_empty() {
                    true => None,
                    false => tables.placements.get::<L>(L::U::splat(instance), L::F::zero(), all),
                };
                let (triangle, p, offset) = stored.placed(&placed, stored.point(u, v));
                let ng = vector(triangle.ng);
                let normal = tables.triangles.has_attributes().then(|| {
                    let a = tables.triangles.attributes::<L>(triangle.attributes, u, v);
                    let [n0, n1, n2] = a.corner_normals;
                    let normal =
                        placed.map_or(a.normal, |by| interpolate3(by.normal(n0), by.normal(n1), by.normal(n2), u, v));
                    vector(normal)
                });
                let corner = |edge: prt::math::V3<L>| vector(stored.v0 + edge).abs();
                let zero = prt::math::V3::zero();
                let extent = corner(zero).max(corner(stored.e1)).max(corner(stored.e2)).max_element();
                let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                let bound =
                    match &placed {
                        Some(placed) => DVec3::from_array(axes.map(|axis| {
                            get(placed.offset_length(L::F::splat(extent as f32), prt::math::V3::splat(axis)))
                        })),
                        None => DVec3::splat(get(offset)),
                    };
                let is_light = !triangle.light.eq(L::U::splat(NONE));
                let density = if is_light.any() {
                    // Seen from 1 m straight above it.
                    let one = L::F::splat(1.0);
                    get(tables.lights.density::<L>(triangle.light, p, triangle.ng, one, one))
                } else {
                    0.0
                };
                Seen {
                    instance,
                    primitive,
                    u: at.0,
                    v: at.1,
                    point: vector(p),
                    ng,
                    ns: normal.map_or(ng, DVec3::normalize_or_zero),
                    offset: get(offset),
                    bound,
                    light_density: density,
                }
            };
            self.1.iter().map(one).collect()
        }
    }
    simd::dispatch(Level::Scalar, Read(prepared, points))
}

/// What rays (origin, direction; world space) hit first.
pub fn trace(prepared: &Prepared, rays: &[(DVec3, DVec3)]) -> Vec<Option<Seen>> {
    let mut batch = RayBatch::new(rays.len());
    for (i, (origin, direction)) in rays.iter().enumerate() {
        batch.set(i, (*origin - prepared.origin).as_vec3(), direction.as_vec3(), f32::INFINITY);
    }
    let mut hits = HitBatch::new(rays.len());
    prepared.accel.intersect(&batch, 0..rays.len(), false, &mut hits);
    let hit: Vec<usize> = (0..rays.len()).filter(|&i| hits.primitive[i] != MISS).collect();
    let points: Vec<_> = hit.iter().map(|&i| (hits.instance[i], hits.primitive[i], hits.u[i], hits.v[i])).collect();
    let mut seen = vec![None; rays.len()];
    for (i, point) in hit.into_iter().zip(read_placed(prepared, &points)) {
        seen[i] = Some(point);
    }
    seen
}
