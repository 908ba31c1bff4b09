//! Options that hold for the whole run; a config file has them above its first `[[file]]`.

use crate::parse::{self, ProgressStyle};
use clap::{Args, ValueHint};
use prt::batch::memory::MemoryLimit;
use std::path::PathBuf;
use std::time::Duration;

const RUN: &str = "Run";
const TERMINAL: &str = "Terminal";

#[derive(Args, Debug)]
pub struct RunArgs {
    /// Where files go
    ///
    /// The folder is made if it is not there. In a config file it is relative to that file's folder.
    #[arg(short, long, value_name = "DIR", default_value = "renders")]
    #[arg(help_heading = RUN, value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// Options and inputs from a file; the command line wins
    ///
    /// Any option of render by its long name, inputs = ["..."], and options of single files by pattern in [[file]]
    /// blocks. See "Config files" in docs/cli.md.
    #[arg(long, value_name = "FILE.toml", help_heading = RUN, value_hint = ValueHint::FilePath)]
    pub config: Option<PathBuf>,
    /// Time for all images together, such as 8h [default: off]
    ///
    /// From the start of the run. Each image may use an equal share of what is left for those that are left; one that
    /// needs less leaves the rest to the others. Every image gets one sample per pixel at least. See "When sampling
    /// ends" below.
    #[arg(long, value_name = "TIME", value_parser = parse::duration, allow_hyphen_values = true, help_heading = RUN)]
    pub batch_time_limit: Option<Duration>,
    /// Worker threads; they do not change a byte of a picture [default: the cores this process may use]
    ///
    /// From 1 to 4096; more than the cores gives a warning.
    #[arg(short, long, value_name = "N", value_parser = parse::threads, help_heading = RUN)]
    pub threads: Option<usize>,
    /// Memory that may be used, such as 8GiB or 50%; what would need more is refused [default: 80%]
    ///
    /// Before it is allocated. KiB MiB GiB TiB, KB MB GB TB, in bytes, or a share of what this process may use (the
    /// machine's memory, less where a container limits it); see "Memory" below.
    #[arg(long, value_name = "AMOUNT", value_parser = parse::memory, allow_hyphen_values = true, help_heading = RUN)]
    pub memory: Option<MemoryLimit>,
    /// Print the plan of each image; render nothing
    ///
    /// With what is skipped and why, memory and time; with --json as JSON. See "The plan" below.
    #[arg(long, help_heading = RUN)]
    pub explain: bool,
    /// Render even what is up to date
    ///
    /// Up-to-date outputs are kept and reported so; what is up to date is said in docs/cli.md.
    #[arg(long, help_heading = RUN)]
    pub force: bool,
    /// Count as failures what is lost: content, non-finite samples, empty scenes, missed error targets
    ///
    /// Dropped non-finite samples, missed error targets, empty scenes and lost content give exit code 1.
    #[arg(long, help_heading = RUN)]
    pub strict: bool,
    /// Write no index.html, the contact sheet of the run
    ///
    /// JSON is always written.
    #[arg(long, help_heading = RUN)]
    pub no_report: bool,
    /// How far the run is, on stderr
    ///
    /// auto shows bars on a terminal, else plain lines; plain at most one line a second; json a line of JSON now and
    /// then.
    #[arg(long, value_name = "STYLE", default_value = "auto", value_parser = parse::progress())]
    #[arg(help_heading = TERMINAL)]
    pub progress: ProgressStyle,
    /// Print the run's batch.json on stdout
    ///
    /// Everything else goes to stderr.
    #[arg(long, help_heading = TERMINAL)]
    pub json: bool,
    /// Say more, about every image
    #[arg(short, long, help_heading = TERMINAL)]
    pub verbose: bool,
    /// Say only what went wrong
    #[arg(short, long, conflicts_with = "verbose", help_heading = TERMINAL)]
    pub quiet: bool,
}
