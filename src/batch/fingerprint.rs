//! What an image was made from, as two hashes and the list behind them: equal fingerprints mean equal files.
//!
//! A fingerprint is known before the scene is loaded, or it would be of no use for not loading it. So it holds what was
//! asked for (`auto`, a width without a height), and the bytes of files instead of what a loader makes of them. It holds
//! no path, and nothing of this machine: equal inputs in another folder have the same fingerprint.

use super::content::{Content, HashCache, InputRecord, content_of};
use super::develop::Tone;
use super::environment::EnvironmentOrigin;
use super::frames::Frames;
use super::picture::FileOptions;
use super::settings::FileSettings;
use super::size::PictureSize;
use super::view::{CameraSource, View};
use crate::camera::{Camera, Lens};
use crate::color::Exposure;
use crate::image::exr::ExrOptions;
use crate::load::LoadOptions;
use crate::render::{CropWindow, Filter, Integrator, Layers, RenderSettings, SpreadReport, Stopping};
use crate::scene::SourceFile;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::{Debug, Write};
use std::path::Path;
use std::time::Duration;

/// Settings by the name of their option, sorted, so that equal settings are equal text.
pub type Settings = BTreeMap<String, String>;

/// What an image was made from, as its JSON has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// Version of the program.
    pub prt: String,
    /// Hash of everything that determines the pixels, 64 hexadecimal digits; the EXR has it as `prt:fingerprint`.
    pub pixels: String,
    /// Hash of everything that determines the bytes of the files.
    pub files: String,
    /// What was asked for, as far as it matters; `spp` is what was reached, `adaptive` how samples were spread, if they were.
    pub settings: Settings,
    /// What was to end sampling, if not a number of samples alone.
    pub stopping: Option<StoppingRecord>,
    /// The files that were read or looked for, the input first.
    pub inputs: Vec<InputRecord>,
    /// The files that were written.
    pub outputs: Vec<OutputRecord>,
}

/// What was to end the sampling of an image. Pixels do not depend on it, only on how many samples there were in the end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoppingRecord {
    /// The most samples a pixel.
    pub spp: u32,
    /// As for `--target-error`.
    pub target_error: Option<f64>,
    /// Seconds.
    pub time_limit: Option<f64>,
    /// Seconds that its whole batch had.
    pub batch_time_limit: Option<f64>,
}

/// A file that was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OutputRecord {
    /// Its extension: `exr` or `png`.
    pub kind: String,
    /// Length.
    pub bytes: u64,
    /// See [`Content::blake3`].
    pub blake3: String,
}

/// An image as it is asked for, before its input is read.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// The scene file.
    pub input: &'a Path,
    /// How it is made.
    pub settings: &'a FileSettings,
    /// Whose cameras, as `settings.camera_source` has it.
    pub origin: &'a CameraOrigin,
    /// Of `settings.environment`.
    pub environment: Option<&'a EnvironmentOrigin>,
    /// Which of them, by its place.
    pub camera: usize,
    /// Which frame of the animation, if `settings.frames` are asked for.
    pub frame: Option<u32>,
    /// Of the run.
    pub batch_time_limit: Option<Duration>,
}

/// Where cameras come from, as far as pixels depend on it.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraOrigin {
    /// The input, whose bytes are in the fingerprint anyway.
    Input,
    /// A file with this in it.
    File(Content),
    /// Numbers.
    View(View),
}

impl CameraOrigin {
    /// The cameras of `source` (see [`CameraSource`]; `None`: each input has its own) and where they come from.
    ///
    /// # Errors
    /// There are none, or their file changed while it was read; the text names the option.
    pub fn read(source: &CameraSource, cache: &HashCache) -> Result<(Option<Vec<Camera>>, Self), String> {
        let file = match source {
            CameraSource::File(path) => Some(SourceFile::input(path)),
            CameraSource::Inputs | CameraSource::View(_) => None,
        };
        let cameras = source.cameras()?;
        let origin = match (source, file) {
            (CameraSource::View(view), _) => Self::View(*view),
            (_, Some(file)) => Self::File(content_of("--camera-from", &file, cache)?),
            (_, None) => Self::Input,
        };
        Ok((cameras, origin))
    }
}

impl Fingerprint {
    /// Of the image `wanted`, made from `inputs` with `spp` samples a pixel, spread so over the pixels; outputs are added as
    /// they are written.
    pub fn new(wanted: &Wanted, inputs: Vec<InputRecord>, spp: u32, spread: Option<SpreadReport>) -> Self {
        let FileSettings { files, render, .. } = wanted.settings;
        let spread = spread.map(|SpreadReport { stage, round, .. }| format!("stage {stage}, round {round}"));
        let pixel_settings = wanted.pixel_settings(spp, spread.as_deref());
        let file_settings = file_settings(files, render.layers);
        let pixels = hash_pixels(&pixel_settings, &inputs);
        Self {
            prt: crate::VERSION.into(),
            files: hash_files(&pixels, &file_settings),
            pixels,
            settings: pixel_settings.into_iter().chain(file_settings).collect(),
            stopping: wanted.stopping(),
            inputs,
            outputs: Vec::new(),
        }
    }

    /// Notes that a file with this extension and these bytes was written.
    pub fn add_output(&mut self, kind: &str, bytes: &[u8]) {
        let Content { bytes, blake3 } = Content::of(bytes);
        self.outputs.push(OutputRecord { kind: kind.into(), bytes, blake3 });
    }

    /// Whether a file with this extension was written.
    pub fn has_output(&self, kind: &str) -> bool {
        self.outputs.iter().any(|output| output.kind == kind)
    }
}

impl Wanted<'_> {
    /// Everything that determines the pixels but the bytes of the inputs. Structures are taken apart whole, so that a
    /// field that is added to one of them must be put here, or named as one that changes no pixel. With `spp` samples a
    /// pixel, which is what is asked for unless something else ends sampling, and how they are spread unevenly.
    pub fn pixel_settings(&self, spp: u32, adaptive: Option<&str>) -> Settings {
        let Self { input, settings, origin, environment, camera, frame: wanted_frame, batch_time_limit: _ } = *self;
        // Names of files change no pixel; which cameras, which environment and from where is said by `origin`, `camera` and
        // `environment`; `files` comes after the pixels.
        let FileSettings {
            name: _,
            size,
            camera_source: _,
            cameras: _,
            environment: _,
            frames,
            load,
            render,
            files: _,
        } = settings;
        let mut lines = Settings::new();
        let mut set = |key: &str, value: String| _ = lines.insert(key.into(), value);
        set(
            "size",
            match size {
                // Its height follows from the camera, which is in the inputs.
                PictureSize::Width(width) => format!("{width} wide"),
                PictureSize::Exact(width, height) => format!("{width}x{height}"),
            },
        );
        set("camera", camera.to_string());
        match origin {
            CameraOrigin::Input => {}
            CameraOrigin::File(Content { bytes, blake3 }) => set("camera-from", format!("{bytes} bytes, {blake3}")),
            CameraOrigin::View(View { eye, look_at, up, yfov }) => {
                for (key, [x, y, z]) in [("eye", eye), ("look-at", look_at), ("up", up)].map(|(k, v)| (k, v.to_array()))
                {
                    set(key, format!("{x},{y},{z}"));
                }
                set("yfov", yfov.to_string());
            }
        }

        if let Some(EnvironmentOrigin { content: Content { bytes, blake3 }, rotate, scale }) = environment {
            set("env", format!("{bytes} bytes, {blake3}"));
            set("env-rotate", rotate.to_string());
            set("env-scale", scale.to_string());
        }

        // The asset root only decides which files may be read; those that were are listed with their contents.
        let LoadOptions { asset_root: _, scene, variant, focus_on, obj_up, obj_scale, smooth_angle } = load;
        set("scene", scene.clone().unwrap_or_else(|| "default".into()));
        if input.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) {
            set("obj-up", name(obj_up));
            set("obj-scale", obj_scale.unwrap_or(1.0).to_string());
            set("smooth-angle", smooth_angle.map_or_else(|| "off".into(), |angle| angle.to_string()));
        } else if let Some(variant) = variant {
            set("variant", variant.clone());
        }

        if let Some(node) = focus_on {
            set("focus-on", node.clone());
        }

        let RenderSettings {
            // Follow from `size`.
            width: _,
            height: _,
            crop,
            // In their place, those that there were.
            spp: _,
            // Only how many samples there are in the end.
            stopping: _,
            // How samples were spread is known when they were.
            adaptive: _,
            seed,
            frame,
            integrator,
            lens: Lens { f_stop, focus_distance, blades, sensor },
            // Said by `focus-on` and the inputs.
            focus_point: _,
            max_bounces,
            cull_backfaces,
            texture_lod,
            clamp,
            filter,
            brdf,
            default_light,
            light_radius,
            sun_angle,
            // As asked for: which backend `auto` takes is known only when the scene is prepared, and their pictures
            // differ by rounding alone.
            accel,
            // What is written beside the pixels: with the files.
            layers: _,
            // Where a library lies, how many work and how many lanes at a time: rounding at most.
            embree_dirs: _,
            threads: _,
            lanes: _,
        } = render;
        let whole = || "whole".into();
        set("crop", crop.map_or_else(whole, |CropWindow { x, y, width, height }| format!("{x},{y},{width},{height}")));
        set("spp", spp.to_string());
        if let Some(adaptive) = adaptive {
            set("adaptive", adaptive.into());
        }
        set("seed", seed.to_string());
        set("frame", wanted_frame.unwrap_or(*frame).to_string());
        // Only where there are any: pictures of files as written have the fingerprints that they had before.
        if let (Some(frames), Some(_)) = (frames, wanted_frame) {
            // The frame's number says which of them.
            let Frames { choice: _, fps, animation, shutter, position } = frames;
            set("fps", fps.to_string());
            set("animation", animation.to_string());
            set("shutter", shutter.map_or_else(|| "of the file".into(), |share| share.to_string()));
            if *shutter != Some(0.0) {
                set("shutter-position", name(position));
            }
        }
        set("max-bounces", max_bounces.map_or_else(|| "unlimited".into(), |most| most.to_string()));
        // Named only where they are on: pictures without them have the fingerprints that they had before there were any.
        if let Some(most) = clamp {
            set("clamp", most.to_string());
        }
        if *integrator != Integrator::Path {
            set("integrator", integrator.name().into());
        }
        let blades = blades.map(f64::from);
        for (name, value) in
            [("f-stop", f_stop), ("focus-distance", focus_distance), ("aperture-blades", &blades), ("sensor", sensor)]
        {
            if let Some(value) = value {
                set(name, value.to_string());
            }
        }
        if *texture_lod {
            set("texture-lod", "on".into());
        }
        for (name, size) in [("light-radius", light_radius), ("sun-angle", sun_angle)] {
            if *size > 0.0 {
                set(name, size.to_string());
            }
        }
        set("cull-backfaces", if *cull_backfaces { "on" } else { "off" }.into());
        let Filter { shape, width } = filter;
        set("filter", format!("{}:{width}", shape.name()));
        set("brdf", name(brdf));
        set("default-light", name(default_light));
        set("accel", name(accel));
        lines
    }
}

impl Wanted<'_> {
    /// What is to end sampling; `None` if that is a number of samples alone.
    pub fn stopping(&self) -> Option<StoppingRecord> {
        // `batch_until` is the moment at which this run's share is over.
        let RenderSettings { spp, stopping: Stopping { target_error, time_limit, batch_until: _ }, .. } =
            self.settings.render;
        let seconds = |limit: Option<Duration>| limit.map(|limit| limit.as_secs_f64());
        let (time_limit, batch_time_limit) = (seconds(time_limit), seconds(self.batch_time_limit));
        let is_open = target_error.is_some() || time_limit.is_some() || batch_time_limit.is_some();
        is_open.then_some(StoppingRecord { spp, target_error, time_limit, batch_time_limit })
    }
}

/// How the files that are asked for are made of the pixels.
pub fn file_settings(files: &FileOptions, layers: Layers) -> Settings {
    let FileOptions { exr, png, format: ExrOptions { samples, compression }, tone: Tone { exposure, curve } } = files;
    let mut lines = Settings::new();
    if *exr {
        lines.insert("exr".into(), name(samples));
        lines.insert("exr-compression".into(), name(compression));
        let Layers { variance, samples } = layers;
        let layers: Vec<_> =
            [("variance", variance), ("samples", samples)].into_iter().filter(|layer| layer.1).collect();
        // Named only where there are any: pictures without have the fingerprints that they had before there were any.
        if !layers.is_empty() {
            lines.insert("aov".into(), layers.iter().map(|layer| layer.0).collect::<Vec<_>>().join(","));
        }
    }
    if *png {
        let exposure = match exposure {
            Exposure::Stops(stops) => stops.to_string(),
            // A function of the pixels.
            Exposure::Auto => "auto".into(),
        };
        lines.insert("exposure".into(), exposure);
        lines.insert("tonemap".into(), name(curve));
    }
    lines
}

/// The name of a variant without fields: only shown, and compared with names made in the same way.
fn name(variant: &impl Debug) -> String {
    format!("{variant:?}").to_ascii_lowercase()
}

/// See [`Fingerprint::pixels`].
pub(super) fn hash_pixels(settings: &Settings, inputs: &[InputRecord]) -> String {
    let mut text = format!("prt pixels 1\nversion {}\n", crate::VERSION);
    for InputRecord { path: _, name, bytes, blake3 } in inputs {
        let _ = match (bytes, blake3) {
            // Names are quoted, so that none can pass for a line.
            (Some(bytes), Some(blake3)) => writeln!(text, "input {} {bytes} {}", quoted(name), quoted(blake3)),
            _ => writeln!(text, "input {} absent", quoted(name)),
        };
    }
    hash_text(text, settings)
}

/// See [`Fingerprint::files`].
pub(super) fn hash_files(pixels: &str, settings: &Settings) -> String {
    hash_text(format!("prt files 1\npixels {}\n", quoted(pixels)), settings)
}

fn hash_text(mut text: String, settings: &Settings) -> String {
    for (key, value) in settings {
        let _ = writeln!(text, "{key} = {}", quoted(value));
    }
    Content::of(text.as_bytes()).blake3
}

fn quoted(text: &str) -> serde_json::Value {
    text.into()
}
