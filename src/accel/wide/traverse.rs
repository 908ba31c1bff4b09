//! Single rays through the tree, 8 boxes or triangles at a time, several rays under way at once.
//!
//! Which hit child is nearest is found exactly, without branches (a minimum over lanes); the others go to the stack in the
//! node's order for the ray's octant. Sorting them exactly by branches, as Wald, Benthin and Boulos 2008 ("Getting Rid of
//! Packets") and Embree do: 0.85 to 0.95 of the speed in large scenes, 1.0 to 1.05 in small ones; the octant's order
//! alone: 0.9 in closed rooms, level elsewhere.
//!
//! In a tree beyond the caches (`WideBvh::interleaves`) a ray stops at a node that may be far away in memory (any but
//! those next to the root), asks for it, and the next ray goes on. With 4 rays, against one: 1.5 times the speed in a
//! terrain of 2 million triangles, 1.1 among a million (2 rays: 1.2; 6: as 4), level at half a million, but 0.88 to 0.95
//! with up to 300 000, where one ray is followed at a time. Stopping at leaves as well: 1.1 times as fast again in the
//! terrain, 0.9 elsewhere. Asking for what is on top of the stack as well: 0.95 to 0.98. Compressions and masks of
//! AVX-512 in 8 lanes in place of AVX2: 0.96 to 0.99. Nothing but what changes is read through the slot: 1.03.

use super::feed::{Feed, Which, single};
use super::leaf::{self, Asked, Nearest};
use super::node::{Child, WIDTH};
use super::ray::{SingleRay, box_end};
use super::special::{Special, meet_shape};
use super::{STACK, Space, WideBvh};
use crate::accel::geometry::ShapeRay;
use crate::accel::linear::ray_in_object;
use crate::accel::{MISS, RayBatch};
use glam::Vec3;
use simd::{Float, Lanes, Mask, Uint, prefetch};

/// Rays under way at once where the tree is beyond the caches.
pub const INTERLEAVED: usize = 4;

/// A ray under way.
struct Slot<'a, L: Lanes> {
    /// Where it is: the world, or a placed object.
    space: &'a Space,
    /// In the world and, while it is in a placed object, there.
    ray: [SingleRay<L>; 2],
    /// Where the octants of both begin in the nodes' orders.
    octant: [u32; 2],
    /// Which ray of the batch it is.
    i: usize,
    asked: Asked<'a>,
    /// How far boxes are entered.
    end: f32,
    nearest: Nearest,
    /// What is visited next.
    child: Child,
    /// Entries of the stack: what is still to be visited and where the ray enters it, the nearest on top.
    len: usize,
    /// Where the entries of the current space begin.
    base: usize,
    enter: [f32; STACK + WIDTH],
    children: [u32; STACK + WIDTH],
}

impl<L: Lanes> Slot<'_, L> {
    /// Which of both rays it is now.
    #[inline(always)]
    fn inside(&self) -> usize {
        usize::from(self.asked.instance > 0)
    }
}

/// What is asked about rays.
pub trait Query {
    /// Whether any hit will do.
    const ANY: bool;
    /// What ray `i`, which ends at `t_max`, has hit already.
    fn before(&self, i: usize, t_max: f32) -> Nearest;
    /// What was found for ray `i`.
    fn done(&mut self, i: usize, nearest: &Nearest);
}

/// Follows the rays that are `which` through `world`, `SLOTS` at a time. `TOP`: there are specials.
#[inline(always)]
pub fn trace<L: Lanes, Q: Query, const TOP: bool, const SLOTS: usize>(
    bvh: &WideBvh,
    world: &Space,
    rays: &RayBatch,
    which: impl Which,
    query: &mut Q,
) {
    if which.len() == 0 {
        return;
    }
    let mut feed = Feed::<L, _>::new(which, rays, &world.tree.bounds);
    let mut slots: [Slot<'_, L>; SLOTS] = std::array::from_fn(|_| Slot {
        space: world,
        ray: [SingleRay::none(); 2],
        octant: [0; 2],
        i: 0,
        asked: Asked { filter: bvh.filter.as_deref(), key: 0, instance: 0 },
        end: 0.0,
        nearest: Nearest::none(0.0),
        child: Child::inner(0),
        len: 0,
        base: 0,
        enter: [0.0; STACK + WIDTH],
        children: [0; STACK + WIDTH],
    });
    let mut live: [usize; SLOTS] = std::array::from_fn(|k| k);
    let mut count = 0;
    while count < SLOTS && fill(world, &mut feed, rays, &mut slots[live[count]], query) {
        count += 1;
    }
    while count > 0 {
        let mut k = 0;
        while k < count {
            let slot = &mut slots[live[k] % SLOTS];
            if advance::<L, Q, TOP, SLOTS>(bvh, world, rays, slot) {
                k += 1;
                continue;
            }
            query.done(slot.i, &slot.nearest);
            if fill(world, &mut feed, rays, slot, query) {
                k += 1;
            } else {
                count -= 1;
                live.swap(k, count);
            }
        }
    }
}

/// Puts the next ray that is one into `slot`; false if there is no more.
#[inline(always)]
fn fill<'a, L: Lanes, W: Which>(
    world: &'a Space,
    feed: &mut Feed<'_, L, W>,
    rays: &RayBatch,
    slot: &mut Slot<'a, L>,
    query: &mut impl Query,
) -> bool {
    while let Some((i, ray)) = feed.next() {
        let nearest = query.before(i, rays.t_max[i]);
        let Some((ray, octant)) = ray else {
            query.done(i, &nearest);
            continue;
        };
        (slot.ray[0], slot.octant[0], slot.i, slot.end, slot.nearest) = (ray, octant, i, box_end(nearest.t), nearest);
        (slot.space, slot.child, slot.len, slot.base) = (world, world.root, 0, 0);
        (slot.asked.key, slot.asked.instance) = (rays.key[i], 0);
        return true;
    }
    false
}

/// Goes on with a ray until it is done (false) or asks for memory that may be far (true; never if it is alone).
#[inline(always)]
fn advance<'a, L: Lanes, Q: Query, const TOP: bool, const SLOTS: usize>(
    bvh: &'a WideBvh,
    world: &'a Space,
    rays: &RayBatch,
    slot: &mut Slot<'a, L>,
) -> bool {
    let ids = L::U::load(&[0, 1, 2, 3, 4, 5, 6, 7], 0);
    let by_4 = L::U::load(&[4, 5, 6, 7, 0, 1, 2, 3], 0);
    let by_2 = L::U::load(&[2, 3, 0, 1, 6, 7, 4, 5], 0);
    let by_1 = L::U::load(&[1, 0, 3, 2, 5, 4, 7, 6], 0);
    let none = L::F::splat(f32::INFINITY);
    let (mut child, mut len, mut end) = (slot.child, slot.len, slot.end);
    // Not read through the slot at every step: it changes all the time.
    let (mut nodes, mut leaves) = (&slot.space.tree.nodes[..], &slot.space.tree.leaves);
    let mut inside = if TOP { slot.inside() } else { 0 };
    loop {
        let mut next = None;
        if child.is_leaf() {
            if Q::ANY {
                if leaf::occluded(leaves, child, &slot.ray[inside], &slot.asked, slot.nearest.t) {
                    slot.nearest.primitive = 0;
                    return false;
                }
            } else if leaf::intersect(leaves, child, &slot.ray[inside], &slot.asked, &mut slot.nearest) {
                end = box_end(slot.nearest.t);
            }
        } else if TOP && child.is_special() {
            slot.len = len;
            let found = special::<L, Q>(bvh, rays, slot, child.index());
            if Q::ANY && slot.nearest.primitive != MISS {
                return false;
            }
            end = box_end(slot.nearest.t);
            (nodes, leaves) = (&slot.space.tree.nodes[..], &slot.space.tree.leaves);
            inside = slot.inside();
            next = found;
        } else {
            let node = &nodes[child.node()];
            let (hit, enter) = slot.ray[inside].test_boxes(&node.planes, L::F::splat(end));
            let at = len % STACK;
            // Where boxes are entered, unique by the lane's number in the lowest bits: off by 7 ulp at most.
            let key = ((enter.to_bits() & L::U::splat(!7)) | ids).to_float_bits().or_else(hit, none);
            let least = key.min(key.permute(by_4));
            let least = least.min(least.permute(by_2));
            let least = least.min(least.permute(by_1));
            let first = least.first();
            if first < f32::INFINITY {
                let order = L::U::load(&node.order, 0).shr(slot.octant[inside]);
                let key = key.permute(order);
                let keep = least.lt(key) & key.lt(none);
                L::U::load(&node.children, 0).permute(order).compress(keep, &mut slot.children, at);
                key.compress(keep, &mut slot.enter, at);
                len += keep.count();
                next = Some(node.child(first.to_bits() as usize % WIDTH));
            }
        }
        child = match next {
            Some(child) => child,
            None => loop {
                if len == slot.base {
                    if TOP && len > 0 {
                        leave(world, slot);
                        (nodes, leaves) = (&slot.space.tree.nodes[..], &slot.space.tree.leaves);
                        inside = 0;
                        continue;
                    }
                    return false;
                }
                len -= 1;
                let top = len % STACK;
                if slot.enter[top] <= end {
                    break Child::from_bits(slot.children[top]);
                }
            },
        };
        if SLOTS > 1 && child.is_far() {
            prefetch(nodes, child.node(), 4);
            (slot.child, slot.len, slot.end) = (child, len, end);
            return true;
        }
    }
}

/// Meets special `index` of the slot's space: a placed object is entered (its root is what comes next), anything else is
/// met here and now.
#[cold]
#[inline(always)]
fn special<'a, L: Lanes, Q: Query>(
    bvh: &'a WideBvh,
    rays: &RayBatch,
    slot: &mut Slot<'a, L>,
    index: usize,
) -> Option<Child> {
    let ray = current_ray(bvh, rays, slot);
    match slot.space.specials[index] {
        Special::Placed(p) => {
            let placed = &bvh.placed[p as usize];
            let ray = ray_in_object(&placed.object_from_world(ray.time)?, &ray);
            let space = &bvh.objects[placed.object as usize];
            slot.octant[1] = single::<L>(ray.origin, ray.direction, &space.tree.bounds, &mut slot.ray[1])?;
            (slot.space, slot.base) = (space, slot.len);
            slot.asked.instance = p + 1;
            Some(space.root)
        }
        Special::Shape(s) => {
            let (shape, primitive) = &slot.space.shapes[s as usize];
            meet_shape(&**shape, *primitive, &ray, Q::ANY, &slot.asked, &mut slot.nearest);
            None
        }
        Special::Moving(m) => {
            slot.space.moving[m as usize].meet(&ray, Q::ANY, &slot.asked, &mut slot.nearest);
            None
        }
    }
}

/// The slot's ray in the space where it is, up to the nearest hit so far.
#[inline(always)]
fn current_ray<L: Lanes>(bvh: &WideBvh, rays: &RayBatch, slot: &Slot<'_, L>) -> ShapeRay {
    let i = slot.i;
    let ray = ShapeRay {
        origin: Vec3::new(rays.ox[i], rays.oy[i], rays.oz[i]),
        direction: Vec3::new(rays.dx[i], rays.dy[i], rays.dz[i]),
        t_max: slot.nearest.t,
        time: rays.time[i],
    };
    match slot.asked.instance {
        0 => ray,
        // It was entered, so the map has an inverse.
        p => bvh.placed[p as usize - 1].object_from_world(ray.time).map_or(ray, |map| ray_in_object(&map, &ray)),
    }
}

/// Back to the world.
#[inline(always)]
fn leave<'a, L: Lanes>(world: &'a Space, slot: &mut Slot<'a, L>) {
    (slot.space, slot.base, slot.asked.instance) = (world, 0, 0);
}
