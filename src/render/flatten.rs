//! Meshes to triangles where they are placed: what rays hit of them, what shading reads, and which of them are lights.

use super::boxes::is_usable;
use super::default_light::SurfaceTotals;
use super::emission::mean_emissions;
use super::opacity::Opacities;
use crate::accel::geometry::{Object, Part};
use crate::light::element::LampTriangle;
use crate::light::parts::connected;
use crate::light::prepared::{LampShape, PreparedLight};
use crate::math::MAX_UV_SETS;
use crate::scene::{Pose, Scene};
use crate::shape::Mesh;
use crate::shape::moving::{KeyedTriangle, MovingTriangles};
use crate::shape::placement::{cofactor, scaled};
use crate::shape::table::{Corners, NONE, TriangleTable};
use glam::{DMat3, DMat4, DVec3, Vec3};

/// Triangles of less area are not sampled as lights, m^2: the density of a point on them, 1 / area at most, would leave
/// the range of f32. Paths still find what they emit.
const LEAST_SAMPLED_AREA: f64 = f32::MIN_POSITIVE as f64;

/// What is counted while instances are flattened.
#[derive(Default)]
pub(super) struct Totals {
    /// Triangles left out because flattening made them unusable.
    pub without_area: usize,
    pub surface: SurfaceTotals,
    /// Their vertex normals all pointed to the back, and were turned round.
    pub turned_normals: usize,
    /// Triangles that are not finite or too far away for every backend.
    pub too_far: usize,
}

/// Triangles of the world or of an object: those that stop every ray, and those whose hits are to be asked about.
pub(super) struct Parts {
    opaque: Part,
    filtered: Part,
}

impl Parts {
    /// None yet, of things that have `keys` keys: 1 at rest.
    pub fn new(keys: usize) -> Self {
        let part = |filtered| Part { later: vec![Vec::new(); keys - 1], filtered, ..Part::default() };
        Self { opaque: part(false), filtered: part(true) }
    }

    /// What backends are built from: these and `others`.
    pub fn object(self, others: Option<Self>) -> Object {
        let all = std::iter::once(self).chain(others).flat_map(|parts| [parts.opaque, parts.filtered]);
        Object { parts: all.filter(|part| !part.triangles.indices.is_empty()).collect(), shapes: Vec::new() }
    }

    /// Where triangles go that let some rays pass, or none.
    fn of(&mut self, lets_rays_pass: bool) -> &mut Part {
        if lets_rays_pass { &mut self.filtered } else { &mut self.opaque }
    }
}

/// How vertices are carried to the prepared space, whose origin is at `origin` in world space.
struct Map {
    world_from_object: DMat4,
    origin: DVec3,
    /// Over its largest element.
    linear: DMat3,
    /// Carries normals: by cofactors, without division, so nearly singular transforms stay finite.
    normal_from_object: DMat3,
    /// A mirroring transform turns the winding; the corners are swapped back so that the front stays the front.
    mirrors: bool,
}

impl Map {
    fn new(world_from_object: &DMat4, origin: DVec3) -> Self {
        let linear = scaled(DMat3::from_mat4(*world_from_object));
        let mirrors = linear.determinant() < 0.0;
        let normal_from_object = cofactor(linear) * if mirrors { -1.0 } else { 1.0 };
        Self { world_from_object: *world_from_object, origin, linear, normal_from_object, mirrors }
    }

    /// In f64, rounded once.
    fn point(&self, p: [f32; 3]) -> [f32; 3] {
        (self.world_from_object.transform_point3(Vec3::from(p).as_dvec3()) - self.origin).as_vec3().to_array()
    }

    /// Unit, or null.
    fn normal(&self, n: [f32; 3]) -> Vec3 {
        (self.normal_from_object * Vec3::from(n).as_dvec3()).normalize_or_zero().as_vec3()
    }

    /// Unit, or null; with the handedness of what may have `turned` its normal: the bitangent stays.
    fn tangent(&self, [x, y, z, w]: [f32; 4], turned: bool) -> [f32; 4] {
        let t = (self.linear * Vec3::new(x, y, z).as_dvec3()).normalize_or_zero().as_vec3();
        [t.x, t.y, t.z, if self.mirrors != turned { -w } else { w }]
    }
}

/// A mesh at a later time of the shutter.
pub(super) struct Later<'a> {
    pub world_from_object: DMat4,
    /// Its vertices, where it changes its form.
    pub pose: Option<&'a Pose>,
}

/// The vertices of [`Later`] in the prepared space.
struct Moved {
    positions: Vec<[f32; 3]>,
    normals: Option<Vec<Vec3>>,
    tangents: Option<Vec<[f32; 4]>>,
}

impl Moved {
    /// `mirrors`: as when the shutter opens.
    fn new(mesh: &Mesh, later: &Later<'_>, origin: DVec3, mirrors: bool) -> Self {
        let map = Map { mirrors, ..Map::new(&later.world_from_object, origin) };
        // Each attribute that the mesh has and the pose lacks is the mesh's.
        let pose = later.pose;
        let positions = pose.map_or(&mesh.positions, |pose| &pose.positions);
        let normals = pose.and_then(|pose| pose.normals.as_ref()).or(mesh.normals.as_ref());
        let tangents = pose.and_then(|pose| pose.tangents.as_ref()).or(mesh.tangents.as_ref());
        Self {
            positions: positions.iter().map(|&p| map.point(p)).collect(),
            normals: mesh.normals.as_ref().and(normals).map(|n| n.iter().map(|&n| map.normal(n)).collect()),
            tangents: mesh.tangents.as_ref().and(tangents).map(|t| t.iter().map(|&t| map.tangent(t, false)).collect()),
        }
    }

    fn corners(&self, vertices: [u32; 3]) -> [Vec3; 3] {
        vertices.map(|v| Vec3::from(self.positions[v as usize]))
    }
}

/// Meshes of a scene becoming triangles.
pub(super) struct Flattener<'a> {
    scene: &'a Scene,
    /// Of each material, see [`mean_emissions`].
    pub emissions: Vec<[f64; 3]>,
    /// Which of them let rays pass.
    pub opacities: Opacities,
    /// What shading reads of the triangles so far.
    pub table: TriangleTable,
    pub totals: Totals,
}

impl<'a> Flattener<'a> {
    /// Of about `count` triangles.
    pub fn new(scene: &'a Scene, count: usize) -> Self {
        Self {
            scene,
            emissions: mean_emissions(scene),
            opacities: Opacities::new(scene),
            table: TriangleTable::with_capacity(count),
            totals: Totals::default(),
        }
    }

    /// Says that triangles with `keys` keys follow, and no others until all of them are there.
    pub fn begin_moving(&mut self, keys: usize, has_normals: bool, has_tangents: bool) {
        self.table.moving = MovingTriangles::new(self.table.len() as u32, keys, has_normals, has_tangents);
    }

    /// Appends a mesh where `world_from_object` puts it, seen from `origin`; vertices are transformed in f64 and rounded
    /// once. `later` has it at the later times of its `parts`. Without `lights` it is an object's own: it gives no light
    /// and does not count as surface.
    pub fn add(
        &mut self,
        mesh: &Mesh,
        world_from_object: &DMat4,
        later: &[Later<'_>],
        origin: DVec3,
        parts: &mut Parts,
        lights: Option<&mut Vec<PreparedLight>>,
    ) {
        let Self { scene, emissions, opacities, table, totals } = self;
        let material = scene.materials.get(mesh.material.index());
        let map = Map::new(world_from_object, origin);
        let mirrors = map.mirrors;
        let later: Vec<Moved> = later.iter().map(|later| Moved::new(mesh, later, origin, mirrors)).collect();
        let lets_rays_pass = opacities.let_rays_pass(scene, mesh);
        let part = parts.of(lets_rays_pass);
        let triangles = &mut part.triangles;
        let first = triangles.positions.len() as u32;
        triangles.positions.extend(mesh.positions.iter().map(|&p| map.point(p)));
        for (positions, moved) in part.later.iter_mut().zip(&later) {
            positions.extend_from_slice(&moved.positions);
        }
        // Once a vertex, not once a corner: a vertex is in six triangles on average.
        let vertex_normals: Option<Vec<Vec3>> =
            mesh.normals.as_ref().map(|normals| normals.iter().map(|&n| map.normal(n)).collect());
        let emission = emissions.get(mesh.material.index()).copied().unwrap_or_default();
        // Mean over channels: what light may be expected of it.
        let average = emission.iter().sum::<f64>() / 3.0;
        let mut lamps = Vec::new();
        let mut mesh_area = 0.0;
        let needs_attributes = mesh.normals.is_some() || !mesh.uv_sets.is_empty() || mesh.colors.is_some();
        for &[i, j, k] in &mesh.indices {
            let vertices = if mirrors { [i, k, j] } else { [i, j, k] };
            let corners = vertices.map(|v| Vec3::from(triangles.positions[(first + v) as usize]));
            let is_far = |corners: [Vec3; 3]| !corners.iter().all(|c| is_usable(&c.as_dvec3()));
            if is_far(corners) || later.iter().any(|moved| is_far(moved.corners(vertices))) {
                totals.too_far += 1;
                continue;
            }
            let mut cross = doubled_area(corners);
            let area = 0.5 * cross.length();
            if area == 0.0 {
                // What moves may have one later.
                let other = later.iter().map(|moved| doubled_area(moved.corners(vertices))).find(|c| c.length() > 0.0);
                let Some(other) = other else {
                    totals.without_area += 1;
                    continue;
                };
                cross = other;
            }
            mesh_area += area;
            // + 0 turns -0 into 0, here and below: the frame about a normal depends on the sign.
            let ng = (cross / cross.length()).as_vec3() + Vec3::ZERO;
            let mut normals = vertex_normals.as_ref().map(|n| vertices.map(|v| n[v as usize]));
            // As pbrt does: normals against the winding would light the triangle from behind.
            let turns = normals.is_some_and(|n| n.iter().all(|n| n.dot(ng) < 0.0));
            if turns {
                totals.turned_normals += 1;
                normals = normals.map(|n| n.map(|n| -n));
            }
            let normals = normals.map(|n| n.map(|n| n + Vec3::ZERO));
            let attributes = if needs_attributes { push_attributes(mesh, vertices, normals, table) } else { NONE };
            let tangents = mesh.tangents.as_ref().map(|t| vertices.map(|v| map.tangent(t[v as usize], turns)));
            if !later.is_empty() {
                let key = |moved: &Moved| {
                    let side = if turns { -1.0 } else { 1.0 };
                    let normals = moved.normals.as_ref().map(|n| vertices.map(|v| n[v as usize] * side));
                    let handed = |[x, y, z, w]: [f32; 4]| [x, y, z, w * side];
                    let tangents = moved.tangents.as_ref().map(|t| vertices.map(|v| handed(t[v as usize])));
                    KeyedTriangle { corners: moved.corners(vertices), normals, tangents }
                };
                let keys = std::iter::once(KeyedTriangle { corners, normals, tangents }).chain(later.iter().map(key));
                table.moving.push(&keys.collect::<Vec<_>>());
            }
            let tangents = tangents.map_or(NONE, |t| table.push_tangents(t));
            let primitive = table.len() as u32;
            part.primitives.push(triangles.indices.len(), primitive);
            triangles.indices.push(vertices.map(|v| first + v));
            table.push(corners, ng, mesh.material.0, attributes, tangents);
            if lights.is_some() && average > 0.0 && area > LEAST_SAMPLED_AREA {
                lamps.push(LampTriangle { corners, ng, area, primitive, attributes });
            }
        }
        if let Some(lights) = lights {
            let both_sides = material.is_some_and(|m| m.double_sided);
            for triangles in connected(lamps) {
                let material = mesh.material.0;
                // What is there in part only would have to be asked about twice, and what moves is known by its triangles.
                let shape = match later.is_empty() {
                    true => LampShape::of(&triangles, !lets_rays_pass),
                    false => LampShape::Triangles,
                };
                lights.push(PreparedLight::Mesh { triangles, radiance: average, both_sides, material, shape });
            }
            totals.surface.add(mesh_area, material, emission);
        }
    }
}

/// Normal of the front times twice the area; in f64: the f32 product of edges below 3e-10 underflows.
fn doubled_area(corners: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|c| c.as_dvec3());
    (b - a).cross(c - a)
}

/// Attributes of a triangle's corners.
fn push_attributes(mesh: &Mesh, corners: [u32; 3], normals: Option<[Vec3; 3]>, table: &mut TriangleTable) -> u32 {
    let mut uvs = [[[0.0; 2]; 3]; MAX_UV_SETS];
    let sets = mesh.uv_sets.len();
    for (uv, set) in uvs.iter_mut().zip(&mesh.uv_sets) {
        *uv = corners.map(|v| set[v as usize]);
    }
    let colors = mesh.colors.as_ref().map(|c| corners.map(|v| c[v as usize]));
    table.push_attributes(&Corners { normals, uvs: &uvs[..sets], colors })
}
