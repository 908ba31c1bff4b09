//! User geometry: shapes that Embree only knows the boxes of, and a program intersects itself.

use std::any::Any;
use std::ffi::{c_int, c_void};
use std::mem::{align_of, offset_of, size_of};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Mutex, PoisonError};

use super::{GeometryHandle, check_count, check_keys};
use crate::callback::{Lanes, Rows, guarded, hit_row, ray_row};
use crate::device::Device;
use crate::error::Error;
use crate::probe::HitLayout;
use crate::raw::{Bounds, GEOMETRY_TYPE_USER};
use crate::ray::Ray;

/// `u32::MAX` marks a miss.
const MAX_SHAPES: usize = u32::MAX as usize - 1;

/// Shapes that Embree puts in its tree by their boxes and asks about single rays.
///
/// All methods may be called from any thread, `bounds` by the threads that build, the others by those that
/// query. A panic in a query is treated as a [`Filter`](crate::Filter)'s is; one in `bounds` comes out of
/// [`Scene::commit`](crate::Scene::commit).
pub trait UserShapes: Send + Sync {
    /// How many shapes there are. Asked once.
    fn len(&self) -> usize;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// At how many equally spaced times from 0 to 1 boxes are asked for; in between Embree interpolates them, so
    /// the boxes of a shape that does not move along a line must have room. Asked once; 1 for shapes at rest.
    fn time_steps(&self) -> usize {
        1
    }

    /// The lower and the upper corner of a box around shape `primitive` at `time`, one of
    /// [`UserShapes::time_steps`] times (0 if there is one). The shape is never hit if there is none at any
    /// time, or one that is not finite, is beyond 1.844e18 or upside down. May be asked more than once.
    fn bounds(&self, primitive: u32, time: f32) -> Option<[[f32; 3]; 2]>;

    /// Where `ray` first meets shape `primitive` with `t` in [`t_min`, `t_max`]; a hit outside of that, or a `t`
    /// that is NaN, is taken as none. Within an instance the ray is in object space, with the same `t`.
    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<UserHit>;

    /// Whether `ray` meets shape `primitive` anywhere with `t` in [`t_min`, `t_max`].
    fn occluded(&self, primitive: u32, ray: &Ray) -> bool {
        self.intersect(primitive, ray).is_some_and(|hit| hit.is_on(ray))
    }
}

/// Where a ray meets a user shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UserHit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Comes out as the hit's `u`.
    pub u: f32,
    /// Comes out as the hit's `v`.
    pub v: f32,
}

impl UserHit {
    fn is_on(&self, ray: &Ray) -> bool {
        (ray.t_min..=ray.t_max).contains(&self.t)
    }
}

/// Shapes of a program's own. Hits report the shape as `primitive` and a zero `ng`.
pub struct UserGeometry {
    // Before what Embree has a pointer to: it lets go of it first.
    pub(super) handle: GeometryHandle,
    /// An `Arc` because a `Box` may not move while Embree has its address.
    data: Arc<UserData>,
}

/// What the user pointer points to.
struct UserData {
    shapes: Arc<dyn UserShapes>,
    layout: HitLayout,
    time_steps: usize,
    /// The first panic in `bounds`, which Embree may call in threads of its own.
    build_panic: Mutex<Option<Box<dyn Any + Send>>>,
}

impl UserGeometry {
    /// A geometry of `shapes`. More than `u32::MAX - 1` shapes, or time steps outside of 1 to 129, are an error.
    pub fn new(device: &Arc<Device>, shapes: Arc<dyn UserShapes>) -> Result<Self, Error> {
        let (count, time_steps) = (shapes.len(), shapes.time_steps());
        check_count("shapes", count, MAX_SHAPES)?;
        check_keys(time_steps)?;
        let count = u32::try_from(count).expect("the count was checked");
        let layout = device.library().hit_layout();
        let data = Arc::new(UserData { shapes, layout, time_steps, build_panic: Mutex::new(None) });

        let handle = GeometryHandle::new(device, GEOMETRY_TYPE_USER)?;
        handle.set_time_steps(time_steps)?;
        let (api, raw, user) = (device.api(), handle.raw(), Arc::as_ptr(&data).cast_mut().cast());
        // SAFETY: the handle is valid and in no scene yet, so nothing calls back now; the functions take what
        // the user pointer points to, which the geometry keeps until Embree has let go of it.
        unsafe {
            (api.set_geometry_user_data)(raw, user);
            (api.set_geometry_user_primitive_count)(raw, count);
            (api.set_geometry_bounds_function)(raw, Some(ask_bounds), user);
            (api.set_geometry_intersect_function)(raw, Some(ask_intersect));
            (api.set_geometry_occluded_function)(raw, Some(ask_occluded));
        }
        device.check("rtcSetGeometryIntersectFunction")?;
        handle.commit()?;
        Ok(Self { handle, data })
    }

    /// The shapes.
    pub fn shapes(&self) -> &Arc<dyn UserShapes> {
        &self.data.shapes
    }

    /// Lets only rays meet the shapes whose mask has a bit in common with `mask`. All bits are set at first.
    pub fn set_mask(&mut self, mask: u32) -> Result<(), Error> {
        self.handle.set_mask(mask)
    }

    /// Goes on with the panic of a `bounds` of the build that has just returned, if there was one.
    pub(crate) fn resume_build_panic(&self) {
        if let Some(payload) = self.data.take_panic() {
            resume_unwind(payload);
        }
    }
}

impl std::fmt::Debug for UserGeometry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("UserGeometry").field("handle", &self.handle).finish_non_exhaustive()
    }
}

impl UserData {
    fn take_panic(&self) -> Option<Box<dyn Any + Send>> {
        self.build_panic.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// The box that Embree gets, the empty one for a shape that is never hit.
    fn bounds(&self, primitive: u32, step: u32) -> Bounds {
        let time = if self.time_steps > 1 { step as f32 / (self.time_steps - 1) as f32 } else { 0.0 };
        let found = catch_unwind(AssertUnwindSafe(|| self.shapes.bounds(primitive, time)));
        let corners = found.unwrap_or_else(|payload| {
            self.build_panic.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(payload);
            None
        });
        // Embree itself looks at what is beyond 1.844e18; of NaN it sees only some.
        let is_box = |[lower, upper]: &[[f32; 3]; 2]| {
            (0..3).all(|axis| lower[axis] <= upper[axis] && lower[axis].is_finite() && upper[axis].is_finite())
        };
        let [lower, upper] = corners.filter(is_box).unwrap_or([[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]]);
        Bounds { lower, align0: 0.0, upper, align1: 0.0 }
    }
}

/// `RTCBoundsFunction`.
pub(crate) type BoundsFunction = unsafe extern "C" fn(*const BoundsArguments);

/// `RTCBoundsFunctionArguments`.
#[repr(C)]
pub(crate) struct BoundsArguments {
    user: *mut c_void,
    primitive: u32,
    time_step: u32,
    bounds: *mut Bounds,
}

/// `RTCIntersectFunctionN` and `RTCOccludedFunctionN`.
pub(crate) type UserFunction = unsafe extern "C" fn(*const UserArguments);

/// `RTCIntersectFunctionNArguments` and `RTCOccludedFunctionNArguments`, which have a ray alone where the
/// first have a ray with its hit.
#[repr(C)]
pub(crate) struct UserArguments {
    valid: *mut c_int,
    user: *mut c_void,
    primitive: u32,
    /// `RTCRayQueryContext`: for one instance level its number, then, if the hits have it, its place.
    context: *mut u32,
    rays: *mut c_void,
    width: u32,
    geometry: u32,
}

const _: () = {
    assert!(size_of::<BoundsArguments>() == 24 && align_of::<BoundsArguments>() == 8);
    assert!(offset_of!(BoundsArguments, user) == 0);
    assert!(offset_of!(BoundsArguments, primitive) == 8);
    assert!(offset_of!(BoundsArguments, time_step) == 12);
    assert!(offset_of!(BoundsArguments, bounds) == 16);
    assert!(size_of::<UserArguments>() == 48 && align_of::<UserArguments>() == 8);
    assert!(offset_of!(UserArguments, valid) == 0);
    assert!(offset_of!(UserArguments, user) == 8);
    assert!(offset_of!(UserArguments, primitive) == 16);
    assert!(offset_of!(UserArguments, context) == 24);
    assert!(offset_of!(UserArguments, rays) == 32);
    assert!(offset_of!(UserArguments, width) == 40);
    assert!(offset_of!(UserArguments, geometry) == 44);
};

/// Embree's callback for a box.
///
/// # Safety
/// Only Embree may call it, for a geometry whose user pointer is a [`UserData`].
unsafe extern "C" fn ask_bounds(arguments: *const BoundsArguments) {
    // SAFETY: Embree passes arguments that live during the call, with the user pointer that was set with this
    // function and an aligned box to be filled.
    unsafe {
        let arguments = &*arguments;
        let data = &*arguments.user.cast::<UserData>();
        arguments.bounds.write(data.bounds(arguments.primitive, arguments.time_step));
    }
}

/// Embree's callback for closest hits.
///
/// # Safety
/// As for [`ask_bounds`].
unsafe extern "C" fn ask_intersect(arguments: *const UserArguments) {
    // SAFETY: as the caller promises.
    let (arguments, data, lanes, rays) = unsafe { unpack(arguments) };
    let hits = rays.from_row(ray_row::COUNT);
    guarded((), || {
        for lane in lanes.asked() {
            let ray = ray_in(rays, lane);
            let Some(hit) = data.shapes.intersect(arguments.primitive, &ray).filter(|hit| hit.is_on(&ray)) else {
                continue;
            };
            rays.set_number(ray_row::T_MAX, lane, hit.t);
            (0..3).for_each(|axis| hits.set_number(hit_row::NG + axis, lane, 0.0));
            hits.set_number(hit_row::U, lane, hit.u);
            hits.set_number(hit_row::V, lane, hit.v);
            hits.set(hit_row::PRIMITIVE, lane, arguments.primitive);
            hits.set(hit_row::GEOMETRY, lane, arguments.geometry);
            // SAFETY: the context of a query without one of its own has the numbers of one instance level, as
            // many as the hits; more levels were refused when the library was probed.
            unsafe {
                hits.set(hit_row::INSTANCE, lane, arguments.context.read());
                if data.layout == HitLayout::InstancePrimitive {
                    hits.set(hit_row::INSTANCE_PRIMITIVE, lane, arguments.context.add(1).read());
                }
            }
        }
    });
}

/// Embree's callback for any hit.
///
/// # Safety
/// As for [`ask_bounds`].
unsafe extern "C" fn ask_occluded(arguments: *const UserArguments) {
    // SAFETY: as the caller promises.
    let (arguments, data, lanes, rays) = unsafe { unpack(arguments) };
    guarded((), || {
        for lane in lanes.asked() {
            if data.shapes.occluded(arguments.primitive, &ray_in(rays, lane)) {
                rays.set_number(ray_row::T_MAX, lane, f32::NEG_INFINITY);
            }
        }
    });
}

/// # Safety
/// `arguments` must be what Embree passes for a geometry whose user pointer is a [`UserData`], and nothing of
/// the result may be used after the callback.
unsafe fn unpack<'a>(arguments: *const UserArguments) -> (&'a UserArguments, &'a UserData, Lanes, Rows) {
    // SAFETY: the arguments live during the call; the user pointer was set with the function and outlives
    // the geometry; the packet has `width` lanes and all rows.
    unsafe {
        let arguments = &*arguments;
        let data = &*arguments.user.cast::<UserData>();
        let lanes = Lanes::new(arguments.valid, arguments.width);
        (arguments, data, lanes, Rows::new(arguments.rays, arguments.width))
    }
}

fn ray_in(rays: Rows, lane: usize) -> Ray {
    Ray {
        origin: rays.triple(ray_row::ORIGIN, lane),
        t_min: rays.number(ray_row::T_MIN, lane),
        direction: rays.triple(ray_row::DIRECTION, lane),
        time: rays.number(ray_row::TIME, lane),
        t_max: rays.number(ray_row::T_MAX, lane),
        mask: rays.word(ray_row::MASK, lane),
        id: rays.word(ray_row::ID, lane),
        flags: rays.word(ray_row::FLAGS, lane),
    }
}

#[cfg(test)]
#[path = "user_tests.rs"]
mod tests;
