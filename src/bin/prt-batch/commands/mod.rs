//! One file per command.

pub mod bench_rays;
pub mod compare;
pub mod doctor;
pub mod explain;
mod exr_files;
pub mod render;
pub mod retone;
pub mod verify;
mod verify_light;
mod verify_materials;
mod verify_shapes;
