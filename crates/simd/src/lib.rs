//! SIMD lanes for code that is written once and runs 1, 8 or 16 wide.
//!
//! A [`Kernel`] is generic over [`Lanes`]; [`dispatch`] (or [`dispatch_large`]) runs it at a [`Level`] that this CPU was
//! found to have. All `std::arch` of the project lives here.
//!
//! Everything a kernel calls must be `#[inline(always)]`: only then is it compiled with the level's instructions
//! (an outlined function falls back to the build's baseline and passes vectors through memory).
//!
//! # Soundness
//! The methods of the AVX types use intrinsics that are undefined behaviour on a CPU without them. The lane types are
//! therefore private: the only way to name one is as the parameter `L` of [`Kernel::run`], and dispatching calls
//! that only after it has found the instructions on this CPU.

mod array;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod buffer;
mod lanes;
mod level;
mod pages;
mod prefetch;

pub use array::Scalar;
pub use buffer::Buffer;
pub use lanes::{Float, Lanes, Mask, Part, Uint};
pub use level::{Kernel, Level, dispatch, dispatch_large, dispatch_one};
pub use pages::prefer_large_pages;
pub use prefetch::prefetch;
