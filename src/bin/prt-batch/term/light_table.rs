//! The table of `prt-batch verify light`.

use super::text::{pad_end, pad_start, width};
use prt::verify::light::{LightReport, Report};

const HEAD: [&str; 7] = ["scene", "test", "exact", "off by", "standard error", "z", "verdict"];

/// A row for each scene.
pub fn text(report: &Report) -> String {
    let mut rows = vec![HEAD.map(str::to_owned)];
    rows.extend(report.cases.iter().map(row));
    let widths: [usize; HEAD.len()] = std::array::from_fn(|i| rows.iter().map(|row| width(&row[i])).max().unwrap_or(0));
    let Report { seed, seeds, samples, .. } = report;
    let mut text = format!("seeds {seed} to {}; {samples} samples a pixel or more\n\n", seed + seeds - 1);
    for row in &rows {
        let is_word = |i: usize| i < 2 || i == HEAD.len() - 1;
        let cell = |i: usize| if is_word(i) { pad_end(&row[i], widths[i]) } else { pad_start(&row[i], widths[i]) };
        text += (0..HEAD.len()).map(cell).collect::<Vec<_>>().join("  ").trim_end();
        text += "\n";
    }
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
