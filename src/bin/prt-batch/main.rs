//! `prt-batch`: see `docs/cli.md` for what users and their scripts may rely on.

mod args;
mod commands;
mod panics;
mod parse;
mod signals;
mod term;
mod unbuilt;

use clap::{CommandFactory, FromArgMatches};
use std::process::ExitCode;

fn main() -> ExitCode {
    panics::guarded(run)
}

fn run() -> ExitCode {
    let matches = unbuilt::add_to(args::Cli::command()).get_matches();
    if let Some(name) = unbuilt::asked_for(&matches) {
        return term::usage(&format!("{name} is not built yet; docs/cli.md says what is"));
    }
    let cli = match args::Cli::from_arg_matches(&matches) {
        Ok(cli) => cli,
        Err(error) => error.exit(),
    };
    match cli.command {
        Some(args::Command::Render(options)) => commands::render::run(&options),
        Some(args::Command::Compare(options)) => commands::compare::run(&options),
        Some(args::Command::Retone(options)) => commands::retone::run(&options),
        Some(args::Command::Doctor(options)) => commands::doctor::run(&options),
        None => commands::render::run(&cli.render),
    }
}
