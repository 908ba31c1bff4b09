//! Whether estimated errors are true: `cargo run --release --example error_calibration SCENE...`.
//!
//! Each scene is rendered with 16 seeds at each number of samples, and the error that each picture states of itself is
//! held against its error to a reference of another seed and at least 64 times the samples, whose own noise is taken off.
//! The median of true over stated should be within 0.9 and 1.1, and 90 to 99 % of the true errors inside the intervals.

use prt::compare::metrics;
use prt::image::exr_read::Picture;
use prt::load::{LoadOptions, load};
use prt::render::{Frame, Progress, RenderSettings, render};
use std::path::Path;

const SIZE: [u32; 2] = [96, 54];
const SPP: [u32; 4] = [4, 16, 64, 256];
const SEEDS: u64 = 16;
const REFERENCE: u32 = 1 << 14;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("| scene | spp | stated | true | true / stated: median, least, most | inside |");
    println!("|---|---|---|---|---|---|");
    let (mut inside, mut runs, mut ratios) = (0, 0, Vec::new());
    for path in std::env::args().skip(1) {
        let path = Path::new(&path);
        let (scene, _) = load(path, &LoadOptions::default())?;
        let shoot = |spp: u32, seed: u64| -> Result<Frame, prt::error::RenderError> {
            let settings = RenderSettings { width: SIZE[0], height: SIZE[1], spp, seed, ..RenderSettings::default() };
            render(&scene, 0, &settings, &Progress::default())
        };
        let reference = shoot(REFERENCE, 1_000_003)?;
        let endless = picture(&reference);
        let own = reference.stats.error.map_or(0.0, |error| error.value);
        for spp in SPP {
            let mut of_spp = Vec::new();
            let (mut stated, mut truth, mut held) = (0.0, 0.0, 0);
            for seed in 0..SEEDS {
                let frame = shoot(spp, seed)?;
                let Some(error) = frame.stats.error else { continue };
                let relmse = metrics(&picture(&frame), &endless).relmse.unwrap_or(f64::NAN);
                let actual = (relmse - own * own).max(0.0).sqrt();
                held += usize::from(error.ci95[0] <= actual && actual <= error.ci95[1]);
                (stated, truth) = (stated + error.value / SEEDS as f64, truth + actual / SEEDS as f64);
                of_spp.push(actual / error.value);
            }
            if of_spp.is_empty() {
                continue;
            }
            of_spp.sort_by(f64::total_cmp);
            let (median, least, most) = (of_spp[of_spp.len() / 2], of_spp[0], of_spp[of_spp.len() - 1]);
            println!(
                "| {} | {spp} | {stated:.5} | {truth:.5} | {median:.3} {least:.3} {most:.3} | {held} of {} |",
                path.file_stem().unwrap_or_default().display(),
                of_spp.len()
            );
            (inside, runs) = (inside + held, runs + of_spp.len());
            ratios.extend(of_spp);
        }
    }
    ratios.sort_by(f64::total_cmp);
    if let Some(median) = ratios.get(ratios.len() / 2) {
        println!("\n{inside} of {runs} inside ({:.1} %), median {median:.3}", 100.0 * inside as f64 / runs as f64);
    }
    Ok(())
}

fn picture(frame: &Frame) -> Picture {
    let [width, height] = SIZE.map(|side| side as usize);
    Picture { origin: [0, 0], width, height, pixels: frame.pixels.clone() }
}
