//! What must hold for any BSDF, checked from outside through a function that evaluates and one that samples.
//!
//! `chi_square` holds samples against the density, on the grid of directions that `domain` lays out; `checks` has energy,
//! reciprocity, finiteness and whether sample and value agree; `statistics` says how unlikely a sum is by chance.
//!
//! Every check says what it found as numbers; what is too much is the caller's to say.

pub mod checks;
pub mod chi_square;
pub mod domain;
pub mod statistics;

/// Value and density for one pair of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evaluated {
    /// BSDF times the cosine at `wi`, 1/sr per colour; no delta lobes.
    pub f_cos: [f32; 3],
    /// Density of sampling, 1/sr; no delta lobes.
    pub pdf: f32,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampled {
    /// Local, unit, away from the surface.
    pub wi: [f32; 3],
    /// BSDF times cosine over density, per colour.
    pub weight: [f32; 3],
    /// 1/sr; infinite: a delta lobe was sampled.
    pub pdf: f32,
}

/// A BSDF in local directions, z along the normal. Many at a time, so that lanes can be filled.
pub trait Scatterer {
    /// Seen from `wo`, for light from each of `wi`; one result for each.
    fn eval(&self, wo: [f32; 3], wi: &[[f32; 3]]) -> Vec<Evaluated>;
    /// Seen from `wo`, a direction by each of `u` in [0, 1)^3 (two for the direction, one for the lobe); `None`: no sample.
    fn sample(&self, wo: [f32; 3], u: &[[f32; 3]]) -> Vec<Option<Sampled>>;
}

/// A BSDF made of two functions of one direction each.
pub struct Functions<E, S> {
    /// `(wo, wi)` to value and density.
    pub eval: E,
    /// `(wo, u)` to a direction.
    pub sample: S,
}

impl<E, S> Scatterer for Functions<E, S>
where
    E: Fn([f32; 3], [f32; 3]) -> Evaluated,
    S: Fn([f32; 3], [f32; 3]) -> Option<Sampled>,
{
    fn eval(&self, wo: [f32; 3], wi: &[[f32; 3]]) -> Vec<Evaluated> {
        wi.iter().map(|&wi| (self.eval)(wo, wi)).collect()
    }

    fn sample(&self, wo: [f32; 3], u: &[[f32; 3]]) -> Vec<Option<Sampled>> {
        u.iter().map(|&u| (self.sample)(wo, u)).collect()
    }
}

/// A local direction with cosine `z` in [-1, 1] to the normal at azimuth `phi` in radians.
pub fn direction(z: f64, phi: f64) -> [f32; 3] {
    let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    [(r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32]
}
