//! Cameras as described by the file.

mod aperture;
mod filter;
mod lens;
mod look_at;
mod rays;

pub use filter::{FilterShape, PixelFilter};
pub use lens::{Lens, ThinLens};
pub use look_at::{NoView, look_at};
pub use rays::CameraRays;

use glam::DMat4;

/// A camera with its place; looks along its local -Z, +Y up.
#[derive(Clone, Debug)]
pub struct Camera {
    /// The camera's name, else its node's; may be empty.
    pub name: String,
    /// Rigid: rotation and translation (metres) of the node, scale removed.
    pub world_from_camera: DMat4,
    /// How points become pixels.
    pub projection: Projection,
    /// What is said of its lens.
    pub lens: Lens,
}

/// How points become pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole.
    Perspective {
        /// Vertical field of view, radians, in (0, pi).
        yfov: f64,
        /// Width over height as the file has it; yields to the picture's own size.
        aspect_ratio: Option<f64>,
    },
    /// Parallel rays.
    Orthographic {
        /// Half of the width of what is seen, metres, > 0; yields to the picture's own shape.
        xmag: f64,
        /// Half of the height of what is seen, metres, > 0.
        ymag: f64,
    },
}
