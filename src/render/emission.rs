//! What surfaces emit on average, for choosing among lights and for asking whether a scene is lit at all.

use crate::color::linear_from_srgb;
use crate::material::{AlphaMode, Material};
use crate::scene::Scene;
use crate::texture::{Texels, TextureRef};

/// Mean radiance of each material over its texture, nits per channel; 0 where it emits nothing that can be seen.
pub fn mean_emissions(scene: &Scene) -> Vec<[f64; 3]> {
    scene.materials.iter().map(|m| mean_emission(scene, m)).collect()
}

/// The factor, times the texture's mean decoded to linear, times the share of the surface that is there. The two
/// textures' means are taken apart: where they go together the product is a little off, which a weight may be.
fn mean_emission(scene: &Scene, material: &Material) -> [f64; 3] {
    let factor = material.emission.factor.map(f64::from);
    if material.unlit || factor.iter().all(|&f| f <= 0.0) {
        return [0.0; 3];
    }
    let texture = material.emission.texture.map_or([1.0; 3], |texture| mean_color(texels(scene, texture)));
    let there = coverage(scene, material);
    [0, 1, 2].map(|c| factor[c] * texture[c] * there)
}

fn texels(scene: &Scene, read: TextureRef) -> &Texels {
    &scene.images[scene.textures[read.texture.index()].image.index()].texels
}

/// Mean of R, G, B, decoded from sRGB.
fn mean_color(texels: &Texels) -> [f64; 3] {
    match texels {
        Texels::Rgba8(texels) => [0, 1, 2].map(|c| mean(texels.iter().map(|t| t[c]))),
        Texels::Rgba16(texels) => [0, 1, 2].map(|c| mean(texels.iter().map(|t| t[c]))),
        Texels::Few8(few) => [0, 1, 2].map(|c| mean(few.channel(c))),
        Texels::Few16(few) => [0, 1, 2].map(|c| mean(few.channel(c))),
    }
}

/// Mean of integers of 8 or 16 bits that are sRGB, decoded: a curve for each value that there is, not one a texel.
fn mean<T: Copy + Into<u32>>(values: impl Iterator<Item = T>) -> f64 {
    let mut counts = vec![0_u64; 1 << (8 * size_of::<T>())];
    for value in values {
        counts[value.into() as usize] += 1;
    }
    let (n, last) = (counts.iter().sum::<u64>().max(1) as f64, (counts.len() - 1) as f64);
    let decoded = |value: usize| linear_from_srgb(value as f64 / last);
    counts.iter().enumerate().filter(|(_, k)| **k > 0).map(|(v, &k)| decoded(v) * k as f64).sum::<f64>() / n
}

/// Mean share of the surface that is there; vertex colours are left out.
fn coverage(scene: &Scene, material: &Material) -> f64 {
    let factor = f64::from(material.opacity.factor);
    let there = |alpha: f64| match material.alpha_mode {
        AlphaMode::Opaque => 1.0,
        AlphaMode::Mask { cutoff } => f64::from(u8::from(factor * alpha >= f64::from(cutoff))),
        AlphaMode::Blend => (factor * alpha).clamp(0.0, 1.0),
    };
    match material.opacity.texture {
        Some(texture) if material.alpha_mode != AlphaMode::Opaque => {
            let texels = texels(scene, texture);
            let sum: f64 = (0..texels.len()).map(|i| there(f64::from(texels.get(i)[3]))).sum();
            sum / texels.len().max(1) as f64
        }
        _ => there(1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImageId, TextureId};
    use crate::texture::{Channels, Filter, Image, Param, Texture, Wrap};

    fn scene(texels: Texels) -> Scene {
        let image = Image { width: texels.len() as u32, height: 1, texels, name: String::new() };
        let (wrap_u, wrap_v) = (Wrap::Repeat, Wrap::Repeat);
        let texture = Texture { image: ImageId(0), wrap_u, wrap_v, filter: Filter::Nearest };
        Scene { images: vec![image.into()], textures: vec![texture], ..Scene::default() }
    }

    fn glowing() -> Material {
        let texture = Some(TextureRef::plain(TextureId(0)));
        Material { emission: Param { factor: [2.0, 1.0, 0.0], texture }, ..Material::default() }
    }

    #[test]
    fn a_texture_counts_by_its_mean_decoded_to_linear() {
        // sRGB 188 is linear 0.5029 (IEC 61966-2-1), so half white, half of it is 0.7514.
        let whole = [Texels::Rgba8(vec![[188; 4], [255; 4]]), Texels::Rgba16(vec![[188 * 257; 4], [65535; 4]])];
        let narrow = whole.clone().map(|texels| texels.narrowed(Channels::RGB));
        for texels in whole.into_iter().chain(narrow) {
            let mean = mean_emission(&scene(texels), &glowing());
            assert!((mean[0] - 2.0 * 0.75144).abs() < 2e-4 && (mean[1] - 0.75144).abs() < 1e-4, "{mean:?}");
            assert_eq!(mean[2], 0.0);
        }
    }

    #[test]
    fn what_is_unlit_or_seen_through_does_not_count() {
        let scene = scene(Texels::Rgba8(vec![[255, 255, 255, 51], [255; 4]]));
        let texture = Some(TextureRef::plain(TextureId(0)));
        let mut material = Material { opacity: Param { factor: 0.5, texture }, ..glowing() };
        let red = |m: &Material| mean_emission(&scene, m)[0];
        assert_eq!(red(&material), 2.0);
        material.alpha_mode = AlphaMode::Blend;
        assert!((red(&material) - 2.0 * 0.5 * 0.6).abs() < 1e-6);
        material.alpha_mode = AlphaMode::Mask { cutoff: 0.4 };
        assert_eq!(red(&material), 1.0);
        material.unlit = true;
        assert_eq!(red(&material), 0.0);
    }
}
