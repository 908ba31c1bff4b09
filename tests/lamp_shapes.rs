//! The same light sampled in two ways shows the same: lights with a size and glowing balls, bulbs by cones and by points,
//! parallelograms whole and in triangles.
//!
//! Seeds 0..8 of each, means of the picture's quarters, Welch's t at 1e-4 a quarter (false alarms on a change of the random
//! numbers: 4e-4 a pair), and the factor that is told in each test is found.

mod support;

use glam::DVec3;
use prt::light::Light;
use prt::material::Material;
use prt::material::extensions::{Transmission, Volume};
use prt::render::RenderSettings;
use prt::scene::{MaterialId, Scene, SceneBuilder};
use prt::shape::Mesh;
use prt::texture::{Filter, Param};
use std::f64::consts::PI;
use support::pictures::{settings, shoot_seeds};
use support::stats::{Sample, welch};
use support::{scenes, smooth};

/// Means of the four quarters, over seeds.
fn quarters(scene: &Scene, settings: &RenderSettings) -> [Vec<f64>; 4] {
    let mut runs: [Vec<f64>; 4] = Default::default();
    for picture in shoot_seeds(scene, settings, 8) {
        let mut sums = [0.0; 4];
        for (i, pixel) in picture.pixels.iter().enumerate() {
            let (x, y) = (i % picture.width, i / picture.width);
            let quarter = 2 * usize::from(2 * y >= picture.height) + usize::from(2 * x >= picture.width);
            sums[quarter] += pixel.iter().map(|&c| f64::from(c)).sum::<f64>();
        }
        for (runs, sum) in runs.iter_mut().zip(sums) {
            runs.push(4.0 * sum / (3 * picture.pixels.len()) as f64);
        }
    }
    runs
}

/// The pictures of `a` and `b` are alike, and a factor of `fault` on either would be found.
fn assert_alike(what: &str, a: (&Scene, &RenderSettings), b: (&Scene, &RenderSettings), fault: f64) {
    let (a, b) = (quarters(a.0, a.1), quarters(b.0, b.1));
    for (quarter, (a, b)) in a.iter().zip(&b).enumerate() {
        let (one, other) = (Sample::of(a), Sample::of(b));
        let test = welch(&one, &other);
        let about = format!("{what}, quarter {quarter}: {} and {}", one.mean, other.mean);
        assert!(test.p > 1e-4, "{about}, p = {:e}", test.p);
        // The test finds what it is to find.
        let moved: Vec<f64> = b.iter().map(|v| fault * v).collect();
        assert!(welch(&one, &Sample::of(&moved)).p < 1e-4, "{about}: a factor of {fault} is not seen");
    }
}

/// Strips of gloss, a mirror and chalk on the ground, seen from below all that shines.
fn stage(builder: &mut SceneBuilder) {
    for (material, [left, right]) in [
        (scenes::white_metal(0.35), [-0.7, -0.2]),
        (scenes::white_metal(0.0), [-0.2, 0.2]),
        (scenes::lambert(0.6), [0.2, 0.7]),
    ] {
        let material = builder.add_material(material);
        scenes::add_quad(
            builder,
            [[left, 0.0, 1.1], [right, 0.0, 1.1], [right, 0.0, -0.6], [left, 0.0, -0.6]],
            material,
        );
    }
    scenes::add_camera(builder, DVec3::new(0.0, 0.45, 1.2), DVec3::new(0.0, 0.0, 0.2), 0.6);
}

/// Balls over the stage, none in another's way; the mirror shows the first.
const BALLS: [([f64; 3], f32); 3] = [([-0.1, 0.75, -0.9], 4.0), ([0.9, 0.9, -0.2], 2.0), ([-1.3, 1.4, 0.9], 6.0)];
const RADIUS: f64 = 0.25;

fn with_balls(radiance: impl Fn(f32) -> Material, far_away: impl Fn(&mut SceneBuilder)) -> Scene {
    let mut builder = SceneBuilder::new(0);
    stage(&mut builder);
    for (place, intensity) in BALLS {
        let lamp = builder.add_material(radiance(intensity / (PI * RADIUS * RADIUS) as f32));
        let mesh = scenes::ball(4, RADIUS).into_iter().map(|t| t.map(|p| p + DVec3::from(place))).collect::<Vec<_>>();
        scenes::add_triangles(&mut builder, &mesh, false, lamp);
    }
    far_away(&mut builder);
    builder.finish()
}

/// A pane behind the camera that lets light straight through: shadow rays then know where they end, so there are no bulbs.
fn pane(builder: &mut SceneBuilder) {
    let glass = Material {
        transmission: Transmission { factor: Param::constant(1.0), dispersion: 0.0 },
        roughness: Param::constant(0.0),
        ..Material::default()
    };
    let glass = builder.add_material(glass);
    scenes::add_quad(builder, [[90.0, 90.0, 90.0], [90.1, 90.0, 90.0], [90.1, 90.1, 90.0], [90.0, 90.1, 90.0]], glass);
}

/// Direct light and one bounce: the shadows of lamps on each other's light hardly count.
fn quick(spp: u32) -> RenderSettings {
    RenderSettings { max_bounces: Some(1), ..settings(16, spp, 0) }
}

#[test]
fn lgt_04_lights_with_a_size_show_what_glowing_balls_show_on_gloss_and_in_mirrors() {
    let mut builder = SceneBuilder::new(0);
    stage(&mut builder);
    for (place, intensity) in BALLS {
        scenes::add_light(&mut builder, Light::Point { intensity: [intensity; 3] }, place.into(), DVec3::NEG_Y);
    }
    let (sized, balls) = (builder.finish(), with_balls(|nits| scenes::lamp(0.0, nits), |_| ()));
    // Nothing but what comes from the lights: glowing balls stand in the way of the rest.
    let direct = RenderSettings { max_bounces: Some(0), ..quick(512) };
    let sized_settings = RenderSettings { light_radius: RADIUS, ..direct.clone() };
    assert_alike("sizes and balls", (&sized, &sized_settings), (&balls, &direct), 1.03);
}

#[test]
fn lgt_04_bulbs_show_what_their_triangles_show() {
    let lamp = |nits| Material { base_color: Param::constant([0.4; 3]), ..scenes::lamp(0.4, nits) };
    assert_alike(
        "bulbs and triangles",
        (&with_balls(lamp, |_| ()), &quick(512)),
        (&with_balls(lamp, pane), &quick(512)),
        1.03,
    );
}

/// A glowing ball of which texture and half the surface's brightness is on one side, in a coloured volume with the floor.
fn textured_bulbs(far_away: impl Fn(&mut SceneBuilder)) -> Scene {
    let mut builder = SceneBuilder::new(0);
    stage(&mut builder);
    let texels = [[255, 255, 255, 255], [20, 200, 20, 255], [0, 0, 0, 255], [120, 20, 200, 255]];
    let map = smooth::add_texture(&mut builder, 2, texels.to_vec(), Filter::Nearest);
    let glow = Material { emission: Param { factor: [30.0; 3], texture: Some(map) }, ..scenes::lamp(0.2, 1.0) };
    let glow = builder.add_material(glow);
    for (place, _) in BALLS {
        let ball = smooth::smooth_sphere(16, 24, glow);
        let at = |p: [f32; 3]| (DVec3::from(p.map(f64::from)) * RADIUS + DVec3::from(place)).as_vec3().to_array();
        smooth::add_mesh(&mut builder, Mesh { positions: ball.positions.iter().map(|&p| at(p)).collect(), ..ball });
    }
    // All of it lies in a volume: what is lost on the way to a bulb is known when it is met.
    let inside = Volume { attenuation_color: [0.5, 0.8, 0.9], attenuation_distance: 2.0 };
    let fog = Material {
        transmission: Transmission { factor: Param::constant(1.0), dispersion: 0.0 },
        roughness: Param::constant(0.0),
        ior: 1.0,
        volume: Some(inside),
        ..Material::default()
    };
    let fog = builder.add_material(fog);
    scenes::add_box(&mut builder, [3.0, 3.0, 3.0], false, fog);
    far_away(&mut builder);
    builder.finish()
}

#[test]
fn lgt_08_textured_bulbs_in_a_volume_show_what_their_triangles_show() {
    let settings = RenderSettings { max_bounces: Some(3), ..settings(16, 1024, 0) };
    assert_alike("textured bulbs", (&textured_bulbs(|_| ()), &settings), (&textured_bulbs(pane), &settings), 1.08);
}

/// A textured parallelogram over the stage, cut into so many pieces along each side; corners of its triangles turned.
fn under_a_quad(pieces: usize, turns: [usize; 2]) -> Scene {
    let mut builder = SceneBuilder::new(0);
    stage(&mut builder);
    let texels = [[255, 10, 10, 255], [20, 200, 20, 255], [0, 0, 40, 255], [220, 200, 20, 255]];
    let map = smooth::add_texture(&mut builder, 2, texels.to_vec(), Filter::Nearest);
    let glow = Material { emission: Param { factor: [30.0; 3], texture: Some(map) }, ..scenes::lamp(0.0, 1.0) };
    let glow = builder.add_material(glow);
    smooth::add_mesh(&mut builder, sheet(pieces, turns, glow));
    builder.finish()
}

fn sheet(pieces: usize, turns: [usize; 2], material: MaterialId) -> Mesh {
    let (mut positions, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for (row, column) in (0..=pieces).flat_map(|row| (0..=pieces).map(move |column| (row, column))) {
        let (u, v) = (column as f64 / pieces as f64, row as f64 / pieces as f64);
        let p = DVec3::new(-0.9, 0.7, -0.4) + u * DVec3::new(1.6, 0.3, 0.0) + v * DVec3::new(0.3, 0.0, 1.1);
        positions.push(p.as_vec3().to_array());
        uvs.push([u as f32, v as f32]);
    }
    let at = |row: usize, column: usize| (row * (pieces + 1) + column) as u32;
    for (row, column) in (0..pieces).flat_map(|row| (0..pieces).map(move |column| (row, column))) {
        let [a, b, c, d] = [at(row, column), at(row, column + 1), at(row + 1, column), at(row + 1, column + 1)];
        // Fronts down.
        let (mut near, mut far) = ([a, b, c], [d, c, b]);
        near.rotate_left(turns[0]);
        far.rotate_left(turns[1]);
        indices.extend([near, far]);
    }
    smooth::mesh(positions.clone(), vec![[0.0, -1.0, 0.0]; positions.len()], uvs, indices, material)
}

#[test]
fn lgt_03_textured_parallelograms_show_what_their_pieces_show() {
    let pieces = under_a_quad(2, [0, 0]);
    for turns in [[0, 0], [1, 2], [2, 1]] {
        let whole = under_a_quad(1, turns);
        assert_alike(&format!("turned by {turns:?}"), (&whole, &quick(512)), (&pieces, &quick(512)), 1.03);
    }
}
