//! Large pages for large arrays.

/// Asks the system to back `memory` by large pages when it is first written, where there are such and it is large
/// enough; nothing elsewhere. It never changes what the memory holds.
pub fn prefer_large_pages<T>(memory: &mut [T]) {
    #[cfg(target_os = "linux")]
    {
        const PAGE: usize = 4096;
        /// What Linux calls `MADV_HUGEPAGE`.
        const HUGE: i32 = 14;
        unsafe extern "C" {
            fn madvise(address: *mut std::ffi::c_void, length: usize, advice: i32) -> i32;
        }
        let range = memory.as_mut_ptr_range();
        let (start, end) = ((range.start as usize).next_multiple_of(PAGE), range.end as usize & !(PAGE - 1));
        if end > start {
            // SAFETY: the pages lie within `memory`, which is borrowed, and the advice leaves their contents alone.
            // It may be refused: then they stay small.
            unsafe { madvise(start as *mut std::ffi::c_void, end - start, HUGE) };
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = memory;
}

#[cfg(test)]
mod tests {
    use super::prefer_large_pages;

    #[test]
    fn memory_holds_what_it_held() {
        let mut numbers: Vec<u64> = (0..1 << 20).collect();
        for range in [0..0, 0..1, 3..700, 0..1 << 20] {
            prefer_large_pages(&mut numbers[range]);
        }
        assert!(numbers.into_iter().eq(0..1 << 20));
    }
}
