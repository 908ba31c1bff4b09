//! `prt-batch doctor`: what was found on this machine. Exit code 0, or 1 if something does not work.

use crate::args::DoctorArgs;
use crate::meaning::embree_dirs;
use crate::term;
use prt::batch::doctor::{Doctor, doctor};
use prt::batch::memory::amount;
use prt::batch::report;
use serde::Serialize;
use std::io::IsTerminal;
use std::process::ExitCode;

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    found: Doctor,
    terminal: Terminal,
}

/// What the terminal gets.
#[derive(Serialize)]
struct Terminal {
    /// Standard error is one.
    is_terminal: bool,
    colour: bool,
    why: String,
    /// The first of `LC_ALL`, `LC_CTYPE`, `LANG` that is set.
    locale: Option<String>,
    utf8: bool,
}

pub fn run(args: &DoctorArgs) -> ExitCode {
    let document = Document { found: doctor(&embree_dirs(), None), terminal: terminal() };
    let is_well = document.found.problems.is_empty();
    if args.json {
        term::print(&report::to_json(&document));
    } else {
        term::print(&text(&document));
    }
    document.found.problems.iter().for_each(|problem| term::error(problem));
    ExitCode::from(u8::from(!is_well))
}

fn variable(name: &str) -> Option<String> {
    std::env::var_os(name).map(|value| value.to_string_lossy().into_owned()).filter(|value| !value.is_empty())
}

fn terminal() -> Terminal {
    let is_terminal = std::io::stderr().is_terminal();
    let (no_color, dumb) = (variable("NO_COLOR").is_some(), variable("TERM").is_none_or(|term| term == "dumb"));
    let (colour, why) = match () {
        () if no_color => (false, "NO_COLOR is set"),
        () if !is_terminal => (false, "stderr is no terminal"),
        () if dumb => (false, "TERM is dumb or not set"),
        () => (true, "stderr is a terminal, NO_COLOR is not set"),
    };
    let locale = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().find_map(variable);
    let utf8 = locale.as_ref().is_some_and(|l| {
        let lower = l.to_ascii_lowercase();
        lower.contains("utf-8") || lower.contains("utf8")
    });
    Terminal { is_terminal, colour, why: why.into(), locale, utf8 }
}

fn text(Document { found, terminal }: &Document) -> String {
    let mut text = String::new();
    let mut add = |name: &str, words: String| text += &format!("{name:<10} {words}\n");
    let Doctor { prt, cpu, memory, embree, self_test, problems } = found;
    add("prt-batch", (*prt).to_string());
    add("cpu", cpu.name.clone().unwrap_or_else(|| "not told by the system".into()));
    add("simd", format!("{}; shades {} lanes at once", cpu.simd.join(", "), cpu.lanes));
    let processors = cpu.processors.map_or_else(String::new, |n| format!(" of {n} processors"));
    let affinity = cpu.affinity.as_ref().map_or_else(String::new, |list| format!("; may run on {list}"));
    let quota = cpu.quota.map_or_else(String::new, |quota| format!("; a control group allows {quota:.1}"));
    add("threads", format!("{}{processors}{affinity}{quota}", cpu.threads));
    let bytes = |bytes: Option<u64>| bytes.map_or_else(|| "unknown".into(), amount);
    let limit = memory.limit.map_or_else(String::new, |limit| format!(" (a control group allows {})", amount(limit)));
    add(
        "memory",
        format!(
            "{}{limit}, {} free; --memory is {} by default",
            bytes(memory.total),
            bytes(memory.available),
            bytes(memory.budget)
        ),
    );
    match &embree.path {
        Some(path) => {
            let words = [&embree.version, &embree.isa].into_iter().flatten().cloned().collect::<Vec<_>>().join(" ");
            add("embree", format!("{words}, {}", path.display()));
        }
        None => add("embree", "not found".into()),
    }
    embree.not_used.iter().for_each(|why| add("", format!("not used: {why}")));
    embree.hint.iter().for_each(|hint| add("", (*hint).to_string()));
    for test in self_test {
        let words = match &test.error {
            Some(error) => format!("cannot be used: {error}"),
            None if test.different > 0 => {
                format!("{} of {} rays find other hits than brute force", test.different, test.rays)
            }
            None => format!("works: {} rays find the hits of brute force", test.rays),
        };
        add("self-test", format!("{}: {words}", test.backend));
    }
    let yes = |is: bool| if is { "yes" } else { "no" };
    add("colour", format!("{} ({})", yes(terminal.colour), terminal.why));
    let locale = terminal.locale.as_deref().unwrap_or("none set");
    add("utf-8", format!("{} (locale {locale})", yes(terminal.utf8)));
    add("result", if problems.is_empty() { "all well".into() } else { format!("{} problems", problems.len()) });
    text
}
