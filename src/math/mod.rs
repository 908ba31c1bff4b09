//! Vectors over lanes, frames, angles, discrete distributions, shading normals kept usable, rounding bounds and ray
//! origins, random numbers for what tests and measures. glam serves everything scalar.

pub mod angle;
pub mod bend;
pub mod distribution;
mod frame;
pub mod lanes;
pub mod random;
pub mod robust;
mod uv;

pub use frame::Frame;
pub use lanes::V3;
pub use uv::{MAX_UV_SETS, UvSets};
