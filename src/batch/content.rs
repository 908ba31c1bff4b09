//! What is in files, as hashes: of the files that a scene was made from, and of those that were written.

use crate::scene::{SourceFile, Stamp};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

/// Bytes that are read at once: files may be larger than memory.
const PIECE: u64 = 256 << 10;

/// What is in a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Content {
    /// Length.
    pub bytes: u64,
    /// BLAKE3 of the bytes, 64 hexadecimal digits.
    pub blake3: String,
}

impl Content {
    /// Of bytes in memory.
    pub fn of(bytes: &[u8]) -> Self {
        Self { bytes: bytes.len() as u64, blake3: blake3::hash(bytes).to_hex().to_string() }
    }

    /// Of a regular file, and its stamp, which was the same before and after.
    fn read(path: &Path) -> io::Result<(Stamp, Self)> {
        let stamp = Stamp::of(path).ok_or_else(|| io::Error::other("is no regular file that can be read"))?;
        let mut file = File::open(path)?;
        let mut hasher = blake3::Hasher::new();
        let mut piece = vec![0; PIECE.min(stamp.bytes + 1) as usize];
        let mut bytes = 0;
        // One that grows while it is read need not be read to its end, which may never come.
        while bytes <= stamp.bytes {
            match file.read(&mut piece) {
                Ok(0) => break,
                Ok(count) => {
                    hasher.update(&piece[..count]);
                    bytes += count as u64;
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        if bytes != stamp.bytes || Stamp::of(path) != Some(stamp) {
            return Err(io::Error::other("changed while it was read"));
        }
        Ok((stamp, Self { bytes, blake3: hasher.finalize().to_hex().to_string() }))
    }
}

/// Contents of files that were hashed before: many images share textures. For one run; may be used by several threads.
#[derive(Debug, Default)]
pub struct HashCache {
    known: Mutex<HashMap<PathBuf, (Stamp, Content)>>,
}

impl HashCache {
    /// What is in the regular file `path` now, and its stamp. It is read unless it was before and its stamp is the same.
    ///
    /// # Errors
    /// It is no regular file, cannot be read, or is being written.
    pub fn content(&self, path: &Path) -> io::Result<(Stamp, Content)> {
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((stamp, content)) = known().get(path)
            && Stamp::of(path) == Some(*stamp)
        {
            return Ok((*stamp, content.clone()));
        }
        let now = SystemTime::now();
        let (stamp, content) = Content::read(path)?;
        if stamp.is_settled(now) {
            known().insert(path.to_owned(), (stamp, content.clone()));
        }
        Ok((stamp, content))
    }
}

/// A file that a scene was made from, as the JSON has it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputRecord {
    /// Where it was, for people; it is found again by its name.
    pub path: String,
    /// See [`SourceFile::name`].
    pub name: String,
    /// Length; `None`: it was looked for and was not there.
    pub bytes: Option<u64>,
    /// See [`Content::blake3`]; `None` with `bytes`.
    pub blake3: Option<String>,
}

impl InputRecord {
    /// What it held; `None`: it was not there.
    pub fn content(&self) -> Option<Content> {
        Some(Content { bytes: self.bytes?, blake3: self.blake3.clone()? })
    }
}

/// A file did not stay as it was while a scene was made from it.
#[derive(Debug)]
pub struct Changed {
    /// Which.
    pub path: PathBuf,
    /// Why it could not be hashed, if that was it.
    pub error: Option<io::Error>,
}

impl std::fmt::Display for Changed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: ", self.path.display())?;
        match &self.error {
            Some(error) => write!(f, "cannot be read a second time: {error}"),
            None => write!(f, "changed while it was read"),
        }
    }
}

impl std::error::Error for Changed {}

/// What was in `sources` when the scene was made from them, in their order. May take a while: reads all of them.
///
/// # Errors
/// The first that is not as it was before the loader read it, so that what the loader saw is not known.
pub fn hash_sources(sources: &[SourceFile], cache: &HashCache) -> Result<Vec<InputRecord>, Changed> {
    let record = |source: &SourceFile| {
        let mut record = InputRecord {
            path: source.path.display().to_string(),
            name: source.name.clone(),
            bytes: None,
            blake3: None,
        };
        // One that was not there is recorded as that, and if it has come since, the record does not fit any more.
        if let Some(stamp) = source.stamp {
            let changed = |error| Changed { path: source.path.clone(), error };
            let read = cache.content(&source.path);
            if Stamp::of(&source.path) != Some(stamp) {
                return Err(changed(None));
            }
            let (_, content) = read.map_err(|error| changed(Some(error)))?;
            (record.bytes, record.blake3) = (Some(content.bytes), Some(content.blake3));
        }
        Ok(record)
    };
    sources.iter().map(record).collect()
}

/// What was in a file of an option's when it was read; `file` is from before that.
///
/// # Errors
/// It did not stay as it was; the text names the option.
pub(super) fn content_of(option: &str, file: &SourceFile, cache: &HashCache) -> Result<Content, String> {
    let changed = |changed: Changed| format!("{option} {changed}\n  Run it again when it is complete.");
    let records = hash_sources(std::slice::from_ref(file), cache).map_err(changed)?;
    let content = records.first().and_then(InputRecord::content);
    // It was read, so it was there; a stamp is missing only where it came into being just then.
    content.ok_or_else(|| changed(Changed { path: file.path.clone(), error: None }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::time::Duration;

    fn aged(path: &Path, bytes: &[u8], seconds: u64) {
        fs::write(path, bytes).unwrap();
        let file = File::options().append(true).open(path).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(seconds)).unwrap();
    }

    #[test]
    fn the_hash_is_blake3_of_all_bytes_however_many_pieces_they_are() {
        // The first test vector of the BLAKE3 paper's repository: no bytes.
        assert_eq!(Content::of(b"").blake3, "af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262");
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("a");
        for length in [0, 1, PIECE - 1, PIECE, PIECE + 1, 3 * PIECE + 7] {
            let bytes: Vec<u8> = (0..length).map(|i| (i * i / 251) as u8).collect();
            fs::write(&path, &bytes).unwrap();
            assert_eq!(HashCache::default().content(&path).unwrap().1, Content::of(&bytes), "{length}");
        }
    }

    #[test]
    fn a_file_with_the_same_stamp_is_not_read_again() {
        let (root, cache) = (tempfile::tempdir().unwrap(), HashCache::default());
        let path = root.path().join("a");
        aged(&path, b"one", 60);
        let (stamp, content) = cache.content(&path).unwrap();
        // A planted content shows which answers come from the cache.
        let planted = Content::of(b"planted");
        cache.known.lock().unwrap().insert(path.clone(), (stamp, planted.clone()));
        assert_eq!(cache.content(&path).unwrap(), (stamp, planted));
        aged(&path, b"two", 50);
        let (_, changed) = cache.content(&path).unwrap();
        assert_eq!(changed, Content::of(b"two"));
        assert_ne!(changed, content);
    }

    #[test]
    fn a_file_that_was_just_written_is_not_kept_in_the_cache() {
        let (root, cache) = (tempfile::tempdir().unwrap(), HashCache::default());
        let (new, old) = (root.path().join("new"), root.path().join("old"));
        aged(&new, b"one", 0);
        aged(&old, b"one", 60);
        for path in [&new, &old] {
            assert_eq!(cache.content(path).unwrap().1, Content::of(b"one"));
        }
        assert!(cache.known.lock().unwrap().keys().eq([&old]));
    }

    #[test]
    fn what_changed_since_the_loader_saw_it_is_an_error_and_what_was_missing_is_recorded_so() {
        let (root, cache) = (tempfile::tempdir().unwrap(), HashCache::default());
        let path = root.path().join("a");
        aged(&path, b"one", 60);
        let source = SourceFile::input(&path);
        let missing = SourceFile { path: root.path().join("b"), name: "b".into(), stamp: None };
        let records = hash_sources(&[source.clone(), missing.clone()], &cache).unwrap();
        assert_eq!((records[0].content(), records[1].content()), (Some(Content::of(b"one")), None));

        aged(&path, b"two", 60);
        let error = hash_sources(&[missing.clone(), source.clone()], &cache).unwrap_err();
        assert_eq!(error.to_string(), format!("{}: changed while it was read", path.display()));
        fs::remove_file(&path).unwrap();
        let error = hash_sources(&[source], &cache).unwrap_err().to_string();
        assert!(error.ends_with("a: changed while it was read"), "{error}");
        // It has come since: recorded as it was seen.
        fs::write(&missing.path, "").unwrap();
        assert_eq!(hash_sources(&[missing], &cache).unwrap()[0].content(), None);
    }
}
