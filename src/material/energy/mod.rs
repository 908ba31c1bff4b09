//! How much of the light that arrives a rough surface gives back after one reflection, so that the rest can be given back
//! too: directional albedos of GGX, looked up N lanes at a time.
//!
//! After Kulla and Conty 2017, "Revisiting Physically Based Shading at Imageworks". [`quadrature`] integrates in f64,
//! [`tables`] stores it (`cargo run --release --example energy_tables`), and here it is turned into cells of four corners,
//! so that a lookup is one load a lane.

pub mod quadrature;
mod stretched;
pub mod tables;

use crate::math::V3;
use crate::math::lanes::lerp;
use simd::{Float, Lanes, Uint};
pub use stretched::Stretched;
use stretched::StretchedTables;
use tables::{GLASS, GLASS_MOST, NODES, SIDE, stored};

/// Which formulas surfaces follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Brdf {
    /// Energy-compensated and conserving, with exact Fresnel reflectances.
    #[default]
    Full,
    /// The single-scattering formulas of glTF 2.0 appendix B with height-correlated masking.
    AppendixB,
}

/// Cells of a two-dimensional table of `nx` x `ny` nodes: corners 00, 10 (x), 01 (y), 11.
fn cells(nx: usize, ny: usize, value: impl Fn(usize, usize) -> f32) -> Vec<[f32; 4]> {
    let corners = |j: usize, i: usize| [value(j, i), value(j, i + 1), value(j + 1, i), value(j + 1, i + 1)];
    (0..(nx - 1) * (ny - 1)).map(|n| corners(n / (nx - 1), n % (nx - 1))).collect()
}

/// The cell that holds position `at` in [0, 1] of an axis of `n` nodes, and where in it.
#[inline(always)]
fn cell<L: Lanes>(at: L::F, n: usize) -> (L::U, L::F) {
    let last = (n - 1) as f32;
    let scaled = (at.max(L::F::zero()) * L::F::splat(last)).min(L::F::splat(last));
    let low = scaled.floor().min(L::F::splat(last - 1.0));
    (low.to_uint(), scaled - low)
}

/// A column of a table, interpolated at `at` in [0, 1]. Means are taken of the tables as they are interpolated, so that
/// what is given back adds up.
fn column(values: &dyn Fn(usize) -> f32, at: f64) -> f64 {
    let x = at * (SIDE - 1) as f64;
    let i = (x as usize).min(SIDE - 2);
    let (a, b) = (f64::from(values(i)), f64::from(values(i + 1)));
    a + (b - a) * (x - i as f64)
}

/// `white` at roughness node `j` and cosine `mu`.
fn white_at(j: usize, mu: f64) -> f64 {
    let alpha = tables::row_alpha(j);
    column(&|i| stored().white[j * SIDE + i], (mu * (1.0 + alpha) / (mu + alpha)).sqrt())
}

/// The mean albedo `e` as it is interpolated: what is lost grows as the fourth power of the roughness.
fn lost(e: f32) -> f32 {
    (1.0 - e).max(0.0).powf(0.25)
}

/// The inverse of [`lost`].
#[inline(always)]
fn kept<L: Lanes>(lost: L::F) -> L::F {
    let square = lost * lost;
    L::F::one() - square * square
}

/// Bilinear.
#[inline(always)]
fn corners<L: Lanes>(table: &[[f32; 4]], index: L::U, fx: L::F, fy: L::F) -> L::F {
    let [a, b, c, d] = index.records(table);
    lerp(lerp(a, b, fx), lerp(c, d, fx), fy)
}

/// The tables as shading reads them, with those of each index of refraction that a scene's dielectrics have.
#[derive(Clone, Debug)]
pub struct Energy {
    /// Which formulas are followed.
    pub brdf: Brdf,
    white: Vec<[f32; 4]>,
    /// Per index of refraction, cells of [`Albedo::rise`] (by root cosine and roughness).
    rise: Vec<[f32; 4]>,
    /// Per index of refraction, by roughness: the mean of E as [`lost`], then that of E x rise, at both ends of the cell.
    means: Vec<[f32; 4]>,
    iors: Vec<f32>,
    /// By eta; empty in scenes without rough glass.
    glass: Vec<[f32; 4]>,
    stretched: StretchedTables,
    /// Per node, its shares; empty in scenes without films.
    hats: Vec<[f32; 4]>,
    /// Per roughness, the means of those.
    mean_hats: Vec<[f32; 4]>,
}

/// Cosines at which a film's reflectance is taken: all that are stored. With half as many a film of 1200 nm gains 2 %.
pub const FILM_NODES: usize = NODES;
const RECORDS: u32 = FILM_NODES as u32 / 4;

/// Cosine of node `k`.
pub fn film_cosine(k: usize) -> f32 {
    let root = k as f32 / (FILM_NODES - 1) as f32;
    root * root
}

const CELLS: usize = (SIDE - 1) * (SIDE - 1);

/// What a roughness fixes: where in the tables a surface is.
#[derive(Clone, Copy)]
pub struct Row<L: Lanes> {
    alpha: L::F,
    row: L::U,
    fy: L::F,
    class: L::U,
    /// Cosine-weighted mean of the albedo E.
    pub mean: L::F,
    /// Mean of E x rise over that of E: how far Fresnel's curve has risen on average.
    pub mean_rise: L::F,
}

impl<L: Lanes> Row<L> {
    /// Of a surface that nobody asks about.
    #[inline(always)]
    pub fn nowhere() -> Self {
        let (zero, none) = (L::F::zero(), L::U::splat(0));
        Self { alpha: zero, row: none, fy: zero, class: none, mean: L::F::one(), mean_rise: zero }
    }
}

impl Default for Energy {
    fn default() -> Self {
        Self::new(Brdf::Full)
    }
}

impl Energy {
    /// Without indices of refraction yet.
    pub fn new(brdf: Brdf) -> Self {
        let white = cells(SIDE, SIDE, |j, i| stored().white[j * SIDE + i]);
        let empty = Vec::new;
        let (rise, means, glass, hats, mean_hats) = (empty(), empty(), empty(), empty(), empty());
        let stretched = StretchedTables::default();
        Self { brdf, white, rise, means, iors: Vec::new(), glass, stretched, hats, mean_hats }
    }

    /// The number of the tables for dielectrics of index `ior` (>= 1, or 0 for infinite), made on first use.
    pub fn class(&mut self, ior: f32) -> u32 {
        if let Some(found) = self.iors.iter().position(|&i| i == ior) {
            return found as u32;
        }
        let nodes: [f64; NODES] =
            std::array::from_fn(|k| quadrature::rise(tables::node_cosine(k, NODES), f64::from(ior)));
        let hats = &stored().hats;
        let rise = |j: usize, i: usize| {
            let row = &hats[(j * SIDE + i) * NODES..][..NODES];
            row.iter().zip(nodes).map(|(&h, n)| f64::from(h) * n).sum::<f64>() as f32
        };
        self.rise.extend(cells(SIDE, SIDE, rise));
        let mean = |j: usize| {
            let e = quadrature::mean(512, |mu| white_at(j, mu));
            [e as f32, quadrature::mean(512, |mu| white_at(j, mu) * column(&|i| rise(j, i), mu.sqrt())) as f32]
        };
        let means: Vec<[f32; 2]> = (0..SIDE).map(mean).collect();
        self.means.extend(means.windows(2).map(|w| [lost(w[0][0]), lost(w[1][0]), w[0][1], w[1][1]]));
        self.iors.push(ior);
        (self.iors.len() - 1) as u32
    }

    /// Makes the tables of rough glass.
    pub fn add_glass(&mut self) {
        let [ns, ny, nx] = GLASS;
        for k in 0..ns {
            for w in 0..2 {
                self.glass.extend(cells(nx, ny, |j, i| stored().glass[((k * ny + j) * nx + i) * 2 + w]));
            }
        }
    }

    /// Makes the tables of thin films.
    pub fn add_film(&mut self) {
        let hats = &stored().hats;
        self.hats = hats.chunks_exact(4).map(|h| [h[0], h[1], h[2], h[3]]).collect();
        for j in 0..SIDE {
            let all = quadrature::mean(256, |mu| white_at(j, mu));
            let share = |k: usize| {
                let hat = |i: usize| hats[(j * SIDE + i) * FILM_NODES + k];
                (quadrature::mean(256, |mu| white_at(j, mu) * column(&hat, mu.sqrt())) / all) as f32
            };
            let shares: Vec<f32> = (0..FILM_NODES).map(share).collect();
            self.mean_hats.extend(shares.chunks_exact(4).map(|h| [h[0], h[1], h[2], h[3]]));
        }
    }

    /// Shares of the albedo towards cosine `mu` that come from normals at the nodes' cosines.
    #[inline(always)]
    pub fn film_shares<L: Lanes>(&self, row: &Row<L>, mu: L::F) -> [L::F; FILM_NODES] {
        let (i, fx) = cell::<L>(mu.sqrt(), SIDE);
        let first = (row.row * L::U::splat(SIDE as u32) + i) * L::U::splat(RECORDS);
        let mut shares = [L::F::zero(); FILM_NODES];
        for q in 0..RECORDS {
            let at = first + L::U::splat(q);
            let next = L::U::splat(RECORDS);
            let above = at + L::U::splat(RECORDS * SIDE as u32);
            let (a, b) = (at.records(&self.hats), (at + next).records(&self.hats));
            let (c, d) = (above.records(&self.hats), (above + next).records(&self.hats));
            for k in 0..4 {
                let (low, high) = (lerp(a[k], b[k], fx), lerp(c[k], d[k], fx));
                shares[q as usize * 4 + k] = lerp(low, high, row.fy);
            }
        }
        shares
    }

    /// The same, cosine-weighted over all directions.
    #[inline(always)]
    pub fn film_mean_shares<L: Lanes>(&self, row: &Row<L>) -> [L::F; FILM_NODES] {
        let mut shares = [L::F::zero(); FILM_NODES];
        for q in 0..RECORDS {
            let at = row.row * L::U::splat(RECORDS) + L::U::splat(q);
            let (a, b) = (at.records(&self.mean_hats), (at + L::U::splat(RECORDS)).records(&self.mean_hats));
            for k in 0..4 {
                shares[q as usize * 4 + k] = lerp(a[k], b[k], row.fy);
            }
        }
        shares
    }

    /// Where surfaces of perceptual roughness `sqrt(alpha)` and tables `class` are.
    #[inline(always)]
    pub fn row<L: Lanes>(&self, alpha: L::F, class: L::U) -> Row<L> {
        let (row, fy) = cell::<L>(alpha.sqrt().sqrt(), SIDE);
        let [e0, e1, r0, r1] = (class * L::U::splat(SIDE as u32 - 1) + row).records(&self.means);
        let mean = kept::<L>(lerp(e0, e1, fy));
        let mean_rise = lerp(r0, r1, fy) / mean;
        Row { alpha, row, fy, class, mean, mean_rise }
    }

    /// `row` at another `alpha`, but for its means.
    #[inline(always)]
    pub fn row_at<L: Lanes>(&self, row: &Row<L>, alpha: L::F) -> Row<L> {
        let (at, fy) = cell::<L>(alpha.sqrt().sqrt(), SIDE);
        Row { alpha, row: at, fy, ..*row }
    }

    /// Albedo towards cosine `mu` > 0 of GGX reflecting everything.
    #[inline(always)]
    pub fn white<L: Lanes>(&self, row: &Row<L>, mu: L::F) -> L::F {
        let x = (mu * (L::F::one() + row.alpha) / (mu + row.alpha)).sqrt();
        let (i, fx) = cell::<L>(x, SIDE);
        corners::<L>(&self.white, row.row * L::U::splat(SIDE as u32 - 1) + i, fx, row.fy)
    }

    /// How far Fresnel's curve has risen from normal incidence (0) to 1, on average over what is reflected towards cosine
    /// `mu` > 0.
    #[inline(always)]
    pub fn rise<L: Lanes>(&self, row: &Row<L>, mu: L::F) -> L::F {
        let (i, fx) = cell::<L>(mu.sqrt(), SIDE);
        let first = row.class * L::U::splat(CELLS as u32) + row.row * L::U::splat(SIDE as u32 - 1);
        corners::<L>(&self.rise, first + i, fx, row.fy)
    }

    /// What a rough boundary reflects and lets through of white light together, seen at cosine `mu` > 0 from the side
    /// before it: with `specular` = 1 by Fresnel's reflectance at `eta` (index behind / before), with 0 by total
    /// reflection only.
    #[inline(always)]
    pub fn glass<L: Lanes>(&self, eta: L::F, alpha: L::F, mu: L::F, specular: L::F) -> L::F {
        let one = L::F::one();
        let [ns, ny, nx] = GLASS;
        let s = (eta - one) / (eta + one);
        let root = (s.abs() * L::F::splat(1.0 / GLASS_MOST as f32)).sqrt().copysign(s);
        let (k, fs) = cell::<L>((root + one) * L::F::splat(0.5), ns);
        let (j, fy) = cell::<L>(alpha.sqrt(), ny);
        let (i, fx) = cell::<L>((mu * (one + alpha) / (mu + alpha)).sqrt(), nx);
        let size = ((nx - 1) * (ny - 1)) as u32;
        let first = (k + k) * L::U::splat(size) + j * L::U::splat(nx as u32 - 1) + i;
        let size = L::U::splat(size);
        let (a, b) = (first, first + size);
        let (c, d) = (b + size, b + size + size);
        let fresnel = lerp(corners::<L>(&self.glass, a, fx, fy), corners::<L>(&self.glass, c, fx, fy), fs);
        let none = lerp(corners::<L>(&self.glass, b, fx, fy), corners::<L>(&self.glass, d, fx, fy), fs);
        lerp(none, fresnel, specular)
    }
}

/// Reflectance of what is reflected more than once, for the mean Fresnel reflectance `f` and mean albedo `e`.
#[inline(always)]
pub fn again<L: Lanes>(f: V3<L>, e: L::F) -> V3<L> {
    let one = L::F::one();
    let x = again_of::<L>(f.x, e, one);
    V3::new(x, again_of::<L>(f.y, e, one), again_of::<L>(f.z, e, one))
}

#[inline(always)]
fn again_of<L: Lanes>(f: L::F, e: L::F, one: L::F) -> L::F {
    f * f * e / (one - f * (one - e)).max(L::F::splat(1e-6))
}
