//! A batch that is killed loses nothing that was finished, and the same command completes it.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const SCENE: &str = include_str!("data/triangle.gltf");

/// Scenes in the batch.
const SCENES: usize = 10;

fn command(folder: &Path, out: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_prt-batch"));
    // One backend, whose library is not looked for: the time between start and end is rendering and writing.
    command.current_dir(folder).args(["scenes", "-o", out, "--size", "48x24", "-s", "16", "--accel", "bvh", "-q"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// The pictures' bytes by name.
fn pictures(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let is_picture = |name: &String| name.ends_with(".exr") || name.ends_with(".png");
    names(folder)
        .into_iter()
        .filter(is_picture)
        .map(|name| (name.clone(), fs::read(folder.join(name)).unwrap()))
        .collect()
}

/// Kills `moments` runs at random moments (seed 1, splitmix64). After each, every file that has its name is whole, and
/// the same command completes the batch with the bytes of an undisturbed run.
fn kill(moments: u64) {
    let root = tempfile::tempdir().unwrap();
    fs::create_dir(root.path().join("scenes")).unwrap();
    for i in 0..SCENES {
        // Emission differs, so that no picture can stand for another.
        let scene = SCENE.replacen("0.25", &format!("0.{}5", 1 + i), 1);
        fs::write(root.path().join(format!("scenes/s{i}.gltf")), scene).unwrap();
    }
    // The shortest of three, so that the moments do not miss the run where other work made one of them long.
    let run = |i| {
        let clock = Instant::now();
        assert!(command(root.path(), &format!("undisturbed{i}")).status().unwrap().success());
        clock.elapsed()
    };
    let whole_run = (0..3).map(run).min().unwrap();
    let expected = pictures(&root.path().join("undisturbed0"));
    assert_eq!(expected.len(), 2 * SCENES);

    let out = root.path().join("out");
    let (mut state, mut interrupted, mut kept) = (1_u64, 0, 0);
    for moment in 0..moments {
        let mut child = command(root.path(), "out").spawn().unwrap();
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let share = ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64;
        std::thread::sleep(Duration::from_secs_f64(share * whole_run.as_secs_f64()));
        child.kill().unwrap();
        interrupted += u32::from(!child.wait().unwrap().success());

        for (name, bytes) in pictures(&out) {
            assert!(expected[&name] == bytes, "{name} is torn after kill {moment}");
        }
        let mut finished = 0;
        for name in names(&out).iter().filter(|name| name.ends_with(".json")) {
            let json = serde_json::from_slice::<serde_json::Value>(&fs::read(out.join(name)).unwrap());
            assert!(json.is_ok(), "{name} is torn after kill {moment}");
            finished += u32::from(name != "batch.json");
        }
        assert!(command(root.path(), "out").status().unwrap().success(), "after kill {moment}");
        assert!(pictures(&out) == expected, "the same command did not complete the batch after kill {moment}");
        let left: Vec<_> = names(&out).into_iter().filter(|name| name.ends_with(".tmp")).collect();
        assert!(left.is_empty(), "{left:?} left after kill {moment}");
        let batch: serde_json::Value = serde_json::from_slice(&fs::read(out.join("batch.json")).unwrap()).unwrap();
        let up_to_date = batch["counts"]["up-to-date"].as_u64().unwrap();
        assert_eq!(up_to_date, u64::from(finished), "what was finished is kept, after kill {moment}");
        kept += up_to_date;
        fs::remove_dir_all(&out).unwrap();
    }
    // Otherwise the moments missed the run.
    println!("{interrupted} of {moments} runs were killed before they ended; {kept} images were kept");
    assert!(u64::from(interrupted) > moments / 2 && kept > 0);
}

#[test]
fn killed_at_200_random_moments_nothing_is_torn_and_the_same_command_goes_on() {
    kill(200);
}
