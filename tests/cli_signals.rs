//! Signals to the built binary: the first ends a run cleanly, a second at once, and what was ignored stays so.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");
const SCENE: &str = include_str!("data/triangle.gltf");

/// More samples than anyone waits for.
const ENDLESS: [&str; 6] = ["--size", "2048x2048", "-s", "1048576", "--accel", "linear"];

fn folder(scenes: usize) -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    (0..scenes).for_each(|i| fs::write(root.path().join(format!("s{i:03}.gltf")), SCENE).expect("a scene"));
    root
}

/// Kills what a failed test leaves.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Running {
    fn start(command: &mut Command, folder: &Path) -> Self {
        let command = command.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Self(command.spawn().expect("the binary was built for this test"))
    }

    fn signal(&self, name: &str) {
        let status = Command::new("kill").args(["-s", name, &self.0.id().to_string()]).status();
        assert!(status.expect("kill is there").success());
    }

    fn stderr(&mut self) -> BufReader<ChildStderr> {
        BufReader::new(self.0.stderr.take().expect("it is piped"))
    }

    /// How it ended; fails if it has not within `limit`.
    #[track_caller]
    fn ended_within(&mut self, limit: Duration) -> ExitStatus {
        let start = Instant::now();
        loop {
            if let Some(status) = self.0.try_wait().expect("it can be waited for") {
                return status;
            }
            assert!(start.elapsed() < limit, "it goes on after {limit:?}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    #[track_caller]
    fn goes_on_for(&mut self, time: Duration) {
        std::thread::sleep(time);
        assert_eq!(self.0.try_wait().expect("it can be waited for"), None);
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("the output folder");
    let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Waits until the output folder is there: then the handlers are, too, and rendering has begun or is about to.
fn wait_for(path: &Path) {
    let start = Instant::now();
    while !path.exists() {
        assert!(start.elapsed() < Duration::from_secs(20), "{} does not appear", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_signal_drops_the_image_under_way_and_says_75_within_two_seconds() {
    for signal in ["INT", "TERM", "HUP"] {
        let root = folder(2);
        let mut run = Running::start(Command::new(BIN).args([".", "-o", "out"]).args(ENDLESS), root.path());
        wait_for(&root.path().join("out"));
        run.goes_on_for(Duration::from_millis(100));
        run.signal(signal);
        assert_eq!(run.ended_within(Duration::from_secs(2)).code(), Some(75), "{signal}");
        let mut text = String::new();
        run.stderr().read_to_string(&mut text).unwrap();
        for line in [
            "interrupted: finishing what is being written; press again to stop at once",
            "interrupted: 0 of 2 images are done; the same command goes on from there",
        ] {
            assert!(text.lines().any(|l| l == line), "{signal}: {text}");
        }
        assert_eq!(names(&root.path().join("out")), ["batch.json", "index.html"], "{signal}");
        let text = fs::read_to_string(root.path().join("out/batch.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["counts"]["interrupted"], 2, "{signal}");
    }
}

/// 200 images; the signal, twice as `timeout` sends it, comes when three are done.
#[test]
fn what_was_finished_before_the_signal_is_whole_and_nothing_else_is_left() {
    let root = folder(200);
    let args = [".", "-o", "out", "--size", "64x64", "-s", "64", "--accel", "linear", "--progress", "plain"];
    let mut run = Running::start(Command::new(BIN).args(args), root.path());
    let mut lines = run.stderr().lines().map(|line| line.expect("messages are UTF-8"));
    (0..3).for_each(|_| drop(lines.find(|line| line.contains("64 spp")).expect("images are finished")));
    run.signal("TERM");
    run.signal("TERM");
    let rest: Vec<_> = lines.collect();
    assert_eq!(run.ended_within(Duration::from_secs(2)).code(), Some(75), "{rest:#?}");

    let out = root.path().join("out");
    let json: serde_json::Value = serde_json::from_slice(&fs::read(out.join("batch.json")).unwrap()).unwrap();
    let images = json["images"].as_array().unwrap();
    let done = images.iter().filter(|image| image["status"] == "rendered").count();
    assert!(images.len() == 200 && (3..200).contains(&done), "{done} of {}", images.len());
    let last = format!("interrupted: {done} of 200 images are done; the same command goes on from there");
    assert_eq!(rest.last(), Some(&last));
    // The scenes are equal, and so are the pictures.
    let first = fs::read(out.join("s000.exr")).unwrap();
    let mut expected = vec!["batch.json".to_owned(), "index.html".to_owned()];
    for image in images.iter().filter(|image| image["status"] == "rendered") {
        let stem = image["input"].as_str().unwrap().trim_start_matches("./").trim_end_matches(".gltf").to_owned();
        assert!(fs::read(out.join(format!("{stem}.exr"))).unwrap() == first, "{stem}.exr is not whole");
        let report: serde_json::Value =
            serde_json::from_slice(&fs::read(out.join(format!("{stem}.json"))).unwrap()).unwrap();
        assert_eq!(report["status"], "rendered");
        expected.extend(["exr", "json", "png"].map(|e| format!("{stem}.{e}")));
    }
    expected.sort();
    assert_eq!(names(&out), expected);
}

/// The process cannot end cleanly: its result is more than a pipe holds, and nobody reads it.
#[test]
fn a_second_signal_ends_the_process_at_once() {
    for second in ["INT", "TERM"] {
        let root = folder(0);
        let missing: Vec<_> = (0..200).map(|i| format!("there-is-no-such-file-{i}.gltf")).collect();
        let mut run = Running::start(Command::new(BIN).args(["--json", "-o", "out"]).args(missing), root.path());
        wait_for(&root.path().join("out/batch.json"));
        run.goes_on_for(Duration::from_millis(200));
        run.signal("INT");
        run.goes_on_for(Duration::from_millis(800));
        run.signal(second);
        assert_eq!(run.ended_within(Duration::from_secs(1)).code(), Some(75), "{second}");
    }
}

#[test]
fn signals_that_were_ignored_stay_so() {
    for (ignored, end) in [("HUP", "TERM"), ("INT", "HUP")] {
        let root = folder(1);
        let script = format!(r#"trap "" {ignored}; exec "$0" "$@""#);
        let args = ["-c", &script, BIN, "s000.gltf", "-o", "out"];
        let mut run = Running::start(Command::new("sh").args(args).args(ENDLESS), root.path());
        wait_for(&root.path().join("out"));
        run.signal(ignored);
        run.goes_on_for(Duration::from_millis(500));
        run.signal(end);
        assert_eq!(run.ended_within(Duration::from_secs(2)).code(), Some(75), "{ignored}");
    }
}
