use super::super::profile::{Curve, Profile};
use super::*;
use crate::math::V3;
use crate::math::random::Rng;
use crate::math::robust::offset_point;
use simd::{Float, Scalar};

const WAIST: [[f64; 2]; 4] = [[1.0, -1.0], [0.2, -0.4], [1.6, 0.3], [0.5, 1.0]];
const BALL: [[f64; 2]; 4] = [[0.0, -1.0], [1.5, -1.0], [1.5, 1.0], [0.0, 1.0]];
const CROSSING: [[f64; 2]; 4] = [[0.3, -1.0], [3.0, -0.3], [-2.0, 0.4], [0.6, 1.0]];
const ROD: [[f64; 2]; 4] = [[0.05, -1.0], [0.06, -0.3], [0.04, 0.3], [0.05, 1.0]];

/// Of curvature, of the shapes below as they are stretched, in their size.
const LEAST_RADIUS: f64 = 0.017;

fn turned(points: &[[f64; 2]]) -> Arc<ExactShape> {
    Arc::new(ExactShape::revolution(Profile::new(Curve::Bezier, points).unwrap()))
}

fn vector(rng: &mut Rng) -> Vec3 {
    Vec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0))
}

fn all(shape: &PlacedShape, ray: &ShapeLine) -> Vec<[f32; 3]> {
    let mut found = Vec::new();
    shape.nearest_where(ray, &mut |hit| {
        found.push(hit);
        false
    });
    found.sort_by(|a, b| a[0].total_cmp(&b[0]));
    found
}

/// Where a ray starts that leaves `point` on the side of `side`.
fn start(point: &ShapePoint, side: f32) -> Vec3 {
    let moved = offset_point(
        V3::<Scalar>::splat(point.p.to_array()),
        V3::<Scalar>::splat((side * point.ng).to_array()),
        <Scalar as Lanes>::F::splat(point.offset),
    );
    Vec3::new(moved.x.first(), moved.y.first(), moved.z.first())
}

// Seeds 10 to 14, 2000 points a shape, scale and position, each left on both sides at any angle and at grazing ones.
#[test]
fn sor_05_rays_that_leave_a_shape_do_not_meet_it_where_they_left_it() {
    let sphere = Arc::new(ExactShape::Sphere { radius: 1.0 });
    let shapes = [sphere, turned(&WAIST), turned(&BALL), turned(&CROSSING), turned(&ROD)];
    for (k, shape) in shapes.iter().enumerate() {
        let mut rng = Rng::new(10 + k as u64);
        let is_convex = k == 0 || k == 2;
        for (scale, shift) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e2), (1.0, 1e4), (1e-3, 1.0), (1e6, 1e8)] {
            let map = DMat4::from_scale_rotation_translation(
                DVec3::new(scale, -1.3 * scale, 0.8 * scale),
                glam::DQuat::from_rotation_x(0.7) * glam::DQuat::from_rotation_z(0.3),
                DVec3::new(1.0, 0.3, -0.7) * shift,
            );
            let placed = PlacedShape::new(Arc::clone(shape), [map]);
            let mut again = 0;
            for i in 0..2000 {
                let (s, turn) = (rng.unit(), rng.unit());
                // Where a profile crosses the axis there is a tip, and what leaves it meets its other half at once.
                if k == 3 && shape.point(s.into(), 0.0).p.x.abs() < 0.02 {
                    continue;
                }
                let point = placed.point(s, turn, 0.0);
                let side = if i % 2 == 0 { 1.0 } else { -1.0 };
                let n = side * point.ng;
                let mut d = vector(&mut rng).normalize();
                d -= n * d.dot(n) * if i % 3 == 0 { 0.999 } else { 0.0 };
                if d.dot(n) < 0.0 {
                    d -= 2.0 * n * d.dot(n);
                }
                let ray = ShapeLine { origin: start(&point, side), direction: d, t_max: f32::INFINITY, time: 0.0 };
                let hits = all(&placed, &ray);
                if is_convex && side > 0.0 {
                    again += u32::from(!hits.is_empty());
                    continue;
                }
                // A surface that bends towards the ray with the radius r is met again after sqrt(2 h r) at least, h above it.
                let soonest = 0.5 * (2.0 * f64::from(point.offset) * LEAST_RADIUS * scale).sqrt();
                again += u32::from(hits.first().is_some_and(|hit| f64::from(hit[0] * d.length()) < soonest));
            }
            assert_eq!(again, 0, "shape {k}, scale {scale:e}, {shift:e} away");
            let point = placed.point(0.37, 0.21, 0.0);
            // Rounding the point, and what is added to it.
            let rounding = 2f32.powi(-23) * point.p.abs().max_element() * point.ng.abs().element_sum();
            assert!(point.offset >= 2.0 * rounding, "the offset {} is hardly more than {rounding}", point.offset);
            let bound = 64.0 * 2f32.powi(-24) * (point.p.abs().max_element() + 2.0 * scale as f32);
            assert!(point.offset <= bound, "the offset {} is larger than {bound}", point.offset);
        }
    }
}

// Seed 20: rays from 4 to 1e6 sizes away at points of the waist.
#[test]
fn sor_04_distance_costs_neither_crossings_nor_digits() {
    let placed = PlacedShape::new(turned(&WAIST), [DMat4::IDENTITY]);
    let mut rng = Rng::new(20);
    let mut apart = Vec::new();
    for i in 0..4000 {
        let target = vector(&mut rng);
        let d = vector(&mut rng).normalize();
        // What f32 makes of the far origin is the ray.
        let distance = 4.0 * 10f32.powf(5.4 * (i as f32 / 4000.0));
        let far = ShapeLine { origin: target - distance * d, direction: d, t_max: f32::INFINITY, time: 0.0 };
        // The same line in f64, from near by.
        let line = Line::new(far.origin.as_dvec3(), d.as_dvec3()).unwrap();
        let unit = placed.unit_from_prepared;
        let near = Line::new(unit.transform_point3(line.point(-4.0)), unit.transform_vector3(d.as_dvec3())).unwrap();
        let mut found = Vec::new();
        let mut nearest = Nearest::new(&near, f32::INFINITY, |c: &Crossing| {
            found.push(c.s);
            false
        });
        placed.shape.crossings(&near, f64::NEG_INFINITY, &mut nearest);
        let mut others: Vec<f64> = all(&placed, &far).iter().map(|hit| f64::from(hit[1])).collect();
        found.sort_by(f64::total_cmp);
        others.sort_by(f64::total_cmp);
        assert_eq!(found.len(), others.len(), "{far:?}");
        apart.extend(found.iter().zip(&others).map(|(a, b)| (a - b).abs()));
    }
    apart.sort_by(f64::total_cmp);
    assert!(apart.len() > 2000);
    assert!(apart[apart.len() / 2] <= 6e-8, "half an ulp of s at most: {}", apart[apart.len() / 2]);
    assert!(apart[apart.len() * 999 / 1000] <= 1e-6, "{}", apart[apart.len() * 999 / 1000]);
}

#[test]
fn self_04_scaled_by_powers_of_two_shapes_are_met_at_the_same_parameters() {
    for shape in [turned(&WAIST), Arc::new(ExactShape::Sphere { radius: 1.3 })] {
        let mut rng = Rng::new(30);
        for _ in 0..500 {
            let (origin, direction) = (3.0 * vector(&mut rng), vector(&mut rng));
            let found: Vec<_> = [-20, 0, 23]
                .map(|j| {
                    let scale = 2f32.powi(j);
                    let placed = PlacedShape::new(Arc::clone(&shape), [DMat4::from_scale(DVec3::splat(scale.into()))]);
                    let ray = ShapeLine { origin: origin * scale, direction: direction * scale, t_max: 9.0, time: 0.0 };
                    assert_eq!(placed.nearest(&ray).is_some(), placed.any(&ray));
                    placed.nearest(&ray)
                })
                .into_iter()
                .collect();
            assert!(found.iter().all(|f| *f == found[1]), "{found:?}");
        }
    }
}

#[test]
fn what_is_not_stopped_goes_on_to_the_next_crossing() {
    let placed = PlacedShape::new(Arc::new(ExactShape::Sphere { radius: 1.0 }), [DMat4::IDENTITY]);
    let ray = ShapeLine { origin: Vec3::new(-3.0, 0.1, 0.0), direction: Vec3::X, t_max: 10.0, time: 0.0 };
    let [near, ..] = placed.nearest(&ray).unwrap();
    let [far, _, turn] = placed.nearest_where(&ray, &mut |[t, ..]| t > 3.0).unwrap();
    assert!((near - 2.005).abs() < 1e-3 && (far - 3.995).abs() < 1e-3 && turn == 0.0, "{near} {far} {turn}");
    assert_eq!(placed.nearest_where(&ray, &mut |_| false), None);
    assert_eq!(placed.nearest(&ShapeLine { t_max: near, ..ray }), None, "the end is excluded");
    assert!(placed.any(&ShapeLine { t_max: near.next_up(), ..ray }));
    assert_eq!(placed.nearest(&ShapeLine { direction: Vec3::ZERO, ..ray }), None);
    assert_eq!(placed.nearest(&ShapeLine { origin: Vec3::NAN, ..ray }), None);
}

#[test]
fn moving_shapes_are_met_and_shaded_where_they_are_at_the_rays_time() {
    let at = |x: f64| DMat4::from_translation(DVec3::X * x);
    let placed = PlacedShape::new(Arc::new(ExactShape::Sphere { radius: 1.0 }), [at(0.0), at(4.0), at(4.0)]);
    let [low, high] = placed.bounds();
    assert!(low.x <= -1.0 && high.x >= 5.0 && high.x < 5.001 && high.y < 1.001);
    for (time, x) in [(0.0, 0.0), (0.25, 2.0), (0.5, 4.0), (1.0, 4.0)] {
        let ray = ShapeLine { origin: Vec3::new(x, 0.0, 5.0), direction: Vec3::NEG_Z, t_max: 10.0, time };
        let [t, s, turn] = placed.nearest(&ray).expect("a hit");
        let point = placed.point(s, turn, time);
        assert!((t - 4.0).abs() < 1e-6 && (point.p - Vec3::new(x, 0.0, 1.0)).length() < 1e-5, "{time}: {t} {point:?}");
        let beside = ShapeLine { origin: Vec3::new(x + 1.1, 0.0, 5.0), ..ray };
        assert_eq!(placed.nearest(&beside), None);
    }
}

#[test]
fn tangents_run_along_the_coordinates_as_the_normal_maps_transform_turns_them() {
    let mut placed = PlacedShape::new(Arc::new(ExactShape::Sphere { radius: 2.0 }), [DMat4::IDENTITY]);
    let plain = placed.point(0.4, 0.1, 0.0);
    // u' = 2 v, v' = -3 u: along u' goes v, half as long.
    placed.set_tangents([[0.0, 2.0], [-3.0, 0.0]]);
    let turned = placed.point(0.4, 0.1, 0.0);
    assert!((turned.du - 0.5 * plain.dv).length() < 1e-5, "{turned:?} {plain:?}");
    let area = |p: &ShapePoint| p.du.cross(p.dv).length();
    assert!((area(&turned) / area(&plain) - 1.0).abs() < 1e-5, "the area is that of the coordinates themselves");
    assert!(turned.dv.dot(plain.du) < 0.0);
    placed.set_tangents([[1.0, 1.0], [1.0, 1.0]]);
    assert_eq!(placed.point(0.4, 0.1, 0.0), turned, "what has no inverse changes nothing");
}
