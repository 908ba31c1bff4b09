//! Self-tests that a user can run: `prt-batch verify`.
//!
//! `hits` shoots rays (`rays`) at built-in meshes (`catalogue`, of `meshes`) or the user's scenes with every backend
//! (`contenders`) and holds the answers against f64 (`oracle`); `report` has counts and limits.
//!
//! `shapes` holds what rays meet of turned profiles against an oracle of its own.
//!
//! `light` renders scenes whose pixels can be written down.
//!
//! `bsdf` holds what must be true of any BSDF against a function that evaluates one and a function that samples it.

pub mod bsdf;
pub mod catalogue;
pub mod contenders;
pub mod hits;
pub mod light;
pub mod materials;
pub mod meshes;
pub mod oracle;
pub mod rays;
pub mod report;
pub mod shapes;
