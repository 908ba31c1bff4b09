//! `prt-batch verify light`: exit code 0 within limits, 1 not, 2 usage, 3 a backend that was asked for is not to be had.

use crate::args::VerifyArgs;
use crate::meaning::embree_dirs;
use crate::term::{self, light_table};
use prt::batch::report::to_json;
use prt::render::{AccelChoice, pool};
use prt::verify::contenders::Backend;
use prt::verify::light::{SAMPLES, SEEDS, Settings, light};
use std::process::ExitCode;

pub fn run(args: &VerifyArgs) -> ExitCode {
    if !args.inputs.is_empty() {
        return term::usage(
            "verify light has scenes of its own, whose pixels can be written down; leave the inputs out",
        );
    }
    let accel = match args.accel[..] {
        [] => AccelChoice::Auto,
        [Backend::Bvh] => AccelChoice::Bvh,
        [Backend::Embree] => AccelChoice::Embree,
        [Backend::Linear] => AccelChoice::Linear,
        _ => return term::usage("verify light takes one ray backend at a time; give --accel one"),
    };
    let samples = u32::try_from(args.samples.unwrap_or(SAMPLES as usize)).unwrap_or(u32::MAX);
    let settings = Settings { seed: args.seed, seeds: SEEDS, samples, accel, embree_dirs: embree_dirs() };
    let report = pool(args.threads).and_then(|pool| pool.install(|| light(&settings)));
    let report = match report {
        Ok(report) => report,
        Err(error) => {
            term::error(&error.to_string());
            return ExitCode::from(3);
        }
    };
    if args.json {
        term::print(&to_json(&report));
    } else {
        term::print(&light_table::text(&report));
    }
    let problems = report.cases.iter().filter_map(|case| case.problem.as_ref().map(|problem| (case.name, problem)));
    problems.for_each(|(name, problem)| term::error(&format!("{name} {problem}")));
    ExitCode::from(u8::from(!report.passed))
}
