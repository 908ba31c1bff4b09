//! Writes the albedo tables of `src/material/energy/tables.bin` anew: `cargo run --release --example energy_tables`. Half a
//! minute on two cores. With `-- --check` it writes nothing and fails if the stored ones are others, to the bit.

use prt::material::energy::tables;
use std::path::Path;
use std::process::ExitCode;

/// Normals along either side of the square that each value is integrated with.
const POINTS: usize = 256;

fn main() -> std::io::Result<ExitCode> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/material/energy/tables.bin");
    let is_check = std::env::args().nth(1).is_some_and(|a| a == "--check");
    let bytes = tables::make(POINTS);
    if !is_check {
        println!("{} bytes to {}", bytes.len(), file.display());
        std::fs::write(file, bytes)?;
        return Ok(ExitCode::SUCCESS);
    }
    let stored = std::fs::read(&file)?;
    let others = stored.chunks(2).zip(bytes.chunks(2)).filter(|(a, b)| a != b).count();
    println!("{others} of {} values are others than those of {}", bytes.len() / 2, file.display());
    Ok(if others == 0 && stored.len() == bytes.len() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
