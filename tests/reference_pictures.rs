//! The stored pictures themselves: they are whole, and they agree with the closed forms and with one another.
//! No rendering: this says that a failure elsewhere is not the reference's.

mod support;

use prt::compare::block_test;
use prt::compare::blocks::ROUNDING;
use prt::image::exr_read::Picture;
use support::pictures::{channel_means, read_exr, reference_stats};
use support::verdict::{Expected, MAX_BIAS, mean_test};
use support::{closed, planted, scenes};

#[test]
fn stored_pictures_have_the_means_that_their_stats_say() {
    for name in scenes::REFERENCE {
        let folder = scenes::reference_folder(name);
        let (picture, stats) = (read_exr(&folder.join("ref_mitsuba.exr")), reference_stats(&folder, "ref_mitsuba"));
        assert_eq!((picture.width, picture.pixels.len()), (256, 256 * 256), "{name}");
        for (got, want) in channel_means(&picture.pixels).into_iter().zip(stats.mean) {
            assert!((got / want - 1.0).abs() < 1e-6, "{name}: {got} {want}");
        }
    }
}

// Mitsuba's picture against the exact pixels, mean over those that have one: 4 standard errors of the picture's mean
// (which the mask hardly changes) and 0.15 %. Fixed pictures: nothing random is left.
#[test]
fn closed_forms_agree_with_the_stored_pictures() {
    for name in scenes::REFERENCE {
        let Some(exact) = closed::reference_pixels(name, 256) else { continue };
        let folder = scenes::reference_folder(name);
        let (picture, stats) = (read_exr(&folder.join("ref_mitsuba.exr")), reference_stats(&folder, "ref_mitsuba"));
        for channel in 0..3 {
            let known = || exact.iter().zip(&picture.pixels).filter_map(|(e, p)| e.map(|e| (e, p)));
            let n = known().count() as f64;
            assert!(n > 0.9 * 65536.0, "{name}: {n} pixels have an exact value");
            let mean = known().map(|(_, p)| f64::from(p[channel])).sum::<f64>() / n;
            let value = known().map(|(e, _)| e[channel]).sum::<f64>() / n;
            let rel_se = stats.mean_rel_se[channel].hypot(ROUNDING);
            let got = mean_test(&[mean, mean], Expected { value, rel_se });
            got.within(MAX_BIAS).unwrap_or_else(|e| panic!("{name}, channel {channel}: {e}"));
        }
    }
}

// Two renderers that share no code: Cycles' picture, twice over in place of our seeds, so that the reference's stated
// noise has to be that of both. 5376 comparisons, family-wise 1e-3 a scene; fixed pictures: nothing random is left.
// The twin: 2 % more light (the noise of a block's difference is up to 0.4 %) is found in every scene.
#[test]
fn cycles_and_mitsuba_agree_by_blocks_and_two_percent_would_show() {
    for name in scenes::REFERENCE {
        let folder = scenes::reference_folder(name);
        let cycles = read_exr(&folder.join("ref_cycles.exr"));
        let mitsuba = read_exr(&folder.join("ref_mitsuba.exr"));
        let [a, b] = ["ref_cycles", "ref_mitsuba"].map(|who| reference_stats(&folder, who).rel_se);
        let test = |picture: Picture| block_test(&[picture.clone(), picture], &mitsuba, a.hypot(b));
        let mut brighter = cycles.clone();
        planted::scale(&mut brighter, 1.02);
        let (sound, planted) = (test(cycles), test(brighter));
        assert!(sound.rejected == 0, "{name}: {sound:?}");
        assert!(planted.rejected > 0, "{name}: 2 % went unseen: {planted:?}");
    }
}
