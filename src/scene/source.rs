//! The files that a scene was made from: what has to be the same for the scene to be the same.

use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// A file that a loader read, or looked for in vain: a missing texture that appears changes the picture too.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceFile {
    /// As opened, links followed; of a missing file, where it would have been.
    pub path: PathBuf,
    /// As the input names it: relative to the input's folder, `/` between folders, escapes replaced; empty for the input
    /// itself. The same on every machine.
    pub name: String,
    /// What it was like just before it was read; `None`: there is no such file, or it may not be read.
    pub stamp: Option<Stamp>,
}

impl SourceFile {
    /// The file that is to be read as the input itself.
    pub fn input(path: &Path) -> Self {
        Self { path: path.to_owned(), name: String::new(), stamp: Stamp::of(path) }
    }
}

/// What the system says about a regular file: equal stamps before and after reading mean that nothing wrote to it in
/// between, as finely as the system's clock for files ticks (some milliseconds at worst).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Length.
    pub bytes: u64,
    modified: Option<SystemTime>,
    identity: Identity,
}

/// Device, file and time of the last change to any of its properties (seconds, nanoseconds): these tell a file that was
/// put in another's place with the other's time, as `cp -p` and `mv` do.
#[cfg(unix)]
type Identity = (u64, u64, i64, i64);
#[cfg(not(unix))]
type Identity = ();

impl Stamp {
    /// The stamp of a regular file, links followed; `None` of anything else: nothing that could block is ever opened.
    pub fn of(path: &Path) -> Option<Self> {
        let meta = std::fs::metadata(path).ok()?;
        let stamp = || Self { bytes: meta.len(), modified: meta.modified().ok(), identity: identity(&meta) };
        meta.is_file().then(stamp)
    }

    /// Whether a later change is sure to move the stamp: the last one was some time before `now`.
    pub fn is_settled(&self, now: SystemTime) -> bool {
        self.modified.is_some_and(|modified| now.duration_since(modified).is_ok_and(|age| age > SETTLING))
    }
}

/// Files that were written less than this long ago may be written again within one tick of the clock for files: that of
/// FAT ticks every 2 s, the others more finely.
const SETTLING: Duration = Duration::from_secs(2);

#[cfg(unix)]
fn identity(meta: &Metadata) -> Identity {
    use std::os::unix::fs::MetadataExt;
    (meta.dev(), meta.ino(), meta.ctime(), meta.ctime_nsec())
}

#[cfg(not(unix))]
fn identity(_: &Metadata) -> Identity {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_stamp_stays_while_nothing_writes_and_moves_when_something_does() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("a");
        fs::write(&path, "one").unwrap();
        let before = Stamp::of(&path).unwrap();
        assert_eq!((before.bytes, Stamp::of(&path)), (3, Some(before)));
        fs::write(&path, "longer").unwrap();
        assert_ne!(Stamp::of(&path), Some(before));
    }

    #[cfg(unix)]
    #[test]
    fn a_file_in_anothers_place_with_its_length_and_time_has_another_stamp() {
        let root = tempfile::tempdir().unwrap();
        let (path, other) = (root.path().join("a"), root.path().join("b"));
        fs::write(&path, "one").unwrap();
        let before = Stamp::of(&path).unwrap();
        fs::write(&other, "two").unwrap();
        fs::File::options().append(true).open(&other).unwrap().set_modified(before.modified.unwrap()).unwrap();
        fs::rename(&other, &path).unwrap();
        let after = Stamp::of(&path).unwrap();
        assert_eq!((after.bytes, after.modified), (before.bytes, before.modified));
        assert_ne!(after, before);
    }

    #[test]
    fn a_stamp_settles_with_time_and_never_if_it_is_from_the_future() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("a");
        fs::write(&path, "one").unwrap();
        let stamp = Stamp::of(&path).unwrap();
        let modified = stamp.modified.unwrap();
        let after = |seconds| stamp.is_settled(modified + Duration::from_secs(seconds));
        assert_eq!([after(1), after(3)], [false, true]);
        assert!(!stamp.is_settled(modified - Duration::from_secs(9)));
    }

    #[test]
    fn only_regular_files_have_stamps() {
        let root = tempfile::tempdir().unwrap();
        assert_eq!(Stamp::of(root.path()), None);
        assert_eq!(Stamp::of(&root.path().join("none")), None);
        #[cfg(unix)]
        {
            let socket = root.path().join("socket");
            let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
            assert_eq!(Stamp::of(&socket), None);
        }
    }
}
