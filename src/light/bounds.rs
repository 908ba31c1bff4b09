//! What a choice among lights knows of one light or of a group of them: where it is, which way it shines, how strongly.
//!
//! After Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG, section 4.

use glam::DVec3;
use std::f64::consts::PI;

/// Cosine of a cone of all directions; below -1, so that no rounding leaves a direction outside.
const ALL: f64 = -2.0;
/// Normals this close to one another are one, and a flat light is one whose corners are this near its plane, in radii.
const FLAT: f64 = 1e-6;
/// By how much a light is taken to be larger than it is, for the rounding of f32.
const SLACK: f64 = 1e-3;

/// A light, or a group of lights, from the outside.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Corners of the box around it, metres.
    low: DVec3,
    high: DVec3,
    /// Unit; what shines is within `cos_cone` of it: the normals of surfaces, the axis of a spot light.
    axis: DVec3,
    cos_cone: f64,
    /// Surfaces shine on both sides.
    both_sides: bool,
    /// In one plane.
    flat: bool,
    /// Irradiance times squared distance at its brightest far away: radiance x projected area, or intensity.
    strength: f64,
    /// Emission at the angle a from the nearest direction of the cone, as a share: `(cos a - start) x scale`, in [0, 1].
    falloff: [f64; 2],
    /// Irradiance on what it surrounds, `pi x radiance`; 0 where it cannot surround anything or is several lights.
    exitance: f64,
    /// Metres, of a ball; 0 of what is not one.
    ball: f64,
}

impl Bounds {
    /// A surface of triangles that shine with `radiance` (mean over channels and the surface) on one or on both sides.
    pub fn of_surface(triangles: &[[DVec3; 3]], radiance: f64, both_sides: bool) -> Self {
        let mut bounds = Self {
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
            axis: DVec3::Z,
            cos_cone: ALL,
            both_sides,
            flat: false,
            strength: 0.0,
            falloff: [0.0, 1.0],
            exitance: PI * radiance,
            ball: 0.0,
        };
        let mut sum = DVec3::ZERO;
        for corners in triangles {
            for &corner in corners {
                bounds.low = bounds.low.min(corner);
                bounds.high = bounds.high.max(corner);
            }
            sum += vector_area(corners);
        }
        if let Some(axis) = sum.try_normalize() {
            let cosine = |corners| {
                let cosine = vector_area(corners).normalize_or_zero().dot(axis);
                if both_sides { cosine.abs() } else { cosine }
            };
            let cos = triangles.iter().map(cosine).fold(1.0, f64::min);
            bounds.axis = axis;
            bounds.cos_cone = if cos > -1.0 + FLAT { cos } else { ALL };
            let off = |corner: &DVec3| (*corner - bounds.centre()).dot(axis).abs();
            let is_level = triangles.as_flattened().iter().all(|corner| off(corner) <= 100.0 * FLAT * bounds.radius());
            bounds.flat = cos > 1.0 - FLAT && is_level;
        }
        bounds.strength = radiance * projected_area(triangles, bounds.axis, both_sides);
        bounds
    }

    /// A ball whose surface shines with `radiance` (mean over channels and the surface).
    pub fn of_ball(centre: DVec3, radius: f64, radiance: f64, both_sides: bool) -> Self {
        Self {
            low: centre - radius,
            high: centre + radius,
            axis: DVec3::Z,
            cos_cone: ALL,
            both_sides,
            flat: false,
            strength: radiance * PI * radius * radius,
            falloff: [0.0, 1.0],
            exitance: PI * radiance,
            ball: radius,
        }
    }

    /// A point light of `intensity` (mean over channels).
    pub fn of_point(position: DVec3, intensity: f64) -> Self {
        Self {
            low: position,
            high: position,
            axis: DVec3::Z,
            cos_cone: ALL,
            both_sides: false,
            flat: false,
            strength: intensity,
            // The cosine is 1 everywhere.
            falloff: [-2.0, 1.0],
            exitance: 0.0,
            ball: 0.0,
        }
    }

    /// A spot light about the unit `axis`: none outside of the angle whose cosine is `outer`, all within that of `inner`.
    pub fn of_spot(position: DVec3, intensity: f64, axis: DVec3, inner: f64, outer: f64) -> Self {
        let falloff = [outer, spot_scale(inner, outer)];
        Self { axis, cos_cone: 1.0, falloff, ..Self::of_point(position, intensity) }
    }

    /// A point or spot light that is a ball of `radius` metres.
    pub fn with_radius(self, radius: f64) -> Self {
        Self { low: self.low - radius, high: self.high + radius, ball: radius, ..self }
    }

    /// What is somewhere within `radius` metres of its box.
    pub fn widened(self, radius: f64) -> Self {
        Self { low: self.low - radius, high: self.high + radius, ..self }
    }

    /// The same with a part of the strength.
    pub fn part(self, part: f64) -> Self {
        Self { strength: self.strength * part, ..self }
    }

    /// Both.
    pub fn union(&self, other: &Self) -> Self {
        let (axis, cos_cone) = join_cones((self.axis, self.cos_cone), (other.axis, other.cos_cone));
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            axis,
            cos_cone,
            both_sides: self.both_sides || other.both_sides,
            flat: false,
            strength: self.strength + other.strength,
            falloff: [self.falloff[0].min(other.falloff[0]), self.falloff[1].max(other.falloff[1])],
            exitance: 0.0,
            ball: 0.0,
        }
    }

    /// Centre of the box.
    pub fn centre(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    /// From the centre to the furthest point, metres: to a corner, but of a ball.
    pub fn radius(&self) -> f64 {
        if self.ball > 0.0 { self.ball } else { 0.5 * (self.high - self.low).length() }
    }

    /// Corners of the box.
    pub fn corners(&self) -> [DVec3; 2] {
        [self.low, self.high]
    }

    /// Irradiance times squared distance, see the field.
    pub fn strength(&self) -> f64 {
        self.strength
    }

    /// The mean direction in which it shines; shorter where there are several.
    pub fn direction(&self) -> DVec3 {
        if self.cos_cone > -1.0 { self.axis * (0.5 * (1.0 + self.cos_cone)) } else { DVec3::ZERO }
    }

    /// As lanes read it (`importance.rs`): strengths multiplied by `scale`, nothing smaller than `least` metres.
    pub fn records(&self, scale: f64, least: f64) -> [[f32; 4]; 3] {
        let centre = self.centre();
        let rounding = f64::from(f32::EPSILON) * centre.abs().max_element();
        let radius = (self.radius() * (1.0 + SLACK) + 4.0 * rounding).max(least);
        // Exactly 1 says that it is flat; what is not has a cone of 1e-3 rad at least.
        let cone = if self.flat { 1.0 } else { self.cos_cone.min(1.0 - FLAT) };
        let xyz = |v: DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        let [start, slope] = self.falloff.map(|v| v as f32);
        // The sign of the slope says whether both sides shine: it is positive.
        let slope = if self.both_sides { -slope } else { slope };
        let share = if self.exitance > 0.0 { 1.0 / (self.exitance * scale) } else { 0.0 };
        let strength = self.strength * scale / (radius * radius);
        [xyz(centre, radius), xyz(self.axis, cone), [strength as f32, start, slope, share as f32]]
    }
}

/// What the cosine from the axis of a spot light is multiplied by, so that it rises by 1 from `outer` to `inner`.
///
/// KHR_lights_punctual: attenuation = clamp((cos - cos outer) / (cos inner - cos outer))^2. Its sample code takes at least
/// 0.001 for the difference, which would dim narrow cones inside the inner angle.
pub fn spot_scale(inner: f64, outer: f64) -> f64 {
    1.0 / (inner - outer).max(1e-6)
}

/// Normal of the front times the area.
fn vector_area([a, b, c]: &[DVec3; 3]) -> DVec3 {
    0.5 * (*b - *a).cross(*c - *a)
}

/// The largest area seen from far away, of directions all around and of `axis`: the area itself of what is flat, a quarter
/// of that of a ball. What hides what is not asked.
fn projected_area(triangles: &[[DVec3; 3]], axis: DVec3, both_sides: bool) -> f64 {
    let mut directions = [axis; 27];
    for (i, direction) in directions.iter_mut().enumerate() {
        let grid = |step: usize| (i / step % 3) as f64 - 1.0;
        *direction = DVec3::new(grid(1), grid(3), grid(9)).try_normalize().unwrap_or(axis);
    }
    let mut seen = [0.0; 27];
    for corners in triangles {
        let area = vector_area(corners);
        for (seen, direction) in seen.iter_mut().zip(&directions) {
            let cosine = area.dot(*direction);
            *seen += if both_sides { cosine.abs() } else { cosine.max(0.0) };
        }
    }
    seen.into_iter().fold(0.0, f64::max)
}

/// The smallest cone around two; after pbrt-v4's `DirectionCone::Union`.
fn join_cones((a, cos_a): (DVec3, f64), (b, cos_b): (DVec3, f64)) -> (DVec3, f64) {
    if cos_a <= -1.0 || cos_b <= -1.0 {
        return (a, ALL);
    }
    let (half_a, half_b) = (cos_a.min(1.0).acos(), cos_b.min(1.0).acos());
    // Both ways round exact: acos(a . b) is not near 0.
    let between = 2.0 * (a - b).length().atan2((a + b).length());
    if (between + half_b).min(PI) <= half_a {
        return (a, cos_a);
    }
    if (between + half_a).min(PI) <= half_b {
        return (b, cos_b);
    }
    let half = 0.5 * (half_a + between + half_b);
    let turned = half - half_a;
    let across = (b - a * a.dot(b)).normalize_or_zero();
    // Opposite axes have no plane in common.
    if half >= PI - 1e-6 || across == DVec3::ZERO {
        return (a, ALL);
    }
    ((a * turned.cos() + across * turned.sin()).normalize(), half.cos())
}
