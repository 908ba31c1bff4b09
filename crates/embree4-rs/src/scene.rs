//! Building a scene. Only what [`Scene::commit`] returns can be asked about rays.

use std::ffi::c_int;
use std::ops::BitOr;
use std::ptr::NonNull;
use std::sync::Arc;

use crate::device::Device;
use crate::error::Error;
use crate::geometry::{Geometry, GeometryId};
use crate::raw::{Bounds, INVALID_ID, RtcScene, scene_flag};

/// How a scene's tree is built and traversed; combine with `|`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneFlags(u32);

impl SceneFlags {
    /// Neither of the others.
    pub const NONE: Self = Self(0);
    /// Half the memory for less speed.
    pub const COMPACT: Self = Self(scene_flag::COMPACT);
    /// Watertight: no ray slips through a shared edge. Embree then builds `High` as `Medium`.
    pub const ROBUST: Self = Self(scene_flag::ROBUST);
}

impl BitOr for SceneFlags {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// Time spent building the tree against speed of tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildQuality {
    /// Morton codes.
    Low,
    /// Surface-area heuristic; Embree's default.
    #[default]
    Medium,
    /// With spatial splits.
    High,
}

/// A scene under construction.
#[derive(Debug)]
pub struct Scene {
    handle: SceneHandle,
}

impl Scene {
    /// An empty scene with `flags` and `quality`.
    pub fn new(device: &Arc<Device>, flags: SceneFlags, quality: BuildQuality) -> Result<Self, Error> {
        device.clear_error();
        let lock = device.lock();
        // SAFETY: the device handle is valid, and the lock keeps other threads away from it.
        let raw = unsafe { (device.api().new_scene)(device.handle()) };
        drop(lock);
        let raw = device.check_handle(raw, "rtcNewScene")?;
        let handle = SceneHandle {
            raw,
            device: Arc::clone(device),
            geometries: Vec::new(),
            has_instances: false,
            has_callbacks: false,
        };
        // SAFETY: the scene handle is valid and nobody else has it.
        unsafe { (device.api().set_scene_flags)(handle.raw(), flags.0) };
        device.check("rtcSetSceneFlags")?;
        let quality: c_int = match quality {
            BuildQuality::Low => 0,
            BuildQuality::Medium => 1,
            BuildQuality::High => 2,
        };
        // SAFETY: as above.
        unsafe { (device.api().set_scene_build_quality)(handle.raw(), quality) };
        device.check("rtcSetSceneBuildQuality")?;
        Ok(Self { handle })
    }

    /// Adds `geometry` and returns its number: 0, 1, 2 and so on.
    pub fn attach(&mut self, geometry: impl Into<Geometry>) -> Result<GeometryId, Error> {
        let geometry = geometry.into();
        let device = &self.handle.device;
        if !Arc::ptr_eq(device, &geometry.handle().device) {
            return Err(Error::OtherDevice);
        }
        device.clear_error();
        let raw = geometry.handle().raw.as_ptr();
        // SAFETY: both handles are valid and of one device; the geometry is kept until the scene is gone.
        let id = unsafe { (device.api().attach_geometry)(self.handle.raw(), raw) };
        let checked = device.check("rtcAttachGeometry");
        // Kept even after an error, in case Embree has it all the same.
        self.handle.has_instances |= geometry.is_instance();
        self.handle.has_callbacks |= geometry.has_callbacks();
        self.handle.geometries.push(geometry);
        checked?;
        if id == INVALID_ID {
            return Err(Error::NullHandle { call: "rtcAttachGeometry" });
        }
        Ok(GeometryId(id))
    }

    /// Builds the tree.
    ///
    /// Embree builds on threads of its own (`threads` in the device's configuration) and this one.
    /// It switches flush-to-zero on in this thread meanwhile, and back before it returns.
    ///
    /// A panic in a [`UserShapes::bounds`](crate::UserShapes::bounds) comes out of here.
    pub fn commit(self) -> Result<CommittedScene, Error> {
        let device = &self.handle.device;
        device.clear_error();
        // SAFETY: the scene handle is valid, and `self` is the only one to use it.
        unsafe { (device.api().commit_scene)(self.handle.raw()) };
        self.resume_build_panic();
        device.check("rtcCommitScene")?;
        let mut bounds = Bounds::default();
        // SAFETY: the scene is committed; `bounds` has the size and alignment of `RTCBounds`.
        unsafe { (device.api().get_scene_bounds)(self.handle.raw(), &mut bounds) };
        device.check("rtcGetSceneBounds")?;
        let is_empty = (0..3).any(|axis| bounds.lower[axis] > bounds.upper[axis]);
        Ok(CommittedScene { handle: self.handle, bounds: (!is_empty).then_some([bounds.lower, bounds.upper]) })
    }
}

impl Scene {
    /// Goes on with a panic that a callback of the build has left behind.
    fn resume_build_panic(&self) {
        for geometry in &self.handle.geometries {
            if let Geometry::User(shapes) = geometry {
                shapes.resume_build_panic();
            }
        }
    }
}

/// A scene with its tree, which no longer changes; any number of threads may trace rays in it.
#[derive(Debug)]
pub struct CommittedScene {
    pub(crate) handle: SceneHandle,
    bounds: Option<[[f32; 3]; 2]>,
}

impl CommittedScene {
    /// The lower and the upper corner of the box around all geometry, `None` where there is none.
    pub fn bounds(&self) -> Option<[[f32; 3]; 2]> {
        self.bounds
    }

    /// The device that the scene was made on.
    pub fn device(&self) -> &Arc<Device> {
        &self.handle.device
    }

    /// The geometry of this number.
    pub fn geometry(&self, id: GeometryId) -> Option<&Geometry> {
        self.handle.geometries.get(id.0 as usize)
    }

    /// Whether another scene is part of this one; then it cannot be instanced itself.
    pub fn has_instances(&self) -> bool {
        self.handle.has_instances
    }

    /// Whether queries may call back into the program.
    pub(crate) fn has_callbacks(&self) -> bool {
        self.handle.has_callbacks
    }
}

/// An owned `RTCScene` and all that must outlive it.
pub(crate) struct SceneHandle {
    raw: NonNull<RtcScene>,
    pub(crate) device: Arc<Device>,
    /// In the order of their numbers.
    geometries: Vec<Geometry>,
    has_instances: bool,
    has_callbacks: bool,
}

// SAFETY: the handle may be used from any thread. Through a shared reference only queries use it, on
// committed scenes, and Embree allows those from any number of threads at once.
unsafe impl Send for SceneHandle {}
// SAFETY: as above.
unsafe impl Sync for SceneHandle {}

impl SceneHandle {
    pub(crate) fn raw(&self) -> *mut RtcScene {
        self.raw.as_ptr()
    }
}

impl Drop for SceneHandle {
    fn drop(&mut self) {
        // SAFETY: this struct owns the handle; geometries and device are dropped after this.
        unsafe { (self.device.api().release_scene)(self.raw()) }
    }
}

impl std::fmt::Debug for SceneHandle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SceneHandle")
            .field("raw", &self.raw)
            .field("geometries", &self.geometries.len())
            .finish_non_exhaustive()
    }
}
