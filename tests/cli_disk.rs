//! Disks that are full, folders that may not be written to, inputs that vanish: the right exit code, and nothing torn.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");
const SCENE: &str = include_str!("data/triangle.gltf");

fn folder() -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    ["a", "b", "c"].iter().for_each(|name| fs::write(root.path().join(format!("{name}.gltf")), SCENE).unwrap());
    root
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// No file may grow beyond `blocks` x 512 bytes, as if the disk were full there (setrlimit(2), RLIMIT_FSIZE).
fn with_file_limit(folder: &Path, blocks: u32, args: &str) -> Output {
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec '{BIN}' {args}");
    Command::new("sh").current_dir(folder).args(["-c", &script]).output().expect("sh is there")
}

#[test]
fn a_full_disk_stops_the_batch_with_4_and_what_is_there_stays_whole() {
    let root = folder();
    let args = "a.gltf b.gltf c.gltf --size 64x64 -s 1 --accel bvh --exr-compression none -t 2";
    let output = with_file_limit(root.path(), 16, args);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(4), "{text}");
    assert!(text.contains("a.exr") && text.contains("cannot be written"), "{text}");
    let left = names(&root.path().join("renders"));
    // The run's own reports are small enough for this disk.
    assert_eq!(left, ["batch.json", "index.html"], "neither a torn picture nor a temporary file");

    // With room again the same command goes on.
    let output = with_file_limit(root.path(), 1 << 20, args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

#[test]
fn a_full_disk_keeps_the_picture_that_it_had() {
    let root = folder();
    let args = "a.gltf --size 64x64 -s 1 --accel bvh --exr-compression none -t 2";
    assert_eq!(with_file_limit(root.path(), 1 << 20, args).status.code(), Some(0));
    let before = fs::read(root.path().join("renders/a.exr")).unwrap();
    let output = with_file_limit(root.path(), 16, &format!("{args} --seed 1 --force"));
    assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    assert!(fs::read(root.path().join("renders/a.exr")).unwrap() == before);
}

#[test]
fn a_folder_that_may_not_be_written_to_exits_with_4_before_anything_is_rendered() {
    let root = folder();
    let out = root.path().join("closed");
    fs::create_dir(&out).unwrap();
    fs::set_permissions(&out, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(out.join("probe"), "").is_ok() {
        println!("skipped: this user may write anywhere; /proc stands in for the closed folder");
        let output = Command::new(BIN).current_dir(root.path()).args(["a.gltf", "-o", "/proc/prt"]).output().unwrap();
        assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
        return;
    }
    let output = Command::new(BIN).current_dir(root.path()).args(["a.gltf", "-o", "closed"]).output().unwrap();
    assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    assert!(stderr(&output).contains("closed") && names(&out).is_empty());
}
