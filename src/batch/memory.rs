//! The memory budget: `--memory`, what it is by default, and the refusal of what would not fit in it.

use super::host;
use super::settings::FileSettings;
use super::size::PictureSize;
use crate::load::{self, LoadEstimate};
use crate::render::RenderSettings;
use crate::render::memory::{Encoded, MemoryEstimate, estimate, of_picture};
use crate::scene::Scene;
use std::path::Path;
use std::str::FromStr;

/// Share of the memory that this process may use which is the budget by default.
pub const DEFAULT_SHARE: f64 = 0.8;

/// A limit as the user gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MemoryLimit {
    /// So many bytes.
    Bytes(u64),
    /// A share of all memory that this process may use, in (0, 1].
    Share(f64),
}

/// Units of amounts, upper case.
const UNITS: [(&str, u64); 9] = [
    ("KIB", 1 << 10),
    ("MIB", 1 << 20),
    ("GIB", 1 << 30),
    ("TIB", 1 << 40),
    ("KB", 1_000),
    ("MB", 1_000_000),
    ("GB", 1_000_000_000),
    ("TB", 1_000_000_000_000),
    ("B", 1),
];

impl FromStr for MemoryLimit {
    type Err = String;

    /// `8GiB`, `1.5 TB`, `500000000`, `50%`; upper and lower case alike.
    fn from_str(text: &str) -> Result<Self, String> {
        const ALLOWED: &str = "must be an amount above 0 such as 8GiB, 512MiB, 16GB or a number of bytes \
                               (units: KiB MiB GiB TiB, KB MB GB TB), or a share of all memory from 1% to 100%";
        let positive = |text: &str| text.trim().parse::<f64>().ok().filter(|n| *n > 0.0 && n.is_finite());
        if let Some(percent) = text.strip_suffix('%') {
            let share = positive(percent).filter(|p| (1.0..=100.0).contains(p)).ok_or(ALLOWED)?;
            return Ok(Self::Share(share / 100.0));
        }
        let upper = text.to_ascii_uppercase();
        let unit = UNITS.iter().find_map(|(unit, bytes)| Some((upper.strip_suffix(unit)?, *bytes)));
        let (number, unit) = unit.unwrap_or((&upper, 1));
        let bytes = positive(number).map(|n| n * unit as f64).filter(|bytes| *bytes >= 1.0 && *bytes < 1e18);
        Ok(Self::Bytes(bytes.ok_or(ALLOWED)? as u64))
    }
}

/// How much memory may be used, and who said so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MemoryBudget {
    /// Bytes; `u64::MAX` where neither the user nor the system sets a limit.
    pub bytes: u64,
    /// The user set it.
    pub is_typed: bool,
    /// Bytes that this process may use; `None` where the system does not tell.
    pub total: Option<u64>,
}

impl MemoryBudget {
    /// The budget of a run: `limit`, else [`DEFAULT_SHARE`] of what this process may use.
    pub fn new(limit: Option<MemoryLimit>) -> Self {
        Self::of(limit, host::memory_total())
    }

    fn of(limit: Option<MemoryLimit>, total: Option<u64>) -> Self {
        let share = |share: f64| total.map_or(u64::MAX, |total| (total as f64 * share) as u64);
        let bytes = match limit {
            Some(MemoryLimit::Bytes(bytes)) => bytes,
            Some(MemoryLimit::Share(s)) => share(s),
            None => share(DEFAULT_SHARE),
        };
        Self { bytes, is_typed: limit.is_some(), total }
    }

    /// Whether `need` fits; `pixels` is the width and height of what is rendered, for the advice.
    ///
    /// # Errors
    /// It does not: a text that says how much of what, what is allowed, and what would help. The caller puts the input in
    /// front.
    pub fn check(&self, need: &MemoryEstimate, pixels: Option<(u32, u32)>) -> Result<(), String> {
        let peak = need.peak();
        if peak <= self.bytes {
            return Ok(());
        }
        let mut parts: Vec<(&str, u64)> = need.at_peak().into_iter().filter(|(_, b)| *b >= peak / 100).collect();
        parts.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
        let parts: Vec<_> = parts.iter().map(|(name, bytes)| format!("{name} {}", amount(*bytes))).collect();
        let (needs, allowed) = (amount(peak), amount(self.bytes));
        let limit = match self.total {
            Some(total) if !self.is_typed => {
                format!("the default of --memory, {allowed} ({:.0} % of {})", 100.0 * DEFAULT_SHARE, amount(total))
            }
            _ => format!("--memory {allowed}"),
        };
        let picture = need.film.max(need.files);
        let fix = match pixels {
            Some((width, height)) if picture >= peak / 2 => format!(
                "Most of it is the picture of {width} x {height} pixels: render it in parts with --crop X,Y,W,H, or \
                 smaller with --size."
            ),
            _ => {
                let total =
                    self.total.map_or_else(String::new, |total| format!(" (this process may use {})", amount(total)));
                format!("Allow more with --memory{total}, or make the scene or its pictures smaller.")
            }
        };
        Err(format!("would take about {needs} of memory ({}), more than {limit}\n  {fix}", parts.join(", ")))
    }
}

impl MemoryBudget {
    /// Whether the pictures that `settings` ask for fit whatever is in them, as far as their size is known without a
    /// camera.
    ///
    /// # Errors
    /// See [`MemoryBudget::check`]; the text names the option.
    pub(super) fn check_picture(&self, settings: &FileSettings) -> Result<(), String> {
        let PictureSize::Exact(width, height) = settings.size else { return Ok(()) };
        let render = RenderSettings { width, height, ..settings.render.clone() };
        let window = crate::render::window(&render);
        self.check(&of_picture(&render, encoded(settings)), Some((window.width, window.height)))
            .map_err(|why| format!("--size {width}x{height} {why}"))
    }

    /// What reading `path` takes, if that fits.
    ///
    /// # Errors
    /// See [`MemoryBudget::check`]; the text names the file.
    pub(super) fn check_loading(&self, path: &Path, settings: &FileSettings) -> Result<LoadEstimate, String> {
        let mut reading = load::estimate(path, &settings.load).unwrap_or_default();
        if settings.frames.is_some() {
            // From the first frame to the last.
            reading.bytes = reading.bytes.saturating_add(reading.unmoved);
            reading.left_over = reading.left_over.saturating_add(reading.unmoved);
        }
        let program = of_picture(&settings.render, encoded(settings)).program;
        let need = MemoryEstimate { program, loading: reading.bytes, ..MemoryEstimate::default() };
        self.check(&need, None).map_err(|why| format!("{}: {why}", path.display()))?;
        Ok(reading)
    }
}

/// What an image of `scene`, which took `reading` to read, takes; `render` has its size.
pub(super) fn need(
    scene: &Scene,
    reading: LoadEstimate,
    render: &RenderSettings,
    settings: &FileSettings,
) -> MemoryEstimate {
    let all = estimate(scene, render, encoded(settings));
    MemoryEstimate { loading: reading.bytes, left_over: reading.left_over, ..all }
}

fn encoded(settings: &FileSettings) -> Encoded {
    Encoded { exr: settings.files.exr, png: settings.files.png }
}

/// Bytes for people: `75.2 GiB`, `12 MiB`, `3 KiB`.
pub fn amount(bytes: u64) -> String {
    let bytes = bytes as f64;
    let of = |power: i32| bytes / 1024_f64.powi(power);
    match () {
        () if of(4) >= 1000.0 => format!("{:.0} TiB", of(4)),
        () if of(3) >= 1000.0 => format!("{:.1} TiB", of(4)),
        () if of(2) >= 1000.0 => format!("{:.1} GiB", of(3)),
        () if of(1) >= 10_000.0 => format!("{:.0} MiB", of(2)),
        () if of(1) >= 1000.0 => format!("{:.1} MiB", of(2)),
        () => format!("{:.0} KiB", of(1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_have_binary_and_decimal_units_and_shares() {
        use MemoryLimit::{Bytes, Share};
        for (text, expected) in [
            ("8GiB", Bytes(8 << 30)),
            ("8gib", Bytes(8 << 30)),
            ("1.5 MiB", Bytes(3 << 19)),
            ("2TiB", Bytes(2 << 40)),
            ("16GB", Bytes(16_000_000_000)),
            ("1kb", Bytes(1000)),
            ("64KiB", Bytes(1 << 16)),
            ("3MB", Bytes(3_000_000)),
            ("1TB", Bytes(1_000_000_000_000)),
            ("500000000", Bytes(500_000_000)),
            ("7B", Bytes(7)),
            ("50%", Share(0.5)),
            ("100%", Share(1.0)),
        ] {
            assert_eq!(text.parse(), Ok(expected), "{text}");
        }
        for text in
            ["", "8", "GiB", "-1GiB", "0", "0GiB", "0.1B", "8Gi", "8G", "1e30TB", "nan", "inf", "0%", "101%", "%"]
        {
            let parsed = text.parse::<MemoryLimit>();
            // A bare number is bytes, however few.
            assert_eq!(parsed.is_ok(), text == "8", "{text}: {parsed:?}");
            if let Err(why) = parsed {
                assert!(why.contains("8GiB") && why.contains("from 1% to 100%"), "{why}");
            }
        }
    }

    #[test]
    fn the_default_is_a_share_of_what_this_process_may_use() {
        assert_eq!(MemoryBudget::of(None, Some(10 << 30)).bytes, 8 << 30);
        assert_eq!(MemoryBudget::of(Some(MemoryLimit::Share(0.5)), Some(10 << 30)).bytes, 5 << 30);
        assert_eq!(MemoryBudget::of(Some(MemoryLimit::Bytes(7)), None).bytes, 7);
        assert_eq!(MemoryBudget::of(None, None).bytes, u64::MAX);
    }

    #[test]
    fn a_picture_that_does_not_fit_is_refused_with_its_parts_the_limit_and_a_remedy() {
        let budget = MemoryBudget::of(None, Some(24 << 30));
        let files = Encoded { exr: true, png: true };
        for (width, height) in [(40_000, 25_000), (65_536, 65_536)] {
            let settings = RenderSettings { width, height, threads: Some(2), ..RenderSettings::default() };
            let why = budget.check(&of_picture(&settings, files), Some((width, height))).unwrap_err();
            for part in ["(film ", "--memory, 19.2 GiB (80 % of 24.0 GiB)", "--crop X,Y,W,H", "--size"] {
                assert!(why.contains(part), "{why}");
            }
            assert!(why.contains(&format!("{width} x {height}")), "{why}");
        }
        let small = RenderSettings { threads: Some(2), ..RenderSettings::default() };
        assert_eq!(budget.check(&of_picture(&small, files), None), Ok(()));
        let scene = MemoryEstimate { scene: 30 << 30, ..of_picture(&small, files) };
        let why = MemoryBudget { is_typed: true, ..budget }.check(&scene, Some((1280, 720))).unwrap_err();
        assert!(why.contains("(scene 30.0 GiB)") && why.contains("more than --memory 19.2 GiB"), "{why}");
        assert!(why.contains("Allow more with --memory (this process may use 24.0 GiB)"), "{why}");
    }

    #[test]
    fn amounts_are_written_short() {
        for (bytes, text) in [(0, "0 KiB"), (3 << 10, "3 KiB"), (5 << 20, "5.0 MiB"), (300 << 20, "300 MiB")] {
            assert_eq!(amount(bytes), text);
        }
        for (bytes, text) in
            [(1 << 30, "1.0 GiB"), (77_u64 << 30, "77.0 GiB"), (2 << 40, "2.0 TiB"), (u64::MAX, "16777216 TiB")]
        {
            assert_eq!(amount(bytes), text);
        }
    }
}
