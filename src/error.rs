//! What can go wrong, said so that a user can repair it: where, what the value is, what is allowed, how to fix it.

use std::fmt;
use std::path::{Path, PathBuf};

/// A place in an input: the file and, inside it, a JSON pointer (`/materials/3/...`) or `line:column`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceLoc {
    /// The input file as the user named it.
    pub file: PathBuf,
    /// JSON pointer or `line:column` inside `file`; empty for the file as a whole.
    pub place: String,
}

impl SourceLoc {
    /// The file as a whole.
    pub fn file(file: &Path) -> Self {
        Self { file: file.to_owned(), place: String::new() }
    }

    /// A place inside the file.
    pub fn at(file: &Path, place: impl Into<String>) -> Self {
        Self { file: file.to_owned(), place: place.into() }
    }
}

impl fmt::Display for SourceLoc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if !self.place.is_empty() {
            write!(f, ": {}", self.place)?;
        }
        Ok(())
    }
}

/// An input that cannot be rendered. `Display` is one or two lines:
/// `FILE: PLACE: problem` and, indented, what is allowed and how to fix it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadError {
    /// Where.
    pub at: SourceLoc,
    /// What is wrong, with the offending value in it.
    pub problem: String,
    /// What is allowed and how to fix it; may be empty.
    pub fix: String,
}

impl LoadError {
    /// An error at `at`: what is wrong (with the value), and what is allowed or how to fix it.
    pub fn new(at: SourceLoc, problem: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { at, problem: problem.into(), fix: fix.into() }
    }
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.at, self.problem)?;
        if !self.fix.is_empty() {
            write!(f, "\n  {}", self.fix)?;
        }
        Ok(())
    }
}

impl std::error::Error for LoadError {}

/// A render that could not be done although the scene is sound.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RenderError {
    /// The backend asked for by name is not to be had; the text says what was tried.
    AccelUnavailable(String),
    /// The scene is larger than an index type allows, or than memory.
    TooLarge(String),
    /// The camera has no such lens; the text says why, and what is allowed.
    Lens(String),
    /// The caller asked for it.
    Interrupted,
}

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AccelUnavailable(why) | Self::Lens(why) => write!(f, "{why}"),
            Self::TooLarge(what) => write!(f, "scene too large: {what}"),
            Self::Interrupted => write!(f, "interrupted"),
        }
    }
}

impl std::error::Error for RenderError {}
