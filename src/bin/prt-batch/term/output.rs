//! The one way to stderr: straight, below the bars' feet, or as JSON. Writes that fail are ignored, because a reader
//! that went away (`2>&1 | head`) must not stop a render.

use super::json_lines::{self, Event};
use super::style::{Level, Paint};
use super::text::indented;
use std::io::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Where lines go.
enum Channel {
    /// To stderr at once.
    Straight,
    /// Until [`take`] fetches them: bars are shown, and whoever draws them prints these above.
    Kept(Vec<String>),
    /// To stderr at once, as JSON.
    Json,
}

static CHANNEL: Mutex<Channel> = Mutex::new(Channel::Straight);

fn channel() -> MutexGuard<'static, Channel> {
    CHANNEL.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on every line is a JSON object.
pub fn speak_json() {
    *channel() = Channel::Json;
}

/// From now on lines wait for [`take`].
pub fn keep() {
    *channel() = Channel::Kept(Vec::new());
}

/// The lines that wait, oldest first.
pub fn take() -> Vec<String> {
    match &mut *channel() {
        Channel::Kept(lines) => std::mem::take(lines),
        _ => Vec::new(),
    }
}

/// Prints the lines that wait, and from now on all others at once.
pub fn release() {
    let mut channel = channel();
    if let Channel::Kept(lines) = &*channel {
        lines.iter().for_each(|line| write(line));
        *channel = Channel::Straight;
    }
}

/// Writes a line to stderr in one piece.
pub fn write(line: &str) {
    let _ = std::io::stderr().lock().write_all(format!("{line}\n").as_bytes());
}

/// Prints `text` as it is.
pub fn say(text: &str) {
    tell(Level::Info, text);
}

/// Prints `text` as [`say`] does, or straight where this very thread may be at it: from a panic hook.
pub fn say_in_panic(text: &str) {
    let is_free = CHANNEL.try_lock().is_ok();
    if is_free { say(text) } else { write(text) }
}

/// Prints an error.
pub fn error(text: &str) {
    tell(Level::Error, text);
}

/// Prints a warning.
pub fn warning(text: &str) {
    tell(Level::Warning, text);
}

/// Prints what is to be known about a run that was told to end.
pub fn interrupted(text: &str) {
    tell(Level::Interrupted, text);
}

/// Prints `text`, which may have several lines, with the word of its level before it.
pub fn tell(level: Level, text: &str) {
    let line = || if level == Level::Info { text.to_owned() } else { tagged(level, text, Paint::of_stderr()) };
    match &mut *channel() {
        Channel::Straight => write(&line()),
        Channel::Kept(lines) => lines.push(line()),
        Channel::Json => {
            let level = if level == Level::Info { "info" } else { level.word() };
            write(&json_lines::line(&Event::Message { level, text: text.trim() }));
        }
    }
}

/// Messages quote names of files and values, which may hold anything.
fn tagged(level: Level, text: &str, paint: Paint) -> String {
    let text: String = text.chars().map(|c| if c.is_control() && c != '\n' { '?' } else { c }).collect();
    format!("{} {}", paint.tag(level), indented(&text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_indented_and_cannot_move_the_cursor() {
        let text = tagged(Level::Error, "a\u{1b}[2J.gltf: no\nLook there.\n  Or here.", Paint::OFF);
        assert_eq!(text, "error: a?[2J.gltf: no\n  Look there.\n  Or here.");
    }
}
