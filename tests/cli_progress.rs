//! What the built binary says on stderr where it is no terminal: plain lines, JSON lines, silence, colours.

use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");
const SCENE: &str = include_str!("data/triangle.gltf");
const SMALL: [&str; 6] = ["--size", "8x4", "-s", "1", "--accel", "linear"];

fn folder(scenes: usize) -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    (0..scenes).for_each(|i| fs::write(root.path().join(format!("s{i}.gltf")), SCENE).expect("a scene"));
    root
}

fn prt_in(folder: &Path, args: &[&str]) -> Output {
    Command::new(BIN).current_dir(folder).args(args).args(SMALL).output().expect("the binary was built for this test")
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("messages are UTF-8")
}

/// Without times and speeds, which differ.
fn steady(text: &str) -> String {
    let line = |line: &str| {
        let rates = line.find(" spp").map_or(line, |end| &line[..end + 4]);
        rates.split_once(", ").map_or(rates, |(counts, _)| counts).to_owned()
    };
    text.lines().map(|l| line(l) + "\n").collect()
}

#[test]
fn a_log_has_a_line_for_each_image_and_at_its_end_what_failed() {
    let root = folder(3);
    fs::write(root.path().join("s1.gltf"), "{").unwrap();
    let output = prt_in(root.path(), &["s0.gltf", "s1.gltf", "s2.gltf"]);
    assert_eq!(output.status.code(), Some(1));
    let text = stderr(&output);
    let lines: Vec<_> = text.lines().collect();
    assert!(lines[0].starts_with("rays by linear"), "{text}");
    assert!(lines[1].starts_with("[1/3] renders/s0.exr  8x4  1 spp  "), "{text}");
    assert!(lines[2].starts_with("error: s1.gltf: "), "{text}");
    assert!(lines.iter().any(|line| line.starts_with("[3/3] renders/s2.exr  8x4  1 spp  ")), "{text}");
    let end = &lines[lines.len() - 2..];
    assert!(end[0].starts_with("failed  s1.gltf  "), "{text}");
    assert!(end[1].starts_with("2 rendered, 1 failed, "), "{text}");
    assert!(!text.contains('\u{1b}'), "no colours where there is no terminal");
}

#[test]
fn verbose_adds_where_time_went_and_a_table() {
    let root = folder(2);
    let text = stderr(&prt_in(root.path(), &["s0.gltf", "s1.gltf", "-v"]));
    assert!(text.contains("\n  load ") && text.contains(" render "), "{text}");
    assert!(text.contains("1 triangle; rays: 32 camera"), "{text}");
    assert!(text.contains("status    image           size  spp"), "{text}");
    assert!(text.contains("\nrendered  renders/s1.exr   8x4    1"), "{text}");
}

#[test]
fn one_image_has_its_line_and_no_table() {
    let root = folder(1);
    let text = stderr(&prt_in(root.path(), &["s0.gltf"]));
    assert_eq!(text.lines().filter(|line| line.starts_with("renders/s0.exr  8x4  1 spp")).count(), 1, "{text}");
    assert!(!text.contains("status") && !text.contains("1 rendered"), "{text}");
}

#[test]
fn without_progress_only_errors_and_warnings_are_told_and_if_quiet_only_errors() {
    let root = folder(2);
    fs::write(root.path().join("s1.gltf"), "{").unwrap();
    // An empty scene is warned of.
    fs::write(root.path().join("s2.gltf"), r#"{"asset": {"version": "2.0"}, "scenes": [{}]}"#).unwrap();
    let args = ["s0.gltf", "s1.gltf", "s2.gltf"];
    let none = stderr(&prt_in(root.path(), &[&args[..], &["--progress", "none"]].concat()));
    let starts: Vec<_> = none.lines().filter(|l| !l.starts_with(' ')).map(|l| l.split(':').next().unwrap()).collect();
    assert_eq!(starts, ["error", "warning"], "{none}");
    for style in ["none", "plain", "auto"] {
        let quiet = stderr(&prt_in(root.path(), &[&args[..], &["-q", "--progress", style]].concat()));
        let starts: Vec<_> = quiet.lines().filter(|l| !l.starts_with(' ')).collect();
        assert!(starts.len() == 1 && starts[0].starts_with("error: s1.gltf"), "{quiet}");
    }
}

#[test]
fn the_same_warning_of_many_images_is_counted() {
    let root = folder(0);
    for i in 0..8 {
        fs::write(root.path().join(format!("s{i}.gltf")), r#"{"asset": {"version": "2.0"}, "scenes": [{}]}"#).unwrap();
    }
    let text = stderr(&prt_in(root.path(), &["."]));
    let warnings: Vec<_> = text.lines().filter(|line| line.starts_with("warning: ")).collect();
    assert_eq!(warnings.len(), 4, "{text}");
    assert!(warnings[0].starts_with("warning: ./s0.gltf: nothing drawable"), "{text}");
    assert!(warnings[3].starts_with("warning: and 5 more images: nothing drawable"), "{text}");
}

#[test]
fn a_warning_that_names_a_line_of_the_input_does_not_name_the_input_twice() {
    let root = folder(0);
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nwibble 3\n";
    fs::write(root.path().join("a.obj"), obj).unwrap();
    let text = stderr(&prt_in(root.path(), &["a.obj"]));
    let warning = text.lines().find(|line| line.contains("no statements of OBJ")).expect("a warning");
    assert!(warning.starts_with("warning: a.obj: 5:1: ") && warning.matches("a.obj").count() == 1, "{warning}");
}

/// Every line is an object; what comes of an image is what `batch.json` says; a signal is a message.
#[test]
fn json_lines_are_objects_that_tell_the_whole_run() {
    let root = folder(1);
    fs::write(root.path().join("a.gltf"), "{").unwrap();
    let mut run = Command::new(BIN)
        .current_dir(root.path())
        .args(["a.gltf", "s0.gltf", "missing.glb", "--progress", "json", "--json", "-q"])
        .args(["--size", "2048x2048", "-s", "1048576", "--accel", "linear"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (mut events, mut progress) = (Vec::<Value>::new(), 0);
    for line in BufReader::new(run.stderr.take().unwrap()).lines() {
        let event: Value = serde_json::from_str(&line.unwrap()).expect("each line is JSON");
        // The picture is endless.
        if event["event"] == "progress" && event["phase"] == "rendering" {
            progress += 1;
            if progress == 2 {
                assert!(Command::new("kill").args(["-s", "INT", &run.id().to_string()]).status().unwrap().success());
            }
        }
        events.push(event);
    }
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(75));
    let result: Value = serde_json::from_slice(&output.stdout).expect("stdout has the result and nothing else");

    let of = |kind: &str| events.iter().filter(|e| e["event"] == kind).collect::<Vec<_>>();
    assert_eq!((&events[0]["event"], &events[0]["images"]), (&"planned".into(), &3.into()));
    let first = &of("started")[0];
    assert_eq!(
        (first["id"].as_u64(), first["input"].as_str(), first["output"].as_str()),
        (Some(0), Some("a.gltf"), Some("a"))
    );
    let finished = of("finished");
    assert_eq!((finished.len(), finished[0]["id"].as_u64()), (1, Some(0)));
    assert_eq!(finished[0]["image"], result["images"][0]);
    let shown = of("progress").into_iter().rfind(|e| e["phase"] == "rendering").unwrap();
    for (field, least) in [
        ("id", 1.0),
        ("seconds", 1.0),
        ("samples_done", 1.0),
        ("samples", 1e12),
        ("rays", 1.0),
        ("mrays_per_s", 0.0),
        ("samples_per_s", 1.0),
    ] {
        assert!(shown[field].as_f64().is_some_and(|value| value >= least), "{field} in {shown}");
    }
    assert!(shown.get("seconds_left").is_some() && shown.get("run_seconds_left").is_some(), "{shown}");
    let messages = of("message");
    assert_eq!(messages.iter().map(|m| m["level"].as_str().unwrap()).collect::<Vec<_>>(), ["interrupted"]);
    let last = events.last().unwrap();
    assert_eq!(
        (&last["event"], &last["exit_code"], &last["interrupted"]),
        (&"summary".into(), &75.into(), &true.into())
    );
    assert_eq!(last["counts"], result["counts"]);
}

#[test]
fn errors_of_usage_are_json_too_where_it_was_asked_for() {
    let root = folder(1);
    let output = prt_in(root.path(), &["s0.gltf", "--progress", "json", "--crop", "60,0,8,8"]);
    assert_eq!(output.status.code(), Some(2));
    let lines: Vec<Value> = stderr(&output).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((&lines[0]["event"], &lines[0]["level"]), (&"message".into(), &"error".into()));
}

#[test]
fn colours_are_forced_and_forbidden_by_the_usual_variables_for_all_messages() {
    let root = folder(1);
    let with = |variables: &[(&str, &str)], args: &[&str]| {
        let mut command = Command::new(BIN);
        for name in ["NO_COLOR", "CLICOLOR_FORCE", "CLICOLOR"] {
            command.env_remove(name);
        }
        command.envs(variables.iter().copied()).current_dir(root.path()).args(args);
        stderr(&command.output().unwrap())
    };
    // Our own message, and clap's.
    for args in [&["nosuch.gltf"][..], &["--nosuch"]] {
        let forced = with(&[("CLICOLOR_FORCE", "1"), ("TERM", "dumb")], args);
        assert!(forced.starts_with("\u{1b}[1m\u{1b}[31merror:\u{1b}[0m "), "{forced:?}");
        assert!(!with(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")], args).contains('\u{1b}'));
        assert!(with(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "")], args).contains('\u{1b}'), "an empty value is none");
        assert!(!with(&[], args).contains('\u{1b}'));
    }
}

/// As `2>&1 | head -1` does it.
#[test]
fn a_reader_of_stderr_that_goes_away_does_not_stop_the_run() {
    let root = folder(6);
    for style in ["plain", "json"] {
        let mut run = Command::new(BIN)
            .current_dir(root.path())
            .args([".", "-v", "-o", style, "--progress", style])
            .args(SMALL)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(run.stderr.take().unwrap()).read_line(&mut line).unwrap();
        assert_eq!(run.wait().unwrap().code(), Some(0), "{style}");
        assert!((0..6).all(|i| root.path().join(format!("{style}/s{i}.json")).is_file()));
    }
}

#[test]
fn the_lines_of_a_run_are_these() {
    let root = folder(2);
    let text = steady(&stderr(&prt_in(root.path(), &["s0.gltf", "s1.gltf"])));
    let text = text.split_once('\n').map_or("", |(_, rest)| rest);
    assert_eq!(text, "[1/2] renders/s0.exr  8x4  1 spp\n[2/2] renders/s1.exr  8x4  1 spp\n2 rendered\n");
}
