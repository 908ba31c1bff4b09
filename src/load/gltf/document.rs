//! A file's JSON, parsed, and the way to everything that it refers to.

use super::buffer::Store;
use super::container::{self, Container};
use super::uri::Resolver;
use super::{LoadError, Result};
use crate::error::SourceLoc;
use crate::scene::SourceFile;
use gltf::json::Root;
use serde_json::Value;
use serde_json::error::Category;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};

/// A parsed file. Nothing in `root` is validated yet: look things up with `Document::item`.
pub(super) struct Document {
    /// The input as the user named it.
    pub file: PathBuf,
    /// Typed JSON, indices unchecked.
    pub root: Root,
    /// Where URIs may lead.
    pub uris: Resolver,
    /// The input itself, as it was before it was read.
    pub source: SourceFile,
    /// Buffers opened so far, one cell per `/buffers/i`.
    pub buffers: Vec<OnceLock<Store>>,
    /// Number of animations; see `animation`.
    pub animations: usize,
    /// Extensions that are ignored were noted for one moment, which is enough.
    pub is_noted: std::sync::atomic::AtomicBool,
    /// About the container.
    pub warnings: Vec<String>,
    /// Extensions that reached objects carry and that are not read: first place, how many places.
    pub ignored: Mutex<BTreeMap<String, (String, usize)>>,
    /// The JSON with what an animation has set in it by pointers, once it has.
    pub posed: Option<Value>,
    pub(super) json: Vec<u8>,
    bin: Option<Range<u64>>,
}

impl Document {
    /// Reads and parses the JSON of `file`.
    pub fn open(file: &Path, asset_root: Option<&Path>) -> Result<Self> {
        let source = SourceFile::input(file);
        let Container { json, bin, warnings } = container::read(file)?;
        let (root, animations) = parse(file, &json)?;
        let uris = Resolver::new(file, asset_root)?;
        let buffers = root.buffers.iter().map(|_| OnceLock::new()).collect();
        let ignored = Mutex::default();
        let (posed, is_noted) = (None, Default::default());
        Ok(Self {
            file: file.to_owned(),
            root,
            uris,
            source,
            buffers,
            animations,
            warnings,
            ignored,
            is_noted,
            posed,
            json,
            bin,
        })
    }

    /// Looks for every file that the document names. Which of them a moment needs depends on the time, and what a frame is
    /// made from must not depend on the frames before it.
    pub fn look_for_all(&self) {
        let uris = (self.root.buffers.iter().map(|b| &b.uri)).chain(self.root.images.iter().map(|i| &i.uri)).flatten();
        for uri in uris.filter(|uri| !uri.get(..5).is_some_and(|s| s.eq_ignore_ascii_case("data:"))) {
            // What is wrong with it is said by who needs it.
            let _ = self.resolve("", uri);
        }
    }

    /// Where in the file the BIN chunk of a `.glb` is.
    pub fn bin(&self) -> Option<Range<u64>> {
        self.bin.clone()
    }

    /// The files that were looked for so far, the input first.
    pub fn sources(&self) -> Vec<SourceFile> {
        let mut sources = vec![self.source.clone()];
        sources.extend(self.uris.sources());
        sources
    }

    /// The JSON text.
    pub fn json(&self) -> &[u8] {
        &self.json
    }

    /// Whether the file says that it uses an extension.
    pub fn uses(&self, extension: &str) -> bool {
        self.root.extensions_used.iter().chain(&self.root.extensions_required).any(|name| name == extension)
    }
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
/// `node` in every animation target (KHR_animation_pointer has none), and we read animations ourselves.
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

    #[test]
    fn scene_without_nodes_and_pointer_animation_parse() {
        let json = br#"{"asset":{"version":"2.0"},"scenes":[{}],"animations":[{"samplers":[],"channels":
            [{"sampler":0,"target":{"path":"pointer"}}]}]}"#;
        let (root, animations) = parse(Path::new("a.gltf"), json).unwrap();
        assert_eq!((root.scenes.len(), animations), (1, 1));
    }
}
