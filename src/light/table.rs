//! Choosing a light and a point on it, for next event estimation.
//!
//! Emissive triangles, punctual lights and the environment share one list; one is chosen with probability proportional to its power,
//! by inverting the distribution function (not an alias table, which would undo the stratification of the number).

use super::environment::EnvironmentTable;
use crate::material::table::MaterialTable;
use crate::math::{UvSets, V3, distribution, robust};
use crate::shape::table::{NONE, TriangleTable};
use crate::texture::lookup::TextureTable;
use simd::{Float, Lanes, Mask, Part, Uint};

const RECORDS: u32 = 6;
const TRIANGLE: u32 = 0;
const POINT: u32 = 1;
const SPOT: u32 = 2;
const DIRECTIONAL: u32 = 3;
const ENVIRONMENT: u32 = 4;

/// A light in the prepared scene's space.
#[derive(Clone, Copy, Debug)]
pub enum PreparedLight {
    /// An emissive triangle.
    Triangle {
        /// Corners, metres.
        corners: [glam::Vec3; 3],
        /// Unit normal of the front.
        ng: glam::Vec3,
        /// Square metres.
        area: f64,
        /// Its index among all triangles.
        primitive: u32,
        /// Material index; emission is looked up there.
        material: u32,
        /// Attribute index or [`NONE`].
        attributes: u32,
    },
    /// A point light, or a spot light about `axis`.
    Point {
        /// Metres.
        position: glam::Vec3,
        /// cd per channel.
        intensity: [f32; 3],
        /// Unit axis and the cosines of the inner and outer half angles.
        cone: Option<(glam::Vec3, f32, f32)>,
    },
    /// Parallel light.
    Directional {
        /// Unit, towards the light.
        towards: glam::Vec3,
        /// lux per channel.
        illuminance: [f32; 3],
    },
}

/// The lights of a scene with their selection probabilities.
///
/// | record | x, y, z | w |
/// |---|---|---|
/// | 0 | corner, position or direction towards the light | kind |
/// | 1 | edge 1, or the spot's axis | pmf |
/// | 2 | edge 2, or the spot's scale and outer cosine | pmf / area |
/// | 3 | intensity or illuminance | material |
/// | 4 | unit normal | offset length |
/// | 5 | attributes | - |
#[derive(Clone, Debug, Default)]
pub struct LightTable {
    records: Vec<[f32; 4]>,
    /// Upper ends of the lights' shares of [0, 1).
    distribution: Vec<f32>,
    has_triangles: bool,
    has_punctual: bool,
    /// With its selection probability; chosen as the last light of the list.
    environment: Option<(EnvironmentTable, f32)>,
}

/// A point on a light seen from a shading point.
pub struct LightSample<L: Lanes> {
    /// Radiance of an area light, nits; intensity / distance^2 or illuminance of the others, lux.
    pub radiance: V3<L>,
    /// Unit, towards the light.
    pub wi: V3<L>,
    /// 1/sr with the selection pmf in it; the pmf alone for delta lights.
    pub pdf: L::F,
    /// Light without size: no BSDF sample can hit it.
    pub is_delta: L::M,
    /// Where the shadow ray ends, already off the light's surface; the direction itself for directional lights.
    pub end: V3<L>,
    /// Lanes whose light is infinitely far.
    pub is_distant: L::M,
    /// Lanes that receive anything.
    pub valid: L::M,
}

impl LightTable {
    /// Lights with their powers (any common unit); those without power must not be in the list. Also sets the light
    /// density of emissive triangles in `triangles`.
    pub fn new(
        lights: &[(PreparedLight, f64)],
        environment: Option<(EnvironmentTable, f64)>,
        triangles: &mut TriangleTable,
    ) -> Self {
        let mut powers: Vec<f64> = lights.iter().map(|l| l.1).collect();
        powers.extend(environment.as_ref().map(|e| e.1));
        let total: f64 = powers.iter().sum();
        let mut table = Self::default();
        for (light, power) in lights {
            table.push(light, power / total, triangles);
        }
        if let Some((environment, power)) = environment {
            let pmf = (power / total) as f32;
            let mut first = [[0.0; 4]; RECORDS as usize];
            first[0][3] = f32::from_bits(ENVIRONMENT);
            table.records.extend(first);
            table.environment = Some((environment, pmf));
        }
        distribution::push_ends(&powers, &mut table.distribution);
        table
    }

    fn push(&mut self, light: &PreparedLight, pmf: f64, triangles: &mut TriangleTable) {
        let record = |v: glam::Vec3, w: f32| [v.x, v.y, v.z, w];
        let kind = f32::from_bits;
        let (zero, pmf32) = (glam::Vec3::ZERO, pmf as f32);
        match *light {
            PreparedLight::Triangle { corners, ng, area, primitive, material, attributes } => {
                let density = (pmf / area) as f32;
                triangles.set_light_density(primitive as usize, density);
                let max_abs = corners[0].abs().max(corners[1].abs()).max(corners[2].abs());
                self.records.extend([
                    record(corners[0], kind(TRIANGLE)),
                    record(corners[1] - corners[0], pmf32),
                    record(corners[2] - corners[0], density),
                    record(zero, f32::from_bits(material)),
                    record(ng, ng.abs().element_sum() * max_abs.max_element() * robust::gamma(16)),
                    [f32::from_bits(attributes), 0.0, 0.0, 0.0],
                ]);
                self.has_triangles = true;
            }
            PreparedLight::Point { position, intensity, cone } => {
                // KHR_lights_punctual: attenuation = clamp((cos - cos outer) / (cos inner - cos outer))^2. Its sample code
                // takes at least 0.001 for the difference, which would dim narrow cones inside the inner angle.
                let (axis, scale, outer) = cone
                    .map_or((zero, 0.0, 1.0), |(axis, inner, outer)| (axis, 1.0 / (inner - outer).max(1e-6), outer));
                self.records.extend([
                    record(position, kind(if cone.is_some() { SPOT } else { POINT })),
                    record(axis, pmf32),
                    [scale, outer, 0.0, 0.0],
                    record(glam::Vec3::from_array(intensity), 0.0),
                    [0.0; 4],
                    [0.0; 4],
                ]);
                self.has_punctual = true;
            }
            PreparedLight::Directional { towards, illuminance } => {
                self.records.extend([
                    record(towards, kind(DIRECTIONAL)),
                    record(zero, pmf32),
                    [0.0; 4],
                    record(glam::Vec3::from_array(illuminance), 0.0),
                    [0.0; 4],
                    [0.0; 4],
                ]);
                self.has_punctual = true;
            }
        }
    }

    /// No light at all.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Lights.
    pub fn len(&self) -> usize {
        self.records.len() / RECORDS as usize
    }

    /// Some light can be hit by a ray.
    pub fn has_triangles(&self) -> bool {
        self.has_triangles
    }

    /// There is light from all around.
    pub fn has_environment(&self) -> bool {
        self.environment.is_some()
    }

    /// What comes from infinitely far along the unit direction `d`: radiance (nits) and the density (1/sr, selection pmf
    /// included) with which [`Self::sample`] would have chosen it. Nothing without an environment.
    #[inline(always)]
    pub fn environment<L: Lanes>(&self, d: V3<L>) -> (V3<L>, L::F) {
        let Some((environment, pmf)) = &self.environment else { return (V3::zero(), L::F::zero()) };
        let (radiance, pdf) = environment.lookup::<L>(d);
        (radiance, pdf * L::F::splat(*pmf))
    }

    /// The index of the light whose share of [0, 1) holds `u`; no work for a single light.
    #[inline(always)]
    fn choose<L: Lanes>(&self, u: L::F) -> L::U {
        distribution::find::<L>(&self.distribution, L::U::splat(0), self.distribution.len() as u32, u)
    }

    /// A light and a point on it, as seen from `p`, by `u` = (choice, point, point). The table must not be empty.
    #[inline(always)]
    pub fn sample<L: Lanes>(
        &self,
        p: V3<L>,
        u: [L::F; 3],
        triangles: &TriangleTable,
        materials: &MaterialTable,
        textures: &TextureTable,
    ) -> LightSample<L> {
        L::outline(Sample { lights: self, p, u, triangles, materials, textures })
    }

    #[inline(always)]
    fn sample_any<L: Lanes>(&self, sample: Sample<'_, L>) -> LightSample<L> {
        let Sample { p, u, triangles, materials, textures, .. } = sample;
        let at = self.choose::<L>(u[0]) * L::U::splat(RECORDS);
        let record = [
            at.records(&self.records),
            (at + L::U::splat(1)).records(&self.records),
            (at + L::U::splat(2)).records(&self.records),
            (at + L::U::splat(3)).records(&self.records),
        ];
        let kind = record[0][3].to_bits();
        let Some((environment, pmf)) = &self.environment else {
            return self.sample_near(p, u, at, &record, kind, triangles, materials, textures);
        };
        let far = kind.eq(L::U::splat(ENVIRONMENT));
        let sky = sample_environment(environment, *pmf, [u[1], u[2]]);
        if !self.has_triangles && !self.has_punctual {
            return sky;
        }
        let near = self.sample_near(p, u, at, &record, kind, triangles, materials, textures);
        LightSample {
            radiance: sky.radiance.or_else(far, near.radiance),
            wi: sky.wi.or_else(far, near.wi),
            pdf: sky.pdf.or_else(far, near.pdf),
            is_delta: near.is_delta & !far,
            end: sky.end.or_else(far, near.end),
            is_distant: near.is_distant | far,
            valid: (sky.valid & far) | (near.valid & !far),
        }
    }

    /// The lights other than the environment.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "tables are passed apart so that light does not know the integrator")]
    fn sample_near<L: Lanes>(
        &self,
        p: V3<L>,
        u: [L::F; 3],
        at: L::U,
        record: &[[L::F; 4]; 4],
        kind: L::U,
        triangles: &TriangleTable,
        materials: &MaterialTable,
        textures: &TextureTable,
    ) -> LightSample<L> {
        let on_triangle = kind.eq(L::U::splat(TRIANGLE));
        if !self.has_punctual {
            return self.sample_triangle(p, u, at, record, triangles, materials, textures);
        }
        let punctual = sample_punctual(p, record, kind);
        if !self.has_triangles || !on_triangle.any() {
            return punctual;
        }
        let area = self.sample_triangle(p, u, at, record, triangles, materials, textures);
        LightSample {
            radiance: area.radiance.or_else(on_triangle, punctual.radiance),
            wi: area.wi.or_else(on_triangle, punctual.wi),
            pdf: area.pdf.or_else(on_triangle, punctual.pdf),
            is_delta: !on_triangle,
            end: area.end.or_else(on_triangle, punctual.end),
            is_distant: punctual.is_distant & !on_triangle,
            valid: (area.valid & on_triangle) | (punctual.valid & !on_triangle),
        }
    }

    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "tables are passed apart so that light does not know the integrator")]
    fn sample_triangle<L: Lanes>(
        &self,
        p: V3<L>,
        u: [L::F; 3],
        at: L::U,
        record: &[[L::F; 4]; 4],
        triangles: &TriangleTable,
        materials: &MaterialTable,
        textures: &TextureTable,
    ) -> LightSample<L> {
        let normal = (at + L::U::splat(4)).records(&self.records);
        let xyz = xyz::<L>;
        let ng = xyz(&normal);
        // Uniform on the triangle: Heitz 2019, "A Low-Distortion Map Between Triangle and Square".
        let half = L::F::splat(0.5);
        let upper = u[2].gt(u[1]);
        let small = u[1].min(u[2]) * half;
        let b1 = small.or_else(upper, u[1] - small);
        let b2 = (u[2] - small).or_else(upper, small);
        let point = xyz(&record[2]).mul_add(b2, xyz(&record[1]).mul_add(b1, xyz(&record[0])));
        let to_light = point - p;
        let distance2 = to_light.dot(to_light);
        let wi = to_light.scale(L::F::one() / distance2.sqrt());
        let cos = -wi.dot(ng);
        let front = cos.gt(L::F::zero());
        let pdf = record[2][3] * distance2 / cos.abs();
        // Off the light's surface, on the side that is seen.
        let side = L::F::one().or_else(front, -L::F::one());
        let end = robust::offset_point(point, ng.scale(side), normal[3]);
        let mut uvs = UvSets::single(L::F::zero(), L::F::zero());
        let mut vertex_opacity = L::F::one();
        if triangles.has_attributes() {
            let attributes = (at + L::U::splat(5)).records(&self.records)[0].to_bits();
            if (!attributes.eq(L::U::splat(NONE))).any() {
                let a = triangles.attributes::<L>(attributes, b1, b2);
                (uvs, vertex_opacity) = (a.uvs, a.opacity);
            }
        }
        let finite = pdf.is_finite() & pdf.gt(L::F::zero());
        let material = record[3][3].to_bits();
        let mut radiance: V3<L> = materials.emission(textures, material, front, &uvs, finite);
        if materials.has_coat() {
            radiance =
                radiance.scale(materials.emission_through_coat::<L>(textures, material, cos.abs(), &uvs, finite));
        }
        if materials.has_alpha() {
            // The ray ends before the light's own surface, so what of it is not there is taken off here.
            radiance = radiance.scale(materials.coverage(textures, material, &uvs, vertex_opacity, finite));
        }
        LightSample {
            radiance,
            wi,
            pdf,
            is_delta: L::M::from_bits(0),
            end,
            is_distant: L::M::from_bits(0),
            valid: finite & radiance.max_component().gt(L::F::zero()),
        }
    }
}

/// A direction of the environment.
/// [`LightTable::sample`].
struct Sample<'a, L: Lanes> {
    lights: &'a LightTable,
    p: V3<L>,
    u: [L::F; 3],
    triangles: &'a TriangleTable,
    materials: &'a MaterialTable,
    textures: &'a TextureTable,
}

impl<L: Lanes> Part<L> for Sample<'_, L> {
    type Output = LightSample<L>;

    #[inline(always)]
    fn run(self) -> LightSample<L> {
        self.lights.sample_any(self)
    }
}

#[inline(always)]
fn sample_environment<L: Lanes>(environment: &EnvironmentTable, pmf: f32, u: [L::F; 2]) -> LightSample<L> {
    let sample = environment.sample::<L>(u);
    let pdf = sample.pdf * L::F::splat(pmf);
    LightSample {
        radiance: sample.radiance,
        wi: sample.direction,
        pdf,
        is_delta: L::M::from_bits(0),
        end: sample.direction,
        is_distant: L::M::first(L::N),
        valid: pdf.is_finite() & pdf.gt(L::F::zero()) & sample.radiance.max_component().gt(L::F::zero()),
    }
}

/// The point, spot and directional lights of `record`.
#[inline(always)]
fn sample_punctual<L: Lanes>(p: V3<L>, record: &[[L::F; 4]; 4], kind: L::U) -> LightSample<L> {
    let (zero, one) = (L::F::zero(), L::F::one());
    let place = xyz::<L>(&record[0]);
    let is_distant = kind.eq(L::U::splat(DIRECTIONAL));
    let to_light = place - p;
    let distance2 = to_light.dot(to_light);
    let wi = place.or_else(is_distant, to_light.scale(one / distance2.sqrt()));
    let cos = -(xyz::<L>(&record[1]).dot(wi));
    let falloff = ((cos - record[2][1]) * record[2][0]).max(zero).min(one);
    let attenuation = (falloff * falloff).or_else(kind.eq(L::U::splat(SPOT)), one);
    let scale = one.or_else(is_distant, attenuation / distance2);
    let radiance = xyz::<L>(&record[3]).scale(scale);
    LightSample {
        radiance,
        wi,
        pdf: record[1][3],
        is_delta: L::M::first(L::N),
        end: place,
        is_distant,
        valid: radiance.is_finite() & wi.is_finite() & radiance.max_component().gt(zero),
    }
}

#[inline(always)]
fn xyz<L: Lanes>(record: &[L::F; 4]) -> V3<L> {
    V3::new(record[0], record[1], record[2])
}
