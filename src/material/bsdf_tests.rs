//! Sampling, density and value of the closure against each other, over a grid of surfaces and directions.

use super::*;
use crate::material::energy::Brdf;
use crate::math::lanes::cos_sin_2pi;
use crate::math::lanes::tests::at_all_levels;
use simd::{Kernel, Mask, Uint};
use std::sync::LazyLock;

/// Surfaces (base, metallic, roughness, specular) and view cosines: corners and middles.
fn grid() -> Vec<([f32; 4], f32)> {
    let mut cells = Vec::new();
    for metallic in [0.0, 0.5, 1.0] {
        for roughness in [0.0, 0.03, 0.1, 0.3, 0.6, 1.0] {
            for specular in [0.0, 1.0] {
                for cos in [1.0, 0.7, 0.2, 0.01] {
                    cells.push(([0.8, metallic, roughness, specular], cos));
                }
            }
        }
    }
    cells
}

/// Tables of index 1.5.
static ENERGY: LazyLock<Energy> = LazyLock::new(|| {
    let mut energy = Energy::new(Brdf::Full);
    energy.class(1.5);
    energy
});

#[inline(always)]
fn bsdf<L: Lanes>([base, metallic, roughness, specular]: [f32; 4], cos: f32) -> Bsdf<'static, L> {
    let f = |v: f32| L::F::splat(v);
    let surface = Surface {
        base: V3::<L>::splat([base, base * 0.5, 0.0]),
        metallic: f(metallic),
        roughness: f(roughness),
        specular: f(specular),
        f0: V3::<L>::splat([0.04; 3]),
        ior: f(1.5),
        class: L::U::splat(0),
        extras: None,
    };
    let wo = V3::<L>::splat([(1.0 - cos * cos).sqrt(), 0.0, cos]);
    Bsdf::new(&surface, &View::new(Frame::around(V3::splat([0.0, 0.0, 1.0])), wo), &ENERGY)
}

/// The first lane.
#[inline(always)]
fn first<L: Lanes>(v: L::F) -> f32 {
    let mut out = [0.0; 16];
    v.store(&mut out, 0);
    out[0]
}

#[test]
fn bsdf_03_sample_weight_and_pdf_are_those_of_eval() {
    #[derive(Clone)]
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            for (surface, cos) in grid() {
                let bsdf = bsdf::<L>(surface, cos);
                for i in 0..64u32 {
                    let u = |k: u32| ((i * 7 + k * 13) % 64) as f32 / 64.0 + 1.0 / 128.0;
                    let s = bsdf.sample([L::F::splat(u(1)), L::F::splat(u(2))], L::F::splat(u(3)));
                    if s.valid.bits() & 1 == 0 || first::<L>(s.pdf).is_infinite() {
                        continue;
                    }
                    let value = bsdf.eval(s.wi);
                    let (pdf, again) = (first::<L>(s.pdf), first::<L>(value.pdf));
                    // A narrow lobe multiplies the rounding of the direction.
                    let tolerance = if surface[2] < 0.2 { 2e-2 } else { 1e-3 };
                    assert!((pdf / again - 1.0).abs() < tolerance, "{surface:?} {cos}: pdf {pdf}, eval {again}");
                    let (weight, ratio) = (first::<L>(s.weight.x), first::<L>(value.f_cos.x) / again);
                    assert!((weight - ratio).abs() <= tolerance * ratio, "{surface:?} {cos}: {weight}, {ratio}");
                }
            }
        }
    }
    at_all_levels(Check);
}

/// The same with the diffuse lobe about a normal `tilt` radians off, towards azimuth 1.
#[inline(always)]
fn split<L: Lanes>(surface: [f32; 4], cos: f32, tilt: f32) -> Bsdf<'static, L> {
    let (sin, z) = tilt.sin_cos();
    let normal = V3::<L>::splat([sin * 1f32.cos(), sin * 1f32.sin(), z]);
    let mut bsdf = bsdf::<L>(surface, cos);
    bsdf.set_diffuse_normal(normal, L::M::first(L::N));
    bsdf
}

#[test]
fn shn04_specular_surface_seen_from_below_its_normal_neither_evaluates_nor_samples() {
    #[derive(Clone)]
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            for (surface, _) in grid().into_iter().filter(|(s, _)| s[1] > 0.0 || s[3] > 0.0) {
                for cos in [0.0, -1e-6, -0.3, -1.0] {
                    for bsdf in [bsdf::<L>(surface, cos), split::<L>(surface, cos, 0.5)] {
                        for i in 0..64u32 {
                            let u = |k: u32| L::F::splat(((i * 7 + k * 13) % 64) as f32 / 64.0 + 1.0 / 128.0);
                            let sample = bsdf.sample([u(1), u(2)], u(3));
                            assert_eq!(sample.valid.bits() & 1, 0, "{surface:?} {cos}");
                            let value = bsdf.eval(sample.wi);
                            assert_eq!((first::<L>(value.pdf), first::<L>(value.f_cos.x)), (0.0, 0.0));
                        }
                    }
                }
            }
        }
    }
    at_all_levels(Check);
}

#[test]
fn shn04_each_lobe_ends_at_its_own_horizon_in_samples_and_in_values() {
    #[derive(Clone)]
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            for (surface, cos) in grid() {
                if surface[2] < 0.2 {
                    continue; // narrow lobes are left to bsdf_03
                }
                let bsdf = split::<L>(surface, cos, 1.2);
                for i in 0..64u32 {
                    let u = |k: u32| L::F::splat(((i * 7 + k * 13) % 64) as f32 / 64.0 + 1.0 / 128.0);
                    let s = bsdf.sample([u(1), u(2)], u(3));
                    if s.valid.bits() & 1 == 0 {
                        continue;
                    }
                    let value = bsdf.eval(s.wi);
                    let (pdf, again) = (first::<L>(s.pdf), first::<L>(value.pdf));
                    assert!((pdf / again - 1.0).abs() < 1e-2, "{surface:?} {cos}: pdf {pdf}, eval {again}");
                    let (weight, ratio) = (first::<L>(s.weight.x), first::<L>(value.f_cos.x) / again);
                    assert!((weight - ratio).abs() <= 1e-2 * ratio, "{surface:?} {cos}: {weight}, {ratio}");
                }
            }
        }
    }
    at_all_levels(Check);
}

/// Sums over a midpoint grid of both halves of the sphere (cosine x azimuth), and over stratified samples.
struct Integrals {
    surface: [f32; 4],
    cos: f32,
    /// As in [`split`]; 0 = one normal.
    tilt: f32,
}

impl Kernel for Integrals {
    /// Integral of the pdf, albedo by quadrature, share of valid samples, albedo by sampling (channel r).
    type Output = [f64; 4];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f64; 4] {
        let mut bsdf = bsdf::<L>(self.surface, self.cos);
        if self.tilt > 0.0 {
            bsdf = split::<L>(self.surface, self.cos, self.tilt);
        }
        let (n, mut out) = (256u32, [0.0; 4]);
        let cell = 1.0 / f64::from(n * n);
        for i in 0..n {
            for j in (0..n).step_by(L::N) {
                let mut azimuth = [0.0; 16];
                let ids = L::U::splat(j) + L::U::lane_ids();
                let v = (ids.to_float() + L::F::splat(0.5)) * L::F::splat(1.0 / n as f32);
                let (c, s) = cos_sin_2pi::<L>(v);
                // z = t^2 resolves the horizon; dz = 2 t dt.
                let t = (i as f32 + 0.5) / n as f32;
                let (z, jacobian) = (t * t, f64::from(2.0 * t) * std::f64::consts::TAU);
                let r = L::F::splat((1.0 - z * z).sqrt());
                let value = bsdf.eval(V3::<L>::new(c * r, s * r, L::F::splat(z)));
                let below = bsdf.eval(V3::<L>::new(c * r, s * r, L::F::splat(-z)));
                // A number of its own for the choice between lobes: the third coordinate of a lattice.
                let third = ids.to_float() * L::F::splat(0.754_877_7) + L::F::splat((i as f32 * 0.569_840_3).fract());
                let sample = bsdf.sample([L::F::splat((i as f32 + 0.5) / n as f32), v], third - third.floor());
                let valid = L::F::one().masked(sample.valid);
                let terms =
                    [value.pdf + below.pdf, value.f_cos.x + below.f_cos.x, valid, sample.weight.x.masked(sample.valid)];
                for (k, term) in terms.into_iter().enumerate() {
                    term.store(&mut azimuth, 0);
                    let scale = if k < 2 { jacobian * cell } else { cell };
                    out[k] += azimuth[..L::N].iter().map(|&x| f64::from(x)).sum::<f64>() * scale;
                }
            }
        }
        out
    }
}

#[test]
fn bsdf_02_pdf_integrates_to_the_share_of_valid_samples_and_both_albedos_agree() {
    // Lobes narrower than a few cells cannot be integrated on the grid.
    for roughness in [0.5, 0.7, 1.0] {
        for cos in [1.0, 0.7, 0.3] {
            for surface in [[1.0, 1.0, roughness, 0.0], [0.8, 0.0, roughness, 0.0]] {
                for tilt in [0.0, 1.2] {
                    let [pdf, quadrature, valid, sampled] =
                        simd::dispatch(simd::Level::best(), Integrals { surface, cos, tilt });
                    assert!((pdf - valid).abs() < 4e-3, "{surface:?} {cos} {tilt}: pdf {pdf}, valid {valid}");
                    assert!((quadrature - sampled).abs() < 4e-3, "{surface:?} {cos} {tilt}: {quadrature}, {sampled}");
                }
            }
        }
    }
}

#[test]
fn bsdf_09_10_extreme_numbers_and_directions_stay_finite() {
    #[derive(Clone)]
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            const EDGES: [f32; 4] = [0.0, 5.9604645e-8, 0.5, 1.0 - 5.9604645e-8];
            for (mut surface, _) in grid() {
                for base in [0.0, 1.0] {
                    surface[0] = base;
                    for cos in [1.0, 1e-3, 1e-5, 1e-7] {
                        let bsdf = bsdf::<L>(surface, cos);
                        for u in EDGES {
                            for v in EDGES {
                                for lobe in EDGES {
                                    let f = |v: f32| L::F::splat(v);
                                    let s = bsdf.sample([f(u), f(v)], f(lobe));
                                    if s.valid.bits() & 1 == 0 {
                                        continue;
                                    }
                                    let (weight, pdf) = (first::<L>(s.weight.x), first::<L>(s.pdf));
                                    let length = first::<L>(s.wi.dot(s.wi));
                                    let place = format!("{surface:?} {cos} {u} {v} {lobe}");
                                    assert!(weight.is_finite() && weight >= 0.0, "{place}: weight {weight}");
                                    assert!(pdf > 0.0, "{place}: pdf {pdf}");
                                    assert!((length - 1.0).abs() < 1e-5, "{place}: |wi|^2 {length}");
                                    let value = bsdf.eval(s.wi);
                                    let f_cos = first::<L>(value.f_cos.x);
                                    assert!(f_cos.is_finite() && f_cos >= 0.0, "{place}: f {f_cos}");
                                }
                            }
                        }
                    }
                }
            }
        }
    }
    at_all_levels(Check);
}
