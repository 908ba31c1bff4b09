//! `prt-batch`: see `docs/cli.md` for what users and their scripts may rely on.

mod args;
mod commands;
mod config;
mod generate;
mod meaning;
mod parse;
mod term;
mod unbuilt;
mod words;

use clap::{CommandFactory, FromArgMatches};
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let matches = unbuilt::add_to(args::Cli::command()).get_matches();
    if let Some(name) = unbuilt::asked_for(&matches) {
        let mut text = format!("{name} is not built yet; docs/cli.md says what is");
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
        (Some(args::Command::Render(_)), Some((_, matches))) => commands::render::run(matches),
        _ => commands::render::run(&matches),
    }
}
