//! Options of `prt-batch compare`.

use crate::parse;
use clap::{Args, ValueHint};
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct CompareArgs {
    /// Pictures and, last, the reference: EXR files, or folders of them with the same names
    ///
    /// Several pictures are renders of one scene with different seeds: their scatter is used for a block-wise test of
    /// equality.
    #[arg(value_name = "A... REF", required = true, num_args = 2.., value_hint = ValueHint::AnyPath)]
    pub pictures: Vec<PathBuf>,
    /// Fail above this relMSE [default: no limit]
    #[arg(long, value_name = "X", value_parser = parse::limit)]
    pub max_relmse: Option<f64>,
    /// Fail where a channel's mean differs by more than this many per cent [default: no limit]
    #[arg(long, value_name = "PERCENT", value_parser = parse::limit)]
    pub max_bias: Option<f64>,
    /// The reference's own relative standard error per pixel, such as 0.02 [default: 0]
    ///
    /// For the block test: rms over pixels of standard error over the square root of relMSE's denominator.
    #[arg(long, value_name = "X", value_parser = parse::limit)]
    pub ref_rel_se: Option<f64>,
    /// The same from the field rel_se of object KEY in a JSON file
    #[arg(long, value_name = "FILE:KEY", conflicts_with = "ref_rel_se", value_hint = ValueHint::FilePath)]
    pub ref_stats: Option<String>,
    /// Print the result as JSON on stdout
    ///
    /// Its fields are below.
    #[arg(long)]
    pub json: bool,
}
