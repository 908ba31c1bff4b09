//! The tables against quadrature between their points.

use super::super::quadrature;
use super::super::sheen::LEAST_ROUGHNESS;
use super::*;
use simd::{Kernel, Level, dispatch};

/// Reads all four at one place: the coat's two, raw sheen, sheen.
struct Read(f64, f64);

impl Kernel for Read {
    type Output = [f64; 4];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f64; 4] {
        let (mu, roughness) = (L::F::splat(self.0 as f32), L::F::splat(self.1 as f32));
        let [ratio, white] = coat::<L>(mu, roughness);
        let [raw, limited] = sheen::<L>(mu, roughness);
        [ratio, white, raw, limited].map(|v| f64::from(v.first()))
    }
}

/// Places over all roughnesses and cosines in [1e-5, 1], half of them by magnitude; `least` roughness.
fn places(n: u32, least: f64) -> impl Iterator<Item = (f64, f64)> {
    // Two coordinates of the R2 sequence (Roberts 2018).
    (0..n).map(move |i| {
        let at = |g: f64| (0.5 + f64::from(i) * g).fract();
        let (u, v) = (at(0.754_877_666_246_692_7), at(0.569_840_290_998_053_2));
        let mu = if i % 2 == 0 { 10f64.powf(-5.0 * u) } else { u.max(1e-5) };
        (mu, least + (1.0 - least) * if i % 4 < 2 { v } else { v * v })
    })
}

#[test]
fn bsdf_12_albedo_of_the_coat_is_that_of_quadrature_within_2e_3() {
    for (mu, roughness) in places(300, 0.01) {
        let alpha = roughness * roughness;
        let [ratio, white, ..] = dispatch(Level::Scalar, Read(mu, roughness));
        let exact = quadrature::coat_albedo(mu, alpha, 128);
        let found = ratio * quadrature::coat_fresnel(mu);
        assert!((found - exact).abs() < 2e-3, "mu {mu}, roughness {roughness}: {found}, quadrature {exact}");
        let exact = quadrature::ggx_albedo(mu, alpha, 128)[1];
        // Of this only the boost is made, and that takes 4 % of it.
        assert!((white - exact).abs() < 1e-2, "mu {mu}, roughness {roughness}: white {white}, quadrature {exact}");
    }
}

#[test]
fn bsdf_12_albedo_of_sheen_is_that_of_quadrature_within_2e_3() {
    for (mu, roughness) in places(120, f64::from(LEAST_ROUGHNESS)) {
        let (alpha, mu) = (roughness * roughness, mu.max(1e-4));
        let [_, _, raw, limited] = dispatch(Level::Scalar, Read(mu, roughness));
        let exact = quadrature::sheen_albedo(mu, alpha, 128, None);
        // The raw albedo matters where it exceeds 1, relative to itself.
        assert!((raw - exact).abs() < 2e-3 * exact.max(1.0), "mu {mu}, roughness {roughness}: raw {raw}, not {exact}");
        let limit = |mu: f64| dispatch(Level::Scalar, Read(mu, roughness))[2];
        let exact = quadrature::sheen_albedo(mu, alpha, 128, Some(&limit));
        assert!((limited - exact).abs() < 2e-3, "mu {mu}, roughness {roughness}: {limited}, not {exact}");
    }
}

#[test]
fn quadrature_has_the_known_albedos_of_ggx() {
    // Numbers of docs/../numerics table C: reflectance 1, alpha 0.25, 0.5 and 1; the last is 1 - mu ln(1 + 1/mu).
    for (mu, alpha, e) in [(1.0, 0.25, 0.91581), (0.1, 0.25, 0.89162), (0.5, 0.5, 0.69825), (0.25, 1.0, 0.59764)] {
        let found = quadrature::ggx_albedo(mu, alpha, 512)[1];
        assert!((found - e).abs() < 2e-4, "mu {mu}, alpha {alpha}: {found}, not {e}");
    }
}

#[test]
fn the_stored_tables_are_those_of_the_generator() {
    // A few rows; all of them take a minute.
    let bits = |i: usize| VALUES[i];
    for (row, column) in [(63, 31), (20, 3), (1, 16)] {
        let y: f64 = row as f64 / (COAT_ROWS - 1) as f64;
        let x = column as f64 / (COAT_COLUMNS - 1) as f64;
        let alpha = y * y;
        let mu = (COAT_WARP * alpha * x / (1.0 + COAT_WARP * alpha - x)).min(1.0);
        let expected = quadrature::coat_albedo(mu, alpha, 256) / quadrature::coat_fresnel(mu);
        let found = f64::from(bits(row * COAT_COLUMNS + column));
        assert!((found - expected).abs() < 1e-6, "row {row}, column {column}: {found}, not {expected}");
    }
}
