//! Textures of MTL maps: the picture as it is, or one derived from it where the shader reads a parameter in another way
//! than MTL writes it.

use super::files::{Picture, Pictures};
use super::map::{Channel, Map};
use crate::color::{linear_from_srgb, srgb_from_linear};
use crate::scene::{ImageId, SceneBuilder};
use crate::texture::{Filter, Image, Texels, Texture, TextureRef, Wrap};
use rayon::prelude::*;
use std::path::PathBuf;

/// What a map means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meaning {
    /// A reflectance in sRGB.
    Color,
    /// Radiance in sRGB; the gain of `-mm` may make it any size.
    Emission,
    /// A linear reflectance, for a slot that is read as sRGB.
    LinearColor,
    /// A linear number, read from whichever channel the slot reads.
    Scalar,
    /// A height; the gain of `-mm` may make it any size.
    Height,
    /// An opacity, for a slot that reads A.
    Opacity,
    /// A share of Phong's exponent, which becomes a roughness.
    Gloss {
        /// The exponent at 1.
        ns: f32,
    },
    /// A normal in tangent space.
    Normal,
}

/// A picture to be made of a file.
#[derive(Clone, Debug, PartialEq)]
struct Recipe {
    path: PathBuf,
    /// `None` = as it is.
    change: Option<(Meaning, Option<Channel>, [f32; 2])>,
}

/// The textures of a scene while materials ask for them.
pub(super) struct Textures {
    pub pictures: Pictures,
    /// In the order of their [`ImageId`].
    recipes: Vec<Recipe>,
    /// In the order of their ids: image, and whether it is clamped.
    textures: Vec<(ImageId, bool)>,
}

impl Textures {
    pub fn new(pictures: Pictures) -> Self {
        Self { pictures, recipes: Vec::new(), textures: Vec::new() }
    }

    /// The texture of `map` and what the parameter's factor is to be multiplied by; `None` if there is no picture.
    pub fn get(
        &mut self,
        builder: &mut SceneBuilder,
        folder: &str,
        map: &Map,
        meaning: Meaning,
    ) -> Option<(TextureRef, f32)> {
        let path = self.pictures.path(folder, map)?.to_owned();
        let unbounded = matches!(meaning, Meaning::Emission | Meaning::Height);
        // A gain alone goes into the factor where that may have any size; else values are baked, and end at 0 and 1.
        let (range, factor) = match (map.base, map.gain) {
            (0.0, gain) if unbounded && gain >= 0.0 => ([0.0, 1.0], gain),
            (base, gain) if unbounded => {
                let most = base.max(base + gain).max(f32::MIN_POSITIVE);
                ([base / most, gain / most], most)
            }
            (base, gain) => ([base, gain], 1.0),
        };
        let as_it_is = match meaning {
            Meaning::Color | Meaning::Emission => range == [0.0, 1.0],
            Meaning::Scalar => range == [0.0, 1.0] && map.channel.is_none(),
            Meaning::Height => range == [0.0, 1.0] && map.channel.is_none() && self.is_gray(&path),
            Meaning::LinearColor | Meaning::Opacity | Meaning::Gloss { .. } => false,
            Meaning::Normal => true,
        };
        let change = (!as_it_is).then_some((meaning, map.channel, range));
        let recipe = Recipe { path, change };
        let image = place_of(&mut self.recipes, recipe);
        let known = self.textures.len();
        let texture = place_of(&mut self.textures, (ImageId(image as u32), map.clamp));
        if texture == known {
            let wrap = if map.clamp { Wrap::ClampToEdge } else { Wrap::Repeat };
            let image = ImageId(image as u32);
            builder.add_texture(Texture { image, wrap_u: wrap, wrap_v: wrap, filter: Filter::Bilinear });
        }
        let texture = crate::scene::TextureId(texture as u32);
        Some((TextureRef { texture, uv_set: 0, transform: map.transform() }, factor))
    }

    fn is_gray(&self, path: &std::path::Path) -> bool {
        self.pictures
            .get(path)
            .is_some_and(|p| (0..p.texels.len()).map(|i| p.texels.get(i)).all(|[r, g, b, _]| r == g && g == b))
    }

    /// Makes the pictures that were asked for.
    pub fn finish(mut self, builder: &mut SceneBuilder) {
        let pictures = &self.pictures;
        let make = |recipe: &Recipe| {
            let (meaning, channel, range) = recipe.change?;
            Some(derive(pictures.get(&recipe.path)?, meaning, channel, range))
        };
        let derived: Vec<Option<Picture>> = self.recipes.par_iter().map(make).collect();
        let mut found = Vec::with_capacity(derived.len());
        for (recipe, derived) in self.recipes.iter().zip(derived) {
            let picture = derived.or_else(|| self.pictures.take(&recipe.path));
            found.push(picture.expect("each recipe's file was decoded, and is taken once"));
        }
        let used = builder.channels();
        let narrow = |(i, Picture { width, height, texels }): (usize, Picture)| {
            let texels = texels.narrowed(used.get(i).copied().unwrap_or_default());
            let name = self.recipes[i].path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            Image { width, height, texels, name }
        };
        let images: Vec<Image> = found.into_par_iter().enumerate().map(narrow).collect();
        for image in images {
            builder.add_image(image);
        }
    }
}

/// Where `item` is in `list`; it is added if it is not there.
fn place_of<T: PartialEq>(list: &mut Vec<T>, item: T) -> usize {
    list.iter().position(|known| *known == item).unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    })
}

/// Rec.709 luminance of encoded values: what `-imfchan l` means for a picture without colour management.
fn luminance([r, g, b, _]: [f32; 4]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The picture that a slot reads as `meaning`; 16 bits a channel, so that nothing is lost by the way.
fn derive(picture: &Picture, meaning: Meaning, channel: Option<Channel>, [base, gain]: [f32; 2]) -> Picture {
    let in_range = |v: f32| (base + gain * v).clamp(0.0, 1.0);
    let count = picture.texels.len();
    let has_alpha = meaning == Meaning::Opacity && (0..count).any(|i| picture.texels.get(i)[3] < 1.0);
    let scalar = |t: [f32; 4]| {
        in_range(match channel {
            Some(Channel::Red) => t[0],
            Some(Channel::Green) => t[1],
            Some(Channel::Blue) => t[2],
            Some(Channel::Alpha) => t[3],
            Some(Channel::Luminance) => luminance(t),
            // Pictures with an alpha channel are given for its sake.
            None if has_alpha => t[3],
            None => luminance(t),
        })
    };
    let srgb = |v: f32| srgb_from_linear(f64::from(v)) as f32;
    let linear = |v: f32| linear_from_srgb(f64::from(v)) as f32;
    let texel = |t: [f32; 4]| match meaning {
        Meaning::Color | Meaning::Emission => {
            [0, 1, 2, 3].map(|k| if k < 3 { srgb(in_range(linear(t[k]))) } else { t[k] })
        }
        Meaning::LinearColor => [0, 1, 2, 3].map(|k| if k < 3 { srgb(in_range(t[k])) } else { t[k] }),
        // Which channel a slot reads differs: without `-imfchan` each keeps its own.
        Meaning::Scalar if channel.is_none() => t.map(in_range),
        Meaning::Scalar | Meaning::Height => [scalar(t); 4],
        Meaning::Opacity => [1.0, 1.0, 1.0, scalar(t)],
        Meaning::Gloss { ns } => [roughness(ns * scalar(t)); 4],
        Meaning::Normal => t,
    };
    let encode = |i: usize| texel(picture.texels.get(i)).map(|v| (v * 65535.0).round() as u16);
    let texels = Texels::Rgba16((0..count).into_par_iter().map(encode).collect());
    Picture { width: picture.width, height: picture.height, texels }
}

/// glTF's perceptual roughness of Phong's exponent: alpha = sqrt(2 / (Ns + 2)) (Walter et al. 2007, "Microfacet Models
/// for Refraction through Rough Surfaces", section 5.2, for Beckmann; close for GGX), roughness = sqrt(alpha).
pub(super) fn roughness(ns: f32) -> f32 {
    (2.0 / (ns.max(0.0) + 2.0)).sqrt().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn derived(texel: [u8; 4], meaning: Meaning, channel: Option<Channel>, range: [f32; 2]) -> [f32; 4] {
        let picture = Picture { width: 1, height: 1, texels: Texels::Rgba8(vec![texel]) };
        derive(&picture, meaning, channel, range).texels.get(0)
    }

    fn close(a: [f32; 4], b: [f32; 4]) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4), "{a:?} {b:?}");
    }

    #[test]
    fn linear_colours_read_as_srgb_come_out_as_they_are() {
        let [r, g, b, _] = derived([0, 51, 255, 255], Meaning::LinearColor, None, [0.0, 1.0]);
        let linear = [r, g, b].map(|v| linear_from_srgb(f64::from(v)) as f32);
        close([linear[0], linear[1], linear[2], 0.0], [0.0, 0.2, 1.0, 0.0]);
    }

    #[test]
    fn opacity_is_alpha_where_there_is_one_else_luminance_else_the_channel_asked_for() {
        close(derived([255, 255, 255, 51], Meaning::Opacity, None, [0.0, 1.0]), [1.0, 1.0, 1.0, 0.2]);
        close(derived([51, 51, 51, 255], Meaning::Opacity, None, [0.0, 1.0]), [1.0, 1.0, 1.0, 0.2]);
        close(derived([51, 0, 0, 255], Meaning::Opacity, Some(Channel::Red), [0.0, 1.0]), [1.0, 1.0, 1.0, 0.2]);
    }

    #[test]
    fn gloss_and_ranges() {
        let expected = (2.0_f32 / 42.0).powf(0.25);
        close(derived([51, 51, 51, 255], Meaning::Gloss { ns: 200.0 }, None, [0.0, 1.0]), [expected; 4]);
        close(derived([0, 51, 255, 255], Meaning::Scalar, None, [0.5, 1.0]), [0.5, 0.7, 1.0, 1.0]);
        let [v, ..] = derived([255, 255, 255, 255], Meaning::Color, None, [0.0, 0.5]);
        assert!((linear_from_srgb(f64::from(v)) - 0.5).abs() < 1e-4);
    }
}
