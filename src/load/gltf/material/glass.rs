//! What lets light through: `KHR_materials_transmission`, `_diffuse_transmission`, `_volume`, `_dispersion`.

use super::Reader;
use crate::load::gltf::Result;
use crate::material::Material;
use crate::material::extensions::{DiffuseTransmission, Transmission, Volume};
use crate::texture::Param;

pub(super) const TRANSMISSION: &str = "KHR_materials_transmission";
const DIFFUSE_TRANSMISSION: &str = "KHR_materials_diffuse_transmission";
pub(super) const VOLUME: &str = "KHR_materials_volume";
pub(super) const DISPERSION: &str = "KHR_materials_dispersion";

/// Metres. The extension forbids a distance of 0, which stands for an inside that is opaque; this is shorter than what
/// is drawn of it.
const MIN_DISTANCE: f32 = 1e-6;

impl Reader<'_, '_> {
    pub(super) fn transmission(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(object) = self.extension(found, TRANSMISSION)? else { return Ok(()) };
        let factor = self.share(&object, "transmissionFactor", Transmission::default().factor.factor)?;
        let why_not = (factor == 0.0).then_some("transmissionFactor is 0").or(Self::without_layers(material));
        material.transmission.factor =
            Param { factor, texture: self.texture_of(&object, "transmissionTexture", why_not)? };
        Ok(())
    }

    pub(super) fn diffuse_transmission(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(object) = self.extension(found, DIFFUSE_TRANSMISSION)? else { return Ok(()) };
        let absent = DiffuseTransmission::default();
        let factor = self.share(&object, "diffuseTransmissionFactor", absent.factor.factor)?;
        let color = self.shares(&object, "diffuseTransmissionColorFactor", absent.color.factor)?;
        let why_not = (factor == 0.0).then_some("diffuseTransmissionFactor is 0").or(Self::without_layers(material));
        let is_black = (color == [0.0; 3]).then_some("diffuseTransmissionColorFactor is 0");
        material.diffuse_transmission = DiffuseTransmission {
            factor: Param { factor, texture: self.texture_of(&object, "diffuseTransmissionTexture", why_not)? },
            color: Param {
                factor: color,
                texture: self.texture_of(&object, "diffuseTransmissionColorTexture", why_not.or(is_black))?,
            },
        };
        Ok(())
    }

    /// After whatever transmits was read.
    pub(super) fn volume(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(object) = self.extension(found, VOLUME)? else { return Ok(()) };
        let thickness = self.number(&object, "thicknessFactor", 0.0)?;
        let [thickness] = self.positive(&object.place("thicknessFactor"), [thickness])?;
        let mut color = self.numbers(&object, "attenuationColor", [1.0; 3])?;
        self.positive(&object.place("attenuationColor"), color)?;
        let distance = self.number(&object, "attenuationDistance", f32::INFINITY)?;
        let hint = "It is in metres; without it, nothing is absorbed.";
        let at = object.place("attenuationDistance");
        let [mut distance] = self.within(&at, [distance], 0.0..=f32::INFINITY, "more than 0", hint)?;
        if object.members.contains_key("thicknessTexture") {
            self.skip(&object.place("thicknessTexture"), "a path tracer finds the thickness itself");
        }
        let transmits = material.has_transmission() || material.has_diffuse_transmission();
        let why_not = Self::without_layers(material)
            .or(material.specular_glossiness.then_some(super::specular_glossiness::EXCLUDES))
            .or((!transmits).then_some("neither transmission nor diffuse transmission lets light inside"))
            .or((thickness == 0.0).then_some("thicknessFactor is 0: the surface is thin-walled"));
        if let Some(why) = why_not {
            self.skip(&format!("extensions/{VOLUME}"), why);
            return Ok(());
        }
        if color.iter().any(|&c| c > 1.0) {
            if color.iter().any(|&c| c > 1.0 + super::ROUNDING) {
                let at = format!("{}/{}", self.at, object.place("attenuationColor"));
                let text = format!("{at} = {color:?} is above 1, which would be light from nothing: 1 is taken there");
                self.loader.builder.warn(text);
            }
            color = color.map(|c| c.min(1.0));
        }
        if distance < MIN_DISTANCE {
            if distance == 0.0 {
                let text = format!(
                    "{}/{at} = 0 must be more than 0: {MIN_DISTANCE} m is taken, nearly opaque; leave it out for clear glass",
                    self.at
                );
                self.loader.builder.warn(text);
            }
            distance = distance.max(MIN_DISTANCE);
        }
        let color = color.map(|c| c.max(0.0));
        material.volume = Some(Volume { attenuation_color: color, attenuation_distance: distance });
        // Both sides of a boundary count, whatever the file says.
        material.double_sided = false;
        Ok(())
    }

    /// After transmission and volume.
    pub(super) fn dispersion(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(object) = self.extension(found, DISPERSION)? else { return Ok(()) };
        let dispersion = self.number(&object, "dispersion", 0.0)?;
        let [dispersion] = self.positive(&object.place("dispersion"), [dispersion])?;
        let refracts = material.has_transmission() && material.volume.is_some();
        if refracts {
            material.transmission.dispersion = dispersion;
        } else if dispersion > 0.0 {
            let why = Self::without_layers(material)
                .or(material.specular_glossiness.then_some(super::specular_glossiness::EXCLUDES))
                .unwrap_or("only volumes with transmission refract");
            self.skip(&format!("extensions/{DISPERSION}"), why);
        }
        Ok(())
    }
}
