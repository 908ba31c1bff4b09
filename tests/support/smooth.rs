//! Meshes with normals, texture coordinates and tangents, and textures made of numbers.

use glam::{DMat4, DVec3, Vec3};
use prt::scene::{Instance, MaterialId, SceneBuilder};
use prt::shape::Mesh;
use prt::texture::{Filter, Image, Texels, Texture, TextureRef, Wrap};
use std::f64::consts::{PI, TAU};

/// Adds a mesh where it is.
pub fn add_mesh(builder: &mut SceneBuilder, mesh: Mesh) {
    let mesh = builder.add_mesh(mesh);
    builder.add_instance(Instance { mesh, world_from_object: DMat4::IDENTITY, name: String::from("mesh") });
}

/// Adds a texture of `width` texels a row.
pub fn add_texture(builder: &mut SceneBuilder, width: u32, texels: Vec<[u8; 4]>, filter: Filter) -> TextureRef {
    let height = texels.len() as u32 / width;
    let image = builder.add_image(Image { width, height, texels: Texels::Rgba8(texels), name: String::from("image") });
    let wrap = Wrap::ClampToEdge;
    TextureRef::plain(builder.add_texture(Texture { image, wrap_u: wrap, wrap_v: wrap, filter }))
}

/// The texel of a normal map that tilts the normal by `degrees` towards the angle `azimuth` (radians, from +u to +v of
/// the tangent frame).
pub fn normal_texel(degrees: f64, azimuth: f64) -> [u8; 4] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let byte = |v: f64| (127.5 * (v + 1.0)).round() as u8;
    [byte(sin * azimuth.cos()), byte(sin * azimuth.sin()), byte(cos), 255]
}

/// A mesh with normals and texture coordinates.
pub fn mesh(
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    indices: Vec<[u32; 3]>,
    material: MaterialId,
) -> Mesh {
    Mesh {
        positions,
        normals: Some(normals),
        uv_sets: vec![uvs],
        colors: None,
        tangents: None,
        indices,
        material,
        name: String::from("mesh"),
    }
}

/// A unit sphere about the origin of `rows` x `columns` quadrilaterals with its own normals at the vertices.
pub fn smooth_sphere(rows: usize, columns: usize, material: MaterialId) -> Mesh {
    let (mut positions, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..=rows {
        let (sin, cos) = (PI * row as f64 / rows as f64).sin_cos();
        for column in 0..=columns {
            let phi = TAU * (column % columns) as f64 / columns as f64;
            positions.push(DVec3::new(sin * phi.sin(), cos, sin * phi.cos()).as_vec3().to_array());
            uvs.push([column as f32 / columns as f32, row as f32 / rows as f32]);
        }
    }
    let at = |row: usize, column: usize| (row * (columns + 1) + column) as u32;
    for row in 0..rows {
        for column in 0..columns {
            let (a, b) = (at(row, column), at(row, column + 1));
            let (c, d) = (at(row + 1, column), at(row + 1, column + 1));
            if row > 0 {
                indices.push([a, c, b]);
            }
            if row + 1 < rows {
                indices.push([b, c, d]);
            }
        }
    }
    mesh(positions.clone(), positions, uvs, indices, material)
}

/// A horizontal square of half side `half` at y = 0, front up, u along +x and v (downwards in the image) along +z, with
/// tangents for a normal map.
pub fn flat_quad(half: f32, material: MaterialId) -> Mesh {
    let h = half;
    let positions = vec![[-h, 0.0, h], [h, 0.0, h], [h, 0.0, -h], [-h, 0.0, -h]];
    let uvs = vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let flat = mesh(positions, vec![[0.0, 1.0, 0.0]; 4], uvs, vec![[0, 1, 2], [0, 2, 3]], material);
    Mesh { tangents: Some(vec![[1.0, 0.0, 0.0, 1.0]; 4]), ..flat }
}

/// The walls of a closed cube of half side `half` about the origin whose fronts look inwards, with tangents.
pub fn mapped_room(half: f32, material: MaterialId) -> Vec<Mesh> {
    let wall = |axis: usize, side: f32| {
        let mut corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(u, v): (f32, f32)| {
            let mut p = [0.0; 3];
            p[axis] = side * half;
            p[(axis + 1) % 3] = u * half;
            p[(axis + 2) % 3] = v * half;
            p
        });
        if side > 0.0 {
            corners.reverse();
        }
        let mut normal = [0.0; 3];
        normal[axis] = -side;
        let tangent = (Vec3::from(corners[1]) - Vec3::from(corners[0])).normalize();
        let uvs = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let wall = mesh(corners.to_vec(), vec![normal; 4], uvs, vec![[0, 1, 2], [0, 2, 3]], material);
        Mesh { tangents: Some(vec![[tangent.x, tangent.y, tangent.z, 1.0]; 4]), ..wall }
    };
    (0..3).flat_map(|axis| [wall(axis, -1.0), wall(axis, 1.0)]).collect()
}
