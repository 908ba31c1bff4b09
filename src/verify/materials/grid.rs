//! The built-in materials: a pairwise covering design with all corners, made by code, always the same (BSDF-01).
//!
//! All 256 corners of eight parameters at their extremes, the other parameters spread over them; then cells until every
//! pair of values of two parameters occurs together. And, as many as wanted, cells at random.

use super::side::Side;
use crate::material::energy::{Brdf, Energy};
use crate::material::surface::{Extras, Surface};
use crate::math::V3;
use crate::math::random::Rng;
use crate::verify::bsdf::direction;
use simd::{Float, Lanes, Mask, Scalar, Uint};
use std::fmt;

/// Indices of refraction; 0 is infinite.
pub const IORS: [f32; 7] = [1.5, 0.0, 1.0, 1.0001, 1.01, 1.33, 2.42];
const ROUGHNESSES: [f32; 9] = [0.0, 1e-3, 0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 1.0];
const THIRDS: [f32; 3] = [0.0, 0.5, 1.0];
/// Cosines of the views: ahead, oblique, and ever closer to grazing.
pub const COSINES: [f32; 7] = [1.0, 0.9, 0.5, 0.1, 0.02, 1e-3, 1e-5];
const COAT_ROUGHNESSES: [f32; 3] = [0.0, 0.1, 0.5];
const SHEEN_ROUGHNESSES: [f32; 3] = [0.0, 0.3, 1.0];
/// nm.
const THICKNESSES: [f32; 5] = [0.0, 100.0, 400.0, 1200.0, 1e5];
const INFINITE: f32 = 1e9;

/// Values of each parameter; those that make corners come first.
const LEVELS: [usize; 12] = [9, 3, 3, 2, 3, 2, 2, 3, 7, 7, 2, 2];
const CORNERS: usize = 8;

/// One material of the grid, and the view that it is sampled from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Perceptual.
    pub roughness: f32,
    /// `metallicFactor`; so the others, named as in glTF.
    pub metallic: f32,
    /// See `metallic`.
    pub transmission: f32,
    /// The boundary of a volume.
    pub is_volume: bool,
    /// See `metallic`.
    pub clearcoat: f32,
    /// White if there is any.
    pub has_sheen: bool,
    /// The whole of it or nothing.
    pub has_iridescence: bool,
    /// See `metallic`.
    pub anisotropy: f32,
    /// Place in [`IORS`].
    pub ior: usize,
    /// Of the view.
    pub cosine: f32,
    /// The viewer is inside of the volume.
    pub is_inside: bool,
    /// The base is white; else orange.
    pub is_white: bool,
    /// Of the coat, perceptual.
    pub clearcoat_roughness: f32,
    /// Of the sheen, perceptual.
    pub sheen_roughness: f32,
    /// Of the film, nm.
    pub thickness: f32,
    /// Azimuth of the view, radians.
    pub azimuth: f32,
}

type Row = [usize; LEVELS.len()];

impl Cell {
    fn of(row: Row, rng: &mut Rng) -> Self {
        let [roughness, metallic, transmission, volume, clearcoat, sheen, film, anisotropy, ior, cosine, side, color] =
            row;
        Self {
            roughness: ROUGHNESSES[roughness],
            metallic: THIRDS[metallic],
            transmission: THIRDS[transmission],
            is_volume: volume == 1,
            clearcoat: THIRDS[clearcoat],
            has_sheen: sheen == 1,
            has_iridescence: film == 1,
            anisotropy: THIRDS[anisotropy],
            ior,
            cosine: COSINES[cosine],
            is_inside: side == 1,
            is_white: color == 0,
            clearcoat_roughness: rng.pick(&COAT_ROUGHNESSES),
            sheen_roughness: rng.pick(&SHEEN_ROUGHNESSES),
            thickness: rng.pick(&THICKNESSES),
            azimuth: rng.range(0.0, std::f32::consts::TAU),
        }
    }

    /// The view it is sampled from.
    pub fn view(&self) -> [f32; 3] {
        direction(f64::from(self.cosine), f64::from(self.azimuth))
    }

    /// Its parameters as shading has them.
    pub fn surface(&self) -> Surface<Scalar> {
        type M = <Scalar as Lanes>::M;
        let f = <Scalar as Lanes>::F::splat;
        let ior = IORS[self.ior];
        let extras = Extras {
            clearcoat: f(self.clearcoat),
            clearcoat_roughness: f(self.clearcoat_roughness),
            sheen: V3::splat([if self.has_sheen { 1.0 } else { 0.0 }; 3]),
            sheen_roughness: f(self.sheen_roughness),
            anisotropy: f(self.anisotropy),
            anisotropy_direction: [f(1.0), f(0.0)],
            iridescence: f(if self.has_iridescence { 1.0 } else { 0.0 }),
            iridescence_ior: f(1.3),
            iridescence_thickness: f(self.thickness),
            transmission: f(self.transmission),
            is_volume: M::first(usize::from(self.is_volume)),
            diffuse_transmission: f(0.0),
            diffuse_transmission_color: V3::splat([1.0; 3]),
            disney: None,
            is_disney: M::first(0),
        };
        Surface {
            base: V3::splat(if self.is_white { [1.0; 3] } else { [0.8, 0.4, 0.1] }),
            metallic: f(self.metallic),
            roughness: f(self.roughness),
            specular: f(1.0),
            f0: V3::splat([((ior - 1.0) / (ior + 1.0)).powi(2); 3]),
            ior: f(ior),
            class: <Scalar as Lanes>::U::splat(self.ior as u32),
            extras: Some(extras),
        }
    }

    /// `surface` as the cell's viewer sees it.
    pub fn side<'a>(&self, surface: &'a Surface<Scalar>, energy: &'a Energy) -> Side<'a> {
        Side { surface, energy, eta: eta(IORS[self.ior], self.is_inside) }
    }
}

/// Index of refraction behind the surface over that before it, seen from air or from inside of index `ior`.
pub fn eta(ior: f32, is_inside: bool) -> f32 {
    let ior = if ior == 0.0 { INFINITE } else { ior };
    if is_inside { 1.0 / ior } else { ior }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "roughness {} ior {}", self.roughness, IORS[self.ior])?;
        for (name, value) in [
            ("metallic", self.metallic),
            ("transmission", self.transmission),
            ("clearcoat", self.clearcoat),
            ("anisotropy", self.anisotropy),
        ] {
            if value > 0.0 {
                write!(f, " {name} {value}")?;
            }
        }
        if self.clearcoat > 0.0 {
            write!(f, " (roughness {})", self.clearcoat_roughness)?;
        }
        if self.has_sheen {
            write!(f, " sheen (roughness {})", self.sheen_roughness)?;
        }
        if self.has_iridescence {
            write!(f, " iridescence (thickness {})", self.thickness)?;
        }
        if self.is_volume && self.transmission > 0.0 {
            write!(f, " volume{}", if self.is_inside { " from inside" } else { "" })?;
        }
        if !self.is_white {
            write!(f, " orange")?;
        }
        Ok(())
    }
}

/// The tables that the grid's materials need.
pub fn energy(brdf: Brdf) -> Energy {
    let mut energy = Energy::new(brdf);
    for ior in IORS {
        energy.class(ior);
    }
    energy.add_glass();
    energy.add_stretched();
    energy.add_film();
    energy
}

/// The grid. `seed` decides what is not part of the design: the coat's and the sheen's roughness, the film's thickness and
/// the azimuth.
pub fn cells(seed: u64) -> Vec<Cell> {
    let mut rng = Rng::of_stream(seed, "grid", 0);
    design().into_iter().map(|row| Cell::of(row, &mut rng)).collect()
}

/// `count` cells at random.
pub fn random(count: usize, seed: u64) -> Vec<Cell> {
    let mut rng = Rng::of_stream(seed, "random cells", 0);
    let row = |rng: &mut Rng| LEVELS.map(|levels| rng.below(levels));
    (0..count).map(|_| row(&mut rng)).collect::<Vec<_>>().into_iter().map(|row| Cell::of(row, &mut rng)).collect()
}

/// The corners, then greedily what covers most of the pairs that are left.
fn design() -> Vec<Row> {
    let mut rng = Rng::of_stream(0, "design", 0);
    let mut rows = Vec::new();
    let mut open = Pairs::all();
    for corner in 0..1usize << CORNERS {
        let row: Row = std::array::from_fn(|k| match k < CORNERS {
            true => (corner >> k & 1) * (LEVELS[k] - 1),
            false => rng.below(LEVELS[k]),
        });
        open.cover(&row);
        rows.push(row);
    }
    while let Some(((i, a), (j, b))) = open.first() {
        let mut best = (0, [0; LEVELS.len()]);
        for _ in 0..40 {
            let mut row = LEVELS.map(|levels| rng.below(levels));
            (row[i], row[j]) = (a, b);
            let gain = open.gain(&row);
            if gain > best.0 {
                best = (gain, row);
            }
        }
        open.cover(&best.1);
        rows.push(best.1);
    }
    rows
}

/// A parameter's number and its value's.
type Value = (usize, usize);

/// Pairs of values that do not occur together yet.
struct Pairs(std::collections::BTreeSet<(Value, Value)>);

impl Pairs {
    fn all() -> Self {
        let n = LEVELS.len();
        let values = |k: usize| (0..LEVELS[k]).map(move |v| (k, v));
        let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
        Self(pairs.flat_map(|(i, j)| values(i).flat_map(move |a| values(j).map(move |b| (a, b)))).collect())
    }

    fn of(row: &Row) -> impl Iterator<Item = (Value, Value)> {
        let n = row.len();
        (0..n).flat_map(move |i| (i + 1..n).map(move |j| ((i, row[i]), (j, row[j]))))
    }

    fn first(&self) -> Option<(Value, Value)> {
        self.0.first().copied()
    }

    fn gain(&self, row: &Row) -> usize {
        Self::of(row).filter(|pair| self.0.contains(pair)).count()
    }

    fn cover(&mut self, row: &Row) {
        Self::of(row).for_each(|pair| _ = self.0.remove(&pair));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_values_and_every_corner_occurs_and_the_grid_is_always_the_same() {
        let rows = design();
        assert_eq!(rows, design());
        assert!((256..400).contains(&rows.len()), "{} cells", rows.len());
        let mut open = Pairs::all();
        rows.iter().for_each(|row| open.cover(row));
        assert_eq!(open.first(), None);
        let ends = |row: &&Row| (0..CORNERS).all(|k| row[k] == 0 || row[k] == LEVELS[k] - 1);
        let corners: std::collections::BTreeSet<_> =
            rows.iter().filter(ends).map(|row| row[..CORNERS].to_vec()).collect();
        assert_eq!(corners.len(), 256);
        assert_ne!(cells(1), cells(2));
    }
}
