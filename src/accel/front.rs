//! The few big triangles of a scene, tested by as many rays at once as there are lanes, in front of a backend.
//!
//! Walls stop most rays of an interior, and a box hierarchy spends its first steps on exactly those. A packet of rays
//! against a short list needs no steps at all. Only rays that may still hit something nearer go on to the backend.
//! Cornell box (42 triangles, all of them here), CPU time a path on one core: 530 ns to 250 with `bvh` behind, 440 to 250
//! with Embree's robust 16-packets (AVX-512).
//!
//! The test is that of `woop.rs`, with rays in the lanes: plain IEEE operations in a fixed order, no FMA, so every lane
//! count gives the same bits. Two differences: the permutation and shear are a matrix per ray with zeroes and a one in
//! it (exact), and the nearest of several hits is chosen by `T / det`. Corners shared by triangles are sheared once.

use super::geometry::{Geometry, Part, Primitives};
use super::woop::{can_be_hit, exact_edges_of, in_doubt};
use super::{Accel, AccelStats, HitBatch, MISS, RayBatch};
use simd::{Float, Kernel, Lanes, Level, Mask, Uint, dispatch};
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Range;

/// More triangles than this are no short list.
pub const MOST: usize = 64;

/// A triangle is big when its box has at least this share of the scene's box, by surface area.
const BIG: f64 = 0.01;

/// Corners of the longest list.
const MOST_CORNERS: usize = 3 * MOST;

/// Which triangles of a scene go into the front, and what is left for the backend.
pub struct Split {
    /// The front; `None` if no triangle is worth it or too many are.
    pub front: Option<Big>,
    /// What is left.
    pub rest: Geometry,
}

/// The short list.
#[derive(Clone)]
pub struct Big {
    /// Distinct corners.
    corners: Vec<[f32; 3]>,
    /// Three corners and the primitive number; ascending.
    triangles: Vec<([u16; 3], u32)>,
}

impl Split {
    /// Of the world's triangles that neither move nor ask a filter: all if there is little else, or else the big ones if
    /// those are few.
    pub fn new(all: impl Into<Geometry>) -> Self {
        let mut rest = all.into();
        let few = rest.placements.is_empty() && rest.triangle_count() <= MOST;
        let scene_area = rest.bounds().map_or(0.0, box_area);
        let mut chosen = Vec::new();
        for (p, part) in rest.world.parts.iter().enumerate().filter(|(_, part)| suits(part)) {
            let is_big = |&i: &usize| few || box_area(part.triangles.corners(i)) >= BIG * scene_area;
            let wanted = MOST + 1 - chosen.len();
            chosen.extend((0..part.triangles.indices.len()).filter(is_big).take(wanted).map(|i| (p, i)));
        }
        if chosen.is_empty() || chosen.len() > MOST {
            return Self { front: None, rest };
        }
        let (mut big, mut known) = (Big { corners: Vec::new(), triangles: Vec::new() }, HashMap::new());
        for &(p, i) in &chosen {
            let part = &rest.world.parts[p];
            let corners = part.triangles.corners(i);
            if !can_be_hit(corners) {
                continue;
            }
            let ids = corners.map(|c| {
                *known.entry(c.to_array().map(f32::to_bits)).or_insert_with(|| {
                    big.corners.push(c.to_array());
                    (big.corners.len() - 1) as u16
                })
            });
            big.triangles.push((ids, part.primitives.get(i)));
        }
        big.triangles.sort_unstable_by_key(|&(_, primitive)| primitive);
        for (p, part) in rest.world.parts.iter_mut().enumerate() {
            let taken: Vec<usize> = chosen.iter().filter(|c| c.0 == p).map(|c| c.1).collect();
            if !taken.is_empty() {
                take(part, &taken);
            }
        }
        rest.world.parts.retain(|part| !part.triangles.indices.is_empty());
        Self { front: Some(big), rest }
    }
}

/// Whether the front can do what a part needs.
fn suits(part: &Part) -> bool {
    part.later.is_empty() && !part.filtered
}

/// Removes the triangles `taken` (ascending) from a part; the others keep their numbers.
fn take(part: &mut Part, taken: &[usize]) {
    let mut next = taken.iter().peekable();
    let (mut indices, mut numbers) = (Vec::new(), Vec::new());
    for (i, &triangle) in part.triangles.indices.iter().enumerate() {
        if next.next_if(|&&t| t == i).is_none() {
            indices.push(triangle);
            numbers.push(part.primitives.get(i));
        }
    }
    part.triangles.indices = indices;
    part.primitives = Primitives::Each(numbers);
}

/// Half the surface of the box about `points`.
fn box_area(points: impl IntoIterator<Item = glam::Vec3>) -> f64 {
    let (mut low, mut high) = (glam::Vec3::INFINITY, glam::Vec3::NEG_INFINITY);
    for p in points {
        (low, high) = (low.min(p), high.max(p));
    }
    let d = (high - low).as_dvec3();
    if d.min_element() < 0.0 { 0.0 } else { d.x * d.y + d.y * d.z + d.z * d.x }
}

/// A backend with the big triangles taken out of it and put in front.
pub struct Front {
    big: Big,
    /// The backend of the rest; `None` if nothing is left.
    behind: Option<Behind>,
    /// What the whole calls itself: the backend's words.
    stats: AccelStats,
    level: Level,
}

struct Behind {
    accel: Box<dyn Accel>,
    low: [f32; 3],
    high: [f32; 3],
}

impl Front {
    /// `behind` was built from the rest, which lies within `bounds`; `None` if nothing is left.
    pub fn new(big: Big, behind: Box<dyn Accel>, bounds: Option<[glam::Vec3; 2]>) -> Self {
        let mut stats = behind.stats();
        stats.front = big.triangles.len();
        let behind = bounds.map(|[low, high]| Behind { accel: behind, low: low.to_array(), high: high.to_array() });
        Self { big, behind, stats, level: Level::best() }
    }

    /// The same with other instructions, for tests.
    pub fn with_level(self, level: Level) -> Self {
        Self { level, ..self }
    }
}

/// Rays that go on to the backend, and where they came from.
struct Onward {
    rays: RayBatch,
    hits: HitBatch,
    from: Vec<u32>,
    occluded: Vec<u8>,
}

thread_local! {
    /// One a thread, as large as the largest batch so far.
    static ONWARD: RefCell<Onward> = RefCell::new(Onward {
        rays: RayBatch::new(0),
        hits: HitBatch::new(0),
        from: Vec::new(),
        occluded: Vec::new(),
    });
}

impl Onward {
    fn reserve(&mut self, n: usize) {
        if self.rays.capacity() < n {
            // A batch rounds its room up; the rest must have as much.
            let rays = RayBatch::new(n);
            let room = rays.capacity();
            *self = Self { rays, hits: HitBatch::new(room), from: Vec::with_capacity(room), occluded: vec![0; room] };
        }
        self.from.clear();
    }

    /// Appends ray `i` of `rays`, to be followed up to `t_max`.
    fn push(&mut self, rays: &RayBatch, i: usize, t_max: f32) {
        let to = self.from.len();
        let r = &mut self.rays;
        (r.ox[to], r.oy[to], r.oz[to]) = (rays.ox[i], rays.oy[i], rays.oz[i]);
        (r.dx[to], r.dy[to], r.dz[to]) = (rays.dx[i], rays.dy[i], rays.dz[i]);
        (r.t_max[to], r.time[to], r.key[to]) = (t_max, rays.time[i], rays.key[i]);
        self.from.push(i as u32);
    }
}

impl Accel for Front {
    fn intersect(&self, rays: &RayBatch, range: Range<usize>, coherent: bool, hits: &mut HitBatch) {
        ONWARD.with_borrow_mut(|onward| {
            onward.reserve(range.len());
            dispatch(self.level, Intersect { front: self, rays, range, hits, onward });
            let Some(behind) = &self.behind else { return };
            behind.accel.intersect(&onward.rays, 0..onward.from.len(), coherent, &mut onward.hits);
            for (k, &i) in onward.from.iter().enumerate() {
                let (primitive, i) = (onward.hits.primitive[k], i as usize);
                // The ray ended at what the front hit, so any hit is nearer.
                if primitive != MISS {
                    hits.t[i] = onward.hits.t[k];
                    hits.u[i] = onward.hits.u[k];
                    hits.v[i] = onward.hits.v[k];
                    hits.primitive[i] = primitive;
                    hits.instance[i] = onward.hits.instance[k];
                }
            }
        });
    }

    fn occluded(&self, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
        ONWARD.with_borrow_mut(|onward| {
            onward.reserve(n);
            dispatch(self.level, Occluded { front: self, rays, n, occluded, onward });
            let Some(behind) = &self.behind else { return };
            let m = onward.from.len();
            behind.accel.occluded(&onward.rays, m, &mut onward.occluded);
            for (&i, &o) in onward.from.iter().zip(&onward.occluded) {
                occluded[i as usize] = o;
            }
        });
    }

    fn stats(&self) -> AccelStats {
        self.stats.clone()
    }
}

/// Rays in lanes, permuted and sheared by a matrix each.
struct Packet<L: Lanes> {
    origin: [L::F; 3],
    /// Rows that give x, y, z of the permuted, sheared space.
    rows: [[L::F; 3]; 3],
    inverse: [L::F; 3],
    t_max: L::F,
    /// Lanes that hold a ray that is one.
    usable: L::M,
}

/// Sheared corners of the list.
struct Sheared<L: Lanes> {
    at: [[L::F; 3]; MOST_CORNERS],
}

/// A vector from `at`; zeroes past the end (a range may start anywhere in a batch, so its last vector may stick out).
#[inline(always)]
fn load<L: Lanes>(src: &[f32], at: usize) -> L::F {
    if at + L::N <= src.len() {
        return L::F::load(src, at);
    }
    let mut tail = [0.0; 16];
    tail[..src.len() - at].copy_from_slice(&src[at..]);
    L::F::load(&tail, 0)
}

impl<L: Lanes> Packet<L> {
    #[inline(always)]
    fn load(rays: &RayBatch, at: usize, active: L::M) -> Self {
        let (zero, one) = (L::F::zero(), L::F::one());
        let o = [load::<L>(&rays.ox, at), load::<L>(&rays.oy, at), load::<L>(&rays.oz, at)];
        let d = [load::<L>(&rays.dx, at), load::<L>(&rays.dy, at), load::<L>(&rays.dz, at)];
        let (ax, ay, az) = (d[0].abs(), d[1].abs(), d[2].abs());
        let largest = ax.max(ay).max(az);
        let finite = (o[0] * zero + o[1] * zero + o[2] * zero + d[0] * zero + d[1] * zero + d[2] * zero).eq(zero);
        let usable = active & finite & largest.ge(L::F::splat(f32::MIN_POSITIVE));
        let along_x = ax.ge(ay) & ax.ge(az);
        let along_y = !along_x & ay.ge(az);
        let along_z = !(along_x | along_y);
        let dz = d[0].or_else(along_x, d[1].or_else(along_y, d[2]));
        // The two other axes in cyclic order, exchanged where dz < 0 to keep the winding.
        let flips = dz.lt(zero);
        let next = [along_z, along_x, along_y];
        let after = [along_y, along_z, along_x];
        let kz = [along_x, along_y, along_z];
        let mut kx = next;
        let mut ky = after;
        for axis in 0..3 {
            kx[axis] = (next[axis] & !flips) | (after[axis] & flips);
            ky[axis] = (after[axis] & !flips) | (next[axis] & flips);
        }
        let dx = d[0].or_else(kx[0], d[1].or_else(kx[1], d[2]));
        let dy = d[0].or_else(ky[0], d[1].or_else(ky[1], d[2]));
        let (sx, sy, sz) = (-(dx / dz), -(dy / dz), one / dz);
        let mut rows = [[zero; 3]; 3];
        for axis in 0..3 {
            rows[0][axis] = one.or_else(kx[axis], sx.masked(kz[axis]));
            rows[1][axis] = one.or_else(ky[axis], sy.masked(kz[axis]));
            rows[2][axis] = sz.masked(kz[axis]);
        }
        // For box tests: an infinite inverse times a zero distance is NaN, which never culls.
        let inverse = [one / d[0], one / d[1], one / d[2]];
        Self { origin: o, rows, inverse, t_max: load::<L>(&rays.t_max, at), usable }
    }

    /// All corners of the list, relative to the rays and sheared.
    #[inline(always)]
    fn shear(&self, big: &Big, out: &mut Sheared<L>) {
        for (corner, out) in big.corners.iter().zip(&mut out.at) {
            let x = L::F::splat(corner[0]) - self.origin[0];
            let y = L::F::splat(corner[1]) - self.origin[1];
            let z = L::F::splat(corner[2]) - self.origin[2];
            let [a, b, c] = &self.rows;
            *out = [x * a[0] + y * a[1] + z * a[2], x * b[0] + y * b[1] + z * b[2], x * c[0] + y * c[1] + z * c[2]];
        }
    }

    /// Lanes whose ray may meet the box before `end`; conservative.
    #[inline(always)]
    fn meets(&self, low: &[f32; 3], high: &[f32; 3], end: L::F) -> L::M {
        let (mut near, mut far) = (L::F::zero(), end);
        for axis in 0..3 {
            let a = (L::F::splat(low[axis]) - self.origin[axis]) * self.inverse[axis];
            let b = (L::F::splat(high[axis]) - self.origin[axis]) * self.inverse[axis];
            // `min` and `max` give the second operand for NaN: near and far stay as they are.
            near = a.min(b).max(near);
            far = (a.max(b) * L::F::splat(1.000_000_5)).min(far);
        }
        near.le(far) & self.usable
    }
}

/// One triangle against a packet.
#[derive(Clone, Copy)]
struct Crossing<L: Lanes> {
    /// T / det.
    t: L::F,
    /// What that may be off by: three roundings of the distances of the corners.
    slack: L::F,
    /// Edge functions.
    edges: [L::F; 3],
    /// Distances of the corners.
    corners: [L::F; 3],
    /// The line passes inside, between the ray's ends.
    inside: L::M,
}

/// Hits are told apart, from each other and from the ray's ends, by `T / det` when they differ by more than this share of
/// the distances of the corners: 16 eps. Closer ones, and those that overflow, by the exact test.
const CLOSE: f32 = 1e-6;

impl<L: Lanes> Crossing<L> {
    /// No hit before `t_max`.
    #[inline(always)]
    fn none(t_max: L::F) -> Self {
        let zero = L::F::zero();
        Self { t: t_max, slack: zero, edges: [zero; 3], corners: [zero; 3], inside: L::M::from_bits(0) }
    }

    /// `self` where `mask`, else `other`.
    #[inline(always)]
    fn or_else(self, mask: L::M, other: Self) -> Self {
        let (a, b) = (self, other);
        Self {
            t: a.t.or_else(mask, b.t),
            slack: a.slack.or_else(mask, b.slack),
            edges: or_else3::<L>(a.edges, mask, b.edges),
            corners: or_else3::<L>(a.corners, mask, b.corners),
            inside: (a.inside & mask) | (b.inside & !mask),
        }
    }

    /// t, u, v as `woop.rs` has them: weights first, then t as their sum.
    #[inline(always)]
    fn exact_hit(&self) -> (L::F, L::F, L::F) {
        let [e0, e1, e2] = self.edges;
        let [at, bt, ct] = self.corners;
        let det = (e0 + e1) + e2;
        let (w, u, v) = (e0 / det, e1 / det, e2 / det);
        ((w * at + u * bt) + v * ct, u, v)
    }
}

#[inline(always)]
fn or_else3<L: Lanes>(a: [L::F; 3], mask: L::M, b: [L::F; 3]) -> [L::F; 3] {
    [a[0].or_else(mask, b[0]), a[1].or_else(mask, b[1]), a[2].or_else(mask, b[2])]
}

#[inline(always)]
fn one_side<L: Lanes>(e0: L::F, e1: L::F, e2: L::F) -> L::M {
    let zero = L::F::zero();
    e0.min(e1).min(e2).ge(zero) | e0.max(e1).max(e2).le(zero)
}

#[inline(always)]
fn cross<L: Lanes>(sheared: &Sheared<L>, ids: [u16; 3], active: L::M, t_max: L::F) -> Option<Crossing<L>> {
    // The remainder never does anything; it spares bounds checks.
    let [[ax, ay, at], [bx, by, bt], [cx, cy, ct]] = [
        sheared.at[ids[0] as usize % MOST_CORNERS],
        sheared.at[ids[1] as usize % MOST_CORNERS],
        sheared.at[ids[2] as usize % MOST_CORNERS],
    ];
    let zero = L::F::zero();
    let (mut e0, mut e1, mut e2) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
    let mut inside = active & one_side::<L>(e0, e1, e2);
    if !inside.any() {
        return None;
    }
    let mut det = (e0 + e1) + e2;
    let around = [[ax, ay], [bx, by], [cx, cy]];
    let doubtful = inside & in_doubt::<L>(around, [e0, e1, e2], det);
    if doubtful.any() {
        [e0, e1, e2] = exact_edges_of::<L>(around, [e0, e1, e2], doubtful.bits());
        inside = inside & one_side::<L>(e0, e1, e2);
        det = (e0 + e1) + e2;
    }
    let t = ((e0 * at + e1 * bt) + e2 * ct) / det;
    let slack = at.abs().max(bt.abs()).max(ct.abs()) * L::F::splat(CLOSE);
    let mut crossing = Crossing::<L> { t, slack, edges: [e0, e1, e2], corners: [at, bt, ct], inside };
    let doubtful = inside & (t.abs().le(slack) | (t - t_max).abs().le(slack) | !t.is_finite());
    crossing.inside = inside & t.gt(zero) & t.lt(t_max);
    if doubtful.any() {
        let exact = crossing.exact_hit().0;
        crossing.inside = (crossing.inside & !doubtful) | (doubtful & exact.gt(zero) & exact.lt(t_max));
    }
    Some(crossing)
}

struct Intersect<'a> {
    front: &'a Front,
    rays: &'a RayBatch,
    range: Range<usize>,
    hits: &'a mut HitBatch,
    onward: &'a mut Onward,
}

impl Kernel for Intersect<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { front, rays, range, hits, onward } = self;
        let mut sheared = Sheared::<L> { at: [[L::F::zero(); 3]; MOST_CORNERS] };
        for at in range.clone().step_by(L::N) {
            let active = L::M::first(range.end - at);
            let packet = Packet::<L>::load(rays, at, active);
            packet.shear(&front.big, &mut sheared);
            let mut best = Crossing::<L>::none(packet.t_max);
            let mut primitive = L::U::splat(MISS);
            for &(ids, index) in &front.big.triangles {
                if let Some(c) = cross::<L>(&sheared, ids, packet.usable, packet.t_max) {
                    // Strictly nearer: ties go to the lower index.
                    let mut nearer = c.inside & (c.t.lt(best.t) | !best.inside);
                    let apart = (c.t - best.t).abs().gt(c.slack + best.slack);
                    let close = best.inside & c.inside & !apart;
                    if close.any() {
                        nearer = (nearer & !close) | (close & c.exact_hit().0.lt(best.exact_hit().0));
                    }
                    best = c.or_else(nearer, best);
                    primitive = L::U::splat(index).or_else(nearer, primitive);
                }
            }
            let (t, u, v) = best.exact_hit();
            let t = t.or_else(best.inside, packet.t_max);
            let mut out = ([0.0; 16], [0.0; 16], [0.0; 16], [0; 16]);
            t.store(&mut out.0, 0);
            u.masked(best.inside).store(&mut out.1, 0);
            v.masked(best.inside).store(&mut out.2, 0);
            primitive.store(&mut out.3, 0);
            let n = L::N.min(range.end - at);
            hits.t[at..at + n].copy_from_slice(&out.0[..n]);
            hits.u[at..at + n].copy_from_slice(&out.1[..n]);
            hits.v[at..at + n].copy_from_slice(&out.2[..n]);
            hits.primitive[at..at + n].copy_from_slice(&out.3[..n]);
            hits.instance[at..at + n].fill(0);
            if let Some(behind) = &front.behind {
                let mut bits = packet.meets(&behind.low, &behind.high, t).bits();
                while bits != 0 {
                    let i = bits.trailing_zeros() as usize % 16;
                    onward.push(rays, at + i, out.0[i]);
                    bits &= bits - 1;
                }
            }
        }
    }
}

struct Occluded<'a> {
    front: &'a Front,
    rays: &'a RayBatch,
    n: usize,
    occluded: &'a mut [u8],
    onward: &'a mut Onward,
}

impl Kernel for Occluded<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { front, rays, n, occluded, onward } = self;
        let mut sheared = Sheared::<L> { at: [[L::F::zero(); 3]; MOST_CORNERS] };
        for at in (0..n).step_by(L::N) {
            let packet = Packet::<L>::load(rays, at, L::M::first(n - at));
            packet.shear(&front.big, &mut sheared);
            let mut open = packet.usable;
            for &(ids, _) in &front.big.triangles {
                if let Some(c) = cross::<L>(&sheared, ids, open, packet.t_max) {
                    open = open & !c.inside;
                    if !open.any() {
                        break;
                    }
                }
            }
            let blocked = packet.usable.bits() & !open.bits();
            for (i, out) in occluded[at..n.min(at + L::N)].iter_mut().enumerate() {
                *out = (blocked >> i & 1) as u8;
            }
            if let Some(behind) = &front.behind {
                let mut bits = (packet.meets(&behind.low, &behind.high, packet.t_max) & open).bits();
                while bits != 0 {
                    let i = at + bits.trailing_zeros() as usize;
                    onward.push(rays, i, rays.t_max[i]);
                    bits &= bits - 1;
                }
            }
        }
    }
}
