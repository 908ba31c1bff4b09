//! Albedo tables as they are stored, and how they are made.
//!
//! | table | axes | what |
//! |---|---|---|
//! | `white` | root roughness, cosine | albedo E of GGX reflecting everything |
//! | `hats` | root roughness, root cosine, node | share of E that comes from normals at the node's cosine to the viewer |
//! | `glass` | reflectance, roughness, cosine, 2 | what a refracting boundary gives back, with Fresnel and without |
//! | `stretched` | anisotropy, roughness, azimuth, cosine, 2 | E of anisotropic GGX, and (by root cosine) the fifth root of the mean of Schlick's `(1 - c)^5` over it |

use super::quadrature::{direction, reflected, reflections, refracted};
use std::sync::OnceLock;

/// Nodes of roughness and cosine of `white` and `hats`.
pub const SIDE: usize = 32;
/// Nodes of the cosine between view and normal in `hats`: cosine `(k / (NODES - 1))^2`.
pub const NODES: usize = 32;
/// Nodes of `glass`: of the root of (eta - 1) / (eta + 1) / GLASS_MOST, of roughness, of cosine. (The root keeps its sign;
/// much changes near eta 1.)
pub const GLASS: [usize; 3] = [25, 24, 24];
/// Index of refraction 4.
pub const GLASS_MOST: f64 = 0.6;
/// Nodes of `stretched`: of anisotropy, roughness, azimuth (as [`azimuth_alpha`] has it), cosine.
pub const STRETCHED: [usize; 4] = [13, 20, 10, 20];

/// All tables, each value in [0, 1].
pub struct Tables {
    /// `[SIDE roughness][SIDE cosine]`.
    pub white: Vec<f32>,
    /// `[SIDE roughness][SIDE root cosine][NODES]`.
    pub hats: Vec<f32>,
    /// `[eta][roughness][cosine][2]`.
    pub glass: Vec<f32>,
    /// `[anisotropy][roughness][azimuth][cosine][2]`.
    pub stretched: Vec<f32>,
}

const STORED: &[u8] = include_bytes!("tables.bin");
const LENGTHS: [usize; 4] = [
    SIDE * SIDE,
    SIDE * SIDE * NODES,
    GLASS[0] * GLASS[1] * GLASS[2] * 2,
    STRETCHED[0] * STRETCHED[1] * STRETCHED[2] * STRETCHED[3] * 2,
];

/// The stored tables, unpacked once.
pub fn stored() -> &'static Tables {
    static TABLES: OnceLock<Tables> = OnceLock::new();
    TABLES.get_or_init(|| {
        let mut values = STORED.chunks_exact(2).map(|b| f32::from(u16::from_le_bytes([b[0], b[1]])) / 65535.0);
        let [white, hats, glass, stretched] = LENGTHS.map(|n| values.by_ref().take(n).collect());
        Tables { white, hats, glass, stretched }
    })
}

/// Cosine of node `x` in [0, 1] of the cosine's axis at `alpha`. The albedo is a function of cosine over alpha where both
/// are small, and has a logarithm's steepness at grazing incidence: hence `x^2 = mu (1 + alpha) / (mu + alpha)`.
pub fn cosine_at(x: f64, alpha: f64) -> f64 {
    let t = x * x;
    if x >= 1.0 { 1.0 } else { t * alpha / (1.0 + alpha - t) }
}

/// Alpha of the node of perceptual roughness `r`: the smoothest one stands for the limit.
pub fn alpha_at(r: f64) -> f64 {
    (r * r).max(1e-5)
}

/// Alpha of row `j` of `white` and `hats`, whose axis is the root of the perceptual roughness: what light does at grazing
/// incidence changes fast with alpha where alpha is small.
pub fn row_alpha(j: usize) -> f64 {
    alpha_at(node(j, SIDE).powi(2))
}

/// Position of node `i` of `n` in [0, 1].
pub fn node(i: usize, n: usize) -> f64 {
    i as f64 / (n - 1) as f64
}

/// Albedo of `white` at a node.
pub fn white(j: usize, i: usize, points: usize) -> f64 {
    let alpha = row_alpha(j);
    let mu = cosine_at(node(i, SIDE), alpha);
    if mu == 0.0 { 1.0 } else { reflected(direction(mu, 0.0), [alpha; 2], points, |_| 1.0) }
}

/// Cosine of node `k` of `n`.
pub fn node_cosine(k: usize, n: usize) -> f64 {
    node(k, n).powi(2)
}

/// The node below cosine `c`, and how far `c` is on the way to the next one.
pub fn between_nodes(c: f64, n: usize) -> (usize, f64) {
    let c = c.clamp(0.0, 1.0);
    let k = ((c.sqrt() * (n - 1) as f64) as usize).min(n - 2);
    let (low, high) = (node_cosine(k, n), node_cosine(k + 1, n));
    (k, (c - low) / (high - low))
}

/// `hats` at a node.
pub fn hats(j: usize, i: usize, points: usize) -> [f64; NODES] {
    let alpha = row_alpha(j);
    let mu = node(i, SIDE).powi(2).max(1e-7);
    let wo = direction(mu, 0.0);
    let mut sums = [0.0; NODES];
    reflections(wo, [alpha; 2], points, |c, share| {
        let (k, part) = between_nodes(c, NODES);
        sums[k] += share * (1.0 - part);
        sums[k + 1] += share * part;
    });
    let all: f64 = sums.iter().sum();
    sums.map(|s| s / all)
}

/// `glass` at a node.
pub fn glass(k: usize, j: usize, i: usize, points: usize) -> [f64; 2] {
    let alpha = alpha_at(node(j, GLASS[1]));
    let mu = cosine_at(node(i, GLASS[2]), alpha).max(1e-9);
    let root = 2.0 * node(k, GLASS[0]) - 1.0;
    let s = root * root.abs() * GLASS_MOST;
    refracted(direction(mu, 0.0), alpha, (1.0 + s) / (1.0 - s), points)
}

/// The two alphas of `KHR_materials_anisotropy`, along and across.
pub fn stretch(alpha: f64, strength: f64) -> [f64; 2] {
    [alpha + (1.0 - alpha) * strength * strength, alpha]
}

/// Alpha that counts in the azimuth of node `x` in [0, 1]: its root is even between those across and along. What light
/// does at grazing incidence changes as fast with azimuth as with that.
pub fn azimuth_alpha(x: f64, [ax, ay]: [f64; 2]) -> f64 {
    (ay.sqrt() + (ax.sqrt() - ay.sqrt()) * x).powi(2)
}

/// `stretched` at a node.
pub fn stretched(l: usize, k: usize, j: usize, i: usize, points: usize) -> [f64; 2] {
    let across = alpha_at(node(k, STRETCHED[1]));
    let [ax, ay] = stretch(across, node(l, STRETCHED[0]));
    let alpha = azimuth_alpha(node(j, STRETCHED[2]), [ax, ay]);
    // alpha^2 = (ax cos phi)^2 + (ay sin phi)^2; round where there is no difference.
    let cos2 = if ax > ay { ((alpha * alpha - ay * ay) / (ax * ax - ay * ay)).clamp(0.0, 1.0) } else { 1.0 };
    let x = node(i, STRETCHED[3]);
    let reflections = |mu: f64, visit: &mut dyn FnMut(f64, f64)| {
        reflections(direction(mu, cos2.sqrt().acos()), [ax, ay], points, visit);
    };
    let (mut white, mut all, mut rise) = (0.0, 0.0, 0.0);
    reflections(cosine_at(x, alpha).max(1e-9), &mut |_, share| white += share);
    reflections((x * x).max(1e-7), &mut |c, share| {
        all += share;
        rise += share * (1.0 - c).max(0.0).powi(5);
    });
    [white, (rise / all).powf(0.2)]
}

/// Makes the tables, `points` x `points` normals a value, and packs them as they are stored.
pub fn make(points: usize) -> Vec<u8> {
    use rayon::prelude::*;
    let side = || (0..SIDE * SIDE).into_par_iter().map(|n| (n / SIDE, n % SIDE));
    let white = side().map(|(j, i)| vec![white(j, i, points)]);
    let hats = side().map(|(j, i)| hats(j, i, points / 2).to_vec());
    let glass = (0..GLASS[0] * GLASS[1] * GLASS[2]).into_par_iter().map(|n| {
        let (k, j, i) = (n / (GLASS[1] * GLASS[2]), n / GLASS[2] % GLASS[1], n % GLASS[2]);
        glass(k, j, i, points).to_vec()
    });
    let stretched = (0..LENGTHS[3] / 2).into_par_iter().map(|n| {
        let [_, a, b, c] = STRETCHED;
        stretched(n / (a * b * c), n / (b * c) % a, n / c % b, n % c, points / 4).to_vec()
    });
    let values: Vec<Vec<f64>> = white.chain(hats).chain(glass).chain(stretched).collect();
    let packed = |v: &f64| ((v.clamp(0.0, 1.0) * 65535.0).round() as u16).to_le_bytes();
    values.iter().flatten().flat_map(packed).collect()
}
