//! Measures ray queries: `cargo run --release --example rays [triangles in thousands] [rays in thousands]`.
//!
//! A displaced sphere in a box, one thread. Prints Mray/s per core (the best of nine rounds, backends
//! interleaved) for
//! camera rays in pixel order, diffuse bounces from where those hit, and shadow rays from there to a lamp.

use glam::Vec3;
use prt::accel::embree::EmbreeAccel;
use prt::accel::linear::Linear;
use prt::accel::wide::WideBvh;
use prt::accel::{Accel, HitBatch, MISS, RayBatch, Triangles};
use simd::Level;
use std::f32::consts::{PI, TAU};
use std::time::Instant;

/// Rays per batch, as the renderer sends them.
const BATCH: usize = 2048;
const ROUNDS: usize = 9;

fn main() {
    let arg = |i: usize, default: usize| std::env::args().nth(i).and_then(|a| a.parse().ok()).unwrap_or(default);
    let (triangles, rays) = (arg(1, 500) * 1000, arg(2, 200) * 1000);
    let scene = scene(triangles);
    let n = scene.indices.len();
    let single = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut seconds: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let start = Instant::now();
            single.install(|| WideBvh::build(&scene));
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    println!("{n} triangles; build, 1 thread: {:.2} Mtri/s", n as f64 / seconds[0] * 1e-6);

    let wide = WideBvh::build(&scene);
    println!("{:?}", wide.stats());
    let mut backends: Vec<Box<dyn Accel>> =
        vec![Box::new(WideBvh::with_level(&scene, Level::Portable8)), Box::new(wide.clone())];
    if n <= 2000 {
        backends.push(Box::new(Linear::new(scene.clone())));
    }
    match EmbreeAccel::build(&scene, &[]) {
        Ok(embree) => backends.push(Box::new(embree)),
        Err(error) => println!("without Embree: {error}"),
    }
    let (camera, diffuse, shadow) = ray_sets(&wide, rays);
    for (name, rays) in [("camera", &camera), ("diffuse", &diffuse), ("shadow", &shadow)] {
        report(name, rays, &backends);
    }
}

/// Runs one set of rays through every backend and prints a line.
fn report(name: &str, rays: &[RayBatch], backends: &[Box<dyn Accel>]) {
    let mut hits = HitBatch::new(BATCH);
    let mut occluded = vec![0; BATCH];
    let mut times = vec![Vec::new(); backends.len()];
    let mut sums = vec![0.0; backends.len()];
    for _ in 0..ROUNDS {
        for (i, accel) in backends.iter().enumerate() {
            let start = Instant::now();
            sums[i] = 0.0;
            for rays in rays {
                if name == "shadow" {
                    accel.occluded(rays, BATCH, &mut occluded);
                    sums[i] += occluded.iter().map(|&o| f64::from(o)).sum::<f64>();
                } else {
                    accel.intersect(rays, 0..BATCH, name == "camera", &mut hits);
                    sums[i] += hits.primitive[..BATCH].iter().filter(|&&p| p != MISS).count() as f64;
                }
            }
            times[i].push(start.elapsed().as_secs_f64());
        }
    }
    let count = (rays.len() * BATCH) as f64;
    print!("{name:8} hit {:5.1} %", 100.0 * sums[0] / count);
    for (i, accel) in backends.iter().enumerate() {
        times[i].sort_by(f64::total_cmp);
        let stats = accel.stats();
        assert!((sums[i] - sums[0]).abs() <= 1e-5 * count, "{}: {} hits, not {}", stats.name, sums[i], sums[0]);
        print!("   {} {} {:6.2} Mray/s", stats.name, stats.isa, count / times[i][0] * 1e-6);
    }
    println!();
}

/// About `n` triangles: a sphere with bumps over a floor between five walls.
fn scene(n: usize) -> Triangles {
    let mut mesh = Triangles::default();
    let rows = ((n / 4) as f32).sqrt() as usize;
    let columns = 2 * rows;
    for row in 0..=rows {
        for column in 0..=columns {
            let (theta, phi) = (PI * row as f32 / rows as f32, TAU * column as f32 / columns as f32);
            let d = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let bumps = (7.0 * d.x).sin() * (9.0 * d.y).sin() * (8.0 * d.z).sin() + 0.2 * (90.0 * d.x * d.z).sin();
            mesh.positions.push((d * (1.0 + 0.15 * bumps)).to_array());
        }
    }
    let at = |row: usize, column: usize| (row * (columns + 1) + column) as u32;
    for row in 0..rows {
        for column in 0..columns {
            let corners = [at(row, column), at(row, column + 1), at(row + 1, column), at(row + 1, column + 1)];
            mesh.indices.push([corners[0], corners[1], corners[2]]);
            mesh.indices.push([corners[1], corners[3], corners[2]]);
        }
    }
    let first = mesh.positions.len() as u32;
    for i in 0..8 {
        mesh.positions.push([2.0; 3]);
        for axis in 0..3 {
            if i >> axis & 1 == 0 {
                mesh.positions[first as usize + i][axis] = -2.0;
            }
        }
    }
    for quad in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4]] {
        let [a, b, c, d] = quad.map(|i: u32| first + i);
        mesh.indices.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

/// Batches of camera, diffuse and shadow rays.
fn ray_sets(accel: &dyn Accel, n: usize) -> (Vec<RayBatch>, Vec<RayBatch>, Vec<RayBatch>) {
    let side = (n as f32).sqrt() as usize;
    let mut state = 1u64;
    let mut unit = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 40) as f32 * 2f32.powi(-24)
    };
    let (eye, lamp) = (Vec3::new(1.9, 0.3, 0.2), Vec3::new(0.5, 0.4, 1.9));
    let (mut camera, mut diffuse, mut shadow) = (Vec::new(), Vec::new(), Vec::new());
    for first in (0..side * side).step_by(BATCH) {
        let mut rays = RayBatch::new(BATCH);
        for i in 0..BATCH {
            let pixel = (first + i) % (side * side);
            let (x, y) = ((pixel % side) as f32 / side as f32 - 0.5, (pixel / side) as f32 / side as f32 - 0.5);
            rays.set(i, eye, Vec3::new(-1.0, x * 1.6, y * 1.6).normalize(), f32::INFINITY);
        }
        let mut hits = HitBatch::new(BATCH);
        accel.intersect(&rays, 0..BATCH, true, &mut hits);
        let (mut bounced, mut lit) = (RayBatch::new(BATCH), RayBatch::new(BATCH));
        for i in 0..BATCH {
            let d = Vec3::new(rays.dx[i], rays.dy[i], rays.dz[i]);
            let t = if hits.primitive[i] == MISS { 1.0 } else { hits.t[i] };
            let p = eye + d * (t * 0.9999);
            let (z, phi) = (2.0 * unit() - 1.0, TAU * unit());
            let r = (1.0 - z * z).max(0.0).sqrt();
            bounced.set(i, p, Vec3::new(r * phi.cos(), r * phi.sin(), z), f32::INFINITY);
            lit.set(i, p, lamp + Vec3::new(unit(), unit(), 0.0) * 0.3 - p, 0.9999);
        }
        camera.push(rays);
        diffuse.push(bounced);
        shadow.push(lit);
    }
    (camera, diffuse, shadow)
}
