//! Tells on stderr what happens in a run, as the user asked for it.

use super::Verbosity;
use super::bars::Look;
use super::board::Board;
use super::image_lines::{accel_line, details, line, strict_failure};
use super::json_lines::{self, Event};
use super::output::{self, error, interrupted, say, tell};
use super::repeats::Repeats;
use super::style::{Level, Paint};
use super::table;
use super::text::{count, seconds};
use super::watch::{Shown, Watch};
use crate::parse::ProgressStyle;
use console::Term;
use prt::batch::report::{ImageReport, Status};
use prt::batch::{ImageId, Observer, Outcome, Started};
use std::io::IsTerminal;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Rows of the table on a terminal, but for failed images.
const MOST_ROWS: usize = 40;

/// Reports a run on stderr.
pub struct Reporter {
    shown: Shown,
    verbosity: Verbosity,
    look: Look,
    board: Arc<Mutex<Board>>,
    accel_said: Option<String>,
    repeats: Repeats,
    watch: Option<Watch>,
}

impl Reporter {
    /// A reporter; `auto` is bars on a terminal and plain lines elsewhere.
    pub fn new(style: ProgressStyle, verbosity: Verbosity) -> Self {
        let variable = |name: &str| std::env::var(name).ok();
        let look = Look::of_locale(Paint::of_stderr(), variable);
        let can_draw = std::io::stderr().is_terminal() && variable("TERM").is_some_and(|term| term != "dumb");
        let shown = match style {
            ProgressStyle::Json => Shown::Json,
            _ if verbosity == Verbosity::Quiet => Shown::Nothing,
            ProgressStyle::None => Shown::Nothing,
            ProgressStyle::Auto if can_draw => Shown::Bars(look),
            ProgressStyle::Auto | ProgressStyle::Plain => Shown::Plain,
        };
        if let Shown::Json = shown {
            output::speak_json();
        }
        let board = Arc::new(Mutex::new(Board::new(Instant::now())));
        Self { shown, verbosity, look, board, accel_said: None, repeats: Repeats::default(), watch: None }
    }

    /// The end of a run, whose files are below `out`.
    pub fn summary(&mut self, outcome: &Outcome, out: &Path) {
        self.watch = None;
        let report = &outcome.report;
        if let Shown::Json = self.shown {
            return output::write(&json_lines::line(&Event::Summary {
                exit_code: outcome.exit_code(),
                interrupted: outcome.interrupted,
                seconds: report.seconds,
                counts: &report.counts,
                unwritable: outcome.unwritable.as_ref().map(ToString::to_string),
            }));
        }
        self.table(&report.images, &out.join("batch.json"));
        if self.verbosity > Verbosity::Quiet {
            self.repeats.rest().iter().for_each(|(level, text)| tell(*level, text));
        }
        if outcome.strict_failures > 0 {
            report.images.iter().filter_map(strict_failure).for_each(|text| error(&text));
        }
        if let Some(stopped) = &outcome.unwritable {
            error(&format!("{stopped}\n  The run stops here; finished images are kept."));
        }
        if self.says_results() && (report.images.len() > 1 || self.verbosity == Verbosity::Verbose) {
            let some = report.counts.iter().filter(|(_, count)| **count > 0);
            let word = |status: Status| self.look.paint.status(status, status.word());
            let list: Vec<_> = some.map(|(status, count)| format!("{count} {}", word(*status))).collect();
            say(&format!("{}, {}", list.join(", "), seconds(report.seconds)));
        }
        if outcome.interrupted {
            let (all, left) = (report.images.len(), report.counts[&Status::Interrupted]);
            let are = if all == 1 { "is" } else { "are" };
            interrupted(&format!(
                "{} of {} {are} done; the same command goes on from there",
                all - left,
                count(all as u64, "image")
            ));
        }
    }

    /// Whether more than errors and warnings is said.
    fn says_results(&self) -> bool {
        match self.verbosity {
            Verbosity::Quiet => false,
            Verbosity::Normal => !matches!(self.shown, Shown::Nothing),
            Verbosity::Verbose => true,
        }
    }

    /// On a terminal, or if much is to be said, all images; else those that failed, which a log has lost among others.
    fn table(&self, images: &[ImageReport], report: &Path) {
        if !self.says_results() || images.len() < 2 {
            return;
        }
        let is_terminal = std::io::stderr().is_terminal();
        let format = table::Format {
            columns: is_terminal.then(|| Term::stderr().size().1.into()),
            most: if is_terminal { MOST_ROWS } else { usize::MAX },
            paint: self.look.paint,
            gap: self.look.gap,
        };
        let report = report.display().to_string();
        let lines = if matches!(self.shown, Shown::Bars(_)) || self.verbosity == Verbosity::Verbose {
            table::lines(images, format, &report)
        } else {
            let is_failed = |image: &&ImageReport| image.status == Status::Failed;
            let failed: Vec<_> = images.iter().filter(is_failed).cloned().collect();
            // The first line names columns that failed images have not.
            if failed.is_empty() { Vec::new() } else { table::lines(&failed, format, &report).split_off(1) }
        };
        if !lines.is_empty() {
            say(&lines.join("\n"));
        }
    }

    fn board(&self) -> MutexGuard<'_, Board> {
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// `[12/500] ` in a log of several images.
    fn place(&self) -> Option<String> {
        let board = self.board();
        (matches!(self.shown, Shown::Plain) && board.all() > 1)
            .then(|| format!("[{}/{}] ", board.finished(), board.all()))
    }

    /// What is said about a finished image where people read it.
    fn results(&mut self, image: &ImageReport) {
        let is_verbose = self.verbosity == Verbosity::Verbose;
        // Once, and again where another backend takes over: `auto` opens no Embree for a scene that needs none.
        let is_new = image.status == Status::Rendered && image.accel.used != self.accel_said;
        if is_new && image.accel.used.is_some() {
            self.accel_said.clone_from(&image.accel.used);
            say(&accel_line(&image.accel, &image.accel_note, is_verbose));
        }
        if image.status != Status::Failed {
            let place = self.place().unwrap_or_default();
            say(&format!("{place}{}", line(image, self.look.paint)));
        }
        self.remarks(Level::Note, image, &image.notes);
    }

    fn remarks(&mut self, level: Level, image: &ImageReport, texts: &[String]) {
        for text in texts {
            if let Some(line) = self.repeats.line(level, &image.input, text) {
                tell(level, &line);
            }
        }
    }
}

impl Observer for Reporter {
    fn planned(&mut self, images: usize) {
        self.board().plan(images, Instant::now());
        if let Shown::Json = self.shown {
            output::write(&json_lines::line(&Event::Planned { images }));
        }
        self.watch = Some(Watch::start(Arc::clone(&self.board), self.shown));
    }

    fn started(&mut self, image: &Started) {
        self.board().start(image, Instant::now());
        if let Shown::Json = self.shown {
            let (input, output) = (image.input.display().to_string(), image.output.display().to_string());
            output::write(&json_lines::line(&Event::Started { id: image.id, input: &input, output: &output }));
        }
    }

    fn finished(&mut self, id: ImageId, image: &ImageReport) {
        self.board().finish(id, image.status, Instant::now());
        if let Shown::Json = self.shown {
            return output::write(&json_lines::line(&Event::Finished { id, image }));
        }
        if let Some(message) = &image.error_message {
            error(message);
        }
        if self.says_results() {
            self.results(image);
        }
        if self.verbosity > Verbosity::Quiet {
            self.remarks(Level::Warning, image, &image.warnings);
        }
        if self.verbosity == Verbosity::Verbose {
            details(image).iter().for_each(|line| say(line));
        }
    }
}
