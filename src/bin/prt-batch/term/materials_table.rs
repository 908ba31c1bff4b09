//! The table of `prt-batch verify materials`.

use super::text::{columns, printable};
use prt::verify::materials::{MaterialReport, Report};

const HEAD: [&str; 8] =
    ["material", "views", "albedo", "chi-square p", "integral", "agreement", "reciprocity", "verdict"];

/// A row for each material (`all`), or for those that break a limit, and the worst of all.
pub fn text(report: &Report, all: bool) -> String {
    let broken = report.materials.iter().filter(|m| !m.problems.is_empty()).count();
    let mut rows = vec![HEAD.map(str::to_owned)];
    rows.extend(report.materials.iter().filter(|m| all || !m.problems.is_empty()).map(row));
    let mut text = format!("seed {}; {} samples of each distribution\n\n", report.seed, report.samples);
    if rows.len() > 1 {
        text += &columns(&rows, |i| i == 0 || i == HEAD.len() - 1);
        text += "\n";
    }
    let tested = report.materials.iter().filter(|m| m.p_value.is_some()).count();
    let views: usize = report.materials.iter().map(|m| m.views).sum();
    text += &format!(
        "{} materials, {views} views; the distribution of samples of {tested} materials is tested; {broken} break a limit\n{}\n",
        report.materials.len(),
        if report.passed { "passed" } else { "FAILED" }
    );
    text
}

fn row(material: &MaterialReport) -> [String; HEAD.len()] {
    let [least, greatest] = material.albedo;
    let verdict = match (material.problems.is_empty(), material.exceptions.is_empty()) {
        (false, _) => "BREAKS",
        (true, true) => "ok",
        (true, false) => "ok, with exceptions",
    };
    [
        printable(&material.name),
        material.views.to_string(),
        format!("{least:.4} to {greatest:.4}"),
        material.p_value.map_or("-".to_owned(), |p| format!("{p:.1e}")),
        format!("{:.1e}", material.integral),
        format!("{:.1e}", material.agreement),
        material.reciprocity.map_or("-".to_owned(), |r| format!("{r:.1e}")),
        verdict.to_owned(),
    ]
}
