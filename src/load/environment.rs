//! Environments from files of their own.

use crate::image::radiance_map;
use crate::light::Environment;
use std::path::Path;

/// The equirectangular environment in the Radiance HDR or OpenEXR file `path`, and what of it is not as it should be.
///
/// Texels that are infinite are taken as the brightest that is not (half floats end at 65504, and suns do not), those
/// that are negative or no number as 0 in that channel.
///
/// # Errors
/// It cannot be read or is no such picture; the text names the file.
pub fn load_environment(path: &Path) -> Result<(Environment, Vec<String>), String> {
    let shown = path.display();
    let bytes = std::fs::read(path).map_err(|error| format!("{shown}: cannot be read: {error}"))?;
    let fix = "Allowed: a .hdr or .exr file.";
    let map = radiance_map::decode(&bytes).map_err(|problem| format!("{shown}: {problem}\n  {fix}"))?;
    let mut warnings = Vec::new();
    let (width, height, mut radiance) = (map.width, map.height, map.pixels);
    if u64::from(width) != 2 * u64::from(height) && width * height > 1 {
        warnings.push(format!("{shown}: {width} x {height} texels; an equirectangular map is twice as wide as high"));
    }
    let brightest = radiance.iter().flatten().copied().filter(|c| c.is_finite()).fold(0.0, f32::max);
    let (mut infinite, mut dark) = (0_u64, 0_u64);
    for channel in radiance.iter_mut().flatten() {
        if *channel == f32::INFINITY {
            (*channel, infinite) = (brightest, infinite + 1);
        } else if channel.is_nan() || *channel < 0.0 {
            (*channel, dark) = (0.0, dark + 1);
        }
    }
    if infinite > 0 {
        warnings
            .push(format!("{shown}: {infinite} channels of texels are infinite: taken as {brightest}, the brightest"));
    }
    if dark > 0 {
        warnings.push(format!("{shown}: {dark} channels of texels are negative or no number: taken as 0"));
    }
    if radiance.iter().flatten().all(|c| *c == 0.0) {
        warnings.push(format!("{shown}: is black: no light comes from it"));
    }
    Ok((Environment { width, height, radiance: radiance.into(), rotation: 0.0, scale: 1.0 }, warnings))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn texels_that_are_no_radiance_are_mended_and_counted() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("a.exr");
        let texels = [[1.0, -1.0, 0.5], [f32::INFINITY, f32::NAN, 60000.0], [0.0; 3], [2.0; 3]];
        exr::prelude::write_rgb_file(&path, 4, 1, |x, _| texels[x].into()).unwrap();
        let (map, warnings) = load_environment(&path).unwrap();
        assert_eq!(&map.radiance[..], [[1.0, 0.0, 0.5], [60000.0, 0.0, 60000.0], [0.0; 3], [2.0; 3]]);
        let says =
            ["4 x 1 texels", "1 channels of texels are infinite: taken as 60000", "2 channels of texels are negative"];
        assert_eq!(warnings.len(), 3);
        for (warning, part) in warnings.iter().zip(says) {
            assert!(warning.contains(part) && warning.contains("a.exr"), "{warning}");
        }
        fs::write(&path, "no picture").unwrap();
        let error = load_environment(&path).unwrap_err();
        assert!(error.contains("a.exr: is neither") && error.contains("Allowed: a .hdr or .exr file"), "{error}");
    }
}
