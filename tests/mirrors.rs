//! All mirrors of a smooth surface, as tracers follow them that leave nothing to chance, against sampling them.

use prt::material::bsdf::{Bsdf, Mirror, View};
use prt::material::energy::{Brdf, Energy};
use prt::material::layered::Layered;
use prt::material::surface::{Extras, Surface};
use prt::math::{Frame, V3};
use simd::{Float, Lanes, Mask, Scalar, Uint};
use std::sync::LazyLock;

type F = <Scalar as Lanes>::F;
type M = <Scalar as Lanes>::M;

/// Tables of index 1.5.
static ENERGY: LazyLock<Energy> = LazyLock::new(|| {
    let mut energy = Energy::new(Brdf::Full);
    energy.class(1.5);
    energy.add_glass();
    energy
});

/// A smooth surface: its share of metal, transmission, coat, and whether it bounds a volume of index `eta`.
#[derive(Clone, Copy, Debug)]
struct Smooth {
    metallic: f32,
    transmission: f32,
    coat: f32,
    is_volume: bool,
    eta: f32,
}

fn bsdf(smooth: Smooth, cos: f32) -> Bsdf<'static, Scalar> {
    let f = F::splat;
    let none = M::from_bits(0);
    let Smooth { metallic, transmission, coat, is_volume, eta } = smooth;
    let extras = Extras {
        clearcoat: f(coat),
        clearcoat_roughness: f(0.0),
        sheen: V3::zero(),
        sheen_roughness: f(0.5),
        anisotropy: f(0.0),
        anisotropy_direction: [f(1.0), f(0.0)],
        iridescence: f(0.0),
        iridescence_ior: f(1.3),
        iridescence_thickness: f(0.0),
        transmission: f(transmission),
        is_volume: if is_volume { M::first(1) } else { none },
        diffuse_transmission: f(0.0),
        diffuse_transmission_color: V3::zero(),
        disney: None,
        is_disney: none,
    };
    let surface = Surface {
        base: V3::splat([0.8, 0.4, 0.2]),
        metallic: f(metallic),
        roughness: f(0.0),
        specular: f(1.0),
        f0: V3::splat([0.04; 3]),
        ior: f(1.5),
        class: <Scalar as Lanes>::U::splat(0),
        extras: Some(extras),
    };
    let wo = V3::<Scalar>::splat([(1.0 - cos * cos).sqrt(), 0.0, cos]);
    let frame = Frame::around(V3::splat([0.0, 0.0, 1.0]));
    let view = View { eta: f(eta), ..View::new(frame, wo) };
    let mut bsdf = Bsdf::new(&surface, &view, &ENERGY);
    bsdf.set_layered(vec![(0, Layered::new(&surface, &view, None, &ENERGY))]);
    bsdf
}

fn xyz(v: V3<Scalar>) -> glam::Vec3 {
    glam::Vec3::new(v.x.first(), v.y.first(), v.z.first())
}

/// Sampling chooses among the mirrors and divides by the probability, so its mean is what they are worth.
#[test]
fn mirrors_are_worth_what_sampling_them_gives_on_average() {
    const N: u32 = 20_000;
    for smooth in [
        Smooth { metallic: 1.0, transmission: 0.0, coat: 0.0, is_volume: false, eta: 1.0 },
        Smooth { metallic: 0.3, transmission: 0.0, coat: 0.7, is_volume: false, eta: 1.0 },
        Smooth { metallic: 0.0, transmission: 1.0, coat: 0.0, is_volume: false, eta: 1.0 },
        Smooth { metallic: 0.2, transmission: 0.6, coat: 1.0, is_volume: false, eta: 1.0 },
        Smooth { metallic: 0.0, transmission: 1.0, coat: 0.0, is_volume: true, eta: 1.5 },
        Smooth { metallic: 0.0, transmission: 0.5, coat: 0.0, is_volume: true, eta: 1.0 / 1.5 },
        Smooth { metallic: 0.0, transmission: 1.0, coat: 0.0, is_volume: true, eta: 1.0 },
    ] {
        for cos in [1.0, 0.8, 0.3] {
            let bsdf = bsdf(smooth, cos);
            // By side: what is reflected, what gets through; sums of weights and of directions by weight.
            let mut sampled = [glam::Vec3::ZERO; 2];
            let mut towards = [glam::Vec3::ZERO; 2];
            for i in 0..N {
                let u_lobe = F::splat((i as f32 + 0.5) / N as f32);
                let sample = bsdf.sample([F::splat(0.3), F::splat(0.6)], u_lobe);
                if sample.valid.any() && sample.pdf.first().is_infinite() {
                    let side = usize::from(sample.transmitted.any());
                    let weight = xyz(sample.weight) / N as f32;
                    sampled[side] += weight;
                    towards[side] += xyz(sample.wi) * weight.x;
                }
            }
            let mut followed = [glam::Vec3::ZERO; 2];
            let mut along = [glam::Vec3::ZERO; 2];
            for mirror in [Mirror::Coat, Mirror::Surface, Mirror::Behind] {
                let sample = bsdf.mirror(mirror);
                if sample.valid.any() {
                    let side = usize::from(sample.transmitted.any());
                    assert_eq!(side == 1, mirror == Mirror::Behind, "{smooth:?} {cos} {mirror:?}");
                    followed[side] += xyz(sample.weight);
                    along[side] += xyz(sample.wi) * xyz(sample.weight).x;
                }
            }
            for side in 0..2 {
                let off = (sampled[side] - followed[side]).abs().max_element();
                assert!(off < 1e-3, "{smooth:?} {cos}: {} sampled, {} followed", sampled[side], followed[side]);
                let off = (towards[side] - along[side]).abs().max_element();
                assert!(off < 1e-3, "{smooth:?} {cos}: towards {}, not {}", towards[side], along[side]);
            }
        }
    }
}
