//! Bytes and seconds for many instances of one mesh, as geometries of their own and as one array, and what a
//! ray in each costs: `cargo run --release -p embree4-rs --example measure_instances [thousands]`.

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use embree4_rs::{
    Affine, BuildQuality, CommittedScene, Device, InstanceArrayGeometry, InstanceGeometry, Library, Ray, Scene,
    SceneFlags, TriangleGeometry,
};

fn main() -> Result<(), Box<dyn Error>> {
    let count = 1000 * std::env::args().nth(1).map_or(Ok(1000), |text| text.parse::<usize>())?;
    let device = Device::new(&Library::find(&[".embree"])?, "threads=1")?;
    let object = Arc::new(bumpy_square(&device, 71)?);
    println!("object: {} bytes", device.memory_bytes());

    let side = (count as f64).sqrt().ceil() as usize;
    let places: Vec<Affine> = (0..count)
        .map(|i| {
            let (s, c) = (i as f32).sin_cos();
            let at = [(i % side) as f32, (i / side) as f32, 0.0];
            [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0], at]
        })
        .collect();
    for kind in ["array", "geometries"] {
        let (before, resident, start) = (device.memory_bytes(), resident_bytes(), Instant::now());
        let mut scene = Scene::new(&device, SceneFlags::ROBUST, BuildQuality::Medium)?;
        if kind == "array" {
            scene.attach(InstanceArrayGeometry::new(&object, vec![places.clone()])?)?;
        } else {
            for place in &places {
                scene.attach(InstanceGeometry::new(&object, &[*place])?)?;
            }
        }
        let attached = start.elapsed().as_secs_f64();
        let scene = scene.commit()?;
        let built = start.elapsed().as_secs_f64();
        let per = |bytes: usize| bytes as f64 / count as f64;
        println!(
            "{count} instances as {kind}: {:.0} bytes each by Embree's count, {:.0} resident; {attached:.2} s to attach, \
             {:.2} s to build",
            per(device.memory_bytes() - before),
            per(resident_bytes().saturating_sub(resident)),
            built - attached
        );
        println!("  {:.2} Mray/s", rays_per_second(&scene, side as f32) / 1e6);
    }
    Ok(())
}

/// `2 * n * n` triangles over the unit square.
fn bumpy_square(device: &Arc<Device>, n: u32) -> Result<CommittedScene, embree4_rs::Error> {
    let at = |i: u32| i as f32 / n as f32;
    let positions = (0..=n)
        .flat_map(|y| (0..=n).map(move |x| [at(x), at(y), 0.2 * (7.0 * at(x)).sin() * (9.0 * at(y)).cos()]))
        .collect();
    let corner = move |x: u32, y: u32| y * (n + 1) + x;
    let indices = (0..n * n)
        .flat_map(|i| {
            let (x, y) = (i % n, i / n);
            let (a, b, c, d) = (corner(x, y), corner(x + 1, y), corner(x, y + 1), corner(x + 1, y + 1));
            [[a, b, d], [a, d, c]]
        })
        .collect();
    let mut scene = Scene::new(device, SceneFlags::ROBUST, BuildQuality::Medium)?;
    scene.attach(TriangleGeometry::new(device, positions, indices)?)?;
    scene.commit()
}

/// Scattered slanted rays; the best of five rounds.
fn rays_per_second(scene: &CommittedScene, side: f32) -> f64 {
    let mut state = 1u32;
    let mut number = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 16_777_216.0
    };
    let rays: Vec<Ray> = (0..200_000)
        .map(|_| Ray::new([side * number(), side * number(), 3.0], [number() - 0.5, number() - 0.5, -0.5]))
        .collect();
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        let hits = rays.iter().filter(|ray| scene.intersect1(ray).is_some()).count();
        best = best.min(start.elapsed().as_secs_f64());
        assert!(hits > 0);
    }
    rays.len() as f64 / best
}

/// Bytes of this process in memory; 0 where the system does not tell.
fn resident_bytes() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or_default();
    line.trim().trim_end_matches(" kB").parse::<usize>().map_or(0, |kib| 1024 * kib)
}
