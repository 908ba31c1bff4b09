//! Scenes of the tests: the reference scenes on disk, and small ones built here.

use glam::{DMat4, DVec3};
use prt::camera::{Camera, Projection};
use prt::light::Light;
use prt::load::{LoadOptions, load};
use prt::material::Material;
use prt::scene::{Instance, MaterialId, PlacedLight, Scene, SceneBuilder};
use prt::shape::Mesh;
use prt::texture::Param;
use std::path::PathBuf;

/// The reference scenes, each a folder of `tests/data/reference`.
pub const REFERENCE: [&str; 7] =
    ["sun_plane", "point_plane", "quad_plane", "furnace", "furnace_closed", "cornell", "punctual"];

/// Folder of a reference scene.
pub fn reference_folder(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/reference").join(name)
}

/// Loads a reference scene.
pub fn reference(name: &str) -> Scene {
    let path = reference_folder(name).join(format!("{name}.gltf"));
    load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).0
}

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

/// Adds a quadrilateral; counter-clockwise corners seen from its front.
pub fn add_quad(builder: &mut SceneBuilder, corners: [[f32; 3]; 4], material: MaterialId) {
    let indices = vec![[0, 1, 2], [0, 2, 3]];
    let mesh = builder.add_mesh(Mesh::plain("quad", corners.to_vec(), indices, material));
    builder.add_instance(Instance { mesh, world_from_object: DMat4::IDENTITY, name: String::from("quad") });
}

/// Adds a horizontal square floor of half side `half` at y = 0, front up.
pub fn add_floor(builder: &mut SceneBuilder, half: f32, material: MaterialId) {
    let h = half;
    add_quad(builder, [[-h, 0.0, h], [h, 0.0, h], [h, 0.0, -h], [-h, 0.0, -h]], material);
}

/// Adds a closed cube of half side `half` about the origin whose fronts look inwards.
pub fn add_room(builder: &mut SceneBuilder, half: f32, material: MaterialId) {
    for axis in 0..3 {
        for side in [-1.0_f32, 1.0] {
            // Corners counter-clockwise about +axis, which is the front of the wall at -half.
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
            add_quad(builder, corners, material);
        }
    }
}

/// Adds a square camera at `eye` looking at `target`; `yfov` in radians.
pub fn add_camera(builder: &mut SceneBuilder, eye: DVec3, target: DVec3, yfov: f64) {
    builder.add_camera(Camera {
        name: String::from("camera"),
        world_from_camera: world_from_view(eye, target - eye),
        projection: Projection::Perspective { yfov, aspect_ratio: Some(1.0) },
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
