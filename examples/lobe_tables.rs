//! Writes `src/material/lobes/tables.bin`: the albedos of the coat and of sheen.
//!
//! `cargo run --release --example lobe_tables [FILE]`; about ten seconds.

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let default = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("src/material/lobes/tables.bin");
    let file = std::env::args_os().nth(1).map_or_else(default, PathBuf::from);
    let values = prt::material::lobes::quadrature::tables();
    std::fs::write(&file, values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())?;
    println!("{}: {} values", file.display(), values.len());
    Ok(())
}
