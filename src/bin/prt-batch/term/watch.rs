//! The thread that shows now and then how far a run is.

use super::bars::Look;
use super::board::Board;
use super::json_lines::{self, Event};
use super::output;
use super::plain::Lines;
use super::screen::Bars;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How progress is shown.
#[derive(Clone, Copy, Debug)]
pub enum Shown {
    Bars(Look),
    Plain,
    Json,
    Nothing,
}

/// How often bars are drawn.
const FRAME: Duration = Duration::from_millis(100);
/// How often lines may be printed.
const LINE: Duration = Duration::from_secs(1);

/// Shows progress until it is dropped.
pub struct Watch {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Shows `board` from now on.
    pub fn start(board: Arc<Mutex<Board>>, shown: Shown) -> Self {
        let (stop, stopped) = channel();
        let watch: Box<dyn FnOnce() + Send> = match shown {
            Shown::Bars(look) => {
                // Lines wait from here on, not from when the thread comes to it.
                let bars = Bars::new(board, look);
                Box::new(move || draw(bars, &stopped))
            }
            Shown::Plain => Box::new(move || print(&board, &stopped)),
            Shown::Json => Box::new(move || print_json(&board, &stopped)),
            Shown::Nothing => return Self { stop: None, thread: None },
        };
        let thread = std::thread::Builder::new().name("progress".into()).spawn(watch);
        // A system that gives no thread will say so to the engine as well.
        Self { stop: Some(stop), thread: thread.ok() }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        // Whatever became of the bars: nothing waits any more.
        output::release();
    }
}

/// Whether the run goes on for another `period`.
fn goes_on(stopped: &Receiver<()>, period: Duration) -> bool {
    stopped.recv_timeout(period) == Err(RecvTimeoutError::Timeout)
}

fn draw(bars: Bars, stopped: &Receiver<()>) {
    while goes_on(stopped, FRAME) {
        bars.draw();
    }
    bars.close();
}

fn print(board: &Mutex<Board>, stopped: &Receiver<()>) {
    let mut lines = Lines::default();
    while goes_on(stopped, LINE) {
        let view = board.lock().unwrap_or_else(PoisonError::into_inner).view(Instant::now());
        if let Some(line) = lines.due(&view) {
            output::say(&line);
        }
    }
}

fn print_json(board: &Mutex<Board>, stopped: &Receiver<()>) {
    while goes_on(stopped, LINE) {
        let view = board.lock().unwrap_or_else(PoisonError::into_inner).view(Instant::now());
        for image in &view.images {
            output::write(&json_lines::line(&Event::progress(image, view.left)));
        }
    }
}
