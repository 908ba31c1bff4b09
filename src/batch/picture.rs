//! A [`Frame`] as the bytes of files.

use super::develop::Tone;
use crate::camera::Projection;
use crate::image::exr::{
    self, ExrCamera, ExrChannel, ExrChannelSamples, ExrLens, ExrOptions, ExrPicture, ExrProjection, ExrSamples,
    ExrValue,
};
use crate::render::{Brdf, Frame, Integrator, LensReport, RenderSettings, SpreadReport};

/// Which files, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileOptions {
    /// Write the EXR.
    pub exr: bool,
    /// Write the PNG.
    pub png: bool,
    /// Of the EXR.
    pub format: ExrOptions,
    /// Of the PNG.
    pub tone: Tone,
}

impl Default for FileOptions {
    fn default() -> Self {
        Self { exr: true, png: true, format: ExrOptions::default(), tone: Tone::default() }
    }
}

/// The bytes of the EXR, and how many of its pixels were clipped; `None` where nothing clips. `fingerprint` is that of
/// its pixels ([`super::fingerprint::Fingerprint::pixels`]), if known.
///
/// # Errors
/// See [`exr::encode`].
pub(super) fn exr_bytes(
    frame: &Frame,
    settings: &RenderSettings,
    options: ExrOptions,
    fingerprint: Option<&str>,
) -> Result<(Vec<u8>, Option<u64>), String> {
    let clipped = match options.samples {
        ExrSamples::Float => None,
        ExrSamples::Half => Some(exr::clipped_by_half(&frame.pixels)),
    };
    let window = frame.window;
    let camera = ExrCamera {
        world_from_camera: frame.camera.world_from_camera,
        projection: match frame.camera.projection {
            Projection::Perspective { yfov, .. } => ExrProjection::Perspective { yfov },
            Projection::Orthographic { ymag, .. } => ExrProjection::Orthographic { half_height: ymag },
        },
        aspect_ratio: frame.camera.aspect_ratio,
    };
    let picture = ExrPicture {
        display_size: [frame.width, frame.height],
        origin: [window.x, window.y],
        size: [window.width, window.height],
        pixels: &frame.pixels,
        channels: channels(frame),
        camera,
        lens: frame
            .stats
            .lens
            .map(|LensReport { thin, .. }| ExrLens { f_stop: thin.f_stop as f32, focus: thin.focus_distance as f32 }),
        attributes: attributes(frame, settings, clipped, fingerprint),
    };
    Ok((exr::encode(&picture, options)?, clipped))
}

/// The layers beside the colour.
fn channels(frame: &Frame) -> Vec<ExrChannel> {
    let variance = |(variance, channel): (&Vec<[f32; 3]>, usize)| ExrChannel {
        name: ["variance.R", "variance.G", "variance.B"][channel],
        samples: ExrChannelSamples::Float(variance.iter().map(|v| v[channel]).collect()),
    };
    let samples =
        |samples: &Vec<u32>| ExrChannel { name: "samples", samples: ExrChannelSamples::Uint(samples.clone()) };
    let variances = frame.variance.iter().flat_map(|of_pixels| (0..3).map(move |channel| (of_pixels, channel)));
    variances.map(variance).chain(frame.samples.iter().map(samples)).collect()
}

/// The `prt:` attributes. Only what determines the pixels, so that equal renders have equal bytes: no times, paths,
/// host, threads.
fn attributes(
    frame: &Frame,
    settings: &RenderSettings,
    clipped: Option<u64>,
    fingerprint: Option<&str>,
) -> Vec<(&'static str, ExrValue)> {
    let stats = &frame.stats;
    let mut attributes = vec![
        ("prt:version", ExrValue::Text(crate::VERSION.into())),
        // Text, because EXR has no 64-bit integer.
        ("prt:seed", ExrValue::Text(settings.seed.to_string())),
        ("prt:spp", ExrValue::Int(i32::try_from(frame.spp).unwrap_or(i32::MAX))),
        ("prt:accel", ExrValue::Text(stats.accel.used.into())),
        ("prt:integrator", ExrValue::Text(settings.integrator.name().into())),
        ("prt:brdf", ExrValue::Text(brdf_name(settings.brdf).into())),
        // Part of the shading model (docs/conventions.md, "Shading normals").
        ("prt:normals", ExrValue::Text("repaired, terminator".into())),
        ("prt:light", ExrValue::Text(light_name(frame).into())),
        ("prt:nonFinite", ExrValue::Double(stats.non_finite_samples as f64)),
        ("prt:truncated", ExrValue::Double(stats.truncated)),
        ("prt:biased", ExrValue::Text(bias_of(frame, settings, clipped))),
    ];
    if let Some(error) = stats.error {
        attributes.push(("prt:error", ExrValue::Double(error.value)));
    }
    if let Some(SpreadReport { stage, round, least, most, gain: _ }) = stats.spread {
        let text = format!("{least} to {most} samples a pixel, by those of {stage}, round {round}");
        attributes.push(("prt:adaptive", ExrValue::Text(text)));
    }
    if let Some(most) = settings.clamp {
        attributes.push(("prt:clamp", ExrValue::Double(most.into())));
    }
    if settings.texture_lod {
        attributes.push(("prt:textureLod", ExrValue::Text("cones".into())));
    }
    for (name, size) in [("prt:lightRadius", settings.light_radius), ("prt:sunAngle", settings.sun_angle)] {
        if size > 0.0 {
            attributes.push((name, ExrValue::Double(size)));
        }
    }
    if let Some(LensReport { thin, .. }) = stats.lens {
        let shape = if thin.blades == 0 { "round".into() } else { format!("{} blades", thin.blades) };
        attributes.push(("prt:lens", ExrValue::Text(format!("radius {:e} m, {shape}", thin.radius))));
    }
    if settings.cull_backfaces {
        attributes.push(("prt:backfaces", ExrValue::Text("culled".into())));
    }
    attributes.extend(fingerprint.map(|hash| ("prt:fingerprint", ExrValue::Text(hash.into()))));
    attributes
}

/// The option's value that names a model.
fn brdf_name(brdf: Brdf) -> &'static str {
    match brdf {
        Brdf::Full => "full",
        Brdf::AppendixB => "appendix-b",
    }
}

/// Whether there is light beside the file's own.
fn light_name(frame: &Frame) -> &'static str {
    match (frame.stats.default_light.used, frame.stats.environment) {
        (true, _) => "studio",
        (_, true) => "environment",
        _ => "file",
    }
}

/// What biases the picture and why; `no` if nothing does.
fn bias_of(frame: &Frame, settings: &RenderSettings, clipped: Option<u64>) -> String {
    let mut reasons = Vec::new();
    match settings.integrator {
        Integrator::Path => {}
        Integrator::Direct => reasons.push("direct light alone (--integrator direct)".to_owned()),
        Integrator::Whitted => reasons.push(format!(
            "mirrors, clear glass and direct light alone, lamps as points; branches below {:e} of their path are left \
             out (--integrator whitted)",
            Integrator::LEAST_BRANCH
        )),
        other => reasons.push(format!("no light (--integrator {})", other.name())),
    }
    if let Some(most) = settings.clamp {
        reasons.push(format!("indirect light is clamped at {most} nits (--clamp)"));
    }
    if settings.texture_lod {
        reasons.push("textures are averaged over cones around the paths (--texture-lod)".into());
    }
    if let Some(bounces) = settings.max_bounces {
        reasons.push(format!("paths end after {bounces} scatterings (--max-bounces)"));
    }
    if frame.stats.truncated > 0.0 {
        let (share, cap) = (frame.stats.truncated, settings.bounce_cap());
        reasons.push(format!("a share of {share:e} of the paths was cut at the cap of {cap} scatterings"));
    }
    if frame.stats.non_finite_samples > 0 {
        reasons.push(format!("{} non-finite samples were dropped", frame.stats.non_finite_samples));
    }
    if let Some(clipped) = clipped.filter(|clipped| *clipped > 0) {
        reasons.push(format!("{clipped} pixels were clipped at 65504 (--exr half)"));
    }
    if reasons.is_empty() { "no".into() } else { reasons.join("; ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::exr_read;
    use crate::render::{AccelReport, CropWindow, FrameCamera, RenderStats};

    fn frame() -> Frame {
        let stats = RenderStats {
            accel: AccelReport { requested: "auto", used: "bvh", ..AccelReport::default() },
            ..RenderStats::default()
        };
        let camera = FrameCamera {
            world_from_camera: glam::DMat4::IDENTITY,
            projection: Projection::Perspective { yfov: 1.0, aspect_ratio: None },
            aspect_ratio: 2.0,
        };
        let window = CropWindow { x: 3, y: 2, width: 2, height: 1 };
        let pixels = vec![[0.25, 0.5, 1.0], [f32::NAN, f32::INFINITY, -1.0]];
        Frame { width: 8, height: 4, window, pixels, spp: 16, variance: None, samples: None, camera, stats }
    }

    #[test]
    fn files_hold_the_window_of_the_frame() {
        let frame = frame();
        let (bytes, clipped) = exr_bytes(&frame, &RenderSettings::default(), ExrOptions::default(), None).unwrap();
        assert_eq!(clipped, None);
        let read = exr_read::decode(&bytes).unwrap();
        assert_eq!((read.origin, read.width, read.height), ([3, 2], 2, 1));
        assert_eq!(read.pixels[0], frame.pixels[0]);
    }

    #[test]
    fn pixels_that_half_clips_are_counted_and_named() {
        let mut frame = frame();
        let half = ExrOptions { samples: ExrSamples::Half, ..ExrOptions::default() };
        let (bytes, clipped) = exr_bytes(&frame, &RenderSettings::default(), half, None).unwrap();
        assert_eq!(clipped, Some(1));
        assert_eq!(exr_read::decode(&bytes).unwrap().pixels[1][1], 65504.0);
        let named = "1 pixels were clipped at 65504 (--exr half)";
        assert!(bytes.windows(named.len()).any(|window| window == named.as_bytes()));
        frame.pixels[1] = [65504.0, 0.1, -65504.0];
        assert_eq!(exr_bytes(&frame, &RenderSettings::default(), half, None).unwrap().1, Some(0));
        assert_eq!(bias_of(&frame, &RenderSettings::default(), Some(0)), "no");
    }

    #[test]
    fn attributes_are_those_of_the_contract() {
        let names = |fingerprint| -> Vec<_> {
            attributes(&frame(), &RenderSettings::default(), None, fingerprint).iter().map(|a| a.0).collect()
        };
        #[rustfmt::skip]
        assert_eq!(names(None), ["prt:version", "prt:seed", "prt:spp", "prt:accel", "prt:integrator", "prt:brdf",
            "prt:normals", "prt:light", "prt:nonFinite", "prt:truncated", "prt:biased"]);
        let with_fingerprint = names(Some("0123"));
        assert_eq!(with_fingerprint[..11], names(None));
        assert_eq!(with_fingerprint[11..], ["prt:fingerprint"]);
    }

    #[test]
    fn bias_is_named() {
        let (mut frame, mut settings) = (frame(), RenderSettings::default());
        assert_eq!(bias_of(&frame, &settings, None), "no");
        settings.texture_lod = true;
        let named = "textures are averaged over cones around the paths (--texture-lod)";
        assert_eq!(bias_of(&frame, &settings, None), named);
        assert!(attributes(&frame, &settings, None, None).iter().any(|a| a.0 == "prt:textureLod"));
        settings.texture_lod = false;
        settings.sun_angle = 0.5;
        assert_eq!(bias_of(&frame, &settings, None), "no", "another scene, not a bias");
        assert!(attributes(&frame, &settings, None, None).iter().any(|a| a.0 == "prt:sunAngle"));
        settings.sun_angle = 0.0;
        settings.clamp = Some(2.5);
        assert_eq!(bias_of(&frame, &settings, None), "indirect light is clamped at 2.5 nits (--clamp)");
        assert!(attributes(&frame, &settings, None, None).contains(&("prt:clamp", ExrValue::Double(2.5))));
        settings.clamp = None;
        settings.max_bounces = Some(3);
        frame.stats.non_finite_samples = 7;
        assert_eq!(
            bias_of(&frame, &settings, None),
            "paths end after 3 scatterings (--max-bounces); 7 non-finite samples were dropped"
        );
    }
}
