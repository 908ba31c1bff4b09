//! Brute force as an [`super::Accel`]: the oracle of the tests, and nothing else.

use super::geometry::{Affine, AtShape, Candidate, Geometry, Object, Part, Placement, ShapeRay};
use super::woop::{ShearedRay, can_be_hit};
use super::{Accel, AccelStats, HitBatch, MISS, RayBatch};
use glam::Vec3;
use std::ops::{ControlFlow, Range};

/// Every triangle and shape of every placement, tested one after the other.
#[derive(Clone)]
pub struct Linear {
    geometry: Geometry,
    /// Of each placement.
    usable: Vec<bool>,
}

/// A crossing with t in (0, t_max) that the filter lets count.
#[derive(Clone, Copy)]
struct Found {
    t: f32,
    u: f32,
    v: f32,
    instance: u32,
    primitive: u32,
}

impl Linear {
    /// Nothing is built.
    pub fn new(geometry: impl Into<Geometry>) -> Self {
        let geometry = geometry.into();
        let usable = geometry.placements.iter().map(Placement::is_usable).collect();
        Self { geometry, usable }
    }

    /// What is tested.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Tells `each` of the crossings of ray `i`, in the order of instances.
    fn crossings(&self, rays: &RayBatch, i: usize, mut each: impl FnMut(Found) -> ControlFlow<()>) -> ControlFlow<()> {
        let geometry = &self.geometry;
        let origin = Vec3::new(rays.ox[i], rays.oy[i], rays.oz[i]);
        let direction = Vec3::new(rays.dx[i], rays.dy[i], rays.dz[i]);
        let ray = ShapeRay { origin, direction, t_max: rays.t_max[i], time: rays.time[i] };
        // A ray that is none hits nothing, wherever it were carried.
        if ShearedRay::new(origin, direction).is_none() {
            return ControlFlow::Continue(());
        }
        self.in_object(&geometry.world, 0, &ray, rays.key[i], &mut each)?;
        for ((placement, instance), _) in
            geometry.placements.iter().zip(1..).zip(&self.usable).filter(|(_, usable)| **usable)
        {
            let Some(object_from_world) = placement.at(ray.time).inverse() else { continue };
            let ray = ray_in_object(&object_from_world, &ray);
            self.in_object(&geometry.objects[placement.object as usize], instance, &ray, rays.key[i], &mut each)?;
        }
        ControlFlow::Continue(())
    }

    fn in_object(
        &self,
        object: &Object,
        instance: u32,
        ray: &ShapeRay,
        key: u32,
        each: &mut impl FnMut(Found) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Some(sheared) = ShearedRay::new(ray.origin, ray.direction) else { return ControlFlow::Continue(()) };
        for part in &object.parts {
            for i in 0..part.triangles.indices.len() {
                let corners = part.corners_at(i, ray.time);
                let Some(c) = sheared.cross(corners) else { continue };
                if !(c.t > 0.0 && c.t < ray.t_max && counts(part, i)) {
                    continue;
                }
                let primitive = part.primitives.get(i);
                let candidate = Candidate { key, instance, primitive, u: c.u, v: c.v };
                if part.filtered && !self.geometry.filter.as_ref().is_some_and(|f| f.stops(&candidate)) {
                    continue;
                }
                each(Found { t: c.t, u: c.u, v: c.v, instance, primitive })?;
            }
        }
        for (shape, primitive) in &object.shapes {
            let filter = self.geometry.filter.as_deref();
            let at = AtShape { shape: &**shape, primitive: *primitive, instance, key, filter };
            if let Some(hit) = at.intersect(ray) {
                each(Found { t: hit.t, u: hit.u, v: hit.v, instance, primitive: *primitive })?;
            }
        }
        ControlFlow::Continue(())
    }
}

/// Whether triangle `i` can be hit: at rest it needs an area; one that moves needs one at some key.
fn counts(part: &Part, i: usize) -> bool {
    (0..part.keys()).any(|k| can_be_hit(part.corners_of_key(k, i)))
}

/// `ray` in the space of an object; t stays what it is.
#[inline(always)]
pub(super) fn ray_in_object(object_from_world: &Affine, ray: &ShapeRay) -> ShapeRay {
    ShapeRay { origin: object_from_world.point(ray.origin), direction: object_from_world.vector(ray.direction), ..*ray }
}

impl Accel for Linear {
    fn intersect(&self, rays: &RayBatch, range: Range<usize>, _coherent: bool, hits: &mut HitBatch) {
        for i in range {
            let mut best = Found { t: rays.t_max[i], u: 0.0, v: 0.0, instance: 0, primitive: MISS };
            let _ = self.crossings(rays, i, |found| {
                let id = |f: &Found| (f.instance, f.primitive);
                let wins_tie = found.t == best.t && best.primitive != MISS && id(&found) < id(&best);
                if found.t < best.t || wins_tie {
                    best = found;
                }
                ControlFlow::Continue(())
            });
            (hits.t[i], hits.u[i], hits.v[i]) = (best.t, best.u, best.v);
            (hits.primitive[i], hits.instance[i]) = (best.primitive, best.instance);
        }
    }

    fn occluded(&self, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
        for (i, out) in occluded[..n].iter_mut().enumerate() {
            *out = u8::from(self.crossings(rays, i, |_| ControlFlow::Break(())).is_break());
        }
    }

    fn stats(&self) -> AccelStats {
        let part = |p: &Part| {
            let later: usize = p.later.iter().map(|positions| size_of_val(&**positions)).sum();
            size_of_val(&*p.triangles.positions) + later + size_of_val(&*p.triangles.indices)
        };
        let object = |o: &Object| o.parts.iter().map(part).sum::<usize>();
        let bytes = object(&self.geometry.world) + self.geometry.objects.iter().map(object).sum::<usize>();
        AccelStats { name: "linear", isa: "scalar".into(), bytes, ..AccelStats::default() }
    }
}
