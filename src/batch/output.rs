//! Files that are whole or not there: written under a temporary name in the same folder, synced, renamed.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// An output that could not be written.
#[derive(Debug)]
pub struct WriteError {
    /// The file that was to be written.
    pub path: PathBuf,
    /// What the system said.
    pub error: io::Error,
}

impl std::fmt::Display for WriteError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: cannot be written: {}", self.path.display(), self.error)
    }
}

impl std::error::Error for WriteError {}

/// Writes `bytes` to `path`, making its folder if needed. On an error `path` is as it was and nothing else is left.
///
/// # Errors
/// The first step that the system refused.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let fail = |error| WriteError { path: path.to_owned(), error };
    let folder = folder_of(path);
    fs::create_dir_all(folder).map_err(fail)?;
    let temporary = Temporary::new(folder);
    let mut file = File::options().write(true).create_new(true).open(&temporary.0).map_err(fail)?;
    file.write_all(bytes).and_then(|()| file.sync_all()).map_err(fail)?;
    drop(file);
    fs::rename(&temporary.0, path).map_err(fail)?;
    sync_folder(folder).map_err(fail)
}

/// Makes `folder` and shows by a file that it can be written to.
///
/// # Errors
/// It cannot.
pub fn check_writable(folder: &Path) -> Result<(), WriteError> {
    let fail = |error| WriteError { path: folder.to_owned(), error };
    fs::create_dir_all(folder).map_err(fail)?;
    let temporary = Temporary::new(folder);
    File::options().write(true).create_new(true).open(&temporary.0).map_err(fail).map(drop)
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// So that the rename itself survives a power cut; folders cannot be opened everywhere, and then there is no need.
fn sync_folder(folder: &Path) -> io::Result<()> {
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}

/// A name that no other writer uses; its file, if it is still there, is removed on drop.
struct Temporary(PathBuf);

impl Temporary {
    fn new(folder: &Path) -> Self {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        Self(folder.join(format!(".prt-{}-{count}.tmp", std::process::id())))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // After the rename it is gone, and a second failure could not be told to anyone.
        let _ = fs::remove_file(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_file_is_replaced_whole_and_nothing_else_is_left() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("a/b/x.exr");
        write_atomic(&path, b"old and long").unwrap();
        write_atomic(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(path.parent().unwrap()), ["x.exr"]);
    }

    #[test]
    fn no_temporary_file_is_left_on_an_error() {
        let root = tempfile::tempdir().unwrap();
        // A folder that is not empty cannot be replaced by a file.
        fs::create_dir_all(root.path().join("x.exr/inside")).unwrap();
        let error = write_atomic(&root.path().join("x.exr"), b"new").unwrap_err();
        assert!(error.to_string().contains("x.exr"), "{error}");
        assert_eq!(names(root.path()), ["x.exr"]);
    }

    #[test]
    fn a_folder_below_a_file_is_not_writable() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("file"), "").unwrap();
        assert!(check_writable(&root.path().join("file/renders")).is_err());
        check_writable(&root.path().join("renders")).unwrap();
        assert!(names(&root.path().join("renders")).is_empty());
    }
}
