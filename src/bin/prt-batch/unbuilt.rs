//! Options and commands of the contract that are not built: refused by name, never ignored, never "unknown option", and
//! not in the help; only the table of `docs/cli.md` has them.

use clap::{Arg, ArgAction, ArgMatches, Command};

/// An option of `render`.
struct Unbuilt {
    /// Its long name.
    name: &'static str,
    /// What its value is called; empty for one without.
    value: &'static str,
    heading: &'static str,
    /// As in the doc comments of `args`: the default in brackets at the end.
    meaning: &'static str,
}

const fn option(heading: &'static str, name: &'static str, value: &'static str, meaning: &'static str) -> Unbuilt {
    Unbuilt { name, value, heading, meaning }
}

const OPTIONS: &[Unbuilt] = &[
    option("Files", "transparent", "", "Alpha from coverage; background not in the beauty [default: off: alpha 1]"),
    option("Terminal", "display", "HOST:PORT", "Show pictures as they grow in tev"),
];

/// Commands of which only sub-commands are built.
const WITHOUT_OWN: &[&str] = &["bench"];

/// `command` with hidden options and commands for everything that is not built.
pub fn add_to(command: Command) -> Command {
    let command = with_options(command)
        .mut_subcommand("render", with_options)
        .mut_subcommand("compare", negatives)
        .mut_subcommand("retone", negatives)
        .mut_subcommand("verify", negatives);
    let anything = || Arg::new("anything").num_args(0..).trailing_var_arg(true).allow_hyphen_values(true).hide(true);
    WITHOUT_OWN.iter().fold(command, |command, name| {
        command.mut_subcommand(name, |own| {
            // Its help is about what is built.
            let built = own.get_subcommands().map(|sub| sub.get_name().to_owned()).collect::<Vec<_>>();
            let own = own.subcommand_required(false).arg(anything());
            built.iter().fold(own, |own, sub| own.mut_subcommand(sub, negatives))
        })
    })
}

/// Lets negative numbers through to the options' own checks, whose messages name the option.
fn negatives(command: Command) -> Command {
    command.mut_args(|arg| {
        if arg.get_long().is_some() && arg.get_action().takes_values() { arg.allow_negative_numbers(true) } else { arg }
    })
}

/// `render`'s options with those that are not built.
pub fn with_options(command: Command) -> Command {
    negatives(command).args(OPTIONS.iter().map(|option| {
        let arg = Arg::new(option.name).long(option.name).hide(true).help(option.meaning).help_heading(option.heading);
        if option.value.is_empty() {
            arg.action(ArgAction::SetTrue)
        } else {
            arg.value_name(option.value).num_args(0..=1).allow_hyphen_values(true).action(ArgAction::Append)
        }
    }))
}

/// Whether `name` is a command of which sub-commands are built.
pub fn has_built_parts(name: &str) -> bool {
    WITHOUT_OWN.contains(&name)
}

/// Whether `--name` is an option of `render` that is not built.
pub fn is_unbuilt(name: &str) -> bool {
    OPTIONS.iter().any(|option| option.name == name)
}

/// The first thing on the command line that is not built.
pub fn asked_for(matches: &ArgMatches) -> Option<String> {
    let used = |matches: &ArgMatches, name: &str| {
        matches.try_contains_id(name).is_ok()
            && matches.value_source(name) == Some(clap::parser::ValueSource::CommandLine)
    };
    let option = |matches: &ArgMatches| {
        let found = OPTIONS.iter().find(|option| used(matches, option.name));
        found.map(|option| format!("--{}", option.name))
    };
    match matches.subcommand() {
        Some((name, own)) if WITHOUT_OWN.contains(&name) => own.subcommand().is_none().then(|| name.to_owned()),
        Some((_, inner)) => option(inner),
        None => option(matches),
    }
}
