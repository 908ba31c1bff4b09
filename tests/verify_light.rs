//! The scenes of `verify light`: they pass, and a picture that is off by 1 % does not.
//!
//! Seeds 0..16, 256 samples a pixel (times the case's own effort), 8 x 8 pixels; chance of a false alarm on a change of the
//! random numbers: 6.3e-5 a scene. The whole run, 16 seeds and 1024 samples, is `prt-batch verify light` (`--long`).

use prt::render::AccelChoice;
use prt::verify::light::cases::{Case, cases};
use prt::verify::light::{BLURRED, Settings, judge, shoot};

#[test]
fn pictures_show_what_can_be_written_down_and_one_that_is_off_by_a_hundredth_is_found() {
    let run = Settings { seed: 0, seeds: 16, samples: 256, accel: AccelChoice::Bvh, embree_dirs: Vec::new() };
    let (mut sharp, mut all) = (0, 0);
    for case in cases() {
        let shots = shoot(&case, &run).unwrap();
        let found = judge(&case, &shots);
        all += 1;
        if found.standard_error > BLURRED {
            // Noisy ones are refused, whatever they show.
            assert!(found.problem.is_some_and(|p| p.starts_with("too noisy")), "{}", case.name);
            continue;
        }
        sharp += 1;
        assert_eq!(found.problem, None, "{}", case.name);
        for fault in [0.99, 1.01] {
            let moved =
                Case { exact: case.exact * fault, ..cases().into_iter().find(|c| c.name == case.name).unwrap() };
            let problem = judge(&moved, &shots).problem;
            assert!(problem.is_some_and(|p| p.contains("off by")), "{}: a fault of {fault} is not seen", case.name);
        }
    }
    assert!(all >= 41 && sharp >= all - 6, "{sharp} of {all} are sharp enough");
}
