//! What is inside the surfaces that bound something: absorption and index of refraction, as paths read them.

use super::Material;
use super::bsdf::DELTA_ALPHA;
use crate::math::V3;
use crate::math::lanes::exp;
use simd::{Float, Lanes, Uint};

/// The medium outside all surfaces: index of refraction 1, no absorption.
pub const AIR: u32 = 0;

const RECORDS: u32 = 2;
/// The surface is the boundary of its inside.
const BOUNDARY: u32 = 1;
/// The surface has no inside and may be so smooth that light goes straight through it.
const THIN: u32 = 2;

/// Index of refraction of what reflects everything (`ior` 0).
const REFLECTING: f32 = 1e9;

/// Wavelengths of the Fraunhofer lines F, d and C, nm: `ior` is the index at d, and Abbe's number is
/// `(n(d) - 1) / (n(F) - n(C))`.
pub const LINES: [f64; 3] = [486.1327, 587.5618, 656.2725];

/// Media by number: 0 is [`AIR`], m + 1 what is inside material m. Two 16-byte records each.
///
/// | record | x | y | z | w |
/// |---|---|---|---|---|
/// | 0 | absorption r, 1/m | g | b | flags |
/// | 1 | index at the d line | its difference between F and C | - | - |
#[derive(Clone, Debug)]
pub struct MediumTable {
    records: Vec<[f32; 4]>,
    has_volume: bool,
    has_thin_glass: bool,
    has_dispersion: bool,
    transmits: bool,
}

impl MediumTable {
    /// The insides of all materials of a scene, in order.
    pub fn new(materials: &[Material]) -> Self {
        let mut table = Self {
            records: vec![[0.0; 4], [1.0, 0.0, 0.0, 0.0]],
            has_volume: false,
            has_thin_glass: false,
            has_dispersion: false,
            transmits: false,
        };
        for m in materials {
            table.push(m);
        }
        if materials.is_empty() {
            table.push(&Material::default());
        }
        table
    }

    fn push(&mut self, m: &Material) {
        let interior = m.interior();
        let is_thin = m.has_transmission() && interior.is_none() && may_be_smooth(m);
        let ior = if m.ior == 0.0 { REFLECTING } else { m.ior };
        let dispersion = if m.has_dispersion() && m.ior != 0.0 { m.transmission.dispersion } else { 0.0 };
        let [r, g, b] = interior.map_or([0.0; 3], |volume| volume.absorption());
        let flags = if interior.is_some() { BOUNDARY } else { 0 } | if is_thin { THIN } else { 0 };
        // KHR_materials_dispersion: Abbe's number is 20 / dispersion.
        let spread = (ior - 1.0) * dispersion / 20.0;
        self.records.extend([[r, g, b, f32::from_bits(flags)], [ior, spread, 0.0, 0.0]]);
        self.has_volume |= interior.is_some();
        self.has_thin_glass |= is_thin;
        self.has_dispersion |= spread > 0.0;
        self.transmits |= m.has_transmission() || m.has_diffuse_transmission();
    }

    /// Whether any surface is the boundary of something that light gets into.
    pub fn has_volume(&self) -> bool {
        self.has_volume
    }

    /// Whether light may go straight through some surface.
    pub fn has_thin_glass(&self) -> bool {
        self.has_thin_glass
    }

    /// Whether the index of refraction of something depends on the wavelength.
    pub fn has_dispersion(&self) -> bool {
        self.has_dispersion
    }

    /// Whether light gets to the other side of any surface.
    pub fn transmits(&self) -> bool {
        self.transmits
    }

    /// The medium inside `material`.
    #[inline(always)]
    pub fn inside<L: Lanes>(material: L::U) -> L::U {
        material + L::U::splat(1)
    }

    #[inline(always)]
    fn record<L: Lanes>(&self, medium: L::U, k: u32) -> [L::F; 4] {
        (medium * L::U::splat(RECORDS) + L::U::splat(k)).records(&self.records)
    }

    /// The lanes whose surface bounds `medium`.
    #[inline(always)]
    pub fn is_boundary<L: Lanes>(&self, medium: L::U, active: L::M) -> L::M {
        active & self.record::<L>(medium, 0)[3].to_bits().has(BOUNDARY)
    }

    /// The lanes of materials of inside `medium` that have none and through which light may go straight.
    #[inline(always)]
    pub fn is_thin_glass<L: Lanes>(&self, medium: L::U, active: L::M) -> L::M {
        active & self.record::<L>(medium, 0)[3].to_bits().has(THIN)
    }

    /// Share of light, per colour, that is left after `distance` metres (>= 0, finite) in `medium`.
    #[inline(always)]
    pub fn transmittance<L: Lanes>(&self, medium: L::U, distance: L::F) -> V3<L> {
        let [r, g, b, _] = self.record::<L>(medium, 0);
        V3::new(exp::<L>(-(r * distance)), exp::<L>(-(g * distance)), exp::<L>(-(b * distance)))
    }

    /// Share of light that comes through `medium` from infinitely far: 1 where it absorbs nothing, else 0.
    #[inline(always)]
    pub fn transmittance_from_far<L: Lanes>(&self, medium: L::U) -> V3<L> {
        let [r, g, b, _] = self.record::<L>(medium, 0);
        let (zero, one) = (L::F::zero(), L::F::one());
        V3::new(one.masked(r.eq(zero)), one.masked(g.eq(zero)), one.masked(b.eq(zero)))
    }

    /// Index of refraction of `medium` at the d line.
    #[inline(always)]
    pub fn ior<L: Lanes>(&self, medium: L::U) -> L::F {
        self.record::<L>(medium, 1)[0]
    }

    /// The lanes whose medium has another index of refraction for every wavelength.
    #[inline(always)]
    pub fn is_dispersive<L: Lanes>(&self, medium: L::U) -> L::M {
        self.record::<L>(medium, 1)[1].gt(L::F::zero())
    }

    /// Index of refraction of `medium` at `wavelength`, nm; at the d line where that is 0. Cauchy's `A + B / wavelength^2`
    /// through the index at d and Abbe's number, at least 1 (`KHR_materials_dispersion`).
    #[inline(always)]
    pub fn ior_at<L: Lanes>(&self, medium: L::U, wavelength: L::F) -> L::F {
        let [ior, spread, ..] = self.record::<L>(medium, 1);
        let scale = L::F::splat(LINE_SCALE);
        let x = scale / (wavelength * wavelength) - L::F::splat((LINE_SCALE_F64 / (LINES[1] * LINES[1])) as f32);
        let dispersed = spread.mul_add(x, ior).max(L::F::one());
        dispersed.or_else(spread.gt(L::F::zero()) & wavelength.gt(L::F::zero()), ior)
    }
}

/// `1 / (1/F^2 - 1/C^2)`, nm^2: what `1 / wavelength^2` is measured in so that it differs by 1 between F and C.
const LINE_SCALE_F64: f64 = 1.0 / (1.0 / (LINES[0] * LINES[0]) - 1.0 / (LINES[2] * LINES[2]));
const LINE_SCALE: f32 = LINE_SCALE_F64 as f32;

/// Whether the roughness of `m` is 0 anywhere, as the closure takes it.
fn may_be_smooth(m: &Material) -> bool {
    let alpha = m.roughness.factor * m.roughness.factor;
    alpha < DELTA_ALPHA || m.roughness.texture.is_some()
}

#[cfg(test)]
#[path = "media_tests.rs"]
mod tests;
