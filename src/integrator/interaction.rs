//! Where a path has hit: geometry, attributes, the normals it is shaded with, and the point from which it goes on.

use super::SceneTables;
use super::exact;
use super::terminator::lift;
use crate::accel::HitBatch;
use crate::math::{UvSets, V3, robust};
use crate::shape::placement::Placed;
use crate::shape::table::{NONE, Triangle, interpolate3};
use simd::{Float, Lanes, Mask, Part, Uint};

/// Where a path hit and how it looks from there.
pub(super) struct Interaction<L: Lanes> {
    /// In the prepared space.
    pub triangle: Triangle<L>,
    /// Where it is placed, for what is read of it besides; `None` where that is the world in all lanes.
    pub placed: Option<Placed<L>>,
    /// Hit point, from barycentric coordinates.
    pub p: V3<L>,
    /// How far rays that leave are moved off the surface, metres.
    pub offset: L::F,
    /// Where light is gathered: the hit point, raised by [`lift`] where the mesh stands for a rounder surface.
    pub origin: V3<L>,
    /// Where it is raised.
    lifted: L::M,
    pub wo: V3<L>,
    /// Geometric normal on the viewer's side.
    pub ng: V3<L>,
    /// The front side was hit.
    pub front: L::M,
    /// Texture coordinates.
    pub uvs: UvSets<L>,
    /// Vertex colour; white where there is none.
    pub color: V3<L>,
    /// Unit normal of the front: interpolated, or geometric where the mesh has none or one that cannot be used.
    pub normal: V3<L>,
    /// Where it is interpolated.
    pub has_normal: L::M,
    /// Barycentric coordinates.
    pub b: [L::F; 2],
    /// Hits of exact shapes: the triangle's edges are the derivatives along which their tangents run.
    pub on_shape: L::M,
}

/// Which placements were hit by the rays `at ..`: nobody asks in scenes where nothing is placed.
#[inline(always)]
fn placed<L: Lanes>(tables: &SceneTables, hits: &HitBatch, at: usize, hit: L::M) -> Option<Placed<L>> {
    if tables.placements.is_empty() {
        return None;
    }
    tables.placements.get::<L>(L::U::load(&hits.instance, at), hit)
}

/// Geometry of the hits `at ..`, seen from the directions `wo` (unit).
#[inline(always)]
pub(super) fn interact<L: Lanes>(
    tables: &SceneTables,
    hits: &HitBatch,
    at: usize,
    wo: V3<L>,
    primitive: L::U,
    hit: L::M,
) -> Interaction<L> {
    L::outline(Interact { tables, hits, at, wo, primitive, hit })
}

/// [`interact`].
struct Interact<'a, L: Lanes> {
    tables: &'a SceneTables,
    hits: &'a HitBatch,
    at: usize,
    wo: V3<L>,
    primitive: L::U,
    hit: L::M,
}

impl<L: Lanes> Part<L> for Interact<'_, L> {
    type Output = Interaction<L>;

    #[inline(always)]
    fn run(self) -> Interaction<L> {
        let Self { tables, hits, at, wo, primitive, hit } = self;
        let zero = L::F::zero();
        let none = L::M::from_bits(0);
        let triangle = tables.triangles.get::<L>(primitive);
        let b = [L::F::load(&hits.u, at), L::F::load(&hits.v, at)];
        let placed = placed::<L>(tables, hits, at, hit);
        let (triangle, p, offset) = triangle.placed(&placed, triangle.point(b[0], b[1]));
        let front = wo.dot(triangle.ng).gt(zero);
        let ng = triangle.ng.or_else(front, -triangle.ng);
        let (mut uvs, mut normal, mut has_normal) = (UvSets::single(zero, zero), triangle.ng, none);
        let mut color = V3::splat([1.0; 3]);
        let (mut origin, mut lifted) = (p, none);
        if tables.triangles.has_attributes() {
            let has = hit & !triangle.attributes.eq(L::U::splat(NONE));
            if has.any() {
                let mut a = tables.triangles.attributes::<L>(triangle.attributes, b[0], b[1]);
                uvs = a.uvs.masked(has);
                if tables.triangles.has_colors() {
                    color = a.color.or_else(has, color);
                }
                if tables.triangles.has_normals() {
                    if let Some(placed) = &placed {
                        // At the corners, as when a mesh is merged: normals of one length are interpolated.
                        let [n0, n1, n2] = a.corner_normals;
                        a.corner_normals = [placed.normal(n0), placed.normal(n1), placed.normal(n2)];
                        let [n0, n1, n2] = a.corner_normals;
                        a.normal = interpolate3(n0, n1, n2, b[0], b[1]).or_else(placed.lanes, a.normal);
                    }
                    let smooth = a.normal.normalized();
                    has_normal = has & a.has_normal & smooth.is_finite();
                    normal = smooth.or_else(has_normal, normal);
                    let height = lift(&triangle, &a.corner_normals, b, front);
                    lifted = has_normal & height.gt(zero);
                    origin = ng.mul_add(height, p).or_else(lifted, p);
                }
            }
        }
        let mut si = Interaction {
            triangle,
            placed,
            p,
            offset,
            origin,
            lifted,
            wo,
            ng,
            front,
            uvs,
            color,
            normal,
            has_normal,
            b,
            on_shape: none,
        };
        if !tables.shapes.is_empty() {
            // Rays have no times yet: all are at the shutter's opening.
            exact::put(tables, hits, at, (primitive, zero), hit, &mut si);
        }
        si
    }
}

impl<L: Lanes> Interaction<L> {
    /// Tangent of the front (not normalised) and handedness; arbitrary where the surface has none. Some must have.
    #[inline(always)]
    pub fn tangent(&self, tables: &SceneTables) -> (V3<L>, L::F) {
        let (tangent, handedness) =
            tables.triangles.tangent::<L>(self.triangle.tangents, self.b[0], self.b[1], &self.placed);
        if !self.on_shape.any() {
            return (tangent, handedness);
        }
        // The bitangent is towards smaller v, as that of a mesh.
        let Triangle { e1, e2, ng, .. } = self.triangle;
        let side = L::F::one().copysign(-(ng.cross(e1).dot(e2)));
        let along = e1.scale(L::F::one() / e1.abs().max_component());
        (along.or_else(self.on_shape, tangent), side.or_else(self.on_shape, handedness))
    }

    /// A normal of the front turned to the viewer's side.
    #[inline(always)]
    pub fn to_viewer(&self, normal: V3<L>) -> V3<L> {
        normal.or_else(self.front, -normal)
    }

    /// Where rays leave on the viewer's side: off the surface.
    #[inline(always)]
    pub fn start(&self) -> V3<L> {
        robust::offset_point(self.origin, self.ng, self.offset)
    }

    /// Just behind the surface, where a ray that goes through it goes on. Nothing is raised there: what a coarse mesh
    /// stands for is its outside.
    #[inline(always)]
    pub fn behind(&self) -> V3<L> {
        robust::offset_point(self.p, -self.ng, self.offset)
    }

    /// Whether `wi` leads away from the surface on the viewer's side: from the triangle, or, at a raised origin, from
    /// the rounder surface that it stands for. (There the ray may still meet the triangle itself.)
    #[inline(always)]
    pub fn is_outside(&self, wi: V3<L>) -> L::M {
        let outside = wi.dot(self.ng).gt(L::F::zero());
        if !self.lifted.any() {
            return outside;
        }
        outside | (self.lifted & wi.dot(self.to_viewer(self.normal)).gt(L::F::zero()))
    }

    /// Whether `wi` leads away from the triangle behind the surface.
    #[inline(always)]
    pub fn is_behind(&self, wi: V3<L>) -> L::M {
        wi.dot(self.ng).lt(L::F::zero())
    }
}
