//! `prt-batch bench rays` as scripts meet it: the keys of its JSON, exit codes and messages. Numbers are only asked to be
//! possible ones: few rays, a debug build, a busy machine.

use serde_json::Value;
use std::path::Path;
use std::process::Command;

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");

/// Exit code, stdout and stderr.
fn bench(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let command = Command::new(BIN).current_dir(folder).args(["bench", "rays"]).args(args).output();
    let output = command.expect("the binary was built for this test");
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// A folder with a lumpy sphere of about 4000 triangles between two walls, `lumps.obj`; no camera, no light.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let (mut text, side) = (String::new(), 46);
    for i in 0..side * side {
        let (u, v) = ((i % side) as f64 / (side - 1) as f64, (i / side) as f64 / (side - 1) as f64);
        let (theta, phi) = (std::f64::consts::PI * (0.01 + 0.98 * v), std::f64::consts::TAU * u);
        let r = 1.0 + 0.2 * (5.0 * theta).sin() * (4.0 * phi).cos();
        text += &format!("v {} {} {}\n", r * theta.sin() * phi.cos(), r * theta.cos(), r * theta.sin() * phi.sin());
    }
    for y in 0..side - 1 {
        for x in 0..side - 1 {
            let a = y * side + x + 1;
            text += &format!("f {} {} {}\nf {} {} {}\n", a, a + 1, a + side + 1, a, a + side + 1, a + side);
        }
    }
    text += "v -3 -2 -3\nv 3 -2 -3\nv 3 -2 3\nv -3 -2 3\nv 3 2 -3\nv -3 2 -3\nf -6 -5 -4 -3\nf -6 -5 -2 -1\n";
    std::fs::write(folder.path().join("lumps.obj"), text).unwrap();
    folder
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

fn is_positive(value: &Value) -> bool {
    value.as_f64().is_some_and(|n| n > 0.0 && n.is_finite())
}

#[test]
fn json_has_the_keys_of_the_contract() {
    let folder = folder();
    let args = ["lumps.obj", "--rays", "4000", "--rounds", "2", "--threads", "2", "--seed", "7", "--json"];
    let (code, stdout, stderr) = bench(folder.path(), &args);
    assert_eq!(code, 0, "{stderr}");
    let json: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((json["rays"].as_u64(), json["rounds"].as_u64()), (Some(4096), Some(2)), "whole batches of 2048");
    assert_eq!((json["threads"].as_u64(), json["seed"].as_u64()), (Some(2), Some(7)));
    let scene = &json["scenes"][0];
    assert_eq!(scene["input"], "lumps.obj");
    assert_eq!(scene["triangles"], 45 * 45 * 2 + 4);
    assert_eq!(scene["front_triangles"], 4, "the walls");
    let has_embree = stderr.is_empty();
    if !has_embree {
        println!("skipped: there is no Embree here, its half of the result is not looked at: {stderr}");
        assert!(stderr.contains("only bvh is measured"), "{stderr}");
    }
    let backends: &[&str] = if has_embree { &["bvh", "embree"] } else { &["bvh"] };
    let rows = scene["rows"].as_array().unwrap();
    let mut expected = Vec::new();
    for kind in ["primary", "diffuse", "shadow", "incoherent"] {
        for threads in [1, 2] {
            for setup in ["prepared", "bare"] {
                expected.extend(backends.iter().map(|backend| format!("{kind} {backend} {setup} {threads}")));
            }
        }
    }
    let word = |row: &Value, key: &str| row[key].as_str().unwrap().to_owned();
    let name = |row: &Value| {
        format!("{} {} {} {}", word(row, "kind"), word(row, "backend"), word(row, "setup"), row["threads"])
    };
    assert_eq!(rows.iter().map(name).collect::<Vec<_>>(), expected);
    for row in rows {
        assert!(is_positive(&row["mrays_per_s"]) && is_positive(&row["wall_mrays_per_s"]), "{row}");
        assert_eq!(is_positive(&row["ratio_to_embree"]), has_embree, "{row}");
        if row["backend"] == "embree" {
            assert_eq!(row["ratio_to_embree"], 1.0);
            assert!([1, 8, 16].contains(&row["entry"].as_u64().unwrap()), "{row}");
        }
    }
    let build = scene["build"].as_array().unwrap();
    assert_eq!(build.iter().map(|row| word(row, "backend")).collect::<Vec<_>>(), backends);
    for row in build {
        assert!(is_positive(&row["seconds"]) && is_positive(&row["bytes"]), "{row}");
    }
    if has_embree {
        // A wrong hit would be 61 in a million: of 16,384 rays none may be.
        assert_eq!(scene["disagreements_per_million"], 0.0, "{scene}");
        let overall = &json["bvh_over_embree"];
        for key in ["geomean", "worst"] {
            assert!(is_positive(&overall[key]) && is_positive(&overall["bare"][key]), "{overall}");
        }
        assert!(overall["worst"].as_f64() <= overall["geomean"].as_f64());
        assert_eq!(overall["spread"].as_array().unwrap().len(), 2);
    } else {
        assert!(scene["disagreements_per_million"].is_null() && json["bvh_over_embree"].is_null());
    }
}

#[test]
fn linear_joins_on_request_and_is_the_slowest() {
    let folder = folder();
    let args = ["lumps.obj", "--accel", "linear,bvh", "--rays", "1", "--rounds", "3", "-t", "1", "--json"];
    let (code, stdout, stderr) = bench(folder.path(), &args);
    assert_eq!((code, stderr.as_str()), (0, ""));
    let json: Value = serde_json::from_str(&stdout).unwrap();
    let scene = &json["scenes"][0];
    let rows = scene["rows"].as_array().unwrap();
    assert_eq!(rows.iter().filter(|row| row["backend"] == "linear").count(), 4, "a row a kind");
    for row in rows.iter().filter(|row| row["backend"] == "bvh") {
        assert!(row["ratio_to_linear"].as_f64().unwrap() > 3.0, "{row}");
        assert!(row["ratio_to_embree"].is_null());
    }
    assert_eq!(scene["linear_disagreements_per_million"], 0.0);
    assert_eq!(keys(&scene["build"][0])[..2], ["backend", "bytes"], "brute force builds nothing");
    assert_eq!(scene["build"].as_array().unwrap().len(), 1);
}

#[test]
fn a_table_is_for_people() {
    let folder = folder();
    let args = ["lumps.obj", "--accel", "bvh", "--rays", "2048", "--rounds", "1", "--threads", "1"];
    let (code, stdout, stderr) = bench(folder.path(), &args);
    assert_eq!((code, stderr.as_str()), (0, ""));
    for part in ["lumps.obj: 4054 triangles, 4 of them in front", "Mtri/s", "primary", "incoherent", "2048 rays"] {
        assert!(stdout.contains(part), "no {part} in\n{stdout}");
    }
}

#[test]
fn what_cannot_be_measured_is_told_and_the_others_are_measured() {
    let folder = folder();
    std::fs::write(folder.path().join("broken.gltf"), "{").unwrap();
    std::fs::write(folder.path().join("empty.gltf"), r#"{"asset": {"version": "2.0"}}"#).unwrap();
    let few = ["--accel", "bvh", "--rays", "1", "--rounds", "1", "-t", "1", "--json"];
    let run = |inputs: &[&str]| bench(folder.path(), &[inputs, &few].concat());
    let (code, stdout, stderr) = run(&["broken.gltf", "lumps.obj", "empty.gltf"]);
    assert!(code == 1 && stderr.contains("broken.gltf") && stderr.contains("empty.gltf: no ray hits"), "{stderr}");
    let json: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((json["scenes"].as_array().unwrap().len(), json["failed"].as_array().unwrap().len()), (1, 2));
    let (code, stdout, _) = run(&["broken.gltf"]);
    assert!(code == 3 && stdout.contains("\"failed\""), "{stdout}");
    assert_eq!(run(&["missing.glb"]).0, 3);
}

#[test]
fn wrong_use_exits_with_2() {
    let folder = folder();
    for (args, says) in [
        (&["lumps.obj", "--rays", "0"][..], "--rays"),
        (&["lumps.obj", "--rounds", "x"], "--rounds"),
        (&["lumps.obj", "--accel", "bvh,cuda"], "allowed: bvh, embree, linear"),
        (&["lumps.obj", "--threads", "0"], "--threads"),
        (&["lumps.obj", "--spp", "4"], "--spp"),
        (&[], "INPUT"),
    ] {
        let (code, stdout, stderr) = bench(folder.path(), args);
        assert!(code == 2 && stdout.is_empty() && stderr.contains(says), "{args:?}: {code} {stderr}");
    }
}
