//! Lights as `render::prepare` hands them to the light table: where they are in the prepared space, and what each is
//! sampled as.

use super::bulb::Bulb;
use super::element::LampTriangle;
use super::quad::Quad;

/// A light in the prepared scene's space. Its radiance, intensity or illuminance is above 0 and finite.
#[derive(Clone, Debug)]
pub enum PreparedLight {
    /// A glowing mesh where it is placed, or a part of one.
    Mesh {
        /// At least one, of areas whose inverse is in the range of f32.
        triangles: Vec<LampTriangle>,
        /// Mean over channels and the surface, nits.
        radiance: f64,
        /// Whether it shines on both sides.
        both_sides: bool,
        /// Material index; emission is looked up there.
        material: u32,
        /// What it is sampled as.
        shape: LampShape,
    },
    /// A glowing sphere, exactly; its radiance is where it is hit.
    Ball {
        /// A little larger than it is.
        bulb: Bulb,
        /// Mean over channels and the surface, nits.
        radiance: f64,
        /// Whether it shines on both sides.
        both_sides: bool,
        /// Its index among all triangles.
        primitive: u32,
    },
    /// A point light, or a spot light about an axis.
    Point {
        /// Metres.
        position: glam::Vec3,
        /// cd per channel.
        intensity: [f32; 3],
        /// Unit axis and the cosines of the inner and outer half angles.
        cone: Option<(glam::Vec3, f32, f32)>,
        /// Of the ball that it is, metres; 0: none.
        radius: f64,
        /// Position and axis at later times of the shutter, evenly spaced; empty at rest.
        later: Vec<(glam::Vec3, glam::Vec3)>,
    },
    /// Parallel light.
    Directional {
        /// Unit, towards the light.
        towards: glam::Vec3,
        /// lux per channel.
        illuminance: [f32; 3],
        /// Half the angle that it is seen at, radians, at most pi/2; 0: none.
        angular_radius: f64,
        /// Direction towards it at later times of the shutter, evenly spaced; empty at rest.
        later: Vec<glam::Vec3>,
    },
}

/// What a glowing mesh is sampled as.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LampShape {
    /// Points on its triangles, each as likely.
    Triangles,
    /// The same, by one square of numbers.
    Quad(Quad),
    /// Directions towards it.
    Bulb(Bulb),
}

impl LampShape {
    /// The shape that connected triangles make; no bulb unless one is allowed.
    pub fn of(lamps: &[LampTriangle], may_be_bulb: bool) -> Self {
        let bulb = Bulb::of(lamps).filter(|_| may_be_bulb);
        let quad = || Quad::of(lamps).map_or(Self::Triangles, Self::Quad);
        bulb.map_or_else(quad, Self::Bulb)
    }
}

impl PreparedLight {
    /// Whether it is a punctual light that moves. (Surfaces are known by their triangles.)
    pub fn moves(&self) -> bool {
        match self {
            Self::Mesh { .. } | Self::Ball { .. } => false,
            Self::Point { later, .. } => !later.is_empty(),
            Self::Directional { later, .. } => !later.is_empty(),
        }
    }

    /// Has a bulb sampled by points on its surface.
    pub fn forget_bulb(&mut self) {
        if let Self::Mesh { shape: shape @ LampShape::Bulb(_), .. } = self {
            *shape = LampShape::Triangles;
        }
    }
}
