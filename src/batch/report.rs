//! What happened, as JSON: one document per image and `batch.json` for the run. A field whose feature is not built is
//! null, never a made-up number. Field names and their order are the contract of `docs/cli.md`.

use super::fingerprint::Fingerprint;
use crate::camera::ThinLens;
use crate::color::Exposure;
use crate::render::LensReport;
use crate::scene::Skipped;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How an image ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Its files are written.
    Rendered,
    /// Its files were there already.
    UpToDate,
    /// Nothing to draw: no picture, no failure.
    Empty,
    /// No picture; `error_message` says why.
    #[default]
    Failed,
    /// The run was stopped before it was done.
    Interrupted,
}

impl Status {
    /// Every status.
    pub const ALL: [Self; 5] = [Self::Rendered, Self::UpToDate, Self::Empty, Self::Failed, Self::Interrupted];

    /// As users read it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Rendered => "rendered",
            Self::UpToDate => "up to date",
            Self::Empty => "empty",
            Self::Failed => "failed",
            Self::Interrupted => "interrupted",
        }
    }
}

/// One image. Paths as the user would type them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct ImageReport {
    pub input: String,
    pub scene: Option<usize>,
    pub camera: Option<String>,
    pub frame: Option<u32>,
    pub status: Status,
    pub error_message: Option<String>,
    pub outputs: Outputs,
    pub width: Option<u32>,
    pub height: Option<u32>,
    pub spp: u32,
    pub seed: u64,
    /// What was computed: `path`, `direct`, `whitted`, `ao`, `normal`, `albedo`.
    pub integrator: Option<String>,
    pub accel: Accel,
    pub seconds: Seconds,
    pub rays: Option<Rays>,
    pub mrays_per_s: Option<f64>,
    /// Null with fewer than four samples a pixel, and for black pictures.
    pub estimated_error: Option<EstimatedError>,
    /// What ended sampling: `spp`, `target-error`, `time-limit`, `batch-time-limit`.
    pub stopped_by: Option<String>,
    /// Null without `--target-error`.
    pub target_error: Option<TargetError>,
    /// Null where every pixel has as many samples.
    pub adaptive: Option<Adaptive>,
    /// Null where `estimated_error` is.
    pub worst_tile: Option<WorstTile>,
    pub non_finite_samples: Option<u64>,
    pub truncated: Option<f64>,
    /// Share of the picture's light that `--clamp` took; 0 without it.
    pub energy_clamped: Option<f64>,
    /// Null where the EXR's samples clip nothing.
    pub clipped_pixels: Option<u64>,
    /// Null without a PNG.
    pub exposure: Option<ExposureReport>,
    pub peak_rss_bytes: Option<u64>,
    pub triangles: Option<u64>,
    pub instances: Option<u64>,
    pub placed_instances: Option<u64>,
    pub lights: Option<u64>,
    pub default_light: Option<DefaultLight>,
    /// Null for a pinhole.
    pub lens: Option<Lens>,
    pub features: BTreeMap<String, bool>,
    pub skipped: Vec<Skipped>,
    pub warnings: Vec<String>,
    /// Those of `warnings` that mean that something of the file is not in the picture: `--strict` fails on them.
    pub losses: Vec<String>,
    /// What it was made from; `None`: that is not known, and it will not be taken for up to date.
    pub fingerprint: Option<Fingerprint>,
    /// Why it was not taken for up to date; said to the user who asks for details, not part of the JSON.
    #[serde(skip)]
    pub why: String,
    /// Why `auto` did not take Embree; said to the user once, not part of the JSON.
    #[serde(skip)]
    pub accel_note: String,
    /// Said to the user, no cause for concern, not part of the JSON.
    #[serde(skip)]
    pub notes: Vec<String>,
}

impl ImageReport {
    /// What `--strict` takes for a failure, although the image is none; empty for one that failed anyway.
    pub fn strict_failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        if self.status == Status::Empty {
            failures.push("the scene is empty".into());
        }
        if let Some(count) = self.non_finite_samples.filter(|count| *count > 0) {
            failures.push(format!("{count} samples were not finite and were dropped"));
        }
        if let Some(missed) = self.target_error.as_ref().filter(|target| !target.met) {
            failures.push(format!("--target-error {} was not reached", missed.target));
        }
        failures.extend(self.losses.iter().cloned());
        failures
    }
}

/// Files written; null where none was.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Outputs {
    pub exr: Option<String>,
    pub png: Option<String>,
    pub json: Option<String>,
}

/// The ray backend; null where it was not chosen or has no such property.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Accel {
    pub requested: String,
    pub used: Option<String>,
    pub version: Option<String>,
    pub isa: Option<String>,
}

/// How far the picture is from that of endless samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct EstimatedError {
    pub metric: String,
    pub value: f64,
    pub ci95: [f64; 2],
}

impl EstimatedError {
    /// Such as `1.3 %`.
    pub fn percent(&self) -> String {
        percent(self.value)
    }
}

/// Such as `1.3 %`, of an error: two digits are more than its interval says.
pub fn percent(error: f64) -> String {
    let percent = 100.0 * error;
    let decimals = (1.0 - percent.log10().floor()).clamp(0.0, 6.0);
    format!("{percent:.*} %", if decimals.is_finite() { decimals as usize } else { 0 })
}

/// What came of `--target-error`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct TargetError {
    pub target: f64,
    pub met: bool,
    /// Share of the pixels; null for black pictures.
    pub pixels_above: Option<f64>,
}

/// Samples that are not as many in every pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Adaptive {
    pub stage: u32,
    pub least: u32,
    pub most: u32,
    pub gain: f64,
}

/// The part of the picture that is worst off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct WorstTile {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
    pub error: f64,
}

/// The built-in studio light and why it is on or off.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct DefaultLight {
    pub requested: String,
    pub used: bool,
    pub emitted_lm_per_m2: f64,
    pub glowing_share: f64,
}

/// The lens of the camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Lens {
    pub f_stop: f64,
    pub focal_length_mm: f64,
    pub aperture_radius_m: f64,
    /// Null: infinitely far.
    pub focus_distance_m: Option<f64>,
    /// Nobody said how far: it is the first surface in the picture's centre.
    pub focus_found: bool,
    /// 0: round.
    pub blades: u32,
}

impl From<LensReport> for Lens {
    fn from(LensReport { thin, is_found }: LensReport) -> Self {
        let ThinLens { radius, focus_distance, blades, f_stop, focal_length } = thin;
        Self {
            f_stop,
            focal_length_mm: 1e3 * focal_length,
            aperture_radius_m: radius,
            focus_distance_m: Some(focus_distance).filter(|distance| distance.is_finite()),
            focus_found: is_found,
            blades,
        }
    }
}

/// The exposure of the PNG.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct ExposureReport {
    pub requested: RequestedExposure,
    pub used: f64,
}

/// Stops, or `auto`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
#[expect(missing_docs, reason = "the variants are the JSON's, described in docs/cli.md")]
pub enum RequestedExposure {
    Stops(f64),
    Word(String),
}

impl ExposureReport {
    /// What was asked for and the stops that it became.
    pub fn new(requested: Exposure, used: f64) -> Self {
        let requested = match requested {
            Exposure::Stops(stops) => RequestedExposure::Stops(stops),
            Exposure::Auto => RequestedExposure::Word("auto".into()),
        };
        Self { requested, used }
    }
}

/// Wall seconds of the image's own work; null where it did not come to that.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Seconds {
    pub load: Option<f64>,
    pub decode: Option<f64>,
    pub build: Option<f64>,
    pub render: Option<f64>,
    pub write: Option<f64>,
    pub total: f64,
}

/// Rays traced.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Rays {
    pub camera: u64,
    pub bounce: u64,
    pub shadow: u64,
    pub total: u64,
}

/// The whole run: `batch.json`.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct BatchReport {
    pub prt: &'static str,
    pub command: String,
    /// UTC, ISO 8601.
    pub started: String,
    pub seconds: f64,
    pub host: Host,
    /// Of the first image that chose a backend, else as requested.
    pub accel: Accel,
    /// Every status, zero or not.
    pub counts: BTreeMap<Status, usize>,
    pub images: Vec<ImageReport>,
}

/// The machine.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Host {
    pub cpu: Option<String>,
    pub threads: usize,
}

/// Indented JSON with a final newline.
pub fn to_json(report: &impl Serialize) -> String {
    let mut json = serde_json::to_string_pretty(report).expect("reports have string keys and finite numbers");
    json.push('\n');
    json
}

/// High-water mark of the process's resident memory, bytes; `None` where the system does not tell.
pub fn peak_rss_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// Name of the processor; `None` where the system does not tell.
pub fn cpu_name() -> Option<String> {
    let info = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = info.lines().find_map(|line| line.strip_prefix("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// How long something took, such as `12 ms`, `3.1 s`, `2 min 00 s`, `1 h 05 min`.
pub fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 0.0995 => format!("{:.0} ms", s * 1e3),
        s if s < 99.95 => format!("{s:.1} s"),
        s => {
            let whole = s.round() as u64;
            let (hours, minutes, seconds) = (whole / 3600, whole / 60 % 60, whole % 60);
            if hours > 0 { format!("{hours} h {minutes:02} min") } else { format!("{minutes} min {seconds:02} s") }
        }
    }
}

/// A time as `2026-01-31T23:59:59Z`.
pub fn utc(time: std::time::SystemTime) -> String {
    let seconds = time.duration_since(std::time::UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let (days, second) = ((seconds / 86_400) as i64, seconds % 86_400);
    // After Howard Hinnant, "chrono-Compatible Low-Level Date Algorithms", civil_from_days, for days >= 0.
    let z = days + 719_468;
    let (era, day_of_era) = (z / 146_097, z % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    let (hour, minute) = (second / 3600, second / 60 % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{:02}Z", second % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, UNIX_EPOCH};

    #[test]
    fn times_are_civil_utc() {
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (1_704_067_200, "2024-01-01T00:00:00Z"),
            (1_767_225_599, "2025-12-31T23:59:59Z"),
        ] {
            assert_eq!(utc(UNIX_EPOCH + Duration::from_secs(seconds)), text);
        }
    }

    #[test]
    fn statuses_are_written_as_in_the_contract() {
        let names = Status::ALL.map(|s| serde_json::to_value(s).unwrap().as_str().unwrap().to_owned());
        assert_eq!(names, ["rendered", "up-to-date", "empty", "failed", "interrupted"]);
    }

    #[test]
    fn exposures_are_a_number_or_auto_and_read_back() {
        for (requested, json) in [
            (Exposure::Stops(-1.5), r#"{"requested":-1.5,"used":2.0}"#),
            (Exposure::Auto, r#"{"requested":"auto","used":2.0}"#),
        ] {
            let report = ExposureReport::new(requested, 2.0);
            assert_eq!(serde_json::to_string(&report).unwrap(), json);
            assert_eq!(serde_json::from_str::<ExposureReport>(json).unwrap(), report);
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn peak_memory_is_plausible() {
        assert!((1 << 20..1 << 40).contains(&peak_rss_bytes().unwrap()));
    }
}
