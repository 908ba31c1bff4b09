//! The `.glb` container and bare JSON (glTF 2.0 specification, section 4.4). Only the JSON is read here; of the BIN
//! chunk the place is noted, and its bytes are read when something that is drawn needs them.

use super::{LoadError, Result};
use crate::error::SourceLoc;
use crate::load::folders::open_file;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

const MAGIC: &[u8; 4] = b"glTF";
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BIN: u32 = 0x004E_4942;
const CUT: &str = "The file is cut short or damaged: export or copy it again.";

/// The parts of a file.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Container {
    /// The JSON text.
    pub json: Vec<u8>,
    /// Where in the file the BIN chunk's data are.
    pub bin: Option<Range<u64>>,
    /// About the container.
    pub warnings: Vec<String>,
}

/// Reads the JSON of `path` and finds its BIN chunk.
pub(super) fn read(path: &Path) -> Result<Container> {
    let unreadable = |why: String| LoadError::new(SourceLoc::file(path), format!("cannot be read: {why}"), "");
    let (mut file, length) = open_file(path).map_err(unreadable)?;
    Input { path, file: &mut file, length }.container()
}

/// Bytes of the JSON of `path` as its header has it, without reading it; `None` if it cannot be read.
pub(super) fn json_length(path: &Path) -> Option<u64> {
    let (mut file, length) = open_file(path).ok()?;
    let mut header = [0; 16];
    match file.read_exact(&mut header) {
        Ok(()) if header.starts_with(MAGIC) => {
            let [.., a, b, c, d] = header;
            Some(u64::from(u32::from_le_bytes([a, b, c, d])).min(length))
        }
        _ => Some(length),
    }
}

/// A file that is being taken apart.
struct Input<'a, F> {
    /// For messages.
    path: &'a Path,
    file: &'a mut F,
    length: u64,
}

impl<F: Read + Seek> Input<'_, F> {
    fn fail<T>(&self, at: u64, problem: String, fix: &str) -> Result<T> {
        Err(LoadError::new(SourceLoc::at(self.path, format!("byte {at}")), problem, fix))
    }

    /// The bytes `range`, which is inside the file.
    fn bytes(&mut self, range: Range<u64>) -> Result<Vec<u8>> {
        let read = |file: &mut F| {
            file.seek(SeekFrom::Start(range.start))?;
            let mut bytes = Vec::with_capacity(usize::try_from(range.end - range.start).unwrap_or(0));
            file.by_ref().take(range.end - range.start).read_to_end(&mut bytes)?;
            Ok(bytes)
        };
        let read: std::io::Result<Vec<u8>> = read(self.file);
        match read {
            Ok(bytes) if bytes.len() as u64 == range.end - range.start => Ok(bytes),
            Ok(bytes) => self.fail(range.start + bytes.len() as u64, "the file became shorter".into(), CUT),
            Err(why) => self.fail(range.start, format!("cannot be read: {why}"), ""),
        }
    }

    /// N words of 32 bits, if the file has them.
    fn words<const N: usize>(&mut self, at: u64) -> Result<Option<[u32; N]>> {
        let end = at.saturating_add(4 * N as u64);
        if end > self.length {
            return Ok(None);
        }
        let bytes = self.bytes(at..end)?;
        let mut words = bytes.as_chunks::<4>().0.iter().map(|w| u32::from_le_bytes(*w));
        Ok(Some(std::array::from_fn(|_| words.next().unwrap_or(0))))
    }

    fn container(&mut self) -> Result<Container> {
        if self.length == 0 {
            let fix = "Was the export or the copy interrupted?";
            return Err(LoadError::new(SourceLoc::file(self.path), "is empty (0 bytes)", fix));
        }
        let start = self.bytes(0..self.length.min(4))?;
        if start == MAGIC {
            return self.chunks();
        }
        if self.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb")) {
            let problem = format!("does not start with \"glTF\" but with \"{}\"", start.escape_ascii());
            let fix = "A .glb file starts with the four letters glTF. Is it JSON text? Then name it .gltf.";
            return self.fail(0, problem, fix);
        }
        let mut container = Container { json: self.bytes(0..self.length)?, ..Container::default() };
        if container.json.starts_with(b"\xEF\xBB\xBF") {
            container.json.drain(..3);
            let text = "the file starts with a byte order mark, which glTF does not allow: ignored";
            container.warnings.push(text.into());
        }
        Ok(container)
    }

    /// The chunks of a binary file: a header of 12 bytes, then (length, type, data) each.
    fn chunks(&mut self) -> Result<Container> {
        let Some([_, version, length]) = self.words::<3>(0)? else {
            let problem = format!("the file ends inside the header: {} of 12 bytes", self.length);
            return self.fail(self.length, problem, CUT);
        };
        if version != 2 {
            let fix = "Only version 2 (glTF 2.0) is read. Convert the file.";
            return self.fail(4, format!("container version {version}"), fix);
        }
        let length = u64::from(length);
        if length > self.length {
            return self.fail(8, format!("length {length} but the file has {} bytes", self.length), CUT);
        }
        let mut container = Container::default();
        if length < self.length {
            let extra = self.length - length;
            container.warnings.push(format!("{extra} bytes after the end that the header names: ignored"));
        }
        self.length = length;
        let (mut at, mut n) = (12, 0);
        while at < length {
            let Some([size, kind]) = self.words::<2>(at)? else {
                return self.fail(at, format!("the file ends inside the header of chunk {n}"), CUT);
            };
            let (start, size) = (at + 8, u64::from(size));
            if size > length - start {
                let problem = format!("chunk {n} has length {size} but only {} bytes follow", length - start);
                return self.fail(at, problem, CUT);
            }
            let end = start + size;
            match (n, kind) {
                (0, CHUNK_JSON) => container.json = self.bytes(start..end)?,
                (0, _) => {
                    let problem = format!("chunk 0 has type {kind:#010x}");
                    return self.fail(at + 4, problem, "It must be JSON (0x4e4f534a).");
                }
                (1, CHUNK_BIN) => container.bin = Some(start..end),
                _ => {} // Unknown chunks are to be ignored (section 4.4.3).
            }
            (at, n) = (end, n + 1);
        }
        if n == 0 {
            return self.fail(12, "there is no JSON chunk".into(), CUT);
        }
        Ok(container)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
        let mut out = Vec::from(*MAGIC);
        let total = 12 + 8 + json.len() + 8 + bin.len();
        for word in [2, total as u32, json.len() as u32, CHUNK_JSON] {
            out.extend(word.to_le_bytes());
        }
        out.extend(json.as_bytes());
        for word in [bin.len() as u32, CHUNK_BIN] {
            out.extend(word.to_le_bytes());
        }
        out.extend(bin);
        out
    }

    fn split(bytes: &[u8]) -> Result<Container> {
        Input { path: Path::new("a.glb"), file: &mut Cursor::new(bytes), length: bytes.len() as u64 }.container()
    }

    #[test]
    fn glb_is_split_into_json_and_bin() {
        let bytes = glb("{}  ", &[1, 2, 3, 4]);
        let parts = split(&bytes).unwrap();
        assert_eq!(parts.json, b"{}  ");
        let bin = parts.bin.unwrap();
        assert_eq!(&bytes[bin.start as usize..bin.end as usize], &[1, 2, 3, 4]);
    }

    #[test]
    fn every_truncation_of_a_glb_is_an_error() {
        let bytes = glb("{}  ", &[1, 2, 3, 4]);
        for n in 0..bytes.len() {
            assert!(split(&bytes[..n]).is_err(), "{n} bytes");
        }
    }

    #[test]
    fn file_that_shrinks_while_it_is_read_is_an_error() {
        let bytes = glb("{}  ", &[1, 2, 3, 4]);
        let cut = &bytes[..22];
        let mut file = Cursor::new(cut);
        let error = Input { path: Path::new("a.glb"), file: &mut file, length: bytes.len() as u64 }.container();
        assert!(error.unwrap_err().problem.contains("became shorter"));
    }
}
