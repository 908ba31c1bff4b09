//! Which files an input may name: those below its own folder or `--asset-root`, links followed. Whatever is looked for
//! is written down ([`SourceFile`]).

use crate::error::{LoadError, SourceLoc};
use crate::scene::{SourceFile, Stamp};
use std::collections::HashSet;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The folders of one input, and the files that were looked for in them.
pub struct Folders {
    /// The input's folder, without links.
    base: PathBuf,
    /// The input's folder as the user sees it.
    shown: PathBuf,
    /// Files may be read below these, without links.
    roots: Vec<PathBuf>,
    sources: Mutex<Sources>,
}

/// The files that were looked for.
#[derive(Default)]
struct Sources {
    files: Vec<SourceFile>,
    names: HashSet<String>,
}

/// Why a path may not be read; the caller puts the path as the file has it in front.
pub(super) struct Refused {
    /// What is wrong with it.
    pub problem: String,
    /// What is allowed.
    pub fix: String,
}

impl Folders {
    /// For the files that `file` names.
    ///
    /// # Errors
    /// Its folder or `asset_root` is not to be had.
    pub fn new(file: &Path, asset_root: Option<&Path>) -> Result<Self, LoadError> {
        let shown = match file.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        let canonical = |path: &Path, what: &str, fix: &str| {
            let why = |e| LoadError::new(SourceLoc::file(file), format!("{what} {}: {e}", path.display()), fix);
            path.canonicalize().map_err(why)
        };
        let base = canonical(&shown, "the folder of the file", "")?;
        let mut roots = vec![base.clone()];
        if let Some(root) = asset_root {
            roots.push(canonical(root, "--asset-root", "It must be a folder that exists.")?);
        }
        Ok(Self { base, shown, roots, sources: Mutex::default() })
    }

    /// The regular file that `name` (relative, separated by `/`) means now, without links; `None` if there is none that
    /// may be read.
    pub fn find(&self, name: &str) -> Option<PathBuf> {
        self.locate(name).ok().filter(|path| path.is_file())
    }

    /// `path` (relative, separated by `/`) below the input's folder, without links, if it is in an allowed folder both
    /// as written and with links followed. It is written down as a source, found or not.
    pub(super) fn confine(&self, path: &str) -> Result<PathBuf, Refused> {
        let located = self.locate(path);
        let mut sources = self.looked_for();
        // The empty name is the input's own; as a path it is its folder.
        if !path.is_empty() && sources.names.insert(path.to_owned()) {
            let opened = located.as_ref().map_or_else(|_| self.base.join(path), PathBuf::clone);
            let stamp = located.as_ref().ok().and_then(|path| Stamp::of(path));
            sources.files.push(SourceFile { path: opened, name: path.to_owned(), stamp });
        }
        located
    }

    /// The files that were looked for, each name once, in that order.
    pub(super) fn sources(&self) -> Vec<SourceFile> {
        self.looked_for().files.clone()
    }

    fn looked_for(&self) -> MutexGuard<'_, Sources> {
        self.sources.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn locate(&self, path: &str) -> Result<PathBuf, Refused> {
        let outside = |how: &str| {
            let roots: Vec<_> = self.roots.iter().map(|r| r.display().to_string()).collect();
            let fix = format!(
                "Files are read only below {}. Move the file there, or name a folder above both with --asset-root DIR.",
                roots.join(" and ")
            );
            Refused { problem: how.to_owned(), fix }
        };
        let allowed = |path: &Path| self.roots.iter().any(|root| path.starts_with(root));
        // First as written, so that nothing outside is even asked about.
        let mut target = self.base.clone();
        for component in Path::new(path).components() {
            match component {
                Component::Normal(name) => target.push(name),
                Component::CurDir => {}
                Component::ParentDir => {
                    target.pop();
                }
                Component::RootDir | Component::Prefix(_) => return Err(outside("is absolute")),
            }
        }
        if !allowed(&target) {
            return Err(outside("leaves the folder of the file"));
        }
        let real = target.canonicalize().map_err(|e| Refused {
            problem: format!("cannot be opened: {}: {e}", self.shown.join(path).display()),
            fix: "Put the file there, or correct the path (upper and lower case count).".into(),
        })?;
        if !allowed(&real) {
            return Err(outside("is a link that leaves the folder of the file"));
        }
        Ok(real)
    }
}

/// Opens a regular file (anything else, a folder or a pipe that would block, is an error) and tells its length.
pub(super) fn open_file(path: &Path) -> Result<(File, u64), String> {
    let meta = std::fs::metadata(path).map_err(|e| e.to_string())?;
    if !meta.is_file() {
        return Err("not a regular file".into());
    }
    let file = File::open(path).map_err(|e| e.to_string())?;
    Ok((file, meta.len()))
}

/// The bytes of a regular file.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, String> {
    let (mut file, length) = open_file(path)?;
    let mut bytes = Vec::with_capacity(usize::try_from(length).map_err(|e| e.to_string())?);
    file.read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    Ok(bytes)
}
