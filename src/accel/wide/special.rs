//! What is not triangles at rest: placed objects, exact shapes, things that move.

use super::leaf::{Asked, Nearest};
use crate::accel::geometry::{Affine, AtShape, Placement, Shape, ShapeRay};

/// A box of a tree that is no node and no leaf.
#[derive(Clone, Copy, Debug)]
pub enum Special {
    /// A placement of the geometry.
    Placed(u32),
    /// A shape of the space.
    Shape(u32),
    /// Moving triangles of the space.
    Moving(u32),
}

/// An object placed in the world.
#[derive(Clone, Debug)]
pub struct Placed {
    /// Index among the objects.
    pub object: u32,
    /// Of what stands still.
    object_from_world: Affine,
    /// Of what moves: the keys of its placement; else empty.
    keys: Box<[Affine]>,
}

impl Placed {
    /// `placement`, which needs an inverse at time 0 to be met at all.
    pub fn new(placement: &Placement) -> Self {
        let object_from_world = placement.at(0.0).inverse().unwrap_or(Affine::IDENTITY);
        let keys = if placement.moves() { placement.keys.clone().into() } else { Box::default() };
        Self { object: placement.object, object_from_world, keys }
    }

    /// The map of what stands still.
    #[inline(always)]
    pub fn at_rest(&self) -> Option<&Affine> {
        self.keys.is_empty().then_some(&self.object_from_world)
    }

    /// The map at `time`; `None` if it has none then.
    #[inline(always)]
    pub fn object_from_world(&self, time: f32) -> Option<Affine> {
        if self.keys.is_empty() { Some(self.object_from_world) } else { Placement::map_at(&self.keys, time).inverse() }
    }
}

/// Meets an exact shape; `ray` ends at the nearest hit so far.
pub fn meet_shape(
    shape: &dyn Shape,
    primitive: u32,
    ray: &ShapeRay,
    any: bool,
    asked: &Asked<'_>,
    nearest: &mut Nearest,
) {
    let shape = AtShape { shape, primitive, instance: asked.instance, key: asked.key, filter: asked.filter };
    if any {
        if shape.occludes(ray) {
            nearest.primitive = primitive;
        }
        return;
    }
    // At equal t the lower number wins, so the ray must reach the nearest hit itself.
    let beyond = ShapeRay { t_max: ray.t_max.next_up(), ..*ray };
    if let Some(hit) = shape.intersect(&beyond)
        && nearest.yields_to(hit.t, asked.instance, primitive)
    {
        *nearest = Nearest { t: hit.t, u: hit.u, v: hit.v, instance: asked.instance, primitive };
    }
}
