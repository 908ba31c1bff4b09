//! The backends that run against each other, and what building them takes.

use super::clock::Clock;
use super::stats::Spread;
use crate::accel::embree::EmbreeAccel;
use crate::accel::front::{Front, Split};
use crate::accel::geometry::Geometry;
use crate::accel::{Accel, AccelStats, linear::Linear, wide::WideBvh};
use crate::error::RenderError;
use embree4_rs::Library;
use rayon::ThreadPool;
use serde::Serialize;
use std::sync::Arc;

/// Builds of each backend at most: large trees take seconds.
const BUILD_ROUNDS: usize = 5;

/// A ray backend.
#[derive(Clone, Debug)]
pub enum Backend {
    /// Our own BVH.
    Bvh,
    /// Embree ROBUST, from this library.
    Embree(Arc<Library>),
    /// Brute force.
    Linear,
}

impl Backend {
    /// As in the JSON.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::Embree(_) => "embree",
            Self::Linear => "linear",
        }
    }

    fn build(&self, geometry: Geometry) -> Result<Box<dyn Accel>, RenderError> {
        Ok(match self {
            Self::Bvh => Box::new(WideBvh::build(geometry)),
            Self::Embree(library) => Box::new(EmbreeAccel::build_with(geometry, library)?),
            Self::Linear => Box::new(Linear::new(geometry)),
        })
    }
}

/// What lies between the renderer and a backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Setup {
    /// As pictures are rendered: with the big triangles in front where that is decided for the scene.
    Prepared,
    /// The backend alone, all triangles in it.
    Bare,
}

/// A built backend.
pub struct Contender {
    /// `bvh`, `embree` or `linear`.
    pub backend: &'static str,
    /// Embree: rays a call, 1 or 16 (8 on a CPU without AVX-512).
    pub entry: Option<usize>,
    /// With what in front.
    pub setup: Setup,
    /// What traces.
    pub accel: Box<dyn Accel>,
}

/// Backends ready to run.
pub struct Contenders {
    /// `bvh` and `embree`, the latter with both of its entries, in every setup.
    pub fast: Vec<Contender>,
    /// Brute force, if it was asked for.
    pub linear: Option<Linear>,
    /// Big triangles in front of the prepared ones; 0: there is no other setup than that, and the bare one is the same.
    pub front: usize,
}

impl Contenders {
    /// Builds `backends` over `geometry`.
    ///
    /// # Errors
    /// Embree's own.
    pub fn build(backends: &[Backend], geometry: &Geometry) -> Result<Self, RenderError> {
        let split = Split::new(geometry.clone());
        let has_bare = split.front.is_some();
        let mut built = Self { fast: Vec::new(), linear: None, front: 0 };
        for backend in backends {
            if let Backend::Linear = backend {
                built.linear = Some(Linear::new(geometry.clone()));
                continue;
            }
            let mut add = |(entry, accel): Entry, setup: Setup| {
                built.front = built.front.max(accel.stats().front);
                built.fast.push(Contender { backend: backend.name(), entry, setup, accel });
            };
            let of_backend = split.clone();
            let Split { all, front } = if let Backend::Embree(_) = backend { of_backend.apart() } else { of_backend };
            if let Some((big, rest)) = &front {
                for ((entry, rest), (_, all)) in entries(backend, rest)?.into_iter().zip(entries(backend, &all)?) {
                    add((entry, Box::new(Front::new(big.clone(), Some(rest), all))), Setup::Prepared);
                }
            } else {
                entries(backend, &all)?.into_iter().for_each(|entry| add(entry, Setup::Prepared));
            }
            if has_bare {
                entries(backend, &all)?.into_iter().for_each(|entry| add(entry, Setup::Bare));
            }
        }
        Ok(built)
    }
}

/// Rays a call, where there is a choice, and what takes them so.
type Entry = (Option<usize>, Box<dyn Accel>);

/// A backend by each of its ways to take rays.
fn entries(backend: &Backend, geometry: &Geometry) -> Result<Vec<Entry>, RenderError> {
    Ok(match backend {
        Backend::Embree(library) => {
            let packets = EmbreeAccel::build_with(geometry.clone(), library)?;
            let single = packets.in_single_rays();
            vec![(Some(1), Box::new(single)), (Some(packets.packet_width()), Box::new(packets))]
        }
        other => vec![(None, other.build(geometry.clone())?)],
    })
}

/// What building one backend over all triangles takes.
#[derive(Clone, Debug, Serialize)]
pub struct BuildRow {
    /// `bvh` or `embree`.
    pub backend: &'static str,
    /// CPU seconds on one thread, median.
    pub seconds: f64,
    /// Their quartiles.
    pub quartiles: [f64; 2],
    /// Wall seconds with `threads`, median.
    pub wall_seconds: f64,
    /// Threads that `wall_seconds` were measured with: Embree is built by one whatever `--threads` is, since with more its
    /// trees, and so ties between equally near triangles, would not be the same every time.
    pub threads: usize,
    /// Triangles / 10^6 / `seconds`.
    pub mtri_per_s: f64,
    /// `seconds` over Embree's, median of the rounds; null without Embree.
    pub ratio_to_embree: Option<f64>,
    /// Held afterwards: of Embree its own trees without the vertices and indices that it reads.
    pub bytes: usize,
    /// The same by triangle.
    pub bytes_per_triangle: f64,
    /// Entries in leaves beyond one for each triangle: spatial splits, of `bvh` alone.
    pub split_references: usize,
}

/// Times builds, backends in turn.
///
/// # Errors
/// Embree's own.
pub fn time_builds(
    backends: &[Backend],
    geometry: &Geometry,
    rounds: usize,
    [single, all]: [&ThreadPool; 2],
) -> Result<Vec<BuildRow>, RenderError> {
    let timed: Vec<&Backend> = backends.iter().filter(|backend| !matches!(backend, Backend::Linear)).collect();
    let rounds = rounds.min(BUILD_ROUNDS);
    let mut cpu = vec![Vec::new(); timed.len()];
    let mut wall = vec![Vec::new(); timed.len()];
    let mut stats = vec![AccelStats::default(); timed.len()];
    let build = |backend: &Backend, pool: &ThreadPool| {
        let geometry = geometry.clone();
        pool.install(|| {
            let clock = Clock::start();
            let accel = backend.build(geometry)?;
            Ok::<_, RenderError>((clock.elapsed(), accel.stats()))
        })
    };
    for round in 0..rounds {
        for turn in 0..timed.len() {
            let i = (turn + round) % timed.len();
            let ((cpu_seconds, wall_seconds), held) = build(timed[i], single)?;
            cpu[i].push(cpu_seconds);
            let in_parallel = matches!(timed[i], Backend::Bvh) && all.current_num_threads() > 1;
            wall[i].push(if in_parallel { build(timed[i], all)?.0.1 } else { wall_seconds });
            stats[i] = held;
        }
    }
    let triangles = geometry.triangle_count() as f64;
    let embree = timed.iter().position(|backend| matches!(backend, Backend::Embree(_)));
    let row = |(i, backend): (usize, &&Backend)| {
        let seconds = Spread::of(cpu[i].iter().copied());
        let ratio = |embree: usize| Spread::of(cpu[i].iter().zip(&cpu[embree]).map(|(own, its)| own / its)).median;
        BuildRow {
            backend: backend.name(),
            seconds: seconds.median,
            quartiles: seconds.quartiles,
            wall_seconds: Spread::of(wall[i].iter().copied()).median,
            threads: if matches!(backend, Backend::Bvh) { all.current_num_threads() } else { 1 },
            mtri_per_s: triangles * 1e-6 / seconds.median,
            ratio_to_embree: embree.map(ratio),
            bytes: stats[i].bytes,
            bytes_per_triangle: stats[i].bytes as f64 / triangles,
            split_references: stats[i].splits,
        }
    };
    Ok(timed.iter().enumerate().map(row).collect())
}
