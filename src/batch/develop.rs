//! From radiance to the bytes of a PNG: the same for a picture just rendered and for one read from an EXR.

use crate::color::{Advice, Exposure, Luminances, Shades, ToneCurve, ToneMap, advice};
use crate::image::png;

/// How radiance becomes a PNG.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tone {
    /// As asked for.
    pub exposure: Exposure,
    /// After the exposure.
    pub curve: ToneCurve,
}

/// A PNG and what there is to say about it.
#[derive(Clone, Debug)]
pub struct Developed {
    /// The bytes of the file.
    pub png: Vec<u8>,
    /// Stops used.
    pub exposure: f64,
    /// Said to the user, no cause for concern.
    pub notes: Vec<String>,
    /// What is wrong with the picture.
    pub warnings: Vec<String>,
}

/// The PNG of `pixels`: `[height * width]`, linear Rec.709, nits. Where `alpha`, of the same shape, is not 1 everywhere,
/// the colours are premultiplied by it; the PNG then has straight colours and alpha. The exposure `auto` meters these
/// pixels and nothing else.
///
/// # Panics
/// If `pixels` or `alpha` do not fill `width x height`.
pub fn develop(pixels: &[[f32; 3]], alpha: Option<&[f32]>, [width, height]: [u32; 2], tone: Tone) -> Developed {
    let alpha = alpha.filter(|alpha| alpha.iter().any(|&a| a != 1.0));
    let straight: Vec<[f32; 3]>;
    let pixels = match alpha {
        None => pixels,
        Some(alpha) => {
            straight = pixels.iter().zip(alpha).map(|(&pixel, &alpha)| unpremultiplied(pixel, alpha)).collect();
            &straight
        }
    };
    let exposure = tone.exposure.resolve(|| Luminances::of(pixels));
    let map = ToneMap { exposure, curve: tone.curve };
    let (mut shades, mut nan_channels) = (Shades::default(), 0);
    let mut bytes = Vec::with_capacity(pixels.len() * if alpha.is_some() { 4 } else { 3 });
    for (index, &radiance) in pixels.iter().enumerate() {
        let (color, nan) = map.apply(radiance);
        shades.add(color);
        nan_channels += u64::from(nan);
        bytes.extend_from_slice(&color);
        if let Some(alpha) = alpha {
            // NaN becomes 0.
            bytes.push((alpha[index].clamp(0.0, 1.0) * 255.0).round() as u8);
        }
    }
    let png = match alpha {
        None => png::encode(&bytes, width, height),
        Some(_) => png::encode_rgba(&bytes, width, height),
    };

    let (mut notes, mut warnings) = (Vec::new(), Vec::new());
    if nan_channels > 0 {
        warnings.push(format!("{nan_channels} channels of the picture are NaN; the PNG shows them as 0"));
    }
    match tone.exposure {
        Exposure::Auto => notes.push(format!("--exposure auto is {exposure}")),
        Exposure::Stops(_) if shades.is_hopeless() => {
            let advice: Option<Advice> = advice(&shades, &Luminances::of(pixels), exposure);
            warnings.extend(advice.map(|advice| advice.to_string()));
        }
        Exposure::Stops(_) => {}
    }
    Developed { png, exposure, notes, warnings }
}

/// The colour that alpha was multiplied into; without any alpha (light that covers nothing) it stays.
fn unpremultiplied(pixel: [f32; 3], alpha: f32) -> [f32; 3] {
    if alpha > 0.0 { pixel.map(|c| c / alpha) } else { pixel }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: [[f32; 3]; 4] = [[0.25, 0.5, 1.0], [0.0, 0.1, 0.2], [f32::NAN, 0.5, -1.0], [2.0, 2.0, 2.0]];

    fn tone(stops: f64) -> Tone {
        Tone { exposure: Exposure::Stops(stops), curve: ToneCurve::Srgb }
    }

    fn read(developed: &Developed) -> image::DynamicImage {
        image::load_from_memory(&developed.png).unwrap()
    }

    #[test]
    fn alpha_of_one_everywhere_changes_no_byte() {
        let plain = develop(&PIXELS, None, [2, 2], tone(0.0));
        assert_eq!(read(&plain).color(), image::ColorType::Rgb8);
        assert_eq!(develop(&PIXELS, Some(&[1.0; 4]), [2, 2], tone(0.0)).png, plain.png);
        assert_eq!(plain.warnings, ["1 channels of the picture are NaN; the PNG shows them as 0"]);
    }

    #[test]
    fn colours_are_divided_by_alpha_before_the_curve() {
        let alpha = [0.5, 1.0, 0.0, f32::NAN];
        let pixels = [[0.09, 0.0, 0.25], [0.18, 0.0, 0.5], [0.0; 3], [0.18; 3]];
        let developed = read(&develop(&pixels, Some(&alpha), [4, 1], tone(0.0)));
        assert_eq!(developed.color(), image::ColorType::Rgba8);
        let expected = [[118, 0, 188, 128], [118, 0, 188, 255], [0, 0, 0, 0], [118, 118, 118, 0]].concat();
        assert_eq!(developed.into_rgba8().into_raw(), expected);
    }

    #[test]
    fn auto_is_said_and_can_be_typed() {
        let auto = develop(&PIXELS, None, [2, 2], Tone { exposure: Exposure::Auto, curve: ToneCurve::Neutral });
        assert_eq!(auto.notes, [format!("--exposure auto is {}", auto.exposure)]);
        let typed = Tone { exposure: Exposure::Stops(auto.exposure), curve: ToneCurve::Neutral };
        assert_eq!(develop(&PIXELS, None, [2, 2], typed).png, auto.png);
    }

    #[test]
    fn a_hopeless_exposure_is_warned_about() {
        let dark = develop(&[[1e-4; 3]; 4], None, [2, 2], tone(0.0));
        assert!(dark.warnings.iter().any(|w| w.contains("almost black") && w.contains("--exposure 12.5")), "{dark:?}");
        assert!(develop(&[[1e-4; 3]; 4], None, [2, 2], tone(12.5)).warnings.is_empty());
        assert!(develop(&[[0.0; 3]; 4], None, [2, 2], tone(0.0)).warnings.is_empty());
    }
}
