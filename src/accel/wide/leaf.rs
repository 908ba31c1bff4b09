//! The watertight test on a whole leaf: the operations of `woop.rs`, in its order, on 8 triangles.

use super::node::{Child, FILTERED, Leaves, WIDTH};
use super::ray::SingleRay;
use crate::accel::MISS;
use crate::accel::geometry::{Candidate, HitFilter};
use crate::accel::woop::{exact_edges_of, in_doubt};
use simd::{Float, Lanes, Mask};

/// The nearest hit so far.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    pub instance: u32,
    pub primitive: u32,
}

impl Nearest {
    /// No hit before `t_max`.
    #[inline(always)]
    pub const fn none(t_max: f32) -> Self {
        Self { t: t_max, u: 0.0, v: 0.0, instance: 0, primitive: MISS }
    }

    /// Whether a hit is nearer, or as near with lower numbers. At the ray's end there is none.
    #[inline(always)]
    pub fn yields_to(&self, t: f32, instance: u32, primitive: u32) -> bool {
        t < self.t || t == self.t && self.primitive != MISS && (instance, primitive) < (self.instance, self.primitive)
    }
}

/// Who is asked about hits on filtered triangles, and for which ray.
#[derive(Clone, Copy)]
pub struct Asked<'a> {
    pub filter: Option<&'a dyn HitFilter>,
    pub key: u32,
    pub instance: u32,
}

impl Asked<'_> {
    /// Whether the ray passes the triangle of `word` at (u, v).
    #[inline(always)]
    pub fn passes(&self, word: u32, u: f32, v: f32) -> bool {
        word & FILTERED != 0 && self.passes_filtered(word & !FILTERED, u, v)
    }

    #[cold]
    fn passes_filtered(&self, primitive: u32, u: f32, v: f32) -> bool {
        let candidate = Candidate { key: self.key, instance: self.instance, primitive, u, v };
        !self.filter.is_some_and(|filter| filter.stops(&candidate))
    }
}

/// Crossings of a ray with up to 8 triangles, in lanes.
struct Crossings {
    /// Lanes with t in (0, end].
    bits: u32,
    t: [f32; WIDTH],
    u: [f32; WIDTH],
    v: [f32; WIDTH],
}

/// A corner relative to the ray and sheared, and its distance.
type Corner<L> = (<L as Lanes>::F, <L as Lanes>::F, <L as Lanes>::F);

/// Crossings of rays and triangles in (0, `end`], of those in `lanes`: which, t, u and v.
#[inline(always)]
pub fn cross<L: Lanes>(corners: [Corner<L>; 3], lanes: u32, end: L::F) -> (u32, L::F, L::F, L::F) {
    let [(ax, ay, at), (bx, by, bt), (cx, cy, ct)] = corners;
    let zero = L::F::zero();
    let (mut e0, mut e1, mut e2) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
    let mut bits = one_side::<L>(e0, e1, e2) & lanes;
    if bits == 0 {
        return (0, zero, zero, zero);
    }
    let mut det = (e0 + e1) + e2;
    let around = [[ax, ay], [bx, by], [cx, cy]];
    let doubtful = in_doubt::<L>(around, [e0, e1, e2], det).bits() & bits;
    if doubtful != 0 {
        [e0, e1, e2] = exact_edges_of::<L>(around, [e0, e1, e2], doubtful);
        bits &= one_side::<L>(e0, e1, e2);
        det = (e0 + e1) + e2;
    }
    let (w, u, v) = (e0 / det, e1 / det, e2 / det);
    let t = (w * at + u * bt) + v * ct;
    (bits & (t.gt(zero) & t.le(end)).bits(), t, u, v)
}

/// A corner from its permuted coordinates.
#[inline(always)]
pub fn sheared<L: Lanes>(p: [L::F; 3], origin: &[L::F; 3], shear: &[L::F; 3]) -> Corner<L> {
    let (x, y, z) = (p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]);
    (x - shear[0] * z, y - shear[1] * z, shear[2] * z)
}

/// Crossings of one ray with the triangles of `leaf` in (0, `end`].
#[inline(always)]
fn crossings<L: Lanes>(leaves: &Leaves, leaf: Child, ray: &SingleRay<L>, end: f32) -> Option<Crossings> {
    let n = leaf.count();
    let rows = &leaves.data[Leaves::offset(leaf)..][..9 * n + WIDTH];
    let corners = [corner::<L>(rows, 0, n, ray), corner::<L>(rows, 3 * n, n, ray), corner::<L>(rows, 6 * n, n, ray)];
    let (bits, t, u, v) = cross::<L>(corners, (1 << n) - 1, L::F::splat(end));
    if bits == 0 {
        return None;
    }
    let mut out = Crossings { bits, t: [0.0; WIDTH], u: [0.0; WIDTH], v: [0.0; WIDTH] };
    t.store(&mut out.t, 0);
    u.store(&mut out.u, 0);
    v.store(&mut out.v, 0);
    Some(out)
}

/// One corner of all triangles of a leaf. `first` is where its rows begin.
#[inline(always)]
fn corner<L: Lanes>(rows: &[f32], first: usize, n: usize, ray: &SingleRay<L>) -> Corner<L> {
    let [kx, ky, kz] = ray.axes;
    let p = [L::F::load(rows, first + kx * n), L::F::load(rows, first + ky * n), L::F::load(rows, first + kz * n)];
    sheared::<L>(p, &ray.origin, &ray.shear)
}

/// Lanes where no edge function is strictly on the other side of another. A NaN may pass: t is NaN then too.
#[inline(always)]
fn one_side<L: Lanes>(e0: L::F, e1: L::F, e2: L::F) -> u32 {
    let zero = L::F::zero();
    (e0.min(e1).min(e2).ge(zero) | e0.max(e1).max(e2).le(zero)).bits()
}

/// Updates `nearest` by the triangles of `leaf`; true if there was a nearer one or, at equal t, one of lower index.
/// `nearest.t` starts as the ray's end, which is excluded.
#[inline(always)]
pub fn intersect<L: Lanes>(
    leaves: &Leaves,
    leaf: Child,
    ray: &SingleRay<L>,
    asked: &Asked<'_>,
    nearest: &mut Nearest,
) -> bool {
    let Some(found) = crossings::<L>(leaves, leaf, ray, nearest.t) else { return false };
    let mut bits = found.bits;
    let mut changed = false;
    while bits != 0 {
        let i = bits.trailing_zeros() as usize % WIDTH;
        bits &= bits - 1;
        let word = leaves.word(leaf, i);
        let primitive = word & !FILTERED;
        let (t, instance) = (found.t[i], asked.instance);
        if nearest.yields_to(t, instance, primitive) && !asked.passes(word, found.u[i], found.v[i]) {
            *nearest = Nearest { t, u: found.u[i], v: found.v[i], instance, primitive };
            changed = true;
        }
    }
    changed
}

/// Whether any triangle of `leaf` lies in (0, `t_max`).
#[inline(always)]
pub fn occluded<L: Lanes>(leaves: &Leaves, leaf: Child, ray: &SingleRay<L>, asked: &Asked<'_>, t_max: f32) -> bool {
    let Some(found) = crossings::<L>(leaves, leaf, ray, t_max) else { return false };
    // The end itself is excluded.
    (0..WIDTH).any(|i| {
        found.bits >> i & 1 == 1 && found.t[i] < t_max && !asked.passes(leaves.word(leaf, i), found.u[i], found.v[i])
    })
}
