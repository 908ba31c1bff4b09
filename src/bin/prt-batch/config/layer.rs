//! Options given in several places, of which the later win: top of the config file, its blocks, the command line.

use crate::args::RenderArgs;
use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, ValueHint};
use std::error::Error;
use std::ffi::OsString;

/// An option as given in one place.
#[derive(Clone, Debug)]
pub struct Given {
    /// Its long name.
    pub name: String,
    /// What one would type: `--name=value`, or `--name` of a switch; `None` for a switch that is set to off.
    pub argument: Option<OsString>,
    /// `FILE:LINE:COLUMN`; none for the command line.
    pub place: Option<String>,
}

/// Options given in one place; none of them excludes another.
#[derive(Clone, Debug, Default)]
pub struct Layer(pub Vec<Given>);

/// What options there are: `render`'s, as `args` defines them.
#[derive(Debug)]
pub struct Definition(Command);

impl Definition {
    pub fn new() -> Self {
        let mut command = RenderArgs::augment_args(Command::new("prt-batch").no_binary_name(true));
        command.build();
        Self(command)
    }

    /// The option with that long name.
    pub fn option(&self, name: &str) -> Option<&Arg> {
        self.0.get_arguments().find(|arg| arg.get_long() == Some(name) && name != "help")
    }

    /// Long names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.get_arguments().filter_map(Arg::get_long).filter(|name| !["help", "config"].contains(name))
    }

    /// The long name of the option with that short one.
    pub fn long_of(&self, short: &str) -> Option<&str> {
        let mut letters = short.chars();
        let letter = letters.next().filter(|_| letters.next().is_none());
        self.0.get_arguments().find(|arg| letter.is_some() && arg.get_short() == letter)?.get_long()
    }

    /// Whether the option holds for the whole run: one of `RunArgs`.
    pub fn is_for_the_run(&self, name: &str) -> bool {
        let group = self.0.get_groups().find(|group| group.get_id() == "RunArgs");
        let ids = group.into_iter().flat_map(clap::ArgGroup::get_args);
        self.option(name).is_some_and(|arg| ids.into_iter().any(|id| id == arg.get_id()))
    }

    /// Whether both are on and only one of them may be.
    pub fn exclude_each_other(&self, one: &Given, other: &Given) -> bool {
        let excludes = |one: &Given, other: &Given| {
            let conflicts = self.option(&one.name).map(|arg| self.0.get_arg_conflicts_with(arg)).unwrap_or_default();
            conflicts.iter().any(|arg| arg.get_long() == Some(&other.name))
        };
        one.argument.is_some() && other.argument.is_some() && (excludes(one, other) || excludes(other, one))
    }

    /// Checks the value of one option.
    ///
    /// # Errors
    /// What is wrong with it, in the words of the option itself.
    pub fn check(&self, argument: &OsString) -> Result<(), String> {
        let Err(error) = self.0.clone().try_get_matches_from([argument]) else { return Ok(()) };
        Err(match error.source() {
            Some(why) if error.kind() == ErrorKind::ValueValidation => why.to_string(),
            _ => said(&error),
        })
    }

    /// What was typed: the options of `matches` that stood on the command line.
    pub fn typed(&self, matches: &ArgMatches) -> Layer {
        let given = |arg: &Arg| {
            let name = arg.get_long()?;
            let id = arg.get_id().as_str();
            // `--help` and the like are no values.
            matches.try_contains_id(id).ok()?;
            (matches.value_source(id) == Some(ValueSource::CommandLine)).then_some(())?;
            let mut argument = OsString::from(format!("--{name}"));
            if arg.get_action().takes_values() {
                argument.push("=");
                argument.push(matches.get_raw(id)?.next()?);
            }
            Some(Given { name: name.to_owned(), argument: Some(argument), place: None })
        };
        Layer(self.0.get_arguments().filter_map(given).collect())
    }

    /// The arguments that remain of `layers`, the last of which wins: an option removes from earlier layers itself and
    /// what it excludes. Sorted, so that equal options are equal arguments.
    pub fn merged(&self, layers: &[&Layer]) -> Vec<OsString> {
        let mut kept: Vec<&Given> = Vec::new();
        for layer in layers {
            let replaces = |new: &Given, old: &Given| new.name == old.name || self.exclude_each_other(new, old);
            kept.retain(|old| !layer.0.iter().any(|new| replaces(new, old)));
            kept.extend(&layer.0);
        }
        let mut arguments: Vec<_> = kept.into_iter().filter_map(|given| given.argument.clone()).collect();
        arguments.sort();
        arguments
    }

    /// The options that `arguments` give.
    ///
    /// # Errors
    /// They exclude each other; each value by itself was checked before.
    pub fn options(&self, arguments: &[OsString]) -> Result<RenderArgs, String> {
        let matches = self.0.clone().try_get_matches_from(arguments);
        matches.and_then(|matches| RenderArgs::from_arg_matches(&matches)).map_err(|error| said(&error))
    }
}

/// The first paragraph of clap's message.
fn said(error: &clap::Error) -> String {
    let text = error.to_string();
    let first = text.split("\n\n").next().unwrap_or_default();
    first.strip_prefix("error: ").unwrap_or(first).to_owned()
}

/// Whether the option's value is a path, which in a config file is relative to that.
pub fn is_path(arg: &Arg) -> bool {
    matches!(arg.get_value_hint(), ValueHint::AnyPath | ValueHint::FilePath | ValueHint::DirPath)
}
