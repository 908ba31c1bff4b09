//! What the user sees: progress and one line per finished picture on stderr, results on stdout.

use crate::parse::ProgressStyle;
use indicatif::{ProgressBar, ProgressStyle as BarStyle};
use prt::batch::report::{ImageReport, Status};
use prt::batch::{ImageId, Observer, Outcome, Started};
use prt::render::Progress;
use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Prints to stdout; a reader that went away (`| head`) is no error.
pub fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// Prints a line to stderr.
pub fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Prints an error to stderr.
pub fn error(text: &str) {
    say(&format!("error: {}", indented(text)));
}

/// Prints a warning to stderr.
pub fn warning(text: &str) {
    say(&format!("warning: {}", indented(text)));
}

/// `text` with every line after the first indented by two spaces, where it is not.
fn indented(text: &str) -> String {
    let line =
        |line: &str| if line.starts_with(' ') || line.is_empty() { line.to_owned() } else { format!("  {line}") };
    let mut lines = text.lines();
    let first = lines.next().unwrap_or_default().to_owned();
    lines.fold(first, |all, next| all + "\n" + &line(next))
}

/// An error of usage: nothing was rendered.
pub fn usage(text: &str) -> ExitCode {
    error(text);
    say("\nFor more information, try '--help'.");
    ExitCode::from(2)
}

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

/// Reports a run on stderr.
pub struct Reporter {
    style: ProgressStyle,
    verbosity: Verbosity,
    accel_said: Option<String>,
    watcher: Option<Watcher>,
}

impl Reporter {
    /// A reporter; `auto` is a bar on a terminal and plain lines elsewhere.
    pub fn new(style: ProgressStyle, verbosity: Verbosity) -> Self {
        Self { style, verbosity, accel_said: None, watcher: None }
    }

    /// The last line of a run.
    pub fn summary(&self, outcome: &Outcome) {
        if let Some(stopped) = &outcome.unwritable {
            error(&format!("{stopped}\n  The run stops here; finished images are kept."));
        }
        let counts = &outcome.report.counts;
        if self.verbosity == Verbosity::Normal && outcome.report.images.len() < 2 || self.verbosity == Verbosity::Quiet
        {
            return;
        }
        let some = counts.iter().filter(|(_, count)| **count > 0);
        let list: Vec<_> = some.map(|(status, count)| format!("{count} {}", status_word(*status))).collect();
        say(&format!("{}, {}", list.join(", "), seconds(outcome.report.seconds)));
    }

    fn details(&self, image: &ImageReport) {
        let s = &image.seconds;
        let time = |name: &str, value: Option<f64>| value.map(|v| format!("{name} {}", seconds(v)));
        let times =
            [("load", s.load), ("decode", s.decode), ("build", s.build), ("render", s.render), ("write", s.write)];
        let times: Vec<_> = times.into_iter().filter_map(|(name, value)| time(name, value)).collect();
        say(&format!("  {}", times.join(", ")));
        if let (Some(rays), Some(triangles)) = (&image.rays, image.triangles) {
            let (camera, bounce, shadow) = (rays.camera, rays.bounce, rays.shadow);
            say(&format!("  {triangles} triangles; rays: {camera} camera, {bounce} bounce, {shadow} shadow"));
        }
        for skipped in &image.skipped {
            say(&format!("  skipped {}: {}", skipped.what, skipped.why));
        }
    }
}

impl Observer for Reporter {
    fn started(&mut self, image: &Started) {
        if self.style != ProgressStyle::None && self.verbosity > Verbosity::Quiet {
            let bar = self.style == ProgressStyle::Auto && std::io::stderr().is_terminal();
            self.watcher = Some(Watcher::start(image.input.display().to_string(), Arc::clone(&image.progress), bar));
        }
    }

    fn finished(&mut self, _id: ImageId, image: &ImageReport) {
        // Ends the bar before anything else is printed.
        self.watcher = None;
        if let Some(message) = &image.error_message {
            error(message);
        }
        if self.verbosity == Verbosity::Quiet {
            return;
        }
        // Once, and again where another backend takes over: `auto` opens no Embree for a scene that needs none.
        if let (Some(used), true) = (&image.accel.used, image.accel.used != self.accel_said) {
            self.accel_said = Some(used.clone());
            let words = [Some(used.as_str()), image.accel.version.as_deref(), image.accel.isa.as_deref()];
            let words: Vec<_> = words.into_iter().flatten().collect();
            // The last line of the note is its gist, those before say what was tried.
            let note = match self.verbosity {
                Verbosity::Verbose => indented(&image.accel_note),
                _ => image.accel_note.lines().last().unwrap_or_default().to_owned(),
            };
            let note = if note.is_empty() { note } else { format!(" ({note})") };
            say(&format!("rays by {}{note}", words.join(" ")));
        }
        match image.status {
            Status::Rendered => say(&line(image)),
            Status::Failed => {}
            other => say(&format!("{}: {}", image.input, status_word(other))),
        }
        for note in &image.notes {
            say(&indented(&format!("note: {}: {note}", image.input)));
        }
        for warning in &image.warnings {
            say(&indented(&format!("warning: {}: {warning}", image.input)));
        }
        if self.verbosity == Verbosity::Verbose {
            self.details(image);
        }
    }
}

/// `renders/cornell.exr  1280x720  64 spp  3.1 s  82 Mray/s`
fn line(image: &ImageReport) -> String {
    let outputs = [&image.outputs.exr, &image.outputs.png, &image.outputs.json];
    let name = outputs.into_iter().flatten().next().map_or(image.input.as_str(), String::as_str);
    let size = |side: Option<u32>| side.unwrap_or_default();
    let mut line = format!("{name}  {}x{}  {} spp", size(image.width), size(image.height), image.spp);
    line += &format!("  {}", seconds(image.seconds.total));
    if let Some(speed) = image.mrays_per_s {
        line += &if speed < 10.0 { format!("  {speed:.2} Mray/s") } else { format!("  {speed:.0} Mray/s") };
    }
    line
}

fn status_word(status: Status) -> &'static str {
    match status {
        Status::Rendered => "rendered",
        Status::UpToDate => "up to date",
        Status::Empty => "empty",
        Status::Failed => "failed",
        Status::Interrupted => "interrupted",
    }
}

fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 0.0995 => format!("{:.0} ms", s * 1e3),
        s if s < 100.0 => format!("{s:.1} s"),
        s => format!("{:.0} min {:02.0} s", (s / 60.0).floor(), s % 60.0),
    }
}

/// A thread that shows how far an image is until it is dropped.
struct Watcher {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Watcher {
    fn start(name: String, progress: Arc<Progress>, bar: bool) -> Self {
        let (stop, stopped) = channel();
        let watch =
            move || if bar { draw_bar(&name, &progress, &stopped) } else { print_lines(&name, &progress, &stopped) };
        Self { stop: Some(stop), thread: Some(std::thread::spawn(watch)) }
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Whether the image goes on for another `period`.
fn goes_on(stopped: &Receiver<()>, period: Duration) -> bool {
    stopped.recv_timeout(period) == Err(RecvTimeoutError::Timeout)
}

fn draw_bar(name: &str, progress: &Progress, stopped: &Receiver<()>) {
    const TEMPLATE: &str = "{msg} {wide_bar} {percent:>3} %  {elapsed} of about {duration}";
    // Of length 0 it would show 100 % until the samples are counted.
    let bar = ProgressBar::new(1).with_style(BarStyle::with_template(TEMPLATE).expect("the template is valid"));
    bar.set_message(name.to_owned());
    while goes_on(stopped, Duration::from_millis(100)) {
        bar.set_length(progress.total.load(Relaxed).max(1));
        bar.set_position(progress.done.load(Relaxed));
    }
    bar.finish_and_clear();
}

/// At most one line a second, and none for an image that is done in the first.
fn print_lines(name: &str, progress: &Progress, stopped: &Receiver<()>) {
    let (clock, mut last) = (Instant::now(), String::new());
    while goes_on(stopped, Duration::from_secs(1)) {
        let (done, total) = (progress.done.load(Relaxed), progress.total.load(Relaxed));
        if total == 0 {
            continue;
        }
        let percent = format!("{:.0} %", 100.0 * done as f64 / total as f64);
        if percent != last {
            let mrays = progress.rays.load(Relaxed) as f64 * 1e-6 / clock.elapsed().as_secs_f64();
            say(&format!("{name}: {percent}, {}, {mrays:.1} Mray/s", seconds(clock.elapsed().as_secs_f64())));
            last = percent;
        }
    }
}
