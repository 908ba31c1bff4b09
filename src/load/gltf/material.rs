//! Materials: metallic-roughness, emission, `KHR_materials_specular`, `KHR_materials_emissive_strength`.

use super::{Loader, Result, extensions, name_or};
use crate::material::Material;
use crate::scene::MaterialId;
use crate::texture::{Param, TextureRef};
use gltf::json::Index;
use gltf::json::material::AlphaMode;
use gltf::json::texture::Info;
use gltf::json::validation::Checked;

/// Exporters that compute in f32 overshoot a bound by a few units in the last place: that much is cut off silently.
const ROUNDING: f32 = 1e-5;

/// A material that was read, and what it asks of meshes.
#[derive(Clone, Debug)]
pub(super) struct Read {
    pub id: MaterialId,
    /// The file's sets of texture coordinates that its textures name, in the order of
    /// [`TextureRef::uv_set`](crate::texture::TextureRef); empty without textures.
    pub tex_coords: Vec<u32>,
    /// There is a normal map, so tangents are needed.
    pub normal_mapped: bool,
    /// For messages.
    pub pointer: String,
}

/// The material at `index` (glTF's default one for `None`), read once; `pointer` is where the index was found.
pub(super) fn read(loader: &mut Loader, index: Option<Index<gltf::json::Material>>, pointer: &str) -> Result<Read> {
    let key = index.map(|i| i.value());
    if let Some(done) = loader.materials.get(&key) {
        return Ok(done.clone());
    }
    let (material, at) = match index {
        None => (Material::default(), "the default material".to_owned()),
        Some(index) => {
            let found = loader.doc.item(&loader.doc.root.materials, index, pointer, "materials")?;
            let at = format!("/materials/{}", index.value());
            let name = name_or(found.name.as_ref(), "materials", index.value());
            (Reader { loader, at: &at }.material(found, name)?, at)
        }
    };
    let tex_coords = if material.textures().next().is_some() { vec![0] } else { Vec::new() };
    let normal_mapped = material.normal.texture.is_some();
    let read = Read { id: loader.builder.add_material(material), tex_coords, normal_mapped, pointer: at };
    loader.materials.insert(key, read.clone());
    Ok(read)
}

struct Reader<'l, 'd> {
    loader: &'l mut Loader<'d>,
    at: &'l str,
}

impl Reader<'_, '_> {
    fn material(&mut self, found: &gltf::json::Material, name: String) -> Result<Material> {
        self.opacity(found)?;
        if let Some(carried) = &found.extensions {
            extensions::check_carried(self.loader.doc, carried.others.keys(), self.at, &[])?;
        }
        let pbr = &found.pbr_metallic_roughness;
        let [r, g, b, a] = pbr.base_color_factor.0;
        let base = self.unit("pbrMetallicRoughness/baseColorFactor", [r, g, b, a])?;
        let [metallic] = self.unit("pbrMetallicRoughness/metallicFactor", [pbr.metallic_factor.0])?;
        let [roughness] = self.unit("pbrMetallicRoughness/roughnessFactor", [pbr.roughness_factor.0])?;
        let base_texture = self.info("pbrMetallicRoughness/baseColorTexture", pbr.base_color_texture.as_ref())?;
        let metallic_roughness =
            self.info("pbrMetallicRoughness/metallicRoughnessTexture", pbr.metallic_roughness_texture.as_ref())?;
        let normal = self.normal(found)?;
        let emission = self.emission(found)?;
        let mut material = Material {
            name,
            base_color: Param { factor: [base[0], base[1], base[2]], texture: base_texture },
            metallic: Param { factor: metallic, texture: metallic_roughness },
            roughness: Param { factor: roughness, texture: metallic_roughness },
            normal,
            emission,
            double_sided: found.double_sided,
            ..Material::default()
        };
        self.specular(found, &mut material)?;
        if found.occlusion_texture.is_some() {
            let what = format!("{}/occlusionTexture", self.at.trim_start_matches('/'));
            self.loader.builder.skip(what, "a path tracer finds occlusion itself");
        }
        Ok(material)
    }

    fn opacity(&self, found: &gltf::json::Material) -> Result<()> {
        let (doc, pointer) = (self.loader.doc, format!("{}/alphaMode", self.at));
        match found.alpha_mode {
            Checked::Valid(AlphaMode::Opaque) => Ok(()),
            Checked::Valid(AlphaMode::Mask | AlphaMode::Blend) => {
                Err(doc.bad(&pointer, "is not built yet", "Only OPAQUE is read: make the material opaque."))
            }
            Checked::Invalid => Err(doc.bad(&pointer, "is not an alpha mode", "Allowed: OPAQUE, MASK, BLEND.")),
        }
    }

    fn normal(&mut self, found: &gltf::json::Material) -> Result<Param<f32>> {
        let Some(map) = &found.normal_texture else {
            return Ok(Param::constant(1.0));
        };
        let others = map.extensions.as_ref().map(|e| &e.others);
        let texture = self.texture("normalTexture", map.index, map.tex_coord, others)?;
        let [scale] = self.within("normalTexture/scale", [map.scale], f32::MIN..=f32::MAX, "a finite number", "")?;
        Ok(Param { factor: scale, texture: Some(texture) })
    }

    fn emission(&mut self, found: &gltf::json::Material) -> Result<Param<[f32; 3]>> {
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
        let strength_at = "extensions/KHR_materials_emissive_strength/emissiveStrength";
        let [strength] = self.positive(strength_at, [strength])?;
        let texture = self.info("emissiveTexture", found.emissive_texture.as_ref())?;
        let factor = factor.map(|c| c * strength);
        if !factor.iter().all(|c| c.is_finite()) {
            let fix = "emissiveFactor x emissiveStrength is radiance in nits and must be finite.";
            return Err(self.loader.doc.bad(&format!("{}/{strength_at}", self.at), "is too large", fix));
        }
        Ok(Param { factor, texture })
    }

    fn specular(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(specular) = found.extensions.as_ref().and_then(|e| e.specular.as_ref()) else {
            return Ok(());
        };
        const AT: &str = "extensions/KHR_materials_specular";
        let [factor] = self.unit(&format!("{AT}/specularFactor"), [specular.specular_factor.0])?;
        let texture = self.info(&format!("{AT}/specularTexture"), specular.specular_texture.as_ref())?;
        let color = self.positive(&format!("{AT}/specularColorFactor"), specular.specular_color_factor.0)?;
        let color_texture =
            self.info(&format!("{AT}/specularColorTexture"), specular.specular_color_texture.as_ref())?;
        material.specular = Param { factor, texture };
        material.specular_color = Param { factor: color, texture: color_texture };
        Ok(())
    }

    /// Factors in [0, 1].
    fn unit<const N: usize>(&self, place: &str, values: [f32; N]) -> Result<[f32; N]> {
        let hint = "Did the exporter write percent, or 0 to 255? Use 1.0 for all of it.";
        let values = self.within(place, values, -ROUNDING..=1.0 + ROUNDING, "in [0, 1]", hint)?;
        Ok(values.map(|v| v.clamp(0.0, 1.0)))
    }

    /// Finite factors of at least 0.
    fn positive<const N: usize>(&self, place: &str, values: [f32; N]) -> Result<[f32; N]> {
        Ok(self.within(place, values, -ROUNDING..=f32::MAX, "at least 0 and finite", "")?.map(|v| v.max(0.0)))
    }

    fn within<const N: usize>(
        &self,
        place: &str,
        values: [f32; N],
        range: std::ops::RangeInclusive<f32>,
        allowed: &str,
        hint: &str,
    ) -> Result<[f32; N]> {
        if values.iter().all(|v| range.contains(v)) {
            return Ok(values);
        }
        let fix = format!("Each value must be {allowed}. {hint}");
        Err(self.loader.doc.bad(&format!("{}/{place}", self.at), "is out of range", fix.trim_end()))
    }

    fn info(&mut self, place: &str, info: Option<&Info>) -> Result<Option<TextureRef>> {
        let Some(info) = info else { return Ok(None) };
        let others = info.extensions.as_ref().map(|e| &e.others);
        self.texture(place, info.index, info.tex_coord, others).map(Some)
    }

    fn texture(
        &mut self,
        place: &str,
        index: Index<gltf::json::Texture>,
        tex_coord: u32,
        others: Option<&serde_json::Map<String, serde_json::Value>>,
    ) -> Result<TextureRef> {
        let at = format!("{}/{place}", self.at);
        if tex_coord != 0 {
            let fix = "Only texCoord 0 is read: bake the textures to one set of coordinates.";
            return Err(self.loader.doc.bad(&format!("{at}/texCoord"), "is not built yet", fix));
        }
        if let Some(others) = others {
            extensions::check_carried(self.loader.doc, others.keys(), &at, &[])?;
        }
        super::texture::read(self.loader, index, &format!("{at}/index")).map(TextureRef::plain)
    }
}
