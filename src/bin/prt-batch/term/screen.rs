//! The bars on the terminal: drawn and wiped by indicatif, on a screen that cannot fail and cannot be torn.

use super::bars::{Look, lines};
use super::board::Board;
use super::output;
use console::Term;
use indicatif::style::ProgressTracker;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle, TermLike};
use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// The bars of a run.
pub struct Bars {
    /// All lines are one bar of indicatif's, so that they are drawn in one piece.
    bar: ProgressBar,
}

impl Bars {
    /// Bars that show `board`; lines of [`output`] wait from now on until [`Bars::draw`] prints them.
    pub fn new(board: Arc<Mutex<Board>>, look: Look) -> Self {
        output::keep();
        let style = ProgressStyle::with_template("{bars}").expect("the template is valid");
        let style = style.with_key("bars", Tracker { board, look });
        let target = ProgressDrawTarget::term_like(Box::new(Screen::default()));
        Self { bar: ProgressBar::with_draw_target(None, target).with_style(style) }
    }

    /// Prints the lines that wait, above the bars as they are now.
    pub fn draw(&self) {
        let waiting = output::take();
        if waiting.is_empty() { self.bar.tick() } else { self.bar.println(waiting.join("\n")) }
    }

    /// Wipes the bars, prints what waits.
    pub fn close(self) {
        self.bar.finish_and_clear();
        output::release();
    }
}

/// Makes the lines when they are drawn.
#[derive(Clone)]
struct Tracker {
    board: Arc<Mutex<Board>>,
    look: Look,
}

impl ProgressTracker for Tracker {
    fn clone_box(&self) -> Box<dyn ProgressTracker> {
        Box::new(self.clone())
    }

    fn tick(&mut self, _: &ProgressState, _: Instant) {}

    fn reset(&mut self, _: &ProgressState, _: Instant) {}

    fn write(&self, _: &ProgressState, text: &mut dyn std::fmt::Write) {
        let view = self.board.lock().unwrap_or_else(PoisonError::into_inner).view(Instant::now());
        let (_, columns) = Term::stderr().size();
        // A String takes everything.
        let _ = text.write_str(&lines(&view, columns.into(), self.look).join("\n"));
    }
}

/// A terminal that gets each drawing in one write. indicatif fills lines with spaces up to the edge and trusts the
/// terminal to go on below; here the lines end where their text does, so that a terminal that becomes narrower, or that
/// shows what is typed, has no reason to break them.
#[derive(Debug, Default)]
struct Screen {
    drawing: Mutex<String>,
    /// The cursor stands behind a line that is complete.
    is_behind_line: AtomicBool,
}

impl Screen {
    fn put(&self, text: &str) -> io::Result<()> {
        self.drawing.lock().unwrap_or_else(PoisonError::into_inner).push_str(text);
        Ok(())
    }

    fn moved(&self, n: usize, direction: char) -> io::Result<()> {
        if n == 0 { Ok(()) } else { self.put(&format!("\x1b[{n}{direction}")) }
    }
}

impl TermLike for Screen {
    fn width(&self) -> u16 {
        Term::stderr().size().1.max(1)
    }

    fn height(&self) -> u16 {
        Term::stderr().size().0.max(1)
    }

    fn move_cursor_up(&self, n: usize) -> io::Result<()> {
        self.moved(n, 'A')
    }

    fn move_cursor_down(&self, n: usize) -> io::Result<()> {
        self.moved(n, 'B')
    }

    fn move_cursor_right(&self, n: usize) -> io::Result<()> {
        self.moved(n, 'C')
    }

    fn move_cursor_left(&self, n: usize) -> io::Result<()> {
        self.moved(n, 'D')
    }

    fn write_line(&self, text: &str) -> io::Result<()> {
        self.put(text)?;
        self.put("\n")
    }

    fn write_str(&self, text: &str) -> io::Result<()> {
        // The filler that ends a line.
        if text.bytes().all(|b| b == b' ') {
            self.is_behind_line.store(true, Relaxed);
            return Ok(());
        }
        if self.is_behind_line.swap(false, Relaxed) {
            self.put("\n")?;
        }
        self.put(text)
    }

    fn clear_line(&self) -> io::Result<()> {
        self.is_behind_line.store(false, Relaxed);
        self.put("\r\x1b[2K")
    }

    fn flush(&self) -> io::Result<()> {
        let drawing = std::mem::take(&mut *self.drawing.lock().unwrap_or_else(PoisonError::into_inner));
        // A terminal that went away is no reason to stop.
        let _ = io::stderr().lock().write_all(drawing.as_bytes());
        Ok(())
    }
}
