//! Materials: metallic-roughness, opacity, emission, `KHR_materials_emissive_strength`, `_ior`, `_specular`, `_unlit`.
//!
//! A texture that cannot change the picture, because its factor is 0 or because nothing asks for it, is not read.

use super::texture_info::{self, Info};
use super::{Loader, Result, extensions, name_or};
use crate::material::{AlphaMode, Material};
use crate::math::MAX_UV_SETS;
use crate::scene::MaterialId;
use crate::texture::{Param, TextureRef};
use gltf::json::Index;
use gltf::json::material::AlphaMode as JsonAlphaMode;
use gltf::json::validation::Checked;

const UNLIT: &str = "KHR_materials_unlit";
const IOR: &str = "KHR_materials_ior";
const SPECULAR: &str = "extensions/KHR_materials_specular";
const STRENGTH: &str = "extensions/KHR_materials_emissive_strength/emissiveStrength";

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
    let (mut material, at) = match index {
        None => (Material::default(), "the default material".to_owned()),
        Some(index) => {
            let found = loader.doc.item(&loader.doc.root.materials, index, pointer, "materials")?;
            let at = format!("/materials/{}", index.value());
            let name = name_or(found.name.as_ref(), "materials", index.value());
            (Reader { loader, at: &at }.material(found, name)?, at)
        }
    };
    let tex_coords = number_sets(loader, &mut material, &at)?;
    let normal_mapped = material.normal.texture.is_some();
    let read = Read { id: loader.builder.add_material(material), tex_coords, normal_mapped, pointer: at };
    loader.materials.insert(key, read.clone());
    Ok(read)
}

/// Numbers the sets of texture coordinates that a material uses 0, 1, ... in ascending order of the file's; returns those.
fn number_sets(loader: &Loader, material: &mut Material, at: &str) -> Result<Vec<u32>> {
    let mut sets: Vec<u32> = material.textures().map(|t| t.uv_set).collect();
    sets.sort_unstable();
    sets.dedup();
    if sets.len() > MAX_UV_SETS {
        let problem = format!("its textures use {} sets of texture coordinates: {sets:?}", sets.len());
        let fix = format!("At most {MAX_UV_SETS} different ones are read in one material.");
        return Err(loader.doc.error(at, problem, fix));
    }
    for texture in material.textures_mut() {
        texture.uv_set = sets.partition_point(|&set| set < texture.uv_set) as u32;
    }
    Ok(sets)
}

struct Reader<'l, 'd> {
    loader: &'l mut Loader<'d>,
    at: &'l str,
}

impl Reader<'_, '_> {
    /// The textures' `uv_set` is still the file's `texCoord`.
    fn material(&mut self, found: &gltf::json::Material, name: String) -> Result<Material> {
        if let Some(carried) = &found.extensions {
            extensions::note_carried(self.loader.doc, carried.others.keys(), self.at, &[]);
        }
        let mut material = Material { name, double_sided: found.double_sided, ..Material::default() };
        material.unlit = found.extensions.as_ref().is_some_and(|e| e.others.contains_key(UNLIT));
        self.base(found, &mut material)?;
        self.metallic_roughness(found, &mut material)?;
        self.normal(found, &mut material)?;
        self.emission(found, &mut material)?;
        self.specular(found, &mut material)?;
        material.ior = self.ior(found)?;
        if found.occlusion_texture.is_some() {
            self.skip("occlusionTexture", "a path tracer finds occlusion itself");
        }
        Ok(material)
    }

    /// Base colour and opacity, which are one factor and one texture.
    fn base(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        const AT: &str = "pbrMetallicRoughness/baseColorTexture";
        let pbr = &found.pbr_metallic_roughness;
        let [r, g, b, a] = self.unit("pbrMetallicRoughness/baseColorFactor", pbr.base_color_factor.0)?;
        material.base_color.factor = [r, g, b];
        material.opacity.factor = a;
        material.alpha_mode = self.alpha_mode(found)?;
        let (is_black, is_opaque) = ([r, g, b] == [0.0; 3], material.alpha_mode == AlphaMode::Opaque);
        let Some(info) = &pbr.base_color_texture else { return Ok(()) };
        if is_black && is_opaque {
            self.skip(AT, "baseColorFactor is 0");
            return Ok(());
        }
        let texture = self.texture(AT, Info::from(info))?;
        material.base_color.texture = texture.filter(|_| !is_black);
        material.opacity.texture = texture.filter(|_| !is_opaque);
        Ok(())
    }

    fn alpha_mode(&self, found: &gltf::json::Material) -> Result<AlphaMode> {
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

    fn metallic_roughness(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        const AT: &str = "pbrMetallicRoughness/metallicRoughnessTexture";
        let pbr = &found.pbr_metallic_roughness;
        let [metallic] = self.unit("pbrMetallicRoughness/metallicFactor", [pbr.metallic_factor.0])?;
        let [roughness] = self.unit("pbrMetallicRoughness/roughnessFactor", [pbr.roughness_factor.0])?;
        let is_nothing = metallic == 0.0 && roughness == 0.0;
        let why_not = is_nothing.then_some("metallicFactor and roughnessFactor are 0");
        let texture = self.slot(AT, pbr.metallic_roughness_texture.as_ref().map(Info::from), material, why_not)?;
        material.metallic = Param { factor: metallic, texture: texture.filter(|_| metallic > 0.0) };
        material.roughness = Param { factor: roughness, texture: texture.filter(|_| roughness > 0.0) };
        Ok(())
    }

    fn normal(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(map) = &found.normal_texture else { return Ok(()) };
        let [scale] = self.within("normalTexture/scale", [map.scale], f32::MIN..=f32::MAX, "a finite number", "")?;
        let texture = self.slot("normalTexture", Some(Info::from(map)), material, None)?;
        material.normal = Param { factor: scale, texture };
        Ok(())
    }

    fn emission(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
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
        let why_not = (factor == [0.0; 3]).then_some("emissiveFactor is 0");
        let info = found.emissive_texture.as_ref().map(Info::from);
        let texture = self.slot("emissiveTexture", info, material, why_not)?;
        material.emission = Param { factor, texture };
        Ok(())
    }

    fn specular(&mut self, found: &gltf::json::Material, material: &mut Material) -> Result<()> {
        let Some(specular) = found.extensions.as_ref().and_then(|e| e.specular.as_ref()) else {
            return Ok(());
        };
        let [factor] = self.unit(&format!("{SPECULAR}/specularFactor"), [specular.specular_factor.0])?;
        let color = self.positive(&format!("{SPECULAR}/specularColorFactor"), specular.specular_color_factor.0)?;
        let why_not = (factor == 0.0).then_some("specularFactor is 0");
        let info = specular.specular_texture.as_ref().map(Info::from);
        let texture = self.slot(&format!("{SPECULAR}/specularTexture"), info, material, why_not)?;
        material.specular = Param { factor, texture };
        let why_not = why_not.or((color == [0.0; 3]).then_some("specularColorFactor is 0"));
        let info = specular.specular_color_texture.as_ref().map(Info::from);
        let texture = self.slot(&format!("{SPECULAR}/specularColorTexture"), info, material, why_not)?;
        material.specular_color = Param { factor: color, texture };
        Ok(())
    }

    /// `KHR_materials_ior`: 1.5 by default; 0 stands for a surface that reflects everything.
    fn ior(&self, found: &gltf::json::Material) -> Result<f32> {
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

    /// The texture of a parameter that unlit materials do not have; `why_not` is why it need not be read at all.
    fn slot(
        &mut self,
        place: &str,
        info: Option<Info>,
        material: &Material,
        why_not: Option<&str>,
    ) -> Result<Option<TextureRef>> {
        let Some(info) = info else { return Ok(None) };
        let why_not = why_not.or(material.unlit.then_some("the material is unlit"));
        match why_not {
            None => self.texture(place, info),
            Some(why) => {
                self.skip(place, why);
                Ok(None)
            }
        }
    }

    fn texture(&mut self, place: &str, info: Info) -> Result<Option<TextureRef>> {
        texture_info::read(self.loader, info, &format!("{}/{place}", self.at))
    }

    fn skip(&mut self, place: &str, why: &str) {
        let what = format!("{}/{place}", self.at.trim_start_matches('/'));
        self.loader.builder.skip(what, why);
    }
}
