//! Shapes of the built-in meshes.

use crate::accel::Triangles;
use crate::math::random::Rng;
use glam::Vec3;
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

/// `n` random triangles in the cube [-1, 1]^3 with edges of about `size`.
pub fn random_soup(n: usize, size: f32, rng: &mut Rng) -> Triangles {
    soup((0..n).map(|_| {
        let centre = rng.cube();
        [0; 3].map(|_| centre + rng.cube() * size)
    }))
}

/// Long thin triangles: lengths about `length`, widths of 0.1 down to 1e-5 of that.
pub fn slivers(n: usize, length: f32, rng: &mut Rng) -> Triangles {
    soup((0..n).map(|i| {
        let width = length * 10f32.powi(-1 - (i % 5) as i32);
        let (a, along) = (rng.cube(), rng.direction() * length);
        [a, a + along, a + along * rng.unit() + rng.direction() * width]
    }))
}

/// A closed latitude-longitude sphere around the origin of radius `radius()` per vertex. As in pbrt's watertight test
/// (pbrt-v4, shapes_test.cpp), poles are one vertex per column and the seam's vertices are doubled, all equal copies.
pub fn sphere(rows: usize, columns: usize, mut radius: impl FnMut() -> f32) -> Triangles {
    let mut mesh = Triangles::default();
    for row in 0..=rows {
        let theta = PI * row as f32 / rows as f32;
        for column in 0..=columns {
            let phi = TAU * column as f32 / columns as f32;
            let pole = row == 0 || row == rows;
            if (pole && column > 0) || column == columns {
                let copied = mesh.positions[mesh.positions.len() - column];
                mesh.positions.push(copied);
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

/// A grid of n x n unit cells from (x0, x0) on, `height(x, y)` above the plane z = 0.
pub fn grid(n: usize, x0: f32, mut height: impl FnMut(f32, f32) -> f32) -> Triangles {
    let mut mesh = Triangles::default();
    for y in 0..=n {
        for x in 0..=n {
            let (x, y) = (x0 + x as f32, x0 + y as f32);
            mesh.positions.push([x, y, height(x, y)]);
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

/// A closed box between two corners: six quads, twelve triangles.
pub fn cuboid(low: Vec3, high: Vec3) -> Triangles {
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
        [pick(0), pick(1), pick(2)]
    };
    let quads = [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
    Triangles {
        positions: (0..8).map(corner).collect(),
        indices: quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
    }
}

/// Scaled, then moved.
pub fn placed(mesh: &Triangles, s: f32, shift: Vec3) -> Triangles {
    let positions = mesh.positions.iter().map(|&p| (Vec3::from(p) * s + shift).to_array()).collect();
    Triangles { positions, indices: mesh.indices.clone() }
}

/// Two meshes in one, the first one's triangles first.
pub fn joined(mut a: Triangles, b: &Triangles) -> Triangles {
    let first = a.positions.len() as u32;
    a.positions.extend(&b.positions);
    a.indices.extend(b.indices.iter().map(|t| t.map(|v| v + first)));
    a
}
