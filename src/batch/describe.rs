//! What images say about themselves, put into their reports.

use super::report::{self, Accel, ImageReport, Rays};
use super::settings::FileSettings;
use crate::film::{ErrorEstimate, Square};
use crate::render::{AccelChoice, DefaultLight, Frame, Integrator, LensReport, SpreadReport, StoppedBy, TargetReport};
use std::path::Path;

/// The report of an image of which nothing is known but what was asked for.
pub(super) fn blank(input: &Path, settings: &FileSettings) -> ImageReport {
    let render = &settings.render;
    ImageReport {
        input: input.display().to_string(),
        spp: render.spp,
        seed: render.seed,
        integrator: Some(render.integrator.name().into()),
        accel: Accel { requested: accel_name(render.accel).into(), ..Accel::default() },
        ..ImageReport::default()
    }
}

/// Adds what `frame` says about itself.
pub(super) fn describe(frame: &Frame, image: &mut ImageReport) {
    let stats = &frame.stats;
    let total = stats.camera_rays + stats.bounce_rays + stats.shadow_rays;
    let some = |text: &String| (!text.is_empty()).then(|| text.clone());
    image.spp = frame.spp;
    image.accel.used = Some(stats.accel.used.into());
    (image.accel.version, image.accel.isa) = (some(&stats.accel.version), some(&stats.accel.isa));
    image.accel_note.clone_from(&stats.accel.note);
    (image.seconds.build, image.seconds.render) = (Some(stats.build_seconds), Some(stats.render_seconds));
    let (camera, bounce, shadow) = (stats.camera_rays, stats.bounce_rays, stats.shadow_rays);
    image.rays = Some(Rays { camera, bounce, shadow, total });
    image.mrays_per_s = (stats.render_seconds > 0.0).then(|| total as f64 / stats.render_seconds * 1e-6);
    image.non_finite_samples = Some(stats.non_finite_samples);
    image.truncated = Some(stats.truncated);
    image.energy_clamped = Some(stats.energy_clamped);
    image.estimated_error = stats.error.map(|ErrorEstimate { value, ci95 }| report::EstimatedError {
        metric: "sqrt-relmse".into(),
        value,
        ci95,
    });
    image.stopped_by = Some(stopped_by_name(stats.stopped_by).into());
    image.target_error = stats.target.map(|TargetReport { target, is_met, above, spp_needed: _ }| {
        report::TargetError { target, met: is_met, pixels_above: above }
    });
    image.adaptive = stats.spread.map(|SpreadReport { stage, least, most, gain, round: _ }| report::Adaptive {
        stage,
        least,
        most,
        gain,
    });
    image.worst_tile = stats.worst.map(|Square { pixels, error }| report::WorstTile {
        x: pixels.x,
        y: pixels.y,
        width: pixels.width,
        height: pixels.height,
        error,
    });
    image.warnings.extend(target_warning(frame));
    image.triangles = Some(stats.triangles);
    image.instances = Some(stats.instances);
    image.placed_instances = Some(stats.placed_instances);
    image.lights = Some(stats.lights);
    image.default_light = Some(report::DefaultLight {
        requested: default_light_name(stats.default_light.requested).into(),
        used: stats.default_light.used,
        emitted_lm_per_m2: stats.default_light.emitted.by_lamps,
        glowing_share: stats.default_light.emitted.glowing,
    });
    image.lens = stats.lens.map(Into::into);
    image.notes.extend(stats.default_light.note());
    if stats.energy_clamped > 0.0 {
        image.notes.push(format!("--clamp took {} of the light", report::percent(stats.energy_clamped)));
    }
    if image.integrator.as_deref() == Some(Integrator::Ao.name()) && frame.pixels.iter().all(|pixel| pixel[0] == 0.0) {
        image.notes.push(
            "--integrator ao: nothing is open: the scene is closed on all sides, and what is there counts at any distance"
                .into(),
        );
    }
    let has = |name| stats.features.contains(&(name, true));
    if image.integrator.as_deref() == Some(Integrator::Whitted.name())
        && (has("emissive_surfaces") || has("environment"))
    {
        image.notes.push(
            "--integrator whitted: lamps are points, the surroundings 16 directions; their shadows are hard".into(),
        );
    }
    image.features = stats.features.iter().map(|&(name, has)| (name.into(), has)).collect();
    image.warnings.extend(stats.warnings.iter().cloned());
    image.losses.extend(stats.losses.iter().cloned());
}

/// What to say of a lens that was focused by itself, and of options that do nothing without one.
pub(super) fn lens_notes(settings: &FileSettings, lens: Option<&LensReport>) -> Option<String> {
    const OTHERWISE: &str = "--focus-distance M and --focus-on NODE say otherwise";
    match lens {
        Some(LensReport { thin, is_found: true }) if thin.focus_distance.is_finite() => Some(format!(
            "the lens is focused at {:.4} m, on the first surface in the picture's centre; {OTHERWISE}",
            thin.focus_distance
        )),
        Some(LensReport { is_found: true, .. }) => {
            Some(format!("the lens is focused at infinity: nothing is in the picture's centre; {OTHERWISE}"))
        }
        Some(_) => None,
        None => {
            let lens = &settings.render.lens;
            let idle = [
                ("--focus-distance", lens.focus_distance.is_some()),
                ("--focus-on", settings.load.focus_on.is_some()),
                ("--aperture-blades", lens.blades.is_some()),
                ("--sensor", lens.sensor.is_some()),
            ];
            let (option, _) = idle.into_iter().find(|(_, is_given)| *is_given && !is_pinhole_by_wish(settings))?;
            Some(format!(
                "{option} does nothing: neither the camera nor --f-stop gives an f-number, so it is a pinhole"
            ))
        }
    }
}

/// `--f-stop inf`.
fn is_pinhole_by_wish(settings: &FileSettings) -> bool {
    settings.render.lens.f_stop.is_some_and(f64::is_infinite)
}

/// What is said where the target was not reached, or there was nothing to tell by.
fn target_warning(frame: &Frame) -> Option<String> {
    let (stats, spp) = (&frame.stats, frame.spp);
    let target = stats.target?;
    let (Some(ErrorEstimate { value, ci95 }), Some(needed)) = (stats.error, target.spp_needed) else {
        return Some(format!(
            "--target-error: nothing but black was seen in {spp} samples of each pixel, so there is no relative error; \
             the picture was taken as it is"
        ));
    };
    // Two digits are more than an estimate of an estimate says.
    let unit = 10.0_f64.powf((needed.log10().floor() - 1.0).max(0.0));
    let needed = (needed / unit).ceil() * unit;
    let [target_, value, upper] = [target.target, value, ci95[1]].map(report::percent);
    (!target.is_met).then(|| {
        format!(
            "--target-error {} ({target_}) was not reached: after {spp} samples of each pixel, the most that --{} gives \
             it, the error is about {value} and at most {upper}\n  It would take about {needed:.0} samples.",
            target.target,
            stopped_by_name(stats.stopped_by)
        )
    })
}

/// The option's name.
pub(super) fn stopped_by_name(by: StoppedBy) -> &'static str {
    match by {
        StoppedBy::Spp => "spp",
        StoppedBy::TargetError => "target-error",
        StoppedBy::TimeLimit => "time-limit",
        StoppedBy::BatchTimeLimit => "batch-time-limit",
    }
}

/// The option's value.
pub(super) fn accel_name(accel: AccelChoice) -> &'static str {
    match accel {
        AccelChoice::Auto => "auto",
        AccelChoice::Embree => "embree",
        AccelChoice::Bvh => "bvh",
        AccelChoice::Linear => "linear",
    }
}

/// The option's value.
pub(super) fn default_light_name(choice: DefaultLight) -> &'static str {
    match choice {
        DefaultLight::Auto => "auto",
        DefaultLight::On => "on",
        DefaultLight::Off => "off",
    }
}
