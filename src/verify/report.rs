//! What was found: counts, limits, and rays to repeat it with.

use super::catalogue::Subject;
use super::contenders::Backend;
use super::oracle::Reported;
use super::rays::{Kind, Ray};
use serde::Serialize;

/// What can be wrong with an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Fault {
    /// Something must be hit, and nothing was, or only something behind it.
    Miss,
    /// What was hit is not there, or not between the ray's ends.
    Phantom,
    /// Distance or weights are beyond the error bound.
    Misplaced,
    /// `occluded` says otherwise than `intersect`.
    Occluded,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Miss, Self::Phantom, Self::Misplaced, Self::Occluded];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Miss => "misses",
            Self::Phantom => "phantom hits",
            Self::Misplaced => "wrong distances",
            Self::Occluded => "occluded against intersect",
        }
    }
}

/// What is allowed of a million rays.
///
/// Our own backends are allowed nothing. Embree ROBUST is not exact, and of its faults those of 4.4.0 (AVX-512) are written
/// down here, at one and a half to two times what the worst built-in mesh showed in 1500 rays a kind, so that it shows
/// when they grow. What they are:
/// - Of rays aimed exactly at a corner 1.5 % pass between its triangles (where those are seen flat: none of a bumpy
///   mesh), of grazing and coplanar ones 0.5 %. Elsewhere its own bar holds, 2e-5.
/// - Weights are 0 where twice the triangle's area times the direction's length is below 1e-18: meshes of 1e-6 m.
/// - Distances of grazing hits and slivers leave the triangle; those of `coplanar` rays always did.
/// - For rays in the plane of a box's face, 1 or 2 of 5000 at the mesh `flat`, occlusion is another answer than the hit:
///   both are allowed there, but not one of each. Elsewhere they agree.
pub fn allowed_per_million(backend: Backend, kind: Kind, fault: Fault) -> f64 {
    if backend != Backend::Embree {
        return 0.0;
    }
    match (fault, kind) {
        (Fault::Occluded, Kind::Grazing | Kind::Coplanar | Kind::Tiny | Kind::Axis) => 500.0,
        (Fault::Occluded, _) | (_, Kind::Invalid) => 0.0,
        (Fault::Miss, Kind::Vertex) => 30e3,
        (Fault::Miss, Kind::Grazing | Kind::Coplanar) => 10e3,
        (Fault::Miss, Kind::Axis | Kind::Far | Kind::Shadow | Kind::Ends) => 2e3,
        (Fault::Miss, _) => 20.0,
        (Fault::Phantom, Kind::Coplanar) => 30e3,
        (Fault::Phantom, Kind::Far | Kind::Grazing) => 4e3,
        (Fault::Phantom, _) => 20.0,
        (Fault::Misplaced, Kind::Coplanar) => 500e3,
        (Fault::Misplaced, Kind::Edge | Kind::Vertex) => 150e3,
        (Fault::Misplaced, Kind::Shadow | Kind::Ends | Kind::Grazing) => 50e3,
        (Fault::Misplaced, Kind::Tiny) => 20e3,
        (Fault::Misplaced, Kind::Far) => 10e3,
        (Fault::Misplaced, _) => 4e3,
    }
}

/// Hits against misses among backends that BVH-01 allows of a million usual rays.
pub const DISAGREEMENTS_PER_MILLION: f64 = 2.0;

/// What one contender did wrong.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Tally {
    pub name: &'static str,
    pub backend: Backend,
    pub hits: usize,
    pub misses: usize,
    pub phantoms: usize,
    pub misplaced: usize,
    pub occluded: usize,
    /// The first few.
    pub reproducers: Vec<Reproducer>,
}

impl Tally {
    /// Nothing yet.
    pub fn new(name: &'static str, backend: Backend) -> Self {
        Self { name, backend, hits: 0, misses: 0, phantoms: 0, misplaced: 0, occluded: 0, reproducers: Vec::new() }
    }

    /// One more.
    pub fn count(&mut self, fault: Fault) {
        *match fault {
            Fault::Miss => &mut self.misses,
            Fault::Phantom => &mut self.phantoms,
            Fault::Misplaced => &mut self.misplaced,
            Fault::Occluded => &mut self.occluded,
        } += 1;
    }

    /// How many of a fault.
    pub fn of(&self, fault: Fault) -> usize {
        match fault {
            Fault::Miss => self.misses,
            Fault::Phantom => self.phantoms,
            Fault::Misplaced => self.misplaced,
            Fault::Occluded => self.occluded,
        }
    }

    /// Counts `other`, of the same way of use.
    pub fn add(&mut self, other: Self) {
        self.hits += other.hits;
        self.misses += other.misses;
        self.phantoms += other.phantoms;
        self.misplaced += other.misplaced;
        self.occluded += other.occluded;
        self.reproducers.extend(other.reproducers);
        self.reproducers.truncate(REPRODUCERS);
    }
}

/// Kept of each contender, kind and subject.
const REPRODUCERS: usize = 4;

/// Rays of one kind at one subject.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct KindReport {
    pub kind: Kind,
    pub rays: usize,
    /// Rays of which the oracle says that they must hit something.
    pub must_hit: usize,
    /// Rays about which contenders say hit and miss, or distances further apart than 32 ulp.
    pub disagreements: usize,
    /// Those of `disagreements` in which every answer is allowed: ties and boundaries.
    pub explained: usize,
    /// Those of `disagreements` that are hit against miss.
    pub hit_or_miss: usize,
    pub contenders: Vec<Tally>,
}

impl KindReport {
    /// Nothing yet.
    pub fn new(kind: Kind, rays: usize) -> Self {
        Self { kind, rays, must_hit: 0, disagreements: 0, explained: 0, hit_or_miss: 0, contenders: Vec::new() }
    }

    /// Counts `other` as well, each contender by its name.
    pub fn add(&mut self, other: Self) {
        self.rays += other.rays;
        self.must_hit += other.must_hit;
        self.disagreements += other.disagreements;
        self.explained += other.explained;
        self.hit_or_miss += other.hit_or_miss;
        for other in other.contenders {
            match self.contenders.iter_mut().find(|tally| tally.name == other.name) {
                Some(tally) => tally.add(other),
                None => self.contenders.push(other),
            }
        }
    }
}

/// All rays at one subject.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct SubjectReport {
    pub name: String,
    pub triangles: usize,
    pub instances: usize,
    pub closed: bool,
    /// Whether the limit of disagreements holds.
    pub ordinary: bool,
    /// Backends that did not take part, and why.
    pub left_out: Vec<String>,
    pub kinds: Vec<KindReport>,
}

impl SubjectReport {
    /// No rays yet.
    pub fn new(name: &str, subject: &Subject) -> Self {
        let Subject { geometry, inside, is_ordinary } = subject;
        Self {
            name: name.to_owned(),
            triangles: geometry.triangle_count(),
            instances: geometry.placements.len(),
            closed: inside.is_some(),
            ordinary: *is_ordinary,
            left_out: Vec::new(),
            kinds: Vec::new(),
        }
    }

    /// How many usual rays backends take for hits and misses, and how many of all disagreements about usual rays are not
    /// within the error bound, in words; `None` if there are none or the limit does not hold.
    fn disagreements(&self) -> Option<String> {
        let usual = || self.kinds.iter().filter(|k| k.kind.is_usual());
        let hit_or_miss: usize = usual().map(|k| k.hit_or_miss).sum();
        let unexplained: usize = usual().map(|k| k.disagreements - k.explained).sum();
        let text = || format!("{}: {hit_or_miss}, unexplained {unexplained}", self.name);
        (self.ordinary && hit_or_miss > 0).then(text)
    }

    /// What is beyond the limits, in words.
    pub fn problems(&self) -> Vec<String> {
        let mut problems = Vec::new();
        for kind in &self.kinds {
            for tally in &kind.contenders {
                for fault in Fault::ALL {
                    let allowed = allowed(allowed_per_million(tally.backend, kind.kind, fault), kind.rays);
                    let found = tally.of(fault);
                    if found > allowed {
                        problems.push(format!(
                            "{}: {} of {} {} rays are {} of {}; allowed: {allowed}",
                            self.name,
                            found,
                            kind.rays,
                            kind.kind.name(),
                            fault.name(),
                            tally.name
                        ));
                    }
                }
            }
        }
        problems
    }
}

/// Of `rays`, for a share of a million, three standard deviations of the count included; nothing where nothing is.
fn allowed(per_million: f64, rays: usize) -> usize {
    let mean = per_million * 1e-6 * rays as f64;
    (mean + 3.0 * mean.sqrt()).ceil() as usize
}

/// The whole run.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Report {
    pub prt: &'static str,
    pub passed: bool,
    pub seed: u64,
    /// All rays, each counted once.
    pub rays: usize,
    /// Of rays as pictures need them (camera, random, bounce, shadow) at ordinary subjects: hit against miss among backends.
    pub usual_rays: usize,
    pub usual_hit_or_miss: usize,
    pub subjects: Vec<SubjectReport>,
    /// What is beyond the limits.
    pub problems: Vec<String>,
}

impl Report {
    /// Of `subjects`, shot at with `seed`.
    pub fn new(seed: u64, subjects: Vec<SubjectReport>) -> Self {
        let kinds = || subjects.iter().flat_map(|s| &s.kinds);
        let ordinary = || subjects.iter().filter(|s| s.ordinary).flat_map(|s| &s.kinds);
        let usual = || ordinary().filter(|k| k.kind.is_usual());
        let (rays, usual_rays) = (kinds().map(|k| k.rays).sum(), usual().map(|k| k.rays).sum());
        let usual_hit_or_miss = usual().map(|k| k.hit_or_miss).sum();
        let mut problems: Vec<String> = subjects.iter().flat_map(SubjectReport::problems).collect();
        let most = allowed(DISAGREEMENTS_PER_MILLION, usual_rays);
        if usual_hit_or_miss > most {
            let at: Vec<String> = subjects.iter().filter_map(SubjectReport::disagreements).collect();
            problems.push(format!(
                "backends disagree about hit or miss of {usual_hit_or_miss} of {usual_rays} usual rays; allowed: {most} ({}). \
                 Slivers and triangles of a few ulp of their coordinates do that with Embree, which catches rays that leave \
                 them: --accel bvh,linear tells",
                at.join("; ")
            ));
        }
        let prt = crate::VERSION;
        Self { prt, passed: problems.is_empty(), seed, rays, usual_rays, usual_hit_or_miss, subjects, problems }
    }
}

/// A ray to repeat a fault with.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the fields are the JSON's, described in docs/cli.md")]
pub struct Reproducer {
    pub subject: String,
    pub kind: Kind,
    pub contender: &'static str,
    pub fault: Fault,
    /// Origin, direction, end and time as numbers.
    pub ray: [f32; 8],
    /// The same as bits.
    pub ray_bits: [u32; 8],
    pub key: u32,
    /// Instance, primitive, t, u, v.
    pub answer: Option<(u32, u32, f32, f32, f32)>,
    /// What the oracle says.
    pub expected: String,
    /// None of the kind is allowed to the backend.
    pub is_beyond: bool,
}

impl Reproducer {
    /// Of a fault of `contender`.
    pub fn new(
        subject: &str,
        kind: Kind,
        contender: (&'static str, Backend),
        fault: Fault,
        ray: Ray,
        hit: Option<Reported>,
        expected: String,
    ) -> Self {
        let ([ox, oy, oz], [dx, dy, dz]) = (ray.origin.to_array(), ray.direction.to_array());
        let numbers = [ox, oy, oz, dx, dy, dz, ray.t_max, ray.time];
        Self {
            subject: subject.to_owned(),
            kind,
            contender: contender.0,
            fault,
            ray: numbers,
            ray_bits: numbers.map(f32::to_bits),
            key: ray.key,
            answer: hit.map(|h| (h.instance, h.primitive, h.t, h.u, h.v)),
            expected,
            is_beyond: allowed_per_million(contender.1, kind, fault) == 0.0,
        }
    }

    /// In a few lines.
    pub fn text(&self) -> String {
        let [ox, oy, oz, dx, dy, dz, t_max, time] = self.ray;
        let bits: Vec<_> = self.ray_bits.iter().map(|b| format!("{b:08x}")).collect();
        let answer = match self.answer {
            Some((instance, primitive, t, u, v)) => {
                format!("instance {instance}, primitive {primitive} at t {t:e} (u {u}, v {v})")
            }
            None => "nothing".to_owned(),
        };
        format!(
            "{}, {} ray, {}: {}\n  origin {ox:e} {oy:e} {oz:e} direction {dx:e} {dy:e} {dz:e} t_max {t_max:e} time {time} \
             key {}\n  bits {}\n  found: {answer}\n  {}",
            self.subject,
            self.kind.name(),
            self.contender,
            self.fault.name(),
            self.key,
            bits.join(" "),
            self.expected
        )
    }
}
