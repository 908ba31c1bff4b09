//! Options and commands of the contract that are not built: refused by name, never ignored, never "unknown option".

use clap::{Arg, ArgAction, ArgMatches, Command};

/// Options of `render`, and whether a value follows.
const OPTIONS: &[(&str, bool)] = &[
    ("frames", true),
    ("fps", true),
    ("animation", true),
    ("shutter", true),
    ("shutter-position", true),
    ("target-error", true),
    ("time-limit", true),
    ("batch-time-limit", true),
    ("clamp", true),
    ("env", true),
    ("env-rotate", true),
    ("env-scale", true),
    ("f-stop", true),
    ("focus-distance", true),
    ("focus-on", true),
    ("aperture-blades", true),
    ("sensor", true),
    ("aov", true),
    ("transparent", false),
    ("texture-lod", false),
    ("config", true),
    ("strict", false),
    ("display", true),
];

/// Commands.
const COMMANDS: &[&str] = &["bench", "verify"];

/// `command` with hidden options and commands for everything that is not built.
pub fn add_to(command: Command) -> Command {
    let command = with_options(command)
        .mut_subcommand("render", with_options)
        .mut_subcommand("compare", negatives)
        .mut_subcommand("retone", negatives);
    command.subcommands(COMMANDS.iter().map(|name| {
        let anything = Arg::new("anything").num_args(0..).trailing_var_arg(true).allow_hyphen_values(true);
        Command::new(*name).hide(true).disable_help_flag(true).arg(anything)
    }))
}

/// Lets negative numbers through to the options' own checks, whose messages name the option.
fn negatives(command: Command) -> Command {
    command.mut_args(|arg| {
        if arg.get_long().is_some() && arg.get_action().takes_values() { arg.allow_negative_numbers(true) } else { arg }
    })
}

fn with_options(command: Command) -> Command {
    negatives(command).args(OPTIONS.iter().map(|&(name, takes_value)| {
        let arg = Arg::new(name).long(name).hide(true);
        if takes_value {
            arg.num_args(0..=1).allow_hyphen_values(true).action(ArgAction::Append)
        } else {
            arg.action(ArgAction::SetTrue)
        }
    }))
}

/// The first thing on the command line that is not built.
pub fn asked_for(matches: &ArgMatches) -> Option<String> {
    let used = |matches: &ArgMatches, name: &str| {
        matches.try_contains_id(name).is_ok()
            && matches.value_source(name) == Some(clap::parser::ValueSource::CommandLine)
    };
    match matches.subcommand() {
        Some((name, _)) if COMMANDS.contains(&name) => Some(name.to_owned()),
        Some((_, inner)) => OPTIONS.iter().find(|(name, _)| used(inner, name)).map(|(name, _)| format!("--{name}")),
        None => OPTIONS.iter().find(|(name, _)| used(matches, name)).map(|(name, _)| format!("--{name}")),
    }
}
