//! The result: what `--json` prints, field by field as `docs/cli.md` has it.

use super::contenders::{Backend, BuildRow, Contender, Contenders, Setup};
use super::rays::{Kind, RaySet};
use super::rounds::Times;
use super::stats::{Overall, Spread};
use super::{Agreement, CLOCK, LinearTimes};
use crate::accel::geometry::Geometry;
use serde::Serialize;
use simd::Level;

/// What to measure, and how well.
#[derive(Clone, Debug)]
pub struct RaySettings {
    /// Which backends.
    pub backends: Vec<Backend>,
    /// Rays of each kind, rounded up to whole batches.
    pub rays: usize,
    /// Rounds, each of which traces all rays with every backend; at least 1.
    pub rounds: usize,
    /// Of everything random.
    pub seed: u64,
    /// The other number of threads beside 1; at least 1.
    pub threads: usize,
}

/// One backend on one kind of rays with some threads.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Of the rays.
    pub kind: Kind,
    /// `bvh`, `embree` or `linear`.
    pub backend: &'static str,
    /// With or without the big triangles in front.
    pub setup: Setup,
    /// That traced.
    pub threads: usize,
    /// 10^6 rays by CPU second times threads: what the threads reach together when each has a core. Median of the rounds.
    pub mrays_per_s: f64,
    /// The same by wall time; null for `linear`.
    pub wall_mrays_per_s: Option<f64>,
    /// Speed over that of Embree ROBUST, by the better of its entries for this kind, in the same setup and with as many
    /// threads; median of the rounds' ratios (for `linear` ratio of the medians). Null without Embree.
    pub ratio_to_embree: Option<f64>,
    /// Lower and upper quartile of the rounds' ratios.
    pub ratio_quartiles: Option<[f64; 2]>,
    /// Speed over that of brute force, 1 thread; null where that was not asked for.
    pub ratio_to_linear: Option<f64>,
    /// Rays each was given.
    pub rays: usize,
    /// Embree: rays a call in the better of its entries, the one that counts.
    pub entry: Option<usize>,
    /// Embree: 10^6 rays by CPU second of the other entry.
    pub other_entry_mrays_per_s: Option<f64>,
    /// The rounds' ratios to Embree.
    #[serde(skip)]
    pub(super) ratios: Vec<f64>,
}

/// Rays of one kind, by the hits that both backends found.
#[derive(Clone, Debug, Serialize)]
pub struct KindRays {
    /// Of the rays.
    pub kind: Kind,
    /// How many.
    pub rays: u64,
    /// Share that hit anything.
    pub hit_share: f64,
    /// See [`SceneRays`].
    pub disagreements: u64,
    /// See [`SceneRays`].
    pub ties: u64,
}

/// What was measured on one scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneRays {
    /// As the user named it.
    pub input: String,
    /// Each object once.
    pub triangles: usize,
    /// Placed objects.
    pub placements: usize,
    /// Big triangles in front of the prepared backends.
    pub front_triangles: usize,
    /// By kind, threads, setup and backend.
    pub rows: Vec<Row>,
    /// Over all triangles, nothing in front.
    pub build: Vec<BuildRow>,
    /// Rays on which `bvh` and Embree (16 rays a call) disagree, by million of all kinds: one hits where the other misses,
    /// or something nearer by more than rounding. Null without Embree.
    pub disagreements_per_million: Option<f64>,
    /// Rays on which both hit different triangles at the same distance up to rounding; not among the disagreements.
    pub ties_per_million: Option<f64>,
    /// The disagreements with brute force, by million of the rays that it was given.
    pub linear_disagreements_per_million: Option<f64>,
    /// The rays.
    pub kinds: Vec<KindRays>,
    #[serde(skip)]
    agreement: Agreement,
    #[serde(skip)]
    linear_agreement: Agreement,
}

impl SceneRays {
    pub(super) fn new(input: &str, geometry: &Geometry, contenders: &Contenders, build: Vec<BuildRow>) -> Self {
        Self {
            input: input.to_owned(),
            triangles: geometry.triangle_count(),
            placements: geometry.placements.len(),
            front_triangles: contenders.front,
            rows: Vec::new(),
            build,
            disagreements_per_million: None,
            ties_per_million: None,
            linear_disagreements_per_million: None,
            kinds: Vec::new(),
            agreement: Agreement::default(),
            linear_agreement: Agreement::default(),
        }
    }

    pub(super) fn add_agreement(&mut self, kind: Kind, found: Agreement) {
        let Agreement { rays, hits, disagreements, ties } = found;
        self.kinds.push(KindRays { kind, rays, hit_share: hits as f64 / rays as f64, disagreements, ties });
        self.agreement += found;
        let all = &self.agreement;
        self.disagreements_per_million = Some(all.per_million(all.disagreements));
        self.ties_per_million = Some(all.per_million(all.ties));
    }

    pub(super) fn add_linear_agreement(&mut self, found: Agreement) {
        self.linear_agreement += found;
        let all = &self.linear_agreement;
        self.linear_disagreements_per_million = Some(all.per_million(all.disagreements));
    }

    /// The rounds' ratios of `bvh` to Embree on one thread, by kind. A scene without a front has one setup only.
    fn bvh_ratios(&self, setup: Setup) -> impl Iterator<Item = &Row> {
        let setup = if self.front_triangles == 0 { Setup::Prepared } else { setup };
        self.rows
            .iter()
            .filter(move |row| row.backend == "bvh" && row.threads == 1 && row.setup == setup && !row.ratios.is_empty())
    }
}

/// The rows of one kind with one number of threads: a row a backend and setup.
pub(super) fn rows(
    set: &RaySet,
    contenders: &[&Contender],
    times: &[Times],
    threads: usize,
    linear: Option<&LinearTimes>,
) -> Vec<Row> {
    let mrays = |seconds: f64| set.len() as f64 * 1e-6 / seconds;
    let median = |i: usize| Spread::of(times[i].cpu.iter().copied()).median;
    let mut rows: Vec<Row> = Vec::new();
    for setup in [Setup::Prepared, Setup::Bare] {
        let of = |backend: &str| {
            let mut found: Vec<usize> = (0..contenders.len())
                .filter(|&i| contenders[i].setup == setup && contenders[i].backend == backend)
                .collect();
            found.sort_by(|&a, &b| median(a).total_cmp(&median(b)));
            found
        };
        let embree = of("embree").first().copied();
        for entries in [of("bvh"), of("embree")] {
            let Some(&best) = entries.first() else { continue };
            let ratios: Vec<f64> = embree
                .map(|embree| times[embree].cpu.iter().zip(&times[best].cpu).map(|(its, own)| its / own).collect())
                .unwrap_or_default();
            let ratio = (!ratios.is_empty()).then(|| Spread::of(ratios.iter().copied()));
            rows.push(Row {
                kind: set.kind,
                backend: contenders[best].backend,
                setup,
                threads,
                mrays_per_s: mrays(median(best)),
                wall_mrays_per_s: Some(mrays(Spread::of(times[best].wall.iter().copied()).median)),
                ratio_to_embree: ratio.map(|ratio| ratio.median),
                ratio_quartiles: ratio.map(|ratio| ratio.quartiles),
                ratio_to_linear: linear.map(|linear| mrays(median(best)) / linear.mrays_per_s()),
                rays: set.len(),
                entry: contenders[best].entry,
                other_entry_mrays_per_s: entries.get(1).map(|&other| mrays(median(other))),
                ratios,
            });
        }
    }
    if let Some(linear) = linear {
        let embree = rows.iter().find(|row| row.backend == "embree").map(|row| row.mrays_per_s);
        rows.push(Row {
            kind: set.kind,
            backend: "linear",
            setup: Setup::Bare,
            threads,
            mrays_per_s: linear.mrays_per_s(),
            wall_mrays_per_s: None,
            ratio_to_embree: embree.map(|embree| linear.mrays_per_s() / embree),
            ratio_quartiles: None,
            ratio_to_linear: Some(1.0),
            rays: linear.rays,
            entry: None,
            other_entry_mrays_per_s: None,
            ratios: Vec::new(),
        });
    }
    rows
}

impl LinearTimes {
    fn mrays_per_s(&self) -> f64 {
        self.rays as f64 * 1e-6 / self.seconds.median
    }
}

/// A scene that could not be measured.
#[derive(Clone, Debug, Serialize)]
pub struct FailedScene {
    /// As the user named it.
    pub input: String,
    /// Why.
    pub error_message: String,
}

/// `bvh` against Embree ROBUST over all scenes and kinds.
#[derive(Clone, Debug, Serialize)]
pub struct BvhOverEmbree {
    /// Backends as pictures are rendered with them.
    #[serde(flatten)]
    pub prepared: Overall,
    /// Where it is worst.
    pub worst_input: String,
    /// On which rays.
    pub worst_kind: Kind,
    /// Backends alone, nothing in front.
    pub bare: Overall,
}

/// What was measured on all scenes.
#[derive(Clone, Debug, Serialize)]
pub struct RayReport {
    /// This program's version.
    pub prt: &'static str,
    /// The processor.
    pub cpu: Option<String>,
    /// What `seconds` and rates are by: `thread CPU`, or `wall` where the system does not tell.
    pub clock: &'static str,
    /// Version of Embree; null where it was not measured.
    pub embree: Option<String>,
    /// Instructions of `bvh`'s kernels.
    pub bvh_isa: &'static str,
    /// As asked for, in whole batches.
    pub rays: usize,
    /// As asked for.
    pub rounds: usize,
    /// As asked for.
    pub seed: u64,
    /// As asked for.
    pub threads: usize,
    /// In the order of the command line.
    pub scenes: Vec<SceneRays>,
    /// Null where one of the two was not measured.
    pub bvh_over_embree: Option<BvhOverEmbree>,
    /// What could not be measured.
    pub failed: Vec<FailedScene>,
}

impl RayReport {
    /// The report of `scenes` and of those that failed.
    pub fn new(settings: &RaySettings, cpu: Option<String>, scenes: Vec<SceneRays>, failed: Vec<FailedScene>) -> Self {
        let embree = settings.backends.iter().find_map(|backend| match backend {
            Backend::Embree(library) => Some(library.version().to_string()),
            _ => None,
        });
        let batch = crate::integrator::POOL;
        Self {
            prt: crate::VERSION,
            cpu,
            clock: CLOCK,
            embree,
            bvh_isa: Level::best().name(),
            rays: settings.rays.div_ceil(batch).max(1) * batch,
            rounds: settings.rounds,
            seed: settings.seed,
            threads: settings.threads,
            bvh_over_embree: overall(&scenes),
            scenes,
            failed,
        }
    }
}

fn overall(scenes: &[SceneRays]) -> Option<BvhOverEmbree> {
    let of = |setup: Setup| {
        let ratios: Vec<&[f64]> = scenes.iter().flat_map(|s| s.bvh_ratios(setup)).map(|row| &row.ratios[..]).collect();
        Overall::of(&ratios)
    };
    let all = scenes.iter().flat_map(|scene| scene.bvh_ratios(Setup::Prepared).map(move |row| (scene, row)));
    let (scene, row) = all.min_by(|a, b| {
        let ratio = |row: &Row| row.ratio_to_embree.unwrap_or(f64::INFINITY);
        ratio(a.1).total_cmp(&ratio(b.1))
    })?;
    Some(BvhOverEmbree {
        prepared: of(Setup::Prepared)?,
        worst_input: scene.input.clone(),
        worst_kind: row.kind,
        bare: of(Setup::Bare)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::linear::Linear;
    use crate::accel::{RayBatch, Triangles};

    fn contender(backend: &'static str, entry: Option<usize>, setup: Setup) -> Contender {
        Contender { backend, entry, setup, accel: Box::new(Linear::new(Triangles::default())) }
    }

    #[test]
    fn the_faster_entry_of_embree_counts_and_ratios_are_of_the_same_round() {
        let contenders = [
            contender("bvh", None, Setup::Prepared),
            contender("embree", Some(16), Setup::Prepared),
            contender("embree", Some(1), Setup::Prepared),
        ];
        let times = [[2.0, 4.0, 8.0], [5.0, 9.0, 9.0], [4.0, 8.0, 8.0]];
        let times = times.map(|cpu| Times { cpu: cpu.to_vec(), wall: vec![1.0; 3] });
        let set = RaySet { kind: Kind::Diffuse, batches: vec![RayBatch::new(2048); 2] };
        let rows = rows(&set, &contenders.iter().collect::<Vec<_>>(), &times, 1, None);
        assert_eq!(rows.iter().map(|row| row.backend).collect::<Vec<_>>(), ["bvh", "embree"]);
        let [bvh, embree] = &rows[..] else { panic!("two rows") };
        assert_eq!((embree.entry, embree.mrays_per_s), (Some(1), 4096e-6 / 8.0));
        assert_eq!(embree.other_entry_mrays_per_s, Some(4096e-6 / 9.0));
        // 4/2, 8/4, 8/8.
        assert_eq!((bvh.ratio_to_embree, bvh.ratio_quartiles), (Some(2.0), Some([1.5, 2.0])));
        assert_eq!(bvh.wall_mrays_per_s, Some(4096e-6));
    }

    #[test]
    fn a_scene_without_a_front_counts_in_both_setups_and_threads_do_not() {
        let row = |setup, threads, ratio: f64| Row {
            kind: Kind::Shadow,
            backend: "bvh",
            setup,
            threads,
            mrays_per_s: 1.0,
            wall_mrays_per_s: None,
            ratio_to_embree: Some(ratio),
            ratio_quartiles: None,
            ratio_to_linear: None,
            rays: 1,
            entry: None,
            other_entry_mrays_per_s: None,
            ratios: vec![ratio; 3],
        };
        let geometry = Geometry::default();
        let scene = |front, rows| {
            let contenders = Contenders { fast: Vec::new(), linear: None, front };
            let mut scene = SceneRays::new("a", &geometry, &contenders, Vec::new());
            scene.rows = rows;
            scene
        };
        let scenes = [
            scene(0, vec![row(Setup::Prepared, 1, 2.0), row(Setup::Prepared, 2, 9.0)]),
            scene(5, vec![row(Setup::Prepared, 1, 8.0), row(Setup::Bare, 1, 0.5)]),
        ];
        let all = overall(&scenes).unwrap();
        assert!((all.prepared.geomean - 4.0).abs() < 1e-9 && all.prepared.worst == 2.0);
        assert!((all.bare.geomean - 1.0).abs() < 1e-9 && all.bare.worst == 0.5);
        assert_eq!(all.worst_input, "a");
    }
}
