//! What a base lets through: specularly, refracted or straight on, and diffusely. Made and read by `base`.

use crate::math::V3;
use simd::Lanes;

/// What goes through.
pub struct Through<L: Lanes> {
    /// Reflectance of the boundary at normal incidence.
    pub f0: V3<L>,
    /// Of what the specular layer lets pass: the share that goes on, times the tint.
    pub tint: V3<L>,
    /// Share of the dielectric that is transparent.
    pub share: L::F,
    /// What the transparent part's specular lobes are multiplied by.
    pub gain: L::F,
    /// Refracted; else the surface is thin and light goes on as it came.
    pub is_volume: L::M,
    /// Index of refraction behind over before.
    pub eta: L::F,
    /// `eta` is 1: there is no boundary.
    pub is_none: L::M,
    /// Coefficient of the diffuse lobe on the other side.
    pub diffuse: V3<L>,
    /// Lanes that have that lobe.
    pub has_behind: L::M,
}
