//! From options to what the engine is asked to do. Nothing behind this sees a string that has to be read.

use crate::args::{FileArgs, RunArgs};
use crate::config::{Config, Definition, Layer};
use crate::parse;
use clap::ArgMatches;
use prt::batch::input::expand;
use prt::batch::{CameraSource, EnvironmentSource, FileOptions, FileSettings, Frames, PictureSize, Task, Tone, View};
use prt::camera::Lens;
use prt::image::exr::ExrOptions;
use prt::load::LoadOptions;
use prt::render::{RenderSettings, Stopping};
use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// What is to be done, of the command line and its config file.
#[derive(Debug)]
pub struct Meaning {
    pub run: RunArgs,
    /// What is rendered, and how.
    pub tasks: Vec<Task>,
    /// What the user may not have meant.
    pub warnings: Vec<String>,
}

impl Meaning {
    /// The meaning of `matches`, which are `render`'s or those of no command.
    ///
    /// # Errors
    /// A config file that cannot be read or is wrong, options that lack others, no input: the text says what to do.
    pub fn of(matches: &ArgMatches) -> Result<Self, String> {
        let definition = Definition::new();
        let typed = definition.typed(matches);
        let file = matches.get_one::<PathBuf>("config");
        let config = file.map(|file| Config::read(file, &definition)).transpose()?;
        let nothing = Layer::default();
        let (top, blocks) = config.as_ref().map_or((&nothing, &[][..]), |config| (&config.top, &config.blocks));
        let run = definition.options(&definition.merged(&[top, &typed]))?.run;
        let mut warnings = Vec::new();
        warnings.extend(run.threads.and_then(too_many_threads));

        let inputs: Vec<PathBuf> = match (matches.get_many::<PathBuf>("inputs"), &config) {
            (Some(typed), _) => typed.cloned().collect(),
            (None, Some(config)) => config.inputs.clone(),
            (None, None) => Vec::new(),
        };
        if inputs.is_empty() {
            return Err(no_input(file.map(PathBuf::as_path)));
        }
        // Inputs that are rendered alike share their settings.
        let mut by_blocks: HashMap<Vec<usize>, Arc<FileSettings>> = HashMap::new();
        let mut by_options: HashMap<Vec<OsString>, Arc<FileSettings>> = HashMap::new();
        let mut is_used = vec![false; blocks.len()];
        let mut tasks = Vec::new();
        for input in expand(&inputs) {
            let about: Vec<usize> = (0..blocks.len()).filter(|&i| blocks[i].is_about(&input.path)).collect();
            about.iter().for_each(|&i| is_used[i] = true);
            let settings = match by_blocks.get(&about) {
                Some(settings) => Arc::clone(settings),
                None => {
                    let own = about.iter().map(|&i| &blocks[i].options);
                    let layers: Vec<&Layer> = std::iter::once(top).chain(own).chain([&typed]).collect();
                    let merged = definition.merged(&layers);
                    let settings = match by_options.get(&merged) {
                        Some(settings) => Arc::clone(settings),
                        None => {
                            let settings = definition
                                .options(&merged)
                                .and_then(|args| file_settings(&args.file, run.batch_time_limit));
                            Arc::new(settings.map_err(|why| match about.is_empty() {
                                true => why,
                                false => format!("{}: {why}", input.path.display()),
                            })?)
                        }
                    };
                    by_options.insert(merged, Arc::clone(&settings));
                    by_blocks.insert(about, Arc::clone(&settings));
                    settings
                }
            };
            tasks.push(Task { input, settings });
        }
        for (block, _) in blocks.iter().zip(is_used).filter(|(_, is_used)| !is_used) {
            warnings.push(format!("{}: no input matches, so this [[file]] does nothing", block.place));
        }
        Ok(Self { run, tasks, warnings })
    }
}

/// A warning where `threads` exceeds the cores that this process may use.
fn too_many_threads(threads: usize) -> Option<String> {
    let cores = std::thread::available_parallelism().ok()?.get();
    (threads > cores)
        .then(|| format!("--threads {threads}: this process may use {cores} cores; more threads do not make it faster"))
}

fn no_input(config: Option<&Path>) -> String {
    let mut text = "no INPUT: give .gltf, .glb or .obj files, or a folder of them, such as: \
                    prt-batch scenes/ --out renders"
        .to_owned();
    if let Some(file) = config {
        text += &format!("\n  Or name them in {}: inputs = [\"scenes/*.gltf\"]", file.display());
    }
    // `prt-batch render` where that was meant as a folder.
    if std::env::args_os().nth(1).is_some_and(|first| first == "render") && Path::new("render").exists() {
        text += "\n  render is a command; what is called so in this folder is ./render.";
    }
    text
}

/// Samples per pixel where nothing is said about when sampling ends.
const DEFAULT_SPP: u32 = 64;

/// Frames a second where nothing is said.
const DEFAULT_FPS: f64 = 24.0;

/// How a file is rendered, in a run with that limit.
///
/// # Errors
/// An option lacks another, or excludes it; the text names both.
pub fn file_settings(args: &FileArgs, batch_time_limit: Option<Duration>) -> Result<FileSettings, String> {
    let stopping = Stopping { target_error: args.target_error, time_limit: args.time_limit, ..Stopping::default() };
    let default_spp = if stopping.is_open() || batch_time_limit.is_some() { parse::MAX_SPP } else { DEFAULT_SPP };
    if args.aov.is_some() && args.no_exr {
        return Err("--aov needs the EXR, whose layers it is about, and --no-exr is given".into());
    }
    let render = RenderSettings {
        crop: args.crop,
        spp: args.spp.unwrap_or(default_spp),
        stopping,
        layers: args.aov.unwrap_or_default(),
        seed: args.seed,
        integrator: args.integrator,
        lens: Lens {
            f_stop: args.f_stop,
            focus_distance: args.focus_distance,
            blades: args.aperture_blades,
            sensor: args.sensor,
        },
        max_bounces: args.max_bounces,
        filter: args.filter,
        brdf: args.brdf,
        cull_backfaces: args.cull_backfaces,
        texture_lod: args.texture_lod,
        clamp: args.clamp,
        adaptive: args.adaptive == parse::Adaptive::Auto,
        default_light: args.default_light,
        light_radius: args.light_radius,
        sun_angle: args.sun_angle,
        accel: args.accel,
        embree_dirs: embree_dirs(),
        ..RenderSettings::default()
    };
    let width = PictureSize::Width(args.width.unwrap_or(PictureSize::DEFAULT_WIDTH));
    Ok(FileSettings {
        name: args.name.clone(),
        size: args.size.map_or(width, |(width, height)| PictureSize::Exact(width, height)),
        camera_source: camera_source(args)?,
        cameras: args.camera.clone(),
        environment: environment(args)?,
        frames: frames(args)?,
        load: LoadOptions {
            asset_root: args.asset_root.clone(),
            scene: args.scene.clone(),
            variant: args.variant.clone(),
            focus_on: args.focus_on.clone(),
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
    })
}

fn frames(args: &FileArgs) -> Result<Option<Frames>, String> {
    let lonely = [
        ("--fps", args.fps.is_some()),
        ("--animation", args.animation.is_some()),
        ("--shutter", args.shutter.is_some()),
        ("--shutter-position", args.shutter_position.is_some()),
    ];
    let Some(choice) = &args.frames else {
        return match lonely.iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) => {
                Err(format!("{option} needs --frames, such as --frames all: without it nothing in a file moves"))
            }
            None => Ok(None),
        };
    };
    Ok(Some(Frames {
        choice: choice.clone(),
        fps: args.fps.unwrap_or(DEFAULT_FPS),
        animation: args.animation.clone().unwrap_or_default(),
        shutter: args.shutter,
        position: args.shutter_position.unwrap_or_default(),
    }))
}

fn environment(args: &FileArgs) -> Result<Option<EnvironmentSource>, String> {
    let lonely = [("--env-rotate", args.env_rotate.is_some()), ("--env-scale", args.env_scale.is_some())];
    let Some(path) = &args.env else {
        return match lonely.iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) => Err(format!("{option} needs --env FILE, the environment that it is about")),
            None => Ok(None),
        };
    };
    let (rotate, scale) = (args.env_rotate.unwrap_or(0.0), args.env_scale.unwrap_or(1.0));
    Ok(Some(EnvironmentSource { path: path.clone(), rotate, scale }))
}

fn camera_source(args: &FileArgs) -> Result<CameraSource, String> {
    if let Some(file) = &args.camera_from {
        return Ok(CameraSource::File(file.clone()));
    }
    let lonely = [("--look-at", args.look_at.is_some()), ("--up", args.up.is_some()), ("--yfov", args.yfov.is_some())];
    match (args.eye, args.look_at) {
        (Some(eye), Some(look_at)) => Ok(CameraSource::View(View {
            eye: eye.into(),
            look_at: look_at.into(),
            up: args.up.unwrap_or([0.0, 1.0, 0.0]).into(),
            yfov: args.yfov.unwrap_or(View::DEFAULT_YFOV),
        })),
        (Some(_), None) => Err("--eye needs --look-at X,Y,Z, the point in the middle of the picture".into()),
        (None, _) => match lonely.iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) => Err(format!("{option} needs --eye X,Y,Z, the place of the camera that it is about")),
            None => Ok(CameraSource::Inputs),
        },
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
