//! The built binary on a terminal, which is a pseudo terminal of Python's and a small emulator: bars appear and vanish,
//! and no line is torn. Skipped where there is no python3.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::Command;

const BIN: &str = env!("CARGO_BIN_EXE_prt-batch");
const SCENE: &str = include_str!("data/triangle.gltf");

/// Runs a command on a terminal of the given size; types ^C after so many seconds if that is not 0; prints what came,
/// and behind a last zero byte the exit code.
const PTY: &str = r#"
import fcntl, os, pty, struct, sys, termios, time, select
columns, rows, wait = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
pid, fd = pty.fork()
if pid == 0:
    # The child waits for the size.
    sys.stdin.readline()
    os.execv(sys.argv[4], sys.argv[4:])
fcntl.ioctl(fd, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
os.write(fd, b"\n")
started = time.time()
while True:
    if wait and time.time() - started > wait:
        os.write(fd, b"\x03")
        wait = 0
    if not select.select([fd], [], [], 0.05)[0]:
        continue
    try:
        data = os.read(fd, 65536)
    except OSError:
        break
    if not data:
        break
    os.write(1, data)
os.write(1, b"\0%d" % os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
"#;

/// What a terminal of so many columns shows: lines of ASCII, of which all that scrolled away are kept.
struct Terminal {
    columns: usize,
    lines: Vec<Vec<char>>,
    row: usize,
    column: usize,
    /// The most lines that held bars at once.
    most_bars: usize,
}

impl Terminal {
    fn new(columns: usize) -> Self {
        Self { columns, lines: vec![Vec::new()], row: 0, column: 0, most_bars: 0 }
    }

    fn down(&mut self) {
        self.row += 1;
        if self.row == self.lines.len() {
            self.lines.push(Vec::new());
        }
    }

    fn show(&mut self, text: &str) {
        let mut rest = text.chars();
        while let Some(c) = rest.next() {
            match c {
                '\r' => self.column = 0,
                '\n' => self.down(),
                '\u{1b}' => {
                    assert_eq!(rest.next(), Some('['), "only such sequences are known here");
                    let mut number = String::new();
                    let end = rest.by_ref().find(|c| {
                        let is_end = c.is_ascii_alphabetic();
                        if !is_end {
                            number.push(*c);
                        }
                        is_end
                    });
                    let n: usize = number.parse().unwrap_or(1);
                    match end {
                        Some('A') => self.row = self.row.checked_sub(n).expect("the cursor stays on the screen"),
                        Some('B') => (0..n).for_each(|_| self.down()),
                        Some('K') => {
                            // Before they are wiped they were seen.
                            self.most_bars = self.most_bars.max(self.text().iter().filter(|line| is_bar(line)).count());
                            self.lines[self.row].clear();
                        }
                        Some('m') => {}
                        other => panic!("an escape sequence that is not known here: {other:?}"),
                    }
                }
                c => {
                    if self.column == self.columns {
                        self.column = 0;
                        self.down();
                    }
                    let line = &mut self.lines[self.row];
                    line.resize(line.len().max(self.column + 1), ' ');
                    line[self.column] = c;
                    self.column += 1;
                }
            }
        }
    }

    fn text(&self) -> Vec<String> {
        self.lines.iter().map(|line| line.iter().collect::<String>().trim_end().to_owned()).collect()
    }
}

fn is_bar(line: &str) -> bool {
    line.contains("####") || line.contains("----") || line.ends_with(" left")
        // In the table at the end stands the error.
        || line.ends_with('%') && !line.starts_with("rendered  ")
}

/// The terminal at the end of a run, its lines that are not empty, and the exit code; `None` without python3.
fn run_on_terminal(
    folder: &Path,
    columns: usize,
    interrupt: f64,
    term: &str,
    args: &[&str],
) -> Option<(Terminal, Vec<String>, String)> {
    let numbers = [columns.to_string(), "30".to_owned(), interrupt.to_string()];
    let mut command = Command::new("python3");
    command.args(["-c", PTY]).args(numbers).arg(BIN).args(args).current_dir(folder);
    for name in ["NO_COLOR", "CLICOLOR_FORCE", "CLICOLOR", "CI"] {
        command.env_remove(name);
    }
    // Without a language the bars are ASCII.
    let Ok(output) = command.env("TERM", term).env("LC_ALL", "C").output() else {
        println!("skipped: there is no python3");
        return None;
    };
    let text = String::from_utf8(output.stdout).expect("ASCII");
    let Some((text, code)) = text.rsplit_once('\0') else {
        panic!("{text}{}", String::from_utf8_lossy(&output.stderr));
    };
    let mut terminal = Terminal::new(columns);
    // The first line is what the child waited for.
    terminal.show(text.split_once('\n').expect("an echo").1);
    let lines: Vec<_> = terminal.text().into_iter().filter(|line| !line.is_empty()).collect();
    Some((terminal, lines, code.to_owned()))
}

fn folder(scenes: usize) -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    (0..scenes).for_each(|i| fs::write(root.path().join(format!("scene-number-{i}.gltf")), SCENE).expect("a scene"));
    root
}

const SLOW: [&str; 7] = ["--size", "320x160", "-s", "32", "--accel", "linear", "."];

#[test]
fn bars_appear_and_vanish_and_no_line_is_torn() {
    for columns in [120, 80] {
        let root = folder(6);
        let Some((terminal, lines, code)) = run_on_terminal(root.path(), columns, 0.0, "xterm", &SLOW) else { return };
        assert_eq!(code, "0", "{lines:#?}");
        assert!(terminal.most_bars >= 2, "an image and the run: {}", terminal.most_bars);
        assert!(!lines.iter().any(|line| is_bar(line)), "{lines:#?}");
        assert!(lines[0].starts_with("rays by linear"), "{lines:#?}");
        for i in 0..6 {
            let name = format!("renders/scene-number-{i}.exr");
            assert!(lines[1 + i].starts_with(&format!("{name}  320x160  32 spp  ")), "{lines:#?}");
            assert!(lines[8 + i].starts_with("rendered  ") && lines[8 + i].contains(&name), "{lines:#?}");
        }
        assert!(lines[7].starts_with("status    image  "), "{lines:#?}");
        assert!(lines[7].contains("warnings") == (columns == 120), "what is known of none makes room: {lines:#?}");
        assert!(lines[14].starts_with("6 rendered, ") && lines.len() == 15, "{lines:#?}");
    }
}

#[test]
fn a_terminal_of_20_columns_has_bars_too() {
    let root = folder(3);
    let Some((terminal, lines, code)) = run_on_terminal(root.path(), 20, 0.0, "xterm", &SLOW) else { return };
    assert_eq!(code, "0");
    assert!(terminal.most_bars >= 1 && !lines.iter().any(|line| line.contains('%')), "bars vanish: {lines:#?}");
    assert!(lines.last().unwrap().starts_with("3 rendered, "), "{lines:#?}");
}

#[test]
fn typing_ctrl_c_ends_the_run_and_tears_nothing() {
    let root = folder(2);
    let endless = ["--size", "2048x2048", "-s", "1048576", "--accel", "linear", "."];
    let Some((terminal, lines, code)) = run_on_terminal(root.path(), 100, 1.0, "xterm", &endless) else { return };
    assert_eq!(code, "75", "{lines:#?}");
    assert!(terminal.most_bars >= 2, "{lines:#?}");
    assert!(!lines.iter().any(|line| is_bar(line)), "{lines:#?}");
    let said: Vec<_> = lines.iter().filter(|line| line.starts_with("interrupted: ")).collect();
    assert_eq!(said.len(), 2, "{lines:#?}");
    assert_eq!(said[1], "interrupted: 0 of 2 images are done; the same command goes on from there");
}

#[test]
fn a_dumb_terminal_gets_plain_lines() {
    let root = folder(2);
    let Some((terminal, lines, code)) = run_on_terminal(root.path(), 80, 0.0, "dumb", &SLOW) else { return };
    assert_eq!((code.as_str(), terminal.most_bars), ("0", 0));
    assert!(lines.iter().any(|line| line.starts_with("[2/2] renders/scene-number-1.exr")), "{lines:#?}");
}
