//! What reading an input will take of memory, known before anything large is allocated.

use super::{LoadOptions, gltf, obj};
use crate::image::header::Header;
use crate::texture::Channels;
use std::path::Path;

/// What reading an input will take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoadEstimate {
    /// Bytes at most at any time while it is read, its scene included.
    pub bytes: u64,
    /// Bytes besides while the file is read for several moments of an animation: vertices before anything moves them.
    pub unmoved: u64,
    /// Of `bytes`, what the allocator keeps when it has been read: what was many small pieces.
    pub left_over: u64,
}

/// What [`super::load`] will take for `path`, by headers and counts alone: at most a few milliseconds whatever its size.
/// `None` where it cannot be told, or where the file is wrong: [`super::load`] then says what is wrong with it, before it
/// allocates what the file has not.
pub fn estimate(path: &Path, options: &LoadOptions) -> Option<LoadEstimate> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "gltf" | "glb" => gltf::estimate(path, options),
        "obj" => obj::estimate(path, options),
        _ => None,
    }
}

/// A picture that will be decoded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Picture {
    pub header: Header,
    /// Bytes of the file.
    pub encoded: u64,
    /// All of its bytes are held until all pictures are decoded.
    pub waits: bool,
    /// Channels that are kept.
    pub used: Channels,
}

impl Picture {
    fn pixels(&self) -> u64 {
        u64::from(self.header.width) * u64::from(self.header.height)
    }

    /// Bytes kept of it: at most two channels, or all four. Equal channels of a picture in colour are not known to be so.
    fn kept(&self) -> u64 {
        let used = (0..4).filter(|&k| self.used.has(k)).count();
        let differ = match self.header.channels {
            1 => 1,
            2 => used.min(2),
            _ => used,
        };
        let channels = if differ <= 2 { differ.max(1) } else { 4 };
        self.pixels() * channels as u64 * u64::from(self.header.depth)
    }

    /// Bytes at most while it is decoded: as the decoder gives it, and as four channels.
    fn decoding(&self) -> u64 {
        self.pixels() * u64::from(self.header.channels + 4) * u64::from(self.header.depth) + self.encoded
    }
}

/// Bytes at most while `all` are decoded, as many at once as there are threads.
pub(super) fn pictures(all: &[Picture]) -> u64 {
    let kept: u64 = all.iter().map(Picture::kept).sum();
    let waiting: u64 = all.iter().filter(|p| p.waits).map(|p| p.encoded).sum();
    let mut passing: Vec<u64> = all.iter().map(|p| p.decoding().saturating_sub(p.kept())).collect();
    passing.sort_unstable_by(|a, b| b.cmp(a));
    let at_once: u64 = passing.iter().take(rayon::current_num_threads()).sum();
    kept + waiting + at_once
}
