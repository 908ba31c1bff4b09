//! Completions of options, of their values where these are words, and of file names.

use clap::{Arg, Command};
use clap_complete::Shell;

/// The script for `shell`.
pub fn script(shell: Shell, mut command: Command) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut command, "prt-batch", &mut script);
    let script = String::from_utf8(script).expect("clap writes text");
    if shell == Shell::Zsh { with_extensions(script, &command) } else { script }
}

/// zsh's script, in which files are completed by extension: of `FILE.gltf` as the value's name says, and of inputs.
fn with_extensions(mut script: String, command: &Command) -> String {
    let names = command.get_arguments().filter_map(Arg::get_value_names).flatten();
    for name in names {
        if let Some(extension) = name.strip_prefix("FILE.") {
            script = script.replace(&format!(":{name}:_files'"), &format!(":{name}:_files -g \"*.{extension}\"'"));
        }
    }
    let inputs = command.get_arguments().find(|arg| arg.is_positional()).and_then(Arg::get_help);
    let inputs = inputs.map(ToString::to_string).unwrap_or_default();
    script.replace(&format!("{inputs}:_files'"), &format!("{inputs}:_files -g \"*.(gltf|glb|obj)\"'"))
}
