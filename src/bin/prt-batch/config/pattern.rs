//! Which inputs a `[[file]]` block is about.

use glob::{MatchOptions, Pattern};
use std::path::{Component, Path};

/// `/` is matched by `**` alone.
const OPTIONS: MatchOptions =
    MatchOptions { case_sensitive: true, require_literal_separator: true, require_literal_leading_dot: false };

/// A pattern for the end of a path, in whole names: `*.gltf` is about files of that name, `lamps/*.gltf` about those in
/// any folder called lamps. With `./` or `../` in front it is about one place, seen from the config file's folder.
#[derive(Debug)]
pub struct FilePattern(Pattern);

impl FilePattern {
    /// The pattern as written in a config file in `folder`.
    ///
    /// # Errors
    /// It is no pattern; the text says what is allowed.
    pub fn new(text: &str, folder: &Path) -> Result<Self, String> {
        let is_placed = text.starts_with("./") || text.starts_with("../") || Path::new(text).is_absolute();
        let whole = if is_placed { resolved(text, folder) } else { format!("**/{text}") };
        Pattern::new(&whole).map(Self).map_err(|error| {
            format!(
                "is no pattern: {}\n  Allowed: * and ? within a name, ** for any folders, [abc], [!abc]; [[] is [.",
                error.msg
            )
        })
    }

    /// Whether the input `path`, as typed or found, is meant.
    pub fn matches(&self, path: &Path) -> bool {
        self.0.matches_with(&names(path).join("/"), OPTIONS)
    }
}

/// `text` seen from `folder`, from the root on and without the first slash.
fn resolved(text: &str, folder: &Path) -> String {
    let mut all: Vec<String> = match Path::new(text).is_absolute() {
        true => Vec::new(),
        // std makes no absolute path of an empty one.
        false => names(&folder.join(".")).iter().map(|name| Pattern::escape(name)).collect(),
    };
    for name in text.split('/') {
        match name {
            "" | "." => {}
            ".." => drop(all.pop()),
            name => all.push(name.to_owned()),
        }
    }
    all.join("/")
}

/// The names that lead from the root to `path`. What is not UTF-8 in them is U+FFFD, which `*` and `?` match.
fn names(path: &Path) -> Vec<String> {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut names = Vec::new();
    for component in absolute.components() {
        match component {
            Component::ParentDir => drop(names.pop()),
            Component::Normal(_) | Component::Prefix(_) => {
                names.push(component.as_os_str().to_string_lossy().into_owned());
            }
            Component::RootDir | Component::CurDir => {}
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_is_about_the_end_of_a_path_in_whole_names() {
        let here = Path::new("/proj/shots[1]");
        for (pattern, path, is_meant) in [
            ("lamp.gltf", "/x/lamp.gltf", true),
            ("lamp.gltf", "lamp.gltf", true),
            ("lamp.gltf", "/x/a-lamp.gltf", false),
            ("*.gltf", "/x/y/a.gltf", true),
            ("lamps/*.gltf", "/x/lamps/a.gltf", true),
            ("lamps/*.gltf", "/x/lamps/b/a.gltf", false),
            ("lamps/*.gltf", "/x/old-lamps/a.gltf", false),
            ("lamps/**/*.gltf", "/x/lamps/b/c/a.gltf", true),
            ("lamps/**", "/x/lamps/b/c/a.gltf", true),
            ("lamps/*.gltf", "/x/other/../lamps/a.gltf", true),
            ("a[0-9].gltf", "/x/a7.gltf", true),
            ("./*.gltf", "/proj/shots[1]/a.gltf", true),
            ("./*.gltf", "/proj/shots1/a.gltf", false),
            ("./*.gltf", "/proj/shots[1]/sub/a.gltf", false),
            ("../art/*.gltf", "/proj/art/a.gltf", true),
            ("/x/*.gltf", "/x/a.gltf", true),
            ("/x/*.gltf", "/y/x/a.gltf", false),
        ] {
            let meant = FilePattern::new(pattern, here).unwrap().matches(Path::new(path));
            assert_eq!(meant, is_meant, "{pattern} {path}");
        }
        assert!(FilePattern::new("a[", here).unwrap_err().contains("is no pattern"));
    }
}
