//! Layers on the surface and shapes of its highlight: `KHR_materials_clearcoat`, `_sheen`, `_anisotropy`, `_iridescence`.

use super::Reader;
use crate::load::gltf::Result;
use crate::material::Material;
use crate::material::extensions::{Anisotropy, Clearcoat, Iridescence, Sheen};
use crate::texture::Param;

const CLEARCOAT: &str = "KHR_materials_clearcoat";
const SHEEN: &str = "KHR_materials_sheen";
const ANISOTROPY: &str = "KHR_materials_anisotropy";
const IRIDESCENCE: &str = "KHR_materials_iridescence";

impl Reader<'_, '_> {
    pub(super) fn clearcoat(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(object) = self.extension(found, CLEARCOAT)? else { return Ok(()) };
        let absent = Clearcoat::default();
        let factor = self.share(&object, "clearcoatFactor", absent.factor.factor)?;
        let roughness = self.share(&object, "clearcoatRoughnessFactor", absent.roughness.factor)?;
        let scale = self.coat_scale(&object)?;
        let why_not = (factor == 0.0).then_some("clearcoatFactor is 0").or(Self::without_layers(material));
        let is_smooth = (roughness == 0.0).then_some("clearcoatRoughnessFactor is 0");
        material.clearcoat = Clearcoat {
            factor: Param { factor, texture: self.texture_of(&object, "clearcoatTexture", why_not)? },
            roughness: Param {
                factor: roughness,
                texture: self.texture_of(&object, "clearcoatRoughnessTexture", why_not.or(is_smooth))?,
            },
            normal: Param { factor: scale, texture: self.texture_of(&object, "clearcoatNormalTexture", why_not)? },
        };
        Ok(())
    }

    /// `scale` of the coat's normal map.
    fn coat_scale(&self, object: &super::object::Object) -> Result<f32> {
        let Some(map) = object.members.get("clearcoatNormalTexture") else { return Ok(1.0) };
        let place = object.place("clearcoatNormalTexture/scale");
        let Some(scale) = map.get("scale") else { return Ok(1.0) };
        let scale = scale.as_f64().map_or(f32::NAN, |v| v as f32);
        self.within(&place, [scale], f32::MIN..=f32::MAX, "a finite number", "").map(|[v]| v)
    }

    pub(super) fn sheen(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(object) = self.extension(found, SHEEN)? else { return Ok(()) };
        let absent = Sheen::default();
        let color = self.shares(&object, "sheenColorFactor", absent.color.factor)?;
        let roughness = self.share(&object, "sheenRoughnessFactor", absent.roughness.factor)?;
        let why_not = (color == [0.0; 3]).then_some("sheenColorFactor is 0").or(Self::without_layers(material));
        let is_smooth = (roughness == 0.0).then_some("sheenRoughnessFactor is 0");
        material.sheen = Sheen {
            color: Param { factor: color, texture: self.texture_of(&object, "sheenColorTexture", why_not)? },
            roughness: Param {
                factor: roughness,
                texture: self.texture_of(&object, "sheenRoughnessTexture", why_not.or(is_smooth))?,
            },
        };
        Ok(())
    }

    pub(super) fn anisotropy(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(object) = self.extension(found, ANISOTROPY)? else { return Ok(()) };
        let absent = Anisotropy::default();
        let strength = self.share(&object, "anisotropyStrength", absent.strength.factor)?;
        let rotation = self.number(&object, "anisotropyRotation", absent.rotation)?;
        let range = f32::MIN..=f32::MAX;
        let [rotation] =
            self.within(&object.place("anisotropyRotation"), [rotation], range, "a finite number of radians", "")?;
        let why_not = (strength == 0.0).then_some("anisotropyStrength is 0").or(Self::without_layers(material));
        let texture = self.texture_of(&object, "anisotropyTexture", why_not)?;
        material.anisotropy = Anisotropy { strength: Param { factor: strength, texture }, rotation };
        Ok(())
    }

    pub(super) fn iridescence(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(object) = self.extension(found, IRIDESCENCE)? else { return Ok(()) };
        let absent = Iridescence::default();
        let factor = self.share(&object, "iridescenceFactor", absent.factor.factor)?;
        let ior = self.number(&object, "iridescenceIor", absent.ior)?;
        let hint = "1 is a film that reflects nothing itself; soap water 1.33.";
        let [ior] =
            self.within(&object.place("iridescenceIor"), [ior], 1.0..=f32::MAX, "at least 1 and finite", hint)?;
        let thickness = |key: &str, absent: f32| {
            let value = self.number(&object, key, absent)?;
            self.positive(&object.place(key), [value]).map(|[v]| v)
        };
        let minimum = thickness("iridescenceThicknessMinimum", absent.thickness_minimum)?;
        let maximum = thickness("iridescenceThicknessMaximum", absent.thickness_maximum.factor)?;
        let why_not = (factor == 0.0).then_some("iridescenceFactor is 0").or(Self::without_layers(material));
        let is_even = (minimum == maximum).then_some("iridescenceThicknessMinimum and Maximum are the same");
        material.iridescence = Iridescence {
            factor: Param { factor, texture: self.texture_of(&object, "iridescenceTexture", why_not)? },
            ior,
            thickness_minimum: minimum,
            thickness_maximum: Param {
                factor: maximum,
                texture: self.texture_of(&object, "iridescenceThicknessTexture", why_not.or(is_even))?,
            },
        };
        Ok(())
    }
}
