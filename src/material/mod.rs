//! Materials as described by the file, in glTF's names.

pub mod bsdf;
pub mod table;

use crate::texture::Param;

/// Metallic-roughness parameters with `KHR_materials_specular` and `KHR_materials_emissive_strength`.
#[derive(Clone, Debug)]
pub struct Material {
    /// For messages.
    pub name: String,
    /// Linear Rec.709 in [0, 1]; texture RGB in sRGB.
    pub base_color: Param<[f32; 3]>,
    /// In [0, 1]; texture channel B, linear. The texture is the same one as roughness'.
    pub metallic: Param<f32>,
    /// Perceptual, in [0, 1]; texture channel G, linear.
    pub roughness: Param<f32>,
    /// Scale of the normal map's x and y; the texture is the tangent-space normal map.
    pub normal: Param<f32>,
    /// Radiance in nits: `emissiveFactor x emissiveStrength`; texture RGB in sRGB.
    pub emission: Param<[f32; 3]>,
    /// `specularFactor` in [0, 1]; texture channel A, linear.
    pub specular: Param<f32>,
    /// `specularColorFactor` >= 0; texture RGB in sRGB.
    pub specular_color: Param<[f32; 3]>,
    /// Both sides emit. (Both sides are always seen; single-sided surfaces emit on their front only.)
    pub double_sided: bool,
}

impl Default for Material {
    /// glTF's default material: white, metallic 1, roughness 1.
    fn default() -> Self {
        Self {
            name: String::from("default"),
            base_color: Param::constant([1.0; 3]),
            metallic: Param::constant(1.0),
            roughness: Param::constant(1.0),
            normal: Param::constant(1.0),
            emission: Param::constant([0.0; 3]),
            specular: Param::constant(1.0),
            specular_color: Param::constant([1.0; 3]),
            double_sided: false,
        }
    }
}
