//! `verify materials`: what must be true of any BSDF, of the built-in grid of materials or the user's own.
//!
//! `grid` makes materials, `side` shows one as [`super::bsdf`] wants it, `judge` checks and knows the limits.

pub mod grid;
pub mod judge;
pub mod side;

use crate::error::RenderError;
use crate::material::Material;
use crate::material::energy::Brdf;
use crate::material::surface::Surface;
use crate::material::table::MaterialTable;
use crate::math::UvSets;
use crate::texture::lookup::TextureTable;
use crate::verify::bsdf::chi_square::views;
use judge::{Effort, Expected, Measured, judge, seed_of};
use rayon::prelude::*;
use serde::Serialize;
use side::Side;
use simd::{Float, Lanes, Mask, Scalar, Uint};

/// Samples of each chi-square test unless told otherwise.
pub const SAMPLES: usize = 100_000;

/// Places where textures are read: the same in all sets of coordinates.
const PLACES: [[f32; 2]; 4] = [[0.5, 0.5], [0.13, 0.29], [0.71, 0.18], [0.37, 0.86]];

/// What was found about one material.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct MaterialReport {
    pub name: String,
    /// Surfaces and directions that it was looked at from.
    pub views: usize,
    /// Least and greatest.
    pub albedo: [f64; 2],
    pub p_value: Option<f64>,
    pub integral: f64,
    pub agreement: f64,
    /// `None` where it need not be reciprocal.
    pub reciprocity: Option<f64>,
    pub faults: usize,
    /// What less is asked of it, and why.
    pub exceptions: Vec<&'static str>,
    /// What is beyond the limits.
    pub problems: Vec<String>,
}

impl MaterialReport {
    fn new(name: String, views: usize, expected: Expected, found: Measured) -> Self {
        let Measured { albedo, p_value, integral, agreement, reciprocity, faults, problems } = found;
        let reciprocity = (!expected.is_one_way).then_some(reciprocity);
        let exceptions = expected.exceptions;
        Self { name, views, albedo, p_value, integral, agreement, reciprocity, faults, exceptions, problems }
    }
}

/// The whole run.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Report {
    pub prt: &'static str,
    pub passed: bool,
    pub seed: u64,
    pub samples: usize,
    pub materials: Vec<MaterialReport>,
}

impl Report {
    /// Of `materials`, looked at with `seed` and `samples`.
    pub fn new(seed: u64, samples: usize, materials: Vec<MaterialReport>) -> Self {
        let passed = materials.iter().all(|m| m.problems.is_empty());
        Self { prt: crate::VERSION, passed, seed, samples, materials }
    }
}

/// The grid and `random` cells more, with the threads of rayon's current pool; what is found does not depend on how many
/// they are. Only every `stride`-th of them, from the first on.
pub fn built_in(samples: usize, seed: u64, random: usize, stride: usize) -> Vec<MaterialReport> {
    let energy = grid::energy(Brdf::Full);
    let mut cells = grid::cells(seed);
    cells.extend(grid::random(random, seed));
    let cells: Vec<_> = cells.into_iter().step_by(stride.max(1)).collect();
    let tests = 2 * cells.len();
    let one = |(i, cell): (usize, &grid::Cell)| {
        let surface = cell.surface();
        let side = cell.side(&surface, &energy);
        let effort = Effort { samples, furnace: FURNACE, seed: seed_of(seed, "cell", i as u64), tests };
        MaterialReport::new(cell.to_string(), 1, Expected::of(&side), judge(&side, cell.view(), effort))
    };
    cells.par_iter().enumerate().map(one).collect()
}

/// Samples along either side of the square of a furnace.
const FURNACE: usize = 256;

/// `materials` of a file, each where its textures are read at a few places, seen from ahead to grazing and from both sides
/// of glass. About the shading normal: normal maps are not part of it. Unlit ones reflect nothing and are left out.
///
/// # Errors
/// Textures that are too large.
pub fn of_file(
    file: &str,
    materials: &[Material],
    mut textures: TextureTable,
    samples: usize,
    seed: u64,
) -> Result<Vec<MaterialReport>, RenderError> {
    let table = MaterialTable::new(materials, &mut textures, Brdf::Full);
    let lit: Vec<(usize, &Material)> = materials.iter().enumerate().filter(|(_, m)| !m.unlit).collect();
    let places = |m: &Material| if m.textures().next().is_some() { PLACES.len() } else { 1 };
    let sides = |m: &Material| if m.volume.is_some() { 2 } else { 1 };
    let tests = 2 * views().len() * lit.iter().map(|(_, m)| places(m) * sides(m)).sum::<usize>();
    let one = |&(i, m): &(usize, &Material)| {
        let mut found = Measured::default();
        let mut expected = Expected::default();
        let jobs: Vec<(usize, bool, [f32; 3])> = (0..places(m))
            .flat_map(|p| (0..sides(m)).flat_map(move |s| views().into_iter().map(move |wo| (p, s == 1, wo))))
            .collect();
        let judged: Vec<(Expected, Measured)> = jobs
            .par_iter()
            .enumerate()
            .map(|(k, &(place, is_inside, wo))| {
                let surface = surface_at(&table, &textures, i, PLACES[place]);
                let side = Side { surface: &surface, energy: table.energy(), eta: grid::eta(m.ior, is_inside) };
                let seed = seed_of(seed, &format!("{file} {i}"), k as u64);
                (Expected::of(&side), judge(&side, wo, Effort { samples, furnace: FURNACE, seed, tests }))
            })
            .collect();
        for (of_place, measured) in judged {
            expected.is_one_way |= of_place.is_one_way;
            for reason in of_place.exceptions {
                if !expected.exceptions.contains(&reason) {
                    expected.exceptions.push(reason);
                }
            }
            found.add(measured);
        }
        let name = if m.name.is_empty() { format!("{file}: /materials/{i}") } else { format!("{file}: {}", m.name) };
        MaterialReport::new(name, jobs.len(), expected, found)
    };
    Ok(lit.par_iter().map(one).collect())
}

/// Material `i` where its textures are read at `[u, v]`.
fn surface_at(table: &MaterialTable, textures: &TextureTable, i: usize, [u, v]: [f32; 2]) -> Surface<Scalar> {
    let [u, v] = [u, v].map(<Scalar as Lanes>::F::splat);
    let mut uvs = UvSets::<Scalar>::single(u, v);
    (1..crate::math::MAX_UV_SETS).for_each(|k| uvs.set(k, u, v));
    let number = <Scalar as Lanes>::U::splat(i as u32);
    table.rich_surface::<Scalar>(textures, number, &uvs, <Scalar as Lanes>::M::first(1))
}
