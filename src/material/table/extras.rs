//! What only some materials have, in a table of its own: a scene without any of it reads none of it.

use super::{EXTRAS_SHIFT, MaterialTable, tangent_normal, texel};
use crate::material::Material;
use crate::material::extensions::Iridescence;
use crate::material::lobes::coat;
use crate::material::surface::{DisneyExtras, Extras};
use crate::math::lanes::lerp;
use crate::math::{UvSets, V3};
use crate::texture::lookup::{Encoding, TextureTable};
use crate::texture::mips::Average;
use simd::{Float, Lanes, Mask, Uint};

const RECORDS: u32 = 10;

// Flags of a material; those of a scene are all of its materials' together.
const COAT: u32 = 1;
const COAT_NORMAL: u32 = 1 << 1;
const SHEEN: u32 = 1 << 2;
const ANISOTROPY: u32 = 1 << 3;
const IRIDESCENCE: u32 = 1 << 4;
const TRANSMISSION: u32 = 1 << 5;
const DIFFUSE_TRANSMISSION: u32 = 1 << 6;
/// Light that gets through is inside of something.
pub(super) const VOLUME: u32 = 1 << 7;
const DISNEY: u32 = 1 << 8;
/// Shading depends on the direction of tangents.
const STRETCHED: u32 = 1 << 9;
/// Any of them.
pub(super) const ANY: u32 = (1 << 10) - 1;

/// Squared length below which the direction in an anisotropy texture is none: 2.5 steps of 8 bits.
const MIN_DIRECTION2: f32 = 4e-4;

/// Ten 16-byte records for each material that has any of it.
///
/// | record | x | y | z | w |
/// |---|---|---|---|---|
/// | 0 | coat | its roughness | texture | texture of the roughness |
/// | 1 | texture of the coat's normal | its scale | sheen: texture of the colour | of the roughness |
/// | 2 | sheen r | g | b | roughness |
/// | 3 | anisotropy | cosine | sine of its rotation | texture |
/// | 4 | iridescence | index | least | greatest thickness, nm |
/// | 5 | texture of the iridescence | of the thickness | transmission | its texture |
/// | 6 | diffuse transmission | texture | texture of the colour | - |
/// | 7 | colour of diffuse transmission r | g | b | - |
/// | 8 | Disney: subsurface | specular | specular tint | anisotropic |
/// | 9 | sheen | sheen tint | clearcoat | clearcoat gloss |
#[derive(Clone, Debug, Default)]
pub(super) struct ExtrasTable {
    records: Vec<[f32; 4]>,
    /// What any material has.
    flags: u32,
}

impl ExtrasTable {
    /// Adds what `m` has; its place here (0 if it has nothing) and its flags.
    pub fn push(&mut self, m: &Material, textures: &mut TextureTable) -> (u32, u32) {
        let flags = flags(m);
        if flags == 0 {
            return (0, 0);
        }
        self.flags |= flags;
        let place = self.records.len() as u32 / RECORDS;
        let mut id = |t, average| f32::from_bits(textures.bind(t, average));
        let (values, light) = (Average::Values, Average::Light);
        let [sheen_r, sheen_g, sheen_b] = m.sheen.color.factor;
        let (sin, cos) = f64::from(m.anisotropy.rotation).sin_cos();
        let [through_r, through_g, through_b] = m.diffuse_transmission.color.factor;
        let film = m.iridescence;
        let d = m.disney.unwrap_or_default();
        self.records.extend([
            [
                m.clearcoat.factor.factor,
                m.clearcoat.roughness.factor,
                id(m.clearcoat.factor.texture, values),
                id(m.clearcoat.roughness.texture, values),
            ],
            [
                id(m.clearcoat.normal.texture, values),
                m.clearcoat.normal.factor,
                id(m.sheen.color.texture, light),
                id(m.sheen.roughness.texture, values),
            ],
            [sheen_r, sheen_g, sheen_b, m.sheen.roughness.factor],
            [m.anisotropy.strength.factor, cos as f32, sin as f32, id(m.anisotropy.strength.texture, values)],
            [film.factor.factor, film.ior, film.thickness_minimum, film.thickness_maximum.factor],
            [
                id(film.factor.texture, values),
                id(film.thickness_maximum.texture, values),
                m.transmission.factor.factor,
                id(m.transmission.factor.texture, values),
            ],
            [
                m.diffuse_transmission.factor.factor,
                id(m.diffuse_transmission.factor.texture, values),
                id(m.diffuse_transmission.color.texture, light),
                0.0,
            ],
            [through_r, through_g, through_b, 0.0],
            [d.subsurface, d.specular, d.specular_tint, d.anisotropic],
            [d.sheen, d.sheen_tint, d.clearcoat, d.clearcoat_gloss],
        ]);
        (place, flags)
    }

    /// Whether any material has any of the `flags`.
    pub fn has(&self, flags: u32) -> bool {
        self.flags & flags != 0
    }

    #[inline(always)]
    fn record<L: Lanes>(&self, place: L::U, k: u32) -> [L::F; 4] {
        (place * L::U::splat(RECORDS) + L::U::splat(k)).records(&self.records)
    }
}

fn flags(m: &Material) -> u32 {
    let flags = [
        (m.has_coat(), COAT),
        (m.has_coat() && m.clearcoat.normal.texture.is_some(), COAT_NORMAL),
        (m.has_sheen(), SHEEN),
        (m.has_anisotropy(), ANISOTROPY | STRETCHED),
        (m.has_iridescence(), IRIDESCENCE),
        (m.has_transmission(), TRANSMISSION),
        (m.has_diffuse_transmission(), DIFFUSE_TRANSMISSION),
        (m.interior().is_some(), VOLUME),
        (m.is_disney(), DISNEY),
        (m.is_disney() && m.disney.is_some_and(|d| d.anisotropic > 0.0), STRETCHED),
    ];
    flags.iter().filter(|(has, _)| *has).fold(0, |bits, (_, flag)| bits | flag)
}

/// What a scene has.
impl MaterialTable {
    /// Whether anything has a clear coat.
    pub fn has_coat(&self) -> bool {
        self.extras.has(COAT)
    }

    /// Whether any coat has a normal map of its own.
    pub fn has_clearcoat_normal(&self) -> bool {
        self.extras.has(COAT_NORMAL)
    }

    /// Whether any highlight is stretched along the tangent, by `KHR_materials_anisotropy` or the Disney BRDF.
    pub fn has_anisotropy(&self) -> bool {
        self.extras.has(STRETCHED)
    }

    /// Whether there is a thin film on anything.
    pub fn has_iridescence(&self) -> bool {
        self.extras.has(IRIDESCENCE)
    }

    /// Whether light goes through anything specularly.
    pub fn has_transmission(&self) -> bool {
        self.extras.has(TRANSMISSION)
    }

    /// Whether light goes through anything diffusely.
    pub fn has_diffuse_transmission(&self) -> bool {
        self.extras.has(DIFFUSE_TRANSMISSION)
    }

    /// Whether anything that lets light through is the boundary of a volume.
    pub fn has_volume(&self) -> bool {
        self.extras.has(VOLUME)
    }

    /// Whether the Disney BRDF of 2012 shades anything.
    pub fn has_disney(&self) -> bool {
        self.extras.has(DISNEY)
    }
}

/// What a material has, wherever it is hit.
impl MaterialTable {
    /// Its flags, and its place in the table of extras.
    #[inline(always)]
    fn features<L: Lanes>(&self, material: L::U) -> (L::U, L::U) {
        let flags = self.record::<L>(material, 0)[3].to_bits().shr(EXTRAS_SHIFT);
        (flags, self.record::<L>(material, 7)[0].to_bits())
    }
}

/// What a material has at a hit.
impl MaterialTable {
    /// `None` where no lane of `active` has any of it.
    #[inline(always)]
    pub(super) fn extras<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        uvs: &UvSets<L>,
        active: L::M,
    ) -> Option<Extras<L>> {
        if !self.has_extras() {
            return None;
        }
        let (flags, place) = self.features::<L>(material);
        if !(active & flags.has(ANY)).any() {
            return None;
        }
        let (zero, one) = (L::F::zero(), L::F::one());
        let film = Iridescence::default();
        let mut extras = Extras {
            clearcoat: zero,
            clearcoat_roughness: zero,
            sheen: V3::zero(),
            sheen_roughness: zero,
            anisotropy: zero,
            anisotropy_direction: [one, zero],
            iridescence: zero,
            iridescence_ior: L::F::splat(film.ior),
            iridescence_thickness: L::F::splat(film.thickness_maximum.factor),
            transmission: zero,
            is_volume: active & flags.has(VOLUME),
            diffuse_transmission: zero,
            diffuse_transmission_color: V3::splat([1.0; 3]),
            disney: None,
            is_disney: active & flags.has(DISNEY),
        };
        let at = At { textures, place, uvs };
        let lanes = active & flags.has(COAT);
        if self.has_coat() && lanes.any() {
            self.coat(&at, lanes, &mut extras);
        }
        let lanes = active & flags.has(SHEEN);
        if self.extras.has(SHEEN) && lanes.any() {
            self.sheen(&at, lanes, &mut extras);
        }
        let lanes = active & flags.has(ANISOTROPY);
        if self.extras.has(ANISOTROPY) && lanes.any() {
            self.anisotropy(&at, lanes, &mut extras);
        }
        let lanes = active & flags.has(IRIDESCENCE);
        if self.extras.has(IRIDESCENCE) && lanes.any() {
            self.iridescence(&at, lanes, &mut extras);
        }
        let lanes = active & flags.has(TRANSMISSION);
        if self.has_transmission() && lanes.any() {
            self.transmission(&at, lanes, &mut extras);
        }
        let lanes = active & flags.has(DIFFUSE_TRANSMISSION);
        if self.has_diffuse_transmission() && lanes.any() {
            self.diffuse_transmission(&at, lanes, &mut extras);
        }
        if self.has_disney() && extras.is_disney.any() {
            let [subsurface, specular, specular_tint, anisotropic] = self.extras.record::<L>(place, 8);
            let [sheen, sheen_tint, clearcoat, clearcoat_gloss] = self.extras.record::<L>(place, 9);
            extras.disney = Some(DisneyExtras {
                subsurface,
                specular,
                specular_tint,
                anisotropic,
                sheen,
                sheen_tint,
                clearcoat,
                clearcoat_gloss,
            });
        }
        Some(extras)
    }

    /// Share of a surface's own light that gets through its coat, seen at the cosine `cos` (> 0) to the geometric normal
    /// (`KHR_materials_clearcoat`: the coat lies over emission too); exactly 1 where there is no coat.
    #[inline(always)]
    pub fn emission_through_coat<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        cos: L::F,
        uvs: &UvSets<L>,
        active: L::M,
    ) -> L::F {
        let one = L::F::one();
        let (flags, place) = self.features::<L>(material);
        let lanes = active & flags.has(COAT);
        if !lanes.any() {
            return one;
        }
        let [mut strength, _, texture, _] = self.extras.record::<L>(place, 0);
        // At level 0, as emission: light sampling knows no footprint.
        if let Some((t, has)) = texel::<L>(textures, texture, &uvs.sharp(), lanes, Encoding::Linear) {
            strength = (strength * t.rgb.x).or_else(has, strength);
        }
        (one - strength * coat::reflectance::<L>(cos)).or_else(lanes, one)
    }

    #[inline(always)]
    fn coat<L: Lanes>(&self, at: &At<'_, L>, lanes: L::M, into: &mut Extras<L>) {
        let [mut coat, mut roughness, texture, of_roughness] = self.extras.record::<L>(at.place, 0);
        if let Some((t, has)) = texel::<L>(at.textures, texture, at.uvs, lanes, Encoding::Linear) {
            coat = (coat * t.rgb.x).or_else(has, coat);
        }
        if let Some((t, has)) = texel::<L>(at.textures, of_roughness, at.uvs, lanes, Encoding::Linear) {
            roughness = (roughness * t.rgb.y).or_else(has, roughness);
        }
        into.clearcoat = coat.masked(lanes);
        into.clearcoat_roughness = roughness.masked(lanes);
    }

    #[inline(always)]
    fn sheen<L: Lanes>(&self, at: &At<'_, L>, lanes: L::M, into: &mut Extras<L>) {
        let [_, _, of_color, of_roughness] = self.extras.record::<L>(at.place, 1);
        let [r, g, b, mut roughness] = self.extras.record::<L>(at.place, 2);
        let mut color = V3::<L>::new(r, g, b);
        if let Some((t, has)) = texel::<L>(at.textures, of_color, at.uvs, lanes, Encoding::Srgb) {
            color = (color * t.rgb).or_else(has, color);
        }
        if let Some((t, has)) = texel::<L>(at.textures, of_roughness, at.uvs, lanes, Encoding::Linear) {
            roughness = (roughness * t.a).or_else(has, roughness);
        }
        into.sheen = color.masked(lanes);
        into.sheen_roughness = roughness.masked(lanes);
    }

    #[inline(always)]
    fn anisotropy<L: Lanes>(&self, at: &At<'_, L>, lanes: L::M, into: &mut Extras<L>) {
        let (zero, one, two) = (L::F::zero(), L::F::one(), L::F::splat(2.0));
        let [mut strength, cos, sin, texture] = self.extras.record::<L>(at.place, 3);
        let (mut x, mut y) = (one, zero);
        if let Some((t, has)) = texel::<L>(at.textures, texture, at.uvs, lanes, Encoding::Linear) {
            strength = (strength * t.rgb.z).or_else(has, strength);
            let (along, across) = (t.rgb.x * two - one, t.rgb.y * two - one);
            let length2: L::F = along * along + across * across;
            let has = has & length2.gt(L::F::splat(MIN_DIRECTION2));
            let scale = one / length2.sqrt();
            (x, y) = ((along * scale).or_else(has, x), (across * scale).or_else(has, y));
        }
        into.anisotropy = strength.masked(lanes);
        into.anisotropy_direction = [(cos * x - sin * y).or_else(lanes, one), (sin * x + cos * y).masked(lanes)];
    }

    #[inline(always)]
    fn iridescence<L: Lanes>(&self, at: &At<'_, L>, lanes: L::M, into: &mut Extras<L>) {
        let [mut factor, ior, least, mut thickness] = self.extras.record::<L>(at.place, 4);
        let [texture, of_thickness, _, _] = self.extras.record::<L>(at.place, 5);
        if let Some((t, has)) = texel::<L>(at.textures, texture, at.uvs, lanes, Encoding::Linear) {
            factor = (factor * t.rgb.x).or_else(has, factor);
        }
        if let Some((t, has)) = texel::<L>(at.textures, of_thickness, at.uvs, lanes, Encoding::Linear) {
            thickness = lerp(least, thickness, t.rgb.y).or_else(has, thickness);
        }
        into.iridescence = factor.masked(lanes);
        into.iridescence_ior = ior.or_else(lanes, into.iridescence_ior);
        into.iridescence_thickness = thickness.or_else(lanes, into.iridescence_thickness);
    }

    #[inline(always)]
    fn transmission<L: Lanes>(&self, at: &At<'_, L>, lanes: L::M, into: &mut Extras<L>) {
        let [_, _, mut factor, texture] = self.extras.record::<L>(at.place, 5);
        if let Some((t, has)) = texel::<L>(at.textures, texture, at.uvs, lanes, Encoding::Linear) {
            factor = (factor * t.rgb.x).or_else(has, factor);
        }
        into.transmission = factor.masked(lanes);
    }

    #[inline(always)]
    fn diffuse_transmission<L: Lanes>(&self, at: &At<'_, L>, lanes: L::M, into: &mut Extras<L>) {
        let [mut factor, texture, of_color, _] = self.extras.record::<L>(at.place, 6);
        let [r, g, b, _] = self.extras.record::<L>(at.place, 7);
        let mut color = V3::<L>::new(r, g, b);
        if let Some((t, has)) = texel::<L>(at.textures, texture, at.uvs, lanes, Encoding::Linear) {
            factor = (factor * t.a).or_else(has, factor);
        }
        if let Some((t, has)) = texel::<L>(at.textures, of_color, at.uvs, lanes, Encoding::Srgb) {
            color = (color * t.rgb).or_else(has, color);
        }
        into.diffuse_transmission = factor.masked(lanes);
        into.diffuse_transmission_color = color.or_else(lanes, into.diffuse_transmission_color);
    }

    /// The vector of the coat's own normal map in tangent space (not normalised), and the lanes that have one.
    #[inline(always)]
    pub fn clearcoat_normal_map<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        uvs: &UvSets<L>,
        active: L::M,
    ) -> (V3<L>, L::M) {
        let flat = V3::splat([0.0, 0.0, 1.0]);
        if !self.has_clearcoat_normal() {
            return (flat, L::M::from_bits(0));
        }
        let (flags, place) = self.features::<L>(material);
        let lanes = active & flags.has(COAT_NORMAL);
        if !lanes.any() {
            return (flat, lanes);
        }
        let [texture, scale, _, _] = self.extras.record::<L>(place, 1);
        match texel::<L>(textures, texture, uvs, lanes, Encoding::Linear) {
            Some((t, has)) => (tangent_normal(&t, scale).or_else(has, flat), has),
            None => (flat, L::M::from_bits(0)),
        }
    }
}

/// Where extras are read.
struct At<'a, L: Lanes> {
    textures: &'a TextureTable,
    /// Of the material in the table of extras.
    place: L::U,
    uvs: &'a UvSets<L>,
}
