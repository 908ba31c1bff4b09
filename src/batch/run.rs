//! The engine: loads, renders and writes one image after the other, and goes on after a failure.

use super::input::{Input, expand};
use super::job::{CameraChoice, Naming, Plan, plan};
use super::names::NameTemplate;
use super::output::{WriteError, check_writable, write_atomic};
use super::picture::{FileOptions, exr_bytes, png_bytes};
use super::report::{self, Accel, BatchReport, Host, ImageReport, Outputs, Rays, Seconds, Status};
use super::size::{PictureSize, aspect_note, check_crop, size_for};
use super::view::CameraSource;
use crate::camera::Camera;
use crate::load::{LoadOptions, LoadTimes, load};
use crate::render::{AccelChoice, DefaultLight, Frame, Progress, RenderSettings, render};
use crate::scene::Scene;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Instant, SystemTime};

/// What to do.
#[derive(Clone, Debug)]
pub struct BatchSettings {
    /// Files and folders as typed.
    pub inputs: Vec<PathBuf>,
    /// Where files go.
    pub out: PathBuf,
    /// Output names; `None` = the stem, with the camera where there are several.
    pub name: Option<NameTemplate>,
    /// Size of every picture.
    pub size: PictureSize,
    /// Where the cameras come from.
    pub camera_source: CameraSource,
    /// Which of them.
    pub cameras: CameraChoice,
    /// How files are read.
    pub load: LoadOptions,
    /// Everything else about the pictures; width and height are set from `size` for each.
    pub render: RenderSettings,
    /// What is written.
    pub files: FileOptions,
    /// The command line, for the report.
    pub command: String,
}

/// Told what happens, from the thread that called [`run()`].
pub trait Observer {
    /// An image of `input` starts; `progress` may be watched from another thread until [`Observer::finished`].
    fn started(&mut self, _input: &Path, _progress: &Arc<Progress>) {}
    /// An image is done, its files are written.
    fn finished(&mut self, _image: &ImageReport) {}
}

/// Why nothing was rendered at all.
#[derive(Debug)]
pub enum Stop {
    /// The settings contradict each other or the inputs.
    Usage(String),
    /// The output folder cannot be written to.
    Unwritable(WriteError),
}

/// How the run went.
#[derive(Debug)]
pub struct Outcome {
    /// As written to `batch.json`.
    pub report: BatchReport,
    /// Images that failed because of their input.
    pub bad_inputs: usize,
    /// An output that could not be written; the run stopped there.
    pub unwritable: Option<WriteError>,
}

impl Outcome {
    /// 0 all well, 1 some images failed, 3 every input was bad, 4 outputs cannot be written.
    pub fn exit_code(&self) -> u8 {
        let (all, failed) = (self.report.images.len(), self.report.counts[&Status::Failed]);
        match () {
            () if self.unwritable.is_some() => 4,
            () if all > 0 && self.bad_inputs == all => 3,
            () if failed > 0 => 1,
            () => 0,
        }
    }
}

/// Renders everything that `settings` asks for.
///
/// # Errors
/// Nothing was rendered, because names clash, a crop does not fit, the cameras from elsewhere are not to be had, or the
/// output folder cannot be written to.
pub fn run(settings: &BatchSettings, observer: &mut dyn Observer) -> Result<Outcome, Stop> {
    let (started, clock) = (SystemTime::now(), Instant::now());
    if let (Some(crop), PictureSize::Exact(width, height)) = (settings.render.crop, settings.size) {
        check_crop(crop, width, height).map_err(Stop::Usage)?;
    }
    let inputs = expand(&settings.inputs);
    let scene = settings.load.scene.as_deref();
    let elsewhere = settings.camera_source.cameras().map_err(Stop::Usage)?;
    let names = elsewhere.as_deref().map(names_of);
    if let Some(names) = &names {
        // What is not there is there for no input.
        let source = settings.camera_source.options();
        settings.cameras.select(names).map_err(|error| Stop::Usage(format!("{source}: {error}")))?;
    }
    let plan =
        plan(&inputs, settings.name.as_ref(), &settings.cameras, scene, names.as_deref()).map_err(Stop::Usage)?;
    check_writable(&settings.out).map_err(Stop::Unwritable)?;

    let mut run = Run { settings, observer, plan, elsewhere, images: Vec::new(), bad_inputs: 0, unwritable: None };
    for (index, input) in inputs.iter().enumerate() {
        run.input(index, input);
        if run.unwritable.is_some() {
            break;
        }
    }
    let Run { images, bad_inputs, mut unwritable, .. } = run;
    let requested = Accel { requested: accel_name(settings.render.accel), ..Accel::default() };
    let chosen = images.iter().map(|image| &image.accel).find(|accel| accel.used.is_some());
    let count = |status| images.iter().filter(|image| image.status == status).count();
    let report = BatchReport {
        prt: crate::VERSION,
        command: settings.command.clone(),
        started: report::utc(started),
        seconds: clock.elapsed().as_secs_f64(),
        host: Host { cpu: report::cpu_name(), threads: threads(&settings.render) },
        accel: chosen.cloned().unwrap_or(requested),
        counts: Status::ALL.iter().map(|&status| (status, count(status))).collect(),
        images,
    };
    if let Err(error) = write_atomic(&settings.out.join("batch.json"), report::to_json(&report).as_bytes()) {
        unwritable.get_or_insert(error);
    }
    Ok(Outcome { report, bad_inputs, unwritable })
}

/// One run under way.
struct Run<'a> {
    settings: &'a BatchSettings,
    observer: &'a mut dyn Observer,
    plan: Plan,
    /// The cameras for every input, if the inputs' own are not wanted.
    elsewhere: Option<Vec<Camera>>,
    images: Vec<ImageReport>,
    bad_inputs: usize,
    unwritable: Option<WriteError>,
}

impl Run<'_> {
    /// All images of one input.
    fn input(&mut self, index: usize, input: &Input) {
        let clock = Instant::now();
        let progress = Arc::new(Progress::default());
        self.observer.started(&input.path, &progress);
        let naming = self.plan.namings[index].clone();
        let mut image = self.blank(&input.path);
        let loaded = match &input.problem {
            Some(problem) => Err(problem.to_string()),
            None => guarded(|| load(&input.path, &self.settings.load).map_err(|error| error.to_string())),
        };
        let loaded = loaded.and_then(|(mut scene, times)| {
            if let Some(cameras) = &self.elsewhere {
                self.settings.camera_source.replace(&mut scene, cameras);
            }
            let names = names_of(&scene.cameras);
            let chosen = self.settings.cameras.select(&names);
            let chosen = chosen.map_err(|error| format!("{}: {error}", input.path.display()))?;
            Ok((scene, times, names, chosen))
        });
        let (scene, times, names, chosen) = match loaded {
            Ok(loaded) => loaded,
            Err(message) => {
                self.bad_inputs += 1;
                fail(&mut image, message);
                image.seconds.total = clock.elapsed().as_secs_f64();
                // A pattern or a folder has no name of its own to write under.
                let output = input.problem.is_none().then(|| naming.output("0", false));
                return self.finish(image, output);
            }
        };
        self.scene(index, &input.path, &scene, times, (&naming, &names, &chosen), (clock, progress));
    }

    /// All chosen images of a loaded scene.
    fn scene(
        &mut self,
        index: usize,
        path: &Path,
        scene: &Scene,
        times: LoadTimes,
        (naming, names, chosen): (&Naming, &[String], &[usize]),
        (mut clock, mut progress): (Instant, Arc<Progress>),
    ) {
        let outputs = naming.outputs(names, chosen);
        for (nth, (&camera, output)) in chosen.iter().zip(outputs).enumerate() {
            let mut image = self.blank(path);
            if nth == 0 {
                (image.seconds.load, image.seconds.decode) = (Some(times.load), Some(times.decode));
            } else {
                // The file was read for the first image already.
                (image.seconds.load, image.seconds.decode) = (Some(0.0), Some(0.0));
                (clock, progress) = (Instant::now(), Arc::default());
                self.observer.started(path, &progress);
            }
            image.scene = Some(scene.index);
            let name = |name: &String| if name.is_empty() { camera.to_string() } else { name.clone() };
            image.camera = names.get(camera).map(name);
            image.warnings.clone_from(&scene.warnings);
            image.skipped.clone_from(&scene.skipped);
            let owner = *self.plan.owners.entry(output.clone()).or_insert(index);
            if owner != index {
                fail(
                    &mut image,
                    format!("{}: {} belongs to another input; use --name", path.display(), output.display()),
                );
                self.finish(image, None);
                continue;
            }
            self.image(scene, camera, &output, &progress, &mut image);
            image.seconds.total = clock.elapsed().as_secs_f64();
            self.finish(image, Some(output));
            if self.unwritable.is_some() {
                return;
            }
        }
    }

    /// Renders one image and writes its pictures.
    fn image(&mut self, scene: &Scene, camera: usize, output: &Path, progress: &Progress, image: &mut ImageReport) {
        if scene.triangle_count() == 0 {
            image.status = Status::Empty;
            image.warnings.push("nothing drawable: the scene has no triangles; no picture was written".into());
            return;
        }
        let mut settings = self.settings.render.clone();
        (settings.width, settings.height) = size_for(self.settings.size, scene, camera);
        (image.width, image.height) = (Some(settings.width), Some(settings.height));
        image.notes.extend(aspect_note(self.settings.size, scene, camera));
        let fitting = settings.crop.map_or(Ok(()), |crop| check_crop(crop, settings.width, settings.height));
        let rendered = fitting
            .and_then(|()| guarded(|| render(scene, camera, &settings, progress).map_err(|error| error.to_string())));
        match rendered {
            Ok(frame) => {
                describe(&frame, &settings, image);
                self.write_pictures(&frame, &settings, output, image);
            }
            Err(message) => fail(image, format!("{}: {message}", image.input)),
        }
    }

    /// Writes EXR, then PNG.
    fn write_pictures(&mut self, frame: &Frame, settings: &RenderSettings, output: &Path, image: &mut ImageReport) {
        let (clock, files) = (Instant::now(), self.settings.files);
        if files.exr {
            match exr_bytes(frame, settings, files.compression) {
                Ok(bytes) => image.outputs.exr = self.write(output, "exr", &bytes),
                Err(error) => return fail(image, format!("{}: {error}", image.input)),
            }
        }
        if files.png && self.unwritable.is_none() {
            let (bytes, nan_channels) = png_bytes(frame, &files.tone);
            if nan_channels > 0 {
                image.warnings.push(format!("{nan_channels} channels of the picture are NaN; the PNG shows them as 0"));
            }
            image.outputs.png = self.write(output, "png", &bytes);
        }
        image.seconds.write = Some(clock.elapsed().as_secs_f64());
        match &self.unwritable {
            Some(error) => fail(image, error.to_string()),
            None => image.status = Status::Rendered,
        }
    }

    /// Writes `<out>/<output>.<extension>`; the path if that went well, else the run is to stop.
    fn write(&mut self, output: &Path, extension: &str, bytes: &[u8]) -> Option<String> {
        let path = self.path(output, extension);
        match write_atomic(&path, bytes) {
            Ok(()) => Some(path.display().to_string()),
            Err(error) => {
                self.unwritable = Some(error);
                None
            }
        }
    }

    fn path(&self, output: &Path, extension: &str) -> PathBuf {
        let mut name = self.settings.out.join(output).into_os_string();
        name.push(".");
        name.push(extension);
        name.into()
    }

    /// Writes the image's JSON and files it.
    fn finish(&mut self, mut image: ImageReport, output: Option<PathBuf>) {
        image.peak_rss_bytes = report::peak_rss_bytes();
        if let (Some(output), None) = (output, &self.unwritable) {
            image.outputs.json = Some(self.path(&output, "json").display().to_string());
            if self.write(&output, "json", report::to_json(&image).as_bytes()).is_none() {
                image.outputs.json = None;
                let error = self.unwritable.as_ref().map(ToString::to_string);
                fail(&mut image, error.unwrap_or_default());
            }
        }
        self.observer.finished(&image);
        self.images.push(image);
    }

    /// The report of an image of which nothing is known yet.
    fn blank(&self, input: &Path) -> ImageReport {
        let render = &self.settings.render;
        ImageReport {
            input: input.display().to_string(),
            scene: None,
            camera: None,
            frame: None,
            status: Status::Failed,
            error_message: None,
            outputs: Outputs::default(),
            width: None,
            height: None,
            spp: render.spp,
            seed: render.seed,
            accel: Accel { requested: accel_name(render.accel), ..Accel::default() },
            seconds: Seconds::default(),
            rays: None,
            mrays_per_s: None,
            estimated_error: None,
            non_finite_samples: None,
            truncated: None,
            energy_clamped: None,
            peak_rss_bytes: None,
            triangles: None,
            instances: None,
            lights: None,
            default_light: None,
            features: Default::default(),
            skipped: Vec::new(),
            warnings: Vec::new(),
            accel_note: String::new(),
            notes: Vec::new(),
        }
    }
}

fn names_of(cameras: &[Camera]) -> Vec<String> {
    cameras.iter().map(|camera| camera.name.clone()).collect()
}

fn fail(image: &mut ImageReport, message: String) {
    image.status = Status::Failed;
    image.error_message = Some(message);
}

/// Runs `work`; a panic in it becomes an error, so that the batch goes on.
fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let text = payload.downcast_ref::<&str>().map(ToString::to_string);
        let text = text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default();
        Err(format!("internal error: {text}\n  This is a bug in prt-batch, please report it with the file."))
    })
}

/// Puts what `frame` says about itself into the report.
fn describe(frame: &Frame, settings: &RenderSettings, image: &mut ImageReport) {
    let stats = &frame.stats;
    let total = stats.camera_rays + stats.bounce_rays + stats.shadow_rays;
    let some = |text: &String| (!text.is_empty()).then(|| text.clone());
    image.spp = frame.spp;
    image.accel.used = Some(stats.accel.used);
    (image.accel.version, image.accel.isa) = (some(&stats.accel.version), some(&stats.accel.isa));
    image.accel_note.clone_from(&stats.accel.note);
    (image.seconds.build, image.seconds.render) = (Some(stats.build_seconds), Some(stats.render_seconds));
    let (camera, bounce, shadow) = (stats.camera_rays, stats.bounce_rays, stats.shadow_rays);
    image.rays = Some(Rays { camera, bounce, shadow, total });
    image.mrays_per_s = (stats.render_seconds > 0.0).then(|| total as f64 / stats.render_seconds * 1e-6);
    image.non_finite_samples = Some(stats.non_finite_samples);
    image.truncated = Some(stats.truncated);
    image.triangles = Some(stats.triangles);
    image.instances = Some(stats.instances);
    image.lights = Some(stats.lights);
    image.default_light = Some(report::DefaultLight {
        requested: default_light_name(stats.default_light.requested),
        used: stats.default_light.used,
        emitted_lm_per_m2: stats.default_light.emitted.by_lamps,
        glowing_share: stats.default_light.emitted.glowing,
    });
    image.notes.extend(stats.default_light.note());
    image.features = stats.features.iter().copied().collect();
    image.warnings.extend(stats.warnings.iter().cloned());
    if let Some((x, y, sample)) = stats.non_finite_examples.first() {
        let (count, seed) = (stats.non_finite_samples, settings.seed);
        let first = format!("the first at pixel ({x}, {y}), sample {sample}, seed {seed}");
        image.warnings.push(format!("{count} samples were not finite and were dropped; {first}"));
    }
}

fn accel_name(accel: AccelChoice) -> &'static str {
    match accel {
        AccelChoice::Auto => "auto",
        AccelChoice::Embree => "embree",
        AccelChoice::Bvh => "bvh",
        AccelChoice::Linear => "linear",
    }
}

fn default_light_name(choice: DefaultLight) -> &'static str {
    match choice {
        DefaultLight::Auto => "auto",
        DefaultLight::On => "on",
        DefaultLight::Off => "off",
    }
}

fn threads(settings: &RenderSettings) -> usize {
    settings.threads.or_else(|| std::thread::available_parallelism().ok().map(Into::into)).unwrap_or(1)
}

#[cfg(test)]
#[path = "run_tests.rs"]
mod tests;
