//! Triangles as shading reads them: four 16-byte records, one cache line, a triangle.

use crate::math::{V3, robust};
use simd::{Float, Lanes, Uint};

/// Index of no attributes, in records.
pub const NONE: u32 = u32::MAX;

/// What shading needs of every triangle of the prepared scene.
///
/// | record | x, y, z | w |
/// |---|---|---|
/// | 0 | first corner, metres | material |
/// | 1 | second corner - first | attributes or [`NONE`] |
/// | 2 | third corner - first | tangents or [`NONE`] |
/// | 3 | unit normal, counter-clockwise side | light density: selection pmf / area, 1/m^2; 0 = not a light |
#[derive(Clone, Debug, Default)]
pub struct TriangleTable {
    records: Vec<[f32; 4]>,
    /// Four a triangle that has any: normal 0, u0 | normal 1, v0 | normal 2, u1 | v1, u2, v2, 1 if normals are given.
    attributes: Vec<[f32; 4]>,
    /// Three a triangle with a normal map: tangent and handedness of each corner.
    tangents: Vec<[f32; 4]>,
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
    /// Selection pmf over area, 1/m^2; 0 where it is no light.
    pub light_density: L::F,
}

/// Interpolated attributes, per lane.
#[derive(Clone, Copy)]
pub struct Attributes<L: Lanes> {
    /// Shading normal, not normalised; arbitrary where `has_normal` is false.
    pub normal: V3<L>,
    /// Whether the mesh gives normals.
    pub has_normal: L::M,
    /// Texture coordinate.
    pub u: L::F,
    /// Texture coordinate, 0 at the top.
    pub v: L::F,
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
        self.records.push(record(ng, 0));
    }

    /// Adds corner attributes and gives their index. Without `normals` shading is flat.
    pub fn push_attributes(&mut self, normals: Option<[glam::Vec3; 3]>, uvs: [[f32; 2]; 3]) -> u32 {
        let index = (self.attributes.len() / 4) as u32;
        let flag = if normals.is_some() { 1.0 } else { 0.0 };
        let n = normals.unwrap_or_default();
        self.attributes.push([n[0].x, n[0].y, n[0].z, uvs[0][0]]);
        self.attributes.push([n[1].x, n[1].y, n[1].z, uvs[0][1]]);
        self.attributes.push([n[2].x, n[2].y, n[2].z, uvs[1][0]]);
        self.attributes.push([uvs[1][1], uvs[2][0], uvs[2][1], flag]);
        index
    }

    /// Adds corner tangents (w = handedness) and gives their index.
    pub fn push_tangents(&mut self, tangents: [[f32; 4]; 3]) -> u32 {
        self.tangents.extend(tangents);
        (self.tangents.len() / 3 - 1) as u32
    }

    /// Marks triangle `i` as a light with selection pmf over area `density`, 1/m^2.
    pub fn set_light_density(&mut self, i: usize, density: f32) {
        self.records[4 * i + 3][3] = density;
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
            light_density: r3[3],
        }
    }

    /// Attributes `index` at barycentric (`u`, `v`); the table must have some.
    #[inline(always)]
    pub fn attributes<L: Lanes>(&self, index: L::U, u: L::F, v: L::F) -> Attributes<L> {
        let at = index.shl(2);
        let one = L::U::splat(1);
        let a0 = at.records(&self.attributes);
        let a1 = (at + one).records(&self.attributes);
        let a2 = (at + one + one).records(&self.attributes);
        let a3 = (at + one + one + one).records(&self.attributes);
        let n0 = V3::<L>::new(a0[0], a0[1], a0[2]);
        let n1 = V3::<L>::new(a1[0], a1[1], a1[2]);
        let n2 = V3::<L>::new(a2[0], a2[1], a2[2]);
        // a0 + (a1 - a0) b1 + (a2 - a0) b2: exactly the constant where the corners agree (numerics GEO-08).
        Attributes {
            normal: (n2 - n0).mul_add(v, (n1 - n0).mul_add(u, n0)),
            has_normal: a3[3].gt(L::F::zero()),
            u: (a3[1] - a0[3]).mul_add(v, (a2[3] - a0[3]).mul_add(u, a0[3])),
            v: (a3[2] - a1[3]).mul_add(v, (a3[0] - a1[3]).mul_add(u, a1[3])),
        }
    }

    /// Tangent (not normalised) and handedness `index` at barycentric (`u`, `v`); the table must have some.
    #[inline(always)]
    pub fn tangent<L: Lanes>(&self, index: L::U, u: L::F, v: L::F) -> (V3<L>, L::F) {
        let at = index + index + index;
        let one = L::U::splat(1);
        let t0 = at.records(&self.tangents);
        let t1 = (at + one).records(&self.tangents);
        let t2 = (at + one + one).records(&self.tangents);
        let (a, b, c) =
            (V3::<L>::new(t0[0], t0[1], t0[2]), V3::<L>::new(t1[0], t1[1], t1[2]), V3::<L>::new(t2[0], t2[1], t2[2]));
        ((c - a).mul_add(v, (b - a).mul_add(u, a)), t0[3])
    }
}

impl<L: Lanes> Triangle<L> {
    /// The point at barycentric (`u`, `v`).
    #[inline(always)]
    pub fn point(&self, u: L::F, v: L::F) -> V3<L> {
        self.e2.mul_add(v, self.e1.mul_add(u, self.v0))
    }

    /// How far a ray's origin is moved off the surface, metres: the bound of [`robust::offset_length`].
    #[inline(always)]
    pub fn offset_length(&self) -> L::F {
        let max_abs = self.v0.abs().max((self.v0 + self.e1).abs()).max((self.v0 + self.e2).abs());
        robust::offset_length(max_abs, self.ng)
    }
}
