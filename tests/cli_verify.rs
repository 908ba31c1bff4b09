//! `prt-batch verify` as users and scripts meet it: exit codes, table, JSON, refusals.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Exit code, stdout and stderr of `prt-batch verify` with `args`.
fn verify(args: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_prt-batch")).arg("verify").args(args).output().expect("it was built");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (output.status.code().expect("an exit code"), text(output.stdout), text(output.stderr))
}

fn scene() -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/triangle.gltf").display().to_string()
}

#[test]
fn a_scene_passes_with_a_table() {
    let (code, stdout, stderr) = verify(&["hits", &scene(), "--rays", "50", "--accel", "bvh,linear"]);
    assert_eq!(code, 0, "{stdout}{stderr}");
    for part in ["must hit", "phantom", "unexplained", "front+bvh", "linear", "triangle.gltf", "passed"] {
        assert!(stdout.contains(part), "no {part}: {stdout}");
    }
    let (_, verbose, _) = verify(&["hits", &scene(), "--rays", "50", "--accel", "bvh", "--verbose"]);
    assert!(verbose.contains("coplanar") && !stdout.contains("coplanar"), "{verbose}");
}

#[test]
fn the_same_seed_gives_the_same_json_for_any_number_of_threads() {
    let run = |seed: &str, threads: &str| {
        let args = ["hits", &scene(), "--rays", "60", "--accel", "bvh", "--json", "--seed", seed, "--threads", threads];
        let (code, stdout, stderr) = verify(&args);
        assert_eq!(code, 0, "{stderr}");
        serde_json::from_str::<Value>(&stdout).expect("JSON")
    };
    let found = run("7", "1");
    assert_eq!(found, run("7", "2"));
    assert_ne!(found["subjects"], run("8", "1")["subjects"]);
    assert_eq!((&found["passed"], &found["seed"], &found["rays"]), (&true.into(), &7.into(), &(60 * 14).into()));
    // Scenes of users are held to the limit of disagreements too: four kinds of rays count for it.
    assert_eq!((&found["subjects"][0]["ordinary"], &found["usual_rays"]), (&true.into(), &(60 * 4).into()));
    let kind = &found["subjects"][0]["kinds"][0];
    assert_eq!((&kind["kind"], &kind["rays"], &kind["disagreements"]), (&"camera".into(), &60.into(), &0.into()));
    let tally = &kind["contenders"][0];
    assert_eq!((&tally["name"], &tally["misses"], &tally["occluded"]), (&"bvh".into(), &0.into(), &0.into()));
}

#[test]
fn light_has_scenes_of_its_own_and_one_backend() {
    for (args, part) in [
        (&["light", "a.gltf"][..], "scenes of its own"),
        (&["light", "--accel", "bvh,linear"], "one ray backend at a time"),
        (&["light", "--rays", "5"], "--rays means nothing to verify light"),
        (&["lens"], "not built yet"),
    ] {
        let (code, _, stderr) = verify(args);
        assert!(code == 2 && stderr.contains(part), "{args:?}: {code} {stderr}");
    }
}

#[test]
fn what_cannot_be_read_is_code_3_and_the_others_are_verified() {
    let (code, _, stderr) = verify(&["hits", "nowhere.gltf", "--rays", "20"]);
    assert!(code == 3 && stderr.contains("nowhere.gltf: there is no such file or folder"), "{code} {stderr}");
    let (code, stdout, _) = verify(&["hits", "nowhere.gltf", &scene(), "--rays", "20", "--accel", "bvh"]);
    assert!(code == 3 && stdout.contains("passed"), "{code} {stdout}");
}

#[test]
fn materials_of_a_scene_pass_and_random_ones_are_for_the_built_in_ones() {
    let args = ["materials", &scene(), "--samples", "2000", "--seed", "3"];
    let (code, stdout, stderr) = verify(&args);
    assert_eq!(code, 0, "{stdout}{stderr}");
    assert!(stdout.contains("passed"), "{stdout}");
    let (code, _, stderr) = verify(&["materials", &scene(), "--random", "2"]);
    assert!(code == 2 && stderr.contains("--random adds to the built-in materials"), "{code} {stderr}");
    let (code, _, stderr) = verify(&["hits", &scene(), "--samples", "2000"]);
    assert!(code == 2 && stderr.contains("samples"), "{code} {stderr}");
}

#[test]
fn shapes_pass_and_take_no_inputs() {
    let (code, stdout, stderr) = verify(&["shapes", "--rays", "200", "--random", "10", "--seed", "2"]);
    assert!(code == 0 && stdout.contains("bottle") && stdout.contains("passed"), "{code} {stdout}{stderr}");
    let (code, stdout, _) = verify(&["shapes", "--rays", "100", "--random", "1", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
    assert!(code == 0 && report["passed"] == true && report["profiles"][0]["missed"] == 0, "{stdout}");
    let (code, _, stderr) = verify(&["shapes", &scene()]);
    assert!(code == 2 && stderr.contains("profiles of its own"), "{code} {stderr}");
    let (code, _, stderr) = verify(&["shapes", "--accel", "bvh"]);
    assert!(code == 2 && stderr.contains("--accel means nothing to verify shapes"), "{code} {stderr}");
}

#[test]
fn what_is_not_built_is_refused_by_name() {
    for what in ["lens", "output"] {
        let (code, _, stderr) = verify(&[what]);
        assert!(
            code == 2 && stderr.contains(&format!("{what} is not built yet; built: hits, materials, light, shapes")),
            "{code} {stderr}"
        );
    }
    let (code, _, stderr) = verify(&["hits", "--accel", "bvh,embre"]);
    assert!(code == 2 && stderr.contains("did you mean embree?"), "{code} {stderr}");
    let (code, _, stderr) = verify(&["hits", "--rays", "0"]);
    assert!(code == 2 && stderr.contains("must be a whole number from 1"), "{code} {stderr}");
}

/// BVH-01: the example scenes and, where they are there, shared ones; a slice of what `scripts/test.sh --long` runs.
#[test]
fn bvh01_backends_agree_on_the_corpus() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut inputs = vec![root.join("scenes")];
    let shared = root.join("../shared/assets");
    for name in ["Box", "Duck", "SimpleInstancing"].map(|name| shared.join(name).join("glTF")) {
        match name.exists() {
            true => inputs.push(name),
            false => println!("skipped: there is no {}", name.display()),
        }
    }
    let inputs: Vec<String> = inputs.iter().map(|path: &PathBuf| path.display().to_string()).collect();
    let mut args = vec!["hits", "--rays", "60"];
    args.extend(inputs.iter().map(String::as_str));
    let (code, stdout, stderr) = verify(&args);
    assert_eq!(code, 0, "{stdout}{stderr}");
}
