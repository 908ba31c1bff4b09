//! The table of `prt-batch verify shapes`.

use super::text::columns;
use prt::verify::shapes::{Report, Row};

const HEAD: [&str; 9] =
    ["profile", "rays", "crossings", "missed", "not nearest", "extra", "disagree", "worst t", "Mray/s"];

/// A row for each profile.
pub fn text(report: &Report) -> String {
    let mut rows = vec![HEAD.map(str::to_owned)];
    rows.extend(report.profiles.iter().map(row));
    let mut text = format!("seed {}; {} random profiles\n\n", report.seed, report.random);
    text += &columns(&rows, |i| i == 0);
    let verdict = if report.passed { "passed" } else { "FAILED" };
    text += &format!("\n{} problems\n{verdict}\n", report.problems.len());
    text
}

fn row(row: &Row) -> [String; HEAD.len()] {
    [
        row.name.clone(),
        row.rays.to_string(),
        row.crossings.to_string(),
        row.missed.to_string(),
        row.wrong_nearest.to_string(),
        row.extra.to_string(),
        row.disagreements.to_string(),
        format!("{:.1e}", row.worst_t),
        format!("{:.2}", row.mrays_per_s),
    ]
}
