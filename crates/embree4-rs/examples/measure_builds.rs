//! Build times, bytes and whether the tree depends on the threads that build it:
//! `cargo run --release -p embree4-rs --example measure_builds [thousands of triangles]`.
//!
//! A terrain, and the same with every triangle three times, so that which of them is reported depends on the order
//! in the tree. Hits of 100,000 slanted rays are hashed with all their numbers.

use std::error::Error;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;
use std::time::Instant;

use embree4_rs::{
    BuildQuality, CommittedScene, Device, HitsSoAMut, Library, RaysSoA, Scene, SceneFlags, TriangleGeometry,
};

fn main() -> Result<(), Box<dyn Error>> {
    let thousands = std::env::args().nth(1).map_or(Ok(2000), |text| text.parse::<u32>())?;
    let side = (500.0 * f64::from(thousands)).sqrt() as u32;
    let library = Library::find(&[".embree"])?;
    for (name, copies) in [("terrain", 1), ("terrain, each triangle three times", 3)] {
        let side = (f64::from(side) / f64::from(copies).sqrt()) as u32;
        for (quality, flags) in [
            (BuildQuality::Low, SceneFlags::ROBUST),
            (BuildQuality::Medium, SceneFlags::ROBUST),
            (BuildQuality::Medium, SceneFlags::ROBUST | SceneFlags::COMPACT),
            (BuildQuality::High, SceneFlags::NONE),
        ] {
            println!("{name}, {} triangles, {quality:?} {flags:?}", 2 * side * side * copies);
            for (config, joined) in [
                ("threads=1", None),
                ("threads=2", None),
                ("threads=2,user_threads=2", Some(1)),
                ("threads=2,user_threads=2", Some(2)),
            ] {
                let mut best = f64::INFINITY;
                let mut seen = Vec::new();
                let rounds = if copies == 1 { 3 } else { 6 };
                for _ in 0..rounds {
                    let device = Device::new(&library, config)?;
                    let mut scene = Scene::new(&device, flags, quality)?;
                    scene.attach(terrain(&device, side, copies)?)?;
                    let start = Instant::now();
                    let scene = match joined {
                        None => scene.commit()?,
                        Some(threads) => scene.commit_joined(threads)?,
                    };
                    best = best.min(start.elapsed().as_secs_f64());
                    let found = (device.memory_bytes(), hits(&scene, side));
                    if !seen.contains(&found) {
                        seen.push(found);
                    }
                }
                let joined = joined.map_or(String::new(), |threads| format!(", {threads} joined"));
                println!("  {config}{joined}: {best:.3} s at best of {rounds}; bytes and hash of hits: {seen:x?}");
            }
        }
    }
    Ok(())
}

/// `2 * side * side * copies` triangles; copies of a triangle are far apart in the array.
fn terrain(device: &Arc<Device>, side: u32, copies: u32) -> Result<TriangleGeometry, embree4_rs::Error> {
    let at = |i: u32| i as f32 / side as f32;
    let height = |x: f32, y: f32| 0.05 * (13.0 * x).sin() * (17.0 * y).cos() + 0.01 * (210.0 * x + 130.0 * y).sin();
    let positions = (0..=side).flat_map(|y| (0..=side).map(move |x| [at(x), at(y), height(at(x), at(y))])).collect();
    let corner = move |x: u32, y: u32| y * (side + 1) + x;
    let indices = (0..copies * side * side)
        .flat_map(|i| {
            let (x, y) = (i % side, i / side % side);
            let (a, b, c, d) = (corner(x, y), corner(x + 1, y), corner(x, y + 1), corner(x + 1, y + 1));
            [[a, b, d], [a, d, c]]
        })
        .collect();
    TriangleGeometry::new(device, positions, indices)
}

/// A number made of all that the closest hits of many rays say.
fn hits(scene: &CommittedScene, seed: u32) -> u64 {
    const COUNT: usize = 100_000;
    let mut state = seed;
    let mut column = |low: f32, high: f32| -> Vec<f32> {
        (0..COUNT)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                low + (high - low) * ((state >> 8) as f32 / 16_777_216.0)
            })
            .collect()
    };
    let [ox, oy, oz] = [column(0.0, 1.0), column(0.0, 1.0), column(0.2, 0.3)];
    let [dx, dy, dz] = [column(-1.0, 1.0), column(-1.0, 1.0), column(-1.0, -0.1)];
    let t_max = vec![f32::INFINITY; COUNT];
    let [mut t, mut u, mut v] = [(); 3].map(|()| vec![0.0; COUNT]);
    let [mut primitive, mut geometry] = [(); 2].map(|()| vec![0; COUNT]);
    let rays = RaysSoA {
        ox: &ox,
        oy: &oy,
        oz: &oz,
        dx: &dx,
        dy: &dy,
        dz: &dz,
        t_max: &t_max,
        time: None,
        id: None,
        mask: None,
        is_open: false,
    };
    let into = HitsSoAMut {
        t: &mut t,
        u: &mut u,
        v: &mut v,
        primitive: &mut primitive,
        geometry: &mut geometry,
        instance: None,
        instance_primitive: None,
    };
    scene.intersect_batch(rays, false, into);
    let mut hash = DefaultHasher::new();
    primitive.hash(&mut hash);
    t.iter().chain(&u).chain(&v).for_each(|number| number.to_bits().hash(&mut hash));
    hash.finish()
}
