//! What reading an OBJ file will take of memory, by samples of its text and the headers of its pictures.

use crate::image::header::header;
use crate::load::LoadOptions;
use crate::load::estimate::{LoadEstimate, Picture, pictures};
use crate::load::folders::{Folders, open_file, read_file};
use crate::texture::Channels;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Samples of the text, spread evenly, and the bytes of each.
const SAMPLES: u64 = 24;
const SAMPLE: u64 = 16 << 10;
/// MTL files longer than this are not looked through for pictures.
const MOST_MTL: u64 = 1 << 20;

/// Bytes that a statement takes: as read, and as part of a mesh. Measured on grids with and without normals.
const VERTEX: f64 = 24.0;
const TEXTURE_COORDINATE: f64 = 16.0;
const NORMAL: f64 = 24.0;
/// Normals that are made where there are none, a vertex.
const SMOOTHED: f64 = 40.0;
const CORNER: f64 = 12.0;
const TRIANGLE: f64 = 24.0;

/// Statements of a piece of text.
#[derive(Debug, Default, PartialEq)]
struct Counts {
    vertices: f64,
    texture_coordinates: f64,
    normals: f64,
    corners: f64,
    triangles: f64,
}

/// Bytes at most while `path` is read.
pub(in crate::load) fn estimate(path: &Path, options: &LoadOptions) -> Option<LoadEstimate> {
    let (mut file, length) = open_file(path).ok()?;
    let (mut counts, mut seen, mut start) = (Counts::default(), 0, Vec::new());
    let pieces = if length <= SAMPLES * SAMPLE { 1 } else { SAMPLES };
    let size = if pieces == 1 { length } else { SAMPLE };
    for i in 0..pieces {
        let mut text = Vec::new();
        file.seek(SeekFrom::Start((length - size) / pieces.max(2).saturating_sub(1) * i)).ok()?;
        file.by_ref().take(size).read_to_end(&mut text).ok()?;
        seen += text.len() as u64;
        counts.add(&text);
        if i == 0 {
            start = text;
        }
    }
    let whole = length as f64 / (seen.max(1)) as f64;
    let made = if counts.normals == 0.0 { SMOOTHED } else { 0.0 };
    let meshes = counts.vertices * (VERTEX + made)
        + counts.texture_coordinates * TEXTURE_COORDINATE
        + counts.normals * NORMAL
        + counts.corners * CORNER
        + counts.triangles * TRIANGLE;
    let decoding = images(path, &start, options).map_or(0, |images| pictures(&images));
    Some(LoadEstimate { bytes: length + (whole * meshes) as u64 + decoding, left_over: 0, unmoved: 0 })
}

impl Counts {
    /// Adds the statements of `text`; what the cuts at its ends make of a line is one line in hundreds.
    fn add(&mut self, text: &[u8]) {
        for line in text.split(|&b| b == b'\n') {
            let line = line.trim_ascii_start();
            match (line.first(), line.get(1)) {
                (Some(b'v'), Some(b' ' | b'\t')) => self.vertices += 1.0,
                (Some(b'v'), Some(b't')) => self.texture_coordinates += 1.0,
                (Some(b'v'), Some(b'n')) => self.normals += 1.0,
                (Some(b'f'), Some(b' ' | b'\t')) => {
                    let words = line[1..].split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
                    let corners = words.count() as f64;
                    self.corners += corners;
                    self.triangles += (corners - 2.0).max(0.0);
                }
                _ => {}
            }
        }
    }
}

/// The pictures that the MTL files name which `start`, the beginning of the OBJ file, names.
fn images(path: &Path, start: &[u8], options: &LoadOptions) -> Option<Vec<Picture>> {
    let folders = Folders::new(path, options.asset_root.as_deref()).ok()?;
    let mut files: BTreeSet<PathBuf> = BTreeSet::new();
    for library in arguments(start, "mtllib") {
        let Ok(found) = folders.confine(&library) else { continue };
        if std::fs::metadata(&found).is_ok_and(|m| m.len() <= MOST_MTL) {
            let text = read_file(&found).ok()?;
            let folder = library.rsplit_once('/').map_or(String::new(), |(folder, _)| format!("{folder}/"));
            // Options stand before the name; a name with blanks is not found here, and counts for nothing.
            let names = ["map_", "bump", "norm", "disp", "refl"].into_iter().flat_map(|word| arguments(&text, word));
            let names: Vec<String> = names.filter_map(|n| Some(n.rsplit(' ').next()?.to_owned())).collect();
            files.extend(names.iter().filter_map(|name| folders.confine(&format!("{folder}{name}")).ok()));
        }
    }
    Some(files.iter().filter_map(|file| picture(file)).collect())
}

/// What follows statements that begin with `word`, backslashes as slashes.
fn arguments(text: &[u8], word: &str) -> Vec<String> {
    let text = String::from_utf8_lossy(text);
    let lines = text.lines().map(str::trim).filter(|line| line.starts_with(word));
    lines.filter_map(|line| Some(line.split_once([' ', '\t'])?.1.trim().replace('\\', "/"))).collect()
}

fn picture(path: &Path) -> Option<Picture> {
    let mut file = File::open(path).ok()?;
    let encoded = file.metadata().ok()?.len();
    let found = header(&mut |at, into| {
        file.seek(SeekFrom::Start(at)).ok()?;
        file.read_exact(into).ok()
    })?;
    Some(Picture { header: found, encoded, waits: false, used: Channels::RGB })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_are_counted_with_their_corners() {
        let mut counts = Counts::default();
        counts.add(b"v 0 1 2\n v\t1 2 3\nvt 0 0\nvn 0 0 1\nf 1 2 3\nf 1/1 2/2  3/3 4/4\r\n# v\nvp 1\no v\n");
        let expected = Counts { vertices: 2.0, texture_coordinates: 1.0, normals: 1.0, corners: 7.0, triangles: 3.0 };
        assert_eq!(counts, expected);
    }
}
