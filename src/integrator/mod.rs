//! The path tracer as a batched wavefront: `wave` is the loop, `pool` the state of the paths, `shade` one vertex. The other
//! integrators are other vertices in the same loop: `whitted`, whose paths branch (`branches`), and `first_hit`.
//!
//! Why batches: at the same ray kernel a wavefront with SIMD shading measured 1.3 (diffuse) to 2.1 times (GGX, textures,
//! Sobol) the speed of a scalar megakernel, and the seam "a batch of rays in, a batch of hits out" is what packets want.

mod branches;
mod bulbs;
mod clamp;
mod closure;
mod cone;
mod coverage;
mod dispersion;
mod emission;
mod exact;
mod first_hit;
mod interaction;
mod kind;
mod light_sample;
mod medium;
mod miss;
mod normals;
mod pool;
mod receiver;
mod shade;
mod sized;
mod terminator;
mod through;
mod wave;
mod weight;
mod whitted;

pub use coverage::Coverage;
pub use dispersion::Spectrum;
pub use kind::Integrator;
pub use pool::POOL;
pub use wave::{Counters, SampleSink, Unit, Worker};

use crate::accel::Accel;
use crate::camera::{CameraRays, PixelFilter};
use crate::light::table::{FixedPoint, LightTable, Sources};
use crate::material::media::MediumTable;
use crate::material::table::MaterialTable;
use crate::shape::exact::table::ShapeTable;
use crate::shape::placement::PlacementTable;
use crate::shape::table::TriangleTable;
use crate::texture::lookup::TextureTable;
use simd::Level;

/// Everything shading reads, prepared and immutable.
pub struct SceneTables {
    /// Triangles with their attributes.
    pub triangles: TriangleTable,
    /// Where those of placed meshes are; empty where nothing is placed.
    pub placements: PlacementTable,
    /// What is exact, numbered above the triangles.
    pub shapes: ShapeTable,
    /// Surface parameters.
    pub materials: MaterialTable,
    /// What is inside of surfaces.
    pub media: MediumTable,
    /// Wavelengths, in scenes with dispersion.
    pub spectrum: Option<Spectrum>,
    /// Texels.
    pub textures: TextureTable,
    /// Lights with selection probabilities.
    pub lights: LightTable,
}

impl SceneTables {
    /// What light samples are read from.
    pub fn sources(&self) -> Sources<'_> {
        Sources { triangles: &self.triangles, materials: &self.materials, textures: &self.textures }
    }

    /// Whether anything that rays or light samples meet moves while the shutter is open.
    pub fn moves(&self) -> bool {
        !self.triangles.moving.is_empty() || self.placements.moves() || self.shapes.moves() || self.lights.moves()
    }

    /// Whether any surface is shaded with another normal than its triangle's.
    pub(crate) fn has_shading_normals(&self) -> bool {
        self.triangles.has_normals() || self.triangles.has_tangents() || self.materials.has_bump()
    }
}

/// A path tracer for one picture: tables, rays, settings. Shared by all workers.
pub struct PathTracer<'a> {
    /// What shading reads.
    pub tables: &'a SceneTables,
    /// What rays hit.
    pub accel: &'a dyn Accel,
    /// What stands for the lights where nothing is left to chance; empty elsewhere.
    pub lamps: Vec<FixedPoint>,
    /// Where rays start.
    pub camera: CameraRays,
    /// How film points are spread about pixel centres.
    pub filter: PixelFilter,
    /// What is computed.
    pub integrator: Integrator,
    /// Scatterings after the first.
    pub max_bounces: u32,
    /// Whether reaching `max_bounces` counts as truncation (a safety cap) and not as the user's wish.
    pub is_capped: bool,
    /// Whether camera rays pass single-sided surfaces from behind.
    pub cull_backfaces: bool,
    /// What a contribution of indirect light is at most, cd/m^2 of its largest channel (`clamp.rs`); biased.
    pub clamp: Option<f32>,
    /// Random numbers' seed.
    pub seed: u64,
    /// Frame number, part of the random numbers.
    pub frame: u32,
    /// Instructions for shading.
    pub level: Level,
}

impl PathTracer<'_> {
    /// Whether paths have a time.
    fn moves(&self) -> bool {
        self.camera.moves() || self.tables.moves()
    }
}
