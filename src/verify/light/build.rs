//! Small scenes, built here.

use crate::camera::{Camera, Lens, Projection};
use crate::light::Light;
use crate::material::Material;
use crate::scene::{Instance, MaterialId, PlacedLight, SceneBuilder};
use crate::shape::Mesh;
use crate::texture::Param;
use glam::{DMat4, DVec3};

/// Lambertian on both sides.
pub fn lambert(albedo: f32) -> Material {
    Material {
        base_color: Param::constant([albedo; 3]),
        metallic: Param::constant(0.0),
        specular: Param::constant(0.0),
        double_sided: true,
        ..Material::default()
    }
}

/// Lambertian and shining, on the front only.
pub fn lamp(albedo: f32, radiance: f32) -> Material {
    Material { emission: Param::constant([radiance; 3]), double_sided: false, ..lambert(albedo) }
}

/// White metal (reflectance 1 at every angle).
pub fn white_metal(roughness: f32) -> Material {
    Material { roughness: Param::constant(roughness), double_sided: true, ..Material::default() }
}

/// White dielectric of normal reflectance 0.04.
pub fn white_dielectric(roughness: f32) -> Material {
    Material { metallic: Param::constant(0.0), ..white_metal(roughness) }
}

/// Adds a mesh where it stands.
pub fn add_mesh(builder: &mut SceneBuilder, positions: Vec<[f32; 3]>, indices: Vec<[u32; 3]>, material: MaterialId) {
    let mesh = builder.add_mesh(Mesh::plain("mesh", positions, indices, material));
    builder.add_instance(Instance { mesh, world_from_object: DMat4::IDENTITY, name: String::from("mesh") });
}

/// Adds a quadrilateral; counter-clockwise corners seen from its front.
pub fn add_quad(builder: &mut SceneBuilder, corners: [[f32; 3]; 4], material: MaterialId) {
    add_mesh(builder, corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]], material);
}

/// Adds a horizontal square floor of half side `half` at y = 0, front up.
pub fn add_floor(builder: &mut SceneBuilder, half: f32, material: MaterialId) {
    let h = half;
    add_quad(builder, [[-h, 0.0, h], [h, 0.0, h], [h, 0.0, -h], [-h, 0.0, -h]], material);
}

/// Adds a closed box about the origin of the half sides `half`; the fronts look inwards or outwards.
pub fn add_box(builder: &mut SceneBuilder, half: [f32; 3], inwards: bool, material: MaterialId) {
    for axis in 0..3 {
        for side in [-1.0_f32, 1.0] {
            // Corners counter-clockwise about +axis, which is the inner front of the wall at -half.
            let mut corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(u, v): (f32, f32)| {
                let mut p = [0.0; 3];
                p[axis] = side * half[axis];
                p[(axis + 1) % 3] = u * half[(axis + 1) % 3];
                p[(axis + 2) % 3] = v * half[(axis + 2) % 3];
                p
            });
            if (side > 0.0) == inwards {
                corners.reverse();
            }
            add_quad(builder, corners, material);
        }
    }
}

/// Adds a closed cube of half side `half` about the origin whose fronts look inwards.
pub fn add_room(builder: &mut SceneBuilder, half: f32, material: MaterialId) {
    add_box(builder, [half; 3], true, material);
}

/// Adds a square camera at `eye` looking at `target`; `yfov` in radians.
pub fn add_camera(builder: &mut SceneBuilder, eye: DVec3, target: DVec3, yfov: f64) {
    builder.add_camera(Camera {
        name: String::from("camera"),
        world_from_camera: world_from_view(eye, target - eye),
        projection: Projection::Perspective { yfov, aspect_ratio: Some(1.0) },
        lens: Lens::default(),
    });
}

/// Adds a punctual light at `position` that shines along `direction`.
pub fn add_light(builder: &mut SceneBuilder, light: Light, position: DVec3, direction: DVec3) {
    builder.add_light(PlacedLight {
        light,
        world_from_light: world_from_view(position, direction),
        name: String::from("light"),
    });
}

/// Rigid transform that takes the origin to `eye` and -Z to `direction`.
fn world_from_view(eye: DVec3, direction: DVec3) -> DMat4 {
    let z = -direction.normalize();
    let up = if z.y.abs() > 0.9 { DVec3::Z } else { DVec3::Y };
    let x = up.cross(z).normalize();
    DMat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), eye.extend(1.0))
}

/// A ball of 20 x 4^`level` triangles about the origin, fronts outwards, whose surface is that of a sphere of `radius`.
pub fn ball(level: u32, radius: f64) -> Vec<[DVec3; 3]> {
    let g = 0.5 * (1.0 + 5.0_f64.sqrt());
    let v = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ]
    .map(|p| DVec3::from_array(p).normalize());
    let faces = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let mut triangles: Vec<[DVec3; 3]> = faces.iter().map(|f| f.map(|i| v[i])).collect();
    for _ in 0..level {
        let split = |[a, b, c]: [DVec3; 3]| {
            let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(split).collect();
    }
    let area: f64 = triangles.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length()).sum();
    let scale = radius * (4.0 * std::f64::consts::PI / area).sqrt();
    triangles.into_iter().map(|t| t.map(|p| p * scale)).collect()
}

/// Adds triangles that share no vertices, the fronts turned round if `inwards`; returns them as f32 has them.
pub fn add_triangles(
    builder: &mut SceneBuilder,
    triangles: &[[DVec3; 3]],
    inwards: bool,
    material: MaterialId,
) -> Vec<[DVec3; 3]> {
    let turn = |[a, b, c]: [DVec3; 3]| if inwards { [a, c, b] } else { [a, b, c] };
    let rounded: Vec<[DVec3; 3]> = triangles.iter().map(|t| turn(*t).map(|p| p.as_vec3().as_dvec3())).collect();
    let positions = rounded.iter().flatten().map(|p| p.as_vec3().to_array()).collect();
    let indices = (0..rounded.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    add_mesh(builder, positions, indices, material);
    rounded
}
