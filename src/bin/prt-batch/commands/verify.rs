//! `prt-batch verify hits [INPUT...]`: exit code 0 within limits, 1 not, 2 usage, 3 an input or a backend that was asked
//! for is not to be had.

use crate::args::{VerifyArgs, What};
use crate::meaning::embree_dirs;
use crate::term::{self, verify_table};
use prt::accel::embree;
use prt::batch::input::expand;
use prt::batch::report::to_json;
use prt::load::{LoadOptions, load};
use prt::render::{RenderSettings, geometry, pool};
use prt::verify::catalogue::{ENTRIES, Subject};
use prt::verify::contenders::Backend;
use prt::verify::hits::{Settings, hits};
use prt::verify::report::{Report, SubjectReport};
use std::path::Path;
use std::process::ExitCode;

/// Rays told of one kind, subject and contender without `--verbose`.
const TOLD: usize = 1;

pub fn run(args: &VerifyArgs) -> ExitCode {
    let refused = match args.what {
        What::Hits => [("samples", args.samples.is_some()), ("random", args.random.is_some())],
        What::Materials => [("rays", args.rays.is_some()), ("accel", !args.accel.is_empty())],
        What::Light => [("rays", args.rays.is_some()), ("random", args.random.is_some())],
        What::Shapes => [("samples", args.samples.is_some()), ("accel", !args.accel.is_empty())],
    };
    if let Some((name, _)) = refused.iter().find(|(_, is_given)| *is_given) {
        return term::usage(&format!("--{name} means nothing to verify {}; leave it out", args.what.name()));
    }
    match args.what {
        What::Hits => hits_of(args),
        What::Materials => super::verify_materials::run(args),
        What::Light => super::verify_light::run(args),
        What::Shapes => super::verify_shapes::run(args),
    }
}

fn hits_of(args: &VerifyArgs) -> ExitCode {
    let (backends, embree) = match backends(&args.accel) {
        Ok(backends) => backends,
        Err(message) => return failed(&message),
    };
    if let Some(note) = embree {
        term::warning(&note);
    }
    let settings =
        Settings { rays: args.rays.unwrap_or(Settings::RAYS), seed: args.seed, backends, embree_dirs: embree_dirs() };
    let pool = match pool(args.threads) {
        Ok(pool) => pool,
        Err(error) => return failed(&error.to_string()),
    };
    let (subjects, unreadable) = pool.install(|| match args.inputs.is_empty() {
        true => built_in(&settings),
        false => scenes(args, &settings),
    });
    unreadable.iter().for_each(|problem| term::error(problem));
    if subjects.is_empty() {
        return ExitCode::from(3);
    }
    let report = Report::new(args.seed, subjects);
    if args.json {
        term::print(&to_json(&report));
    } else {
        term::print(&verify_table::text(&report, args.verbose));
    }
    let told = if args.verbose { usize::MAX } else { TOLD };
    for tally in report.subjects.iter().flat_map(|s| &s.kinds).flat_map(|k| &k.contenders) {
        tally.reproducers.iter().filter(|r| r.is_beyond).take(told).for_each(|r| term::say(&r.text()));
    }
    report.problems.iter().for_each(|problem| term::error(problem));
    ExitCode::from(match (report.passed, unreadable.is_empty()) {
        (false, _) => 1,
        (true, false) => 3,
        (true, true) => 0,
    })
}

fn failed(message: &str) -> ExitCode {
    term::error(message);
    ExitCode::from(3)
}

/// The backends that were asked for, or all that are to be had, with a note about one that is not.
fn backends(asked: &[Backend]) -> Result<(Vec<Backend>, Option<String>), String> {
    let embree = embree::find(&embree_dirs());
    if !asked.is_empty() {
        let mut unique = asked.to_vec();
        unique.sort_by_key(|b| *b as u8);
        unique.dedup();
        return match embree {
            Err(why) if unique.contains(&Backend::Embree) => Err(format!("--accel embree: {why}")),
            _ => Ok((unique, None)),
        };
    }
    Ok(match embree {
        Ok(_) => (vec![Backend::Bvh, Backend::Embree, Backend::Linear], None),
        Err(why) => {
            let note = format!("Embree takes no part: {why}");
            (vec![Backend::Bvh, Backend::Linear], Some(note))
        }
    })
}

fn built_in(settings: &Settings) -> (Vec<SubjectReport>, Vec<String>) {
    let (mut reports, mut problems) = (Vec::new(), Vec::new());
    for entry in ENTRIES {
        match hits(entry.name, &entry.subject(), settings) {
            Ok(report) => reports.push(report),
            Err(error) => problems.push(format!("{}: {error}", entry.name)),
        }
    }
    (reports, problems)
}

fn scenes(args: &VerifyArgs, settings: &Settings) -> (Vec<SubjectReport>, Vec<String>) {
    let (mut reports, mut problems) = (Vec::new(), Vec::new());
    for input in expand(&args.inputs) {
        let found = match input.problem {
            Some(problem) => Err(problem.to_string()),
            None => scene(&input.path, settings),
        };
        match found {
            Ok(report) => reports.push(report),
            Err(problem) => problems.push(problem),
        }
    }
    (reports, problems)
}

fn scene(path: &Path, settings: &Settings) -> Result<SubjectReport, String> {
    let (scene, _) = load(path, &LoadOptions::default()).map_err(|error| error.to_string())?;
    let named = |error: prt::error::RenderError| format!("{}: {error}", path.display());
    let geometry = geometry(&scene, &RenderSettings::default()).map_err(named)?;
    let subject = Subject { geometry, inside: None, is_ordinary: true };
    hits(&path.display().to_string(), &subject, settings).map_err(named)
}
