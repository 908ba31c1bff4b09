//! From a scene and settings to a [`Frame`].

mod boxes;
mod default_light;
mod emission;
mod features;
mod flatten;
mod frame;
mod framing;
mod lens;
pub mod memory;
mod moving;
mod opacity;
mod pilot;
mod placing;
mod prepare;
mod progress;
mod refraction;
mod schedule;
mod settings;
mod shapes;
mod stopping;
mod tracer;

pub use default_light::{DefaultLightReport, Emitted, LEAST_EMITTED};
pub use features::features;
pub use frame::{pool, render, render_prepared};
pub use framing::{FRAMING_YFOV, framing};
pub use lens::{LensReport, lens};
pub use pilot::{Pilot, pilot};
pub use placing::{Choice, Considered};
pub use prepare::{PlacedReport, Prepared, build_accel, geometry, prepare, prepare_placing, prepare_with};
pub use progress::{Phase, Progress};
pub use settings::{
    AccelChoice, Brdf, CropWindow, DefaultLight, Filter, FilterShape, Integrator, Layers, RenderSettings,
};
pub use stopping::{StoppedBy, Stopping};
pub use tracer::{camera, window};

/// A camera's matrices for the picture that was rendered, f64, column vectors (`dst_from_src`).
#[derive(Clone, Copy, Debug)]
pub struct FrameCamera {
    /// Rigid, right-handed, camera looking along -Z; world space of the file.
    pub world_from_camera: glam::DMat4,
    /// How points became pixels; of its two sizes the vertical one was kept.
    pub projection: crate::camera::Projection,
    /// Width over height of the whole picture.
    pub aspect_ratio: f64,
}

/// How the backend was chosen and what it is.
#[derive(Clone, Debug, Default)]
pub struct AccelReport {
    /// As asked: `auto`, `embree`, `bvh`, `linear`.
    pub requested: &'static str,
    /// `embree`, `bvh` or `linear`.
    pub used: &'static str,
    /// Version of the library, empty for our own.
    pub version: String,
    /// Instruction set of the ray kernels, such as `avx512`.
    pub isa: String,
    /// Why `auto` did not take Embree; empty if it did.
    pub note: String,
    /// Big triangles tested by packets of rays before the backend.
    pub front_triangles: u64,
    /// Parts that `bvh` cut long diagonal triangles into, beyond one each.
    pub splits: u64,
}

/// Counts and times of one frame.
#[derive(Clone, Debug, Default)]
pub struct RenderStats {
    /// Wall seconds to flatten the scene and build light tables and the acceleration structure.
    pub build_seconds: f64,
    /// Wall seconds of sampling.
    pub render_seconds: f64,
    /// Camera rays.
    pub camera_rays: u64,
    /// Rays continued after a scattering.
    pub bounce_rays: u64,
    /// Rays towards lights.
    pub shadow_rays: u64,
    /// Samples dropped because a channel was not finite.
    pub non_finite_samples: u64,
    /// The first few of them: (pixel x, pixel y, sample).
    pub non_finite_examples: Vec<(u32, u32, u32)>,
    /// Share of paths ended by the bounce limit that is a safety cap (not by `--max-bounces`).
    pub truncated: f64,
    /// Share of the picture's light that the clamp took, all channels together; 0 without one.
    pub energy_clamped: f64,
    /// How far the picture is from that of endless samples; `None` with fewer than four samples a pixel, or if it is
    /// black.
    pub error: Option<crate::film::ErrorEstimate>,
    /// The part of the picture that is worst off, where there is an error.
    pub worst: Option<crate::film::Square>,
    /// What ended sampling.
    pub stopped_by: StoppedBy,
    /// How samples were spread over the pixels; `None`: each has as many.
    pub spread: Option<SpreadReport>,
    /// What came of the target of the error, where there was one.
    pub target: Option<TargetReport>,
    /// Triangles that rays can meet, with every instance.
    pub triangles: u64,
    /// Meshes that the file places.
    pub instances: u64,
    /// Placements of what was not merged into the world; meshes with the same places count once.
    pub placed_instances: u64,
    /// Lights: punctual ones, glowing meshes (each part that touches no other) and the environment.
    pub lights: u64,
    /// Named yes/no facts about the scene, as in `features` of the JSON.
    pub features: Vec<(&'static str, bool)>,
    /// Whether the built-in studio lights the scene, and why.
    pub default_light: DefaultLightReport,
    /// Whether the scene has an environment of its own, or was given one, that shines.
    pub environment: bool,
    /// The lens; `None`: a pinhole, or parallel rays.
    pub lens: Option<LensReport>,
    /// Which backend and why.
    pub accel: AccelReport,
    /// SIMD lanes that shaded: 1, 8 or 16.
    pub lanes: u32,
    /// Said to the user and written into the JSON.
    pub warnings: Vec<String>,
    /// Those of `warnings` that mean that something of the scene is not in the picture.
    pub losses: Vec<String>,
}

/// Samples that are not as many in every pixel: decided after `stage` of each, by the noise of the pixels around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpreadReport {
    /// Samples of each pixel before.
    pub stage: u32,
    /// Waves since; with the stage it says how many samples each pixel has.
    pub round: u32,
    /// Samples of the pixels with fewest.
    pub least: u32,
    /// Samples of the pixels with most.
    pub most: u32,
    /// The share of the work that it was thought to take.
    pub gain: f64,
}

/// How near a picture came to the error that was asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetReport {
    /// What was asked for: sqrt(relMSE).
    pub target: f64,
    /// The upper end of the interval is at most that. A black picture has no error and is taken as it is: true.
    pub is_met: bool,
    /// Share of the pixels in parts of the picture whose error is above it; `None` for a black picture.
    pub above: Option<f64>,
    /// About how many samples a pixel it takes; `None` for a black picture.
    pub spp_needed: Option<f64>,
}

/// A rendered picture. `pixels` covers `window` only, row by row from the top.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Size of the whole picture.
    pub width: u32,
    /// Size of the whole picture.
    pub height: u32,
    /// The part that was rendered (the whole picture without `--crop`).
    pub window: CropWindow,
    /// `[window.height * window.width]` linear Rec.709 radiance, nits; alpha is 1.
    pub pixels: Vec<[f32; 3]>,
    /// Samples per pixel that were taken; the mean, rounded, where they are spread unevenly.
    pub spp: u32,
    /// `[window.height * window.width]` variance of each channel of the pixel, if that was asked for: on the safe side,
    /// infinite with one sample.
    pub variance: Option<Vec<[f32; 3]>>,
    /// `[window.height * window.width]` samples in each pixel, if that was asked for: fewer than `spp` where some were
    /// dropped.
    pub samples: Option<Vec<u32>>,
    /// For the EXR's matrices.
    pub camera: FrameCamera,
    /// Counts and times.
    pub stats: RenderStats,
}
