//! A camera for a scene without one: where it stands so that the whole scene is in the picture and can be recognised.
//! The policy is stated in docs/conventions.md, "Framing".

use super::boxes::Boxes;
use super::shapes;
use crate::camera::{Camera, Lens, Projection};
use crate::scene::{Framing, Instance, Scene};
use crate::shape::placement::cofactor;
use glam::{DMat3, DMat4, DVec3};

/// Vertical field of view, degrees.
pub const FRAMING_YFOV: f64 = 40.0;
/// Room left around the bounds: the corner nearest to an edge of the picture is 1 / this of the way from the centre.
const MARGIN: f64 = 1.08;
/// Bounds whose second extent is this much of the first or less are thin.
const THIN: f64 = 0.1;
/// Share of the face of flat bounds that the surface must turn to the back to be seen from there.
const TURNED: f64 = 0.1;

/// A camera that sees all of `bounds` (world space, metres; `None` = nothing to see) in a picture of this `aspect`
/// (width over height). `vector_area` (m^2) says which side flat things show: see [`vector_area`].
pub(super) fn framing_camera(bounds: Option<(DVec3, DVec3)>, vector_area: DVec3, aspect: f64) -> Camera {
    let (low, high) = bounds.unwrap_or((DVec3::splat(-1.0), DVec3::splat(1.0)));
    let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
    let towards = direction(2.0 * half, vector_area).normalize();
    let right = DVec3::Y.cross(towards).normalize();
    let up = towards.cross(right);
    let yfov = FRAMING_YFOV.to_radians();
    let (tan_y, tan_x) = ((0.5 * yfov).tan(), (0.5 * yfov).tan() * aspect);
    // The least distance from which every corner of the bounds is in the picture, and a margin.
    let nearest = (0..8)
        .map(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corner = half * DVec3::new(sign(0), sign(1), sign(2));
            let sideways = (corner.dot(right).abs() / tan_x).max(corner.dot(up).abs() / tan_y);
            MARGIN * sideways + corner.dot(towards)
        })
        .fold(0.0, f64::max);
    // Bounds that are a point have no size to keep away from.
    let distance = if nearest > 0.0 { nearest } else { 1.0 };
    let eye = centre + towards * distance;
    let world_from_camera = DMat4::from_cols(right.extend(0.0), up.extend(0.0), towards.extend(0.0), eye.extend(1.0));
    let projection = Projection::Perspective { yfov, aspect_ratio: None };
    Camera { name: String::new(), world_from_camera, projection, lens: Lens::default() }
}

/// From bounds of these `extents` towards the camera; any length, never along Y.
fn direction(extents: DVec3, vector_area: DVec3) -> DVec3 {
    let extents = extents.to_array();
    // Of equal ones z comes first, so that what could be seen from several sides is seen from the front.
    let mut axes = [2, 0, 1];
    axes.sort_by(|&a, &b| extents[a].total_cmp(&extents[b]));
    let [thin, middle, long] = axes;
    if extents[thin] <= THIN * extents[middle] {
        let face = extents[middle] * extents[long];
        let side = if vector_area[thin] < -TURNED * face { -1.0 } else { 1.0 };
        return match thin {
            0 => DVec3::new(side, 0.15, 0.2),
            // Less steeply than a wall is faced, so that a floor still is a floor.
            1 => DVec3::new(0.2, side, 0.6),
            _ => DVec3::new(0.2, 0.15, side),
        };
    }
    if long == 2 && extents[middle] <= THIN * extents[long] {
        // A rod along z would be seen end-on.
        return DVec3::new(1.0, 0.3, 0.35);
    }
    DVec3::new(0.35, 0.3, 1.0)
}

/// What a camera for `scene` alone is framed on.
pub fn framing(scene: &Scene) -> Framing {
    Framing { bounds: Boxes::of(scene).scene, vector_area: vector_area(scene) }
}

/// Sum over all triangles of area times normal, m^2, world space: null for closed surfaces, across a flat one.
pub(super) fn vector_area(scene: &Scene) -> DVec3 {
    let of_mesh = |mesh: &crate::shape::Mesh| -> DVec3 {
        let corner = |i: u32| DVec3::from_array(mesh.positions[i as usize].map(f64::from));
        mesh.indices
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(corner);
                0.5 * (b - a).cross(c - a)
            })
            .sum()
    };
    let meshes: Vec<DVec3> = scene.meshes.iter().map(|mesh| of_mesh(mesh)).collect();
    let placed = |Instance { mesh, world_from_object, .. }: &Instance| {
        let linear = DMat3::from_mat4(*world_from_object);
        // Areas go by the cofactor matrix; a mirrored mesh keeps its front.
        cofactor(linear) * meshes[mesh.index()] * if linear.determinant() < 0.0 { -1.0 } else { 1.0 }
    };
    scene.instances.iter().map(placed).sum::<DVec3>() + shapes::vector_area(scene)
}

#[cfg(test)]
#[path = "framing_tests.rs"]
mod tests;
