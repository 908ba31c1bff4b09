//! The seam: a scene's description becomes machinery. Everything conditional is decided here, once.

use super::boxes::Boxes;
use super::default_light::{DefaultLightReport, SurfaceTotals};
use super::flatten::{Flattener, Parts};
use super::moving;
use super::placing::{Choice, Considered, Placing, Thing, rounded};
use super::shapes::{self, Shapes};
use super::{AccelChoice, AccelReport, RenderSettings, refraction};
use crate::accel::embree::{self, EmbreeAccel};
use crate::accel::front::{Front, Split};
use crate::accel::geometry::{Affine, Geometry, HitFilter, Object, Placement};
use crate::accel::{Accel, AccelStats, linear::Linear, wide::WideBvh};
use crate::error::RenderError;
use crate::integrator::{Coverage, SceneTables, Spectrum};
use crate::light::environment::EnvironmentTable;
use crate::light::prepared::PreparedLight;
use crate::light::table::LightTable;
use crate::light::{Light, studio};
use crate::material::media::MediumTable;
use crate::material::table::MaterialTable;
use crate::scene::Scene;
use crate::shape::Mesh;
use crate::shape::placement::{PlacementTable, cofactor};
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
    let mut flattener = Flattener::new(scene, count as usize);
    let mut lights = Vec::new();
    let mut parts = Parts::new(1);
    for instance in scene.instances.iter().zip(&placing.is_merged).filter_map(|(i, merged)| merged.then_some(i)) {
        let mesh = &scene.meshes[instance.mesh.index()];
        flattener.add(mesh, &instance.world_from_object, &[], origin, &mut parts, Some(&mut lights));
    }
    let moving = deformed(scene, &placing.deformed, origin, &mut flattener, &mut lights);
    let mut geometry = Geometry { world: parts.object(moving), ..Geometry::default() };
    let mut placements = PlacementTable::with_capacity(placing.placements());
    let mut seen = flattener.table.len() as u64;
    for thing in &placing.things {
        let before = flattener.table.len();
        geometry.objects.push(object(scene, thing, &mut flattener));
        seen += (flattener.table.len() - before) as u64 * thing.instances.len() as u64;
        let object = (geometry.objects.len() - 1) as u32;
        for keys in thing.keys(scene, origin) {
            let keys: Vec<Affine> = keys.iter().map(rounded).collect();
            match keys[..] {
                [map] => placements.push(map.columns, map.translation),
                _ => placements.push_moving(&keys.iter().map(|map| (map.columns, map.translation)).collect::<Vec<_>>()),
            }
            geometry.placements.push(Placement { object, keys });
        }
        add_surface(scene, thing, &flattener.emissions, &mut flattener.totals.surface);
    }
    let Flattener { table: mut triangles, mut totals, emissions, opacities, .. } = flattener;
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

/// Flattens the instances `all`, whose vertices are known at every key; `None` without any.
fn deformed(
    scene: &Scene,
    all: &[u32],
    origin: DVec3,
    flattener: &mut Flattener<'_>,
    lights: &mut Vec<PreparedLight>,
) -> Option<Parts> {
    if all.is_empty() {
        return None;
    }
    let keys = moving::most_keys(scene, all);
    let meshes = || all.iter().map(|&i| &scene.meshes[scene.instances[i as usize].mesh.index()]);
    let (has_normals, has_tangents) =
        (meshes().any(|mesh| mesh.normals.is_some()), meshes().any(|mesh| mesh.tangents.is_some()));
    flattener.begin_moving(keys, has_normals, has_tangents);
    let mut parts = Parts::new(keys);
    for (&i, mesh) in all.iter().zip(meshes()) {
        let later = moving::later(scene, i as usize, keys);
        let map = &scene.instances[i as usize].world_from_object;
        flattener.add(mesh, map, &later, origin, &mut parts, Some(lights));
    }
    Some(parts)
}

/// Triangles that are held: those of instances that are not placed, and of each placed mesh once.
pub(super) fn stored_triangles(scene: &Scene, placing: &Placing) -> u64 {
    let of = |mesh: &Mesh| mesh.indices.len() as u64;
    let merged: u64 = placing.held(scene).map(|instance| of(&scene.meshes[instance.mesh.index()])).sum();
    let placed = placing.things.iter().flat_map(|thing| &thing.meshes);
    merged + placed.map(|mesh| of(&scene.meshes[mesh.index()])).sum::<u64>()
}

/// What is placed, in a space of its own.
fn object(scene: &Scene, thing: &Thing, flattener: &mut Flattener<'_>) -> Object {
    let mut parts = Parts::new(1);
    for mesh in &thing.meshes {
        let mesh = &scene.meshes[mesh.index()];
        flattener.add(mesh, &DMat4::IDENTITY, &[], thing.centre, &mut parts, None);
    }
    parts.object(None)
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

/// Adds the punctual lights that shine at all.
fn punctual(scene: &Scene, origin: DVec3, settings: &RenderSettings, lights: &mut Vec<PreparedLight>) {
    let (radius, angular_radius) = (settings.light_radius, 0.5 * settings.sun_angle.to_radians());
    for (i, placed) in scene.lights.iter().enumerate() {
        let position = |m: &DMat4| (m.w_axis.truncate() - origin).as_vec3();
        let axis = |m: &DMat4| (-m.z_axis.truncate().normalize()).as_vec3();
        let first = &placed.world_from_light;
        let later = scene.motion.lights.get(&(i as u32)).map_or(&[][..], Vec::as_slice);
        let later = if later.iter().all(|m| m == first) { &[] } else { later };
        let point = |intensity, cone| {
            let later = later.iter().map(|m| (position(m), axis(m))).collect();
            PreparedLight::Point { position: position(first), intensity, cone, radius, later }
        };
        let (light, color) = match placed.light {
            Light::Point { intensity } => (point(intensity, None), intensity),
            Light::Spot { intensity, inner_cone, outer_cone } => {
                let (inner, outer) = (f64::from(inner_cone).cos(), f64::from(outer_cone).cos());
                (point(intensity, Some((axis(first), inner as f32, outer as f32))), intensity)
            }
            Light::Directional { illuminance } => {
                let (towards, later) = (-axis(first), later.iter().map(|m| -axis(m)).collect());
                (PreparedLight::Directional { towards, illuminance, angular_radius, later }, illuminance)
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
