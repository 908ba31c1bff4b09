//! Geometries: what can be attached to a scene. Each kind has a file of its own and owns, like the
//! triangle mesh does, whatever Embree keeps pointers to.

mod instance;
mod triangles;
mod user;

pub use instance::{Affine, InstanceArrayGeometry, InstanceGeometry};
pub use triangles::TriangleGeometry;
pub(crate) use user::{BoundsFunction, UserFunction};
pub use user::{UserGeometry, UserHit, UserShapes};

use std::ffi::c_int;
use std::ptr::NonNull;
use std::sync::Arc;

use crate::device::Device;
use crate::error::Error;
use crate::raw::{Api, MAX_TIME_STEPS, RtcGeometry};

/// The number of a geometry in its scene, as hits report it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GeometryId(pub u32);

/// What can be attached to a scene.
#[derive(Debug)]
#[non_exhaustive]
pub enum Geometry {
    /// A triangle mesh.
    Triangles(TriangleGeometry),
    /// Another scene at one place.
    Instance(InstanceGeometry),
    /// Another scene at many places.
    InstanceArray(InstanceArrayGeometry),
    /// Shapes that the program intersects itself.
    User(UserGeometry),
}

impl Geometry {
    pub(crate) fn handle(&self) -> &GeometryHandle {
        match self {
            Self::Triangles(mesh) => &mesh.handle,
            Self::Instance(instance) => &instance.handle,
            Self::InstanceArray(instances) => &instances.handle,
            Self::User(shapes) => &shapes.handle,
        }
    }

    /// Whether a query may call back into the program.
    pub(crate) fn has_callbacks(&self) -> bool {
        match self {
            Self::Triangles(mesh) => mesh.has_filter(),
            Self::Instance(instance) => instance.scene().has_callbacks(),
            Self::InstanceArray(instances) => instances.scene().has_callbacks(),
            Self::User(_) => true,
        }
    }

    /// Whether a scene with this geometry can no longer be instanced.
    pub(crate) fn is_instance(&self) -> bool {
        matches!(self, Self::Instance(_) | Self::InstanceArray(_))
    }
}

impl From<TriangleGeometry> for Geometry {
    fn from(mesh: TriangleGeometry) -> Self {
        Self::Triangles(mesh)
    }
}

impl From<InstanceGeometry> for Geometry {
    fn from(instance: InstanceGeometry) -> Self {
        Self::Instance(instance)
    }
}

impl From<InstanceArrayGeometry> for Geometry {
    fn from(instances: InstanceArrayGeometry) -> Self {
        Self::InstanceArray(instances)
    }
}

impl From<UserGeometry> for Geometry {
    fn from(shapes: UserGeometry) -> Self {
        Self::User(shapes)
    }
}

/// An owned `RTCGeometry` and the device that it was made on.
pub(crate) struct GeometryHandle {
    pub(crate) raw: NonNull<RtcGeometry>,
    pub(crate) device: Arc<Device>,
}

// SAFETY: the handle may be used from any thread, and nothing uses it through a shared reference
// but `Scene::attach`, which owns the geometry.
unsafe impl Send for GeometryHandle {}
// SAFETY: as above.
unsafe impl Sync for GeometryHandle {}

impl GeometryHandle {
    /// A geometry of `kind`, one of the `GEOMETRY_TYPE` constants.
    fn new(device: &Arc<Device>, kind: c_int) -> Result<Self, Error> {
        device.clear_error();
        let lock = device.lock();
        // SAFETY: the device handle is valid, and the lock keeps other threads away from it.
        let raw = unsafe { (device.api().new_geometry)(device.handle(), kind) };
        drop(lock);
        let raw = device.check_handle(raw, "rtcNewGeometry")?;
        Ok(Self { raw, device: Arc::clone(device) })
    }

    fn raw(&self) -> *mut RtcGeometry {
        self.raw.as_ptr()
    }

    fn api(&self) -> &Api {
        self.device.api()
    }

    /// Says how many keys follow. One is what a new geometry has.
    fn set_time_steps(&self, count: usize) -> Result<(), Error> {
        if count == 1 {
            return Ok(());
        }
        // The caller has been through `check_keys`.
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        // SAFETY: the handle is valid and nobody else has it yet.
        unsafe { (self.api().set_geometry_time_step_count)(self.raw(), count) };
        self.device.check("rtcSetGeometryTimeStepCount")
    }

    /// Rays meet the geometry if their mask and this one have a bit in common.
    fn set_mask(&mut self, mask: u32) -> Result<(), Error> {
        self.device.clear_error();
        // SAFETY: the handle is valid; `&mut` says that it is in no scene yet.
        unsafe { (self.api().set_geometry_mask)(self.raw(), mask) };
        self.device.check("rtcSetGeometryMask")?;
        self.commit()
    }

    /// Ends a round of changes.
    fn commit(&self) -> Result<(), Error> {
        // SAFETY: the handle is valid and nobody else has it yet.
        unsafe { (self.api().commit_geometry)(self.raw()) };
        self.device.check("rtcCommitGeometry")
    }
}

impl Drop for GeometryHandle {
    fn drop(&mut self) {
        // SAFETY: this struct owns one reference to the handle.
        unsafe { (self.device.api().release_geometry)(self.raw.as_ptr()) }
    }
}

impl std::fmt::Debug for GeometryHandle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("GeometryHandle").field(&self.raw).finish()
    }
}

fn check_count(what: &'static str, count: usize, limit: usize) -> Result<(), Error> {
    if count > limit { Err(Error::TooMany { what, count, limit }) } else { Ok(()) }
}

/// Whether `count` is a possible number of keys.
fn check_keys(count: usize) -> Result<(), Error> {
    if count == 0 {
        return Err(Error::NoKeys);
    }
    check_count("time keys", count, MAX_TIME_STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_many_items_are_an_error_that_names_the_limit() {
        assert_eq!(check_count("vertices", 3, 3), Ok(()));
        let error = check_count("vertices", 4, 3).unwrap_err();
        assert_eq!(error.to_string(), "4 vertices in one geometry, at most 3 are possible; split it");
    }

    #[test]
    fn no_key_and_too_many_keys_are_errors() {
        assert_eq!(check_keys(0), Err(Error::NoKeys));
        assert_eq!((check_keys(1), check_keys(129)), (Ok(()), Ok(())));
        assert_eq!(check_keys(130), Err(Error::TooMany { what: "time keys", count: 130, limit: 129 }));
    }
}
