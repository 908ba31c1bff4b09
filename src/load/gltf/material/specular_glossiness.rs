//! `KHR_materials_pbrSpecularGlossiness`, the model before metallic-roughness; archived, and still in many files.

use super::Reader;
use super::core::{IOR, SPECULAR};
use super::glass::TRANSMISSION;
use super::object::Object;
use crate::load::gltf::Result;
use crate::load::gltf::texture_info::Info;
use crate::material::Material;
use crate::texture::Param;

const NAME: &str = "KHR_materials_pbrSpecularGlossiness";
/// Why its neighbours are not read.
pub(super) const EXCLUDES: &str = "KHR_materials_pbrSpecularGlossiness excludes it";

impl Reader<'_, '_> {
    /// Reads the extension in place of metallic-roughness, as it asks for, with opacity; `false` if it is not there or
    /// something else takes its place.
    pub(super) fn specular_glossiness(
        &mut self,
        found: &gltf::json::Material,
        material: &mut Material,
    ) -> Result<bool> {
        let Some(object) = self.extension(found, NAME)? else { return Ok(false) };
        if material.disney.is_some() {
            self.skip(&format!("extensions/{NAME}"), "prt_disney takes the place of this");
            return Ok(false);
        }
        material.specular_glossiness = true;
        material.metallic = Param::constant(0.0);
        material.ior = 0.0;
        material.alpha_mode = self.alpha_mode(found)?;
        let diffuse = self.shares(&object, "diffuseFactor", [1.0; 4])?;
        let specular = self.shares(&object, "specularFactor", [1.0; 3])?;
        let glossiness = self.share(&object, "glossinessFactor", 1.0)?;
        self.diffuse(&object, material, diffuse)?;
        let is_nothing = specular == [0.0; 3] && glossiness == 0.0;
        let why_not = is_nothing.then_some("specularFactor and glossinessFactor are 0").or(Self::unlit(material));
        let texture = self.texture_of(&object, "specularGlossinessTexture", why_not)?;
        material.specular_color = Param { factor: specular, texture: texture.filter(|_| specular != [0.0; 3]) };
        material.roughness = Param { factor: 1.0 - glossiness, texture: texture.filter(|_| glossiness > 0.0) };
        self.skip_replaced(found);
        Ok(true)
    }

    fn diffuse(&mut self, object: &Object, material: &mut Material, factor: [f32; 4]) -> Result<()> {
        const KEY: &str = "diffuseTexture";
        let place = object.place(KEY);
        let info = match object.members.get(KEY) {
            None => None,
            Some(value) => Some(Info::from_json(self.loader.doc, value, &format!("{}/{place}", self.at))?),
        };
        self.color_and_opacity(material, factor, &place, info, "diffuseFactor is 0")
    }

    /// Lists what the extension replaces or excludes.
    fn skip_replaced(&mut self, found: &gltf::json::Material) {
        const REPLACED: &str = "KHR_materials_pbrSpecularGlossiness takes the place of this";
        let pbr = &found.pbr_metallic_roughness;
        if pbr.base_color_texture.is_some() {
            self.skip("pbrMetallicRoughness/baseColorTexture", REPLACED);
        }
        if pbr.metallic_roughness_texture.is_some() {
            self.skip("pbrMetallicRoughness/metallicRoughnessTexture", REPLACED);
        }
        let Some(extensions) = &found.extensions else { return };
        if extensions.specular.is_some() {
            self.skip(SPECULAR, EXCLUDES);
        }
        for name in [IOR, TRANSMISSION] {
            if extensions.others.contains_key(name) {
                self.skip(&format!("extensions/{name}"), EXCLUDES);
            }
        }
    }
}
