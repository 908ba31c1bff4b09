//! Whether estimated errors are true: `cargo run --release --example error_calibration -- [--targets] SCENE...`.
//!
//! Each scene is rendered with 16 seeds at each number of samples, or with `--targets` until each of four errors, and the
//! error that each picture states of itself is held against its error to a reference of another seed and many times the
//! samples, whose own noise is taken off. The median of true over stated should be within 0.9 and 1.1, and 90 to 99 % of
//! the true errors inside the intervals.

use prt::compare::metrics;
use prt::image::exr_read::Picture;
use prt::load::{LoadOptions, load};
use prt::render::{Frame, Progress, RenderSettings, Stopping, render};
use prt::scene::Scene;
use std::path::Path;

const SIZE: [u32; 2] = [96, 54];
const SPP: [u32; 8] = [4, 16, 64, 96, 112, 128, 192, 256];
/// In units of the error that the scene has at 64 samples: reached at about 64 to 600 of them.
const TARGETS: [f64; 4] = [1.0, 0.75, 0.5, 0.35];
const SEEDS: u64 = 16;
const REFERENCE: u32 = 1 << 14;

/// What ends a picture.
#[derive(Clone, Copy)]
enum End {
    Spp(u32),
    Error(f64),
}

fn shoot(scene: &Scene, end: End, seed: u64) -> Result<Frame, prt::error::RenderError> {
    let (spp, target_error) = match end {
        End::Spp(spp) => (spp, None),
        End::Error(error) => (1 << 13, Some(error)),
    };
    let stopping = Stopping { target_error, ..Stopping::default() };
    let settings = RenderSettings { width: SIZE[0], height: SIZE[1], spp, seed, stopping, ..RenderSettings::default() };
    render(scene, 0, &settings, &Progress::default())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("| scene | end | spp | stated | true | true / stated: median, least, most | inside | above target |");
    println!("|---|---|---|---|---|---|---|---|");
    let (mut inside, mut runs, mut ratios) = (0, 0, Vec::new());
    let (options, paths): (Vec<_>, Vec<_>) = std::env::args().skip(1).partition(|arg| arg.starts_with("--"));
    for path in paths {
        let path = Path::new(&path);
        let (scene, _) = load(path, &LoadOptions::default())?;
        let reference = shoot(&scene, End::Spp(REFERENCE), 1_000_003)?;
        let endless = picture(&reference);
        let own = reference.stats.error.map_or(0.0, |error| error.value);
        let ends: Vec<End> = if options.iter().any(|option| option == "--targets") {
            let at_64 = shoot(&scene, End::Spp(64), 1_000_003)?.stats.error.map_or(0.1, |error| error.ci95[1]);
            TARGETS.iter().map(|share| End::Error(share * at_64)).collect()
        } else {
            SPP.iter().map(|&spp| End::Spp(spp)).collect()
        };
        for end in ends {
            let mut of_end = Vec::new();
            let (mut stated, mut truth, mut held, mut above, mut spp) = (0.0, 0.0, 0, 0, 0.0);
            for seed in 0..SEEDS {
                let frame = shoot(&scene, end, seed)?;
                let Some(error) = frame.stats.error else { continue };
                let relmse = metrics(&picture(&frame), &endless).relmse.unwrap_or(f64::NAN);
                let actual = (relmse - own * own).max(0.0).sqrt();
                held += usize::from(error.ci95[0] <= actual && actual <= error.ci95[1]);
                above += usize::from(frame.stats.target.is_some_and(|target| actual > target.target));
                (stated, truth) = (stated + error.value / SEEDS as f64, truth + actual / SEEDS as f64);
                spp += f64::from(frame.spp) / SEEDS as f64;
                of_end.push(actual / error.value);
            }
            if of_end.is_empty() {
                continue;
            }
            of_end.sort_by(f64::total_cmp);
            let (median, least, most) = (of_end[of_end.len() / 2], of_end[0], of_end[of_end.len() - 1]);
            let (what, above) = match end {
                End::Spp(spp) => (format!("{spp} spp"), "-".into()),
                End::Error(error) => (format!("error {error:.4}"), above.to_string()),
            };
            println!(
                "| {} | {what} | {spp:.0} | {stated:.5} | {truth:.5} | {median:.3} {least:.3} {most:.3} | {held} of {} | {above} |",
                path.file_stem().unwrap_or_default().display(),
                of_end.len()
            );
            (inside, runs) = (inside + held, runs + of_end.len());
            ratios.extend(of_end);
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
