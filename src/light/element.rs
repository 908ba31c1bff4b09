//! What light samples come from: triangles of glowing surfaces, bulbs, punctual lights, the environment.

use super::bounds::spot_scale;
use super::bulb::Bulb;
use super::environment::EnvironmentTable;
use super::quad::Quad;
use super::rect::Span;
use super::table::Sources;
use crate::math::{UvSets, V3, robust};
use crate::shape::moving::segment;
use crate::shape::table::{NONE, Triangle, TriangleTable};
use simd::{Float, Lanes, Mask, Uint};

/// Records of an element.
///
/// | record | x, y, z | w |
/// |---|---|---|
/// | 0 | corner, position or direction towards the light | kind |
/// | 1 | edge 1, or the spot's axis | attributes; of a parallelogram those of its first half |
/// | 2 | edge 2, or the spot's scale and outer cosine and its size: the squared radius (of bulbs too), or 1 - cos of the sun's | attributes of a parallelogram's second half; of a triangle that moves one more than its number, else 0 |
/// | 3 | intensity or illuminance; which corners of its halves the parallelogram's edges leave, 2 bits each; one over their lengths in a rectangle, else 0 | material |
/// | 4 | unit normal; of a punctual light that moves where its keys are and one less than it has of them | offset length |
pub const RECORDS: u32 = 5;
const TRIANGLE: u32 = 0;
const POINT: u32 = 1;
const SPOT: u32 = 2;
const DIRECTIONAL: u32 = 3;
const ENVIRONMENT: u32 = 4;
const BULB: u32 = 5;
const QUAD: u32 = 6;

/// An emissive triangle.
#[derive(Clone, Copy, Debug)]
pub struct LampTriangle {
    /// Corners, metres.
    pub corners: [glam::Vec3; 3],
    /// Unit normal of the front.
    pub ng: glam::Vec3,
    /// Square metres.
    pub area: f64,
    /// Its index among all triangles.
    pub primitive: u32,
    /// Attribute index or [`NONE`].
    pub attributes: u32,
}

/// A point on a light seen from a shading point.
pub struct LightSample<L: Lanes> {
    /// Radiance, nits; where `is_hidden` what a surface that faces the light gets, lux; 1 where a surface is `sought`.
    pub radiance: V3<L>,
    /// Unit, towards the light.
    pub wi: V3<L>,
    /// 1/sr with the selection pmf in it; the pmf alone where `is_hidden`.
    pub pdf: L::F,
    /// Light that is no part of the scene's surfaces and surroundings: no scattered ray finds it.
    pub is_hidden: L::M,
    /// Where the shadow ray ends, already off the light's surface; the direction itself for directional lights.
    pub end: V3<L>,
    /// Number of the light whose surface the shadow ray is to meet, for its radiance there; [`NONE`] where it is known.
    pub sought: L::U,
    /// How far away that is at most, metres; [`Self::end`] is then the nearest that it can be.
    pub reach: L::F,
    /// Lanes whose light is infinitely far.
    pub is_distant: L::M,
    /// Lanes that receive anything.
    pub valid: L::M,
    /// Importances of all lights together, see [`super::choice::Choice::pmf`].
    pub total: L::F,
}

/// Chosen elements: their first four records, and where the fifth is.
pub struct Element<L: Lanes> {
    pub(super) records: [[L::F; 4]; 4],
    normal: L::U,
    /// Unit normals of triangles, where some may have turned.
    turned: Option<V3<L>>,
    /// Selection pmf.
    pub pmf: L::F,
    /// Density of a point on it, given that the light is chosen, 1/m^2.
    pub density: L::F,
}

fn record(v: glam::Vec3, w: u32) -> [f32; 4] {
    [v.x, v.y, v.z, f32::from_bits(w)]
}

/// A triangle of a surface of `material`, with its corners at all keys if it moves.
pub fn triangle(lamp: &LampTriangle, keys: &[[glam::Vec3; 3]], material: u32) -> [[f32; 4]; RECORDS as usize] {
    let LampTriangle { corners, ng, attributes, primitive, .. } = *lamp;
    let mut offset = offset_length(&corners, ng);
    if !keys.is_empty() {
        // Whichever way it faces.
        offset = offset_length(keys.as_flattened(), glam::Vec3::splat(3f32.sqrt().recip()));
    }
    [
        record(corners[0], TRIANGLE),
        record(corners[1] - corners[0], attributes),
        record(corners[2] - corners[0], if keys.is_empty() { 0 } else { primitive + 1 }),
        record(glam::Vec3::ZERO, material),
        record(ng, offset.to_bits()),
    ]
}

/// How far shadow rays end off a light's surface with these corners, metres.
fn offset_length(corners: &[glam::Vec3], ng: glam::Vec3) -> f32 {
    let max_abs = corners.iter().fold(glam::Vec3::ZERO, |most, corner| most.max(corner.abs()));
    ng.abs().element_sum() * max_abs.max_element() * robust::gamma(16)
}

/// A parallelogram of `material` with the unit normal `ng`.
pub fn quad(quad: &Quad, ng: glam::Vec3, material: u32) -> [[f32; 4]; RECORDS as usize] {
    let Quad { v0, e1, e2, attributes: [near, far], apex: [i, k] } = *quad;
    let offset = offset_length(&[v0, v0 + e1, v0 + e2, v0 + e1 + e2], ng);
    let inverse = quad.inverse_lengths();
    [
        record(v0, QUAD),
        record(e1, near),
        record(e2, far),
        [f32::from_bits(i | k << 2), inverse[0], inverse[1], f32::from_bits(material)],
        record(ng, offset.to_bits()),
    ]
}

/// A bulb, whose radiance is where it is hit.
pub fn bulb(bulb: &Bulb) -> [[f32; 4]; RECORDS as usize] {
    let size = [0.0, 0.0, (bulb.radius * bulb.radius) as f32, 0.0];
    [record(bulb.centre, BULB), record(glam::Vec3::ZERO, NONE), size, [0.0; 4], [0.0; 4]]
}

/// A point light, or a spot light about an axis with the cosines of its inner and outer half angles; a ball of `radius`.
pub fn point(
    position: glam::Vec3,
    intensity: [f32; 3],
    cone: Option<(glam::Vec3, f32, f32)>,
    radius: f64,
) -> [[f32; 4]; RECORDS as usize] {
    let spot = |(axis, inner, outer): (glam::Vec3, f32, f32)| {
        (axis, spot_scale(f64::from(inner), f64::from(outer)) as f32, outer)
    };
    let (axis, scale, outer) = cone.map_or((glam::Vec3::ZERO, 0.0, 1.0), spot);
    [
        record(position, if cone.is_some() { SPOT } else { POINT }),
        record(axis, NONE),
        [scale, outer, (radius * radius) as f32, 0.0],
        record(intensity.into(), 0),
        [0.0; 4],
    ]
}

/// Parallel light, or that of a sun of `angular_radius` radians.
pub fn directional(towards: glam::Vec3, illuminance: [f32; 3], angular_radius: f64) -> [[f32; 4]; RECORDS as usize] {
    // 1 - cos, without its loss of digits.
    let size = 2.0 * (0.5 * angular_radius).sin().powi(2);
    let (axis, size) = (record(glam::Vec3::ZERO, NONE), [0.0, 0.0, size as f32, 0.0]);
    [record(towards, DIRECTIONAL), axis, size, record(illuminance.into(), 0), [0.0; 4]]
}

/// Tells a punctual light where its keys are, the first and the `later` ones.
pub fn set_keys(records: &mut [[f32; 4]; RECORDS as usize], first: u32, later: u32) {
    records[4] = [f32::from_bits(first), f32::from_bits(later), 0.0, 0.0];
}

/// Stands for the environment.
pub fn environment() -> [[f32; 4]; RECORDS as usize] {
    let mut records = [[0.0; 4]; RECORDS as usize];
    records[0][3] = f32::from_bits(ENVIRONMENT);
    records
}

impl<L: Lanes> Element<L> {
    /// Elements number `index`.
    #[inline(always)]
    pub fn load(elements: &[[f32; 4]], index: L::U, pmf: L::F, density: L::F) -> Self {
        let at = index * L::U::splat(RECORDS);
        let records = [
            at.records(elements),
            (at + L::U::splat(1)).records(elements),
            (at + L::U::splat(2)).records(elements),
            (at + L::U::splat(3)).records(elements),
        ];
        Self { records, normal: at + L::U::splat(4), turned: None, pmf, density }
    }

    /// The same element in every lane, certainly chosen; its records come first in `elements`.
    #[inline(always)]
    pub fn splat(elements: &[[f32; 4]]) -> Self {
        Self::load(elements, L::U::splat(0), L::F::one(), L::F::zero())
    }

    /// The same elements, triangles that move where they are at `time`.
    #[inline(always)]
    pub fn lamp_at(mut self, elements: &[[f32; 4]], triangles: &TriangleTable, time: L::F) -> Self {
        let one = L::U::splat(1);
        let number = self.records[2][3].to_bits();
        let moving = self.records[0][3].to_bits().eq(L::U::splat(TRIANGLE)) & !number.eq(L::U::splat(0));
        let Some(moved) = triangles.moving.at::<L>((number - one).or_else(moving, one), time, moving) else {
            return self;
        };
        let xyz = V3::<L>::of_record;
        let [corner, e1, e2, _] = &self.records;
        let none = L::U::splat(NONE);
        let (material, attributes, tangents, light) = (none, none, none, none);
        let ng = xyz(&self.normal.records(elements));
        let (v0, e1, e2) = (xyz(corner), xyz(e1), xyz(e2));
        let triangle = Triangle { v0, e1, e2, ng, material, attributes, tangents, light };
        let (triangle, growth) = triangles.moving.moved(&triangle, &moved);
        for (record, v) in self.records.iter_mut().zip([triangle.v0, triangle.e1, triangle.e2]) {
            (record[0], record[1], record[2]) = (v.x, v.y, v.z);
        }
        self.turned = Some(triangle.ng);
        self.density = self.density / growth;
        self
    }

    /// The same elements, punctual lights that move where they are at `time`; `keys` are those of [`set_keys`].
    #[inline(always)]
    pub fn punctual_at(mut self, elements: &[[f32; 4]], keys: &[[f32; 4]], time: L::F) -> Self {
        if keys.is_empty() {
            return self;
        }
        let kind = self.records[0][3].to_bits();
        let is_punctual = kind.eq(L::U::splat(POINT)) | kind.eq(L::U::splat(SPOT)) | kind.eq(L::U::splat(DIRECTIONAL));
        let place = self.normal.records(elements);
        let last = place[1].to_bits();
        let moving = is_punctual & !last.eq(L::U::splat(0));
        if !moving.any() {
            return self;
        }
        let two = L::U::splat(2);
        let (k, s) = segment::<L>(last.or_else(moving, L::U::splat(1)), time);
        let at = (place[0].to_bits() + k * two).or_else(moving, L::U::splat(0));
        let is_distant = kind.eq(L::U::splat(DIRECTIONAL));
        for (i, record) in self.records.iter_mut().take(2).enumerate() {
            let at = at + L::U::splat(i as u32);
            let (before, after) = (at.records(keys), (at + two).records(keys));
            let v = V3::<L>::of_record(&before).lerp(V3::of_record(&after), s);
            // Directions stay unit: those of suns come first, axes second.
            let unit = v.normalized();
            let is_direction = if i == 0 { is_distant } else { !is_distant };
            let v = unit.or_else(is_direction & unit.is_finite(), v).or_else(moving, V3::of_record(record));
            (record[0], record[1], record[2]) = (v.x, v.y, v.z);
        }
        self
    }

    /// Lanes whose element is the environment.
    #[inline(always)]
    pub fn is_environment(&self) -> L::M {
        self.records[0][3].to_bits().eq(L::U::splat(ENVIRONMENT))
    }

    /// Lanes whose element is a triangle or a parallelogram.
    #[inline(always)]
    pub fn is_lamp(&self) -> L::M {
        self.records[0][3].to_bits().eq(L::U::splat(TRIANGLE)) | self.is_quad()
    }

    #[inline(always)]
    fn is_quad(&self) -> L::M {
        self.records[0][3].to_bits().eq(L::U::splat(QUAD))
    }

    /// Lanes whose element is a lamp or a bulb.
    #[inline(always)]
    pub fn is_surface(&self) -> L::M {
        self.is_lamp() | self.records[0][3].to_bits().eq(L::U::splat(BULB))
    }

    /// The rectangles as seen from `p`, and the lanes that sample them by solid angle.
    #[inline(always)]
    pub fn span(&self, elements: &[[f32; 4]], p: V3<L>) -> (Span<L>, L::M) {
        let (records, xyz) = (&self.records, V3::<L>::of_record);
        let normal = self.normal.records(elements);
        let inverse = [records[3][1], records[3][2]];
        let span = Span::new(p, xyz(&records[0]), [xyz(&records[1]), xyz(&records[2])], xyz(&normal), inverse);
        let by_angle = self.is_quad() & inverse[0].gt(L::F::zero()) & span.is_large();
        (span, by_angle)
    }

    /// A point on the triangles and parallelograms, as seen from `p`: each as likely, on rectangles each direction if some
    /// element is one.
    #[inline(always)]
    pub fn sample_lamp(
        &self,
        elements: &[[f32; 4]],
        p: V3<L>,
        u: [L::F; 2],
        sources: &Sources<'_>,
        has_rectangles: bool,
    ) -> LightSample<L> {
        let Self { records, pmf, density, .. } = self;
        let Sources { triangles, materials, textures } = *sources;
        let normal = self.normal.records(elements);
        let xyz = V3::<L>::of_record;
        let ng = match self.turned {
            Some(ng) => ng,
            None => xyz(&normal),
        };
        // Uniform on the triangle: Heitz 2019, "A Low-Distortion Map Between Triangle and Square".
        let half = L::F::splat(0.5);
        let upper = u[1].gt(u[0]);
        let small = u[0].min(u[1]) * half;
        let is_quad = self.is_quad();
        let mut b1 = u[0].or_else(is_quad, small.or_else(upper, u[0] - small));
        let mut b2 = u[1].or_else(is_quad, (u[1] - small).or_else(upper, small));
        let mut rectangle = None;
        if has_rectangles {
            let (span, by_angle) = self.span(elements, p);
            let [s, t] = span.sample(u);
            (b1, b2) = (s.or_else(by_angle, b1), t.or_else(by_angle, b2));
            rectangle = Some((span.pdf(), by_angle));
        }
        let point = xyz(&records[2]).mul_add(b2, xyz(&records[1]).mul_add(b1, xyz(&records[0])));
        let to_light = point - p;
        let distance2 = to_light.dot(to_light);
        let wi = to_light.scale(L::F::one() / distance2.sqrt());
        let cos = -wi.dot(ng);
        let front = cos.gt(L::F::zero());
        let mut pdf = *density * distance2 / cos.abs();
        if let Some((own, by_angle)) = rectangle {
            pdf = own.or_else(by_angle, pdf);
        }
        let pdf = *pmf * pdf;
        // Off the light's surface, on the side that is seen.
        let side = L::F::one().or_else(front, -L::F::one());
        let end = robust::offset_point(point, ng.scale(side), normal[3]);
        let mut uvs = UvSets::single(L::F::zero(), L::F::zero());
        let mut vertex_opacity = L::F::one();
        if triangles.has_attributes() {
            let (attributes, b1, b2) = self.half(is_quad, b1, b2);
            if (!attributes.eq(L::U::splat(NONE))).any() {
                let a = triangles.attributes::<L>(attributes, b1, b2);
                (uvs, vertex_opacity) = (a.uvs, a.opacity);
            }
        }
        let finite = pdf.is_finite() & pdf.gt(L::F::zero()) & distance2.gt(L::F::zero());
        let material = records[3][3].to_bits();
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
            is_hidden: L::M::from_bits(0),
            end,
            sought: L::U::splat(NONE),
            reach: L::F::zero(),
            is_distant: L::M::from_bits(0),
            valid: finite & radiance.max_component().gt(L::F::zero()),
            total: L::F::zero(),
        }
    }

    /// Attributes and barycentric coordinates of points of triangles, and of parallelograms (in `is_quad`) on their halves.
    #[inline(always)]
    fn half(&self, is_quad: L::M, b1: L::F, b2: L::F) -> (L::U, L::F, L::F) {
        let (records, one) = (&self.records, L::F::one());
        let near = records[1][3].to_bits();
        if !is_quad.any() {
            return (near, b1, b2);
        }
        let sum = b1 + b2;
        let is_far = is_quad & one.lt(sum);
        let attributes = records[2][3].to_bits().or_else(is_far, near);
        // From the apex; then by the numbers of the corners.
        let (c1, c2) = ((one - b1).or_else(is_far, b1), (one - b2).or_else(is_far, b2));
        let c0 = (one - c1) - c2;
        let both = records[3][0].to_bits();
        let apex = both.shr(2).or_else(is_far, both & L::U::splat(3));
        let (first, second) = (is_quad & apex.eq(L::U::splat(1)), is_quad & apex.eq(L::U::splat(2)));
        (attributes, c0.or_else(first, c2.or_else(second, c1)), c1.or_else(first, c0.or_else(second, c2)))
    }

    /// The point, spot and directional lights without size.
    #[inline(always)]
    pub fn sample_punctual(&self, p: V3<L>) -> LightSample<L> {
        let record = &self.records;
        let kind = record[0][3].to_bits();
        let (zero, one) = (L::F::zero(), L::F::one());
        let place = V3::<L>::of_record(&record[0]);
        let is_distant = kind.eq(L::U::splat(DIRECTIONAL));
        let to_light = place - p;
        let distance2 = to_light.dot(to_light);
        let wi = place.or_else(is_distant, to_light.scale(one / distance2.sqrt()));
        let cos = -(V3::<L>::of_record(&record[1]).dot(wi));
        let falloff = ((cos - record[2][1]) * record[2][0]).max(zero).min(one);
        let attenuation = (falloff * falloff).or_else(kind.eq(L::U::splat(SPOT)), one);
        let scale = one.or_else(is_distant, attenuation / distance2);
        let radiance = V3::<L>::of_record(&record[3]).scale(scale);
        LightSample {
            radiance,
            wi,
            pdf: self.pmf,
            is_hidden: L::M::first(L::N),
            end: place,
            sought: L::U::splat(NONE),
            reach: L::F::zero(),
            is_distant,
            valid: radiance.is_finite() & wi.is_finite() & radiance.max_component().gt(zero) & self.pmf.gt(zero),
            total: zero,
        }
    }
}

/// A direction of the environment.
#[inline(always)]
pub fn sample_environment<L: Lanes>(environment: &EnvironmentTable, pmf: L::F, u: [L::F; 2]) -> LightSample<L> {
    let sample = environment.sample::<L>(u);
    let pdf = sample.pdf * pmf;
    LightSample {
        radiance: sample.radiance,
        wi: sample.direction,
        pdf,
        is_hidden: L::M::from_bits(0),
        end: sample.direction,
        sought: L::U::splat(NONE),
        reach: L::F::zero(),
        is_distant: L::M::first(L::N),
        valid: pdf.is_finite() & pdf.gt(L::F::zero()) & sample.radiance.max_component().gt(L::F::zero()),
        total: L::F::zero(),
    }
}
