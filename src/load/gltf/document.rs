//! Bytes to parsed JSON: `.gltf` text or the `.glb` container (glTF 2.0 specification, section 4.4).

use super::uri::Resolver;
use super::{LoadError, Result};
use crate::error::SourceLoc;
use gltf::json::Root;
use serde_json::Value;
use serde_json::error::Category;
use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 4] = b"glTF";
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BIN: u32 = 0x004E_4942;

/// A parsed file. Nothing in `root` is validated yet: look things up with `Document::item`.
pub(super) struct Document {
    /// The input as the user named it.
    pub file: PathBuf,
    /// Typed JSON, indices unchecked.
    pub root: Root,
    /// Where URIs may lead.
    pub uris: Resolver,
    /// Buffers opened so far, one cell per `/buffers/i`.
    pub buffers: Vec<OnceCell<Vec<u8>>>,
    /// Number of animations, none of which is read.
    pub animations: usize,
    /// About the container.
    pub warnings: Vec<String>,
    /// Extensions that reached objects carry and that are not read: first place, how many places.
    pub ignored: RefCell<BTreeMap<String, (String, usize)>>,
    bytes: Vec<u8>,
    container: Container,
}

/// Where the parts lie in the file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Container {
    json: Range<usize>,
    bin: Option<Range<usize>>,
    warnings: Vec<String>,
}

impl Document {
    /// Reads and parses `file`.
    pub fn open(file: &Path, asset_root: Option<&Path>) -> Result<Self> {
        let whole = |problem: String, fix: &str| LoadError::new(SourceLoc::file(file), problem, fix);
        let bytes = read_file(file).map_err(|why| whole(format!("cannot be read: {why}"), ""))?;
        let container = split(file, &bytes)?;
        let json = bytes.get(container.json.clone()).unwrap_or_default();
        let (root, animations) = parse(file, json)?;
        let uris = Resolver::new(file, asset_root)?;
        let buffers = root.buffers.iter().map(|_| OnceCell::new()).collect();
        let warnings = container.warnings.clone();
        let ignored = RefCell::default();
        Ok(Self { file: file.to_owned(), root, uris, buffers, animations, warnings, ignored, bytes, container })
    }

    /// The BIN chunk of a `.glb`.
    pub fn bin(&self) -> Option<&[u8]> {
        self.bytes.get(self.container.bin.clone()?)
    }

    /// The JSON text.
    pub fn json(&self) -> &[u8] {
        self.bytes.get(self.container.json.clone()).unwrap_or_default()
    }
}

/// The bytes of a regular file; anything else (a folder, a pipe that would block) is an error.
pub(super) fn read_file(path: &Path) -> std::result::Result<Vec<u8>, String> {
    let meta = std::fs::metadata(path).map_err(|e| e.to_string())?;
    if !meta.is_file() {
        return Err("not a regular file".into());
    }
    std::fs::read(path).map_err(|e| e.to_string())
}

/// Finds the JSON and BIN parts.
fn split(file: &Path, bytes: &[u8]) -> Result<Container> {
    let fail = |place: &str, problem: String, fix: &str| LoadError::new(SourceLoc::at(file, place), problem, fix);
    if bytes.is_empty() {
        return Err(fail("", "is empty (0 bytes)".into(), "Was the export or the copy interrupted?"));
    }
    if bytes.starts_with(MAGIC) {
        return split_glb(file, bytes);
    }
    if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb")) {
        let found: Vec<u8> = bytes.iter().take(4).copied().collect();
        return Err(fail(
            "byte 0",
            format!("does not start with \"glTF\" but with \"{}\"", found.escape_ascii()),
            "A .glb file starts with the four letters glTF. Is it JSON text? Then name it .gltf.",
        ));
    }
    let mut container = Container { json: 0..bytes.len(), ..Container::default() };
    if bytes.starts_with(b"\xEF\xBB\xBF") {
        container.json.start = 3;
        container.warnings.push("the file starts with a byte order mark, which glTF does not allow: ignored".into());
    }
    Ok(container)
}

/// The chunks of a binary file: a header of 12 bytes, then (length, type, data) each.
fn split_glb(file: &Path, bytes: &[u8]) -> Result<Container> {
    let fail = |at: usize, problem: String, fix: &str| {
        Err(LoadError::new(SourceLoc::at(file, format!("byte {at}")), problem, fix))
    };
    const CUT: &str = "The file is cut short or damaged: export or copy it again.";
    let word = |at: usize| {
        let four = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(four.try_into().ok()?))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return fail(bytes.len(), format!("the file ends inside the header: {} of 12 bytes", bytes.len()), CUT);
    };
    if version != 2 {
        return fail(4, format!("container version {version}"), "Only version 2 (glTF 2.0) is read. Convert the file.");
    }
    let length = length as usize;
    if length > bytes.len() {
        return fail(8, format!("length {length} but the file has {} bytes", bytes.len()), CUT);
    }
    let mut container = Container::default();
    if length < bytes.len() {
        let extra = bytes.len() - length;
        container.warnings.push(format!("{extra} bytes after the end that the header names: ignored"));
    }
    let (mut at, mut n) = (12, 0);
    while at < length {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
            return fail(at, format!("the file ends inside the header of chunk {n}"), CUT);
        };
        let start = at + 8;
        let end = match start.checked_add(size as usize) {
            Some(end) if end <= length => end,
            _ => {
                let left = length.saturating_sub(start);
                return fail(at, format!("chunk {n} has length {size} but only {left} bytes follow"), CUT);
            }
        };
        match (n, kind) {
            (0, CHUNK_JSON) => container.json = start..end,
            (0, _) => return fail(at + 4, format!("chunk 0 has type {kind:#010x}"), "It must be JSON (0x4e4f534a)."),
            (1, CHUNK_BIN) => container.bin = Some(start..end),
            _ => {} // Unknown chunks are to be ignored (section 4.4.3).
        }
        (at, n) = (end, n + 1);
    }
    if n == 0 {
        return fail(12, "there is no JSON chunk".into(), CUT);
    }
    Ok(container)
}

/// Typed JSON and the number of animations.
fn parse(file: &Path, json: &[u8]) -> Result<(Root, usize)> {
    let error = match Root::from_slice(json) {
        Ok(root) => {
            let animations = root.animations.len();
            return Ok((root, animations));
        }
        Err(error) => error,
    };
    if error.classify() == Category::Data
        && let Some(relaxed) = relax(json)
    {
        return Ok(relaxed);
    }
    let place = format!("{}:{}", error.line(), error.column());
    let text = error.to_string();
    let what = text.split(" at line ").next().unwrap_or(&text);
    let (problem, fix) = match error.classify() {
        Category::Eof => {
            (format!("the JSON ends too early: {what}"), "The file is cut short: export or copy it again.")
        }
        Category::Data => (format!("not as glTF 2.0 has it: {what}"), "Correct the file or export it again."),
        _ => (format!("not JSON: {what}"), "Correct the file or export it again."),
    };
    Err(LoadError::new(SourceLoc::at(file, place), problem, fix))
}

/// Parses again where the `gltf` crate asks for more than the specification: it wants `nodes` in every scene and a
/// `node` in every animation target (KHR_animation_pointer has none), and we read no animation at all.
fn relax(json: &[u8]) -> Option<(Root, usize)> {
    let mut value: Value = serde_json::from_slice(json).ok()?;
    let top = value.as_object_mut()?;
    let animations = match top.remove("animations") {
        None => 0,
        Some(list) => list.as_array()?.len(),
    };
    if let Some(scenes) = top.get_mut("scenes") {
        for scene in scenes.as_array_mut()? {
            scene.as_object_mut()?.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    Root::from_slice(&serde_json::to_vec(&value).ok()?).ok().map(|root| (root, animations))
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn glb_is_split_into_json_and_bin() {
        let bytes = glb("{}  ", &[1, 2, 3, 4]);
        let parts = split(Path::new("a.glb"), &bytes).unwrap();
        assert_eq!(&bytes[parts.json], b"{}  ");
        assert_eq!(&bytes[parts.bin.unwrap()], &[1, 2, 3, 4]);
    }

    #[test]
    fn every_truncation_of_a_glb_is_an_error() {
        let bytes = glb("{}  ", &[1, 2, 3, 4]);
        for n in 0..bytes.len() {
            assert!(split(Path::new("a.glb"), &bytes[..n]).is_err(), "{n} bytes");
        }
    }

    #[test]
    fn scene_without_nodes_and_pointer_animation_parse() {
        let json = br#"{"asset":{"version":"2.0"},"scenes":[{}],"animations":[{"samplers":[],"channels":
            [{"sampler":0,"target":{"path":"pointer"}}]}]}"#;
        let (root, animations) = parse(Path::new("a.gltf"), json).unwrap();
        assert_eq!((root.scenes.len(), animations), (1, 1));
    }
}
