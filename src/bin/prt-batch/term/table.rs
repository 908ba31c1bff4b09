//! The table at the end of a run of several images.

use super::image_lines::{name, size};
use super::style::Paint;
use super::text::{cut, mrays, pad_end, pad_start, printable, seconds, shorten, width};
use prt::batch::report::{EstimatedError, ImageReport, Status};

/// How a table is made.
#[derive(Clone, Copy, Debug)]
pub struct Format {
    /// Of the terminal; `None` = any width.
    pub columns: Option<usize>,
    /// Rows, but for failed images, which are always there.
    pub most: usize,
    pub paint: Paint,
    /// In place of the middle of long names.
    pub gap: &'static str,
}

const HEAD: [&str; 8] = ["status", "image", "size", "spp", "time", "Mray/s", "error", "warnings"];
/// The column of names.
const IMAGE: usize = 1;
/// The shortest that names are cut to.
const LEAST_NAME: usize = 16;
/// Columns that a terminal too narrow for all goes without: error, Mray/s, spp, size, time, warnings.
const FIRST_LOST: [usize; 6] = [6, 5, 3, 2, 4, 7];

/// The lines of the table; of what was left out because the run ended there are none. `report` is where all are told.
pub fn lines(images: &[ImageReport], format: Format, report: &str) -> Vec<String> {
    let told = || images.iter().filter(|image| image.status != Status::Interrupted);
    let failed = told().filter(|image| image.status == Status::Failed).count();
    let mut room = format.most.saturating_sub(failed);
    let mut shown = Vec::new();
    for image in told() {
        let is_failed = image.status == Status::Failed;
        if is_failed || room > 0 {
            room -= usize::from(!is_failed);
            shown.push(image);
        }
    }
    let cells: Vec<_> = shown.iter().map(|image| row(image)).collect();
    let mut widths = HEAD.map(width);
    for (row, image) in cells.iter().zip(&shown) {
        // The message of a failed image runs on over the columns of numbers.
        let columns = if image.status == Status::Failed { IMAGE + 1 } else { HEAD.len() };
        widths.iter_mut().zip(row).take(columns).for_each(|(w, cell)| *w = (*w).max(width(cell)));
    }
    let mut kept: Vec<usize> = (0..HEAD.len()).collect();
    if let Some(columns) = format.columns {
        let others = |kept: &[usize]| kept.iter().map(|&i| if i == IMAGE { 0 } else { widths[i] + 2 }).sum::<usize>();
        // Rather than names, what is known of no image.
        if others(&kept) + widths[IMAGE] > columns {
            kept.retain(|&i| i < 2 || cells.iter().any(|row| row[i] != "-"));
        }
        for lost in FIRST_LOST {
            if others(&kept) + LEAST_NAME > columns {
                kept.retain(|&i| i != lost);
            }
        }
        widths[IMAGE] = widths[IMAGE].min(columns.saturating_sub(others(&kept)).max(LEAST_NAME));
    }
    let numbers = |cells: &[String; 8]| numbers(cells, &kept, widths, format.gap);

    let end = |line: &str| format.columns.map_or(line.to_owned(), |columns| cut(line, columns));
    let mut lines = vec![format.paint.dim(&end(&numbers(&HEAD.map(str::to_owned))))];
    for (cells, image) in cells.iter().zip(shown) {
        let status = pad_end(&cells[0], widths[0]);
        let line = match image.status {
            Status::Failed => {
                let message = message(image);
                let message = if message.is_empty() { message } else { format!("  {message}") };
                format!(
                    "{status}  {}{message}",
                    pad_end(&shorten(&cells[IMAGE], widths[IMAGE], format.gap), widths[IMAGE])
                )
            }
            _ => numbers(cells),
        };
        // The status is first, so that cutting the end leaves its colour whole.
        let line = end(line.trim_end());
        let painted = format.paint.status(image.status, line.get(..status.len()).unwrap_or(&line).trim_end());
        lines.push(match line.get(status.trim_end().len()..) {
            Some(rest) => painted + rest,
            None => painted,
        });
    }
    match told().count() - cells.len() {
        0 => {}
        more => lines.push(format!("{} and {more} more, all in {report}", format.gap)),
    }
    lines
}

/// The first line of why an image failed, without its name, which stands beside it.
fn message(image: &ImageReport) -> String {
    let text = image.error_message.as_deref().unwrap_or_default();
    let first = text.lines().next().unwrap_or_default();
    let own = first.strip_prefix(image.input.as_str()).and_then(|rest| rest.strip_prefix(": "));
    printable(own.unwrap_or(first))
}

fn row(image: &ImageReport) -> [String; 8] {
    let none = || "-".to_owned();
    let is_rendered = image.status == Status::Rendered;
    let spp = if is_rendered || image.status == Status::UpToDate { image.spp.to_string() } else { none() };
    let warnings = image.warnings.len();
    let error = image.estimated_error.as_ref().map_or_else(none, EstimatedError::percent);
    [
        image.status.word().to_owned(),
        name(image),
        size(image).unwrap_or_else(none),
        spp,
        // What is known of one that was up to date is from the run that rendered it.
        if image.status == Status::UpToDate { none() } else { seconds(image.seconds.total) },
        image.mrays_per_s.filter(|_| is_rendered).map_or_else(none, mrays),
        error,
        if warnings == 0 { none() } else { warnings.to_string() },
    ]
}

/// The cells of `kept`: words to the left, numbers to the right.
fn numbers(cells: &[String; 8], kept: &[usize], widths: [usize; 8], gap: &str) -> String {
    let cell = |&i: &usize| match i {
        IMAGE => pad_end(&shorten(&cells[i], widths[i], gap), widths[i]),
        0 => pad_end(&cells[i], widths[i]),
        _ => pad_start(&cells[i], widths[i]),
    };
    kept.iter().map(cell).collect::<Vec<_>>().join("  ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use prt::batch::report::{Outputs, Seconds};

    fn rendered(stem: &str, seconds: f64) -> ImageReport {
        ImageReport {
            input: format!("scenes/{stem}.gltf"),
            status: Status::Rendered,
            outputs: Outputs { exr: Some(format!("renders/{stem}.exr")), ..Outputs::default() },
            width: Some(1280),
            height: Some(720),
            spp: 64,
            seconds: Seconds { total: seconds, ..Seconds::default() },
            mrays_per_s: Some(82.1),
            ..ImageReport::default()
        }
    }

    fn failed(stem: &str) -> ImageReport {
        let input = format!("scenes/{stem}.gltf");
        let error = format!("{input}: /meshes/0: there is no such mesh\n  Allowed: none.");
        ImageReport { input, status: Status::Failed, error_message: Some(error), ..ImageReport::default() }
    }

    fn table(images: &[ImageReport], columns: Option<usize>, most: usize) -> String {
        let lines = lines(images, Format { columns, most, paint: Paint::OFF, gap: ".." }, "renders/batch.json");
        assert!(
            columns.is_none_or(|columns| lines[..lines.len() - 1].iter().all(|l| width(l) <= columns)),
            "{lines:#?}"
        );
        lines.join("\n") + "\n"
    }

    fn several() -> Vec<ImageReport> {
        let mut warned = rendered("光の部屋", 125.0);
        warned.warnings = vec!["a".into(), "b".into()];
        let up_to_date = ImageReport { status: Status::UpToDate, ..rendered("old", 0.001) };
        let left_out = ImageReport { status: Status::Interrupted, ..ImageReport::default() };
        vec![rendered("a rather long name of a scene", 3.1), warned, failed("broken"), up_to_date, left_out]
    }

    #[test]
    fn a_table_lines_up_whatever_the_script() {
        assert_eq!(
            table(&several(), None, 40),
            "\
status      image                                          size  spp        time  Mray/s  error  warnings
rendered    renders/a rather long name of a scene.exr  1280x720   64       3.1 s      82      -         -
rendered    renders/光の部屋.exr                       1280x720   64  2 min 05 s      82      -         2
failed      scenes/broken.gltf                         /meshes/0: there is no such mesh
up to date  renders/old.exr                            1280x720   64           -       -      -         -
"
        );
    }

    #[test]
    fn a_narrow_terminal_shortens_names_in_the_middle_and_messages_at_the_end() {
        assert_eq!(
            table(&several(), Some(64), 40),
            "\
status      image                     size        time  warnings
rendered    render.. a scene.exr  1280x720       3.1 s         -
rendered    renders/光の部屋.exr  1280x720  2 min 05 s         2
failed      scenes/broken.gltf    /meshes/0: there is no such me
up to date  renders/old.exr       1280x720           -         -
"
        );
    }

    #[test]
    fn of_many_images_some_are_shown_and_all_failed_ones() {
        let mut images: Vec<_> = (0..500).map(|i| rendered(&i.to_string(), 1.0)).collect();
        (images[7], images[450]) = (failed("7"), failed("450"));
        let text = table(&images, Some(100), 40);
        assert_eq!(text.lines().count(), 1 + 40 + 1);
        assert!(text.contains("scenes/7.gltf") && text.contains("scenes/450.gltf"), "{text}");
        assert!(text.ends_with(".. and 460 more, all in renders/batch.json\n"), "{text}");
        let bad: Vec<_> = (0..100).map(|i| failed(&i.to_string())).collect();
        assert_eq!(table(&bad, Some(100), 40).lines().count(), 101, "failed ones are always shown");
    }

    #[test]
    fn only_the_status_has_a_colour() {
        let format = Format { columns: Some(80), most: 40, paint: Paint::ON, gap: ".." };
        let text = lines(&[failed("a")], format, "")[1].clone();
        assert!(text.starts_with("\u{1b}[1m\u{1b}[31mfailed\u{1b}[0m  scenes/a.gltf"), "{text:?}");
    }
}
