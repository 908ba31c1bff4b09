//! Why candidates are refused, told without an Embree at hand.

use super::*;
use std::fs;

/// A folder of its own under the system's temporary one, removed when dropped.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("embree4-rs-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn refusals(embree_dir: Option<&Path>, folders: &[&Path]) -> Vec<Refusal> {
    let embree_dir = embree_dir.map(|path| path.as_os_str().to_owned());
    Library::search(embree_dir, folders, &[]).unwrap_err().refused
}

#[test]
fn a_missing_folder_is_named() {
    let error = Library::search(None, &["/nowhere/.embree"], &[]).unwrap_err();
    let text = error.to_string();
    assert!(text.starts_with("Embree not used: /nowhere/.embree: no such folder\n"), "{text}");
    assert!(text.contains("EMBREE_DIR"), "{text}");
}

#[test]
fn an_empty_folder_is_named() {
    let folder = Folder::new("empty");
    let refused = refusals(Some(&folder.0), &[]);
    assert_eq!(refused, [Refusal { path: folder.0.clone(), reason: Reason::NothingFound }]);
}

#[test]
fn embree_dir_comes_before_folders_and_may_be_a_file() {
    let folder = Folder::new("order");
    let file = folder.0.join("any-name.so");
    fs::write(&file, "text").unwrap();
    let refused = refusals(Some(&file), &[Path::new("/nowhere")]);
    assert_eq!(refused[0].path, file);
    assert_eq!(refused[1].path, Path::new("/nowhere"));
}

#[test]
#[cfg(target_os = "linux")]
fn a_text_file_with_the_right_name_is_refused_with_the_loaders_words() {
    let folder = Folder::new("text");
    fs::create_dir(folder.0.join("embreex.libs")).unwrap();
    let file = folder.0.join("embreex.libs/libembree4.so");
    fs::write(&file, "not a shared library\n".repeat(100)).unwrap();
    let refused = refusals(None, &[&folder.0]);
    assert_eq!(refused.len(), 1);
    assert_eq!(refused[0].path, file);
    let Reason::Open(text) = &refused[0].reason else { panic!("{}", refused[0]) };
    assert_eq!(text, "invalid ELF header");
}

#[test]
#[cfg(target_os = "linux")]
fn another_library_is_refused_for_the_missing_function() {
    let Some(other) = ["/lib/x86_64-linux-gnu/libm.so.6", "/lib64/libm.so.6", "/usr/lib/libm.so.6"]
        .iter()
        .find(|path| Path::new(path).is_file())
    else {
        println!("skipped: no libm.so.6 at a known place");
        return;
    };
    let folder = Folder::new("other");
    let file = folder.0.join("libembree4.so.4");
    fs::copy(other, &file).unwrap();
    let refused = refusals(None, &[&folder.0]);
    assert_eq!(refused, [Refusal { path: file, reason: Reason::MissingSymbol("rtcNewDevice") }]);
}

#[test]
fn names_are_told_apart_and_links_to_one_file_are_one_candidate() {
    let folder = Folder::new("names");
    for name in ["libembree4-ab.so.4", "libembree3.so.3", "libembree4.txt", "libtbb.so.12"] {
        fs::write(folder.0.join(name), name).unwrap();
    }
    #[cfg(target_os = "linux")]
    {
        std::os::unix::fs::symlink("libembree4-ab.so.4", folder.0.join("libembree4.so")).unwrap();
        let found = libraries_in(&folder.0);
        assert_eq!(found, [Ok(folder.0.join("libembree4-ab.so.4"))]);
    }
}

#[test]
fn a_wrong_version_says_which_was_found_and_which_is_needed() {
    let version = Version::from_number(31305);
    let refusal = Refusal { path: "/x/libembree4.so.3".into(), reason: Reason::Version(version) };
    assert_eq!(refusal.to_string(), "/x/libembree4.so.3: version 3.13.5 found, 4.x needed");
}
