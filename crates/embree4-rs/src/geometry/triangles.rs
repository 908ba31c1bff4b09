//! Triangle meshes, static or moving, that Embree reads in place.

use std::sync::Arc;

use super::{GeometryHandle, check_count, check_keys};
use crate::device::Device;
use crate::error::Error;
use crate::filter::{Filter, FilterData, ask_filter};
use crate::raw::{
    BUFFER_TYPE_INDEX, BUFFER_TYPE_VERTEX, FORMAT_FLOAT3, FORMAT_UINT3, GEOMETRY_TYPE_TRIANGLE, INVALID_ID,
};

const VERTEX_BYTES: usize = size_of::<[f32; 3]>();
const TRIANGLE_BYTES: usize = size_of::<[u32; 3]>();

/// Embree multiplies indices by the stride ahead of time and so takes at most 16 GiB of vertices.
const MAX_VERTICES: usize = (16 << 30) / VERTEX_BYTES - 1;
/// `u32::MAX` marks a miss.
const MAX_TRIANGLES: usize = u32::MAX as usize - 1;

/// A triangle mesh that Embree reads in place.
pub struct TriangleGeometry {
    // Before what Embree has pointers to: it lets go of them first.
    pub(super) handle: GeometryHandle,
    arrays: Box<Arrays>,
    /// An `Arc` because a `Box` may not move while Embree has its address.
    filter: Option<Arc<FilterData>>,
}

/// What Embree reads. Behind a pointer so that a geometry stays small: scenes hold many.
#[derive(Debug)]
struct Arrays {
    /// One array per time key, each with one more than there are vertices, so that 16-byte loads of
    /// the last one stay inside.
    keys: Vec<Vec<[f32; 3]>>,
    indices: Vec<[u32; 3]>,
}

impl TriangleGeometry {
    /// A mesh of vertex `positions` (`[n][3]` f32, any unit) and triangles `indices` (`[m][3]`,
    /// each below `n`). The arrays are moved, not copied, if `positions` has room for one more.
    ///
    /// Triangles with a coordinate that is NaN, infinite or beyond 1.844e18 are never hit. An index out
    /// of range is an error.
    pub fn new(device: &Arc<Device>, positions: Vec<[f32; 3]>, indices: Vec<[u32; 3]>) -> Result<Self, Error> {
        Self::moving(device, vec![positions], indices)
    }

    /// A mesh whose vertices move: `keys` (`[k][n][3]` f32) are positions at equally spaced times from 0
    /// to 1, with straight lines between. One key is a mesh at rest, traced at full speed. Costs memory and,
    /// for rays in this geometry, about half of the speed.
    ///
    /// The rules of [`TriangleGeometry::new`] hold; a triangle with a bad coordinate in any key is
    /// never hit. No key, more than 129, or keys of different lengths are an error.
    pub fn moving(device: &Arc<Device>, mut keys: Vec<Vec<[f32; 3]>>, indices: Vec<[u32; 3]>) -> Result<Self, Error> {
        check_keys(keys.len())?;
        let vertices = keys[0].len();
        if let Some((key, positions)) = keys.iter().enumerate().find(|(_, positions)| positions.len() != vertices) {
            return Err(Error::KeyLength { key, found: positions.len(), expected: vertices });
        }
        check_count("vertices", vertices, MAX_VERTICES)?;
        check_count("triangles", indices.len(), MAX_TRIANGLES)?;
        check_indices(&indices, vertices)?;
        for positions in &mut keys {
            positions.reserve_exact(1);
            positions.push([0.0; 3]);
        }

        let handle = GeometryHandle::new(device, GEOMETRY_TYPE_TRIANGLE)?;
        handle.set_time_steps(keys.len())?;
        let set_buffer = device.api().set_shared_geometry_buffer;
        for (slot, positions) in (0..).zip(&keys) {
            let data = positions.as_ptr().cast();
            // SAFETY: the array outlives the handle, is not changed while it lives, has `vertices` items
            // and 12 readable bytes behind them.
            unsafe {
                set_buffer(handle.raw(), BUFFER_TYPE_VERTEX, slot, FORMAT_FLOAT3, data, 0, VERTEX_BYTES, vertices);
            }
            device.check("rtcSetSharedGeometryBuffer (vertices)")?;
        }
        let (data, count) = (indices.as_ptr().cast(), indices.len());
        // SAFETY: the array outlives the handle, is not changed while it lives, and has `count` items.
        unsafe { set_buffer(handle.raw(), BUFFER_TYPE_INDEX, 0, FORMAT_UINT3, data, 0, TRIANGLE_BYTES, count) };
        device.check("rtcSetSharedGeometryBuffer (indices)")?;
        handle.commit()?;
        Ok(Self { handle, arrays: Box::new(Arrays { keys, indices }), filter: None })
    }

    /// The vertex positions, of a moving mesh those of its first key.
    pub fn positions(&self) -> &[[f32; 3]] {
        self.key(0).unwrap_or_default()
    }

    /// The vertex positions of time key `key`; `None` where there are fewer.
    pub fn key(&self, key: usize) -> Option<&[[f32; 3]]> {
        let positions = self.arrays.keys.get(key)?;
        Some(&positions[..positions.len() - 1])
    }

    /// How many time keys there are; 1 for a mesh at rest.
    pub fn time_steps(&self) -> usize {
        self.arrays.keys.len()
    }

    /// The triangles.
    pub fn indices(&self) -> &[[u32; 3]] {
        &self.arrays.indices
    }

    /// Lets only rays meet the mesh whose mask has a bit in common with `mask`. All bits are set at first.
    pub fn set_mask(&mut self, mask: u32) -> Result<(), Error> {
        self.handle.set_mask(mask)
    }

    /// Lets only those hits of this mesh count that `filter` accepts. A filter that accepts everything costs
    /// some 5 to 10 % of the speed in this mesh, and nothing in others.
    pub fn set_filter(&mut self, filter: Arc<dyn Filter>) -> Result<(), Error> {
        let device = &self.handle.device;
        let data = Arc::new(FilterData { filter, layout: device.library().hit_layout() });
        let user = Arc::as_ptr(&data).cast_mut().cast();
        device.clear_error();
        // SAFETY: the handle is valid and in no scene yet, so nothing calls back now; the functions take what
        // the user pointer points to, which the mesh keeps until Embree has let go of the geometry.
        unsafe {
            (device.api().set_geometry_user_data)(self.handle.raw(), user);
            (device.api().set_geometry_intersect_filter_function)(self.handle.raw(), Some(ask_filter));
            (device.api().set_geometry_occluded_filter_function)(self.handle.raw(), Some(ask_filter));
        }
        self.filter = Some(data);
        device.check("rtcSetGeometryIntersectFilterFunction")?;
        self.handle.commit()
    }

    /// Whether the mesh has a filter.
    pub fn has_filter(&self) -> bool {
        self.filter.is_some()
    }
}

impl std::fmt::Debug for TriangleGeometry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TriangleGeometry")
            .field("handle", &self.handle)
            .field("vertices", &self.positions().len())
            .field("triangles", &self.indices().len())
            .field("time_steps", &self.time_steps())
            .field("has_filter", &self.has_filter())
            .finish_non_exhaustive()
    }
}

/// Embree does not look at indices, so one out of range would read outside of the vertex array.
fn check_indices(indices: &[[u32; 3]], vertices: usize) -> Result<(), Error> {
    for (triangle, corners) in indices.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&index| index as usize >= vertices) {
            return Err(Error::IndexOutOfRange { triangle, index, vertices });
        }
    }
    Ok(())
}

const _: () = {
    assert!(VERTEX_BYTES == 12 && TRIANGLE_BYTES == 12);
    assert!(MAX_TRIANGLES < INVALID_ID as usize);
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_index_out_of_range_is_named() {
        let triangles = [[0, 1, 2], [2, 1, 3]];
        assert_eq!(check_indices(&triangles, 4), Ok(()));
        let expected = Error::IndexOutOfRange { triangle: 1, index: 3, vertices: 3 };
        assert_eq!(check_indices(&triangles, 3), Err(expected));
        assert!(check_indices(&[[0; 3]], 0).is_err());
    }
}
