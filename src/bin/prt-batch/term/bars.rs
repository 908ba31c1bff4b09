//! The lines of bars: one for each image under way, and one for the run. How they get to the terminal: `screen.rs`.

use super::board::{ImageView, View};
use super::style::Paint;
use super::text::{cut, mrays_per_s, pad_end, pad_start, samples_per_s, shorten, whole, width};
use prt::render::Phase;

/// Columns at the right that stay free: a terminal shows what is typed, such as `^C`, behind the last line, and would
/// tear the bars if that did not fit.
const FREE: usize = 3;
/// The longest bar, columns.
const LONGEST_BAR: usize = 40;
/// The longest name, columns.
const LONGEST_NAME: usize = 36;

/// What bars are made of.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    pub paint: Paint,
    pub done: &'static str,
    pub left: &'static str,
    /// In place of the middle of long names.
    pub gap: &'static str,
}

impl Look {
    /// For terminals that show more than ASCII.
    pub fn unicode(paint: Paint) -> Self {
        Self { paint, done: "█", left: "░", gap: "…" }
    }

    /// For all terminals.
    pub fn ascii(paint: Paint) -> Self {
        Self { paint, done: "#", left: "-", gap: ".." }
    }

    /// As the locale has it, given the value of an environment variable.
    pub fn of_locale(paint: Paint, variable: impl Fn(&str) -> Option<String>) -> Self {
        let set = |name: &&str| variable(name).filter(|value| !value.is_empty());
        let locale = ["LC_ALL", "LC_CTYPE", "LANG"].iter().find_map(set).unwrap_or_default().to_ascii_lowercase();
        let is_unicode = locale.contains("utf-8") || locale.contains("utf8");
        if is_unicode { Self::unicode(paint) } else { Self::ascii(paint) }
    }
}

/// What there is room for, from the widest to the narrowest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
enum Room {
    Percent,
    Phase,
    Left,
    Bar,
    Rays,
    Samples,
}

impl Room {
    const ALL: [Self; 6] = [Self::Samples, Self::Rays, Self::Bar, Self::Left, Self::Phase, Self::Percent];

    /// Columns of everything but the name and what the bar has beyond its least, with the spaces before them.
    fn fixed(self) -> usize {
        let part = |least, columns| if self >= least { columns + 2 } else { 0 };
        part(Self::Percent, 5)
            + part(Self::Phase, 9)
            + part(Self::Left, 15)
            + part(Self::Bar, Self::LEAST_BAR)
            + part(Self::Rays, 11)
            + part(Self::Samples, 15)
    }

    const LEAST_BAR: usize = 10;
    const LEAST_NAME: usize = 12;
}

/// The lines for a terminal of `columns`; one at least, none of them wider.
pub fn lines(view: &View, columns: usize, look: Look) -> Vec<String> {
    let columns = columns.saturating_sub(FREE).max(1);
    let names = view.images.iter().map(|image| width(&image.name)).max().unwrap_or_default().clamp(1, LONGEST_NAME);
    let least = names.min(Room::LEAST_NAME);
    let room = Room::ALL.into_iter().find(|room| room.fixed() + least <= columns).unwrap_or(Room::Percent);
    let name = names.min(columns.saturating_sub(room.fixed()));
    let bar = (columns.saturating_sub(room.fixed() + name) + Room::LEAST_BAR).min(LONGEST_BAR);
    let mut lines: Vec<_> = view.images.iter().map(|image| image_line(image, room, name, bar, columns, look)).collect();
    if view.all != 1 || lines.is_empty() {
        lines.push(run_line(view, columns, bar, look));
    }
    lines
}

fn image_line(image: &ImageView, room: Room, name: usize, bar: usize, columns: usize, look: Look) -> String {
    // What is written was rendered; before it is rendered there is nothing to show.
    let share = image.share().filter(|_| image.phase >= Phase::Rendering);
    let rate = |rate: Option<f64>, show: fn(f64) -> String| rate.map_or("-".into(), show);
    let left = image.left.map_or("- left".into(), |left| format!("{} left", whole(left)));
    let percent = share.map_or("-".into(), |share| format!("{:.0} %", (100.0 * share).floor()));
    if room == Room::Percent && columns < name + 7 {
        return cut(&percent, columns);
    }
    let mut line = pad_end(&shorten(&image.name, name, look.gap), name);
    if room >= Room::Phase {
        line += &format!("  {}", pad_end(image.phase.name(), 9));
    }
    if room >= Room::Bar {
        line += &format!("  {}", draw(share, bar, look));
    }
    line += &format!("  {}", pad_start(&percent, 5));
    if room >= Room::Samples {
        line += &format!("  {}", pad_start(&rate(image.samples_per_s, samples_per_s), 15));
    }
    if room >= Room::Rays {
        line += &format!("  {}", pad_start(&rate(image.mrays_per_s, mrays_per_s), 11));
    }
    if room >= Room::Left {
        line += &format!("  {}", pad_start(&left, 15));
    }
    line
}

fn run_line(view: &View, columns: usize, bar: usize, look: Look) -> String {
    let counts = format!("{} of {} images", view.finished, view.all);
    let left = view.left.map_or("- left".into(), |left| format!("about {} left", whole(left)));
    let times = format!("{}, {left}", whole(view.elapsed));
    let current = view.foremost().and_then(ImageView::share).unwrap_or(0.0);
    let share = (view.all > 0).then(|| ((view.finished as f64 + current) / view.all as f64).min(1.0));
    let full = width(&counts) + 2 + bar + 2 + width(&times);
    match columns {
        c if c >= full => format!("{counts}  {}  {times}", draw(share, bar, look)),
        c if c >= width(&counts) + 2 + width(&times) => format!("{counts}  {times}"),
        c => {
            let short = format!("{}/{}", view.finished, view.all);
            let left = view.left.map_or(String::new(), |left| format!("  {} left", whole(left)));
            if width(&short) + width(&left) <= c { short + &left } else { cut(&short, c) }
        }
    }
}

fn draw(share: Option<f64>, columns: usize, look: Look) -> String {
    let done = (share.unwrap_or(0.0) * columns as f64).floor() as usize;
    let (done, left) = (look.done.repeat(done), look.left.repeat(columns - done.min(columns)));
    look.paint.done(&done) + &look.paint.dim(&left)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        let image = |id, name: &str, phase| ImageView { id, name: name.into(), phase, ..Default::default() };
        View {
            finished: 12,
            all: 500,
            elapsed: 63.0,
            left: Some(7500.0),
            images: vec![
                ImageView {
                    done: 100,
                    total: 100,
                    ..image(11, "shots/a rather long name of a scene.Main", Phase::Writing)
                },
                ImageView {
                    done: 439,
                    total: 1000,
                    samples_per_s: Some(12_345_678.0),
                    mrays_per_s: Some(82.1),
                    left: Some(63.4),
                    ..image(12, "cornell", Phase::Rendering)
                },
                image(13, "光の部屋", Phase::Loading),
            ],
        }
    }

    fn shown(columns: usize) -> String {
        let lines = lines(&view(), columns, Look::unicode(Paint::OFF));
        assert!(lines.iter().all(|line| width(line) <= columns - FREE), "{lines:#?}");
        lines.join("\n")
    }

    #[test]
    fn a_wide_terminal_has_room_for_everything() {
        assert_eq!(
            shown(130),
            "\
shots/a rat…ong name of a scene.Main  writing    ████████████████████████  100 %                -            -           - left
cornell                               rendering  ██████████░░░░░░░░░░░░░░   43 %  12.3 Msamples/s    82 Mray/s  1 min 03 s left
光の部屋                              loading    ░░░░░░░░░░░░░░░░░░░░░░░░      -                -            -           - left
12 of 500 images  ░░░░░░░░░░░░░░░░░░░░░░░░  1 min 03 s, about 2 h 05 min left"
        );
    }

    #[test]
    fn a_terminal_of_80_columns_keeps_name_phase_bar_percent_and_end() {
        assert_eq!(
            shown(80),
            "\
shots… scene.Main  writing    ██████████  100 %            -           - left
cornell            rendering  ████░░░░░░   43 %    82 Mray/s  1 min 03 s left
光の部屋           loading    ░░░░░░░░░░      -            -           - left
12 of 500 images  ░░░░░░░░░░  1 min 03 s, about 2 h 05 min left"
        );
    }

    #[test]
    fn a_terminal_of_20_columns_keeps_name_and_percent() {
        assert_eq!(
            shown(20),
            "\
sho…e.Main  100 %
cornell      43 %
光の部屋        -
12/500"
        );
    }

    #[test]
    fn no_line_is_too_wide_for_any_terminal() {
        for columns in 4..200 {
            shown(columns);
        }
    }

    #[test]
    fn one_image_has_no_line_for_the_run_and_nothing_is_promised_that_is_not_known() {
        let images = vec![ImageView { name: "a".into(), phase: Phase::Building, ..Default::default() }];
        let view = View { all: 1, images, ..View::default() };
        assert_eq!(lines(&view, 40, Look::ascii(Paint::OFF)), ["a  building       -           - left"]);
    }

    #[test]
    fn other_locales_get_ascii() {
        let done = |pairs: &'static [(&str, &str)]| {
            let find = |name: &str| pairs.iter().find(|(n, _)| *n == name).map(|(_, value)| (*value).to_owned());
            Look::of_locale(Paint::OFF, find).done
        };
        assert_eq!(done(&[("LANG", "de_DE.UTF-8")]), "█");
        assert_eq!(done(&[("LANG", "C.utf8"), ("LC_ALL", "")]), "█");
        assert_eq!(done(&[("LANG", "de_DE.UTF-8"), ("LC_ALL", "C")]), "#");
        assert_eq!(done(&[]), "#");
    }
}
