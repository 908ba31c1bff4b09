//! `prt-batch verify materials [INPUT...]`: exit code 0 within limits, 1 not, 2 usage, 3 an input cannot be read.

use crate::args::VerifyArgs;
use crate::term::{self, materials_table};
use prt::batch::input::expand;
use prt::batch::report::to_json;
use prt::load::{LoadOptions, load};
use prt::render::pool;
use prt::texture::lookup::TextureTable;
use prt::verify::materials::{MaterialReport, Report, SAMPLES, built_in, of_file};
use std::path::Path;
use std::process::ExitCode;

pub fn run(args: &VerifyArgs) -> ExitCode {
    if args.random.is_some() && !args.inputs.is_empty() {
        return term::usage("--random adds to the built-in materials; leave it or the inputs out");
    }
    let samples = args.samples.unwrap_or(SAMPLES);
    let pool = match pool(args.threads) {
        Ok(pool) => pool,
        Err(error) => {
            term::error(&error.to_string());
            return ExitCode::from(3);
        }
    };
    let (materials, unreadable) = pool.install(|| match args.inputs.is_empty() {
        true => (built_in(samples, args.seed, args.random.unwrap_or(0), 1), Vec::new()),
        false => files(args, samples),
    });
    unreadable.iter().for_each(|problem| term::error(problem));
    if materials.is_empty() && !unreadable.is_empty() {
        return ExitCode::from(3);
    }
    let report = Report::new(args.seed, samples, materials);
    if args.json {
        term::print(&to_json(&report));
    } else {
        let all = args.verbose || !args.inputs.is_empty();
        term::print(&materials_table::text(&report, all));
    }
    for material in &report.materials {
        material.problems.iter().for_each(|problem| term::error(&format!("{} {problem}", material.name)));
    }
    ExitCode::from(match (report.passed, unreadable.is_empty()) {
        (false, _) => 1,
        (true, false) => 3,
        (true, true) => 0,
    })
}

/// What is found in the inputs, and what is wrong with those that cannot be read.
fn files(args: &VerifyArgs, samples: usize) -> (Vec<MaterialReport>, Vec<String>) {
    let (mut reports, mut problems) = (Vec::new(), Vec::new());
    for input in expand(&args.inputs) {
        let found = match input.problem {
            Some(problem) => Err(problem.to_string()),
            None => file(&input.path, samples, args.seed),
        };
        match found {
            Ok(found) => reports.extend(found),
            Err(problem) => problems.push(problem),
        }
    }
    (reports, problems)
}

fn file(path: &Path, samples: usize, seed: u64) -> Result<Vec<MaterialReport>, String> {
    let (scene, _) = load(path, &LoadOptions::default()).map_err(|error| error.to_string())?;
    let name = path.display().to_string();
    let named = |error: prt::error::RenderError| format!("{name}: {error}");
    let textures = TextureTable::new(&scene.textures, &scene.images).map_err(named)?;
    of_file(&name, &scene.materials, textures, samples, seed).map_err(named)
}
