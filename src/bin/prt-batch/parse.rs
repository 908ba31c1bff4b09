//! Values of options: what is allowed, and what is of the contract but not built.

use crate::args::What;
use crate::generate::Product;
use crate::words::Words;
use clap::builder::{PossibleValue, TypedValueParser};
use prt::batch::{FrameChoice, job::CameraChoice, memory::MemoryLimit, names::NameTemplate};
use prt::camera::Lens;
use prt::color::{Exposure, ToneCurve};
use prt::image::exr::{ExrCompression, ExrSamples};
use prt::load::obj::ObjUp;
use prt::load::{AnimationChoice, ShutterPosition};
use prt::render::{AccelChoice, Brdf, CropWindow, DefaultLight, Filter, FilterShape, Integrator, Layers};
use prt::verify::contenders::Backend;
use std::ffi::OsStr;
use std::str::FromStr;
use std::time::Duration;

/// Most pixels along one side.
const MAX_SIDE: u32 = prt::batch::MAX_SIDE;
/// Most samples per pixel: 2^20, where the sampler's sequences end.
pub const MAX_SPP: u32 = 1 << 20;

/// A whole number from `least` to `most`.
fn number<T: FromStr + PartialOrd + std::fmt::Display>(value: &str, least: T, most: T) -> Result<T, String> {
    let inside = |n: &T| *n >= least && *n <= most;
    value.parse().ok().filter(inside).ok_or_else(|| format!("must be a whole number from {least} to {most}"))
}

pub fn size(value: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| number(text, 1, MAX_SIDE).ok();
    let sides = |value: &str, x: char| value.split_once(x).and_then(|(w, h)| Some((side(w.trim())?, side(h.trim())?)));
    sides(value, 'x').filter(|_| !value.contains(' ')).ok_or_else(|| {
        let meant = ['x', 'X', '*', ',', ':', '\u{d7}'].iter().find_map(|x| sides(value, *x));
        let meant = meant.map(|(width, height)| format!("; did you mean {width}x{height}?"));
        let allowed = format!("must be WIDTHxHEIGHT, such as 1280x720, each from 1 to {MAX_SIDE}");
        allowed + &meant.unwrap_or_default()
    })
}

pub fn width(value: &str) -> Result<u32, String> {
    number(value, 1, MAX_SIDE)
}

pub fn crop(value: &str) -> Result<CropWindow, String> {
    let wrong =
        || "must be X,Y,WIDTH,HEIGHT in whole pixels, such as 100,50,64,64, WIDTH and HEIGHT at least 1".to_owned();
    let numbers: Result<Vec<u32>, _> = value.split(',').map(str::parse).collect();
    match numbers.as_deref() {
        Ok(&[x, y, width, height]) if width > 0 && height > 0 => Ok(CropWindow { x, y, width, height }),
        _ => Err(wrong()),
    }
}

pub fn camera(value: &str) -> Result<CameraChoice, String> {
    Ok(match (value, value.parse()) {
        ("", _) => return Err("must be all, an index or a name".into()),
        ("all", _) => CameraChoice::All,
        (_, Ok(index)) => CameraChoice::Index(index),
        (name, Err(_)) => CameraChoice::Name(name.into()),
    })
}

/// Three numbers in a range where their squares' sums stay numbers in the renderer's 32 bits.
pub fn vector(value: &str) -> Result<[f64; 3], String> {
    const MOST: f64 = 1e18;
    let inside = |n: &f64| n.abs() <= MOST;
    let numbers: Option<Vec<f64>> = value.split(',').map(|n| n.trim().parse().ok().filter(inside)).collect();
    numbers
        .and_then(|n| n.try_into().ok())
        .ok_or_else(|| format!("must be X,Y,Z: three numbers from -{MOST:e} to {MOST:e}, such as 3,2.5,-1"))
}

pub fn yfov(value: &str) -> Result<f64, String> {
    let inside = |degrees: &f64| *degrees > 0.0 && *degrees < 180.0;
    value.parse().ok().filter(inside).ok_or_else(|| "must be degrees above 0 and below 180".into())
}

pub fn env_rotate(value: &str) -> Result<f64, String> {
    let inside = |degrees: &f64| degrees.abs() <= 1e6;
    value.parse().ok().filter(inside).ok_or_else(|| "must be degrees, such as 90, from -1e6 to 1e6".into())
}

pub fn env_scale(value: &str) -> Result<f64, String> {
    let inside = |scale: &f64| (0.0..=1e9).contains(scale);
    value.parse().ok().filter(inside).ok_or_else(|| "must be a factor from 0 to 1e9".into())
}

/// Metres, so that squares of them stay numbers in the renderer's 32 bits.
pub fn light_radius(value: &str) -> Result<f64, String> {
    let inside = |metres: &f64| *metres == 0.0 || (1e-6..=1e6).contains(metres);
    value.parse().ok().filter(inside).ok_or_else(|| "must be metres from 1e-6 to 1e6, or 0 for no size".into())
}

pub fn sun_angle(value: &str) -> Result<f64, String> {
    let inside = |degrees: &f64| *degrees == 0.0 || (1e-4..=180.0).contains(degrees);
    value.parse().ok().filter(inside).ok_or_else(|| "must be degrees from 1e-4 to 180, or 0 for no size".into())
}

/// Nits.
pub fn clamp(value: &str) -> Result<f32, String> {
    let inside = |most: &f32| (1e-6..=1e12).contains(most);
    value.parse().ok().filter(inside).ok_or_else(|| {
        "must be nits from 1e-6 to 1e12, such as 10; without indirect light at all: --max-bounces 0".into()
    })
}

pub fn frames(value: &str) -> Result<FrameChoice, String> {
    value.parse()
}

pub fn fps(value: &str) -> Result<f64, String> {
    let inside = |fps: &f64| (0.001..=1e6).contains(fps);
    value.parse().ok().filter(inside).ok_or_else(|| "must be frames a second from 0.001 to 1e6, such as 24".into())
}

pub fn animation(value: &str) -> Result<AnimationChoice, String> {
    Ok(match (value, value.parse()) {
        ("", _) => return Err("must be an index, a name or all".into()),
        ("all", _) => AnimationChoice::All,
        (_, Ok(index)) => AnimationChoice::Index(index),
        (name, Err(_)) => AnimationChoice::Name(name.into()),
    })
}

/// Share of a frame.
pub fn shutter(value: &str) -> Result<f64, String> {
    let inside = |share: &f64| (0.0..=1.0).contains(share);
    let number = |text: &str| text.trim().parse::<f64>().ok();
    number(value).filter(inside).ok_or_else(|| {
        let degrees = number(value).filter(|degrees| *degrees > 1.0 && *degrees <= 360.0);
        let meant = degrees.map_or_else(String::new, |d| format!("; {d} degrees are {:.4}", d / 360.0));
        format!("must be a share of a frame from 0 to 1, such as 0.5{meant}")
    })
}

pub fn shutter_position() -> Words<ShutterPosition> {
    use ShutterPosition::{Center, End, Start};
    Words::new(&[("start", Start), ("center", Center), ("end", End)], &[])
}

pub fn spp(value: &str) -> Result<u32, String> {
    number(value, 1, MAX_SPP)
}

/// An error, as a share.
pub fn target_error(value: &str) -> Result<f64, String> {
    let inside = |error: &f64| *error > 0.0 && *error <= 1.0;
    let number = |text: &str| text.trim().parse::<f64>().ok();
    number(value).filter(inside).ok_or_else(|| {
        let percent = value.strip_suffix('%').and_then(number).map(|percent| percent / 100.0).filter(inside);
        let meant = percent.map_or_else(String::new, |share| format!("; did you mean {share}?"));
        format!("must be a number above 0 and at most 1, such as 0.01 for 1 %{meant}")
    })
}

/// A time, above 0 and at most a year.
pub fn duration(value: &str) -> Result<Duration, String> {
    const MOST: f64 = 365.0 * 86_400.0;
    const UNITS: [(char, f64); 3] = [('s', 1.0), ('m', 60.0), ('h', 3600.0)];
    let plain = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    let number = |text: &str| text.parse::<f64>().ok().filter(|_| plain(text));
    let inside = |seconds: &f64| *seconds >= 0.001 && *seconds <= MOST;
    let found = UNITS.iter().find_map(|(unit, seconds)| Some(number(value.strip_suffix(*unit)?)? * seconds));
    found.filter(inside).map(Duration::from_secs_f64).ok_or_else(|| {
        let seconds = number(value).filter(inside).map_or_else(String::new, |_| format!("; did you mean {value}s?"));
        format!("must be a time such as 30s, 5m, 1h or 0.5s, from 0.001s to 8760h{seconds}")
    })
}

const AOVS: Words<Layers> = Words::new(
    &[("variance", Layers { variance: true, samples: false }), ("samples", Layers { variance: false, samples: true })],
    &["albedo", "normal", "depth", "position", "uv", "object-id", "material-id", "cryptomatte"],
);

fn aov(value: &str) -> Result<Layers, String> {
    value.split(',').try_fold(Layers::default(), |all, word| {
        let Layers { variance, samples } = AOVS.find(word.trim())?;
        Ok(Layers { variance: all.variance || variance, samples: all.samples || samples })
    })
}

/// Words of layers with commas between.
#[derive(Clone)]
pub struct AovParser;

impl TypedValueParser for AovParser {
    type Value = Layers;

    fn parse_ref(&self, cmd: &clap::Command, arg: Option<&clap::Arg>, value: &OsStr) -> Result<Layers, clap::Error> {
        aov.parse_ref(cmd, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(AOVS.possible_values().into_iter()))
    }
}

pub fn seed(value: &str) -> Result<u64, String> {
    number(value, 0, u64::MAX)
}

pub fn max_bounces(value: &str) -> Result<u32, String> {
    number(value, 0, prt::render::RenderSettings::BOUNCE_CAP)
}

pub fn memory(value: &str) -> Result<MemoryLimit, String> {
    value.parse()
}

pub fn threads(value: &str) -> Result<usize, String> {
    number(value, 1, 4096)
}

/// Shapes by their names, each with the width that it has if nothing is said.
const FILTERS: Words<(FilterShape, f32)> = {
    const NAMES: [(&str, (FilterShape, f32)); FilterShape::NAMES.len()] = {
        let mut names = [("", (FilterShape::Box, 0.0)); FilterShape::NAMES.len()];
        let mut i = 0;
        while i < names.len() {
            let (name, shape, width) = FilterShape::NAMES[i];
            names[i] = (name, (shape, width));
            i += 1;
        }
        names
    };
    Words::new(&NAMES, &[])
};

fn filter(value: &str) -> Result<Filter, String> {
    const MAX_WIDTH: f32 = 64.0;
    let (name, width) = value.split_once(':').map_or((value, None), |(name, width)| (name, Some(width)));
    let width = |default: f32| {
        let inside = |w: &f32| *w > 0.0 && *w <= MAX_WIDTH;
        let parse = |w: &str| {
            w.parse().ok().filter(inside).ok_or_else(|| format!("WIDTH must be above 0 and at most {MAX_WIDTH} pixels"))
        };
        width.map_or(Ok(default), parse)
    };
    let (shape, usual) = FILTERS.find(name)?;
    Ok(Filter { shape, width: width(usual)? })
}

/// The word of a pixel filter, with or without a width behind it.
#[derive(Clone)]
pub struct FilterParser;

impl TypedValueParser for FilterParser {
    type Value = Filter;

    fn parse_ref(&self, cmd: &clap::Command, arg: Option<&clap::Arg>, value: &OsStr) -> Result<Filter, clap::Error> {
        filter.parse_ref(cmd, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(FILTERS.possible_values().into_iter()))
    }
}

pub fn accel() -> Words<AccelChoice> {
    use AccelChoice::{Auto, Bvh, Embree, Linear};
    Words::new(&[("auto", Auto), ("embree", Embree), ("bvh", Bvh), ("linear", Linear)], &[])
}

pub fn default_light() -> Words<DefaultLight> {
    use DefaultLight::{Auto, Off, On};
    Words::new(&[("auto", Auto), ("on", On), ("off", Off)], &[])
}

/// When samples may be spread unevenly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adaptive {
    Auto,
    Off,
}

pub fn adaptive() -> Words<Adaptive> {
    Words::new(&[("auto", Adaptive::Auto), ("off", Adaptive::Off)], &[])
}

pub fn brdf() -> Words<Brdf> {
    Words::new(&[("full", Brdf::Full), ("appendix-b", Brdf::AppendixB)], &[])
}

pub fn integrator() -> Words<Integrator> {
    Words::new(&Integrator::NAMES, &[])
}

pub fn f_stop(value: &str) -> Result<f64, String> {
    let [least, most] = Lens::F_STOPS;
    let inside = |n: &f64| (least..=most).contains(n) || *n == f64::INFINITY;
    let wrong = || format!("must be an f-number from {least} to {most}, such as 2.8, or inf for a pinhole");
    value.parse().ok().filter(inside).ok_or_else(wrong)
}

pub fn focus_distance(value: &str) -> Result<f64, String> {
    let [least, most] = Lens::DISTANCES;
    let inside = |n: &f64| (least..=most).contains(n) || *n == f64::INFINITY;
    let wrong = || format!("must be metres from {least} to {most:e}, or inf");
    value.parse().ok().filter(inside).ok_or_else(wrong)
}

pub fn aperture_blades(value: &str) -> Result<u32, String> {
    let [least, most] = Lens::BLADES;
    if value == "0" { Ok(0) } else { number(value, least, most).map_err(|allowed| allowed + ", or 0: round") }
}

pub fn sensor(value: &str) -> Result<f64, String> {
    let [least, most] = Lens::SENSORS;
    let inside = |n: &f64| (least..=most).contains(n);
    value.parse().ok().filter(inside).ok_or_else(|| format!("must be millimetres from {least} to {most}, such as 36"))
}

pub fn exposure(value: &str) -> Result<Exposure, String> {
    if value == "auto" {
        return Ok(Exposure::Auto);
    }
    let inside = |stops: &f64| (-100.0..=100.0).contains(stops);
    let stops = value.parse().ok().filter(inside).map(Exposure::Stops);
    stops.ok_or_else(|| "must be auto or a number of stops from -100 to 100".into())
}

pub fn tonemap() -> Words<ToneCurve> {
    Words::new(&ToneCurve::NAMES, &[])
}

pub fn exr() -> Words<ExrSamples> {
    Words::new(&[("float", ExrSamples::Float), ("half", ExrSamples::Half)], &[])
}

pub fn exr_compression() -> Words<ExrCompression> {
    use ExrCompression::{None, Piz, Rle, Zip, Zips};
    Words::new(&[("zip", Zip), ("zips", Zips), ("piz", Piz), ("rle", Rle), ("none", None)], &[])
}

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProgressStyle {
    Auto,
    Plain,
    Json,
    None,
}

pub fn progress() -> Words<ProgressStyle> {
    use ProgressStyle::{Auto, Json, None, Plain};
    Words::new(&[("auto", Auto), ("plain", Plain), ("json", Json), ("none", None)], &[])
}

pub fn name(value: &str) -> Result<NameTemplate, String> {
    NameTemplate::parse(value)
}

pub fn obj_up() -> Words<ObjUp> {
    Words::new(&[("y", ObjUp::Y), ("z", ObjUp::Z)], &[])
}

pub fn obj_scale(value: &str) -> Result<f64, String> {
    let inside = |scale: &f64| (1e-9..=1e9).contains(scale);
    value.parse().ok().filter(inside).ok_or_else(|| "must be a number of metres per unit from 1e-9 to 1e9".into())
}

pub fn smooth_angle(value: &str) -> Result<f32, String> {
    let inside = |angle: &f32| (0.0..=180.0).contains(angle);
    value.parse().ok().filter(inside).ok_or_else(|| "must be a number of degrees from 0 to 180".into())
}

/// A number above 0, or 0.
pub fn limit(value: &str) -> Result<f64, String> {
    let inside = |n: &f64| n.is_finite() && *n >= 0.0;
    value.parse().ok().filter(inside).ok_or_else(|| "must be a number, 0 or more".into())
}

/// A backend that can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BenchBackend {
    Bvh,
    Embree,
    Linear,
}

pub fn bench_backend() -> Words<BenchBackend> {
    use BenchBackend::{Bvh, Embree, Linear};
    Words::new(&[("bvh", Bvh), ("embree", Embree), ("linear", Linear)], &[])
}

pub fn bench_rays(value: &str) -> Result<usize, String> {
    number(value, 1, 1 << 26)
}

pub fn bench_rounds(value: &str) -> Result<usize, String> {
    number(value, 1, 1000)
}

pub fn verify() -> Words<What> {
    const BUILT: [(&str, What); 4] =
        [("hits", What::Hits), ("materials", What::Materials), ("light", What::Light), ("shapes", What::Shapes)];
    Words::new(&BUILT, &["lens", "output"])
}

pub fn backend() -> Words<Backend> {
    Words::new(&[("bvh", Backend::Bvh), ("embree", Backend::Embree), ("linear", Backend::Linear)], &[])
}

/// Rays of each kind at each mesh.
pub fn rays(value: &str) -> Result<usize, String> {
    number(value, 1, 100_000_000)
}

/// Samples of each chi-square test; fewer fill no histogram.
pub fn samples(value: &str) -> Result<usize, String> {
    number(value, 1000, 100_000_000)
}

pub fn generate() -> Words<Product> {
    Words::new(Product::NAMES, &[])
}
