//! Exact shapes of a scene made ready: where they are in the prepared space, what rays meet of them, which are lamps.

use super::boxes::join;
use super::default_light::SurfaceTotals;
use super::opacity::Opacities;
use crate::accel::geometry::{Shape, ShapeHit, ShapeRay};
use crate::light::bulb::Bulb;
use crate::light::prepared::PreparedLight;
use crate::scene::{PlacedShape as Described, Scene};
use crate::shape::exact::ExactShape;
use crate::shape::exact::table::{PlacedShape, ShapeLine, ShapeTable};
use crate::shape::placement::cofactor;
use crate::shape::table::{NONE, TriangleTable};
use glam::{DMat3, DMat4, DVec3, Vec3};
use std::sync::Arc;

/// A sphere's axes may differ by this share and be at such a cosine to one another, and it is a ball.
const ROUND: f64 = 1e-6;
/// By how much a ball is taken larger where directions towards it are sampled, for the rounding of f32.
const SLACK: f64 = 1e-6;
/// Names that a warning lists at most.
const NAMES: usize = 4;

/// What became of the shapes of a scene.
pub(super) struct Shapes {
    /// For shading.
    pub table: ShapeTable,
    /// Some of them shine.
    pub glow: bool,
    /// What is to be said.
    pub warnings: Vec<String>,
}

/// What a backend meets of a shape.
struct Met(Arc<PlacedShape>);

fn line(ray: &ShapeRay) -> ShapeLine {
    let &ShapeRay { origin, direction, t_max, time } = ray;
    ShapeLine { origin, direction, t_max, time }
}

fn hit([t, u, v]: [f32; 3]) -> ShapeHit {
    ShapeHit { t, u, v }
}

impl Shape for Met {
    fn bounds(&self) -> [[f32; 3]; 2] {
        self.0.bounds().map(|corner| corner.to_array())
    }

    fn intersect(&self, ray: &ShapeRay) -> Option<ShapeHit> {
        self.0.nearest(&line(ray)).map(hit)
    }

    fn occludes(&self, ray: &ShapeRay) -> bool {
        self.0.any(&line(ray))
    }

    fn is_filtered(&self) -> bool {
        self.0.is_filtered
    }

    fn intersect_where(&self, ray: &ShapeRay, stops: &mut dyn FnMut(&ShapeHit) -> bool) -> Option<ShapeHit> {
        self.0.nearest_where(&line(ray), &mut |found| stops(&hit(found))).map(hit)
    }
}

impl Shapes {
    /// Puts the shapes of `scene` behind the triangles of `triangles`, seen from `origin`, and their lamps into `lights`.
    pub fn new(
        scene: &Scene,
        origin: DVec3,
        emissions: &[[f64; 3]],
        opacities: &Opacities,
        triangles: &mut TriangleTable,
        lights: &mut Vec<PreparedLight>,
        surface: &mut SurfaceTotals,
    ) -> Self {
        let first = triangles.len() as u32;
        let to_prepared = DMat4::from_translation(-origin);
        let mut tangents = None;
        let (mut unsampled, mut glow) = (Vec::new(), false);
        let mut shapes = Vec::with_capacity(scene.shapes.len());
        for (i, described) in scene.shapes.iter().enumerate() {
            let Described { shape, material, world_from_object, name } = described;
            let later = scene.motion.shapes.get(&(i as u32)).into_iter().flatten();
            let keys = std::iter::once(world_from_object).chain(later).map(|map| to_prepared * *map);
            let mut placed = PlacedShape::new(Arc::clone(shape), keys);
            placed.is_filtered = opacities.material_lets_rays_pass(scene, *material);
            let mut tangent = NONE;
            let own = scene.materials.get(material.index());
            if let Some(own) = own.filter(|own| own.needs_tangents()) {
                if let Some(transform) = own.tangent_map().and_then(|map| map.transform) {
                    placed.set_tangents(transform.m.map(|row| [row[0].into(), row[1].into()]));
                }
                // One for all: shading asks the shape itself.
                tangent = *tangents.get_or_insert_with(|| triangles.push_tangents([[1.0, 0.0, 0.0, 1.0]; 3]));
            }
            let primitive = triangles.len() as u32;
            triangles.push([Vec3::ZERO; 3], Vec3::Y, material.0, NONE, tangent);
            let emission = emissions.get(material.index()).copied().unwrap_or_default();
            let map = to_prepared * *world_from_object * shape.object_from_unit();
            let radiance = emission.iter().sum::<f64>() / 3.0;
            if radiance > 0.0 {
                glow = true;
                // What is there in part only would have to be asked about twice; what moves is not in one place.
                let ball = ball(shape, &map).filter(|_| !placed.is_filtered && !placed.moves());
                let both_sides = own.is_some_and(|own| own.double_sided);
                match ball {
                    Some(bulb) => lights.push(PreparedLight::Ball { bulb, radiance, both_sides, primitive }),
                    None => unsampled.push(name.as_str()),
                }
            }
            surface.add(shape.area(DMat3::from_mat4(map)), own, emission);
            shapes.push(Arc::new(placed));
        }
        let warnings = found_by_chance(&unsampled).into_iter().collect();
        Self { table: ShapeTable::new(first, shapes), glow, warnings }
    }
}

/// What a backend is built from.
pub(super) fn for_rays(table: &ShapeTable) -> Vec<(Arc<dyn Shape>, u32)> {
    let met = |shape: &Arc<PlacedShape>| Arc::new(Met(Arc::clone(shape))) as Arc<dyn Shape>;
    table.numbered().map(|(shape, number)| (met(shape), number)).collect()
}

/// The ball that a sphere is where `map` puts its unit, if it still is one.
fn ball(shape: &ExactShape, map: &DMat4) -> Option<Bulb> {
    let ExactShape::Sphere { .. } = shape else { return None };
    let axes = [map.x_axis, map.y_axis, map.z_axis].map(|axis| axis.truncate());
    let radius = axes[0].length();
    let is_round = (0..3).all(|i| {
        let (a, b) = (axes[i], axes[(i + 1) % 3]);
        (a.length() - radius).abs() <= ROUND * radius && a.dot(b).abs() <= ROUND * radius * radius
    });
    // The density of its directions must be in the range of f32.
    let fits = (1e-18..1e18).contains(&radius);
    (is_round && fits).then(|| Bulb { centre: map.w_axis.truncate().as_vec3(), radius: radius * (1.0 + SLACK) })
}

/// What is said of so many balls in a scene of smooth thin glass.
pub(super) fn behind_panes(balls: usize) -> String {
    let (noun, glow) = if balls == 1 { ("sphere", "glows") } else { ("spheres", "glow") };
    format!(
        "{balls} exact {noun} {glow} in a scene of smooth thin glass: shadow rays that go through panes do not look for \
         them, so their light is found by scattered rays only, which is noisy"
    )
}

fn found_by_chance(names: &[&str]) -> Option<String> {
    if names.is_empty() {
        return None;
    }
    let listed = names.iter().take(NAMES).map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let rest = names.len().saturating_sub(NAMES);
    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    let (noun, glow, it) = if names.len() == 1 { ("shape", "glows", "it") } else { ("shapes", "glow", "them") };
    Some(format!(
        "exact {noun} {listed}{more} {glow}, and light of {it} is found by scattered rays only, which is noisy: spheres \
         that are round, opaque and at rest are sampled as lights"
    ))
}

/// Low and high corner of all shapes of a scene at any time, world space.
pub(super) fn bounds(scene: &Scene) -> Option<(DVec3, DVec3)> {
    let of = |(i, placed): (usize, &Described)| {
        let unit = placed.shape.object_from_unit();
        let later = scene.motion.shapes.get(&(i as u32)).into_iter().flatten();
        let keys = std::iter::once(&placed.world_from_object).chain(later);
        keys.map(|key| placed.shape.bounds(&(*key * unit))).reduce(join)
    };
    scene.shapes.iter().enumerate().filter_map(of).reduce(join)
}

/// Sum over all shapes of area times normal, m^2, world space.
pub(super) fn vector_area(scene: &Scene) -> DVec3 {
    let of = |placed: &Described| {
        let linear = DMat3::from_mat4(placed.world_from_object * placed.shape.object_from_unit());
        cofactor(linear) * placed.shape.vector_area() * if linear.determinant() < 0.0 { -1.0 } else { 1.0 }
    };
    scene.shapes.iter().map(of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_is_a_ball_unless_it_is_stretched_or_sheared() {
        let sphere = ExactShape::Sphere { radius: 2.0 };
        let unit = sphere.object_from_unit();
        let turned = DMat4::from_rotation_x(0.4) * DMat4::from_scale(DVec3::new(-3.0, 3.0, 3.0));
        let found = ball(&sphere, &(DMat4::from_translation(DVec3::X) * turned * unit)).expect("a ball");
        assert!((found.radius - 6.0).abs() < 1e-4 && found.centre == Vec3::X);
        for map in [
            DMat4::from_scale(DVec3::new(1.0, 1.0, 1.01)),
            DMat4::from_cols_array(&{
                let mut sheared = DMat4::IDENTITY.to_cols_array();
                sheared[4] = 0.01;
                sheared
            }),
        ] {
            assert_eq!(ball(&sphere, &(map * unit)), None);
        }
    }

    #[test]
    fn shapes_that_glow_unsampled_are_named_once() {
        assert_eq!(found_by_chance(&[]), None);
        let text = found_by_chance(&["a", "b", "c", "d", "e", "f"]).unwrap();
        assert!(text.contains("\"a\", \"b\", \"c\", \"d\" and 2 more glow") && !text.contains("\"e\""), "{text}");
    }
}
