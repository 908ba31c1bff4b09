//! One file per command.

pub mod compare;
mod exr_files;
pub mod render;
pub mod retone;
