//! The mean of our pictures of a reference scene against what is known of it.

use super::closed;
use super::pictures::{ReferenceStats, channel_means};
use super::verdict::{Expected, MeanVerdict, mean_test};
use prt::image::exr_read::Picture;

/// One verdict a channel on `runs` (one square picture a seed): against the closed form, over the pixels that
/// have one, else the whole picture against the stored picture's mean.
pub fn mean_verdicts(name: &str, runs: &[Picture], stats: &ReferenceStats) -> [MeanVerdict; 3] {
    let exact = closed::reference_pixels(name, runs[0].width);
    [0, 1, 2].map(|channel| match &exact {
        Some(exact) => {
            let known = exact.iter().flatten().count() as f64;
            let value = exact.iter().flatten().map(|e| e[channel]).sum::<f64>() / known;
            let mean_of = |run: &Picture| {
                let inside = run.pixels.iter().zip(exact).filter(|(_, e)| e.is_some());
                inside.map(|(p, _)| f64::from(p[channel])).sum::<f64>() / known
            };
            mean_test(&runs.iter().map(mean_of).collect::<Vec<_>>(), Expected { value, rel_se: 0.0 })
        }
        None => {
            let means: Vec<f64> = runs.iter().map(|run| channel_means(&run.pixels)[channel]).collect();
            mean_test(&means, Expected { value: stats.mean[channel], rel_se: stats.mean_rel_se[channel] })
        }
    })
}
