//! One file per command.

pub mod compare;
pub mod doctor;
pub mod explain;
pub mod render;
