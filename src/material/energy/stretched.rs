//! Albedos of anisotropic GGX: what it reflects towards a direction, and how far Fresnel's curve has risen there.
//!
//! Of the rise the table has that of Schlick's curve. Those of exact curves, of which every index of refraction has its
//! own, are taken from the round lobe of the alpha that counts in that azimuth, by the power that makes Schlick's right.

use super::{Energy, Row, cell, cells, corners, kept, lost, tables};
use crate::math::V3;
use crate::math::lanes::{exp, lerp, ln};
use simd::{Float, Lanes, Scalar, Uint};
use tables::{STRETCHED, node, stored};

/// The tables; empty in scenes without anisotropy.
#[derive(Clone, Debug, Default)]
pub(super) struct StretchedTables {
    /// Per strength and roughness, by cosine and azimuth: the albedo, then the fifth root of the rise of Schlick's curve.
    cells: Vec<[f32; 4]>,
    /// Mean of the albedo, as [`lost`], by strength and roughness.
    means: Vec<[f32; 4]>,
    /// Per index of refraction the mean of albedo x rise over that of the albedo.
    rises: Vec<[f32; 4]>,
    /// Number of the tables of round lobes with Schlick's curve.
    schlick: u32,
}

/// Where an anisotropic surface is; see [`Row`].
#[derive(Clone, Copy)]
pub struct Stretched<L: Lanes> {
    /// Along and across.
    alphas: [L::F; 2],
    first: L::U,
    fl: L::F,
    fk: L::F,
    /// Cosine-weighted mean of the albedo.
    pub mean: L::F,
    /// Mean of the albedo x rise over that.
    pub mean_rise: L::F,
    /// The same with Schlick's curve.
    pub mean_schlick: L::F,
}

/// Directions of the means: azimuths in a quarter turn, and cosines.
const AZIMUTHS: usize = 16;
const COSINES: usize = 48;

impl Energy {
    /// Makes the tables of anisotropic surfaces, for the indices of refraction that there are by now.
    pub fn add_stretched(&mut self) {
        use rayon::prelude::*;
        type F = <Scalar as Lanes>::F;
        let [nl, nk, nj, ni] = STRETCHED;
        self.stretched = StretchedTables { schlick: self.class(0.0), ..StretchedTables::default() };
        for slice in stored().stretched.chunks(nj * ni * 2) {
            for w in 0..2 {
                self.stretched.cells.extend(cells(ni, nj, |j, i| slice[(j * ni + i) * 2 + w]));
            }
        }
        let classes = self.iors.len();
        // Of the tables as they are interpolated, so that what is given back adds up.
        let mean = |n: usize| {
            let (l, k) = (n % nl, n / nl);
            let alpha = F::splat(tables::alpha_at(node(k, nk)) as f32);
            let row = self.stretched_place::<Scalar>(alpha, F::splat(node(l, nl) as f32));
            let (mut all, mut rises) = (0.0, vec![0.0; classes]);
            for at in 0..AZIMUTHS * COSINES {
                let phi = (at % AZIMUTHS) as f64 + 0.5;
                let root = ((at / AZIMUTHS) as f64 + 0.5) / COSINES as f64;
                let w = super::quadrature::direction(root * root, phi / AZIMUTHS as f64 * std::f64::consts::FRAC_PI_2);
                let w = V3::<Scalar>::splat(w.map(|c| c as f32));
                // 2 mu dmu = 4 root^3 droot.
                let share = 4.0 * root.powi(3) / (AZIMUTHS * COSINES) as f64;
                let [white, schlick] = self.stretched::<Scalar>(&row, w).map(|v| f64::from(v.first()));
                all += share * white;
                for (class, sum) in rises.iter_mut().enumerate() {
                    let round = self.row::<Scalar>(row.toward(w), <Scalar as Lanes>::U::splat(class as u32));
                    let rise = self.stretched_rise::<Scalar>(&round, w.z, F::splat(schlick as f32));
                    *sum += share * white * f64::from(rise.first());
                }
            }
            (lost(all as f32), rises.into_iter().map(|r| (r / all) as f32).collect::<Vec<f32>>())
        };
        let found: Vec<(f32, Vec<f32>)> = (0..nl * nk).into_par_iter().map(mean).collect();
        self.stretched.means = cells(nl, nk, |k, l| found[k * nl + l].0);
        for class in 0..classes {
            self.stretched.rises.extend(cells(nl, nk, |k, l| found[k * nl + l].1[class]));
        }
    }

    /// Where anisotropic surfaces of `alpha` across, `strength` and tables `class` are.
    #[inline(always)]
    pub fn stretched_row<L: Lanes>(&self, alpha: L::F, strength: L::F, class: L::U) -> Stretched<L> {
        let [nl, nk, ..] = STRETCHED;
        let (l, fl) = cell::<L>(strength, nl);
        let (k, fk) = cell::<L>(alpha.sqrt(), nk);
        let at = k * L::U::splat(nl as u32 - 1) + l;
        let mean = kept::<L>(corners::<L>(&self.stretched.means, at, fl, fk));
        let size = L::U::splat(((nl - 1) * (nk - 1)) as u32);
        let mean_rise = corners::<L>(&self.stretched.rises, class * size + at, fl, fk);
        let schlick = L::U::splat(self.stretched.schlick) * size + at;
        let mean_schlick = corners::<L>(&self.stretched.rises, schlick, fl, fk);
        Stretched { mean, mean_rise, mean_schlick, ..self.stretched_place(alpha, strength) }
    }

    /// The same without the means.
    #[inline(always)]
    fn stretched_place<L: Lanes>(&self, alpha: L::F, strength: L::F) -> Stretched<L> {
        let [nl, nk, ..] = STRETCHED;
        let (l, fl) = cell::<L>(strength, nl);
        let (k, fk) = cell::<L>(alpha.sqrt(), nk);
        let along = alpha + (L::F::one() - alpha) * strength * strength;
        let first = l * L::U::splat(nk as u32) + k;
        Stretched {
            alphas: [along, alpha],
            first,
            fl,
            fk,
            mean: L::F::one(),
            mean_rise: L::F::zero(),
            mean_schlick: L::F::zero(),
        }
    }

    /// The albedo of anisotropic GGX reflecting everything, and the rise of Schlick's curve, towards the unit vector `w`,
    /// w.z > 0.
    #[inline(always)]
    pub fn stretched<L: Lanes>(&self, row: &Stretched<L>, w: V3<L>) -> [L::F; 2] {
        let one = L::F::one();
        let [_, nk, nj, ni] = STRETCHED;
        let alpha = row.toward(w);
        let [along, across] = row.alphas;
        let (along, across) = (along.sqrt(), across.sqrt());
        let azimuth = (alpha.sqrt() - across) / (along - across).max(L::F::splat(1e-9));
        let (i, fx) = cell::<L>((w.z * (one + alpha) / (w.z + alpha)).sqrt(), ni);
        let (j, fy) = cell::<L>(azimuth.min(one), nj);
        let size = ((ni - 1) * (nj - 1)) as u32;
        let at = row.first * L::U::splat(2 * size) + j * L::U::splat(ni as u32 - 1) + i;
        let (rougher, stronger) = (L::U::splat(2 * size), L::U::splat(2 * size * nk as u32));
        let (i_rise, fx_rise) = cell::<L>(w.z.sqrt(), ni);
        let of_rise = (at - i) + i_rise + L::U::splat(size);
        let table = &self.stretched.cells;
        let mut values = [L::F::zero(); 2];
        for ((a, fx), value) in [(at, fx), (of_rise, fx_rise)].into_iter().zip(&mut values) {
            let c = a + stronger;
            let low = lerp(corners::<L>(table, a, fx, fy), corners::<L>(table, a + rougher, fx, fy), row.fk);
            let high = lerp(corners::<L>(table, c, fx, fy), corners::<L>(table, c + rougher, fx, fy), row.fk);
            *value = lerp(low, high, row.fl);
        }
        let [white, root] = values;
        let root2 = root * root;
        [white, root2 * root2 * root]
    }

    /// The rise of the curve of `round`'s index towards cosine `mu`, where Schlick's has risen to `schlick` and `round` is
    /// the row of the alpha that counts there.
    #[inline(always)]
    pub fn stretched_rise<L: Lanes>(&self, round: &Row<L>, mu: L::F, schlick: L::F) -> L::F {
        let of_round = Row { class: L::U::splat(self.stretched.schlick), ..*round };
        let inside = |v: L::F| v.max(L::F::splat(1e-5)).min(L::F::splat(1.0 - 1e-5));
        let power = ln::<L>(inside(schlick)) / ln::<L>(inside(self.rise(&of_round, mu)));
        let rise = self.rise(round, mu).max(L::F::splat(1e-9));
        exp::<L>(ln::<L>(rise) * power).min(L::F::one())
    }
}

impl<L: Lanes> Stretched<L> {
    /// Alpha in the azimuth of `w`.
    #[inline(always)]
    pub fn toward(&self, w: V3<L>) -> L::F {
        let (x2, y2) = (w.x * w.x, w.y * w.y);
        let [ax, ay] = self.alphas;
        let all = (x2 + y2).max(L::F::splat(1e-20));
        // Straight from above it does not matter.
        ((ax * ax * x2 + ay * ay * y2) / all).sqrt().max(ax.min(ay))
    }
}
