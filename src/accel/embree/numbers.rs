//! Embree numbers geometries in their scene and primitives in their geometry, from 0; here these become ours.

use super::super::geometry::{Placement, Primitives};
use std::sync::Arc;

/// What Embree's numbers mean.
pub(super) struct Numbers {
    /// Of each geometry of the world, in the order in which they were attached.
    pub(super) world: Vec<Arc<Primitives>>,
    /// Of each geometry of each object.
    pub(super) objects: Vec<Vec<Arc<Primitives>>>,
    /// The geometries behind those of the world.
    pub(super) groups: Arc<Groups>,
}

/// Placements as Embree has them: each group is a geometry of the world.
pub(super) struct Groups {
    /// The geometry that is the first group.
    first: u32,
    pub(super) all: Vec<Group>,
}

/// Placements of one object with as many keys each.
pub(super) struct Group {
    pub(super) object: usize,
    pub(super) keys: usize,
    /// Which, ascending.
    pub(super) placements: Vec<u32>,
}

impl Groups {
    /// Of those of `placements` that are usable, in a world of `first` geometries. Where Embree knows no `arrays`, each is
    /// a group of its own.
    pub(super) fn new(placements: &[Placement], first: u32, arrays: bool) -> Self {
        let mut order: Vec<u32> = (0..placements.len() as u32).collect();
        order.retain(|&i| placements[i as usize].is_usable());
        let kind = |&i: &u32| (placements[i as usize].object, placements[i as usize].keys.len());
        // Stable: ascending in each group.
        order.sort_by_key(kind);
        let group = |of: &[u32]| {
            let (object, keys) = kind(&of[0]);
            Group { object: object as usize, keys, placements: of.to_vec() }
        };
        let all = order.chunk_by(|a, b| arrays && kind(a) == kind(b)).map(group).collect();
        Self { first, all }
    }

    /// Our instance number for a geometry of the world and a place in it; `u32::MAX` is the world itself.
    #[inline(always)]
    pub(super) fn instance(&self, geometry: u32, place: u32) -> u32 {
        if geometry == u32::MAX {
            return 0;
        }
        // A group that is no array has no places.
        let place = if place == u32::MAX { 0 } else { place as usize };
        self.all[(geometry - self.first) as usize].placements[place] + 1
    }
}

impl Numbers {
    /// Whether Embree's numbers are ours already.
    pub(super) fn are_the_same(&self) -> bool {
        self.groups.all.is_empty() && matches!(&self.world[..], [only] if matches!(**only, Primitives::From(0)))
    }

    /// Our instance and primitive for a hit on `primitive` of `geometry`, of the world or of an instance.
    #[inline(always)]
    pub(super) fn of(&self, instance: u32, place: u32, geometry: u32, primitive: u32) -> (u32, u32) {
        let number = self.groups.instance(instance, place);
        let geometries = match instance {
            u32::MAX => &self.world,
            group => &self.objects[self.groups.all[(group - self.groups.first) as usize].object],
        };
        (number, geometries[geometry as usize].get(primitive as usize))
    }
}
