//! The built binary as users and their scripts meet it: exit codes and messages of `docs/cli.md`.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");

/// A scene of one emissive triangle in front of one camera; its buffer is inside the file.
const SCENE: &str = include_str!("data/triangle.gltf");

fn prt_in(folder: &Path, args: &[&str]) -> Output {
    Command::new(BIN).current_dir(folder).args(args).output().expect("the binary was built for this test")
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("messages are UTF-8")
}

/// Runs and checks the exit code and that stderr has all of `says`.
#[track_caller]
fn refused(folder: &Path, args: &[&str], code: i32, says: &[&str]) {
    let output = prt_in(folder, args);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(code), "{args:?}: {text}");
    for part in says {
        assert!(text.contains(part), "{args:?} must say {part:?}, but says: {text}");
    }
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

#[test]
fn wrong_values_name_option_value_and_what_is_allowed() {
    let root = folder();
    for (option, value, allowed) in [
        ("--size", "0x0", "WIDTHxHEIGHT"),
        ("--size", "100", "WIDTHxHEIGHT"),
        ("--size", "99999999x2", "65536"),
        ("--width", "0", "from 1 to 65536"),
        ("--spp", "0", "from 1 to 1048576"),
        ("--size", "-4x4", "WIDTHxHEIGHT"),
        ("--crop", "-1,0,4,4", "X,Y,WIDTH,HEIGHT"),
        ("--threads", "-1", "from 1"),
        ("--spp", "-1", "from 1 to 1048576"),
        ("--spp", "abc", "from 1 to 1048576"),
        ("--spp", "1.5", "from 1 to 1048576"),
        ("--seed", "x", "from 0 to 18446744073709551615"),
        ("--max-bounces", "2000", "from 0 to 1024"),
        ("--crop", "1,2,3", "X,Y,WIDTH,HEIGHT"),
        ("--crop", "1,2,0,4", "at least 1"),
        ("--filter", "tent:0", "above 0"),
        ("--filter", "lanczos", "box, tent, gaussian, blackman-harris"),
        ("--filter", "gaussian:nan", "above 0"),
        ("--accel", "cuda", "auto, embree, bvh, linear"),
        ("--exposure", "x", "from -100 to 100"),
        ("--obj-up", "x", "allowed: y, z"),
        ("--obj-scale", "0", "from 1e-9 to 1e9"),
        ("--smooth-angle", "-1", "from 0 to 180"),
        ("--exposure", "nan", "from -100 to 100"),
        ("--exposure", "automatic", "must be auto or a number"),
        ("--tonemap", "filmic", "neutral, agx, aces, srgb"),
        ("--clamp", "0", "from 1e-6 to 1e12"),
        ("--clamp", "nan", "from 1e-6 to 1e12"),
        ("--brdf", "half", "full, appendix-b"),
        ("--default-light", "studio", "auto, on, off"),
        ("--integrator", "whited", "path, direct, whitted, ao, normal, albedo"),
        ("--exr", "double", "float, half"),
        ("--exr-compression", "dwaa", "zip, zips, piz, rle, none"),
        ("--progress", "dots", "auto, plain, json, none"),
        ("--threads", "0", "from 1"),
        ("--memory", "0", "8GiB"),
        ("--memory", "8G", "KiB MiB GiB TiB"),
        ("--memory", "-5%", "from 1% to 100%"),
        ("--name", "{steam}", "{stem}, {parent}, {camera}"),
        ("--name", "{frame:4}", "written 01 to 09"),
        ("--name", "../{stem}", "below the output folder"),
    ] {
        refused(root.path(), &["a.gltf", option, value], 2, &["error: ", option, &format!("'{value}'"), allowed]);
    }
    assert!(!root.path().join("renders").exists());
}

#[test]
fn unbuilt_options_and_commands_are_refused_by_name() {
    let root = folder();
    refused(root.path(), &["a.gltf", "--display", "-1"], 2, &["--display is not built yet"]);
    refused(root.path(), &["render", "--display", "1", "a.gltf"], 2, &["--display is not built yet"]);
    refused(root.path(), &["--transparent", "a.gltf"], 2, &["--transparent is not built yet"]);
    refused(root.path(), &["bench", "a.gltf", "--out", "x"], 2, &["bench is not built yet"]);
    assert!(!root.path().join("renders").exists());
}

#[test]
fn unknown_options_are_refused_with_a_suggestion() {
    refused(folder().path(), &["a.gltf", "--widht", "5"], 2, &["--widht", "--width"]);
}

#[test]
fn usage_errors_say_what_to_do() {
    let root = folder();
    refused(root.path(), &[], 2, &["no INPUT", "--help"]);
    refused(root.path(), &["a.gltf", "--size", "64x32", "--width", "3"], 2, &["--size", "--width"]);
    let crop = ["a.gltf", "--size", "64x32", "--crop", "60,0,8,8"];
    refused(root.path(), &crop, 2, &["--crop 60,0,8,8", "64 x 32"]);
}

#[test]
fn help_has_examples_and_version_is_told() {
    let help = prt_in(folder().path(), &["--help"]);
    let text = String::from_utf8(help.stdout).unwrap();
    assert!(help.status.success() && text.contains("Examples:") && text.contains("--out"), "{text}");
    assert!(["--camera-from", "--eye", "--look-at", "--up", "--yfov"].iter().all(|o| text.contains(o)), "{text}");
    assert!(!text.contains("--transparent"), "what is not built is not advertised");
    assert!(text.contains("--default-light"), "{text}");
    let version = prt_in(folder().path(), &["--version"]);
    assert_eq!(String::from_utf8(version.stdout).unwrap().trim(), concat!("prt-batch ", env!("CARGO_PKG_VERSION")));
}

#[test]
fn bad_inputs_exit_with_3_and_name_the_file() {
    let root = folder();
    fs::create_dir(root.path().join("empty")).unwrap();
    fs::write(root.path().join("scene.txt"), "").unwrap();
    refused(root.path(), &["nosuch.gltf"], 3, &["nosuch.gltf", "no such file"]);
    refused(
        root.path(),
        &["scenes/*.gltf"],
        3,
        &["scenes/*.gltf", "no file matches this pattern", "Is the folder right?"],
    );
    refused(root.path(), &["empty"], 3, &["empty", "no scene file", ".gltf"]);
    refused(root.path(), &["scene.txt"], 3, &["scene.txt", "not a scene file", ".glb"]);
}

#[test]
fn one_bad_input_of_several_is_named_and_every_image_is_reported() {
    let root = folder();
    fs::write(root.path().join("broken.gltf"), "{ not json").unwrap();
    let output = prt_in(root.path(), &["broken.gltf", "missing.glb", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let inputs: Vec<_> = json["images"].as_array().unwrap().iter().map(|i| i["input"].as_str().unwrap()).collect();
    assert_eq!(inputs, ["broken.gltf", "missing.glb"]);
    assert_eq!(json["counts"]["failed"], 2);
}

#[test]
fn a_scene_or_a_folder_that_is_not_there_says_which_are() {
    let root = folder();
    fs::write(root.path().join("a.gltf"), SCENE).unwrap();
    refused(root.path(), &["a.gltf", "--scene", "Night"], 3, &["a.gltf: /scenes", "no scene \"Night\"", "Allowed: 0."]);
    refused(root.path(), &["a.gltf", "--asset-root", "none"], 3, &["none"]);
    let start = SCENE.find("data:application").expect("a data URI");
    let end = start + SCENE[start..].find('"').expect("its end");
    let outside = format!("{}../points.bin{}", &SCENE[..start], &SCENE[end..]);
    fs::create_dir(root.path().join("sub")).unwrap();
    fs::write(root.path().join("sub/a.gltf"), outside).unwrap();
    fs::write(root.path().join("points.bin"), [0; 36]).unwrap();
    refused(root.path(), &["sub/a.gltf"], 3, &["/buffers/0/uri", "../points.bin", "--asset-root"]);
}

#[test]
fn same_stems_are_refused_with_the_name_that_tells_them_apart() {
    let root = folder();
    for sub in ["red", "blue"] {
        fs::create_dir(root.path().join(sub)).unwrap();
        fs::write(root.path().join(sub).join("lamp.gltf"), SCENE).unwrap();
    }
    let clash = ["red/lamp.gltf", "blue/lamp.gltf"];
    refused(root.path(), &clash, 2, &["red/lamp.gltf and blue/lamp.gltf", "lamp", "--name '{parent}-{stem}'"]);
    assert!(!root.path().join("renders").exists());
    fs::write(root.path().join("batch.gltf"), SCENE).unwrap();
    refused(root.path(), &["batch.gltf"], 2, &["batch.gltf", "reserved", "--name"]);
}

#[test]
fn an_output_folder_that_cannot_be_made_exits_with_4() {
    let root = folder();
    fs::write(root.path().join("file"), "").unwrap();
    fs::write(root.path().join("a.gltf"), SCENE).unwrap();
    refused(root.path(), &["a.gltf", "--out", "file/renders"], 4, &["file/renders", "cannot be written", "--out"]);
}

#[test]
fn json_has_every_field_of_the_contract() {
    let root = folder();
    fs::write(root.path().join("broken.gltf"), "{").unwrap();
    let output = prt_in(root.path(), &["broken.gltf", "--json", "--progress", "none", "--force", "--no-report"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    for field in ["prt", "command", "started", "seconds", "host", "accel", "counts", "images"] {
        assert!(json.get(field).is_some(), "{field} in {json}");
    }
    let image = &json["images"][0];
    for field in [
        "input",
        "scene",
        "camera",
        "frame",
        "status",
        "error_message",
        "outputs",
        "width",
        "height",
        "spp",
        "seed",
        "accel",
        "seconds",
        "rays",
        "mrays_per_s",
        "estimated_error",
        "stopped_by",
        "target_error",
        "worst_tile",
        "non_finite_samples",
        "truncated",
        "energy_clamped",
        "peak_rss_bytes",
        "triangles",
        "instances",
        "lights",
        "features",
        "skipped",
        "warnings",
        "fingerprint",
    ] {
        assert!(image.get(field).is_some(), "{field} in {image}");
    }
    for (object, fields) in [
        ("outputs", &["exr", "png", "json"][..]),
        ("accel", &["requested", "used", "version", "isa"]),
        ("seconds", &["load", "decode", "build", "render", "write", "total"]),
    ] {
        assert!(fields.iter().all(|field| image[object].get(field).is_some()), "{object} in {image}");
    }
    let written: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(root.path().join("renders/batch.json")).unwrap()).unwrap();
    assert_eq!(written, json, "stdout is batch.json");
    assert!(root.path().join("renders/broken.json").is_file());
}

#[test]
fn a_reader_of_stdout_that_goes_away_is_no_panic() {
    let root = folder();
    let mut child = Command::new(BIN)
        .current_dir(root.path())
        .args(["nosuch.gltf", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(!stderr(&output).contains("panicked"));
}

/// Needs loader and renderer.
#[test]
fn a_scene_becomes_exr_png_and_json_also_below_spaces_and_unicode() {
    let root = folder();
    let scenes = root.path().join("mes scènes 光");
    fs::create_dir(&scenes).unwrap();
    fs::write(scenes.join("été 1.gltf"), SCENE).unwrap();
    let args = ["mes scènes 光/été 1.gltf", "-o", "rendus ü", "--size", "16x8", "-s", "2", "--accel", "linear"];
    let output = prt_in(root.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let mut files: Vec<_> = fs::read_dir(root.path().join("rendus ü"))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(files, ["batch.json", "index.html", "été 1.exr", "été 1.json", "été 1.png"]);
    assert!(stderr(&output).contains("16x8  2 spp"), "{}", stderr(&output));
}

/// Needs loader and renderer.
#[test]
fn one_bad_file_stops_none_and_exits_with_1() {
    let root = folder();
    fs::write(root.path().join("a.gltf"), "{").unwrap();
    fs::write(root.path().join("b.gltf"), SCENE).unwrap();
    let small = ["--size", "8x4", "-s", "1", "--accel", "linear"];
    let output = prt_in(root.path(), &[&["a.gltf", "b.gltf"][..], &small].concat());
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(root.path().join("renders/b.exr").is_file() && stderr(&output).contains("a.gltf"));
}

/// Needs loader and renderer.
#[test]
fn equal_renders_in_two_processes_have_equal_bytes() {
    let root = folder();
    fs::write(root.path().join("a.gltf"), SCENE).unwrap();
    let render = |out: &str, threads: &str| {
        let args = ["a.gltf", "-o", out, "--size", "32x16", "-s", "4", "--accel", "bvh", "-t", threads];
        let output = prt_in(root.path(), &args);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        ["a.exr", "a.png"].map(|name| fs::read(root.path().join(out).join(name)).unwrap())
    };
    let first = render("one", "1");
    for again in 0..3 {
        assert!(first == render(&format!("again{again}"), "2"), "run {again} differs");
    }
}
