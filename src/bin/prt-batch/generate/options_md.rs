//! The tables of options in `docs/cli.md`.

use clap::{Arg, ArgAction, Command};

/// What stands before and after the table of a command.
fn markers(command: &str) -> [String; 2] {
    [format!("<!-- generated: prt-batch --generate options-md: {command} -->"), format!("<!-- end of {command} -->")]
}

/// A table for every command that has options, between its markers.
pub fn tables(mut command: Command) -> String {
    command.build();
    let mut tables = Vec::new();
    add_tables(&command, "", &mut tables);
    tables.join("\n")
}

/// Adds those of the commands below `parent`, whose name is `prefix` with a space; of one that has commands of its own,
/// those alone.
fn add_tables(parent: &Command, prefix: &str, tables: &mut Vec<String>) {
    let is_told = |sub: &&Command| !sub.is_hide_set() && sub.get_name() != "help";
    for command in parent.get_subcommands().filter(is_told) {
        let name = format!("{prefix}{}", command.get_name());
        if command.has_subcommands() {
            add_tables(command, &format!("{name} "), tables);
        } else {
            tables.push(table(command, &name));
        }
    }
}

fn table(command: &Command, name: &str) -> String {
    let [before, after] = markers(name);
    let mut text = format!("{before}\n| option | meaning | default | built |\n|---|---|---|---|\n");
    let args: Vec<_> =
        command.get_arguments().filter(|arg| !["help", "version"].contains(&arg.get_id().as_str())).collect();
    // In the order of the definition; what is not built comes last, so after what is built of its heading.
    let mut headings: Vec<Option<&str>> = Vec::new();
    for arg in &args {
        if !headings.contains(&arg.get_help_heading()) {
            headings.push(arg.get_help_heading());
        }
    }
    for heading in headings {
        if let Some(heading) = heading {
            text += &format!("| **{heading}** | | | |\n");
        }
        for arg in args.iter().filter(|arg| arg.get_help_heading() == heading) {
            text += &row(arg);
        }
    }
    text + &after + "\n"
}

fn row(arg: &Arg) -> String {
    let meaning = arg.get_long_help().or(arg.get_help()).map(ToString::to_string).unwrap_or_default();
    let (meaning, stated) = split_default(&meaning);
    let defaults: Vec<_> = arg.get_default_values().iter().map(|value| value.to_string_lossy()).collect();
    let takes_values = arg.get_action().takes_values();
    let default = match stated {
        Some(default) => default,
        None if !takes_values => "off".into(),
        None if defaults.is_empty() => "-".into(),
        None => format!("`{}`", defaults.join(",")),
    };
    let (built, unbuilt): (Vec<_>, Vec<_>) =
        arg.get_possible_values().into_iter().filter(|_| takes_values).partition(|value| !value.is_hide_set());
    let list = |values: &[clap::builder::PossibleValue]| {
        let names: Vec<_> = values.iter().map(|value| format!("`{}`", value.get_name())).collect();
        names.join(", ")
    };
    let allowed = if built.is_empty() { String::new() } else { format!(". One of {}", list(&built)) };
    let state = match (arg.is_hide_set(), unbuilt.is_empty()) {
        (true, _) => "no".into(),
        (false, true) => "yes".into(),
        (false, false) => format!("yes; not {}", list(&unbuilt)),
    };
    let cells = [spelling(arg), prose(meaning.trim_end_matches('.')) + &allowed, prose(&default), state];
    format!("| {} |\n", cells.map(|cell| cell.replace('|', "\\|")).join(" | "))
}

/// `-o, --out DIR` in code font.
fn spelling(arg: &Arg) -> String {
    let value = arg.get_value_names().map(|names| names.join(" ")).unwrap_or_default();
    let Some(long) = arg.get_long() else {
        let is_many = matches!(arg.get_action(), ArgAction::Append) && !value.contains("...");
        let dots = if is_many { "..." } else { "" };
        return format!("`{value}{dots}`");
    };
    let short = arg.get_short().map(|short| format!("-{short}, ")).unwrap_or_default();
    let value = if arg.get_action().takes_values() { format!(" {value}") } else { String::new() };
    format!("`{short}--{long}{value}`")
}

/// The text without its `[default: ...]`, on one line, and that default.
fn split_default(help: &str) -> (String, Option<String>) {
    const MARK: &str = " [default: ";
    let mut paragraphs: Vec<_> = help.split("\n\n").map(|p| p.replace('\n', " ")).collect();
    let first = &mut paragraphs[0];
    let mut default = None;
    if let Some(at) = first.find(MARK) {
        default = first[at + MARK.len()..].strip_suffix(']').map(str::to_owned);
        first.truncate(at);
    }
    if paragraphs.len() > 1 && !paragraphs[0].ends_with('.') {
        paragraphs[0].push('.');
    }
    (paragraphs.join(" "), default)
}

/// Options, templates, paths and file names in code font.
fn prose(text: &str) -> String {
    let word = |word: &str| {
        let core = word.trim_start_matches(['(', '"']).trim_end_matches([')', ',', '.', ';', ':', '"']);
        let is_code =
            ["--", "{", ".", "*"].iter().any(|start| core.starts_with(start)) || core == "?" || core.starts_with('[');
        match word.find(core).filter(|_| is_code) {
            Some(at) => format!("{}`{core}`{}", &word[..at], &word[at + core.len()..]),
            None => word.to_owned(),
        }
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}
