//! `prt-batch`: see `docs/cli.md` for what users and their scripts may rely on.

mod args;
mod commands;
mod config;
mod generate;
mod meaning;
mod panics;
mod parse;
mod signals;
mod term;
mod unbuilt;
mod words;

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches};
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    panics::guarded(run)
}

fn run() -> ExitCode {
    let matches = match unbuilt::add_to(args::Cli::command()).try_get_matches() {
        Ok(matches) => matches,
        Err(error) => match hyphen_file().filter(|_| error.kind() == ErrorKind::UnknownArgument) {
            Some(file) => {
                return term::usage(&format!("{file} is no option\n  For the file of that name write ./{file}."));
            }
            None => error.exit(),
        },
    };
    if let Some(name) = unbuilt::asked_for(&matches) {
        let mut text = format!("{name} is not built yet; docs/cli.md says what is");
        if unbuilt::has_built_parts(&name) {
            text += &format!("\n  What of {name} is built is told by prt-batch help {name}.");
        }
        if Path::new(&name).exists() {
            text += &format!("\n  {name} is a command; what is called so in this folder is ./{name}.");
        }
        return term::usage(&text);
    }
    let cli = match args::Cli::from_arg_matches(&matches) {
        Ok(cli) => cli,
        Err(error) => error.exit(),
    };
    if let Some(product) = cli.generate {
        term::print(&product.text());
        return ExitCode::SUCCESS;
    }
    match (cli.command, matches.subcommand()) {
        (Some(args::Command::Compare(options)), _) => commands::compare::run(&options),
        (Some(args::Command::Retone(options)), _) => commands::retone::run(&options),
        (Some(args::Command::Bench { what: args::BenchCommand::Rays(options) }), _) => {
            commands::bench_rays::run(&options)
        }
        (Some(args::Command::Verify(options)), _) => commands::verify::run(&options),
        (Some(args::Command::Doctor(options)), _) => commands::doctor::run(&options),
        (Some(args::Command::Render(_)), Some((_, matches))) => commands::render::run(matches),
        _ => commands::render::run(&matches),
    }
}

/// What was typed that begins with a hyphen and is a file.
fn hyphen_file() -> Option<String> {
    let typed = std::env::args_os().skip(1).map(|arg| arg.to_string_lossy().into_owned());
    typed.filter(|arg| arg.starts_with('-') && arg.len() > 1).find(|arg| Path::new(arg).exists())
}
