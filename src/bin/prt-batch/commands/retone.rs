//! `prt-batch retone IN.exr...`: tone-maps stored EXRs again. Exit code 0 all done, 1 some failed, 2 usage, 3 none could
//! be read, 4 a PNG could not be written.

use super::exr_files::exr_files;
use crate::args::RetoneArgs;
use crate::term;
use prt::batch::output::{WriteError, check_writable, write_atomic};
use prt::batch::{Tone, develop};
use prt::image::exr_read;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// A picture to develop again.
struct Job {
    exr: PathBuf,
    png: PathBuf,
}

/// Why there is no PNG.
enum Failure {
    /// It is no EXR that can be read.
    Unreadable(String),
    /// The command ends here.
    Unwritable(WriteError),
}

pub fn run(args: &RetoneArgs) -> ExitCode {
    let (mut jobs, problems) = jobs(&args.inputs, args.out.as_deref());
    if let Err(message) = settle(&mut jobs) {
        return term::usage(&message);
    }
    if let Some(Err(error)) = args.out.as_deref().map(check_writable) {
        term::error(&format!("{error}\n  Nothing was written. Choose another folder with --out."));
        return ExitCode::from(4);
    }
    problems.iter().for_each(|problem| term::error(problem));
    let mut failed = problems.len();
    let all = jobs.len() + failed;
    for job in &jobs {
        match retone(job, args) {
            Ok(()) => {}
            Err(Failure::Unreadable(message)) => {
                failed += 1;
                term::error(&message);
            }
            Err(Failure::Unwritable(error)) => {
                term::error(&format!("{error}\n  The command stops here; finished pictures are kept."));
                return ExitCode::from(4);
            }
        }
    }
    ExitCode::from(match failed {
        0 => 0,
        _ if failed == all => 3,
        _ => 1,
    })
}

/// What the files and folders of `inputs` mean, and what is wrong with the others.
fn jobs(inputs: &[PathBuf], out: Option<&Path>) -> (Vec<Job>, Vec<String>) {
    let (mut jobs, mut problems) = (Vec::new(), Vec::new());
    for input in inputs {
        let at = input.display();
        // Beside the EXR, or below --out with the sub-folders of a folder.
        let job = |exr: PathBuf, name: &Path| Job {
            png: out.map_or(exr.clone(), |out| out.join(name)).with_extension("png"),
            exr,
        };
        match std::fs::metadata(input) {
            Err(error) => problems.push(format!("{at}: {error}\n  Give EXR files, or folders of them.")),
            Ok(metadata) if metadata.is_dir() => match exr_files(input, Path::new("")) {
                Err(error) => problems.push(format!("{at}: the folder cannot be read: {error}")),
                Ok(names) if names.is_empty() => problems.push(format!("{at}: there is no .exr file in this folder")),
                Ok(names) => jobs.extend(names.iter().map(|name| job(input.join(name), name))),
            },
            Ok(_) => jobs.push(job(input.clone(), Path::new(input.file_name().unwrap_or_default()))),
        }
    }
    (jobs, problems)
}

/// Takes what is named twice once, and finds two pictures that would become one file.
fn settle(jobs: &mut Vec<Job>) -> Result<(), String> {
    let place = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let mut owners: HashMap<PathBuf, PathBuf> = HashMap::new();
    let mut clash = None;
    jobs.retain(|job| {
        let (exr, png) = (place(&job.exr), spelled_out(&job.png));
        if exr == place(&job.png) {
            clash.get_or_insert_with(|| format!("{}: this is where its PNG would go; use --out", job.exr.display()));
        }
        match owners.get(&png) {
            None => owners.insert(png, exr).is_none(),
            Some(owner) if *owner == exr => false,
            Some(owner) => {
                let (one, other, png) = (owner.display(), job.exr.display(), job.png.display());
                clash.get_or_insert_with(|| {
                    format!(
                        "{one} and {other} would both become {png}\n  Give them separately, each with its own --out."
                    )
                });
                false
            }
        }
    });
    clash.map_or(Ok(()), Err)
}

/// `path` with its folder as the system knows it: two spellings of one place are the same.
fn spelled_out(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    path.file_name().map_or(folder.clone(), |name| folder.join(name))
}

fn retone(job: &Job, args: &RetoneArgs) -> Result<(), Failure> {
    let unreadable = |error: String| Failure::Unreadable(format!("{}: {error}", job.exr.display()));
    let bytes = std::fs::read(&job.exr).map_err(|error| unreadable(error.to_string()))?;
    let (picture, alpha) = exr_read::decode_with_alpha(&bytes).map_err(unreadable)?;
    let side =
        |side: usize| u32::try_from(side).map_err(|_| unreadable(format!("a side of {side} pixels is too long")));
    let size = [side(picture.width)?, side(picture.height)?];
    let tone = Tone { exposure: args.exposure, curve: args.tonemap };
    let developed = develop(&picture.pixels, alpha.as_deref(), size, tone);
    write_atomic(&job.png, &developed.png).map_err(Failure::Unwritable)?;
    if !args.quiet {
        term::say(&format!("{}  {}x{}", job.png.display(), size[0], size[1]));
        for note in &developed.notes {
            term::say(&format!("note: {}: {note}", job.exr.display()));
        }
        for warning in &developed.warnings {
            term::say(&format!("warning: {}: {warning}", job.exr.display()));
        }
    }
    Ok(())
}
