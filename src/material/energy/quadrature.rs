//! Directional albedos in f64: what the tables are made of and checked against.

use std::f64::consts::TAU;

type V = [f64; 3];

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(v: V) -> V {
    let l = dot(v, v).sqrt();
    v.map(|c| c / l)
}

/// Smith's Lambda of GGX.
pub fn masking(w: V, [ax, ay]: [f64; 2]) -> f64 {
    ((1.0 + (ax * ax * w[0] * w[0] + ay * ay * w[1] * w[1]) / (w[2] * w[2])).sqrt() - 1.0) / 2.0
}

/// Unpolarised reflectance of a dielectric boundary at cosine `c` on the viewer's side; `eta` = index behind / before.
pub fn dielectric(c: f64, eta: f64) -> f64 {
    if eta == 1.0 {
        return 0.0;
    }
    let g2 = (eta - 1.0) * (eta + 1.0) + c * c;
    if g2 <= 0.0 {
        return 1.0;
    }
    let g = g2.sqrt();
    let s = (c - g) / (c + g);
    let p = (eta * eta * c - g) / (eta * eta * c + g);
    (s * s + p * p) / 2.0
}

/// Reflectance of a dielectric at normal incidence.
pub fn reflectance(eta: f64) -> f64 {
    ((eta - 1.0) / (eta + 1.0)).powi(2)
}

/// How far Fresnel's curve has risen at cosine `c`, from 0 at normal incidence to 1: `(F(c) - F0) / (1 - F0)`; after
/// Schlick for `ior` 0, which stands for infinite.
pub fn rise(c: f64, ior: f64) -> f64 {
    if ior == 0.0 {
        return (1.0 - c).powi(5);
    }
    let f0 = reflectance(ior);
    (dielectric(c, ior) - f0) / (1.0 - f0)
}

/// Calls `visit(h, cos(wo, h), weight)` for visible normals of GGX seen from `wo`; the weights' sum is 1. `n` x `n`
/// points: spherical caps (Dupuy and Benyoub 2023), refined towards the flat normals whose tail is heavy.
fn visible_normals(wo: V, [ax, ay]: [f64; 2], n: usize, mut visit: impl FnMut(V, f64, f64)) {
    let stretched = unit([wo[0] * ax, wo[1] * ay, wo[2]]);
    for j in 0..n {
        let v = (j as f64 + 0.5) / n as f64;
        let (u, weight) = (1.0 - (1.0 - v).powi(4), 4.0 * (1.0 - v).powi(3) / (n * n) as f64);
        let z = (1.0 - u) * (1.0 + stretched[2]) - stretched[2];
        let r = (1.0 - z * z).max(0.0).sqrt();
        for i in 0..n {
            let (sin, cos) = (TAU * (i as f64 + 0.5) / n as f64).sin_cos();
            let h = [r * cos + stretched[0], r * sin + stretched[1], z + stretched[2]];
            let h = unit([h[0] * ax, h[1] * ay, h[2].max(1e-300)]);
            visit(h, dot(wo, h), weight);
        }
    }
}

/// Direction of azimuth `phi` and cosine `mu`.
pub fn direction(mu: f64, phi: f64) -> V {
    let sin = (1.0 - mu * mu).max(0.0).sqrt();
    [sin * phi.cos(), sin * phi.sin(), mu]
}

/// Calls `visit(cos(wo, h), share)` for the light that GGX reflects; the shares' sum is the albedo.
pub fn reflections(wo: V, alpha: [f64; 2], n: usize, mut visit: impl FnMut(f64, f64)) {
    let before = 1.0 + masking(wo, alpha);
    visible_normals(wo, alpha, n, |h, c, weight| {
        let wi = [0, 1, 2].map(|k| 2.0 * c * h[k] - wo[k]);
        if wi[2] > 0.0 {
            visit(c, weight * before / (before + masking(wi, alpha)));
        }
    });
}

/// Albedo of GGX reflection weighted by `fresnel(cos(wo, h))`.
pub fn reflected(wo: V, alpha: [f64; 2], n: usize, fresnel: impl Fn(f64) -> f64) -> f64 {
    let mut sum = 0.0;
    reflections(wo, alpha, n, |c, share| sum += share * fresnel(c));
    sum
}

/// What a rough refracting boundary reflects and transmits of white light together, once with Fresnel's reflectance
/// and once with none but total reflection.
pub fn refracted(wo: V, alpha: f64, eta: f64, n: usize) -> [f64; 2] {
    let alpha = [alpha; 2];
    let before = 1.0 + masking(wo, alpha);
    let mut sum = [0.0; 2];
    visible_normals(wo, alpha, n, |h, c, weight| {
        let f = dielectric(c, eta);
        let wi = [0, 1, 2].map(|k| 2.0 * c * h[k] - wo[k]);
        let reflects = if wi[2] > 0.0 { weight * before / (before + masking(wi, alpha)) } else { 0.0 };
        let sin2 = (1.0 - c * c) / (eta * eta);
        if sin2 >= 1.0 {
            sum[0] += reflects;
            sum[1] += reflects;
            return;
        }
        let across = c / eta - (1.0 - sin2).sqrt();
        let wt = [0, 1, 2].map(|k| across * h[k] - wo[k] / eta);
        let passes = if wt[2] < 0.0 { weight * before / (before + masking(wt, alpha)) } else { 0.0 };
        sum[0] += f * reflects + (1.0 - f) * passes;
        sum[1] += passes;
    });
    sum
}

/// Cosine-weighted mean over the hemisphere of a function of the cosine: `2 int f(mu) mu dmu`, by the midpoint rule in
/// the square root of the cosine.
pub fn mean(n: usize, f: impl Fn(f64) -> f64) -> f64 {
    let point = |i: usize| (i as f64 + 0.5) / n as f64;
    (0..n).map(|i| 4.0 * point(i).powi(3) * f(point(i) * point(i))).sum::<f64>() / n as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_albedo_at_alpha_1_is_the_closed_form() {
        for mu in [1.0f64, 0.9, 0.5, 0.25, 0.1, 0.02] {
            let exact = 1.0 - mu * (1.0 / mu).ln_1p();
            let found = reflected(direction(mu, 0.0), [1.0; 2], 200, |_| 1.0);
            assert!((found - exact).abs() < 2e-4, "mu {mu}: {found}, closed form {exact}");
        }
        let average = mean(64, |mu| reflected(direction(mu, 0.0), [1.0; 2], 64, |_| 1.0));
        assert!((average - 4.0 / 3.0 * (1.0 - std::f64::consts::LN_2)).abs() < 5e-4, "{average}");
    }

    #[test]
    fn the_albedo_does_not_depend_on_azimuth_unless_the_surface_is_stretched() {
        let round = |phi| reflected(direction(0.4, phi), [0.3; 2], 128, |_| 1.0);
        assert!((round(0.0) - round(1.0)).abs() < 1e-3);
        let stretched = |phi| reflected(direction(0.2, phi), [0.9, 0.1], 128, |_| 1.0);
        assert!((stretched(0.0) - stretched(TAU / 4.0)).abs() > 2e-2);
    }
}
