//! What all callbacks share: panics must not unwind into C++, and which lanes of which rows Embree hands over.
//!
//! A callback that panics is not called again by the same query; the query goes on as if it had said "no hit"
//! and panics with the same payload once Embree has returned.

use std::any::Any;
use std::cell::RefCell;
use std::ffi::c_int;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

type Payload = Box<dyn Any + Send>;

thread_local! {
    /// The panic of a callback in the query that this thread is in. Queries call back in their own thread.
    static PANIC: RefCell<Option<Payload>> = const { RefCell::new(None) };
}

/// What `callback` returns; `otherwise` if it panics or one before it did in this query.
pub(crate) fn guarded<T>(otherwise: T, callback: impl FnOnce() -> T) -> T {
    if PANIC.with_borrow(Option::is_some) {
        return otherwise;
    }
    match catch_unwind(AssertUnwindSafe(callback)) {
        Ok(value) => value,
        Err(payload) => {
            PANIC.set(Some(payload));
            otherwise
        }
    }
}

/// Goes on with the panic of a callback of the query that has just returned, if there was one.
pub(crate) fn resume_panic() {
    if let Some(payload) = PANIC.take() {
        resume_unwind(payload);
    }
}

/// Rows of `width` words that Embree lends to a callback: a ray, a hit, or a ray with its hit behind it.
#[derive(Clone, Copy)]
pub(crate) struct Rows {
    first: *mut u32,
    width: usize,
}

/// Rows of a ray in a packet of any width.
pub(crate) mod ray_row {
    pub(crate) const ORIGIN: usize = 0;
    pub(crate) const T_MIN: usize = 3;
    pub(crate) const DIRECTION: usize = 4;
    pub(crate) const TIME: usize = 7;
    pub(crate) const T_MAX: usize = 8;
    pub(crate) const MASK: usize = 9;
    pub(crate) const ID: usize = 10;
    pub(crate) const FLAGS: usize = 11;
    /// How many there are; a hit follows them.
    pub(crate) const COUNT: usize = 12;
}

/// Rows of a hit in a packet of any width.
pub(crate) mod hit_row {
    pub(crate) const NG: usize = 0;
    pub(crate) const U: usize = 3;
    pub(crate) const V: usize = 4;
    pub(crate) const PRIMITIVE: usize = 5;
    pub(crate) const GEOMETRY: usize = 6;
    pub(crate) const INSTANCE: usize = 7;
    /// Only there in libraries with instance arrays.
    pub(crate) const INSTANCE_PRIMITIVE: usize = 8;
}

impl Rows {
    /// # Safety
    /// `first` must point to all rows that are asked for, of `width` words each, for as long as this lives.
    pub(crate) unsafe fn new<T>(first: *mut T, width: u32) -> Self {
        Self { first: first.cast(), width: width as usize }
    }

    /// The rows from `row` on.
    pub(crate) fn from_row(self, row: usize) -> Self {
        // SAFETY: the rows are there, as the caller of `new` says.
        Self { first: unsafe { self.first.add(row * self.width) }, ..self }
    }

    pub(crate) fn word(self, row: usize, lane: usize) -> u32 {
        debug_assert!(lane < self.width);
        // SAFETY: the row is there, as the caller of `new` says, and all callers stay within the width.
        unsafe { self.first.add(row * self.width + lane).read() }
    }

    pub(crate) fn number(self, row: usize, lane: usize) -> f32 {
        f32::from_bits(self.word(row, lane))
    }

    pub(crate) fn triple(self, row: usize, lane: usize) -> [f32; 3] {
        std::array::from_fn(|i| self.number(row + i, lane))
    }

    pub(crate) fn set(self, row: usize, lane: usize, word: u32) {
        debug_assert!(lane < self.width);
        // SAFETY: as in `word`; Embree lends its rays and hits to be written to.
        unsafe { self.first.add(row * self.width + lane).write(word) };
    }

    pub(crate) fn set_number(self, row: usize, lane: usize, number: f32) {
        self.set(row, lane, number.to_bits());
    }
}

/// The lanes that a callback is asked about: 0 for none, anything else for one.
#[derive(Clone, Copy)]
pub(crate) struct Lanes {
    first: *mut c_int,
    width: usize,
}

impl Lanes {
    /// # Safety
    /// `first` must point to `width` words that may be written to for as long as this lives.
    pub(crate) unsafe fn new(first: *mut c_int, width: u32) -> Self {
        Self { first, width: width as usize }
    }

    /// The lanes that are asked about.
    pub(crate) fn asked(self) -> impl Iterator<Item = usize> {
        // SAFETY: `lane` is within the width, as the caller of `new` says.
        (0..self.width).filter(move |&lane| unsafe { self.first.add(lane).read() } != 0)
    }

    /// Says no for `lane`.
    pub(crate) fn refuse(self, lane: usize) {
        debug_assert!(lane < self.width);
        // SAFETY: as above.
        unsafe { self.first.add(lane).write(0) };
    }

    /// Says no for all lanes.
    pub(crate) fn refuse_all(self) {
        (0..self.width).for_each(|lane| self.refuse(lane));
    }
}

const _: () = {
    use crate::ray::{HitPacket, RayHitPacket, RayPacket};
    use std::mem::offset_of;
    const N: usize = 16;
    const ROW: usize = 4 * N;
    assert!(offset_of!(RayPacket<N>, origin_x) == ray_row::ORIGIN * ROW);
    assert!(offset_of!(RayPacket<N>, t_min) == ray_row::T_MIN * ROW);
    assert!(offset_of!(RayPacket<N>, direction_x) == ray_row::DIRECTION * ROW);
    assert!(offset_of!(RayPacket<N>, time) == ray_row::TIME * ROW);
    assert!(offset_of!(RayPacket<N>, t_max) == ray_row::T_MAX * ROW);
    assert!(offset_of!(RayPacket<N>, mask) == ray_row::MASK * ROW);
    assert!(offset_of!(RayPacket<N>, id) == ray_row::ID * ROW);
    assert!(offset_of!(RayPacket<N>, flags) == ray_row::FLAGS * ROW);
    assert!(offset_of!(RayHitPacket<N>, hit) == ray_row::COUNT * ROW);
    assert!(offset_of!(HitPacket<N>, ng_x) == hit_row::NG * ROW);
    assert!(offset_of!(HitPacket<N>, u) == hit_row::U * ROW);
    assert!(offset_of!(HitPacket<N>, v) == hit_row::V * ROW);
    assert!(offset_of!(HitPacket<N>, primitive) == hit_row::PRIMITIVE * ROW);
    assert!(offset_of!(HitPacket<N>, geometry) == hit_row::GEOMETRY * ROW);
    assert!(offset_of!(HitPacket<N>, instance) == hit_row::INSTANCE * ROW);
    assert!(offset_of!(HitPacket<N>, instance_primitive) == hit_row::INSTANCE_PRIMITIVE * ROW);
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_silences_the_callbacks_after_it_and_is_raised_once() {
        assert_eq!(guarded(1, || 2), 2);
        assert_eq!(guarded(1, || panic!("first")), 1);
        assert_eq!(guarded(1, || unreachable!("a callback after a panic")), 1);
        let payload = catch_unwind(resume_panic).unwrap_err();
        assert_eq!(payload.downcast_ref::<&str>(), Some(&"first"));
        resume_panic();
        assert_eq!(guarded(1, || 3), 3);
    }

    #[test]
    fn lanes_and_rows_of_any_width_are_where_the_layout_says() {
        for width in [1u32, 4, 8, 16] {
            let mut words: Vec<u32> = (0..ray_row::COUNT as u32 * width).collect();
            // SAFETY: twelve rows of `width` words.
            let rows = unsafe { Rows::new(words.as_mut_ptr(), width) };
            let last = width as usize - 1;
            assert_eq!(rows.word(ray_row::ID, last), 10 * width + width - 1);
            assert_eq!(rows.from_row(3).word(2, 0), 5 * width);
            rows.set_number(ray_row::T_MAX, last, 2.5);
            assert_eq!(rows.number(ray_row::T_MAX, last), 2.5);

            let mut valid: Vec<c_int> = (0..width as c_int).map(|lane| -(lane % 2)).collect();
            // SAFETY: `width` words.
            let lanes = unsafe { Lanes::new(valid.as_mut_ptr(), width) };
            assert!(lanes.asked().eq((1..width as usize).step_by(2)));
            lanes.refuse_all();
            assert_eq!(lanes.asked().count(), 0);
        }
    }
}
