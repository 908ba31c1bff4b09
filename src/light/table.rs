//! The lights of a scene: choosing one and a point on it, for next event estimation, and the density of that choice.
//!
//! A glowing mesh (each part of it that touches no other) is one light, however many triangles it has; of these one is
//! chosen in proportion to its area, unless they make a parallelogram or a bulb. By inverting distribution functions throughout (not by alias tables, which would undo
//! the stratification of the numbers).

use super::bounds::Bounds;
use super::choice::{Candidates, Choice, Receiver, Sky, Sun};
use super::element::{self, Element, LampTriangle, LightSample, sample_environment};
use super::environment::EnvironmentTable;
use super::prepared::{LampShape, PreparedLight};
use super::sized::Met;
use crate::material::table::MaterialTable;
use crate::math::{V3, distribution};
use crate::shape::moving::MovingTriangles;
use crate::shape::table::TriangleTable;
use crate::texture::lookup::TextureTable;
use glam::DVec3;
use simd::{Float, Lanes, Mask, Part, Uint};
use std::ops::Range;

#[path = "fixed.rs"]
mod fixed;

pub use fixed::FixedPoint;

/// What of the scene lights are read from.
#[derive(Clone, Copy)]
pub struct Sources<'a> {
    /// Attributes of emissive triangles.
    pub triangles: &'a TriangleTable,
    /// Their emission.
    pub materials: &'a MaterialTable,
    /// Its textures.
    pub textures: &'a TextureTable,
}

/// In place of a density.
const IS_BULB: f64 = -1.0;

/// The lights of a scene, in the order of their numbers: those with a place, then suns, then the environment.
#[derive(Clone, Debug, Default)]
pub struct LightTable {
    /// [`element::RECORDS`] each, those of a light together.
    elements: Vec<[f32; 4]>,
    /// A light's first element, the first of its `ends`, how many these are, and the density of a point on it given that
    /// it is chosen, 1/m^2, or [`IS_BULB`].
    lights: Vec<[f32; 4]>,
    /// Upper ends of the triangles' shares of their light, a table a mesh.
    ends: Vec<f32>,
    /// The largest table.
    most_ends: u32,
    emissive_meshes: usize,
    emissive_triangles: usize,
    /// Glowing spheres that are no mesh.
    exact_balls: usize,
    /// Surfaces that are sampled by points on them.
    has_lamps: bool,
    /// Some of them by the solid angle that they fill.
    has_rectangles: bool,
    has_bulbs: bool,
    has_punctual: bool,
    /// Some of them have a size.
    has_sized: bool,
    /// Numbers of the lights with a size that scattered rays find.
    balls: Range<u32>,
    suns: Range<u32>,
    environment: Option<EnvironmentTable>,
    samples_environment: bool,
    /// Punctual lights that move, at every key: two records, as the first two of an element.
    keys: Vec<[f32; 4]>,
    /// Some light moves.
    moves: bool,
    /// How one is chosen; `None` for a single light.
    choice: Option<Choice>,
}

impl LightTable {
    /// Of a scene of `radius` metres. Also tells the triangles of glowing meshes in `triangles` which light they are of.
    pub fn new(
        mut lights: Vec<PreparedLight>,
        environment: Option<EnvironmentTable>,
        radius: f64,
        triangles: &mut TriangleTable,
    ) -> Self {
        // Stable: surfaces, balls, points that move, other points, suns.
        lights.sort_by_key(|light| match light {
            PreparedLight::Mesh { .. } | PreparedLight::Ball { .. } => 0,
            PreparedLight::Point { radius, .. } if *radius > 0.0 => 1,
            PreparedLight::Point { .. } => 3 - u8::from(light.moves()),
            PreparedLight::Directional { .. } => 4,
        });
        let mut table = Self::default();
        // An environment that is the same all around is left to scattered rays, which find it wherever they go.
        let sky = environment.as_ref().and_then(|environment| Sky::new(environment.samples()));
        table.samples_environment = sky.is_some();
        let count = lights.len() + usize::from(sky.is_some());
        let mut order: Vec<u32> = (0..lights.len() as u32).collect();
        if count > 1 {
            let (choice, placed) = Choice::new(candidates(&lights, sky, radius, &triangles.moving));
            order[..placed.len()].copy_from_slice(&placed);
            table.choice = Some(choice);
        }
        for light in order {
            table.push(&lights[light as usize], triangles);
        }
        if table.samples_environment {
            table.push_element(0, 0, 0.0, element::environment());
        }
        table.environment = environment;
        if table.choice.as_ref().is_some_and(|choice| !choice.finds_balls()) {
            table.balls = 0..0;
        }
        table
    }

    fn push(&mut self, light: &PreparedLight, triangles: &mut TriangleTable) {
        match light {
            PreparedLight::Mesh { triangles: lamps, material, shape, .. } => {
                let number = self.lights.len() as u32;
                for lamp in lamps {
                    triangles.set_light(lamp.primitive as usize, number);
                }
                self.push_lamp(lamps, *material, shape, &triangles.moving);
                self.emissive_meshes += 1;
                self.emissive_triangles += lamps.len();
            }
            PreparedLight::Ball { bulb, primitive, .. } => {
                triangles.set_light(*primitive as usize, self.lights.len() as u32);
                self.push_element(0, 0, IS_BULB, element::bulb(bulb));
                self.has_bulbs = true;
                self.exact_balls += 1;
            }
            &PreparedLight::Point { position, intensity, cone, radius, ref later } => {
                if radius > 0.0 {
                    extend(&mut self.balls, self.lights.len() as u32);
                    self.has_sized = true;
                }
                self.push_punctual(element::point(position, intensity, cone, radius), later);
            }
            &PreparedLight::Directional { towards, illuminance, angular_radius, ref later } => {
                if angular_radius > 0.0 {
                    extend(&mut self.suns, self.lights.len() as u32);
                    self.has_sized = true;
                }
                let later: Vec<_> = later.iter().map(|&towards| (towards, glam::Vec3::ZERO)).collect();
                self.push_punctual(element::directional(towards, illuminance, angular_radius), &later);
            }
        }
    }

    /// A light of the one element `records`, whose first two records have these vectors at later times.
    fn push_punctual(
        &mut self,
        mut records: [[f32; 4]; element::RECORDS as usize],
        later: &[(glam::Vec3, glam::Vec3)],
    ) {
        if !later.is_empty() {
            element::set_keys(&mut records, self.keys.len() as u32, later.len() as u32);
            self.keys.extend([records[0], records[1]]);
            self.keys.extend(later.iter().flat_map(|(a, b)| [[a.x, a.y, a.z, 0.0], [b.x, b.y, b.z, 0.0]]));
            self.moves = true;
        }
        self.push_element(0, 0, 0.0, records);
        self.has_punctual = true;
    }

    /// A glowing mesh.
    fn push_lamp(&mut self, lamps: &[LampTriangle], material: u32, shape: &LampShape, moving: &MovingTriangles) {
        let areas: Vec<f64> = lamps.iter().map(|lamp| lamp.area).collect();
        let density = 1.0 / areas.iter().sum::<f64>();
        match shape {
            LampShape::Bulb(bulb) => {
                self.push_element(0, 0, IS_BULB, element::bulb(bulb));
                self.has_bulbs = true;
                return;
            }
            LampShape::Quad(quad) => {
                self.push_element(0, 0, density, element::quad(quad, lamps[0].ng, material));
                self.has_rectangles |= quad.inverse_lengths()[0] > 0.0;
            }
            LampShape::Triangles => {
                let first_end = self.ends.len();
                distribution::push_ends(&areas, &mut self.ends);
                let ends = self.ends.len() - first_end;
                self.most_ends = self.most_ends.max(ends as u32);
                let element = |lamp: &LampTriangle| {
                    let keys: Vec<_> = moving.corners(lamp.primitive).collect();
                    element::triangle(lamp, &keys, material)
                };
                self.moves |= lamps.iter().any(|lamp| moving.corners(lamp.primitive).next().is_some());
                self.push_element(first_end as u32, ends as u32, density, element(&lamps[0]));
                self.elements.extend(lamps[1..].iter().flat_map(element));
            }
        }
        self.has_lamps = true;
    }

    /// A light whose first element has these `records`.
    fn push_element(
        &mut self,
        first_end: u32,
        ends: u32,
        density: f64,
        records: [[f32; 4]; element::RECORDS as usize],
    ) {
        let first = (self.elements.len() / element::RECORDS as usize) as u32;
        self.lights.push([f32::from_bits(first), f32::from_bits(first_end), f32::from_bits(ends), density as f32]);
        self.elements.extend(records);
    }

    /// No light that is sampled.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Lights, a part of a glowing mesh that touches no other being one; with the environment, sampled or not.
    pub fn len(&self) -> usize {
        self.lights.len() + usize::from(self.has_environment() && !self.samples_environment)
    }

    /// Glowing meshes, or parts of them that touch no other.
    pub fn emissive_meshes(&self) -> usize {
        self.emissive_meshes
    }

    /// Their triangles.
    pub fn emissive_triangles(&self) -> usize {
        self.emissive_triangles
    }

    /// Some light can be hit by a ray.
    pub fn has_triangles(&self) -> bool {
        self.emissive_triangles > 0 || self.exact_balls > 0
    }

    /// Some light moves while the shutter is open.
    pub fn moves(&self) -> bool {
        self.moves
    }

    /// There is light from all around.
    pub fn has_environment(&self) -> bool {
        self.environment.is_some()
    }

    /// Numbers of the point and spot lights that scattered rays find: those that are balls, unless they are too many.
    pub fn balls(&self) -> Range<u32> {
        self.balls.clone()
    }

    /// Numbers of the directional lights that scattered rays find: those with an angle.
    pub fn suns(&self) -> Range<u32> {
        self.suns.clone()
    }

    /// What rays at `time` from `p` along the unit vectors `d` meet of the light `number` of [`Self::balls`], and the density with
    /// which it is sampled from `from` (receivers and sums; `None` in scenes without a choice), 1/sr.
    #[inline(always)]
    pub fn ball<L: Lanes>(
        &self,
        number: u32,
        (p, d): (V3<L>, V3<L>),
        time: L::F,
        from: Option<&(Receiver<L>, L::F)>,
    ) -> Met<L> {
        let met = self.only::<L>(number, time).meet_ball(p, d);
        if !met.meets.any() {
            return met;
        }
        let pmf = match (&self.choice, from) {
            (Some(choice), Some((at, total))) => choice.pmf_of_ball(number, at, *total),
            _ => L::F::one(),
        };
        Met { pdf: met.pdf * pmf, ..met }
    }

    /// [`Self::ball`] of the light `number` of [`Self::suns`].
    #[inline(always)]
    pub fn sun<L: Lanes>(&self, number: u32, d: V3<L>, time: L::F, from: Option<&(Receiver<L>, L::F)>) -> Met<L> {
        let met = self.only::<L>(number, time).meet_sun(d);
        if !met.meets.any() {
            return met;
        }
        let pmf = match (&self.choice, from) {
            (Some(choice), Some((at, total))) => choice.pmf_of_sun(number, at, *total),
            _ => L::F::one(),
        };
        Met { pdf: met.pdf * pmf, ..met }
    }

    /// The punctual light `number` in every lane.
    #[inline(always)]
    fn only<L: Lanes>(&self, number: u32, time: L::F) -> Element<L> {
        let element = Element::splat(self.records(number));
        if self.keys.is_empty() { element } else { element.punctual_at(self.records(number), &self.keys, time) }
    }

    /// Records of the elements of a light, and those after them.
    fn records(&self, light: u32) -> &[[f32; 4]] {
        let first = self.lights[light as usize][0].to_bits();
        &self.elements[(first * element::RECORDS) as usize..]
    }

    /// Whether the probability of a light depends on the point that it lights.
    pub fn has_choice(&self) -> bool {
        self.choice.is_some()
    }

    /// Numbers of f32 that [`Self::sample`] needs beside it.
    pub fn scratch(&self) -> usize {
        self.choice.as_ref().map_or(0, Choice::scratch)
    }

    /// Points `p` on flat opaque surfaces with the unit normals `n`.
    #[inline(always)]
    pub fn receiver<L: Lanes>(&self, p: V3<L>, n: V3<L>) -> Receiver<L> {
        Receiver { p, n, both_sides: L::M::from_bits(0), least: L::F::zero() }
    }

    /// Density (1/sr) of the point `at` on the surfaces `light` (a number of a light), seen in the unit direction -`wo` from
    /// `distance` metres away, at the cosine `cos` to its normal; given that they are chosen.
    #[inline(always)]
    pub fn density<L: Lanes>(&self, light: L::U, at: V3<L>, wo: V3<L>, distance: L::F, cos: L::F) -> L::F {
        let record = light.records(&self.lights);
        let mut density = record[3] * distance * distance / cos;
        if !self.has_bulbs && !self.has_rectangles {
            return density;
        }
        let is_bulb = record[3].lt(L::F::zero());
        let element = Element::<L>::load(&self.elements, record[0].to_bits(), L::F::one(), L::F::one());
        let from = wo.mul_add(distance, at);
        if self.has_rectangles {
            let (span, by_angle) = element.span(&self.elements, from);
            density = span.pdf().or_else(by_angle, density);
        }
        if self.has_bulbs {
            density = element.pdf_of_bulb(from).or_else(is_bulb, density);
        }
        density
    }

    /// Some lights are sampled by rays that look for them, see [`LightSample::sought`].
    pub fn has_bulbs(&self) -> bool {
        self.has_bulbs
    }

    /// Probability with which [`Self::sample`] chooses the surfaces `light` (no other number) from the receivers and sums of
    /// `from`: `None` in scenes without a choice.
    #[inline(always)]
    pub fn pmf<L: Lanes>(&self, light: L::U, from: Option<(Receiver<L>, L::F)>) -> L::F {
        match (&self.choice, from) {
            (Some(choice), Some((at, total))) => choice.pmf(light, &at, total),
            _ => L::F::one(),
        }
    }

    /// Probability with which [`Self::sample`] chooses the environment from the receivers and sums of `from`: `None` in
    /// scenes without a choice.
    #[inline(always)]
    pub fn pmf_of_environment<L: Lanes>(&self, from: Option<(Receiver<L>, L::F)>) -> L::F {
        match (&self.choice, from) {
            (Some(choice), Some((at, total))) => choice.pmf_of_sky(&at, total),
            _ => L::F::splat(if self.samples_environment { 1.0 } else { 0.0 }),
        }
    }

    /// What comes from infinitely far along the unit direction `d`: radiance (nits) and the density (1/sr) with which the
    /// environment is sampled there, once chosen. Nothing without an environment.
    #[inline(always)]
    pub fn environment<L: Lanes>(&self, d: V3<L>) -> (V3<L>, L::F) {
        let Some(environment) = &self.environment else { return (V3::zero(), L::F::zero()) };
        environment.lookup::<L>(d)
    }

    /// A light and a point on it at `time`, as seen from `at`, by `u` = (choice, point, point, triangle). The table must not
    /// be empty.
    #[inline(always)]
    pub fn sample<L: Lanes>(
        &self,
        at: &Receiver<L>,
        u: [L::F; 4],
        time: L::F,
        sources: Sources<'_>,
        scratch: &mut [f32],
    ) -> LightSample<L> {
        let (light, pmf, total) = match &self.choice {
            Some(choice) => {
                let chosen = choice.choose(at, u[0], scratch);
                (chosen.light, chosen.pmf, chosen.total)
            }
            None => (L::U::splat(0), L::F::one(), L::F::zero()),
        };
        let sample = L::outline(Sample { lights: self, light, pmf, p: at.p, u, time, sources });
        LightSample { total, ..sample }
    }
}

/// Appends a number to those from the first to the last.
fn extend(numbers: &mut Range<u32>, number: u32) {
    *numbers = if numbers.end == 0 { number } else { numbers.start }..number + 1;
}

/// How `lights` look from afar.
fn candidates(lights: &[PreparedLight], sky: Option<Sky>, radius: f64, moving: &MovingTriangles) -> Candidates {
    let mean = |c: [f32; 3]| c.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0;
    let mut candidates = Candidates { placed: Vec::new(), surfaces: 0, balls: 0, suns: Vec::new(), sky, radius };
    for light in lights {
        match light {
            PreparedLight::Mesh { triangles, radiance, both_sides, .. } => {
                let mut corners: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.corners.map(|c| c.as_dvec3())).collect();
                let later = triangles.iter().flat_map(|t| moving.corners(t.primitive).skip(1));
                corners.extend(later.map(|corners| corners.map(|c| c.as_dvec3())));
                // What moves is there once at every key, for a part of the time.
                let part = triangles.len() as f64 / corners.len() as f64;
                candidates.placed.push(Bounds::of_surface(&corners, *radiance, *both_sides).part(part));
                candidates.surfaces += 1;
            }
            PreparedLight::Ball { bulb, radiance, both_sides, .. } => {
                candidates.placed.push(Bounds::of_ball(bulb.centre.as_dvec3(), bulb.radius, *radiance, *both_sides));
                candidates.surfaces += 1;
            }
            PreparedLight::Point { position, intensity, cone, radius, later } => {
                let intensity = mean(*intensity);
                candidates.placed.push(match cone {
                    // It shines everywhere around where it may be: towards which side of that is not asked.
                    _ if !later.is_empty() => {
                        let share = intensity / (1 + later.len()) as f64;
                        let at = |place: &glam::Vec3| Bounds::of_point(place.as_dvec3(), share);
                        later.iter().fold(at(position), |all, (place, _)| all.union(&at(place))).widened(*radius)
                    }
                    Some((axis, inner, outer)) => {
                        let (inner, outer) = (f64::from(*inner), f64::from(*outer));
                        let spot = Bounds::of_spot(position.as_dvec3(), intensity, axis.as_dvec3(), inner, outer);
                        spot.with_radius(*radius)
                    }
                    None => Bounds::of_point(position.as_dvec3(), intensity).with_radius(*radius),
                });
                candidates.balls += usize::from(*radius > 0.0 || !later.is_empty());
            }
            PreparedLight::Directional { towards, illuminance, angular_radius, later } => {
                let (towards, illuminance) = (towards.as_dvec3(), mean(*illuminance));
                // Wherever it goes it is in the cone about where it starts.
                let from = |other: &glam::Vec3| towards.angle_between(other.as_dvec3());
                let turned = later.iter().map(from).fold(0.0, f64::max);
                let angular_radius = (angular_radius + turned).min(std::f64::consts::FRAC_PI_2);
                candidates.suns.push(Sun { towards, illuminance, angular_radius });
            }
        }
    }
    candidates
}

/// [`LightTable::sample`], the light being chosen.
struct Sample<'a, L: Lanes> {
    lights: &'a LightTable,
    light: L::U,
    pmf: L::F,
    p: V3<L>,
    u: [L::F; 4],
    time: L::F,
    sources: Sources<'a>,
}

impl<L: Lanes> Part<L> for Sample<'_, L> {
    type Output = LightSample<L>;

    #[inline(always)]
    fn run(self) -> LightSample<L> {
        let Self { lights, light, pmf, p, u, time, sources } = self;
        let record = light.records(&lights.lights);
        let mut index = record[0].to_bits();
        if lights.most_ends > 1 {
            let (first, count) = (record[1].to_bits(), record[2].to_bits());
            index = index + distribution::find_each::<L>(&lights.ends, first, count, lights.most_ends, u[3]);
        }
        let mut element = Element::<L>::load(&lights.elements, index, pmf, record[3]);
        if lights.moves {
            element = element.lamp_at(&lights.elements, sources.triangles, time);
            element = element.punctual_at(&lights.elements, &lights.keys, time);
        }
        let Some(environment) = lights.environment.as_ref().filter(|_| lights.samples_environment) else {
            return lights.sample_near(&element, light, p, [u[1], u[2]], &sources);
        };
        let far = element.is_environment();
        let sky = sample_environment(environment, pmf, [u[1], u[2]]);
        if !lights.has_triangles() && !lights.has_punctual {
            return sky;
        }
        merged(far, sky, lights.sample_near(&element, light, p, [u[1], u[2]], &sources))
    }
}

impl LightTable {
    /// The lights other than the environment.
    #[inline(always)]
    fn sample_near<L: Lanes>(
        &self,
        element: &Element<L>,
        light: L::U,
        p: V3<L>,
        u: [L::F; 2],
        sources: &Sources<'_>,
    ) -> LightSample<L> {
        if !self.has_punctual {
            return self.sample_surface(element, light, p, u, sources);
        }
        let punctual = if self.has_sized {
            // Balls that are too many to be looked for.
            element.sample_sized(p, u, self.choice.as_ref().is_none_or(Choice::finds_balls))
        } else {
            element.sample_punctual(p)
        };
        let on_surface = element.is_surface();
        if !self.has_triangles() || !on_surface.any() {
            return punctual;
        }
        merged(on_surface, self.sample_surface(element, light, p, u, sources), punctual)
    }

    /// Lamps and bulbs.
    #[inline(always)]
    fn sample_surface<L: Lanes>(
        &self,
        element: &Element<L>,
        light: L::U,
        p: V3<L>,
        u: [L::F; 2],
        sources: &Sources<'_>,
    ) -> LightSample<L> {
        if !self.has_bulbs {
            return element.sample_lamp(&self.elements, p, u, sources, self.has_rectangles);
        }
        let bulb = element.sample_bulb(light, p, u);
        let on_lamp = element.is_lamp();
        if !self.has_lamps || !on_lamp.any() {
            return bulb;
        }
        merged(on_lamp, element.sample_lamp(&self.elements, p, u, sources, self.has_rectangles), bulb)
    }
}

/// `a` in `lanes`, else `b`.
#[inline(always)]
fn merged<L: Lanes>(lanes: L::M, a: LightSample<L>, b: LightSample<L>) -> LightSample<L> {
    LightSample {
        radiance: a.radiance.or_else(lanes, b.radiance),
        wi: a.wi.or_else(lanes, b.wi),
        pdf: a.pdf.or_else(lanes, b.pdf),
        is_hidden: (a.is_hidden & lanes) | (b.is_hidden & !lanes),
        end: a.end.or_else(lanes, b.end),
        sought: a.sought.or_else(lanes, b.sought),
        reach: a.reach.or_else(lanes, b.reach),
        is_distant: (a.is_distant & lanes) | (b.is_distant & !lanes),
        valid: (a.valid & lanes) | (b.valid & !lanes),
        total: a.total.or_else(lanes, b.total),
    }
}
