//! `prt-batch doctor`: what this program finds on this machine, and whether its ray backends work here.

use super::host;
use super::memory::{MemoryBudget, MemoryLimit};
use super::report::cpu_name;
use crate::accel::embree::{EmbreeAccel, Located, locate};
use crate::accel::{Accel, HitBatch, RayBatch, Triangles, linear::Linear, wide::WideBvh};
use glam::Vec3;
use serde::Serialize;
use simd::Level;
use std::path::PathBuf;

/// What was found.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Doctor {
    pub prt: &'static str,
    pub cpu: Cpu,
    pub memory: Memory,
    pub embree: Embree,
    pub self_test: Vec<SelfTest>,
    /// What does not work, each with what to do; empty if all is well.
    pub problems: Vec<String>,
}

/// Processors.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Cpu {
    pub name: Option<String>,
    /// SIMD levels that this CPU has, the widest last.
    pub simd: Vec<&'static str>,
    /// Lanes that shade.
    pub lanes: u32,
    pub processors: Option<usize>,
    /// Those that this process may run on, such as `0-3`.
    pub affinity: Option<String>,
    /// Processors' worth of time that a control group allows.
    pub quota: Option<f64>,
    /// What `--threads` is by default.
    pub threads: usize,
}

/// Bytes.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Memory {
    pub total: Option<u64>,
    pub available: Option<u64>,
    /// What control groups allow.
    pub limit: Option<u64>,
    /// What `--memory` is by default.
    pub budget: Option<u64>,
}

/// The library that traces rays, if it is there.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Embree {
    pub path: Option<PathBuf>,
    pub version: Option<String>,
    pub isa: Option<String>,
    /// What was tried and not used, `path: reason`.
    pub not_used: Vec<String>,
    /// How to get it; null if it is there.
    pub hint: Option<&'static str>,
}

/// A ray backend tried on a small mesh against brute force.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct SelfTest {
    pub backend: &'static str,
    pub rays: usize,
    /// Rays that hit anything.
    pub hits: usize,
    /// Rays that hit something else than by brute force.
    pub different: usize,
    /// It could not be built.
    pub error: Option<String>,
}

const HINT: &str = "Embree is optional: without it rays are traced by the built-in bvh. scripts/get-embree.sh brings it \
                    into .embree beside the program's project; or set EMBREE_DIR to a folder that holds libembree4.so \
                    and its TBB.";

/// Looks at this machine. `embree_dirs` are the folders in which libembree4 is looked for, after `EMBREE_DIR` and before
/// the system's; `memory` is the limit of a run. Nothing is written.
pub fn doctor(embree_dirs: &[PathBuf], memory: Option<MemoryLimit>) -> Doctor {
    let located = locate(embree_dirs);
    let mut self_test = vec![tried("bvh", |mesh| Ok(Box::new(WideBvh::build(mesh))))];
    if located.is_ok() {
        let build = |mesh: &Triangles| -> Result<Box<dyn Accel>, String> {
            Ok(Box::new(EmbreeAccel::build(mesh, embree_dirs).map_err(|error| error.to_string())?))
        };
        self_test.push(tried("embree", build));
    }
    let mut problems = Vec::new();
    for test in &self_test {
        let other = if test.backend == "embree" { "bvh" } else { "embree" };
        if let Some(error) = &test.error {
            problems.push(format!("{} cannot be used here: {error}; render with --accel {other}", test.backend));
        } else if test.different > 0 || test.hits == 0 {
            let SelfTest { backend, rays, different, .. } = test;
            problems.push(format!(
                "{backend} finds other hits than brute force ({different} of {rays} rays); render with --accel {other}, \
                 and please report it with this text"
            ));
        }
    }
    // A library that the user points at is meant to be used.
    let refused = match &located {
        Ok(found) => &found.refused,
        Err(refused) => refused,
    };
    let embree_dir = std::env::var_os("EMBREE_DIR").filter(|dir| !dir.is_empty());
    if let Some(dir) = embree_dir {
        let dir = dir.to_string_lossy().into_owned();
        if let Some(why) = refused.iter().find(|why| why.starts_with(&dir)) {
            problems.push(format!("EMBREE_DIR={dir} has no Embree that can be used: {why}"));
        }
    }
    let levels = [Level::Scalar, Level::Avx2, Level::Avx512];
    let budget = MemoryBudget::new(memory);
    Doctor {
        prt: crate::VERSION,
        cpu: Cpu {
            name: cpu_name(),
            simd: levels.into_iter().filter(|level| level.is_available()).map(Level::name).collect(),
            lanes: Level::best().without_portable().lanes(),
            processors: host::processors(),
            affinity: host::affinity(),
            quota: host::cpu_quota(),
            threads: host::threads(),
        },
        memory: Memory {
            total: host::memory_total(),
            available: host::memory_available(),
            limit: host::memory_limit(),
            budget: Some(budget.bytes).filter(|bytes| *bytes < u64::MAX),
        },
        embree: embree(located),
        self_test,
        problems,
    }
}

fn embree(located: Result<Located, Vec<String>>) -> Embree {
    match located {
        Ok(Located { path, version, isa, refused }) => {
            Embree { path: Some(path), version: Some(version), isa: Some(isa), not_used: refused, hint: None }
        }
        Err(refused) => Embree { path: None, version: None, isa: None, not_used: refused, hint: Some(HINT) },
    }
}

/// Squares along a side of the test's mesh.
const SQUARES: u32 = 8;
/// Rays along a side of the test: fewer per square than one, and none on an edge or through a corner.
const RAYS: usize = 31;

/// Tries a backend on a wavy mesh of 128 triangles, of which one is missing, from above.
fn tried(backend: &'static str, build: impl Fn(&Triangles) -> Result<Box<dyn Accel>, String>) -> SelfTest {
    let mesh = mesh();
    let rays = RAYS * RAYS;
    let failed = |error| SelfTest { backend, rays, hits: 0, different: rays, error: Some(error) };
    let accel = match build(&mesh) {
        Ok(accel) => accel,
        Err(error) => return failed(error),
    };
    let (found, expected) = (hits(&*accel), hits(&Linear::new(mesh)));
    let hit = |hits: &HitBatch, i: usize| (hits.t[i], hits.primitive[i]);
    let differs = |&i: &usize| {
        let ((t, triangle), (other_t, other)) = (hit(&found, i), hit(&expected, i));
        triangle != other || (t.is_finite() && (t - other_t).abs() > 1e-4)
    };
    let hits = (0..rays).filter(|&i| found.t[i].is_finite()).count();
    SelfTest { backend, rays, hits, different: (0..rays).filter(differs).count(), error: None }
}

fn mesh() -> Triangles {
    let side = SQUARES + 1;
    let height = |i: u32| 0.1 * (i as f32).sin();
    let positions = (0..side * side).map(|i| [(i % side) as f32, height(i), (i / side) as f32]).collect();
    let mut indices: Vec<[u32; 3]> = Vec::new();
    for i in (0..SQUARES * SQUARES).map(|i| i / SQUARES * side + i % SQUARES) {
        indices.extend([[i, i + side, i + 1], [i + 1, i + side, i + side + 1]]);
    }
    indices.remove(SQUARES as usize);
    Triangles { positions, indices }
}

/// What a square of rays that come down slantwise hits.
fn hits(accel: &dyn Accel) -> HitBatch {
    let (mut rays, mut hits) = (RayBatch::new(RAYS * RAYS), HitBatch::new(RAYS * RAYS));
    let place = |i: usize| (i as f32 + 0.37) * SQUARES as f32 / RAYS as f32;
    for i in 0..RAYS * RAYS {
        rays.set(i, Vec3::new(place(i % RAYS), 2.0, place(i / RAYS)), Vec3::new(0.013, -1.0, 0.007), f32::INFINITY);
    }
    accel.intersect(&rays, 0..RAYS * RAYS, false, &mut hits);
    hits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_backend_that_loses_a_triangle_or_cannot_be_built_is_found_out() {
        let good = tried("bvh", |mesh| Ok(Box::new(WideBvh::build(mesh))));
        assert_eq!((good.different, &good.error), (0, &None));
        // Nearly all rays hit; the missing triangle and the rim are missed.
        assert!(good.hits > good.rays * 9 / 10 && good.hits < good.rays, "{good:?}");
        let loses = tried("bvh", |mesh| {
            let mut mesh = mesh.clone();
            mesh.indices.pop();
            Ok(Box::new(WideBvh::build(&mesh)))
        });
        assert!(loses.different > 0 && loses.different < loses.rays / 32, "{loses:?}");
        let none = tried("embree", |_| Err("not here".into()));
        assert_eq!((none.error.as_deref(), none.different), (Some("not here"), none.rays));
    }

    #[test]
    fn this_machine_is_described() {
        let found = doctor(&[PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".embree")], Some(MemoryLimit::Bytes(7)));
        assert_eq!(found.problems, Vec::<String>::new());
        assert!(found.cpu.threads >= 1 && [1, 8, 16].contains(&found.cpu.lanes));
        assert_eq!(found.memory.budget, Some(7));
        let embree = &found.embree;
        assert_eq!(embree.path.is_some(), embree.hint.is_none());
        assert_eq!(found.self_test.len(), if embree.path.is_some() { 2 } else { 1 });
    }
}
