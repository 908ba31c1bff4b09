//! What a picture depends on beside the scene.

use super::stopping::Stopping;
pub use crate::camera::FilterShape;
use crate::camera::Lens;
pub use crate::integrator::Integrator;
pub use crate::material::energy::Brdf;
use std::path::PathBuf;

/// Which ray backend.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AccelChoice {
    /// Embree if its library is found, else our BVH.
    #[default]
    Auto,
    /// Embree or an error.
    Embree,
    /// Our own BVH.
    Bvh,
    /// Brute force, for tests.
    Linear,
}

/// When the built-in studio lights a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DefaultLight {
    /// Where the scene has no light of its own and hardly emits any.
    #[default]
    Auto,
    /// Beside whatever lights there are.
    On,
    /// Never.
    Off,
}

/// Pixel filter, sampled by importance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    /// Its shape.
    pub shape: FilterShape,
    /// Full support, pixels, > 0.
    pub width: f32,
}

impl Default for Filter {
    fn default() -> Self {
        Self { shape: FilterShape::Tent, width: 2.0 }
    }
}

/// A window of the picture in pixels, origin top left, y down; inside the picture and not empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CropWindow {
    /// Left edge.
    pub x: u32,
    /// Top edge.
    pub y: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

/// What there may be of each pixel beside its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layers {
    /// The variance of the pixel's mean.
    pub variance: bool,
    /// How many samples are in it.
    pub samples: bool,
}

impl Layers {
    /// Bytes a pixel.
    pub(super) fn bytes(self) -> u64 {
        12 * u64::from(self.variance) + 4 * u64::from(self.samples)
    }
}

/// Settings of one frame.
#[derive(Clone, Debug)]
pub struct RenderSettings {
    /// Pixels across, >= 1.
    pub width: u32,
    /// Pixels down, >= 1.
    pub height: u32,
    /// Render only this window; its pixels equal those of the whole picture.
    pub crop: Option<CropWindow>,
    /// Samples per pixel, >= 1; the most if `stopping` leaves their number open.
    pub spp: u32,
    /// What may end sampling before that.
    pub stopping: Stopping,
    /// With a target of the error and no limit of time, pixels may get different numbers of samples.
    pub adaptive: bool,
    /// Same seed, same pixels.
    pub seed: u64,
    /// Animation frame number; part of the random numbers.
    pub frame: u32,
    /// What is computed.
    pub integrator: Integrator,
    /// What of the lens is to be another than the camera's own.
    pub lens: Lens,
    /// A point that a lens is focused on, world space, metres, in place of a distance.
    pub focus_point: Option<glam::DVec3>,
    /// Scatterings after the first; `None` = roulette alone ends paths (safety cap [`RenderSettings::bounce_cap`]).
    pub max_bounces: Option<u32>,
    /// Camera rays pass single-sided surfaces from behind; other rays do not.
    pub cull_backfaces: bool,
    /// Textures are averaged over cones around the paths; biased.
    pub texture_lod: bool,
    /// What a contribution of light is at most after two scatterings or more, cd/m^2 of its largest channel, above 0; biased.
    pub clamp: Option<f32>,
    /// Pixel filter.
    pub filter: Filter,
    /// Microfacet model.
    pub brdf: Brdf,
    /// Built-in studio light.
    pub default_light: DefaultLight,
    /// Point and spot lights are balls of this radius, metres, in `[0, 1e6]`; 0: without size.
    pub light_radius: f64,
    /// Directional lights are suns of this angular diameter, degrees, in `[0, 180]`; 0: without size.
    pub sun_angle: f64,
    /// What is to be had beside the picture; changes none of its bytes.
    pub layers: Layers,
    /// Ray backend.
    pub accel: AccelChoice,
    /// Folders in which libembree4 is looked for, after `EMBREE_DIR` and before the system's.
    pub embree_dirs: Vec<PathBuf>,
    /// Worker threads; `None` = those of the current rayon pool. Does not change a byte of the picture.
    pub threads: Option<usize>,
    /// SIMD lanes for shading (1, 8, 16); `None` = the most this CPU has. For tests.
    pub lanes: Option<u32>,
}

impl RenderSettings {
    /// Scatterings at which a path is cut whatever roulette says; the share of paths cut is reported.
    pub const BOUNCE_CAP: u32 = 1024;

    /// Scatterings at which a path is cut without `max_bounces`: nothing ends the branches of Whitted's tracer in a box of
    /// mirrors.
    pub fn bounce_cap(&self) -> u32 {
        if self.integrator == Integrator::Whitted { 64 } else { Self::BOUNCE_CAP }
    }
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            crop: None,
            spp: 64,
            stopping: Stopping::default(),
            adaptive: true,
            seed: 0,
            frame: 0,
            integrator: Integrator::Path,
            lens: Lens::default(),
            focus_point: None,
            max_bounces: None,
            cull_backfaces: false,
            texture_lod: false,
            clamp: None,
            filter: Filter::default(),
            brdf: Brdf::default(),
            default_light: DefaultLight::default(),
            light_radius: 0.0,
            sun_angle: 0.0,
            layers: Layers::default(),
            accel: AccelChoice::default(),
            embree_dirs: Vec::new(),
            threads: None,
            lanes: None,
        }
    }
}
