//! The table of `prt-batch verify hits`.

use super::text::{pad_end, pad_start, printable, width};
use prt::verify::report::{Fault, KindReport, Report, SubjectReport, Tally};

const HEAD: [&str; 10] =
    ["mesh", "kind", "rays", "must hit", "missed", "phantom", "misplaced", "occluded", "differ", "unexplained"];

/// Rows for all kinds of a subject, for those kinds about which there is something to say (or all), and for backends.
pub fn text(report: &Report, verbose: bool) -> String {
    let mut rows = vec![HEAD.map(str::to_owned)];
    for subject in &report.subjects {
        if let Some(all) = together(subject) {
            rows.push(row(&subject.name, "all", &all));
        }
        for kind in subject.kinds.iter().filter(|kind| verbose || is_notable(kind)) {
            rows.push(row("", kind.kind.name(), kind));
        }
    }
    let mut text = format!("seed {}; faults and differences per million rays, of the worst backend\n\n", report.seed);
    text += &lines(&rows);
    text += "\nper million rays, all meshes\n\n";
    let names = ["backend", "rays", "hits", "missed", "phantom", "misplaced", "occluded"].map(str::to_owned);
    let mut rows = vec![names];
    for (name, rays, tally) in backends(report) {
        let counts = Fault::ALL.map(|fault| per_million(tally.of(fault), rays));
        let [missed, phantom, misplaced, occluded] = counts;
        rows.push([name.to_owned(), rays.to_string(), tally.hits.to_string(), missed, phantom, misplaced, occluded]);
    }
    text += &lines(&rows);
    for subject in &report.subjects {
        subject.left_out.iter().for_each(|why| text += &format!("\nleft out of {}: {why}", printable(&subject.name)));
    }
    let Report { rays, usual_rays, usual_hit_or_miss, .. } = report;
    text += &format!(
        "\n{rays} rays; of {usual_rays} usual ones (camera, random, bounce, shadow) the backends disagree about hit or \
         miss of {usual_hit_or_miss}\n{}\n",
        if report.passed { "passed" } else { "FAILED" }
    );
    text
}

/// Whether anything of a kind is not as it should be.
fn is_notable(kind: &KindReport) -> bool {
    let faults = |tally: &Tally| Fault::ALL.iter().any(|fault| tally.of(*fault) > 0);
    kind.contenders.iter().any(faults) || kind.disagreements > kind.explained
}

/// All kinds of a subject in one.
fn together(subject: &SubjectReport) -> Option<KindReport> {
    let mut kinds = subject.kinds.iter().cloned();
    let mut all = kinds.next()?;
    kinds.for_each(|kind| all.add(kind));
    Some(all)
}

/// Each way of use with the rays it traced and what it did.
fn backends(report: &Report) -> Vec<(&'static str, usize, Tally)> {
    let mut all: Vec<(&'static str, usize, Tally)> = Vec::new();
    for kind in report.subjects.iter().flat_map(|s| &s.kinds) {
        for tally in &kind.contenders {
            match all.iter_mut().find(|(name, ..)| *name == tally.name) {
                Some((_, rays, sum)) => {
                    *rays += kind.rays;
                    sum.add(tally.clone());
                }
                None => all.push((tally.name, kind.rays, tally.clone())),
            }
        }
    }
    all
}

/// `0`, or such as `12.3`.
fn per_million(count: usize, rays: usize) -> String {
    if count == 0 { "0".into() } else { format!("{:.1}", 1e6 * count as f64 / rays as f64) }
}

fn row(name: &str, kind: &str, report: &KindReport) -> [String; 10] {
    let most = |fault| report.contenders.iter().map(|tally| tally.of(fault)).max().unwrap_or(0);
    let [missed, phantom, misplaced, occluded] = Fault::ALL.map(|fault| per_million(most(fault), report.rays));
    [
        printable(name),
        kind.to_owned(),
        report.rays.to_string(),
        report.must_hit.to_string(),
        missed,
        phantom,
        misplaced,
        occluded,
        per_million(report.disagreements, report.rays),
        per_million(report.disagreements - report.explained, report.rays),
    ]
}

/// Words to the left, numbers to the right.
fn lines<const N: usize>(rows: &[[String; N]]) -> String {
    let widths: [usize; N] = std::array::from_fn(|i| rows.iter().map(|row| width(&row[i])).max().unwrap_or(0));
    let is_number = |cell: &str| cell.starts_with(|c: char| c.is_ascii_digit());
    let numbers: [bool; N] = std::array::from_fn(|i| rows.iter().skip(1).any(|row| is_number(&row[i])) && i > 0);
    let mut text = String::new();
    for row in rows {
        let cell = |i: usize| if numbers[i] { pad_start(&row[i], widths[i]) } else { pad_end(&row[i], widths[i]) };
        text += (0..N).map(cell).collect::<Vec<_>>().join("  ").trim_end();
        text += "\n";
    }
    text
}
