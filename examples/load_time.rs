//! `load_time FILE`: how long a file takes to become a scene, and how much memory that takes at most (where the system
//! tells); `scripts/make_big.py` makes files for it.

use prt::load::{LoadOptions, estimate, load};
use std::time::Instant;

/// A field of `/proc/self/status` in MiB.
fn memory(field: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with(field))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kib| kib / 1024.0)
}

fn main() {
    for file in std::env::args().skip(1) {
        let start = Instant::now();
        let estimated = estimate(file.as_ref(), &LoadOptions::default()).map(|e| e.bytes as f64 / f64::from(1 << 20));
        let looking = start.elapsed().as_secs_f64();
        let start = Instant::now();
        match load(file.as_ref(), &LoadOptions::default()) {
            Err(error) => println!("error: {error}"),
            Ok((scene, _)) => {
                let seconds = start.elapsed().as_secs_f64();
                let (kept, peak) = (memory("VmRSS:"), memory("VmHWM:"));
                println!(
                    "{file}: {} triangles, {seconds:.3} s, kept {kept:?} MiB, peak {peak:?} MiB, \
                     estimated in {looking:.6} s: {estimated:.1?} MiB",
                    scene.triangle_count()
                );
            }
        }
    }
}
