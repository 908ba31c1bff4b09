//! Buffers and buffer views, opened when something that is drawn needs them.

use super::Result;
use super::document::{Document, read_file};
use super::uri::Source;
use gltf::json::Index;
use gltf::json::buffer::{Buffer, View};
use gltf::json::validation::USize64;

impl Document {
    /// The bytes of a buffer view and the view; `pointer` is where the index was found.
    pub fn view(&self, index: Index<View>, pointer: &str) -> Result<(&[u8], &View)> {
        let view = self.item(&self.root.buffer_views, index, pointer, "bufferViews")?;
        let at = format!("/bufferViews/{}", index.value());
        let buffer = self.buffer(view.buffer, &format!("{at}/buffer"))?;
        let start = view.byte_offset.unwrap_or(USize64(0)).0;
        let range = start.checked_add(view.byte_length.0).and_then(|end| usize_range(start, end));
        let bytes = range.and_then(|range| buffer.get(range)).ok_or_else(|| {
            let problem = format!(
                "byteOffset {start} + byteLength {} is past the end of buffer {}",
                view.byte_length.0,
                view.buffer.value()
            );
            self.error(at, problem, format!("The buffer has {} bytes.", buffer.len()))
        })?;
        Ok((bytes, view))
    }

    /// The `byteLength` bytes of a buffer.
    fn buffer(&self, index: Index<Buffer>, pointer: &str) -> Result<&[u8]> {
        let buffer = self.item(&self.root.buffers, index, pointer, "buffers")?;
        let at = format!("/buffers/{}", index.value());
        let bytes = match (&buffer.uri, self.buffers.get(index.value())) {
            (Some(uri), Some(cell)) => match cell.get() {
                Some(bytes) => bytes.as_slice(),
                None => {
                    let bytes = self.fetch(&format!("{at}/uri"), uri)?;
                    cell.get_or_init(|| bytes).as_slice()
                }
            },
            _ => self.bin().filter(|_| index.value() == 0).ok_or_else(|| {
                let others = buffer.extensions.iter().flat_map(|e| e.others.keys()).next();
                let problem = match others {
                    None => "has no uri".to_owned(),
                    Some(name) => format!("has no uri but the extension {name}, which is not built yet"),
                };
                self.error(&at, problem, "Only buffer 0 of a .glb with a BIN chunk may go without a uri.")
            })?,
        };
        let length = buffer.byte_length.0;
        usize::try_from(length).ok().and_then(|n| bytes.get(..n)).ok_or_else(|| {
            let problem = format!("{length} but the data has {} bytes", bytes.len());
            self.error(format!("{at}/byteLength"), problem, "The data is cut short: export or copy it again.")
        })
    }

    /// The bytes behind the URI at `pointer`.
    pub fn fetch(&self, pointer: &str, uri: &str) -> Result<Vec<u8>> {
        match self.resolve(pointer, uri)? {
            Source::Data(bytes, _) => Ok(bytes),
            Source::File(path) => {
                read_file(&path).map_err(|why| self.error(pointer, format!("{}: {why}", path.display()), ""))
            }
        }
    }
}

fn usize_range(start: u64, end: u64) -> Option<std::ops::Range<usize>> {
    Some(usize::try_from(start).ok()?..usize::try_from(end).ok()?)
}
