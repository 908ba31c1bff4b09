//! Choosing a light by what a point may expect of each: all are asked in a scene of few lights, a cut through a tree in a
//! scene of many. Suns and the sky stand beside the tree, so that they are not lumped together with what is near.
//!
//! One number chooses, by inverting the distribution in an order that does not depend on the point: unlike resampling it
//! keeps the stratification of that number. The same functions give the probability of a light that a scattered ray
//! found, from the point where it was scattered, so that the weights of both strategies sum to 1.

mod cut;
mod importance;
mod packed;
mod sky;
mod tree;

pub use importance::Receiver;
pub use sky::Sky;

use super::bounds::Bounds;
use cut::CUT;
use importance::{of_ball, of_group, of_point, of_sun};
use simd::{Float, Lanes, Part, Uint};
use tree::Tree;

/// Up to so many lights with a place all are asked.
pub const MOST_ASKED: usize = 256;
/// No light is taken to be smaller than this part of the scene, so that importances stay in the range of f32.
const LEAST_PART: f64 = 1e-4;
/// Records of a light in the list.
const RECORDS: u32 = 3;
/// Of parallel light.
const SUN_RECORDS: usize = 2;
/// The largest f32 below 1.
const BELOW_1: f32 = 1.0 - f32::EPSILON / 2.0;

/// What the lights of a scene look like from afar, in the order of the choice.
pub struct Candidates {
    /// Lights with a place: surfaces first, then points and spots that are balls, then those without size.
    pub placed: Vec<Bounds>,
    /// How many of them are surfaces.
    pub surfaces: usize,
    /// How many are balls.
    pub balls: usize,
    /// Parallel light.
    pub suns: Vec<Sun>,
    /// The environment, if it is sampled.
    pub sky: Option<Sky>,
    /// Of the scene, metres.
    pub radius: f64,
}

/// Parallel light as the choice knows it.
pub struct Sun {
    /// Unit, to its middle.
    pub towards: glam::DVec3,
    /// Mean over channels, lux.
    pub illuminance: f64,
    /// Half the angle that it is seen at, radians, at most pi/2.
    pub angular_radius: f64,
}

/// How to choose among two or more lights.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Those with a place, [`RECORDS`] each; empty where there is a tree.
    list: Vec<[f32; 4]>,
    /// How many in the list are surfaces; balls, then points follow.
    surfaces: usize,
    balls: usize,
    tree: Option<Tree>,
    /// Lights with a place.
    placed: usize,
    /// Direction and illuminance, then the sine of the angular radius: [`SUN_RECORDS`] each.
    suns: Vec<[f32; 4]>,
    sky: Option<Sky>,
}

/// Lights that were chosen.
pub struct Chosen<L: Lanes> {
    /// Which, in the order of [`Candidates`] as [`Choice::new`] changed it.
    pub light: L::U,
    /// With which probability; 0 where no light can be expected.
    pub pmf: L::F,
    /// The importances of all lights together: [`Choice::pmf`] takes it.
    pub total: L::F,
}

impl Choice {
    /// Prepares the choice, and the order in which it counts lights with a place: numbers in `candidates.placed`.
    pub fn new(candidates: Candidates) -> (Self, Vec<u32>) {
        let Candidates { placed, surfaces, balls, suns, sky, radius } = candidates;
        let radius = radius.max(f64::from(f32::MIN_POSITIVE).sqrt());
        // About 1 in the middle of the scene: far from both ends of f32.
        let brightest = placed.iter().map(|b| b.strength() / (radius * radius));
        let brightest = brightest.chain(suns.iter().map(|s| s.illuminance)).chain(sky.as_ref().map(Sky::brightest));
        let scale = 1.0 / brightest.fold(f64::MIN_POSITIVE, f64::max);
        let least = radius * LEAST_PART;
        let mut order: Vec<u32> = (0..placed.len() as u32).collect();
        let (mut list, mut tree) = (Vec::new(), None);
        if placed.len() <= MOST_ASKED {
            list.extend(placed.iter().flat_map(|bounds| bounds.records(scale, least)));
        } else {
            tree = Some(Tree::new(&placed, &mut order, scale, least));
        }
        let sun = |sun: &Sun| {
            let d = sun.towards;
            let place = [d.x as f32, d.y as f32, d.z as f32, (sun.illuminance * scale) as f32];
            [place, [sun.angular_radius.sin() as f32, 0.0, 0.0, 0.0]]
        };
        let suns = suns.iter().flat_map(sun).collect();
        let sky = sky.map(|sky| sky.scaled(scale));
        (Self { list, surfaces, balls, tree, placed: placed.len(), suns, sky }, order)
    }

    /// Numbers of f32 that [`Self::choose`] needs beside it.
    pub fn scratch(&self) -> usize {
        let near = if self.tree.is_some() { CUT } else { self.placed };
        (near + self.suns.len() / SUN_RECORDS + usize::from(self.sky.is_some())) * 16
    }

    /// The number of the light that is the sky.
    pub fn sky_number(&self) -> u32 {
        (self.placed + self.suns.len() / SUN_RECORDS) as u32
    }

    /// A light for each receiver, by `u` in [0, 1).
    #[inline(always)]
    pub fn choose<L: Lanes>(&self, at: &Receiver<L>, u: L::F, scratch: &mut [f32]) -> Chosen<L> {
        L::outline(Choose { choice: self, at, u, scratch })
    }

    /// The probability with which [`Self::choose`] takes the surface `light` from `at`, where all importances together
    /// were `total`; 0 where that was 0.
    #[inline(always)]
    pub fn pmf<L: Lanes>(&self, light: L::U, at: &Receiver<L>, total: L::F) -> L::F {
        L::outline(Pmf { choice: self, light, at, total })
    }

    /// Scattered rays find lights that are balls: all are asked, so all may as well be looked for.
    pub fn finds_balls(&self) -> bool {
        self.tree.is_none()
    }

    /// The probability with which [`Self::choose`] takes the ball number `light`; there must be no tree.
    #[inline(always)]
    pub fn pmf_of_ball<L: Lanes>(&self, light: u32, at: &Receiver<L>, total: L::F) -> L::F {
        let first = light as usize * RECORDS as usize;
        let Some([a, b, c]) = self.list.get(first..first + RECORDS as usize) else { return L::F::zero() };
        let group = [splat::<L>(a), splat::<L>(b), splat::<L>(c)];
        (of_ball(&group, at) / total).masked(total.gt(L::F::zero()))
    }

    /// The probability with which [`Self::choose`] takes the parallel light number `light`.
    #[inline(always)]
    pub fn pmf_of_sun<L: Lanes>(&self, light: u32, at: &Receiver<L>, total: L::F) -> L::F {
        let first = (light as usize - self.placed) * SUN_RECORDS;
        let Some([place, size]) = self.suns.get(first..first + SUN_RECORDS) else { return L::F::zero() };
        (of_sun(&[splat::<L>(place), splat::<L>(size)], at) / total).masked(total.gt(L::F::zero()))
    }

    /// The probability with which [`Self::choose`] takes the sky.
    #[inline(always)]
    pub fn pmf_of_sky<L: Lanes>(&self, at: &Receiver<L>, total: L::F) -> L::F {
        let Some(sky) = &self.sky else { return L::F::zero() };
        (sky.importance(at) / total).masked(total.gt(L::F::zero()))
    }
}

/// [`Choice::choose`].
struct Choose<'a, L: Lanes> {
    choice: &'a Choice,
    at: &'a Receiver<L>,
    u: L::F,
    scratch: &'a mut [f32],
}

impl<L: Lanes> Part<L> for Choose<'_, L> {
    type Output = Chosen<L>;

    #[inline(always)]
    fn run(self) -> Chosen<L> {
        let Self { choice, at, u, scratch } = self;
        let (zero, one) = (L::F::zero(), L::F::one());
        let mut total = zero;
        // Importances, one after the other.
        let mut n = 0;
        let mut cut = None;
        if let Some(tree) = &choice.tree {
            let nodes = cut.insert(cut::cut(&tree.nodes, at));
            for importance in nodes.importance {
                push::<L>(importance, scratch, &mut n, &mut total);
            }
        } else {
            for (i, records) in choice.list.chunks_exact(RECORDS as usize).enumerate() {
                let group = [splat::<L>(&records[0]), splat::<L>(&records[1]), splat::<L>(&records[2])];
                let importance = if i < choice.surfaces {
                    of_group(&group, at).0
                } else if i < choice.surfaces + choice.balls {
                    of_ball(&group, at)
                } else {
                    of_point(&group, at)
                };
                push::<L>(importance, scratch, &mut n, &mut total);
            }
        }
        let near = n;
        for sun in choice.suns.chunks_exact(SUN_RECORDS) {
            push::<L>(of_sun(&[splat::<L>(&sun[0]), splat::<L>(&sun[1])], at), scratch, &mut n, &mut total);
        }
        if let Some(sky) = &choice.sky {
            push::<L>(sky.importance(at), scratch, &mut n, &mut total);
        }

        // The last sum is the total again, to the bit, and u x total is below it: the end is always found.
        let target = u * total;
        let (mut end, mut start, mut importance, mut place) = (zero, zero, zero, L::U::splat(0));
        for i in 0..n {
            let next = L::F::load(scratch, i * L::N);
            let before = end;
            end = before + next;
            let here = target.lt(end) & before.le(target);
            (start, importance) = (before.or_else(here, start), next.or_else(here, importance));
            place = L::U::splat(i as u32).or_else(here, place);
        }
        let mut pmf = (importance / total).masked(total.gt(zero));
        let mut light = place;
        if let (Some(tree), Some(cut)) = (&choice.tree, &cut) {
            let in_tree = place.lt(L::U::splat(near as u32));
            let (mut node, mut right, mut first) = (cut.nodes[0], cut.rights[0], cut.firsts[0]);
            for i in 1..CUT {
                let here = place.eq(L::U::splat(i as u32));
                (node, right) = (cut.nodes[i].or_else(here, node), cut.rights[i].or_else(here, right));
                first = cut.firsts[i].or_else(here, first);
            }
            let within = ((target - start) / importance).max(zero).min(L::F::splat(BELOW_1));
            let leaf = cut::descend(&tree.nodes, at, (node, right, first), within, in_tree & pmf.gt(zero));
            // Beyond the cut come the suns, beyond the lights of the tree.
            let beyond = place + L::U::splat((choice.placed - near) as u32);
            light = leaf.light.or_else(in_tree, beyond);
            pmf = pmf * leaf.pmf.or_else(in_tree, one);
        }
        Chosen { light, pmf, total }
    }
}

/// [`Choice::pmf`].
struct Pmf<'a, L: Lanes> {
    choice: &'a Choice,
    light: L::U,
    at: &'a Receiver<L>,
    total: L::F,
}

impl<L: Lanes> Part<L> for Pmf<'_, L> {
    type Output = L::F;

    #[inline(always)]
    fn run(self) -> L::F {
        let Self { choice, light, at, total } = self;
        let importance = match &choice.tree {
            None => {
                let first = light * L::U::splat(RECORDS);
                let one = L::U::splat(1);
                let group = [
                    first.records(&choice.list),
                    (first + one).records(&choice.list),
                    (first + one + one).records(&choice.list),
                ];
                of_group(&group, at).0 / total
            }
            Some(tree) => cut::pmf(&tree.nodes, at, light, total),
        };
        importance.masked(total.gt(L::F::zero()))
    }
}

/// Appends an importance.
#[inline(always)]
fn push<L: Lanes>(importance: L::F, scratch: &mut [f32], n: &mut usize, total: &mut L::F) {
    importance.store(scratch, *n * L::N);
    *total = *total + importance;
    *n += 1;
}

/// The same record in every lane.
#[inline(always)]
fn splat<L: Lanes>(record: &[f32; 4]) -> [L::F; 4] {
    [L::F::splat(record[0]), L::F::splat(record[1]), L::F::splat(record[2]), L::F::splat(record[3])]
}

#[cfg(test)]
#[path = "choice_tests.rs"]
mod tests;
