//! Meshes and rays for the tests of ray queries.
#![allow(dead_code)]

use super::rng::Rng;
use glam::Vec3;
use prt::accel::{RayBatch, Triangles};
use std::f32::consts::{PI, TAU};

/// Triangles that share no vertices.
pub fn soup(corners: impl IntoIterator<Item = [Vec3; 3]>) -> Triangles {
    let mut triangles = Triangles::default();
    for corners in corners {
        let first = triangles.positions.len() as u32;
        triangles.positions.extend(corners.map(|p| p.to_array()));
        triangles.indices.push([first, first + 1, first + 2]);
    }
    triangles
}

/// Random triangles in the cube [-1, 1]^3 with edges of about `size`, positions first scaled by `s` and then moved by
/// `shift`.
pub fn random_soup(n: usize, size: f32, s: f32, shift: Vec3, rng: &mut Rng) -> Triangles {
    soup((0..n).map(|_| {
        let centre = rng.cube();
        [0; 3].map(|_| (centre + rng.cube() * size) * s + shift)
    }))
}

/// Long thin triangles: length about 1, width about `width`.
pub fn slivers(n: usize, width: f32, rng: &mut Rng) -> Triangles {
    soup((0..n).map(|_| {
        let (a, along) = (rng.cube(), rng.direction());
        [a, a + along, a + along * rng.unit() + rng.direction() * width]
    }))
}

/// A closed latitude-longitude sphere around the origin of radius `radius()` per vertex. As in pbrt's test, poles are
/// one vertex per column and the seam's vertices are doubled, all equal copies.
pub fn sphere(rows: usize, columns: usize, mut radius: impl FnMut() -> f32) -> Triangles {
    let mut mesh = Triangles::default();
    for row in 0..=rows {
        let theta = PI * row as f32 / rows as f32;
        for column in 0..=columns {
            let phi = TAU * column as f32 / columns as f32;
            let pole = row == 0 || row == rows;
            if (pole && column > 0) || column == columns {
                let copied = mesh.positions.len() - column;
                mesh.positions.push(mesh.positions[copied]);
                continue;
            }
            let d = if pole {
                Vec3::Z * theta.cos().signum()
            } else {
                Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
            };
            mesh.positions.push((d * radius()).to_array());
        }
    }
    let at = |row: usize, column: usize| (row * (columns + 1) + column) as u32;
    for row in 0..rows {
        for column in 0..columns {
            let (a, b) = (at(row, column), at(row, column + 1));
            let (c, d) = (at(row + 1, column), at(row + 1, column + 1));
            if row > 0 {
                mesh.indices.push([a, b, c]);
            }
            if row + 1 < rows {
                mesh.indices.push([b, d, c]);
            }
        }
    }
    mesh
}

/// A flat n x n grid from (x0, x0) on with unit cells in the plane z = 0.
pub fn grid(n: usize, x0: f32) -> Triangles {
    let mut mesh = Triangles::default();
    for y in 0..=n {
        for x in 0..=n {
            mesh.positions.push([x0 + x as f32, x0 + y as f32, 0.0]);
        }
    }
    let at = |x: usize, y: usize| (y * (n + 1) + x) as u32;
    for y in 0..n {
        for x in 0..n {
            mesh.indices.push([at(x, y), at(x + 1, y), at(x + 1, y + 1)]);
            mesh.indices.push([at(x, y), at(x + 1, y + 1), at(x, y + 1)]);
        }
    }
    mesh
}

/// Scaled, then moved.
pub fn placed(mesh: &Triangles, s: f32, shift: Vec3) -> Triangles {
    let positions = mesh.positions.iter().map(|&p| (Vec3::from(p) * s + shift).to_array()).collect();
    Triangles { positions, indices: mesh.indices.clone() }
}

/// A batch of rays given as origin, direction and end.
pub fn batch(rays: &[(Vec3, Vec3, f32)]) -> RayBatch {
    let mut batch = RayBatch::new(rays.len());
    for (i, &(origin, direction, t_max)) in rays.iter().enumerate() {
        batch.set(i, origin, direction, t_max);
    }
    batch
}
