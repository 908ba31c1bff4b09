//! Absorption and indices of refraction against f64.

use super::*;
use crate::material::extensions::{Transmission, Volume};
use crate::texture::Param;
use simd::{Kernel, Level, dispatch};

fn glass(color: [f32; 3], distance: f32, ior: f32, dispersion: f32) -> Material {
    Material {
        transmission: Transmission { factor: Param::constant(1.0), dispersion },
        volume: Some(Volume { attenuation_color: color, attenuation_distance: distance }),
        ior,
        ..Material::default()
    }
}

#[derive(Clone)]
struct Through<'a>(&'a MediumTable, u32, f32);

impl Kernel for Through<'_> {
    type Output = [f32; 3];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f32; 3] {
        let t = self.0.transmittance::<L>(L::U::splat(self.1), L::F::splat(self.2));
        let mut out = [[0.0; 16]; 3];
        t.x.store(&mut out[0], 0);
        t.y.store(&mut out[1], 0);
        t.z.store(&mut out[2], 0);
        out.map(|o| o[0])
    }
}

struct FromFar<'a>(&'a MediumTable, u32);

impl Kernel for FromFar<'_> {
    type Output = [f32; 3];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f32; 3] {
        let t = self.0.transmittance_from_far::<L>(L::U::splat(self.1));
        let mut out = [[0.0; 16]; 3];
        t.x.store(&mut out[0], 0);
        t.y.store(&mut out[1], 0);
        t.z.store(&mut out[2], 0);
        out.map(|o| o[0])
    }
}

struct IorAt<'a>(&'a MediumTable, u32, f32);

impl Kernel for IorAt<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        let mut out = [0.0; 16];
        self.0.ior_at::<L>(L::U::splat(self.1), L::F::splat(self.2)).store(&mut out, 0);
        out[0]
    }
}

fn levels() -> impl Iterator<Item = Level> {
    [Level::Scalar, Level::Portable8, Level::Avx2, Level::Avx512].into_iter().filter(|l| l.is_available())
}

#[test]
fn vol01_transmittance_is_colour_to_the_power_of_relative_distance() {
    for distance in [1e-3_f32, 0.25, 1.0, 40.0] {
        for color in [[0.9, 0.5, 0.1], [1.0, 0.999, 1e-6], [0.0, 1.0, 0.3]] {
            let table = MediumTable::new(&[glass(color, distance, 1.5, 0.0)]);
            for x in [0.0_f32, 1e-7, 1e-3, 0.1, 1.0, 7.5, 300.0, 1e7] {
                let want = color.map(|c| f64::from(c).powf(f64::from(x) / f64::from(distance)));
                for level in levels() {
                    let got = dispatch(level, Through(&table, 1, x)).map(f64::from);
                    for (g, w) in got.into_iter().zip(want) {
                        // Below 1e-37 it is 0.
                        let close = (g - w).abs() <= 1e-5 * w || (g < 1e-30 && w < 1e-30);
                        assert!(close, "{color:?} over {x} m of {distance} m: {g} for {w}");
                    }
                }
            }
        }
    }
}

#[test]
fn vol01_limits_are_not_nan() {
    // Colour, distance, length: black over nothing is 1; no distance lets only white through; infinite lets all through.
    let cases = [
        ([0.0; 3], 1.0, 0.0, 1.0),
        ([0.0; 3], 1.0, 1e-7, 0.0),
        ([0.5; 3], f32::INFINITY, 1e7, 1.0),
        ([0.0; 3], f32::INFINITY, 1e7, 1.0),
        ([0.5; 3], 0.0, 1e-7, 0.0),
        ([0.5; 3], 0.0, 0.0, 1.0),
        ([1.0; 3], 0.0, 1.0, 1.0),
        ([1.0; 3], 1.0, 1e30, 1.0),
        ([1.5; 3], 1.0, 5.0, 1.0),
        ([0.5; 3], 1e-30, 1e30, 0.0),
    ];
    for (color, distance, x, want) in cases {
        let table = MediumTable::new(&[glass(color, distance, 1.5, 0.0)]);
        for level in levels() {
            assert_eq!(dispatch(level, Through(&table, 1, x)), [want; 3], "{color:?} {distance} {x}");
            assert_eq!(dispatch(level, Through(&table, 0, x)), [1.0; 3], "air");
        }
    }
    let table = MediumTable::new(&[glass([1.0, 0.5, 0.0], 1.0, 1.5, 0.0)]);
    assert_eq!(dispatch(Level::best(), FromFar(&table, 1)), [1.0, 0.0, 0.0]);
    assert_eq!(dispatch(Level::best(), FromFar(&table, 0)), [1.0; 3]);
}

#[test]
fn index_at_the_lines_has_the_materials_abbe_number() {
    for (ior, dispersion) in [(1.5, 1.0), (1.458, 0.295), (2.42, 0.36), (1.3, 5.0)] {
        let table = MediumTable::new(&[glass([1.0; 3], 1.0, ior, dispersion)]);
        assert!(table.has_dispersion());
        let [f, d, c] = LINES.map(|line| f64::from(dispatch(Level::best(), IorAt(&table, 1, line as f32))));
        assert!((d - f64::from(ior)).abs() < 3e-7, "{d} at the d line of {ior}");
        let abbe = (d - 1.0) / (f - c);
        assert!((abbe * f64::from(dispersion) / 20.0 - 1.0).abs() < 1e-3, "{abbe} for 20 / {dispersion}");
        assert!(f > d && d > c, "blue is bent more than red");
        assert_eq!(dispatch(Level::best(), IorAt(&table, 1, 0.0)), ior, "no wavelength");
        assert_eq!(dispatch(Level::best(), IorAt(&table, 0, 500.0)), 1.0, "air");
    }
    // Far beyond glass the index stays above 1.
    let table = MediumTable::new(&[glass([1.0; 3], 1.0, 1.01, 400.0)]);
    assert_eq!(dispatch(Level::best(), IorAt(&table, 1, 700.0)), 1.0);
}

#[test]
fn a_scene_has_what_its_materials_have() {
    let plain = MediumTable::new(&[Material::default()]);
    assert!(!plain.has_volume() && !plain.has_thin_glass() && !plain.has_dispersion() && !plain.transmits());
    let inside = MediumTable::new(&[Material::default(), glass([0.5; 3], 1.0, 1.5, 0.0)]);
    assert!(inside.has_volume() && !inside.has_thin_glass() && !inside.has_dispersion() && inside.transmits());
    let thin =
        |roughness| Material { volume: None, roughness: Param::constant(roughness), ..glass([1.0; 3], 1.0, 1.5, 1.0) };
    let smooth = MediumTable::new(&[thin(0.0)]);
    assert!(smooth.has_thin_glass() && !smooth.has_volume() && !smooth.has_dispersion() && smooth.transmits());
    let rough = MediumTable::new(&[thin(0.3)]);
    assert!(!rough.has_thin_glass() && rough.transmits());
    let void = Material { transmission: Transmission::default(), ..glass([0.5; 3], 1.0, 1.5, 1.0) };
    let void = MediumTable::new(&[void]);
    assert!(!void.has_volume() && !void.transmits() && !void.has_dispersion(), "no light gets in");
}
