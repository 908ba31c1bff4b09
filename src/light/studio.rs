//! The built-in studio: soft light for files that have none. A function of direction alone, ours, without any image.
//!
//! A calm grey dome, darker below the horizon, with four soft boxes: the key upper left in front, a broad fill in front
//! on the right, a strip overhead and a rim behind. All is neutral grey, so that colours stay what the file says. "In front" is
//! +Z, where a glTF asset's front faces (glTF 2.0, section 3.4).

use super::Environment;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Texels across and down: 1.4 degrees each, a fraction of the boxes' soft edges.
pub const SIZE: [u32; 2] = [256, 128];

/// Radiance of the dome, nits, straight up, at the horizon and straight down.
const ZENITH: f64 = 0.40;
const HORIZON: f64 = 0.30;
const NADIR: f64 = 0.12;

/// A light panel seen from the middle, with a soft outline.
struct SoftBox {
    /// Towards its centre, any length.
    towards: [f64; 3],
    /// Half width and half height on the plane at distance 1, x being horizontal.
    half: [f64; 2],
    /// Width of the soft edge on the same plane, inwards and outwards of the outline.
    edge: f64,
    /// Radiance in its middle beyond the dome's, nits.
    radiance: f64,
}

/// Key, fill, overhead, rim.
const BOXES: [SoftBox; 4] = [
    SoftBox { towards: [-0.7, 0.6, 1.0], half: [0.50, 0.42], edge: 0.16, radiance: 2.4 },
    SoftBox { towards: [1.0, 0.2, 0.9], half: [0.42, 0.60], edge: 0.20, radiance: 1.5 },
    SoftBox { towards: [0.1, 1.0, 0.1], half: [0.70, 0.28], edge: 0.18, radiance: 0.8 },
    SoftBox { towards: [0.35, 0.85, -1.0], half: [0.65, 0.22], edge: 0.14, radiance: 2.0 },
];

/// Radiance (nits, the same in all channels) from the unit direction `d`.
pub fn radiance(d: DVec3) -> f64 {
    let dome = if d.y > 0.0 { HORIZON + (ZENITH - HORIZON) * d.y } else { below(d.y) };
    dome + BOXES.iter().map(|b| b.radiance * b.coverage(d)).sum::<f64>()
}

/// The dome below the horizon: falls off to the floor within some 20 degrees, level at the horizon.
fn below(y: f64) -> f64 {
    let t = (-y / 0.35).min(1.0);
    HORIZON + (NADIR - HORIZON) * t * t * (3.0 - 2.0 * t)
}

impl SoftBox {
    /// How much of the box is seen in the direction `d`: 1 inside, 0 outside, smooth between.
    fn coverage(&self, d: DVec3) -> f64 {
        let z = DVec3::from_array(self.towards).normalize();
        let distance = d.dot(z);
        if distance <= 0.0 {
            return 0.0;
        }
        // No box is straight overhead.
        let x = DVec3::Y.cross(z).normalize();
        let p = [d.dot(x) / distance, d.dot(z.cross(x)) / distance];
        let inside = |p: f64, half: f64| {
            let t = ((half + self.edge - p.abs()) / (2.0 * self.edge)).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        inside(p[0], self.half[0]) * inside(p[1], self.half[1])
    }
}

/// The studio as a map.
pub fn environment() -> Environment {
    let [width, height] = SIZE;
    let texel = |i: u32| {
        let phi = (f64::from(i % width) + 0.5) / f64::from(width) * TAU - PI;
        let theta = (f64::from(i / width) + 0.5) / f64::from(height) * PI;
        let d = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        [radiance(d) as f32; 3]
    };
    Environment::new(width, height, (0..width * height).map(texel).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean radiance over all directions, nits.
    const MEAN: f64 = 0.590;
    /// What a white diffuse surface facing +Z shows, nits.
    const FRONT: f64 = 0.872;

    /// Irradiance over pi on a surface facing `n`: what a white diffuse surface shows there.
    fn white(n: DVec3) -> f64 {
        let map = environment();
        let [w, h] = SIZE.map(f64::from);
        let mut sum = 0.0;
        for row in 0..SIZE[1] {
            let theta = (f64::from(row) + 0.5) / h * PI;
            let d_omega = TAU / w * ((theta - 0.5 * PI / h).cos() - (theta + 0.5 * PI / h).cos());
            for column in 0..SIZE[0] {
                let phi = (f64::from(column) + 0.5) / w * TAU - PI;
                let d = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
                let radiance = f64::from(map.radiance[(row * SIZE[0] + column) as usize][0]);
                sum += radiance * d.dot(n).max(0.0) * d_omega;
            }
        }
        sum / PI
    }

    #[test]
    fn white_shows_what_the_conventions_say() {
        let table = super::super::environment::EnvironmentTable::new(&environment()).unwrap();
        assert!((table.mean_radiance() - MEAN).abs() < 2e-3, "{}", table.mean_radiance());
        let front = white(DVec3::Z);
        assert!((front - FRONT).abs() < 5e-3, "{front}");
        for n in [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, -DVec3::Z] {
            assert!((0.12..1.02).contains(&white(n)), "{n}: {}", white(n));
        }
    }

    #[test]
    fn no_texel_is_black_and_neighbours_differ_little() {
        let map = environment();
        let [w, h] = SIZE.map(|n| n as usize);
        let at = |row: usize, column: usize| map.radiance[row * w + column % w][0];
        for row in 0..h {
            for column in 0..w {
                let here = at(row, column);
                assert!((0.1..4.0).contains(&here), "{row} {column}: {here}");
                // The seam is between the last column and the first.
                assert!((at(row, column + 1) - here).abs() < 0.35, "{row} {column}");
                assert!(row + 1 == h || (at(row + 1, column) - here).abs() < 0.35, "{row} {column}");
            }
        }
        // At the poles all columns meet; the overhead box's edge is near.
        for row in [0, h - 1] {
            let values: Vec<f32> = (0..w).map(|column| at(row, column)).collect();
            let (low, high) = values.iter().fold((f32::MAX, 0.0_f32), |(l, u), &v| (l.min(v), u.max(v)));
            assert!(high - low < 0.04 * high, "{low} {high}");
        }
    }
}
