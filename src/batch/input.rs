//! From what the user typed to the files to render.

use super::pattern::{self, PatternError, is_pattern};
use crate::error::{LoadError, SourceLoc};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Extensions of scene files, lower case. The first of two files that differ only in it keeps the plain output name.
pub const SCENE_EXTENSIONS: [&str; 3] = ["gltf", "glb", "obj"];

/// One file to render, or the reason why there is none.
#[derive(Clone, Debug)]
pub struct Input {
    /// As the user named it, or found below the folder that the user named.
    pub path: PathBuf,
    /// Folder below the output folder: the sub-folder of the input folder; empty for files named directly.
    pub folder: PathBuf,
    /// Why this input cannot be rendered; found without reading it.
    pub problem: Option<LoadError>,
}

/// The files that `paths` mean: a folder means every scene file below it, in the order of their paths, and what is not
/// there and has `*`, `?` or `[` in it means the scene files that it matches. A file that two of `paths` mean with the
/// same output folder is taken once.
pub fn expand(paths: &[PathBuf]) -> Vec<Input> {
    let mut inputs = Vec::new();
    for path in paths {
        if let Err(error) = expand_one(path, &mut inputs) {
            inputs.push(Input { path: path.clone(), folder: PathBuf::new(), problem: Some(error) });
        }
    }
    let mut seen = std::collections::HashSet::new();
    inputs.retain(|input| {
        let path = input.path.canonicalize().unwrap_or_else(|_| input.path.clone());
        seen.insert((path, input.folder.clone()))
    });
    inputs
}

fn expand_one(path: &Path, inputs: &mut Vec<Input>) -> Result<(), LoadError> {
    let at = || SourceLoc::file(path);
    let metadata = match std::fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) if error.kind() == ErrorKind::NotFound && is_pattern(path) => return expand_pattern(path, inputs),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            return Err(LoadError::new(at(), "there is no such file or folder", ""));
        }
        Err(error) => return Err(LoadError::new(at(), format!("cannot be opened: {error}"), "")),
    };
    if !metadata.is_dir() {
        inputs.push(Input { path: path.to_owned(), folder: PathBuf::new(), problem: None });
        return Ok(());
    }
    let before = inputs.len();
    walk(path, Path::new(""), inputs).map_err(|(folder, error)| {
        LoadError::new(SourceLoc::file(&folder), format!("the folder cannot be read: {error}"), "")
    })?;
    if inputs.len() == before {
        return Err(LoadError::new(at(), "there is no scene file in this folder", "Looked for .gltf, .glb and .obj."));
    }
    Ok(())
}

fn expand_pattern(path: &Path, inputs: &mut Vec<Input>) -> Result<(), LoadError> {
    const ALLOWED: &str = "* and ? stand for what is within a name, ** for any folders, [abc] for one of these; \
                           only .gltf, .glb and .obj files are taken.";
    let at = || SourceLoc::file(path);
    let found = pattern::expand(path).map_err(|error| match error {
        PatternError::Invalid(error) => LoadError::new(at(), format!("this is no pattern: {}", error.msg), ALLOWED),
        PatternError::Unreadable(folder, error) => {
            LoadError::new(SourceLoc::file(&folder), format!("the folder cannot be read: {error}"), "")
        }
    })?;
    if found.is_empty() {
        return Err(LoadError::new(at(), "no file matches this pattern", format!("Is the folder right? {ALLOWED}")));
    }
    inputs.extend(found.into_iter().map(|path| Input { path, folder: PathBuf::new(), problem: None }));
    Ok(())
}

/// Adds every scene file below `root/folder`, files before sub-folders, each sorted by name. Links to folders are not
/// followed: they may lead back up.
fn walk(root: &Path, folder: &Path, inputs: &mut Vec<Input>) -> Result<(), (PathBuf, std::io::Error)> {
    let here = root.join(folder);
    let fail = |error| (here.clone(), error);
    let mut entries = std::fs::read_dir(&here).and_then(Iterator::collect::<Result<Vec<_>, _>>).map_err(fail)?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    let mut folders = Vec::new();
    for entry in entries {
        let path = entry.path();
        if entry.file_type().map_err(fail)?.is_dir() {
            folders.push(folder.join(entry.file_name()));
        } else if extension_rank(&path).is_some() && path.is_file() {
            inputs.push(Input { path, folder: folder.to_owned(), problem: None });
        }
    }
    folders.iter().try_for_each(|folder| walk(root, folder, inputs))
}

/// Place of the file's extension in [`SCENE_EXTENSIONS`].
pub(super) fn extension_rank(path: &Path) -> Option<usize> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    SCENE_EXTENSIONS.iter().position(|e| *e == extension)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_means_every_scene_below_it_with_its_sub_folders() {
        let root = tempfile::tempdir().unwrap();
        for name in ["b.gltf", "a.GLB", "a.bin", "sub/deep/c.gltf", "sub/readme.txt", "sub/d.OBJ"] {
            let path = root.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        let inputs = expand(&[root.path().to_owned(), root.path().join("b.gltf")]);
        let found: Vec<_> = inputs
            .iter()
            .map(|i| (i.path.strip_prefix(root.path()).unwrap().to_str().unwrap(), i.folder.to_str().unwrap()))
            .collect();
        assert_eq!(found, [("a.GLB", ""), ("b.gltf", ""), ("sub/d.OBJ", "sub"), ("sub/deep/c.gltf", "sub/deep")]);
    }

    #[test]
    fn what_cannot_be_found_says_why() {
        let root = tempfile::tempdir().unwrap();
        let problem = |path: PathBuf| expand(&[path])[0].problem.as_ref().unwrap().to_string();
        assert!(problem(root.path().join("*.gltf")).contains("no file matches this pattern"));
        assert!(problem(root.path().join("x.gltf")).contains("no such file"));
        assert!(problem(root.path().to_owned()).contains("no scene file"));
    }
}
