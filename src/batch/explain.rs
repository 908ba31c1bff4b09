//! `--explain`: what a run would do with each image, found out without rendering or writing anything. Scenes are loaded
//! and prepared, and a tenth of a second of paths is traced to tell how long the rest will take.

use super::content::HashCache;
use super::describe::{accel_name, default_light_name, lens_notes};
use super::elsewhere::Elsewhere;
use super::fingerprint::StoppingRecord;
use super::job::Plan;
use super::load_stage::scene as scene_of;
use super::memory::{MemoryBudget, need};
use super::panics::guarded;
use super::report::{Accel, DefaultLight, Lens, Outputs};
use super::run::{Stop, names_of, planned, reported_name};
use super::settings::{BatchSettings, FileSettings};
use super::size::{aspect_note, check_crop, size_for};
use super::up_to_date::check;
use super::view::CameraSource;
use crate::camera::{Camera, Projection};
use crate::light::Light;
use crate::load::{LoadEstimate, LoadTimes};
use crate::render::memory::{MemoryEstimate, texel_bytes};
use crate::render::{self, Considered, Prepared, RenderSettings, features, pilot, prepare};
use crate::scene::{Scene, Skipped};
use crate::texture::{Image, Texels};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What would come of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Prospect {
    /// It would be rendered.
    #[default]
    Render,
    /// Its files are up to date and would be kept.
    Keep,
    /// Nothing to draw: no picture, no failure.
    Empty,
    /// It would fail; `problem` says why.
    Fail,
}

/// The plan of one image. What is not known, because the image would fail before, is null or empty.
#[derive(Clone, Debug, Default, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Explanation {
    pub input: String,
    pub prospect: Prospect,
    pub problem: Option<String>,
    /// Why the files on disk would be kept, or rendered again; null where nobody looked.
    pub up_to_date: Option<String>,
    pub scene: Option<usize>,
    pub camera: Option<CameraPlan>,
    /// Null for a pinhole.
    pub lens: Option<Lens>,
    pub frame: Option<u32>,
    pub outputs: Outputs,
    pub width: Option<u32>,
    pub height: Option<u32>,
    /// X, Y, width, height.
    pub crop: Option<[u32; 4]>,
    /// The most, if `stopping` is not null.
    pub spp: u32,
    /// With that.
    pub paths: Option<u64>,
    /// What may end sampling before.
    pub stopping: Option<StoppingRecord>,
    pub seed: u64,
    pub integrator: &'static str,
    pub accel: Accel,
    /// Why `auto` does not take Embree; empty if it does.
    pub accel_note: String,
    /// Big triangles tested by packets of rays before the backend.
    pub front_triangles: Option<u64>,
    /// Entries in the leaves of `bvh` beyond one for each triangle: it cut long diagonal ones where that pays.
    pub split_references: Option<u64>,
    pub features: BTreeMap<String, bool>,
    pub triangles: Option<TrianglePlan>,
    pub meshes: Option<usize>,
    pub instances: Option<usize>,
    /// Placements of what is not merged into the world; meshes with the same places count once.
    pub placed_instances: Option<u64>,
    /// What has several instances, and whether they are merged or placed.
    pub placing: Vec<Considered>,
    pub materials: Option<usize>,
    pub textures: Vec<TexturePlan>,
    pub texture_bytes: u64,
    pub lights: Option<LightPlan>,
    pub default_light: Option<DefaultLight>,
    pub memory: Option<MemoryPlan>,
    pub seconds: SecondsPlan,
    pub skipped: Vec<Skipped>,
    pub warnings: Vec<String>,
    pub losses: Vec<String>,
    pub notes: Vec<String>,
}

/// The camera of an image.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct CameraPlan {
    /// Its place among the scene's cameras; null for the one framed on the bounds.
    pub index: Option<usize>,
    pub name: Option<String>,
    /// `file`, `bounds`, or the option that gives it.
    pub from: String,
    /// `perspective` or `orthographic`.
    pub projection: &'static str,
    /// Degrees; null for an orthographic camera.
    pub yfov: Option<f64>,
    /// Metres, world space.
    pub eye: [f64; 3],
}

/// How many triangles.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct TrianglePlan {
    /// Of all meshes that the scene uses, each once.
    pub file: u64,
    /// With every instance of a mesh.
    pub placed: u64,
    /// Without those that have no area or are out of range once placed.
    pub traced: u64,
    /// Held for that: those of a mesh that is not merged into the world once.
    pub stored: u64,
}

/// An image that textures read.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct TexturePlan {
    pub name: String,
    pub width: u32,
    pub height: u32,
    /// Kept of it: 1, 2 or 4.
    pub channels: usize,
    /// A channel.
    pub bits: u32,
    pub bytes: u64,
}

/// Lights by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct LightPlan {
    /// Glowing meshes where they are placed, or parts of them that touch no other: a light each.
    pub emissive_meshes: usize,
    /// Their triangles.
    pub emissive_triangles: u64,
    pub point: usize,
    pub spot: usize,
    pub directional: usize,
    /// Of the scene's own or the built-in studio.
    pub environment: bool,
}

/// Estimated bytes, at most and by part.
#[derive(Clone, Copy, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct MemoryPlan {
    pub peak: u64,
    #[serde(flatten)]
    pub parts: MemoryEstimate,
    /// What `--memory` allows; null where there is no limit.
    pub budget: Option<u64>,
}

/// Seconds of wall clock: those of loading and building as they were just now, the others estimated.
#[derive(Clone, Copy, Debug, Default, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct SecondsPlan {
    pub load: Option<f64>,
    pub decode: Option<f64>,
    pub build: Option<f64>,
    pub render: Option<f64>,
    pub write: Option<f64>,
    pub total: Option<f64>,
    /// Rays a second that the estimate of `render` follows from, in millions.
    pub mrays_per_s: Option<f64>,
}

/// How the planning went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Explained {
    /// Images.
    pub images: usize,
    /// Those of them that would fail.
    pub failing: usize,
    /// Inputs that cannot be read.
    pub bad_inputs: usize,
    /// Inputs.
    pub inputs: usize,
}

impl Explained {
    /// As a run of the same images would end: 0, 1 some would fail, 3 every input is bad.
    pub fn exit_code(&self) -> u8 {
        match () {
            () if self.inputs > 0 && self.bad_inputs == self.inputs => 3,
            () if self.failing > 0 => 1,
            () => 0,
        }
    }
}

/// Tells `told` the plan of every image that [`super::run()`] would make, in the same order. Nothing is rendered and
/// nothing is written, not even a folder.
///
/// # Errors
/// What stops a run before anything is rendered, but for the output folder, which is not touched.
pub fn explain(settings: &BatchSettings, told: &mut dyn FnMut(Explanation)) -> Result<Explained, Stop> {
    let hashes = HashCache::default();
    let (elsewhere, plan) = planned(&settings.tasks, &hashes).map_err(Stop::Usage)?;
    let pool = render::pool(settings.threads).map_err(|error| Stop::Usage(format!("--threads: {error}")))?;
    let budget = MemoryBudget::new(settings.memory);
    let mut explained = Explained { inputs: settings.tasks.len(), ..Explained::default() };
    for (task, elsewhere) in elsewhere.iter().enumerate() {
        let frame = plan.frames[task].first().copied().flatten();
        let one = File { run: settings, plan: &plan, task, elsewhere, hashes: &hashes, budget, frame };
        let mut count = |explanation: Explanation| {
            explained.images += 1;
            explained.failing += usize::from(explanation.prospect == Prospect::Fail);
            told(explanation);
        };
        match pool.install(|| guarded(|| one.load())) {
            Ok((scene, times, reading)) => {
                let first = pool.install(|| one.images(&scene, times, reading));
                let later: Vec<Explanation> = (plan.frames[task].iter().skip(1))
                    .flat_map(|&frame| File { frame, ..one }.like(&first, &names_of(&scene.cameras)))
                    .collect();
                first.into_iter().chain(later).for_each(&mut count);
            }
            Err(problem) => {
                explained.bad_inputs += 1;
                let explanation = Explanation { prospect: Prospect::Fail, problem: Some(problem), ..one.blank() };
                explained.images += 1;
                explained.failing += 1;
                told(explanation);
            }
        }
    }
    Ok(explained)
}

/// One input of a run.
#[derive(Clone, Copy)]
struct File<'a> {
    run: &'a BatchSettings,
    plan: &'a Plan,
    task: usize,
    elsewhere: &'a Elsewhere,
    hashes: &'a HashCache,
    budget: MemoryBudget,
    frame: Option<u32>,
}

impl File<'_> {
    fn settings(&self) -> &FileSettings {
        &self.run.tasks[self.task].settings
    }

    /// What is known before anything is read.
    fn blank(&self) -> Explanation {
        let (input, render) = (&self.run.tasks[self.task].input, &self.settings().render);
        Explanation {
            input: input.path.display().to_string(),
            frame: self.frame,
            spp: render.spp,
            stopping: self
                .elsewhere
                .wanted(&self.run.tasks[self.task], 0, self.frame, self.run.batch_time_limit)
                .stopping(),
            seed: render.seed,
            integrator: render.integrator.name(),
            crop: render.crop.map(|c| [c.x, c.y, c.width, c.height]),
            accel: Accel { requested: accel_name(render.accel).into(), ..Accel::default() },
            ..Explanation::default()
        }
    }

    /// The scene, unless reading it would take more memory than there may be used.
    fn load(&self) -> Result<(Scene, LoadTimes, LoadEstimate), String> {
        let (input, settings) = (&self.run.tasks[self.task].input, self.settings());
        if let Some(problem) = &input.problem {
            return Err(problem.to_string());
        }
        let reading = self.budget.check_loading(&input.path, settings)?;
        let (mut scene, times) =
            scene_of(&input.path, settings, self.frame, &mut None).map_err(|error| error.to_string())?;
        self.elsewhere.replace_in(&mut scene, settings);
        Ok((scene, times, reading))
    }

    /// The plans of all chosen cameras of a scene.
    fn images(&self, scene: &Scene, times: LoadTimes, reading: LoadEstimate) -> Vec<Explanation> {
        let settings = self.settings();
        let names = names_of(&scene.cameras);
        let chosen = match settings.cameras.select(&names) {
            Ok(chosen) => chosen,
            Err(error) => {
                let problem = Some(format!("{}: {error}", self.blank().input));
                return vec![Explanation { prospect: Prospect::Fail, problem, ..self.blank() }];
            }
        };
        let outputs = self.plan.namings[self.task].outputs(&names, &chosen, self.frame);
        let mut prepared = None;
        let mut all = Vec::with_capacity(chosen.len());
        for (nth, (&camera, output)) in chosen.iter().zip(outputs).enumerate() {
            let mut plan = self.blank();
            self.describe_scene(scene, &mut plan);
            // As in reports: the file is read for its first image.
            let times = if nth == 0 { times } else { LoadTimes::default() };
            (plan.seconds.load, plan.seconds.decode) = (Some(times.load), Some(times.decode));
            plan.outputs = self.outputs(&output);
            if self.plan.owners.get(&output).is_some_and(|owner| *owner != self.task) {
                let output = output.display();
                fail(&mut plan, format!("{output} belongs to another input; use --name"));
            } else if let Err(problem) = self.image(scene, camera, reading, &mut prepared, &mut plan) {
                fail(&mut plan, problem);
            }
            self.look_for_earlier(camera, &mut plan);
            all.push(plan);
        }
        all
    }

    /// The plans of this frame as those of the file's first one: what a later frame takes is not tried out.
    fn like(&self, first: &[Explanation], names: &[String]) -> Vec<Explanation> {
        let chosen = self.settings().cameras.select(names).unwrap_or_default();
        let outputs = self.plan.namings[self.task].outputs(names, &chosen, self.frame);
        let of = |((plan, &camera), output): ((&Explanation, &usize), PathBuf)| {
            let mut plan = Explanation { frame: self.frame, outputs: self.outputs(&output), ..plan.clone() };
            if plan.prospect == Prospect::Keep {
                plan.prospect = Prospect::Render;
            }
            self.look_for_earlier(camera, &mut plan);
            plan
        };
        first.iter().zip(&chosen).zip(outputs).map(of).collect()
    }

    fn outputs(&self, output: &Path) -> Outputs {
        let files = self.settings().files;
        let path = |extension: &str| self.run.path(output, extension).display().to_string();
        Outputs { exr: files.exr.then(|| path("exr")), png: files.png.then(|| path("png")), json: Some(path("json")) }
    }

    /// Whether an earlier run left what this one would write.
    fn look_for_earlier(&self, camera: usize, plan: &mut Explanation) {
        let wanted = self.elsewhere.wanted(&self.run.tasks[self.task], camera, self.frame, self.run.batch_time_limit);
        let json = match &plan.outputs.json {
            Some(json) if plan.prospect == Prospect::Render && !self.run.force => json,
            _ => return,
        };
        match check(Path::new(json), &wanted, self.hashes) {
            Ok(_) => {
                plan.prospect = Prospect::Keep;
                plan.up_to_date = Some("its files are what a run would write".into());
            }
            Err(why) => plan.up_to_date = Some(format!("no: {why}")),
        }
    }

    /// What a scene is, whoever looks at it.
    fn describe_scene(&self, scene: &Scene, plan: &mut Explanation) {
        plan.scene = Some(scene.index);
        plan.warnings.clone_from(&scene.warnings);
        plan.losses.clone_from(&scene.losses);
        plan.skipped.clone_from(&scene.skipped);
        (plan.meshes, plan.instances) = (Some(scene.meshes.len()), Some(scene.instances.len()));
        plan.materials = Some(scene.materials.len());
        plan.textures = scene.images.iter().map(|image| texture(image)).collect();
        plan.texture_bytes = plan.textures.iter().map(|texture| texture.bytes).sum();
        let (file, placed) =
            (scene.meshes.iter().map(|mesh| mesh.indices.len() as u64).sum(), scene.triangle_count() as u64);
        plan.triangles = Some(TrianglePlan { file, placed, traced: placed, stored: placed });
    }

    /// The rest; `prepared` is the scene made ready, for the first of its images that needs it.
    fn image(
        &self,
        scene: &Scene,
        camera: usize,
        reading: LoadEstimate,
        prepared: &mut Option<Prepared>,
        plan: &mut Explanation,
    ) -> Result<(), String> {
        let settings = self.settings();
        let frame = self.frame.unwrap_or(settings.render.frame);
        let mut render = RenderSettings { frame, focus_point: scene.focus, threads: None, ..settings.render.clone() };
        (render.width, render.height) = size_for(settings.size, scene, camera);
        (plan.width, plan.height) = (Some(render.width), Some(render.height));
        plan.notes.extend(aspect_note(settings.size, scene, camera));
        if scene.is_empty() {
            plan.prospect = Prospect::Empty;
            plan.warnings.push("nothing drawable: the scene has no triangles; no picture would be written".into());
            return Ok(());
        }
        if let Some(crop) = render.crop {
            check_crop(crop, render.width, render.height)?;
        }
        let window = render::window(&render);
        let paths = u64::from(window.width) * u64::from(window.height) * u64::from(render.spp);
        plan.paths = Some(paths);
        let need = need(scene, reading, &render, settings);
        let budget = Some(self.budget.bytes).filter(|bytes| *bytes < u64::MAX);
        plan.memory = Some(MemoryPlan { peak: need.peak(), parts: need, budget });
        let fits = self.budget.check(&need, Some((window.width, window.height)));
        // A picture that is too large says nothing against preparing its scene.
        self.budget.check(&MemoryEstimate { film: 0, files: 0, ..need }, None)?;
        let is_first = prepared.is_none();
        let start = Instant::now();
        let prepared = match prepared {
            Some(prepared) => prepared,
            None => prepared.insert(guarded(|| prepare(scene, &render).map_err(|error| error.to_string()))?),
        };
        plan.seconds.build = Some(if is_first { start.elapsed().as_secs_f64() } else { 0.0 });
        describe_prepared(scene, prepared, plan);
        let seen = render::camera(scene, camera, prepared, &render);
        let lens = render::lens(prepared, &seen, &render).map_err(|error| error.to_string())?;
        plan.features.insert("depth_of_field".into(), lens.is_some());
        plan.lens = lens.map(Lens::from);
        plan.notes.extend(lens_notes(settings, lens.as_ref()));
        plan.camera = Some(self.camera(scene, camera, &seen));
        let trial = guarded(|| Ok(pilot(prepared, &seen, lens.as_ref(), &render)))?;
        let pixels = (u64::from(window.width) * u64::from(window.height)) as f64;
        let per_pixel =
            if settings.files.exr { EXR_SECONDS } else { 0.0 } + if settings.files.png { PNG_SECONDS } else { 0.0 };
        let seconds = &mut plan.seconds;
        let limit = render.stopping.time_limit.map(|limit| limit.as_secs_f64());
        // A target ends it earlier, nobody knows when; the time of a batch is shared when it is there.
        let is_open = render.stopping.target_error.is_some() || self.run.batch_time_limit.is_some();
        let most = limit.map_or(trial.render_seconds, |limit| limit.min(trial.render_seconds));
        seconds.render = (!is_open || limit.is_some()).then_some(most);
        seconds.write = Some(pixels * per_pixel);
        let rays = trial.rays as f64 / trial.paths.max(1) as f64 * paths as f64;
        seconds.mrays_per_s = (trial.render_seconds > 0.0).then(|| rays / trial.render_seconds * 1e-6);
        let parts = [seconds.load, seconds.decode, seconds.build, seconds.render, seconds.write];
        seconds.total = Some(parts.into_iter().flatten().sum());
        fits
    }

    fn camera(&self, scene: &Scene, index: usize, camera: &Camera) -> CameraPlan {
        let (projection, yfov) = match camera.projection {
            Projection::Perspective { yfov, .. } => ("perspective", Some(yfov.to_degrees())),
            Projection::Orthographic { .. } => ("orthographic", None),
        };
        let is_framed = scene.cameras.is_empty();
        CameraPlan {
            index: (!is_framed).then_some(index),
            name: reported_name(&names_of(&scene.cameras), index),
            from: match &self.settings().camera_source {
                CameraSource::Inputs if is_framed => "bounds".into(),
                CameraSource::Inputs => "file".into(),
                other => other.options(),
            },
            projection,
            yfov,
            eye: camera.world_from_camera.w_axis.truncate().to_array(),
        }
    }
}

/// Wall seconds a pixel that encoding and writing take, measured on one core of a server of 2023 (ZIP; noise compresses
/// worst).
const EXR_SECONDS: f64 = 200e-9;
const PNG_SECONDS: f64 = 60e-9;

fn fail(plan: &mut Explanation, problem: String) {
    plan.prospect = Prospect::Fail;
    plan.problem = Some(format!("{}: {problem}", plan.input));
}

fn texture(image: &Image) -> TexturePlan {
    let (channels, bits) = match &image.texels {
        Texels::Rgba8(_) => (4, 8),
        Texels::Rgba16(_) => (4, 16),
        Texels::Few8(few) => (few.kept, 8),
        Texels::Few16(few) => (few.kept, 16),
    };
    let bytes = texel_bytes(&image.texels);
    TexturePlan { name: image.name.clone(), width: image.width, height: image.height, channels, bits, bytes }
}

/// What is known when a scene is ready to be traced.
fn describe_prepared(scene: &Scene, prepared: &Prepared, plan: &mut Explanation) {
    let (tables, accel, light) = (&prepared.tables, &prepared.accel_report, &prepared.default_light);
    let some = |text: &String| (!text.is_empty()).then(|| text.clone());
    plan.accel.used = Some(accel.used.into());
    (plan.accel.version, plan.accel.isa) = (some(&accel.version), some(&accel.isa));
    plan.accel_note.clone_from(&accel.note);
    plan.front_triangles = Some(accel.front_triangles);
    plan.split_references = Some(accel.splits);
    plan.features = features(scene, prepared, false).into_iter().map(|(name, has)| (name.into(), has)).collect();
    if let Some(triangles) = &mut plan.triangles {
        (triangles.traced, triangles.stored) = (prepared.placed.triangles, prepared.placed.stored);
    }
    plan.placed_instances = Some(prepared.placed.instances);
    plan.placing.clone_from(&prepared.placed.considered);
    plan.warnings.extend(prepared.warnings.iter().cloned());
    plan.losses.extend(prepared.losses.iter().cloned());
    plan.notes.extend(light.note());
    plan.default_light = Some(DefaultLight {
        requested: default_light_name(light.requested).into(),
        used: light.used,
        emitted_lm_per_m2: light.emitted.by_lamps,
        glowing_share: light.emitted.glowing,
    });
    let count = |kind: fn(&Light) -> bool| scene.lights.iter().filter(|placed| kind(&placed.light)).count();
    let environment = tables.lights.has_environment();
    plan.lights = Some(LightPlan {
        emissive_meshes: tables.lights.emissive_meshes(),
        emissive_triangles: tables.lights.emissive_triangles() as u64,
        point: count(|light| matches!(light, Light::Point { .. })),
        spot: count(|light| matches!(light, Light::Spot { .. })),
        directional: count(|light| matches!(light, Light::Directional { .. })),
        environment,
    });
}
