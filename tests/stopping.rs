//! ADP-02: pictures that end by their error are as good as they say.

mod support;

use prt::compare::metrics;
use prt::image::exr_read::Picture;
use prt::render::{AccelChoice, Frame, RenderSettings, StoppedBy, Stopping};
use support::pictures::{settings, shoot};
use support::scenes;

/// sqrt(relMSE).
fn error(frame: &Frame, reference: &Frame) -> f64 {
    let picture = |frame: &Frame| {
        let (width, height) = (frame.width as usize, frame.height as usize);
        Picture { origin: [0, 0], width, height, pixels: frame.pixels.clone() }
    };
    metrics(&picture(frame), &picture(reference)).relmse.expect("numbers").sqrt()
}

/// Seeds 0..8 against one picture of seed 1,000,003 with 2048 samples, whose own variance is taken off. If 90 % of true
/// errors are inside of the stated intervals, fewer than 5 of 8 are there by chance in 1 of 200 runs of a scene; seeds
/// are fixed, so it either fails always or never.
#[test]
fn adp_02_pictures_end_when_they_are_as_good_as_they_were_to_be() {
    for (scene, target) in [("cornell", 0.12), ("punctual", 0.2), ("quad_plane", 0.03)] {
        let scene_loaded = scenes::reference(scene);
        let base = RenderSettings { accel: AccelChoice::Bvh, ..settings(24, 2048, 1_000_003) };
        let reference = shoot(&scene_loaded, &base);
        let own = reference.stats.error.expect("it is not black").value;
        let (mut inside, mut ratios, mut below) = (0, Vec::new(), 0);
        for seed in 0..8 {
            let stopping = Stopping { target_error: Some(target), ..Stopping::default() };
            let frame = shoot(&scene_loaded, &RenderSettings { seed, spp: 1024, stopping, ..base.clone() });
            let stated = frame.stats.error.expect("it is not black");
            assert_eq!(frame.stats.stopped_by, StoppedBy::TargetError, "{scene}: {} spp, {stated:?}", frame.spp);
            assert!(stated.ci95[1] <= target && frame.spp < 1024, "{scene}: {stated:?}");
            let truth = (error(&frame, &reference).powi(2) - own * own).max(0.0).sqrt();
            inside += usize::from(stated.ci95[0] <= truth && truth <= stated.ci95[1]);
            below += usize::from(truth <= target);
            ratios.push(truth / stated.value);
        }
        ratios.sort_by(f64::total_cmp);
        println!("{scene}: {inside} of 8 inside, {below} below the target, true over stated {ratios:.3?}");
        assert!(inside >= 5 && below >= 7, "{scene}: {inside} inside, {below} below, {ratios:?}");
        // Direct light alone gets better in steps, at every other power of two, where the statement is too high.
        let least = if scene == "quad_plane" { 0.5 } else { 0.8 };
        assert!((least..1.2).contains(&ratios[4]), "{scene}: {ratios:?}");
    }
}
