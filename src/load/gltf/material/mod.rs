//! Materials: metallic-roughness, opacity, emission, and the extensions of Khronos (`KHR_materials_*`).
//!
//! A texture that cannot change the picture, because its factor is 0 or because nothing asks for it, is not read.

mod core;
mod disney;
mod glass;
mod layers;
mod object;
mod specular_glossiness;

use super::texture_info::{self, Info};
use super::{Loader, Result, extensions, name_or};
use crate::material::Material;
use crate::math::MAX_UV_SETS;
use crate::scene::MaterialId;
use crate::texture::{TextureRef, UvTransform};
use gltf::json::Index;

const UNLIT: &str = "KHR_materials_unlit";

/// Exporters that compute in f32 overshoot a bound by a few units in the last place: that much is cut off silently.
const ROUNDING: f32 = 1e-5;

/// A material that was read, and what it asks of meshes.
#[derive(Clone, Debug)]
pub(super) struct Read {
    pub id: MaterialId,
    /// The file's sets of texture coordinates that its textures name, in the order of
    /// [`TextureRef::uv_set`](crate::texture::TextureRef); empty without textures.
    pub tex_coords: Vec<u32>,
    /// Along which coordinates tangents run, if it needs tangents.
    pub tangents: Option<Along>,
    /// For messages.
    pub pointer: String,
}

/// The texture coordinates along whose u tangents run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Along {
    /// Place in [`Read::tex_coords`].
    pub set: usize,
    /// Applied to them first.
    pub transform: Option<UvTransform>,
    /// No texture reads them for the tangents' sake: meshes without them do without tangents.
    pub is_optional: bool,
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
    let tangents = material.needs_tangents().then(|| match material.tangent_map() {
        Some(map) => Along { set: map.uv_set as usize, transform: map.transform, is_optional: false },
        // Sets are in ascending order; where 0 could not be had besides four others, the first of those serves.
        None => Along { set: 0, transform: None, is_optional: true },
    });
    let read = Read { id: loader.builder.add_material(material), tex_coords, tangents, pointer: at };
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
    // Tangents that no texture goes with run along TEXCOORD_0.
    let is_alone = material.needs_tangents() && material.tangent_map().is_none();
    if is_alone && sets.first() != Some(&0) && sets.len() < MAX_UV_SETS {
        sets.insert(0, 0);
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
        material.disney = self.disney(found)?;
        let is_glossy = self.specular_glossiness(found, &mut material)?;
        if !is_glossy {
            self.base(found, &mut material)?;
            self.metallic_roughness(found, &mut material)?;
        }
        self.normal(found, &mut material)?;
        self.emission(found, &mut material)?;
        if !is_glossy {
            self.specular(found, &mut material)?;
            material.ior = self.ior(found)?;
            self.transmission(found, &mut material)?;
        }
        self.clearcoat(found, &mut material)?;
        self.sheen(found, &mut material)?;
        self.anisotropy(found, &mut material)?;
        self.iridescence(found, &mut material)?;
        self.diffuse_transmission(found, &mut material)?;
        self.volume(found, &mut material)?;
        self.dispersion(found, &mut material)?;
        if found.occlusion_texture.is_some() {
            self.skip("occlusionTexture", "a path tracer finds occlusion itself");
        }
        Ok(material)
    }

    /// Why what only lit materials have need not be read, if it need not.
    fn unlit(material: &Material) -> Option<&'static str> {
        material.unlit.then_some("the material is unlit")
    }

    /// Why what only the layers of glTF have need not be read, if it need not.
    fn without_layers(material: &Material) -> Option<&'static str> {
        Self::unlit(material).or(material.disney.is_some().then_some("prt_disney takes the place of this"))
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

    /// The texture of a parameter; `why_not` is why it need not be read at all.
    fn slot(&mut self, place: &str, info: Option<Info>, why_not: Option<&str>) -> Result<Option<TextureRef>> {
        let Some(info) = info else { return Ok(None) };
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
