//! Instances: a scene as a geometry of another, at one place or at many.

use std::sync::Arc;

use super::{GeometryHandle, check_count, check_keys};
use crate::error::Error;
use crate::raw::{
    BUFFER_TYPE_TRANSFORM, FORMAT_FLOAT3X4_COLUMN_MAJOR, GEOMETRY_TYPE_INSTANCE, GEOMETRY_TYPE_INSTANCE_ARRAY,
};
use crate::scene::CommittedScene;

/// A matrix `world_from_object`, 3 rows by 4 columns, column by column: where the x, y and z axes go,
/// then where the origin goes.
pub type Affine = [[f32; 3]; 4];

const AFFINE_BYTES: usize = size_of::<Affine>();
/// `u32::MAX` marks "no instance".
const MAX_INSTANCES: usize = u32::MAX as usize - 1;

/// A committed scene placed in another one by a matrix. Hits report the number of this geometry as their
/// `instance`, and geometry and primitive of the object scene.
///
/// A matrix may mirror and scale unevenly; `t` is the same in both spaces, `ng` is in object space.
#[derive(Debug)]
pub struct InstanceGeometry {
    // Before the scene: Embree lets go of it first.
    pub(super) handle: GeometryHandle,
    scene: Arc<CommittedScene>,
}

impl InstanceGeometry {
    /// `scene` placed by `keys`: one matrix, or several for equally spaced times from 0 to 1. Between
    /// keys the matrices' numbers are interpolated, so a turn needs several.
    ///
    /// Errors: no key or more than 129; a matrix that is not finite or cannot be inverted in f32; a
    /// `scene` that itself contains instances, because Embree is usually built for one level and then
    /// misses without a word.
    pub fn new(scene: &Arc<CommittedScene>, keys: &[Affine]) -> Result<Self, Error> {
        check_keys(keys.len())?;
        check_level(scene)?;
        for (key, matrix) in keys.iter().enumerate() {
            check_matrix(matrix, 0, key)?;
        }
        let device = scene.device();
        let handle = GeometryHandle::new(device, GEOMETRY_TYPE_INSTANCE)?;
        handle.set_time_steps(keys.len())?;
        // SAFETY: both handles are valid and of one device; the scene outlives the geometry.
        unsafe { (device.api().set_geometry_instanced_scene)(handle.raw(), scene.handle.raw()) };
        device.check("rtcSetGeometryInstancedScene")?;
        for (step, matrix) in (0..).zip(keys) {
            let data = matrix.as_ptr().cast();
            // SAFETY: the matrix has the twelve numbers that the format says, and Embree copies them.
            unsafe {
                (device.api().set_geometry_transform)(handle.raw(), step, FORMAT_FLOAT3X4_COLUMN_MAJOR, data);
            }
            device.check("rtcSetGeometryTransform")?;
        }
        handle.commit()?;
        Ok(Self { handle, scene: Arc::clone(scene) })
    }

    /// The scene that is placed.
    pub fn scene(&self) -> &Arc<CommittedScene> {
        &self.scene
    }

    /// Lets only rays meet the instance whose mask has a bit in common with `mask`. All bits are set at
    /// first. The masks of the geometries inside count too.
    pub fn set_mask(&mut self, mask: u32) -> Result<(), Error> {
        self.handle.set_mask(mask)
    }
}

/// A committed scene placed at many places of another one: as many [`InstanceGeometry`]s for a fraction of
/// their memory. Hits report the number of this geometry as their `instance` and the place as their
/// `instance_primitive`.
#[derive(Debug)]
pub struct InstanceArrayGeometry {
    // Before the scene and the matrices: Embree lets go of them first.
    pub(super) handle: GeometryHandle,
    scene: Arc<CommittedScene>,
    /// One array per time key, each with one matrix more than there are places, for 16-byte loads of the
    /// last column.
    keys: Box<[Vec<Affine>]>,
}

impl InstanceArrayGeometry {
    /// `scene` placed by each matrix of `keys` (`[k][n]`): one array, or several of the same length for
    /// equally spaced times from 0 to 1.
    ///
    /// The rules of [`InstanceGeometry::new`] hold. A library that was built without instance arrays, or is
    /// older than 4.3, is an error of Embree's.
    pub fn new(scene: &Arc<CommittedScene>, mut keys: Vec<Vec<Affine>>) -> Result<Self, Error> {
        check_keys(keys.len())?;
        check_level(scene)?;
        let count = keys[0].len();
        check_count("instances", count, MAX_INSTANCES)?;
        for (key, matrices) in keys.iter().enumerate() {
            if matrices.len() != count {
                return Err(Error::KeyLength { key, found: matrices.len(), expected: count });
            }
            for (instance, matrix) in matrices.iter().enumerate() {
                check_matrix(matrix, instance, key)?;
            }
        }
        for matrices in &mut keys {
            matrices.reserve_exact(1);
            matrices.push([[0.0; 3]; 4]);
        }
        let device = scene.device();
        let handle = GeometryHandle::new(device, GEOMETRY_TYPE_INSTANCE_ARRAY)?;
        handle.set_time_steps(keys.len())?;
        // SAFETY: both handles are valid and of one device; the scene outlives the geometry.
        unsafe { (device.api().set_geometry_instanced_scene)(handle.raw(), scene.handle.raw()) };
        device.check("rtcSetGeometryInstancedScene")?;
        for (slot, matrices) in (0..).zip(&keys) {
            let data = matrices.as_ptr().cast();
            // SAFETY: the array outlives the handle, is not changed while it lives, has `count` items and
            // 48 readable bytes behind them.
            unsafe {
                (device.api().set_shared_geometry_buffer)(
                    handle.raw(),
                    BUFFER_TYPE_TRANSFORM,
                    slot,
                    FORMAT_FLOAT3X4_COLUMN_MAJOR,
                    data,
                    0,
                    AFFINE_BYTES,
                    count,
                );
            }
            device.check("rtcSetSharedGeometryBuffer (transforms)")?;
        }
        handle.commit()?;
        Ok(Self { handle, scene: Arc::clone(scene), keys: keys.into_boxed_slice() })
    }

    /// The scene that is placed.
    pub fn scene(&self) -> &Arc<CommittedScene> {
        &self.scene
    }

    /// How many places there are.
    pub fn len(&self) -> usize {
        self.keys[0].len() - 1
    }

    /// Whether there is no place.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// As [`InstanceGeometry::set_mask`], for all places.
    pub fn set_mask(&mut self, mask: u32) -> Result<(), Error> {
        self.handle.set_mask(mask)
    }
}

fn check_level(scene: &CommittedScene) -> Result<(), Error> {
    if scene.has_instances() { Err(Error::SecondLevel) } else { Ok(()) }
}

/// Embree inverts the matrix in f32, as adjoint over determinant, and asks nobody whether that can be done.
fn check_matrix(matrix: &Affine, instance: usize, key: usize) -> Result<(), Error> {
    let refuse = |problem| Err(Error::Matrix { matrix: *matrix, instance, key, problem });
    if !matrix.iter().flatten().all(|number| number.is_finite()) {
        return refuse("is not finite");
    }
    let [x, y, z, origin] = matrix.map(|column| column.map(f64::from));
    let adjoint = [cross(y, z), cross(z, x), cross(x, y)];
    let determinant = dot(x, adjoint[0]);
    if determinant == 0.0 {
        return refuse("cannot be inverted: its determinant is 0");
    }
    // Below that Embree's determinant is a subnormal number, which it flushes to 0.
    let is_normal = (f64::from(f32::MIN_POSITIVE)..=f64::from(f32::MAX)).contains(&determinant.abs());
    let fits = |number: f64| number.abs() <= f64::from(f32::MAX);
    let inverse = adjoint.map(|row| row.map(|number| number / determinant));
    let back = inverse.map(|row| dot(row, origin));
    let fits_adjoint = adjoint.iter().flatten().all(|&number| fits(number));
    if !is_normal || !fits_adjoint || !inverse.iter().flatten().chain(&back).all(|&number| fits(number)) {
        return refuse("cannot be inverted within the range of f32; scale the object's vertices instead");
    }
    Ok(())
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

const _: () = assert!(AFFINE_BYTES == 48);

#[cfg(test)]
mod tests {
    use super::*;

    fn scaled(s: f32) -> Affine {
        [[s, 0.0, 0.0], [0.0, s, 0.0], [0.0, 0.0, s], [1.0, 2.0, 3.0]]
    }

    #[test]
    fn mirrored_thin_and_small_matrices_pass() {
        for matrix in [scaled(1.0), scaled(-1.0), scaled(1e-12), scaled(1e12)] {
            assert_eq!(check_matrix(&matrix, 0, 0), Ok(()), "{matrix:?}");
        }
        let thin = [[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1e-20], [0.0; 3]];
        assert_eq!(check_matrix(&thin, 0, 0), Ok(()));
    }

    #[test]
    fn singular_and_infinite_matrices_name_the_instance_and_the_key() {
        let flat = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0; 3]];
        let mut infinite = scaled(1.0);
        infinite[3][1] = f32::INFINITY;
        let mut nan = scaled(1.0);
        nan[1][0] = f32::NAN;
        for matrix in [flat, infinite, nan, scaled(0.0), scaled(1e-14), scaled(1e14)] {
            let error = check_matrix(&matrix, 7, 2).unwrap_err();
            assert!(matches!(error, Error::Matrix { instance: 7, key: 2, .. }), "{matrix:?}");
        }
    }

    #[test]
    fn an_inverse_that_overflows_is_refused() {
        // The determinant is 1e-9, but the origin goes to 1e38 / 1e-9.
        let mut matrix = scaled(1e-3);
        matrix[3] = [1e38, 0.0, 0.0];
        assert!(check_matrix(&matrix, 0, 0).is_err());
    }
}
