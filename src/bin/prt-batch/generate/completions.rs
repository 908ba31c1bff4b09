//! Completions of options, of their values where these are words, and of file names.

use clap::Command;
use clap_complete::Shell;

/// The script for `shell`.
pub fn script(shell: Shell, mut command: Command) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut command, "prt-batch", &mut script);
    String::from_utf8(script).expect("clap writes text")
}
