//! Options of `prt-batch bench`.

use super::EXAMPLES_OF_BENCH_RAYS;
use crate::parse::{self, BenchBackend};
use clap::{Args, Subcommand, ValueHint};
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Ray backends against each other: the same rays of your scenes, by CPU time.
    #[command(after_long_help = EXAMPLES_OF_BENCH_RAYS)]
    Rays(BenchRaysArgs),
}

#[derive(Args, Debug)]
pub struct BenchRaysArgs {
    /// .gltf, .glb and .obj files; a folder means every such file below it
    ///
    /// Rays are those of the first camera of the default scene, or of one framed on the bounds.
    #[arg(value_name = "INPUT", required = true, value_hint = ValueHint::AnyPath)]
    pub inputs: Vec<PathBuf>,
    /// Backends, separated by commas [default: bvh,embree]
    ///
    /// Without Embree on this machine the default is bvh alone. linear is brute force, on fewer rays and one thread.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = parse::bench_backend())]
    pub accel: Vec<BenchBackend>,
    /// Rays of each kind, rounded up to batches of 2048
    ///
    /// From 1 to 2^26. Fewer than 100000 do not fill the caches as a picture does.
    #[arg(long, value_name = "N", default_value = "262144", value_parser = parse::bench_rays)]
    pub rays: usize,
    /// Rounds, of which the median counts
    ///
    /// In each of them every backend traces all rays, in turn. From 1 to 1000.
    #[arg(long, value_name = "N", default_value = "9", value_parser = parse::bench_rounds)]
    pub rounds: usize,
    /// Seed of everything random
    #[arg(long, value_name = "N", default_value = "0", value_parser = parse::seed)]
    pub seed: u64,
    /// Measure with 1 thread and with this many [default: the cores this process may use]
    ///
    /// From 1 to 4096.
    #[arg(short, long, value_name = "N", value_parser = parse::threads)]
    pub threads: Option<usize>,
    /// Print the result as JSON on stdout
    ///
    /// Its fields are below.
    #[arg(long)]
    pub json: bool,
}
