//! Vectors over lanes, frames, ray origins, hashing of random numbers' keys. glam serves everything scalar.

mod frame;
pub mod lanes;
pub mod origin;

pub use frame::Frame;
pub use lanes::V3;
