//! The command line as typed. A row here is a row in `docs/cli.md`.

use crate::parse::{self, ProgressStyle};
use clap::{Args, Parser, Subcommand};
use prt::batch::{job::CameraChoice, names::NameTemplate};
use prt::color::ToneCurve;
use prt::image::exr::ExrCompression;
use prt::load::obj::ObjUp;
use prt::render::{AccelChoice, Brdf, CropWindow, DefaultLight, Filter};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  prt-batch scenes/*.gltf --out renders/       every scene to EXR, PNG and JSON
  prt-batch scenes/ -o renders -s 256          every scene below a folder, 256 samples per pixel
  prt-batch a.glb --size 320x180 --spp 16      a quick look
  prt-batch a.glb --camera Main --crop 100,50,64,64
  prt-batch models/ --camera-from studio.gltf  every file as the cameras of another see it
  prt-batch a.glb --eye 3,2,5 --look-at 0,1,0  from a place of your own
  prt-batch scenes/*.gltf --json > result.json
  prt-batch compare renders/a.exr reference/a.exr --max-relmse 1e-3

Exit codes: 0 all rendered or empty; 1 some images failed; 2 usage; 3 every input was bad;
4 outputs cannot be written; 75 interrupted, finished images are kept.";

/// Path-traces glTF scenes on the CPU, in batches, to linear HDR EXR and tone-mapped PNG.
#[derive(Debug, Parser)]
#[command(version, about, after_help = EXAMPLES, args_conflicts_with_subcommands = true, max_term_width = 110)]
#[command(override_usage = "prt-batch [OPTIONS] INPUT...\n       prt-batch compare [OPTIONS] A... REF")]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub render: RenderArgs,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render (the same as without a command).
    Render(Box<RenderArgs>),
    /// Error metrics of pictures against a reference, of files or of folders.
    Compare(CompareArgs),
}

#[derive(Args, Debug)]
pub struct RenderArgs {
    /// `.gltf`, `.glb` and `.obj` files; a folder means every such file below it
    #[arg(value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,

    /// Where files go
    #[arg(short, long, value_name = "DIR", default_value = "renders")]
    pub out: PathBuf,
    /// Output name from {stem} {parent} {camera} [default: {stem}, with .{camera} if a file has several]
    #[arg(long, value_name = "TEMPLATE", value_parser = parse::name)]
    pub name: Option<NameTemplate>,

    /// Pixels, such as 1280x720
    #[arg(long, value_name = "WxH", value_parser = parse::size, allow_hyphen_values = true, conflicts_with = "width")]
    pub size: Option<(u32, u32)>,
    /// Pixels across; the height follows from the camera's aspect ratio, else 16:9 [default: 1280]
    #[arg(long, value_name = "W", value_parser = parse::width)]
    pub width: Option<u32>,
    /// Render that window only, origin top left, y down; its pixels equal those of the whole picture
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse::crop, allow_hyphen_values = true)]
    pub crop: Option<CropWindow>,
    /// Which cameras: all, an index or a name
    #[arg(long, value_name = "CAMERA", default_value = "all", value_parser = parse::camera)]
    pub camera: CameraChoice,
    /// Cameras of this glTF file's default scene, for every input and in place of its own
    #[arg(long, value_name = "FILE")]
    pub camera_from: Option<PathBuf>,
    /// A camera at this place, for every input and in place of its own; metres, needs --look-at
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    #[arg(requires = "look_at", conflicts_with_all = ["camera_from", "camera"])]
    pub eye: Option<[f64; 3]>,
    /// The point in the middle of the picture from --eye
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true, requires = "eye")]
    pub look_at: Option<[f64; 3]>,
    /// What points up in the picture from --eye [default: 0,1,0]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true, requires = "eye")]
    pub up: Option<[f64; 3]>,
    /// Vertical field of view from --eye, degrees [default: 40]
    #[arg(long, value_name = "DEG", value_parser = parse::yfov, requires = "eye")]
    pub yfov: Option<f64>,
    /// Which scene: an index or a name [default: the file's]
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<String>,

    /// Samples per pixel
    #[arg(short, long, value_name = "N", default_value = "64", value_parser = parse::spp)]
    pub spp: u32,
    /// Same seed, same pixels
    #[arg(long, value_name = "N", default_value = "0", value_parser = parse::seed)]
    pub seed: u64,
    /// What is computed: path
    #[arg(long, value_name = "NAME", default_value = "path", value_parser = parse::integrator)]
    pub integrator: &'static str,
    /// Scatterings after the first; 0 = emitted and direct light only [default: unlimited]
    #[arg(long, value_name = "N", value_parser = parse::max_bounces)]
    pub max_bounces: Option<u32>,
    /// Microfacet model: appendix-b
    #[arg(long, value_name = "MODEL", default_value = "appendix-b", value_parser = parse::brdf)]
    pub brdf: Brdf,
    /// Single-sided surfaces are invisible to camera rays from behind
    #[arg(long)]
    pub cull_backfaces: bool,
    /// Pixel filter: box or tent, :WIDTH = full support in pixels
    #[arg(long, value_name = "NAME[:WIDTH]", default_value = "tent:2", value_parser = parse::filter)]
    pub filter: Filter,
    /// Ray backend: auto, embree, bvh or linear (brute force, for tests)
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = parse::accel)]
    pub accel: AccelChoice,

    /// Built-in studio light: auto (where the file has no light and hardly emits any), on or off
    #[arg(long, value_name = "WHEN", default_value = "auto", value_parser = parse::default_light)]
    pub default_light: DefaultLight,

    /// Exposure of the PNG in stops
    #[arg(long, value_name = "EV", default_value = "0", value_parser = parse::exposure, allow_hyphen_values = true)]
    pub exposure: f64,
    /// Tone curve of the PNG: neutral or srgb
    #[arg(long, value_name = "CURVE", default_value = "neutral", value_parser = parse::tonemap)]
    pub tonemap: ToneCurve,
    /// Sample type of the EXR: float
    #[arg(long, value_name = "TYPE", default_value = "float", value_parser = parse::exr)]
    pub exr: &'static str,
    /// Compression of the EXR: zip, zips, piz, rle or none; all are lossless
    #[arg(long, value_name = "NAME", default_value = "zip", value_parser = parse::exr_compression)]
    pub exr_compression: ExrCompression,
    /// Write no PNG
    #[arg(long)]
    pub no_png: bool,
    /// Write no EXR
    #[arg(long)]
    pub no_exr: bool,
    /// Write no index.html (which is not built yet); JSON is always written
    #[arg(long)]
    pub no_report: bool,

    /// Files may be read below this folder instead of only below the input's own
    #[arg(long, value_name = "DIR")]
    pub asset_root: Option<PathBuf>,
    /// OBJ: which axis points up, y or z
    #[arg(long, value_name = "AXIS", default_value = "y", value_parser = parse::obj_up)]
    pub obj_up: ObjUp,
    /// OBJ: metres per unit [default: 1]
    #[arg(long, value_name = "S", value_parser = parse::obj_scale, allow_hyphen_values = true)]
    pub obj_scale: Option<f64>,
    /// OBJ: where the file gives no normals, edges below this angle are smooth [default: smoothing groups]
    #[arg(long, value_name = "DEG", value_parser = parse::smooth_angle, allow_hyphen_values = true)]
    pub smooth_angle: Option<f32>,
    /// Worker threads; they do not change a byte of a picture [default: the cores this process may use]
    #[arg(short, long, value_name = "N", value_parser = parse::threads)]
    pub threads: Option<usize>,
    /// Render even what is up to date (everything renders: keeping it is not built yet)
    #[arg(long)]
    pub force: bool,
    /// On stderr: auto (bars on a terminal, else plain), plain (at most one line a second), json or none
    #[arg(long, value_name = "STYLE", default_value = "auto", value_parser = parse::progress)]
    pub progress: ProgressStyle,
    /// Print the run's batch.json on stdout
    #[arg(long)]
    pub json: bool,
    /// Say more, about every image
    #[arg(short, long)]
    pub verbose: bool,
    /// Say only what went wrong
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,
}

#[derive(Args, Debug)]
pub struct CompareArgs {
    /// Pictures and, last, the reference: EXR files, or folders of them with the same names. Several pictures are
    /// renders of one scene with different seeds: their scatter is used for a block-wise test of equality
    #[arg(value_name = "A... REF", required = true, num_args = 2..)]
    pub pictures: Vec<PathBuf>,
    /// Fail above this relMSE
    #[arg(long, value_name = "X", value_parser = parse::limit)]
    pub max_relmse: Option<f64>,
    /// Fail where a channel's mean differs by more than this many per cent
    #[arg(long, value_name = "PERCENT", value_parser = parse::limit)]
    pub max_bias: Option<f64>,
    /// The reference's own relative standard error per pixel (rms), such as 0.02
    #[arg(long, value_name = "X", value_parser = parse::limit)]
    pub ref_rel_se: Option<f64>,
    /// The same from the field `rel_se` of object KEY in a JSON file
    #[arg(long, value_name = "FILE:KEY", conflicts_with = "ref_rel_se")]
    pub ref_stats: Option<String>,
    /// Print the result as JSON on stdout
    #[arg(long)]
    pub json: bool,
}
