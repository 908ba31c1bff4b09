//! What users read when they made a mistake, word for word: one file a case in `tests/data/messages/`, with the command
//! line and the exit code. `PRT_UPDATE=1 cargo test --test cli_messages` writes the files; read the difference.

use std::fs;
use std::path::Path;
use std::process::Command;

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");

/// A name, the arguments, and the files that are there: (path, text); a path that ends with `/` is a folder.
type Case = (&'static str, &'static [&'static str], &'static [(&'static str, &'static str)]);

const SCENE: &str = include_str!("data/triangle.gltf");
const A: (&str, &str) = ("a.gltf", SCENE);

const TYPED: &[Case] = &[
    ("option-typo", &["a.gltf", "--widht", "5"], &[A]),
    ("option-unbuilt", &["a.gltf", "--transparent"], &[A]),
    ("env-missing", &["a.gltf", "--env", "sky.exr"], &[A]),
    ("env-no-picture", &["a.gltf", "--env", "a.gltf"], &[A]),
    ("env-rotate-alone", &["a.gltf", "--env-rotate", "90"], &[A]),
    ("light-radius-negative", &["a.gltf", "--light-radius", "-0.1"], &[A]),
    ("light-radius-nan", &["a.gltf", "--light-radius", "nan"], &[A]),
    ("sun-angle-too-wide", &["a.gltf", "--sun-angle", "200"], &[A]),
    ("f-stop-zero", &["a.gltf", "--f-stop", "0"], &[A]),
    ("focus-distance-zero", &["a.gltf", "--focus-distance", "0"], &[A]),
    ("aperture-blades-two", &["a.gltf", "--aperture-blades", "2"], &[A]),
    ("sensor-negative", &["a.gltf", "--sensor", "-36"], &[A]),
    ("contradiction-focus", &["a.gltf", "--focus-on", "Main", "--focus-distance", "2"], &[A]),
    ("integrator-typo", &["a.gltf", "--integrator", "whited"], &[A]),
    ("option-twice", &["a.gltf", "--spp", "1", "--spp", "2"], &[A]),
    ("option-without-value", &["a.gltf", "--spp"], &[A]),
    ("option-with-empty-value", &["a.gltf", "--spp="], &[A]),
    ("value-typo", &["a.gltf", "--accel", "embre"], &[A]),
    ("value-strange", &["a.gltf", "--accel", "cuda"], &[A]),
    ("value-unbuilt", &["a.gltf", "--tonemap", "filmic"], &[A]),
    ("size-with-capital-x", &["a.gltf", "--size", "1280X720"], &[A]),
    ("size-with-comma", &["a.gltf", "--size", "1280,720"], &[A]),
    ("size-of-one-number", &["a.gltf", "--size", "1280"], &[A]),
    ("size-too-large", &["a.gltf", "--size", "70000x70000"], &[A]),
    ("spp-too-many", &["a.gltf", "--spp", "1048577"], &[A]),
    ("target-error-zero", &["a.gltf", "--target-error", "0"], &[A]),
    ("target-error-negative", &["a.gltf", "--target-error", "-0.1"], &[A]),
    ("target-error-nan", &["a.gltf", "--target-error", "NaN"], &[A]),
    ("target-error-in-percent", &["a.gltf", "--target-error", "1%"], &[A]),
    ("target-error-above-one", &["a.gltf", "--target-error", "5"], &[A]),
    ("time-limit-without-unit", &["a.gltf", "--time-limit", "30"], &[A]),
    ("time-limit-zero", &["a.gltf", "--time-limit", "0s"], &[A]),
    ("time-limit-negative", &["a.gltf", "--time-limit", "-5s"], &[A]),
    ("time-limit-nan", &["a.gltf", "--time-limit", "NaNs"], &[A]),
    ("batch-time-limit-of-days", &["a.gltf", "--batch-time-limit", "2d"], &[A]),
    ("aov-unbuilt", &["a.gltf", "--aov", "variance,albedo"], &[A]),
    ("aov-typo", &["a.gltf", "--aov", "varience"], &[A]),
    ("aov-without-exr", &["a.gltf", "--aov", "samples", "--no-exr"], &[A]),
    ("threads-absurd", &["a.gltf", "--threads", "100000"], &[A]),
    ("threads-more-than-cores", &["missing.gltf", "--threads", "64"], &[]),
    ("contradiction-size", &["a.gltf", "--size", "64x32", "--width", "3"], &[A]),
    ("contradiction-camera", &["a.gltf", "--eye", "1,2,3", "--look-at", "0,0,0", "--camera", "Main"], &[A]),
    ("contradiction-quiet", &["a.gltf", "-qv"], &[A]),
    ("eye-alone", &["a.gltf", "--eye", "1,2,3"], &[A]),
    ("yfov-alone", &["a.gltf", "--yfov", "30"], &[A]),
    ("input-none", &[], &[]),
    ("input-missing", &["b.gltf"], &[]),
    ("input-with-hyphen", &["-a.gltf"], &[("-a.gltf", SCENE)]),
    ("input-with-hyphen-after-dashes", &["--", "-b.gltf"], &[]),
    ("input-folder-without-scenes", &["textures"], &[("textures/wood.png", "")]),
    ("input-folder-called-like-a-command", &["bench/"], &[("bench/", "")]),
    ("input-of-another-type", &["a.fbx"], &[("a.fbx", "")]),
    ("command-unbuilt", &["bench", "a.gltf"], &[A]),
    ("command-or-folder", &["bench"], &[("bench/a.gltf", SCENE)]),
    ("command-render-or-folder", &["render"], &[("render/a.gltf", SCENE)]),
    ("pattern-without-match", &["scenes/*.gltf"], &[("scenes/a.glb", "")]),
    ("pattern-broken", &["[a.gltf"], &[A]),
    ("out-is-a-file", &["a.gltf", "--out", "notes.txt"], &[A, ("notes.txt", "")]),
    ("generate-typo", &["--generate", "complete-bsh"], &[]),
    ("generate-with-more", &["--generate", "man", "a.gltf"], &[A]),
];

/// Each with this text in night.toml and the arguments `a.gltf --config night.toml`.
const CONFIGS: &[(&str, &str)] = &[
    ("config-syntax", "spp = 64\nsize = 640x360\n"),
    ("config-unclosed", "spp = 64\nname = \"{stem\n"),
    ("config-key-unknown", "spp = 64\nsppp = 5\n"),
    ("config-key-strange", "quality = 5\n"),
    ("config-key-short", "s = 5\n"),
    ("config-key-with-underscore", "no_png = true\n"),
    ("config-key-unbuilt", "env = \"sky.exr\"\n"),
    ("config-key-twice", "spp = 64\nseed = 1\nspp = 5\n"),
    ("config-key-with-dot", "tonemap.curve = \"srgb\"\n"),
    ("config-in-config", "config = \"other.toml\"\n"),
    ("config-value-out-of-range", "seed = 1\nspp = 0\n"),
    ("config-value-typo", "tonemap = \"neutrl\"\n"),
    ("config-value-empty", "name = \"\"\n"),
    ("config-value-of-a-switch", "no-png = \"yes\"\n"),
    ("config-value-list", "size = [640, 360]\n"),
    ("config-value-bool", "spp = true\n"),
    ("config-value-too-short", "eye = [1, 2]\n"),
    ("config-contradiction", "width = 640\nspp = 5\nsize = \"640x360\"\n"),
    (
        "config-contradiction-in-block",
        "[[file]]\nmatch = \"*\"\ncamera = 1\ncamera-from = \"b.glb\"\neye = [0, 0, 1]\n",
    ),
    ("config-run-in-block", "spp = 5\n[[file]]\nmatch = \"a.gltf\"\nout = \"x\"\n"),
    ("config-inputs-in-block", "[[file]]\nmatch = \"a.gltf\"\ninputs = \"b.gltf\"\n"),
    ("config-inputs-wrong", "inputs = [\"a.gltf\", 3]\n"),
    ("config-inputs-empty", "inputs = []\n"),
    ("config-block-without-match", "[[file]]\nspp = 5\n"),
    ("config-block-single", "[file]\nmatch = \"a.gltf\"\nspp = 5\n"),
    ("config-block-pattern-broken", "[[file]]\nmatch = [\"b.gltf\", \"***\"]\nspp = 5\n"),
    ("config-block-match-wrong", "[[file]]\nmatch = 3\n"),
    ("config-block-lacks-look-at", "[[file]]\nmatch = \"*.gltf\"\neye = [1, 2, 3]\n"),
];

/// A run's command line, exit code and stderr.
fn transcript(args: &[&str], files: &[(&str, &[u8])]) -> String {
    let root = tempfile::tempdir().unwrap();
    for (path, text) in files {
        let path = root.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        if !path.is_dir() && !path.to_string_lossy().ends_with('/') {
            fs::write(path, text).unwrap();
        }
    }
    for folder in files.iter().filter(|(path, _)| path.ends_with('/')) {
        fs::create_dir_all(root.path().join(folder.0)).unwrap();
    }
    let mut command = Command::new(BIN);
    command.current_dir(root.path()).args(args).env("LC_ALL", "C").env_remove("COLUMNS");
    let output = command.output().expect("the binary was built for this test");
    let text = String::from_utf8(output.stderr).expect("messages are UTF-8 whatever the locale");
    // Of this machine.
    let cores = std::thread::available_parallelism().unwrap();
    let text = text.replace(&format!("may use {cores} cores"), "may use <CORES> cores");
    let code = output.status.code().expect("not ended by a signal");
    assert!(output.stdout.is_empty() && !text.contains("panicked"), "{args:?}: {text}");
    format!("$ prt-batch {}\nexit code {code}\n{text}", args.join(" "))
}

/// Compares each with the file of its name, and there is no other file.
fn compare(texts: &[(String, String)]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/messages");
    let mut wrong = Vec::new();
    for (name, text) in texts {
        let path = folder.join(format!("{name}.txt"));
        if std::env::var_os("PRT_UPDATE").is_some() {
            fs::write(&path, text).unwrap();
        }
        let known = fs::read_to_string(&path).unwrap_or_default();
        if known != *text {
            wrong.push(format!("--- {} has:\n{known}--- but now it is:\n{text}", path.display()));
        }
    }
    assert!(wrong.is_empty(), "{}\nPRT_UPDATE=1 cargo test --test cli_messages rewrites them", wrong.join("\n"));
}

#[test]
fn mistakes_on_the_command_line_are_answered_as_recorded() {
    let files = |list: &[(&'static str, &'static str)]| list.iter().map(|f| (f.0, f.1.as_bytes())).collect::<Vec<_>>();
    let text = |case: &Case| (case.0.to_owned(), transcript(case.1, &files(case.2)));
    compare(&TYPED.iter().map(text).collect::<Vec<_>>());
}

#[test]
fn mistakes_in_config_files_are_answered_as_recorded_and_render_nothing() {
    let run = |name: &str, config: &[u8]| {
        let files = [("a.gltf", SCENE.as_bytes()), ("night.toml", config)];
        let text = transcript(&["a.gltf", "--config", "night.toml"], &files);
        assert!(text.contains("\nexit code 2\n"), "{name}: {text}");
        let shown = format!("{text}\nnight.toml:\n{}", String::from_utf8_lossy(config));
        (name.to_owned(), shown)
    };
    let mut texts: Vec<_> = CONFIGS.iter().map(|(name, config)| run(name, config.as_bytes())).collect();
    texts.push(run("config-not-utf-8", b"spp = 5\n# \xff\n"));
    let files: &[(&str, &[u8])] = &[("a.gltf", SCENE.as_bytes())];
    texts.push(("config-missing".into(), transcript(&["a.gltf", "--config", "nigth.toml"], files)));
    texts.push(("config-is-a-folder".into(), transcript(&["a.gltf", "--config", "."], files)));
    let files: &[(&str, &[u8])] = &[("night.toml", b"spp = 5\n")];
    texts.push(("config-without-inputs".into(), transcript(&["--config", "night.toml"], files)));
    let unused: &[u8] = b"[[file]]\nmatch = [\"lamp.gltf\", \"x/*\"]\nspp = 5\n";
    let files: &[(&str, &[u8])] = &[("night.toml", unused)];
    texts.push(("config-block-unused".into(), transcript(&["a.gltf", "--config", "night.toml"], files)));
    compare(&texts);
}

#[test]
fn there_is_a_case_for_every_recorded_message() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/messages");
    let known = TYPED.iter().map(|case| case.0).chain(CONFIGS.iter().map(|case| case.0));
    let single =
        ["not-utf-8", "missing", "is-a-folder", "without-inputs", "block-unused"].map(|n| format!("config-{n}"));
    let mut known: Vec<String> = known.map(Into::into).chain(single).collect();
    known.sort();
    let stem =
        |entry: std::io::Result<fs::DirEntry>| entry.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned();
    let mut files: Vec<String> = fs::read_dir(folder).unwrap().map(stem).collect();
    files.sort();
    assert_eq!(files, known);
}

#[cfg(unix)]
#[test]
fn names_that_are_not_utf_8_or_have_spaces_and_line_ends_are_rendered_in_any_locale() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let root = tempfile::tempdir().unwrap();
    let name = OsStr::from_bytes(b"lamp \xff\n\xe5\x85\x89.gltf");
    fs::write(root.path().join(name), SCENE).unwrap();
    fs::write(root.path().join("night.toml"), "[[file]]\nmatch = 'lamp *.gltf'\nspp = 2\n").unwrap();
    for input in [name, OsStr::new("*.gltf"), OsStr::new(".")] {
        let mut command = Command::new(BIN);
        command.current_dir(root.path()).arg(input).env("LC_ALL", "C").args(["--config", "night.toml"]);
        command.args(["--size", "4x2", "--accel", "bvh", "--json", "--out"]);
        let output = command.arg(OsStr::from_bytes(b"out \xfe")).output().unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{input:?}: {text}");
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(json["images"][0]["spp"], 2, "{input:?}");
        let folder = root.path().join(OsStr::from_bytes(b"out \xfe"));
        let files =
            fs::read_dir(&folder).unwrap().filter(|e| e.as_ref().unwrap().path().extension() == Some("exr".as_ref()));
        assert_eq!(files.count(), 1, "{input:?}");
        fs::remove_dir_all(folder).unwrap();
    }
    let mut command = Command::new(BIN);
    let output = command.current_dir(root.path()).arg("--camera").arg(OsStr::from_bytes(b"\xff")).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), text.contains("invalid UTF-8")), (Some(2), true), "{text}");
}
