//! Embree as an [`Accel`]: 16-wide packets, COHERENT for camera rays only (elsewhere it halves the speed), ROBUST so
//! that closed meshes do not leak. (0 of 200,000 rays aimed at random and at edges; of those aimed exactly at a vertex
//! 0.19 % pass between its triangles, in Embree 4.4.0. `bvh` loses none.)

mod build;
mod numbers;

use super::geometry::Geometry;
use super::{Accel, AccelStats, HitBatch, MISS, RayBatch};
use crate::error::RenderError;
use build::Built;
use embree4_rs::{Device, HitsSoAMut, Library, Ray, RaysSoA};
use std::cell::RefCell;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// Committed Embree scenes: of the world, and of each object that is placed in it.
#[derive(Clone)]
pub struct EmbreeAccel {
    built: Arc<Built>,
    /// Whether every ray is a call of its own in place of packets.
    single: bool,
}

/// The library that [`EmbreeAccel::build`] uses: `EMBREE_DIR`, `folders`, then the system's.
///
/// # Errors
/// There is none; the text says what was tried.
pub fn find(folders: &[PathBuf]) -> Result<Arc<Library>, RenderError> {
    Library::find(folders).map_err(|e| RenderError::AccelUnavailable(e.to_string()))
}

impl EmbreeAccel {
    /// Finds libembree4 (`EMBREE_DIR`, `folders`, then the system's) and builds.
    ///
    /// # Errors
    /// No usable library (the text says what was tried), or Embree's own error.
    pub fn build(geometry: impl Into<Geometry>, folders: &[PathBuf]) -> Result<Self, RenderError> {
        Self::build_with(geometry, &find(folders)?)
    }

    /// Builds with the library that [`find`] found.
    ///
    /// # Errors
    /// Embree's own.
    pub fn build_with(geometry: impl Into<Geometry>, library: &Arc<Library>) -> Result<Self, RenderError> {
        match build::build(geometry.into(), library) {
            Ok(built) => Ok(Self { built: Arc::new(built), single: false }),
            Err(e) => Err(RenderError::AccelUnavailable(format!("Embree: {e}"))),
        }
    }

    /// The same scene asked ray by ray: for measurements, since scattered rays may be faster so.
    pub fn in_single_rays(&self) -> Self {
        Self { single: true, ..self.clone() }
    }

    /// Rays in a packet: 8 or 16.
    pub fn packet_width(&self) -> usize {
        self.built.scene.device().native_width().max(8)
    }

    /// Nearest hits ray by ray.
    fn intersect_single(&self, rays: &RayBatch, range: Range<usize>, hits: &mut HitBatch) {
        let Built { scene, numbers, .. } = &*self.built;
        for i in range {
            let Some(hit) = scene.intersect1(&ray(rays, i)) else {
                (hits.t[i], hits.u[i], hits.v[i], hits.primitive[i]) = (rays.t_max[i], 0.0, 0.0, MISS);
                continue;
            };
            (hits.t[i], hits.u[i], hits.v[i]) = (hit.t, hit.u, hit.v);
            (hits.instance[i], hits.primitive[i]) =
                numbers.of(hit.instance, hit.instance_primitive, hit.geometry, hit.primitive);
        }
    }

    fn rays<'a>(&self, rays: &'a RayBatch, range: Range<usize>) -> RaysSoA<'a> {
        RaysSoA {
            ox: &rays.ox[range.clone()],
            oy: &rays.oy[range.clone()],
            oz: &rays.oz[range.clone()],
            dx: &rays.dx[range.clone()],
            dy: &rays.dy[range.clone()],
            dz: &rays.dz[range.clone()],
            t_max: &rays.t_max[range.clone()],
            time: self.built.moves.then(|| &rays.time[range.clone()]),
            id: self.built.is_filtered.then(|| &rays.key[range]),
            mask: None,
            is_open: true,
        }
    }
}

fn ray(rays: &RayBatch, i: usize) -> Ray {
    let origin = [rays.ox[i], rays.oy[i], rays.oz[i]];
    let direction = [rays.dx[i], rays.dy[i], rays.dz[i]];
    // Embree counts hits at the ends.
    let (t_min, t_max) = (f32::MIN_POSITIVE, rays.t_max[i].next_down());
    Ray { t_min, t_max, time: rays.time[i], id: rays.key[i], ..Ray::new(origin, direction) }
}

/// Where Embree says which instance was hit.
#[derive(Default)]
struct Places {
    geometry: Vec<u32>,
    instance: Vec<u32>,
    place: Vec<u32>,
}

thread_local! {
    /// One a thread, as large as the largest batch so far.
    static PLACES: RefCell<Places> = RefCell::default();
}

impl Accel for EmbreeAccel {
    fn intersect(&self, rays: &RayBatch, range: Range<usize>, coherent: bool, hits: &mut HitBatch) {
        if self.single {
            return self.intersect_single(rays, range, hits);
        }
        let Built { scene, numbers, .. } = &*self.built;
        let slices = self.rays(rays, range.clone());
        if numbers.are_the_same() {
            let into = HitsSoAMut {
                t: &mut hits.t[range.clone()],
                u: &mut hits.u[range.clone()],
                v: &mut hits.v[range.clone()],
                primitive: &mut hits.primitive[range.clone()],
                // The only geometry is number 0, as the world is.
                geometry: &mut hits.instance[range],
                instance: None,
                instance_primitive: None,
            };
            return scene.intersect_batch(slices, coherent, into);
        }
        PLACES.with_borrow_mut(|places| {
            let n = range.len();
            for scratch in [&mut places.geometry, &mut places.instance, &mut places.place] {
                scratch.resize(n.max(scratch.len()), 0);
            }
            let into = HitsSoAMut {
                t: &mut hits.t[range.clone()],
                u: &mut hits.u[range.clone()],
                v: &mut hits.v[range.clone()],
                primitive: &mut hits.primitive[range.clone()],
                geometry: &mut places.geometry[..n],
                instance: Some(&mut places.instance[..n]),
                instance_primitive: Some(&mut places.place[..n]),
            };
            scene.intersect_batch(slices, coherent, into);
            for (k, i) in range.enumerate() {
                if hits.primitive[i] != MISS {
                    let (instance, place) = (places.instance[k], places.place[k]);
                    (hits.instance[i], hits.primitive[i]) =
                        numbers.of(instance, place, places.geometry[k], hits.primitive[i]);
                }
            }
        });
    }

    fn occluded(&self, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
        if self.single {
            let of = |(i, o): (usize, &mut u8)| *o = self.built.scene.occluded1(&ray(rays, i)).into();
            return occluded[..n].iter_mut().enumerate().for_each(of);
        }
        self.built.scene.occluded_batch(self.rays(rays, 0..n), false, &mut occluded[..n]);
    }

    fn stats(&self) -> AccelStats {
        let device = self.built.scene.device();
        AccelStats {
            name: "embree",
            version: device.version().to_string(),
            isa: device.isa().to_owned(),
            bytes: device.memory_bytes(),
            front: 0,
            splits: 0,
        }
    }
}

/// A usable libembree4.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Located {
    /// The file, or the name that the system's loader knows it by.
    pub path: PathBuf,
    /// Such as `4.4.0`.
    pub version: String,
    /// Instruction set of its kernels, such as `avx512`.
    pub isa: String,
    /// What was tried before and why it was not used, `path: reason`.
    pub refused: Vec<String>,
}

/// The libembree4 that [`EmbreeAccel::build`] would use.
///
/// # Errors
/// There is none: what was tried and why it was not used, `path: reason`.
pub fn locate(folders: &[PathBuf]) -> Result<Located, Vec<String>> {
    let library = Library::find(folders).map_err(|e| e.refused.iter().map(ToString::to_string).collect::<Vec<_>>())?;
    let device = Device::new(&library, "threads=1").map_err(|e| vec![format!("{}: {e}", library.path().display())])?;
    Ok(Located {
        path: library.path().to_owned(),
        version: library.version().to_string(),
        isa: device.isa().to_owned(),
        refused: library.refused().iter().map(ToString::to_string).collect(),
    })
}
