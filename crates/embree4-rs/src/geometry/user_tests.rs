//! The callbacks, called as Embree calls them but without an Embree.

use super::*;
use crate::callback::resume_panic;
use crate::raw::INVALID_ID;

/// Shape `p` is met at `t = 2`, with `u` the ray's id and `v` the shape; odd rays miss, ray 1001 panics.
struct Planes;

impl UserShapes for Planes {
    fn len(&self) -> usize {
        3
    }

    fn bounds(&self, primitive: u32, time: f32) -> Option<[[f32; 3]; 2]> {
        match primitive {
            0 => Some([[0.0; 3], [1.0 + time; 3]]),
            1 => Some([[0.0; 3], [f32::NAN; 3]]),
            2 => Some([[1.0; 3], [0.0; 3]]),
            3 => None,
            _ => panic!("no shape {primitive}"),
        }
    }

    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<UserHit> {
        assert!(ray.id < 1000, "no ray {}", ray.id);
        assert_eq!((ray.origin, ray.direction), ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]));
        let hit = UserHit { t: 2.0, u: ray.id as f32, v: primitive as f32 };
        ray.id.is_multiple_of(2).then_some(hit)
    }
}

fn data(layout: HitLayout, time_steps: usize) -> Arc<UserData> {
    Arc::new(UserData { shapes: Arc::new(Planes), layout, time_steps, build_panic: Mutex::new(None) })
}

/// The words of a packet after the callback. The last lane is not asked about; exactly as long as Embree's.
fn call(function: UserFunction, layout: HitLayout, width: u32, first_id: u32, t_max: f32) -> Vec<u32> {
    let (data, n) = (data(layout, 1), width as usize);
    let hit_rows = if layout == HitLayout::Plain { 8 } else { 9 };
    let mut words = vec![INVALID_ID; (12 + hit_rows) * n];
    let numbers = [1.0, 2.0, 3.0, 0.0, 4.0, 5.0, 6.0, 0.25, t_max];
    for lane in 0..n {
        for (row, number) in numbers.into_iter().enumerate() {
            words[row * n + lane] = number.to_bits();
        }
        words[10 * n + lane] = first_id + lane as u32;
    }
    let mut valid = vec![-1; n];
    if n > 1 {
        valid[n - 1] = 0;
    }
    let mut context = vec![70, 80];
    context.truncate(hit_rows - 7);
    let arguments = UserArguments {
        valid: valid.as_mut_ptr(),
        user: Arc::as_ptr(&data).cast_mut().cast(),
        primitive: 2,
        context: context.as_mut_ptr(),
        rays: words.as_mut_ptr().cast(),
        width,
        geometry: 60,
    };
    // SAFETY: the arguments are what Embree passes.
    unsafe { function(&arguments) };
    words
}

#[test]
fn hits_are_written_to_the_lanes_that_are_asked_about_and_hit() {
    for layout in [HitLayout::Plain, HitLayout::InstancePrimitive] {
        for width in [1, 4, 8, 16] {
            let words = call(ask_intersect, layout, width, 40, 9.0);
            let n = width as usize;
            for lane in 0..n {
                let is_hit = lane % 2 == 0 && (n == 1 || lane != n - 1);
                let row = |row: usize| words[row * n + lane];
                assert_eq!(f32::from_bits(row(8)), if is_hit { 2.0 } else { 9.0 });
                assert_eq!(row(10), 40 + lane as u32);
                let written: Vec<u32> = (12..words.len() / n).map(row).collect();
                if is_hit {
                    let (u, v) = ((40.0 + lane as f32).to_bits(), 2.0f32.to_bits());
                    let expected = [0, 0, 0, u, v, 2, 60, 70, 80];
                    assert_eq!(written, expected[..written.len()]);
                } else {
                    assert!(written.iter().all(|&word| word == INVALID_ID), "lane {lane}");
                }
            }
        }
    }
}

#[test]
fn a_hit_beyond_the_segment_is_none() {
    let layout = HitLayout::InstancePrimitive;
    for function in [ask_intersect as UserFunction, ask_occluded] {
        let words = call(function, layout, 8, 0, 1.5);
        assert!(words[8 * 8..9 * 8].iter().all(|&t| f32::from_bits(t) == 1.5));
        assert!(words[12 * 8..].iter().all(|&word| word == INVALID_ID));
    }
}

#[test]
fn occlusion_is_a_negative_infinite_t_max_and_nothing_else() {
    for width in [1, 4, 8, 16] {
        let words = call(ask_occluded, HitLayout::Plain, width, 40, 9.0);
        let n = width as usize;
        for lane in 0..n {
            let is_hit = lane % 2 == 0 && (n == 1 || lane != n - 1);
            assert_eq!(f32::from_bits(words[8 * n + lane]), if is_hit { f32::NEG_INFINITY } else { 9.0 });
        }
        assert!(words[12 * n..].iter().all(|&word| word == INVALID_ID));
    }
}

#[test]
fn a_panic_in_a_query_waits_for_it_to_end() {
    for function in [ask_intersect as UserFunction, ask_occluded] {
        let words = call(function, HitLayout::Plain, 1, 1001, 9.0);
        assert_eq!(f32::from_bits(words[8]), 9.0);
        let silenced = call(function, HitLayout::Plain, 1, 40, 9.0);
        assert_eq!(f32::from_bits(silenced[8]), 9.0);
        assert!(catch_unwind(resume_panic).is_err());
        let words = call(function, HitLayout::Plain, 1, 40, 9.0);
        assert_ne!(f32::from_bits(words[8]), 9.0);
    }
}

#[test]
fn boxes_that_are_none_are_empty_and_a_panic_is_kept() {
    let data = data(HitLayout::Plain, 5);
    let ask = |primitive, time_step| {
        let mut bounds = Bounds::default();
        let user = Arc::as_ptr(&data).cast_mut().cast();
        let arguments = BoundsArguments { user, primitive, time_step, bounds: &mut bounds };
        // SAFETY: the arguments are what Embree passes.
        unsafe { ask_bounds(&arguments) };
        (bounds.lower, bounds.upper)
    };
    assert_eq!(ask(0, 0), ([0.0; 3], [1.0; 3]));
    assert_eq!(ask(0, 1), ([0.0; 3], [1.25; 3]));
    assert_eq!(ask(0, 4), ([0.0; 3], [2.0; 3]));
    assert!(data.take_panic().is_none());
    for nothing in [1, 2, 3, 4] {
        assert_eq!(ask(nothing, 0), ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]), "shape {nothing}");
    }
    assert!(data.take_panic().is_some());
}
