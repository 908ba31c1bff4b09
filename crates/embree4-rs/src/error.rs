//! What can go wrong: why a library was refused, and what a build call reports.

use std::fmt;
use std::path::PathBuf;

/// Version `major.minor.patch` of an Embree library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// Major version; this crate takes 4.
    pub major: u32,
    /// Minor version.
    pub minor: u32,
    /// Patch level.
    pub patch: u32,
}

impl Version {
    /// From Embree's number, `10000 * major + 100 * minor + patch`.
    pub(crate) fn from_number(number: isize) -> Self {
        let number = u32::try_from(number).unwrap_or(0);
        Self { major: number / 10_000, minor: number / 100 % 100, patch: number % 100 }
    }
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

/// Why one candidate was not used.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// The folder does not exist.
    NoFolder,
    /// The folder exists, but neither it nor the sub-folders that are looked at hold an Embree 4.
    NothingFound,
    /// The system could not open the file as a library; the system's words.
    Open(String),
    /// The library opened but lacks a function.
    MissingSymbol(&'static str),
    /// The library could not make a device; its words.
    Device(String),
    /// Another major version.
    Version(Version),
    /// The probe rays did not write what the known layouts write.
    Layout {
        /// The library's version.
        version: Version,
        /// Which word differed and how.
        detail: String,
    },
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoFolder => write!(f, "no such folder"),
            Self::NothingFound => write!(f, "holds no Embree 4 library (libembree4*.so*)"),
            Self::Open(text) => write!(f, "cannot be opened: {text}"),
            Self::MissingSymbol(name) => {
                write!(f, "not an Embree 4 library: function {name} is missing")
            }
            Self::Device(text) => write!(f, "cannot make a device: {text}"),
            Self::Version(found) => write!(f, "version {found} found, 4.x needed"),
            Self::Layout { version, detail } => {
                write!(f, "version {version} found, but its hits have an unknown layout: {detail}")
            }
        }
    }
}

/// One candidate and why it was not used. Displays as `path: reason`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// The file, folder or library name that was tried.
    pub path: PathBuf,
    /// Why it was not used.
    pub reason: Reason,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path.display(), self.reason)
    }
}

/// No candidate could be used. Displays as one line per candidate and one that says what helps.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadError {
    /// Every candidate, in the order in which they were tried.
    pub refused: Vec<Refusal>,
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for refusal in &self.refused {
            writeln!(f, "Embree not used: {refusal}")?;
        }
        write!(f, "no Embree 4 library found; set EMBREE_DIR to a folder that holds libembree4.so and its TBB")
    }
}

impl std::error::Error for LoadError {}

/// `RTCError`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorCode {
    /// `RTC_ERROR_UNKNOWN`.
    Unknown,
    /// `RTC_ERROR_INVALID_ARGUMENT`.
    InvalidArgument,
    /// `RTC_ERROR_INVALID_OPERATION`.
    InvalidOperation,
    /// `RTC_ERROR_OUT_OF_MEMORY`.
    OutOfMemory,
    /// `RTC_ERROR_UNSUPPORTED_CPU`.
    UnsupportedCpu,
    /// `RTC_ERROR_CANCELLED`.
    Cancelled,
    /// A code that is newer than this crate.
    Other(i32),
}

impl ErrorCode {
    /// `None` for "no error".
    pub(crate) fn from_number(number: i32) -> Option<Self> {
        Some(match number {
            0 => return None,
            1 => Self::Unknown,
            2 => Self::InvalidArgument,
            3 => Self::InvalidOperation,
            4 => Self::OutOfMemory,
            5 => Self::UnsupportedCpu,
            6 => Self::Cancelled,
            other => Self::Other(other),
        })
    }
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => write!(f, "unknown error"),
            Self::InvalidArgument => write!(f, "invalid argument"),
            Self::InvalidOperation => write!(f, "invalid operation"),
            Self::OutOfMemory => write!(f, "out of memory"),
            Self::UnsupportedCpu => write!(f, "unsupported CPU"),
            Self::Cancelled => write!(f, "cancelled"),
            Self::Other(number) => write!(f, "error {number}"),
        }
    }
}

/// What a build call reports.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// Embree reported an error.
    Embree {
        /// The C function that failed.
        call: &'static str,
        /// Embree's code.
        code: ErrorCode,
        /// Embree's words, empty where it gave none.
        message: String,
    },
    /// Embree returned a null handle without reporting an error.
    NullHandle {
        /// The C function that returned it.
        call: &'static str,
    },
    /// The configuration contains what must not reach Embree.
    Config {
        /// The configuration.
        config: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A triangle names a vertex that is not there.
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it names.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// More items than Embree can number.
    TooMany {
        /// Items of which kind.
        what: &'static str,
        /// How many were given.
        count: usize,
        /// How many are allowed.
        limit: usize,
    },
    /// The geometry was made on another device than the scene.
    OtherDevice,
    /// A geometry was given no time key.
    NoKeys,
    /// The arrays of the time keys differ in length.
    KeyLength {
        /// The first key that differs from key 0.
        key: usize,
        /// How many items it has.
        found: usize,
        /// How many key 0 has.
        expected: usize,
    },
    /// The matrix of an instance is not finite or cannot be inverted.
    Matrix {
        /// The matrix, column by column.
        matrix: [[f32; 3]; 4],
        /// Index of the instance in its geometry.
        instance: usize,
        /// Index of the time key.
        key: usize,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The scene to be instanced contains instances itself.
    SecondLevel,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Embree { call, code, message } if message.is_empty() => {
                write!(f, "Embree: {call}: {code}")
            }
            Self::Embree { call, code, message } => write!(f, "Embree: {call}: {code}: {message}"),
            Self::NullHandle { call } => {
                write!(f, "Embree: {call} returned no handle and reported no error")
            }
            Self::Config { config, problem } => {
                write!(f, "Embree device configuration {config:?} {problem}")
            }
            Self::IndexOutOfRange { triangle, index, vertices } => write!(
                f,
                "triangle {triangle} names vertex {index}, but the mesh has {vertices} vertices; \
                 indices must be below that"
            ),
            Self::TooMany { what, count, limit } => {
                write!(f, "{count} {what} in one geometry, at most {limit} are possible; split it")
            }
            Self::OtherDevice => {
                write!(f, "the geometry belongs to another device than the scene")
            }
            Self::NoKeys => write!(f, "no time key was given; a geometry at rest has one"),
            Self::KeyLength { key, found, expected } => write!(
                f,
                "time key {key} has {found} items, but key 0 has {expected}; all keys must have the same number"
            ),
            Self::Matrix { matrix, instance, key, problem } => {
                write!(f, "the matrix of instance {instance} at time key {key}, columns {matrix:?}, {problem}")
            }
            Self::SecondLevel => write!(
                f,
                "the scene to be instanced contains instances itself, but one level is possible; multiply the \
                 matrices and instance the inner scene"
            ),
        }
    }
}

impl std::error::Error for Error {}
