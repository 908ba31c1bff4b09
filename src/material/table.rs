//! Materials as shading reads them, and their textures applied.

use super::Material;
use super::bsdf::Surface;
use crate::id::TextureId;
use crate::math::V3;
use crate::texture::lookup::{Encoding, NO_TEXTURE, TextureTable};
use simd::{Float, Lanes, Mask, Uint};

const RECORDS: u32 = 6;
const DOUBLE_SIDED: u32 = 1;
const EMISSIVE: u32 = 2;

/// Six 16-byte records a material.
///
/// | record | x | y | z | w |
/// |---|---|---|---|---|
/// | 0 | base r | g | b | flags |
/// | 1 | metallic | roughness | specular | normal scale |
/// | 2 | dielectric f0 r | g | b | - |
/// | 3 | emission r | g | b | emission texture |
/// | 4 | base texture | metallic-roughness | normal | specular |
/// | 5 | specular colour texture | - | - | - |
#[derive(Clone, Debug, Default)]
pub struct MaterialTable {
    records: Vec<[f32; 4]>,
    /// Some material has a texture other than normal or emission.
    is_textured: bool,
    /// Some material emits.
    is_emissive: bool,
}

impl MaterialTable {
    /// All materials of a scene, in order; a scene without any gets the default one.
    pub fn new(materials: &[Material]) -> Self {
        let mut table = Self::default();
        for m in materials {
            table.push(m);
        }
        if materials.is_empty() {
            table.push(&Material::default());
        }
        table
    }

    fn push(&mut self, m: &Material) {
        let id = |t: Option<TextureId>| f32::from_bits(t.map_or(NO_TEXTURE, |t| t.0));
        let emits = m.emission.factor.iter().any(|&e| e > 0.0);
        let flags = if m.double_sided { DOUBLE_SIDED } else { 0 } | if emits { EMISSIVE } else { 0 };
        let ([r, g, b], [er, eg, eb]) = (m.base_color.factor, m.emission.factor);
        // 0.04 = ((1.5 - 1) / (1.5 + 1))^2: glTF's dielectric.
        let f0 = m.specular_color.factor.map(|c| 0.04 * c);
        self.records.extend([
            [r, g, b, f32::from_bits(flags)],
            [m.metallic.factor, m.roughness.factor, m.specular.factor, m.normal.factor],
            [f0[0], f0[1], f0[2], 0.0],
            [er, eg, eb, id(m.emission.texture)],
            [id(m.base_color.texture), id(m.roughness.texture), id(m.normal.texture), id(m.specular.texture)],
            [id(m.specular_color.texture), 0.0, 0.0, 0.0],
        ]);
        let textures = [m.base_color.texture, m.roughness.texture, m.specular.texture, m.specular_color.texture];
        self.is_textured |= textures.iter().any(Option::is_some);
        self.is_emissive |= emits;
    }

    /// Whether anything emits at all.
    pub fn is_emissive(&self) -> bool {
        self.is_emissive
    }

    /// Whether any reflection parameter has a texture.
    pub fn is_textured(&self) -> bool {
        self.is_textured
    }

    #[inline(always)]
    fn record<L: Lanes>(&self, material: L::U, k: u32) -> [L::F; 4] {
        (material * L::U::splat(RECORDS) + L::U::splat(k)).records(&self.records)
    }

    /// Emitted radiance, nits, towards the front (`front`) or the back of the surface at texture coordinate (`u`, `v`).
    #[inline(always)]
    pub fn emission<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        front: L::M,
        u: L::F,
        v: L::F,
        active: L::M,
    ) -> V3<L> {
        let flags = self.record::<L>(material, 0)[3].to_bits();
        let emits = active & flags.has(EMISSIVE) & (front | flags.has(DOUBLE_SIDED));
        if !emits.any() {
            return V3::zero();
        }
        let [r, g, b, texture] = self.record::<L>(material, 3);
        let factor = V3::<L>::new(r, g, b).masked(emits);
        let texture = texture.to_bits();
        let textured = emits & !texture.eq(L::U::splat(NO_TEXTURE));
        if !textured.any() {
            return factor;
        }
        let texel = textures.lookup::<L>(texture, u, v, Encoding::Srgb);
        (factor * texel.rgb).or_else(textured, factor)
    }

    /// Reflection parameters at texture coordinate (`u`, `v`).
    #[inline(always)]
    pub fn surface<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        u: L::F,
        v: L::F,
        active: L::M,
    ) -> Surface<L> {
        let [r, g, b, _] = self.record::<L>(material, 0);
        let [metallic, roughness, specular, _] = self.record::<L>(material, 1);
        let [f0r, f0g, f0b, _] = self.record::<L>(material, 2);
        let mut s =
            Surface { base: V3::<L>::new(r, g, b), metallic, roughness, specular, f0: V3::<L>::new(f0r, f0g, f0b) };
        if self.is_textured {
            let none = L::U::splat(NO_TEXTURE);
            let [base, rough, _, spec] = self.record::<L>(material, 4);
            let (base, rough, spec) = (base.to_bits(), rough.to_bits(), spec.to_bits());
            let has = active & !base.eq(none);
            if has.any() {
                s.base = (s.base * textures.lookup::<L>(base, u, v, Encoding::Srgb).rgb).or_else(has, s.base);
            }
            let has = active & !rough.eq(none);
            if has.any() {
                let t = textures.lookup::<L>(rough, u, v, Encoding::Linear);
                s.roughness = (s.roughness * t.rgb.y).or_else(has, s.roughness);
                s.metallic = (s.metallic * t.rgb.z).or_else(has, s.metallic);
            }
            let has = active & !spec.eq(none);
            if has.any() {
                let t = textures.lookup::<L>(spec, u, v, Encoding::Linear);
                s.specular = (s.specular * t.a).or_else(has, s.specular);
            }
            let color = self.record::<L>(material, 5)[0].to_bits();
            let has = active & !color.eq(none);
            if has.any() {
                s.f0 = (s.f0 * textures.lookup::<L>(color, u, v, Encoding::Srgb).rgb).or_else(has, s.f0);
            }
        }
        s.f0 = s.f0.min(V3::splat([1.0; 3]));
        s
    }

    /// The normal map's vector in tangent space (not normalised), and the lanes that have one.
    #[inline(always)]
    pub fn normal_map<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        u: L::F,
        v: L::F,
        active: L::M,
    ) -> (V3<L>, L::M) {
        let texture = self.record::<L>(material, 4)[2].to_bits();
        let has = active & !texture.eq(L::U::splat(NO_TEXTURE));
        let flat = V3::splat([0.0, 0.0, 1.0]);
        if !has.any() {
            return (flat, has);
        }
        let scale = self.record::<L>(material, 1)[3];
        let t = textures.lookup::<L>(texture, u, v, Encoding::Linear).rgb;
        let (two, one) = (L::F::splat(2.0), L::F::one());
        let n = V3::<L>::new((t.x * two - one) * scale, (t.y * two - one) * scale, t.z * two - one);
        (n.or_else(has, flat), has)
    }
}
