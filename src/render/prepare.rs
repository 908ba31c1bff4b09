//! The seam: a scene's description becomes machinery. Everything conditional is decided here, once.

use super::default_light::{DefaultLightReport, SurfaceTotals};
use super::emission::mean_emissions;
use super::{AccelChoice, AccelReport, RenderSettings};
use crate::accel::embree::{self, EmbreeAccel};
use crate::accel::front::{Front, Split};
use crate::accel::geometry::Geometry;
use crate::accel::{Accel, AccelStats, Triangles, linear::Linear, wide::WideBvh};
use crate::error::RenderError;
use crate::integrator::SceneTables;
use crate::light::environment::EnvironmentTable;
use crate::light::table::{LightTable, PreparedLight};
use crate::light::{Light, studio};
use crate::material::table::MaterialTable;
use crate::math::MAX_UV_SETS;
use crate::scene::{Instance, MAX_COORDINATE, Scene};
use crate::shape::Mesh;
use crate::shape::table::{Corners, NONE, TriangleTable};
use crate::texture::lookup::TextureTable;
use glam::{DMat3, DVec3};

/// A scene made ready to be traced.
pub struct Prepared {
    /// What shading reads.
    pub tables: SceneTables,
    /// What rays hit.
    pub accel: Box<dyn Accel>,
    /// Which backend and why.
    pub accel_report: AccelReport,
    /// World position of the prepared space's origin: the centre of the scene's bounds, so that f32 serves scenes far
    /// from the world's origin as well.
    pub origin: DVec3,
    /// Bounds in world space; `None` without triangles.
    pub bounds: Option<(DVec3, DVec3)>,
    /// Whether the built-in studio lights the scene, and why.
    pub default_light: DefaultLightReport,
    /// Said to the user.
    pub warnings: Vec<String>,
    /// Those of `warnings` that mean that something of the scene is not in the picture.
    pub losses: Vec<String>,
}

/// What is counted while instances are flattened.
#[derive(Default)]
struct Totals {
    /// Triangles left out because flattening made them unusable.
    without_area: usize,
    surface: SurfaceTotals,
    /// Their vertex normals all pointed to the back, and were turned round.
    turned_normals: usize,
    /// Triangles that are not finite or too far away for every backend.
    too_far: usize,
}

/// Triangles of less area are not sampled as lights, m^2: the density of a point on them, 1 / area at most, would leave
/// the range of f32. Paths still find what they emit.
const LEAST_SAMPLED_AREA: f64 = f32::MIN_POSITIVE as f64;

/// Prepares `scene`.
///
/// # Errors
/// The backend is not to be had, or the scene does not fit index types.
pub fn prepare(scene: &Scene, settings: &RenderSettings) -> Result<Prepared, RenderError> {
    prepare_with(scene, settings, |geometry| build_accel(geometry, settings))
}

/// What rays can hit of `scene`, as [`prepare`] gives it to a backend, without building one.
///
/// # Errors
/// The scene does not fit index types.
pub fn geometry(scene: &Scene, settings: &RenderSettings) -> Result<Geometry, RenderError> {
    let mut kept = Geometry::default();
    prepare_with(scene, settings, |geometry| {
        kept = geometry;
        let nothing: Box<dyn Accel> = Box::new(Linear::new(Geometry::default()));
        let report = report(&*nothing, "linear", String::new());
        Ok((nothing, report))
    })?;
    Ok(kept)
}

/// [`prepare`] with a backend built by `build`.
fn prepare_with(
    scene: &Scene,
    settings: &RenderSettings,
    build: impl FnOnce(Geometry) -> Result<(Box<dyn Accel>, AccelReport), RenderError>,
) -> Result<Prepared, RenderError> {
    let count = scene.triangle_count();
    // Records are gathered by signed 32-bit indices, four a triangle.
    if count > (i32::MAX / 4) as usize {
        return Err(RenderError::TooLarge(format!("{count} triangles; at most {}", i32::MAX / 4)));
    }
    let bounds = bounds(scene);
    let origin = bounds.map_or(DVec3::ZERO, |(low, high)| 0.5 * (low + high));
    let mut textures = TextureTable::new(&scene.textures, &scene.images)?;
    let materials = MaterialTable::new(&scene.materials, &mut textures);
    let mut triangles = TriangleTable::with_capacity(count);
    let mut geometry = Triangles::default();
    let mut lights = Vec::new();
    let emissions = mean_emissions(scene);
    let mut totals = Totals::default();
    for instance in &scene.instances {
        flatten(scene, instance, origin, &emissions, &mut geometry, &mut triangles, &mut lights, &mut totals);
    }
    let (mut warnings, mut losses) = (Vec::new(), Vec::new());
    if totals.without_area > 0 {
        warnings.push(format!("{} triangles have no area once placed and were dropped", totals.without_area));
    }
    if totals.turned_normals > 0 {
        warnings.push(format!(
            "{} triangles have vertex normals that point to their back; they were turned to the front, which is \
             counter-clockwise",
            totals.turned_normals
        ));
    }
    if totals.too_far > 0 {
        let count = totals.too_far;
        losses.push(format!("{count} triangles are not finite or beyond 1.844e18 once placed and were dropped"));
    }
    warnings.extend(losses.iter().cloned());
    let radius = bounds.map_or(0.0, |(low, high)| 0.5 * (high - low).length());
    punctual(scene, origin, radius, &mut lights);
    let default_light = DefaultLightReport::decide(settings.default_light, scene, totals.surface.emitted());
    let environment = environment(scene, default_light.used, radius, &lights);
    if lights.is_empty() && environment.is_none() {
        warnings.push(default_light.darkness(scene));
    }
    let lights = LightTable::new(&lights, environment, &mut triangles);
    let (accel, accel_report) = build(geometry.into())?;
    let tables = SceneTables { triangles, materials, textures, lights };
    Ok(Prepared { tables, accel, accel_report, origin, bounds, default_light, warnings, losses })
}

/// Most that the environment takes of the light samples where there are other lights: scattered rays find it by
/// themselves, other lights need the samples.
const ENVIRONMENT_SHARE: f64 = 0.5;

/// The environment with the weight of its choice: its power through the scene's bounding sphere, limited.
fn environment(
    scene: &Scene,
    studio: bool,
    radius: f64,
    others: &[(PreparedLight, f64)],
) -> Option<(EnvironmentTable, f64)> {
    let own = scene.environment.as_ref().and_then(EnvironmentTable::new);
    let table = own.or_else(|| studio.then(studio::environment).as_ref().and_then(EnvironmentTable::new))?;
    let power = 4.0 * (std::f64::consts::PI * radius).powi(2) * table.mean_radiance();
    let others: f64 = others.iter().map(|l| l.1).sum();
    let most = others * ENVIRONMENT_SHARE / (1.0 - ENVIRONMENT_SHARE);
    // Alone it is certain, whatever its power; a scene of a single point has no sphere.
    let weight = if others > 0.0 { power.min(most) } else { 1.0 };
    Some((table, weight))
}

/// World bounds of everything placed.
fn bounds(scene: &Scene) -> Option<(DVec3, DVec3)> {
    let mut bounds: Option<(DVec3, DVec3)> = None;
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh.index()];
        // Only vertices that a triangle uses, and only triangles that are kept: one that flies off to 1e30 m would leave
        // the others no digits.
        for triangle in &mesh.indices {
            let place = |i: u32| glam::Vec3::from(mesh.positions[i as usize]).as_dvec3();
            let corners = triangle.map(|i| instance.world_from_object.transform_point3(place(i)));
            if !corners.iter().all(is_usable) {
                continue;
            }
            for p in corners {
                let (low, high) = bounds.get_or_insert((p, p));
                (*low, *high) = (low.min(p), high.max(p));
            }
        }
    }
    bounds
}

/// Whether every backend takes a triangle with the corner `p`; placing it may have moved it out of range.
fn is_usable(p: &DVec3) -> bool {
    p.to_array().iter().all(|c| c.abs() <= f64::from(MAX_COORDINATE))
}

/// Appends one instance in world space, recentred, vertices transformed in f64 and rounded once.
#[expect(clippy::too_many_arguments, reason = "what is read, then the four tables that grow")]
fn flatten(
    scene: &Scene,
    instance: &Instance,
    origin: DVec3,
    emissions: &[[f64; 3]],
    geometry: &mut Triangles,
    table: &mut TriangleTable,
    lights: &mut Vec<(PreparedLight, f64)>,
    totals: &mut Totals,
) {
    let mesh = &scene.meshes[instance.mesh.index()];
    let material = scene.materials.get(mesh.material.index());
    let linear = scaled(DMat3::from_mat4(instance.world_from_object));
    // Normals go by the cofactor matrix: no division, so nearly singular transforms stay finite. A mirroring transform
    // (negative determinant) turns the winding; the corners are swapped back so that the front stays the front.
    let mirrors = linear.determinant() < 0.0;
    let normal_from_object = cofactor(linear) * if mirrors { -1.0 } else { 1.0 };
    let first = geometry.positions.len() as u32;
    geometry.positions.extend(mesh.positions.iter().map(|&p| {
        let p = instance.world_from_object.transform_point3(glam::Vec3::from(p).as_dvec3());
        (p - origin).as_vec3().to_array()
    }));
    // Once a vertex, not once a corner: a vertex is in six triangles on average.
    let vertex_normals: Option<Vec<glam::Vec3>> = mesh.normals.as_ref().map(|normals| {
        let world = |&n: &[f32; 3]| (normal_from_object * glam::Vec3::from(n).as_dvec3()).normalize_or_zero().as_vec3();
        normals.iter().map(world).collect()
    });
    let emission = emissions.get(mesh.material.index()).copied().unwrap_or_default();
    // Mean over channels: what its share of the light samples follows.
    let average = emission.iter().sum::<f64>() / 3.0;
    let sides = if material.is_some_and(|m| m.double_sided) { 2.0 } else { 1.0 };
    let mut mesh_area = 0.0;
    let needs_attributes = mesh.normals.is_some() || !mesh.uv_sets.is_empty() || mesh.colors.is_some();
    for &[i, j, k] in &mesh.indices {
        let [j, k] = if mirrors { [k, j] } else { [j, k] };
        let corner = |v: u32| glam::Vec3::from(geometry.positions[(first + v) as usize]);
        let corners = [corner(i), corner(j), corner(k)];
        // In f64: the f32 product of edges below 3e-10 underflows.
        let edges = corners.map(|c| c.as_dvec3());
        if !edges.iter().all(is_usable) {
            totals.too_far += 1;
            continue;
        }
        let cross = (edges[1] - edges[0]).cross(edges[2] - edges[0]);
        let area = 0.5 * cross.length();
        if area == 0.0 {
            totals.without_area += 1;
            continue;
        }
        mesh_area += area;
        // + 0 turns -0 into 0, here and below: the frame about a normal depends on the sign.
        let ng = (cross / (2.0 * area)).as_vec3() + glam::Vec3::ZERO;
        let mut normals = vertex_normals.as_ref().map(|n| [i, j, k].map(|v| n[v as usize]));
        // As pbrt does: normals against the winding would light the triangle from behind.
        let turns = normals.is_some_and(|n| n.iter().all(|n| n.dot(ng) < 0.0));
        if turns {
            totals.turned_normals += 1;
            normals = normals.map(|n| n.map(|n| -n));
        }
        let normals = normals.map(|n| n.map(|n| n + glam::Vec3::ZERO));
        let attributes = if needs_attributes { push_attributes(mesh, [i, j, k], normals, table) } else { NONE };
        let tangents = mesh.tangents.as_ref().map_or(NONE, |t| {
            table.push_tangents([i, j, k].map(|v| {
                let [x, y, z, w] = t[v as usize];
                let t = (linear * DVec3::new(f64::from(x), f64::from(y), f64::from(z))).normalize_or_zero().as_vec3();
                // The bitangent stays when the normal turns.
                [t.x, t.y, t.z, if mirrors != turns { -w } else { w }]
            }))
        });
        let primitive = geometry.indices.len() as u32;
        geometry.indices.push([i, j, k].map(|v| first + v));
        table.push(corners, ng, mesh.material.0, attributes, tangents);
        if average > 0.0 && area > LEAST_SAMPLED_AREA {
            let power = average * area * sides * std::f64::consts::PI;
            let light = PreparedLight::Triangle { corners, ng, area, primitive, material: mesh.material.0, attributes };
            lights.push((light, power));
        }
    }
    totals.surface.add(mesh_area, material, emission);
}

/// Attributes of a triangle's corners.
fn push_attributes(mesh: &Mesh, corners: [u32; 3], normals: Option<[glam::Vec3; 3]>, table: &mut TriangleTable) -> u32 {
    let mut uvs = [[[0.0; 2]; 3]; MAX_UV_SETS];
    let sets = mesh.uv_sets.len();
    for (uv, set) in uvs.iter_mut().zip(&mesh.uv_sets) {
        *uv = corners.map(|v| set[v as usize]);
    }
    let colors = mesh.colors.as_ref().map(|c| corners.map(|v| c[v as usize]));
    table.push_attributes(&Corners { normals, uvs: &uvs[..sets], colors })
}

/// `m` over its largest element: directions stay, and products of three elements stay in range whatever the scale.
fn scaled(m: DMat3) -> DMat3 {
    let largest = m.to_cols_array().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if largest == 0.0 { m } else { DMat3::from_cols_array(&m.to_cols_array().map(|x| x / largest)) }
}

/// Matrix of cofactors: the inverse transpose times the determinant.
pub(super) fn cofactor(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

/// Adds the punctual lights that shine at all.
fn punctual(scene: &Scene, origin: DVec3, radius: f64, lights: &mut Vec<(PreparedLight, f64)>) {
    use std::f64::consts::PI;
    for placed in &scene.lights {
        let place = placed.world_from_light.w_axis.truncate() - origin;
        let axis = -placed.world_from_light.z_axis.truncate().normalize();
        let mean = |c: [f32; 3]| c.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0;
        let position = place.as_vec3();
        let (light, power) = match placed.light {
            Light::Point { intensity } => {
                (PreparedLight::Point { position, intensity, cone: None }, 4.0 * PI * mean(intensity))
            }
            Light::Spot { intensity, inner_cone, outer_cone } => {
                let (inner, outer) = (f64::from(inner_cone).cos(), f64::from(outer_cone).cos());
                let cone = Some((axis.as_vec3(), inner as f32, outer as f32));
                let solid_angle = 2.0 * PI * (1.0 - 0.5 * (inner + outer));
                (PreparedLight::Point { position, intensity, cone }, solid_angle * mean(intensity))
            }
            Light::Directional { illuminance } => (
                PreparedLight::Directional { towards: (-axis).as_vec3(), illuminance },
                PI * radius * radius * mean(illuminance),
            ),
        };
        if power > 0.0 {
            lights.push((light, power));
        }
    }
}

/// Chooses and builds the backend.
fn build_accel(geometry: Geometry, settings: &RenderSettings) -> Result<(Box<dyn Accel>, AccelReport), RenderError> {
    let requested = match settings.accel {
        AccelChoice::Auto => "auto",
        AccelChoice::Embree => "embree",
        AccelChoice::Bvh => "bvh",
        AccelChoice::Linear => "linear",
    };
    let mut note = String::new();
    if settings.accel == AccelChoice::Linear {
        let accel: Box<dyn Accel> = Box::new(Linear::new(geometry));
        let report = report(&*accel, requested, note);
        return Ok((accel, report));
    }
    let Split { front, rest } = Split::new(geometry);
    let bounds = rest.bounds();
    let behind: Box<dyn Accel> = match settings.accel {
        AccelChoice::Linear => unreachable!("returned above"),
        AccelChoice::Bvh => Box::new(WideBvh::build(rest)),
        AccelChoice::Embree => Box::new(EmbreeAccel::build(rest, &settings.embree_dirs)?),
        AccelChoice::Auto if bounds.is_none() => {
            // Opening libembree4 costs tens of milliseconds, for nothing.
            note = String::from("every triangle is tested in packets, so no Embree is needed");
            Box::new(WideBvh::build(rest))
        }
        AccelChoice::Auto => match embree::find(&settings.embree_dirs) {
            Ok(library) => Box::new(EmbreeAccel::build_with(rest, &library)?),
            Err(why) => {
                note = why.to_string();
                Box::new(WideBvh::build(rest))
            }
        },
    };
    let accel = match front {
        Some(big) => Box::new(Front::new(big, behind, bounds)),
        None => behind,
    };
    let report = report(&*accel, requested, note);
    Ok((accel, report))
}

/// What is said about the backend in use.
fn report(accel: &dyn Accel, requested: &'static str, note: String) -> AccelReport {
    let AccelStats { name, version, isa, front, .. } = accel.stats();
    AccelReport { requested, used: name, version, isa, note, front_triangles: front as u64 }
}
