//! Pictures through a thin lens against what optics says of them (LENS-01, and 2.8 of the design's closed forms), and what
//! files may say of lenses.
//!
//! Rendered values: seed 0, samples as stated at each test; the numbers of a pixel are stratified in four dimensions, so
//! that sums over the picture are off by far less than 0.5 %.

mod gltf_support;
mod support;

use glam::{DMat4, DQuat, DVec3};
use gltf_support::Sample;
use prt::camera::{Camera, Lens, Projection};
use prt::light::Environment;
use prt::load::LoadOptions;
use prt::render::{
    AccelChoice, CropWindow, DefaultLight, Filter, FilterShape, Frame, Progress, RenderSettings, render,
};
use prt::scene::{Scene, SceneBuilder};
use serde_json::json;
use support::pictures::{settings, shoot};
use support::scenes::{add_quad, lambert, lamp, reference};

const SIDE: u32 = 48;
/// Half of what is seen at distance 1.
const HALF: f64 = 0.152;
/// Pixels a unit of the plane at distance 1.
const PER_TAN: f64 = 0.5 * SIDE as f64 / HALF;
/// Radius of the aperture, metres: that of a 36 mm sensor at [`f_stop`].
const RADIUS: f64 = 0.1;
/// Where the light is, metres along the axis.
const DEPTH: f64 = 4.0;

fn yfov() -> f64 {
    2.0 * HALF.atan()
}

/// Metres.
fn focal_length() -> f64 {
    0.018 / HALF
}

fn f_stop() -> f64 {
    focal_length() / (2.0 * RADIUS)
}

fn options(spp: u32, lens: Lens) -> RenderSettings {
    RenderSettings {
        width: SIDE,
        height: SIDE,
        spp,
        lens,
        max_bounces: Some(0),
        default_light: DefaultLight::Off,
        filter: Filter { shape: FilterShape::Box, width: 1.0 },
        accel: AccelChoice::Bvh,
        ..RenderSettings::default()
    }
}

fn lens(focus_distance: f64) -> Lens {
    Lens { f_stop: Some(f_stop()), focus_distance: Some(focus_distance), ..Lens::default() }
}

/// Turned and moved, so that no axis is another's by chance.
fn world_from_camera() -> DMat4 {
    let turn = DQuat::from_rotation_y(0.6) * DQuat::from_rotation_x(-0.3) * DQuat::from_rotation_z(0.2);
    DMat4::from_rotation_translation(turn, DVec3::new(4.0, 3.0, -2.0))
}

/// Shining rectangles (corners x0, y0, x1, y1 at a depth; camera space, metres) of 1 nit, all facing the camera.
fn scene_of(rectangles: &[([f64; 4], f64)]) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let shines = builder.add_material(lamp(0.0, 1.0));
    for ([x0, y0, x1, y1], depth) in rectangles {
        let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)];
        let corners = corners.map(|(x, y)| world_from_camera().transform_point3(DVec3::new(*x, *y, -depth)));
        add_quad(&mut builder, corners.map(|p| p.as_vec3().to_array()), shines);
    }
    builder.add_camera(Camera {
        name: "eye".into(),
        world_from_camera: world_from_camera(),
        projection: Projection::Perspective { yfov: yfov(), aspect_ratio: None },
        lens: Lens::default(),
    });
    builder.finish()
}

/// A square of half side `half` about the axis at [`DEPTH`].
fn spot(half: f64) -> Scene {
    scene_of(&[([-half, -half, half, half], DEPTH)])
}

/// Pixels with their values: x, y from the picture's centre, y up.
fn centred(frame: &Frame) -> impl Iterator<Item = ([f64; 2], f64)> {
    let CropWindow { x, y, width, .. } = frame.window;
    let at = |i: u32| f64::from(i) + 0.5 - 0.5 * f64::from(SIDE);
    let place = move |i: u32| [at(x + i % width), -at(y + i / width)];
    frame.pixels.iter().enumerate().map(move |(i, v)| (place(i as u32), f64::from(v[0])))
}

/// The window of `side` pixels in the middle.
fn middle(side: u32, settings: RenderSettings) -> RenderSettings {
    let edge = (SIDE - side) / 2;
    RenderSettings { crop: Some(CropWindow { x: edge, y: edge, width: side, height: side }), ..settings }
}

fn total(frame: &Frame) -> f64 {
    centred(frame).map(|(_, v)| v).sum()
}

/// Radius of the blur in pixels by its second moment: a disc of radius r has r^2 / 4 along an axis, a square of half side
/// a has a^2 / 3, and a pixel 1 / 12.
fn blur_radius(frame: &Frame, half: f64) -> f64 {
    let a = half / DEPTH * PER_TAN;
    let moment = centred(frame).map(|([x, y], v)| 0.5 * (x * x + y * y) * v).sum::<f64>() / total(frame);
    2.0 * (moment - a * a / 3.0 - 1.0 / 12.0).sqrt()
}

#[test]
fn lens01_an_aperture_of_0_is_the_pinhole_bit_for_bit() {
    let scene = reference("cornell");
    let pinhole = RenderSettings { accel: AccelChoice::Bvh, ..settings(24, 4, 3) };
    let closed = Lens { f_stop: Some(f64::INFINITY), focus_distance: Some(2.0), blades: Some(5), sensor: Some(10.0) };
    let without = Lens { f_stop: None, ..closed };
    for lens in [closed, without] {
        let frame = shoot(&scene, &RenderSettings { lens, ..pinhole.clone() });
        assert_eq!(frame.pixels, shoot(&scene, &pinhole).pixels);
        assert!(frame.stats.lens.is_none());
    }
}

/// 2.8: the disc's radius is A |1/f - 1/z|, and what is in it does not depend on the focus. 1024 samples.
#[test]
fn lens01_the_blur_is_a_disc_of_the_radius_of_the_closed_form() {
    const HALF_SIDE: f64 = 0.05;
    for focus in [1.2, 2.0, 8.0, f64::INFINITY] {
        let frame = shoot(&spot(HALF_SIDE), &middle(30, options(1024, lens(focus))));
        let wanted = RADIUS * (1.0 / focus - 1.0 / DEPTH).abs() * PER_TAN;
        let radius = blur_radius(&frame, HALF_SIDE);
        assert!((radius - wanted).abs() < 0.5, "focus {focus}: {radius} px for {wanted}");
        assert!((radius / wanted - 1.0).abs() < 0.02, "focus {focus}: {radius} px for {wanted}");
        // As high everywhere within the disc as its share of the flux says, and nothing outside.
        let a = HALF_SIDE / DEPTH * PER_TAN;
        let level = 4.0 * a * a / (std::f64::consts::PI * wanted * wanted);
        let distance = |[x, y]: [f64; 2]| x.hypot(y);
        let edge = wanted - 1.5 * a - 1.0;
        for ring in [0.0..0.6 * edge, 0.6 * edge..edge] {
            let values: Vec<f64> = centred(&frame).filter(|(p, _)| ring.contains(&distance(*p))).map(|p| p.1).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            assert!(edge < 3.0 || (mean / level - 1.0).abs() < 0.06, "focus {focus}: {mean} in {ring:?} for {level}");
        }
        let outside = |r: f64| r > wanted + 1.5 * a + 1.0;
        assert!(centred(&frame).all(|(p, v)| v == 0.0 || !outside(distance(p))), "focus {focus}: light outside");
    }
}

#[test]
fn lens01_the_light_of_a_blurred_spot_does_not_depend_on_the_focus() {
    const HALF_SIDE: f64 = 0.1;
    // The square is parallel to the film, so that from each point of the lens it has the same size in the picture.
    let wanted = (2.0 * HALF_SIDE / DEPTH * PER_TAN).powi(2);
    let sharp = total(&shoot(&spot(HALF_SIDE), &options(256, Lens::default())));
    assert!((sharp / wanted - 1.0).abs() < 5e-3, "pinhole: {sharp} for {wanted}");
    for (focus, blades) in [(1.2, 0), (2.0, 0), (2.0, 5), (DEPTH, 0), (8.0, 6), (f64::INFINITY, 0)] {
        let lens = Lens { blades: Some(blades), ..lens(focus) };
        let flux = total(&shoot(&spot(HALF_SIDE), &middle(30, options(1024, lens))));
        assert!((flux / wanted - 1.0).abs() < 5e-3, "focus {focus}, {blades} blades: {flux} for {wanted}");
    }
}

/// The circle of confusion of optics, c = D f |z - s| / (z (s - f)), is on a sensor at the image's distance f s / (s - f);
/// the picture is what a sensor there sees, whatever its focus, of the same angles.
#[test]
fn lens01_the_circle_of_confusion_is_that_of_the_thin_lens_formula() {
    const HALF_SIDE: f64 = 0.05;
    for (sensor, n) in [(36.0, f_stop()), (12.0, f_stop() / 3.0)] {
        let f = 0.5e-3 * sensor / HALF;
        for s in [1.0, 1.5, 40.0] {
            let lens = Lens { f_stop: Some(n), sensor: Some(sensor), ..lens(s) };
            let frame = shoot(&spot(HALF_SIDE), &middle(34, options(1024, lens)));
            let report = frame.stats.lens.expect("a lens");
            assert!((report.thin.focal_length - f).abs() < 1e-12 && (report.thin.radius - RADIUS).abs() < 1e-12);
            let confusion = (f / n) * f * (DEPTH - s).abs() / (DEPTH * (s - f));
            let measured = 2.0 * blur_radius(&frame, HALF_SIDE) / PER_TAN * (f * s / (s - f));
            assert!((measured / confusion - 1.0).abs() < 5e-3, "{sensor} mm, {s} m: {measured} m for {confusion} m");
            let blur = 2.0 * report.thin.blur(DEPTH) * (f * s / (s - f));
            assert!((blur / confusion - 1.0).abs() < 1e-12, "{blur} for {confusion}");
        }
    }
}

/// A checkerboard whose edges are those of pixels, in the plane of focus: sharp into the corners. Were the distance taken
/// along the rays, the corners would be 3 cm out of focus and 0.1 px blurred.
#[test]
fn lens01_what_is_in_the_plane_of_focus_is_sharp_up_to_the_corners_of_the_picture() {
    const CELL: u32 = 4;
    let edge = |i: u32| (f64::from(i) - 0.5 * f64::from(SIDE)) / PER_TAN * DEPTH;
    let cells = (0..SIDE / CELL).flat_map(|y| (0..SIDE / CELL).map(move |x| (x, y))).filter(|(x, y)| (x + y) % 2 == 0);
    let of = |(x, y): (u32, u32)| {
        let [x0, x1, y0, y1] = [x * CELL, (x + 1) * CELL, y * CELL, (y + 1) * CELL].map(edge);
        ([x0, y0, x1, y1], DEPTH)
    };
    let scene = scene_of(&cells.map(of).collect::<Vec<_>>());
    let wide = Lens { f_stop: Some(f_stop() / 4.0), ..lens(DEPTH) };
    let frame = shoot(&scene, &options(64, wide));
    let mut lit = 0;
    for ([x, y], v) in centred(&frame) {
        let cell = |c: f64| ((c + 0.5 * f64::from(SIDE)) / f64::from(CELL)).floor() as i64;
        let wanted = if (cell(x) + cell(y)) % 2 == 0 { 1.0 } else { 0.0 };
        // A ray on an edge falls to either side.
        assert!((v - wanted).abs() < 0.02, "{v} for {wanted} at {x} {y}");
        lit += usize::from(wanted > 0.5);
    }
    assert_eq!(lit, (SIDE * SIDE / 2) as usize);
    // The same board a little behind: blurred.
    let blurred = shoot(&scene, &options(64, Lens { focus_distance: Some(3.9), ..wide }));
    assert!(centred(&blurred).any(|(_, v)| v > 0.2 && v < 0.8));
}

#[test]
fn lens01_all_that_comes_through_an_aperture_is_as_bright_as_what_it_comes_from() {
    let mut scene = spot(0.1);
    scene.environment = Some(Environment::new(4, 2, [[1.0; 3]; 8]));
    for blades in [0, 3, 7] {
        for focus in [1e-3, 2.0, f64::INFINITY] {
            let frame = shoot(&scene, &options(8, Lens { blades: Some(blades), ..lens(focus) }));
            // The spot shines as the sky does, if seen from its front: from everywhere on the lens it is.
            assert!(frame.pixels.iter().flatten().all(|v| (v - 1.0).abs() < 1e-6), "{blades} {focus}");
        }
    }
}

/// A corner at the top of what is behind the focus, at the bottom of what is before it.
#[test]
fn bokeh_has_the_corners_and_the_area_of_its_blades() {
    const HALF_SIDE: f64 = 0.03;
    for blades in [5, 6] {
        for (focus, wide) in [(1.2, 2.0), (f64::INFINITY, 5.0)] {
            let lens = Lens { blades: Some(blades), f_stop: Some(f_stop() / wide), ..lens(focus) };
            let radius = wide * RADIUS * (1.0 / focus - 1.0 / DEPTH) * PER_TAN;
            let frame = shoot(&spot(HALF_SIDE), &middle(44, options(1024, lens)));
            let n = f64::from(blades);
            let area = 0.5 * n * (std::f64::consts::TAU / n).sin() * radius * radius;
            // What a pixel inside has is the flux over the area: level x area = flux.
            let flux = (2.0 * HALF_SIDE / DEPTH * PER_TAN).powi(2);
            let inner: Vec<f64> =
                centred(&frame).filter(|([x, y], _)| x.hypot(*y) < 0.5 * radius.abs()).map(|(_, v)| v).collect();
            let level = inner.iter().sum::<f64>() / inner.len() as f64;
            assert!(
                (level * area / flux - 1.0).abs() < 0.06,
                "{blades} blades, focus {focus}: {level} of {flux} / {area}"
            );
            // Extents: the last row of which two pixels' worth are lit.
            let rows = |y: f64| centred(&frame).filter(move |(p, _)| p[1] == y).map(|(_, v)| v).sum::<f64>();
            let reach = |side: f64| {
                let lit = (0..SIDE / 2).map(|i| f64::from(i) + 0.5).filter(|y| rows(side * y) > 2.0 * level);
                lit.fold(0.0, f64::max) + 0.5
            };
            let up = radius.signum();
            let across = if blades == 5 { (std::f64::consts::PI / 5.0).cos() } else { 1.0 };
            let (corner, other) = (radius.abs(), radius.abs() * across);
            assert!((reach(up) - corner).abs() < 1.6, "{blades} blades, focus {focus}: {} px for {corner}", reach(up));
            assert!((reach(-up) - other).abs() < 1.6, "{blades} blades, focus {focus}: {} px for {other}", reach(-up));
            if blades == 5 {
                // A side is 19 % of the radius nearer than the corner across.
                assert!(
                    reach(up) > reach(-up) + 0.1 * corner,
                    "{blades} blades, focus {focus}: a corner on the wrong side"
                );
            }
        }
    }
}

#[test]
fn a_lens_without_a_focus_is_focused_on_what_is_in_the_centre() {
    let open = Lens { f_stop: Some(2.0), ..Lens::default() };
    let scene = scene_of(&[([-0.1, -0.1, 0.1, 0.1], 3.0), ([0.2, -2.0, 2.0, 2.0], 1.0)]);
    let found = shoot(&scene, &options(1, open)).stats.lens.expect("a lens");
    assert!(found.is_found && (found.thin.focus_distance - 3.0).abs() < 1e-5, "{found:?}");
    let aside = scene_of(&[([0.2, -2.0, 2.0, 2.0], 1.0)]);
    let found = shoot(&aside, &options(1, open)).stats.lens.expect("a lens");
    assert!(found.is_found && found.thin.focus_distance == f64::INFINITY, "{found:?}");
}

#[test]
fn a_point_to_focus_on_counts_along_the_axis_and_must_be_before_the_camera() {
    let at = |p: DVec3| Some(world_from_camera().transform_point3(p));
    let focused =
        |p| RenderSettings { focus_point: at(p), ..options(1, Lens { f_stop: Some(2.0), ..Lens::default() }) };
    let found = shoot(&spot(0.1), &focused(DVec3::new(3.0, -1.0, -2.5))).stats.lens.expect("a lens");
    assert!(!found.is_found && (found.thin.focus_distance - 2.5).abs() < 1e-12, "{found:?}");
    let refused =
        |settings: &RenderSettings| render(&spot(0.1), 0, settings, &Progress::default()).unwrap_err().to_string();
    let error = refused(&focused(DVec3::new(0.0, 0.0, 2.0)));
    assert!(error.contains("--focus-on") && error.contains("m behind the camera \"eye\""), "{error}");
    // Of no matter to a pinhole.
    let pinhole = RenderSettings { lens: Lens::default(), ..focused(DVec3::Z) };
    assert!(shoot(&spot(0.1), &pinhole).stats.lens.is_none());
}

#[test]
fn lens01_a_camera_that_can_have_no_lens_is_refused() {
    let mut scene = spot(0.1);
    let refused =
        |scene: &Scene, lens| render(scene, 0, &options(1, lens), &Progress::default()).unwrap_err().to_string();
    for (lens, says) in [(lens(0.0), "focus distance 0"), (Lens { f_stop: Some(0.0), ..lens(1.0) }, "f-number 0")] {
        let error = refused(&scene, lens);
        assert!(error.contains(says) && error.contains("Allowed"), "{error}");
    }
    scene.cameras[0].projection = Projection::Orthographic { xmag: 1.0, ymag: 1.0 };
    let error = refused(&scene, lens(1.0));
    assert!(error.contains("camera \"eye\"") && error.contains("orthographic"), "{error}");
    assert!(render(&scene, 0, &options(1, Lens::default()), &Progress::default()).is_ok());
}

#[test]
fn settings_win_over_the_cameras_own_lens() {
    let mut scene = spot(0.1);
    scene.cameras[0].lens = Lens { f_stop: Some(4.0), focus_distance: Some(3.0), blades: Some(7), sensor: Some(18.0) };
    let own = shoot(&scene, &options(1, Lens::default())).stats.lens.expect("a lens").thin;
    assert_eq!((own.f_stop, own.focus_distance, own.blades), (4.0, 3.0, 7));
    assert!((own.focal_length - 0.5 * focal_length()).abs() < 1e-12);
    let over = Lens { f_stop: Some(8.0), sensor: Some(36.0), ..Lens::default() };
    let other = shoot(&scene, &options(1, over)).stats.lens.expect("a lens").thin;
    assert_eq!((other.f_stop, other.focus_distance, other.blades), (8.0, 3.0, 7));
    assert!((other.focal_length - focal_length()).abs() < 1e-12);
    let off = Lens { f_stop: Some(f64::INFINITY), ..Lens::default() };
    assert!(shoot(&scene, &options(1, off)).stats.lens.is_none());
}

#[test]
fn a_surface_seen_through_a_lens_is_lit_as_through_a_pinhole() {
    // Far out of focus, but all of it alike: the mean is the pinhole's. 8 x 8 pixels, 256 samples.
    let mut builder = SceneBuilder::new(0);
    let floor = builder.add_material(lambert(0.6));
    prt::verify::light::build::add_floor(&mut builder, 50.0, floor);
    prt::verify::light::build::add_camera(&mut builder, DVec3::new(0.0, 3.0, 0.0), DVec3::ZERO, 0.1);
    let mut scene = builder.finish();
    scene.environment = Some(Environment::new(4, 2, [[1.0; 3]; 8]));
    let open = Lens { f_stop: Some(0.5), focus_distance: Some(1.0), ..Lens::default() };
    let frame = shoot(&scene, &RenderSettings { max_bounces: Some(4), ..options(256, open) });
    let mean = total(&frame) / f64::from(SIDE * SIDE);
    assert!((mean / 0.6 - 1.0).abs() < 2e-3, "{mean}");
}

#[test]
fn extras_of_the_node_win_over_those_of_the_camera() {
    let mut sample = Sample::new();
    sample.json["cameras"][0]["extras"] =
        json!({"prt_f_stop": 4, "prt_focus_distance": 2.5, "prt_sensor": 24.0, "unrelated": [1]});
    let read = |sample: &Sample| sample.load().expect("a scene").cameras[0].lens;
    let of_camera = Lens { f_stop: Some(4.0), focus_distance: Some(2.5), blades: None, sensor: Some(24.0) };
    assert_eq!(read(&sample), of_camera);
    sample.json["nodes"][1]["extras"] = json!({"prt_f_stop": 1.4, "prt_aperture_blades": 6.0});
    assert_eq!(read(&sample), Lens { f_stop: Some(1.4), blades: Some(6), ..of_camera });
    sample.json["nodes"][1]["extras"] = json!("prt_f_stop, but no object");
    assert_eq!(read(&sample), of_camera);
}

#[test]
fn extras_that_make_no_lens_are_refused_with_their_place_and_what_is_allowed() {
    for (key, value, says) in [
        ("prt_f_stop", json!(0), "0 is out of range"),
        ("prt_f_stop", json!(-2.8), "-2.8"),
        ("prt_f_stop", json!("2.8"), "\"2.8\""),
        ("prt_focus_distance", json!(0), "metres"),
        ("prt_focus_distance", json!(-1), "-1"),
        ("prt_aperture_blades", json!(2), "3 to 64"),
        ("prt_aperture_blades", json!(5.5), "5.5"),
        ("prt_sensor", json!(0), "millimetres"),
        ("prt_sensor", json!(null), "null"),
    ] {
        for (list, i) in [("cameras", 0), ("nodes", 1)] {
            let mut sample = Sample::new();
            sample.json[list][i]["extras"] = json!({key: value});
            let error = sample.load().unwrap_err().to_string();
            let place = format!("/{list}/{i}/extras/{key}");
            assert!(error.contains(&place) && error.contains(says) && error.contains("Allowed"), "{error}");
        }
    }
    let mut sample = Sample::new();
    sample.json["cameras"][0] = json!({"type": "orthographic", "extras": {"prt_f_stop": 2},
        "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}});
    let error = sample.load().unwrap_err().to_string();
    assert!(error.contains("/cameras/0/extras/prt_f_stop: 2 is given for an orthographic camera"), "{error}");
}

#[test]
fn a_node_to_focus_on_is_where_its_parents_put_it_and_a_strange_name_lists_those_like_it() {
    let mut sample = Sample::new();
    sample.json["nodes"][1]["children"] = json!([3]);
    sample.json["nodes"].as_array_mut().unwrap().push(json!({"name": "Focus.001", "translation": [1, 2, -3]}));
    let with = |name: &str| LoadOptions { focus_on: Some(name.into()), ..LoadOptions::default() };
    let scene = sample.load_with(&with("Focus.001")).expect("a scene");
    assert_eq!(scene.focus, Some(DVec3::new(1.0, 2.0, 2.0)));
    assert_eq!(sample.load().expect("a scene").focus, None);
    let error = sample.load_with(&with("focus")).unwrap_err().to_string();
    assert!(error.contains("no node \"focus\"") && error.contains("\"Focus.001\""), "{error}");
}
