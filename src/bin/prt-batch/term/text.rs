//! Numbers, durations and names as they are shown, and their width in columns of a terminal.

pub use prt::batch::report::seconds;
use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

/// Columns that `text` takes; it must not hold escape sequences.
pub fn width(text: &str) -> usize {
    text.width()
}

/// `text` with spaces behind it up to `columns`.
pub fn pad_end(text: &str, columns: usize) -> String {
    format!("{text}{}", " ".repeat(columns.saturating_sub(width(text))))
}

/// `text` with spaces before it up to `columns`.
pub fn pad_start(text: &str, columns: usize) -> String {
    format!("{}{text}", " ".repeat(columns.saturating_sub(width(text))))
}

/// `rows` below each other, two spaces between columns: those of words from the left, the others from the right.
pub fn columns<const N: usize>(rows: &[[String; N]], is_word: impl Fn(usize) -> bool) -> String {
    let widths: [usize; N] = std::array::from_fn(|i| rows.iter().map(|row| width(&row[i])).max().unwrap_or(0));
    let pad = |row: &[String; N], i: usize| match is_word(i) {
        true => pad_end(&row[i], widths[i]),
        false => pad_start(&row[i], widths[i]),
    };
    let line = |row| (0..N).map(|i| pad(row, i)).collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n";
    rows.iter().map(line).collect()
}

/// The longest beginning of `chars` that fits into `columns`, and its width.
fn beginning(chars: impl Iterator<Item = char>, columns: usize) -> (Vec<char>, usize) {
    let (mut taken, mut used) = (Vec::new(), 0);
    for c in chars {
        let wide = c.width().unwrap_or(0);
        if used + wide > columns {
            break;
        }
        used += wide;
        taken.push(c);
    }
    (taken, used)
}

/// `text`, its end cut off if it takes more than `columns`.
pub fn cut(text: &str, columns: usize) -> String {
    if width(text) <= columns { text.to_owned() } else { beginning(text.chars(), columns).0.into_iter().collect() }
}

/// `text`, with `gap` in place of its middle if it takes more than `columns`. Of names the end tells more than the
/// beginning, and so more of it is kept.
pub fn shorten(text: &str, columns: usize, gap: &str) -> String {
    if width(text) <= columns {
        return text.to_owned();
    }
    let Some(room) = columns.checked_sub(width(gap)) else { return cut(text, columns) };
    let (head, used) = beginning(text.chars(), room / 3);
    let (tail, _) = beginning(text.chars().rev(), room - used);
    head.into_iter().chain(gap.chars()).chain(tail.into_iter().rev()).collect()
}

/// `text` without what would move the cursor: names of files may hold anything.
pub fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '?' } else { c }).collect()
}

/// `text` with every line after the first indented by two spaces, where it is not.
pub fn indented(text: &str) -> String {
    let line =
        |line: &str| if line.starts_with(' ') || line.is_empty() { line.to_owned() } else { format!("  {line}") };
    let mut lines = text.lines();
    let first = lines.next().unwrap_or_default().to_owned();
    lines.fold(first, |all, next| all + "\n" + &line(next))
}

/// A duration that goes on, such as `9 s`, `1 min 03 s`, `44 min`, `2 h 05 min`.
pub fn whole(seconds: f64) -> String {
    let s = seconds.max(0.0).round() as u64;
    match s {
        0..60 => format!("{s} s"),
        60..600 => format!("{} min {:02} s", s / 60, s % 60),
        600..3600 => format!("{} min", s / 60),
        _ => format!("{} h {:02} min", s / 3600, s / 60 % 60),
    }
}

/// `12.3 Msamples/s`.
pub fn samples_per_s(rate: f64) -> String {
    match rate {
        r if r < 999.5 => format!("{r:.0} samples/s"),
        r if r < 999.95e3 => format!("{:.1} ksamples/s", r * 1e-3),
        r => format!("{:.1} Msamples/s", r * 1e-6),
    }
}

/// `8.21 Mray/s`, `82 Mray/s`.
pub fn mrays_per_s(rate: f64) -> String {
    format!("{} Mray/s", mrays(rate))
}

/// The number of [`mrays_per_s`].
pub fn mrays(rate: f64) -> String {
    if rate < 10.0 { format!("{rate:.2}") } else { format!("{rate:.0}") }
}

/// `1 image`, `2 images`.
pub fn count(n: u64, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_shortened_in_the_middle_by_their_width_on_the_terminal() {
        assert_eq!(shorten("cornell", 7, ".."), "cornell");
        assert_eq!(shorten("a/very/long/name.gltf", 12, ".."), "a/v..me.gltf");
        // Wide characters take two columns; what does not fit is left out.
        assert_eq!(shorten("光光光光光光", 7, "…"), "光…光光");
        assert_eq!(width(&shorten("光光光光光光", 7, "…")), 7);
        for columns in 0..20 {
            assert!(width(&shorten("mes scènes 光/été 1.gltf", columns, "..")) <= columns);
        }
    }

    #[test]
    fn durations_are_told_as_exactly_as_they_matter() {
        let told = [0.003, 0.0996, 3.12, 99.94, 99.96, 3599.4, 3600.0, 1e5].map(seconds);
        assert_eq!(
            told,
            ["3 ms", "0.1 s", "3.1 s", "99.9 s", "1 min 40 s", "59 min 59 s", "1 h 00 min", "27 h 46 min"]
        );
        assert_eq!([0.4, 59.6, 2640.0, 7500.0].map(whole), ["0 s", "1 min 00 s", "44 min", "2 h 05 min"]);
    }

    #[test]
    fn rates_have_a_unit() {
        assert_eq!(
            [12.0, 12_345.0, 12_345_678.0].map(samples_per_s),
            ["12 samples/s", "12.3 ksamples/s", "12.3 Msamples/s"]
        );
        assert_eq!([0.5, 8.214, 82.14].map(mrays_per_s), ["0.50 Mray/s", "8.21 Mray/s", "82 Mray/s"]);
    }

    #[test]
    fn names_cannot_move_the_cursor() {
        assert_eq!(printable("a\n\u{1b}[2Jb"), "a??[2Jb");
    }
}
