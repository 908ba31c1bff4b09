//! What the tables hold, by quadrature in f64. Read by the generator of `tables.bin` (`examples/lobe_tables.rs`) and by the
//! tests that hold the tables against it; nothing that renders reads it.

use super::tables::{COAT_COLUMNS, COAT_ROWS, COAT_WARP, SHEEN_COLUMNS, SHEEN_LEAST_ROOT, SHEEN_ROWS};
use std::f64::consts::{PI, TAU};

/// Index of refraction of a coat.
pub const COAT_IOR: f64 = super::coat::IOR as f64;

/// [`super::sheen::LEAST_ROUGHNESS`].
const SHEEN_LEAST_ROUGHNESS: f64 = super::sheen::LEAST_ROUGHNESS as f64;

/// The fourth root of the least cosine of sheen.
const LEAST_ROOT: f64 = SHEEN_LEAST_ROOT as f64;

/// Reflectance of the smooth coat at cosine `c` (Fresnel, exact).
pub fn coat_fresnel(c: f64) -> f64 {
    let g = (c * c + COAT_IOR * COAT_IOR - 1.0).sqrt();
    let s = (c - g) / (c + g);
    let p = (COAT_IOR * COAT_IOR * c - g) / (COAT_IOR * COAT_IOR * c + g);
    0.5 * (s * s + p * p)
}

/// Albedo of isotropic GGX of roughness `alpha` seen at cosine `mu` > 0: with the coat's reflectance, and with reflectance
/// 1. Single scattering; the mean over `side`^2 visible normals (midpoints).
pub fn ggx_albedo(mu: f64, alpha: f64, side: usize) -> [f64; 2] {
    let sin = ((1.0 - mu) * (1.0 + mu)).sqrt();
    let lambda = |sin: f64, cos: f64| 0.5 * ((alpha * sin / cos).hypot(1.0) - 1.0);
    let length = (alpha * sin).hypot(mu);
    let (sx, sz) = (alpha * sin / length, mu / length);
    let to_pole = sx * sx / (1.0 + sz);
    let mut sums = [0.0; 2];
    for i in 0..side {
        // 1 - u = w^2 resolves the normals seen edge-on, which are few and matter.
        let w = (i as f64 + 0.5) / side as f64;
        let u = 1.0 - w * w;
        let z = w * w * (1.0 + sz);
        let rho = (u * (1.0 + sz) * (z + to_pole)).sqrt();
        // Each row of points is shifted by the golden ratio: the integrand has a step along a curve, at grazing angles.
        let shift = (i as f64 * 0.618_033_988_749_894_9).fract();
        for j in 0..side {
            // Half a turn: the other half is its mirror image.
            let (y, x) = ((j as f64 + shift) / side as f64 * PI).sin_cos();
            let h = [(rho * x + sx) * alpha, rho * y * alpha, z];
            let length = (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]).sqrt();
            let cos = (sin * h[0] + mu * h[2]) / length;
            let wi_z = 2.0 * cos * h[2] / length - mu;
            if wi_z > 0.0 {
                let (o, i) = (lambda(sin, mu), lambda(((1.0 - wi_z) * (1.0 + wi_z)).max(0.0).sqrt(), wi_z));
                let weight = 2.0 * w * (1.0 + o) / (1.0 + o + i);
                sums[0] += weight * coat_fresnel(cos.min(1.0));
                sums[1] += weight;
            }
        }
    }
    sums.map(|s| s / (side * side) as f64)
}

/// Sheen of `KHR_materials_sheen` for white: D V of roughness `alpha` (not perceptual) between unit directions given as
/// cosine and azimuth difference, 1/sr.
pub fn sheen(mu_o: f64, mu_i: f64, phi: f64, alpha: f64) -> f64 {
    let [mu_o, mu_i] = [mu_o, mu_i].map(|mu| mu.max(f64::from(super::sheen::LEAST_COSINE)));
    let (so, si) = (((1.0 - mu_o) * (1.0 + mu_o)).sqrt(), ((1.0 - mu_i) * (1.0 + mu_i)).sqrt());
    let h = [so + si * phi.cos(), si * phi.sin(), mu_o + mu_i];
    let across = h[0] * h[0] + h[1] * h[1];
    let sin2 = across / (across + h[2] * h[2]);
    let d = (2.0 + 1.0 / alpha) * sin2.powf(0.5 / alpha) / TAU;
    d / ((1.0 + sheen_lambda(mu_o, alpha) + sheen_lambda(mu_i, alpha)) * 4.0 * mu_o * mu_i)
}

/// Lambda of the sheen at cosine `mu`: the fit of Estevez and Kulla 2017.
pub fn sheen_lambda(mu: f64, alpha: f64) -> f64 {
    let t = (1.0 - alpha) * (1.0 - alpha);
    let mix = |at_1: f64, at_0: f64| at_1 + (at_0 - at_1) * t;
    let (a, b, c) = (mix(21.5473, 25.3245), mix(3.82987, 3.32435), mix(0.19823, 0.16801));
    let (d, e) = (mix(-1.97760, -1.27393), mix(-4.32054, -4.85967));
    let l = |x: f64| a / (1.0 + b * x.powf(c)) + d * x + e;
    if mu < 0.5 { l(mu).exp() } else { (2.0 * l(0.5) - l(1.0 - mu)).exp() }
}

/// Albedo of the white sheen of roughness `alpha` at cosine `mu` > 0 (midpoints of `side`^2 directions): as the formula
/// has it, which exceeds 1 at grazing angles where alpha is below 0.1; `limit` divides by what is above 1 at either end.
pub fn sheen_albedo(mu: f64, alpha: f64, side: usize, limit: Option<&dyn Fn(f64) -> f64>) -> f64 {
    let mut sum = 0.0;
    for i in 0..side {
        // cos = t^2 resolves grazing directions; d cos = 2 t dt.
        let t = (i as f64 + 0.5) / side as f64;
        let mut ring = 0.0;
        for j in 0..side {
            // Azimuths crowd where the half vector is most oblique: phi = pi v^2, dphi = 2 pi v dv.
            let v = (j as f64 + 0.5) / side as f64;
            ring += sheen(mu, t * t, PI * v * v, alpha) * 2.0 * PI * v;
        }
        let above = limit.map_or(1.0, |limit| limit(mu).max(limit(t * t)).max(1.0));
        sum += ring * t * t * 2.0 * t / above;
    }
    2.0 * sum / (side * side) as f64
}

/// All tables in the order of `tables.bin`.
pub fn tables() -> Vec<f32> {
    let (mut ratios, mut whites, mut raws, mut limited) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for row in 0..COAT_ROWS {
        let alpha = coat_alpha(row as f64 / (COAT_ROWS - 1) as f64);
        for column in 0..COAT_COLUMNS {
            let mu = coat_mu(column as f64 / (COAT_COLUMNS - 1) as f64, alpha);
            ratios.push((coat_albedo(mu, alpha, 256) / coat_fresnel(mu)) as f32);
            whites.push(ggx_albedo(mu, alpha, 256)[1] as f32);
        }
    }
    for row in 0..SHEEN_ROWS {
        let alpha = sheen_alpha(row as f64 / (SHEEN_ROWS - 1) as f64);
        let mus: Vec<f64> = (0..SHEEN_COLUMNS).map(|i| sheen_mu(i as f64 / (SHEEN_COLUMNS - 1) as f64)).collect();
        let raw: Vec<f64> = mus.iter().map(|&mu| sheen_albedo(mu, alpha, 256, None)).collect();
        // What shading divides by is interpolated; so what is left must be computed from that.
        let limit = |mu: f64| {
            let x = (mu.powf(0.25).max(LEAST_ROOT) - LEAST_ROOT) / (1.0 - LEAST_ROOT) * (SHEEN_COLUMNS - 1) as f64;
            let i = (x as usize).min(SHEEN_COLUMNS - 2);
            raw[i] + (raw[i + 1] - raw[i]) * (x - i as f64)
        };
        let share = |(&mu, raw): (&f64, &f64)| sheen_albedo(mu, alpha, 256, Some(&limit)) / raw.min(1.0);
        limited.extend(mus.iter().zip(&raw).map(|v| share(v) as f32));
        raws.extend(raw.iter().map(|&v| v as f32));
    }
    [ratios, whites, raws, limited].concat()
}

/// Albedo of the coat, with what multiple scattering adds ([`super::coat`]).
pub fn coat_albedo(mu: f64, alpha: f64, side: usize) -> f64 {
    let [coat, white] = ggx_albedo(mu, alpha, side);
    coat * (1.0 + coat_fresnel(1.0) * (1.0 - white) / white)
}

/// Alpha of the coat at a place in [0, 1] down the table; the first row is the limit of smooth coats.
fn coat_alpha(y: f64) -> f64 {
    y.max(1e-3).powi(2)
}

/// Cosine at a place in [0, 1] along a row of the coat's table.
fn coat_mu(x: f64, alpha: f64) -> f64 {
    (COAT_WARP * alpha * x / (1.0 + COAT_WARP * alpha - x)).clamp(1e-9, 1.0)
}

/// Alpha of the sheen at a place in [0, 1] down the table.
fn sheen_alpha(y: f64) -> f64 {
    (SHEEN_LEAST_ROUGHNESS + (1.0 - SHEEN_LEAST_ROUGHNESS) * y * y).powi(2)
}

/// Cosine at a place in [0, 1] along a row of the sheen's table.
fn sheen_mu(x: f64) -> f64 {
    (LEAST_ROOT + (1.0 - LEAST_ROOT) * x).powi(4)
}
