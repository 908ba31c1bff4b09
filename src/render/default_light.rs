//! Whether the built-in studio lights the scene: the rule of `--default-light`, open it to see or change it.

use super::DefaultLight;
use crate::scene::Scene;

/// Emitted lumen per square metre of surface below which `auto` takes a scene to be unlit: a glowing dial or a lamp
/// that is only drawn, not meant to light the rest. A white room needs about this much to be seen at exposure 0.
pub const LEAST_EMITTED: f64 = 0.05;

/// What was decided about the built-in studio, and from what.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DefaultLightReport {
    /// As asked.
    pub requested: DefaultLight,
    /// Whether the studio lights the scene.
    pub used: bool,
    /// What surfaces emit, lumen per square metre of all surface (each counted on one side).
    pub emitted: f64,
}

/// Emission over a scene's surface.
#[derive(Clone, Debug, Default)]
pub struct SurfaceTotals {
    area: f64,
    flux: f64,
}

impl SurfaceTotals {
    /// Adds `area` square metres of a surface of mean radiance `emission` (nits per channel) on `sides` sides.
    pub fn add(&mut self, area: f64, emission: [f64; 3], sides: f64) {
        let [r, g, b] = emission;
        // Luminance of linear Rec.709.
        let luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        self.area += area;
        self.flux += std::f64::consts::PI * luminance * area * sides;
    }

    /// Lumen per square metre; 0 without any surface.
    pub fn emitted(&self) -> f64 {
        if self.area > 0.0 { self.flux / self.area } else { 0.0 }
    }
}

impl DefaultLightReport {
    /// Applies the rule. A punctual light counts even if its intensity is 0: who placed it meant to light the scene
    /// himself. An environment of the scene's own always wins: there is only one.
    pub fn decide(requested: DefaultLight, scene: &Scene, emitted: f64) -> Self {
        let used = scene.environment.is_none()
            && match requested {
                DefaultLight::On => true,
                DefaultLight::Off => false,
                DefaultLight::Auto => scene.lights.is_empty() && emitted < LEAST_EMITTED,
            };
        Self { requested, used, emitted }
    }

    /// A line for the user about a choice that `auto` made; `None` where there is nothing to say.
    pub fn note(&self) -> Option<String> {
        (self.requested == DefaultLight::Auto && self.used).then(|| {
            let emitted = self.emitted;
            format!(
                "lit by the built-in studio: the file has no light and emits {emitted:.3} lm per m^2 of its surface, \
                 less than {LEAST_EMITTED} (--default-light off leaves it dark)"
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

    fn used(requested: DefaultLight, scene: &Scene, emitted: f64) -> bool {
        DefaultLightReport::decide(requested, scene, emitted).used
    }

    #[test]
    fn auto_lights_what_hardly_emits() {
        let scene = Scene::default();
        for (emitted, expected) in [(0.0, true), (0.0499, true), (0.05, false), (1e3, false)] {
            assert_eq!(used(DefaultLight::Auto, &scene, emitted), expected, "{emitted}");
            assert!(used(DefaultLight::On, &scene, emitted) && !used(DefaultLight::Off, &scene, emitted));
        }
    }

    #[test]
    fn a_punctual_light_of_any_intensity_or_an_environment_keeps_the_studio_off() {
        let light = Light::Point { intensity: [0.0; 3] };
        let placed = PlacedLight { light, world_from_light: glam::DMat4::IDENTITY, name: String::new() };
        let mut scene = Scene { lights: vec![placed], ..Scene::default() };
        assert!(!used(DefaultLight::Auto, &scene, 0.0) && used(DefaultLight::On, &scene, 0.0));
        scene.lights.clear();
        scene.environment = Some(Environment { width: 1, height: 1, radiance: vec![[1.0; 3]] });
        assert!(!used(DefaultLight::Auto, &scene, 0.0) && !used(DefaultLight::On, &scene, 0.0));
    }

    #[test]
    fn emission_is_by_luminance_over_all_surface() {
        let mut totals = SurfaceTotals::default();
        assert_eq!(totals.emitted(), 0.0);
        totals.add(2.0, [0.0, 1.0, 0.0], 2.0);
        totals.add(6.0, [0.0; 3], 1.0);
        assert!((totals.emitted() - 0.7152 * std::f64::consts::PI * 4.0 / 8.0).abs() < 1e-12);
    }

    #[test]
    fn only_a_choice_of_auto_is_told() {
        let report = |requested, used| DefaultLightReport { requested, used, emitted: 0.012 };
        let note = report(DefaultLight::Auto, true).note().unwrap();
        assert!(note.contains("0.012") && note.contains("0.05") && note.contains("--default-light off"), "{note}");
        assert_eq!(report(DefaultLight::Auto, false).note(), None);
        assert_eq!(report(DefaultLight::On, true).note(), None);
    }
}
