//! Options that may differ from file to file; a config file may have them in `[[file]]` blocks too.
//!
//! What needs another option (`--eye` and `--look-at`) is checked in `meaning.rs`, when config files and the command
//! line have come together.

use crate::parse;
use clap::{Args, ValueHint};
use prt::batch::{FrameChoice, job::CameraChoice, names::NameTemplate};
use prt::color::{Exposure, ToneCurve};
use prt::image::exr::{ExrCompression, ExrSamples};
use prt::load::obj::ObjUp;
use prt::load::{AnimationChoice, ShutterPosition};
use prt::render::{AccelChoice, Brdf, CropWindow, DefaultLight, Filter, Integrator, Layers};
use std::path::PathBuf;
use std::time::Duration;

const PICTURES: &str = "Pictures";
const CAMERAS: &str = "Cameras";
const LENS: &str = "Lens";
const SAMPLING: &str = "Sampling";
const LIGHT: &str = "Light";
const ANIMATION: &str = "Animation";
const FILES: &str = "Files";
const OBJ: &str = "OBJ";

#[derive(Args, Debug)]
pub struct FileArgs {
    /// Pixels, such as 1280x720
    ///
    /// Each side at most 65536.
    #[arg(long, value_name = "WxH", value_parser = parse::size, allow_hyphen_values = true, help_heading = PICTURES)]
    #[arg(conflicts_with = "width")]
    pub size: Option<(u32, u32)>,
    /// Pixels across; the height follows from the camera's aspect ratio, else 16:9 [default: 1280]
    #[arg(long, value_name = "W", value_parser = parse::width, help_heading = PICTURES)]
    pub width: Option<u32>,
    /// Render that window only
    ///
    /// Origin top left, y down (EXR data window; the display window stays whole). Its pixels equal those of the whole
    /// picture.
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse::crop, allow_hyphen_values = true)]
    #[arg(help_heading = PICTURES)]
    pub crop: Option<CropWindow>,
    /// Exposure of the PNG in stops, or auto
    ///
    /// From -100 to 100; the EXR is never touched by it. auto and the curves: see "The PNG" below.
    #[arg(long, value_name = "EV", default_value = "0", value_parser = parse::exposure, allow_hyphen_values = true)]
    #[arg(help_heading = PICTURES)]
    pub exposure: Exposure,
    /// Tone curve of the PNG
    ///
    /// The EXR is never touched by it.
    #[arg(long, value_name = "CURVE", default_value = "neutral", value_parser = parse::tonemap())]
    #[arg(help_heading = PICTURES)]
    pub tonemap: ToneCurve,
    /// Single-sided surfaces are invisible to camera rays from behind
    #[arg(long, help_heading = PICTURES)]
    pub cull_backfaces: bool,

    /// Which scene: an index or a name [default: the file's]
    #[arg(long, value_name = "SCENE", help_heading = CAMERAS)]
    pub scene: Option<String>,
    /// Which of a glTF file's variants of materials [default: the file's own materials]
    ///
    /// By its name in KHR_materials_variants; a file that does not have it is an error that lists those it has.
    #[arg(long, value_name = "NAME", help_heading = CAMERAS)]
    pub variant: Option<String>,
    /// Which cameras: all, an index or a name
    ///
    /// Of the default scene, or of that of --scene. A number is a place in the scene (depth first), anything else a
    /// name; of several of one name the first. A file without cameras is seen by one framed on its bounds.
    #[arg(long, value_name = "CAMERA", default_value = "all", value_parser = parse::camera, help_heading = CAMERAS)]
    pub camera: CameraChoice,
    /// Cameras of this glTF file's default scene, for every input and in place of its own
    ///
    /// All of them, or the one that --camera names; nothing else of the file is read. A camera that is not to be had
    /// is a usage error (2).
    #[arg(long, value_name = "FILE.gltf", help_heading = CAMERAS, value_hint = ValueHint::FilePath)]
    pub camera_from: Option<PathBuf>,
    /// A camera at this place, for every input and in place of its own; needs --look-at
    ///
    /// Metres. The camera is called eye and has no aspect ratio of its own. Excludes --camera and --camera-from, as do
    /// --look-at, --up and --yfov.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true, help_heading = CAMERAS)]
    #[arg(conflicts_with_all = ["camera_from", "camera"])]
    pub eye: Option<[f64; 3]>,
    /// The point in the middle of the picture from --eye, metres
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true, help_heading = CAMERAS)]
    #[arg(conflicts_with_all = ["camera_from", "camera"])]
    pub look_at: Option<[f64; 3]>,
    /// What points up in the picture from --eye [default: 0,1,0]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true, help_heading = CAMERAS)]
    #[arg(conflicts_with_all = ["camera_from", "camera"])]
    pub up: Option<[f64; 3]>,
    /// Vertical field of view from --eye, degrees [default: 40]
    #[arg(long, value_name = "DEG", value_parser = parse::yfov, help_heading = CAMERAS)]
    #[arg(conflicts_with_all = ["camera_from", "camera"])]
    pub yfov: Option<f64>,

    /// F-number of a thin lens, such as 2.8; inf: a pinhole [default: from the file, else a pinhole]
    ///
    /// The lens' radius is f/(2N) metres, with f = (h/2)/tan(yfov/2) and h the height of the image on the sensor. From
    /// 1e-6 to 1e6. With an orthographic camera an error. See "The lens" below.
    #[arg(long, value_name = "N", value_parser = parse::f_stop, allow_hyphen_values = true, help_heading = LENS)]
    pub f_stop: Option<f64>,
    /// Metres along the camera's axis to the plane that is sharp, or inf [default: from the file, else what is in the centre]
    ///
    /// Where nothing says it, the lens is focused on the first surface in the picture's centre, and a note says how far
    /// that is. From 1e-6 to 1e18.
    #[arg(long, value_name = "M", value_parser = parse::focus_distance, allow_hyphen_values = true)]
    #[arg(help_heading = LENS)]
    pub focus_distance: Option<f64>,
    /// Focus on the place of this glTF node in place of a distance
    ///
    /// By its name; of several the first. A node that is not there is an error that lists the names most like it, as is
    /// one that is not before the camera.
    #[arg(long, value_name = "NODE", conflicts_with = "focus_distance", help_heading = LENS)]
    pub focus_on: Option<String>,
    /// Corners of the aperture, one of them at the top; 0: round [default: from the file, else round]
    ///
    /// From 3 to 64: a regular polygon with its corners on the circle of the lens' radius.
    #[arg(long, value_name = "N", value_parser = parse::aperture_blades, allow_hyphen_values = true)]
    #[arg(help_heading = LENS)]
    pub aperture_blades: Option<u32>,
    /// The longer side of the image on the sensor, millimetres [default: from the file, else 36]
    ///
    /// From 1e-3 to 1e6.
    #[arg(long, value_name = "MM", value_parser = parse::sensor, allow_hyphen_values = true, help_heading = LENS)]
    pub sensor: Option<f64>,

    /// Samples per pixel; the most, with a target or a time limit [default: 64; 2^20 with a target or a time limit]
    ///
    /// From 1 to 2^20.
    #[arg(short, long, value_name = "N", value_parser = parse::spp, help_heading = SAMPLING)]
    pub spp: Option<u32>,
    /// Stop when the error of the picture is at most E, such as 0.01 [default: off]
    ///
    /// When the upper end of the 95 % interval of the estimated relative error (sqrt of relMSE, below) is at most E,
    /// from 64 samples on; above 0 and at most 1. See "When sampling ends" below.
    #[arg(long, value_name = "E", value_parser = parse::target_error, allow_hyphen_values = true)]
    #[arg(help_heading = SAMPLING)]
    pub target_error: Option<f64>,
    /// Stop sampling an image after this time, such as 30s, 5m or 1h [default: off]
    ///
    /// Every image gets one sample per pixel at least; the JSON says how many it got, and with that --spp the same
    /// bytes come again.
    #[arg(long, value_name = "TIME", value_parser = parse::duration, allow_hyphen_values = true)]
    #[arg(help_heading = SAMPLING)]
    pub time_limit: Option<Duration>,
    /// Whether pixels may get different numbers of samples, with --target-error
    ///
    /// auto: where that is likely to save 30 % of the work, and without a limit of time; see "When sampling ends" below.
    /// off: every pixel has as many.
    #[arg(long, value_name = "WHEN", default_value = "auto", value_parser = parse::adaptive())]
    #[arg(help_heading = SAMPLING)]
    pub adaptive: parse::Adaptive,
    /// Same seed, same pixels
    #[arg(long, value_name = "N", default_value = "0", value_parser = parse::seed, help_heading = SAMPLING)]
    pub seed: u64,
    /// What is computed
    ///
    /// path: all light. direct: emitted and direct light, also in perfect mirrors and through clear glass. whitted: the
    /// same without chance, lamps being points. ao: the share of the hemisphere that is open. normal: shading normals, as
    /// 0.5 + 0.5 n. albedo: base colours. See "Integrators" below.
    #[arg(long, value_name = "NAME", default_value = "path", value_parser = parse::integrator())]
    #[arg(help_heading = SAMPLING)]
    pub integrator: Integrator,
    /// Scatterings after the first; 0 = emitted and direct light only [default: unlimited]
    ///
    /// Roulette ends paths; a safety cap of 1024, which is also the most that may be given. The share of paths cut
    /// goes to JSON and EXR (prt:truncated).
    #[arg(long, value_name = "N", value_parser = parse::max_bounces, help_heading = SAMPLING)]
    pub max_bounces: Option<u32>,
    /// Microfacet model
    ///
    /// full: energy-compensated, conserving, exact Fresnel reflectances. appendix-b: the single-scattering formulas of
    /// glTF 2.0 appendix B with height-correlated G, for comparison with other renderers.
    #[arg(long, value_name = "MODEL", default_value = "full", value_parser = parse::brdf())]
    #[arg(help_heading = SAMPLING)]
    pub brdf: Brdf,
    /// Pixel filter, :WIDTH = full support in pixels
    ///
    /// Sampled by importance. tent:2 is smallpt's; box is :1, gaussian (standard deviation WIDTH / 6) and blackman-harris :3.
    #[arg(long, value_name = "NAME[:WIDTH]", default_value = "tent:2", help_heading = SAMPLING)]
    #[arg(value_parser = parse::FilterParser, hide_possible_values = true)]
    pub filter: Filter,
    /// Ray backend
    ///
    /// auto: Embree if its library is found, else bvh, and it says which. linear: brute force, for tests.
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = parse::accel(), help_heading = SAMPLING)]
    pub accel: AccelChoice,
    /// Ray-cone level of detail (biased)
    ///
    /// Textures are averaged over what a pixel, or a scattered ray, sees of them: less noise at few samples, softer
    /// textures at any number. Emission and opacity are not.
    #[arg(long, help_heading = SAMPLING)]
    pub texture_lod: bool,
    /// Most nits that indirect light brings at once (biased); what it takes is reported [default: off]
    ///
    /// From 1e-6 to 1e12. Each contribution of light after two scatterings or more is scaled down until its largest
    /// channel is at most C; what the camera sees by itself and direct light on it are left alone. Ends fireflies, and
    /// darkens the picture: the share of its light that was taken is energy_clamped of the JSON.
    #[arg(long, value_name = "C", value_parser = parse::clamp, allow_hyphen_values = true, help_heading = SAMPLING)]
    pub clamp: Option<f32>,

    /// Built-in studio light
    ///
    /// auto: on when the file has no punctual and no image-based light, what of it emits more than 1 nit gives less
    /// than 0.02 lm per m^2 of all its surface, and less than half of its surface emits; figures and choice are logged
    /// and recorded. Of a scene that has an environment of its own, that one is used.
    #[arg(long, value_name = "WHEN", default_value = "auto", value_parser = parse::default_light())]
    #[arg(help_heading = LIGHT)]
    pub default_light: DefaultLight,
    /// Equirectangular environment; with it --default-light auto is off
    ///
    /// Radiance in nits, the centre column +X, columns going on towards +Z. It lights every input in place of an
    /// environment of its own, and is what the camera sees behind everything. A file that is no such picture is a usage
    /// error (2); infinite, negative and missing numbers in it are mended with a warning.
    #[arg(long, value_name = "FILE.hdr|.exr", help_heading = LIGHT, value_hint = ValueHint::FilePath)]
    pub env: Option<PathBuf>,
    /// Its rotation, counter-clockwise about +Y seen from above [default: 0]
    #[arg(long, value_name = "DEG", value_parser = parse::env_rotate, allow_hyphen_values = true)]
    #[arg(help_heading = LIGHT)]
    pub env_rotate: Option<f64>,
    /// Factor on its radiance [default: 1]
    ///
    /// From 0 to 1e9.
    #[arg(long, value_name = "S", value_parser = parse::env_scale, allow_hyphen_values = true, help_heading = LIGHT)]
    pub env_scale: Option<f64>,

    /// Point and spot lights are balls of this radius, metres
    ///
    /// What sees the whole ball gets as much light as without. From 1e-6 to 1e6, or 0 for no size. They hide nothing, what
    /// is inside a ball gets none of its light, and the camera does not show them; mirrors and glass do, in scenes of at
    /// most 256 lights with a place.
    #[arg(long, value_name = "METRES", default_value = "0", value_parser = parse::light_radius)]
    #[arg(allow_hyphen_values = true, help_heading = LIGHT)]
    pub light_radius: f64,
    /// Directional lights are suns of this angular diameter, degrees
    ///
    /// As --light-radius, in scenes of any number of lights; the sun is 0.53 wide. From 1e-4 to 180, or 0 for no size.
    #[arg(long, value_name = "DEG", default_value = "0", value_parser = parse::sun_angle)]
    #[arg(allow_hyphen_values = true, help_heading = LIGHT)]
    pub sun_angle: f64,

    /// Frames of each file's animation [default: the file as written, no animation]
    ///
    /// all, or numbers and ranges: 12, 1-24, 1-100x2 (every second one), 1,5,9. Frame f is at f / --fps seconds; before
    /// its first and after its last key each channel stays as it is there. all: from 0 to the frame at or after the last
    /// key. A picture for each, of the same scene, whose meshes and images are read once; a file without animation gives
    /// the same picture for each, with a warning. See "Animation" below.
    #[arg(long, value_name = "all|1-24|1-100x2|1,5,9", value_parser = parse::frames, allow_hyphen_values = true)]
    #[arg(help_heading = ANIMATION)]
    pub frames: Option<FrameChoice>,
    /// Frames a second [default: 24]
    ///
    /// From 0.001 to 1e6.
    #[arg(long, value_name = "N", value_parser = parse::fps, allow_hyphen_values = true, help_heading = ANIMATION)]
    pub fps: Option<f64>,
    /// Which of a file's animations: an index, a name or all [default: 0]
    ///
    /// all: all at once; where two of them move one thing, the first does. A file that has animations and not this one
    /// fails.
    #[arg(long, value_name = "INDEX|NAME|all", value_parser = parse::animation, help_heading = ANIMATION)]
    pub animation: Option<AnimationChoice>,
    /// Share of a frame that the shutter is open, from 0 to 1 [default: from the file, else 0]
    ///
    /// The file says it by prt_shutter in the extras of a camera or its node. What moves meanwhile is blurred.
    #[arg(long, value_name = "FRACTION", value_parser = parse::shutter, allow_hyphen_values = true)]
    #[arg(help_heading = ANIMATION)]
    pub shutter: Option<f64>,
    /// Where the open shutter lies: before, about or after the frame's time [default: center]
    ///
    /// start: it opens at the frame's time; end: it closes then.
    #[arg(long, value_name = "WHERE", value_parser = parse::shutter_position(), help_heading = ANIMATION)]
    pub shutter_position: Option<ShutterPosition>,

    /// Output name from {stem} {parent} {camera} {frame} [default: {stem}, with .{camera} if a file has several, with .{frame:04} if there are several]
    ///
    /// "/" in it makes sub-folders. {camera} is the camera's name made fit for a file (else its index), 0 for the one
    /// framed on the bounds. Without --name the same stem of another type in one folder adds its extension
    /// (cornell.obj.exr): of a.gltf, a.glb and a.obj the first that is there keeps the plain name. {frame} is the
    /// frame's number, 0 without --frames; {frame:04} has four digits at least.
    #[arg(long, value_name = "TEMPLATE", value_parser = parse::name, help_heading = FILES)]
    pub name: Option<NameTemplate>,
    /// Sample type of the EXR
    ///
    /// half clips at 65504 and the clipped pixels are counted.
    #[arg(long, value_name = "TYPE", default_value = "float", value_parser = parse::exr(), help_heading = FILES)]
    pub exr: ExrSamples,
    /// Compression of the EXR; all are lossless
    #[arg(long, value_name = "NAME", default_value = "zip", value_parser = parse::exr_compression())]
    #[arg(help_heading = FILES)]
    pub exr_compression: ExrCompression,
    /// EXR layers, separated by commas [default: none]
    ///
    /// variance: variance.R, .G, .B, the variance of the pixel's mean, on the safe side (float whatever --exr says).
    /// samples: how many samples are in it.
    #[arg(long, value_name = "LIST", value_parser = parse::AovParser, hide_possible_values = true)]
    #[arg(allow_hyphen_values = true, help_heading = FILES)]
    pub aov: Option<Layers>,
    /// Write no PNG
    #[arg(long, help_heading = FILES)]
    pub no_png: bool,
    /// Write no EXR
    #[arg(long, help_heading = FILES)]
    pub no_exr: bool,
    /// Files may be read below this folder [default: the input's folder]
    ///
    /// Instead of only below the input's own; the refusal of ../textures/x.png names this option.
    #[arg(long, value_name = "DIR", help_heading = FILES, value_hint = ValueHint::DirPath)]
    pub asset_root: Option<PathBuf>,

    /// Which axis of the OBJ points up
    #[arg(long, value_name = "AXIS", default_value = "y", value_parser = parse::obj_up(), help_heading = OBJ)]
    pub obj_up: ObjUp,
    /// Metres per unit of the OBJ [default: 1]
    ///
    /// From 1e-9 to 1e9.
    #[arg(long, value_name = "S", value_parser = parse::obj_scale, allow_hyphen_values = true, help_heading = OBJ)]
    pub obj_scale: Option<f64>,
    /// Edges of the OBJ below this angle are smooth [default: smoothing groups]
    ///
    /// Where the file gives no normals, in place of its smoothing groups. From 0 to 180 degrees.
    #[arg(long, value_name = "DEG", value_parser = parse::smooth_angle, allow_hyphen_values = true, help_heading = OBJ)]
    pub smooth_angle: Option<f32>,
}
