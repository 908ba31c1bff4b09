//! `prt-batch bench rays INPUT...`: exit code 0 all measured, 1 some, 2 usage, 3 none.

use crate::args::BenchRaysArgs;
use crate::meaning::embree_dirs;
use crate::parse::BenchBackend;
use crate::term;
use prt::accel::embree;
use prt::batch::{input, report};
use prt::bench::{Backend, FailedScene, RayReport, RaySettings, SceneRays, measure};
use prt::load::{LoadOptions, load};
use std::path::Path;
use std::process::ExitCode;

mod table;

pub fn run(args: &BenchRaysArgs) -> ExitCode {
    let backends = match backends(&args.accel) {
        Ok(backends) => backends,
        Err(message) => {
            term::error(&message);
            return ExitCode::from(3);
        }
    };
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let settings = RaySettings {
        backends,
        rays: args.rays,
        rounds: args.rounds,
        seed: args.seed,
        threads: args.threads.unwrap_or_else(cores),
    };
    let (mut scenes, mut failed) = (Vec::new(), Vec::new());
    for input in input::expand(&args.inputs) {
        let name = input.path.display().to_string();
        let measured = match input.problem {
            Some(problem) => Err(problem.to_string()),
            None => one(&input.path, &name, &settings),
        };
        match measured {
            Ok(scene) => {
                if !args.json {
                    term::print(&table::scene(&scene));
                }
                scenes.push(scene);
            }
            Err(message) => {
                term::error(&message);
                failed.push(FailedScene { input: name, error_message: message });
            }
        }
    }
    let code = match (scenes.is_empty(), failed.is_empty()) {
        (true, _) => 3,
        (false, true) => 0,
        (false, false) => 1,
    };
    let result = RayReport::new(&settings, report::cpu_name(), scenes, failed);
    term::print(&if args.json { report::to_json(&result) } else { table::overall(&result) });
    ExitCode::from(code)
}

fn one(path: &Path, name: &str, settings: &RaySettings) -> Result<SceneRays, String> {
    let (scene, _) = load(path, &LoadOptions::default()).map_err(|error| error.to_string())?;
    measure(&scene, name, settings).map_err(|error| format!("{name}: {error}"))
}

/// The backends asked for; by default Embree only where there is one, and it is said when there is none.
fn backends(asked: &[BenchBackend]) -> Result<Vec<Backend>, String> {
    let wanted: &[BenchBackend] = if asked.is_empty() { &[BenchBackend::Bvh, BenchBackend::Embree] } else { asked };
    let mut backends = Vec::new();
    // In a fixed order, each once.
    if wanted.contains(&BenchBackend::Bvh) {
        backends.push(Backend::Bvh);
    }
    if wanted.contains(&BenchBackend::Embree) {
        match embree::find(&embree_dirs()) {
            Ok(library) => backends.push(Backend::Embree(library)),
            Err(why) if asked.is_empty() => {
                term::warning(&format!("only bvh is measured, there is nothing to compare it with: {why}"));
            }
            Err(why) => return Err(format!("--accel embree: {why}")),
        }
    }
    if wanted.contains(&BenchBackend::Linear) {
        backends.push(Backend::Linear);
    }
    Ok(backends)
}
