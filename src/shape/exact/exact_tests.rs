use super::line::Nearest;
use super::profile::Curve;
use super::*;
use crate::math::random::Rng;

fn shapes() -> Vec<(&'static str, ExactShape)> {
    let of = |points: &[[f64; 2]]| ExactShape::revolution(Profile::new(Curve::Bezier, points).unwrap());
    vec![
        ("sphere", ExactShape::Sphere { radius: 3.0 }),
        ("waist", of(&[[1.0, -1.0], [0.2, -0.4], [1.6, 0.3], [0.5, 1.0]])),
        ("ball", of(&[[0.0, -1.0], [1.5, -1.0], [1.5, 1.0], [0.0, 1.0]])),
        ("crossing", of(&[[0.3, -1.0], [3.0, -0.3], [-2.0, 0.4], [0.6, 1.0]])),
    ]
}

#[test]
fn sor_06_normals_and_derivatives_are_those_of_finite_differences() {
    let mut rng = Rng::new(1);
    for (name, shape) in shapes() {
        for _ in 0..2000 {
            let (s, turn) = (f64::from(rng.range(0.01, 0.99)), f64::from(rng.unit()));
            let here = shape.point(s, turn);
            let h = 1e-6;
            let by_turn = (shape.point(s, turn + h).p - shape.point(s, turn - h).p) / (2.0 * h);
            // The second coordinate is 1 - s.
            let by_v = (shape.point(s - h, turn).p - shape.point(s + h, turn).p) / (2.0 * h);
            let near = |a: DVec3, b: DVec3| (a - b).length() <= 1e-4 * (1.0 + b.length());
            assert!(near(here.du, by_turn) && near(here.dv, by_v), "{name} {s} {turn}: {here:?} {by_turn} {by_v}");
            assert!((here.n.length() - 1.0).abs() < 1e-12);
            let across = by_turn.cross(-by_v);
            if across.length() > 1e-3 {
                // The front is to the right of the profile, on either side of the axis.
                let side = shape.point(s, 0.0).p.x.signum();
                assert!((across.normalize() * side - here.n).length() < 1e-4, "{name} {s} {turn}");
            }
        }
    }
}

#[test]
fn sor_06_poles_have_the_axis_for_normal_finite_derivatives_and_the_seam_is_closed() {
    for (name, shape) in shapes() {
        for turn in [0.0, 0.3, 0.999] {
            for s in [0.0, 1.0] {
                let pole = shape.point(s, turn);
                assert!(pole.du.is_finite() && pole.dv.is_finite() && pole.du != DVec3::ZERO, "{name} {s}: {pole:?}");
                if name == "sphere" || name == "ball" {
                    let axis = DVec3::Y * (2.0 * s - 1.0);
                    assert!((pole.n - axis).length() < 1e-9, "{name} {s}: {pole:?}");
                }
            }
        }
        for k in 0..=20 {
            let s = f64::from(k) / 20.0;
            assert!((shape.point(s, 0.0).p - shape.point(s, 1.0).p).length() < 1e-14);
        }
    }
    // Textures are not mirrored: from outside, the turn grows to the right where +y is up.
    let here = ExactShape::Sphere { radius: 1.0 }.point(0.5, 0.0);
    assert!((here.p - DVec3::X).length() < 1e-12 && (here.du.normalize() - DVec3::NEG_Z).length() < 1e-12);
    assert!((here.dv.normalize() - DVec3::NEG_Y).length() < 1e-12, "v grows downwards");
}

#[test]
fn sor_01_spheres_are_met_where_f64_has_them_at_every_distance() {
    let shape = ExactShape::Sphere { radius: 1.0 };
    let mut rng = Rng::new(4);
    let mut vector = |size: f32| {
        DVec3::new(rng.range(-size, size).into(), rng.range(-size, size).into(), rng.range(-size, size).into())
    };
    let mut met = 0;
    for k in 0..4000 {
        // A point of the sphere, a direction through it from outside, and a start far away.
        let (q, d) = (vector(1.0).normalize(), vector(1.0).normalize());
        let d = if d.dot(q) > 0.0 { -d } else { d };
        if d.dot(q) > -1e-3 {
            continue;
        }
        let distance = 4.0 * 10f64.powi(k % 7);
        let line = Line::new(q - d * distance, d).unwrap();
        let mut nearest = Nearest::new(&line, f32::INFINITY, |_: &line::Crossing| true);
        shape.crossings(&line, line.range(f32::INFINITY)[0], &mut nearest);
        let found = nearest.found.expect("a hit");
        assert!(
            (line.point(found.at) - q).length() <= 1e-15 * distance / d.dot(q).abs() + 1e-12,
            "{q} {d} {distance:e}"
        );
        let again = shape.point(shape.parameter(&line, &found).into(), ExactShape::turn(&line, &found).into());
        assert!((again.p - q).length() < 1e-6, "{q}: {again:?}");
        met += 1;
    }
    assert!(met > 3500);
}

#[test]
fn boxes_hold_every_point_and_are_tight() {
    let mut rng = Rng::new(5);
    for (name, shape) in shapes() {
        for _ in 0..50 {
            let mut columns = [0.0; 12];
            columns.iter_mut().for_each(|c| *c = f64::from(rng.range(-2.0, 2.0)));
            let map = DMat4::from_cols(
                DVec3::from_slice(&columns[0..3]).extend(0.0),
                DVec3::from_slice(&columns[3..6]).extend(0.0),
                DVec3::from_slice(&columns[6..9]).extend(0.0),
                DVec3::from_slice(&columns[9..12]).extend(1.0),
            );
            let (low, high) = shape.bounds(&map);
            let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            for k in 0..4000 {
                let p = map.transform_point3(shape.point(f64::from(k % 63) / 62.0, f64::from(k) / 4000.0).p);
                (least, most) = (least.min(p), most.max(p));
            }
            let room = 1e-9;
            assert!((least - low).min_element() >= -room && (high - most).min_element() >= -room, "{name}");
            assert!(((high - low) - (most - least)).max_element() < 0.1 * (high - low).max_element(), "{name}");
        }
    }
}

#[test]
fn areas_are_those_of_spheres_ellipsoids_and_cylinders() {
    let sphere = ExactShape::Sphere { radius: 1.0 };
    let near = |a: f64, b: f64, room: f64| assert!((a / b - 1.0).abs() < room, "{a}, not {b}");
    near(sphere.area(DMat3::from_diagonal(DVec3::splat(2.0))), 16.0 * PI, 1e-12);
    // An oblate spheroid of half axes 2, 2, 1: 2 pi a^2 (1 + (1 - e^2) / e atanh e), e^2 = 3/4.
    let e = 0.75f64.sqrt();
    near(sphere.area(DMat3::from_diagonal(DVec3::new(2.0, 1.0, 2.0))), 8.0 * PI * (1.0 + 0.25 / e * e.atanh()), 1e-2);
    let wall: Vec<[f64; 2]> = (0..4).map(|i| [0.5, f64::from(i)]).collect();
    let cylinder = ExactShape::revolution(Profile::new(Curve::Bezier, &wall).unwrap());
    near(cylinder.area(DMat3::from_mat4(cylinder.object_from_unit())), 3.0 * PI, 1e-9);
    assert_eq!(cylinder.vector_area(), DVec3::ZERO);
    let disc: Vec<[f64; 2]> = (0..4).map(|i| [f64::from(i) / 3.0, 0.0]).collect();
    let disc = ExactShape::revolution(Profile::new(Curve::Bezier, &disc).unwrap());
    assert!((disc.vector_area() + DVec3::Y * PI).length() < 1e-12, "from the axis outwards it faces down");
}
