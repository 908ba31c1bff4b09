//! Options of `prt-batch retone`.

use crate::parse;
use clap::{Args, ValueHint};
use prt::color::{Exposure, ToneCurve};
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct RetoneArgs {
    /// EXR files; a folder means every .exr below it, its sub-folders kept under --out
    #[arg(value_name = "IN", required = true, value_hint = ValueHint::AnyPath)]
    pub inputs: Vec<PathBuf>,
    /// Where the PNGs go [default: beside each EXR]
    #[arg(short, long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: Option<PathBuf>,
    /// Exposure in stops, or auto
    #[arg(long, value_name = "EV", default_value = "0", value_parser = parse::exposure, allow_hyphen_values = true)]
    pub exposure: Exposure,
    /// Tone curve
    #[arg(long, value_name = "CURVE", default_value = "neutral", value_parser = parse::tonemap())]
    pub tonemap: ToneCurve,
    /// Say only what went wrong
    #[arg(short, long)]
    pub quiet: bool,
}
