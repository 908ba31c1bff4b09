//! `prt`: an offline path tracer for glTF scenes, as a library.
//!
//! A file becomes a [`scene::Scene`] (a checked description), [`render::prepare`] turns that into machinery
//! (triangle records, an [`accel::Accel`], light tables), [`render::render`] traces it and gives a
//! [`render::Frame`], and [`batch`] writes frames to files. Arrows between modules point downwards only:
//! `batch -> render -> load | integrator | film -> accel -> scene -> material, light, camera, ... -> math`.
#![forbid(unsafe_code)]

pub mod accel;
pub mod batch;
pub mod bench;
pub mod camera;
pub mod color;
pub mod compare;
pub mod error;
pub mod film;
pub mod id;
pub mod image;
pub mod integrator;
pub mod light;
pub mod load;
pub mod material;
pub mod math;
pub mod render;
pub mod sampler;
pub mod scene;
pub mod shape;
pub mod texture;
pub mod verify;

/// This program's version, as it is written into files.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
