//! What is said about one finished image.

use super::style::Paint;
use super::text::{count, indented, mrays_per_s, printable, seconds};
use prt::batch::report::{Accel, Adaptive, ImageReport, Status, percent};

/// A name that no other image of the run has: its first output, else its input.
pub fn name(image: &ImageReport) -> String {
    let outputs = [&image.outputs.exr, &image.outputs.png];
    printable(outputs.into_iter().flatten().next().unwrap_or(&image.input))
}

/// `renders/cornell.exr  1280x720  64 spp  3.1 s  82 Mray/s`, or the name and what else came of it.
pub fn line(image: &ImageReport, paint: Paint) -> String {
    if image.status != Status::Rendered {
        return format!("{}: {}", name(image), paint.status(image.status, image.status.word()));
    }
    // Without pictures the JSON is what came of it.
    let json = image.outputs.json.as_ref().filter(|_| image.outputs.exr.is_none() && image.outputs.png.is_none());
    let mut line = json.map_or_else(|| name(image), |json| printable(json));
    line += &format!("  {}  {} spp  {}", size(image).unwrap_or_default(), image.spp, seconds(image.seconds.total));
    if let Some(speed) = image.mrays_per_s {
        line += &format!("  {}", mrays_per_s(speed));
    }
    if let Some(error) = image.estimated_error.as_ref().filter(|_| image.target_error.is_some()) {
        line += &format!("  error {}", error.percent());
    }
    line
}

/// `1280x720`.
pub fn size(image: &ImageReport) -> Option<String> {
    Some(format!("{}x{}", image.width?, image.height?))
}

/// `rays by embree 4.4.0 avx512`, and why.
pub fn accel_line(accel: &Accel, note: &str, is_verbose: bool) -> String {
    let words = [accel.used.as_deref(), accel.version.as_deref(), accel.isa.as_deref()];
    let words: Vec<_> = words.into_iter().flatten().collect();
    // The last line of the note is its gist, those before say what was tried.
    let note = if is_verbose { indented(note) } else { note.lines().last().unwrap_or_default().to_owned() };
    let note = if note.is_empty() { note } else { format!(" ({note})") };
    format!("rays by {}{note}", words.join(" "))
}

/// Why `--strict` takes an image for a failure; `None` if it does not.
pub fn strict_failure(image: &ImageReport) -> Option<String> {
    let failures = image.strict_failures();
    let first = failures.first()?;
    let more = if failures.len() > 1 { format!(", and {} more", failures.len() - 1) } else { String::new() };
    Some(format!("{}: counts as failed (--strict): {first}{more}", printable(&image.input)))
}

/// Where the time went, what was traced, and what was left out; nothing of an image that is up to date, whose report is
/// that of another run.
pub fn details(image: &ImageReport) -> Vec<String> {
    if image.status == Status::UpToDate {
        return Vec::new();
    }
    let s = &image.seconds;
    let phases = [("load", s.load), ("decode", s.decode), ("build", s.build), ("render", s.render), ("write", s.write)];
    let known = phases.into_iter().filter_map(|(name, value)| Some(format!("{name} {}", seconds(value?))));
    let known: Vec<_> = known.collect();
    let mut lines = Vec::new();
    if !image.why.is_empty() {
        lines.push(format!("  rendered again: {}", printable(&image.why)));
    }
    if !known.is_empty() {
        lines.push(format!("  {}", known.join(", ")));
    }
    if let Some(error) = &image.estimated_error {
        let [low, high] = error.ci95.map(percent);
        let by = image.stopped_by.as_deref().filter(|by| *by != "spp");
        let by = by.map_or(String::new(), |by| format!("; ended by --{by}"));
        let worst = image
            .worst_tile
            .as_ref()
            .map_or(String::new(), |worst| format!("; worst at {},{}: {}", worst.x, worst.y, percent(worst.error)));
        let above = image.target_error.as_ref().and_then(|target| target.pixels_above);
        let above =
            above.map_or(String::new(), |share| format!("; {:.0} % of the pixels above the target", 100.0 * share));
        lines.push(format!("  error {} ({low} to {high}){by}{worst}{above}", error.percent()));
    }
    if let Some(Adaptive { stage, least, most, gain }) = &image.adaptive {
        let saved = 100.0 * (1.0 - gain);
        lines.push(format!("  {least} to {most} samples a pixel, by what {stage} told: about {saved:.0} % less work"));
    }
    if let (Some(rays), Some(triangles)) = (&image.rays, image.triangles) {
        let (camera, bounce, shadow) = (rays.camera, rays.bounce, rays.shadow);
        let triangles = count(triangles, "triangle");
        lines.push(format!("  {triangles}; rays: {camera} camera, {bounce} bounce, {shadow} shadow"));
    }
    lines.extend(image.skipped.iter().map(|s| format!("  skipped {}: {}", printable(&s.what), printable(&s.why))));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use prt::batch::report::{EstimatedError, Outputs, Rays, Seconds, TargetError, WorstTile};

    fn rendered() -> ImageReport {
        ImageReport {
            input: "scenes/cornell.gltf".into(),
            status: Status::Rendered,
            outputs: Outputs { exr: Some("renders/cornell.exr".into()), ..Outputs::default() },
            width: Some(1280),
            height: Some(720),
            spp: 64,
            seconds: Seconds { load: Some(0.004), render: Some(2.9), total: 3.1, ..Seconds::default() },
            rays: Some(Rays { camera: 1, bounce: 2, shadow: 3, total: 6 }),
            mrays_per_s: Some(82.1),
            triangles: Some(36),
            ..ImageReport::default()
        }
    }

    #[test]
    fn a_finished_image_is_one_line() {
        assert_eq!(line(&rendered(), Paint::OFF), "renders/cornell.exr  1280x720  64 spp  3.1 s  82 Mray/s");
        let empty = ImageReport { status: Status::Empty, outputs: Outputs::default(), ..rendered() };
        assert_eq!(line(&empty, Paint::OFF), "scenes/cornell.gltf: empty");
    }

    #[test]
    fn an_image_with_a_target_says_how_near_it_came() {
        let image = ImageReport {
            estimated_error: Some(EstimatedError {
                metric: "sqrt-relmse".into(),
                value: 0.0093,
                ci95: [0.0087, 0.00994],
            }),
            stopped_by: Some("target-error".into()),
            target_error: Some(TargetError { target: 0.01, met: true, pixels_above: Some(0.31) }),
            worst_tile: Some(WorstTile { x: 32, y: 64, width: 16, height: 16, error: 0.0512 }),
            ..rendered()
        };
        assert!(line(&image, Paint::OFF).ends_with("  64 spp  3.1 s  82 Mray/s  error 0.93 %"));
        assert_eq!(
            details(&image)[1],
            "  error 0.93 % (0.87 % to 0.99 %); ended by --target-error; worst at 32,64: 5.1 %; 31 % of the pixels above \
             the target"
        );
        let missed = TargetError { met: false, ..image.target_error.clone().unwrap() };
        let image = ImageReport { target_error: Some(missed), ..image };
        let told = "scenes/cornell.gltf: counts as failed (--strict): --target-error 0.01 was not reached";
        assert_eq!(strict_failure(&image).as_deref(), Some(told));
    }

    #[test]
    fn an_image_without_pictures_is_named_by_its_report() {
        let outputs = Outputs { json: Some("renders/cornell.json".into()), ..Outputs::default() };
        let image = ImageReport { outputs, ..rendered() };
        assert!(line(&image, Paint::OFF).starts_with("renders/cornell.json  1280x720"), "{}", line(&image, Paint::OFF));
    }

    #[test]
    fn details_say_why_an_image_is_rendered_again_and_nothing_of_what_another_run_did() {
        let image = ImageReport { why: "settings changed: spp 64 -> 128".into(), ..rendered() };
        assert_eq!(details(&image)[0], "  rendered again: settings changed: spp 64 -> 128");
        assert!(details(&ImageReport { status: Status::UpToDate, ..rendered() }).is_empty());
    }

    #[test]
    fn strict_names_the_first_loss_and_counts_the_others() {
        assert_eq!(strict_failure(&rendered()), None);
        let image = ImageReport { losses: vec!["no wood.png".into(), "no normals".into()], ..rendered() };
        let told = "scenes/cornell.gltf: counts as failed (--strict): no wood.png, and 1 more";
        assert_eq!(strict_failure(&image).as_deref(), Some(told));
    }

    #[test]
    fn details_say_where_time_went_and_what_was_traced() {
        assert_eq!(
            details(&rendered()),
            ["  load 4 ms, render 2.9 s", "  36 triangles; rays: 1 camera, 2 bounce, 3 shadow"]
        );
    }
}
