//! Scene files that a pattern means, for shells that leave patterns alone and for config files.

use super::input::extension_rank;
use glob::{MatchOptions, Pattern};
use std::ffi::OsStr;
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

/// As shells match names: a leading dot is not what `*` or `?` means.
const OPTIONS: MatchOptions =
    MatchOptions { case_sensitive: true, require_literal_separator: true, require_literal_leading_dot: true };

/// Why a pattern could not be followed.
#[derive(Debug)]
pub(super) enum PatternError {
    /// It is none: where, and why.
    Invalid(glob::PatternError),
    /// A folder that it leads to cannot be read.
    Unreadable(PathBuf, std::io::Error),
}

/// Whether `path` has something in it that only patterns have.
pub(super) fn is_pattern(path: &Path) -> bool {
    path.to_string_lossy().contains(['*', '?', '['])
}

/// The scene files that `pattern` matches, sorted by name, those of a folder before those of its sub-folders. `*`, `?`
/// and `[...]` are matched within a name, `**` by any folders, also none; a name that is there as it stands is itself.
/// What is not UTF-8 in a name is one character, which `*` and `?` match.
pub(super) fn expand(pattern: &Path) -> Result<Vec<PathBuf>, PatternError> {
    let mut parts: Vec<Component<'_>> = pattern.components().collect();
    let any = Component::Normal(OsStr::new("**"));
    parts.dedup_by(|a, b| *a == any && *b == any);
    // `a/**` means the files below a.
    if parts.last() == Some(&any) {
        parts.push(Component::Normal(OsStr::new("*")));
    }
    let mut found = Vec::new();
    follow(Path::new(""), &parts, &mut found)?;
    Ok(found)
}

fn follow(base: &Path, parts: &[Component<'_>], found: &mut Vec<PathBuf>) -> Result<(), PatternError> {
    let Some((first, rest)) = parts.split_first() else {
        if extension_rank(base).is_some() && base.is_file() {
            found.push(base.to_owned());
        }
        return Ok(());
    };
    let Component::Normal(name) = first else { return follow(&base.join(first), rest, found) };
    if *name == "**" {
        follow(base, rest, found)?;
        // Links to folders are not followed: they may lead back up.
        for (name, is_folder) in entries(base)? {
            if is_folder && !name.as_encoded_bytes().starts_with(b".") {
                follow(&base.join(name), parts, found)?;
            }
        }
        return Ok(());
    }
    let literal = base.join(name);
    if literal.exists() {
        return follow(&literal, rest, found);
    }
    if !is_pattern(Path::new(name)) {
        return Ok(());
    }
    let pattern = Pattern::new(&name.to_string_lossy()).map_err(PatternError::Invalid)?;
    for (name, _) in entries(base)? {
        if pattern.matches_with(&name.to_string_lossy(), OPTIONS) {
            follow(&base.join(name), rest, found)?;
        }
    }
    Ok(())
}

/// Names in `folder`, sorted, and whether each is a folder itself; none if it is no folder.
fn entries(folder: &Path) -> Result<Vec<(std::ffi::OsString, bool)>, PatternError> {
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let fail = |error| PatternError::Unreadable(here.to_owned(), error);
    let list = match std::fs::read_dir(here) {
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => return Ok(Vec::new()),
        list => list.map_err(fail)?,
    };
    let mut entries = Vec::new();
    for entry in list {
        let entry = entry.map_err(fail)?;
        entries.push((entry.file_name(), entry.file_type().map_err(fail)?.is_dir()));
    }
    entries.sort();
    Ok(entries)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_mean_scene_files_as_shells_match_them() {
        let root = tempfile::tempdir().unwrap();
        let names =
            ["b.gltf", "a.glb", "a.bin", ".hidden.gltf", "[x].gltf", "sub/c.gltf", "sub/deep/d.obj", ".git/e.obj"];
        for name in names {
            let path = root.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        std::fs::create_dir(root.path().join("folder.gltf")).unwrap();
        let found = |pattern: &str| -> Vec<String> {
            let found = expand(&root.path().join(pattern)).unwrap();
            found.iter().map(|path| path.strip_prefix(root.path()).unwrap().to_str().unwrap().into()).collect()
        };
        for (pattern, files) in [
            ("*", &["[x].gltf", "a.glb", "b.gltf"][..]),
            ("*.gltf", &["[x].gltf", "b.gltf"]),
            ("?.gl*", &["a.glb", "b.gltf"]),
            ("[a-b].*", &["a.glb", "b.gltf"]),
            ("[!a].gltf", &["b.gltf"]),
            ("[x].gltf", &["[x].gltf"]),
            (".h*", &[".hidden.gltf"]),
            ("*/*.gltf", &["sub/c.gltf"]),
            ("**/*.obj", &["sub/deep/d.obj"]),
            ("**/**/c.*", &["sub/c.gltf"]),
            ("sub/**", &["sub/c.gltf", "sub/deep/d.obj"]),
            ("**/sub/../*.glb", &["sub/../a.glb"]),
            ("*.gltf/x", &[]),
            ("none/*.gltf", &[]),
        ] {
            assert_eq!(found(pattern), files, "{pattern}");
        }
        assert!(matches!(expand(&root.path().join("[a")), Err(PatternError::Invalid(_))));
    }
}
