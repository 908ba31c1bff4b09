//! An environment as shading reads it: radiance and density in a direction, and directions sampled by radiance.
//!
//! The map is bilinear between texel centres, so it is a sum of tents, one a texel. A texel is chosen in proportion to
//! its tent's share of the light, then a point under the tent: the density is the bilinear function itself, and radiance
//! over density stays bounded beside a bright texel, where a density constant over texels would not (pbrt-v3 issue 62).
//! Density and radiance lie in one record, so one lookup reads both.
//!
//! Rows are counted from the nearer pole: there sin(theta) and what is divided by it vanish together, without the
//! cancellation that counting from +Y has at -Y.

use super::Environment;
use crate::math::{V3, angle, distribution, lanes::cos_sin_2pi};
use glam::DVec3;
use simd::{Float, Lanes, Uint};
use std::f64::consts::PI;

/// The smallest sine of the polar angle: at the pole itself 0 would be divided by 0.
const MIN_SINE: f32 = 1e-12;

/// A distant light all around, over N lanes.
#[derive(Clone, Debug)]
pub struct EnvironmentTable {
    width: u32,
    height: u32,
    /// See [`Environment::rotation`].
    rotation: f32,
    /// `[height + 2][width]`: R, G, B in nits; density in (u, v) over 2 pi^2, so that the density over solid angle is it
    /// by the sine of the polar angle. The first and the last row are the poles: the next row's colours, density 0.
    texels: Vec<[f32; 4]>,
    /// Ends of the rows' shares.
    rows: Vec<f32>,
    /// Ends of the columns' shares, a table a row.
    columns: Vec<f32>,
    mean_radiance: f64,
}

/// A direction with what comes from it.
pub struct EnvironmentSample<L: Lanes> {
    /// Unit, world axes.
    pub direction: V3<L>,
    /// nits.
    pub radiance: V3<L>,
    /// 1/sr.
    pub pdf: L::F,
}

/// A point of the map.
struct Place<L: Lanes> {
    /// Columns from the left edge, `[0, width]`.
    columns: L::F,
    /// Rows from the nearer pole, `[0, height / 2]`.
    rows: L::F,
    /// The nearer pole is +Y.
    north: L::M,
    /// Sine of the polar angle.
    sine: L::F,
}

impl EnvironmentTable {
    /// Prepares `environment`; `None` if it is black.
    pub fn new(environment: &Environment) -> Option<Self> {
        let (w, h) = (environment.width as usize, environment.height as usize);
        assert!(w > 0 && h > 0 && environment.radiance.len() == w * h, "a map has width x height texels");
        let factor = environment.scale;
        let mean = |t: &[f32; 3]| t.iter().map(|&c| f64::from(c * factor)).sum::<f64>() / 3.0;
        let rows: Vec<&[[f32; 3]]> = environment.radiance.chunks(w).collect();
        let sine = |row: usize| (PI * (row as f64 + 0.5) / h as f64).sin();
        // Integrals of a tent over v, the map being 1 high; those of the outer rows end at the poles.
        let area = |row: usize| {
            let [above, below] = reach(row, h);
            0.5 * (above + below) / h as f64
        };
        let sums: Vec<f64> = rows.iter().map(|row| row.iter().map(mean).sum::<f64>() / w as f64).collect();
        let shares: Vec<f64> = (0..h).map(|row| sums[row] * sine(row) * area(row)).collect();
        // d omega = 2 pi^2 sin(theta) du dv.
        let total = 2.0 * PI * PI * shares.iter().sum::<f64>();
        if total <= 0.0 {
            return None;
        }
        let mut table = Self {
            width: environment.width,
            height: environment.height,
            rotation: environment.rotation,
            texels: Vec::with_capacity(w * (h + 2)),
            rows: Vec::new(),
            columns: Vec::with_capacity(w.next_power_of_two() * h),
            mean_radiance: total / (4.0 * PI),
        };
        let records = |row: usize, scale: f64| {
            let record = move |t: &[f32; 3]| {
                let [r, g, b] = t.map(|c| c * factor);
                [r, g, b, (mean(t) * scale / total) as f32]
            };
            rows[row].iter().map(record).collect::<Vec<_>>()
        };
        table.texels.extend(records(0, 0.0));
        for (row, texels) in rows.iter().enumerate() {
            table.texels.extend(records(row, sine(row)));
            distribution::push_ends(&texels.iter().map(mean).collect::<Vec<_>>(), &mut table.columns);
        }
        table.texels.extend(records(h - 1, 0.0));
        distribution::push_ends(&shares, &mut table.rows);
        Some(table)
    }

    /// Each texel: unit direction of its centre in world axes, radiance (nits, mean over channels), solid angle (sr).
    pub fn samples(&self) -> impl Iterator<Item = (DVec3, f64, f64)> + Clone {
        let (w, h) = (self.width as usize, self.height as usize);
        let inside = self.texels[w..w * (h + 1)].iter().enumerate();
        inside.map(move |(i, texel)| {
            let turns = ((i % w) as f64 + 0.5) / w as f64 - f64::from(self.rotation);
            let (sin_phi, cos_phi) = (2.0 * PI * turns).sin_cos();
            let step = PI / h as f64;
            let (sine, cosine) = (step * ((i / w) as f64 + 0.5)).sin_cos();
            let radiance = texel[..3].iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
            let angle = 2.0 * PI / w as f64 * 2.0 * (0.5 * step).sin() * sine;
            (DVec3::new(-sine * cos_phi, cosine, -sine * sin_phi), radiance, angle)
        })
    }

    /// Mean over all directions and channels, nits.
    pub fn mean_radiance(&self) -> f64 {
        self.mean_radiance
    }

    /// Radiance (nits) from the unit direction `d`, and the density (1/sr) with which [`Self::sample`] gives it.
    #[inline(always)]
    pub fn lookup<L: Lanes>(&self, d: V3<L>) -> (V3<L>, L::F) {
        let one = L::F::one();
        let sine = d.x.mul_add(d.x, d.z * d.z).sqrt().max(L::F::splat(MIN_SINE));
        // The centre column is +X and u grows towards +Z; what is turned counter-clockwise lies further back.
        let u = angle::turns::<L>(d.x, d.z) + L::F::splat((0.5 + self.rotation) % 1.0);
        let u = (u - one).or_else(u.ge(one), u);
        self.read(&Place {
            columns: u * L::F::splat(self.width as f32),
            rows: angle::turns::<L>(d.y.abs(), sine) * L::F::splat(2.0 * self.height as f32),
            north: d.y.ge(L::F::zero()),
            sine,
        })
    }

    /// A direction with density in proportion to the mean of its channels, by `u` in [0, 1).
    #[inline(always)]
    pub fn sample<L: Lanes>(&self, u: [L::F; 2]) -> EnvironmentSample<L> {
        let f = |v: f32| L::F::splat(v);
        let (zero, one, half) = (L::F::zero(), L::F::one(), f(0.5));
        let (width, height) = (f(self.width as f32), f(self.height as f32));
        let none = L::U::splat(0);
        let (row, t) = distribution::find_within::<L>(&self.rows, none, self.rows.len() as u32, u[1]);
        let stride = self.width.next_power_of_two();
        let (column, s) = distribution::find_within::<L>(&self.columns, row * L::U::splat(stride), stride, u[0]);
        let x = column.to_float() + half + tent::<L>(s, one, one);
        let x = (x + width).or_else(x.lt(zero), x);
        let x = (x - width).or_else(x.ge(width), x);
        let row = row.to_float();
        let above = half.or_else(row.lt(half), one);
        let below = half.or_else((row + f(1.5)).gt(height), one);
        let y = row + half + tent::<L>(t, above, below);
        let north = (y + y).lt(height);
        let rows = y.or_else(north, height - y).max(zero);
        // cos_sin_2pi takes [0, 1): half a turn further than the column's angle, which turns both signs.
        let turns = x / width - f(self.rotation);
        let turns = (turns + one).or_else(turns.lt(zero), turns);
        // A whole turn where 1 was added to nearly nothing.
        let (cos_phi, sin_phi) = cos_sin_2pi::<L>(zero.or_else(turns.ge(one), turns));
        let (cosine, sine) = cos_sin_2pi::<L>(rows * half / height);
        let sine = sine.max(f(MIN_SINE));
        let (radiance, pdf) = self.read(&Place { columns: x, rows, north, sine });
        let direction = V3::new(-(sine * cos_phi), cosine.or_else(north, -cosine), -(sine * sin_phi));
        EnvironmentSample { direction, radiance, pdf }
    }

    /// Radiance and density (1/sr) at a point of the map. Lanes without a place read some texel.
    #[inline(always)]
    fn read<L: Lanes>(&self, at: &Place<L>) -> (V3<L>, L::F) {
        let (zero, one, half) = (L::F::zero(), L::F::one(), L::F::splat(0.5));
        let (width, height) = (L::F::splat(self.width as f32), L::U::splat(self.height));
        let x = at.columns.max(zero).min(width) - half;
        let left = x.floor();
        let across = x - left;
        let right = left + one;
        let left = (left + width).or_else(left.lt(zero), left).to_uint();
        let right = zero.or_else(right.ge(width), right).to_uint();
        // From the pole to the first row is half a row only.
        let rows = at.rows.max(zero).min(L::F::splat(0.5 * self.height as f32));
        let y = rows - half;
        let outer = y.floor();
        let down = (rows + rows).or_else(y.lt(zero), y - outer);
        let outer = (outer + one).to_uint();
        let step = L::U::splat(1);
        let first = outer.or_else(at.north, height + step - outer);
        let second = (outer + step).or_else(at.north, height - outer);
        let stride = L::U::splat(self.width);
        let t00 = (first * stride + left).records(&self.texels);
        let t10 = (first * stride + right).records(&self.texels);
        let t01 = (second * stride + left).records(&self.texels);
        let t11 = (second * stride + right).records(&self.texels);
        let top = lerp4::<L>(t00, t10, across);
        let bottom = lerp4::<L>(t01, t11, across);
        let [r, g, b, density] = lerp4::<L>(top, bottom, down);
        (V3::new(r, g, b), density / at.sine)
    }
}

/// How far the tent of `row` reaches up and down, in rows.
fn reach(row: usize, height: usize) -> [f64; 2] {
    [if row == 0 { 0.5 } else { 1.0 }, if row + 1 == height { 0.5 } else { 1.0 }]
}

/// A point under a tent that reaches `above` back and `below` forth from its top at 0, by `t` in [0, 1).
#[inline(always)]
fn tent<L: Lanes>(t: L::F, above: L::F, below: L::F) -> L::F {
    let one = L::F::one();
    let split = above / (above + below);
    let rising = above * ((t / split).sqrt() - one);
    let falling = below * (one - ((one - t) / (one - split)).sqrt());
    rising.or_else(t.lt(split), falling)
}

#[inline(always)]
fn lerp4<L: Lanes>(a: [L::F; 4], b: [L::F; 4], t: L::F) -> [L::F; 4] {
    [
        (b[0] - a[0]).mul_add(t, a[0]),
        (b[1] - a[1]).mul_add(t, a[1]),
        (b[2] - a[2]).mul_add(t, a[2]),
        (b[3] - a[3]).mul_add(t, a[3]),
    ]
}
