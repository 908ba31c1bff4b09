//! Which instructions this CPU has, and running a kernel with them.

use crate::array::{Portable8, Scalar};
use crate::lanes::Lanes;

/// Code written once for any lane count.
pub trait Kernel {
    /// What it returns.
    type Output;

    /// The work. Must be `#[inline(always)]`, as must everything below it.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// An instruction set with its lane count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// 1 lane, plain code: the readable reference.
    Scalar,
    /// 8 lanes of plain code.
    Portable8,
    /// 8 lanes, AVX2 and FMA.
    Avx2,
    /// 16 lanes, AVX-512 F, BW, DQ, VL.
    Avx512,
}

impl Level {
    /// The widest level of this CPU; [`Level::Portable8`] where there is no AVX2.
    pub fn best() -> Self {
        [Self::Avx512, Self::Avx2].into_iter().find(|l| l.is_available()).unwrap_or(Self::Portable8)
    }

    /// The widest 8-lane level of this CPU.
    pub fn best_of_8() -> Self {
        if Self::Avx2.is_available() { Self::Avx2 } else { Self::Portable8 }
    }

    /// Whether this CPU can run it.
    #[cfg(target_arch = "x86_64")]
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar | Self::Portable8 => true,
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
        }
    }

    /// Whether this CPU can run it.
    #[cfg(not(target_arch = "x86_64"))]
    pub fn is_available(self) -> bool {
        matches!(self, Self::Scalar | Self::Portable8)
    }

    /// Itself, but one lane in place of [`Level::Portable8`], for [`dispatch_large`].
    pub fn without_portable(self) -> Self {
        if self == Self::Portable8 { Self::Scalar } else { self }
    }

    /// Lanes: 1, 8 or 16.
    pub fn lanes(self) -> u32 {
        match self {
            Self::Scalar => 1,
            Self::Portable8 | Self::Avx2 => 8,
            Self::Avx512 => 16,
        }
    }

    /// Lower-case name, such as `avx2`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Portable8 => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }
}

/// Runs `kernel` at `level`.
///
/// # Panics
/// When this CPU does not have it.
pub fn dispatch<K: Kernel>(level: Level, kernel: K) -> K::Output {
    if level == Level::Portable8 { kernel.run::<Portable8>() } else { dispatch_large(level, kernel) }
}

/// Runs `kernel` at [`Level::Scalar`], for work that comes one at a time: nothing wider is compiled.
#[inline(always)]
pub fn dispatch_one<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Scalar>()
}

/// [`dispatch`] for a kernel that is large enough for its build time to matter: never at [`Level::Portable8`], whose
/// plain code is five times that of AVX-512. [`Level::without_portable`] takes its place by one lane.
///
/// # Panics
/// When this CPU does not have the level, and at [`Level::Portable8`].
pub fn dispatch_large<K: Kernel>(level: Level, kernel: K) -> K::Output {
    assert!(level.is_available() && level != Level::Portable8, "not {} here", level.name());
    match level {
        Level::Scalar | Level::Portable8 => kernel.run::<Scalar>(),
        #[cfg(target_arch = "x86_64")]
        // SAFETY: availability was asserted above.
        Level::Avx2 => unsafe { with_avx2(kernel) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: availability was asserted above.
        Level::Avx512 => unsafe { with_avx512(kernel) },
        #[cfg(not(target_arch = "x86_64"))]
        Level::Avx2 | Level::Avx512 => unreachable!("not available on this architecture"),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<crate::avx2::Avx2>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
fn with_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<crate::avx512::Avx512>()
}
