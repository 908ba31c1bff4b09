//! Embree 4 for Rust, loaded at run time.
//!
//! Nothing is linked: [`Library::find`] opens an Embree 4 shared library if there is one and says
//! why not if there is none, so a program can fall back to a ray kernel of its own. A library is used only
//! after probe rays have shown that its hits have a known layout in memory.
//!
//! ```no_run
//! use embree4_rs::{BuildQuality, Device, Library, Ray, Scene, SceneFlags, TriangleGeometry};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let library = Library::find(&[".embree"])?;
//! let device = Device::new(&library, "threads=1")?;
//! let mut scene = Scene::new(&device, SceneFlags::ROBUST, BuildQuality::Medium)?;
//! let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! scene.attach(TriangleGeometry::new(&device, positions, vec![[0, 1, 2]])?)?;
//! let scene = scene.commit()?;
//!
//! let ray = Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]);
//! assert_eq!(scene.intersect1(&ray).map(|hit| hit.t), Some(1.0));
//! # Ok(())
//! # }
//! ```
//!
//! # What keeps it sound
//!
//! - Only a [`CommittedScene`] has queries, and it no longer changes.
//! - What Embree keeps pointers to is owned by the geometry, and a scene owns its geometries.
//! - Indices are checked before Embree sees them.
//! - Hit structs have room for longer layouts than are accepted.
//! - Rays that are not finite never reach Embree; they miss.
//! - The floating-point environment of the calling thread is as before after every call.

#![deny(unsafe_op_in_unsafe_fn)]

mod batch;
mod callback;
mod device;
mod error;
mod filter;
mod geometry;
mod library;
mod probe;
mod query;
mod raw;
mod ray;
mod scene;

pub use batch::{HitsSoAMut, RaysSoA};
pub use device::Device;
pub use error::{Error, ErrorCode, LoadError, Reason, Refusal, Version};
pub use filter::{Candidate, Filter};
pub use geometry::{Affine, Geometry, GeometryId, InstanceArrayGeometry, InstanceGeometry, TriangleGeometry};
pub use geometry::{UserGeometry, UserHit, UserShapes};
pub use library::Library;
pub use probe::HitLayout;
pub use query::Coherence;
pub use ray::{Hit, HitPacket, Mask, Mask8, Mask16, Ray, Ray8, Ray16, RayHit8, RayHit16, RayHitPacket, RayPacket};
pub use scene::{BuildQuality, CommittedScene, Scene, SceneFlags};
