//! Materials as shading reads them, and their textures applied. What only some of them have is in `extras.rs`.

mod extras;

use super::energy::{Brdf, Energy};
use super::surface::Surface;
use super::{AlphaMode, Material};
use crate::math::{UvSets, V3};
use crate::texture::TextureRef;
use crate::texture::lookup::{Encoding, NO_TEXTURE, Texel, TextureTable};
use crate::texture::mips::Average;
use extras::ExtrasTable;
use simd::{Float, Lanes, Mask, Uint};

const RECORDS: u32 = 8;
const DOUBLE_SIDED: u32 = 1;
const EMISSIVE: u32 = 2;
const MASK: u32 = 4;
const BLEND: u32 = 8;
const UNLIT: u32 = 16;
/// The metallic texture is the roughness texture, as always in glTF.
const METALLIC_WITH_ROUGHNESS: u32 = 32;
/// Specular and glossiness in place of metal and roughness.
const GLOSSY: u32 = 64;
/// The flags from here on are those of [`extras`].
const EXTRAS_SHIFT: u32 = 8;

/// Indices of refraction above this reflect all but 4e-6 at normal incidence: as good as 0, which stands for infinite.
const LARGEST_IOR: f32 = 1e6;

/// Eight 16-byte records a material.
///
/// | record | x | y | z | w |
/// |---|---|---|---|---|
/// | 0 | base r | g | b | flags |
/// | 1 | metallic | roughness | specular | normal scale |
/// | 2 | dielectric f0 r | g | b | opacity |
/// | 3 | emission r | g | b | emission texture |
/// | 4 | base texture | roughness | normal | specular |
/// | 5 | specular colour texture | metallic, if it is not roughness' | opacity | bump |
/// | 6 | alpha cutoff | bump height | bump without transform | - |
/// | 7 | place in the table of extras | index of refraction | number of its albedo tables | - |
///
/// Textures are bindings of the scene's [`TextureTable`].
#[derive(Clone, Debug, Default)]
pub struct MaterialTable {
    records: Vec<[f32; 4]>,
    energy: Energy,
    /// Some material has a texture other than normal, bump, opacity or emission.
    is_textured: bool,
    /// Some material emits.
    is_emissive: bool,
    /// Some material is seen through.
    has_alpha: bool,
    /// Some material is unlit.
    has_unlit: bool,
    /// Some material has a height map.
    has_bump: bool,
    /// Some material has specular and glossiness.
    has_glossy: bool,
    /// What only some materials have.
    extras: ExtrasTable,
}

impl MaterialTable {
    /// All materials of a scene, in order, their textures bound in `textures`; a scene without any gets the default one.
    pub fn new(materials: &[Material], textures: &mut TextureTable, brdf: Brdf) -> Self {
        let mut table = Self { energy: Energy::new(brdf), ..Self::default() };
        for m in materials {
            table.push(m, textures);
        }
        if materials.is_empty() {
            table.push(&Material::default(), textures);
        }
        if table.has_volume() {
            table.energy.add_glass();
        }
        if table.has_anisotropy() {
            table.energy.add_stretched();
        }
        if table.has_iridescence() {
            table.energy.add_film();
        }
        table
    }

    fn push(&mut self, m: &Material, textures: &mut TextureTable) {
        let emits = !m.unlit && m.emission.factor.iter().any(|&e| e > 0.0);
        let (alpha, cutoff) = match m.alpha_mode {
            AlphaMode::Opaque => (0, 0.0),
            AlphaMode::Mask { cutoff } => (MASK, cutoff),
            AlphaMode::Blend => (BLEND, 0.0),
        };
        let shares = m.metallic.texture.is_some() && m.metallic.texture == m.roughness.texture;
        let flags =
            [(m.double_sided, DOUBLE_SIDED), (emits, EMISSIVE), (m.unlit, UNLIT), (shares, METALLIC_WITH_ROUGHNESS)];
        let flags = flags.iter().filter(|f| f.0).fold(alpha, |bits, f| bits | f.1);
        // An unlit surface shows its base colour as it is.
        let is_glossy = m.specular_glossiness && !m.unlit;
        let (place, extras) = self.extras.push(m, textures);
        let flags = flags | if is_glossy { GLOSSY } else { 0 } | extras << EXTRAS_SHIFT;
        let mut id = |t, average| f32::from_bits(textures.bind(t, average));
        let (values, light) = (Average::Values, Average::Light);
        // The colour of a surface is that of the part of it that is there.
        let is_cut_out = alpha != 0 && m.opacity.texture == m.base_color.texture;
        let base = if is_cut_out { Average::LightByOpacity } else { light };
        let ([r, g, b], [er, eg, eb]) = (m.base_color.factor, m.emission.factor);
        // KHR_materials_ior: ior 0 stands for infinite, which reflects everything.
        let ior = if m.ior > LARGEST_IOR { 0.0 } else { m.ior };
        let reflectance = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let f0 = m.specular_color.factor.map(|c| reflectance * c);
        let metallic = if shares { None } else { m.metallic.texture };
        let bump = if m.bump.factor == 0.0 { None } else { m.bump.texture };
        let plain_bump = bump.map(|b| TextureRef::plain(b.texture));
        self.records.extend([
            [r, g, b, f32::from_bits(flags)],
            [m.metallic.factor, m.roughness.factor, m.specular.factor, m.normal.factor],
            [f0[0], f0[1], f0[2], m.opacity.factor],
            // Emission is sampled as light, opacity decides for shadow rays as well, slopes are differences of texels: all
            // of these at level 0.
            [er, eg, eb, id(m.emission.texture, Average::Never)],
            [
                id(m.base_color.texture, base),
                id(m.roughness.texture, values),
                id(m.normal.texture, values),
                id(m.specular.texture, values),
            ],
            [
                id(m.specular_color.texture, light),
                id(metallic, values),
                id(m.opacity.texture, Average::Never),
                id(bump, Average::Never),
            ],
            [cutoff, m.bump.factor, id(plain_bump, Average::Never), 0.0],
            [f32::from_bits(place), ior, f32::from_bits(self.energy.class(ior)), 0.0],
        ]);
        let textures = [
            m.base_color.texture,
            m.roughness.texture,
            m.metallic.texture,
            m.specular.texture,
            m.specular_color.texture,
        ];
        self.is_textured |= textures.iter().any(Option::is_some);
        self.is_emissive |= emits;
        self.has_alpha |= alpha != 0;
        self.has_unlit |= m.unlit;
        self.has_bump |= bump.is_some();
        self.has_glossy |= is_glossy;
    }

    /// The albedos that its surfaces are compensated by.
    pub fn energy(&self) -> &Energy {
        &self.energy
    }

    /// Whether anything emits at all.
    pub fn is_emissive(&self) -> bool {
        self.is_emissive
    }

    /// Whether any reflection parameter has a texture.
    pub fn is_textured(&self) -> bool {
        self.is_textured
    }

    /// Whether anything is seen through.
    pub fn has_alpha(&self) -> bool {
        self.has_alpha
    }

    /// Whether anything is unlit.
    pub fn has_unlit(&self) -> bool {
        self.has_unlit
    }

    /// Whether anything has what only some materials have.
    pub fn has_extras(&self) -> bool {
        self.extras.has(extras::ANY)
    }

    /// Whether anything has a height map.
    pub fn has_bump(&self) -> bool {
        self.has_bump
    }

    /// The lanes whose material is unlit.
    #[inline(always)]
    pub fn unlit<L: Lanes>(&self, material: L::U, active: L::M) -> L::M {
        active & self.record::<L>(material, 0)[3].to_bits().has(UNLIT)
    }

    /// The lanes whose material has a front only.
    #[inline(always)]
    pub fn single_sided<L: Lanes>(&self, material: L::U, active: L::M) -> L::M {
        // Both sides of a boundary count.
        active & !self.record::<L>(material, 0)[3].to_bits().has(DOUBLE_SIDED | extras::VOLUME << EXTRAS_SHIFT)
    }

    /// Share of a surface that is there, in [0, 1]: 1 if opaque, 0 or 1 under a mask, else the opacity. `vertex` is the
    /// vertex colour's part of it.
    #[inline(always)]
    pub fn coverage<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        uvs: &UvSets<L>,
        vertex: L::F,
        active: L::M,
    ) -> L::F {
        let (zero, one) = (L::F::zero(), L::F::one());
        let flags = self.record::<L>(material, 0)[3].to_bits();
        let masks = active & flags.has(MASK);
        let blends = active & flags.has(BLEND);
        if !(masks | blends).any() {
            return one;
        }
        let mut opacity = self.record::<L>(material, 2)[3] * vertex;
        let texture = self.record::<L>(material, 5)[2].to_bits();
        let has = (masks | blends) & !texture.eq(L::U::splat(NO_TEXTURE));
        if has.any() {
            let texel = textures.lookup::<L>(texture, &uvs.sharp(), Encoding::Linear);
            opacity = (opacity * texel.a).or_else(has, opacity);
        }
        let cutoff = self.record::<L>(material, 6)[0];
        let there = one.or_else(opacity.ge(cutoff), zero);
        there.or_else(masks, opacity.max(zero).min(one).or_else(blends, one))
    }

    #[inline(always)]
    pub(super) fn record<L: Lanes>(&self, material: L::U, k: u32) -> [L::F; 4] {
        (material * L::U::splat(RECORDS) + L::U::splat(k)).records(&self.records)
    }

    /// Emitted radiance, nits, towards the front (`front`) or the back of the surface at texture coordinates `uvs`.
    #[inline(always)]
    pub fn emission<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        front: L::M,
        uvs: &UvSets<L>,
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
        let texel = textures.lookup::<L>(texture, &uvs.sharp(), Encoding::Srgb);
        (factor * texel.rgb).or_else(textured, factor)
    }

    /// The parameters that every material has at texture coordinates `uvs`.
    #[inline(always)]
    pub fn surface<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        uvs: &UvSets<L>,
        active: L::M,
    ) -> Surface<L> {
        let [r, g, b, _] = self.record::<L>(material, 0);
        let [_, ior, class, _] = self.record::<L>(material, 7);
        let [metallic, roughness, specular, _] = self.record::<L>(material, 1);
        let [f0r, f0g, f0b, _] = self.record::<L>(material, 2);
        let mut s = Surface {
            base: V3::<L>::new(r, g, b),
            metallic,
            roughness,
            specular,
            f0: V3::<L>::new(f0r, f0g, f0b),
            ior,
            class: class.to_bits(),
            extras: None,
        };
        if self.is_textured {
            let none = L::U::splat(NO_TEXTURE);
            let [base, rough, _, spec] = self.record::<L>(material, 4);
            let [color, metal, _, _] = self.record::<L>(material, 5);
            let (base, rough, spec, metal) = (base.to_bits(), rough.to_bits(), spec.to_bits(), metal.to_bits());
            let shared = self.record::<L>(material, 0)[3].to_bits().has(METALLIC_WITH_ROUGHNESS);
            let has = active & !base.eq(none);
            if has.any() {
                s.base = (s.base * textures.lookup::<L>(base, uvs, Encoding::Srgb).rgb).or_else(has, s.base);
            }
            let has = active & !rough.eq(none);
            if has.any() {
                let t = textures.lookup::<L>(rough, uvs, Encoding::Linear);
                s.roughness = if self.has_glossy {
                    self.rough_or_glossy(material, s.roughness, &t).or_else(has, s.roughness)
                } else {
                    (s.roughness * t.rgb.y).or_else(has, s.roughness)
                };
                // Where the metallic texture is the same one, this was its lookup too; see `push`.
                s.metallic = (s.metallic * t.rgb.z).or_else(has & shared, s.metallic);
            }
            let has = active & !metal.eq(none);
            if has.any() {
                let t = textures.lookup::<L>(metal, uvs, Encoding::Linear);
                s.metallic = (s.metallic * t.rgb.z).or_else(has, s.metallic);
            }
            let has = active & !spec.eq(none);
            if has.any() {
                let t = textures.lookup::<L>(spec, uvs, Encoding::Linear);
                s.specular = (s.specular * t.a).or_else(has, s.specular);
            }
            let color = color.to_bits();
            let has = active & !color.eq(none);
            if has.any() {
                s.f0 = (s.f0 * textures.lookup::<L>(color, uvs, Encoding::Srgb).rgb).or_else(has, s.f0);
            }
        }
        s.f0 = s.f0.min(V3::splat([1.0; 3]));
        if self.has_glossy {
            // KHR_materials_pbrSpecularGlossiness: c_diff = diffuse x (1 - max(specular)).
            let glossy = self.record::<L>(material, 0)[3].to_bits().has(GLOSSY);
            s.base = s.base.scale(L::F::one() - s.f0.max_component()).or_else(glossy, s.base);
        }
        s
    }

    /// [`MaterialTable::surface`] with what only some materials have.
    #[inline(always)]
    pub fn rich_surface<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        uvs: &UvSets<L>,
        active: L::M,
    ) -> Surface<L> {
        let extras = self.extras(textures, material, uvs, active);
        Surface { extras, ..self.surface(textures, material, uvs, active) }
    }

    /// The lanes of `active` whose material has what only some have.
    #[inline(always)]
    pub fn rich<L: Lanes>(&self, material: L::U, active: L::M) -> L::M {
        active & (self.record::<L>(material, 0)[3].to_bits().shr(EXTRAS_SHIFT)).has(extras::ANY)
    }

    /// `roughness` with the texel `t` applied, which holds roughness in G or glossiness in A.
    #[inline(always)]
    fn rough_or_glossy<L: Lanes>(&self, material: L::U, roughness: L::F, t: &Texel<L>) -> L::F {
        let one = L::F::one();
        let glossy = self.record::<L>(material, 0)[3].to_bits().has(GLOSSY);
        (one - (one - roughness) * t.a).or_else(glossy, roughness * t.rgb.y)
    }

    /// The normal map's vector in tangent space (not normalised), and the lanes that have one.
    #[inline(always)]
    pub fn normal_map<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        uvs: &UvSets<L>,
        active: L::M,
    ) -> (V3<L>, L::M) {
        let texture = self.record::<L>(material, 4)[2];
        let flat = V3::splat([0.0, 0.0, 1.0]);
        let Some((t, has)) = texel::<L>(textures, texture, uvs, active, Encoding::Linear) else {
            return (flat, L::M::from_bits(0));
        };
        let n = tangent_normal(&t, self.record::<L>(material, 1)[3]);
        (n.or_else(has, flat), has)
    }
}

/// The texture in those of `lanes` that have one, and these; `None` where none has. `binding` is as in the records.
#[inline(always)]
fn texel<L: Lanes>(
    textures: &TextureTable,
    binding: L::F,
    uvs: &UvSets<L>,
    lanes: L::M,
    encoding: Encoding,
) -> Option<(Texel<L>, L::M)> {
    let binding = binding.to_bits();
    let has = lanes & !binding.eq(L::U::splat(NO_TEXTURE));
    if has.any() { Some((textures.lookup::<L>(binding, uvs, encoding), has)) } else { None }
}

/// The vector of a normal map's texel, x and y times `scale`.
#[inline(always)]
fn tangent_normal<L: Lanes>(t: &Texel<L>, scale: L::F) -> V3<L> {
    let (two, one) = (L::F::splat(2.0), L::F::one());
    V3::new((t.rgb.x * two - one) * scale, (t.rgb.y * two - one) * scale, t.rgb.z * two - one)
}
