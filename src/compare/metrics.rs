//! relMSE and mean ratios, as `docs/cli.md` defines them.

use crate::image::exr_read::Picture;
use serde::Serialize;

/// Share of pixels that the trimmed relMSE leaves out: the worst 0.1 %.
const TRIM: f64 = 1e-3;
/// Weight of the squared mean luminance in the denominator of relMSE.
const EPSILON: f64 = 0.01;

/// Difference of a picture from its reference.
#[derive(Clone, Debug, Serialize)]
pub struct Metrics {
    /// Mean over pixels and channels of `(a - r)^2 / (rm^2 + 0.01 mean(rm)^2)`; null with a non-finite pixel.
    pub relmse: Option<f64>,
    /// The same without the worst 0.1 % of the pixels.
    pub relmse_trimmed: Option<f64>,
    /// The reference is black, so both numbers are absolute mean squared errors.
    pub absolute: bool,
    /// Mean of the picture over mean of the reference, per channel; null where the reference's is 0.
    pub mean_ratio: [Option<f64>; 3],
    /// Pixels of the picture with a channel that is not finite: a failure whatever the rest says.
    pub non_finite_pixels: usize,
    /// Pixels of the reference with a channel that is not finite.
    pub non_finite_reference_pixels: usize,
}

/// Compares two pictures of the same size.
///
/// # Panics
/// If the sizes differ.
pub fn metrics(picture: &Picture, reference: &Picture) -> Metrics {
    let (a, r) = (&picture.pixels, &reference.pixels);
    assert_eq!(a.len(), r.len(), "pictures of one size");
    let bad = |pixels: &[[f32; 3]]| pixels.iter().filter(|p| p.iter().any(|c| !c.is_finite())).count();
    let (non_finite_pixels, non_finite_reference_pixels) = (bad(a), bad(r));
    let finite = non_finite_pixels + non_finite_reference_pixels == 0;

    let denominators = denominators(reference);
    let absolute = denominators.is_none();
    let mut errors: Vec<f64> = (a.iter().zip(r).enumerate())
        .map(|(i, (a, r))| {
            let squares: f64 = (0..3).map(|c| (f64::from(a[c]) - f64::from(r[c])).powi(2)).sum();
            squares / 3.0 / denominators.as_ref().map_or(1.0, |d| d[i])
        })
        .collect();
    errors.sort_unstable_by(f64::total_cmp);
    let kept = ((errors.len() as f64 * (1.0 - TRIM)).round() as usize).max(1).min(errors.len());
    let mean = |errors: &[f64]| finite.then(|| errors.iter().sum::<f64>() / errors.len() as f64);
    let (mean_a, mean_r) = (means(a), means(r));
    let ratio = |c: usize| Some(mean_a[c] / mean_r[c]).filter(|ratio: &f64| ratio.is_finite());
    Metrics {
        relmse: mean(&errors),
        relmse_trimmed: mean(&errors[..kept]),
        absolute,
        mean_ratio: [ratio(0), ratio(1), ratio(2)],
        non_finite_pixels,
        non_finite_reference_pixels,
    }
}

/// Per pixel `rm^2 + 0.01 mean(rm)^2` with `rm` the mean of the reference's channels; `None` for a black reference.
pub(super) fn denominators(reference: &Picture) -> Option<Vec<f64>> {
    let gray = |p: &[f32; 3]| p.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
    let mean = reference.pixels.iter().map(gray).sum::<f64>() / reference.pixels.len() as f64;
    let black = reference.pixels.iter().all(|p| *p == [0.0; 3]);
    (!black).then(|| reference.pixels.iter().map(|p| gray(p).powi(2) + EPSILON * mean * mean).collect())
}

/// Mean of each channel.
pub(super) fn means(pixels: &[[f32; 3]]) -> [f64; 3] {
    std::array::from_fn(|c| pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / pixels.len() as f64)
}

/// The mean of several pictures of one size.
pub fn mean_picture(pictures: &[Picture]) -> Picture {
    let mut mean = pictures[0].clone();
    for (i, pixel) in mean.pixels.iter_mut().enumerate() {
        let sum = |c: usize| pictures.iter().map(|p| f64::from(p.pixels[i][c])).sum::<f64>();
        *pixel = std::array::from_fn(|c| (sum(c) / pictures.len() as f64) as f32);
    }
    mean
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(pixels: Vec<[f32; 3]>) -> Picture {
        Picture { origin: [0, 0], width: pixels.len(), height: 1, pixels }
    }

    #[test]
    fn relmse_matches_hand_calculation() {
        // rm = 1 and 3, mean 2, denominators 1.04 and 9.04; squared errors 0.75 / 3 and 3 / 3.
        let reference = picture(vec![[0.0, 1.0, 2.0], [3.0; 3]]);
        let a = picture(vec![[0.5, 1.5, 2.5], [4.0; 3]]);
        let metrics = metrics(&a, &reference);
        assert!((metrics.relmse.unwrap() - (0.25 / 1.04 + 1.0 / 9.04) / 2.0).abs() < 1e-12);
        assert!((metrics.mean_ratio[0].unwrap() - 1.5).abs() < 1e-12);
        assert!(!metrics.absolute);
    }

    #[test]
    fn trimming_leaves_out_one_pixel_in_a_thousand() {
        let reference = picture(vec![[1.0; 3]; 1000]);
        let mut a = reference.clone();
        a.pixels[500] = [100.0; 3];
        let metrics = metrics(&a, &reference);
        assert!(metrics.relmse.unwrap() > 9.0);
        assert_eq!(metrics.relmse_trimmed, Some(0.0));
    }

    #[test]
    fn a_black_reference_gives_the_absolute_error() {
        let metrics = metrics(&picture(vec![[0.5; 3]; 4]), &picture(vec![[0.0; 3]; 4]));
        assert_eq!((metrics.relmse, metrics.absolute, metrics.mean_ratio[1]), (Some(0.25), true, None));
    }

    #[test]
    fn a_non_finite_pixel_leaves_no_number() {
        let reference = picture(vec![[1.0; 3]; 4]);
        let mut a = reference.clone();
        a.pixels[1][2] = f32::NAN;
        a.pixels[3] = [f32::INFINITY; 3];
        let metrics = metrics(&a, &reference);
        assert_eq!((metrics.relmse, metrics.relmse_trimmed, metrics.non_finite_pixels), (None, None, 2));
    }
}
