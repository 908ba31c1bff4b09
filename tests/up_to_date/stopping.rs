//! What ended the sampling of a picture, and whether it is kept for that; and layers.

use super::Shot;
use std::time::Duration;

type Limits = (u32, Option<f64>, Option<u64>, Option<u64>);

/// Asks for at most so many samples, that error, and so many seconds for the image and for the batch.
fn ask(shot: &mut Shot, (spp, target_error, time, batch): Limits) {
    shot.settings.render.spp = spp;
    let stopping = &mut shot.settings.render.stopping;
    (stopping.target_error, stopping.time_limit) = (target_error, time.map(Duration::from_secs));
    shot.batch_time_limit = batch.map(Duration::from_secs);
}

/// Why it is not up to date when it was rendered as asked for `then` and ended with `ended`; empty if it is.
fn why_after(then: Limits, ended: Option<(u32, &'static str)>, now: Limits) -> String {
    let mut shot = Shot::gltf();
    ask(&mut shot, then);
    shot.ended = ended;
    let mut shot = shot.rendered();
    ask(&mut shot, now);
    shot.ended = None;
    shot.check().err().map_or_else(String::new, |why| why.to_string())
}

#[test]
fn a_picture_that_reached_its_error_is_kept_for_the_same_error_whatever_time_there_is() {
    let then = (1024, Some(0.01), None, None);
    let ended = Some((96, "target-error"));
    for now in
        [then, (2048, Some(0.01), None, None), (1024, Some(0.01), Some(5), Some(9)), (96, Some(0.01), None, None)]
    {
        assert_eq!(why_after(then, ended, now), "", "{now:?}");
    }
    assert_eq!(why_after(then, ended, (1024, Some(0.02), None, None)), "settings changed: target-error 0.01 -> 0.02");
    assert_eq!(why_after(then, ended, (1024, None, None, None)), "settings changed: spp 96 -> 1024");
    assert_eq!(why_after(then, ended, (64, Some(0.01), None, None)), "settings changed: spp 1024 -> 64");
    assert_eq!(why_after(then, ended, (1024, None, Some(5), None)), "settings changed: target-error 0.01 -> none");
    // Its pixels are those of that many samples, so it is one.
    assert_eq!(why_after(then, ended, (96, None, None, None)), "");
}

#[test]
fn a_picture_that_time_ended_is_kept_for_the_same_times_alone() {
    let then = (1 << 20, None, Some(30), Some(3600));
    for by in ["time-limit", "batch-time-limit"] {
        let ended = Some((37, by));
        assert_eq!(why_after(then, ended, then), "");
        let longer = why_after(then, ended, (1 << 20, None, Some(60), Some(3600)));
        assert_eq!(longer, "settings changed: time-limit 30s -> 60s");
        let other = why_after(then, ended, (1 << 20, None, Some(30), None));
        assert_eq!(other, "settings changed: batch-time-limit 3600s -> none");
        assert_eq!(why_after(then, ended, (37, None, None, None)), "");
    }
}

#[test]
fn a_picture_with_all_its_samples_is_kept_whatever_time_there_is() {
    for then in [(64, None, None, None), (64, None, Some(30), None), (64, None, None, Some(3600))] {
        for now in [(64, None, None, None), (64, None, Some(1), None), (64, None, None, Some(2))] {
            assert_eq!(why_after(then, None, now), "", "{then:?} {now:?}");
        }
        assert_eq!(why_after(then, None, (65, None, None, None)), "settings changed: spp 64 -> 65");
    }
    // Whether a run with a target would have ended earlier is not known.
    let now = (64, Some(0.5), None, None);
    assert_eq!(why_after((64, None, None, None), None, now), "settings changed: target-error none -> 0.5");
}

#[test]
fn pixels_have_the_fingerprint_of_their_number_of_samples_however_that_came_about() {
    let mut shot = Shot::gltf();
    ask(&mut shot, (96, None, None, None));
    let fixed = shot.fingerprint();
    ask(&mut shot, (1 << 20, Some(0.01), Some(30), None));
    shot.ended = Some((96, "time-limit"));
    let stopped = shot.fingerprint();
    assert_eq!((&stopped.pixels, &stopped.settings), (&fixed.pixels, &fixed.settings));
    assert!(fixed.stopping.is_none() && stopped.stopping.is_some());
}

#[test]
fn layers_are_part_of_the_exr_and_not_of_the_pixels() {
    let mut shot = Shot::gltf().rendered();
    let before = shot.fingerprint();
    shot.settings.render.layers.samples = true;
    assert_eq!(shot.why(), "settings changed: aov none -> samples");
    let after = shot.fingerprint();
    assert!(after.pixels == before.pixels && after.files != before.files);
    shot.settings.files.exr = false;
    shot.settings.render.layers.variance = true;
    assert_eq!(shot.why(), "settings changed: aov none -> variance,samples");
}
