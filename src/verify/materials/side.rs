//! A surface seen from one side, as the checks of [`crate::verify::bsdf`] want it: local directions, one lane.

use crate::material::bsdf::{DELTA_ALPHA, View};
use crate::material::energy::Energy;
use crate::material::layered::Layered;
use crate::material::surface::Surface;
use crate::math::{Frame, V3};
use crate::verify::bsdf::domain::Domain;
use crate::verify::bsdf::{Evaluated, Sampled, Scatterer};
use simd::{Float, Lanes, Mask, Scalar};

type F = <Scalar as Lanes>::F;

/// Lobes of less alpha than this are looked at in slopes: in angles they are points.
const NARROW: f64 = 0.05;

/// See [`Side::domains`].
const MOST_APART: f64 = 5.0;
const NARROWEST: f64 = 1e-3;
const LOWEST: f32 = 0.01;

/// A surface with the viewer on one side of it.
pub struct Side<'a> {
    /// Its parameters.
    pub surface: &'a Surface<Scalar>,
    /// With the tables of its index of refraction.
    pub energy: &'a Energy,
    /// Index of refraction behind the surface over that before it, as the viewer has it.
    pub eta: f32,
}

/// One hemisphere: that above the surface, or that below mirrored to above, as what goes through thin surfaces is as narrow
/// as what is reflected.
pub struct Half<'s> {
    /// Of both.
    pub side: &'s Side<'s>,
    /// Which.
    pub is_below: bool,
}

/// Radiance of what is refracted as energy: it is denser by 1 / eta^2 where it comes from the denser side.
pub struct AsEnergy<'s>(pub &'s Side<'s>);

fn vector(v: [f32; 3]) -> V3<Scalar> {
    V3::splat(v)
}

fn numbers(v: V3<Scalar>) -> [f32; 3] {
    [v.x.first(), v.y.first(), v.z.first()]
}

fn mirrored([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x, y, -z]
}

impl<'a> Side<'a> {
    fn closure(&self, wo: [f32; 3]) -> Layered<'a> {
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(vector);
        let view = View { eta: F::splat(self.eta), ..View::new(Frame { x, y, z }, vector(wo)) };
        Layered::new(self.surface, &view, None, self.energy)
    }

    /// A number of the extras; 0 without any.
    fn extra(&self, of: impl Fn(&crate::material::surface::Extras<Scalar>) -> F) -> f32 {
        self.surface.extras.as_ref().map_or(0.0, |extras| of(extras).first())
    }

    /// The surface is shaded by the Disney BRDF of 2012.
    pub fn is_disney(&self) -> bool {
        self.surface.extras.as_ref().is_some_and(|e| e.is_disney.any() && e.disney.is_some())
    }

    /// Something goes through it specularly.
    pub fn transmits(&self) -> bool {
        !self.is_disney() && self.extra(|e| e.transmission) > 0.0
    }

    /// Light is refracted on its way through.
    pub fn refracts(&self) -> bool {
        self.transmits() && self.surface.extras.as_ref().is_some_and(|e| e.is_volume.any())
    }

    /// It has a coat.
    pub fn is_coated(&self) -> bool {
        self.extra(|e| e.clearcoat) > 0.0
    }

    /// Share of what is transmitted diffusely.
    fn behind(&self) -> f32 {
        self.extra(|e| e.diffuse_transmission)
    }

    /// Whether it gives back all light: white, nothing absorbed. Sheen takes more from below than it reflects, as its
    /// extension wants it; the coat and the film do not.
    pub fn is_white(&self) -> bool {
        let is_one = |v: V3<Scalar>| numbers(v) == [1.0; 3];
        let below = self.surface.extras.as_ref().is_none_or(|e| {
            numbers(e.sheen) == [0.0; 3]
                && (e.diffuse_transmission.first() == 0.0 || is_one(e.diffuse_transmission_color))
        });
        // Both ways of getting through at once cannot be told apart from outside.
        is_one(self.surface.base) && !self.is_disney() && below && !(self.refracts() && self.behind() > 0.0)
    }

    /// It has a thin film.
    pub fn has_film(&self) -> bool {
        !self.is_disney() && self.extra(|e| e.iridescence) > 0.0
    }

    /// Its highlight is stretched.
    pub fn is_stretched(&self) -> bool {
        !self.is_disney() && self.extra(|e| e.anisotropy) > 0.0
    }

    /// Alphas along x and y of the specular lobes that are no mirrors.
    fn lobes(&self) -> Vec<[f64; 2]> {
        let mut lobes = Vec::new();
        let across = self.surface.roughness.first().powi(2);
        if self.is_disney() {
            // Its own coat and aspect are within a few times that.
            lobes.push([f64::from(across.max(1e-3)); 2]);
        } else if self.surface.has_specular().any() && (across >= DELTA_ALPHA || self.is_stretched()) {
            let across = across.max(DELTA_ALPHA);
            let strength = self.extra(|e| e.anisotropy);
            lobes.push([across + (1.0 - across) * strength * strength, across].map(f64::from));
        }
        let coat = self.extra(|e| e.clearcoat_roughness).powi(2);
        if self.is_coated() && coat >= DELTA_ALPHA {
            lobes.push([f64::from(coat); 2]);
        }
        lobes
    }

    /// Where samples are counted: all directions, or the narrow lobes above and below. Nothing where a narrow lobe is
    /// together with one `MOST_APART` times as wide: no grid resolves both; nor where the narrow one is of alpha below
    /// `NARROWEST` or seen at a cosine below `LOWEST`, where the integral of the density is not good enough in f32.
    pub fn domains(&self, wo: [f32; 3]) -> Vec<(Domain, Option<bool>)> {
        let lobes = self.lobes();
        let alphas = || lobes.iter().flatten().copied();
        let (least, most) = (alphas().fold(1.0, f64::min), alphas().fold(0.0, f64::max));
        if least >= NARROW {
            return vec![(Domain::Sphere, None)];
        }
        if most > MOST_APART * least || least < NARROWEST || wo[2] < LOWEST {
            return Vec::new();
        }
        let alpha = [least; 2];
        let mut domains = vec![(Domain::Reflected { alpha }, Some(false))];
        if self.refracts() && (self.eta - 1.0).abs() > 1e-3 {
            domains.push((Domain::Refracted { alpha, eta: f64::from(self.eta) }, None));
        } else if self.transmits() && !self.refracts() {
            domains.push((Domain::Reflected { alpha }, Some(true)));
        }
        domains
    }
}

impl Scatterer for Side<'_> {
    fn eval(&self, wo: [f32; 3], wi: &[[f32; 3]]) -> Vec<Evaluated> {
        let closure = self.closure(wo);
        let eval = |&wi: &[f32; 3]| {
            let value = closure.eval(vector(wi));
            Evaluated { f_cos: numbers(value.f_cos), pdf: value.pdf.first() }
        };
        wi.iter().map(eval).collect()
    }

    fn sample(&self, wo: [f32; 3], u: &[[f32; 3]]) -> Vec<Option<Sampled>> {
        let closure = self.closure(wo);
        let sample = |u: &[f32; 3]| {
            let found = closure.sample([F::splat(u[0]), F::splat(u[1])], F::splat(u[2]));
            let sampled = || Sampled { wi: numbers(found.wi), weight: numbers(found.weight), pdf: found.pdf.first() };
            found.valid.any().then(sampled)
        };
        u.iter().map(sample).collect()
    }
}

impl Scatterer for Half<'_> {
    fn eval(&self, wo: [f32; 3], wi: &[[f32; 3]]) -> Vec<Evaluated> {
        let own = |wi: [f32; 3]| if self.is_below { mirrored(wi) } else { wi };
        let turned: Vec<[f32; 3]> = wi.iter().map(|&wi| own(wi)).collect();
        let kept = |(value, wi): (Evaluated, &[f32; 3])| if wi[2] > 0.0 { value } else { Evaluated::default() };
        self.side.eval(wo, &turned).into_iter().zip(wi).map(kept).collect()
    }

    fn sample(&self, wo: [f32; 3], u: &[[f32; 3]]) -> Vec<Option<Sampled>> {
        let own = |s: Sampled| if self.is_below { Sampled { wi: mirrored(s.wi), ..s } } else { s };
        let kept = |sample: Option<Sampled>| sample.map(own).filter(|s| s.wi[2] > 0.0);
        self.side.sample(wo, u).into_iter().map(kept).collect()
    }
}

impl Scatterer for AsEnergy<'_> {
    fn eval(&self, wo: [f32; 3], wi: &[[f32; 3]]) -> Vec<Evaluated> {
        self.0.eval(wo, wi)
    }

    fn sample(&self, wo: [f32; 3], u: &[[f32; 3]]) -> Vec<Option<Sampled>> {
        let eta2 = self.0.eta * self.0.eta;
        // With diffuse transmission besides, which is not denser, less than the energy is better than more.
        let factor = if self.0.behind() > 0.0 { eta2.min(1.0) } else { eta2 };
        let factor = if self.0.refracts() { factor } else { 1.0 };
        let energy = |s: Sampled| {
            let weight = if s.wi[2] < 0.0 { s.weight.map(|w| w * factor) } else { s.weight };
            Sampled { weight, ..s }
        };
        self.0.sample(wo, u).into_iter().map(|sample| sample.map(energy)).collect()
    }
}
