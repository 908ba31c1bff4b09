//! LGT-04 and LGT-05: lights with a size at every distance, without noise (numbers spread evenly).

use super::super::element::{RECORDS, directional, point};
use super::*;
use crate::math::lanes::tests::at_all_levels;
use glam::{DVec3, Vec3};
use simd::{Kernel, Mask};

/// Numbers along each side of the square of numbers.
const N: usize = 64;

/// Irradiance at the origin about `normal`, and each sample's direction and end. What is sampled is what a scattered ray
/// meets, with that density.
fn gather<L: Lanes>(records: [[f32; 4]; RECORDS as usize], normal: DVec3) -> (f64, Vec<(DVec3, DVec3)>) {
    let (mut sum, mut seen) = (0.0, Vec::new());
    let size = records[2][2];
    let place = Vec3::new(records[0][0], records[0][1], records[0][2]);
    // Squared sine of a ball; 1 - cos of a sun.
    let cone = size / place.length_squared();
    let element = Element::<L>::splat(&records);
    for i in 0..N * N {
        let u = [i % N, i / N].map(|i| L::F::splat((i as f32 + 0.5) / N as f32));
        let sample = element.sample_sized(V3::zero(), u, true);
        let alone = element.sample_sized(V3::zero(), u, false);
        assert_eq!(alone.valid.bits(), sample.valid.bits());
        if sample.valid.bits() == 0 {
            continue;
        }
        let sized = sample.is_hidden.bits() == 0;
        assert_eq!(sized, size > 0.0);
        let (found, gathered) = ((sample.radiance.x / sample.pdf).first(), (alone.radiance.x / alone.pdf).first());
        assert!((found / gathered - 1.0).abs() < 1e-5, "{found} and {gathered}");
        let is_sun = sample.is_distant.bits() != 0;
        assert_eq!(alone.is_hidden.bits() == 0, sized && is_sun);
        // Not its very edge.
        if sized && i % N < N - 1 {
            let met = if is_sun { element.meet_sun(sample.wi) } else { element.meet_ball(V3::zero(), sample.wi) };
            let ratios = [met.pdf / sample.pdf, met.radiance.x / sample.radiance.x].map(|ratio| ratio.first());
            assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 1e-5), "{ratios:?}");
            // Far away f32 does not tell where in the disc a direction is.
            assert!(met.meets.bits() != 0 || cone < 1e-9);
            if !is_sun && met.meets.bits() != 0 {
                let end = sample.end.dot(sample.end).sqrt();
                assert!((met.distance / end).first() - 1.0 < 1e-3);
            }
        }
        let f64s = |v: V3<L>| DVec3::from([v.x, v.y, v.z].map(|c| f64::from(c.first())));
        let (wi, end) = (f64s(sample.wi), f64s(sample.end));
        sum += f64::from(gathered) * wi.dot(normal).max(0.0);
        seen.push((wi, end));
    }
    (sum / (N * N) as f64, seen)
}

#[derive(Clone)]
struct Balls;

impl Kernel for Balls {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let towards = DVec3::new(0.48, 0.6, 0.64);
        for radius in [1e-6_f64, 1e-3, 1.0, 1e3, 1e6] {
            for ratio in [1.0001, 1.01, 1.5, 4.0, 1e3, 1e6] {
                let place = (towards * radius * ratio).as_vec3();
                let (d, axis) = (place.as_dvec3().length(), place.as_dvec3().normalize());
                let s = (radius / d).min(1.0);
                // With all of the ball above the horizon; what cuts it is in `verify light`.
                for tilt in [0.0_f64, 0.7, 1.5].into_iter().filter(|tilt| tilt.cos() > s || *tilt == 0.0) {
                    let normal = axis * tilt.cos() + axis.any_orthonormal_vector() * tilt.sin();
                    let (found, seen) = gather::<L>(point(place, [3.0; 3], None, radius), normal);
                    let exact = 3.0 * tilt.cos() / (d * d);
                    assert!((found / exact - 1.0).abs() < 2e-4, "{radius} m, {ratio}, {tilt}: {found} for {exact}");
                    for (wi, end) in seen {
                        assert!((wi.length() - 1.0).abs() < 1e-5);
                        // On the near side of the ball.
                        let off = (end - place.as_dvec3()).length() / radius - 1.0;
                        assert!(off.abs() < 1e-6 * ratio + 1e-3, "{off} radii off the ball of {radius} m at {ratio}");
                        let near = (end - place.as_dvec3()).dot(axis);
                        assert!(near < radius * (1e-3 + 1e-6 * ratio), "beyond the horizon of the ball");
                    }
                }
            }
            // On it and inside.
            for ratio in [1.0, 0.5, 0.0] {
                let place = Vec3::new(0.0, (radius * ratio) as f32, 0.0);
                let (found, seen) = gather::<L>(point(place, [3.0; 3], None, f64::from(radius as f32)), DVec3::Y);
                assert!(found == 0.0 && seen.is_empty(), "{found} within the ball of {radius} m");
            }
        }
    }
}

#[test]
fn lgt_04_balls_give_what_spheres_do_at_every_size_and_distance_and_nothing_inside() {
    at_all_levels(Balls);
}

#[derive(Clone)]
struct Suns;

impl Kernel for Suns {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let towards = Vec3::new(0.48, 0.6, 0.64).normalize();
        for degrees in [0.0_f64, 1e-4, 0.53, 40.0, 179.0] {
            let radius = 0.5 * degrees.to_radians();
            for tilt in [0.0_f64, 0.7, 1.4].into_iter().filter(|tilt| tilt.cos() > radius.sin()) {
                let axis = towards.as_dvec3();
                let normal = axis * tilt.cos() + axis.any_orthonormal_vector() * tilt.sin();
                let (found, seen) = gather::<L>(directional(towards, [3.0; 3], radius), normal);
                let exact = 3.0 * tilt.cos();
                assert!((found / exact - 1.0).abs() < 2e-4, "{degrees} degrees, {tilt}: {found} for {exact}");
                for (wi, end) in seen {
                    assert!(wi == end && (wi.length() - 1.0).abs() < 1e-5);
                    let off = 2.0 * (0.5 * (wi - axis).length()).asin();
                    assert!(off <= radius * 1.001 + 1e-6, "{off} of {radius} rad from its middle");
                }
            }
        }
    }
}

#[test]
fn lgt_05_suns_of_every_size_give_what_they_give_without() {
    at_all_levels(Suns);
}
