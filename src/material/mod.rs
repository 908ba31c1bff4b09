//! Materials as described by the file, in glTF's names.

mod base;
pub mod bsdf;
mod bump;
pub mod energy;
pub mod extensions;
mod extent;
mod features;
mod film;
pub mod layered;
pub mod lobes;
pub mod media;
pub mod surface;
pub mod table;
mod through;

use crate::texture::{Channels, Param, TextureRef};
use extensions::{Anisotropy, Clearcoat, DiffuseTransmission, Disney, Iridescence, Sheen, Transmission, Volume};

/// What is seen through a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Nothing: opacity is ignored.
    Opaque,
    /// All of it where the opacity is below `cutoff`, else nothing.
    Mask {
        /// >= 0; above 1 the surface is not there at all.
        cutoff: f32,
    },
    /// A share of 1 - opacity, decided at random for each ray (coverage, not absorption).
    Blend,
}

/// Metallic-roughness parameters and those of the `KHR_materials_*` extensions. A feature with a factor of 0 is absent.
#[derive(Clone, Debug)]
pub struct Material {
    /// For messages.
    pub name: String,
    /// Linear Rec.709 in [0, 1]; texture RGB in sRGB.
    pub base_color: Param<[f32; 3]>,
    /// In [0, 1]; texture channel A, linear; ignored where `alpha_mode` is opaque. In glTF the texture is the base colour's.
    pub opacity: Param<f32>,
    /// What `opacity` means.
    pub alpha_mode: AlphaMode,
    /// In [0, 1]; texture channel B, linear. In glTF the texture is the same one as roughness'.
    pub metallic: Param<f32>,
    /// Perceptual, in [0, 1]; texture channel G, linear.
    pub roughness: Param<f32>,
    /// Scale of the normal map's x and y; the texture is the tangent-space normal map.
    pub normal: Param<f32>,
    /// Height map instead of a normal map: the height in metres (object space) of a texel of 1; texture channel R, linear.
    pub bump: Param<f32>,
    /// Radiance in nits: `emissiveFactor x emissiveStrength`; texture RGB in sRGB.
    pub emission: Param<[f32; 3]>,
    /// `specularFactor` in [0, 1]; texture channel A, linear.
    pub specular: Param<f32>,
    /// `specularColorFactor` >= 0; texture RGB in sRGB.
    pub specular_color: Param<[f32; 3]>,
    /// Index of refraction, >= 1, or 0: fully reflecting (`KHR_materials_ior`).
    pub ior: f32,
    /// Coat over everything else (`KHR_materials_clearcoat`).
    pub clearcoat: Clearcoat,
    /// Fuzz over everything but the coat (`KHR_materials_sheen`).
    pub sheen: Sheen,
    /// Stretched highlights (`KHR_materials_anisotropy`).
    pub anisotropy: Anisotropy,
    /// Thin film on the specular layer and the metal (`KHR_materials_iridescence`).
    pub iridescence: Iridescence,
    /// Specular transmission (`KHR_materials_transmission`, `_dispersion`).
    pub transmission: Transmission,
    /// What is inside, if the surface is the boundary of something (`KHR_materials_volume`); `None` = thin-walled.
    pub volume: Option<Volume>,
    /// Light that comes through diffusely (`KHR_materials_diffuse_transmission`).
    pub diffuse_transmission: DiffuseTransmission,
    /// The Disney BRDF of 2012 in place of all of these but base colour, metallic and roughness (`prt_disney`).
    pub disney: Option<Disney>,
    /// `KHR_materials_pbrSpecularGlossiness`: `base_color` is the diffuse colour, `specular_color` the reflectance at
    /// normal incidence with `ior` 0, `roughness` one minus the glossiness; their texture's alpha is the glossiness.
    pub specular_glossiness: bool,
    /// Shows its base colour as it is to camera and mirror rays, neither lit nor lighting anything.
    pub unlit: bool,
    /// Both sides emit. (Both sides are always seen; single-sided surfaces emit on their front only.)
    pub double_sided: bool,
}

impl Material {
    /// Every texture that it reads, as often as it has parameters that read it.
    pub fn textures(&self) -> impl Iterator<Item = TextureRef> {
        self.channels().into_iter().map(|(texture, _)| texture)
    }

    /// Every texture that it reads, with the channels that matter.
    pub fn channels(&self) -> Vec<(TextureRef, Channels)> {
        let slots = [
            (self.base_color.texture, Channels::RGB),
            (self.opacity.texture, Channels::A),
            (self.metallic.texture, Channels::B),
            (self.roughness.texture, if self.specular_glossiness { Channels::A } else { Channels::G }),
            (self.normal.texture, Channels::RGB),
            (self.bump.texture, Channels::R),
            (self.emission.texture, Channels::RGB),
            (self.specular.texture, Channels::A),
            (self.specular_color.texture, Channels::RGB),
            (self.clearcoat.factor.texture, Channels::R),
            (self.clearcoat.roughness.texture, Channels::G),
            (self.clearcoat.normal.texture, Channels::RGB),
            (self.sheen.color.texture, Channels::RGB),
            (self.sheen.roughness.texture, Channels::A),
            (self.anisotropy.strength.texture, Channels::RGB),
            (self.iridescence.factor.texture, Channels::R),
            (self.iridescence.thickness_maximum.texture, Channels::G),
            (self.transmission.factor.texture, Channels::R),
            (self.diffuse_transmission.factor.texture, Channels::A),
            (self.diffuse_transmission.color.texture, Channels::RGB),
        ];
        slots.into_iter().filter_map(|(texture, channels)| texture.map(|t| (t, channels))).collect()
    }

    /// What [`Material::textures`] lists, to be changed.
    pub fn textures_mut(&mut self) -> impl Iterator<Item = &mut TextureRef> {
        let slots = [
            &mut self.base_color.texture,
            &mut self.opacity.texture,
            &mut self.metallic.texture,
            &mut self.roughness.texture,
            &mut self.normal.texture,
            &mut self.bump.texture,
            &mut self.emission.texture,
            &mut self.specular.texture,
            &mut self.specular_color.texture,
            &mut self.clearcoat.factor.texture,
            &mut self.clearcoat.roughness.texture,
            &mut self.clearcoat.normal.texture,
            &mut self.sheen.color.texture,
            &mut self.sheen.roughness.texture,
            &mut self.anisotropy.strength.texture,
            &mut self.iridescence.factor.texture,
            &mut self.iridescence.thickness_maximum.texture,
            &mut self.transmission.factor.texture,
            &mut self.diffuse_transmission.factor.texture,
            &mut self.diffuse_transmission.color.texture,
        ];
        slots.into_iter().flatten()
    }
}

impl Default for Material {
    /// glTF's default material: white, metallic 1, roughness 1.
    fn default() -> Self {
        Self {
            name: String::from("default"),
            base_color: Param::constant([1.0; 3]),
            opacity: Param::constant(1.0),
            alpha_mode: AlphaMode::Opaque,
            metallic: Param::constant(1.0),
            roughness: Param::constant(1.0),
            normal: Param::constant(1.0),
            bump: Param::constant(0.0),
            emission: Param::constant([0.0; 3]),
            specular: Param::constant(1.0),
            specular_color: Param::constant([1.0; 3]),
            ior: 1.5,
            clearcoat: Clearcoat::default(),
            sheen: Sheen::default(),
            anisotropy: Anisotropy::default(),
            iridescence: Iridescence::default(),
            transmission: Transmission::default(),
            volume: None,
            diffuse_transmission: DiffuseTransmission::default(),
            disney: None,
            specular_glossiness: false,
            unlit: false,
            double_sided: false,
        }
    }
}
