//! `prt-batch compare` as scripts meet it: exit codes and messages, on pictures made here.

use prt::image::exr::{ExrCamera, ExrOptions, ExrPicture, ExrProjection, encode};
use std::path::Path;
use std::process::Command;

const SIZE: u32 = 32;

/// Writes an EXR whose pixels are `value(x, y)`.
fn write(path: &Path, origin: [u32; 2], size: [u32; 2], value: impl Fn(u32, u32) -> f32) {
    let rows = origin[1]..origin[1] + size[1];
    let pixels: Vec<_> = rows
        .flat_map(|y| (origin[0]..origin[0] + size[0]).map(move |x| (x, y)))
        .map(|(x, y)| [value(x, y); 3])
        .collect();
    let camera = ExrCamera {
        world_from_camera: glam::DMat4::IDENTITY,
        projection: ExrProjection::Perspective { yfov: 1.0 },
        aspect_ratio: 1.0,
    };
    let picture = ExrPicture {
        display_size: [SIZE, SIZE],
        origin,
        size,
        pixels: &pixels,
        channels: Vec::new(),
        camera,
        lens: None,
        attributes: Vec::new(),
    };
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, encode(&picture, ExrOptions::default()).unwrap()).unwrap();
}

fn whole(path: &Path, value: impl Fn(u32, u32) -> f32) {
    write(path, [0, 0], [SIZE, SIZE], value);
}

/// Exit code, stdout and stderr.
fn compare(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let command = Command::new(env!("CARGO_BIN_EXE_prt-batch")).current_dir(folder).arg("compare").args(args).output();
    let output = command.unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn limits_decide_between_0_and_1() {
    let root = tempfile::tempdir().unwrap();
    whole(&root.path().join("ref.exr"), |x, _| 1.0 + x as f32);
    whole(&root.path().join("a.exr"), |x, _| 1.01 * (1.0 + x as f32));
    assert_eq!(compare(root.path(), &["a.exr", "ref.exr"]).0, 0);
    assert_eq!(compare(root.path(), &["a.exr", "ref.exr", "--max-bias", "1.1", "--max-relmse", "1e-3"]).0, 0);
    let (code, _, stderr) = compare(root.path(), &["a.exr", "ref.exr", "--max-bias", "0.9"]);
    assert!(code == 1 && stderr.contains("a.exr: mean of R is off by +1.0000 %, beyond --max-bias 0.9"), "{stderr}");
    let (code, stdout, stderr) = compare(root.path(), &["a.exr", "ref.exr", "--max-relmse", "1e-5", "--json"]);
    assert!(code == 1 && stderr.contains("--max-relmse"), "{stderr}");
    let json: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(json["passed"], false);
    assert!(json["pairs"][0]["pictures"][0]["relmse"].as_f64().unwrap() > 5e-5);
}

#[test]
fn a_non_finite_pixel_fails_without_any_limit() {
    let root = tempfile::tempdir().unwrap();
    whole(&root.path().join("ref.exr"), |_, _| 1.0);
    whole(&root.path().join("a.exr"), |x, y| if (x, y) == (3, 4) { f32::NAN } else { 1.0 });
    let (code, _, stderr) = compare(root.path(), &["a.exr", "ref.exr"]);
    assert!(code == 1 && stderr.contains("1 pixels are not finite"), "{stderr}");
}

#[test]
fn unreadable_exits_with_3_and_wrong_use_with_2() {
    let root = tempfile::tempdir().unwrap();
    whole(&root.path().join("ref.exr"), |_, _| 1.0);
    write(&root.path().join("small/a.exr"), [0, 0], [16, 16], |_, _| 1.0);
    std::fs::write(root.path().join("text.exr"), "no picture").unwrap();
    for (args, code, says) in [
        (&["nosuch.exr", "ref.exr"][..], 3, "nosuch.exr"),
        (&["text.exr", "ref.exr"], 3, "text.exr: not a readable EXR"),
        (&["ref.exr", "small/a.exr"], 3, "cannot be compared"),
        (&["ref.exr"], 2, "REF"),
        (&["small", "ref.exr"], 2, "files or folders"),
        (&["ref.exr", "ref.exr", "--max-bias", "-1"], 2, "--max-bias"),
        (&["ref.exr", "ref.exr", "--ref-stats", "x"], 2, "FILE:KEY"),
        (&["ref.exr", "ref.exr", "--ref-stats", "no.json:x"], 3, "no.json"),
    ] {
        let (found, _, stderr) = compare(root.path(), args);
        assert!(found == code && stderr.contains(says), "{args:?}: {found} {stderr}");
    }
}

#[test]
fn a_crop_is_compared_with_its_part_of_the_reference() {
    let root = tempfile::tempdir().unwrap();
    whole(&root.path().join("ref.exr"), |x, y| (x * y) as f32);
    write(&root.path().join("crop.exr"), [5, 6], [7, 8], |x, y| (x * y) as f32);
    let (code, _, stderr) = compare(root.path(), &["crop.exr", "ref.exr", "--max-relmse", "0"]);
    assert_eq!(code, 0, "{stderr}");
}

#[test]
fn folders_are_compared_by_name() {
    let root = tempfile::tempdir().unwrap();
    for name in ["one.exr", "sub/two.exr"] {
        whole(&root.path().join("ref").join(name), |_, _| 1.0);
        whole(&root.path().join("a").join(name), |_, _| 1.0);
    }
    let (code, stdout, _) = compare(root.path(), &["a", "ref", "--max-relmse", "0"]);
    assert!(code == 0 && stdout.contains("one.exr") && stdout.contains("two.exr"), "{stdout}");
    std::fs::remove_file(root.path().join("a/one.exr")).unwrap();
    let (code, _, stderr) = compare(root.path(), &["a", "ref"]);
    assert!(code == 3 && stderr.contains("one.exr"), "{stderr}");
}

#[test]
fn several_seeds_are_tested_by_blocks() {
    let root = tempfile::tempdir().unwrap();
    let noise = |seed: u32, x: u32, y: u32| {
        let hash = (x + 57 * y + 1013 * seed + 1).wrapping_mul(0x9E37_79B1);
        ((hash ^ (hash >> 15)).wrapping_mul(0x85EB_CA77) >> 8) as f32 / (1 << 24) as f32 - 0.5
    };
    whole(&root.path().join("ref.exr"), |_, _| 1.0);
    whole(&root.path().join("biased.exr"), |_, _| 1.1);
    let names: Vec<String> = (0..6).map(|seed| format!("{seed}.exr")).collect();
    for (seed, name) in (0..).zip(&names) {
        whole(&root.path().join(name), |x, y| 1.0 + noise(seed, x, y));
    }
    let args = |reference: &'static str| names.iter().map(String::as_str).chain([reference]).collect::<Vec<_>>();
    let (code, stdout, stderr) = compare(root.path(), &args("ref.exr"));
    assert!(code == 0 && stdout.contains("6 seeds, 0 of 12 block tests rejected"), "{stdout} {stderr}");
    let (code, _, stderr) = compare(root.path(), &args("biased.exr"));
    assert!(code == 1 && stderr.contains("beyond noise"), "{stderr}");
}
