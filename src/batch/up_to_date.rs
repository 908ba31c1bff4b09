//! Whether an image's files are what a run would write: then there is no need to render it.
//!
//! Everything is decided by contents. The JSON of the last run says which files the image was made from; each is found
//! again by its name, as the loader would find it, and hashed. A record that does not fit, whatever the reason, means
//! that the image is rendered; it is never an error.

use super::content::{Content, HashCache, InputRecord};
use super::fingerprint::{
    Fingerprint, OutputRecord, Settings, StoppingRecord, Wanted, file_settings, hash_files, hash_pixels,
};
use super::picture::FileOptions;
use super::report::{ImageReport, Status};
use super::settings::FileSettings;
use crate::load::{Folders, LoadOptions};
use crate::scene::Stamp;
use std::fmt;
use std::path::{Path, PathBuf};

/// A longer file is no record of ours.
const MOST_BYTES: u64 = 64 << 20;

/// An image whose files are up to date.
#[derive(Clone, Debug)]
pub struct Kept {
    /// As the run that rendered it wrote it; its paths are those of then.
    pub report: ImageReport,
    /// The picture files that are asked for, in the order EXR, PNG.
    pub outputs: Vec<PathBuf>,
}

/// Why an image is to be rendered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Why {
    /// There is no JSON.
    New,
    /// Its JSON is not one that this program writes.
    NoRecord(PathBuf),
    /// The last run wrote no picture.
    NotRendered(Status),
    /// The last run did not record what it was made from, perhaps because that changed while it was read.
    NoFingerprint,
    /// By another version.
    Version {
        /// The one that wrote it.
        then: String,
    },
    /// Something else was asked for; `None`: it did not matter.
    Setting {
        /// Name of the option.
        key: String,
        /// Then.
        then: Option<String>,
        /// Now.
        now: Option<String>,
    },
    /// A file that it was made from is not what it was.
    Input {
        /// As the input names it, or the input itself.
        file: String,
        /// What has become of it.
        how: Change,
    },
    /// A file that is asked for is not whole.
    Output {
        /// Which.
        path: PathBuf,
        /// What has become of it.
        how: Change,
    },
    /// A file that is asked for was not asked for then.
    NotWritten {
        /// Its extension.
        kind: &'static str,
    },
    /// The record's hashes are not those of what it lists.
    Inconsistent(PathBuf),
}

/// What has become of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Other bytes.
    Changed,
    /// It is gone, or may not be read.
    Missing,
    /// It was not there.
    Appeared,
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::New => write!(f, "not rendered before"),
            Self::NoRecord(path) => write!(f, "{} is not a record that this version writes", path.display()),
            Self::NotRendered(status) => write!(
                f,
                "{}",
                match status {
                    Status::Empty => "there was nothing to draw the last time",
                    Status::Interrupted => "the last run was interrupted",
                    _ => "the last run failed",
                }
            ),
            Self::NoFingerprint => write!(f, "the last run could not record what it was made from"),
            Self::Version { then } => write!(f, "rendered by version {then}"),
            Self::Setting { key, then, now } => {
                let show = |value: &Option<String>| value.clone().unwrap_or_else(|| "none".into());
                write!(f, "settings changed: {key} {} -> {}", show(then), show(now))
            }
            Self::Input { file, how } => write!(f, "{file} {how}"),
            Self::Output { path, how: Change::Missing } => write!(f, "{} is missing", path.display()),
            Self::Output { path, .. } => write!(f, "{} is damaged or was edited", path.display()),
            Self::NotWritten { kind } => write!(f, "no {kind} was asked for the last time"),
            Self::Inconsistent(path) => write!(f, "{} contradicts itself", path.display()),
        }
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Changed => "changed",
            Self::Missing => "is missing",
            Self::Appeared => "was not there before",
        })
    }
}

/// Whether the files beside `json`, the JSON of an earlier run, are those that `wanted` would give. Reads the files that
/// it was made from, and its pictures; not the scene.
///
/// # Errors
/// They are not.
pub fn check(json: &Path, wanted: &Wanted, cache: &HashCache) -> Result<Kept, Why> {
    let no_record = |_| Why::NoRecord(json.to_owned());
    let report: ImageReport = serde_json::from_slice(&read(json)?).map_err(no_record)?;
    if !matches!(report.status, Status::Rendered | Status::UpToDate) {
        return Err(Why::NotRendered(report.status));
    }
    let then = report.fingerprint.as_ref().ok_or(Why::NoFingerprint)?;
    if then.prt != crate::VERSION {
        return Err(Why::Version { then: then.prt.clone() });
    }
    // From cheap to dear: most of what is not up to date is found without reading a file.
    let FileSettings { files, load, render, .. } = wanted.settings;
    let wanted_kinds = [("exr", files.exr), ("png", files.png)];
    let kinds = wanted_kinds.into_iter().filter_map(|(kind, is_wanted)| is_wanted.then_some(kind));
    let not_written = kinds.clone().find(|kind| !then.has_output(kind));
    if let Some(kind) = not_written {
        return Err(Why::NotWritten { kind });
    }
    // Files that are there and not asked for now do no harm.
    let files = FileOptions { exr: then.has_output("exr"), png: then.has_output("png"), ..*files };
    // What was reached; nobody asks for none.
    let spp = then.settings.get("spp").and_then(|spp| spp.parse().ok()).unwrap_or(0);
    check_stopping(spp, &report, then, wanted)?;
    let adaptive = then.settings.get("adaptive").map(String::as_str);
    let (pixel_settings, file_settings) = (wanted.pixel_settings(spp, adaptive), file_settings(&files, render.layers));
    compare(&then.settings, &pixel_settings, &file_settings)?;
    let outputs: Vec<_> = kinds.map(|kind| json.with_extension(kind)).collect();
    let record = |path: &Path| then.outputs.iter().find(|o| path.extension().is_some_and(|e| *e == *o.kind));
    outputs.iter().try_for_each(|path| check_length(path, record(path)))?;

    check_inputs(&then.inputs, wanted.input, load, cache)?;
    let pixels = hash_pixels(&pixel_settings, &then.inputs);
    if pixels != then.pixels || hash_files(&pixels, &file_settings) != then.files {
        return Err(Why::Inconsistent(json.to_owned()));
    }
    outputs.iter().try_for_each(|path| check_content(path, record(path)))?;
    Ok(Kept { report, outputs })
}

/// Whether sampling ended where it would end now, too. What time allows differs from run to run: a picture that was
/// ended by its time is kept where the same time is asked for, and no limit of time says anything against one that has
/// all that was asked for.
fn check_stopping(spp: u32, report: &ImageReport, then: &Fingerprint, wanted: &Wanted) -> Result<(), Why> {
    let fixed = |spp| StoppingRecord { spp, target_error: None, time_limit: None, batch_time_limit: None };
    let is_open = wanted.stopping().is_some();
    let now = wanted.stopping().unwrap_or_else(|| fixed(wanted.settings.render.spp));
    let adaptive = then.settings.get("adaptive");
    // However it was ended: the samples are what counts.
    let then = then.stopping.clone().filter(|_| is_open).unwrap_or_else(|| fixed(spp));
    let has_target = then.target_error == now.target_error;
    let has_all = spp == now.spp && (now.target_error.is_none() || has_target);
    let was_good = now.target_error.is_some() && report.stopped_by.as_deref() == Some("target-error");
    let is_good = was_good && has_target && spp <= now.spp;
    if has_all || is_good {
        // A mean number of samples is not that of each pixel.
        return match adaptive.filter(|_| !(is_open && has_target && wanted.settings.render.adaptive)) {
            Some(_) => Err(Why::Setting { key: "adaptive".into(), then: adaptive.cloned(), now: None }),
            None => Ok(()),
        };
    }
    let text = |value: Option<f64>| value.map(|value| value.to_string());
    let seconds = |value: Option<f64>| value.map(|value| format!("{value}s"));
    let fields = |record: &StoppingRecord| {
        [
            ("target-error", text(record.target_error)),
            ("time-limit", seconds(record.time_limit)),
            ("batch-time-limit", seconds(record.batch_time_limit)),
            ("spp", Some(record.spp.to_string())),
        ]
    };
    let differs = fields(&then).into_iter().zip(fields(&now)).find(|(then, now)| then != now);
    differs.map_or(Ok(()), |((key, then), (_, now))| Err(Why::Setting { key: key.into(), then, now }))
}

/// The bytes of a JSON that may be anything.
fn read(json: &Path) -> Result<Vec<u8>, Why> {
    match Stamp::of(json) {
        Some(stamp) if stamp.bytes <= MOST_BYTES => std::fs::read(json).map_err(|_| Why::NoRecord(json.to_owned())),
        None if !json.exists() => Err(Why::New),
        _ => Err(Why::NoRecord(json.to_owned())),
    }
}

/// The first setting that differs.
fn compare(then: &Settings, pixels: &Settings, files: &Settings) -> Result<(), Why> {
    let now = |key: &str| pixels.get(key).or_else(|| files.get(key));
    let keys = pixels.keys().chain(files.keys()).chain(then.keys());
    match keys.into_iter().find(|key| then.get(*key) != now(key)) {
        None => Ok(()),
        Some(key) => Err(Why::Setting { key: key.clone(), then: then.get(key).cloned(), now: now(key).cloned() }),
    }
}

/// Whether the files that the image was made from are as they were.
fn check_inputs(then: &[InputRecord], input: &Path, load: &LoadOptions, cache: &HashCache) -> Result<(), Why> {
    let itself = || input.display().to_string();
    let missing = |file: String| Why::Input { file, how: Change::Missing };
    let folders = Folders::new(input, load.asset_root.as_deref()).map_err(|_| missing(itself()))?;
    if then.first().is_none_or(|first| !first.name.is_empty()) {
        // What its hash is the hash of is not the input.
        return Err(missing(itself()));
    }
    for record in then {
        let (path, file) = match record.name.as_str() {
            "" => (Some(input.to_owned()), itself()),
            name => (folders.find(name), name.to_owned()),
        };
        let now = path.and_then(|path| cache.content(&path).ok()).map(|(_, content)| content);
        let how = match (record.content(), now) {
            (then, now) if then == now => continue,
            (Some(_), Some(_)) => Change::Changed,
            (Some(_), None) => Change::Missing,
            (None, _) => Change::Appeared,
        };
        return Err(Why::Input { file, how });
    }
    Ok(())
}

/// Whether an output is there and as long as it was.
fn check_length(path: &Path, record: Option<&OutputRecord>) -> Result<(), Why> {
    let fail = |how| Err(Why::Output { path: path.to_owned(), how });
    match (Stamp::of(path), record) {
        (None, _) => fail(Change::Missing),
        (Some(stamp), Some(record)) if stamp.bytes == record.bytes => Ok(()),
        _ => fail(Change::Changed),
    }
}

/// Whether an output is what was written, byte by byte.
fn check_content(path: &Path, record: Option<&OutputRecord>) -> Result<(), Why> {
    let content = HashCache::default().content(path);
    match (content, record) {
        (Ok((_, Content { bytes, blake3 })), Some(then)) if bytes == then.bytes && blake3 == then.blake3 => Ok(()),
        _ => Err(Why::Output { path: path.to_owned(), how: Change::Changed }),
    }
}
