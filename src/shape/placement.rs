//! Placed meshes as shading reads them: where each placement is, and what placing adds to the rounding error.
//!
//! A placed mesh has its triangles in the table once, in its own space. What shading reads there is carried to the
//! prepared space here, in the lanes whose hit was on a placement.

use super::moving::segment;
use crate::math::{V3, robust};
use glam::{DMat3, DVec3, Vec3};
use simd::{Float, Lanes, Mask, Uint};

/// Records a placement.
const RECORDS: u32 = 7;

/// The placements of a prepared scene by the `instance` of a hit: 0, the world, and i + 1 for placement i.
///
/// | record | x, y, z | w |
/// |---|---|---|
/// | 0, 1, 2 | row of the matrix, prepared space from object space | translation, metres |
/// | 3, 4, 5 | row of its cofactors over their largest, times the sign of the determinant: carries normals | error a metre of the object, by axis |
/// | 6 | error of what lies at the object's origin, metres | sign of the determinant |
#[derive(Clone, Debug, Default)]
pub struct PlacementTable {
    records: Vec<[f32; 4]>,
    /// Of placements that move the rows 0 to 2 at every key, and which those are.
    keys: Vec<[f32; 4]>,
    /// By the `instance` of a hit: the first record of its `keys`, and one less than it has of them, or 0. Empty where
    /// nothing moves.
    moving: Vec<[f32; 4]>,
}

/// The placements that lanes hit.
#[derive(Clone, Copy)]
pub struct Placed<L: Lanes> {
    /// Lanes that hit a placement; in the others nothing is changed.
    pub lanes: L::M,
    rows: [V3<L>; 3],
    translation: V3<L>,
    normal_rows: [V3<L>; 3],
    per_metre: V3<L>,
    at_origin: V3<L>,
    side: L::F,
}

/// Bounds, by axis of the prepared space, of how far rounding moves what is placed: the error of a point of an object, of
/// carrying it to the prepared space, and of carrying the origin of a ray that leaves it back. After Pharr, Jakob and
/// Humphreys 2023, "Physically Based Rendering", 4th edition, section 6.8.6:
/// `e' = |M| e + gamma(3) (|M| |p| + |t|)`, and the way back `|M| gamma(6) (|M^-1| |p'| + |M^-1 t|)`, where 6 instead of
/// 4 leaves Embree room, which inverts in f32.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacementError {
    /// For each metre of the largest coordinate of a triangle in its object's space.
    pub per_metre: DVec3,
    /// Beyond that, metres.
    pub at_origin: DVec3,
}

impl PlacementError {
    /// Of the map `linear * p + translation`, which must be invertible.
    pub fn of(linear: DMat3, translation: DVec3) -> Self {
        let gamma = |n| f64::from(robust::gamma(n));
        let (inverse, m, t) = (linear.inverse(), absolute(linear), translation.abs());
        let back = m * absolute(inverse);
        // What an object's metre spans along each axis.
        let span = m * DVec3::ONE;
        Self {
            per_metre: (gamma(16) + gamma(3)) * span + gamma(6) * (back * span),
            at_origin: gamma(3) * t + gamma(6) * (back * t + m * (inverse * translation).abs()),
        }
    }

    /// For a triangle whose largest coordinate in its object's space is `extent` metres.
    pub fn at(&self, extent: f64) -> DVec3 {
        self.per_metre * extent + self.at_origin
    }
}

fn absolute(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

/// `m` over its largest element: directions stay, and products of three elements stay in range whatever the scale.
pub fn scaled(m: DMat3) -> DMat3 {
    let largest = m.to_cols_array().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if largest == 0.0 { m } else { DMat3::from_cols_array(&m.to_cols_array().map(|x| x / largest)) }
}

/// Matrix of cofactors: the inverse transpose times the determinant.
pub fn cofactor(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

fn record(v: DVec3, w: f64) -> [f32; 4] {
    [v.x as f32, v.y as f32, v.z as f32, w as f32]
}

fn map(columns: [Vec3; 3], translation: Vec3) -> (DMat3, DVec3) {
    let [x, y, z] = columns.map(Vec3::as_dvec3);
    (DMat3::from_cols(x, y, z), translation.as_dvec3())
}

impl PlacementTable {
    /// Room for `n` placements.
    pub fn with_capacity(n: usize) -> Self {
        let records = if n == 0 { Vec::new() } else { Vec::with_capacity(RECORDS as usize * (n + 1)) };
        Self { records, ..Self::default() }
    }

    /// Adds a placement: the images of the axes and of the origin in the prepared space, as the backend has them. They
    /// must be linearly independent.
    pub fn push(&mut self, columns: [Vec3; 3], translation: Vec3) {
        if self.records.is_empty() {
            // The world, so that lanes which hit nothing placed read something.
            self.add(DMat3::IDENTITY, DVec3::ZERO, PlacementError::of(DMat3::IDENTITY, DVec3::ZERO));
        }
        let (linear, translation) = map(columns, translation);
        self.add(linear, translation, PlacementError::of(linear, translation));
        if !self.moving.is_empty() {
            self.moving.push([0.0; 4]);
        }
    }

    /// Adds a placement that moves: its maps at evenly spaced times, at least two, as [`Self::push`] takes them.
    pub fn push_moving(&mut self, keys: &[([Vec3; 3], Vec3)]) {
        debug_assert!(keys.len() >= 2, "what has one key does not move");
        let maps: Vec<_> = keys.iter().map(|&(columns, translation)| map(columns, translation)).collect();
        if self.records.is_empty() {
            self.add(DMat3::IDENTITY, DVec3::ZERO, PlacementError::of(DMat3::IDENTITY, DVec3::ZERO));
        }
        // Of what came before, the world among it.
        self.moving.resize(self.records.len() / RECORDS as usize, [0.0; 4]);
        // Between keys the map is no further from singular than at the worst of them, unless it turns a long way from one
        // to the next; twice the bound leaves room for that and for the interpolation's own three roundings.
        let worst = |of: fn(&PlacementError) -> DVec3| {
            let errors = maps.iter().map(|&(linear, translation)| PlacementError::of(linear, translation));
            2.0 * errors.map(|error| of(&error)).fold(DVec3::ZERO, DVec3::max)
        };
        let error = PlacementError { per_metre: worst(|e| e.per_metre), at_origin: worst(|e| e.at_origin) };
        self.add(maps[0].0, maps[0].1, error);
        let first = self.keys.len() as u32;
        for (linear, translation) in &maps {
            for axis in 0..3 {
                self.keys.push(record(linear.row(axis), translation[axis]));
            }
        }
        self.moving.push([f32::from_bits(first), f32::from_bits(keys.len() as u32 - 1), 0.0, 0.0]);
    }

    /// Some of them move.
    pub fn moves(&self) -> bool {
        !self.moving.is_empty()
    }

    fn add(&mut self, linear: DMat3, translation: DVec3, error: PlacementError) {
        let PlacementError { per_metre, at_origin } = error;
        let unit = scaled(linear);
        let side = if unit.determinant() < 0.0 { -1.0 } else { 1.0 };
        // Scaled again: the cofactors of a squashed map are small.
        let normals = scaled(cofactor(unit)) * side;
        for axis in 0..3 {
            self.records.push(record(linear.row(axis), translation[axis]));
        }
        for axis in 0..3 {
            self.records.push(record(normals.row(axis), per_metre[axis]));
        }
        self.records.push(record(at_origin, side));
    }

    /// Nothing is placed: every hit is the world's.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Placements.
    pub fn len(&self) -> usize {
        (self.records.len() / RECORDS as usize).saturating_sub(1)
    }

    /// Bytes held a placement.
    pub const BYTES: usize = RECORDS as usize * size_of::<[f32; 4]>();

    /// What the lanes of `hit` hit at `time`; `None` where none of them hit a placement, which needs no carrying.
    #[inline(always)]
    pub fn get<L: Lanes>(&self, instance: L::U, time: L::F, hit: L::M) -> Option<Placed<L>> {
        let zero = L::U::splat(0);
        let lanes = hit & !instance.eq(zero);
        if !lanes.any() {
            return None;
        }
        let at = instance.or_else(lanes, zero) * L::U::splat(RECORDS);
        let r0 = at.records(&self.records);
        let r1 = (at + L::U::splat(1)).records(&self.records);
        let r2 = (at + L::U::splat(2)).records(&self.records);
        let r3 = (at + L::U::splat(3)).records(&self.records);
        let r4 = (at + L::U::splat(4)).records(&self.records);
        let r5 = (at + L::U::splat(5)).records(&self.records);
        let r6 = (at + L::U::splat(6)).records(&self.records);
        let mut placed = Placed {
            lanes,
            rows: [V3::<L>::of_record(&r0), V3::<L>::of_record(&r1), V3::<L>::of_record(&r2)],
            translation: V3::new(r0[3], r1[3], r2[3]),
            normal_rows: [V3::<L>::of_record(&r3), V3::<L>::of_record(&r4), V3::<L>::of_record(&r5)],
            per_metre: V3::new(r3[3], r4[3], r5[3]),
            at_origin: V3::<L>::of_record(&r6),
            side: r6[3],
        };
        if self.moves() {
            placed = self.moved(placed, instance, time);
        }
        Some(placed)
    }

    /// `placed` at `time` in the lanes that hit something that moves. The elements are interpolated as the ray kernels do
    /// it, and the cofactors are those of what comes out.
    #[inline(always)]
    fn moved<L: Lanes>(&self, placed: Placed<L>, instance: L::U, time: L::F) -> Placed<L> {
        let entry = instance.or_else(placed.lanes, L::U::splat(0)).records(&self.moving);
        let last = entry[1].to_bits();
        let lanes = placed.lanes & !last.eq(L::U::splat(0));
        if !lanes.any() {
            return placed;
        }
        let (one, three) = (L::U::splat(1), L::U::splat(3));
        let (k, s) = segment::<L>(last.or_else(lanes, one), time);
        let at = (entry[0].to_bits() + k * three).or_else(lanes, L::U::splat(0));
        let mut rows = placed.rows;
        let mut translation = [placed.translation.x, placed.translation.y, placed.translation.z];
        for (axis, (row, shift)) in rows.iter_mut().zip(&mut translation).enumerate() {
            let at = at + L::U::splat(axis as u32);
            let (a, b) = (at.records(&self.keys), (at + three).records(&self.keys));
            let (before, after) = (V3::<L>::of_record(&a), V3::<L>::of_record(&b));
            *row = (before + (after - before).scale(s)).or_else(lanes, *row);
            *shift = (a[3] + (b[3] - a[3]) * s).or_else(lanes, *shift);
        }
        let ([nx, ny, nz], side) = cofactors(&rows);
        let [x, y, z] = placed.normal_rows;
        Placed {
            rows,
            translation: V3::new(translation[0], translation[1], translation[2]),
            normal_rows: [nx.or_else(lanes, x), ny.or_else(lanes, y), nz.or_else(lanes, z)],
            side: side.or_else(lanes, placed.side),
            ..placed
        }
    }
}

/// Rows of the cofactors of the matrix with these `rows`, of any length but in the range of f32, times the sign of its
/// determinant; and that sign.
#[inline(always)]
fn cofactors<L: Lanes>(rows: &[V3<L>; 3]) -> ([V3<L>; 3], L::F) {
    let largest = rows[0].abs().max(rows[1].abs()).max(rows[2].abs()).max_component();
    let per = L::F::one() / largest;
    let [x, y, z] = [rows[0].scale(per), rows[1].scale(per), rows[2].scale(per)];
    // The cofactors of the transpose are the transpose of the cofactors.
    let (a, b, c) = (y.cross(z), z.cross(x), x.cross(y));
    let side = L::F::one().copysign(x.dot(a));
    ([a.scale(side), b.scale(side), c.scale(side)], side)
}

#[inline(always)]
fn times<L: Lanes>(rows: &[V3<L>; 3], v: V3<L>) -> V3<L> {
    V3::new(rows[0].dot(v), rows[1].dot(v), rows[2].dot(v))
}

impl<L: Lanes> Placed<L> {
    /// Where the point `p` of the object is, metres.
    #[inline(always)]
    pub fn point(&self, p: V3<L>) -> V3<L> {
        (times(&self.rows, p) + self.translation).or_else(self.lanes, p)
    }

    /// Where the vector `v` of the object points, metres.
    #[inline(always)]
    pub fn vector(&self, v: V3<L>) -> V3<L> {
        times(&self.rows, v).or_else(self.lanes, v)
    }

    /// The direction of `v`, carried as points are; unit, or null where it has none.
    #[inline(always)]
    pub fn direction(&self, v: V3<L>) -> V3<L> {
        unit_or_null(times(&self.rows, v)).or_else(self.lanes, v)
    }

    /// The normal `n`, carried by the inverse transpose; unit, or null where it has no direction. The front stays the
    /// front, also of a mirrored object.
    #[inline(always)]
    pub fn normal(&self, n: V3<L>) -> V3<L> {
        unit_or_null(times(&self.normal_rows, n)).or_else(self.lanes, n)
    }

    /// The handedness `w` of a tangent: the other one where the object is mirrored.
    #[inline(always)]
    pub fn handedness(&self, w: L::F) -> L::F {
        (w * self.side).or_else(self.lanes, w)
    }

    /// How far a ray's origin is moved off a triangle along its unit normal `ng` (prepared space), metres; `extent` is the
    /// triangle's largest coordinate in its object's space. Only for `lanes`.
    #[inline(always)]
    pub fn offset_length(&self, extent: L::F, ng: V3<L>) -> L::F {
        ng.abs().dot(self.per_metre.mul_add(extent, self.at_origin))
    }
}

#[inline(always)]
fn unit_or_null<L: Lanes>(v: V3<L>) -> V3<L> {
    // By its largest component first: the squares of a vector that a small scale shrank leave the range of f32.
    let v = v.scale(L::F::one() / v.abs().max_component());
    let unit = v.normalized();
    unit.masked(unit.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::tests::at_all_levels;
    use simd::{Float, Kernel};

    /// A placement, and what of it lanes must say.
    #[derive(Clone)]
    struct Case {
        linear: DMat3,
        translation: DVec3,
    }

    impl Case {
        fn table(&self) -> PlacementTable {
            let mut table = PlacementTable::with_capacity(1);
            let m = self.linear;
            table.push([m.x_axis.as_vec3(), m.y_axis.as_vec3(), m.z_axis.as_vec3()], self.translation.as_vec3());
            table
        }

        /// As the table has it.
        fn rounded(&self) -> (DMat3, DVec3) {
            let m = self.linear;
            let column = |c: DVec3| c.as_vec3().as_dvec3();
            (DMat3::from_cols(column(m.x_axis), column(m.y_axis), column(m.z_axis)), column(self.translation))
        }
    }

    /// Turned, stretched with this condition number, sheared, scaled, mirrored.
    fn cases() -> Vec<(f64, Case)> {
        let mut all = Vec::new();
        for k in 0..200 {
            let a = f64::from(k);
            let (before, after) =
                (DMat3::from_rotation_y(a) * DMat3::from_rotation_x(2.0 * a), DMat3::from_rotation_z(0.7 * a));
            for cond in [1.0, 10.0, 1e3, 1e6] {
                for scale in [1.0, 1e-12, 1e12] {
                    let side = if k % 2 == 0 { 1.0 } else { -1.0 };
                    let stretch = DVec3::new(1.0, side / f64::sqrt(cond), 1.0 / cond) * scale;
                    let linear = before * DMat3::from_diagonal(stretch) * after;
                    all.push((cond, Case { linear, translation: DVec3::new(a, -2.0 * a, 0.3 * a) * scale }));
                }
            }
        }
        all
    }

    #[inline(always)]
    fn get<L: Lanes>(v: V3<L>) -> DVec3 {
        let mut out = [[0.0; 16]; 3];
        v.x.store(&mut out[0], 0);
        v.y.store(&mut out[1], 0);
        v.z.store(&mut out[2], 0);
        DVec3::new(f64::from(out[0][0]), f64::from(out[1][0]), f64::from(out[2][0]))
    }

    // 600 placements of each condition number.
    #[test]
    fn inst_02_placed_normals_go_by_the_inverse_transpose() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                for (cond, case) in cases() {
                    let table = case.table();
                    let placed = table.get::<L>(L::U::splat(1), L::F::zero(), L::M::first(L::N)).expect("a placement");
                    let n = Vec3::new(0.48, -0.6, 0.64);
                    let (linear, _) = case.rounded();
                    // In units of its largest element, where f64 has no trouble with determinants.
                    let exact = (scaled(linear).inverse().transpose() * n.as_dvec3()).normalize();
                    let found = get(placed.normal(V3::splat(n.to_array())));
                    let angle = found.cross(exact).length().atan2(found.dot(exact));
                    assert!(angle <= 4e-7 * cond && (found.length() - 1.0).abs() < 1e-6, "{cond:e}: {angle:e} {found}");
                    let zero = get(placed.normal(V3::zero()));
                    assert_eq!(zero, DVec3::ZERO);
                }
            }
        }
        at_all_levels(Check);
    }

    #[test]
    fn inst_03_placed_points_are_within_their_bound() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                for (_, case) in cases() {
                    let table = case.table();
                    let placed = table.get::<L>(L::U::splat(1), L::F::zero(), L::M::first(L::N)).expect("a placement");
                    let p = Vec3::new(0.9, -0.31, 0.77);
                    let exact = case.linear * p.as_dvec3() + case.translation;
                    let apart = (get(placed.point(V3::splat(p.to_array()))) - exact).abs();
                    for (i, axis) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().enumerate() {
                        let bound = placed.offset_length(L::F::splat(0.9), V3::splat(axis));
                        let bound = get(V3::<L>::new(bound, bound, bound)).x;
                        assert!(apart[i] <= 0.5 * bound, "{apart} beyond {bound:e}");
                    }
                }
            }
        }
        at_all_levels(Check);
    }

    #[test]
    fn lanes_of_the_world_are_left_as_they_are() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                let table =
                    Case { linear: DMat3::from_diagonal(DVec3::new(-2.0, 3.0, 1.0)), translation: DVec3::X }.table();
                let all = L::M::first(L::N);
                assert!(table.get::<L>(L::U::splat(0), L::F::zero(), all).is_none());
                assert!(table.get::<L>(L::U::splat(1), L::F::zero(), L::M::from_bits(0)).is_none());
                // The first lane hit the placement, the others the world.
                let instance = L::U::splat(1).or_else(L::M::first(1), L::U::splat(0));
                let placed = table.get::<L>(instance, L::F::zero(), all).expect("a lane that hit a placement");
                let (mut out, v) = ([0.0; 16], V3::<L>::splat([1.0, 0.5, 0.25]));
                placed.point(v).x.store(&mut out, 0);
                assert_eq!(out[0], -1.0);
                assert!(out[1..L::N].iter().all(|&x| x == 1.0));
                placed.handedness(L::F::one()).store(&mut out, 0);
                assert_eq!(out[0], -1.0);
                assert!(out[1..L::N].iter().all(|&x| x == 1.0));
                placed.normal(v).y.store(&mut out, 0);
                assert!(out[1..L::N].iter().all(|&x| x == 0.5));
            }
        }
        at_all_levels(Check);
    }
}
