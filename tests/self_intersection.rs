//! SELF-01 on slats, SELF-02, SELF-03 and the turned rays of SELF-04: gaps, ends of shadow rays and right angles, by every
//! backend.

#[path = "support/meshes.rs"]
mod meshes;
#[path = "support/rng.rs"]
mod rng;

use glam::{Quat, Vec3};
use meshes::{batch, placed, random_soup, soup, sphere};
use prt::accel::embree::EmbreeAccel;
use prt::accel::linear::Linear;
use prt::accel::wide::WideBvh;
use prt::accel::{Accel, HitBatch, MISS, Triangles};
use prt::math::robust::offset_origin;
use rng::Rng;
use std::path::PathBuf;

type Ray = (Vec3, Vec3, f32);
const INF: f32 = f32::INFINITY;

fn backends(mesh: &Triangles) -> Vec<(&'static str, Box<dyn Accel>)> {
    let mut all: Vec<(&'static str, Box<dyn Accel>)> =
        vec![("linear", Box::new(Linear::new(mesh))), ("bvh", Box::new(WideBvh::build(mesh)))];
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".embree");
    match EmbreeAccel::build(mesh, &[folder]) {
        Ok(embree) => all.push(("embree", Box::new(embree))),
        Err(why) => println!("skipped: no Embree library ({why})"),
    }
    all
}

/// Triangles hit, with their distances; [`MISS`] for none.
fn trace(accel: &dyn Accel, rays: &[Ray]) -> Vec<(u32, f32)> {
    let mut hits = HitBatch::new(rays.len());
    accel.intersect(&batch(rays), 0..rays.len(), false, &mut hits);
    (0..rays.len()).map(|i| (hits.primitive[i], hits.t[i])).collect()
}

/// A square of half side `half` about `centre` across `normal`; two triangles.
fn square(centre: Vec3, normal: Vec3, half: f32) -> [[Vec3; 3]; 2] {
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    let at = |u: f32, v: f32| centre + (x * u + y * v) * half;
    let [a, b, c, d] = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
    [[a, b, c], [a, c, d]]
}

/// The unit normal of a triangle, in f64 first.
fn normal(corners: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a).normalize().as_vec3().normalize()
}

fn extent(corners: [Vec3; 3]) -> Vec3 {
    corners.iter().fold(Vec3::ZERO, |most, c| most.max(c.abs()))
}

/// A column of `n` slats, each 1700 times as long as wide, two triangles each: `5 s` long about `centre`, leaning along
/// `axis`. Its wall is convex: what leaves it outwards meets nothing.
fn column(n: usize, s: f32, axis: Vec3, centre: Vec3) -> Triangles {
    let x = axis.any_orthonormal_vector();
    let y = axis.cross(x);
    let radius = n as f32 * s * 5.0 / 1700.0 / std::f32::consts::TAU;
    let foot = |i: usize| {
        let (sin, cos) = (i as f32 / n as f32 * std::f32::consts::TAU).sin_cos();
        centre + (x * cos + y * sin) * radius - axis * (2.5 * s)
    };
    soup((0..n).flat_map(|i| {
        let (a, b) = (foot(i), foot((i + 1) % n));
        let (c, d) = (b + axis * (5.0 * s), a + axis * (5.0 * s));
        [[a, b, c], [a, c, d]]
    }))
}

#[test]
fn self01_self03_slats_neither_catch_what_leaves_them_nor_shade_what_ends_on_them() {
    // Seeded; 40,000 rays in all by each backend. While edge functions were evaluated in f32 alone, a quarter of both
    // kinds were caught in the first case (969 and 990 of 4000).
    let mut rng = Rng::new(1700);
    for (s, far) in [(1.0, 0.0), (1.0, 3.0), (1e-3, 0.0), (1e-3, 4.0), (1e4, 1.0)] {
        let axis = rng.direction();
        let centre = rng.direction() * far * s;
        let mesh = column(200, s, axis, centre);
        let (mut rays, mut kinds) = (Vec::new(), Vec::new());
        while rays.len() < 8000 {
            let corners = mesh.corners(rng.below(mesh.indices.len()));
            let q = point(corners, &mut rng);
            // Off the axis.
            let ng = normal(corners);
            let out = ng * (q - centre).dot(ng).signum();
            let mut d = rng.direction();
            d -= out * (d.dot(out) - d.dot(out).abs() * rng.pick(&[1.0, 1.0, 1e-2]));
            if d.dot(out) < 1e-3 {
                continue;
            }
            if rays.len() % 2 == 0 {
                rays.push((offset_origin(q, extent(corners), out, d), d, INF));
            } else {
                let p = q + d * s * rng.range(0.01, 20.0);
                let to = offset_origin(q, extent(corners), out, d);
                rays.push((p, to - p, 1.0));
            }
            kinds.push(rays.len() % 2);
        }
        for (name, accel) in backends(&mesh) {
            let hits = trace(&*accel, &rays);
            let of = |kind| hits.iter().zip(&kinds).filter(|(hit, k)| hit.0 != MISS && **k == kind).count();
            // Embree's own arithmetic may catch a few (3 of 4000, with a closed end of the ray).
            let most = if name == "embree" { 10 } else { 0 };
            println!("{name}: {} of 4000 that leave, {} of 4000 that end there; s {s}, far {far}", of(1), of(0));
            assert!(of(1) <= most && of(0) <= most, "{name}, s {s}, far {far}");
        }
    }
}

#[test]
fn self02_no_ray_slips_through_a_gap_of_32_ulp_or_takes_the_wrong_side_of_it() {
    let mut rng = Rng::new(2);
    for k in 0..=12 {
        let (mut hidden, mut lost) = ([0; 3], [0; 3]);
        for _ in 0..60 {
            let n = rng.direction();
            // The widest gap is 0.06 m: no ray leaves sideways.
            let centre = rng.cube() * 10f32.powf(rng.range(0.0, 2.0));
            let largest = (centre.abs() + 2.0).max_element();
            let ulp = largest.next_up() - largest;
            let gap = ulp * (1 << k) as f32;
            let (front, back) = (square(centre + n * gap, n, 1.0), square(centre, n, 1.0));
            let mesh = soup([front[0], front[1], back[0], back[1]]);
            let mut rays = Vec::new();
            let mut leaving = Vec::new();
            for i in 0..20 {
                let p = centre + n.any_orthonormal_vector() * rng.range(-0.6, 0.6);
                let d = (n * -1.0 + rng.direction() * 0.7).normalize();
                rays.push((p - d * 3.0, d, INF));
                // From the back square's front side outwards: the front square is in the way.
                let corners = back[i % 2];
                let q = corners[0] + (corners[1] - corners[0]) * 0.5 + (corners[2] - corners[0]) * rng.range(0.1, 0.4);
                let out = (n + rng.direction() * 0.7).normalize();
                leaving.push((offset_origin(q, extent(corners), normal(corners), out), out, INF));
            }
            for (b, (name, accel)) in backends(&mesh).iter().enumerate() {
                let seen = trace(&**accel, &rays);
                assert!(seen.iter().all(|h| h.0 != MISS), "{name}: a ray passes both squares, gap 2^{k} ulp");
                hidden[b] += seen.iter().filter(|h| h.0 >= 2).count();
                lost[b] += trace(&**accel, &leaving).iter().filter(|h| h.0 >= 2).count();
            }
        }
        // Below 32 ulp either square may be the nearer one, and what leaves the back one may start beyond the front one.
        println!("gap 2^{k} ulp: {hidden:?} hits on the hidden square, {lost:?} of what leaves it gets out (of 1200)");
        if k >= 5 {
            assert_eq!((hidden, lost), ([0; 3], [0; 3]), "gap 2^{k} ulp");
        }
    }
}

#[test]
fn self02_a_film_of_4e_5_around_a_sphere_is_met_first_and_left_last() {
    let (inner, outer) = (sphere(48, 96, || 1.0), sphere(48, 96, || 1.0 + 4e-5));
    let first_outer = inner.indices.len() as u32;
    let mut mesh = inner.clone();
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(&outer.positions);
    mesh.indices.extend(outer.indices.iter().map(|t| t.map(|v| v + first)));
    let mut rng = Rng::new(1871);
    let (mut towards, mut between) = (Vec::new(), Vec::new());
    for i in 0..20_000 {
        // The two are similar: along a radius, and near it, the film is 4e-5 thick.
        let corners = outer.corners(i % outer.indices.len());
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let d = (-middle + rng.direction() * 0.3).normalize();
        towards.push((middle - d * 2.0, d, INF));
        let inside = inner.corners(i % inner.indices.len());
        let p = (inside[0] + inside[1] + inside[2]) / 3.0;
        between.push((offset_origin(p, extent(inside), normal(inside), p), p + rng.direction() * 0.3, INF));
    }
    // Brute force would take minutes.
    for (name, accel) in backends(&mesh).into_iter().skip(1) {
        assert!(trace(&*accel, &towards).iter().all(|h| h.0 != MISS && h.0 >= first_outer), "{name}: inner one first");
        assert!(trace(&*accel, &between).iter().all(|h| h.0 != MISS && h.0 >= first_outer), "{name}: through the film");
    }
}

/// A shadow ray from `p` of one triangle to `q` of another, off both by the error bound.
fn shadow_ray(p: (Vec3, [Vec3; 3]), q: (Vec3, [Vec3; 3])) -> Ray {
    let d = q.0 - p.0;
    let from = offset_origin(p.0, extent(p.1), normal(p.1), d);
    let to = offset_origin(q.0, extent(q.1), normal(q.1), -d);
    (from, to - from, 1.0)
}

fn point(corners: [Vec3; 3], rng: &mut Rng) -> Vec3 {
    let (u, v) = (rng.range(0.1, 0.4), rng.range(0.1, 0.4));
    corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v
}

#[test]
fn self03_what_is_four_bounds_before_a_light_shades_and_the_light_does_not_shade_itself() {
    let mut rng = Rng::new(3);
    let mut shaded = 0;
    for case in 0..600 {
        let s = 10f32.powi(case % 7 - 3);
        let shift = rng.cube() * s * 10f32.powf(rng.range(0.0, 3.0));
        let lamp = [0; 3].map(|_| rng.cube() * s + shift);
        let floor = [0; 3].map(|_| (rng.cube() + Vec3::X * 4.0) * s + shift);
        let (p, q) = (point(floor, &mut rng), point(lamp, &mut rng));
        let (d, ng) = (q - p, normal(lamp));
        // A lamp seen edge on has no side for the occluder to be on.
        if d.normalize().dot(ng).abs() < 0.2 || d.normalize().dot(normal(floor)).abs() < 0.05 {
            continue;
        }
        let ray = [shadow_ray((p, floor), (q, lamp))];
        let free = soup([lamp, floor]);
        for (name, accel) in backends(&free) {
            assert_eq!(trace(&*accel, &ray)[0].0, MISS, "{name}: the lamp or the floor shades itself, {ray:?}");
        }
        let bound = (q - offset_origin(q, extent(lamp), ng, -d)).length();
        for k in 2..=7 {
            let share = 10f32.powi(-k);
            if share * d.length() * d.normalize().dot(ng).abs() < 4.0 * bound {
                continue;
            }
            // Parallel to the lamp, so that the distance holds everywhere.
            let occluder = square(q - d * share, ng, 0.5 * s);
            let mesh = soup([lamp, floor, occluder[0], occluder[1]]);
            for (name, accel) in backends(&mesh) {
                let mut occluded = [0];
                accel.occluded(&batch(&ray), 1, &mut occluded);
                assert_eq!(occluded, [1], "{name}: an occluder at 1 - 1e-{k} of the way is lost, {ray:?}");
            }
            shaded += 1;
        }
    }
    assert!(shaded > 800, "{shaded}");
}

#[test]
fn self03_a_closed_lamp_shades_its_far_side_only() {
    // Light points on a convex mesh: seen from the front nothing is in the way, from behind the mesh itself is.
    let lamp = placed(&sphere(16, 32, || 1.0), 0.25, Vec3::new(0.0, 3.0, 0.0));
    let floor = square(Vec3::ZERO, Vec3::Y, 20.0);
    let mut mesh = lamp.clone();
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(floor.as_flattened().iter().map(|p| p.to_array()));
    mesh.indices.extend([[first, first + 1, first + 2], [first + 3, first + 4, first + 5]]);
    let mut rng = Rng::new(33);
    let (mut rays, mut expected) = (Vec::new(), Vec::new());
    while rays.len() < 20_000 {
        let corners = lamp.corners(rng.below(lamp.indices.len()));
        let (p, q) = (Vec3::new(rng.range(-5.0, 5.0), 0.0, rng.range(-5.0, 5.0)), point(corners, &mut rng));
        let out = normal(corners) * (q - Vec3::Y * 3.0).dot(normal(corners)).signum();
        let cos = (p - q).normalize().dot(out);
        if cos.abs() > 0.02 {
            rays.push(shadow_ray((p, floor[0]), (q, corners)));
            expected.push(u8::from(cos < 0.0));
        }
    }
    for (name, accel) in backends(&mesh) {
        let mut occluded = vec![2; rays.len()];
        accel.occluded(&batch(&rays), rays.len(), &mut occluded);
        let wrong = occluded.iter().zip(&expected).filter(|(a, b)| a != b).count();
        assert_eq!(wrong, 0, "{name}: of {} shadow rays", rays.len());
    }
}

#[test]
fn self04_turned_by_right_angles_rays_hit_the_same_at_the_same_distances() {
    let mut rng = Rng::new(4);
    let mesh = random_soup(500, 0.3, 1.0, Vec3::ZERO, &mut rng);
    let rays: Vec<Ray> = (0..5000).map(|_| (rng.cube() * 2.0, rng.direction(), INF)).collect();
    // Exact: components change places and signs.
    let turns: [fn(Vec3) -> Vec3; 4] = [
        |p| Vec3::new(p.z, p.y, -p.x),
        |p| Vec3::new(-p.y, p.x, p.z),
        |p| Vec3::new(p.x, -p.z, p.y),
        |p| Vec3::new(-p.x, -p.y, p.z),
    ];
    for turn in turns {
        let turned = Triangles {
            positions: mesh.positions.iter().map(|&p| turn(Vec3::from(p)).to_array()).collect(),
            indices: mesh.indices.clone(),
        };
        let turned_rays: Vec<Ray> = rays.iter().map(|&(o, d, end)| (turn(o), turn(d), end)).collect();
        let pairs: [(Box<dyn Accel>, Box<dyn Accel>); 2] = [
            (Box::new(Linear::new(&mesh)), Box::new(Linear::new(&turned))),
            (Box::new(WideBvh::build(&mesh)), Box::new(WideBvh::build(&turned))),
        ];
        for (straight, turned) in pairs {
            assert_eq!(trace(&*straight, &rays), trace(&*turned, &turned_rays), "{}", straight.stats().name);
        }
    }
}

#[test]
fn self04_scaled_by_powers_of_two_rays_hit_the_same() {
    let mut rng = Rng::new(44);
    let mesh = random_soup(500, 0.3, 1.0, Vec3::ZERO, &mut rng);
    let rays: Vec<Ray> = (0..5000).map(|_| (rng.cube() * 2.0, rng.direction(), INF)).collect();
    let expected = trace(&WideBvh::build(&mesh), &rays);
    for j in -20..=23 {
        let s = 2f32.powi(j);
        // Directions stay, so distances scale: a constant length anywhere would show.
        let scaled: Vec<Ray> = rays.iter().map(|&(o, d, end)| (o * s, d, end)).collect();
        let expected: Vec<_> = expected.iter().map(|&(primitive, t)| (primitive, t * s)).collect();
        let found = trace(&WideBvh::build(placed(&mesh, s, Vec3::ZERO)), &scaled);
        assert_eq!(found, expected, "scaled by 2^{j}");
    }
    // A turn by any angle rounds, so hits agree within bounds.
    let turn = Quat::from_axis_angle(Vec3::new(0.36, 0.48, 0.8), 1.0);
    let turned = Triangles {
        positions: mesh.positions.iter().map(|&p| (turn * Vec3::from(p)).to_array()).collect(),
        indices: mesh.indices.clone(),
    };
    let turned_rays: Vec<Ray> = rays.iter().map(|&(o, d, end)| (turn * o, turn * d, end)).collect();
    let found = trace(&WideBvh::build(&turned), &turned_rays);
    let differ = found.iter().zip(&expected).filter(|(a, b)| a.0 != b.0).count();
    assert!(differ <= 5, "{differ} of 5000 rays hit something else");
}
