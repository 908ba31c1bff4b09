//! Modules know only what lies below them: `use crate::...` never points upwards or sideways between siblings that
//! must not know each other (ARCHITECTURE.md has the picture), and everything unsafe lives under crates/.

use std::fs;
use std::path::{Path, PathBuf};

/// Each module with those it may use.
const MAY_USE: [(&str, &[&str]); 20] = [
    ("error", &[]),
    ("id", &[]),
    ("math", &[]),
    ("color", &[]),
    ("sampler", &["math"]),
    ("image", &["color", "error", "math"]),
    ("texture", &["color", "error", "id", "image", "math"]),
    ("material", &["error", "id", "math", "texture"]),
    ("shape", &["error", "id", "math"]),
    ("light", &["id", "material", "math", "shape", "texture"]),
    ("camera", &["math"]),
    ("scene", &["camera", "error", "id", "light", "material", "math", "shape", "texture"]),
    ("accel", &["error", "math"]),
    ("film", &["math"]),
    ("load", &["camera", "color", "error", "image", "light", "material", "math", "scene", "shape", "texture"]),
    ("integrator", &["accel", "camera", "id", "light", "material", "math", "sampler", "shape", "texture"]),
    ("compare", &["image"]),
    (
        "render",
        &[
            "accel",
            "camera",
            "color",
            "error",
            "film",
            "integrator",
            "light",
            "material",
            "math",
            "sampler",
            "scene",
            "shape",
            "texture",
        ],
    ),
    ("bench", &["accel", "camera", "error", "film", "integrator", "load", "math", "render", "sampler", "scene"]),
    (
        "verify",
        &["accel", "camera", "compare", "error", "light", "material", "math", "render", "scene", "shape", "texture"],
    ),
];

/// Sits on top: may use everything but the binary.
const TOP: &str = "batch";

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The modules named by `crate::X` in `text`, braces included (`crate::{a::b, c}`).
fn used_modules(text: &str) -> Vec<String> {
    let name = |s: &str| s.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect::<String>();
    let mut used = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        let rest = &text[at + "crate::".len()..];
        if let Some(group) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut expects_name = true;
            for (i, c) in group.char_indices() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' => expects_name = depth == 0,
                    c if expects_name && c.is_ascii_alphabetic() => {
                        used.push(name(&group[i..]));
                        expects_name = false;
                    }
                    _ => {}
                }
            }
        } else {
            used.push(name(rest));
        }
    }
    used
}

#[test]
fn modules_use_only_what_lies_below_them() {
    let mut wrong = Vec::new();
    for file in rust_files(&root().join("src")) {
        let relative = file.strip_prefix(root().join("src")).expect("below src").to_string_lossy().into_owned();
        let module = relative.split(['/', '\\', '.']).next().expect("a first part").to_owned();
        if ["bin", "lib", TOP].contains(&module.as_str()) {
            continue;
        }
        let Some((_, allowed)) = MAY_USE.iter().find(|(m, _)| *m == module) else {
            wrong.push(format!("{relative}: module `{module}` has no row in MAY_USE"));
            continue;
        };
        let text = fs::read_to_string(&file).expect("readable source");
        for used in used_modules(&text) {
            let is_module = MAY_USE.iter().any(|(m, _)| *m == used) || used == TOP;
            if is_module && used != module && !allowed.contains(&used.as_str()) {
                wrong.push(format!("{relative} uses crate::{used}"));
            }
        }
    }
    assert!(wrong.is_empty(), "arrows that point the wrong way:\n{}", wrong.join("\n"));
}

#[test]
fn braces_are_read_too() {
    assert_eq!(used_modules("use crate::{film::{Film, Tile}, math::V3};"), ["film", "math"]);
    assert_eq!(used_modules("let x = crate::error::Error;"), ["error"]);
}

#[test]
fn only_the_binary_knows_the_terminal() {
    for file in rust_files(&root().join("src")) {
        if file.starts_with(root().join("src/bin")) {
            continue;
        }
        let text = fs::read_to_string(&file).expect("readable source");
        for name in ["clap::", "indicatif::"] {
            assert!(!text.contains(name), "{} names {name}", file.display());
        }
    }
}
