//! What `bench rays` prints without `--json`.

use prt::batch::memory::amount;
use prt::bench::{RayReport, Row, SceneRays, Setup};
use std::fmt::Write;

/// A scene's builds and rays.
pub fn scene(scene: &SceneRays) -> String {
    let mut text = format!("{}: {} triangles", scene.input, scene.triangles);
    if scene.placements > 0 {
        let _ = write!(text, ", {} placements", scene.placements);
    }
    if scene.front_triangles > 0 {
        let _ = write!(text, ", {} of them in front", scene.front_triangles);
    }
    text += "\n  build    CPU s  Mtri/s  of embree's  bytes/tri       bytes   wall s\n";
    for build in &scene.build {
        let _ = writeln!(
            text,
            "  {:7}{:7.3}{:8.2}{:>13}{:11.1}{:>12}{:9.3} ({} thread{}){}",
            build.backend,
            build.seconds,
            build.mtri_per_s,
            optional(build.ratio_to_embree),
            build.bytes_per_triangle,
            amount(build.bytes as u64),
            build.wall_seconds,
            build.threads,
            if build.threads == 1 { "" } else { "s" },
            match build.split_references {
                0 => String::new(),
                n => format!(", long triangles in {n} more parts"),
            },
        );
    }
    text += "  rays        setup     threads  backend  Mray/s   wall  of embree's  quartiles    of linear's\n";
    for row in &scene.rows {
        text += &line(row);
    }
    if let Some((wrong, ties)) = scene.disagreements_per_million.zip(scene.ties_per_million) {
        let _ = writeln!(text, "  hits: bvh and embree disagree on {wrong:.2} of a million rays; {ties:.2} are ties");
    }
    if let Some(wrong) = scene.linear_disagreements_per_million {
        let _ = writeln!(text, "  hits: {wrong:.2} of a million rays are not as by brute force");
    }
    text + "\n"
}

fn line(row: &Row) -> String {
    let setup = match row.setup {
        Setup::Prepared => "prepared",
        Setup::Bare => "bare",
    };
    let quartiles = row.ratio_quartiles.filter(|_| row.backend != "embree");
    let entry = row.entry.map_or_else(String::new, |entry| {
        let other = row.other_entry_mrays_per_s.map_or_else(String::new, |other| format!(", the other {other:.2}"));
        format!("  {entry} rays a call{other}")
    });
    let text = format!(
        "  {:<11} {setup:<9}{:>7}  {:<7}{:>8.2}{:>7}{:>13}  {:<11}{:>13}{entry}",
        row.kind.name(),
        row.threads,
        row.backend,
        row.mrays_per_s,
        optional(row.wall_mrays_per_s),
        optional(row.ratio_to_embree.filter(|_| row.backend != "embree")),
        quartiles.map_or_else(String::new, |[low, high]| format!("{low:.2}-{high:.2}")),
        row.ratio_to_linear.filter(|_| row.backend != "linear").map_or_else(String::new, |r| format!("{r:.0}x")),
    );
    text.trim_end().to_owned() + "\n"
}

fn optional(number: Option<f64>) -> String {
    number.map_or_else(|| "-".into(), |number| format!("{number:.2}"))
}

/// All scenes together.
pub fn overall(report: &RayReport) -> String {
    let mut text = format!(
        "{} rays of each kind, {} rounds, median; by {} time; seed {}\n",
        report.rays, report.rounds, report.clock, report.seed
    );
    if let Some(ratio) = &report.bvh_over_embree {
        for (setup, all) in [("prepared", &ratio.prepared), ("bare", &ratio.bare)] {
            let [low, high] = all.spread;
            let _ = write!(
                text,
                "bvh over embree robust, 1 thread, {setup}: geometric mean {:.3} ({low:.3}-{high:.3}), worst {:.3}",
                all.geomean, all.worst
            );
            if setup == "prepared" {
                let _ = write!(text, " ({} rays of {})", ratio.worst_kind.name(), ratio.worst_input);
            }
            text += "\n";
        }
    }
    text
}
