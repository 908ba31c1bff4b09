//! MTL materials in glTF's terms; `docs/conventions.md` has the rules.

use super::mtl::Written;
use super::texture::{Meaning, Textures, roughness};
use crate::material::{AlphaMode, Material};
use crate::scene::SceneBuilder;
use crate::texture::Param;

/// Diffuse reflectance where the file says nothing.
const UNSAID: f32 = 0.8;

/// Phong's exponent that a white texel of `map_Ns` stands for where there is no `Ns`: the largest that the format names.
const MOST_NS: f32 = 1000.0;

/// The reflectance at normal incidence of glTF's standard dielectric, index 1.5.
const DIELECTRIC: f32 = 0.04;

/// How a material reflects.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Model {
    /// `illum` 0 or 1, or `Ks 0 0 0`.
    Lambert,
    /// Kd below a coat whose reflectance at normal incidence is Ks.
    Phong,
    /// Pr and Pm: glTF's metal and dielectric.
    Metal,
}

impl Model {
    fn of(w: &Written) -> Self {
        let is_metal = w.pr.is_some() || w.pm.is_some() || w.maps.pr.is_some() || w.maps.pm.is_some();
        // A map without a number stands for itself.
        let shines = w.ks.map_or(w.maps.ks.is_some(), |ks| ks.iter().any(|&c| c > 0.0));
        match () {
            () if is_metal => Self::Metal,
            () if !shines || w.illum.is_some_and(|i| i < 2.0) => Self::Lambert,
            () => Self::Phong,
        }
    }
}

/// Takes out the maps that the material does not use, so that their files are not opened.
pub(super) fn drop_unused_maps(w: &mut Written) {
    match Model::of(w) {
        Model::Lambert => (w.maps.ks, w.maps.ns) = (None, None),
        Model::Phong => {}
        Model::Metal => {
            w.maps.ks = None;
            if w.pr.is_some() || w.maps.pr.is_some() {
                w.maps.ns = None;
            }
        }
    }
    if w.maps.norm.is_some() {
        w.maps.bump = None;
    }
}

/// What faces without a material, or with one that is nowhere, are made of: Lambertian, and white below vertex colours.
pub(super) fn default(is_coloured: bool) -> Material {
    let base = if is_coloured { 1.0 } else { UNSAID };
    Material {
        base_color: Param::constant([base; 3]),
        metallic: Param::constant(0.0),
        specular: Param::constant(0.0),
        double_sided: true,
        ..Material::default()
    }
}

/// The material; `folder` is that of its MTL file.
pub(super) fn convert(w: &Written, folder: &str, textures: &mut Textures, builder: &mut SceneBuilder) -> Material {
    let mut converter = Converter { w, folder, textures, builder };
    let mut material = Material { name: w.name.clone(), ..default(false) };
    converter.diffuse(&mut material);
    match Model::of(w) {
        Model::Lambert => {}
        Model::Phong => converter.phong(&mut material),
        Model::Metal => converter.metal(&mut material),
    }
    converter.emission(&mut material);
    converter.opacity(&mut material);
    converter.relief(&mut material);
    converter.remarks();
    material
}

struct Converter<'c> {
    w: &'c Written,
    folder: &'c str,
    textures: &'c mut Textures,
    builder: &'c mut SceneBuilder,
}

impl Converter<'_> {
    fn warn(&mut self, what: &str) {
        self.builder.warn(format!("{}: \"{}\": {what}", self.w.at, self.w.name));
    }

    fn lose(&mut self, what: &str) {
        self.builder.lose(format!("{}: \"{}\": {what}", self.w.at, self.w.name));
    }

    fn texture(
        &mut self,
        map: Option<&super::map::Map>,
        meaning: Meaning,
    ) -> Option<(crate::texture::TextureRef, f32)> {
        self.textures.get(self.builder, self.folder, map?, meaning)
    }

    /// A number in [0, 1].
    fn unit(&mut self, key: &str, value: f32) -> f32 {
        if !(0.0..=1.0).contains(&value) {
            self.warn(&format!("{key} = {value} is outside [0, 1]: cut off there"));
        }
        value.clamp(0.0, 1.0)
    }

    fn unit_color(&mut self, key: &str, color: [f32; 3]) -> [f32; 3] {
        let inside = color.iter().all(|c| (0.0..=1.0).contains(c));
        if !inside {
            let [r, g, b] = color;
            self.warn(&format!("{key} = {r} {g} {b} is outside [0, 1]: cut off there"));
        }
        color.map(|c| c.clamp(0.0, 1.0))
    }

    fn diffuse(&mut self, m: &mut Material) {
        let texture = self.texture(self.w.maps.kd.as_ref(), Meaning::Color);
        let unsaid = if texture.is_some() { 1.0 } else { UNSAID };
        let kd = self.w.kd.unwrap_or([unsaid; 3]);
        if texture.is_some() && kd == [0.0; 3] {
            self.warn("Kd 0 0 0 makes map_Kd black, as the format has it; remove Kd to see the map");
        }
        m.base_color = Param { factor: self.unit_color("Kd", kd), texture: texture.map(|t| t.0) };
    }

    fn phong(&mut self, m: &mut Material) {
        let ks = self.unit_color("Ks", self.w.ks.unwrap_or([1.0; 3]));
        m.specular = Param::constant(1.0);
        m.specular_color.factor = ks.map(|c| c / DIELECTRIC);
        m.specular_color.texture = self.texture(self.w.maps.ks.as_ref(), Meaning::LinearColor).map(|t| t.0);
        self.gloss(m);
    }

    /// Roughness from `Ns` and its map.
    fn gloss(&mut self, m: &mut Material) {
        let ns = self.w.ns.unwrap_or(MOST_NS);
        m.roughness = match self.texture(self.w.maps.ns.as_ref(), Meaning::Gloss { ns }) {
            Some((texture, _)) => Param { factor: 1.0, texture: Some(texture) },
            None => Param::constant(roughness(self.w.ns.unwrap_or(0.0))),
        };
    }

    fn metal(&mut self, m: &mut Material) {
        m.specular = Param::constant(1.0);
        // Most exporters write `Ni 1` and mean nothing by it.
        m.ior = self.w.ni.filter(|ni| *ni > 1.0).unwrap_or(m.ior);
        // Their maps replace the numbers: exporters write both, and a product with `Pm 0` would lose the map.
        let roughness = self.texture(self.w.maps.pr.as_ref(), Meaning::Scalar);
        let metallic = self.texture(self.w.maps.pm.as_ref(), Meaning::Scalar);
        match (roughness, self.w.pr) {
            (Some((texture, _)), _) => m.roughness = Param { factor: 1.0, texture: Some(texture) },
            (None, Some(pr)) => m.roughness = Param::constant(self.unit("Pr", pr)),
            (None, None) => self.gloss(m),
        }
        m.metallic = match metallic {
            Some((texture, _)) => Param { factor: 1.0, texture: Some(texture) },
            None => Param::constant(self.unit("Pm", self.w.pm.unwrap_or(0.0))),
        };
    }

    fn emission(&mut self, m: &mut Material) {
        let texture = self.texture(self.w.maps.ke.as_ref(), Meaning::Emission);
        let unsaid = if texture.is_some() { 1.0 } else { 0.0 };
        let ke = self.w.ke.unwrap_or([unsaid; 3]).map(|c| c * texture.map_or(1.0, |t| t.1));
        if ke.iter().any(|c| *c < 0.0 || !c.is_finite()) {
            self.warn("Ke must be at least 0 and finite: cut off there");
        }
        let factor = ke.map(|c| if c.is_nan() { 0.0 } else { c.clamp(0.0, f32::MAX) });
        m.emission = Param { factor, texture: texture.map(|t| t.0) };
    }

    fn opacity(&mut self, m: &mut Material) {
        let said = self.w.d.or(self.w.tr.map(|tr| 1.0 - tr));
        let opacity = self.unit(if self.w.d.is_some() { "d" } else { "1 - Tr" }, said.unwrap_or(1.0));
        if opacity == 0.0 {
            self.warn(match self.w.d {
                Some(_) => "d 0: nothing of it is seen",
                None => "Tr 1: nothing of it is seen. Some exporters write Tr and mean d: use d 1 then",
            });
        }
        let texture = self.texture(self.w.maps.d.as_ref(), Meaning::Opacity).map(|t| t.0);
        if opacity < 1.0 || texture.is_some() {
            m.alpha_mode = AlphaMode::Blend;
            m.opacity = Param { factor: opacity, texture };
        }
    }

    /// Normal or height map.
    fn relief(&mut self, m: &mut Material) {
        if let Some(map) = &self.w.maps.norm
            && let Some((texture, _)) = self.texture(Some(map), Meaning::Normal)
        {
            if (map.base, map.gain) != (0.0, 1.0) {
                self.lose("-mm of a normal map is ignored");
            }
            m.normal = Param { factor: map.bump, texture: Some(texture) };
        }
        if let Some(map) = &self.w.maps.bump
            && let Some((texture, gain)) = self.texture(Some(map), Meaning::Height)
        {
            m.bump = Param { factor: map.bump * gain, texture: Some(texture) };
        }
    }

    fn remarks(&mut self) {
        if !self.w.ignored.is_empty() {
            self.lose(&format!("{} ignored: there is nothing like it here", self.w.ignored.join(", ")));
        }
        if let Some(illum @ (4.0 | 6.0 | 7.0 | 9.0)) = self.w.illum {
            self.lose(&format!("illum {illum} asks for refraction, which is not built: only d lets light through"));
        }
    }
}
