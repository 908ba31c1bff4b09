//! `prt-batch verify shapes`: exit code 0 within limits, 1 not, 2 usage.

use crate::args::VerifyArgs;
use crate::term::{self, shapes_table};
use prt::batch::report::to_json;
use prt::render::pool;
use prt::verify::shapes::{Settings, shapes};
use std::process::ExitCode;

pub fn run(args: &VerifyArgs) -> ExitCode {
    if !args.inputs.is_empty() {
        return term::usage("verify shapes has profiles of its own; leave the inputs out");
    }
    let settings = Settings {
        rays: args.rays.unwrap_or(Settings::RAYS),
        random: args.random.unwrap_or(Settings::RANDOM),
        seed: args.seed,
    };
    let report = match pool(args.threads) {
        Ok(pool) => pool.install(|| shapes(&settings)),
        Err(error) => {
            term::error(&error.to_string());
            return ExitCode::from(3);
        }
    };
    if args.json {
        term::print(&to_json(&report));
    } else {
        term::print(&shapes_table::text(&report));
    }
    report.problems.iter().for_each(|problem| term::error(problem));
    ExitCode::from(u8::from(!report.passed))
}
