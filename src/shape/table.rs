//! Triangles as shading reads them: four 16-byte records, one cache line, a triangle. Those of placed meshes are there
//! once, in their object's space; `placement.rs` carries what is read to the prepared space.

use super::moving::{Moved, MovingTriangles};
use super::placement::Placed;
use crate::math::{MAX_UV_SETS, UvSets, V3, robust};
use simd::{Float, Lanes, Mask, Uint};

/// Index of no attributes, in records.
pub const NONE: u32 = u32::MAX;

/// Flags of attributes: normals are given.
const HAS_NORMALS: u32 = 1;
/// Flags of attributes: vertex colours are given.
const HAS_COLORS: u32 = 2;
/// Where the number of sets of coordinates beyond the first is in the flags.
const MORE_UV_SETS_SHIFT: u32 = 2;

/// Attributes of a triangle's corners, as they are put into the table.
#[derive(Clone, Debug, Default)]
pub struct Corners<'a> {
    /// Shading normals; without them shading is flat.
    pub normals: Option<[glam::Vec3; 3]>,
    /// Texture coordinates: sets of three, at most [`MAX_UV_SETS`].
    pub uvs: &'a [[[f32; 2]; 3]],
    /// Linear R G B and opacity.
    pub colors: Option<[[f32; 4]; 3]>,
}

/// What shading needs of every triangle of the prepared scene.
///
/// | record | x, y, z | w |
/// |---|---|---|
/// | 0 | first corner, metres | material |
/// | 1 | second corner - first | attributes or [`NONE`] |
/// | 2 | third corner - first | tangents or [`NONE`] |
/// | 3 | unit normal, counter-clockwise side | number of the light that it is of, or [`NONE`] |
#[derive(Clone, Debug, Default)]
pub struct TriangleTable {
    records: Vec<[f32; 4]>,
    /// Four or more a triangle that has any: normal 0, u0 | normal 1, v0 | normal 2, u1 | v1, u2, v2, flags; then, if
    /// the flags say so, three vertex colours; then two for each further set of coordinates: u0, v0, u1, v1 | u2, v2.
    attributes: Vec<[f32; 4]>,
    /// Most sets of coordinates of any triangle, at least 1.
    uv_sets: usize,
    /// Some triangle has normals.
    has_normals: bool,
    /// Some triangle has vertex colours.
    has_colors: bool,
    /// Three a triangle with a normal map: tangent and handedness of each corner.
    tangents: Vec<[f32; 4]>,
    /// Those that move by their vertices; what is said of them above holds when the shutter opens.
    pub moving: MovingTriangles,
}

/// One triangle's record, per lane.
#[derive(Clone, Copy)]
pub struct Triangle<L: Lanes> {
    /// First corner.
    pub v0: V3<L>,
    /// Second corner minus first.
    pub e1: V3<L>,
    /// Third corner minus first.
    pub e2: V3<L>,
    /// Unit geometric normal.
    pub ng: V3<L>,
    /// Material index.
    pub material: L::U,
    /// Attribute index or [`NONE`].
    pub attributes: L::U,
    /// Tangent index or [`NONE`].
    pub tangents: L::U,
    /// Number of the light that it is of, or [`NONE`].
    pub light: L::U,
}

/// Interpolated attributes, per lane.
#[derive(Clone, Copy)]
pub struct Attributes<L: Lanes> {
    /// Shading normal, not normalised; arbitrary where `has_normal` is false.
    pub normal: V3<L>,
    /// Unit (or zero) shading normals of the corners; arbitrary where `has_normal` is false.
    pub corner_normals: [V3<L>; 3],
    /// Whether the mesh gives normals.
    pub has_normal: L::M,
    /// Texture coordinates, v = 0 at the top.
    pub uvs: UvSets<L>,
    /// Vertex colour, linear; white where there is none.
    pub color: V3<L>,
    /// Opacity of the vertex colour; 1 where there is none.
    pub opacity: L::F,
}

impl TriangleTable {
    /// Room for `n` triangles.
    pub fn with_capacity(n: usize) -> Self {
        Self { records: Vec::with_capacity(4 * n), ..Self::default() }
    }

    /// Adds a triangle by corners (prepared space), its unit normal and material.
    pub fn push(&mut self, corners: [glam::Vec3; 3], ng: glam::Vec3, material: u32, attributes: u32, tangents: u32) {
        let record = |v: glam::Vec3, w: u32| [v.x, v.y, v.z, f32::from_bits(w)];
        self.records.push(record(corners[0], material));
        self.records.push(record(corners[1] - corners[0], attributes));
        self.records.push(record(corners[2] - corners[0], tangents));
        self.records.push(record(ng, NONE));
    }

    /// Adds corner attributes and gives their index.
    pub fn push_attributes(&mut self, corners: &Corners<'_>) -> u32 {
        let Corners { normals, uvs, colors } = corners;
        let index = self.attributes.len() as u32;
        let more = uvs.len().saturating_sub(1);
        assert!(more < MAX_UV_SETS, "at most {MAX_UV_SETS} sets of coordinates");
        let flags = if normals.is_some() { HAS_NORMALS } else { 0 }
            | if colors.is_some() { HAS_COLORS } else { 0 }
            | (more as u32) << MORE_UV_SETS_SHIFT;
        let n = normals.unwrap_or_default();
        let uv = uvs.first().copied().unwrap_or_default();
        self.attributes.push([n[0].x, n[0].y, n[0].z, uv[0][0]]);
        self.attributes.push([n[1].x, n[1].y, n[1].z, uv[0][1]]);
        self.attributes.push([n[2].x, n[2].y, n[2].z, uv[1][0]]);
        self.attributes.push([uv[1][1], uv[2][0], uv[2][1], f32::from_bits(flags)]);
        self.attributes.extend(colors.iter().flatten());
        for [a, b, c] in uvs.iter().skip(1) {
            self.attributes.push([a[0], a[1], b[0], b[1]]);
            self.attributes.push([c[0], c[1], 0.0, 0.0]);
        }
        self.has_normals |= normals.is_some();
        self.has_colors |= colors.is_some();
        self.uv_sets = self.uv_sets.max(1 + more);
        index
    }

    /// Adds corner tangents (w = handedness) and gives their index.
    pub fn push_tangents(&mut self, tangents: [[f32; 4]; 3]) -> u32 {
        self.tangents.extend(tangents);
        (self.tangents.len() / 3 - 1) as u32
    }

    /// Marks triangle `i` as part of a light.
    pub fn set_light(&mut self, i: usize, light: u32) {
        self.records[4 * i + 3][3] = f32::from_bits(light);
    }

    /// Triangles.
    pub fn len(&self) -> usize {
        self.records.len() / 4
    }

    /// No triangle at all.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Any triangle with normals or texture coordinates.
    pub fn has_attributes(&self) -> bool {
        !self.attributes.is_empty()
    }

    /// Any triangle with normals.
    pub fn has_normals(&self) -> bool {
        self.has_normals
    }

    /// Any triangle with vertex colours.
    pub fn has_colors(&self) -> bool {
        self.has_colors
    }

    /// Any triangle with tangents.
    pub fn has_tangents(&self) -> bool {
        !self.tangents.is_empty()
    }

    /// The triangles `primitive`. The table must not be empty.
    #[inline(always)]
    pub fn get<L: Lanes>(&self, primitive: L::U) -> Triangle<L> {
        let at = primitive.shl(2);
        let one = L::U::splat(1);
        let r0 = at.records(&self.records);
        let r1 = (at + one).records(&self.records);
        let r2 = (at + one + one).records(&self.records);
        let r3 = (at + one + one + one).records(&self.records);
        Triangle {
            v0: V3::<L>::new(r0[0], r0[1], r0[2]),
            e1: V3::<L>::new(r1[0], r1[1], r1[2]),
            e2: V3::<L>::new(r2[0], r2[1], r2[2]),
            ng: V3::<L>::new(r3[0], r3[1], r3[2]),
            material: r0[3].to_bits(),
            attributes: r1[3].to_bits(),
            tangents: r2[3].to_bits(),
            light: r3[3].to_bits(),
        }
    }

    /// Attributes `index` at barycentric (`u`, `v`); the table must have some.
    #[inline(always)]
    pub fn attributes<L: Lanes>(&self, index: L::U, u: L::F, v: L::F) -> Attributes<L> {
        let at = index;
        let one = L::U::splat(1);
        let a0 = at.records(&self.attributes);
        let a1 = (at + one).records(&self.attributes);
        let a2 = (at + one + one).records(&self.attributes);
        let a3 = (at + one + one + one).records(&self.attributes);
        let flags = a3[3].to_bits();
        let n0 = V3::<L>::new(a0[0], a0[1], a0[2]);
        let n1 = V3::<L>::new(a1[0], a1[1], a1[2]);
        let n2 = V3::<L>::new(a2[0], a2[1], a2[2]);
        let mut attributes = Attributes {
            normal: interpolate3(n0, n1, n2, u, v),
            corner_normals: [n0, n1, n2],
            has_normal: flags.has(HAS_NORMALS),
            uvs: UvSets::single(
                interpolate::<L>(a0[3], a2[3], a3[1], u, v),
                interpolate::<L>(a1[3], a3[0], a3[2], u, v),
            ),
            color: V3::splat([1.0; 3]),
            opacity: L::F::one(),
        };
        if self.has_colors || self.uv_sets > 1 {
            self.more::<L>(at + L::U::splat(4), flags, u, v, &mut attributes);
        }
        attributes
    }

    /// What few triangles have: colours and further sets of coordinates, from record `at` on.
    #[inline(always)]
    fn more<L: Lanes>(&self, at: L::U, flags: L::U, u: L::F, v: L::F, into: &mut Attributes<L>) {
        let (zero, one) = (L::U::splat(0), L::U::splat(1));
        let colored = flags.has(HAS_COLORS);
        if colored.any() {
            let c0 = at.records(&self.attributes);
            let c1 = (at + one).records(&self.attributes);
            let c2 = (at + one + one).records(&self.attributes);
            let rgb = interpolate3(
                V3::<L>::new(c0[0], c0[1], c0[2]),
                V3::<L>::new(c1[0], c1[1], c1[2]),
                V3::<L>::new(c2[0], c2[1], c2[2]),
                u,
                v,
            );
            into.color = rgb.or_else(colored, into.color);
            into.opacity = interpolate::<L>(c0[3], c1[3], c2[3], u, v).or_else(colored, into.opacity);
        }
        let mut at = at + L::U::splat(3).or_else(colored, zero);
        let more = flags.shr(MORE_UV_SETS_SHIFT);
        for k in 1..self.uv_sets.min(MAX_UV_SETS) {
            // A lane without this set reads whatever lies there, and nobody asks for it.
            let has = !more.lt(L::U::splat(k as u32));
            let first = at.records(&self.attributes);
            let second = (at + one).records(&self.attributes);
            let su = interpolate::<L>(first[0], first[2], second[0], u, v).masked(has);
            let sv = interpolate::<L>(first[1], first[3], second[1], u, v).masked(has);
            into.uvs.set(k, su, sv);
            at = at + one + one;
        }
    }

    /// Twice the area of the triangles with attributes `index` in each of their sets of coordinates, in units of these; 0
    /// in a set that a lane does not have. The table must have some attributes.
    #[inline(always)]
    pub fn uv_areas<L: Lanes>(&self, index: L::U) -> [L::F; MAX_UV_SETS] {
        let one = L::U::splat(1);
        let mut at = index + one + one + one;
        let a0 = index.records(&self.attributes);
        let a1 = (index + one).records(&self.attributes);
        let a2 = (index + one + one).records(&self.attributes);
        let a3 = at.records(&self.attributes);
        let zero = L::F::zero();
        let mut areas = [zero; MAX_UV_SETS];
        areas[0] = doubled_area::<L>([a0[3], a1[3]], [a2[3], a3[0]], [a3[1], a3[2]]);
        if self.uv_sets > 1 {
            let flags = a3[3].to_bits();
            at = at + one + L::U::splat(3).or_else(flags.has(HAS_COLORS), L::U::splat(0));
            let more = flags.shr(MORE_UV_SETS_SHIFT);
            for (k, set) in areas.iter_mut().enumerate().take(self.uv_sets).skip(1) {
                let first = at.records(&self.attributes);
                let second = (at + one).records(&self.attributes);
                let area = doubled_area::<L>([first[0], first[1]], [first[2], first[3]], [second[0], second[1]]);
                *set = area.masked(!more.lt(L::U::splat(k as u32)));
                at = at + one + one;
            }
        }
        areas
    }

    /// Tangent (not normalised) and handedness `index` at barycentric (`u`, `v`), of a triangle that is `placed` or has
    /// `moved`; the table must have some.
    #[inline(always)]
    pub fn tangent<L: Lanes>(
        &self,
        index: L::U,
        u: L::F,
        v: L::F,
        placed: &Option<Placed<L>>,
        moved: &Option<Moved<L>>,
    ) -> (V3<L>, L::F) {
        let at = index + index + index;
        let one = L::U::splat(1);
        let t0 = at.records(&self.tangents);
        let t1 = (at + one).records(&self.tangents);
        let t2 = (at + one + one).records(&self.tangents);
        let (mut a, mut b, mut c) =
            (V3::<L>::new(t0[0], t0[1], t0[2]), V3::<L>::new(t1[0], t1[1], t1[2]), V3::<L>::new(t2[0], t2[1], t2[2]));
        let mut handedness = t0[3];
        if let Some(moved) = moved {
            [a, b, c] = self.moving.tangents([a, b, c], moved);
        }
        if let Some(placed) = placed {
            (a, b, c) = (placed.direction(a), placed.direction(b), placed.direction(c));
            handedness = placed.handedness(handedness);
        }
        (interpolate3(a, b, c, u, v), handedness)
    }
}

/// `a0 + (a1 - a0) b1 + (a2 - a0) b2`: exactly the constant where the corners agree (numerics GEO-08).
#[inline(always)]
fn interpolate<L: Lanes>(a0: L::F, a1: L::F, a2: L::F, b1: L::F, b2: L::F) -> L::F {
    (a2 - a0).mul_add(b2, (a1 - a0).mul_add(b1, a0))
}

/// The same for vectors.
#[inline(always)]
pub fn interpolate3<L: Lanes>(a0: V3<L>, a1: V3<L>, a2: V3<L>, b1: L::F, b2: L::F) -> V3<L> {
    (a2 - a0).mul_add(b2, (a1 - a0).mul_add(b1, a0))
}

/// Twice the area of a triangle in the plane.
#[inline(always)]
fn doubled_area<L: Lanes>(a: [L::F; 2], b: [L::F; 2], c: [L::F; 2]) -> L::F {
    ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs()
}

impl<L: Lanes> Triangle<L> {
    /// The point at barycentric (`u`, `v`).
    #[inline(always)]
    pub fn point(&self, u: L::F, v: L::F) -> V3<L> {
        self.e2.mul_add(v, self.e1.mul_add(u, self.v0))
    }

    /// How far a ray's origin is moved off the surface, metres: the bound of [`robust::offset_length`]. For a triangle of
    /// the world.
    #[inline(always)]
    pub fn offset_length(&self) -> L::F {
        robust::offset_length(self.max_abs(), self.ng)
    }

    /// The largest coordinates, by axis.
    #[inline(always)]
    fn max_abs(&self) -> V3<L> {
        self.v0.abs().max((self.v0 + self.e1).abs()).max((self.v0 + self.e2).abs())
    }

    /// The triangle where it is `placed`, the point `p` of it there, and how far a ray's origin is moved off it, metres.
    #[inline(always)]
    pub fn placed(&self, placed: &Option<Placed<L>>, p: V3<L>) -> (Self, V3<L>, L::F) {
        let Some(placed) = placed else { return (*self, p, self.offset_length()) };
        let triangle = Self {
            v0: placed.point(self.v0),
            e1: placed.vector(self.e1),
            e2: placed.vector(self.e2),
            ng: placed.normal(self.ng),
            ..*self
        };
        let offset = placed.offset_length(self.max_abs().max_component(), triangle.ng);
        (triangle, placed.point(p), offset.or_else(placed.lanes, self.offset_length()))
    }
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
