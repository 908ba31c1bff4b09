//! The triangles at rest of one object, numbered through, as the builder sees them.

use super::node::FILTERED;
use crate::accel::geometry::Part;
use glam::Vec3;

/// Triangles of several parts, one after the other.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    parts: &'a [Part],
}

impl<'a> Source<'a> {
    /// All triangles of `parts`, of which none may move.
    pub fn new(parts: &'a [Part]) -> Self {
        debug_assert!(parts.iter().all(|part| part.later.is_empty()));
        Self { parts }
    }

    /// Triangles.
    pub fn len(&self) -> usize {
        self.parts.iter().map(|part| part.triangles.indices.len()).sum()
    }

    /// The corners of triangle `i`.
    #[inline(always)]
    pub fn corners(&self, i: usize) -> [Vec3; 3] {
        let (part, i) = self.find(i);
        part.triangles.corners(i)
    }

    /// The primitive number of triangle `i`, with [`FILTERED`] if hits on it are to be asked about.
    #[inline(always)]
    pub fn word(&self, i: usize) -> u32 {
        let (part, i) = self.find(i);
        part.primitives.get(i) | if part.filtered { FILTERED } else { 0 }
    }

    #[inline(always)]
    fn find(&self, mut i: usize) -> (&'a Part, usize) {
        // A scene has few parts.
        for part in self.parts {
            let n = part.triangles.indices.len();
            if i < n {
                return (part, i);
            }
            i -= n;
        }
        unreachable!("no triangle of this number")
    }
}
