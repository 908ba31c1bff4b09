//! Surfaces that are not all there (alpha MASK and BLEND), vertex colours, several sets of texture coordinates, and
//! unlit materials: scenes whose pixels can be written down.
//!
//! Masks and unlit surfaces are exact to 1e-5. Blended ones are decided at random: seeds 0..8, 1024 samples, 8 x 8 pixels
//! that look at one point, Student's t over seeds at 1e-4 with the bias bound stated beside each; a value moved by the
//! stated fault must not pass.

mod support;

use glam::{DMat4, DVec3};
use prt::camera::{Camera, Lens, Projection};
use prt::light::Light;
use prt::material::{AlphaMode, Material};
use prt::render::{AccelChoice, DefaultLight, RenderSettings, geometry};
use prt::scene::{ImageId, Instance, MaterialId, Scene, SceneBuilder, TextureId};
use prt::shape::Mesh;
use prt::texture::{Filter, Image, Param, Texels, Texture, TextureRef, UvTransform, Wrap};
use std::f64::consts::PI;
use support::pictures::{channel_means, settings, shoot, shoot_seeds};
use support::scenes;
use support::verdict::{Expected, mean_test};

/// So small that all pixels see one point.
const POINT_VIEW: f64 = 1e-6;
const SUN: f32 = 10.0;
const ALBEDO: f32 = 0.6;

/// The unit square of uv, as a texture of `width` x 1 texels read without filtering.
fn add_texture(builder: &mut SceneBuilder, texels: &[[u8; 4]]) -> TextureId {
    let image =
        Image { width: texels.len() as u32, height: 1, texels: Texels::Rgba8(texels.to_vec()), name: "t".into() };
    let image: ImageId = builder.add_image(image);
    builder.add_texture(Texture { image, wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat, filter: Filter::Nearest })
}

/// A horizontal square of half side `half` at height `y`, front up, u along +x and v along +z from 0 to 1.
fn add_sheet(builder: &mut SceneBuilder, y: f32, half: f32, material: MaterialId) {
    let h = half;
    let mesh = builder.add_mesh(Mesh {
        positions: vec![[-h, y, h], [h, y, h], [h, y, -h], [-h, y, -h]],
        normals: None,
        uv_sets: vec![vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]],
        colors: None,
        tangents: None,
        indices: vec![[0, 1, 2], [0, 2, 3]],
        material,
        name: "sheet".into(),
    });
    builder.add_instance(Instance { mesh, world_from_object: DMat4::IDENTITY, name: "sheet".into() });
}

/// Black to light, with this opacity.
fn black(mode: AlphaMode, opacity: f32) -> Material {
    Material { alpha_mode: mode, opacity: Param::constant(opacity), ..scenes::lambert(0.0) }
}

fn sun(builder: &mut SceneBuilder) {
    scenes::add_light(builder, Light::Directional { illuminance: [SUN; 3] }, DVec3::ZERO, DVec3::NEG_Y);
}

/// A Lambertian floor in the sun under sheets at heights 1, 1.1, ..., seen at (`x`, 0, 0) from below the sheets.
fn floor_under(sheets: &[Material], x: f64) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let floor = builder.add_material(scenes::lambert(ALBEDO));
    scenes::add_floor(&mut builder, 5.0, floor);
    for (i, sheet) in sheets.iter().enumerate() {
        let material = builder.add_material(sheet.clone());
        add_sheet(&mut builder, 1.0 + 0.1 * i as f32, 4.0, material);
    }
    sun(&mut builder);
    scenes::add_camera(&mut builder, DVec3::new(x, 0.5, 0.7), DVec3::new(x, 0.0, 0.0), POINT_VIEW);
    builder.finish()
}

/// What the floor shows in full sun.
fn in_the_sun() -> f64 {
    f64::from(ALBEDO) * f64::from(SUN) / PI
}

fn assert_exactly(what: &str, scene: &Scene, value: f64) {
    for pixel in shoot(scene, &settings(4, 4, 0)).pixels {
        for x in pixel.map(f64::from) {
            assert!((x - value).abs() <= 1e-5 * value, "{what}: {x} instead of {value}");
        }
    }
}

/// The picture's mean over seeds is `value` within `bias`, and is told from `value * fault`.
fn assert_shows(what: &str, scene: &Scene, value: f64, bias: f64, fault: f64) {
    let runs = shoot_seeds(scene, &settings(8, 1024, 0), 8);
    let runs: Vec<f64> = runs.iter().map(|run| channel_means(&run.pixels)[1]).collect();
    let test = |value: f64| mean_test(&runs, Expected { value, rel_se: 0.0 }).within(bias);
    test(value).unwrap_or_else(|e| panic!("{what}: expected {value:.6}: {e}"));
    assert!(test(value * fault).is_err(), "{what}: the test does not see a factor of {fault}");
}

#[test]
fn mask_texel_below_cutoff_lets_shadow_ray_pass() {
    for (x, value) in [(-2.0, in_the_sun()), (2.0, 0.0)] {
        let mut scene = floor_under(&[black(AlphaMode::Mask { cutoff: 0.5 }, 1.0)], x);
        let mut builder = SceneBuilder::new(0);
        // Opacity 0.498 on the left, 0.502 on the right.
        let texture = add_texture(&mut builder, &[[255, 255, 255, 127], [255, 255, 255, 128]]);
        let made = builder.finish();
        (scene.images, scene.textures) = (made.images, made.textures);
        scene.materials[1].opacity = Param { factor: 1.0, texture: Some(TextureRef::plain(texture)) };
        assert_exactly("mask", &scene, value);
    }
}

#[test]
fn opacity_equal_to_the_cutoff_is_there_and_cutoff_above_one_hides_everything() {
    for (opacity, cutoff, value) in [(0.5, 0.5, 0.0), (0.49, 0.5, in_the_sun()), (1.0, 1.5, in_the_sun())] {
        assert_exactly("cutoff", &floor_under(&[black(AlphaMode::Mask { cutoff }, opacity)], 0.0), value);
    }
}

#[test]
fn blended_sheets_let_their_share_of_light_through() {
    // Not below the edge between a sheet's two triangles: exactly there a ray meets both.
    let sheet = || black(AlphaMode::Blend, 0.3);
    assert_shows("one sheet", &floor_under(&[sheet()], 0.3), 0.7 * in_the_sun(), 0.01, 1.02);
    assert_shows("two sheets", &floor_under(&[sheet(), sheet()], 0.3), 0.49 * in_the_sun(), 0.015, 1.03);
    assert_exactly("opacity 0", &floor_under(&[black(AlphaMode::Blend, 0.0)], 0.0), in_the_sun());
    assert_exactly("opacity 1", &floor_under(&[black(AlphaMode::Blend, 1.0)], 0.0), 0.0);
}

#[test]
fn sheets_in_one_place_each_stop_their_share() {
    let mut scene = floor_under(&[black(AlphaMode::Blend, 0.3), black(AlphaMode::Blend, 0.3)], 0.3);
    // The second sheet's height becomes the first one's: 49 % pass, not 70 %.
    let positions = scene.meshes[1].positions.clone();
    std::sync::Arc::make_mut(&mut scene.meshes[2]).positions = positions;
    assert_shows("coinciding sheets", &scene, 0.49 * in_the_sun(), 0.015, 1.03);
    // A camera in the sun above them sees the floor in 49 % of its rays, in the light that 49 % reach.
    scene.cameras[0] = camera_above(3.0, POINT_VIEW);
    scene.cameras[0].world_from_camera.w_axis.x = 0.3;
    assert_shows("seen through them", &scene, 0.49 * 0.49 * in_the_sun(), 0.03, 1.06);
}

#[test]
fn only_what_some_ray_may_pass_is_asked_about() {
    // The floor's triangles and those of sheets that are there ask no filter.
    for (mode, opacity, not_asked) in [
        (AlphaMode::Opaque, 0.0, 4),
        (AlphaMode::Blend, 1.0, 4),
        (AlphaMode::Blend, 0.9, 2),
        (AlphaMode::Mask { cutoff: 0.5 }, 0.5, 4),
        (AlphaMode::Mask { cutoff: 0.5 }, 0.4, 2),
    ] {
        let geometry = geometry(&floor_under(&[black(mode, opacity)], 0.0), &settings(4, 4, 0)).expect("a small scene");
        let plain = geometry.world.parts.iter().filter(|part| !part.filtered);
        assert_eq!(plain.map(|part| part.triangles.indices.len()).sum::<usize>(), not_asked, "{mode:?} {opacity}");
    }
}

#[test]
fn camera_sees_through_blended_sheets_by_their_share() {
    let mut builder = SceneBuilder::new(0);
    let lamp = builder.add_material(scenes::lamp(0.0, 2.0));
    add_sheet(&mut builder, 0.0, 4.0, lamp);
    let sheet = builder.add_material(black(AlphaMode::Blend, 0.25));
    for y in [1.0, 2.0] {
        add_sheet(&mut builder, y, 4.0, sheet);
    }
    scenes::add_camera(&mut builder, DVec3::new(0.3, 3.0, 0.4), DVec3::new(0.3, 0.0, 0.0), POINT_VIEW);
    assert_shows("lamp behind two sheets", &builder.finish(), 2.0 * 0.75 * 0.75, 0.015, 1.03);
}

/// A floor under a square lamp of half side 1 at height 2, with `between` at height 1.
fn floor_under_lamp(lamp: Material, between: &[Material]) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let floor = builder.add_material(scenes::lambert(ALBEDO));
    scenes::add_floor(&mut builder, 3.0, floor);
    let lamp = builder.add_material(lamp);
    add_sheet(&mut builder, 2.0, 1.0, lamp);
    for (i, material) in between.iter().enumerate() {
        let material = builder.add_material(material.clone());
        add_sheet(&mut builder, 1.0 + 0.1 * i as f32, 3.0, material);
    }
    scenes::add_camera(&mut builder, DVec3::new(0.0, 0.5, 0.7), DVec3::ZERO, POINT_VIEW);
    builder.finish()
}

/// What the floor shows below the lamp: Lambert's formula for a square seen from below its centre.
fn under_lamp(radiance: f64) -> f64 {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| DVec3::new(x, 2.0, z));
    let irradiance = support::closed::polygon_irradiance(&corners, DVec3::ZERO, DVec3::Y, radiance);
    f64::from(ALBEDO) / PI * irradiance
}

#[test]
fn sheets_that_are_not_there_change_neither_light_nor_weights() {
    // With a lamp both ways of finding light are used; a path's weight needs the distance from the floor, not from the
    // last sheet that it passed. One bounce, so that light between floor and lamp does not add to it.
    let lamp = Material { double_sided: true, ..scenes::lamp(0.0, 5.0) };
    let absent = vec![black(AlphaMode::Blend, 0.0); 4];
    for between in [&[][..], &absent[..]] {
        let scene = floor_under_lamp(lamp.clone(), between);
        assert_shows("four absent sheets", &scene, under_lamp(5.0), 0.002, 1.006);
    }
}

#[test]
fn half_present_lamp_gives_half_of_its_light() {
    let lamp = Material {
        double_sided: true,
        alpha_mode: AlphaMode::Blend,
        opacity: Param::constant(0.5),
        ..scenes::lamp(0.0, 5.0)
    };
    assert_shows("half a lamp", &floor_under_lamp(lamp, &[]), 0.5 * under_lamp(5.0), 0.005, 1.012);
}

#[test]
fn passing_a_surface_is_no_bounce() {
    let sheets = vec![black(AlphaMode::Blend, 0.0); 8];
    let scene = floor_under(&sheets, 0.0);
    let frame = shoot(&scene, &RenderSettings { max_bounces: Some(0), ..settings(4, 4, 0) });
    assert!(frame.pixels.iter().all(|p| (f64::from(p[0]) - in_the_sun()).abs() < 1e-5 * in_the_sun()));
    // Seen through all of them from above.
    let mut scene = scene;
    scene.cameras[0] = camera_above(3.0, POINT_VIEW);
    let frame = shoot(&scene, &RenderSettings { max_bounces: Some(0), ..settings(4, 4, 0) });
    assert!(frame.pixels.iter().all(|p| (f64::from(p[0]) - in_the_sun()).abs() < 1e-5 * in_the_sun()));
}

/// Looks straight down at the origin from height `y`, +z at the lower edge.
fn camera_above(y: f64, yfov: f64) -> Camera {
    let world_from_camera = DMat4::from_translation(DVec3::Y * y) * DMat4::from_rotation_x(-PI / 2.0);
    let projection = Projection::Perspective { yfov, aspect_ratio: None };
    Camera { name: "above".into(), world_from_camera, projection, lens: Lens::default() }
}

/// Blended sheets of several opacities and a mask of many holes over a floor under a lamp and the sun, seen whole.
fn mixed_scene() -> Scene {
    let sheet =
        |opacity| Material { alpha_mode: AlphaMode::Blend, opacity: Param::constant(opacity), ..scenes::lambert(0.5) };
    let mut scene = floor_under_lamp(scenes::lamp(0.5, 5.0), &[sheet(0.2), sheet(0.5), sheet(0.8), sheet(0.9)]);
    let mut builder = SceneBuilder::new(0);
    let texels: Vec<[u8; 4]> = (0..64).map(|i| [255, 255, 255, if i % 3 == 0 { 40 } else { 250 }]).collect();
    let texture = add_texture(&mut builder, &texels);
    let made = builder.finish();
    (scene.images, scene.textures) = (made.images, made.textures);
    let mask = scene.materials.last_mut().expect("the last sheet");
    mask.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
    mask.opacity.texture = Some(TextureRef::plain(texture));
    scene.cameras[0] = camera_above(6.0, 1.0);
    scene
}

#[test]
fn every_backend_and_number_of_threads_decides_the_same() {
    let scene = mixed_scene();
    let with = |accel, threads| RenderSettings { accel, threads: Some(threads), ..settings(48, 8, 3) };
    let picture = |accel, threads| shoot(&scene, &with(accel, threads)).pixels;
    let bvh = picture(AccelChoice::Bvh, 1);
    assert!(bvh == picture(AccelChoice::Bvh, 3), "threads");
    assert!(bvh == picture(AccelChoice::Linear, 2), "linear");
    let frame = shoot(&scene, &with(AccelChoice::Auto, 2));
    assert!(bvh == frame.pixels, "{}", frame.stats.accel.used);
}

#[test]
fn culled_backs_let_camera_rays_pass_and_still_cast_shadows() {
    // A single-sided ceiling with its front down, seen from above: gone for the camera, there for the sun.
    let ceiling = Material { double_sided: false, ..scenes::lambert(0.0) };
    let lamp = Material { double_sided: true, ..scenes::lamp(0.0, 2.0) };
    for (material, culled, expected) in [(&ceiling, true, 2.0), (&ceiling, false, 0.0), (&lamp, true, 2.0)] {
        let mut builder = SceneBuilder::new(0);
        let floor = builder.add_material(lamp.clone());
        add_sheet(&mut builder, 0.0, 2.0, floor);
        let above = builder.add_material(material.clone());
        let h = 2.0;
        scenes::add_quad(&mut builder, [[-h, 1.0, -h], [h, 1.0, -h], [h, 1.0, h], [-h, 1.0, h]], above);
        builder.add_camera(camera_above(3.0, POINT_VIEW));
        let settings = RenderSettings { cull_backfaces: culled, ..settings(4, 4, 0) };
        assert!(shoot(&builder.finish(), &settings).pixels.iter().flatten().all(|&x| x == expected), "{culled}");
    }
    let mut scene = floor_under(&[ceiling], 0.0);
    // The sheet's front is up, so turn it over.
    std::sync::Arc::make_mut(&mut scene.meshes[1]).indices = vec![[0, 2, 1], [0, 3, 2]];
    scene.cameras[0] = camera_above(3.0, POINT_VIEW);
    let settings = RenderSettings { cull_backfaces: true, ..settings(4, 4, 0) };
    assert!(shoot(&scene, &settings).pixels.iter().flatten().all(|&x| x == 0.0));
}

#[test]
fn culled_backs_stop_light_that_scatters() {
    // A lamp above a single-sided sheet whose back faces the floor: gone for the camera below, there for all light.
    let mut scene =
        floor_under_lamp(scenes::lamp(0.0, 5.0), &[Material { double_sided: false, ..scenes::lambert(0.0) }]);
    // The lamp shines down.
    std::sync::Arc::make_mut(&mut scene.meshes[1]).indices = vec![[0, 2, 1], [0, 3, 2]];
    let settings = RenderSettings { cull_backfaces: true, ..settings(8, 64, 0) };
    assert!(shoot(&scene, &settings).pixels.iter().flatten().all(|&x| x == 0.0));
}

#[test]
fn alpha_of_an_opaque_material_is_ignored() {
    assert_exactly("opaque", &floor_under(&[black(AlphaMode::Opaque, 0.0)], 0.0), 0.0);
}

/// An unlit sheet of this colour.
fn unlit(color: [f32; 3]) -> Material {
    Material { base_color: Param::constant(color), unlit: true, ..Material::default() }
}

#[test]
fn unlit_shows_its_colour_to_the_camera_and_in_mirrors() {
    let color = [0.25, 0.5, 2.0 / 3.0];
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(unlit(color));
    let mirror = builder.add_material(scenes::white_metal(0.0));
    add_sheet(&mut builder, 0.0, 2.0, material);
    // Faces down, so that it is seen from below.
    scenes::add_quad(&mut builder, [[-2.0, 3.0, -2.0], [2.0, 3.0, -2.0], [2.0, 3.0, 2.0], [-2.0, 3.0, 2.0]], mirror);
    for target in [DVec3::ZERO, DVec3::new(0.0, 3.0, 0.0)] {
        scenes::add_camera(&mut builder, DVec3::new(0.1, 1.0, 0.3), target, POINT_VIEW);
    }
    let scene = builder.finish();
    for camera in 0..2 {
        let one = Scene { cameras: vec![scene.cameras[camera].clone()], ..scene.clone() };
        for pixel in shoot(&one, &settings(4, 4, 0)).pixels {
            assert!(pixel.iter().zip(color).all(|(a, b)| (a - b).abs() < 1e-5), "camera {camera}: {pixel:?}");
        }
    }
}

#[test]
fn unlit_lights_nothing_and_blocks_light() {
    let white = unlit([1.0; 3]);
    assert_exactly("shadow of an unlit sheet", &floor_under(std::slice::from_ref(&white), 0.0), 0.0);
    // Emission of an unlit material is not light either.
    let shining = Material { emission: Param::constant([100.0; 3]), ..white };
    assert_exactly("shadow of an unlit lamp", &floor_under(&[shining], 0.0), 0.0);
}

/// One unlit triangle seen from above with these vertex colours.
fn colored_triangle(mode: AlphaMode, colors: Vec<[f32; 4]>) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(Material { alpha_mode: mode, ..unlit([1.0, 0.5, 1.0]) });
    let mesh = builder.add_mesh(Mesh {
        positions: vec![[-2.0, 0.0, -2.0], [-2.0, 0.0, 2.0], [2.0, 0.0, -2.0]],
        normals: None,
        uv_sets: Vec::new(),
        colors: Some(colors),
        tangents: None,
        indices: vec![[0, 1, 2]],
        material,
        name: "triangle".into(),
    });
    builder.add_instance(Instance { mesh, world_from_object: DMat4::IDENTITY, name: "triangle".into() });
    let mut camera = camera_above(4.0, POINT_VIEW);
    (camera.world_from_camera.w_axis.x, camera.world_from_camera.w_axis.z) = (-1.0, -1.0);
    builder.add_camera(camera);
    builder.finish()
}

#[test]
fn vertex_colours_are_interpolated_and_multiply_the_base_colour() {
    let corners = vec![[0.0, 1.0, 0.0, 1.0], [1.0, 0.0, 0.5, 1.0], [0.5, 0.0, 0.25, 1.0]];
    // (-1, -1) has the weights 1/2, 1/4, 1/4.
    for pixel in shoot(&colored_triangle(AlphaMode::Opaque, corners), &settings(4, 4, 0)).pixels {
        assert!(pixel.iter().zip([0.375, 0.25, 0.1875]).all(|(a, b)| (a - b).abs() < 1e-5), "{pixel:?}");
    }
}

#[test]
fn vertex_opacity_counts_for_masks() {
    for (alpha, shown) in [(0.3, [0.0; 3]), (0.6, [1.0, 0.5, 1.0])] {
        let scene = colored_triangle(AlphaMode::Mask { cutoff: 0.5 }, vec![[1.0, 1.0, 1.0, alpha]; 3]);
        let settings = RenderSettings { default_light: DefaultLight::Off, ..settings(4, 4, 0) };
        for pixel in shoot(&scene, &settings).pixels {
            assert!(pixel.iter().zip(shown).all(|(a, b)| (a - b).abs() < 1e-5), "{alpha}: {pixel:?}");
        }
    }
}

#[test]
fn textures_read_the_set_of_coordinates_and_the_transform_that_they_name() {
    let red_green = [[255, 0, 0, 255], [0, 255, 0, 255]];
    // Set 0 puts the origin into the left texel; set 1 is the other way round.
    let left = vec![[0.2, 0.5]; 4];
    let right = vec![[0.8, 0.5]; 4];
    let shift = UvTransform { m: [[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]] };
    let swap = UvTransform { m: [[0.0, 1.6, 0.0], [1.0, 0.0, 0.0]] };
    for (uv_set, transform, expected) in [
        (0, None, [1.0, 0.0, 0.0]),
        (1, None, [0.0, 1.0, 0.0]),
        (0, Some(shift), [0.0, 1.0, 0.0]),
        (1, Some(shift), [1.0, 0.0, 0.0]),
        (0, Some(swap), [0.0, 1.0, 0.0]),
    ] {
        let mut builder = SceneBuilder::new(0);
        let texture = add_texture(&mut builder, &red_green);
        let base_color = Param { factor: [1.0; 3], texture: Some(TextureRef { texture, uv_set, transform }) };
        let material = builder.add_material(Material { base_color, ..unlit([1.0; 3]) });
        add_sheet(&mut builder, 0.0, 1.0, material);
        builder.add_camera(camera_above(2.0, POINT_VIEW));
        let mut scene = builder.finish();
        std::sync::Arc::make_mut(&mut scene.meshes[0]).uv_sets = vec![left.clone(), right.clone()];
        for pixel in shoot(&scene, &settings(4, 4, 0)).pixels {
            assert!(pixel.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{uv_set} {transform:?}: {pixel:?}");
        }
    }
}

#[test]
fn meshes_with_and_without_further_attributes_share_a_scene() {
    // Lanes of one vector hit triangles with no coordinates although their texture needs them, two sets, and colours: the small picture
    // must equal a picture of each pixel on its own (crops), whatever its neighbours hit.
    let mut builder = SceneBuilder::new(0);
    // Every texel differs from the first, which stands for coordinates that are not there.
    let texels: Vec<[u8; 4]> = (0..=255).map(|i| [255 - i, i, 128, 255]).collect();
    let texture = add_texture(&mut builder, &texels);
    let reads = |uv_set| Some(TextureRef { texture, uv_set, transform: None });
    for k in 0..4_u8 {
        let base_color = Param { factor: [0.9; 3], texture: reads(u32::from(k == 2)) };
        let material = builder.add_material(Material { base_color, ..scenes::lambert(0.9) });
        let x = -1.5 + f32::from(k);
        let uvs = vec![[0.1, 0.5], [0.9, 0.5], [0.9, 0.1], [0.1, 0.1]];
        let flipped = uvs.iter().map(|[u, v]| [1.0 - u, *v]).collect();
        let mesh = builder.add_mesh(Mesh {
            positions: vec![[x - 0.5, 0.0, 1.0], [x + 0.5, 0.0, 1.0], [x + 0.5, 0.0, -1.0], [x - 0.5, 0.0, -1.0]],
            normals: None,
            uv_sets: if k == 0 { Vec::new() } else { vec![uvs, flipped] },
            colors: (k == 3).then(|| vec![[1.0, 0.5, 0.25, 1.0]; 4]),
            tangents: None,
            indices: vec![[0, 1, 2], [0, 2, 3]],
            material,
            name: format!("strip {k}"),
        });
        builder.add_instance(Instance { mesh, world_from_object: DMat4::IDENTITY, name: String::new() });
    }
    sun(&mut builder);
    builder.add_camera(camera_above(4.0, 0.9));
    let scene = builder.finish();
    let whole = shoot(&scene, &settings(16, 4, 0));
    for (x, y) in [(1, 8), (4, 8), (7, 3), (10, 8), (14, 12)] {
        let crop = Some(prt::render::CropWindow { x, y, width: 1, height: 1 });
        let one = shoot(&scene, &RenderSettings { crop, ..settings(16, 4, 0) });
        assert_eq!(one.pixels[0], whole.pixels[(y * 16 + x) as usize], "pixel {x},{y}");
    }
}
