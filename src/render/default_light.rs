//! Whether the built-in studio lights the scene: the rule of `--default-light`, open it to see or change it.
//!
//! Emission alone does not say whether a file is lit: the labels of TransmissionTest emit 0.13 lm per m^2 of the asset's
//! surface and light nothing, the lamp of our quad_plane emits 0.04 and lights it all. What tells them apart is
//! brightness: glTF's core emission ends at 1 nit, about what a white surface shows, so a *lamp* is what emits more. What glows
//! at most that bright lights a scene only where it is most of the scene, as in a furnace.

use super::DefaultLight;
use crate::material::Material;
use crate::scene::Scene;

/// Lumen that lamps emit per square metre of all surface, below which `auto` takes a scene to be unlit.
pub const LEAST_EMITTED: f64 = 0.02;

/// Nits above which a surface is a lamp: the end of glTF's `emissiveFactor` without `KHR_materials_emissive_strength`.
const LAMP: f32 = 1.0;

/// Share of the surface from which on glowing surfaces light a scene.
const LEAST_GLOWING: f64 = 0.5;

/// What was decided about the built-in studio, and from what.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DefaultLightReport {
    /// As asked.
    pub requested: DefaultLight,
    /// Whether the studio lights the scene.
    pub used: bool,
    /// What surfaces emit.
    pub emitted: Emitted,
}

/// What surfaces emit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Emitted {
    /// By lamps (emission above 1 nit), lumen per square metre of all surface, each counted on one side.
    pub by_lamps: f64,
    /// Share of all surface that emits, textures by their mean, in [0, 1].
    pub glowing: f64,
}

/// Emission over a scene's surface.
#[derive(Clone, Debug, Default)]
pub struct SurfaceTotals {
    area: f64,
    flux: f64,
    glowing: f64,
}

impl SurfaceTotals {
    /// Adds `area` square metres of `material`, which emits `emission` (nits per channel) on average.
    pub fn add(&mut self, area: f64, material: Option<&Material>, emission: [f64; 3]) {
        self.area += area;
        let Some(material) = material else { return };
        let factor = material.emission.factor;
        let emitted = luminance(emission);
        if emitted > 0.0 {
            self.glowing += area * (emitted / luminance(factor.map(f64::from))).min(1.0);
        }
        if factor.iter().any(|&f| f > LAMP) {
            let sides = if material.double_sided { 2.0 } else { 1.0 };
            self.flux += std::f64::consts::PI * emitted * area * sides;
        }
    }

    /// The sums over all surface; nothing without any.
    pub fn emitted(&self) -> Emitted {
        if self.area > 0.0 {
            Emitted { by_lamps: self.flux / self.area, glowing: self.glowing / self.area }
        } else {
            Emitted::default()
        }
    }
}

/// Of linear Rec.709.
fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

impl DefaultLightReport {
    /// Applies the rule. A punctual light counts even if its intensity is 0: who placed it meant to light the scene
    /// himself. An environment of the scene's own always wins: there is only one.
    pub fn decide(requested: DefaultLight, scene: &Scene, emitted: Emitted) -> Self {
        let lit = emitted.by_lamps >= LEAST_EMITTED || emitted.glowing >= LEAST_GLOWING;
        let used = scene.environment.is_none()
            && match requested {
                DefaultLight::On => true,
                DefaultLight::Off => false,
                DefaultLight::Auto => scene.lights.is_empty() && !lit,
            };
        Self { requested, used, emitted }
    }

    /// A line for the user about a choice that `auto` made; `None` where there is nothing to say.
    pub fn note(&self) -> Option<String> {
        (self.requested == DefaultLight::Auto && self.used).then(|| {
            let emitted = self.emitted.by_lamps;
            format!(
                "lit by the built-in studio: the file has no light, and what emits more than 1 nit gives {emitted:.3} lm \
                 per m^2 of its surface, less than {LEAST_EMITTED} (--default-light off switches the studio off)"
            )
        })
    }

    /// What to say where nothing shines.
    pub fn darkness(&self, scene: &Scene) -> String {
        let why = if scene.lights.is_empty() {
            "nothing in the scene emits light"
        } else {
            "all lights of the scene have intensity 0"
        };
        format!(
            "{why}, so the picture is black; add a light or an emissive material, or switch on the built-in studio with \
             --default-light on"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Environment, Light};
    use crate::scene::PlacedLight;

    fn used(requested: DefaultLight, scene: &Scene, by_lamps: f64, glowing: f64) -> bool {
        DefaultLightReport::decide(requested, scene, Emitted { by_lamps, glowing }).used
    }

    #[test]
    fn auto_lights_what_hardly_emits() {
        let scene = Scene::default();
        for (lamps, glowing, expected) in [
            (0.0, 0.0, true),
            (0.0199, 0.1, true),
            (0.02, 0.1, false),
            (1e3, 0.1, false),
            (0.0, 0.49, true),
            (0.0, 0.5, false),
        ] {
            assert_eq!(used(DefaultLight::Auto, &scene, lamps, glowing), expected, "{lamps} {glowing}");
            assert!(used(DefaultLight::On, &scene, lamps, glowing) && !used(DefaultLight::Off, &scene, lamps, glowing));
        }
    }

    #[test]
    fn a_punctual_light_of_any_intensity_or_an_environment_keeps_the_studio_off() {
        let light = Light::Point { intensity: [0.0; 3] };
        let placed = PlacedLight { light, world_from_light: glam::DMat4::IDENTITY, name: String::new() };
        let mut scene = Scene { lights: vec![placed], ..Scene::default() };
        assert!(!used(DefaultLight::Auto, &scene, 0.0, 0.0) && used(DefaultLight::On, &scene, 0.0, 0.0));
        scene.lights.clear();
        scene.environment = Some(Environment::new(1, 1, [[1.0; 3]]));
        assert!(!used(DefaultLight::Auto, &scene, 0.0, 0.0) && !used(DefaultLight::On, &scene, 0.0, 0.0));
    }

    #[test]
    fn lamps_count_by_luminance_over_all_surface_and_glow_by_area() {
        use crate::texture::Param;
        let glows = |green: f32, double_sided| Material {
            emission: Param::constant([0.0, green, 0.0]),
            double_sided,
            ..Material::default()
        };
        let mut totals = SurfaceTotals::default();
        assert_eq!(totals.emitted(), Emitted::default());
        totals.add(2.0, Some(&glows(3.0, true)), [0.0, 3.0, 0.0]);
        totals.add(1.0, Some(&glows(1.0, false)), [0.0, 0.25, 0.0]);
        totals.add(5.0, None, [0.0; 3]);
        let emitted = totals.emitted();
        assert!((emitted.by_lamps - 0.7152 * std::f64::consts::PI * 12.0 / 8.0).abs() < 1e-12, "{emitted:?}");
        assert!((emitted.glowing - 2.25 / 8.0).abs() < 1e-12, "{emitted:?}");
    }

    #[test]
    fn only_a_choice_of_auto_is_told() {
        let emitted = Emitted { by_lamps: 0.012, glowing: 0.0 };
        let report = |requested, used| DefaultLightReport { requested, used, emitted };
        let note = report(DefaultLight::Auto, true).note().unwrap();
        assert!(note.contains("0.012") && note.contains("0.02") && note.contains("--default-light off"), "{note}");
        assert_eq!(report(DefaultLight::Auto, false).note(), None);
        assert_eq!(report(DefaultLight::On, true).note(), None);
    }
}
