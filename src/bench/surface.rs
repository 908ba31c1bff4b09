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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::geometry::{Affine, Placement};
    use crate::accel::{Accel, Triangles, linear::Linear};

    fn part(z: f32, primitives: Primitives) -> Part {
        let positions = vec![[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 9.0, z], [0.0, -9.0, z]];
        Part { triangles: Triangles { positions, indices: vec![[0, 3, 2], [3, 1, 2]] }, primitives, ..Part::default() }
    }

    #[test]
    fn points_lie_on_the_rays_in_the_world_and_in_placed_objects() {
        let object = |parts| Object { parts, shapes: Vec::new() };
        // Mirrored and stretched, in front of the world's triangles for x > 0 only.
        let map = Affine { columns: [-Vec3::X, Vec3::Y * 0.5, Vec3::Z * 3.0], translation: Vec3::new(9.0, 1.0, 4.0) };
        let geometry = Geometry {
            world: object(vec![part(50.0, Primitives::From(7)), part(-1.0, Primitives::Each(vec![2, 30]))]),
            objects: vec![object(vec![part(0.5, Primitives::Each(vec![3, 4]))])],
            placements: vec![Placement { object: 0, keys: vec![map] }],
            filter: None,
        };
        let (mut rays, mut hits) = (RayBatch::new(16), HitBatch::new(16));
        for i in 0..4 {
            let x = [-1.5, -0.5, 4.0, 8.5][i];
            rays.set(i, Vec3::new(x, 0.2, 20.0), Vec3::new(0.1, -0.05, -2.0), f32::INFINITY);
        }
        rays.set(4, Vec3::new(0.0, 0.0, -5.0), Vec3::NEG_Z, f32::INFINITY);
        Linear::new(geometry.clone()).intersect(&rays, 0..5, false, &mut hits);
        assert_eq!(hits.primitive[..5], [2, 30, 4, 3, MISS]);
        for i in 0..4 {
            let point = SurfacePoint::of_hit(&geometry, &rays, &hits, i).unwrap();
            let origin = Vec3::new(rays.ox[i], rays.oy[i], rays.oz[i]);
            let at = origin + Vec3::new(0.1, -0.05, -2.0) * hits.t[i];
            assert!((point.p - at).length() < 1e-5, "{} is not {at}", point.p);
            assert!((point.ng - Vec3::Z).length() < 1e-6, "the side that the ray came from: {}", point.ng);
            assert!(point.start(Vec3::Z).z > point.p.z && point.start(Vec3::NEG_Z).z < point.p.z);
        }
        assert!(SurfacePoint::of_hit(&geometry, &rays, &hits, 4).is_none());
    }
}
