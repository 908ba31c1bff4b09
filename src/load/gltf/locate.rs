//! Where something is in the file, and errors that say so.

use super::Result;
use super::document::Document;
use crate::error::{LoadError, SourceLoc};
use gltf::json::Index;
use serde_json::Value;

/// Values longer than this are shortened in messages.
const SHOWN_CHARS: usize = 60;

impl Document {
    /// An error at a JSON pointer.
    pub fn error(&self, pointer: impl Into<String>, problem: impl Into<String>, fix: impl Into<String>) -> LoadError {
        LoadError::new(SourceLoc::at(&self.file, pointer), problem, fix)
    }

    /// An error about the value at `pointer`, which is shown: `VALUE why`, then what is allowed.
    pub fn bad(&self, pointer: &str, why: &str, fix: impl Into<String>) -> LoadError {
        self.error(pointer, format!("{} {why}", self.shown(pointer)), fix)
    }

    /// What `index` (found at `pointer`) points to in `list`; `kind` names the list in the message.
    pub fn item<'a, T, U>(&self, list: &'a [T], index: Index<U>, pointer: &str, kind: &str) -> Result<&'a T> {
        list.get(index.value()).ok_or_else(|| {
            let allowed = match list.len() {
                0 => format!("The file has no {kind}."),
                1 => "The file has 1 of them: only 0 is allowed.".to_owned(),
                n => format!("The file has {n} of them: 0 to {} are allowed.", n - 1),
            };
            self.bad(pointer, &format!("is not an index into {kind}"), allowed)
        })
    }

    /// The JSON value at a pointer as it is in the file, shortened; only for messages: it parses the file again.
    pub fn shown(&self, pointer: &str) -> String {
        let parsed: Option<Value> = match self.posed {
            Some(_) => None,
            None => serde_json::from_slice(self.json()).ok(),
        };
        match self.posed.as_ref().or(parsed.as_ref()).and_then(|v| v.pointer(pointer)) {
            None => "(absent)".into(),
            Some(value) => shorten(&value.to_string()),
        }
    }
}

/// At most [`SHOWN_CHARS`] characters of `text`.
pub(super) fn shorten(text: &str) -> String {
    match text.char_indices().nth(SHOWN_CHARS) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}...", text.get(..end).unwrap_or_default()),
    }
}
