//! Which surfaces some ray may pass: rays ask about hits on those, and on no others.

use crate::material::{AlphaMode, Material};
use crate::scene::{MaterialId, Scene};
use crate::shape::Mesh;
use crate::texture::{Texels, TextureRef};

/// The least opacity of each material of a scene, vertex colours left out.
pub struct Opacities(Vec<f32>);

impl Opacities {
    /// Reads the opacity textures of what is not opaque.
    pub fn new(scene: &Scene) -> Self {
        Self(scene.materials.iter().map(|material| least(scene, material)).collect())
    }

    /// Whether `mesh` of the same scene has a point that some ray may pass. Exporters write BLEND and MASK for much that is
    /// opaque everywhere.
    pub fn let_rays_pass(&self, scene: &Scene, mesh: &Mesh) -> bool {
        let vertex = || mesh.colors.iter().flatten().fold(1.0, |least: f32, color| least.min(color[3]));
        self.let_rays_pass_at(scene, mesh.material, vertex)
    }

    /// Whether a surface of this material without vertex colours has such a point.
    pub fn material_lets_rays_pass(&self, scene: &Scene, material: MaterialId) -> bool {
        self.let_rays_pass_at(scene, material, || 1.0)
    }

    fn let_rays_pass_at(&self, scene: &Scene, material: MaterialId, vertex: impl Fn() -> f32) -> bool {
        let i = material.index();
        let (Some(material), Some(&opacity)) = (scene.materials.get(i), self.0.get(i)) else { return false };
        match material.alpha_mode {
            AlphaMode::Opaque => false,
            AlphaMode::Mask { cutoff } => opacity * vertex() < cutoff,
            AlphaMode::Blend => opacity * vertex() < 1.0,
        }
    }
}

/// The factor times the least texel: filtering gives nothing less.
fn least(scene: &Scene, material: &Material) -> f32 {
    let texture = material.opacity.texture.filter(|_| material.alpha_mode != AlphaMode::Opaque);
    material.opacity.factor * texture.map_or(1.0, |texture| least_texel(texels(scene, texture)))
}

fn texels(scene: &Scene, read: TextureRef) -> &Texels {
    &scene.images[scene.textures[read.texture.index()].image.index()].texels
}

fn least_texel(texels: &Texels) -> f32 {
    let mut least = 1.0_f32;
    for i in 0..texels.len() {
        least = least.min(texels.get(i)[3]);
        if least == 0.0 {
            break;
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImageId, TextureId};
    use crate::texture::{Filter, Image, Param, Texture, Wrap};

    /// Whether rays pass a mesh of this mode, factor, texel of opacity beside one of 1, and vertex opacity.
    fn pass(alpha_mode: AlphaMode, factor: f32, texel: Option<u8>, vertex: Option<f32>) -> bool {
        let texels = Texels::Rgba8(vec![[255; 4], [0, 0, 0, texel.unwrap_or(255)]]);
        let image = Image { width: 2, height: 1, texels, name: String::new() };
        let (wrap_u, wrap_v) = (Wrap::Repeat, Wrap::Repeat);
        let texture = Texture { image: ImageId(0), wrap_u, wrap_v, filter: Filter::Bilinear };
        let read = texel.map(|_| TextureRef::plain(TextureId(0)));
        let material = Material { alpha_mode, opacity: Param { factor, texture: read }, ..Material::default() };
        let colors = vertex.map(|opacity| vec![[1.0, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, opacity]]);
        let mesh = Mesh {
            positions: Vec::new(),
            normals: None,
            uv_sets: Vec::new(),
            colors,
            tangents: None,
            indices: Vec::new(),
            material: MaterialId(0),
            name: String::new(),
        };
        let scene = Scene {
            images: vec![image.into()],
            textures: vec![texture],
            materials: vec![material],
            ..Scene::default()
        };
        Opacities::new(&scene).let_rays_pass(&scene, &mesh)
    }

    #[test]
    fn rays_pass_only_what_is_somewhere_less_than_there() {
        let mask = AlphaMode::Mask { cutoff: 0.5 };
        assert!(!pass(AlphaMode::Opaque, 0.0, Some(0), Some(0.0)));
        for (mode, opacity) in [(AlphaMode::Blend, [0.9, 1.0]), (mask, [0.4, 0.6])] {
            for (opacity, passes) in opacity.into_iter().zip([true, false]) {
                assert_eq!(pass(mode, opacity, None, None), passes, "{mode:?} factor {opacity}");
                assert_eq!(pass(mode, 1.0, Some((255.0 * opacity) as u8), None), passes, "{mode:?} texel {opacity}");
                assert_eq!(pass(mode, 1.0, None, Some(opacity)), passes, "{mode:?} vertex {opacity}");
            }
        }
        // None of the three alone.
        assert!(pass(mask, 0.8, Some(204), Some(0.75)));
        assert!(pass(AlphaMode::Mask { cutoff: 1.5 }, 1.0, None, None));
        assert!(!pass(AlphaMode::Mask { cutoff: 0.0 }, 0.0, Some(0), None));
    }
}
