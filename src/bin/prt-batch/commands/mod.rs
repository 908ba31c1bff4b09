//! One file per command.

pub mod compare;
pub mod render;
