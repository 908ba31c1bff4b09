//! Filters: hits that geometry offers and a program may turn down, such as at the holes of a leaf's texture.

use std::ffi::{c_int, c_void};
use std::mem::{align_of, offset_of, size_of};
use std::sync::Arc;

use crate::callback::{Lanes, Rows, guarded, hit_row, ray_row};
use crate::probe::HitLayout;
use crate::raw::INVALID_ID;

/// Decides which hits count. Belongs to a geometry, is asked in closest-hit and any-hit queries alike, and in
/// the thread that queries.
///
/// Embree may ask about a candidate that is not the closest, about the same one twice (where its tree keeps a
/// triangle twice, and at an edge about both neighbours), and in any order: the answer must depend on nothing
/// but the candidate. A filter may query scenes itself.
///
/// A panic ends the asking: the rest of the query takes every candidate of a filter as refused, and the query
/// panics with the same payload when Embree has returned. Its results are then undefined, not unsound.
pub trait Filter: Send + Sync {
    /// Whether this hit counts; `false` lets the ray go on.
    fn accept(&self, candidate: &Candidate) -> bool;
}

/// A hit that a [`Filter`] is asked about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The ray's [`id`](crate::Ray::id).
    pub ray_id: u32,
    /// Geometry number in the scene, or in the instanced scene.
    pub geometry: u32,
    /// Triangle or shape in its geometry.
    pub primitive: u32,
    /// Geometry number of the instance, `u32::MAX` for none.
    pub instance: u32,
    /// Place in an instance array; see [`Hit::instance_primitive`](crate::Hit).
    pub instance_primitive: u32,
    /// Weight of the triangle's second vertex, or what the shape says.
    pub u: f32,
    /// Weight of the triangle's third vertex, or what the shape says.
    pub v: f32,
    /// Distance in lengths of the ray's direction.
    pub t: f32,
}

/// What a filtered geometry's user pointer points to.
pub(crate) struct FilterData {
    pub(crate) filter: Arc<dyn Filter>,
    pub(crate) layout: HitLayout,
}

/// `RTCFilterFunctionN`.
pub(crate) type FilterFunction = unsafe extern "C" fn(*const FilterArguments);

/// `RTCFilterFunctionNArguments`.
#[repr(C)]
pub(crate) struct FilterArguments {
    valid: *mut c_int,
    user: *mut c_void,
    context: *mut c_void,
    ray: *mut c_void,
    hit: *mut c_void,
    width: u32,
}

const _: () = {
    assert!(size_of::<FilterArguments>() == 48 && align_of::<FilterArguments>() == 8);
    assert!(offset_of!(FilterArguments, valid) == 0);
    assert!(offset_of!(FilterArguments, user) == 8);
    assert!(offset_of!(FilterArguments, context) == 16);
    assert!(offset_of!(FilterArguments, ray) == 24);
    assert!(offset_of!(FilterArguments, hit) == 32);
    assert!(offset_of!(FilterArguments, width) == 40);
};

/// Embree's callback: asks the filter about every lane that is valid.
///
/// # Safety
/// Only Embree may call it, for a geometry whose user pointer is a [`FilterData`].
pub(crate) unsafe extern "C" fn ask_filter(arguments: *const FilterArguments) {
    // SAFETY: Embree passes arguments that live during the call, and the user pointer that was set with this
    // function, which outlives the geometry.
    let (arguments, data) = unsafe { (&*arguments, &*(*arguments).user.cast::<FilterData>()) };
    // SAFETY: the packets have `width` lanes, and all rows of a ray and of a hit of this layout.
    let (lanes, ray, hit) = unsafe {
        let width = arguments.width;
        (Lanes::new(arguments.valid, width), Rows::new(arguments.ray, width), Rows::new(arguments.hit, width))
    };
    let is_done = guarded(false, || {
        for lane in lanes.asked() {
            let candidate = Candidate {
                ray_id: ray.word(ray_row::ID, lane),
                geometry: hit.word(hit_row::GEOMETRY, lane),
                primitive: hit.word(hit_row::PRIMITIVE, lane),
                instance: hit.word(hit_row::INSTANCE, lane),
                instance_primitive: match data.layout {
                    HitLayout::Plain => INVALID_ID,
                    HitLayout::InstancePrimitive => hit.word(hit_row::INSTANCE_PRIMITIVE, lane),
                },
                u: hit.number(hit_row::U, lane),
                v: hit.number(hit_row::V, lane),
                // Embree puts the candidate's distance there, and takes it back if it is refused.
                t: ray.number(ray_row::T_MAX, lane),
            };
            if !data.filter.accept(&candidate) {
                lanes.refuse(lane);
            }
        }
        true
    });
    if !is_done {
        lanes.refuse_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::callback::resume_panic;
    use std::panic::catch_unwind;
    use std::sync::Mutex;

    /// Remembers what it was asked and accepts even rays.
    #[derive(Default)]
    struct Even(Mutex<Vec<Candidate>>);

    impl Filter for Even {
        fn accept(&self, candidate: &Candidate) -> bool {
            assert!(candidate.ray_id < 1000, "no such ray");
            self.0.lock().unwrap().push(*candidate);
            candidate.ray_id.is_multiple_of(2)
        }
    }

    /// Calls the callback as Embree does, with ray ids from `first_id` on and the last lane not valid.
    fn call(filter: &Arc<Even>, layout: HitLayout, width: u32, first_id: u32) -> Vec<c_int> {
        let data = Arc::new(FilterData { filter: Arc::clone(filter) as Arc<dyn Filter>, layout });
        let n = width as usize;
        let mut valid = vec![-1; n];
        if n > 1 {
            valid[n - 1] = 0;
        }
        let mut ray = vec![0u32; 12 * n];
        // Exactly as long as Embree's, so that Miri sees a read behind it.
        let mut hit = vec![0u32; if layout == HitLayout::Plain { 8 } else { 9 } * n];
        for lane in 0..n {
            ray[8 * n + lane] = (lane as f32).to_bits();
            ray[10 * n + lane] = first_id + lane as u32;
            for row in 0..hit.len() / n {
                let number = 0.5 * lane as f32;
                hit[row * n + lane] = if row < 5 { number.to_bits() } else { (100 * row + lane) as u32 };
            }
        }
        let arguments = FilterArguments {
            valid: valid.as_mut_ptr(),
            user: Arc::as_ptr(&data).cast_mut().cast(),
            context: std::ptr::null_mut(),
            ray: ray.as_mut_ptr().cast(),
            hit: hit.as_mut_ptr().cast(),
            width,
        };
        // SAFETY: the arguments are what Embree passes.
        unsafe { ask_filter(&arguments) };
        valid
    }

    #[test]
    fn every_valid_lane_is_asked_with_its_own_words() {
        for layout in [HitLayout::Plain, HitLayout::InstancePrimitive] {
            for width in [1, 4, 8, 16] {
                let filter = Arc::new(Even::default());
                let valid = call(&filter, layout, width, 40);
                let asked = filter.0.lock().unwrap();
                assert_eq!(asked.len(), (width as usize - 1).max(1));
                for (lane, candidate) in asked.iter().enumerate() {
                    let expected = Candidate {
                        ray_id: 40 + lane as u32,
                        geometry: 600 + lane as u32,
                        primitive: 500 + lane as u32,
                        instance: 700 + lane as u32,
                        instance_primitive: if layout == HitLayout::Plain { u32::MAX } else { 800 + lane as u32 },
                        u: 0.5 * lane as f32,
                        v: 0.5 * lane as f32,
                        t: lane as f32,
                    };
                    assert_eq!(*candidate, expected);
                    assert_eq!(valid[lane], if lane % 2 == 0 { -1 } else { 0 });
                }
            }
        }
    }

    #[test]
    fn a_panic_refuses_all_lanes_and_waits_for_the_query_to_end() {
        let filter = Arc::new(Even::default());
        // The first two are accepted and refused before the third panics.
        assert_eq!(call(&filter, HitLayout::Plain, 8, 998), [0; 8]);
        // Silenced until the query ends.
        assert_eq!(call(&filter, HitLayout::Plain, 1, 0), [0]);
        let payload = catch_unwind(resume_panic).unwrap_err();
        assert!(payload.downcast_ref::<&str>() == Some(&"no such ray"));
        assert_eq!(call(&filter, HitLayout::Plain, 1, 0), [-1]);
    }
}
