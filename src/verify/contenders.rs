//! Every backend, in every way that pictures use it.

use super::rays::{Kind, Ray, batch};
use crate::accel::embree::{self, EmbreeAccel};
use crate::accel::front::{Front, Split};
use crate::accel::geometry::{Geometry, Object};
use crate::accel::linear::Linear;
use crate::accel::wide::WideBvh;
use crate::accel::{Accel, HitBatch};
use crate::error::RenderError;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::Arc;

/// A backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Backend {
    /// Our own.
    Bvh,
    /// libembree4.
    Embree,
    /// Brute force: only for small meshes.
    Linear,
}

/// Brute force looks at no more triangles than this.
const LINEAR_MOST: usize = 1000;

impl Backend {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::Embree => "embree",
            Self::Linear => "linear",
        }
    }
}

/// A backend in one way of use.
pub struct Contender {
    /// Such as `bvh` or `front+embree`.
    pub name: &'static str,
    /// Which it is.
    pub backend: Backend,
    accel: Arc<dyn Accel>,
    /// The hint that rays are a camera's, which makes some backends trace packets.
    is_coherent: bool,
}

/// What a contender says about rays.
pub struct Answers {
    /// Nearest hits.
    pub hits: HitBatch,
    /// 1 where anything is in the way.
    pub occluded: Vec<u8>,
}

impl Contender {
    /// One of `accel`, for tests.
    pub fn new(name: &'static str, backend: Backend, accel: Arc<dyn Accel>) -> Self {
        Self { name, backend, accel, is_coherent: false }
    }

    /// Whether it takes part with rays of a kind: Embree's packets for coherent rays may lose others (30 % of the `tiny`
    /// ones), so the hint is kept for a camera's, there as here.
    pub fn takes(&self, kind: Kind) -> bool {
        !self.is_coherent || self.backend != Backend::Embree || kind == Kind::Camera
    }

    /// Traces `rays`, each twice.
    pub fn ask(&self, rays: &[Ray]) -> Answers {
        let rays_in = batch(rays);
        let mut answers = Answers { hits: HitBatch::new(rays.len()), occluded: vec![0; rays.len()] };
        self.accel.intersect(&rays_in, 0..rays.len(), self.is_coherent, &mut answers.hits);
        self.accel.occluded(&rays_in, rays.len(), &mut answers.occluded);
        answers
    }
}

/// A backend that is left out, and why.
pub type LeftOut = (Backend, String);

/// All ways in which `backends` trace `geometry`, brute force last, and those left out.
///
/// # Errors
/// A backend cannot be built.
pub fn contenders(
    geometry: &Geometry,
    backends: &[Backend],
    embree_dirs: &[PathBuf],
) -> Result<(Vec<Contender>, Vec<LeftOut>), RenderError> {
    let (mut all, mut left_out) = (Vec::new(), Vec::new());
    for &backend in backends {
        if backend == Backend::Linear {
            let traced = traced_triangles(geometry);
            if traced > LINEAR_MOST {
                left_out.push((backend, format!("{traced} triangles are too many")));
            } else {
                all.push(Contender::new("linear", backend, Arc::new(Linear::new(geometry.clone()))));
            }
            continue;
        }
        let build = |geometry: Geometry| -> Result<Box<dyn Accel>, RenderError> {
            Ok(match backend {
                Backend::Embree => Box::new(EmbreeAccel::build_with(geometry, &embree::find(embree_dirs)?)?),
                _ => Box::new(WideBvh::build(geometry)),
            })
        };
        let names = match backend {
            Backend::Embree => ["embree", "embree packets", "front+embree"],
            _ => ["bvh", "bvh packets", "front+bvh"],
        };
        let accel: Arc<dyn Accel> = build(geometry.clone())?.into();
        all.push(Contender { name: names[0], backend, accel: Arc::clone(&accel), is_coherent: false });
        all.push(Contender { name: names[1], backend, accel, is_coherent: true });
        let split = Split::new(geometry.clone());
        let Split { all: everything, front } = if backend == Backend::Embree { split.apart() } else { split };
        if let Some(front) = front {
            let front = Front::build(everything, front, build)?;
            all.push(Contender { name: names[2], backend, accel: Arc::new(front), is_coherent: false });
        }
    }
    Ok((all, left_out))
}

/// Triangles and shapes that a ray is held against by brute force.
fn traced_triangles(geometry: &Geometry) -> usize {
    let of = |o: &Object| o.shapes.len() + o.parts.iter().map(|p| p.triangles.indices.len()).sum::<usize>();
    let placed = geometry.placements.iter().map(|p| of(&geometry.objects[p.object as usize]));
    of(&geometry.world) + placed.sum::<usize>()
}
