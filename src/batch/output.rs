//! Files that are whole or not there: written under a temporary name in the same folder, synced, renamed.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
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
    write_whole(path, bytes)?;
    sync_folder(folder_of(path)).map_err(|error| WriteError { path: path.to_owned(), error })
}

/// [`write_atomic`] of one of several files in a folder, of which the last is to be written by that: the file is whole
/// under its name, but until the folder is synced too a power cut may take it back to what it was.
///
/// # Errors
/// The first step that the system refused.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let fail = |error| WriteError { path: path.to_owned(), error };
    let folder = folder_of(path);
    fs::create_dir_all(folder).map_err(fail)?;
    let (temporary, mut file) = Temporary::create(folder).map_err(fail)?;
    file.write_all(bytes).and_then(|()| file.sync_all()).map_err(fail)?;
    drop(file);
    fs::rename(&temporary.0, path).map_err(fail)
}

/// Makes `folder` and shows by a file that it can be written to.
///
/// # Errors
/// It cannot.
pub fn check_writable(folder: &Path) -> Result<(), WriteError> {
    let fail = |error| WriteError { path: folder.to_owned(), error };
    fs::create_dir_all(folder).map_err(fail)?;
    Temporary::create(folder).map_err(fail).map(drop)
}

/// Removes the temporary files that processes of this machine left in `folder` when they were killed. Those of other
/// machines, and of processes that are alive, stay.
pub fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        if entry.file_name().to_str().is_some_and(is_left_over) {
            // Another process may have been faster.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Whether `name` is that of a temporary file whose writer is gone.
fn is_left_over(name: &str) -> bool {
    let Some(rest) = name.strip_prefix(".prt-").and_then(|rest| rest.strip_suffix(".tmp")) else { return false };
    let mut parts = rest.rsplitn(3, '-');
    let (Some(count), Some(process), Some(machine)) = (parts.next(), parts.next(), parts.next()) else { return false };
    let (Ok(count), Ok(process)) = (count.parse::<u64>(), process.parse::<u32>()) else { return false };
    if machine != this_machine() {
        return false;
    }
    if process == std::process::id() {
        // In containers one number is used again and again; what this process wrote itself has a lower count.
        return count >= COUNT.load(Ordering::Relaxed);
    }
    // Where the system does not show its processes, all are taken to be alive.
    Path::new("/proc/self").exists() && !Path::new(&format!("/proc/{process}")).exists()
}

/// Eight digits that differ between machines and between containers of one machine, whose process numbers overlap.
fn this_machine() -> &'static str {
    static TAG: OnceLock<String> = OnceLock::new();
    TAG.get_or_init(|| {
        let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let processes = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
        // FNV-1a, 64 bits, folded: the same in every process and build, which std's hasher does not promise.
        let bytes = host.trim().bytes().chain(processes.as_os_str().as_encoded_bytes().iter().copied());
        let hash =
            bytes.fold(0xcbf2_9ce4_8422_2325_u64, |hash, b| (hash ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
        format!("{:08x}", (hash >> 32) ^ (hash & 0xffff_ffff))
    })
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

/// Of temporary files that this process made.
static COUNT: AtomicU64 = AtomicU64::new(0);

impl Temporary {
    fn create(folder: &Path) -> io::Result<(Self, File)> {
        loop {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!(".prt-{}-{}-{count}.tmp", this_machine(), std::process::id()));
            match File::options().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((Self(path), file)),
                // Left by another process of this number.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
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

    #[test]
    fn files_of_dead_processes_are_swept_and_no_others() {
        let root = tempfile::tempdir().unwrap();
        let (tag, me) = (this_machine(), std::process::id());
        // Above the largest process number of Linux, 2^22.
        let (dead, alive) = (4_194_305, std::os::unix::process::parent_id());
        let gone = [format!(".prt-{tag}-{dead}-0.tmp"), format!(".prt-{tag}-{me}-{}.tmp", u64::MAX)];
        let kept = [
            format!(".prt-{tag}-{alive}-0.tmp"),
            format!(".prt-00000000-{dead}-0.tmp"),
            format!(".prt-{tag}-{dead}.tmp"),
            ".prt-notes.tmp".into(),
            "a.exr".into(),
        ];
        gone.iter().chain(&kept).for_each(|name| fs::write(root.path().join(name), "").unwrap());
        let (mine, _file) = Temporary::create(root.path()).unwrap();
        sweep(root.path());
        let mut kept: Vec<_> = kept.into_iter().collect();
        kept.push(mine.0.file_name().unwrap().to_str().unwrap().into());
        kept.sort();
        let mut left = names(root.path());
        left.sort();
        assert_eq!(left, kept);
    }
}
