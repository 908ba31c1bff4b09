//! `memory [--size WxH] [--spp N] [--accel NAME] FILE...`: what each picture is estimated to take of memory, and what a
//! process of its own that renders it takes at most (where the system tells).

use prt::batch::job::CameraChoice;
use prt::batch::{BatchSettings, FileSettings, Observer, PictureSize, input::expand, report, run};
use prt::load::{self, LoadOptions, load};
use prt::render::memory::{Encoded, estimate};
use prt::render::{AccelChoice, RenderSettings};
use std::path::PathBuf;
use std::process::{Command, ExitCode};

/// What is measured.
struct Case {
    size: (u32, u32),
    render: RenderSettings,
}

impl Case {
    fn from_words(words: &[String]) -> (Self, Vec<PathBuf>) {
        let mut case = Self { size: (640, 360), render: RenderSettings::default() };
        case.render.embree_dirs = vec![PathBuf::from(".embree")];
        let (mut files, mut words) = (Vec::new(), words.iter());
        while let Some(word) = words.next() {
            let mut value = || words.next().map_or("", String::as_str);
            match word.as_str() {
                "--size" => {
                    let (w, h) = value().split_once('x').expect("--size WxH");
                    case.size = (w.parse().expect("a width"), h.parse().expect("a height"));
                }
                "--spp" => case.render.spp = value().parse().expect("a number of samples"),
                "--accel" => {
                    case.render.accel = match value() {
                        "bvh" => AccelChoice::Bvh,
                        "embree" => AccelChoice::Embree,
                        _ => AccelChoice::Auto,
                    }
                }
                file => files.push(file.into()),
            }
        }
        (case.render.width, case.render.height) = case.size;
        (case, files)
    }
}

struct Silent;

impl Observer for Silent {}

/// Child: loads `file` and says what the picture is estimated to take, and what this process took to load it.
fn estimated(case: &Case, file: PathBuf) {
    let (scene, _) = match load(&file, &LoadOptions::default()) {
        Ok(loaded) => loaded,
        Err(error) => return println!("error: {error}"),
    };
    let peak = report::peak_rss_bytes().unwrap_or(0);
    let mut all = estimate(&scene, &case.render, Encoded { exr: true, png: true });
    if let Some(reading) = load::estimate(&file, &LoadOptions::default()) {
        (all.loading, all.left_over) = (reading.bytes, reading.left_over);
    }
    let mut words = vec![scene.triangle_count() as u64, peak, all.peak()];
    words.extend(all.parts().map(|(_, bytes)| bytes));
    println!("{}", words.iter().map(u64::to_string).collect::<Vec<_>>().join(" "));
}

/// Child: renders `file` and says what this process took.
fn measured(case: &Case, file: PathBuf) {
    let out = std::env::temp_dir().join(format!("prt-memory-{}", std::process::id()));
    let one = FileSettings {
        size: PictureSize::Exact(case.size.0, case.size.1),
        cameras: CameraChoice::Index(0),
        render: case.render.clone(),
        ..FileSettings::default()
    };
    let tasks = BatchSettings::tasks_for(expand(&[file]), one);
    let settings = BatchSettings { tasks, out: out.clone(), ..BatchSettings::default() };
    let outcome = run(settings, &mut Silent);
    let _ = std::fs::remove_dir_all(&out);
    match outcome {
        Ok(outcome) if outcome.exit_code() == 0 => println!("{}", report::peak_rss_bytes().unwrap_or(0)),
        other => println!("error: {other:?}"),
    }
}

/// The numbers that this program prints as `kind`, in a process of its own.
fn child(kind: &str, words: &[String]) -> Result<Vec<f64>, String> {
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let output = Command::new(program).arg(kind).args(words).output().map_err(|e| e.to_string())?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    numbers.ok().filter(|numbers| !numbers.is_empty()).ok_or(text)
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let Some(kind @ ("--estimated" | "--measured")) = words.first().map(String::as_str) {
        let (case, files) = Case::from_words(&words[1..]);
        for file in files {
            if kind == "--estimated" { estimated(&case, file) } else { measured(&case, file) }
        }
        return ExitCode::SUCCESS;
    }
    let (case, files) = Case::from_words(&words);
    let options: Vec<String> = words.iter().filter(|w| !files.contains(&PathBuf::from(w))).cloned().collect();
    println!("MiB; {}x{}, {} spp", case.size.0, case.size.1, case.render.spp);
    println!(
        "triangles estimated measured ratio | load peak | program loading left scene prepared building film files"
    );
    let mut is_good = true;
    for file in files {
        let mut words = options.clone();
        words.push(file.display().to_string());
        match (child("--estimated", &words), child("--measured", &words)) {
            (Ok(estimated), Ok(measured)) => {
                let mib = |bytes: f64| format!("{:.1}", bytes / f64::from(1 << 20));
                let ratio = estimated[2] / measured[0];
                let parts: Vec<_> = estimated[3..].iter().map(|&p| mib(p)).collect();
                let [triangles, load, peak] = [estimated[0], estimated[1], estimated[2]];
                let (peak, measured, load) = (mib(peak), mib(measured[0]), mib(load));
                let file = file.display();
                println!("{triangles} {peak} {measured} {ratio:.2} | {load} | {} | {file}", parts.join(" "));
                is_good &= (0.9..=1.5).contains(&ratio);
            }
            (a, b) => {
                println!("{}: {a:?} {b:?}", file.display());
                is_good = false;
            }
        }
    }
    ExitCode::from(u8::from(!is_good))
}
