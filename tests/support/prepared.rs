//! Small scenes made ready, and what rays and shading see of them, in f64.
#![allow(dead_code)]

use glam::{DMat4, DVec3};
use prt::accel::{HitBatch, MISS, RayBatch};
use prt::material::Material;
use prt::render::{AccelChoice, Prepared, RenderSettings, prepare};
use prt::scene::{Instance, MaterialId, Scene, SceneBuilder};
use prt::shape::Mesh;
use simd::{Float, Kernel, Lanes, Level, Uint};

/// A mesh of positions and triangles alone.
pub fn mesh(positions: Vec<[f32; 3]>, indices: Vec<[u32; 3]>) -> Mesh {
    Mesh {
        positions,
        normals: None,
        uv_sets: Vec::new(),
        colors: None,
        tangents: None,
        indices,
        material: MaterialId(0),
        name: String::from("mesh"),
    }
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

/// Made ready with our own BVH.
pub fn prepared(scene: &Scene) -> Prepared {
    let settings = RenderSettings { accel: AccelChoice::Bvh, ..RenderSettings::default() };
    prepare(scene, &settings).expect("a small scene")
}

/// A point of a triangle; vectors in the prepared space.
#[derive(Clone, Debug)]
pub struct Seen {
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
    /// Selection pmf over area, 1/m^2.
    pub light_density: f64,
}

/// The points (triangle, u, v), read as shading reads them.
pub fn read(prepared: &Prepared, points: &[(u32, f32, f32)]) -> Vec<Seen> {
    struct Read<'a>(&'a Prepared, &'a [(u32, f32, f32)]);
    impl Kernel for Read<'_> {
        type Output = Vec<Seen>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<Seen> {
            let table = &self.0.tables.triangles;
            let get = |x: L::F| {
                let mut out = [0.0; 16];
                x.store(&mut out, 0);
                f64::from(out[0])
            };
            let vector = |v: prt::math::V3<L>| DVec3::new(get(v.x), get(v.y), get(v.z));
            self.1
                .iter()
                .map(|&(primitive, u, v)| {
                    let triangle = table.get::<L>(L::U::splat(primitive));
                    let at = (u, v);
                    let (u, v) = (L::F::splat(u), L::F::splat(v));
                    let ng = vector(triangle.ng);
                    let normal =
                        table.has_attributes().then(|| vector(table.attributes::<L>(triangle.attributes, u, v).normal));
                    Seen {
                        primitive,
                        u: at.0,
                        v: at.1,
                        point: vector(triangle.point(u, v)),
                        ng,
                        ns: normal.map_or(ng, DVec3::normalize_or_zero),
                        offset: get(triangle.offset_length()),
                        light_density: get(triangle.light_density),
                    }
                })
                .collect()
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
    let points: Vec<_> = hit.iter().map(|&i| (hits.primitive[i], hits.u[i], hits.v[i])).collect();
    let mut seen = vec![None; rays.len()];
    for (i, point) in hit.into_iter().zip(read(prepared, &points)) {
        seen[i] = Some(point);
    }
    seen
}
