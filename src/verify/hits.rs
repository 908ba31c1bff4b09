//! `verify hits`: shoots rays at a subject with every backend and holds the answers against the oracle.

use super::catalogue::Subject;
use super::contenders::{Answers, Backend, Contender, contenders};
use super::oracle::{Must, Oracle, Reported, Wrong};
use super::rays::{Aim, Kind, Ray};
use super::report::{Fault, KindReport, Reproducer, SubjectReport, Tally};
use crate::accel::MISS;
use crate::error::RenderError;
use crate::math::random::Rng;
use rayon::prelude::*;
use std::path::PathBuf;

/// What is shot, and with what.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Rays of each kind at each subject.
    pub rays: usize,
    /// Other seeds, other rays.
    pub seed: u64,
    /// Which backends.
    pub backends: Vec<Backend>,
    /// Folders in which libembree4 is looked for.
    pub embree_dirs: Vec<PathBuf>,
}

impl Settings {
    /// Rays of each kind at each subject unless told otherwise.
    pub const RAYS: usize = 5000;
}

/// Rays that are made and traced together. Part of what a seed means: it says where streams of random numbers begin.
const CHUNK: usize = 2000;

/// Faults of one contender in a chunk of which the rays are told.
const TOLD: usize = 2;

/// Two distances further apart than this share are a disagreement (BVH-01).
const FAR_APART: f64 = 32.0 / (1 << 24) as f64;

/// Shoots at `subject` with the threads of rayon's current pool; what is found does not depend on how many they are.
///
/// # Errors
/// A backend cannot be built.
pub fn hits(name: &str, subject: &Subject, settings: &Settings) -> Result<SubjectReport, RenderError> {
    let (contenders, left_out) = contenders(&subject.geometry, &settings.backends, &settings.embree_dirs)?;
    let mut report = hits_of(name, subject, &contenders, settings);
    report.left_out = left_out.into_iter().map(|(backend, why)| format!("{}: {why}", backend.name())).collect();
    Ok(report)
}

/// As [`hits`], with contenders of the caller's own.
pub fn hits_of(name: &str, subject: &Subject, contenders: &[Contender], settings: &Settings) -> SubjectReport {
    let geometry = &subject.geometry;
    let mut report = SubjectReport::new(name, subject);
    let Some(aim) = Aim::new(geometry, subject.inside) else { return report };
    let oracle = Oracle::new(geometry);
    let chunks = settings.rays.div_ceil(CHUNK);
    let jobs: Vec<(Kind, usize)> = Kind::ALL.iter().flat_map(|kind| (0..chunks).map(|c| (*kind, c))).collect();
    let shot = |&(kind, chunk): &(Kind, usize)| {
        let stream = format!("{name} {}", kind.name());
        let mut rng = Rng::of_stream(settings.seed, &stream, chunk as u64);
        let n = CHUNK.min(settings.rays - chunk * CHUNK);
        let rays = aim.rays(kind, n, &mut rng);
        judge(name, kind, &rays, contenders, &oracle)
    };
    let done: Vec<KindReport> = jobs.par_iter().map(shot).collect();
    for part in done {
        match report.kinds.last_mut() {
            Some(last) if last.kind == part.kind => last.add(part),
            _ => report.kinds.push(part),
        }
    }
    report
}

fn judge(name: &str, kind: Kind, rays: &[Ray], contenders: &[Contender], oracle: &Oracle<'_>) -> KindReport {
    let contenders: Vec<&Contender> = contenders.iter().filter(|contender| contender.takes(kind)).collect();
    let answers: Vec<Answers> = contenders.iter().map(|contender| contender.ask(rays)).collect();
    let musts: Vec<Option<Must>> = rays.iter().map(|ray| oracle.must(ray)).collect();
    let mut report = KindReport::new(kind, rays.len());
    report.must_hit = musts.iter().zip(rays).filter(|(must, ray)| must.is_some() || leaks(ray)).count();
    report.contenders = contenders.iter().map(|c| Tally::new(c.name, c.backend)).collect();
    for (i, ray) in rays.iter().enumerate() {
        let mut all_allowed = true;
        for ((contender, answers), tally) in contenders.iter().zip(&answers).zip(&mut report.contenders) {
            let hit = reported(answers, i);
            tally.hits += usize::from(hit.is_some());
            let ends = |hit: &Reported| hit.t == 0.0 || hit.t == ray.t_max;
            let at_end = hit.as_ref().is_some_and(ends);
            let mut faults = vec![fault(oracle, ray, musts[i], hit).or(at_end.then_some(Fault::Phantom))];
            all_allowed &= faults[0].is_none();
            if (answers.occluded[i] != 0) != hit.is_some() {
                faults.push(Some(Fault::Occluded));
            }
            for fault in faults.into_iter().flatten() {
                tally.count(fault);
                if tally.reproducers.len() < TOLD {
                    let expected = expected(oracle, ray, musts[i], hit);
                    let ray = *ray;
                    tally.reproducers.push(Reproducer::new(
                        name,
                        kind,
                        (contender.name, contender.backend),
                        fault,
                        ray,
                        hit,
                        expected,
                    ));
                }
            }
        }
        let Some((first, others)) = answers.split_first() else { continue };
        let first = reported(first, i);
        let others = others.iter().map(|answers| reported(answers, i));
        let (differs, hit_or_miss) = others.fold((false, false), |(differs, hit_or_miss), other| {
            (differs || disagree(first, other), hit_or_miss || first.is_some() != other.is_some())
        });
        report.disagreements += usize::from(differs);
        report.explained += usize::from(differs && all_allowed);
        report.hit_or_miss += usize::from(hit_or_miss);
    }
    report
}

/// Whether a ray that hits nothing has left a closed mesh.
fn leaks(ray: &Ray) -> bool {
    ray.is_inside && ray.direction.is_finite() && ray.direction.abs().max_element() >= f32::MIN_POSITIVE
}

/// The hit of ray `i`.
fn reported(Answers { hits, .. }: &Answers, i: usize) -> Option<Reported> {
    let primitive = hits.primitive[i];
    let hit = || Reported { instance: hits.instance[i], primitive, t: hits.t[i], u: hits.u[i], v: hits.v[i] };
    (primitive != MISS).then(hit)
}

/// What is wrong with an answer.
fn fault(oracle: &Oracle<'_>, ray: &Ray, must: Option<Must>, hit: Option<Reported>) -> Option<Fault> {
    let Some(hit) = hit else { return (must.is_some() || leaks(ray)).then_some(Fault::Miss) };
    match oracle.judge(ray, &hit) {
        Err(Wrong::Phantom) => Some(Fault::Phantom),
        Err(Wrong::Place(_)) => Some(Fault::Misplaced),
        Ok(()) => must.is_some_and(|must| f64::from(hit.t) > must.t).then_some(Fault::Miss),
    }
}

/// What the oracle says, in words.
fn expected(oracle: &Oracle<'_>, ray: &Ray, must: Option<Must>, hit: Option<Reported>) -> String {
    let must = match must {
        Some(Must { t, id: (instance, primitive) }) => {
            format!("must hit at t <= {t:.9e} (instance {instance}, primitive {primitive}, or beside it)")
        }
        None if leaks(ray) => "must hit something: it starts inside a closed mesh".to_owned(),
        None => "need not hit anything".to_owned(),
    };
    match hit.map(|hit| oracle.judge(ray, &hit)) {
        Some(Err(Wrong::Place([low, high]))) => format!("{must}; what was hit is at t {low:.9e} to {high:.9e}"),
        Some(Err(Wrong::Phantom)) => format!("{must}; what was hit is not there"),
        _ => must,
    }
}

fn disagree(a: Option<Reported>, b: Option<Reported>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => {
            let (a, b) = (f64::from(a.t), f64::from(b.t));
            (a - b).abs() > FAR_APART * a.abs().max(b.abs())
        }
        (a, b) => a.is_some() != b.is_some(),
    }
}
