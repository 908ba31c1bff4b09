//! Parameters of the material extensions of glTF, in their names. Every default is the feature's absence.

use crate::texture::Param;

/// `KHR_materials_clearcoat`: a dielectric layer of index 1.5 over the rest.
#[derive(Clone, Copy, Debug)]
pub struct Clearcoat {
    /// In [0, 1]; texture channel R, linear.
    pub factor: Param<f32>,
    /// Perceptual, in [0, 1]; texture channel G, linear.
    pub roughness: Param<f32>,
    /// Scale of the coat's own normal map; without a texture the coat has the mesh's normal, not the base's normal map.
    pub normal: Param<f32>,
}

/// `KHR_materials_sheen`.
#[derive(Clone, Copy, Debug)]
pub struct Sheen {
    /// Linear, in [0, 1]; texture RGB in sRGB.
    pub color: Param<[f32; 3]>,
    /// Perceptual, in [0, 1]; texture channel A, linear.
    pub roughness: Param<f32>,
}

/// `KHR_materials_anisotropy`.
#[derive(Clone, Copy, Debug)]
pub struct Anisotropy {
    /// In [0, 1]; texture channel B, linear. Its R and G are the direction, [0, 1] for [-1, 1], turned by `rotation`.
    pub strength: Param<f32>,
    /// Radians, counter-clockwise from the tangent.
    pub rotation: f32,
}

/// `KHR_materials_iridescence`.
#[derive(Clone, Copy, Debug)]
pub struct Iridescence {
    /// In [0, 1]; texture channel R, linear.
    pub factor: Param<f32>,
    /// Index of refraction of the film, >= 1.
    pub ior: f32,
    /// Thickness in nm where the texture says 0; unused without a texture.
    pub thickness_minimum: f32,
    /// Thickness in nm where the texture says 1 or is absent; texture channel G, linear.
    pub thickness_maximum: Param<f32>,
}

/// `KHR_materials_transmission` and `KHR_materials_dispersion`.
#[derive(Clone, Copy, Debug)]
pub struct Transmission {
    /// In [0, 1]; texture channel R, linear.
    pub factor: Param<f32>,
    /// 20 / Abbe number; 0 = none.
    pub dispersion: f32,
}

/// `KHR_materials_volume`: the homogeneous absorbing inside of a closed surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// What is left of white light after `attenuation_distance`; linear, in [0, 1].
    pub attenuation_color: [f32; 3],
    /// Metres, > 0; infinite: nothing is absorbed.
    pub attenuation_distance: f32,
}

/// `KHR_materials_diffuse_transmission`.
#[derive(Clone, Copy, Debug)]
pub struct DiffuseTransmission {
    /// Share of the diffuse light that goes through, in [0, 1]; texture channel A, linear.
    pub factor: Param<f32>,
    /// Linear, in [0, 1]; texture RGB in sRGB.
    pub color: Param<[f32; 3]>,
}

/// Burley 2012, "Physically Based Shading at Disney": what glTF has no name for; each in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disney {
    /// Blend from diffuse to the Hanrahan-Krueger-like lobe.
    pub subsurface: f32,
    /// Reflectance at normal incidence / 0.08.
    pub specular: f32,
    /// Tint of the specular lobe towards the base colour.
    pub specular_tint: f32,
    /// Aspect of the specular highlight.
    pub anisotropic: f32,
    /// Grazing component for cloth.
    pub sheen: f32,
    /// Tint of the sheen towards the base colour.
    pub sheen_tint: f32,
    /// Strength of the second, fixed specular lobe.
    pub clearcoat: f32,
    /// 0 satin, 1 gloss.
    pub clearcoat_gloss: f32,
}

impl Default for Clearcoat {
    fn default() -> Self {
        Self { factor: Param::constant(0.0), roughness: Param::constant(0.0), normal: Param::constant(1.0) }
    }
}

impl Default for Sheen {
    fn default() -> Self {
        Self { color: Param::constant([0.0; 3]), roughness: Param::constant(0.0) }
    }
}

impl Default for Anisotropy {
    fn default() -> Self {
        Self { strength: Param::constant(0.0), rotation: 0.0 }
    }
}

impl Default for Iridescence {
    fn default() -> Self {
        let thickness_maximum = Param::constant(400.0);
        Self { factor: Param::constant(0.0), ior: 1.3, thickness_minimum: 100.0, thickness_maximum }
    }
}

impl Default for Transmission {
    fn default() -> Self {
        Self { factor: Param::constant(0.0), dispersion: 0.0 }
    }
}

impl Default for DiffuseTransmission {
    fn default() -> Self {
        Self { factor: Param::constant(0.0), color: Param::constant([1.0; 3]) }
    }
}

impl Default for Disney {
    /// The published viewer's defaults.
    fn default() -> Self {
        Self {
            subsurface: 0.0,
            specular: 0.5,
            specular_tint: 0.0,
            anisotropic: 0.0,
            sheen: 0.0,
            sheen_tint: 0.5,
            clearcoat: 0.0,
            clearcoat_gloss: 1.0,
        }
    }
}
