//! `prt-batch compare A... REF`

use crate::args::CompareArgs;
use std::process::ExitCode;

pub fn run(_args: &CompareArgs) -> ExitCode {
    ExitCode::from(2)
}
