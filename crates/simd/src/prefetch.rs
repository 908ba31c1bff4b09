//! Asking for memory before it is needed.

/// Starts to bring `slice[at]` (its first 64-byte line and the `lines - 1` after it) into the cache; nothing where that
/// is out of bounds or the CPU has no such instruction. It never changes what a program computes.
#[inline(always)]
pub fn prefetch<T>(slice: &[T], at: usize, lines: usize) {
    #[cfg(target_arch = "x86_64")]
    if at < slice.len() {
        let first = slice.as_ptr().wrapping_add(at).cast::<i8>();
        for line in 0..lines {
            // SAFETY: SSE is part of the architecture, and a prefetch of any address is no access.
            unsafe {
                std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(first.wrapping_add(64 * line))
            };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (slice, at, lines);
}
