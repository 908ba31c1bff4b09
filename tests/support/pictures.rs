//! Rendering over seeds, and reading stored pictures.

use prt::image::exr_read::{self, Picture};
use prt::render::{AccelChoice, Brdf, Filter, FilterShape, Frame, Progress, RenderSettings, render};
use prt::scene::Scene;
use std::path::Path;

/// Reads a stored picture.
pub fn read_exr(path: &Path) -> Picture {
    exr_read::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// What stats.json says of a reference picture.
#[derive(serde::Deserialize)]
pub struct ReferenceStats {
    /// Relative standard error of a pixel, root mean square over the picture.
    pub rel_se: f64,
    /// Mean of the picture per channel.
    pub mean: [f64; 3],
    /// Relative standard error of `mean`.
    pub mean_rel_se: [f64; 3],
}

/// The entry of the picture `which` (`ref_mitsuba`, `ref_cycles`) in a scene folder's stats.json.
pub fn reference_stats(folder: &Path, which: &str) -> ReferenceStats {
    let path = folder.join("stats.json");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let all: serde_json::Value = serde_json::from_str(&text).expect("stats.json is JSON");
    serde_json::from_value(all[which].clone()).unwrap_or_else(|e| panic!("{}: {which}: {e}", path.display()))
}

/// Settings under which pictures are comparable with the references: box filter of one pixel, 32 bounces. `auto` takes
/// Embree where `scripts/get-embree.sh` brought it.
pub fn settings(size: u32, spp: u32, seed: u64) -> RenderSettings {
    RenderSettings {
        width: size,
        height: size,
        spp,
        seed,
        max_bounces: Some(32),
        filter: Filter { shape: FilterShape::Box, width: 1.0 },
        brdf: Brdf::AppendixB,
        accel: AccelChoice::Auto,
        embree_dirs: vec![Path::new(env!("CARGO_MANIFEST_DIR")).join(".embree")],
        ..RenderSettings::default()
    }
}

/// Renders the first camera; panics where the renderer reports an error or drops a sample.
pub fn shoot(scene: &Scene, settings: &RenderSettings) -> Frame {
    let frame = render(scene, 0, settings, &Progress::default()).unwrap_or_else(|e| panic!("render: {e}"));
    assert_eq!(frame.stats.non_finite_samples, 0, "samples that are not finite: {:?}", frame.stats.non_finite_examples);
    frame
}

/// One picture a seed, seeds `0..count`.
pub fn shoot_seeds(scene: &Scene, settings: &RenderSettings, count: u64) -> Vec<Picture> {
    let (width, height) = (settings.width as usize, settings.height as usize);
    let shoot = |seed| shoot(scene, &RenderSettings { seed, ..settings.clone() }).pixels;
    (0..count).map(|seed| Picture { origin: [0, 0], width, height, pixels: shoot(seed) }).collect()
}

/// Mean of a picture per channel.
pub fn channel_means(pixels: &[[f32; 3]]) -> [f64; 3] {
    let sum = pixels.iter().fold([0.0; 3], |s, p| [0, 1, 2].map(|c| s[c] + f64::from(p[c])));
    sum.map(|s| s / pixels.len() as f64)
}
