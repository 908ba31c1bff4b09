//! Which files an input may name: those below its own folder or `--asset-root`, links followed.

use crate::error::{LoadError, SourceLoc};
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// The folders of one input.
pub(super) struct Folders {
    /// The input's folder, without links.
    base: PathBuf,
    /// The input's folder as the user sees it.
    shown: PathBuf,
    /// Files may be read below these, without links.
    roots: Vec<PathBuf>,
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
        Ok(Self { base, shown, roots })
    }

    /// `path` (relative, separated by `/`) below the input's folder, without links, if it is in an allowed folder both
    /// as written and with links followed.
    pub fn confine(&self, path: &str) -> Result<PathBuf, Refused> {
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
