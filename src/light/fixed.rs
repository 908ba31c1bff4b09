//! Lights without chance: each stands for itself by points that are always the same.

use super::{LightTable, Sources};
use crate::light::element::{Element, LightSample, sample_environment};
use crate::math::V3;
use simd::{Float, Lanes, Mask, Part, Scalar};

/// Points that an environment, or a glowing mesh of many triangles, is seen by; a square number.
const POINTS: u32 = 16;

/// A point that stands for a light, or for a part of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedPoint {
    /// What it is of.
    kind: Kind,
    /// Where on it, in the unit cube that chooses points of such a light: point, point, triangle.
    u: [f32; 3],
    /// What it counts of the light; those of a light sum to 1.
    pub share: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// A light without size, or taken for one, by its number.
    Punctual(u32),
    /// A glowing mesh, by its number.
    Surface(u32),
    Environment,
}

impl LightTable {
    /// The points that stand for the lights, in the order of these: punctual lights are points, whatever their size; a
    /// rectangle is its middle, with the solid angle that it fills; a bulb its middle; any other mesh up to 16 of its
    /// triangles, spread over its area, by their centroids; the environment 16 directions, each for a sixteenth of its
    /// light.
    pub fn fixed_points(&self) -> Vec<FixedPoint> {
        let mut points = Vec::new();
        for number in 0..self.lights.len() as u32 {
            let element = Element::<Scalar>::splat(self.records(number));
            if element.is_environment().any() {
                continue;
            }
            if !element.is_surface().any() {
                points.push(FixedPoint { kind: Kind::Punctual(number), u: [0.5; 3], share: 1.0 });
                continue;
            }
            let kind = Kind::Surface(number);
            match self.lights[number as usize][2].to_bits() {
                // Of the cone about a bulb the axis is at 0.
                0 if !element.is_lamp().any() => points.push(FixedPoint { kind, u: [0.0, 0.0, 0.5], share: 1.0 }),
                0 => points.push(FixedPoint { kind, u: [0.5; 3], share: 1.0 }),
                triangles => {
                    let count = triangles.min(POINTS);
                    let share = 1.0 / count as f32;
                    // Two thirds twice is the centroid in the map from the square.
                    let point = |i| FixedPoint { kind, u: [2.0 / 3.0, 2.0 / 3.0, (i as f32 + 0.5) * share], share };
                    points.extend((0..count).map(point));
                }
            }
        }
        if self.environment.is_some() {
            let side = POINTS.isqrt();
            let middle = |i: u32| (i as f32 + 0.5) / side as f32;
            let cells = (0..POINTS).map(|i| [middle(i % side), middle(i / side), 0.5]);
            points.extend(cells.map(|u| FixedPoint { kind: Kind::Environment, u, share: 1.0 / POINTS as f32 }));
        }
        points
    }

    /// `point` at `time` as seen from `p`: as if the light were chosen certainly.
    #[inline(always)]
    pub fn at_fixed<L: Lanes>(&self, point: &FixedPoint, p: V3<L>, time: L::F, sources: Sources<'_>) -> LightSample<L> {
        L::outline(Look { lights: self, point, p, time, sources })
    }
}

/// [`LightTable::at_fixed`].
struct Look<'a, L: Lanes> {
    lights: &'a LightTable,
    point: &'a FixedPoint,
    p: V3<L>,
    time: L::F,
    sources: Sources<'a>,
}

impl<L: Lanes> Part<L> for Look<'_, L> {
    type Output = LightSample<L>;

    #[inline(always)]
    fn run(self) -> LightSample<L> {
        use simd::Uint;
        let Self { lights, point, p, time, sources } = self;
        let (one, u) = (L::F::one(), point.u.map(L::F::splat));
        match (point.kind, &lights.environment) {
            (Kind::Environment, Some(environment)) => sample_environment(environment, one, [u[0], u[1]]),
            (Kind::Surface(number), _) => {
                let [first, first_end, ends, density] = lights.lights[number as usize];
                let mut index = L::U::splat(first.to_bits());
                if ends.to_bits() > 0 {
                    let (start, count) = (L::U::splat(first_end.to_bits()), L::U::splat(ends.to_bits()));
                    index = index
                        + crate::math::distribution::find_each::<L>(&lights.ends, start, count, ends.to_bits(), u[2]);
                }
                let mut element = Element::<L>::load(&lights.elements, index, one, L::F::splat(density));
                if lights.moves {
                    element = element.lamp_at(&lights.elements, sources.triangles, time);
                }
                lights.sample_surface(&element, L::U::splat(number), p, [u[0], u[1]], &sources)
            }
            (Kind::Punctual(number), _) => lights.only::<L>(number, time).sample_punctual(p),
            (Kind::Environment, None) => {
                LightSample { valid: L::M::from_bits(0), ..Element::<L>::splat(lights.records(0)).sample_punctual(p) }
            }
        }
    }
}
