//! The device: what scenes and geometries are made on, and where Embree reports errors.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr::{NonNull, null_mut};
use std::sync::atomic::{AtomicIsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::error::{Error, ErrorCode, Version};
use crate::library::{Library, device_creation_error};
use crate::raw::{Api, RtcDevice, property};

thread_local! {
    /// The words of the latest error that Embree reported in this thread, on whatever device.
    /// Per thread because Embree's error codes are, and because a callback without a pointer into
    /// the device has nothing that could dangle.
    static LAST_MESSAGE: RefCell<String> = const { RefCell::new(String::new()) };
}

/// What the memory monitor counts, in bytes.
struct Memory {
    held: AtomicIsize,
    limit: AtomicIsize,
}

/// An Embree device. Any number of scenes may share one.
pub struct Device {
    handle: NonNull<RtcDevice>,
    library: Arc<Library>,
    config: String,
    native_width: usize,
    /// Shared because Embree has its address.
    memory: Arc<Memory>,
    /// Held while a call changes the device itself, which Embree does not allow from two threads.
    building: Mutex<()>,
}

// SAFETY: the handle may be used from any thread; calls that change the device hold `building`.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl Device {
    /// A device with Embree's configuration string `config`: `key=value` pairs separated by commas,
    /// such as `threads=1`; an empty string takes Embree's defaults. A tree's bytes can depend on
    /// the number of build threads, so a program that promises equal results passes a constant.
    ///
    /// Embree skips keys that it does not know without a word. `float_exceptions` is refused: it
    /// changes the floating-point environment of the calling thread, which Rust does not allow.
    pub fn new(library: &Arc<Library>, config: &str) -> Result<Arc<Self>, Error> {
        let refuse = |problem| Error::Config { config: config.to_owned(), problem };
        if config.contains("float_exceptions") {
            return Err(refuse("must not set float_exceptions"));
        }
        let c_config = CString::new(config).map_err(|_| refuse("must not contain a NUL character"))?;
        // SAFETY: the configuration is NUL-terminated and outlives the call.
        let handle = unsafe { (library.version_api.new_device)(c_config.as_ptr()) };
        let Some(handle) = NonNull::new(handle) else {
            let call = "rtcNewDevice";
            let (code, message) = device_creation_error(&library.version_api);
            return Err(ErrorCode::from_number(code).map_or(Error::NullHandle { call }, |code| Error::Embree {
                call,
                code,
                message: format!("{message} (configuration {config:?})"),
            }));
        };
        let mut device = Self {
            handle,
            library: Arc::clone(library),
            config: config.to_owned(),
            native_width: 4,
            memory: Arc::new(Memory { held: AtomicIsize::new(0), limit: AtomicIsize::new(isize::MAX) }),
            building: Mutex::new(()),
        };
        let memory = Arc::as_ptr(&device.memory).cast_mut().cast();
        // SAFETY: the handle is valid; the callbacks never unwind; the first needs no user pointer, the
        // second's is to a counter that is dropped after the handle is released.
        unsafe {
            (device.api().set_device_memory_monitor_function)(device.handle(), Some(count_memory), memory);
            (device.api().set_device_error_function)(device.handle(), Some(keep_message), null_mut());
        }
        if device.property(property::NATIVE_RAY16_SUPPORTED) != 0 {
            device.native_width = 16;
        } else if device.property(property::NATIVE_RAY8_SUPPORTED) != 0 {
            device.native_width = 8;
        }
        device.check("rtcSetDeviceErrorFunction")?;
        Ok(Arc::new(device))
    }

    /// The library that the device belongs to.
    pub fn library(&self) -> &Arc<Library> {
        &self.library
    }

    /// The library's version.
    pub fn version(&self) -> Version {
        self.library.version()
    }

    /// The configuration that the device was made with.
    pub fn config(&self) -> &str {
        &self.config
    }

    /// Bytes that Embree has allocated for all scenes of this device: trees, not the arrays that geometries own.
    pub fn memory_bytes(&self) -> usize {
        usize::try_from(self.memory.held.load(Ordering::Relaxed)).unwrap_or(0)
    }

    /// From now on a build that would let [`Device::memory_bytes`] grow beyond `bytes` fails with
    /// [`Error::MemoryLimit`] and gives back what it had taken; `usize::MAX`, as at first, is no limit. What is there
    /// already stays.
    ///
    /// Embree takes memory in blocks of up to 2 MiB for each thread, so leave room for some.
    pub fn set_memory_limit(&self, bytes: usize) {
        self.memory.limit.store(isize::try_from(bytes).unwrap_or(isize::MAX), Ordering::Relaxed);
    }

    /// How many rays the widest packet holds that runs as one on this device: 4, 8 or 16.
    pub fn native_width(&self) -> usize {
        self.native_width
    }

    /// The instruction set that the device's kernels use: `avx512`, `avx2`, `avx`, `sse`, or `neon`.
    ///
    /// Embree does not tell it, so it follows from [`Device::native_width`]; for AVX and AVX2, which
    /// share a width, from the CPU and the configuration. A library that was itself built without
    /// AVX2 is reported as `avx2` on a CPU that has it.
    pub fn isa(&self) -> &'static str {
        #[cfg(target_arch = "x86_64")]
        {
            let asks_for_avx = self.config.split(',').any(|entry| {
                let mut parts = entry.split('=').map(str::trim);
                matches!(parts.next(), Some("isa" | "max_isa")) && parts.next() == Some("avx")
            });
            match self.native_width {
                16 => "avx512",
                8 if std::arch::is_x86_feature_detected!("avx2") && !asks_for_avx => "avx2",
                8 => "avx",
                _ => "sse",
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        "neon"
    }

    pub(crate) fn api(&self) -> &Api {
        &self.library.api
    }

    pub(crate) fn handle(&self) -> *mut RtcDevice {
        self.handle.as_ptr()
    }

    /// To be held around calls that take the device handle.
    pub(crate) fn lock(&self) -> MutexGuard<'_, ()> {
        // The lock guards no data, so a panic elsewhere leaves nothing broken behind.
        self.building.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Forgets an error that an earlier call of this thread left behind, such as a query's, so that
    /// the next [`Device::check`] does not report it as its own.
    pub(crate) fn clear_error(&self) {
        // SAFETY: the handle is valid; reading the error resets it.
        unsafe { (self.library.version_api.get_device_error)(self.handle()) };
    }

    /// The error that `call`, just made in this thread, reported.
    pub(crate) fn check(&self, call: &'static str) -> Result<(), Error> {
        // SAFETY: the handle is valid.
        let number = unsafe { (self.library.version_api.get_device_error)(self.handle()) };
        match ErrorCode::from_number(number) {
            None => Ok(()),
            Some(code) => {
                let message = LAST_MESSAGE.with(RefCell::take);
                if code == ErrorCode::OutOfMemory && message.contains("memory monitor") {
                    let limit = usize::try_from(self.memory.limit.load(Ordering::Relaxed)).unwrap_or(0);
                    return Err(Error::MemoryLimit { call, limit });
                }
                Err(Error::Embree { call, code, message })
            }
        }
    }

    /// `handle` unless it is null; the error that `call` reported comes first.
    pub(crate) fn check_handle<T>(&self, handle: *mut T, call: &'static str) -> Result<NonNull<T>, Error> {
        self.check(call)?;
        NonNull::new(handle).ok_or(Error::NullHandle { call })
    }

    fn property(&self, property: c_int) -> isize {
        // SAFETY: the handle is valid; an unknown property is an error code, not undefined.
        unsafe { (self.library.version_api.get_device_property)(self.handle(), property) }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: this struct owns the handle; what was made on it holds a reference of its own.
        unsafe { (self.library.version_api.release_device)(self.handle()) }
    }
}

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Device")
            .field("library", &self.library)
            .field("config", &self.config)
            .field("isa", &self.isa())
            .finish_non_exhaustive()
    }
}

/// Embree's error callback: keeps the words for the `check` that follows in the same thread.
unsafe extern "C" fn keep_message(_user: *mut c_void, _code: c_int, text: *const c_char) {
    let message = if text.is_null() {
        String::new()
    } else {
        // SAFETY: Embree passes null or a NUL-terminated text that lives during the call.
        unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
    };
    // Neither fails in a thread that is ending nor unwinds into C++.
    let _ = LAST_MESSAGE.try_with(|last| {
        if let Ok(mut last) = last.try_borrow_mut() {
            *last = message;
        }
    });
}

/// Embree's memory monitor: `bytes` more, or fewer if negative. `true` lets it go on. `is_done` says that they have
/// been taken already, too late to refuse them.
unsafe extern "C" fn count_memory(user: *mut c_void, bytes: isize, is_done: bool) -> bool {
    // SAFETY: `user` is the device's counter, which outlives the device handle.
    let memory = unsafe { &*user.cast::<Memory>() };
    memory.count(bytes, is_done)
}

impl Memory {
    /// Counts `bytes` and says whether Embree may go on; bytes that are refused are not counted, because Embree then
    /// does not take them.
    fn count(&self, bytes: isize, is_done: bool) -> bool {
        let held = self.held.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
        if bytes <= 0 || is_done || held <= self.limit.load(Ordering::Relaxed) {
            return true;
        }
        self.held.fetch_sub(bytes, Ordering::Relaxed);
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_beyond_the_limit_are_refused_and_not_counted() {
        let memory = Memory { held: AtomicIsize::new(0), limit: AtomicIsize::new(100) };
        let held = || memory.held.load(Ordering::Relaxed);
        assert!(memory.count(100, false) && held() == 100);
        assert!(!memory.count(1, false) && held() == 100);
        assert!(memory.count(1, true) && held() == 101);
        assert!(memory.count(-51, false) && held() == 50);
        assert!(memory.count(50, false) && held() == 100);
    }
}
