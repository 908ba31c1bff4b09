//! Image textures as described by the file. Lookups over N lanes are in [`lookup`].

pub mod lookup;
pub mod mips;
mod texels;

use crate::id::{ImageId, TextureId};
pub use texels::{Channels, Few, Texels};

/// Decoded pixels, as encoded in the file (sRGB or linear is decided by the use, not here).
#[derive(Clone, Debug)]
pub struct Image {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `[height * width]`, row 0 at the top.
    pub texels: Texels,
    /// For messages: the image's name or JSON pointer.
    pub name: String,
}

/// What happens outside [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Tiled.
    Repeat,
    /// Tiled, every second tile mirrored.
    MirroredRepeat,
    /// The border texel goes on.
    ClampToEdge,
}

/// How texels are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The texel the point lies in.
    Nearest,
    /// Weighted mean of the four nearest texels.
    Bilinear,
}

/// An image with its sampler.
#[derive(Clone, Debug)]
pub struct Texture {
    /// The pixels.
    pub image: ImageId,
    /// Across.
    pub wrap_u: Wrap,
    /// Down.
    pub wrap_v: Wrap,
    /// Magnification filter, which the levels of detail have as well (`--texture-lod`).
    pub filter: Filter,
}

/// How a material reads a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// What is read.
    pub texture: TextureId,
    /// Where: index into `Mesh::uv_sets`, less than [`crate::math::MAX_UV_SETS`].
    pub uv_set: u32,
    /// Applied to the mesh's coordinates first (`KHR_texture_transform`); `None` = as they are.
    pub transform: Option<UvTransform>,
}

impl TextureRef {
    /// The texture at the first set of coordinates as they are.
    pub fn plain(texture: TextureId) -> Self {
        Self { texture, uv_set: 0, transform: None }
    }
}

/// An affine map of texture coordinates: `u' = m[0][0] u + m[0][1] v + m[0][2]`, `v'` likewise by `m[1]`; finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform {
    /// Two rows.
    pub m: [[f32; 3]; 2],
}

/// A material parameter: `factor`, times a texture where there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Param<T> {
    /// The constant part.
    pub factor: T,
    /// The varying part.
    pub texture: Option<TextureRef>,
}

impl<T> Param<T> {
    /// A parameter without texture.
    pub fn constant(factor: T) -> Self {
        Self { factor, texture: None }
    }
}
