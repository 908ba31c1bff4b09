//! Image textures as described by the file. Lookups over N lanes are in [`lookup`].

pub mod lookup;

use crate::id::{ImageId, TextureId};

/// Decoded pixels, 8 bits a channel, as encoded in the file (sRGB or linear is decided by the use, not here).
#[derive(Clone, Debug)]
pub struct Image {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `[height * width]`, row 0 at the top, R G B A.
    pub texels: Vec<[u8; 4]>,
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
    /// Magnification filter; textures are always read at level 0.
    pub filter: Filter,
}

/// A material parameter: `factor`, times a texture where there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Param<T> {
    /// The constant part.
    pub factor: T,
    /// The varying part.
    pub texture: Option<TextureId>,
}

impl<T> Param<T> {
    /// A parameter without texture.
    pub fn constant(factor: T) -> Self {
        Self { factor, texture: None }
    }
}
