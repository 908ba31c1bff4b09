//! How far an image is, and the way to stop it, for other threads than its own.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering::Relaxed};

/// What is being done for an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Phase {
    /// Nothing: it is not begun, or read and waiting for its turn.
    #[default]
    Waiting,
    /// Its file is read, its pictures decoded.
    Loading,
    /// The scene is made ready to be traced.
    Building,
    /// Samples are taken.
    Rendering,
    /// Its files are encoded and written.
    Writing,
}

impl Phase {
    /// Every phase, in the order of time.
    pub const ALL: [Self; 5] = [Self::Waiting, Self::Loading, Self::Building, Self::Rendering, Self::Writing];

    /// As users read it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Loading => "loading",
            Self::Building => "building",
            Self::Rendering => "rendering",
            Self::Writing => "writing",
        }
    }
}

/// Watched and steered from other threads while an image is made.
#[derive(Debug, Default)]
pub struct Progress {
    /// Camera samples finished.
    pub done: AtomicU64,
    /// Camera samples to do in all; 0 until known.
    pub total: AtomicU64,
    /// Rays traced so far.
    pub rays: AtomicU64,
    phase: AtomicU8,
    /// Set it and the render ends within milliseconds with [`crate::error::RenderError::Interrupted`]. May be shared by
    /// all images of a run.
    cancel: Arc<AtomicBool>,
}

impl Progress {
    /// Of an image that ends when `cancel` is set.
    pub fn cancelled_by(cancel: Arc<AtomicBool>) -> Self {
        Self { cancel, ..Self::default() }
    }

    /// Whether the image is to end.
    pub fn is_cancelled(&self) -> bool {
        self.cancel.load(Relaxed)
    }

    /// What is being done.
    pub fn phase(&self) -> Phase {
        Phase::ALL[usize::from(self.phase.load(Relaxed))]
    }

    /// Says what is being done from now on.
    pub fn enter(&self, phase: Phase) {
        self.phase.store(phase as u8, Relaxed);
    }
}
