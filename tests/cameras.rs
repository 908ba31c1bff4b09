//! Cameras of every kind: a known point is in the pixel where the arithmetic, and the EXR's `worldToNDC`, say it is.

mod support;

use glam::{DMat4, DQuat, DVec3};
use prt::camera::{Camera, Lens, Projection, look_at};
use prt::image::exr::{ExrCamera, ExrOptions, ExrPicture, ExrProjection, encode};
use prt::material::Material;
use prt::render::{AccelChoice, Filter, FilterShape, Frame, Progress, RenderSettings, render};
use prt::scene::{Scene, SceneBuilder};
use prt::texture::Param;
use support::scenes::add_quad;

const WIDTH: u32 = 60;
const HEIGHT: u32 = 40;

/// Turned and moved, so that no axis is another's by chance.
fn world_from_camera() -> DMat4 {
    DMat4::from_rotation_translation(
        DQuat::from_rotation_y(0.6) * DQuat::from_rotation_x(-0.3) * DQuat::from_rotation_z(0.2),
        DVec3::new(4.0, 3.0, -2.0),
    )
}

/// A shining square of half side `half` about the point `at` (camera space, metres), facing the camera.
fn scene(projection: Projection, at: DVec3, half: f64) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let world = world_from_camera();
    let material = builder.add_material(Material {
        emission: Param::constant([1.0; 3]),
        double_sided: true,
        ..Material::default()
    });
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, y)| world.transform_point3(at + half * DVec3::new(x, y, 0.0)).as_vec3().to_array());
    add_quad(&mut builder, corners, material);
    builder.add_camera(Camera { name: String::new(), world_from_camera: world, projection, lens: Lens::default() });
    builder.finish()
}

fn picture(scene: &Scene) -> Frame {
    let settings = RenderSettings {
        width: WIDTH,
        height: HEIGHT,
        spp: 16,
        max_bounces: Some(0),
        filter: Filter { shape: FilterShape::Box, width: 1.0 },
        accel: AccelChoice::Bvh,
        ..RenderSettings::default()
    };
    render(scene, 0, &settings, &Progress::default()).expect("a render")
}

/// The pixels that are lit, as (x, y).
fn lit(frame: &Frame) -> Vec<(u32, u32)> {
    let all = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    all.zip(&frame.pixels).filter(|(_, p)| p[0] > 0.0).map(|(at, _)| at).collect()
}

/// Where the EXR's `worldToNDC` puts the world point `p`, pixels from the upper left corner.
fn by_exr(frame: &Frame, p: DVec3) -> (f64, f64) {
    let projection = match frame.camera.projection {
        Projection::Perspective { yfov, .. } => ExrProjection::Perspective { yfov },
        Projection::Orthographic { ymag, .. } => ExrProjection::Orthographic { half_height: ymag },
    };
    let camera = ExrCamera {
        world_from_camera: frame.camera.world_from_camera,
        projection,
        aspect_ratio: frame.camera.aspect_ratio,
    };
    let size = [WIDTH, HEIGHT];
    let picture = ExrPicture {
        display_size: size,
        origin: [0, 0],
        size,
        pixels: &frame.pixels,
        channels: Vec::new(),
        camera,
        lens: None,
        attributes: Vec::new(),
    };
    let bytes = encode(&picture, ExrOptions::default()).expect("a whole picture");
    let meta = exr::meta::MetaData::read_from_buffered(std::io::Cursor::new(bytes), false).expect("a header");
    let m = meta.headers[0].own_attributes.world_to_normalized_device.expect("worldToNDC");
    let row = [p.x, p.y, p.z, 1.0];
    let [x, y, w] = [0, 1, 3].map(|k| (0..4).map(|i| row[i] * f64::from(m[4 * i + k])).sum::<f64>());
    (x / w * f64::from(WIDTH), y / w * f64::from(HEIGHT))
}

/// The square about `at` (camera space) lights the one pixel in whose centre it is.
#[track_caller]
fn lights_pixel(projection: Projection, at: DVec3, half: f64, pixel: (u32, u32)) {
    let scene = scene(projection, at, half);
    let frame = picture(&scene);
    assert_eq!(lit(&frame), [pixel], "{projection:?} {at}");
    let (x, y) = by_exr(&frame, world_from_camera().transform_point3(at));
    let centre = (f64::from(pixel.0) + 0.5, f64::from(pixel.1) + 0.5);
    assert!((x - centre.0).abs() < 1e-3 && (y - centre.1).abs() < 1e-3, "{projection:?} {at}: {x} {y}");
}

#[test]
fn a_known_point_of_a_parallel_camera_is_in_its_pixel_at_any_distance() {
    // 3 m x 2 m are seen: 5 cm a pixel, whatever the file's own shape is.
    for xmag in [1.5, 99.0, 1e-3] {
        for (x, y) in [(30, 20), (0, 0), (59, 39), (7, 33)] {
            let at = |z| DVec3::new((f64::from(x) + 0.5) * 0.05 - 1.5, 1.0 - (f64::from(y) + 0.5) * 0.05, z);
            for z in [-0.5, -20.0] {
                lights_pixel(Projection::Orthographic { xmag, ymag: 1.0 }, at(z), 0.02, (x, y));
            }
        }
    }
}

#[test]
fn a_known_point_of_a_pinhole_is_in_its_pixel() {
    // 3 x 2 are seen at distance 1.
    let yfov = 2.0 * 1f64.atan();
    for aspect_ratio in [None, Some(9.0)] {
        for (x, y) in [(30, 20), (0, 0), (59, 39), (7, 33)] {
            let at = DVec3::new((f64::from(x) + 0.5) * 0.05 - 1.5, 1.0 - (f64::from(y) + 0.5) * 0.05, -1.0);
            for distance in [0.5, 20.0] {
                let projection = Projection::Perspective { yfov, aspect_ratio };
                lights_pixel(projection, distance * at, 0.02 * distance, (x, y));
            }
        }
    }
}

#[test]
fn what_lies_behind_a_parallel_camera_is_not_seen() {
    let projection = Projection::Orthographic { xmag: 1.5, ymag: 1.0 };
    assert!(lit(&picture(&scene(projection, DVec3::new(0.0, 0.0, 0.5), 0.5))).is_empty());
    assert!(!lit(&picture(&scene(projection, DVec3::new(0.0, 0.0, -0.5), 0.5))).is_empty());
}

#[test]
fn a_camera_that_looks_at_a_point_has_it_in_the_middle() {
    let mut scene = scene(Projection::Perspective { yfov: 0.5, aspect_ratio: None }, DVec3::new(1.0, 2.0, -9.0), 0.15);
    let target = world_from_camera().transform_point3(DVec3::new(1.0, 2.0, -9.0));
    for eye in [DVec3::new(-3.0, 9.0, 4.0), DVec3::new(1.0, -2.0, 1.0)] {
        scene.cameras[0].world_from_camera = look_at(eye, target, DVec3::Y).expect("a view");
        let lit = lit(&picture(&scene));
        let n = lit.len() as f64;
        let mean = |part: fn(&(u32, u32)) -> u32| lit.iter().map(|at| f64::from(part(at)) + 0.5).sum::<f64>() / n;
        assert!(!lit.is_empty() && (mean(|at| at.0) - 30.0).abs() < 0.5 && (mean(|at| at.1) - 20.0).abs() < 0.5);
    }
}
