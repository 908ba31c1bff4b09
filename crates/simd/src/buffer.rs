//! A 64-byte aligned array whose length is a multiple of 16 elements.

use std::ops::{Deref, DerefMut};

/// Sixteen 4-byte elements: one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Line<T>([T; 16]);

/// `len` elements of 4 bytes, 64-byte aligned, zeroed, `len` rounded up to a multiple of 16, so that a full vector can
/// be loaded at any index that is a multiple of the lane count.
#[derive(Clone, Debug)]
pub struct Buffer<T> {
    lines: Vec<Line<T>>,
}

impl<T: Copy + Default> Buffer<T> {
    /// At least `len` zeroes.
    pub fn new(len: usize) -> Self {
        const { assert!(size_of::<T>() == 4, "lanes are 4 bytes") }
        Self { lines: vec![Line([T::default(); 16]); len.div_ceil(16)] }
    }
}

impl<T> Deref for Buffer<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        // SAFETY: `Line<T>` is `repr(C)` around `[T; 16]` of size 64 (asserted in `new`), so it has no padding and
        // `lines` is `16 * lines.len()` consecutive initialised `T`.
        unsafe { std::slice::from_raw_parts(self.lines.as_ptr().cast(), self.lines.len() * 16) }
    }
}

impl<T> DerefMut for Buffer<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        // SAFETY: as in `deref`, and `self` is borrowed mutably.
        unsafe { std::slice::from_raw_parts_mut(self.lines.as_mut_ptr().cast(), self.lines.len() * 16) }
    }
}
