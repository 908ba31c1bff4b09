//! What is made of the definition of the command line: the tables of `docs/cli.md`, completions, the man page, help.

use std::fs;
use std::path::Path;
use std::process::Command;

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");

fn printed(args: &[&str]) -> String {
    let output =
        Command::new(BIN).args(args).env_remove("COLUMNS").output().expect("the binary was built for this test");
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// Long names in the lines of a help text that define options.
fn options_of(help: &str) -> Vec<String> {
    // `  -s, --spp` or `      --size`; what is further in is text.
    let name = |line: &str| {
        let option =
            line.strip_prefix("      ").or_else(|| line.strip_prefix("  -")?.split_once(", ").map(|(_, o)| o))?;
        let end = option.find([' ', '=']).unwrap_or(option.len());
        option.starts_with("--").then(|| option[..end].to_owned())
    };
    help.lines().filter_map(name).collect()
}

/// With `PRT_UPDATE` set it writes the tables instead.
#[test]
fn the_tables_of_the_documentation_are_those_of_the_program() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/cli.md");
    let mut docs = fs::read_to_string(&path).unwrap();
    let tables = printed(&["--generate", "options-md"]);
    let mut missing = Vec::new();
    for table in tables.split_inclusive("-->\n").collect::<Vec<_>>().chunks(2) {
        let table = table.concat();
        let table = table.trim_start();
        let (before, after) = (table.lines().next().unwrap(), table.lines().last().unwrap());
        let place = docs.find(before).zip(docs.find(after).map(|at| at + after.len() + 1));
        let Some((start, end)) = place else {
            missing.push(format!("docs/cli.md has no lines {before} and {after}"));
            continue;
        };
        if docs[start..end] != *table {
            missing.push(format!(
                "docs/cli.md: the table after {before} is not what prt-batch --generate options-md prints"
            ));
            docs.replace_range(start..end, table);
        }
    }
    if std::env::var_os("PRT_UPDATE").is_some() {
        fs::write(&path, docs).unwrap();
    } else {
        assert!(missing.is_empty(), "{}\nPRT_UPDATE=1 cargo test --test cli_docs rewrites them.", missing.join("\n"));
    }
}

#[test]
fn completions_know_options_and_values_and_nothing_that_is_not_built() {
    let options = options_of(&printed(&["-h"]));
    assert!(options.len() > 35 && options.contains(&"--out".into()), "{options:?}");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = printed(&["--generate", &format!("complete-{shell}")]);
        for option in &options {
            let name = option.trim_start_matches("--");
            assert!(script.contains(option) || script.contains(&format!("-l {name} ")), "{shell} lacks {option}");
        }
        assert!(!script.contains("transparent"), "{shell} has what is not built");
        if shell != "powershell" && shell != "elvish" {
            assert!(script.contains("linear") && script.contains("zips"), "{shell} lacks values");
        }
    }
    let zsh = printed(&["--generate", "complete-zsh"]);
    for kind in ["*.toml", "*.gltf", "*.(gltf|glb|obj)"] {
        assert!(zsh.contains(&format!("_files -g \"{kind}\"")), "zsh completes no {kind}");
    }
}

#[test]
fn bash_can_read_its_completions() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("completions");
    fs::write(&script, printed(&["--generate", "complete-bash"])).unwrap();
    let complete = r#"source "$0"; COMP_WORDS=(prt-batch a.gltf --accel li); COMP_CWORD=3
        [[ $(complete -p prt-batch) =~ -F\ ([^ ]+) ]] && "${BASH_REMATCH[1]}" prt-batch li --accel
        echo "${COMPREPLY[*]}""#;
    match Command::new("bash").args(["-c", complete]).arg(&script).output() {
        Ok(output) => assert_eq!(String::from_utf8_lossy(&output.stdout), "linear\n", "{output:?}"),
        Err(error) => println!("skipped: bash cannot be run: {error}"),
    }
}

#[test]
fn the_man_page_has_every_option_examples_and_exit_codes() {
    let page = printed(&["--generate", "man"]).replace("\\-", "-");
    for option in options_of(&printed(&["-h"])).iter().chain(&options_of(&printed(&["compare", "-h"]))) {
        assert!(page.contains(&format!("\\fB{option}\\fR")), "no {option}");
    }
    for part in [".SH EXAMPLES", "--config night.toml", "75 interrupted", ".SH \"PRT-BATCH COMPARE\"", ".SH SAMPLING"] {
        assert!(page.contains(part), "no {part}");
    }
}

#[test]
fn short_help_is_short_and_long_help_says_more() {
    let (short, long) = (printed(&["-h"]), printed(&["--help"]));
    assert_eq!(options_of(&short), options_of(&long));
    for part in ["Examples:", "Exit codes:", "75 interrupted", "single-scattering"] {
        assert!(long.contains(part) && !short.contains(part), "{part}");
    }
    let compare = printed(&["compare", "--help"]);
    assert!(compare.contains("Examples:") && compare.contains("Exit codes: 0 within limits"), "{compare}");
    assert_eq!(options_of(&printed(&["render", "-h"])).len() + 2, options_of(&short).len(), "--generate, --version");
}

/// Whoever adds an option adds a test that runs the program with it: its name stands, as an argument of its own or with
/// its value, in one of the files that run the program.
#[test]
fn every_option_is_used_by_some_test_of_the_program() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let runs_the_program = |path: &Path| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        name.starts_with("cli") && name.ends_with(".rs") && name != "cli_docs.rs"
    };
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| runs_the_program(path));
    let text: String = files.map(|path| fs::read_to_string(path).unwrap()).collect();
    let mut options = options_of(&printed(&["-h"]));
    for command in [&["compare"][..], &["retone"], &["doctor"], &["verify"], &["bench", "rays"]] {
        options.extend(options_of(&printed(&[command, &["-h"]].concat())));
    }
    assert!(options.len() > 40, "{options:?}");
    // Between quotes, or in a line of arguments.
    let is_used = |option: &String| {
        let ends = |rest: &str| !rest.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '-');
        text.match_indices(option.as_str()).any(|(at, _)| ends(&text[at + option.len()..]))
    };
    let unused: Vec<_> = options.iter().filter(|option| !is_used(option)).collect();
    assert!(unused.is_empty(), "no test runs the program with {unused:?}");
}
