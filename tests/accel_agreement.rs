//! All backends find the same hits: watertight meshes, exact edges, degenerate trees, rays that are no rays.
//!
//! Test names carry the IDs of the stress-test catalogue. Seeds are fixed.

#[path = "support/fronts.rs"]
mod fronts;
#[path = "support/meshes.rs"]
mod meshes;
#[path = "support/rng.rs"]
mod rng;

use glam::{DVec3, Vec3};
use meshes::{batch, grid, placed, random_soup, slivers, soup, sphere};
use prt::accel::linear::Linear;
use prt::accel::wide::{SpatialSplits, WideBvh};
use prt::accel::{Accel, HitBatch, MISS, Triangles};
use rng::Rng;
use simd::Level;

const INF: f32 = f32::INFINITY;
type Ray = (Vec3, Vec3, f32);

/// Every backend that runs here, the oracle first.
fn backends(triangles: &Triangles) -> Vec<(&'static str, Box<dyn Accel>)> {
    let mut all: Vec<(&'static str, Box<dyn Accel>)> = vec![("linear", Box::new(Linear::new(triangles.clone())))];
    all.extend(fast_backends(triangles));
    all
}

/// Those that need not look at every triangle.
fn fast_backends(triangles: &Triangles) -> Vec<(&'static str, Box<dyn Accel>)> {
    let levels = [Level::Portable8, Level::Scalar, Level::Avx2, Level::Avx512];
    let mut all: Vec<(&'static str, Box<dyn Accel>)> = Vec::new();
    for level in levels.into_iter().filter(|level| level.is_available()) {
        let bvh = WideBvh::with_level(triangles, level);
        bvh.validate(triangles).expect("a sound tree");
        all.push((level.name(), Box::new(bvh)));
        if let Some(front) = fronts::front(triangles, level) {
            let name = ["front scalar", "front portable", "front avx2", "front avx512"][level as usize];
            all.push((name, Box::new(front)));
        }
    }
    let split = WideBvh::with_splits(triangles, Level::best(), SpatialSplits::Always);
    split.validate(triangles).expect("a sound tree");
    all.push(("with splits", Box::new(split)));
    all.push(("interleaved", Box::new(WideBvh::build(triangles).interleaved())));
    all
}

/// Nearest hits as (primitive, t, u, v) by bits, after checking that `occluded` says the same about every ray.
fn trace(name: &str, accel: &dyn Accel, rays: &[Ray]) -> Vec<(u32, [u32; 3])> {
    let rays_in = batch(rays);
    let mut hits = HitBatch::new(rays.len());
    let mut occluded = vec![2; rays.len()];
    accel.intersect(&rays_in, 0..rays.len(), false, &mut hits);
    accel.occluded(&rays_in, rays.len(), &mut occluded);
    // Camera rays may be traced in another way, to the same hits.
    let mut coherent = HitBatch::new(rays.len());
    accel.intersect(&rays_in, 0..rays.len(), true, &mut coherent);
    for (i, ray) in rays.iter().enumerate() {
        let bits = |hits: &HitBatch| (hits.primitive[i], [hits.t[i], hits.u[i], hits.v[i]].map(f32::to_bits));
        assert_eq!(bits(&coherent), bits(&hits), "{name}: the coherent hint changes the hit of {ray:?}");
    }
    (0..rays.len())
        .map(|i| {
            let hit = hits.primitive[i] != MISS;
            assert_eq!(occluded[i], u8::from(hit), "{name}: occluded and intersect disagree about {:?}", rays[i]);
            if !hit {
                assert_eq!(hits.t[i].to_bits(), rays[i].2.to_bits(), "{name}: t of a miss is t_max");
            }
            (hits.primitive[i], [hits.t[i], hits.u[i], hits.v[i]].map(f32::to_bits))
        })
        .collect()
}

/// The hits of the first backend, after checking that all others find the same bits.
fn agreed(backends: &[(&str, Box<dyn Accel>)], rays: &[Ray]) -> Vec<(u32, [u32; 3])> {
    let (first, others) = backends.split_first().expect("a backend");
    let expected = trace(first.0, &*first.1, rays);
    for (name, accel) in others {
        for (i, (found, expected)) in trace(name, &**accel, rays).iter().zip(&expected).enumerate() {
            assert_eq!(found, expected, "{name} against {}: {:?}", first.0, rays[i]);
        }
    }
    expected
}

fn assert_all_hit(what: &str, backends: &[(&str, Box<dyn Accel>)], rays: &[Ray]) {
    let missed = agreed(backends, rays).iter().filter(|hit| hit.0 == MISS).count();
    assert_eq!(missed, 0, "{what}: {missed} of {} rays leaked", rays.len());
}

/// pbrt's three rays: anywhere, at a vertex, at a point of an edge, from `origin`.
fn leak_rays(mesh: &Triangles, origin: Vec3, rng: &mut Rng) -> impl Iterator<Item = Ray> {
    let corners = mesh.corners(rng.below(mesh.indices.len()));
    let k = rng.below(3);
    let edge = corners[k] + (corners[(k + 1) % 3] - corners[k]) * rng.unit();
    let directions = [rng.direction(), corners[rng.below(3)] - origin, edge - origin];
    directions.into_iter().filter(|&d| d != Vec3::ZERO).map(move |d| (origin, d, INF))
}

const FAR: Vec3 = Vec3::new(148_376.0, 1234.0, -223_423.0);

#[test]
fn geo01_no_ray_leaves_a_closed_mesh() {
    let mut rng = Rng::new(12111);
    let bumpy = sphere(16, 16, || 1.0 + 5.0 * rng.unit());
    for s in [1e-6, 1.0, 1e6] {
        for shift in [Vec3::ZERO, FAR] {
            let mesh = placed(&bumpy, s, shift * s);
            let mut rays = Vec::new();
            while rays.len() < 9000 {
                let origin = rng.direction() * 0.5 * s + shift * s;
                rays.extend(leak_rays(&mesh, origin, &mut rng));
            }
            assert_all_hit(&format!("s {s}, T {shift}"), &backends(&mesh), &rays);
        }
    }
}

#[test]
fn geo01_no_ray_leaves_a_fine_sphere() {
    let mesh = sphere(100, 200, || 2.0);
    for shift in [Vec3::ZERO, FAR] {
        let mesh = placed(&mesh, 1.0, shift);
        let mut rng = Rng::new(6557);
        let mut rays = Vec::new();
        while rays.len() < 150_000 {
            rays.extend(leak_rays(&mesh, rng.direction() * 0.5 + shift, &mut rng));
        }
        // At the far position the mesh is rounded to 1/64 m: vertices coincide, but it stays closed.
        assert_all_hit(&format!("T {shift}"), &fast_backends(&mesh), &rays);
    }
}

#[test]
fn geo01_no_ray_passes_a_grid() {
    let mesh = grid(12, -3.0);
    let mut rng = Rng::new(12);
    let mut rays = Vec::new();
    while rays.len() < 30_000 {
        let origin = Vec3::new(rng.range(-3.0, 9.0), rng.range(-3.0, 9.0), rng.range(0.01, 6.0));
        rays.extend(leak_rays(&mesh, origin, &mut rng).skip(1).filter(|ray| {
            // The rim belongs to no second triangle.
            let p = ray.0 + ray.1;
            p.truncate().min_element() > -2.99 && p.truncate().max_element() < 8.99
        }));
    }
    assert_all_hit("grid", &backends(&mesh), &rays);
}

#[test]
fn geo02_ray_on_the_diagonal_of_a_quad_hits() {
    let [a, b, c, d] = [(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
    let quad = soup([[a, b, c], [a, c, d]]);
    let down = Vec3::new(0.304_584_47, 0.304_584_47, -0.902_472_5);
    assert_all_hit("diagonal", &backends(&quad), &[(Vec3::new(0.0, 0.0, 10.0), down, INF)]);
}

#[test]
fn geo02_rays_at_the_middle_of_a_turned_quad_hit() {
    // 90 degrees about (1, 1, 1).
    let turn = glam::Quat::from_axis_angle(Vec3::ONE.normalize(), std::f32::consts::FRAC_PI_2);
    let [a, b, c, d] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| turn * Vec3::new(x, y, 0.0));
    let quad = soup([[a, b, c], [c, d, a]]);
    let target = turn * Vec3::new(0.5, 0.5, 0.0);
    let mut rays = Vec::new();
    for i in 0..32 * 32 {
        let (u, v) = ((i % 32) as f32 / 32.0 + 1.0 / 64.0, (i / 32) as f32 / 32.0 + 1.0 / 64.0);
        let (r, phi) = (u.sqrt(), std::f32::consts::TAU * v);
        let d = turn * Vec3::new(r * phi.cos(), r * phi.sin(), (1.0 - u).sqrt());
        rays.push((target - d * 2.0, d, INF));
    }
    assert_all_hit("turned quad", &backends(&quad), &rays);
}

#[test]
fn geo02_vulkan_shared_edges_hit() {
    let bits = |x: u32, y: u32, z: u32| Vec3::from([x, y, z].map(f32::from_bits));
    let (p, q) = (Vec3::new(1.0, 0.0, -1.0), Vec3::new(0.0, 1.0, -1.0));
    let pair = soup([
        [p, q, bits(0x3ec8_3ac8, 0x3f1b_e29d, 0xbed7_9c23)],
        [q, p, bits(0x3e8f_7a0c, 0x3f35_3a70, 0xbf4f_ab47)],
    ]);
    let origin = Vec3::new(f32::from_bits(0x3f70_8000), f32::from_bits(0x3d78_0000), 0.0);
    assert_all_hit("shared edge", &backends(&pair), &[(origin, Vec3::NEG_Z, INF)]);
}

#[test]
fn geo03_no_hit_lies_outside_its_triangle() {
    let mut rng = Rng::new(387);
    let mut hits_seen = 0;
    for case in 0..3000 {
        // Edges 11.2, 9.7 and 1.4 or ever thinner, seen at 0.5 degrees.
        let thinness = case % 7;
        let width = 1.4 * 10f32.powi(-thinness);
        let (along, side) = (rng.direction(), rng.direction());
        let side = (side - along * side.dot(along)).normalize();
        let a = rng.cube() * 300.0;
        let corners = [a, a + along * 11.2, a + along * 9.7 + side * width];
        let mesh = soup([corners]);
        let normal = along.cross(side);
        let rays: Vec<Ray> = (0..20)
            .map(|_| {
                let (b, c) = (rng.unit(), rng.unit());
                let p = corners[0] + (corners[1] - corners[0]) * b + (corners[2] - corners[0]) * c * (1.0 - b);
                let phi = rng.range(0.0, std::f32::consts::TAU);
                let d = (along * phi.cos() + side * phi.sin()) + normal * 0.5f32.to_radians().sin();
                (p - d * rng.range(1.0, 600.0), d, INF)
            })
            .collect();
        for (hit, &(o, d, _)) in agreed(&backends(&mesh), &rays).into_iter().zip(&rays) {
            if hit.0 == MISS {
                continue;
            }
            hits_seen += 1;
            let [t, u, v] = hit.1.map(f32::from_bits);
            assert!((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v), "{u} {v}");
            // Along the direction's largest axis t lies within the triangle; that bounds it whatever its shape.
            let k = d.abs().max_position();
            let ts = corners.map(|p| (f64::from(p[k]) - f64::from(o[k])) / f64::from(d[k]));
            let (low, high) = (ts[0].min(ts[1]).min(ts[2]), ts[0].max(ts[1]).max(ts[2]));
            let slack = 64.0 * 2f64.powi(-24) * f64::from(o.length() + t * d.length());
            assert!(low - slack <= t.into() && f64::from(t) <= high + slack, "t {t} not in {low}..{high}");
            // And the point on the ray is the point on the triangle: not for the thinner ones, where the rounding of
            // vertex - origin alone moves the weights by more than the bound (0.02 m at a width of 1.4e-5).
            if thinness > 1 {
                continue;
            }
            let [p, q, r] = corners.map(Vec3::as_dvec3);
            let on_triangle = p + (q - p) * f64::from(u) + (r - p) * f64::from(v);
            let error = (o.as_dvec3() + d.as_dvec3() * f64::from(t) - on_triangle).length();
            let bound = f64::from(o.length() + t * d.length() + corners[0].abs().max_element() + 12.0);
            assert!(error <= 64.0 * 2f64.powi(-24) * bound, "point error {error}, {corners:?} {o} {d}");
        }
    }
    assert!(hits_seen > 10_000, "{hits_seen}");
}

#[test]
fn geo03_bad_case_of_pbrt_misses() {
    let x = -1_113.454_6;
    let z = -56.243_19;
    let triangle = soup([[Vec3::new(x, -79.049_614, z), Vec3::new(x, -87.092_27, z), Vec3::new(x, -79.209_015, z)]]);
    let o = Vec3::new(-1_081.479_2, 99.999_954, 87.770_11);
    let d = Vec3::new(-32.107_3, -183.355_87, -144.607_64);
    assert_eq!(agreed(&backends(&triangle), &[(o, d, 0.9999)])[0].0, MISS);
}

#[test]
fn geo06_rays_that_are_no_rays_miss_and_end() {
    let mut rng = Rng::new(6);
    let mesh = random_soup(300, 0.3, 1.0, Vec3::ZERO, &mut rng);
    let backends = backends(&mesh);
    let mut bad = Vec::new();
    for value in [f32::NAN, INF, -INF] {
        for axis in 0..3 {
            let mut v = Vec3::new(0.1, 0.2, 0.3);
            v[axis] = value;
            bad.push((v, Vec3::ONE, INF));
            bad.push((Vec3::ZERO, v, INF));
        }
    }
    bad.push((Vec3::ZERO, Vec3::ZERO, INF));
    bad.push((Vec3::ZERO, Vec3::new(-0.0, 0.0, -0.0), INF));
    bad.extend([f32::NAN, 0.0, -0.0, -1.0, -INF].map(|t_max| (Vec3::splat(-3.0), Vec3::ONE, t_max)));
    assert!(agreed(&backends, &bad).iter().all(|hit| hit.0 == MISS));
    // Strange but legal: tiny, huge and axis-parallel ones agree, and nothing panics or hangs.
    let mut odd = Vec::new();
    for _ in 0..2000 {
        let component = |rng: &mut Rng| match rng.below(8) {
            0 => 0.0,
            1 => -0.0,
            2 => 10f32.powf(rng.range(-38.0, 38.0)),
            3 => -(10f32.powf(rng.range(-38.0, 38.0))),
            _ => rng.range(-2.0, 2.0),
        };
        let v = |rng: &mut Rng| Vec3::new(component(rng), component(rng), component(rng));
        odd.push((v(&mut rng), v(&mut rng), if rng.below(2) == 0 { INF } else { rng.range(0.0, 2.0) }));
    }
    agreed(&backends, &odd);
}

#[test]
fn geo06_garbage_triangles_end() {
    // Finite and below the limit, as the contract demands, but of any exponent.
    for seed in 0..200 {
        let mut rng = Rng::new(seed * 23565);
        let number = |rng: &mut Rng| {
            let x = f32::from_bits(rng.bits());
            if x.abs() < 1.844e18 { x } else { 0.0 }
        };
        let corner = |rng: &mut Rng| Vec3::new(number(rng), number(rng), number(rng));
        let mesh = soup((0..256).map(|_| [0; 3].map(|_| corner(&mut rng))));
        for (name, accel) in fast_backends(&mesh) {
            let rays: Vec<Ray> = (0..64).map(|_| (corner(&mut rng), corner(&mut rng), INF)).collect();
            trace(name, &*accel, &rays);
        }
    }
}

#[test]
fn geo07_grazing_rays_hit_exactly_where_they_must() {
    // A square in the plane z = 0 seen at ever flatter angles; the forced cases are far from its rim.
    let [a, b, c, d] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
    let backends = backends(&soup([[a, b, c], [a, c, d]]));
    let mut rng = Rng::new(7);
    for k in 1..=8 {
        for _ in 0..500 {
            let phi = rng.range(0.0, std::f32::consts::TAU);
            let along = Vec3::new(phi.cos(), phi.sin(), 0.0);
            let p = Vec3::new(rng.range(-2.0, 2.0), rng.range(-2.0, 2.0), 0.0);
            let ray = (p - along * 4.0 + Vec3::Z * 4.0 * 10f32.powi(-k), along - Vec3::Z * 10f32.powi(-k), INF);
            let hit = agreed(&backends, &[ray])[0];
            // Where it really meets the plane, and how far that is certain.
            let (o, dir): (DVec3, DVec3) = (ray.0.as_dvec3(), ray.1.as_dvec3());
            let at = o - dir * (o.z / dir.z);
            let rim = at.x.abs().max(at.y.abs()) - 1.0;
            if rim.abs() > 1e-5 {
                assert_eq!(hit.0 != MISS, rim < 0.0, "10^-{k}: {ray:?} meets {at}");
            }
        }
    }
}

#[test]
fn geo07_rays_in_the_plane_of_a_triangle_are_finite() {
    let mut rng = Rng::new(77);
    for _ in 0..2000 {
        let corners = [rng.cube(), rng.cube(), rng.cube()];
        let inside = (corners[0] + corners[1] + corners[2]) / 3.0;
        let d = corners[0] - corners[1] + (corners[2] - corners[1]) * rng.unit();
        let rays = [(inside - d * 3.0, d, INF), (corners[0] - d, d, INF), (corners[1] * 2.0 - corners[0], d, INF)];
        for hit in agreed(&backends(&soup([corners])), &rays) {
            assert!(hit.0 == MISS || hit.1.iter().all(|&x| f32::from_bits(x).is_finite()));
        }
    }
}

#[test]
fn geo05_meshes_with_and_without_degenerate_triangles_agree() {
    let mut rng = Rng::new(55);
    let clean = random_soup(1000, 0.3, 1.0, Vec3::ZERO, &mut rng);
    let mut mixed = clean.clone();
    for i in 0..100 {
        // Exactly representable, so that the collinear ones are.
        let a = (rng.cube() * 1024.0).round() / 1024.0;
        let d = (rng.cube() * 64.0).round() / 1024.0;
        let corners = [[a, a, a], [a, a, a + d], [a, a + d, a], [a, a + d, a + d * 2.0]][i % 4];
        let first = mixed.positions.len() as u32;
        mixed.positions.extend(corners.map(|p| p.to_array()));
        mixed.indices.push([first, first + 1, first + 2]);
    }
    let mut rays = random_rays(10_000, 1.0, Vec3::ZERO, &mut rng);
    // At the degenerate ones too.
    rays.extend((3000..mixed.positions.len()).map(|i| (Vec3::splat(3.0), Vec3::from(mixed.positions[i]) - 3.0, INF)));
    assert_eq!(agreed(&backends(&clean), &rays), agreed(&backends(&mixed), &rays));
}

#[test]
fn geo05_collinear_triangles_leave_no_gap_in_a_closed_mesh() {
    // Rounded to 1/64 m, about a hundred triangles of this sphere have three different corners on a line.
    let mesh = placed(&sphere(100, 200, || 2.0), 1.0, FAR);
    let is_collinear = |&i: &usize| {
        let [a, b, c] = mesh.corners(i);
        a != b && b != c && c != a && (b - a).as_dvec3().cross((c - a).as_dvec3()) == DVec3::ZERO
    };
    let collinear: Vec<usize> = (0..mesh.indices.len()).filter(is_collinear).collect();
    assert!(collinear.len() > 50, "{}", collinear.len());
    let mut rng = Rng::new(1);
    let mut rays = Vec::new();
    for _ in 0..30_000 {
        let corners = mesh.corners(collinear[rng.below(collinear.len())]);
        let (origin, k) = (rng.direction() * 0.5 + FAR, rng.below(3));
        rays.push((origin, corners[k] - origin, INF));
        rays.push((origin, corners[k] + (corners[(k + 1) % 3] - corners[k]) * rng.unit() - origin, INF));
    }
    assert_all_hit("collinear", &fast_backends(&mesh), &rays);
}

/// Rays from around and inside of the unit cube, half of them of limited length.
fn random_rays(n: usize, s: f32, shift: Vec3, rng: &mut Rng) -> Vec<Ray> {
    (0..n)
        .map(|i| {
            let origin = rng.cube() * if i % 2 == 0 { 1.0 } else { 4.0 };
            let d = if i % 3 == 0 { rng.direction() } else { rng.cube() - origin };
            let t_max = if i % 4 < 2 { INF } else { rng.range(0.0, 1.0) * s };
            (origin * s + shift, d, t_max)
        })
        .collect()
}

#[test]
fn bvh01_backends_agree_on_random_meshes() {
    let mut rng = Rng::new(1);
    for (s, shift) in [(1.0, Vec3::ZERO), (1e-6, Vec3::ZERO), (1e6, Vec3::ZERO), (1.0, Vec3::new(1e4, 3e3, -7e3))] {
        for size in [0.02, 0.3, 2.0] {
            let mesh = random_soup(600, size, s, shift, &mut rng);
            agreed(&backends(&mesh), &random_rays(8000, s, shift, &mut rng));
        }
    }
    for width in [1e-1, 1e-3, 1e-5] {
        agreed(&backends(&slivers(600, width, &mut rng)), &random_rays(8000, 1.0, Vec3::ZERO, &mut rng));
    }
}

#[test]
fn bvh01_avx2_and_portable_give_the_same_bits_on_a_large_mesh() {
    let mut rng = Rng::new(11);
    let mesh = sphere(150, 300, || 0.8 + 0.1 * rng.unit());
    agreed(&fast_backends(&mesh), &random_rays(100_000, 1.0, Vec3::ZERO, &mut Rng::new(12)));
}

#[test]
fn bvh02_rays_in_flat_boxes_agree() {
    // Planes at x, y and z = const through lattice points, rays that start on them, run in them and along their edges.
    let mut rng = Rng::new(2);
    let lattice = |rng: &mut Rng| rng.below(5) as f32 - 2.0;
    let flat = (0..400).map(|i| {
        let (axis, at) = (i % 3, lattice(&mut rng));
        [0; 3].map(|_| {
            let mut p = Vec3::new(lattice(&mut rng), lattice(&mut rng), lattice(&mut rng));
            p[axis] = at;
            p
        })
    });
    let mesh = soup(flat);
    let mut rng = Rng::new(3);
    let rays: Vec<Ray> = (0..30_000)
        .map(|i| {
            let mut o = Vec3::new(lattice(&mut rng), lattice(&mut rng), lattice(&mut rng));
            let mut d = Vec3::new(lattice(&mut rng), lattice(&mut rng), lattice(&mut rng)).signum();
            d[i % 3] = rng.range(-1.0, 1.0);
            o[i % 3] += rng.range(-1.0, 1.0);
            for axis in [(i + 1) % 3, (i + 2) % 3] {
                match rng.below(5) {
                    0 => d[axis] = 0.0,
                    1 => d[axis] = -0.0,
                    2 => d[axis] = 10f32.powf(rng.range(-30.0, -6.0)),
                    3 => d[axis] = -(10f32.powf(rng.range(-30.0, -6.0))),
                    _ => {}
                }
            }
            (o, d, INF)
        })
        .collect();
    let hit = agreed(&backends(&mesh), &rays).iter().filter(|hit| hit.0 != MISS).count();
    assert!(hit > 1000, "{hit}");
}

#[test]
fn bvh03_duplicates_build_and_the_lowest_index_wins() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mesh = soup((0..100_000).map(|_| corners));
    let hits = agreed(&fast_backends(&mesh), &[(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z, INF)]);
    assert_eq!(hits[0].0, 0);
}

#[test]
fn bvh03_concentric_triangles_agree() {
    let mut rng = Rng::new(33);
    let concentric = |n: usize| {
        soup((0..n).map(|i| {
            let r = 1.0 + i as f32 / n as f32;
            [Vec3::new(r, 0.0, 0.0), Vec3::new(-r, r, 0.0), Vec3::new(-r, -r, 0.0)]
        }))
    };
    let rays = random_rays(1000, 1.0, Vec3::ZERO, &mut rng);
    agreed(&backends(&concentric(2000)), &rays);
    agreed(&fast_backends(&concentric(50_000)), &rays[..50]);
}

#[test]
fn bvh04_a_small_thing_in_a_large_scene_is_found() {
    let mut rng = Rng::new(4);
    let mut mesh = grid(2, -1.0);
    mesh = placed(&mesh, 1e6, Vec3::ZERO);
    let small = random_soup(500, 0.3, 1e-4, Vec3::new(0.0, 0.0, 1e-3), &mut rng);
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(&small.positions);
    mesh.indices.extend(small.indices.iter().map(|t| t.map(|v| v + first)));
    let rays = random_rays(5000, 1e-4, Vec3::new(0.0, 0.0, 1e-3), &mut rng);
    agreed(&backends(&mesh), &rays);
}

#[test]
fn bvh05_few_primitives_agree() {
    let mut rng = Rng::new(5);
    for n in 0..20 {
        for _ in 0..5 {
            let mesh = random_soup(n, 1.0, 1.0, Vec3::ZERO, &mut rng);
            agreed(&backends(&mesh), &random_rays(200, 1.0, Vec3::ZERO, &mut rng));
        }
    }
    let nothing_to_hit = soup([[Vec3::ONE; 3], [Vec3::ZERO, Vec3::ZERO, Vec3::X]]);
    let hits = agreed(&backends(&nothing_to_hit), &random_rays(200, 1.0, Vec3::ZERO, &mut rng));
    assert!(hits.iter().all(|hit| hit.0 == MISS));
}

#[test]
fn bvh05_chains_stay_within_the_stack() {
    // Sizes and positions that fall by a constant factor: the SAH peels one after the other.
    for factor in [0.9f32, 0.75, 0.5] {
        let n = (-80.0 / factor.log2()) as i32;
        let mesh = soup((0..n).map(|i| {
            let s = factor.powi(i);
            [Vec3::new(s, 0.0, 0.0), Vec3::new(s, s * 0.1, 0.0), Vec3::new(s, 0.0, s * 0.1)]
        }));
        let rays: Vec<Ray> = (0..n).map(|i| (Vec3::new(-1.0, 1e-3, 1e-3) * factor.powi(i), Vec3::X, INF)).collect();
        agreed(&backends(&mesh), &rays);
    }
}

#[test]
fn bvh05_a_million_slivers_in_a_row_are_built_and_hit() {
    let n = 1 << 20;
    // Ascending, all on one line, and ever thinner.
    let mesh = soup((0..n).map(|i| {
        let (x, width) = (i as f32, 1.0 / (1.0 + i as f32));
        [Vec3::new(x, -width, 0.0), Vec3::new(x, width, -width), Vec3::new(x, 0.0, 1.0)]
    }));
    let bvh = WideBvh::build(&mesh);
    bvh.validate(&mesh).expect("a sound tree");
    let line = |x: f32| Vec3::new(x, 0.0, 0.1);
    let rays = [(line(-1.0), Vec3::X, INF), (line(2e6), -Vec3::X, INF), (line(1000.5), Vec3::X, INF)];
    let hits = trace("bvh", &bvh, &rays);
    assert_eq!([hits[0].0, hits[1].0, hits[2].0], [0, n - 1, 1001]);
}

#[test]
fn det01_tree_does_not_depend_on_the_number_of_threads() {
    let mut rng = Rng::new(8);
    // Large enough for parallel binning, with many equal centres.
    let mut mesh = random_soup(150_000, 0.01, 1.0, Vec3::ZERO, &mut rng);
    mesh.indices.extend_from_within(..20_000);
    let fingerprint = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| WideBvh::build(&mesh)).fingerprint()
    };
    let one = fingerprint(1);
    assert_eq!([fingerprint(2), fingerprint(3)], [one, one]);
}

#[test]
fn ties_go_to_the_lowest_index_in_every_order() {
    let mut rng = Rng::new(9);
    let base = random_soup(200, 0.5, 1.0, Vec3::ZERO, &mut rng);
    let mut mesh = base.clone();
    for _ in 0..4 {
        let mut copies = base.indices.clone();
        for i in (1..copies.len()).rev() {
            copies.swap(i, rng.below(i + 1));
        }
        mesh.indices.extend(copies);
    }
    let rays = random_rays(5000, 1.0, Vec3::ZERO, &mut rng);
    let hits = agreed(&backends(&mesh), &rays);
    assert!(hits.iter().all(|hit| hit.0 == MISS || hit.0 < 200), "the first copy wins");
}

#[test]
fn range_of_a_batch_is_all_that_is_written() {
    let mesh = soup([[Vec3::ZERO, Vec3::X, Vec3::Y]]);
    let rays = batch(&[(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z, INF); 40]);
    for (name, accel) in backends(&mesh) {
        let mut hits = HitBatch::new(40);
        hits.primitive.fill(77);
        accel.intersect(&rays, 3..21, true, &mut hits);
        let written: Vec<usize> = (0..40).filter(|&i| hits.primitive[i] != 77).collect();
        assert_eq!(written, (3..21).collect::<Vec<_>>(), "{name}");
    }
}
