//! `prt-batch --explain`: the plan of each image, for people or as JSON, on stdout.

use crate::term;
use prt::batch::explain::{CameraPlan, Explanation, MemoryPlan, Prospect, explain};
use prt::batch::fingerprint::StoppingRecord;
use prt::batch::memory::amount;
use prt::batch::report::Lens;
use prt::batch::{BatchSettings, Stop, report};
use prt::render::Considered;
use serde::Serialize;
use std::process::ExitCode;

/// Textures, warnings and skipped parts listed in text; JSON has all.
const SHOWN: usize = 12;

#[derive(Serialize)]
struct Document {
    prt: &'static str,
    images: Vec<Explanation>,
}

pub fn run(settings: &BatchSettings, json: bool) -> ExitCode {
    let mut document = Document { prt: prt::VERSION, images: Vec::new() };
    let explained = explain(settings, &mut |plan| {
        if json {
            document.images.push(plan);
        } else {
            term::print(&text(&plan));
        }
    });
    match explained {
        Ok(explained) => {
            if json {
                term::print(&report::to_json(&document));
            }
            ExitCode::from(explained.exit_code())
        }
        Err(Stop::Usage(message)) => term::usage(&message),
        Err(Stop::Unwritable(error)) => {
            term::error(&error.to_string());
            ExitCode::from(4)
        }
    }
}

/// Lines of a name and what is said about it.
struct Lines(String);

impl Lines {
    fn add(&mut self, name: &str, text: impl AsRef<str>) {
        // What goes on in further lines stays in its column.
        let text = text.as_ref().replace('\n', "\n             ");
        self.0 += &format!("  {name:<10} {text}\n");
    }

    fn list(&mut self, name: &str, all: impl ExactSizeIterator<Item = String>) {
        let count = all.len();
        all.take(SHOWN).for_each(|text| self.add(name, text));
        if count > SHOWN {
            self.add("", format!("and {} more (--json has all)", count - SHOWN));
        }
    }
}

/// The plan of an image, with an empty line behind it.
fn text(plan: &Explanation) -> String {
    let mut lines = Lines(format!("{}\n", plan.input));
    let prospect = match plan.prospect {
        Prospect::Render => "would be rendered".to_owned(),
        Prospect::Keep => "is up to date and would be kept".to_owned(),
        Prospect::Empty => "is empty: no picture would be written".to_owned(),
        Prospect::Fail => "would fail".to_owned(),
    };
    lines.add("prospect", prospect);
    lines.list("problem", plan.problem.iter().cloned());
    lines.list("up to date", plan.up_to_date.iter().cloned());
    let outputs = [&plan.outputs.exr, &plan.outputs.png, &plan.outputs.json];
    let outputs: Vec<&str> = outputs.into_iter().flatten().map(String::as_str).collect();
    if !outputs.is_empty() {
        lines.add("files", outputs.join(", "));
    }
    if let (Some(scene), Some(width), Some(height)) = (plan.scene, plan.width, plan.height) {
        let crop = plan.crop.map_or_else(String::new, |[x, y, w, h]| format!(", of it {w} x {h} at {x},{y}"));
        let paths = plan.paths.map_or_else(String::new, |paths| format!(", {} paths", grouped(paths)));
        let (spp, seed) = (plan.spp, plan.seed);
        let integrator = match plan.integrator {
            "path" => String::new(),
            other => format!(", integrator {other}"),
        };
        let most = if plan.stopping.is_some() { "at most " } else { "" };
        lines.add(
            "picture",
            format!("{width} x {height} pixels{crop}, {most}{spp} spp{paths}, seed {seed}{integrator}"),
        );
        lines.list("ends", plan.stopping.iter().map(stopping_text));
        lines.add("scene", scene.to_string());
        lines.list("frame", plan.frame.iter().map(u32::to_string));
    }
    if let Some(camera) = &plan.camera {
        lines.add("camera", camera_text(camera));
        lines.list("lens", plan.lens.iter().map(lens_text));
    }
    if let Some(used) = &plan.accel.used {
        let words = [Some(used), plan.accel.version.as_ref(), plan.accel.isa.as_ref()];
        let words: Vec<&str> = words.into_iter().flatten().map(String::as_str).collect();
        let note = plan.accel_note.lines().last().map_or_else(String::new, |note| format!(" ({note})"));
        let front = plan.front_triangles.filter(|&n| n > 0);
        let front = front.map_or_else(String::new, |n| {
            format!("; {n} big triangles are tested in packets before, for scattered rays")
        });
        let splits = plan.split_references.filter(|&n| n > 0);
        let splits = splits.map_or_else(String::new, |n| format!("; long triangles in {} more parts", grouped(n)));
        lines.add("rays by", format!("{}{note}{splits}{front}", words.join(" ")));
    }
    if let Some(triangles) = &plan.triangles {
        let (placed, traced) = (grouped(triangles.placed), grouped(triangles.traced));
        let mut dropped =
            if triangles.traced == triangles.placed { String::new() } else { format!(", {traced} of them traced") };
        if triangles.stored != triangles.traced {
            dropped += &format!(", {} held", grouped(triangles.stored));
        }
        let count = |n: Option<usize>| grouped(n.unwrap_or(0) as u64);
        let (meshes, instances, materials) = (count(plan.meshes), count(plan.instances), count(plan.materials));
        lines.add(
            "triangles",
            format!(
                "{placed} placed ({} in the file){dropped}; {meshes} meshes, {instances} instances, {materials} materials",
                grouped(triangles.file)
            ),
        );
    }
    lines.list("instances", plan.placing.iter().map(placing_text));
    if !plan.textures.is_empty() {
        lines.add("textures", format!("{}, {}", plan.textures.len(), amount(plan.texture_bytes)));
        lines.list(
            "",
            plan.textures.iter().map(|t| {
                let kept = ["", "1 channel", "2 channels", "", "4 channels"].get(t.channels).copied().unwrap_or("");
                format!("{} {} x {}, {kept} of {} bits, {}", t.name, t.width, t.height, t.bits, amount(t.bytes))
            }),
        );
    }
    light_lines(plan, &mut lines);
    let features: Vec<&str> = plan.features.iter().filter(|(_, has)| **has).map(|(name, _)| name.as_str()).collect();
    if !plan.features.is_empty() {
        lines.add("features", if features.is_empty() { "none".into() } else { features.join(", ") });
    }
    if let Some(memory) = &plan.memory {
        lines.add("memory", memory_text(memory));
    }
    if let Some(total) = plan.seconds.total {
        lines.add("time", time_text(plan, total));
    }
    lines.list("skipped", plan.skipped.iter().map(|skipped| format!("{}: {}", skipped.what, skipped.why)));
    lines.list("note", plan.notes.iter().cloned());
    lines.list("warning", plan.warnings.iter().cloned());
    lines.0 + "\n"
}

/// What may end sampling before the most samples.
fn stopping_text(stopping: &StoppingRecord) -> String {
    let error = stopping.target_error.map(|error| format!("the error is at most {}", report::percent(error)));
    let time = stopping.time_limit.map(|limit| format!("{} of sampling are over", report::seconds(limit)));
    let batch = stopping
        .batch_time_limit
        .map(|limit| format!("its equal share is over of what is left of {} for all images", report::seconds(limit)));
    let ends: Vec<_> = error.into_iter().chain(time).chain(batch).collect();
    format!("when {}, or with the last sample", ends.join(", or "))
}

/// Such as `f/2.8, 24.5 mm, focused at 3.5 m, 6 blades`.
fn lens_text(lens: &Lens) -> String {
    let focus = lens.focus_distance_m.map_or_else(|| "infinity".to_owned(), |metres| format!("{metres} m"));
    let blades = if lens.blades == 0 { "round".to_owned() } else { format!("{} blades", lens.blades) };
    format!("f/{}, {:.1} mm, focused at {focus}, {blades}", lens.f_stop, lens.focal_length_mm)
}

fn camera_text(camera: &CameraPlan) -> String {
    let from = match camera.from.as_str() {
        "file" => "of the file".to_owned(),
        "bounds" => "framed on the scene's bounds, because the file has none".to_owned(),
        option => format!("from {option}"),
    };
    let which = match (camera.index, &camera.name) {
        (Some(index), Some(name)) if *name != index.to_string() => format!("{index} \"{name}\" "),
        (Some(index), _) => format!("{index} "),
        (None, _) => String::new(),
    };
    let yfov = camera.yfov.map_or_else(String::new, |yfov| format!(", yfov {yfov:.1} deg"));
    let [x, y, z] = camera.eye;
    format!("{which}{from}: {}{yfov}, at {x:.3},{y:.3},{z:.3}", camera.projection)
}

/// What became of something that has several instances.
fn placing_text(thing: &Considered) -> String {
    let more = if thing.meshes > 1 { format!(" ({} meshes)", thing.meshes) } else { String::new() };
    let became = match thing.placed {
        0 => String::from("merged"),
        n if n == thing.instances => String::from("placed"),
        n => format!("{} placed, the others merged, since placing them would cost precision", grouped(n)),
    };
    let (n, instances, why) = (grouped(thing.triangles), grouped(thing.instances), thing.why);
    let (merge, place) = (seconds(thing.merge_seconds), seconds(thing.place_seconds));
    format!("{}{more}, {n} triangles x {instances}: {became} ({why}; merging {merge}, placing {place})", thing.mesh)
}

fn light_lines(plan: &Explanation, lines: &mut Lines) {
    let Some(lights) = &plan.lights else { return };
    let light = plan.default_light.clone().unwrap_or_default();
    let counted = [
        (lights.emissive_meshes as u64, "glowing meshes"),
        (lights.emissive_triangles, "emissive triangles"),
        (lights.point as u64, "point"),
        (lights.spot as u64, "spot"),
        (lights.directional as u64, "directional"),
        (u64::from(lights.environment && !light.used), "environment"),
    ];
    let some = counted.into_iter().filter(|(n, _)| *n > 0).map(|(n, kind)| format!("{} {kind}", grouped(n)));
    let some: Vec<String> = some.collect();
    lines.add("lights", if some.is_empty() { "none in the file".into() } else { some.join(", ") });
    let state = if light.used { "on" } else { "off" };
    let (by_lamps, glowing) = (light.emitted_lm_per_m2, 100.0 * light.glowing_share);
    lines.add(
        "studio",
        format!(
            "{state} (--default-light {}): lamps give {by_lamps:.3} lm per m^2 of surface, {glowing:.1} % of it emits",
            light.requested
        ),
    );
}

fn memory_text(memory: &MemoryPlan) -> String {
    let parts: Vec<String> = (memory.parts.at_peak().into_iter())
        .filter(|(_, bytes)| *bytes > 0)
        .map(|(name, bytes)| format!("{name} {}", amount(bytes)))
        .collect();
    let budget = memory.budget.map_or_else(String::new, |budget| format!(" of {}", amount(budget)));
    format!("about {}{budget} ({})", amount(memory.peak), parts.join(", "))
}

fn time_text(plan: &Explanation, total: f64) -> String {
    let s = &plan.seconds;
    let parts = [("load", s.load), ("decode", s.decode), ("build", s.build), ("render", s.render), ("write", s.write)];
    let parts: Vec<String> =
        parts.into_iter().filter_map(|(name, value)| value.map(|v| format!("{name} {}", seconds(v)))).collect();
    let speed = s.mrays_per_s.map_or_else(String::new, |speed| format!(", {speed:.1} Mray/s"));
    format!("about {} ({}{speed})", seconds(total), parts.join(", "))
}

/// `1,234,567`.
fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// An estimate: two digits.
fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 0.001 => "0 s".into(),
        s if s < 0.0995 => format!("{s:.3} s"),
        s if s < 9.95 => format!("{s:.1} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped_and_seconds_are_short() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
        let texts = [0.0, 0.012, 0.52, 9.99, 119.0, 600.0, 36_000.0].map(seconds);
        assert_eq!(texts, ["0 s", "0.012 s", "0.5 s", "10 s", "119 s", "10 min", "10.0 h"]);
    }
}
