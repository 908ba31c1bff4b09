//! Colours: which, and whether any.

use anstream::{AutoStream, ColorChoice};
use anstyle::{AnsiColor, Style};
use prt::batch::report::Status;
use std::fmt::Display;
use std::sync::OnceLock;

/// What a line is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    Error,
    Warning,
    Note,
    Interrupted,
    /// Neither good nor bad.
    Info,
}

impl Level {
    /// What lines of this level begin with, without the colon; empty = nothing.
    pub fn word(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
            Self::Interrupted => "interrupted",
            Self::Info => "",
        }
    }

    fn style(self) -> Style {
        match self {
            Self::Error => AnsiColor::Red.on_default().bold(),
            Self::Warning | Self::Interrupted => AnsiColor::Yellow.on_default(),
            Self::Note => AnsiColor::Cyan.on_default(),
            Self::Info => Style::new(),
        }
    }
}

/// Puts colours on text, or leaves it as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Paint {
    is_on: bool,
}

impl Paint {
    #[cfg(test)]
    pub const OFF: Self = Self { is_on: false };
    #[cfg(test)]
    pub const ON: Self = Self { is_on: true };

    /// As stderr wants it, by the rules that clap's messages follow: NO_COLOR, CLICOLOR_FORCE, CLICOLOR, TERM, and
    /// whether it is a terminal.
    pub fn of_stderr() -> Self {
        static IS_ON: OnceLock<bool> = OnceLock::new();
        Self { is_on: *IS_ON.get_or_init(|| AutoStream::choice(&std::io::stderr()) != ColorChoice::Never) }
    }

    fn put(self, style: Style, text: impl Display) -> String {
        if self.is_on && style != Style::new() { format!("{style}{text}{style:#}") } else { text.to_string() }
    }

    /// `error:`, or the like; nothing for [`Level::Info`].
    pub fn tag(self, level: Level) -> String {
        if level == Level::Info { String::new() } else { self.put(level.style(), format_args!("{}:", level.word())) }
    }

    /// `text`, which is about `status`.
    pub fn status(self, status: Status, text: &str) -> String {
        let style = match status {
            Status::Rendered => AnsiColor::Green.on_default(),
            Status::UpToDate => AnsiColor::Cyan.on_default(),
            Status::Failed => Level::Error.style(),
            Status::Empty | Status::Interrupted => Level::Warning.style(),
        };
        self.put(style, text)
    }

    /// The part of a bar that is done.
    pub fn done(self, text: &str) -> String {
        self.put(AnsiColor::Green.on_default(), text)
    }

    /// What matters less.
    pub fn dim(self, text: &str) -> String {
        self.put(Style::new().dimmed(), text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_put_on_only_where_they_are_wanted() {
        assert_eq!(Paint::OFF.tag(Level::Error), "error:");
        assert_eq!(Paint::ON.tag(Level::Error), "\u{1b}[1m\u{1b}[31merror:\u{1b}[0m");
        assert_eq!(Paint::ON.tag(Level::Warning), "\u{1b}[33mwarning:\u{1b}[0m");
        assert_eq!(Paint::ON.tag(Level::Info), "");
        assert_eq!(Paint::OFF.status(Status::Failed, "failed"), "failed");
    }
}
