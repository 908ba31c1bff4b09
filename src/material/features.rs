//! Which features a material has: those whose parameters can change a picture. A feature that it lacks costs nothing and
//! leaves no trace, whatever the rest of its parameters say.

use super::Material;
use super::extensions::Volume;
use crate::texture::TextureRef;

/// Absorption of what lets nothing through, 1/m: within a micrometre nothing that f32 can tell from 0 is left, and times
/// the longest distance it is still finite.
const MAX_ABSORPTION: f64 = 1e20;

impl Material {
    /// Whether it is shaded as the layers of glTF, neither unlit nor by another model.
    fn is_layered(&self) -> bool {
        !self.unlit && self.disney.is_none()
    }

    /// Whether it has a clear coat.
    pub fn has_coat(&self) -> bool {
        self.is_layered() && self.clearcoat.factor.factor > 0.0
    }

    /// Whether it has a sheen.
    pub fn has_sheen(&self) -> bool {
        self.is_layered() && self.sheen.color.factor.iter().any(|&c| c > 0.0)
    }

    /// Whether its highlights are stretched (those of glTF; see [`Material::needs_tangents`] for the others).
    pub fn has_anisotropy(&self) -> bool {
        self.is_layered() && self.anisotropy.strength.factor > 0.0
    }

    /// Whether it has a thin film. One without thickness is none.
    pub fn has_iridescence(&self) -> bool {
        let film = &self.iridescence;
        let is_thick = film.thickness_maximum.factor > 0.0
            || film.thickness_maximum.texture.is_some() && film.thickness_minimum > 0.0;
        self.is_layered() && film.factor.factor > 0.0 && is_thick
    }

    /// Whether light goes through specularly.
    pub fn has_transmission(&self) -> bool {
        self.is_layered() && self.transmission.factor.factor > 0.0
    }

    /// Whether light goes through diffusely.
    pub fn has_diffuse_transmission(&self) -> bool {
        self.is_layered() && self.diffuse_transmission.factor.factor > 0.0
    }

    /// What is behind it, if light gets there and it is the boundary of something.
    pub fn interior(&self) -> Option<Volume> {
        self.volume.filter(|_| self.has_transmission() || self.has_diffuse_transmission())
    }

    /// Whether it refracts colours differently: only boundaries refract.
    pub fn has_dispersion(&self) -> bool {
        self.has_transmission() && self.volume.is_some() && self.transmission.dispersion > 0.0
    }

    /// Whether the Disney BRDF of 2012 shades it.
    pub fn is_disney(&self) -> bool {
        !self.unlit && self.disney.is_some()
    }

    /// Whether it has any of these.
    pub fn has_extras(&self) -> bool {
        self.has_coat()
            || self.has_sheen()
            || self.has_anisotropy()
            || self.has_iridescence()
            || self.has_transmission()
            || self.has_diffuse_transmission()
            || self.is_disney()
    }

    /// Whether shading depends on the direction of tangents.
    pub fn needs_tangents(&self) -> bool {
        let is_stretched =
            self.has_anisotropy() || self.is_disney() && self.disney.is_some_and(|d| d.anisotropic > 0.0);
        is_stretched || self.tangent_map().is_some()
    }

    /// Whether normals are read from a texture, its own or the coat's.
    pub fn has_normal_map(&self) -> bool {
        self.normal.texture.is_some() || self.has_coat() && self.clearcoat.normal.texture.is_some()
    }

    /// The texture along whose coordinates tangents run: the normal map, else the coat's normal map, else that of the
    /// anisotropy; `None`: no texture says.
    pub fn tangent_map(&self) -> Option<TextureRef> {
        let coat = self.clearcoat.normal.texture.filter(|_| self.has_coat());
        let stretched = self.anisotropy.strength.texture.filter(|_| self.has_anisotropy());
        self.normal.texture.or(coat).or(stretched)
    }
}

impl Volume {
    /// Absorption per channel, 1/m, in [0, 1e20]: of light of 1, `exp(-absorption x)` is left after x metres.
    pub fn absorption(&self) -> [f32; 3] {
        let distance = f64::from(self.attenuation_distance).max(f64::MIN_POSITIVE);
        self.attenuation_color.map(|color| {
            // A colour of 0 is gone at once, unless nothing is ever absorbed: 0^(x / infinity) = 1.
            let absorption = -f64::from(color).ln() / distance;
            // NaN, -0 and the negative (a colour above 1) count as 0.
            if absorption > 0.0 { absorption.min(MAX_ABSORPTION) as f32 } else { 0.0 }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::extensions::Disney;

    #[test]
    fn vol_01_absorption_is_that_of_f64_and_finite_at_every_edge() {
        let of = |color: f32, distance: f32| {
            Volume { attenuation_color: [color; 3], attenuation_distance: distance }.absorption()[0]
        };
        assert_eq!(of(1.0, 1.0).to_bits(), 0);
        assert_eq!(of(0.5, f32::INFINITY).to_bits(), 0);
        assert_eq!(of(0.0, f32::INFINITY).to_bits(), 0);
        assert_eq!(of(1.0, 0.0).to_bits(), 0);
        assert_eq!(of(2.0, 1.0).to_bits(), 0);
        assert_eq!(of(0.0, 1.0), 1e20);
        assert_eq!(of(0.5, 0.0), 1e20);
        assert_eq!(of(0.25, 2.0), std::f32::consts::LN_2);
        // Nearly white over a kilometre: in f32 the logarithm alone would be 3 % off.
        let exact = (-f64::from(0.999_999_f32).ln() / 1e3) as f32;
        assert_eq!(of(0.999_999, 1e3), exact);
    }

    #[test]
    fn feature_with_a_factor_of_zero_is_absent() {
        let mut m = Material::default();
        m.clearcoat.roughness.factor = 0.5;
        m.sheen.roughness.factor = 0.5;
        m.anisotropy.rotation = 1.0;
        m.transmission.dispersion = 1.0;
        m.volume = Some(Volume { attenuation_color: [0.5; 3], attenuation_distance: 1.0 });
        assert!(!m.has_extras() && !m.needs_tangents() && !m.has_dispersion() && m.interior().is_none());
        m.iridescence.factor.factor = 1.0;
        assert!(m.has_iridescence());
        m.iridescence.thickness_maximum.factor = 0.0;
        assert!(!m.has_iridescence(), "a film without thickness");
        m.transmission.factor.factor = 1.0;
        assert!(m.has_transmission() && m.has_dispersion() && m.interior().is_some());
        for other in [Material { unlit: true, ..m.clone() }, Material { disney: Some(Disney::default()), ..m }] {
            assert!(!other.has_transmission() && !other.has_dispersion() && other.interior().is_none());
            assert_eq!(other.has_extras(), other.is_disney());
        }
    }
}
