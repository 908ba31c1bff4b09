//! Shading normals and frames: vertex normals, normal maps and height maps, each kept usable (`math/bend.rs`); the coat's
//! normal; the directions of stretched highlights.

use super::SceneTables;
use super::interaction::Interaction;
use crate::material::bsdf::View;
use crate::material::surface::{Extras, Surface};
use crate::math::bend::{let_mirror_leave, raise};
use crate::math::{Frame, UvSets, V3};
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
        let (m, has) = tables.materials.normal_map::<L>(&tables.textures, si.triangle.material, &si.uvs, mapped);
        normal = map_normal(tables, si, normal, m, has);
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

/// How a surface with the unit normal `normal` on the viewer's side is seen. That its material has a coat or a stretched
/// highlight counts; what the normal was made of (maps, heights) is the base's alone.
#[inline(always)]
pub(super) fn view<L: Lanes>(
    tables: &SceneTables,
    si: &Interaction<L>,
    surface: &Surface<L>,
    normal: V3<L>,
    active: L::M,
) -> View<L> {
    let mut view = View::new(Frame::around(normal), si.wo);
    let Some(extras) = &surface.extras else { return view };
    if tables.materials.has_anisotropy() {
        let stretched = active & stretched(extras);
        if stretched.any() {
            view.frame = anisotropy_frame(tables, si, normal, extras.anisotropy_direction, stretched);
        }
    }
    // For all lanes with a coat or for none, so that a lane does not depend on its neighbours.
    let coated = active & extras.clearcoat.gt(L::F::zero());
    if tables.has_shading_normals() && coated.any() {
        let coat = coat_normal(tables, si, coated);
        let (bent, low) = let_mirror_leave(coat, si.ng, si.wo);
        view.coat_frame = Some(Frame::around(bent.or_else(low, coat)));
    }
    view
}

/// The lanes whose highlight depends on the direction of the tangent.
#[inline(always)]
fn stretched<L: Lanes>(extras: &Extras<L>) -> L::M {
    let zero = L::F::zero();
    let lanes = extras.anisotropy.gt(zero);
    match &extras.disney {
        Some(disney) => lanes | (extras.is_disney & disney.anisotropic.gt(zero)),
        None => lanes,
    }
}

/// The unit normal of a coat on the viewer's side, in front of the surface: the interpolated one, with the coat's own
/// normal map if it has that. Normal and height maps of what is below it do not count.
#[inline(always)]
pub(super) fn coat_normal<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, active: L::M) -> V3<L> {
    let mut normal = si.normal;
    let mut shaped = active & si.has_normal;
    if tables.triangles.has_tangents() && tables.materials.has_clearcoat_normal() {
        let mapped = active & !si.triangle.tangents.eq(L::U::splat(NONE));
        let (m, has) =
            tables.materials.clearcoat_normal_map::<L>(&tables.textures, si.triangle.material, &si.uvs, mapped);
        if has.any() {
            normal = map_normal(tables, si, normal, m, has);
            shaped = shaped | has;
        }
    }
    if !shaped.any() {
        return si.ng;
    }
    raise(si.to_viewer(normal), si.ng).or_else(shaped, si.ng)
}

/// A frame about the unit shading normal `ns` (on the viewer's side) with x along `direction` in the tangent's and
/// bitangent's terms, brought into the plane of `ns`; in the other lanes than `lanes`, and where the tangent has no
/// direction, any frame about `ns`, of which x and y take the places of tangent and bitangent.
#[inline(always)]
pub(super) fn anisotropy_frame<L: Lanes>(
    tables: &SceneTables,
    si: &Interaction<L>,
    ns: V3<L>,
    direction: [L::F; 2],
    lanes: L::M,
) -> Frame<L> {
    let any = Frame::around(ns);
    let (mut tangent, mut bitangent) = (any.x, any.y);
    let mapped = lanes & !si.triangle.tangents.eq(L::U::splat(NONE));
    if tables.triangles.has_tangents() && mapped.any() {
        let (given, handedness) = si.tangent(tables);
        let across = given - ns.scale(ns.dot(given));
        let t = across.normalized();
        let usable = mapped & t.is_finite() & across.dot(across).gt(given.dot(given) * L::F::splat(MIN_TANGENT_SINE2));
        // The handedness is about the front's normal: seen from behind, the bitangent stays where it is.
        let b = si.to_viewer(ns).cross(t).scale(handedness);
        (tangent, bitangent) = (t.or_else(usable, tangent), b.or_else(usable, bitangent));
    }
    let x = tangent.mul_add(direction[0], bitangent.scale(direction[1]));
    let x = (x - ns.scale(ns.dot(x))).normalized().or_else(lanes, any.x);
    let y = ns.cross(x).or_else(lanes, any.y);
    Frame { x, y, z: ns }
}

/// `normal` (front side up) with the tangent-space vector `m` of a normal map applied in the lanes that `has` it; as it is
/// where that is (0, 0, 1) or the tangent has no direction.
#[inline(always)]
fn map_normal<L: Lanes>(tables: &SceneTables, si: &Interaction<L>, normal: V3<L>, m: V3<L>, has: L::M) -> V3<L> {
    let zero = L::F::zero();
    let flat = m.x.eq(zero) & m.y.eq(zero) & m.z.gt(zero);
    let (tangent, handedness) = si.tangent(tables);
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

#[cfg(test)]
#[path = "normals_tests.rs"]
mod tests;
