//! Punctual lights (`KHR_lights_punctual`). Emissive surfaces are materials.

pub mod table;

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
