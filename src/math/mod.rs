//! Vectors over lanes, frames, rounding bounds and ray origins. glam serves everything scalar.

mod frame;
pub mod lanes;
pub mod robust;

pub use frame::Frame;
pub use lanes::V3;
