//! The EXR files below a folder, for the commands that take folders of them.

use std::path::{Path, PathBuf};

/// Every `.exr` below `root/below`, sorted by name, relative to `root`. Links to folders are not followed.
pub fn exr_files(root: &Path, below: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut names = Vec::new();
    walk(root, below, &mut names)?;
    Ok(names)
}

fn walk(root: &Path, below: &Path, names: &mut Vec<PathBuf>) -> std::io::Result<()> {
    let mut entries = std::fs::read_dir(root.join(below))?.collect::<Result<Vec<_>, _>>()?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let name = below.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            walk(root, &name, names)?;
        } else if name.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
            names.push(name);
        }
    }
    Ok(())
}
