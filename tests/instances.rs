//! Placing a mesh by an instance and writing its vertices where they end up is the same: INST-01, INST-02, INST-03 of
//! the numerics plan. Twice: for meshes that are merged into the world, and for those that are placed.

#[path = "support/prepared.rs"]
mod prepared;
#[path = "support/rng.rs"]
mod rng;

use glam::{DMat3, DMat4, DQuat, DVec3, Vec3};
use prepared::{Seen, backends, mesh, one_instance, prepared, prepared_as, read, scene, trace};
use prt::math::robust::gamma;
use prt::render::{AccelChoice, Choice, Prepared};
use prt::scene::{Scene, SceneBuilder};
use prt::shape::Mesh;
use rng::Rng;
use std::f64::consts::{PI, TAU};

const ROWS: usize = 28;
const COLUMNS: usize = 44;

/// A dented sphere of radius about 1 without its polar caps, so that both sides can be seen; smooth normals, which
/// like the winding point outwards.
fn dented_sphere() -> Mesh {
    let at = |row: usize, column: usize| {
        let theta = 0.5 + (PI - 1.0) * row as f64 / ROWS as f64;
        let phi = TAU * column as f64 / COLUMNS as f64;
        let radius = 1.0 + 0.15 * (3.0 * phi).sin() * (2.0 * theta).sin();
        radius * DVec3::new(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin())
    };
    let mut positions = Vec::new();
    let mut normals = Vec::new();
    for row in 0..=ROWS {
        for column in 0..COLUMNS {
            let p = at(row, column).as_vec3().to_array();
            positions.push(p);
            normals.push(p);
        }
    }
    let index = |row: usize, column: usize| (row * COLUMNS + column % COLUMNS) as u32;
    let mut indices = Vec::new();
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let (a, b) = (index(row, column), index(row, column + 1));
            let (c, d) = (index(row + 1, column), index(row + 1, column + 1));
            indices.extend([[a, c, d], [a, d, b]]);
        }
    }
    Mesh { normals: Some(normals), ..mesh(positions, indices) }
}

/// `mesh` with its vertices and normals where `world_from_object` puts them, in f64 and rounded once.
fn baked(mesh: &Mesh, world_from_object: DMat4) -> Mesh {
    let linear = DMat3::from_mat4(world_from_object);
    let normal_from_object = linear.inverse().transpose();
    let place = |p: &[f32; 3]| world_from_object.transform_point3(Vec3::from(*p).as_dvec3()).as_vec3().to_array();
    let turn = |n: &[f32; 3]| (normal_from_object * Vec3::from(*n).as_dvec3()).normalize().as_vec3().to_array();
    // A mirror turns a counter-clockwise triangle clockwise.
    let winding = |t: &[u32; 3]| if linear.determinant() < 0.0 { [t[0], t[2], t[1]] } else { *t };
    Mesh {
        positions: mesh.positions.iter().map(place).collect(),
        normals: mesh.normals.as_ref().map(|n| n.iter().map(turn).collect()),
        indices: mesh.indices.iter().map(winding).collect(),
        ..mesh.clone()
    }
}

/// What INST-01 names, and a translation.
fn transforms() -> Vec<(&'static str, DMat4)> {
    let turn = DQuat::from_rotation_y(0.8) * DQuat::from_rotation_x(-0.4);
    let trs = |s: DVec3, turn: DQuat| DMat4::from_scale_rotation_translation(s, turn, DVec3::new(1.5, -2.0, 0.75));
    let moved = DMat4::from_translation(DVec3::new(-0.7, 0.3, 2.1));
    let scale = |x, y, z| DMat4::from_scale(DVec3::new(x, y, z));
    let level = |k: f64| {
        let s = DVec3::new(1.0 + 0.1 * k, 0.9, 1.1 - 0.3 * k);
        DMat4::from_scale_rotation_translation(s, DQuat::from_rotation_z(k) * turn, DVec3::new(0.1, -k, 0.3))
    };
    vec![
        ("identity", DMat4::IDENTITY),
        ("uniform 0.57", trs(DVec3::splat(0.57), turn)),
        ("uniform 2.7", trs(DVec3::splat(2.7), turn)),
        ("(1, 2, 3)", trs(DVec3::new(1.0, 2.0, 3.0), turn)),
        ("(1e-3, 1, 1e3)", scale(1e-3, 1.0, 1e3)),
        ("mirrored in x", trs(DVec3::new(-1.0, 1.0, 1.0), turn)),
        ("mirrored in y", scale(1.0, -1.3, 1.0)),
        ("mirrored in z", scale(1.0, 1.0, -0.7)),
        ("mirrored in x and y", trs(DVec3::new(-1.0, -2.0, 1.0), turn)),
        ("mirrored in x, y and z", trs(DVec3::new(-1.0, -2.0, -0.5), turn)),
        ("sheared by its parents", scale(1.0, 3.0, 0.5) * DMat4::from_quat(turn) * scale(2.0, 0.4, 1.0)),
        ("sheared, mirrored and moved", moved * scale(1.0, -3.0, 0.5) * DMat4::from_quat(turn) * scale(2.0, 0.4, 1.0)),
        ("nearly singular (1, 1, 1e-6)", scale(1.0, 1.0, 1e-6)),
        ("five levels", (1..=5).map(|k| level(0.2 * f64::from(k))).product()),
    ]
}

/// Rays in world space, f64: most at points of the mesh from outside, a third past it or nearly so.
fn rays(mesh: &Mesh, world_from_object: DMat4, n: usize, rng: &mut Rng) -> Vec<(DVec3, DVec3)> {
    (0..n)
        .map(|i| {
            let target = if i % 3 == 0 {
                1.3 * rng.cube()
            } else {
                let [a, b, c] = mesh.indices[rng.below(mesh.indices.len())].map(|v| mesh.positions[v as usize]);
                let (u, v) = (rng.unit(), rng.unit());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                Vec3::from(a) + (Vec3::from(b) - Vec3::from(a)) * u + (Vec3::from(c) - Vec3::from(a)) * v
            };
            let d = rng.direction().as_dvec3();
            let origin = target.as_dvec3() - 4.0 * d;
            (world_from_object.transform_point3(origin), world_from_object.transform_vector3(d))
        })
        .collect()
}

/// Angle between two vectors, radians.
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

/// Largest differences between what rays see of two prepared scenes.
#[derive(Default, Debug)]
struct Differences {
    /// Hits of one and misses of the other.
    hits: usize,
    /// Same hit, another triangle (across an edge).
    neighbours: usize,
    /// Distance of one's point from the other's plane over the error bound.
    off_plane: f64,
    /// Distance of the points at the same place of the same triangle over the error bound.
    position: f64,
    /// Angle between the geometric normals of one triangle, radians.
    ng: f64,
    /// Angle between the shading normals at the same place, radians.
    ns: f64,
    /// Front for one and back for the other.
    sides: usize,
    /// Geometric normals that do not point outwards. (Shading normals may: a facet of a squashed dent. INST-02 has theirs.)
    inwards: usize,
    both: usize,
}

/// Between `mesh` placed by `placed` (`a`) and what is baked so (`b`).
fn differences(a: &Prepared, b: &Prepared, mesh: &Mesh, placed: DMat4, rays: &[(DVec3, DVec3)]) -> Differences {
    // A mirrored mesh that is merged or baked has its corners in another order.
    let swapped = !a.tables.placements.is_empty() && DMat3::from_mat4(placed).determinant() < 0.0;
    let normal_from_object = DMat3::from_mat4(placed).inverse().transpose();
    let outwards = |primitive: u32| {
        let [p, q, r] = mesh.indices[primitive as usize].map(|v| Vec3::from(mesh.positions[v as usize]).as_dvec3());
        normal_from_object * (q - p).cross(r - p)
    };
    let mut found = Differences::default();
    let bound = |seen: &Seen, at: &Prepared| {
        // Of the hit's own arithmetic, and of the vertices' one rounding in world space.
        let world = (seen.point + at.origin).abs().max_element();
        (seen.offset + f64::from(gamma(2)) * world, seen.bound + f64::from(gamma(2)) * world)
    };
    let hits_of_a = trace(a, rays);
    let place = |x: &Seen| if swapped { (x.primitive, x.v, x.u) } else { (x.primitive, x.u, x.v) };
    let places: Vec<_> = hits_of_a.iter().flatten().map(place).collect();
    for (x, y) in hits_of_a.iter().flatten().zip(read(b, &places)) {
        let apart = (x.point + a.origin) - (y.point + b.origin);
        found.position = found.position.max((apart.abs() / (bound(x, a).1 + bound(&y, b).1)).max_element());
        found.ns = found.ns.max(angle(x.ns, y.ns));
    }
    for ((x, y), (_, d)) in hits_of_a.into_iter().zip(trace(b, rays)).zip(rays) {
        let (Some(x), Some(y)) = (&x, &y) else {
            found.hits += usize::from(x.is_some() != y.is_some());
            continue;
        };
        found.both += 1;
        let apart = (x.point + a.origin) - (y.point + b.origin);
        if x.primitive == y.primitive {
            found.off_plane = found.off_plane.max(apart.dot(y.ng).abs() / (bound(x, a).0 + bound(y, b).0));
            found.ng = found.ng.max(angle(x.ng, y.ng));
            found.sides += usize::from((d.dot(x.ng) < 0.0) != (d.dot(y.ng) < 0.0));
        } else {
            found.neighbours += 1;
        }
        for (seen, n) in [(x, outwards(x.primitive)), (y, outwards(y.primitive))] {
            found.inwards += usize::from(seen.ng.dot(n) <= 0.0);
            found.sides += usize::from((d.dot(seen.ng) < 0.0) != (d.dot(n) < 0.0) && angle(*d, n) - 0.5 * PI > 1e-5);
        }
    }
    found
}

// 1e5 rays a transform from seed 1; the limits are the plan's.
#[test]
fn inst_01_an_instance_is_its_baked_mesh() {
    let mesh = dented_sphere();
    const RAYS: usize = 100_000;
    for (name, placed) in transforms() {
        let rays = rays(&mesh, placed, RAYS, &mut Rng::new(1));
        let (instance, flat) = (one_instance(&mesh, placed), one_instance(&baked(&mesh, placed), DMat4::IDENTITY));
        let (a, b) = (prepared(&instance), prepared(&flat));
        assert_eq!((a.tables.triangles.len(), b.tables.triangles.len()), (mesh.indices.len(), mesh.indices.len()));
        let found = differences(&a, &b, &mesh, placed, &rays);
        println!("{name}: {found:?}");
        assert!(found.both > RAYS / 2, "{name}: {found:?}");
        // 1e-5 of the rays.
        assert!(found.hits <= RAYS / 100_000 && found.neighbours <= RAYS / 10_000, "{name}: {found:?}");
        assert!(
            found.off_plane <= 1.0 && found.position <= 1.0 && found.ng <= 1e-5 && found.ns <= 1e-5,
            "{name}: {found:?}"
        );
        assert_eq!((found.sides, found.inwards), (0, 0), "{name}: {found:?}");
    }
}

// 1e5 rays a transform from seed 1, 2000 by brute force; the limits are the plan's.
#[test]
fn inst_01_a_placed_mesh_is_its_baked_mesh() {
    let mesh = dented_sphere();
    for (name, placed) in transforms() {
        let instance = one_instance(&mesh, placed);
        let baked = one_instance(&baked(&mesh, placed), DMat4::IDENTITY);
        for accel in backends() {
            let n = if accel == AccelChoice::Linear { 2000 } else { 100_000 };
            let rays = rays(&mesh, placed, n, &mut Rng::new(1));
            let (a, b) = (prepared_as(&instance, accel, Choice::Always), prepared_as(&baked, accel, Choice::Never));
            // What would lose digits when placed is merged, and tested above.
            let is_extreme = ["(1e-3, 1, 1e3)", "nearly singular (1, 1, 1e-6)"].contains(&name);
            let expected = if is_extreme { (0, 0) } else { (1, 0) };
            assert_eq!((a.tables.placements.len(), b.tables.placements.len()), expected, "{name}");
            assert_eq!(a.tables.triangles.len(), mesh.indices.len());
            let found = differences(&a, &b, &mesh, placed, &rays);
            println!("{name}, {accel:?}: {found:?}");
            assert!(found.both > n / 2, "{name}, {accel:?}: {found:?}");
            assert!(found.hits <= n / 100_000 && found.neighbours <= n / 10_000, "{name}, {accel:?}: {found:?}");
            assert!(found.off_plane <= 1.0 && found.position <= 1.0, "{name}, {accel:?}: {found:?}");
            assert!(found.ng <= 1e-5 && found.ns <= 1e-5, "{name}, {accel:?}: {found:?}");
            assert_eq!((found.sides, found.inwards), (0, 0), "{name}, {accel:?}: {found:?}");
        }
    }
}

/// A random rotation or reflection.
fn orthogonal(rng: &mut Rng) -> DMat3 {
    let q = DMat3::from_quat(
        DQuat::from_array(std::array::from_fn::<f64, 4, _>(|_| f64::from(rng.range(-1.0, 1.0)))).normalize(),
    );
    if rng.unit() < 0.5 { q } else { q * DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)) }
}

/// One scene of an equilateral triangle placed by each of `placed`, with another normal each.
fn triangles(placed: &[DMat3], rng: &mut Rng) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(prt::material::Material::default());
    for linear in placed {
        let turn = orthogonal(rng);
        let corners = [0.0, TAU / 3.0, 2.0 * TAU / 3.0].map(|a: f64| turn * DVec3::new(a.cos(), a.sin(), 0.0));
        let normals = corners.map(|_| rng.direction().to_array()).to_vec();
        let positions = corners.map(|c| c.as_vec3().to_array()).to_vec();
        let mesh = Mesh { normals: Some(normals), material, ..mesh(positions, vec![[0, 1, 2]]) };
        let mesh = builder.add_mesh(mesh);
        let world_from_object = DMat4::from_mat3(*linear);
        builder.add_instance(prt::scene::Instance { mesh, world_from_object, name: String::from("triangle") });
    }
    builder.finish()
}

// 1000 matrices of each condition number and scale, seed 2.
#[test]
fn inst_02_normals_go_by_the_inverse_transpose_at_every_condition_and_scale() {
    let mut rng = Rng::new(2);
    for scale in [1.0, 1e-20, 1e-13, 1e13] {
        for cond in [1.0_f64, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6] {
            let placed: Vec<DMat3> = (0..1000)
                .map(|_| {
                    let middle = f64::from(rng.unit());
                    let stretch = DVec3::new(1.0, cond.powf(-middle), 1.0 / cond);
                    orthogonal(&mut rng) * DMat3::from_diagonal(scale * stretch) * orthogonal(&mut rng)
                })
                .collect();
            let scene = triangles(&placed, &mut rng);
            let ready = prepared(&scene);
            let n = placed.len();
            assert_eq!(ready.tables.triangles.len(), n, "{scale:e}, condition {cond:e}: {:?}", ready.warnings);
            // The first corner, whose normal is stored and not interpolated.
            let seen = read(&ready, &(0..n as u32).map(|i| (i, 0.0, 0.0)).collect::<Vec<_>>());
            let (mut worst_ns, mut worst_ng): (f64, f64) = (0.0, 0.0);
            for ((seen, linear), mesh) in seen.iter().zip(&placed).zip(&scene.meshes) {
                let normal_from_object = (*linear * (1.0 / scale)).inverse().transpose();
                let normals = [0, 1, 2].map(|i| Vec3::from(mesh.normals.as_ref().unwrap()[i]).as_dvec3());
                let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(mesh.positions[i]).as_dvec3());
                let ng = normal_from_object * (b - a).cross(c - a);
                // Normals that all point to the back are turned to the front.
                let world = normals.map(|n| normal_from_object * n);
                let turns = world.iter().all(|n| n.dot(seen.ng) < 0.0);
                let n = if turns { -world[0] } else { world[0] };
                assert!((seen.ns.length() - 1.0).abs() < 1e-6 && (seen.ng.length() - 1.0).abs() < 1e-6);
                worst_ns = worst_ns.max(angle(seen.ns, n));
                worst_ng = worst_ng.max(angle(seen.ng, ng));
            }
            println!("scale {scale:e}, condition {cond:e}: shading {worst_ns:e}, geometric {worst_ng:e} rad");
            assert!(worst_ns <= 4e-7, "{scale:e}, condition {cond:e}: {worst_ns:e} rad");
            // The corners' rounding to f32 turns a squashed triangle.
            assert!(worst_ng <= 4e-7 * cond, "{scale:e}, condition {cond:e}: {worst_ng:e} rad");
        }
    }
}

#[test]
fn inst_02_a_mesh_squashed_to_a_plane_is_flat_and_one_squashed_further_is_dropped_and_counted() {
    let sphere = dented_sphere();
    let all = sphere.indices.len();
    for (squash, left) in [
        (DVec3::new(1.0, 0.0, 1.0), Some(DVec3::Y)),
        (DVec3::new(0.0, -2.0, 1.0), Some(DVec3::X)),
        (DVec3::new(0.0, 1.0, 0.0), None),
        (DVec3::ZERO, None),
    ] {
        let scene = one_instance(&sphere, DMat4::from_scale(squash));
        let ready = prepared(&scene);
        let kept = ready.tables.triangles.len();
        let Some(normal) = left else {
            assert_eq!(kept, 0, "{squash}");
            assert!(scene.warnings.iter().any(|w| w.starts_with("1 instances dropped")), "{:?}", scene.warnings);
            continue;
        };
        assert!(kept > all / 2 && kept <= all, "{squash}: {kept} of {all}");
        let said = ready.warnings.iter().any(|w| w.starts_with(&format!("{} triangles have no area", all - kept)));
        assert!(said || kept == all, "{:?}", ready.warnings);
        for seen in read(&ready, &(0..kept as u32).map(|i| (i, 0.2, 0.3)).collect::<Vec<_>>()) {
            assert!(seen.point.is_finite() && seen.ns.is_finite());
            assert!((seen.ng.dot(normal).abs() - 1.0).abs() < 1e-6, "{squash}: {}", seen.ng);
        }
        // Every ray's hit agrees with the plane it was squashed to.
        let rays = rays(&sphere, DMat4::IDENTITY, 1000, &mut Rng::new(3));
        let hits: Vec<_> = trace(&ready, &rays).into_iter().flatten().collect();
        assert!(hits.len() > 100 && hits.iter().all(|s| (s.point + ready.origin).dot(normal).abs() < 1e-6));
    }
}

#[test]
fn inst_02_tiny_and_huge_placements_are_seen_and_face_the_right_way() {
    let sphere = dented_sphere();
    // Sizes whose squares and cubes leave f32, and whose cubes leave f64 in the determinant.
    for scale in [1e-13, -1e-13, 1e-7, 1e7, 1e13] {
        let placed = DMat4::from_scale(DVec3::splat(scale));
        let rays = rays(&sphere, placed, 3000, &mut Rng::new(4));
        let (a, b) = (
            prepared(&one_instance(&sphere, placed)),
            prepared(&one_instance(&baked(&sphere, placed), DMat4::IDENTITY)),
        );
        let found = differences(&a, &b, &sphere, placed, &rays);
        assert!(found.both > 1500 && found.hits == 0 && found.sides == 0 && found.inwards == 0, "{scale:e}: {found:?}");
    }
    // A chain of small scales: the determinant is below the least f64.
    let chain = DMat4::from_scale(DVec3::splat(-1e-120));
    let ready = prepared(&one_instance(&sphere, chain * DMat4::from_scale(DVec3::splat(1e105))));
    let seen = read(&ready, &[(7, 0.2, 0.3)]);
    assert!(seen[0].ng.dot(seen[0].ns) > 0.9, "a mirrored mesh's sides agree with its normals: {:?}", seen[0]);
}

// 1e6 points from seed 5.
#[test]
fn inst_03_points_lie_within_their_bound_of_where_f64_has_them() {
    let mut rng = Rng::new(5);
    const PLACEMENTS: usize = 50;
    const TRIANGLES: usize = 200;
    const POINTS: usize = 100;
    let (mut worst, mut outside): (f64, usize) = (0.0, 0);
    for _ in 0..PLACEMENTS {
        let shear = DMat3::from_cols(rng.cube().as_dvec3(), rng.cube().as_dvec3(), rng.cube().as_dvec3());
        let size = 10f64.powf(f64::from(rng.range(-6.0, 6.0)));
        let mut placed = DMat4::from_mat3(shear * size);
        placed.w_axis = (rng.cube().as_dvec3() * size * 10f64.powf(f64::from(rng.range(-2.0, 6.0)))).extend(1.0);
        let corners: Vec<[f32; 3]> = (0..3 * TRIANGLES).map(|_| rng.cube().to_array()).collect();
        let indices = (0..TRIANGLES as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = mesh(corners, indices);
        let ready = prepared(&one_instance(&mesh, placed));
        assert_eq!(ready.tables.triangles.len(), TRIANGLES);
        let mirrors = DMat3::from_mat4(placed).determinant() < 0.0;
        let items: Vec<(u32, f32, f32)> = (0..TRIANGLES * POINTS)
            .map(|i| {
                let (u, v) = (rng.unit(), rng.unit());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                ((i / POINTS) as u32, u, v)
            })
            .collect();
        for (seen, &(i, u, v)) in read(&ready, &items).iter().zip(&items) {
            let [a, b, c] = mesh.indices[i as usize].map(|k| {
                let p = Vec3::from(mesh.positions[k as usize]).as_dvec3();
                placed.transform_point3(p) - ready.origin
            });
            let (b, c) = if mirrors { (c, b) } else { (b, c) };
            let exact = a + (b - a) * f64::from(u) + (c - a) * f64::from(v);
            // The length by which a ray's origin is moved along the normal must be more than the error along it.
            let used = (seen.point - exact).dot(seen.ng).abs() / seen.offset;
            let bound = f64::from(gamma(16)) * a.abs().max(b.abs()).max(c.abs()).max_element();
            worst = worst.max(used).max((seen.point - exact).abs().max_element() / bound);
            outside += usize::from(used > 1.0);
        }
    }
    println!("largest error over its bound: {worst}");
    assert_eq!(outside, 0);
    assert!(worst < 0.5, "{worst}");
}

#[test]
fn a_mirrored_pair_of_one_mesh_is_in_one_scene() {
    // One mesh, shared by a plain and a mirrored instance: the second must not change the first.
    let sphere = dented_sphere();
    let places = [
        DMat4::from_translation(DVec3::X * -2.0),
        DMat4::from_translation(DVec3::X * 2.0) * DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)),
    ];
    let both = prepared(&scene(&sphere, &places));
    let all = sphere.indices.len();
    assert_eq!(both.tables.triangles.len(), 2 * all);
    let seen = read(&both, &(0..2 * all as u32).map(|i| (i, 0.3, 0.3)).collect::<Vec<_>>());
    for (k, seen) in seen.iter().enumerate() {
        let centre = DVec3::X * if k < all { -2.0 } else { 2.0 };
        let outwards = seen.point + both.origin - centre;
        assert!(seen.ng.dot(outwards) > 0.0 && seen.ns.dot(outwards) > 0.0, "triangle {k}");
    }
}
