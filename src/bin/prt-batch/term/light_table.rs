//! The table of `prt-batch verify light`.

use super::text::columns;
use prt::verify::light::{LightReport, Report};

const HEAD: [&str; 7] = ["scene", "test", "exact", "off by", "standard error", "z", "verdict"];

/// A row for each scene.
pub fn text(report: &Report) -> String {
    let mut rows = vec![HEAD.map(str::to_owned)];
    rows.extend(report.cases.iter().map(row));
    let Report { seed, seeds, samples, .. } = report;
    let mut text = format!("seeds {seed} to {}; {samples} samples a pixel or more\n\n", seed + seeds - 1);
    text += &columns(&rows, |i| i < 2 || i == HEAD.len() - 1);
    let wrong = report.cases.iter().filter(|case| case.problem.is_some()).count();
    text += &format!(
        "\n{} scenes, {wrong} wrong\n{}\n",
        report.cases.len(),
        if report.passed { "passed" } else { "FAILED" }
    );
    text
}

fn row(case: &LightReport) -> [String; HEAD.len()] {
    [
        case.name.to_owned(),
        case.id.to_owned(),
        format!("{:.5e}", case.exact),
        format!("{:+.4} %", 100.0 * case.bias),
        format!("{:.4} %", 100.0 * case.standard_error),
        format!("{:+.1}", case.z),
        if case.problem.is_none() { "ok" } else { "WRONG" }.to_owned(),
    ]
}
