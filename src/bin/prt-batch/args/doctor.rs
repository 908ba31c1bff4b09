//! Options of `prt-batch doctor`.

use clap::Args;

#[derive(Args, Debug)]
pub struct DoctorArgs {
    /// Print the result as JSON on stdout
    #[arg(long)]
    pub json: bool,
}
