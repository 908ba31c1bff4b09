//! What packets meet that is not triangles at rest: placed objects, into which they go as packets, and, ray by ray, exact
//! shapes and moving triangles.

use super::nearest::{Entry, NearestLanes, intersect};
use super::occluded::{Open, stopped};
use super::{INNER_STACK, MAX_LANES, Walk, Worth};
use crate::accel::MISS;
use crate::accel::geometry::{Affine, ShapeRay};
use crate::accel::linear::ray_in_object;
use crate::accel::wide::leaf::Nearest;
use crate::accel::wide::node::Child;
use crate::accel::wide::ray::RayLanes;
use crate::accel::wide::special::{Placed, Special, meet_shape};
use glam::Vec3;
use simd::{Float, Lanes, Uint};

/// What a tree may hold besides triangles at rest.
pub trait Specials {
    /// Whether there may be anything.
    const SOME: bool;

    /// With what it needs.
    fn new() -> Self;

    /// Updates `nearest` in `lanes` by special `index` of the space of `walk`.
    fn meet<L: Lanes>(
        &mut self,
        walk: &Walk<'_>,
        index: usize,
        t_max: L::F,
        lanes: u32,
        worth: &mut Worth,
        nearest: &mut NearestLanes<L>,
    );

    /// Which rays of `lanes` it stops.
    fn stopped<L: Lanes>(&mut self, walk: &Walk<'_>, index: usize, t_max: L::F, lanes: u32, worth: &mut Worth) -> u32;
}

/// Nothing else: the world's first pass.
pub struct AtRest;

impl Specials for AtRest {
    const SOME: bool = false;

    #[inline(always)]
    fn new() -> Self {
        Self
    }

    #[inline(always)]
    fn meet<L: Lanes>(&mut self, _: &Walk<'_>, _: usize, _: L::F, _: u32, _: &mut Worth, _: &mut NearestLanes<L>) {}

    #[inline(always)]
    fn stopped<L: Lanes>(&mut self, _: &Walk<'_>, _: usize, _: L::F, _: u32, _: &mut Worth) -> u32 {
        0
    }
}

/// Shapes and moving triangles of a placed object.
struct InObject;

impl Specials for InObject {
    const SOME: bool = true;

    #[inline(always)]
    fn new() -> Self {
        Self
    }

    #[inline(always)]
    fn meet<L: Lanes>(
        &mut self,
        walk: &Walk<'_>,
        index: usize,
        _: L::F,
        lanes: u32,
        _: &mut Worth,
        nearest: &mut NearestLanes<L>,
    ) {
        meet_each::<L>(walk, index, lanes, nearest);
    }

    #[inline(always)]
    fn stopped<L: Lanes>(&mut self, walk: &Walk<'_>, index: usize, t_max: L::F, lanes: u32, _: &mut Worth) -> u32 {
        stopped_each::<L>(walk, index, t_max, lanes)
    }
}

/// Everything: the world's second pass.
pub struct Others {
    entries: [Entry; INNER_STACK],
    open: [Open; INNER_STACK],
}

impl Specials for Others {
    const SOME: bool = true;

    /// With stacks for placed objects.
    #[inline(always)]
    fn new() -> Self {
        Self { entries: [Entry::NONE; INNER_STACK], open: [(Child::inner(0), 0); INNER_STACK] }
    }

    #[inline(always)]
    fn meet<L: Lanes>(
        &mut self,
        walk: &Walk<'_>,
        index: usize,
        t_max: L::F,
        lanes: u32,
        worth: &mut Worth,
        nearest: &mut NearestLanes<L>,
    ) {
        let Special::Placed(p) = walk.space.specials[index] else {
            return meet_each::<L>(walk, index, lanes, nearest);
        };
        let (inside, packet, mut open) = enter::<L>(walk, p, t_max, lanes);
        while open != 0 {
            let alike = packet.alike(open);
            open &= !alike;
            intersect::<L, InObject, INNER_STACK>(
                &inside,
                &packet,
                alike,
                &mut InObject,
                &mut self.entries,
                worth,
                nearest,
            );
        }
    }

    #[inline(always)]
    fn stopped<L: Lanes>(&mut self, walk: &Walk<'_>, index: usize, t_max: L::F, lanes: u32, worth: &mut Worth) -> u32 {
        let Special::Placed(p) = walk.space.specials[index] else {
            return stopped_each::<L>(walk, index, t_max, lanes);
        };
        let (inside, packet, mut open) = enter::<L>(walk, p, t_max, lanes);
        let mut found = 0;
        while open != 0 {
            let alike = packet.alike(open);
            open &= !alike;
            found |= stopped::<L, InObject, INNER_STACK>(&inside, &packet, alike, &mut InObject, &mut self.open, worth);
        }
        found
    }
}

/// The packet in the space of placement `p`, and which of `lanes` are rays there.
#[inline(always)]
fn enter<'a, L: Lanes>(walk: &Walk<'a>, p: u32, t_max: L::F, lanes: u32) -> (Walk<'a>, RayLanes<L>, u32) {
    let (bvh, rays, at) = (walk.bvh, walk.rays, walk.at);
    let placed = &bvh.placed[p as usize];
    let space = &bvh.objects[placed.object as usize];
    let o = [L::F::load(&rays.ox, at), L::F::load(&rays.oy, at), L::F::load(&rays.oz, at)];
    let d = [L::F::load(&rays.dx, at), L::F::load(&rays.dy, at), L::F::load(&rays.dz, at)];
    let (o, d, found) = match placed.at_rest() {
        Some(map) => (mapped::<L>(map, o, Some(map.translation)), mapped::<L>(map, d, None), lanes),
        None => each_mapped::<L>(walk, placed, lanes),
    };
    let packet = RayLanes::<L>::of(o, d, t_max, &space.tree.bounds);
    let open = found & packet.valid;
    (Walk { space, instance: p + 1, ..*walk }, packet, open)
}

/// [`Affine::vector`] in lanes and, with a translation, [`Affine::point`]: the same operations.
#[inline(always)]
fn mapped<L: Lanes>(map: &Affine, v: [L::F; 3], translation: Option<Vec3>) -> [L::F; 3] {
    let mut out = v;
    for (axis, out) in out.iter_mut().enumerate() {
        let by = |column: usize| L::F::splat(map.columns[column][axis]);
        *out = v[0] * by(0) + v[1] * by(1) + v[2] * by(2);
        if let Some(translation) = translation {
            *out = *out + L::F::splat(translation[axis]);
        }
    }
    out
}

/// Origins and directions in the space of what moves, each at its time, and the lanes that have one.
#[inline(always)]
fn each_mapped<L: Lanes>(walk: &Walk<'_>, placed: &Placed, lanes: u32) -> ([L::F; 3], [L::F; 3], u32) {
    let mut out = [[0.0; MAX_LANES]; 6];
    let found = map_each(walk, placed, lanes, &mut out);
    let row = |row: usize| L::F::load(&out[row], 0);
    ([row(0), row(1), row(2)], [row(3), row(4), row(5)], found)
}

#[inline(never)]
fn map_each(walk: &Walk<'_>, placed: &Placed, lanes: u32, out: &mut [[f32; MAX_LANES]; 6]) -> u32 {
    let mut found = 0;
    for i in (0..MAX_LANES).filter(|i| lanes >> i & 1 == 1) {
        let ray = world_ray(walk, i, f32::INFINITY);
        let Some(map) = placed.object_from_world(ray.time) else { continue };
        let ray = ray_in_object(&map, &ray);
        for axis in 0..3 {
            (out[axis][i], out[3 + axis][i]) = (ray.origin[axis], ray.direction[axis]);
        }
        found |= 1 << i;
    }
    found
}

/// Ray of lane `i` in the world, ending at `t_max`.
fn world_ray(walk: &Walk<'_>, i: usize, t_max: f32) -> ShapeRay {
    let (rays, i) = (walk.rays, walk.at + i);
    ShapeRay {
        origin: Vec3::new(rays.ox[i], rays.oy[i], rays.oz[i]),
        direction: Vec3::new(rays.dx[i], rays.dy[i], rays.dz[i]),
        t_max,
        time: rays.time[i],
    }
}

/// Lets every lane meet a shape or moving triangles.
#[inline(always)]
fn meet_each<L: Lanes>(walk: &Walk<'_>, index: usize, lanes: u32, nearest: &mut NearestLanes<L>) {
    let mut tuv = [[0.0; MAX_LANES]; 3];
    let mut ids = [[0; MAX_LANES]; 2];
    nearest.t.store(&mut tuv[0], 0);
    nearest.u.store(&mut tuv[1], 0);
    nearest.v.store(&mut tuv[2], 0);
    nearest.primitive.store(&mut ids[0], 0);
    nearest.instance.store(&mut ids[1], 0);
    meet_one_by_one(walk, index, lanes, false, &mut tuv, &mut ids);
    *nearest = NearestLanes {
        t: L::F::load(&tuv[0], 0),
        u: L::F::load(&tuv[1], 0),
        v: L::F::load(&tuv[2], 0),
        primitive: L::U::load(&ids[0], 0),
        instance: L::U::load(&ids[1], 0),
    };
}

/// Which lanes a shape or moving triangles stop.
#[inline(always)]
fn stopped_each<L: Lanes>(walk: &Walk<'_>, index: usize, t_max: L::F, lanes: u32) -> u32 {
    let mut tuv = [[0.0; MAX_LANES]; 3];
    let mut ids = [[MISS; MAX_LANES]; 2];
    t_max.store(&mut tuv[0], 0);
    meet_one_by_one(walk, index, lanes, true, &mut tuv, &mut ids);
    (0..MAX_LANES).filter(|&i| ids[0][i] != MISS).fold(0, |found, i| found | 1 << i)
}

/// Hits (t, u, v; primitive, instance) of `lanes` with special `index`, a shape or moving triangles.
#[cold]
#[inline(never)]
fn meet_one_by_one(
    walk: &Walk<'_>,
    index: usize,
    lanes: u32,
    any: bool,
    tuv: &mut [[f32; MAX_LANES]; 3],
    ids: &mut [[u32; MAX_LANES]; 2],
) {
    let bvh = walk.bvh;
    for i in (0..MAX_LANES).filter(|i| lanes >> i & 1 == 1) {
        let [t, u, v] = [0, 1, 2].map(|row| tuv[row][i]);
        let mut nearest = Nearest { t, u, v, instance: ids[1][i], primitive: ids[0][i] };
        let mut ray = world_ray(walk, i, t);
        if walk.instance > 0 {
            // It was entered, so the map has an inverse.
            let Some(map) = bvh.placed[walk.instance as usize - 1].object_from_world(ray.time) else { continue };
            ray = ray_in_object(&map, &ray);
        }
        let asked = walk.asked(i);
        match walk.space.specials[index] {
            Special::Shape(s) => {
                let (shape, primitive) = &walk.space.shapes[s as usize];
                meet_shape(&**shape, *primitive, &ray, any, &asked, &mut nearest);
            }
            Special::Moving(m) => walk.space.moving[m as usize].meet(&ray, any, &asked, &mut nearest),
            Special::Placed(_) => {}
        }
        (tuv[0][i], tuv[1][i], tuv[2][i]) = (nearest.t, nearest.u, nearest.v);
        (ids[0][i], ids[1][i]) = (nearest.primitive, nearest.instance);
    }
}
