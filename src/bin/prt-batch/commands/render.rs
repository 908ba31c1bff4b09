//! `prt-batch INPUT...`

use crate::meaning::Meaning;
use crate::signals;
use crate::term::{self, Reporter, Verbosity};
use clap::ArgMatches;
use prt::batch::{self, BatchSettings, Stop};
use std::process::ExitCode;

pub fn run(matches: &ArgMatches) -> ExitCode {
    let Meaning { run: args, tasks, warnings } = match Meaning::of(matches) {
        Ok(meaning) => meaning,
        Err(message) => return term::usage(&message),
    };
    let settings = BatchSettings {
        tasks,
        out: args.out.clone(),
        threads: args.threads,
        memory: args.memory,
        batch_time_limit: args.batch_time_limit,
        force: args.force,
        strict: args.strict,
        report: !args.no_report,
        command: command_line(),
        ..BatchSettings::default()
    };
    let warn = || warnings.iter().filter(|_| !args.quiet).for_each(|warning| term::warning(warning));
    if args.explain {
        warn();
        return super::explain::run(&settings, args.json);
    }
    let verbosity = match (args.quiet, args.verbose) {
        (true, _) => Verbosity::Quiet,
        (_, true) => Verbosity::Verbose,
        _ => Verbosity::Normal,
    };
    let mut reporter = Reporter::new(args.progress, verbosity);
    // Behind the reporter, which decides how warnings look.
    warn();
    if let Err(error) = signals::install(&settings.cancel) {
        term::warning(&format!("signals will end the process at once: {error}"));
    }
    match batch::run(settings, &mut reporter) {
        Ok(outcome) => {
            reporter.summary(&outcome, &args.out);
            if args.json {
                term::print(&batch::report::to_json(&outcome.report));
            }
            ExitCode::from(outcome.exit_code())
        }
        Err(Stop::Usage(message)) => term::usage(&message),
        Err(Stop::Unwritable(error)) => {
            term::error(&format!("{error}\n  Nothing was rendered. Choose another folder with --out."));
            ExitCode::from(4)
        }
    }
}

/// The command line, quoted so that a POSIX shell reads it back.
fn command_line() -> String {
    let quoted = |arg: std::ffi::OsString| {
        let arg = arg.to_string_lossy().into_owned();
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+@%".contains(c);
        if !arg.is_empty() && arg.chars().all(plain) { arg } else { format!("'{}'", arg.replace('\'', r"'\''")) }
    };
    std::env::args_os().map(quoted).collect::<Vec<_>>().join(" ")
}
