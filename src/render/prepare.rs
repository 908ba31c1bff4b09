//! The seam: a scene's description becomes machinery. Everything conditional is decided here, once.

use super::boxes::{Boxes, is_usable};
use super::default_light::{DefaultLightReport, SurfaceTotals};
use super::emission::mean_emissions;
use super::opacity::Opacities;
use super::placing::{Choice, Considered, Placing, Thing, rounded};
use super::shapes::{self, Shapes};
use super::{AccelChoice, AccelReport, RenderSettings, refraction};
use crate::accel::embree::{self, EmbreeAccel};
use crate::accel::front::{Front, Split};
use crate::accel::geometry::{Geometry, HitFilter, Object, Part, Placement};
use crate::accel::{Accel, AccelStats, linear::Linear, wide::WideBvh};
use crate::error::RenderError;
use crate::integrator::{Coverage, SceneTables, Spectrum};
use crate::light::element::LampTriangle;
use crate::light::environment::EnvironmentTable;
use crate::light::parts::connected;
use crate::light::prepared::{LampShape, PreparedLight};
use crate::light::table::LightTable;
use crate::light::{Light, studio};
use crate::material::media::MediumTable;
use crate::material::table::MaterialTable;
use crate::math::MAX_UV_SETS;
use crate::scene::Scene;
use crate::shape::Mesh;
use crate::shape::placement::{PlacementTable, cofactor, scaled};
use crate::shape::table::{Corners, NONE, TriangleTable};
use crate::texture::lookup::TextureTable;
use glam::{DMat3, DMat4, DVec3};
use std::sync::Arc;

/// A scene made ready to be traced.
pub struct Prepared {
    /// What shading reads.
    pub tables: Arc<SceneTables>,
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
    /// What was placed and what merged.
    pub placed: PlacedReport,
    /// Said to the user.
    pub warnings: Vec<String>,
    /// Those of `warnings` that mean that something of the scene is not in the picture.
    pub losses: Vec<String>,
}

/// What was placed and what merged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlacedReport {
    /// Instances that are placed; the others are merged into the world. Meshes that have the same places count once.
    pub instances: u64,
    /// Triangles that rays can meet, those of a placed mesh at each of its places.
    pub triangles: u64,
    /// Triangles held, those of a placed mesh once.
    pub stored: u64,
    /// What has several instances, and what became of it.
    pub considered: Vec<Considered>,
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

/// Triangles of the world or of an object: those that stop every ray, and those whose hits are to be asked about.
struct Parts {
    opaque: Part,
    filtered: Part,
}

impl Default for Parts {
    fn default() -> Self {
        Self { opaque: Part::default(), filtered: Part { filtered: true, ..Part::default() } }
    }
}

impl Parts {
    /// Where triangles go that let some rays pass, or none.
    fn of(&mut self, lets_rays_pass: bool) -> &mut Part {
        if lets_rays_pass { &mut self.filtered } else { &mut self.opaque }
    }

    /// What backends are built from.
    fn object(self) -> Object {
        let mut parts = vec![self.opaque, self.filtered];
        parts.retain(|part| !part.triangles.indices.is_empty());
        Object { parts, shapes: Vec::new() }
    }
}

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

/// [`prepare`] with a backend that the caller builds from what rays can hit: [`build_accel`] is the renderer's own.
///
/// # Errors
/// As [`prepare`], and those of `build`.
pub fn prepare_with(
    scene: &Scene,
    settings: &RenderSettings,
    build: impl FnOnce(Geometry) -> Result<(Box<dyn Accel>, AccelReport), RenderError>,
) -> Result<Prepared, RenderError> {
    prepare_all(scene, settings, Choice::Auto, build)
}

/// [`prepare`] with meshes placed or merged as `choice` says.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_placing(scene: &Scene, settings: &RenderSettings, choice: Choice) -> Result<Prepared, RenderError> {
    prepare_all(scene, settings, choice, |geometry| build_accel(geometry, settings))
}

fn prepare_all(
    scene: &Scene,
    settings: &RenderSettings,
    choice: Choice,
    build: impl FnOnce(Geometry) -> Result<(Box<dyn Accel>, AccelReport), RenderError>,
) -> Result<Prepared, RenderError> {
    let boxes = Boxes::of(scene);
    let placing = Placing::of(scene, &boxes, choice);
    // A shape has a record among the triangles.
    let count = stored_triangles(scene, &placing) + scene.shapes.len() as u64;
    // Records are gathered by signed 32-bit indices, four a triangle and seven a placement.
    if count > (i32::MAX / 4) as u64 {
        return Err(RenderError::TooLarge(format!("{count} triangles and shapes; at most {}", i32::MAX / 4)));
    }
    if placing.placements() > (i32::MAX / 7) as usize {
        return Err(RenderError::TooLarge(format!("{} instances; at most {}", placing.placements(), i32::MAX / 7)));
    }
    let (bounds, origin) = (boxes.scene, boxes.origin());
    let mut textures = TextureTable::new(&scene.textures, &scene.images)?;
    let materials = MaterialTable::new(&scene.materials, &mut textures, settings.brdf);
    if settings.texture_lod {
        textures.add_levels(&scene.textures, &scene.images)?;
    }
    let mut triangles = TriangleTable::with_capacity(count as usize);
    let mut parts = Parts::default();
    let mut lights = Vec::new();
    let (emissions, opacities) = (mean_emissions(scene), Opacities::new(scene));
    let mut totals = Totals::default();
    for instance in scene.instances.iter().zip(&placing.is_merged).filter_map(|(i, merged)| merged.then_some(i)) {
        let mesh = &scene.meshes[instance.mesh.index()];
        let map = &instance.world_from_object;
        let lights = Some(&mut lights);
        flatten(scene, mesh, map, origin, &emissions, &opacities, &mut parts, &mut triangles, lights, &mut totals);
    }
    let mut geometry = Geometry { world: parts.object(), ..Geometry::default() };
    let mut placements = PlacementTable::with_capacity(placing.placements());
    let mut seen = triangles.len() as u64;
    for thing in &placing.things {
        let before = triangles.len();
        geometry.objects.push(object(scene, thing, &emissions, &opacities, &mut triangles, &mut totals));
        seen += (triangles.len() - before) as u64 * thing.instances.len() as u64;
        let object = (geometry.objects.len() - 1) as u32;
        for map in thing.places(scene, origin) {
            let map = rounded(&map);
            placements.push(map.columns, map.translation);
            geometry.placements.push(Placement { object, keys: vec![map] });
        }
        add_surface(scene, thing, &emissions, &mut totals.surface);
    }
    let placed = PlacedReport {
        instances: placing.placements() as u64,
        triangles: seen,
        stored: triangles.len() as u64,
        considered: placing.considered,
    };
    let shapes = Shapes::new(scene, origin, &emissions, &opacities, &mut triangles, &mut lights, &mut totals.surface);
    geometry.world.shapes = shapes::for_rays(&shapes.table);
    let (mut warnings, mut losses) = (shapes.warnings, Vec::new());
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
    punctual(scene, origin, settings, &mut lights);
    let default_light = DefaultLightReport::decide(settings.default_light, scene, totals.surface.emitted());
    let environment = environment(scene, default_light.used);
    if lights.is_empty() && environment.is_none() && !shapes.glow {
        warnings.push(default_light.darkness(scene));
    }
    let media = MediumTable::new(&scene.materials);
    if media.has_thin_glass() {
        // A ball has no triangles to fall back on: what it sends through panes is left to scattered rays.
        let before = lights.len();
        lights.retain(|light| !matches!(light, PreparedLight::Ball { .. }));
        if lights.len() < before {
            warnings.push(shapes::behind_panes(before - lights.len()));
        }
        // Shadow rays go through it step by step, to an end that they know.
        for light in &mut lights {
            light.forget_bulb();
        }
    }
    let lights = LightTable::new(lights, environment, radius, &mut triangles);
    warnings.extend(refraction::lights_that_glass_hides(scene, !lights.balls().is_empty(), !lights.suns().is_empty()));
    let spectrum = media.has_dispersion().then(Spectrum::default);
    let tables = Arc::new(SceneTables {
        triangles,
        placements,
        shapes: shapes.table,
        materials,
        media,
        spectrum,
        textures,
        lights,
    });
    let is_filtered = geometry.objects.iter().chain([&geometry.world]).flat_map(|o| &o.parts).any(|part| part.filtered)
        || geometry.world.shapes.iter().any(|(shape, _)| shape.is_filtered());
    geometry.filter = is_filtered.then(|| Arc::new(Coverage::new(Arc::clone(&tables))) as Arc<dyn HitFilter>);
    let (accel, accel_report) = build(geometry)?;
    Ok(Prepared { tables, accel, accel_report, origin, bounds, default_light, placed, warnings, losses })
}

/// Triangles that are held: those of merged instances, and of each placed mesh once.
pub(super) fn stored_triangles(scene: &Scene, placing: &Placing) -> u64 {
    let of = |mesh: &Mesh| mesh.indices.len() as u64;
    let merged = scene.instances.iter().zip(&placing.is_merged).filter(|(_, merged)| **merged);
    let merged: u64 = merged.map(|(instance, _)| of(&scene.meshes[instance.mesh.index()])).sum();
    let placed = placing.things.iter().flat_map(|thing| &thing.meshes);
    merged + placed.map(|mesh| of(&scene.meshes[mesh.index()])).sum::<u64>()
}

/// What is placed, in a space of its own.
fn object(
    scene: &Scene,
    thing: &Thing,
    emissions: &[[f64; 3]],
    opacities: &Opacities,
    table: &mut TriangleTable,
    totals: &mut Totals,
) -> Object {
    let mut parts = Parts::default();
    for mesh in &thing.meshes {
        let mesh = &scene.meshes[mesh.index()];
        flatten(scene, mesh, &DMat4::IDENTITY, thing.centre, emissions, opacities, &mut parts, table, None, totals);
    }
    parts.object()
}

/// Adds the surface of a placed thing, at all its places, to `surface`.
fn add_surface(scene: &Scene, thing: &Thing, emissions: &[[f64; 3]], surface: &mut SurfaceTotals) {
    for mesh in &thing.meshes {
        let mesh = &scene.meshes[mesh.index()];
        // Areas go by the cofactor matrix: a triangle of area a and unit normal n has the area a |C n|, whose root mean
        // square over the mesh takes the sum of a n n^T alone. Exact for uniform scales; else above the mean.
        let (mut area, mut squares) = (0.0, DMat3::ZERO);
        for triangle in &mesh.indices {
            let [a, b, c] = triangle.map(|i| glam::Vec3::from(mesh.positions[i as usize]).as_dvec3());
            let cross = 0.5 * (b - a).cross(c - a);
            let size = cross.length();
            if size > 0.0 {
                let n = cross / size;
                area += size;
                squares += DMat3::from_cols(n * n.x, n * n.y, n * n.z) * size;
            }
        }
        let placed = |map: DMat4| {
            let c = cofactor(DMat3::from_mat4(map));
            let sum = c * squares * c.transpose();
            (area * (sum.x_axis.x + sum.y_axis.y + sum.z_axis.z)).sqrt()
        };
        let area = thing.places(scene, DVec3::ZERO).map(placed).sum();
        let (material, emission) = (scene.materials.get(mesh.material.index()), emissions.get(mesh.material.index()));
        surface.add(area, material, emission.copied().unwrap_or_default());
    }
}

/// The environment: the scene's own, or the studio if that is to light it.
fn environment(scene: &Scene, studio: bool) -> Option<EnvironmentTable> {
    let own = scene.environment.as_ref().and_then(EnvironmentTable::new);
    own.or_else(|| studio.then(studio::environment).as_ref().and_then(EnvironmentTable::new))
}

/// Appends a mesh where `world_from_object` puts it, seen from `origin`; vertices are transformed in f64 and rounded
/// once. Without `lights` it is an object's own: it gives no light and does not count as surface.
#[expect(clippy::too_many_arguments, reason = "what is read, then the four tables that grow")]
fn flatten(
    scene: &Scene,
    mesh: &Mesh,
    world_from_object: &DMat4,
    origin: DVec3,
    emissions: &[[f64; 3]],
    opacities: &Opacities,
    parts: &mut Parts,
    table: &mut TriangleTable,
    lights: Option<&mut Vec<PreparedLight>>,
    totals: &mut Totals,
) {
    let material = scene.materials.get(mesh.material.index());
    let linear = scaled(DMat3::from_mat4(*world_from_object));
    // Normals go by the cofactor matrix: no division, so nearly singular transforms stay finite. A mirroring transform
    // (negative determinant) turns the winding; the corners are swapped back so that the front stays the front.
    let mirrors = linear.determinant() < 0.0;
    let normal_from_object = cofactor(linear) * if mirrors { -1.0 } else { 1.0 };
    let lets_rays_pass = opacities.let_rays_pass(scene, mesh);
    let part = parts.of(lets_rays_pass);
    let triangles = &mut part.triangles;
    let first = triangles.positions.len() as u32;
    triangles.positions.extend(mesh.positions.iter().map(|&p| {
        let p = world_from_object.transform_point3(glam::Vec3::from(p).as_dvec3());
        (p - origin).as_vec3().to_array()
    }));
    // Once a vertex, not once a corner: a vertex is in six triangles on average.
    let vertex_normals: Option<Vec<glam::Vec3>> = mesh.normals.as_ref().map(|normals| {
        let world = |&n: &[f32; 3]| (normal_from_object * glam::Vec3::from(n).as_dvec3()).normalize_or_zero().as_vec3();
        normals.iter().map(world).collect()
    });
    let emission = emissions.get(mesh.material.index()).copied().unwrap_or_default();
    // Mean over channels: what light may be expected of it.
    let average = emission.iter().sum::<f64>() / 3.0;
    let mut lamps = Vec::new();
    let mut mesh_area = 0.0;
    let needs_attributes = mesh.normals.is_some() || !mesh.uv_sets.is_empty() || mesh.colors.is_some();
    for &[i, j, k] in &mesh.indices {
        let [j, k] = if mirrors { [k, j] } else { [j, k] };
        let corner = |v: u32| glam::Vec3::from(triangles.positions[(first + v) as usize]);
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
        let primitive = table.len() as u32;
        part.primitives.push(triangles.indices.len(), primitive);
        triangles.indices.push([i, j, k].map(|v| first + v));
        table.push(corners, ng, mesh.material.0, attributes, tangents);
        if lights.is_some() && average > 0.0 && area > LEAST_SAMPLED_AREA {
            lamps.push(LampTriangle { corners, ng, area, primitive, attributes });
        }
    }
    if let Some(lights) = lights {
        let both_sides = material.is_some_and(|m| m.double_sided);
        for triangles in connected(lamps) {
            let material = mesh.material.0;
            // What is there in part only would have to be asked about twice.
            let shape = LampShape::of(&triangles, !lets_rays_pass);
            lights.push(PreparedLight::Mesh { triangles, radiance: average, both_sides, material, shape });
        }
        totals.surface.add(mesh_area, material, emission);
    }
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

/// Adds the punctual lights that shine at all.
fn punctual(scene: &Scene, origin: DVec3, settings: &RenderSettings, lights: &mut Vec<PreparedLight>) {
    let (radius, angular_radius) = (settings.light_radius, 0.5 * settings.sun_angle.to_radians());
    for placed in &scene.lights {
        let position = (placed.world_from_light.w_axis.truncate() - origin).as_vec3();
        let axis = -placed.world_from_light.z_axis.truncate().normalize();
        let (light, color) = match placed.light {
            Light::Point { intensity } => (PreparedLight::Point { position, intensity, cone: None, radius }, intensity),
            Light::Spot { intensity, inner_cone, outer_cone } => {
                let (inner, outer) = (f64::from(inner_cone).cos(), f64::from(outer_cone).cos());
                let cone = Some((axis.as_vec3(), inner as f32, outer as f32));
                (PreparedLight::Point { position, intensity, cone, radius }, intensity)
            }
            Light::Directional { illuminance } => {
                let towards = (-axis).as_vec3();
                (PreparedLight::Directional { towards, illuminance, angular_radius }, illuminance)
            }
        };
        // Not for NaN either.
        let sum: f32 = color.iter().sum();
        if sum > 0.0 && sum.is_finite() {
            lights.push(light);
        }
    }
}

/// Chooses and builds the backend.
///
/// # Errors
/// The backend asked for by name is not to be had.
pub fn build_accel(
    geometry: Geometry,
    settings: &RenderSettings,
) -> Result<(Box<dyn Accel>, AccelReport), RenderError> {
    let requested = match settings.accel {
        AccelChoice::Auto => "auto",
        AccelChoice::Embree => "embree",
        AccelChoice::Bvh => "bvh",
        AccelChoice::Linear => "linear",
    };
    if settings.accel == AccelChoice::Linear {
        let accel: Box<dyn Accel> = Box::new(Linear::new(geometry));
        let report = report(&*accel, requested, String::new());
        return Ok((accel, report));
    }
    let split = Split::new(geometry);
    let (library, note) = match settings.accel {
        AccelChoice::Linear | AccelChoice::Bvh => (None, String::new()),
        AccelChoice::Embree => (Some(embree::find(&settings.embree_dirs)?), String::new()),
        // Opening libembree4 costs tens of milliseconds, for nothing.
        AccelChoice::Auto if split.front.as_ref().is_some_and(|(big, _)| big.is_all()) => {
            (None, String::from("every triangle is tested in packets, so no Embree is needed"))
        }
        AccelChoice::Auto => match embree::find(&settings.embree_dirs) {
            Ok(library) => (Some(library), String::new()),
            Err(why) => (None, why.to_string()),
        },
    };
    let build = |geometry: Geometry| -> Result<Box<dyn Accel>, RenderError> {
        Ok(match &library {
            Some(library) => Box::new(EmbreeAccel::build_with(geometry, library)?),
            None => Box::new(WideBvh::build(geometry)),
        })
    };
    let Split { all, front } = if library.is_some() { split.apart() } else { split };
    let accel = match front {
        Some(front) => Box::new(Front::build(all, front, build)?),
        None => build(all)?,
    };
    let report = report(&*accel, requested, note);
    Ok((accel, report))
}

/// What is said about the backend in use.
fn report(accel: &dyn Accel, requested: &'static str, note: String) -> AccelReport {
    let AccelStats { name, version, isa, front, splits, .. } = accel.stats();
    let (front_triangles, splits) = (front as u64, splits as u64);
    AccelReport { requested, used: name, version, isa, note, front_triangles, splits }
}
