//! Embree's C interface as far as this crate calls it: handles, constants, argument structs and the
//! table of functions. To use one more function, add a line to the table; everything else follows.
//!
//! Written from the public API documentation of Embree 4.4.0. The ray and hit structs, which are part
//! of the same interface, are in `ray.rs` because callers fill them.

use std::ffi::{c_char, c_int, c_void};
use std::mem::{align_of, offset_of, size_of};
use std::ptr::null_mut;

use crate::filter::FilterFunction;
use crate::geometry::{BoundsFunction, UserFunction};
use crate::ray::{Ray, RayHit, RayHitPacket, RayPacket};

/// What an `RTCDevice` points to.
#[repr(C)]
pub(crate) struct RtcDevice {
    _opaque: [u8; 0],
}

/// What an `RTCScene` points to.
#[repr(C)]
pub(crate) struct RtcScene {
    _opaque: [u8; 0],
}

/// What an `RTCGeometry` points to.
#[repr(C)]
pub(crate) struct RtcGeometry {
    _opaque: [u8; 0],
}

/// `RTC_INVALID_GEOMETRY_ID`, which also marks "no instance" and, in this crate, "no primitive".
pub(crate) const INVALID_ID: u32 = u32::MAX;

/// `RTCDeviceProperty` values.
pub(crate) mod property {
    use std::ffi::c_int;

    pub(crate) const VERSION: c_int = 0;
    pub(crate) const NATIVE_RAY8_SUPPORTED: c_int = 33;
    pub(crate) const NATIVE_RAY16_SUPPORTED: c_int = 34;
    pub(crate) const TRIANGLE_GEOMETRY_SUPPORTED: c_int = 96;
}

/// `RTCSceneFlags` bits.
pub(crate) mod scene_flag {
    pub(crate) const COMPACT: u32 = 1 << 1;
    pub(crate) const ROBUST: u32 = 1 << 2;
}

/// `RTCRayQueryFlags` bits.
pub(crate) mod query_flag {
    pub(crate) const INCOHERENT: u32 = 0;
    pub(crate) const COHERENT: u32 = 1 << 16;
}

pub(crate) const GEOMETRY_TYPE_TRIANGLE: c_int = 0;
pub(crate) const GEOMETRY_TYPE_USER: c_int = 120;
pub(crate) const GEOMETRY_TYPE_INSTANCE: c_int = 121;
pub(crate) const GEOMETRY_TYPE_INSTANCE_ARRAY: c_int = 122;
pub(crate) const BUFFER_TYPE_INDEX: c_int = 0;
pub(crate) const BUFFER_TYPE_VERTEX: c_int = 1;
pub(crate) const BUFFER_TYPE_TRANSFORM: c_int = 23;
pub(crate) const FORMAT_UINT3: c_int = 0x5003;
pub(crate) const FORMAT_FLOAT3: c_int = 0x9003;
pub(crate) const FORMAT_FLOAT3X4_COLUMN_MAJOR: c_int = 0x9234;
/// `RTC_MAX_TIME_STEP_COUNT`.
pub(crate) const MAX_TIME_STEPS: usize = 129;

/// `RTC_FEATURE_FLAG_ALL`. CPU devices ignore the feature mask; it is there for GPUs.
const FEATURE_ALL: u32 = u32::MAX;

/// `RTCErrorFunction`.
pub(crate) type ErrorFunction = unsafe extern "C" fn(*mut c_void, c_int, *const c_char);

/// `RTCMemoryMonitorFunction`.
pub(crate) type MemoryFunction = unsafe extern "C" fn(*mut c_void, isize, bool) -> bool;

/// `RTCBounds`: an axis-aligned box, each corner padded to 16 bytes.
#[repr(C, align(16))]
#[derive(Default)]
pub(crate) struct Bounds {
    pub(crate) lower: [f32; 3],
    pub(crate) align0: f32,
    pub(crate) upper: [f32; 3],
    pub(crate) align1: f32,
}

/// `RTCIntersectArguments` and `RTCOccludedArguments`, which differ only in the type of the last
/// callback. `reserved` covers `minWidthDistanceFactor`, which a library built with
/// `EMBREE_MIN_WIDTH` reads after the last pointer; zero switches it off.
#[repr(C)]
pub(crate) struct QueryArguments {
    flags: u32,
    feature_mask: u32,
    /// Always null: the struct behind it differs with the number of instance levels the library was
    /// built for, and Embree makes its own when it is null.
    context: *mut c_void,
    filter: *mut c_void,
    callback: *mut c_void,
    reserved: [u64; 2],
}

impl QueryArguments {
    /// Arguments without callbacks; `flags` are `query_flag` bits.
    pub(crate) const fn new(flags: u32) -> Self {
        Self {
            flags,
            feature_mask: FEATURE_ALL,
            context: null_mut(),
            filter: null_mut(),
            callback: null_mut(),
            reserved: [0; 2],
        }
    }
}

const _: () = {
    assert!(size_of::<Bounds>() == 32 && align_of::<Bounds>() == 16);
    assert!(offset_of!(Bounds, lower) == 0);
    assert!(offset_of!(Bounds, align0) == 12);
    assert!(offset_of!(Bounds, upper) == 16);
    assert!(offset_of!(Bounds, align1) == 28);
    assert!(size_of::<c_int>() == 4);
};

#[cfg(target_pointer_width = "64")]
const _: () = {
    assert!(size_of::<QueryArguments>() == 48 && align_of::<QueryArguments>() == 8);
    assert!(offset_of!(QueryArguments, flags) == 0);
    assert!(offset_of!(QueryArguments, feature_mask) == 4);
    assert!(offset_of!(QueryArguments, context) == 8);
    assert!(offset_of!(QueryArguments, filter) == 16);
    assert!(offset_of!(QueryArguments, callback) == 24);
    assert!(offset_of!(QueryArguments, reserved) == 32);
};

#[cfg(not(target_pointer_width = "64"))]
compile_error!("embree4-rs supports 64-bit targets only, as Embree 4 does");

/// Declares a struct of function pointers and how to fill it from an opened library. Those under
/// `optional` may be missing.
macro_rules! function_table {
    (
        $(#[$table_doc:meta])* $table:ident
        required { $($field:ident = $symbol:literal: fn($($arg:ty),*) $(-> $ret:ty)?;)* }
        optional { $($opt_field:ident = $opt_symbol:literal: fn($($opt_arg:ty),*) $(-> $opt_ret:ty)?;)* }
    ) => {
        $(#[$table_doc])*
        pub(crate) struct $table {
            $(pub(crate) $field: unsafe extern "C" fn($($arg),*) $(-> $ret)?,)*
            $(pub(crate) $opt_field: Option<unsafe extern "C" fn($($opt_arg),*) $(-> $opt_ret)?>,)*
        }

        impl $table {
            /// The functions of `library`, or the name of the first one that it lacks.
            ///
            /// # Safety
            /// Symbols of these names must have Embree 4's signatures, and the library must stay
            /// loaded for as long as the table is used.
            pub(crate) unsafe fn load(library: &libloading::Library) -> Result<Self, &'static str> {
                Ok(Self {
                    $($field: {
                        // SAFETY: the caller vouches for the signature.
                        let symbol = unsafe { library.get($symbol.as_bytes()) };
                        *symbol.map_err(|_| $symbol)?
                    },)*
                    $($opt_field: {
                        // SAFETY: the caller vouches for the signature.
                        let symbol = unsafe { library.get($opt_symbol.as_bytes()) };
                        symbol.ok().map(|symbol| *symbol)
                    },)*
                })
            }
        }
    };
}

function_table! {
    /// The few functions that Embree 3 has with the same signatures: enough to ask for the version.
    VersionApi
    required {
        new_device = "rtcNewDevice": fn(*const c_char) -> *mut RtcDevice;
        release_device = "rtcReleaseDevice": fn(*mut RtcDevice);
        get_device_property = "rtcGetDeviceProperty": fn(*mut RtcDevice, c_int) -> isize;
        get_device_error = "rtcGetDeviceError": fn(*mut RtcDevice) -> c_int;
    }
    optional {
        // since 4.3.3
        get_device_last_error_message = "rtcGetDeviceLastErrorMessage": fn(*mut RtcDevice) -> *const c_char;
    }
}

function_table! {
    /// Everything else that this crate calls.
    Api
    required {
        set_device_error_function = "rtcSetDeviceErrorFunction": fn(*mut RtcDevice, Option<ErrorFunction>, *mut c_void);
        set_device_memory_monitor_function = "rtcSetDeviceMemoryMonitorFunction":
            fn(*mut RtcDevice, Option<MemoryFunction>, *mut c_void);

        new_geometry = "rtcNewGeometry": fn(*mut RtcDevice, c_int) -> *mut RtcGeometry;
        release_geometry = "rtcReleaseGeometry": fn(*mut RtcGeometry);
        set_shared_geometry_buffer = "rtcSetSharedGeometryBuffer":
            fn(*mut RtcGeometry, c_int, u32, c_int, *const c_void, usize, usize, usize);
        set_geometry_time_step_count = "rtcSetGeometryTimeStepCount": fn(*mut RtcGeometry, u32);
        set_geometry_mask = "rtcSetGeometryMask": fn(*mut RtcGeometry, u32);
        set_geometry_instanced_scene = "rtcSetGeometryInstancedScene": fn(*mut RtcGeometry, *mut RtcScene);
        set_geometry_transform = "rtcSetGeometryTransform": fn(*mut RtcGeometry, u32, c_int, *const c_void);
        set_geometry_user_data = "rtcSetGeometryUserData": fn(*mut RtcGeometry, *mut c_void);
        set_geometry_intersect_filter_function = "rtcSetGeometryIntersectFilterFunction":
            fn(*mut RtcGeometry, Option<FilterFunction>);
        set_geometry_occluded_filter_function = "rtcSetGeometryOccludedFilterFunction":
            fn(*mut RtcGeometry, Option<FilterFunction>);
        set_geometry_user_primitive_count = "rtcSetGeometryUserPrimitiveCount": fn(*mut RtcGeometry, u32);
        set_geometry_bounds_function = "rtcSetGeometryBoundsFunction":
            fn(*mut RtcGeometry, Option<BoundsFunction>, *mut c_void);
        set_geometry_intersect_function = "rtcSetGeometryIntersectFunction": fn(*mut RtcGeometry, Option<UserFunction>);
        set_geometry_occluded_function = "rtcSetGeometryOccludedFunction": fn(*mut RtcGeometry, Option<UserFunction>);
        commit_geometry = "rtcCommitGeometry": fn(*mut RtcGeometry);

        new_scene = "rtcNewScene": fn(*mut RtcDevice) -> *mut RtcScene;
        release_scene = "rtcReleaseScene": fn(*mut RtcScene);
        set_scene_flags = "rtcSetSceneFlags": fn(*mut RtcScene, u32);
        set_scene_build_quality = "rtcSetSceneBuildQuality": fn(*mut RtcScene, c_int);
        attach_geometry = "rtcAttachGeometry": fn(*mut RtcScene, *mut RtcGeometry) -> u32;
        attach_geometry_by_id = "rtcAttachGeometryByID": fn(*mut RtcScene, *mut RtcGeometry, u32);
        commit_scene = "rtcCommitScene": fn(*mut RtcScene);
        get_scene_bounds = "rtcGetSceneBounds": fn(*mut RtcScene, *mut Bounds);

        intersect1 = "rtcIntersect1": fn(*mut RtcScene, *mut RayHit, *mut QueryArguments);
        intersect8 = "rtcIntersect8": fn(*const c_int, *mut RtcScene, *mut RayHitPacket<8>, *mut QueryArguments);
        intersect16 = "rtcIntersect16": fn(*const c_int, *mut RtcScene, *mut RayHitPacket<16>, *mut QueryArguments);
        occluded1 = "rtcOccluded1": fn(*mut RtcScene, *mut Ray, *mut QueryArguments);
        occluded8 = "rtcOccluded8": fn(*const c_int, *mut RtcScene, *mut RayPacket<8>, *mut QueryArguments);
        occluded16 = "rtcOccluded16": fn(*const c_int, *mut RtcScene, *mut RayPacket<16>, *mut QueryArguments);
    }
    optional {}
}
