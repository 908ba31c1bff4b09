//! Shading normals: vertex normals, normal maps and height maps, each kept usable (`math/bend.rs`).

use super::SceneTables;
use super::interaction::Interaction;
use crate::math::bend::raise;
use crate::math::{UvSets, V3};
use crate::shape::table::NONE;
use simd::{Float, Lanes, Mask, Uint};

/// Squared sine between tangent and normal below which the tangent is taken for parallel: its direction across the
/// normal would be the rounding's (1e-7 of 1e-3).
const MIN_TANGENT_SINE2: f32 = 1e-6;

/// The unit shading normal on the viewer's side, in front of the surface. The geometric one's bits where nothing says
/// otherwise.
#[inline(always)]
pub(super) fn shading_normal<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, active: L::M) -> V3<L> {
    let mapped = active & !si.triangle.tangents.eq(L::U::splat(NONE));
    let mut shaped = active & si.has_normal;
    let mut normal = si.normal;
    if tables.triangles.has_tangents() && mapped.any() {
        normal = map_normal(tables, si, normal, mapped);
        shaped = shaped | mapped;
    }
    if tables.materials.has_bump() {
        let (bumped, has) = bump_normal(tables, si, normal, active);
        normal = bumped;
        shaped = shaped | has;
    }
    if !shaped.any() {
        return si.ng;
    }
    raise(si.to_viewer(normal), si.ng).or_else(shaped, si.ng)
}

/// `normal` (front side up) with the material's normal map applied; as it is where the map says (0, 0, 1) or the
/// tangent has no direction.
#[inline(always)]
fn map_normal<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, normal: V3<L>, mapped: L::M) -> V3<L> {
    let zero = L::F::zero();
    let (m, has) = tables.materials.normal_map::<L>(&tables.textures, si.triangle.material, &si.uvs, mapped);
    let flat = m.x.eq(zero) & m.y.eq(zero) & m.z.gt(zero);
    let (tangent, handedness) = tables.triangles.tangent::<L>(si.triangle.tangents, si.b[0], si.b[1], &si.placed);
    // glTF 3.7.2.1: bitangent = cross(normal, tangent) x handedness. The tangent is used as interpolated, made unit.
    let across = tangent - normal.scale(normal.dot(tangent));
    let usable = across.dot(across).gt(tangent.dot(tangent) * L::F::splat(MIN_TANGENT_SINE2));
    let t = across.normalized();
    let b = normal.cross(t).scale(handedness);
    let n = t.mul_add(m.x, b.mul_add(m.y, normal.scale(m.z))).normalized();
    n.or_else(has & !flat & usable & n.is_finite(), normal)
}

/// `normal` (front side up) tilted against the slope of the material's height map, and the lanes that are.
///
/// Blinn 1978, "Simulation of Wrinkled Surfaces", in the form of Mikkelsen 2010, "Bump Mapping Unparametrized Surfaces
/// on the GPU", section 2: any two vectors in the surface serve in place of dP/du and dP/dv, so the triangle's edges do,
/// and nothing is divided by an area in texture space.
#[inline(always)]
fn bump_normal<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, normal: V3<L>, active: L::M) -> (V3<L>, L::M) {
    let zero = L::F::zero();
    let has = active & !si.triangle.attributes.eq(L::U::splat(NONE));
    if !tables.triangles.has_attributes() || !has.any() {
        return (normal, L::M::from_bits(0));
    }
    let corners = [
        corner_uvs(tables, si, [zero, zero]),
        corner_uvs(tables, si, [L::F::one(), zero]),
        corner_uvs(tables, si, [zero, L::F::one()]),
    ];
    let [h1, h2] =
        tables.materials.bump_along_edges::<L>(&tables.textures, si.triangle.material, &si.uvs, &corners, has);
    let tilted = has & !(h1.eq(zero) & h2.eq(zero));
    if !tilted.any() {
        return (normal, tilted);
    }
    let (r1, r2) = (si.triangle.e2.cross(normal), normal.cross(si.triangle.e1));
    let det = si.triangle.e1.dot(r1);
    let slope = r1.scale(h1) + r2.scale(h2);
    let n = (normal.scale(det.abs()) - slope.scale(L::F::one().copysign(det))).normalized();
    let tilted = tilted & n.is_finite();
    (n.or_else(tilted, normal), tilted)
}

/// Texture coordinates of the corner of barycentric `b`.
#[inline(always)]
fn corner_uvs<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, b: [L::F; 2]) -> UvSets<L> {
    tables.triangles.attributes::<L>(si.triangle.attributes, b[0], b[1]).uvs
}
