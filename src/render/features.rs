//! What a scene asks of the renderer, by name: `features` of the JSON, of a render and of a plan alike.

use super::Prepared;
use crate::material::Material;
use crate::scene::Scene;

/// Named yes/no facts about `scene` as it was prepared and is seen, through a lens or not, in a fixed order.
pub fn features(scene: &Scene, prepared: &Prepared, has_lens: bool) -> Vec<(&'static str, bool)> {
    let tables = &prepared.tables;
    vec![
        ("emissive_surfaces", tables.lights.has_triangles()),
        ("punctual_lights", !scene.lights.is_empty()),
        ("environment", tables.lights.has_environment()),
        ("default_light", prepared.default_light.used),
        ("textures", !scene.textures.is_empty()),
        ("shading_normals", scene.meshes.iter().any(|m| m.normals.is_some())),
        ("normal_maps", scene.materials.iter().any(Material::has_normal_map)),
        ("alpha", tables.materials.has_alpha()),
        ("transmission", tables.media.transmits()),
        ("volumes", tables.media.has_volume()),
        ("straight_shadows", tables.media.has_thin_glass()),
        ("dispersion", tables.media.has_dispersion()),
        ("unlit", tables.materials.has_unlit()),
        ("vertex_colors", tables.triangles.has_colors()),
        ("instances", !tables.placements.is_empty()),
        ("motion", !scene.motion.is_empty()),
        ("exact_shapes", !tables.shapes.is_empty()),
        ("depth_of_field", has_lens),
    ]
}
