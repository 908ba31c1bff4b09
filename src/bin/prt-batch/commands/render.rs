//! `prt-batch INPUT...`

use crate::args::RenderArgs;
use crate::signals;
use crate::term::{self, Reporter, Verbosity};
use prt::batch::input::expand;
use prt::batch::{self, BatchSettings, CameraSource, FileOptions, FileSettings, PictureSize, Stop, Tone, View};
use prt::image::exr::ExrOptions;
use prt::load::LoadOptions;
use prt::render::RenderSettings;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

pub fn run(args: &RenderArgs) -> ExitCode {
    if args.inputs.is_empty() {
        return term::usage(
            "no INPUT: give .gltf, .glb or .obj files, or a folder of them, such as: prt-batch scenes/ --out renders",
        );
    }
    let settings = BatchSettings {
        tasks: BatchSettings::tasks_for(expand(&args.inputs), file_settings(args)),
        out: args.out.clone(),
        threads: args.threads,
        memory: args.memory,
        force: args.force,
        report: !args.no_report,
        command: command_line(),
        ..BatchSettings::default()
    };
    if args.explain {
        return super::explain::run(&settings, args.json);
    }
    let verbosity = match (args.quiet, args.verbose) {
        (true, _) => Verbosity::Quiet,
        (_, true) => Verbosity::Verbose,
        _ => Verbosity::Normal,
    };
    let mut reporter = Reporter::new(args.progress, verbosity);
    if let Err(error) = signals::install(&settings.cancel) {
        term::warning(&format!("signals will end the process at once: {error}"));
    }
    match batch::run(settings, &mut reporter) {
        Ok(outcome) => {
            reporter.summary(&outcome, &args.out);
            if args.json {
                term::print(&batch::report::to_json(&outcome.report));
            }
            ExitCode::from(outcome.exit_code())
        }
        Err(Stop::Usage(message)) => term::usage(&message),
        Err(Stop::Unwritable(error)) => {
            term::error(&format!("{error}\n  Nothing was rendered. Choose another folder with --out."));
            ExitCode::from(4)
        }
    }
}

fn file_settings(args: &RenderArgs) -> FileSettings {
    let render = RenderSettings {
        crop: args.crop,
        spp: args.spp,
        seed: args.seed,
        max_bounces: args.max_bounces,
        filter: args.filter,
        brdf: args.brdf,
        cull_backfaces: args.cull_backfaces,
        default_light: args.default_light,
        accel: args.accel,
        embree_dirs: embree_dirs(),
        ..RenderSettings::default()
    };
    let width = PictureSize::Width(args.width.unwrap_or(PictureSize::DEFAULT_WIDTH));
    FileSettings {
        name: args.name.clone(),
        size: args.size.map_or(width, |(width, height)| PictureSize::Exact(width, height)),
        camera_source: camera_source(args),
        cameras: args.camera.clone(),
        load: LoadOptions {
            asset_root: args.asset_root.clone(),
            scene: args.scene.clone(),
            obj_up: args.obj_up,
            obj_scale: args.obj_scale,
            smooth_angle: args.smooth_angle,
        },
        render,
        files: FileOptions {
            exr: !args.no_exr,
            png: !args.no_png,
            format: ExrOptions { samples: args.exr, compression: args.exr_compression },
            tone: Tone { exposure: args.exposure, curve: args.tonemap },
        },
    }
}

fn camera_source(args: &RenderArgs) -> CameraSource {
    match (&args.camera_from, args.eye, args.look_at) {
        (Some(file), ..) => CameraSource::File(file.clone()),
        (None, Some(eye), Some(look_at)) => CameraSource::View(View {
            eye: eye.into(),
            look_at: look_at.into(),
            up: args.up.unwrap_or([0.0, 1.0, 0.0]).into(),
            yfov: args.yfov.unwrap_or(View::DEFAULT_YFOV),
        }),
        _ => CameraSource::Inputs,
    }
}

/// Where libembree4 may lie beside this program: an installation's folders, the project's when run from its target
/// folder, and the current folder's.
pub fn embree_dirs() -> Vec<PathBuf> {
    let mut dirs = Vec::new();
    if let Some(folder) = std::env::current_exe().ok().as_deref().and_then(Path::parent) {
        dirs.extend([folder.join(".embree"), folder.join("../lib")]);
        // <project>/target/<profile>/prt-batch
        if let Some(target) = folder.parent().filter(|target| target.ends_with("target")) {
            dirs.extend(target.parent().map(|project| project.join(".embree")));
        }
    }
    dirs.extend(std::env::current_dir().map(|folder| folder.join(".embree")));
    let mut seen = std::collections::HashSet::new();
    dirs.retain(|dir| seen.insert(dir.clone()));
    dirs
}

/// The command line, quoted so that a POSIX shell reads it back.
fn command_line() -> String {
    let quoted = |arg: std::ffi::OsString| {
        let arg = arg.to_string_lossy().into_owned();
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+@%".contains(c);
        if !arg.is_empty() && arg.chars().all(plain) { arg } else { format!("'{}'", arg.replace('\'', r"'\''")) }
    };
    std::env::args_os().map(quoted).collect::<Vec<_>>().join(" ")
}
