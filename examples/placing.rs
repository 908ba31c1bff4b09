//! What rays pay for entering placements: the constant `ENTRY_NS` of `render/placing.rs`.
//!
//! `cargo run --release --example placing [PLACEMENTS]`: balls of 2000 triangles in a cube, the same random rays against
//! them merged and placed, in turns, in CPU time of this thread. Lines through the cube meet as many boxes as their share
//! of its surface says; rays that hit a ball leave the rest unmet, so what is printed is a little low.

use glam::{DMat4, DQuat, DVec3, Vec3};
use prt::accel::{HitBatch, MISS, RayBatch};
use prt::render::{AccelChoice, Choice, Prepared, RenderSettings, prepare_placing};
use prt::scene::{Instance, MaterialId, Scene, SceneBuilder};
use prt::shape::Mesh;

const BATCH: usize = 2048;
const BATCHES: usize = 50;
const ROUNDS: usize = 9;

/// A number in [0, 1) for each `i`.
fn random(i: u64) -> f64 {
    let mut x = i.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x ^ (x >> 31)) as f64 / 2f64.powi(64)
}

/// Nanoseconds that this thread has computed.
fn cpu_ns() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux tells the time of threads");
    text.split(' ').next().and_then(|ns| ns.parse().ok()).expect("a number")
}

fn ball(material: MaterialId) -> Mesh {
    let (rows, columns) = (25_u32, 40_u32);
    let at = |row: u32, column: u32| {
        let (theta, phi) = (f64::from(row) / f64::from(rows), 2.0 * f64::from(column) / f64::from(columns));
        let ((s, c), (sp, cp)) = ((theta * std::f64::consts::PI).sin_cos(), (phi * std::f64::consts::PI).sin_cos());
        DVec3::new(s * cp, c, -s * sp).as_vec3().to_array()
    };
    let positions = (0..=rows).flat_map(|row| (0..=columns).map(move |column| at(row, column))).collect();
    let v = |row: u32, column: u32| row * (columns + 1) + column;
    let quad = |row: u32, column: u32| {
        let (a, b, c, d) = (v(row, column), v(row, column + 1), v(row + 1, column), v(row + 1, column + 1));
        [[a, c, b], [b, c, d]]
    };
    let indices = (0..rows).flat_map(|row| (0..columns).flat_map(move |column| quad(row, column))).collect();
    Mesh::plain("ball", positions, indices, material)
}

/// `n` balls in a cube of side 1 whose boxes are met by `entries` of the lines through it on average.
fn scene(n: usize, entries: f64) -> Scene {
    let mut builder = SceneBuilder::new(0);
    let material = builder.add_material(prt::material::Material::default());
    let mesh = builder.add_mesh(ball(material));
    let radius = 0.5 * (entries / n as f64).sqrt();
    for i in 0..n as u64 {
        let at = DVec3::new(random(7 * i), random(7 * i + 1), random(7 * i + 2));
        // A quarter turn about an axis keeps the box as it is.
        let turn = DQuat::from_rotation_y((random(7 * i + 3) * 4.0).floor() * std::f64::consts::FRAC_PI_2);
        let world_from_object = DMat4::from_scale_rotation_translation(DVec3::splat(radius), turn, at);
        builder.add_instance(Instance { mesh, world_from_object, name: String::new() });
    }
    builder.finish()
}

fn rays() -> Vec<RayBatch> {
    let mut k = 1_000_000;
    let mut next = || {
        k += 1;
        random(k) as f32
    };
    let batch = |_| {
        let mut batch = RayBatch::new(BATCH);
        for i in 0..BATCH {
            // Lines through the cube from all sides.
            let (z, phi) = (2.0 * next() - 1.0, std::f32::consts::TAU * next());
            let r = (1.0 - z * z).max(0.0).sqrt();
            let d = Vec3::new(r * phi.cos(), r * phi.sin(), z);
            let target = Vec3::new(next(), next(), next()) - 0.5;
            batch.set(i, target - 2.0 * d, d, f32::INFINITY);
        }
        batch
    };
    (0..BATCHES).map(batch).collect()
}

/// CPU nanoseconds a ray, and the share of rays that hit something.
fn cost(ready: &Prepared, rays: &[RayBatch]) -> (f64, f64) {
    let (mut hits, mut found) = (HitBatch::new(BATCH), 0);
    let start = cpu_ns();
    for batch in rays {
        ready.accel.intersect(batch, 0..BATCH, false, &mut hits);
        found += (0..BATCH).filter(|&i| hits.primitive[i] != MISS).count();
    }
    let n = (BATCH * rays.len()) as f64;
    ((cpu_ns() - start) / n, found as f64 / n)
}

fn main() {
    let n = std::env::args().nth(1).map_or(500, |text| text.parse().expect("a number of placements"));
    let rays = rays();
    println!("backend  entries  hit share  merged ns/ray  placed ns/ray  ns/entry");
    for accel in [AccelChoice::Bvh, AccelChoice::Embree] {
        for entries in [0.3, 1.0, 3.0] {
            let scene = scene(n, entries);
            let settings = RenderSettings { accel, embree_dirs: vec![".embree".into()], ..RenderSettings::default() };
            let ready = [Choice::Never, Choice::Always].map(|choice| prepare_placing(&scene, &settings, choice));
            let [Ok(merged), Ok(placed)] = ready else {
                println!("{accel:?}: not to be had");
                continue;
            };
            let mut rounds: Vec<[f64; 3]> = (0..ROUNDS)
                .map(|_| {
                    let ((m, share), (p, _)) = (cost(&merged, &rays), cost(&placed, &rays));
                    [m, p, share]
                })
                .collect();
            // By their difference: the middle round.
            rounds.sort_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
            let [m, p, share] = rounds[ROUNDS / 2];
            println!("{accel:?}  {entries}  {share:.2}  {m:.0}  {p:.0}  {:.0}", (p - m) / entries);
        }
    }
}
