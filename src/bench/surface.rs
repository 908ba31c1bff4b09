//! Where on the geometry a ray hit: what bounces and shadow rays start from.

use crate::accel::geometry::{Geometry, Object, Part, Primitives};
use crate::accel::{HitBatch, MISS, RayBatch};
use crate::math::robust::offset_origin;
use glam::Vec3;

/// A point on a triangle, prepared space.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Metres.
    pub p: Vec3,
    /// Unit normal of the triangle, turned to where the ray came from.
    pub ng: Vec3,
    /// Largest |coordinate| of the corners, by axis.
    extent: Vec3,
}

impl SurfacePoint {
    /// What ray `i` hit at time 0; `None` for a miss, an exact shape and a triangle whose normal f32 cannot hold.
    pub fn of_hit(geometry: &Geometry, rays: &RayBatch, hits: &HitBatch, i: usize) -> Option<Self> {
        let (primitive, instance) = (hits.primitive[i], hits.instance[i]);
        if primitive == MISS {
            return None;
        }
        let corners = match instance {
            0 => corners(&geometry.world, primitive)?,
            placed => {
                let placement = &geometry.placements[placed as usize - 1];
                let prepared_from_object = placement.at(0.0);
                corners(&geometry.objects[placement.object as usize], primitive)?
                    .map(|corner| prepared_from_object.point(corner))
            }
        };
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let ng = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        if ng == Vec3::ZERO {
            return None;
        }
        let direction = Vec3::new(rays.dx[i], rays.dy[i], rays.dz[i]);
        let p = a + (b - a) * f64::from(hits.u[i]) + (c - a) * f64::from(hits.v[i]);
        Some(Self {
            p: p.as_vec3(),
            ng: if direction.dot(ng) > 0.0 { -ng } else { ng },
            extent: corners.iter().fold(Vec3::ZERO, |most, corner| most.max(corner.abs())),
        })
    }

    /// Origin of a ray that leaves the point to the side of `direction`.
    pub fn start(&self, direction: Vec3) -> Vec3 {
        offset_origin(self.p, self.extent, self.ng, direction)
    }
}

/// Corners of the triangle numbered `primitive`, at time 0.
fn corners(object: &Object, primitive: u32) -> Option<[Vec3; 3]> {
    object.parts.iter().find_map(|part| Some(part.triangles.corners(index(part, primitive)?)))
}

/// Which of the part's triangles has the number.
fn index(part: &Part, primitive: u32) -> Option<usize> {
    match &part.primitives {
        Primitives::From(first) => {
            primitive.checked_sub(*first).map(|i| i as usize).filter(|&i| i < part.triangles.indices.len())
        }
        Primitives::Each(numbers) => numbers.binary_search(&primitive).ok(),
    }
}
