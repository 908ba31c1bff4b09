//! What rays hit, decided in f64: which answers a backend may give, and which it must.
//!
//! `ray` carries a ray into a space and bounds what f32 makes of it there, `sight` decides about one triangle, `chain`
//! about several that share edges, `tree` finds them.
//!
//! Why it hides no error. A hit that a backend reports is held against the triangle that it names, without any search, so
//! the tree cannot excuse a phantom. What must be hit is searched for in boxes made larger by the very bound within which
//! triangles count, so the tree loses none that matters; and what any backend reports is looked at too, so a triangle that
//! the tree lost would have to be lost by all backends as well. `tests/verify_hits.rs` compares the search with looking
//! at every triangle. f64 itself is never in doubt: its roundings are 2^-29 of the bounds, and within the bounds both answers
//! are allowed.

mod chain;
mod ray;
mod sight;
mod tree;

pub use ray::ExactRay;

use super::rays::Ray;
use crate::accel::geometry::{Candidate, Geometry, Object, Part, Placement, Primitives, Shape, ShapeRay, segment};
use chain::Link;
use glam::DVec3;
use ray::{EPS, Map};
use sight::Sight;
use tree::{Box3, Tree};

/// Errors of what moves, in shares of the largest coordinate: time to segment, difference, product, sum.
const MOVING: f64 = 8.0 * EPS;

/// A ray that passes so near to more triangles than this, one of them near enough, is not asked more about: seen from 1e5
/// times its size away, all of a mesh is within the error bound.
const MOST_LINKS: usize = 256;

/// Geometry with what finds things in it.
pub struct Oracle<'g> {
    geometry: &'g Geometry,
    /// Of the world, then of each object.
    objects: Vec<Searchable>,
    /// Of the placements.
    places: Tree,
}

/// An object's triangles and shapes in a tree.
struct Searchable {
    tree: Tree,
    items: Vec<Item>,
    /// Largest coordinate of anything that moves.
    moving_extent: f64,
}

#[derive(Clone, Copy)]
enum Item {
    Triangle { part: u32, index: u32 },
    Shape(u32),
}

/// What a ray must hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Must {
    /// Something must be hit no further than here.
    pub t: f64,
    /// It is this, or one of several that share an edge with it: (instance, primitive).
    pub id: (u32, u32),
}

/// A hit as a backend reports it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reported {
    /// 0 for the world, i + 1 for placement i.
    pub instance: u32,
    /// Primitive number.
    pub primitive: u32,
    /// Distance.
    pub t: f32,
    /// First weight.
    pub u: f32,
    /// Second weight.
    pub v: f32,
}

/// What is wrong with a reported hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wrong {
    /// There is no such instance or primitive, the ray does not meet it, the filter lets the ray through, or t is not
    /// between the ray's ends (themselves included: that they are not is a backend's promise, no matter of f64).
    Phantom,
    /// The ray meets it, but between these distances, or elsewhere on it.
    Place([f64; 2]),
}

/// Triangles and shapes that a ray may meet, as they are gathered.
struct Gathered {
    end: f64,
    must: Option<Must>,
    links: Vec<Link>,
    /// Ids of the links.
    ids: Vec<(u32, u32)>,
}

impl<'g> Oracle<'g> {
    /// Makes everything findable.
    pub fn new(geometry: &'g Geometry) -> Self {
        Self::with_boxes(geometry, |bounds| bounds)
    }

    /// One that looks at everything for every ray: what the search must agree with.
    pub fn exhaustive(geometry: &'g Geometry) -> Self {
        Self::with_boxes(geometry, |_| [DVec3::NEG_INFINITY, DVec3::INFINITY])
    }

    fn with_boxes(geometry: &'g Geometry, boxed: fn(Box3) -> Box3) -> Self {
        let all = std::iter::once(&geometry.world).chain(&geometry.objects);
        let objects = all.map(|object| Searchable::new(object, boxed)).collect();
        let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let of = |p: &Placement| {
            let bounds = geometry.objects[p.object as usize].bounds();
            boxed(bounds.map_or(empty, |bounds| p.bounds(bounds).map(|corner| corner.as_dvec3())))
        };
        let places: Vec<Box3> = geometry.placements.iter().map(of).collect();
        Self { geometry, objects, places: Tree::new(&places) }
    }

    /// What `ray` must hit, if anything.
    pub fn must(&self, ray: &Ray) -> Option<Must> {
        let world = exact(ray)?;
        let mut found = Gathered { end: world.t_max, must: None, links: Vec::new(), ids: Vec::new() };
        self.search(0, &world, ray, &mut found);
        // Placed boxes are rounded outwards and hold all their triangles; what passes that close to one that its roundings
        // matter is not certain.
        let hold = |bounds: &Box3| world.widening(bounds[0], bounds[1], 0.0);
        self.places.visit((world.origin, world.direction), hold, found.end, |i| {
            if let Some(local) = self.in_placement(&world, i) {
                self.search(i + 1, &local, ray, &mut found);
            }
            found.end
        });
        found.must
    }

    /// Judges a hit.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn judge(&self, ray: &Ray, hit: &Reported) -> Result<(), Wrong> {
        let Some(world) = exact(ray).filter(|_| hit.t >= 0.0 && hit.t <= ray.t_max) else { return Err(Wrong::Phantom) };
        let Some((object, local)) = self.space(&world, hit.instance) else { return Err(Wrong::Phantom) };
        let t = f64::from(hit.t);
        let place = |range: [f64; 2], is_there: bool| match is_there && range[0] <= t && t <= range[1] {
            true => Ok(()),
            false => Err(Wrong::Place(range)),
        };
        if let Some((part, i)) = locate(object, hit.primitive) {
            let (corners, error) = corners(part, i, &local);
            let Some(sight) = Sight::new(&local, corners, error) else { return Err(Wrong::Phantom) };
            if part.filtered && !self.stops(ray, hit.instance, hit.primitive, [hit.u, hit.v]) {
                return Err(Wrong::Phantom);
            }
            return place(sight.t, sight.has(f64::from(hit.u), f64::from(hit.v)));
        }
        match object.shapes.iter().find(|(_, primitive)| *primitive == hit.primitive) {
            Some((shape, _)) => match shape_range(&**shape, &local) {
                Some((range, _)) => place(range, true),
                None => Err(Wrong::Phantom),
            },
            None => Err(Wrong::Phantom),
        }
    }

    /// The object of an instance and the ray in its space.
    fn space(&self, world: &ExactRay, instance: u32) -> Option<(&'g Object, ExactRay)> {
        if instance == 0 {
            return Some((&self.geometry.world, *world));
        }
        let placement = self.geometry.placements.get(instance as usize - 1)?;
        let local = self.in_placement(world, instance as usize - 1)?;
        Some((&self.geometry.objects[placement.object as usize], local))
    }

    fn in_placement(&self, world: &ExactRay, i: usize) -> Option<ExactRay> {
        match &self.geometry.placements[i].keys[..] {
            [only] => world.into_object(&Map::between(only, only, 0.0), 0.0),
            keys => {
                let (k, s) = at_time(keys.len(), world.time);
                world.into_object(&Map::between(&keys[k], &keys[k + 1], s), MOVING)
            }
        }
    }

    /// Adds what `ray` must hit in one space.
    fn search(&self, instance: usize, local: &ExactRay, ray: &Ray, found: &mut Gathered) {
        let of = if instance == 0 { 0 } else { self.geometry.placements[instance - 1].object as usize + 1 };
        let object = if of == 0 { &self.geometry.world } else { &self.geometry.objects[of - 1] };
        let Searchable { tree, items, moving_extent } = &self.objects[of];
        let widening = |bounds: &Box3| local.widening(bounds[0], bounds[1], MOVING * moving_extent);
        found.links.clear();
        found.ids.clear();
        tree.visit((local.origin, local.direction), widening, found.end, |item| {
            match items[item] {
                Item::Triangle { part, index } => {
                    let (part, index) = (&object.parts[part as usize], index as usize);
                    let id = (instance as u32, part.primitives.get(index));
                    self.add_triangle(part, index, id, local, ray, found);
                }
                Item::Shape(index) => {
                    let (shape, primitive) = &object.shapes[index as usize];
                    if let Some((range, true)) = shape_range(&**shape, local) {
                        found.demand(range, (instance as u32, *primitive), local);
                    }
                }
            }
            found.end
        });
        // Those beyond what must be hit anyway demand nothing.
        let near = |link: &Link| link.sight.t[0] <= found.end;
        let first = found.links.iter().position(near);
        let id = first.map_or((0, 0), |i| found.ids[i]);
        found.links.retain(near);
        if found.links.len() > 1 {
            for range in chain::forced(&found.links) {
                found.demand(range, id, local);
            }
        }
    }

    fn add_triangle(
        &self,
        part: &Part,
        index: usize,
        id: (u32, u32),
        local: &ExactRay,
        ray: &Ray,
        found: &mut Gathered,
    ) {
        let (corners, error) = corners(part, index, local);
        // Backends leave out what has no area.
        if (corners[1] - corners[0]).cross(corners[2] - corners[0]) == DVec3::ZERO {
            return;
        }
        let Some(sight) = Sight::new(local, corners, error) else { return };
        if part.filtered && !self.surely_stops(&sight, ray, id) {
            return;
        }
        if sight.is_certain() {
            found.demand(sight.t, id, local);
        } else if found.links.len() < MOST_LINKS {
            found.links.push(Link { corners, sight });
            found.ids.push(id);
        } else {
            // Nothing more is looked at.
            found.end = -1.0;
        }
    }

    fn stops(&self, ray: &Ray, instance: u32, primitive: u32, [u, v]: [f32; 2]) -> bool {
        let candidate = Candidate { key: ray.key, instance, primitive, u, v };
        self.geometry.filter.as_ref().is_some_and(|filter| filter.stops(&candidate))
    }

    /// Whether the filter stops the ray wherever on the triangle a backend may find it: asked at nine places.
    fn surely_stops(&self, sight: &Sight, ray: &Ray, (instance, primitive): (u32, u32)) -> bool {
        let steps = [-sight.uv_error, 0.0, sight.uv_error];
        steps.iter().all(|du| {
            let u = (sight.uv[0] + du).clamp(0.0, 1.0);
            steps.iter().all(|dv| {
                let v = (sight.uv[1] + dv).clamp(0.0, 1.0 - u);
                self.stops(ray, instance, primitive, [u as f32, v as f32])
            })
        })
    }
}

impl Gathered {
    /// Something must be hit at a distance in `range`, if that is on the ray.
    fn demand(&mut self, range: [f64; 2], id: (u32, u32), ray: &ExactRay) {
        if range[0] > 0.0 && range[1] < ray.t_max && self.must.is_none_or(|must| range[1] < must.t) {
            self.must = Some(Must { t: range[1], id });
            self.end = self.end.min(range[1]);
        }
    }
}

impl Searchable {
    fn new(object: &Object, boxed: fn(Box3) -> Box3) -> Self {
        let (mut boxes, mut items, mut moving_extent) = (Vec::new(), Vec::new(), 0.0);
        for (p, part) in object.parts.iter().enumerate() {
            for i in 0..part.triangles.indices.len() {
                let all = (0..part.keys()).flat_map(|k| part.corners_of_key(k, i)).map(|c| c.as_dvec3());
                let bounds = all.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], c| [l.min(c), h.max(c)]);
                if part.keys() > 1 {
                    let extent = bounds[0].abs().max(bounds[1].abs()).max_element();
                    moving_extent = f64::max(moving_extent, extent);
                }
                boxes.push(boxed(bounds));
                items.push(Item::Triangle { part: p as u32, index: i as u32 });
            }
        }
        for (s, (shape, _)) in object.shapes.iter().enumerate() {
            boxes.push(boxed(shape.bounds().map(|c| glam::Vec3::from(c).as_dvec3())));
            items.push(Item::Shape(s as u32));
        }
        Self { tree: Tree::new(&boxes), items, moving_extent }
    }
}

/// The ray in f64; `None` if it is none (it hits nothing): not finite, no direction or no length.
fn exact(ray: &Ray) -> Option<ExactRay> {
    let finite = ray.origin.is_finite() && ray.direction.is_finite() && ray.t_max > 0.0;
    let is_ray = finite && ray.direction.abs().max_element() >= f32::MIN_POSITIVE;
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    is_ray.then(|| ExactRay::new(o, d, ray.t_max.into(), ray.time.into(), ray.key))
}

/// The triangle of an object with the number `primitive`.
fn locate(object: &Object, primitive: u32) -> Option<(&Part, usize)> {
    object.parts.iter().find_map(|part| {
        let i = match &part.primitives {
            Primitives::From(first) => primitive.checked_sub(*first)? as usize,
            Primitives::Each(numbers) => numbers.binary_search(&primitive).ok()?,
        };
        (i < part.triangles.indices.len()).then_some((part, i))
    })
}

/// [`segment`] in f64.
fn at_time(keys: usize, time: f64) -> (usize, f64) {
    let (k, _) = segment(keys, time as f32);
    (k, time.clamp(0.0, 1.0) * (keys - 1) as f64 - k as f64)
}

/// Corners of triangle `i` when the ray passes, and how far off they may be, metres.
fn corners(part: &Part, i: usize, ray: &ExactRay) -> ([DVec3; 3], f64) {
    let key = |k: usize| part.corners_of_key(k, i).map(|c| c.as_dvec3());
    if part.keys() == 1 {
        return (key(0), 0.0);
    }
    let (k, s) = at_time(part.keys(), ray.time);
    let (before, after) = (key(k), key(k + 1));
    let extent = before.iter().chain(&after).fold(0.0, |most: f64, c| most.max(c.abs().max_element()));
    ([0, 1, 2].map(|c| before[c].lerp(after[c], s)), MOVING * extent)
}

/// Between which distances a ray meets an exact shape, by the shape's own word about the ray and its neighbours, and
/// whether all of them meet it; `None` if none does.
fn shape_range(shape: &dyn Shape, ray: &ExactRay) -> Option<([f64; 2], bool)> {
    let wider = ray.widening(ray.origin, ray.origin, 0.0);
    let [low, high] = shape.bounds().map(|c| glam::Vec3::from(c).as_dvec3());
    let aside = ray.widening(low, high, 0.0).max(wider);
    let ts: Vec<Option<f64>> = (0..9)
        .map(|k| {
            // The ray itself, and moved to the corners of a cube about its origin.
            let side = |bit: usize| if k == 8 { 0.0 } else { aside * if k >> bit & 1 == 0 { -1.0 } else { 1.0 } };
            let origin = (ray.origin + DVec3::new(side(0), side(1), side(2))).as_vec3();
            let direction = ray.direction.as_vec3();
            let local = ShapeRay { origin, direction, t_max: ray.t_max as f32, time: ray.time as f32 };
            shape.intersect(&local).map(|hit| f64::from(hit.t))
        })
        .collect();
    let found = ts.iter().flatten();
    let (low, high) = found.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(*t), h.max(*t)));
    let slack = 64.0 * EPS * high.abs() + aside / ray.direction.length();
    (low <= high).then(|| ([low - slack, high + slack], ts.iter().all(Option::is_some)))
}
