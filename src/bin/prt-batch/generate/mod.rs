//! What is made of the definition in `args` for others to read: the man page, completions of shells, and the tables of
//! `docs/cli.md`.

mod completions;
mod man;
mod options_md;

use crate::args::Cli;
use clap::CommandFactory;
use clap_complete::Shell;

/// What `--generate` prints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Product {
    /// prt-batch(1), in roff.
    Man,
    /// A script that completes options and values.
    Completions(Shell),
    /// The tables of options, between the markers that `docs/cli.md` has.
    OptionsMd,
}

impl Product {
    /// Their names on the command line.
    pub const NAMES: &[(&'static str, Self)] = &[
        ("man", Self::Man),
        ("complete-bash", Self::Completions(Shell::Bash)),
        ("complete-zsh", Self::Completions(Shell::Zsh)),
        ("complete-fish", Self::Completions(Shell::Fish)),
        ("complete-powershell", Self::Completions(Shell::PowerShell)),
        ("complete-elvish", Self::Completions(Shell::Elvish)),
        ("options-md", Self::OptionsMd),
    ];

    /// Its text. What is not built is in none of them but the tables.
    pub fn text(self) -> String {
        match self {
            Self::Man => man::page(Cli::command()),
            Self::Completions(shell) => completions::script(shell, Cli::command()),
            Self::OptionsMd => options_md::tables(crate::unbuilt::add_to(Cli::command())),
        }
    }
}
