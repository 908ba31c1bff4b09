//! Punctual lights (`KHR_lights_punctual`) and environments. Emissive surfaces are materials.

pub mod bounds;
pub mod bulb;
pub mod choice;
pub mod element;
pub mod environment;
pub mod parts;
pub mod prepared;
pub mod quad;
pub mod rect;
pub mod sized;
pub mod studio;
pub mod table;

use std::sync::Arc;

/// Light from all around, infinitely far away: an equirectangular map in world axes.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Texels across, >= 1.
    pub width: u32,
    /// Texels down, >= 1.
    pub height: u32,
    /// `[height * width]` linear Rec.709 radiance, nits, finite and >= 0; row 0 is +Y, the centre column +X, and columns
    /// go on towards +Z. Bilinear between texel centres.
    pub radiance: Arc<[[f32; 3]]>,
    /// Turns counter-clockwise about +Y seen from above, `[0, 1)`.
    pub rotation: f32,
    /// Factor on the radiance, finite and >= 0.
    pub scale: f32,
}

impl Environment {
    /// A map as it stands.
    pub fn new(width: u32, height: u32, radiance: impl Into<Arc<[[f32; 3]]>>) -> Self {
        Self { width, height, radiance: radiance.into(), rotation: 0.0, scale: 1.0 }
    }
}

/// A light without size. It shines along the local -Z axis where it has a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Equal in all directions.
    Point {
        /// Radiant intensity, cd per channel (`color x intensity`).
        intensity: [f32; 3],
    },
    /// A cone about -Z.
    Spot {
        /// cd per channel on the axis.
        intensity: [f32; 3],
        /// Half angle in radians within which the intensity is full; `0 <= inner < outer`.
        inner_cone: f32,
        /// Half angle in radians outside which there is none; at most pi/2.
        outer_cone: f32,
    },
    /// Parallel light travelling along -Z.
    Directional {
        /// lux per channel on a surface facing the light.
        illuminance: [f32; 3],
    },
}
