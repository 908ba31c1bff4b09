//! The man page: one for all commands.

use clap::Command;
use clap_mangen::Man;
use std::io;

/// prt-batch(1) in roff.
pub fn page(command: Command) -> String {
    let mut page = Vec::new();
    write(command, &mut page).expect("memory can be written to");
    String::from_utf8(page).expect("roff is text")
}

fn write(command: Command, page: &mut Vec<u8>) -> io::Result<()> {
    let man = Man::new(command.clone());
    man.render_title(page)?;
    man.render_name_section(page)?;
    man.render_synopsis_section(page)?;
    man.render_description_section(page)?;
    man.render_options_section(page)?;
    // `render` has the options above.
    for sub in command.get_subcommands().filter(|sub| !sub.is_hide_set() && sub.get_name() != "render") {
        write_sub(sub, sub.get_name(), page)?;
    }
    // Examples as they stand, not filled.
    let examples = command.get_after_long_help().map(ToString::to_string).unwrap_or_default();
    page.extend(format!(".SH EXAMPLES\n.nf\n{}.fi\n", escaped(&examples)).into_bytes());
    man.render_version_section(page)
}

/// The section of a command, or those of the commands below it.
fn write_sub(sub: &Command, name: &str, page: &mut Vec<u8>) -> io::Result<()> {
    if sub.has_subcommands() {
        return sub
            .get_subcommands()
            .try_for_each(|below| write_sub(below, &format!("{name} {}", below.get_name()), page));
    }
    let mut section = Vec::new();
    let about = sub.get_about().map(ToString::to_string).unwrap_or_default();
    let full = format!("prt-batch {name}");
    let man = Man::new(sub.clone().display_name(&full).bin_name(full.replace(' ', "\\ ")));
    man.render_options_section(&mut section)?;
    let section = String::from_utf8(section).expect("roff is text").replace(".SH ", ".SS ");
    page.extend(format!(".SH \"PRT\\-BATCH {}\"\n{about}\n{section}", name.to_uppercase()).into_bytes());
    Ok(())
}

/// Lines of text that roff leaves as they are.
fn escaped(text: &str) -> String {
    let line = |line: &str| format!("\\&{}\n", line.replace('\\', "\\e").replace('-', "\\-"));
    text.lines().filter(|text| *text != "Examples:").map(line).collect()
}
