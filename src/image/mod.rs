//! Pictures in files.

pub mod decode;
