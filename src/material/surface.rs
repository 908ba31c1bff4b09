//! Parameters of the surface at a hit, over N lanes; no textures left.

use crate::math::V3;
use simd::{Float, Lanes};

/// What every material has.
pub struct Surface<L: Lanes> {
    /// Linear, in [0, 1].
    pub base: V3<L>,
    /// In [0, 1].
    pub metallic: L::F,
    /// Perceptual, in [0, 1].
    pub roughness: L::F,
    /// `specularFactor`, in [0, 1].
    pub specular: L::F,
    /// Dielectric reflectance at normal incidence with its colour, in [0, 1].
    pub f0: V3<L>,
    /// Index of refraction, >= 1; 0: fully reflecting.
    pub ior: L::F,
    /// Number of the index' tables, [`super::energy::Energy::class`].
    pub class: L::U,
    /// What only some materials have; `None` where no lane has any of it.
    pub extras: Option<Extras<L>>,
}

/// What only some materials have. In a lane without a feature its factor is 0, and the rest of it is any finite number
/// in range.
pub struct Extras<L: Lanes> {
    /// `clearcoatFactor`, in [0, 1].
    pub clearcoat: L::F,
    /// Perceptual, in [0, 1].
    pub clearcoat_roughness: L::F,
    /// `sheenColor`, in [0, 1].
    pub sheen: V3<L>,
    /// Perceptual, in [0, 1].
    pub sheen_roughness: L::F,
    /// `anisotropyStrength`, in [0, 1].
    pub anisotropy: L::F,
    /// Unit direction of the stretched highlight, along the tangent and the bitangent.
    pub anisotropy_direction: [L::F; 2],
    /// `iridescenceFactor`, in [0, 1].
    pub iridescence: L::F,
    /// Of the film, >= 1.
    pub iridescence_ior: L::F,
    /// nm.
    pub iridescence_thickness: L::F,
    /// `transmissionFactor`, in [0, 1].
    pub transmission: L::F,
    /// The surface is the boundary of a volume: light is refracted; else it is thin-walled.
    pub is_volume: L::M,
    /// `diffuseTransmissionFactor`, in [0, 1].
    pub diffuse_transmission: L::F,
    /// `diffuseTransmissionColor`, in [0, 1].
    pub diffuse_transmission_color: V3<L>,
    /// Parameters of the lanes of `is_disney`; `None` where there are none.
    pub disney: Option<DisneyExtras<L>>,
    /// Lanes shaded by the Disney BRDF of 2012 from `base`, `metallic`, `roughness` and `disney`.
    pub is_disney: L::M,
}

/// [`super::extensions::Disney`] over N lanes.
pub struct DisneyExtras<L: Lanes> {
    /// See [`super::extensions::Disney::subsurface`]; so the others.
    pub subsurface: L::F,
    #[expect(missing_docs, reason = "said above")]
    pub specular: L::F,
    #[expect(missing_docs, reason = "said above")]
    pub specular_tint: L::F,
    #[expect(missing_docs, reason = "said above")]
    pub anisotropic: L::F,
    #[expect(missing_docs, reason = "said above")]
    pub sheen: L::F,
    #[expect(missing_docs, reason = "said above")]
    pub sheen_tint: L::F,
    #[expect(missing_docs, reason = "said above")]
    pub clearcoat: L::F,
    #[expect(missing_docs, reason = "said above")]
    pub clearcoat_gloss: L::F,
}

impl<L: Lanes> Surface<L> {
    /// The lanes that have more than diffuse lobes.
    #[inline(always)]
    pub fn has_specular(&self) -> L::M {
        let reflects = self.metallic.gt(L::F::zero()) | self.specular.gt(L::F::zero());
        match &self.extras {
            Some(extras) => reflects | extras.transmission.gt(L::F::zero()),
            None => reflects,
        }
    }
}
