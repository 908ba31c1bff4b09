//! The thorough check of the reference scenes; run it as `scripts/reference_check.sh`.
//!
//! Every scene at 256 x 256 with 32 seeds. The picture's mean must be within 0.15 % of the closed form, or of Mitsuba's
//! where there is none; 16 x 16 block means must agree with Mitsuba's picture (Student's t over seeds, the reference's
//! own variance included, Holm over blocks and channels, family-wise significance 1e-3 a scene); and the same block
//! test must find 0.5 % of planted light. False alarms on a change of the random numbers: 1 in 1000 a scene by the
//! blocks and 1 in 6000 a channel by the mean. Prints a table; exits 1 if anything failed, 2 on wrong usage.

#[path = "../tests/support/mod.rs"]
mod support;

use prt::compare::{BlockTest, block_test};
use prt::image::exr_read::Picture;
use prt::render::{AccelChoice, RenderSettings};
use std::process::ExitCode;
use std::time::Instant;
use support::pictures::{read_exr, reference_stats, settings, shoot_seeds};
use support::reference::mean_verdicts;
use support::verdict::{MAX_BIAS, MeanVerdict};
use support::{planted, scenes};

const USAGE: &str = "usage: reference_check [--scenes a,b,..] [--seeds N] [--spp-scale F] [--accel auto|embree|bvh]
  --scenes     default: all of tests/data/reference
  --seeds      pictures per scene, >= 2 (default 32)
  --spp-scale  multiplies each scene's samples per pixel (default 1)";

/// Samples per pixel: so many that the reference's noise, not ours, limits the test.
fn samples(scene: &str) -> u32 {
    match scene {
        "sun_plane" => 4,
        "point_plane" | "quad_plane" | "furnace" => 64,
        _ => 128,
    }
}

struct Options {
    scenes: Vec<String>,
    seeds: u64,
    spp_scale: f64,
    accel: AccelChoice,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        scenes: scenes::REFERENCE.map(String::from).to_vec(),
        seeds: 32,
        spp_scale: 1.0,
        accel: AccelChoice::Auto,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(option) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{option} needs a value"))?;
        let wrong = || format!("{option} {value}: not allowed");
        match option.as_str() {
            "--scenes" => options.scenes = value.split(',').map(String::from).collect(),
            "--seeds" => options.seeds = value.parse().ok().filter(|n| *n >= 2).ok_or_else(wrong)?,
            "--spp-scale" => options.spp_scale = value.parse().ok().filter(|x| *x > 0.0).ok_or_else(wrong)?,
            "--accel" => {
                options.accel = match value.as_str() {
                    "auto" => AccelChoice::Auto,
                    "embree" => AccelChoice::Embree,
                    "bvh" => AccelChoice::Bvh,
                    _ => return Err(wrong()),
                }
            }
            _ => return Err(format!("{option}: unknown")),
        }
    }
    match options.scenes.iter().find(|s| !scenes::REFERENCE.contains(&s.as_str())) {
        Some(unknown) => Err(format!("--scenes {unknown}: allowed are {}", scenes::REFERENCE.join(","))),
        None => Ok(options),
    }
}

/// The block test with a fault planted in every run.
fn with_fault(runs: &[Picture], fault: impl Fn(&mut Picture), reference: &Picture, rel_se: f64) -> BlockTest {
    let mut faulty = runs.to_vec();
    faulty.iter_mut().for_each(fault);
    block_test(&faulty, reference, rel_se)
}

/// Prints one row; what is wrong comes back.
fn check(name: &str, options: &Options) -> Vec<String> {
    let start = Instant::now();
    let folder = scenes::reference_folder(name);
    let (reference, stats) = (read_exr(&folder.join("ref_mitsuba.exr")), reference_stats(&folder, "ref_mitsuba"));
    let spp = (f64::from(samples(name)) * options.spp_scale).ceil() as u32;
    let settings = RenderSettings { accel: options.accel, ..settings(reference.width as u32, spp, 0) };
    let runs = shoot_seeds(&scenes::reference(name), &settings, options.seeds);
    let means = mean_verdicts(name, &runs, &stats);
    let wrong = |(channel, mean): (usize, &MeanVerdict)| {
        mean.within(MAX_BIAS).err().map(|problem| format!("channel {channel}: {problem}"))
    };
    let mut problems: Vec<String> = means.iter().enumerate().filter_map(wrong).collect();

    let blocks = block_test(&runs, &reference, stats.rel_se);
    if blocks.rejected > 0 {
        let ([x, y, channel], p) = (blocks.worst_at, blocks.smallest_p);
        problems.push(format!("block at ({x}, {y}), channel {channel} is biased: adjusted p {p:.1e}"));
    }
    let found = |test: BlockTest| test.rejected > 0;
    let everywhere = found(with_fault(&runs, |run| planted::scale(run, 1.005), &reference, stats.rel_se));
    let quarter = found(with_fault(&runs, |run| planted::scale_quarter(run, 1.005), &reference, stats.rel_se));
    if !everywhere {
        problems.push(String::from("0.5 % of planted light was not found: too few samples, or a broken test"));
    }
    let [r, g, b] = means.map(|mean| 1.0 + mean.bias);
    let yes = |x| if x { "yes" } else { "no" };
    println!(
        "| {name:14} | {spp:4} | {r:.5} {g:.5} {b:.5} | {:6.2} | {:8.1e} | {:>7} | {:>7} | {:7.1} |",
        blocks.largest_t,
        blocks.smallest_p,
        yes(everywhere),
        yes(quarter),
        start.elapsed().as_secs_f64(),
    );
    problems.into_iter().map(|problem| format!("{name}: {problem}")).collect()
}

fn main() -> ExitCode {
    let options = match options() {
        Ok(options) => options,
        Err(problem) => {
            eprintln!("{problem}\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    println!(
        "| scene          |  spp | ratio of the means, R G B | max |t| | min p    | planted | quarter | seconds |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let problems: Vec<String> = options.scenes.iter().flat_map(|name| check(name, &options)).collect();
    for problem in &problems {
        eprintln!("FAILED {problem}");
    }
    if problems.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
