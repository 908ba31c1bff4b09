//! What glTF itself has, and the extensions that add to its parameters: `KHR_materials_emissive_strength`, `_specular`,
//! `_ior`.

use super::super::{Result, texture_info::Info};
use super::{ROUNDING, Reader};
use crate::material::{AlphaMode, Material};
use crate::texture::Param;
use gltf::json::material::AlphaMode as JsonAlphaMode;
use gltf::json::validation::Checked;

pub(super) const IOR: &str = "KHR_materials_ior";
pub(super) const SPECULAR: &str = "extensions/KHR_materials_specular";
const STRENGTH: &str = "extensions/KHR_materials_emissive_strength/emissiveStrength";

impl Reader<'_, '_> {
    pub(super) fn base(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let pbr = &found.pbr_metallic_roughness;
        let factor = self.unit("pbrMetallicRoughness/baseColorFactor", pbr.base_color_factor.0)?;
        material.alpha_mode = self.alpha_mode(found)?;
        let info = pbr.base_color_texture.as_ref().map(Info::from);
        self.color_and_opacity(material, factor, "pbrMetallicRoughness/baseColorTexture", info, "baseColorFactor is 0")
    }

    /// Base colour and opacity, which are one factor and one texture; `is_black` says that the factor is 0.
    pub(super) fn color_and_opacity(
        &mut self,
        material: &mut Material,
        [r, g, b, a]: [f32; 4],
        place: &str,
        info: Option<Info>,
        is_black: &str,
    ) -> Result<()> {
        material.base_color.factor = [r, g, b];
        material.opacity.factor = a;
        let has_color = [r, g, b] != [0.0; 3];
        let is_opaque = material.alpha_mode == AlphaMode::Opaque;
        let why_not = (!has_color && is_opaque).then_some(is_black);
        let texture = self.slot(place, info, why_not)?;
        material.base_color.texture = texture.filter(|_| has_color);
        material.opacity.texture = texture.filter(|_| !is_opaque);
        Ok(())
    }

    pub(super) fn alpha_mode(&self, found: &gltf::json::Material) -> Result<AlphaMode> {
        match found.alpha_mode {
            Checked::Valid(JsonAlphaMode::Opaque) => Ok(AlphaMode::Opaque),
            Checked::Valid(JsonAlphaMode::Blend) => Ok(AlphaMode::Blend),
            Checked::Valid(JsonAlphaMode::Mask) => {
                let [cutoff] = self.positive("alphaCutoff", [found.alpha_cutoff.unwrap_or_default().0])?;
                Ok(AlphaMode::Mask { cutoff })
            }
            Checked::Invalid => {
                let at = format!("{}/alphaMode", self.at);
                Err(self.loader.doc.bad(&at, "is not an alpha mode", "Allowed: OPAQUE, MASK, BLEND."))
            }
        }
    }

    pub(super) fn metallic_roughness(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        const AT: &str = "pbrMetallicRoughness/metallicRoughnessTexture";
        let pbr = &found.pbr_metallic_roughness;
        let [metallic] = self.unit("pbrMetallicRoughness/metallicFactor", [pbr.metallic_factor.0])?;
        let [roughness] = self.unit("pbrMetallicRoughness/roughnessFactor", [pbr.roughness_factor.0])?;
        let is_nothing = metallic == 0.0 && roughness == 0.0;
        let why_not = is_nothing.then_some("metallicFactor and roughnessFactor are 0").or(Self::unlit(material));
        let texture = self.slot(AT, pbr.metallic_roughness_texture.as_ref().map(Info::from), why_not)?;
        material.metallic = Param { factor: metallic, texture: texture.filter(|_| metallic > 0.0) };
        material.roughness = Param { factor: roughness, texture: texture.filter(|_| roughness > 0.0) };
        Ok(())
    }

    pub(super) fn normal(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(map) = &found.normal_texture else { return Ok(()) };
        let [scale] = self.within("normalTexture/scale", [map.scale], f32::MIN..=f32::MAX, "a finite number", "")?;
        let texture = self.slot("normalTexture", Some(Info::from(map)), Self::unlit(material))?;
        material.normal = Param { factor: scale, texture };
        Ok(())
    }

    pub(super) fn emission(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let factor = self.positive("emissiveFactor", found.emissive_factor.0)?;
        if factor.iter().any(|&c| c > 1.0 + ROUNDING) {
            let text = format!(
                "{}/emissiveFactor = {factor:?} is above 1, which glTF does not allow: used as it stands \
                 (KHR_materials_emissive_strength is the way to say it)",
                self.at
            );
            self.loader.builder.warn(text);
        }
        let strength = found.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
        let strength = strength.map_or(1.0, |s| s.emissive_strength.0);
        let [strength] = self.positive(STRENGTH, [strength])?;
        let factor = factor.map(|c| c * strength);
        if !factor.iter().all(|c| c.is_finite()) {
            let fix = "emissiveFactor x emissiveStrength is radiance in nits and must be finite.";
            return Err(self.loader.doc.bad(&format!("{}/{STRENGTH}", self.at), "is too large", fix));
        }
        let why_not = (factor == [0.0; 3]).then_some("emissiveFactor is 0").or(Self::unlit(material));
        let info = found.emissive_texture.as_ref().map(Info::from);
        let texture = self.slot("emissiveTexture", info, why_not)?;
        material.emission = Param { factor, texture };
        Ok(())
    }

    pub(super) fn specular(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(specular) = found.extensions.as_ref().and_then(|e| e.specular.as_ref()) else {
            return Ok(());
        };
        let [factor] = self.unit(&format!("{SPECULAR}/specularFactor"), [specular.specular_factor.0])?;
        let color = self.positive(&format!("{SPECULAR}/specularColorFactor"), specular.specular_color_factor.0)?;
        let why_not = (factor == 0.0).then_some("specularFactor is 0").or(Self::without_layers(material));
        let info = specular.specular_texture.as_ref().map(Info::from);
        let texture = self.slot(&format!("{SPECULAR}/specularTexture"), info, why_not)?;
        material.specular = Param { factor, texture };
        let why_not = why_not.or((color == [0.0; 3]).then_some("specularColorFactor is 0"));
        let info = specular.specular_color_texture.as_ref().map(Info::from);
        let texture = self.slot(&format!("{SPECULAR}/specularColorTexture"), info, why_not)?;
        material.specular_color = Param { factor: color, texture };
        Ok(())
    }

    /// `KHR_materials_ior`: 1.5 by default; 0 stands for a surface that reflects everything.
    pub(super) fn ior(&self, found: &gltf::json::Material) -> Result<f32> {
        let value = found.extensions.as_ref().and_then(|e| e.others.get(IOR)).and_then(|e| e.get("ior"));
        let Some(value) = value else { return Ok(Material::default().ior) };
        let ior = value.as_f64().map_or(f32::NAN, |v| v as f32);
        if ior == 0.0 || (1.0..=f32::MAX).contains(&ior) {
            return Ok(ior);
        }
        let fix =
            "An index of refraction is at least 1 (glass 1.5, water 1.33), or 0: a surface that reflects everything.";
        Err(self.loader.doc.bad(&format!("{}/extensions/{IOR}/ior", self.at), "is out of range", fix))
    }
}
