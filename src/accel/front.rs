//! The few big triangles of a scene, tested by as many rays at once as there are lanes, in front of a backend.
//!
//! Walls stop most scattered rays of an interior, and a box hierarchy spends its first steps on exactly those. A packet
//! of rays against a short list needs no steps at all. Only rays that may still hit something nearer go on, to a backend
//! over the rest. Scattered rays, with the front against without, Embree's 16-packets and `bvh`: Cornell box (42 triangles,
//! all of them here) 2.3 and 2.0 times as fast, a mesh of 33,000 triangles in a room 1.8 and 1.7, one of 73,000 in a gallery
//! 1.8 and 1.5. Behind a tree over everything, the big triangles included, 0.8 of that: hence a second tree.
//!
//! Camera rays, and shadow rays unless a third of them cannot meet anything but walls, go to the tree over everything.
//!
//! The test is that of `woop.rs`, with rays in the lanes: plain IEEE operations in a fixed order, no FMA, so every lane
//! count gives the same bits. Two differences: the permutation and shear are a matrix per ray with zeroes and a one in
//! it (exact), and the nearest of several hits is chosen by `T / det`. Corners shared by triangles are sheared once.

use super::geometry::{Candidate, Geometry};
use super::woop::{exact_edges_of, in_doubt};
use super::{Accel, AccelStats, HitBatch, MISS, RayBatch};
use simd::{Buffer, Float, Kernel, Lanes, Level, Mask, Uint, dispatch};
use std::cell::RefCell;
use std::ops::Range;

mod split;

pub use split::{Big, MOST, MOST_TWICE, Split};
use split::{MOST_CORNERS, Triangle};

/// A backend with the big triangles in front of it, for the rays that gain by them.
pub struct Front {
    big: Big,
    /// Over all that is not in the list; `None` if that is nothing.
    rest: Option<Box<dyn Accel>>,
    /// Over everything, for the others.
    all: Box<dyn Accel>,
    /// All shadow rays are tested against the list, whether that pays or not: before Embree, whose arithmetic is another, so
    /// that `occluded` says what `intersect` says. (It costs its packets of shadow rays 4 to 12 % of their speed.) Ours gives
    /// the same bits by either way, and goes the faster one.
    is_for_all_shadows: bool,
    level: Level,
}

impl Front {
    /// `all` was built from everything, `rest` from what a [`Split`] left: it may be `None` where that is nothing.
    pub fn new(big: Big, rest: Option<Box<dyn Accel>>, all: Box<dyn Accel>) -> Self {
        let rest = rest.filter(|_| !big.is_all());
        let is_for_all_shadows = all.stats().name == "embree";
        Self { big, rest, all, is_for_all_shadows, level: Level::best() }
    }

    /// Over what a [`Split`] chose, by backends that `build` makes.
    ///
    /// # Errors
    /// Those of `build`.
    pub fn build<E>(
        all: Geometry,
        (big, rest): (Big, Geometry),
        mut build: impl FnMut(Geometry) -> Result<Box<dyn Accel>, E>,
    ) -> Result<Self, E> {
        let rest = (!big.is_all()).then(|| build(rest)).transpose()?;
        Ok(Self::new(big, rest, build(all)?))
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
    from: Buffer<u32>,
    occluded: Vec<u8>,
    /// How many.
    n: usize,
}

thread_local! {
    /// One a thread, as large as the largest batch so far.
    static ONWARD: RefCell<Onward> = RefCell::new(Onward::new(0));
}

impl Onward {
    fn new(room: usize) -> Self {
        Self {
            rays: RayBatch::new(room),
            hits: HitBatch::new(room),
            from: Buffer::new(room),
            occluded: vec![0; room],
            n: 0,
        }
    }

    fn reserve(&mut self, n: usize) {
        // One vector more than rays, so that a whole one may be stored behind the last.
        let room = n + 16;
        if self.rays.capacity() < room {
            *self = Self::new(room.next_multiple_of(16));
        }
        self.n = 0;
    }

    /// Appends the rays of `lanes`, from `at` on, to be followed up to `t_max`.
    #[inline(always)]
    fn push<L: Lanes>(&mut self, rays: &RayBatch, at: usize, lanes: L::M, t_max: L::F) {
        let (to, r) = (self.n, &mut self.rays);
        load::<L>(&rays.ox, at).compress(lanes, &mut r.ox, to);
        load::<L>(&rays.oy, at).compress(lanes, &mut r.oy, to);
        load::<L>(&rays.oz, at).compress(lanes, &mut r.oz, to);
        load::<L>(&rays.dx, at).compress(lanes, &mut r.dx, to);
        load::<L>(&rays.dy, at).compress(lanes, &mut r.dy, to);
        load::<L>(&rays.dz, at).compress(lanes, &mut r.dz, to);
        t_max.compress(lanes, &mut r.t_max, to);
        load::<L>(&rays.time, at).compress(lanes, &mut r.time, to);
        load_uint::<L>(&rays.key, at).compress(lanes, &mut r.key, to);
        (L::U::lane_ids() + L::U::splat(at as u32)).compress(lanes, &mut self.from, to);
        self.n += lanes.count();
    }
}

impl Accel for Front {
    fn intersect(&self, rays: &RayBatch, range: Range<usize>, coherent: bool, hits: &mut HitBatch) {
        // Packets find walls in a tree in no time: 1.1 to 2.2 times as fast without a front.
        if coherent {
            return self.all.intersect(rays, range, coherent, hits);
        }
        ONWARD.with_borrow_mut(|onward| {
            onward.reserve(range.len());
            dispatch(self.level, Intersect { big: &self.big, rays, range, hits, onward });
            let Some(rest) = &self.rest else { return };
            let Onward { rays, hits: found, from, n, .. } = onward;
            rest.intersect(rays, 0..*n, coherent, found);
            for (k, &i) in from[..*n].iter().enumerate() {
                let (primitive, i) = (found.primitive[k], i as usize);
                // The ray ended at what the front hit, so any hit is nearer.
                if primitive != MISS {
                    hits.t[i] = found.t[k];
                    hits.u[i] = found.u[k];
                    hits.v[i] = found.v[k];
                    hits.primitive[i] = primitive;
                    hits.instance[i] = found.instance[k];
                }
            }
        });
    }

    fn occluded(&self, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
        if !self.is_for_all_shadows && !dispatch(self.level, Pays { big: &self.big, rays, n }) {
            return self.all.occluded(rays, n, occluded);
        }
        ONWARD.with_borrow_mut(|onward| {
            onward.reserve(n);
            dispatch(self.level, Occluded { big: &self.big, rays, n, occluded, onward });
            let Some(rest) = &self.rest else { return };
            let Onward { rays, from, occluded: found, n, .. } = onward;
            rest.occluded(rays, *n, found);
            for (&i, &o) in from[..*n].iter().zip(&*found) {
                occluded[i as usize] = o;
            }
        });
    }

    fn stats(&self) -> AccelStats {
        let all = self.all.stats();
        let bytes = all.bytes + self.rest.as_ref().map_or(0, |rest| rest.stats().bytes);
        AccelStats { front: self.big.triangles.len(), bytes, ..all }
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

/// As [`load`].
#[inline(always)]
fn load_uint<L: Lanes>(src: &[u32], at: usize) -> L::U {
    if at + L::N <= src.len() {
        return L::U::load(src, at);
    }
    let mut tail = [0; 16];
    tail[..src.len() - at].copy_from_slice(&src[at..]);
    L::U::load(&tail, 0)
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

    /// Lanes whose ray may meet before `end` what is in the box. Conservative: the box is padded by what the triangle test
    /// may be off by, as `wide/ray.rs` has it. Else a ray along the box's own face, whose distance is 0 * infinity, would
    /// lose the corners that lie in it, and one at an edge shared by a big triangle and another what the other won.
    #[inline(always)]
    fn meets(&self, [low, high]: &[[f32; 3]; 2], end: L::F) -> L::M {
        let (mut near, mut far, mut reach) = (L::F::zero(), end, L::F::zero());
        for axis in 0..3 {
            reach = reach.max((L::F::splat(low[axis]) - self.origin[axis]).abs());
            reach = reach.max((L::F::splat(high[axis]) - self.origin[axis]).abs());
        }
        let pad = reach * L::F::splat(PAD);
        for axis in 0..3 {
            let a = ((L::F::splat(low[axis]) - self.origin[axis]) - pad) * self.inverse[axis];
            let b = ((L::F::splat(high[axis]) - self.origin[axis]) + pad) * self.inverse[axis];
            near = a.min(b).max(near);
            far = (a.max(b) * L::F::splat(1.000_000_5)).min(far);
        }
        near.le(far) & self.usable
    }
}

/// The pad of the box of the rest, as a share of the distance to its farthest corner: 32 eps. The triangle test may be off
/// by 5 eps of the distance and 10 eps of a triangle's extent, which is twice that distance at most.
const PAD: f32 = 1.0 / (1 << 19) as f32;

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

impl Big {
    /// Whether nothing is left that is not in it.
    pub fn is_all(&self) -> bool {
        self.rest.is_none()
    }

    /// Those of `lanes` whose rays, from `at` on, a filtered triangle lets pass at (u, v).
    #[inline(always)]
    fn passing<L: Lanes>(&self, triangle: &Triangle, lanes: L::M, keys: &[u32], u: L::F, v: L::F) -> L::M {
        let mut at = [[0.0; 16]; 2];
        u.store(&mut at[0], 0);
        v.store(&mut at[1], 0);
        L::M::from_bits(self.ask(triangle.primitive, lanes.bits(), keys, &at))
    }

    #[cold]
    #[inline(never)]
    fn ask(&self, primitive: u32, mut bits: u32, keys: &[u32], [u, v]: &[[f32; 16]; 2]) -> u32 {
        let mut passing = 0;
        while bits != 0 {
            let i = bits.trailing_zeros() as usize % 16;
            bits &= bits - 1;
            let candidate = Candidate { key: keys[i], instance: 0, primitive, u: u[i], v: v[i] };
            let stops = self.filter.as_ref().is_some_and(|filter| filter.stops(&candidate));
            passing |= u32::from(!stops) << i;
        }
        passing
    }
}

struct Intersect<'a> {
    big: &'a Big,
    rays: &'a RayBatch,
    range: Range<usize>,
    hits: &'a mut HitBatch,
    onward: &'a mut Onward,
}

impl Kernel for Intersect<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { big, rays, range, hits, onward } = self;
        let mut sheared = Sheared::<L> { at: [[L::F::zero(); 3]; MOST_CORNERS] };
        for at in range.clone().step_by(L::N) {
            let active = L::M::first(range.end - at);
            let packet = Packet::<L>::load(rays, at, active);
            packet.shear(big, &mut sheared);
            let mut best = Crossing::<L>::none(packet.t_max);
            let mut primitive = L::U::splat(MISS);
            for triangle in &big.triangles {
                if let Some(c) = cross::<L>(&sheared, triangle.corners, packet.usable, packet.t_max) {
                    // Strictly nearer: ties go to the lower index.
                    let mut nearer = c.inside & (c.t.lt(best.t) | !best.inside);
                    let apart = (c.t - best.t).abs().gt(c.slack + best.slack);
                    let close = best.inside & c.inside & !apart;
                    if close.any() {
                        nearer = (nearer & !close) | (close & c.exact_hit().0.lt(best.exact_hit().0));
                    }
                    if triangle.is_filtered && nearer.any() {
                        let (_, u, v) = c.exact_hit();
                        nearer = nearer & !big.passing::<L>(triangle, nearer, &rays.key[at..], u, v);
                    }
                    best = c.or_else(nearer, best);
                    primitive = L::U::splat(triangle.primitive).or_else(nearer, primitive);
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
            if let Some(rest) = &big.rest {
                onward.push::<L>(rays, at, packet.meets(rest, t), t);
            }
        }
    }
}

/// One packet of so many is asked whether the front pays.
const SAMPLED: usize = 16;

/// Whether the front pays for shadow rays: where a third of them or more cannot meet anything else. Every sixteenth
/// packet is asked. What is found does not depend on it.
struct Pays<'a> {
    big: &'a Big,
    rays: &'a RayBatch,
    n: usize,
}

impl Kernel for Pays<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let Self { big, rays, n } = self;
        let Some(rest) = &big.rest else { return true };
        let (mut asked, mut alone) = (0, 0);
        for at in (0..n).step_by(SAMPLED * L::N) {
            let packet = Packet::<L>::load(rays, at, L::M::first(n - at));
            asked += packet.usable.count();
            alone += (packet.usable & !packet.meets(rest, packet.t_max)).count();
        }
        3 * alone >= asked
    }
}

struct Occluded<'a> {
    big: &'a Big,
    rays: &'a RayBatch,
    n: usize,
    occluded: &'a mut [u8],
    onward: &'a mut Onward,
}

impl Kernel for Occluded<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { big, rays, n, occluded, onward } = self;
        let mut sheared = Sheared::<L> { at: [[L::F::zero(); 3]; MOST_CORNERS] };
        for at in (0..n).step_by(L::N) {
            let packet = Packet::<L>::load(rays, at, L::M::first(n - at));
            packet.shear(big, &mut sheared);
            let mut open = packet.usable;
            for triangle in &big.triangles {
                if let Some(c) = cross::<L>(&sheared, triangle.corners, open, packet.t_max) {
                    let mut stopped = c.inside;
                    if triangle.is_filtered && stopped.any() {
                        let (_, u, v) = c.exact_hit();
                        stopped = stopped & !big.passing::<L>(triangle, stopped, &rays.key[at..], u, v);
                    }
                    open = open & !stopped;
                    if !open.any() {
                        break;
                    }
                }
            }
            let blocked = packet.usable.bits() & !open.bits();
            for (i, out) in occluded[at..n.min(at + L::N)].iter_mut().enumerate() {
                *out = (blocked >> i & 1) as u8;
            }
            if let Some(rest) = &big.rest {
                onward.push::<L>(rays, at, packet.meets(rest, packet.t_max) & open, packet.t_max);
            }
        }
    }
}

#[cfg(test)]
#[path = "front_tests.rs"]
mod tests;
