//! prt-batch.
fn main() {}
