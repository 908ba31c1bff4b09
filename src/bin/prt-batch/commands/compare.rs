//! `prt-batch compare A... REF`: exit code 0 within limits, 1 not, 2 usage, 3 unreadable.

use super::exr_files::exr_files;
use crate::args::CompareArgs;
use crate::term;
use prt::compare::metrics::{Metrics, mean_picture, metrics};
use prt::compare::{BlockTest, block_test};
use prt::image::exr_read::{self, Picture};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Serialize)]
struct Comparison {
    passed: bool,
    pairs: Vec<Pair>,
}

/// One scene: pictures of it and its reference.
#[derive(Serialize)]
struct Pair {
    reference: String,
    pictures: Vec<One>,
    /// Of the mean of several pictures; null for one.
    mean: Option<Metrics>,
    /// Needs several pictures.
    block_test: Option<BlockTest>,
    failures: Vec<String>,
}

#[derive(Serialize)]
struct One {
    path: String,
    #[serde(flatten)]
    metrics: Metrics,
}

pub fn run(args: &CompareArgs) -> ExitCode {
    let rel_se = match reference_noise(args) {
        Ok(rel_se) => rel_se,
        Err((code, message)) => return failed(code, &message),
    };
    let pairs = match pair_up(&args.pictures) {
        Ok(pairs) => pairs,
        Err((code, message)) => return failed(code, &message),
    };
    let mut compared = Vec::new();
    for (pictures, reference) in pairs {
        match compare(&pictures, &reference, rel_se, args) {
            Ok(pair) => compared.push(pair),
            Err(message) => return failed(3, &message),
        }
    }
    let result = Comparison { passed: compared.iter().all(|pair| pair.failures.is_empty()), pairs: compared };
    if args.json {
        term::print(&prt::batch::report::to_json(&result));
    } else {
        result.pairs.iter().for_each(print);
    }
    for failure in result.pairs.iter().flat_map(|pair| &pair.failures) {
        term::error(failure);
    }
    ExitCode::from(u8::from(!result.passed))
}

fn failed(code: u8, message: &str) -> ExitCode {
    if code == 2 {
        term::usage(message)
    } else {
        term::error(message);
        ExitCode::from(code)
    }
}

/// `--ref-rel-se`, or the number that `--ref-stats FILE:KEY` points at, or 0.
fn reference_noise(args: &CompareArgs) -> Result<f64, (u8, String)> {
    let Some(stats) = &args.ref_stats else { return Ok(args.ref_rel_se.unwrap_or(0.0)) };
    let Some((file, key)) = stats.rsplit_once(':') else {
        return Err((2, format!("--ref-stats {stats}: must be FILE:KEY, such as stats.json:ref_mitsuba")));
    };
    let text = std::fs::read_to_string(file).map_err(|error| (3, format!("{file}: {error}")))?;
    let json: serde_json::Value = serde_json::from_str(&text).map_err(|error| (3, format!("{file}: {error}")))?;
    json[key]["rel_se"].as_f64().ok_or_else(|| (3, format!("{file}: /{key}/rel_se: there is no such number")))
}

/// Pictures and the reference they belong to.
type Files = (Vec<PathBuf>, PathBuf);

/// Files as they stand; of folders, every `.exr` below the reference's folder with those of the same name.
fn pair_up(paths: &[PathBuf]) -> Result<Vec<Files>, (u8, String)> {
    let (reference, pictures) = paths.split_last().expect("clap takes at least two");
    let folders = paths.iter().filter(|path| path.is_dir()).count();
    if folders == 0 {
        return Ok(vec![(pictures.to_vec(), reference.clone())]);
    }
    if folders < paths.len() {
        return Err((2, "compare takes either files or folders, not both".into()));
    }
    let names = exr_files(reference, Path::new(""));
    let names = names.map_err(|error| (3, format!("{}: {error}", reference.display())))?;
    if names.is_empty() {
        return Err((3, format!("{}: there is no .exr file in this folder", reference.display())));
    }
    let pair = |name: PathBuf| (pictures.iter().map(|folder| folder.join(&name)).collect(), reference.join(&name));
    Ok(names.into_iter().map(pair).collect())
}

fn compare(paths: &[PathBuf], reference_path: &Path, rel_se: f64, args: &CompareArgs) -> Result<Pair, String> {
    let read = |path: &Path| exr_read::read(path).map_err(|error| format!("{}: {error}", path.display()));
    let mut reference = read(reference_path)?;
    let pictures: Vec<Picture> = paths.iter().map(|path| read(path)).collect::<Result<_, _>>()?;
    let window = |p: &Picture| (p.origin, p.width, p.height);
    let text = |p: &Picture| format!("{}x{} at {},{}", p.width, p.height, p.origin[0], p.origin[1]);
    // A crop is compared with its part of the reference.
    let part = reference.part(&pictures[0]).filter(|part| pictures.iter().all(|p| window(p) == window(part)));
    reference = part.ok_or_else(|| {
        let sizes: Vec<_> = pictures.iter().map(text).collect();
        let (all, path) = (sizes.join(", "), reference_path.display());
        format!("{}: pixels {all} cannot be compared with {path}: {}", paths[0].display(), text(&reference))
    })?;

    let mut failures = Vec::new();
    let mut one = |path: &Path, metrics: &Metrics| check(path, metrics, args, &mut failures);
    let several = pictures.len() > 1;
    let ones: Vec<One> = (paths.iter().zip(&pictures))
        .map(|(path, picture)| One { path: path.display().to_string(), metrics: metrics(picture, &reference) })
        .collect();
    let finite = ones.iter().all(|one| one.metrics.relmse.is_some());
    let mean = several.then(|| metrics(&mean_picture(&pictures), &reference));
    // Limits hold for the mean of several seeds; a non-finite pixel fails in any of them.
    match &mean {
        Some(mean) if finite => one(&paths[0], mean),
        _ => paths.iter().zip(&ones).for_each(|(path, o)| one(path, &o.metrics)),
    }
    let block_test = (several && finite).then(|| block_test(&pictures, &reference, rel_se));
    if let Some(test) = block_test.as_ref().filter(|test| test.rejected > 0) {
        let (path, [x, y, channel]) = (paths[0].display(), test.worst_at);
        failures.push(format!(
            "{path}: {} of {} block means differ from the reference beyond noise; the worst at pixel {x},{y}, channel {}: {:+.3} %",
            test.rejected, test.tests, ["R", "G", "B"][channel], 100.0 * test.worst_difference
        ));
    }
    Ok(Pair { reference: reference_path.display().to_string(), pictures: ones, mean, block_test, failures })
}

/// Adds what is beyond the limits to `failures`.
fn check(path: &Path, metrics: &Metrics, args: &CompareArgs, failures: &mut Vec<String>) {
    let path = path.display();
    let Some(relmse) = metrics.relmse else {
        let (a, r) = (metrics.non_finite_pixels, metrics.non_finite_reference_pixels);
        return failures.push(format!("{path}: {a} pixels are not finite, and {r} of the reference"));
    };
    if let Some(limit) = args.max_relmse.filter(|limit| relmse > *limit) {
        failures.push(format!("{path}: relMSE {relmse:.6e} is above --max-relmse {limit:e}"));
    }
    for (channel, ratio) in ["R", "G", "B"].iter().zip(metrics.mean_ratio) {
        let bias = ratio.map(|ratio| 100.0 * (ratio - 1.0));
        if let (Some(bias), Some(limit)) = (bias, args.max_bias)
            && bias.abs() > limit
        {
            failures.push(format!("{path}: mean of {channel} is off by {bias:+.4} %, beyond --max-bias {limit}"));
        }
    }
}

fn print(pair: &Pair) {
    let mut text = format!("reference {}\n", pair.reference);
    let named = pair.pictures.iter().map(|one| (one.path.as_str(), &one.metrics));
    for (name, metrics) in named.chain(pair.mean.iter().map(|mean| ("mean of all", mean))) {
        let number = |value: Option<f64>| value.map_or("-".into(), |v| format!("{v:.6e}"));
        let ratio = |value: Option<f64>| value.map_or("-".into(), |v| format!("{v:.5}"));
        let kind = if metrics.absolute { "MSE (the reference is black)" } else { "relMSE" };
        let (all, trimmed, ratios) =
            (number(metrics.relmse), number(metrics.relmse_trimmed), metrics.mean_ratio.map(ratio).join(" "));
        text += &format!("{name}\n  {kind} {all}, trimmed {trimmed}, mean ratio {ratios}\n");
    }
    if let Some(test) = &pair.block_test {
        let (seeds, tests, rejected, p) = (test.seeds, test.tests, test.rejected, test.smallest_p);
        text += &format!("  {seeds} seeds, {rejected} of {tests} block tests rejected, smallest adjusted p {p:.2e}\n");
    }
    term::print(&text);
}
