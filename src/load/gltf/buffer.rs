//! Buffers and buffer views: found and measured first, read range by range when something that is drawn needs them.
//! Reads are positioned reads of files, not memory maps: a file that another process cuts short is an error, not a
//! signal.

use super::Result;
use super::document::Document;
use super::uri::Source;
use crate::load::folders::open_file;
use gltf::json::Index;
use gltf::json::buffer::{Buffer, View};
use gltf::json::validation::USize64;
use std::borrow::Cow;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::PathBuf;

/// Where the bytes of a buffer are.
#[derive(Debug)]
pub(super) enum Store {
    /// Here: a data URI, decoded.
    Bytes(Vec<u8>),
    /// In a file, opened anew for each read: the number of open files has a limit, the number of buffers has none.
    File {
        /// Proven to be allowed.
        path: PathBuf,
        /// First byte of the buffer.
        start: u64,
        /// Bytes from there on.
        length: u64,
    },
}

impl Store {
    fn length(&self) -> u64 {
        match self {
            Self::Bytes(bytes) => bytes.len() as u64,
            Self::File { length, .. } => *length,
        }
    }
}

/// A range of a buffer that is known to exist, not yet read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span<'d> {
    store: &'d Store,
    start: u64,
    /// Bytes.
    pub length: u64,
}

impl<'d> Span<'d> {
    /// The `length` bytes from `start` on; `None` if that is more than there is.
    pub fn part(self, start: u64, length: u64) -> Option<Self> {
        let end = start.checked_add(length)?;
        (end <= self.length).then_some(Self { start: self.start + start, length, ..self })
    }

    /// Reads from the first byte on.
    pub fn reader(self) -> std::io::Result<Reader<'d>> {
        match self.store {
            Store::Bytes(bytes) => {
                let start = usize::try_from(self.start).unwrap_or(usize::MAX);
                let length = usize::try_from(self.length).unwrap_or(usize::MAX);
                let bytes = bytes.get(start..).and_then(|b| b.get(..length)).unwrap_or_default();
                Ok(Reader::Bytes(bytes))
            }
            Store::File { path, start, .. } => {
                let mut file = File::open(path)?;
                file.seek(SeekFrom::Start(start + self.start))?;
                Ok(Reader::File(file.take(self.length)))
            }
        }
    }

    /// All of it.
    pub fn bytes(self) -> std::io::Result<Cow<'d, [u8]>> {
        match self.reader()? {
            Reader::Bytes(bytes) => Ok(Cow::Borrowed(bytes)),
            Reader::File(mut file) => {
                let mut bytes = vec![0; usize::try_from(self.length).map_err(std::io::Error::other)?];
                file.read_exact(&mut bytes)?;
                Ok(Cow::Owned(bytes))
            }
        }
    }
}

/// The bytes of a span, one after the other.
pub(super) enum Reader<'d> {
    /// Already here.
    Bytes(&'d [u8]),
    /// From a file.
    File(std::io::Take<File>),
}

impl Read for Reader<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        match self {
            Self::Bytes(bytes) => bytes.read(out),
            Self::File(file) => file.read(out),
        }
    }
}

impl Document {
    /// Where a buffer view is, and the view; `pointer` is where the index was found.
    pub fn span(&self, index: Index<View>, pointer: &str) -> Result<(Span<'_>, &View)> {
        let view = self.item(&self.root.buffer_views, index, pointer, "bufferViews")?;
        let at = format!("/bufferViews/{}", index.value());
        let buffer = self.buffer(view.buffer, &format!("{at}/buffer"))?;
        let start = view.byte_offset.unwrap_or(USize64(0)).0;
        let span = buffer.part(start, view.byte_length.0).ok_or_else(|| {
            let problem = format!(
                "byteOffset {start} + byteLength {} is past the end of buffer {}",
                view.byte_length.0,
                view.buffer.value()
            );
            self.error(at, problem, format!("The buffer has {} bytes.", buffer.length))
        })?;
        Ok((span, view))
    }

    /// The bytes of a buffer view and the view; `pointer` is where the index was found.
    pub fn view(&self, index: Index<View>, pointer: &str) -> Result<(Cow<'_, [u8]>, &View)> {
        let (span, view) = self.span(index, pointer)?;
        Ok((span.bytes().map_err(|why| self.unreadable(pointer, &why))?, view))
    }

    /// An error about bytes that were found and then could not be read.
    pub fn unreadable(&self, pointer: &str, why: &std::io::Error) -> crate::error::LoadError {
        self.error(pointer, format!("its bytes cannot be read: {why}"), "Was the file changed in the meantime?")
    }

    /// The `byteLength` bytes of a buffer.
    fn buffer(&self, index: Index<Buffer>, pointer: &str) -> Result<Span<'_>> {
        let buffer = self.item(&self.root.buffers, index, pointer, "buffers")?;
        let cell = self.item(&self.buffers, index, pointer, "buffers")?;
        let store = match cell.get() {
            Some(store) => store,
            None => {
                let store = self.locate(buffer, index.value())?;
                cell.get_or_init(|| store)
            }
        };
        let length = buffer.byte_length.0;
        Span { store, start: 0, length: store.length() }.part(0, length).ok_or_else(|| {
            let problem = format!("{length} but the data has {} bytes", store.length());
            let fix = "The data is cut short: export or copy it again.";
            self.error(format!("/buffers/{}/byteLength", index.value()), problem, fix)
        })
    }

    /// Where the bytes of buffer `i` are.
    fn locate(&self, buffer: &Buffer, i: usize) -> Result<Store> {
        let at = format!("/buffers/{i}");
        let Some(uri) = &buffer.uri else {
            return match self.bin() {
                Some(bin) if i == 0 => {
                    Ok(Store::File { path: self.file.clone(), start: bin.start, length: bin.end - bin.start })
                }
                _ => {
                    let others = buffer.extensions.iter().flat_map(|e| e.others.keys()).next();
                    let problem = match others {
                        None => "has no uri".to_owned(),
                        Some(name) => format!("has no uri but the extension {name}, which is not built yet"),
                    };
                    Err(self.error(&at, problem, "Only buffer 0 of a .glb with a BIN chunk may go without a uri."))
                }
            };
        };
        let pointer = format!("{at}/uri");
        match self.resolve(&pointer, uri)? {
            Source::Data(bytes, _) => Ok(Store::Bytes(bytes)),
            Source::File(path) => match open_file(&path) {
                Ok((_, length)) => Ok(Store::File { path, start: 0, length }),
                Err(why) => Err(self.error(pointer, format!("{}: {why}", path.display()), "")),
            },
        }
    }
}
