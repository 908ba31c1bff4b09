//! The command line as typed: the one definition that parses it and its config files, and from which help, completions,
//! the man page and the tables of `docs/cli.md` are made.
//!
//! Of an option's doc comment the first paragraph is the line of `-h`, all of it the meaning in `--help` and the
//! tables. A default that clap does not know stands at the end of the first paragraph as `[default: ...]`.

mod bench;
mod compare;
mod doctor;
mod file;
mod retone;
mod run;
mod verify;

pub use bench::{BenchCommand, BenchRaysArgs};
pub use compare::CompareArgs;
pub use doctor::DoctorArgs;
pub use file::FileArgs;
pub use retone::RetoneArgs;
pub use run::RunArgs;
pub use verify::{VerifyArgs, What};

use crate::generate::Product;
use crate::parse;
use clap::{Args, Parser, Subcommand, ValueHint};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  prt-batch scenes/*.gltf --out renders/       every scene to EXR, PNG and JSON
  prt-batch scenes/ -o renders -s 256          every scene below a folder, 256 samples per pixel
  prt-batch a.glb --size 320x180 --spp 16      a quick look
  prt-batch a.glb --camera Main --crop 100,50,64,64
  prt-batch models/ --camera-from studio.gltf  every file as the cameras of another see it
  prt-batch a.glb --eye 3,2,5 --look-at 0,1,0  from a place of your own
  prt-batch scenes/ --target-error 0.01        every picture until its error is 1 % (--time-limit 10m, at most)
  prt-batch --config night.toml                a batch from a file: inputs, options, options of single files
  prt-batch scenes/*.gltf --json > result.json
  prt-batch compare renders/a.exr reference/a.exr --max-relmse 1e-3
  prt-batch retone renders/ --tonemap agx --exposure auto
  prt-batch --generate complete-bash > ~/.local/share/bash-completion/completions/prt-batch

Exit codes: 0 all rendered or empty; 1 some images failed; 2 usage; 3 every input was bad;
4 outputs cannot be written; 75 interrupted, run again to go on.";

const EXAMPLES_OF_COMPARE: &str = "\
Examples:
  prt-batch compare renders/a.exr reference/a.exr --max-relmse 1e-3
  prt-batch compare renders/ reference/ --max-bias 0.5
  prt-batch compare seed1.exr seed2.exr seed3.exr seed4.exr reference.exr

Exit codes: 0 within limits; 1 not; 2 usage; 3 unreadable or of different size.";

const EXAMPLES_OF_RETONE: &str = "\
Examples:
  prt-batch retone renders/ --tonemap agx --exposure auto
  prt-batch retone renders/a.exr --exposure 1.5 --out brighter/

Exit codes: 0 all done; 1 some failed; 2 usage; 3 none could be read; 4 a PNG could not be written.";

const EXAMPLES_OF_BENCH_RAYS: &str = "\
Examples:
  prt-batch bench rays scenes/*.gltf
  prt-batch bench rays big.glb --threads 1 --rays 1000000 --json > rays.json
  prt-batch bench rays small.glb --accel bvh,linear

Exit codes: 0 all scenes measured; 1 some; 2 usage; 3 none.";

const EXAMPLES_OF_VERIFY: &str = "\
Examples:
  prt-batch verify hits                        every ray backend at the built-in meshes
  prt-batch verify hits scenes/ --rays 100000  at scenes of your own
  prt-batch verify hits --accel bvh,embree --seed 7 --json > hits.json

Exit codes: 0 within limits; 1 not; 2 usage; 3 an input or a backend that was asked for is not to be had.";

/// Path-traces glTF scenes on the CPU, in batches, to linear HDR EXR and tone-mapped PNG.
#[derive(Debug, Parser)]
#[command(version, about, after_long_help = EXAMPLES, args_conflicts_with_subcommands = true, max_term_width = 110)]
#[command(after_help = "--help says more about each option, with examples and exit codes.")]
#[command(override_usage = "prt-batch [OPTIONS] INPUT...\n       prt-batch compare [OPTIONS] A... REF\n       \
                      prt-batch retone [OPTIONS] IN...\n       prt-batch verify [OPTIONS] [hits] [INPUT...]")]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub render: RenderArgs,
    /// Print the man page, shell completions or the tables of docs/cli.md
    #[arg(long, value_name = "WHAT", exclusive = true, value_parser = parse::generate())]
    pub generate: Option<Product>,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render (the same as without a command).
    #[command(after_long_help = EXAMPLES)]
    Render(Box<RenderArgs>),
    /// Error metrics of pictures against a reference, of files or of folders.
    #[command(after_long_help = EXAMPLES_OF_COMPARE)]
    Compare(CompareArgs),
    /// Tone-map stored EXRs again, no rendering.
    #[command(after_long_help = EXAMPLES_OF_RETONE)]
    Retone(RetoneArgs),
    /// Measurements on your own scenes and machine.
    #[command(subcommand_required = true)]
    Bench {
        #[command(subcommand)]
        what: BenchCommand,
    },
    /// Self-tests: do the ray backends hit what they must, decided in f64?
    #[command(after_long_help = EXAMPLES_OF_VERIFY)]
    Verify(VerifyArgs),
    /// What was found on this machine: processors, memory, Embree; and whether the ray backends work.
    Doctor(DoctorArgs),
}

#[derive(Args, Debug)]
pub struct RenderArgs {
    /// .gltf, .glb and .obj files; a folder means every such file below it
    ///
    /// The sub-folders of a folder are kept under --out. A name that is no file and has *, ? or [ in it is a pattern,
    /// for shells that leave patterns alone: it means the .gltf, .glb and .obj files that it matches, with ** for any
    /// folders between.
    #[arg(value_name = "INPUT", value_hint = ValueHint::AnyPath)]
    pub inputs: Vec<PathBuf>,
    #[command(flatten)]
    pub file: FileArgs,
    #[command(flatten)]
    pub run: RunArgs,
}
