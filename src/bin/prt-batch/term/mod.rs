//! What the user sees: progress, a line per finished picture and a table on stderr, results on stdout.
//!
//! Everything on stderr goes through [`output`], because bars may be in the way; [`Reporter`] decides what is said.
//! [`board`] knows what is under way, [`watch`] shows it now and then as [`bars`], [`plain`] lines or [`json_lines`].

mod bars;
mod board;
mod image_lines;
mod json_lines;
pub mod light_table;
pub mod materials_table;
mod output;
mod plain;
mod repeats;
mod reporter;
mod screen;
pub mod shapes_table;
mod style;
mod table;
mod text;
pub mod verify_table;
mod watch;

pub use output::{error, interrupted, say, say_in_panic, warning};
pub use reporter::Reporter;

use std::io::Write;
use std::process::ExitCode;

/// How much is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
pub enum Verbosity {
    /// Errors only.
    Quiet,
    /// A line per picture, warnings.
    Normal,
    /// Times, rays, what was skipped.
    Verbose,
}

/// Prints to stdout; a reader that went away (`| head`) is no error.
pub fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// An error of usage: nothing was rendered.
pub fn usage(text: &str) -> ExitCode {
    error(text);
    say("\nFor more information, try '--help'.");
    ExitCode::from(2)
}
