//! Geometries: triangle meshes now; an instance or user geometry would be one more variant of
//! [`Geometry`] that owns, like the mesh does, whatever Embree keeps pointers to.

use std::ptr::NonNull;
use std::sync::Arc;

use crate::device::Device;
use crate::error::Error;
use crate::raw::{
    BUFFER_TYPE_INDEX, BUFFER_TYPE_VERTEX, FORMAT_FLOAT3, FORMAT_UINT3, GEOMETRY_TYPE_TRIANGLE, INVALID_ID, RtcGeometry,
};

const VERTEX_BYTES: usize = size_of::<[f32; 3]>();
const TRIANGLE_BYTES: usize = size_of::<[u32; 3]>();

/// Embree multiplies indices by the stride ahead of time and so takes at most 16 GiB of vertices.
const MAX_VERTICES: usize = (16 << 30) / VERTEX_BYTES - 1;
/// `u32::MAX` marks a miss.
const MAX_TRIANGLES: usize = u32::MAX as usize - 1;

/// The number of a geometry in its scene, as hits report it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GeometryId(pub u32);

/// What can be attached to a scene.
#[derive(Debug)]
#[non_exhaustive]
pub enum Geometry {
    /// A triangle mesh.
    Triangles(TriangleGeometry),
}

impl Geometry {
    pub(crate) fn handle(&self) -> &GeometryHandle {
        match self {
            Self::Triangles(mesh) => &mesh.handle,
        }
    }
}

impl From<TriangleGeometry> for Geometry {
    fn from(mesh: TriangleGeometry) -> Self {
        Self::Triangles(mesh)
    }
}

/// A triangle mesh that Embree reads in place.
#[derive(Debug)]
pub struct TriangleGeometry {
    // Before the arrays: Embree lets go of them first.
    handle: GeometryHandle,
    /// One more than there are vertices, so that 16-byte loads of the last one stay inside.
    positions: Vec<[f32; 3]>,
    indices: Vec<[u32; 3]>,
}

impl TriangleGeometry {
    /// A mesh of vertex `positions` (`[n][3]` f32, any unit) and triangles `indices` (`[m][3]`,
    /// each below `n`). The arrays are moved, not copied, if `positions` has room for one more.
    ///
    /// Triangles with a coordinate that is NaN, infinite or beyond 1.844e18 are never hit. An index out
    /// of range is an error.
    pub fn new(device: &Arc<Device>, mut positions: Vec<[f32; 3]>, indices: Vec<[u32; 3]>) -> Result<Self, Error> {
        let vertices = positions.len();
        check_count("vertices", vertices, MAX_VERTICES)?;
        check_count("triangles", indices.len(), MAX_TRIANGLES)?;
        check_indices(&indices, vertices)?;
        positions.reserve_exact(1);
        positions.push([0.0; 3]);

        let handle = GeometryHandle::new(device)?;
        let (api, raw) = (device.api(), handle.raw.as_ptr());
        // SAFETY: both arrays outlive the handle, are not changed while it lives, have the stated
        // number of items, and the vertices are followed by 12 readable bytes.
        unsafe {
            (api.set_shared_geometry_buffer)(
                raw,
                BUFFER_TYPE_VERTEX,
                0,
                FORMAT_FLOAT3,
                positions.as_ptr().cast(),
                0,
                VERTEX_BYTES,
                vertices,
            );
            device.check("rtcSetSharedGeometryBuffer (vertices)")?;
            (api.set_shared_geometry_buffer)(
                raw,
                BUFFER_TYPE_INDEX,
                0,
                FORMAT_UINT3,
                indices.as_ptr().cast(),
                0,
                TRIANGLE_BYTES,
                indices.len(),
            );
            device.check("rtcSetSharedGeometryBuffer (indices)")?;
            (api.commit_geometry)(raw);
        }
        device.check("rtcCommitGeometry")?;
        Ok(Self { handle, positions, indices })
    }

    /// The vertex positions.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions[..self.positions.len() - 1]
    }

    /// The triangles.
    pub fn indices(&self) -> &[[u32; 3]] {
        &self.indices
    }
}

fn check_count(what: &'static str, count: usize, limit: usize) -> Result<(), Error> {
    if count > limit { Err(Error::TooMany { what, count, limit }) } else { Ok(()) }
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

/// An owned `RTCGeometry` and the device that it was made on.
pub(crate) struct GeometryHandle {
    pub(crate) raw: NonNull<RtcGeometry>,
    pub(crate) device: Arc<Device>,
}

// SAFETY: the handle may be used from any thread, and nothing uses it through a shared reference
// but `Scene::attach`, which owns the geometry.
unsafe impl Send for GeometryHandle {}
// SAFETY: as above.
unsafe impl Sync for GeometryHandle {}

impl GeometryHandle {
    fn new(device: &Arc<Device>) -> Result<Self, Error> {
        device.clear_error();
        let lock = device.lock();
        // SAFETY: the device handle is valid, and the lock keeps other threads away from it.
        let raw = unsafe { (device.api().new_geometry)(device.handle(), GEOMETRY_TYPE_TRIANGLE) };
        drop(lock);
        let raw = device.check_handle(raw, "rtcNewGeometry")?;
        Ok(Self { raw, device: Arc::clone(device) })
    }
}

impl Drop for GeometryHandle {
    fn drop(&mut self) {
        // SAFETY: this struct owns one reference to the handle.
        unsafe { (self.device.api().release_geometry)(self.raw.as_ptr()) }
    }
}

impl std::fmt::Debug for GeometryHandle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("GeometryHandle").field(&self.raw).finish()
    }
}

const _: () = {
    assert!(VERTEX_BYTES == 12 && TRIANGLE_BYTES == 12);
    assert!(MAX_TRIANGLES < INVALID_ID as usize);
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_many_items_are_an_error_that_names_the_limit() {
        assert_eq!(check_count("vertices", 3, 3), Ok(()));
        let error = check_count("vertices", 4, 3).unwrap_err();
        assert_eq!(error.to_string(), "4 vertices in one mesh, at most 3 are possible; split the mesh");
    }

    #[test]
    fn the_first_index_out_of_range_is_named() {
        let triangles = [[0, 1, 2], [2, 1, 3]];
        assert_eq!(check_indices(&triangles, 4), Ok(()));
        let expected = Error::IndexOutOfRange { triangle: 1, index: 3, vertices: 3 };
        assert_eq!(check_indices(&triangles, 3), Err(expected));
        assert!(check_indices(&[[0; 3]], 0).is_err());
    }
}
