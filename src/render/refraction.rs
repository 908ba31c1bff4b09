//! Lights without size behind glass that bends light: no path can find them there.

use crate::light::Light;
use crate::material::Material;
use crate::scene::{PlacedShape, Scene};

/// Names that a warning lists at most.
const NAMES: usize = 4;

/// What is said of a scene with lights without size and glass that bends light: shadow rays end at such glass, and a path
/// that is bent by it never meets a point exactly. `None` where one or the other is missing. Paths find point and spot lights
/// where those are balls (`finds_balls`), and directional lights where those are suns.
pub(super) fn lights_that_glass_hides(scene: &Scene, finds_balls: bool, finds_suns: bool) -> Option<String> {
    let is_shape = |m: &Material| {
        let own = |shape: &PlacedShape| scene.materials.get(shape.material.index());
        scene.shapes.iter().any(|shape| own(shape).is_some_and(|own| std::ptr::eq(own, m)))
    };
    let seen = |m: &&Material| scene.instances.iter().any(|i| is_of(scene, i.mesh.index(), m)) || is_shape(m);
    let glass = scene.materials.iter().filter(|m| bends(m)).find(seen)?;
    let is_found = |light: &Light| if matches!(light, Light::Directional { .. }) { finds_suns } else { finds_balls };
    let hidden = scene.lights.iter().filter(|l| shines(&l.light) && !is_found(&l.light));
    let names: Vec<&str> = hidden.map(|l| l.name.as_str()).collect();
    if names.is_empty() {
        return None;
    }
    let listed = names.iter().take(NAMES).map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let rest = names.len().saturating_sub(NAMES);
    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    let (noun, have, them) = if names.len() == 1 { ("light", "has", "it") } else { ("lights", "have", "them") };
    Some(format!(
        "{noun} {listed}{more} {have} no size: nothing is lit by {them} through glass that bends light, such as that of \
         material \"{}\". A size does it: --light-radius METRES for lamps (at most 256), --sun-angle DEG for suns; so do \
         emissive surfaces and environments",
        glass.name
    ))
}

/// Whether light comes through `m` in other directions than straight on.
fn bends(m: &Material) -> bool {
    m.has_transmission() && (m.interior().is_some() || m.roughness.factor > 0.0)
}

fn shines(light: &Light) -> bool {
    let (Light::Point { intensity: power }
    | Light::Spot { intensity: power, .. }
    | Light::Directional { illuminance: power }) = light;
    power.iter().any(|&p| p > 0.0)
}

/// Whether mesh `mesh` is of the material `m` of `scene`.
fn is_of(scene: &Scene, mesh: usize, m: &Material) -> bool {
    scene.materials.get(scene.meshes[mesh].material.index()).is_some_and(|own| std::ptr::eq(own, m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::extensions::{Transmission, Volume};
    use crate::scene::{Instance, PlacedLight, SceneBuilder};
    use crate::shape::Mesh;
    use crate::texture::Param;
    use glam::DMat4;

    fn scene(material: Material, lights: usize) -> Scene {
        let mut builder = SceneBuilder::new(0);
        let material = builder.add_material(Material { name: String::from("Glass"), ..material });
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = builder.add_mesh(Mesh::plain("pane", positions, vec![[0, 1, 2]], material));
        builder.add_instance(Instance { mesh, world_from_object: DMat4::IDENTITY, name: String::from("pane") });
        for i in 0..lights {
            let light = Light::Point { intensity: [1.0; 3] };
            let name = format!("Lamp {i}");
            builder.add_light(PlacedLight { light, world_from_light: DMat4::IDENTITY, name });
        }
        builder.finish()
    }

    fn glass(roughness: f32, is_volume: bool) -> Material {
        let inside = Volume { attenuation_color: [1.0; 3], attenuation_distance: f32::INFINITY };
        Material {
            transmission: Transmission { factor: Param::constant(1.0), dispersion: 0.0 },
            roughness: Param::constant(roughness),
            volume: is_volume.then_some(inside),
            ..Material::default()
        }
    }

    #[test]
    fn lights_without_size_behind_glass_that_bends_are_named() {
        for material in [glass(0.0, true), glass(0.4, false)] {
            let warning = lights_that_glass_hides(&scene(material, 2), false, false).expect("a warning");
            for part in ["\"Lamp 0\", \"Lamp 1\" have no size", "\"Glass\"", "--light-radius", "--sun-angle"] {
                assert!(warning.contains(part), "{warning}");
            }
        }
        let many = lights_that_glass_hides(&scene(glass(0.0, true), 7), false, false).expect("a warning");
        assert!(many.contains("and 3 more") && !many.contains("Lamp 4"), "{many}");
    }

    #[test]
    fn nothing_is_said_of_glass_that_lets_shadow_rays_through_nor_without_such_lights() {
        assert_eq!(lights_that_glass_hides(&scene(glass(0.0, false), 1), false, false), None);
        assert_eq!(lights_that_glass_hides(&scene(glass(0.0, true), 0), false, false), None);
        assert_eq!(lights_that_glass_hides(&scene(Material::default(), 1), false, false), None);
        assert_eq!(
            lights_that_glass_hides(&scene(Material { unlit: true, ..glass(0.4, true) }, 1), false, false),
            None
        );
    }

    #[test]
    fn lights_with_a_size_are_found_through_glass() {
        let warning = |balls, suns| lights_that_glass_hides(&scene(glass(0.0, true), 2), balls, suns);
        assert_eq!(warning(true, false), None);
        assert!(warning(false, true).is_some(), "those of the scene are no suns");
    }
}
