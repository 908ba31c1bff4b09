//! Writes the albedo tables of `src/material/energy/tables.bin` anew: `cargo run --release --example energy_tables`. Half a
//! minute on two cores.

use prt::material::energy::tables;
use std::path::Path;

/// Normals along either side of the square that each value is integrated with.
const POINTS: usize = 256;

fn main() -> std::io::Result<()> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/material/energy/tables.bin");
    let bytes = tables::make(POINTS);
    println!("{} bytes to {}", bytes.len(), file.display());
    std::fs::write(file, bytes)
}
