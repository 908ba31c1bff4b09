//! Our pictures of the reference scenes have the right mean: against the closed form where there is one, else against
//! Mitsuba's stored picture. The quick check of the ordinary suite; `scripts/reference_check.sh` is the thorough one.
//!
//! Every test: seeds 0..8, samples as in the table below, 256 x 256 scenes at `SIZE` under the same box filter, so the
//! same picture mean. Pass: within 0.15 %, p >= 1e-4 (Student's t over seeds, the reference's own error included), and
//! noise low enough that 0.15 % is 4 standard errors. False alarms on a change of the random numbers: at most 1.6e-4
//! a channel. Twin of each: the same pictures with 0.5 % more light must fail.
//!
//! `PRT_TEST_SPP_SCALE` (a number, default 1) multiplies the samples, to try out other budgets.

mod support;

use prt::image::exr_read::Picture;
use support::pictures::{reference_stats, settings, shoot_seeds};
use support::reference::mean_verdicts;
use support::verdict::{MAX_BIAS, MeanVerdict};
use support::{planted, scenes};

/// Pixels across and down.
const SIZE: u32 = 64;
/// Pictures per scene.
const SEEDS: u64 = 8;

/// Renders and judges a scene, then does it again with the planted fault.
fn check(name: &str, spp: u32) {
    let scale: f64 = std::env::var("PRT_TEST_SPP_SCALE").map_or(1.0, |s| s.parse().expect("PRT_TEST_SPP_SCALE"));
    let spp = (f64::from(spp) * scale).ceil() as u32;
    let runs = shoot_seeds(&scenes::reference(name), &settings(SIZE, spp, 0), SEEDS);
    let problems = compare(name, &runs);
    assert!(problems.is_empty(), "{name} at {spp} spp:\n  {}", problems.join("\n  "));

    let mut brighter = runs;
    brighter.iter_mut().for_each(|run| planted::scale(run, 1.005));
    assert_eq!(compare(name, &brighter).len(), 3, "{name}: half a percent more light must fail in every channel");
}

/// One line for each channel that is wrong.
fn compare(name: &str, runs: &[Picture]) -> Vec<String> {
    let stats = reference_stats(&scenes::reference_folder(name), "ref_mitsuba");
    let verdicts = mean_verdicts(name, runs, &stats);
    let judge = |(channel, verdict): (usize, &MeanVerdict)| {
        println!("{name}[{channel}]: bias {:+.5} %, s.e. {:.5} %", 100.0 * verdict.bias, 100.0 * verdict.rel_se);
        verdict.within(MAX_BIAS).err().map(|e| format!("channel {channel}: {e}"))
    };
    verdicts.iter().enumerate().filter_map(judge).collect()
}

#[test]
fn directional_light_on_a_floor_is_exact() {
    check("sun_plane", 4);
}

#[test]
fn point_light_on_a_floor_is_exact() {
    check("point_plane", 64);
}

#[test]
fn square_lamp_on_a_floor_follows_lamberts_formula() {
    check("quad_plane", 64);
}

#[test]
fn ball_in_a_furnace_shows_its_albedo() {
    check("furnace", 32);
}

#[test]
fn closed_furnace_shows_one_everywhere() {
    check("furnace_closed", 64);
}

#[test]
fn cornell_box_has_mitsubas_mean() {
    check("cornell", 256);
}

#[test]
fn three_punctual_lights_have_mitsubas_mean() {
    check("punctual", 1024);
}
